//! What a load misses on a meshed surface, by how much the surface turns from facet to facet where the true one is smooth.

use super::assemble::is_straight;
use super::space::{Facets, Space, area_vector};
use crate::linalg::dot;
use crate::problem::order::Order;
use std::collections::HashMap;

/// Angle from which two facets, or two edges of a rim, meet in a corner. Chords that turn by t leave their arc by 1 - cos(t/2) = t^2/8 of its radius; with this t that
/// is 3 per cent, the worst that is taken for round. A circle of 13 chords turns by 0.483.
const CORNER: f64 = 0.49;

/// Return the share of a load that may be missing on some facets, zero if they are plane with straight rims.
///
/// An inscribed polygon of chords that turn by t each misses t^2/24 of the length of its circle and t^2/6 of its area, and a surface of triangles t^2/8
/// of the area of its sphere. Parabolas through the middle of each arc miss t^4/960 of the length and t^4/480 of the area.
pub fn missed<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let is_curved = |i: usize| !is_straight(&facets.coordinates(i, space), D);
    let angle = turn(space, facets);
    match facets.order == Order::P2 && (0..facets.count()).any(is_curved) {
        true => angle.powi(4) / 480.0,
        false => by_chords(angle),
    }
}

/// The share of a load that may be missing on straight facets that turn by an angle.
pub fn by_chords(angle: f64) -> f64 {
    angle * angle / 6.0
}

/// Return the largest angle by which some facets, or the edges of their rim, turn without a corner.
fn turn<const D: usize>(space: &Space<D>, facets: &Facets<D>) -> f64 {
    let mut most = 0.0f64;
    let mut note = |cosine: f64| {
        let angle = cosine.clamp(-1.0, 1.0).acos();
        most = most.max(if angle < CORNER { angle } else { 0.0 });
    };
    let mut normals: HashMap<Vec<u32>, [f64; D]> = HashMap::new();
    for i in 0..facets.count() {
        let corners = &facets.facet(i)[..D];
        let x: Vec<[f64; D]> = corners.iter().map(|&node| space.nodes[node as usize]).collect();
        let normal = unit(area_vector::<D>(Order::P1, &x, &[1.0 / D as f64; D]));
        for opposite in 0..D {
            let mut side: Vec<u32> = (0..D).filter(|&k| k != opposite).map(|k| corners[k]).collect();
            side.sort_unstable();
            // what stays belongs to one facet alone: the rim
            match normals.remove(&side) {
                Some(other) => note(dot(&normal, &other)),
                None => drop(normals.insert(side, normal)),
            }
        }
    }
    let mut rim: HashMap<u32, Vec<[f64; D]>> = HashMap::new();
    for side in normals.keys().filter(|side| side.len() == 2) {
        for [from, to] in [[side[0], side[1]], [side[1], side[0]]] {
            let [a, b] = [from, to].map(|node| space.nodes[node as usize]);
            rim.entry(from).or_default().push(unit(std::array::from_fn(|c| b[c] - a[c])));
        }
    }
    rim.values().filter(|ways| ways.len() == 2).for_each(|ways| note(-dot(&ways[0], &ways[1])));
    most
}

fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
    let size = dot(&v, &v).sqrt();
    v.map(|v| v / size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::sample::block;

    /// A cube has corners alone. Bent into a part of a ring, its cylinders turn by the angle of a cell, and so does the rim of a plane end.
    #[test]
    fn a_bent_cube_turns() {
        let mut cube = block::<3>(4, Order::P1);
        // the sample is skewed
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
