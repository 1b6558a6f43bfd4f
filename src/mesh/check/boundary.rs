//! The boundary of a body: a node that lies on a facet without belonging to it leaves a crack.
//!
//! Coincident nodes are a crack with two sets of nodes, other ones are hanging nodes. Curved facets count as their flat
//! pieces between nodes.

use super::faces::Cells;
use crate::error::Result;
use crate::linalg::{bounds, cross, dot, length, minus};
use crate::mesh::faces::Face;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// A point (x, y, z).
type Point = [f64; 3];

/// Distance from a facet, as a share of its size, within which a node touches it.
const TOUCH: f64 = 1e-9;

/// Local nodes of the flat pieces of a facet in space: a triangle, or four of them between the nodes of a quadratic
/// facet.
const PIECES: [&[[usize; 3]]; 2] = [&[[0, 1, 2]], &[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]];

/// Check that no node of the boundary lies on a facet to which it does not belong. `facets` are those of one cell
/// alone.
///
/// # Errors
/// A node lies on such a facet. The error gives the place and the cells.
pub fn check<const D: usize>(cells: &Cells<D>, facets: &[Face<D>]) -> Result<()> {
    let nodes: Vec<Vec<u32>> = facets.iter().map(|facet| facet.nodes(cells.simplices()).collect()).collect();
    let boxed = |(facet, number): (&Vec<u32>, usize)| {
        let [low, high] = bounds(facet.iter().map(|&node| cells.at(node)));
        let slack = TOUCH * length(minus(high, low));
        let widened = Rectangle::from_corners(low.map(|x| x - slack), high.map(|x| x + slack));
        GeomWithData::new(widened, (number, slack))
    };
    let tree = RTree::bulk_load(nodes.iter().zip(0..).map(boxed).collect());
    let mut seen = vec![false; cells.node_count()];
    for (own, facet) in nodes.iter().enumerate() {
        for &node in facet.iter().filter(|node| !std::mem::replace(&mut seen[**node as usize], true)) {
            let x = cells.at(node);
            for found in tree.locate_in_envelope_intersecting(AABB::from_point(x)) {
                let (other, slack) = found.data;
                if nodes[other].contains(&node) || distance::<D>(cells, &nodes[other], x) > slack {
                    continue;
                }
                let is_double = nodes[other].iter().any(|&other| length(minus(cells.at(other), x)) <= slack);
                let (what, help) = if is_double { DOUBLE } else { HANGING };
                let cells_of = [own, other].map(|facet| facets[facet].cell());
                return Err(cells.refuse(what, &cells_of, x).help(help));
            }
        }
    }
    Ok(())
}

/// What two nodes at one place leave, and what to do.
const DOUBLE: (&str, &str) = (
    "cells touch each other with nodes of their own, which leaves a crack",
    "let them share the nodes (in the script: `Coherence;`), draw the crack open, or make bodies of the connected parts: \
     `split = true` in the table of the body",
);
/// What a node on a facet of another cell leaves, and what to do.
const HANGING: (&str, &str) = (
    "a node hangs on a facet of another cell, which leaves a crack",
    "cells must share whole facets: mesh the body in one piece (in the script: `Coherence;`)",
);

/// Return the distance of a point from a facet, whose ends come before the nodes between them.
fn distance<const D: usize>(cells: &Cells<D>, facet: &[u32], x: Point) -> f64 {
    let at = |node: u32| cells.at(node);
    let distances: Vec<f64> = if D == 2 {
        let row = [&facet[..1], &facet[2..], &facet[1..2]].concat();
        row.windows(2).map(|ends| from_segment(x, at(ends[0]), at(ends[1]))).collect()
    } else {
        let pieces = PIECES[usize::from(cells.is_curved())];
        pieces.iter().map(|piece| from_triangle(x, piece.map(|corner| at(facet[corner])))).collect()
    };
    distances.into_iter().fold(f64::INFINITY, f64::min)
}

fn from_segment(x: Point, a: Point, b: Point) -> f64 {
    let edge = minus(b, a);
    let t = (dot(&minus(x, a), &edge) / dot(&edge, &edge)).clamp(0.0, 1.0);
    let foot = std::array::from_fn(|c| a[c] + t * edge[c]);
    length(minus(x, foot))
}

fn from_triangle(x: Point, [a, b, c]: [Point; 3]) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    let inner = |p: Point, q: Point| dot(&cross(minus(q, p), minus(x, p)), &normal) >= 0.0;
    if inner(a, b) && inner(b, c) && inner(c, a) {
        return dot(&minus(x, a), &normal).abs() / length(normal);
    }
    from_segment(x, a, b).min(from_segment(x, b, c)).min(from_segment(x, c, a))
}
