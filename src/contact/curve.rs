//! The height of a smooth curve above the quadratic edges that stand for it.
//!
//! A quadratic edge misses a curve by terms of the third degree, which elements of higher order show as gaps: a wave of amplitude 1e-4 per length
//! had errors of its pressures 10 to 400 times larger without the heights, with orders 3 to 8 on adapted meshes. The curve of degree four through the points of an
//! edge and of its neighbour misses two degrees less.

use super::side::Side;
use crate::fem::{element, minus, unit};
use crate::linalg::{dot, interpolation_weights};
use crate::mesh::is_smooth;
use crate::problem::order::Order;
use std::collections::HashMap;

/// The heights of a curve in the plane above its edges. They are zero by default.
#[derive(Debug, Clone, Default)]
pub struct Heights<const D: usize> {
    edges: Vec<Edge<D>>,
}

/// A quadratic edge between its neighbours.
#[derive(Debug, Clone)]
struct Edge<const D: usize> {
    /// Its two vertices and its middle.
    own: [[f64; D]; 3],
    /// Middle and far vertex of each neighbour on the same curve.
    neighbours: Vec<[[f64; D]; 2]>,
}

impl Heights<2> {
    /// Find the neighbours of the edges of a side. A straight edge is a line, and no part of a curve. Heights above edges of order one and two are zero, as the
    /// edges are no better.
    pub fn new(side: &Side<2>) -> Self {
        if side.facets.order <= Order::P2 {
            return Self::default();
        }
        let shapes: Vec<Vec<[f64; 2]>> = (0..side.facets.count()).map(|i| side.facets.shape(i, side.space)).collect();
        let is_curved = |i: &usize| !element::is_straight(Order::P2, &shapes[*i], 2);
        let mut at_vertex: HashMap<u32, Vec<usize>> = HashMap::new();
        for i in (0..shapes.len()).filter(is_curved) {
            side.on_facet(i)[..2].iter().for_each(|&vertex| at_vertex.entry(vertex).or_default().push(i));
        }
        let edge = |i: usize| {
            let own = [shapes[i][0], shapes[i][1], shapes[i][2]];
            let beside = |end: usize| {
                let vertex = side.on_facet(i)[end];
                let other = at_vertex.get(&vertex)?.iter().copied().find(|&other| other != i && is_curved(&i))?;
                let beyond = [shapes[other][2], shapes[other][usize::from(side.on_facet(other)[0] == vertex)]];
                is_smooth([own[1 - end], own[2], own[end], beyond[0], beyond[1]]).then_some(beyond)
            };
            Edge { own, neighbours: [0, 1].into_iter().filter_map(beside).collect() }
        };
        Self { edges: (0..shapes.len()).map(edge).collect() }
    }
}

impl<const D: usize> Heights<D> {
    /// Return the height of the curve at barycentric coordinates of an edge, along the outer normal.
    ///
    /// Each neighbour gives a curve of degree four. Where the curvature jumps at a vertex, the curve beyond it is none of the edge, and its height is far larger; so the
    /// smaller height counts, and none if they have different signs.
    pub fn at(&self, edge: usize, l: &[f64; D]) -> f64 {
        let Some(Edge { own, neighbours }) = self.edges.get(edge) else { return 0.0 };
        let along = unit(minus(own[1], own[0]));
        let across: [f64; D] = std::array::from_fn(|c| if c == 0 { along[1] } else { -along[0] });
        let local = |x: [f64; D]| [along, across].map(|axis| dot(&axis, &minus(x, own[0])));
        let [x, y] = local(element::interpolate(own, &element::values(Order::P2, l)));
        let height = |&[middle, far]: &[[f64; D]; 2]| {
            let points = [own[0], own[2], own[1], middle, far].map(local);
            let at = points.map(|point| point[0]);
            interpolation_weights(&at, x).zip(points).map(|(weight, point)| weight * point[1]).sum::<f64>() - y
        };
        let heights: Vec<f64> = neighbours.iter().map(height).collect();
        match heights[..] {
            [one] => one,
            [p, q] if p * q > 0.0 => p.signum() * p.abs().min(q.abs()),
            _ => 0.0,
        }
    }
}
