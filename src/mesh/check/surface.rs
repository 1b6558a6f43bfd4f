//! The boundary of a body. It must not meet itself, and behind each of its closed surfaces there is one cell.

use super::faces::{Cells, Face, NONE};
use crate::error::Result;
use crate::linalg::{self, DisjointSets, cross, dot, length, minus};
use robust::Coord3D;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Share of a facet's size below which two facets touch. It is ten times the error with which Gmsh places nodes.
const TOUCH: f64 = 1e-9;

/// Number of pieces of the edge of a curved facet in a close comparison.
const FINE: usize = 8;

/// The facets of the boundary of a body, with a search tree of their boxes.
pub struct BoundarySurface<'a, const D: usize> {
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
struct FlatFacet {
    /// Corners; a segment has the last one twice.
    x: [Point; 3],
    /// Nodes of the corners, or [`NONE`] where a corner is not a node.
    node: [u32; 3],
}

impl<'a, const D: usize> BoundarySurface<'a, D> {
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

    fn facet(&self, i: usize) -> &[u32] {
        &self.nodes[i * self.stride..][..self.stride]
    }

    /// Return the indices of the facets whose boxes meet the box from `low` to `high`.
    fn near(&self, low: Point, high: Point) -> impl Iterator<Item = usize> + '_ {
        let found = self.tree.locate_in_envelope_intersecting(AABB::from_corners(low, high));
        found.map(|found| found.data as usize)
    }

    /// Return the corners of the flat pieces of a facet between its nodes. A linear facet is one piece. With mid-edge nodes
    /// there are two segments or four triangles.
    fn flat(&self, i: usize) -> impl Iterator<Item = [Point; D]> + '_ {
        self.pieces(i).map(|piece| std::array::from_fn(|k| piece.x[k]))
    }

    fn pieces(&self, i: usize) -> impl Iterator<Item = FlatFacet> + '_ {
        const SPLIT: [&[[usize; 3]]; 4] =
            [&[[0, 1, 1]], &[[0, 2, 2], [2, 1, 1]], &[[0, 1, 2]], &[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]];
        let facet = self.facet(i);
        let split = SPLIT[2 * (D - 2) + usize::from(self.cells.is_quadratic())];
        split.iter().map(move |corners| {
            let node = corners.map(|k| facet[k]);
            FlatFacet { x: node.map(|node| self.cells.at(node)), node }
        })
    }

    /// Return the pieces of a curved facet that has no node in common with the facet to which it is compared.
    fn fine_pieces(&self, i: usize) -> Vec<FlatFacet> {
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
        let piece = |corners: [[usize; 2]; 3]| FlatFacet { x: corners.map(|[i, j]| at(i, j)), node: [NONE; 3] };
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
            let slack = TOUCH * apart(low, high);
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
        let other: Vec<FlatFacet> = self.pieces(j).collect();
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
            TOUCH * apart(low, high)
        };
        let slack = size(i).max(size(j));
        let own = |i: usize, j: usize| self.facet(i).iter().copied().filter(move |node| !self.facet(j).contains(node));
        let twin = own(i, j).find(|&a| own(j, i).any(|b| apart(self.cells.at(a), self.cells.at(b)) <= slack));
        if let Some(node) = twin {
            let what = "cells touch each other with nodes of their own, which leaves a crack";
            return self.cells.refuse(what, &cells, self.cells.at(node)).help(
                "let them share the nodes (in the script: `Coherence;`), draw the crack open, or make bodies of the connected parts: \
                 `split = true` in the table of the body",
            );
        }
        let on = |node: u32, j: usize| {
            self.pieces(j).any(|piece| match D {
                2 => from_segment(self.cells.at(node), [piece.x[0], piece.x[1]]) <= slack,
                _ => from_triangle(self.cells.at(node), piece.x) <= slack,
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

    /// Check that every closed surface of the boundary has the body on one side and nothing on the other. Behind one facet of each
    /// surface there must be one cell. There would be two if a part was meshed again inside another one.
    ///
    /// # Errors
    /// The number of cells behind a facet is not one.
    pub fn check_nesting(&self) -> Result<()> {
        let cells = self.cells;
        let mut joined = DisjointSets::new(cells.node_count());
        for i in 0..self.faces.len() {
            let facet = self.facet(i);
            (1..D).for_each(|k| joined.join(facet[0], facet[k]));
        }
        let (count, closed) = joined.classes();
        let mut seen = vec![false; count];
        let first = (0..self.faces.len()).filter(|&i| {
            let class = closed[self.facet(i)[0] as usize] as usize;
            !std::mem::replace(&mut seen[class], true)
        });
        for i in first.collect::<Vec<_>>() {
            let cell = self.faces[i].cell();
            let inside = |weights: &[f64; 4]| -> Point {
                let sum: f64 = weights[..=D].iter().sum();
                let corners = cells.cell(cell)[..=D].iter().zip(weights);
                corners.fold([0.0; 3], |x, (&node, weight)| {
                    std::array::from_fn(|c| x[c] + weight / sum * cells.at(node)[c])
                })
            };
            // A line that meets an edge decides nothing. The same holds in a thin curved cell for a point that its chords leave
            // outside.
            let counts: Vec<i32> = INSIDE.iter().filter_map(|weights| self.covers(inside(weights))).collect();
            if counts.iter().all(|&count| count != 1) && !counts.is_empty() {
                let what = format!("{} cells lie over each other", counts[0].max(2));
                let help = "a part of the body was meshed twice: correct the geometry, or make bodies of its parts";
                return Err(cells.refuse(&what, &[cell], inside(&INSIDE[0])).help(help));
            }
        }
        Ok(())
    }

    /// Return how many times the boundary goes around a point, which is the number of cells of positive volume that cover it. The
    /// crossings of the line from the point to larger x are counted, outwards minus inwards. Return `None` if the line meets an
    /// edge of a facet.
    fn covers(&self, from: Point) -> Option<i32> {
        let mut far = from;
        far[0] = f64::MAX;
        let mut count = 0;
        for piece in self.near(from, far).flat_map(|i| self.flat(i)) {
            count += if D == 2 {
                line(from, piece[0], piece[1])
            } else {
                triangle(from, [piece[0], piece[1], piece[2 % D]])?
            };
        }
        Some(count)
    }
}

/// Return the box around nodes.
fn bounds<const D: usize>(nodes: &[u32], cells: &Cells<D>) -> [Point; 2] {
    linalg::bounds(nodes.iter().map(|&node| cells.at(node)))
}

/// Return whether two pieces meet except in the corners that they share.
fn meet<const D: usize>(a: &FlatFacet, b: &FlatFacet) -> bool {
    let largest = |piece: &FlatFacet| {
        let [p, q, r] = piece.x;
        apart(p, q).max(apart(q, r)).max(apart(r, p))
    };
    let within = TOUCH * largest(a).max(largest(b));
    let low = |piece: &FlatFacet, c: usize| piece.x.iter().map(|x| x[c]).fold(f64::INFINITY, f64::min);
    let high = |piece: &FlatFacet, c: usize| piece.x.iter().map(|x| x[c]).fold(f64::NEG_INFINITY, f64::max);
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
        (2, 0) => segments([p.x[0], p.x[1]], [q.x[0], q.x[1]], within),
        (2, 1) => from_segment(p.x[1], [q.x[0], q.x[1]]) <= within || from_segment(q.x[1], [p.x[0], p.x[1]]) <= within,
        (3, 0) => {
            let edges = |x: [Point; 3]| [[x[0], x[1]], [x[1], x[2]], [x[2], x[0]]];
            edges(p.x).into_iter().any(|edge| segment_triangle(edge, q.x, within))
                || edges(q.x).into_iter().any(|edge| segment_triangle(edge, p.x, within))
        }
        (3, 1) => segment_triangle([p.x[1], p.x[2]], q.x, within) || segment_triangle([q.x[1], q.x[2]], p.x, within),
        (3, 2) => same_side([p.x[0], p.x[1]], p.x[2], q.x[2], TOUCH),
        _ => true,
    }
}

/// Weights of the corners of a cell for points inside it. These points lie on no line or plane through other nodes.
const INSIDE: [[f64; 4]; 5] = [
    [0.2718, 0.2357, 0.2583, 0.2342],
    [0.2236, 0.2646, 0.2449, 0.2669],
    [0.3142, 0.1732, 0.2824, 0.2302],
    [0.1414, 0.3317, 0.2513, 0.2756],
    [0.2887, 0.2079, 0.1619, 0.3415],
];

/// Return the crossing of a segment that has the body on its left. The upper end does not belong to the segment, so that two
/// segments with a common end do not both count it.
fn line(from: Point, a: Point, b: Point) -> i32 {
    if (a[1] > from[1]) == (b[1] > from[1]) {
        return 0;
    }
    let x = a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
    if x > from[0] { (b[1] - a[1]).signum() as i32 } else { 0 }
}

/// Return the crossing of a triangle whose normal points out of the body. At its edges return `None`.
fn triangle(from: Point, x: [Point; 3]) -> Option<i32> {
    let x = x.map(|x| minus(x, from));
    // These are twice the areas in the plane across the line.
    let areas = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| x[i][1] * x[j][2] - x[i][2] * x[j][1]);
    let size = x.iter().flat_map(|x| &x[1..]).fold(0.0, |max: f64, x| max.max(x.abs()));
    let side = |area: &f64| if area.abs() <= 1e-12 * size * size { 0 } else { area.signum() as i32 };
    let sides = areas.each_ref().map(side);
    if sides.contains(&1) && sides.contains(&-1) {
        return Some(0);
    }
    if sides.contains(&0) {
        return None;
    }
    let normal = cross(minus(x[1], x[0]), minus(x[2], x[0]));
    // The line meets the plane of the triangle ahead of the point if this x is positive.
    let ahead = dot(&normal, &x[0]) / normal[0] > 0.0;
    Some(if ahead { sides[0] } else { 0 })
}

/// A point (x, y, z).
type Point = [f64; 3];

/// Return the distance of two points.
fn apart(a: Point, b: Point) -> f64 {
    length(minus(a, b))
}

fn between(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

/// Return the distance of a point from a segment.
fn from_segment(x: Point, [a, b]: [Point; 2]) -> f64 {
    let edge = minus(b, a);
    let t = (dot(&minus(x, a), &edge) / dot(&edge, &edge)).clamp(0.0, 1.0);
    apart(x, between(a, b, t))
}

/// Return whether the distance of two segments is at most `within`.
fn segments([a, b]: [Point; 2], [c, d]: [Point; 2], within: f64) -> bool {
    let ends =
        from_segment(a, [c, d]).min(from_segment(b, [c, d])).min(from_segment(c, [a, b])).min(from_segment(d, [a, b]));
    if ends <= within {
        return true;
    }
    // The least distance is that of an end, or that of the lines if both feet lie inside the segments.
    let (u, v, w) = (minus(b, a), minus(d, c), minus(a, c));
    let (uu, uv, vv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((uv * dot(&v, &w) - vv * dot(&u, &w)) / det, (uu * dot(&v, &w) - uv * dot(&u, &w)) / det);
    let inside = |t: f64| (0.0..=1.0).contains(&t);
    inside(s) && inside(t) && apart(between(a, b, s), between(c, d, t)) <= within
}

/// Return the distance of a point from a triangle.
fn from_triangle(x: Point, [a, b, c]: [Point; 3]) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    let inner = |p: Point, q: Point| dot(&cross(minus(q, p), minus(x, p)), &normal) >= 0.0;
    if inner(a, b) && inner(b, c) && inner(c, a) {
        return dot(&minus(x, a), &normal).abs() / length(normal);
    }
    from_segment(x, [a, b]).min(from_segment(x, [b, c])).min(from_segment(x, [c, a]))
}

/// Return the side of the plane through three points on which a fourth one lies. The sign is free of rounding errors, and zero
/// in the plane.
fn side([a, b, c]: [Point; 3], x: Point) -> f64 {
    let [a, b, c, x] = [a, b, c, x].map(|[x, y, z]| Coord3D { x, y, z });
    robust::orient3d(a, b, c, x)
}

/// Return whether a segment has a point of a triangle between its ends. In a flat boundary all determinants vanish except for
/// rounding. The sign of a rounded one tells nothing, so exact signs are needed.
fn pierces([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let ends = [p, q].map(|x| side([a, b, c], x));
    if !(ends[0] < 0.0 && ends[1] > 0.0 || ends[0] > 0.0 && ends[1] < 0.0) {
        return false;
    }
    let sides = [[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u], v));
    sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
}

/// Return whether the distance of a segment and a triangle is at most `within`.
fn segment_triangle([p, q]: [Point; 2], [a, b, c]: [Point; 3], within: f64) -> bool {
    let normal = cross(minus(b, a), minus(c, a));
    let size = length(normal);
    let [from, to] = [p, q].map(|x| dot(&minus(x, a), &normal));
    if from.min(to) > within * size || from.max(to) < -within * size {
        return false;
    }
    pierces([p, q], [a, b, c])
        || from_triangle(p, [a, b, c]) <= within
        || from_triangle(q, [a, b, c]) <= within
        || [[a, b], [b, c], [c, a]].into_iter().any(|edge| segments([p, q], edge, within))
}

/// Return whether the half-planes from the line ab through c and through d coincide to within a small angle.
fn same_side([a, b]: [Point; 2], c: Point, d: Point, angle: f64) -> bool {
    let edge = minus(b, a);
    let across = |x: Point| {
        let t = dot(&minus(x, a), &edge) / dot(&edge, &edge);
        minus(x, between(a, b, t))
    };
    let (c, d) = (across(c), across(d));
    let sine = cross(c, d);
    dot(&c, &d) > 0.0 && dot(&sine, &sine) <= angle * angle * dot(&c, &c) * dot(&d, &d)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Point; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn segments_meet_at_ends_and_inside() {
        let a = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert!(segments(a, [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0]], 1e-9));
        assert!(segments(a, [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], 1e-9));
        assert!(segments(a, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], 1e-9));
        assert!(!segments(a, [[1.0, -1.0, 1e-3], [1.0, 1.0, 1e-3]], 1e-9));
        assert!(segments(a, [[1.0, -1.0, 1e-3], [1.0, 1.0, 1e-3]], 2e-3));
        assert!(!segments(a, [[3.0, -1.0, 0.0], [3.0, 1.0, 0.0]], 0.5));
        assert!(!segments(a, [[0.0, 1e-3, 0.0], [2.0, 1e-3, 0.0]], 1e-9));
    }

    #[test]
    fn segments_meet_triangles() {
        let meets = |p: Point, q: Point| segment_triangle([p, q], TRIANGLE, 1e-9);
        assert!(meets([0.2, 0.2, -1.0], [0.2, 0.2, 1.0]));
        assert!(meets([0.2, 0.2, 0.0], [0.2, 0.2, 1.0]));
        assert!(meets([-1.0, 0.5, 0.0], [2.0, 0.5, 0.0]));
        assert!(meets([0.5, -1.0, -1.0], [0.5, 1.0, 1.0]));
        assert!(!meets([0.2, 0.2, 1e-3], [0.2, 0.2, 1.0]));
        assert!(!meets([0.8, 0.8, -1.0], [0.8, 0.8, 1.0]));
        assert!(!meets([-1.0, 1.5, 0.0], [2.0, 1.5, 0.0]));
    }

    /// The plane is turned so that no coordinate is exact. Its triangles meet where their corners say so and nowhere else.
    #[test]
    fn triangles_of_a_turned_plane() {
        let (u, v) = ([0.6, 0.37, -0.709_295_425_052_062_4], [0.1, 0.83, 0.517_559_123_1]);
        let point = |s: f64, t: f64| -> Point { std::array::from_fn(|c| 0.123 + s * u[c] + t * v[c]) };
        let mut meeting = [0; 2];
        for k in 0..40_000 {
            // The segment lies at s + t > 1; in every second case it enters the triangle.
            let [i, j, m] = [k % 37, k / 37 % 37, k / 1369].map(|i| f64::from(i) / 37.0);
            let enters = k % 2 == 0;
            let ends =
                [point(1.0 + i, 0.1 + j), if enters { point(0.3 * m, 0.3 * j) } else { point(0.1 + m, 1.0 + i) }];
            let found = segment_triangle(ends, [point(0.0, 0.0), point(1.0, 0.0), point(0.0, 1.0)], 1e-9);
            assert_eq!(found, enters, "{k}");
            meeting[usize::from(found)] += 1;
        }
        assert!(meeting.iter().all(|&count| count > 1000), "{meeting:?}");
    }

    #[test]
    fn half_planes_are_told_by_their_angle() {
        let edge = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert!(same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-11], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-6], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], 1e-9));
    }
}
