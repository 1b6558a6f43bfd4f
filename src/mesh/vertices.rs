//! Vertices of boundaries that are moved to given places, so that a solution is smooth in each cell beside them.
//!
//! Elements of high order converge fast where the solution is smooth. At an end of the contact, and where a gap has a kink, it is smooth on both sides, but
//! not in a cell that holds the place. A mesher knows only sizes, so that its mesh is changed afterwards.

use super::Mesh;
use crate::linalg::{axpy, dot, interpolation_weights, length, minus};
use std::collections::{HashMap, HashSet};

/// Least ratio of the area of a cell after a move to that before it. A vertex that moves by half of an edge along a boundary
/// halves that of a regular cell; an irregular one may have a half of what is left.
const AREA: f64 = 0.25;

/// Largest angle in radians between the two edges of a smooth boundary at their vertex. On a circle quadratic edges that turn by t each differ there by t^3/16,
/// which is 0.009 for twelve edges.
const SMOOTH: f64 = 0.02;

/// A vertex of a boundary in the plane with the two quadratic edges that meet there: their points in a row, mid-edge points included.
type Passage = [u32; 5];

impl Mesh<2> {
    /// Move the nearest vertex of each boundary that passes at one of the places to this place. The mesh has the order 2.
    ///
    /// A vertex moves along the curve of order four through the points of both edges by at most half an edge, once. It stays at corners, where other groups begin,
    /// where it has a name of its own or belongs to two bodies, and where a cell would become too small.
    pub fn move_vertices_to(&mut self, places: &[[f64; 3]]) {
        let passages = self.passages();
        let mut cells: HashMap<u32, Vec<[u32; 6]>> = HashMap::new();
        for cell in self.groups.iter().filter(|group| group.dimension == 2).flat_map(|group| group.simplices()) {
            let Ok(cell) = <[u32; 6]>::try_from(cell) else { continue };
            cell[..3].iter().for_each(|&vertex| cells.entry(vertex).or_default().push(cell));
        }
        let mut moved: HashSet<u32> = HashSet::new();
        for place in places {
            let place = [place[0] - self.datum[0], place[1] - self.datum[1]];
            for passage in &passages {
                if passage.iter().any(|point| moved.contains(point)) {
                    continue;
                }
                let (Some(points), Some(cells)) = (self.moved_passage(passage, place), cells.get(&passage[2])) else {
                    continue;
                };
                if self.set_passage(passage, points, cells) {
                    moved.extend(passage);
                }
            }
        }
    }

    /// Return the passages of all vertices that may move along a boundary, in the order of their numbers.
    fn passages(&self) -> Vec<Passage> {
        let mut groups_of: HashMap<[u32; 3], Vec<usize>> = HashMap::new();
        let (mut fixed, mut body_of) = (HashSet::new(), HashMap::new());
        for (index, group) in self.groups.iter().enumerate() {
            for simplex in group.simplices() {
                match *simplex {
                    [point] => {
                        fixed.insert(point);
                    }
                    [a, b, middle] => groups_of.entry([a.min(b), a.max(b), middle]).or_default().push(index),
                    // a vertex of two bodies or materials belongs to their interface
                    _ => fixed.extend(simplex.iter().filter(|&&point| *body_of.entry(point).or_insert(index) != index)),
                }
            }
        }
        let mut edges_at: HashMap<u32, Vec<[u32; 3]>> = HashMap::new();
        for edge in groups_of.keys() {
            edge[..2].iter().for_each(|&vertex| edges_at.entry(vertex).or_default().push(*edge));
        }
        let passage = |(&vertex, edges): (&u32, &Vec<[u32; 3]>)| {
            let &[first, second] = &edges[..] else { return None };
            let (first, second) = if first < second { (first, second) } else { (second, first) };
            let other = |edge: [u32; 3]| if edge[0] == vertex { edge[1] } else { edge[0] };
            let is_free = groups_of[&first] == groups_of[&second] && !fixed.contains(&vertex);
            is_free.then(|| [other(first), first[2], vertex, second[2], other(second)])
        };
        let mut passages: Vec<Passage> = edges_at
            .iter()
            .filter_map(passage)
            .filter(|passage| is_smooth(passage.map(|point| self.points[point as usize])))
            .collect();
        passages.sort_unstable_by_key(|passage| passage[2]);
        passages
    }

    /// Return the points of a passage with its vertex at `place`, or at the point of the curve that is nearest to it; none unless this vertex is the nearest
    /// one of its curve and the place less than an edge away from it.
    fn moved_passage(&self, passage: &Passage, place: [f64; 2]) -> Option<[[f64; 2]; 5]> {
        let points = passage.map(|point| self.points[point as usize]);
        let mut at = [0.0; 5];
        (1..5).for_each(|i| at[i] = at[i - 1] + length(minus(points[i], points[i - 1])));
        // differences from the first point keep a straight boundary straight to the last digit
        let curve = |s: f64| -> [f64; 2] {
            let mut x = points[0];
            for (weight, point) in interpolation_weights(&at, s).zip(points) {
                axpy(weight, &minus(point, points[0]), &mut x);
            }
            x
        };
        let along = minus(points[4], points[0]).map(|x| x / length(minus(points[4], points[0])));
        let mut s = at[2];
        for _ in 0..10 {
            s += dot(&minus(place, curve(s)), &along);
            // the nearest vertex of the curve is another one
            if s < at[1] || s > at[3] {
                return None;
            }
        }
        let nearest = curve(s);
        (length(minus(place, nearest)) < 0.5 * at[4])
            .then(|| [points[0], curve(0.5 * s), nearest, curve(0.5 * (s + at[4])), points[4]])
    }

    /// Give the points of a passage new places, and the other edges at its vertex straight shifts. Return false, and change nothing, if a cell at the vertex
    /// becomes too small.
    fn set_passage(&mut self, passage: &Passage, points: [[f64; 2]; 5], cells: &[[u32; 6]]) -> bool {
        let (vertex, step) = (passage[2], minus(points[2], self.points[passage[2] as usize]));
        let area = |cell: &[u32; 6], step: [f64; 2]| {
            let corner = |k: usize| -> [f64; 2] {
                let x = self.points[cell[k] as usize];
                if cell[k] == vertex { std::array::from_fn(|c| x[c] + step[c]) } else { x }
            };
            let (a, b) = (minus(corner(1), corner(0)), minus(corner(2), corner(0)));
            a[0] * b[1] - a[1] * b[0]
        };
        if !cells.iter().all(|cell| area(cell, step) >= AREA * area(cell, [0.0; 2])) {
            return false;
        }
        // mid-edge points of a triangle follow its vertices as 01 12 02
        let middles = |cell: &[u32; 6]| match cell[..3].iter().position(|&corner| corner == vertex) {
            Some(0) => [cell[3], cell[5]],
            Some(1) => [cell[3], cell[4]],
            _ => [cell[4], cell[5]],
        };
        let inner: HashSet<u32> = cells.iter().flat_map(middles).filter(|middle| !passage.contains(middle)).collect();
        for middle in inner {
            (0..2).for_each(|c| self.points[middle as usize][c] += 0.5 * step[c]);
        }
        passage.iter().zip(points).for_each(|(&point, x)| self.points[point as usize] = x);
        true
    }
}

/// Return whether the quadratic edges through points 0 to 2 and 2 to 4 have one tangent where they meet.
pub fn is_smooth(x: [[f64; 2]; 5]) -> bool {
    let before: [f64; 2] = std::array::from_fn(|c| 3.0 * x[2][c] - 4.0 * x[1][c] + x[0][c]);
    let after: [f64; 2] = std::array::from_fn(|c| 4.0 * x[3][c] - 3.0 * x[2][c] - x[4][c]);
    (before[0] * after[1] - before[1] * after[0]).atan2(dot(&before, &after)).abs() < SMOOTH
}

#[cfg(test)]
mod tests {
    use super::super::{Group, Mesh};
    use crate::problem::Order;

    /// Return `count` squares in a row, each two quadratic triangles, with the curve `top` of all and the curve `end` at the last edge. `shape` gives places.
    fn row(count: u32, shape: impl Fn([f64; 2]) -> [f64; 2]) -> Mesh<2> {
        let points = (0..=2 * count).flat_map(|i| (0..3).map(move |j| [f64::from(i), f64::from(j)].map(|x| 0.5 * x)));
        let at = |i: u32, j: u32| 3 * i + j;
        let (mut cells, mut top) = (Vec::new(), Vec::new());
        for i in (0..2 * count).step_by(2) {
            cells.extend([at(i, 0), at(i + 2, 0), at(i + 2, 2), at(i + 1, 0), at(i + 2, 1), at(i + 1, 1)]);
            cells.extend([at(i, 0), at(i + 2, 2), at(i, 2), at(i + 1, 1), at(i + 1, 2), at(i, 1)]);
            top.extend([at(i, 2), at(i + 2, 2), at(i + 1, 2)]);
        }
        let end = top[top.len() - 3..].to_vec();
        let group = |name: &str, dimension: usize, stride: usize, connectivity: Vec<u32>| Group {
            name: name.to_owned(),
            dimension,
            stride,
            connectivity,
            tags: Vec::new(),
        };
        let groups = vec![group("block", 2, 6, cells), group("top", 1, 3, top), group("end", 1, 3, end)];
        Mesh::new("row.msh".into(), points.map(shape).collect(), Order::P2, groups.into())
    }

    #[test]
    fn the_nearest_vertex_moves_along_a_straight_boundary() {
        let still = row(4, |x| x);
        let mut mesh = still.clone();
        mesh.move_vertices_to(&[[1.3, 1.1, 0.0]]);
        let changed: Vec<usize> = (0..still.points.len()).filter(|&i| mesh.points[i] != still.points[i]).collect();
        // the vertex at (1, 1), the middles of its edges on the boundary, and those of the edges to (0, 0) and (1, 0)
        assert_eq!(changed, [3 + 1, 3 + 2, 6 + 1, 6 + 2, 9 + 2]);
        assert!((mesh.points[6 + 2][0] - 1.3).abs() < 1e-12);
        for (index, at) in [(3 + 1, [0.65, 0.5]), (3 + 2, [0.65, 1.0]), (6 + 1, [1.15, 0.5]), (9 + 2, [1.65, 1.0])] {
            assert!((0..2).all(|c| (mesh.points[index][c] - at[c]).abs() < 1e-12), "{index} {:?}", mesh.points[index]);
        }
        assert!(mesh.points.iter().enumerate().all(|(i, x)| i % 3 < 2 || x[1] == 1.0));
    }

    /// A corner, a vertex where another group begins, and vertices far from the place stay.
    #[test]
    fn other_vertices_stay() {
        let still = row(4, |x| x);
        for place in [[0.3, 1.0, 0.0], [2.9, 1.0, 0.0], [3.8, 1.0, 0.0], [1.3, 9.0, 0.0]] {
            let mut mesh = still.clone();
            mesh.move_vertices_to(&[place]);
            assert_eq!(mesh.points, still.points, "{place:?}");
        }
        let bent = row(4, |[x, y]| [x, y - 0.05 * (x - 2.0).max(0.0)]);
        let mut mesh = bent.clone();
        mesh.move_vertices_to(&[[2.2, 0.99, 0.0]]);
        assert_eq!(mesh.points, bent.points);
    }

    /// On an arc the vertex and the middles of its edges stay on the arc, to the error of a curve of order four.
    #[test]
    fn vertices_move_along_an_arc() {
        let arc = |angle: f64, radius: f64| [radius * angle.sin(), radius * angle.cos()];
        let mut mesh = row(4, |[x, y]| arc(0.2 * x, 1.0 + y));
        let place = arc(0.2 * 1.7, 2.0);
        mesh.move_vertices_to(&[[place[0], place[1], 0.0]]);
        let moved = [9, 12, 15].map(|first| mesh.points[first + 2]);
        for x in moved {
            assert!((x[0].hypot(x[1]) - 2.0).abs() < 1e-6, "{x:?}");
        }
        assert!((0..2).all(|c| (moved[1][c] - place[c]).abs() < 1e-6), "{moved:?}");
        let angle = |x: [f64; 2]| x[0].atan2(x[1]) / 0.2;
        assert!((angle(moved[0]) - 1.35).abs() < 1e-3 && (angle(moved[2]) - 2.35).abs() < 1e-3, "{moved:?}");
    }
}
