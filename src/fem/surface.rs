//! Integrals over surfaces: loads, foundations, areas.

use super::assemble::{NodalBlock, interpolate};
use super::element;
use super::forces::NodalForces;
use super::frame::place;
use super::quadrature::{self, Parts};
use super::space::{Facets, Space, area_vector};
use crate::problem::order::Order;

/// Nodal forces of a surface load; `traction(x, n)` is force per area at a point with outer unit normal n.
pub fn surface_load<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    parts: Parts,
    traction: &dyn Fn([f64; D], [f64; D]) -> [f64; D],
) -> NodalForces<D> {
    let of_surface = facets.distinct_nodes();
    let mut load = vec![0.0; D * of_surface.len()];
    on_facets(space, facets, parts, &mut |nodes, phi, weight, x, normal| {
        let force = traction(x, normal);
        for (a, at) in nodes.iter().enumerate().filter_map(|(a, &node)| Some((a, place(&of_surface, node)?))) {
            for c in 0..D {
                load[D * at as usize + c] += weight * phi[a] * force[c];
            }
        }
    });
    NodalForces::new(of_surface.into_iter(), &load)
}

/// What is done at an integration point of a surface: nodes of the facet, their shape functions, weight, place, outer unit
/// normal.
type Visit<'a, const D: usize> = dyn FnMut(&[u32], &[f64], f64, [f64; D], [f64; D]) + 'a;

/// Visits the integration points of a surface.
fn on_facets<const D: usize>(space: &Space<D>, facets: &Facets<D>, parts: Parts, visit: &mut Visit<D>) {
    let mut rule = quadrature::simplex(D, if space.order == Order::P1 { 3 } else { 5 });
    if parts == Parts::Halves {
        rule = rule.on_parts();
    }
    for index in 0..facets.count() {
        let x = facets.coordinates(index, space);
        for (l, weight) in rule.iter() {
            let area = area_vector(space.order, &x, l);
            let measure = area.iter().map(|a| a * a).sum::<f64>().sqrt();
            let normal = area.map(|a| a / measure);
            let phi = element::values(space.order, l);
            let at = interpolate(&x, &phi);
            visit(facets.facet(index), &phi, weight * measure * space.circle(&at), at, normal);
        }
    }
}

/// Springs per area on a surface, a foundation: `stiffness(x, n)` is traction per displacement at a point with outer unit
/// normal n.
pub fn foundation<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    stiffness: &dyn Fn([f64; D], [f64; D]) -> [[f64; D]; D],
) -> Vec<NodalBlock<D>> {
    let mut blocks = Vec::new();
    on_facets(space, facets, Parts::Whole, &mut |nodes, phi, weight, x, normal| {
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

/// Length (area) of a surface, in bodies of revolution the area that the curve sweeps over.
pub fn measure<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let mut sum = 0.0;
    on_facets(space, facets, Parts::Whole, &mut |_, _, weight, _, _| sum += weight);
    sum
}
