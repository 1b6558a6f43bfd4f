//! The bodies of a scene on its mesh, which one rank has read.

use super::approach::Outer;
use super::elastic;
use super::find::{find_group, point};
use super::known::Known;
use super::part::{self, Part};
use super::verify::{self, Verified};
use crate::contact::pad;
use crate::error::{Error, Result};
use crate::fem::quadrature::Parts;
use crate::fem::{Elasticity, Space, interpolation};
use crate::mesh::Mesh;
use crate::model::Exchange;
use crate::parallel;
use crate::problem::body::BodySpec;
use crate::problem::elasticity::Plane;
use crate::scene::Scene;

/// The bodies with their spaces, supports and springs, as the first rank has read them, with the elasticity of their cells there. Collective.
///
/// # Errors
/// Refusals of the scene against its mesh.
pub fn parts<'a, const D: usize>(
    scene: &Scene,
    verified: &Verified<D>,
    bodies: &'a [BodySpec],
    exchange: &dyn Exchange,
) -> Result<(Vec<Part<'a, D>>, Option<Vec<Elasticity>>)> {
    let Verified { mesh, checked, .. } = verified;
    let mut first = None;
    let read = || {
        let on_surface = if exchange.ranks() > 1 { on_surfaces(mesh) } else { Vec::new() };
        let wanted = Wanted { plane: scene.plane, boundaries: !scene.auto.is_empty(), on_surface: &on_surface };
        let (mut parts, mut elasticities) = (Vec::new(), Vec::new());
        for (index, spec) in bodies.iter().enumerate() {
            let (space, elasticity, known) = read(spec, mesh, wanted)?;
            let mut part = Part::new(spec, mesh, space, known)?;
            part.known.outer = Outer::new(spec, &part.space, mesh, &|load| part.resultant(load, mesh))?;
            verify::held(&part, &checked[index].parts, mesh)?;
            parts.push(part);
            elasticities.push(elasticity);
        }
        let known = parts.iter_mut().map(|part| std::mem::take(&mut part.known)).collect();
        first = Some((parts, elasticities));
        Ok(known)
    };
    let known: Vec<Known> = parallel::tell(exchange, read)?;
    if let Some((mut parts, elasticities)) = first {
        parts.iter_mut().zip(known).for_each(|(part, known)| part.known = known);
        return Ok((parts, Some(elasticities)));
    }
    let of_body =
        |(spec, known): (&'a BodySpec, Known)| Part::new(spec, mesh, known.space(spec, mesh, scene.plane), known);
    Ok((bodies.iter().zip(known).map(of_body).collect::<Result<_>>()?, None))
}

/// What a scene asks of all bodies.
#[derive(Clone, Copy)]
struct Wanted<'a> {
    /// Kind of a plane problem.
    plane: Plane,
    /// Whether contacts are to be found on whole boundaries.
    boundaries: bool,
    /// Whether each point of the mesh is on a surface; empty where one rank has all cells.
    on_surface: &'a [bool],
}

/// The space and the elasticity of a body of which this rank has all cells, and what others are told of it.
///
/// # Errors
/// Refusals of the scene against its mesh, and bodies of revolution with points of negative radius.
fn read<const D: usize>(spec: &BodySpec, mesh: &Mesh<D>, wanted: Wanted) -> Result<(Space<D>, Elasticity, Known)> {
    let group = find_group(mesh, &spec.name, &[D], "body")?;
    let mut space = Space::new(mesh, group, spec.order);
    if wanted.plane == Plane::Axisymmetric {
        space = space.revolved();
        if let Some(x) = space.nodes.iter().find(|x| x[0] < 0.0) {
            let message = format!("body `{}` has a negative radius at {}", spec.name.value, point(pad(*x)));
            return Err(Error::mesh(&mesh.path, None, message).help(
                "axisymmetric bodies are drawn as meridians, x >= 0 with the axis at x = 0: leave out one half",
            ));
        }
    }
    let elasticity = elastic::of(spec, &space, mesh, wanted.plane)?;
    let points = space.points();
    let volume = (0..space.cell_count()).map(|cell| space.share(cell)).sum();
    let on_surface = |node: &&u32| wanted.on_surface[points[**node as usize] as usize];
    let is_behind = |cell: &&[u32]| cell[..=D].iter().filter(on_surface).count() >= D;
    let cells = space.cells.chunks_exact(space.stride);
    let known = Known {
        cells: space.cell_count(),
        volume,
        moduli: elastic::moduli(&space, &elasticity, volume),
        force: part::body_force(spec, &space, Parts::Whole)?,
        corners: interpolation::corners(&space),
        boundary: if wanted.boundaries { space.boundary().nodes } else { Vec::new() },
        behind: if wanted.on_surface.is_empty() {
            Vec::new()
        } else {
            cells.filter(is_behind).flatten().copied().collect()
        },
        measure: space.measure(),
        points,
        outer: Outer::default(),
    };
    Ok((space, elasticity, known))
}

/// Whether each point of a mesh is on a surface.
fn on_surfaces<const D: usize>(mesh: &Mesh<D>) -> Vec<bool> {
    let mut on_surface = vec![false; mesh.points.len()];
    let surfaces = mesh.groups.iter().filter(|group| group.dimension == D - 1);
    surfaces.flat_map(|group| &group.connectivity).for_each(|&point| on_surface[point as usize] = true);
    on_surface
}
