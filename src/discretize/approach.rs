//! The displacement of a body towards its contact, as a row of weights of nodal displacements for each of its contact
//! surfaces.

use super::groups::Line;
use super::scene_body::SceneBody;
use super::supports::axis_vector;
use crate::contact::ContactPair;
use crate::error::Result;
use crate::fem::{NodalForces, assemble, surface, unit};
use crate::linalg::{Csr, dot, length};
use crate::mesh::{Group, Mesh};
use crate::model::Segment;
use std::cell::OnceCell;

/// Smallest cosine of the angle between a force or a constrained direction and the contact normal at which a place is
/// included. It belongs to 60 degrees, up to which facets are pairs without the key `angle`.
const ALONG: f64 = 0.5;

/// Least length of the integrated normal of a pair relative to its area: below this ratio the pair has no mean normal.
///
/// Around a closed surface the integral is zero except for facets without a partner, and one such facet in a thousand
/// does not define a direction of the contact. Half a circle has the ratio 0.64.
const CANCELS: f64 = 1e-3;

/// Return the mean unit normal of a pair from side a to side b, if it has one.
pub fn mean_normal(pair: &ContactPair) -> Option<[f64; 3]> {
    let points = || pair.area.iter().zip(&pair.resultant[0]);
    let sum: [f64; 3] = std::array::from_fn(|k| points().map(|(area, n)| area * n[k]).sum());
    let (size, total) = (length(sum), pair.area.iter().sum::<f64>());
    (size > CANCELS * total).then(|| sum.map(|n| n / size))
}

/// Return a row for each contact surface of a body, with displacements of nodes as columns: how far the body moves
/// along the mean outer normal of the pair. The sum over both bodies is the approach of the pair. Rows of pairs without
/// a mean normal are empty.
///
/// A body moves as the supports do that move it along the normal. Without such, the displacement is the one on which
/// the forces along the normal of its loads work, divided by their sum. A body without such loads moves as its supports
/// and springs along the normal, and else as the mean over all of it.
///
/// # Errors
/// A group is missing, or a load is not finite.
pub fn rows<const D: usize>(
    body: &SceneBody<D>,
    segments: &[Segment],
    pairs: &[ContactPair],
    mesh: &Mesh<D>,
) -> Result<Csr> {
    let mut rows = Csr::new(body.mesh.space.dofs());
    if segments.is_empty() {
        return Ok(rows);
    }
    let holders = holders(body, mesh)?;
    let loads = body.spec.load.iter().map(|load| body.full_load(load, mesh)).collect::<Result<Vec<_>>>()?;
    let whole = OnceCell::new();
    let everywhere = || shapes(&assemble::body_force(&body.mesh.space, &|_| axis_vector(0)));
    for &Segment { pair, side } in segments {
        let Some(normal) = mean_normal(&pairs[pair]) else {
            rows.push_row([]);
            continue;
        };
        let n: [f64; D] = std::array::from_fn(|c| if side == 0 { normal[c] } else { -normal[c] });
        let weights = mean(&holders, n, true)
            .or_else(|| working(&loads, n))
            .or_else(|| mean(&holders, n, false))
            .unwrap_or_else(|| whole.get_or_init(everywhere).clone());
        let total: f64 = weights.iter().map(|entry| entry.1).sum();
        rows.push_row(weights.iter().flat_map(|&(node, weight)| {
            n.into_iter().enumerate().map(move |(c, n)| (D * node as usize + c, n * weight / total))
        }));
    }
    Ok(rows)
}

/// A support or spring of the body.
struct Holder<const D: usize> {
    /// Unit vectors: the constrained directions, and whether the body moves along them by a displacement other than
    /// zero.
    directions: Vec<([f64; D], bool)>,
    /// Integrals of the shape functions of nodes over its surface; 1 for each node of a group of another dimension.
    weights: Vec<(u32, f64)>,
    is_surface: bool,
}

/// Return the supports and springs of a body.
fn holders<const D: usize>(body: &SceneBody<D>, mesh: &Mesh<D>) -> Result<Vec<Holder<D>>> {
    let (spec, mut all) = (body.spec, Vec::new());
    for fix in &spec.fix {
        let group = fix.group(mesh)?;
        let components = (0..D).filter_map(|c| Some((axis_vector(c), fix.components()[c]?)));
        let along = fix.along_normal().and_then(|value| Some((normal(body, group)?, value)));
        let directions = components.chain(along).map(|(n, value)| (n, !value.is_zero())).collect();
        all.push(holder(body, group, directions));
    }
    for spring in &spec.spring {
        let group = spring.group(mesh)?;
        let directions: Vec<[f64; D]> = match &spring.stiffness {
            Some(fields) => (0..D).filter(|&c| !fields[c].is_zero()).map(axis_vector).collect(),
            None => normal(body, group).into_iter().collect(),
        };
        all.push(holder(body, group, directions.into_iter().map(|n| (n, false)).collect()));
    }
    Ok(all)
}

fn holder<const D: usize>(body: &SceneBody<D>, group: &Group, directions: Vec<([f64; D], bool)>) -> Holder<D> {
    let facets = (group.dimension + 1 == D).then(|| body.mesh.space.facets(group));
    let areas = facets.map(|facets| shapes(&surface::surface_load(&body.mesh.space, &facets, &|_, _| axis_vector(0))));
    let is_surface = areas.as_ref().is_some_and(|areas| !areas.is_empty());
    let nodes = || body.mesh.space.nodes_on(group).into_iter().map(|node| (node, 1.0)).collect();
    Holder { directions, weights: areas.filter(|_| is_surface).unwrap_or_else(nodes), is_surface }
}

/// Return the first components of nodal forces. Under a unit traction or body force along x they are the integrals of
/// the shape functions.
fn shapes<const D: usize>(all: &NodalForces<D>) -> Vec<(u32, f64)> {
    all.iter().map(|(node, weight)| (node, weight[0])).collect()
}

/// Return the weights of the mean over those holders that constrain the direction `n`, or move the body along it if
/// `moving`. Points count only where there is no surface. The result is `None` without such holders.
fn mean<const D: usize>(holders: &[Holder<D>], n: [f64; D], moving: bool) -> Option<Vec<(u32, f64)>> {
    let acts = |&(d, moves): &([f64; D], bool)| (moves || !moving) && dot(&d, &n).abs() >= ALONG;
    let along = holders.iter().filter(|holder| holder.directions.iter().any(acts));
    let surfaces = along.clone().any(|holder| holder.is_surface);
    let weights: Vec<(u32, f64)> = along
        .filter(|holder| holder.is_surface || !surfaces)
        .flat_map(|holder| holder.weights.iter().copied())
        .collect();
    (!weights.is_empty()).then(|| summed(weights))
}

/// Return the forces at nodes along `n` of those loads that push along it; `None` without such loads. A moment and a
/// pressure all around have no sum.
fn working<const D: usize>(loads: &[NodalForces<D>], n: [f64; D]) -> Option<Vec<(u32, f64)>> {
    let mut weights = Vec::new();
    for load in loads {
        let [net, size] = load.iter().fold([0.0; 2], |[net, size], (_, f)| [net + dot(&f, &n), size + length(f)]);
        if net != 0.0 && net.abs() >= ALONG * size {
            weights.extend(load.iter().map(|(node, force)| (node, net.signum() * dot(&force, &n))));
        }
    }
    (!weights.is_empty()).then(|| summed(weights))
}

/// Add the weights of nodes that occur several times.
fn summed(mut weights: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    weights.sort_by_key(|entry| entry.0);
    weights.chunk_by(|a, b| a.0 == b.0).map(|same| (same[0].0, same.iter().map(|entry| entry.1).sum())).collect()
}

/// Return the mean unit normal of a surface, if it has one.
fn normal<const D: usize>(body: &SceneBody<D>, group: &Group) -> Option<[f64; D]> {
    if group.dimension + 1 != D {
        return None;
    }
    let normals = body.mesh.space.facets(group).normals(&body.mesh.space);
    let sum = normals.into_iter().fold([0.0; D], |sum: [f64; D], n| std::array::from_fn(|c| sum[c] + n[c]));
    (length(sum) > 0.0).then(|| unit(sum))
}
