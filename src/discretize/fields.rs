//! What the displacements of a body say: fields for output, errors against a known answer.

use super::find::point;
use crate::contact;
use crate::error::{Error, Result};
use crate::fem::{Elasticity, Space, norms, stress};
use crate::output::vtu::{BodyField, CellKind};
use crate::problem::body::BodySpec;
use std::rc::Rc;

/// Displacements of all nodes -> fields for output.
pub type FieldMaker = Box<dyn Fn(&[f64]) -> BodyField>;

/// Displacements of all nodes -> relative errors against the scene's known ones.
pub type ErrorMaker = Box<dyn Fn(&[f64]) -> [f64; 3]>;

/// Displacements, and the stresses that belong to them.
pub fn field_maker<const D: usize>(name: String, space: Rc<Space<D>>, elasticity: Rc<Elasticity>) -> FieldMaker {
    Box::new(move |u| {
        let stress = stress::nodal(&space, &elasticity, u);
        BodyField {
            name: name.clone(),
            points: space.nodes.iter().map(|&x| contact::pad(x)).collect(),
            cell: CellKind::simplex(D, space.order.degree()),
            connectivity: space.cells.clone(),
            displacement: u
                .chunks_exact(D)
                .map(|u| std::array::from_fn(|c| u.get(c).copied().unwrap_or(0.0)))
                .collect(),
            von_mises: stress.iter().map(stress::von_mises).collect(),
            principal: stress.iter().map(stress::principal).collect(),
            stress,
        }
    })
}

/// Errors in L2, in the H1 seminorm and in energy over the norms of `exact`, if the body has it.
///
/// # Errors
/// A known displacement that is not finite at a node.
pub fn error_maker<const D: usize>(
    spec: &BodySpec,
    space: &Rc<Space<D>>,
    elasticity: &Rc<Elasticity>,
) -> Result<Option<ErrorMaker>> {
    let Some(exact) = spec.exact.clone() else { return Ok(None) };
    for (component, &x) in exact.iter().flat_map(|u| space.nodes.iter().map(move |x| (u, x))) {
        let value = component.eval(&x);
        if !value.is_finite() {
            let message = format!("the known displacement is {value} at {}", point(contact::pad(x)));
            return Err(Error::scene(component.place(), message)
                .help("look for roots of negative numbers and divisions by zero in the expression"));
        }
    }
    let (space, elasticity) = (space.clone(), elasticity.clone());
    Ok(Some(Box::new(move |u| {
        let at = |x: [f64; D]| norms::Known {
            value: std::array::from_fn(|i| exact[i].eval(&x)),
            gradient: std::array::from_fn(|i| std::array::from_fn(|j| exact[i].eval_by(j, &x).1)),
        };
        let [error, whole] = norms::error(&space, &elasticity, u, &at);
        [error.l2 / whole.l2, error.h1 / whole.h1, error.energy / whole.energy]
    })))
}
