//! The boundary of a body, which must not meet itself.

use super::cells::{Cells, NONE};
use super::distance::{self, Point};
use super::faces::Face;
use crate::error::Result;
use crate::linalg;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Share of a facet's size below which two facets touch. It is ten times the error with which Gmsh places nodes.
const TOUCH: f64 = 1e-9;

/// Number of pieces of the edge of a curved facet in a close comparison.
const FINE: usize = 8;

/// The facets of the boundary of a body, with a search tree of their boxes.
pub struct Surface<'a, const D: usize> {
    cells: &'a Cells<'a, D>,
    /// The facets as faces of cells.
    pub faces: Vec<Face<D>>,
    /// Nodes of all facets, `stride` per facet.
    nodes: Vec<u32>,
    stride: usize,
    tree: RTree<GeomWithData<Rectangle<Point>, u32>>,
}

/// A flat part of a facet between corners: a segment in the plane, a triangle in space.
#[derive(Clone, Copy)]
struct Piece {
    /// Corners; a segment has the last one twice.
    x: [Point; 3],
    /// Nodes of the corners, or [`NONE`] where a corner is not a node.
    node: [u32; 3],
}

impl<'a, const D: usize> Surface<'a, D> {
    /// Make the surface of the facets that bound one cell, in the order of [`Faces::outer`](super::faces::Faces::outer).
    pub fn new(cells: &'a Cells<'a, D>, faces: Vec<Face<D>>) -> Self {
        let nodes: Vec<u32> = faces.iter().flat_map(|face| face.nodes(cells)).collect();
        let stride = if cells.is_quadratic() { D * (D + 1) / 2 } else { D };
        let boxed = |(facet, i)| {
            let [low, high] = bounds(facet, cells);
            GeomWithData::new(Rectangle::from_corners(low, high), i)
        };
        let tree = RTree::bulk_load(nodes.chunks_exact(stride).zip(0..).map(boxed).collect());
        Self { cells, faces, nodes, stride, tree }
    }

    /// Return the nodes of a facet.
    pub fn facet(&self, i: usize) -> &[u32] {
        &self.nodes[i * self.stride..][..self.stride]
    }

    /// Return the indices of the facets whose boxes meet the box from `low` to `high`.
    pub fn near(&self, low: Point, high: Point) -> impl Iterator<Item = usize> + '_ {
        let found = self.tree.locate_in_envelope_intersecting(AABB::from_corners(low, high));
        found.map(|found| found.data as usize)
    }

    /// Return the corners of the flat pieces of a facet between its nodes. A linear facet is one piece. With mid-edge nodes
    /// there are two segments or four triangles.
    pub fn flat(&self, i: usize) -> impl Iterator<Item = [Point; D]> + '_ {
        self.pieces(i).map(|piece| std::array::from_fn(|k| piece.x[k]))
    }

    fn pieces(&self, i: usize) -> impl Iterator<Item = Piece> + '_ {
        const SPLIT: [&[[usize; 3]]; 4] =
            [&[[0, 1, 1]], &[[0, 2, 2], [2, 1, 1]], &[[0, 1, 2]], &[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]];
        let facet = self.facet(i);
        let split = SPLIT[2 * (D - 2) + usize::from(self.cells.is_quadratic())];
        split.iter().map(move |corners| {
            let node = corners.map(|k| facet[k]);
            Piece { x: node.map(|node| self.cells.at(node)), node }
        })
    }

    /// Return the pieces of a curved facet that has no node in common with the facet to which it is compared.
    fn fine_pieces(&self, i: usize) -> Vec<Piece> {
        let x: Vec<Point> = self.facet(i).iter().map(|&node| self.cells.at(node)).collect();
        let point = |l: [f64; 3]| -> Point {
            let edges = [[0, 1], [1, 2], [0, 2]];
            let shape = |k: usize| match k {
                k if k < D => l[k] * (2.0 * l[k] - 1.0),
                k => 4.0 * l[edges[k - D][0]] * l[edges[k - D][1]],
            };
            std::array::from_fn(|c| x.iter().enumerate().map(|(k, x)| shape(k) * x[c]).sum())
        };
        let at = |i: usize, j: usize| {
            let [s, t] = [i, j].map(|i| i as f64 / FINE as f64);
            point([1.0 - s - t, s, t])
        };
        let piece = |corners: [[usize; 2]; 3]| Piece { x: corners.map(|[i, j]| at(i, j)), node: [NONE; 3] };
        if D == 2 {
            return (0..FINE).map(|i| piece([[i, 0], [i + 1, 0], [i + 1, 0]])).collect();
        }
        let lower = (0..FINE).flat_map(|i| (0..FINE - i).map(move |j| [[i, j], [i + 1, j], [i, j + 1]]));
        let upper = (1..FINE).flat_map(|i| (1..=FINE - i).map(move |j| [[i, j], [i - 1, j], [i, j - 1]]));
        lower.chain(upper).map(piece).collect()
    }

    /// Check that no two facets meet except in the corners and edges that they share.
    ///
    /// # Errors
    /// Two facets meet elsewhere.
    pub fn check(&self) -> Result<()> {
        for i in 0..self.faces.len() {
            let [low, high] = bounds(self.facet(i), self.cells);
            let slack = TOUCH * distance::apart(low, high);
            for j in self.near(low.map(|x| x - slack), high.map(|x| x + slack)).filter(|&j| j > i) {
                if self.meet(i, j) {
                    return Err(self.refuse(i, j));
                }
            }
        }
        Ok(())
    }

    /// Return whether two facets meet where they should not.
    fn meet(&self, i: usize, j: usize) -> bool {
        let other: Vec<Piece> = self.pieces(j).collect();
        if !self.pieces(i).any(|piece| other.iter().any(|other| meet::<D>(&piece, other))) {
            return false;
        }
        let apart = !self.facet(i).iter().any(|node| self.facet(j).contains(node));
        if !(apart && self.cells.is_quadratic()) {
            return true;
        }
        // Chords may meet where arcs do not.
        let other = self.fine_pieces(j);
        self.fine_pieces(i).iter().any(|piece| other.iter().any(|other| meet::<D>(piece, other)))
    }

    /// Return the error of two facets that meet.
    fn refuse(&self, i: usize, j: usize) -> crate::error::Error {
        let cells = [i, j].map(|i| self.faces[i].cell());
        let pair = || [(i, j), (j, i)].into_iter();
        let size = |i: usize| {
            let [low, high] = bounds(self.facet(i), self.cells);
            TOUCH * distance::apart(low, high)
        };
        let slack = size(i).max(size(j));
        let own = |i: usize, j: usize| self.facet(i).iter().copied().filter(move |node| !self.facet(j).contains(node));
        let twin = own(i, j).find(|&a| own(j, i).any(|b| distance::apart(self.cells.at(a), self.cells.at(b)) <= slack));
        if let Some(node) = twin {
            let what = "cells touch each other with nodes of their own, which leaves a crack";
            return self.cells.refuse(what, &cells, self.cells.at(node)).help(
                "let them share the nodes (in the script: `Coherence;`), draw the crack open, or make bodies of the connected parts: \
                 `split = true` in the table of the body",
            );
        }
        let on = |node: u32, j: usize| {
            self.pieces(j).any(|piece| match D {
                2 => distance::from_segment(self.cells.at(node), [piece.x[0], piece.x[1]]) <= slack,
                _ => distance::from_triangle(self.cells.at(node), piece.x) <= slack,
            })
        };
        let hanging = pair().find_map(|(i, j)| own(i, j).find(|&node| on(node, j)));
        if let Some(node) = hanging {
            let what = "a node hangs on a facet of another cell, which leaves a crack";
            return self
                .cells
                .refuse(what, &cells, self.cells.at(node))
                .help("cells must share whole facets: mesh the body in one piece (in the script: `Coherence;`)");
        }
        let what = "the boundary of the body crosses itself, so that cells overlap";
        self.cells.refuse(what, &cells, self.cells.at(self.facet(i)[0])).help("correct the geometry, or mesh it again")
    }
}

/// Return the box around nodes.
fn bounds<const D: usize>(nodes: &[u32], cells: &Cells<D>) -> [Point; 2] {
    linalg::bounds(nodes.iter().map(|&node| cells.at(node)))
}

/// Return whether two pieces meet except in the corners that they share.
fn meet<const D: usize>(a: &Piece, b: &Piece) -> bool {
    let largest = |piece: &Piece| {
        let [p, q, r] = piece.x;
        distance::apart(p, q).max(distance::apart(q, r)).max(distance::apart(r, p))
    };
    let within = TOUCH * largest(a).max(largest(b));
    let low = |piece: &Piece, c: usize| piece.x.iter().map(|x| x[c]).fold(f64::INFINITY, f64::min);
    let high = |piece: &Piece, c: usize| piece.x.iter().map(|x| x[c]).fold(f64::NEG_INFINITY, f64::max);
    if (0..3).any(|c| low(a, c) > high(b, c) + within || low(b, c) > high(a, c) + within) {
        return false;
    }
    // The corners that both pieces have come first, in the same order.
    let (mut p, mut q) = (*a, *b);
    let mut common = 0;
    for k in 0..D {
        let Some(same) = (common..D).find(|&m| q.node[m] == p.node[k] && p.node[k] != NONE) else { continue };
        p.node.swap(common, k);
        p.x.swap(common, k);
        q.node.swap(common, same);
        q.x.swap(common, same);
        common += 1;
    }
    match (D, common) {
        (2, 0) => distance::segments([p.x[0], p.x[1]], [q.x[0], q.x[1]], within),
        (2, 1) => {
            distance::from_segment(p.x[1], [q.x[0], q.x[1]]) <= within
                || distance::from_segment(q.x[1], [p.x[0], p.x[1]]) <= within
        }
        (3, 0) => {
            let edges = |x: [Point; 3]| [[x[0], x[1]], [x[1], x[2]], [x[2], x[0]]];
            edges(p.x).into_iter().any(|edge| distance::segment_triangle(edge, q.x, within))
                || edges(q.x).into_iter().any(|edge| distance::segment_triangle(edge, p.x, within))
        }
        (3, 1) => {
            distance::segment_triangle([p.x[1], p.x[2]], q.x, within)
                || distance::segment_triangle([q.x[1], q.x[2]], p.x, within)
        }
        (3, 2) => distance::same_side([p.x[0], p.x[1]], p.x[2], q.x[2], TOUCH),
        _ => true,
    }
}
