//! The bodies of a scene on its mesh.

use super::approach::Outer;
use super::elastic;
use super::facts::BodyFacts;
use super::find::{find_group, point};
use super::part::Part;
use super::verify::{self, Verified};
use crate::error::{Error, Result};
use crate::fem::{Elasticity, Extent, Space};
use crate::linalg::Total;
use crate::mesh::Mesh;
use crate::problem::{BodySpec, Plane};
use crate::scene::Scene;
use std::rc::Rc;

/// Return the bodies with their spaces, elasticity, supports and springs.
///
/// # Errors
/// The scene contradicts its mesh.
pub fn parts<'a, const D: usize>(
    scene: &Scene,
    verified: &Verified<D>,
    bodies: &'a [BodySpec],
) -> Result<Vec<Part<'a, D>>> {
    let Verified { mesh, checked, .. } = verified;
    let mut parts = Vec::new();
    for (index, spec) in bodies.iter().enumerate() {
        let space = space(spec, mesh, scene.plane)?;
        let checked = &checked[index];
        let elasticity = elastic::of(spec, &space, mesh, scene.plane)?;
        let facts = facts(spec, &space, &elasticity, checked.points.clone());
        let mut part = Part::new(spec, mesh, space, Rc::new(elasticity), facts)?;
        let resultant = |load: &_| part.resultant(load, mesh);
        part.facts.outer = Outer::new(spec, &part.space, mesh, &resultant)?;
        verify::held(&part, &checked.parts, mesh)?;
        parts.push(part);
    }
    Ok(parts)
}

/// Return the space of a body.
///
/// # Errors
/// The mesh lacks the cells of the body, or a body of revolution has points of negative radius.
fn space<const D: usize>(spec: &BodySpec, mesh: &Mesh<D>, plane: Plane) -> Result<Space<D>> {
    let space = Space::new(mesh, find_group(mesh, &spec.name, &[D], "body")?, spec.order);
    if plane != Plane::Axisymmetric {
        return Ok(space);
    }
    let space = space.revolved();
    let Some(&negative) = space.nodes.iter().find(|x| x[0] < 0.0) else { return Ok(space) };
    let x = point(space.in_scene(negative));
    let message = format!("body `{}` has a negative radius at {x}", spec.name.value);
    let help = "axisymmetric bodies are drawn as meridians, x >= 0 with the axis at x = 0: leave out one half";
    Err(Error::mesh(&mesh.path, None, message).help(help))
}

/// Return the facts of a body whose nodes are these `points` of the mesh.
fn facts<const D: usize>(spec: &BodySpec, space: &Space<D>, elasticity: &Elasticity, points: Vec<u32>) -> BodyFacts {
    let cells = space.cell_count();
    let volume = (0..cells).map(|cell| space.share(cell)).collect::<Total>().value();
    let moduli = match spec.regions.is_empty() && elasticity.is_constant() {
        true => elasticity.moduli(0, [0.0; 3]).unwrap_or_default(),
        false => elastic::moduli(space, elasticity, 0..cells).map(|sum| sum / volume),
    };
    let extent = Extent::of(space.nodes.iter().copied());
    BodyFacts { points, extent, cells, volume, moduli, outer: Outer::default() }
}
