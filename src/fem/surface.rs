//! Integrals over surfaces (loads, foundations and areas), and what a load misses where facets approximate a smooth surface.

use super::assemble::{NodalBlock, NodalForces};
use super::element::{self, Subdivision};
use super::facets::{Facets, area_vector};
use super::frame::place;
use super::space::Space;
use super::{length, minus, unit};
use crate::linalg::dot;
use crate::problem::order::Order;
use std::collections::HashMap;

/// Return the nodal forces of a surface load. `traction(x, n)` is the force per area at a point x with outer unit normal n.
pub fn surface_load<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    parts: Subdivision,
    traction: &dyn Fn([f64; D], [f64; D]) -> [f64; D],
) -> NodalForces<D> {
    let surface_nodes = facets.distinct_nodes();
    let mut load = vec![0.0; D * surface_nodes.len()];
    visit(space, facets, parts, |FacetPoint { nodes, phi, weight, x, normal }| {
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
struct FacetPoint<'a, const D: usize> {
    /// Nodes of the facet.
    nodes: &'a [u32],
    /// Values of the shape functions.
    phi: [f64; element::MOST],
    /// Weight of the point in an integral over the surface.
    weight: f64,
    x: [f64; D],
    /// Outer unit normal.
    normal: [f64; D],
}

/// Visit the integration points of a surface.
fn visit<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    parts: Subdivision,
    mut each: impl FnMut(FacetPoint<D>),
) {
    let mut rule = element::rule(D, if space.order == Order::P1 { 3 } else { 5 });
    if parts == Subdivision::Halves {
        rule = rule.on_parts();
    }
    for index in 0..facets.count() {
        let x = facets.coordinates(index, space);
        for (l, weight) in rule.iter() {
            let area = area_vector(space.order, &x, l);
            let measure = length(area);
            let normal = area.map(|a| a / measure);
            let phi = element::values(space.order, l);
            let at = element::interpolate(&x, &phi);
            let weight = weight * measure * space.circle(&at);
            each(FacetPoint { nodes: facets.facet(index), phi, weight, x: at, normal });
        }
    }
}

/// Return the springs of a foundation on a surface. `stiffness(x, n)` is the traction per displacement at a point x with outer unit
/// normal n.
pub fn foundation<const D: usize>(
    space: &Space<D>,
    facets: &Facets<D>,
    stiffness: &dyn Fn([f64; D], [f64; D]) -> [[f64; D]; D],
) -> Vec<NodalBlock<D>> {
    let mut blocks = Vec::new();
    visit(space, facets, Subdivision::Whole, |FacetPoint { nodes, phi, weight, x, normal }| {
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
    visit(space, facets, Subdivision::Whole, |point| sum += point.weight);
    sum
}

/// Angle from which two facets, or two edges of a rim, meet in a corner.
///
/// Chords that turn by an angle t leave their arc by 1 - cos(t/2) = t^2/8 of its radius. With this angle that is 3 per cent, the worst
/// polygon that is taken for round. A circle of 13 chords turns by 0.483.
const CORNER: f64 = 0.49;

/// Return the share of a load that may be missing on some facets, zero if they are plane with straight rims.
///
/// An inscribed polygon of chords that turn by an angle t each misses t^2/24 of the length of its circle and t^2/6 of its area. A surface
/// of triangles misses t^2/8 of the area of its sphere. Parabolas through the middle of each arc miss t^4/960 of the length and t^4/480 of
/// the area.
pub fn missed<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let is_curved = |i: usize| !element::is_straight(&facets.coordinates(i, space), D);
    let angle = turn(space, facets);
    match facets.order == Order::P2 && (0..facets.count()).any(is_curved) {
        true => angle.powi(4) / 480.0,
        false => by_chords(angle),
    }
}

/// Return the share of a load that may be missing on straight facets that turn by an angle.
pub fn by_chords(angle: f64) -> f64 {
    angle * angle / 6.0
}

/// Return the largest angle below [`CORNER`] between neighbouring facets, or between neighbouring edges of their rim.
fn turn<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let normals: Vec<[f64; D]> = (0..facets.count()).map(|i| normal(space, facets, i)).collect();
    let mut cosines = Vec::new();
    let mut rim_at: HashMap<u32, Vec<[f64; D]>> = HashMap::new();
    for (edge, around) in facets.by_edge() {
        // Where more than two facets meet, they are taken in pairs.
        for pair in around.chunks(2) {
            match (pair, &edge[..D - 1]) {
                (&[i, j], _) => cosines.push(dot(&normals[i], &normals[j])),
                (_, &[from, to]) => {
                    let [a, b] = [from, to].map(|node| space.nodes[node as usize]);
                    rim_at.entry(from).or_default().push(unit(minus(b, a)));
                    rim_at.entry(to).or_default().push(unit(minus(a, b)));
                }
                // In the plane the rim consists of single nodes.
                _ => {}
            }
        }
    }
    cosines.extend(rim_at.values().filter(|edges| edges.len() == 2).map(|edges| -dot(&edges[0], &edges[1])));
    let angles = cosines.into_iter().map(|cosine| cosine.clamp(-1.0, 1.0).acos());
    angles.filter(|&angle| angle < CORNER).fold(0.0, f64::max)
}

/// Return the unit normal of the plane through the corners of facet `i`.
fn normal<const D: usize>(space: &Space<D>, facets: &Facets<D>, i: usize) -> [f64; D] {
    let x = facets.coordinates(i, space);
    unit(area_vector::<D>(Order::P1, &x[..D], &[1.0 / D as f64; D]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;

    /// A cube has only corners. If it is bent into a part of a ring, its cylinders turn by the angle of a cell, and so does the rim of a
    /// plane end.
    #[test]
    fn a_bent_cube_turns() {
        let mut cube = block::<3>(4, Order::P1);
        // The sample is skewed, which is undone here.
        cube.nodes.iter_mut().for_each(|[x, y, z]| {
            *y -= 0.2 * *z;
            *x -= 0.2 * *y;
        });
        assert!(turn(&cube, &cube.boundary()) < 1e-7);
        cube.nodes.iter_mut().for_each(|[_, y, z]| {
            let (radius, angle) = (3.0 + *y, 0.8 * *z);
            (*y, *z) = (radius * angle.cos(), radius * angle.sin());
        });
        let whole = cube.boundary();
        let end: Vec<bool> = whole.normals(&cube).chunks(3).map(|normals| normals[0][0] > 0.99).collect();
        let end = whole.only(&end);
        assert_eq!(end.count(), 32);
        for facets in [whole, end] {
            let found = turn(&cube, &facets);
            assert!((found - 0.2).abs() < 1e-9, "{found}");
        }
    }
}
