//! Evaluation of the displacements of a body: fields for output, forces, errors against a known solution. Each rank evaluates its
//! part.

use super::approach::Outer;
use super::balance::{Balance, Forces};
use super::find::point;
use super::unbalanced::Unbalanced;
use crate::contact::pad;
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::fem::displacement::{self, Strained};
use crate::output::{BodyField, CellKind};
use crate::problem::BodySpec;

/// A part of a body that is evaluated for states of the dofs of its nodes, without the space dimension.
pub trait Post {
    /// Return displacements and stresses of the cells that this rank writes. `bent` is the state without the rigid motion that
    /// supports leave. Stresses come from `bent`, since a large rigid motion leaves few digits to the deformation.
    fn field(&self, v: &[f64], bent: &[f64]) -> BodyField;

    /// Return the largest strain in the cells that this rank writes. `bent` is as in [`Post::field`].
    fn strain(&self, bent: &[f64]) -> Strained;

    /// Return the forces on the owned nodes under the forces omega p of the contact rows of the body.
    fn balance(&self, v: &[f64], force: &[f64]) -> Balance;

    /// Return the unbalanced forces on the owned nodes under the forces omega p of the contact rows. `bent` is as in
    /// [`Post::field`]. `springs` are the stiffnesses omega kappa of these rows.
    fn unbalanced(&self, bent: &[f64], force: &[f64], springs: &[f64]) -> Unbalanced;

    /// See `Forces::rough`.
    fn rough(&self, unbalanced: &Unbalanced) -> Vec<f64>;

    /// See `Forces::on_hats`.
    fn on_hats(&self, unbalanced: &Unbalanced) -> Vec<f64>;

    /// See `Forces::smooth`.
    fn smooth(&self, sums: &[f64], with_springs: bool) -> Vec<f64>;

    /// See `Forces::products`.
    fn products(&self, fields: &[Vec<f64>]) -> Vec<f64>;

    /// See `Forces::trace`.
    fn trace(&self, field: &[f64]) -> Vec<f64>;

    /// Return the contribution of the owned nodes to the mean displacement (x, y, z) of the outer part of the body. The outer
    /// part is where the body is loaded along `direction`, else where it is constrained along it, else the whole body.
    fn outer(&self, v: &[f64], direction: [f64; 3]) -> [f64; 3];

    /// Return the norms of the error against the known displacements of the scene, and the norms of these displacements. They are
    /// the L2 norm, the H1 seminorm and the energy norm ([`displacement::norms_of_error`]) on the cells that this rank writes. The result is
    /// `None` if the scene has no known displacements.
    fn errors(&self, v: &[f64]) -> Option<[[f64; 3]; 2]>;
}

/// The implementation of [`Post`] in `D` dimensions.
pub struct OnPart<const D: usize> {
    name: String,
    /// Known displacements, if the scene has them.
    exact: Option<Vec<Expression>>,
    outer: Outer,
    forces: Forces<D>,
}

impl<const D: usize> OnPart<D> {
    /// Make the evaluation of a part of a body.
    ///
    /// # Errors
    /// A known displacement is not finite at a node.
    pub fn new(spec: &BodySpec, outer: Outer, forces: Forces<D>) -> Result<Self> {
        let space = &forces.part.space;
        let places = || space.nodes.iter().map(|&x| space.in_scene(x));
        for (component, x) in spec.exact.iter().flatten().flat_map(|u| places().map(move |x| (u, x))) {
            let value = component.eval(&x[..D]);
            if !value.is_finite() {
                let message = format!("the known displacement is {value} at {}", point(x));
                return Err(Error::scene(component.place(), message)
                    .help("look for roots of negative numbers and divisions by zero in the expression"));
            }
        }
        Ok(Self { name: spec.name.value.clone(), exact: spec.exact.clone(), outer, forces })
    }

    /// Return the displacements of the nodes of the part.
    fn nodal(&self, v: &[f64]) -> Vec<f64> {
        self.forces.held.frame.displacements(v)
    }
}

impl<const D: usize> Post for OnPart<D> {
    fn field(&self, v: &[f64], bent: &[f64]) -> BodyField {
        let Forces { part, elasticity, .. } = &self.forces;
        let (u, space) = (self.nodal(v), &part.space);
        let (owned, shown) = space.part(part.owned());
        let stress = displacement::nodal_stresses(space, elasticity, &self.nodal(bent));
        let stress: Vec<[f64; 6]> = shown.iter().map(|&node| stress[node as usize]).collect();
        let displacement = |&node: &u32| pad(std::array::from_fn::<f64, D, _>(|c| u[D * node as usize + c]));
        BodyField {
            name: self.name.clone(),
            points: owned.nodes.iter().map(|&x| owned.in_scene(x)).collect(),
            cell: CellKind::simplex(D, space.order.degree()),
            connectivity: owned.cells,
            displacement: shown.iter().map(displacement).collect(),
            von_mises: stress.iter().map(displacement::von_mises).collect(),
            principal: stress.iter().map(displacement::principal).collect(),
            stress,
        }
    }

    fn strain(&self, bent: &[f64]) -> Strained {
        let part = &self.forces.part;
        displacement::largest_strain(&part.space, part.owned(), &self.nodal(bent))
    }

    fn balance(&self, v: &[f64], force: &[f64]) -> Balance {
        self.forces.balance(&self.nodal(v), force)
    }

    fn unbalanced(&self, bent: &[f64], force: &[f64], springs: &[f64]) -> Unbalanced {
        self.forces.unbalanced(&self.nodal(bent), force, springs)
    }

    fn rough(&self, unbalanced: &Unbalanced) -> Vec<f64> {
        self.forces.rough(unbalanced)
    }

    fn on_hats(&self, unbalanced: &Unbalanced) -> Vec<f64> {
        self.forces.on_hats(unbalanced)
    }

    fn smooth(&self, sums: &[f64], with_springs: bool) -> Vec<f64> {
        self.forces.smooth(sums, with_springs)
    }

    fn products(&self, fields: &[Vec<f64>]) -> Vec<f64> {
        self.forces.products(fields)
    }

    fn trace(&self, field: &[f64]) -> Vec<f64> {
        self.forces.trace(field)
    }

    fn outer(&self, v: &[f64], direction: [f64; 3]) -> [f64; 3] {
        self.outer.mean::<D>(&self.nodal(v), &self.forces.part.own, direction)
    }

    fn errors(&self, v: &[f64]) -> Option<[[f64; 3]; 2]> {
        let (exact, Forces { part, elasticity, .. }) = (self.exact.as_ref()?, &self.forces);
        let at = |x: [f64; D]| {
            let x = &part.space.in_scene(x)[..D];
            displacement::Exact {
                value: std::array::from_fn(|i| exact[i].eval(x)),
                gradient: std::array::from_fn(|i| std::array::from_fn(|j| exact[i].eval_by(j, x).1)),
            }
        };
        let norms = displacement::norms_of_error(&part.space, part.owned(), elasticity, &self.nodal(v), &at);
        Some(norms.map(|norms| [norms.l2, norms.h1, norms.energy]))
    }
}
