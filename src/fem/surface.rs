//! Integrals over surfaces: loads, foundations and areas.

use super::assemble::{NodalBlock, NodalForces};
use super::element::{self, Rule};
use super::facets::{Facets, area_vector};
use super::frame::place;
use super::length;
use super::space::Space;

/// Return the quadrature rule of loads and springs on the surface of a body. It has ten degrees more than constant
/// loads need: of a bell exp(-(s/r)^2) with r a third of a linear facet it loses 1e-5 in place of a fifth.
pub fn rule<const D: usize>(space: &Space<D>) -> Rule {
    element::rule(D, 2 * space.order.degree() + 11)
}

/// Return the nodal forces of a surface load. `traction(x, n)` is the force per area at a point x with outer unit
/// normal n.
pub fn surface_load<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    traction: &dyn Fn([f64; D], [f64; D]) -> [f64; D],
) -> NodalForces<D> {
    let surface_nodes = facets.distinct_nodes();
    let mut load = vec![0.0; D * surface_nodes.len()];
    visit(space, facets, &rule(space), |SurfacePoint { nodes, phi, weight, x, normal }| {
        let force = traction(x, normal);
        for (a, at) in nodes.iter().enumerate().filter_map(|(a, &node)| Some((a, place(&surface_nodes, node)?))) {
            for c in 0..D {
                load[D * at as usize + c] += weight * phi[a] * force[c];
            }
        }
    });
    NodalForces::new(surface_nodes.into_iter(), &load)
}

/// An integration point of a surface.
struct SurfacePoint<'a, const D: usize> {
    /// Nodes of the facet.
    nodes: &'a [u32],
    /// Values of the shape functions.
    phi: element::Values,
    /// Weight of the point in an integral over the surface.
    weight: f64,
    x: [f64; D],
    /// Outer unit normal.
    normal: [f64; D],
}

/// Visit the integration points of a surface.
fn visit<const D: usize>(space: &Space<D>, facets: &Facets<D>, rule: &Rule, mut each: impl FnMut(SurfacePoint<D>)) {
    for index in 0..facets.count() {
        let x = facets.coordinates(index, space);
        for (l, weight) in rule.iter() {
            let area = area_vector(space.order, &x, l);
            let measure = length(area);
            let normal = area.map(|a| a / measure);
            let phi = element::values(space.order, l);
            let at = element::interpolate(&x, &phi);
            let weight = weight * measure * space.circle(&at);
            each(SurfacePoint { nodes: facets.facet(index), phi, weight, x: at, normal });
        }
    }
}

/// Return the springs of a foundation on a surface. `stiffness(x, n)` is the traction per displacement at a point x
/// with outer unit normal n.
pub fn foundation<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    stiffness: &dyn Fn([f64; D], [f64; D]) -> [[f64; D]; D],
) -> Vec<NodalBlock<D>> {
    let mut blocks = Vec::new();
    visit(space, facets, &rule(space), |SurfacePoint { nodes, phi, weight, x, normal }| {
        let density = stiffness(x, normal);
        for (a, &first) in nodes.iter().enumerate() {
            for (b, &second) in nodes.iter().enumerate() {
                let block = density.map(|row| row.map(|value| weight * phi[a] * phi[b] * value));
                blocks.push(NodalBlock { nodes: [first, second], block });
            }
        }
    });
    blocks
}

/// Return the length (area) of a surface, in bodies of revolution the area that the curve sweeps over.
pub fn measure<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let mut sum = 0.0;
    visit(space, facets, &rule(space), |point| sum += point.weight);
    sum
}
