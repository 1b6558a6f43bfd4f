//! Springs of a body to the ground. On surfaces their stiffness is per area; on groups of points each point has its own spring.

use super::find::{find_group, not_on_body, of_body, without_area};
use crate::error::{Error, Result, shown};
use crate::expression::Field;
use crate::fem::{NodalBlock, Space, surface};
use crate::mesh::Mesh;
use crate::problem::body::{BodySpec, SpringKind, SpringSpec};
use std::cell::RefCell;

/// Return the stiffness blocks between nodes that a spring of the scene adds to K.
///
/// # Errors
/// The group is missing or not on the body, or the stiffness is negative or not finite somewhere.
pub fn blocks<const D: usize>(
    spring: &SpringSpec,
    spec: &BodySpec,
    space: &Space<D>,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalBlock<D>>> {
    let group = find_group(mesh, &spring.on, &[D - 1, 0], "spring")?;
    let fault = RefCell::new(None);
    let value = |field: &Field, x: [f64; D]| match stiffness(field, spring, space.in_scene(x)) {
        Ok(value) => value,
        Err(error) => {
            fault.borrow_mut().get_or_insert(error.because(of_body(&spec.name.value)));
            0.0
        }
    };
    let at = |x: [f64; D], n: [f64; D]| -> [[f64; D]; D] {
        match &spring.kind {
            SpringKind::Vector(fields) => {
                std::array::from_fn(|i| std::array::from_fn(|j| if i == j { value(&fields[i], x) } else { 0.0 }))
            }
            SpringKind::Normal(field) => {
                let k = value(field, x);
                n.map(|a| n.map(|b| k * a * b))
            }
        }
    };
    let blocks = if group.dimension == 0 {
        if matches!(spring.kind, SpringKind::Normal(_)) {
            return Err(Error::scene(&spring.on.place, format!("points such as `{}` have no normal", spring.on.value))
                .help("give stiffness = [kx, ky]"));
        }
        let node = |node: u32| NodalBlock { nodes: [node; 2], block: at(space.nodes[node as usize], [0.0; D]) };
        space.nodes_on(group).into_iter().map(node).collect()
    } else {
        let facets = space.facets(group);
        if facets.count() > 0 && surface::measure(space, &facets) == 0.0 {
            return Err(without_area(&spring.on, spec));
        }
        surface::foundation(space, &facets, &at)
    };
    match fault.into_inner() {
        Some(error) => Err(error),
        None if blocks.is_empty() => Err(not_on_body(&spring.on, &spec.name.value)),
        None => Ok(blocks),
    }
}

/// Return the stiffness at a point.
///
/// # Errors
/// The stiffness is negative or not finite.
fn stiffness(field: &Field, spring: &SpringSpec, x: [f64; 3]) -> Result<f64> {
    match field.eval_finite("the stiffness of this spring", x)? {
        k if k >= 0.0 => Ok(k),
        k => {
            let message = format!(
                "the stiffness of the spring on `{}` is {} at {}",
                spring.on.value,
                shown(k),
                super::find::point(x)
            );
            Err(Error::scene(field.place().unwrap_or(&spring.on.place), message).label("must not be negative"))
        }
    }
}
