//! What a body says of its displacements once they are found: each rank of its part.

use super::approach::Outer;
use super::balance::{Balance, Forces};
use super::fields::{self, ErrorMaker, FieldMaker};
use crate::error::Result;
use crate::output::vtu::BodyField;
use crate::problem::body::BodySpec;

/// Displacements of a body -> fields, forces, errors of a part of it.
pub struct Post {
    field: FieldMaker,
    nodal: NodalMaker,
    balance: BalanceMaker,
    errors: Option<ErrorMaker>,
    outer: OuterMaker,
}

/// State of all dofs -> displacements of the nodes of the part.
type NodalMaker = Box<dyn Fn(&[f64]) -> Vec<f64>>;

/// Displacements of the nodes of the part, forces omega p at the contact rows -> forces on its own nodes.
type BalanceMaker = Box<dyn Fn(&[f64], &[f64]) -> Balance>;

/// State of all dofs, a direction -> mean displacement of the body.
type OuterMaker = Box<dyn Fn(&[f64], [f64; 3]) -> [f64; 3]>;

impl Post {
    /// Of a part of a body.
    ///
    /// # Errors
    /// A known displacement that is not finite at a node.
    pub fn new<const D: usize>(spec: &BodySpec, outer: Outer, forces: Forces<D>) -> Result<Self> {
        let Forces { part, elasticity, held, .. } = &forces;
        let (part, elasticity, held, frame) = (part.clone(), elasticity.clone(), held.clone(), held.clone());
        Ok(Self {
            errors: fields::error_maker(spec, &part, &elasticity)?,
            outer: Box::new(move |v, direction| outer.mean::<D>(&frame.frame.displacements(v), direction)),
            field: fields::field_maker(spec.name.value.clone(), part.clone(), elasticity),
            nodal: Box::new(move |v| part.values(&held.frame.displacements(v))),
            balance: Box::new(move |u, force| forces.balance(u, force)),
        })
    }

    /// Displacements and stresses of the cells that this rank shows, from a state of all dofs. `bent` is the same without the rigid motion
    /// that supports leave: beside a large one the digits of the deformation are few.
    pub fn field(&self, v: &[f64], bent: &[f64]) -> BodyField {
        (self.field)(&(self.nodal)(v), &(self.nodal)(bent))
    }

    /// Forces on the own nodes in a state of all dofs, under the forces omega p of the contact rows of the body.
    pub fn balance(&self, v: &[f64], force: &[f64]) -> Balance {
        (self.balance)(&(self.nodal)(v), force)
    }

    /// Mean displacement of where the body is loaded along a direction, else of where it is held along it, else of all of it; from a
    /// state of all dofs.
    pub fn outer(&self, v: &[f64], direction: [f64; 3]) -> [f64; 3] {
        (self.outer)(v, direction)
    }

    /// Norms of the error against the scene's known displacements, and of these, on the cells that this rank shows, if the scene has them: L2
    /// norm, H1 seminorm, energy norm ([`norms::error`](crate::fem::norms::error)); from a state of all dofs.
    pub fn errors(&self, v: &[f64]) -> Option<[[f64; 3]; 2]> {
        self.errors.as_ref().map(|errors| errors(&(self.nodal)(v)))
    }
}
