//! What the displacements of a body say: fields for output, errors against a known answer.

use super::find::point;
use super::local::Local;
use crate::contact;
use crate::error::{Error, Result};
use crate::fem::{Elasticity, norms, stress};
use crate::output::vtu::{BodyField, CellKind};
use crate::problem::body::BodySpec;
use std::rc::Rc;

/// Displacements of the nodes of a part, and the same without a rigid motion -> fields for output.
pub type FieldMaker = Box<dyn Fn(&[f64], &[f64]) -> BodyField>;

/// Displacements of the nodes of a part -> norms of the error against the scene's known ones, and of these.
pub type ErrorMaker = Box<dyn Fn(&[f64]) -> [[f64; 3]; 2]>;

/// Displacements, and the stresses of the others, on the cells that a part [shows](Local::told).
pub fn field_maker<const D: usize>(name: String, part: Rc<Local<D>>, elasticity: Rc<Elasticity>) -> FieldMaker {
    Box::new(move |u, bent| {
        let space = &part.space;
        let (told, shown) = space.part(part.told());
        let stress = stress::nodal(space, &elasticity, bent);
        let stress: Vec<[f64; 6]> = shown.iter().map(|&node| stress[node as usize]).collect();
        BodyField {
            name: name.clone(),
            points: told.nodes.iter().map(|&x| contact::pad(x)).collect(),
            cell: CellKind::simplex(D, space.order.degree()),
            connectivity: told.cells,
            displacement: shown
                .iter()
                .map(|&node| contact::pad(std::array::from_fn::<f64, D, _>(|c| u[D * node as usize + c])))
                .collect(),
            von_mises: stress.iter().map(stress::von_mises).collect(),
            principal: stress.iter().map(stress::principal).collect(),
            stress,
        }
    })
}

/// Errors in L2, in the H1 seminorm and in energy, and the norms of `exact`, if the body has it.
///
/// # Errors
/// A known displacement that is not finite at a node.
pub fn error_maker<const D: usize>(
    spec: &BodySpec,
    part: &Rc<Local<D>>,
    elasticity: &Rc<Elasticity>,
) -> Result<Option<ErrorMaker>> {
    let Some(exact) = spec.exact.clone() else { return Ok(None) };
    for (component, &x) in exact.iter().flat_map(|u| part.space.nodes.iter().map(move |x| (u, x))) {
        let value = component.eval(&x);
        if !value.is_finite() {
            let message = format!("the known displacement is {value} at {}", point(contact::pad(x)));
            return Err(Error::scene(component.place(), message)
                .help("look for roots of negative numbers and divisions by zero in the expression"));
        }
    }
    let (part, elasticity) = (part.clone(), elasticity.clone());
    Ok(Some(Box::new(move |u| {
        let at = |x: [f64; D]| norms::Known {
            value: std::array::from_fn(|i| exact[i].eval(&x)),
            gradient: std::array::from_fn(|i| std::array::from_fn(|j| exact[i].eval_by(j, &x).1)),
        };
        norms::error(&part.space, part.told(), &elasticity, u, &at).map(|norms| [norms.l2, norms.h1, norms.energy])
    })))
}
