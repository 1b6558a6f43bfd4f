//! What a body says of its displacements once they are found, on the rank that speaks for it.

use super::approach::OuterMaker;
use super::balance::{Balance, Forces};
use super::fields::{self, ErrorMaker, FieldMaker};
use crate::error::Result;
use crate::output::vtu::BodyField;
use crate::problem::body::BodySpec;

/// Displacements of a body -> fields, forces, errors.
pub struct Post {
    field: FieldMaker,
    nodal: NodalMaker,
    balance: BalanceMaker,
    errors: Option<ErrorMaker>,
    outer: OuterMaker,
}

/// State of all dofs -> displacements of all nodes.
type NodalMaker = Box<dyn Fn(&[f64]) -> Vec<f64>>;

/// Displacements of all nodes, forces omega p at the contact rows -> forces on the body.
type BalanceMaker = Box<dyn Fn(&[f64], &[f64]) -> Balance>;

impl Post {
    /// Of a body with all its cells.
    ///
    /// # Errors
    /// A known displacement that is not finite at a node.
    pub fn new<const D: usize>(spec: &BodySpec, outer: OuterMaker, forces: Forces<D>) -> Result<Self> {
        let Forces { space, elasticity, held, .. } = &forces;
        let (space, elasticity, held) = (space.clone(), elasticity.clone(), held.clone());
        Ok(Self {
            errors: fields::error_maker(spec, &space, &elasticity)?,
            outer,
            nodal: Box::new(move |v| held.frame.displacements(v)),
            balance: Box::new(move |u, force| forces.balance(u, force)),
            field: fields::field_maker(spec.name.value.clone(), space, elasticity),
        })
    }

    /// Displacements and recovered stresses for output, from a state of all dofs. `bent` is the same without the rigid motion that
    /// supports leave: beside a large one the digits of the deformation are few.
    pub fn field(&self, v: &[f64], bent: &[f64]) -> BodyField {
        let mut field = (self.field)(&(self.nodal)(bent));
        let u = (self.nodal)(v);
        let dimension = u.len() / field.points.len().max(1);
        for (to, u) in field.displacement.iter_mut().zip(u.chunks_exact(dimension.max(1))) {
            to[..u.len()].copy_from_slice(u);
        }
        field
    }

    /// Forces on the body in a state of all dofs, under the forces omega p of its contact rows.
    pub fn balance(&self, v: &[f64], force: &[f64]) -> Balance {
        (self.balance)(&(self.nodal)(v), force)
    }

    /// Mean displacement of where the body is loaded along a direction, else of where it is held along it, else of all of it; from a
    /// state of all dofs.
    pub fn outer(&self, v: &[f64], direction: [f64; 3]) -> [f64; 3] {
        (self.outer)(&(self.nodal)(v), direction)
    }

    /// Errors against the scene's known displacements over the norms of these, if the scene has them: L2 norm, H1 seminorm,
    /// energy norm ([`norms::error`](crate::fem::norms::error)); from a state of all dofs.
    pub fn errors(&self, v: &[f64]) -> Option<[f64; 3]> {
        self.errors.as_ref().map(|errors| errors(&(self.nodal)(v)))
    }
}
