//! Error of a load on a meshed surface that approximates a smooth one, from the angles between neighbouring facets.

use super::assemble::is_straight;
use super::facets::{Facets, area_vector};
use super::space::Space;
use super::{minus, unit};
use crate::linalg::dot;
use crate::problem::order::Order;
use std::collections::HashMap;

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
    let is_curved = |i: usize| !is_straight(&facets.coordinates(i, space), D);
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
    for (side, around) in facets_by_side(facets) {
        // Where more than two facets meet, they are taken in pairs.
        for pair in around.chunks(2) {
            match (pair, &side[..]) {
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

/// Return the facets at each side, in their order. A side is the sorted corners of a facet without one of them: an edge of a triangle,
/// or an end of a line.
fn facets_by_side<const D: usize>(facets: &Facets<D>) -> HashMap<Vec<u32>, Vec<usize>> {
    let mut around: HashMap<Vec<u32>, Vec<usize>> = HashMap::new();
    for i in 0..facets.count() {
        for opposite in 0..D {
            let mut side = facets.facet(i)[..D].to_vec();
            side.remove(opposite);
            side.sort_unstable();
            around.entry(side).or_default().push(i);
        }
    }
    around
}

/// Return the unit normal of the plane through the corners of facet `i`.
fn normal<const D: usize>(space: &Space<D>, facets: &Facets<D>, i: usize) -> [f64; D] {
    let x = facets.coordinates(i, space);
    unit(area_vector::<D>(Order::P1, &x[..D], &[1.0 / D as f64; D]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::sample::block;

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
