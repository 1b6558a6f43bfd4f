//! Vertices of boundaries that are moved to given places, so that a solution is smooth in each cell beside them.
//!
//! Elements of high order converge fast where the solution is smooth. At an end of the contact, and where a gap has a
//! kink, it is smooth on both sides, but not in a cell that holds the place. A mesher knows only sizes, so that its
//! mesh is changed afterwards.

use super::shape::turned;
use super::{Mesh, edges};
use crate::linalg::{axpy, dot, interpolation_weights, length, minus, unit};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Least ratio of the area of a cell after a move to that before it. A vertex that moves by half of an edge along a
/// boundary halves that of a regular cell; an irregular one may have a half of what is left.
const AREA: f64 = 0.25;

/// Largest angle in radians between the two edges of a smooth boundary at their vertex. On a circle quadratic edges
/// that turn by t each differ there by t^3/16, which is 0.009 for twelve edges, and those of higher orders by less.
const SMOOTH: f64 = 0.02;

/// A vertex of a boundary in the plane with the two edges that meet there: their points in a row, the vertex in the
/// middle.
type Passage = Vec<u32>;

impl Mesh<2> {
    /// Move the nearest vertex of each boundary that passes at one of the places to this place. The mesh has an order
    /// above one.
    ///
    /// A vertex moves along the curves of both edges by at most half an edge, once. It stays at corners, where other
    /// groups begin, where it has a name of its own or belongs to two bodies, and where a cell would become too small.
    pub fn move_vertices_to(&mut self, places: &[[f64; 3]]) {
        let passages = self.passages();
        let mut cells: HashMap<u32, Vec<Vec<u32>>> = HashMap::new();
        for cell in self.groups.iter().filter(|group| group.dimension == 2).flat_map(|group| group.simplices()) {
            cell[..3].iter().for_each(|&vertex| cells.entry(vertex).or_default().push(cell.to_vec()));
        }
        let mut moved: HashSet<u32> = HashSet::new();
        for place in places {
            let place = [place[0] - self.datum[0], place[1] - self.datum[1]];
            for passage in &passages {
                if passage.iter().any(|point| moved.contains(point)) {
                    continue;
                }
                let (Some(points), Some(cells)) =
                    (self.moved_passage(passage, place), cells.get(&passage[self.order.degree()]))
                else {
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
        let mut groups_of: HashMap<Vec<u32>, Vec<usize>> = HashMap::new();
        let (mut fixed, mut body_of) = (HashSet::<u32>::new(), HashMap::new());
        for (index, group) in self.groups.iter().enumerate() {
            for simplex in group.simplices() {
                match group.dimension {
                    0 => fixed.extend(simplex),
                    1 => groups_of.entry(row(simplex)).or_default().push(index),
                    // a vertex of two bodies or materials belongs to their interface
                    _ => fixed.extend(simplex.iter().filter(|&&point| *body_of.entry(point).or_insert(index) != index)),
                }
            }
        }
        let mut edges_at: HashMap<u32, Vec<&Vec<u32>>> = HashMap::new();
        for edge in groups_of.keys() {
            [edge[0], edge[edge.len() - 1]].into_iter().for_each(|end| edges_at.entry(end).or_default().push(edge));
        }
        let passage = |(&vertex, edges): (&u32, &Vec<&Vec<u32>>)| {
            let &[first, second] = &edges[..] else { return None };
            let is_free = groups_of[first] == groups_of[second] && !fixed.contains(&vertex);
            let [before, after] = [first.min(second), first.max(second)];
            let after = turned(after, after[0] != vertex).into_iter().skip(1);
            is_free.then(|| turned(before, before[0] == vertex).into_iter().chain(after).collect::<Passage>())
        };
        let mut passages: Vec<Passage> =
            edges_at.iter().filter_map(passage).filter(|passage| is_smooth(&self.places(passage))).collect();
        passages.sort_unstable_by_key(|passage| passage[self.order.degree()]);
        passages
    }

    /// Return the places of points.
    fn places(&self, points: &[u32]) -> Vec<[f64; 2]> {
        points.iter().map(|&point| self.points[point as usize]).collect()
    }

    /// Return the points of a passage with its vertex at `place`, or at the point of the curve that is nearest to it;
    /// none unless this vertex is the nearest one of its curve and the place less than an edge away from it.
    ///
    /// Each edge is a polynomial of its order over the chord of both, and the points of the new edges are equally
    /// spaced along this chord.
    fn moved_passage(&self, passage: &Passage, place: [f64; 2]) -> Option<Vec<[f64; 2]>> {
        let (points, degree) = (self.places(passage), self.order.degree());
        let first = points[0];
        let along = unit(minus(points[2 * degree], first));
        let at: Vec<f64> = points.iter().map(|&x| dot(&minus(x, first), &along)).collect();
        let whole = at[2 * degree];
        if !at.is_sorted_by(|a, b| a < b) {
            return None;
        }
        // differences from the first point keep a straight boundary straight to the last digit
        let curve = |s: f64| -> [f64; 2] {
            let edge = if s < at[degree] { 0..=degree } else { degree..=2 * degree };
            let mut x = first;
            for (weight, point) in interpolation_weights(&at[edge.clone()], s).zip(&points[edge]) {
                axpy(weight, &minus(*point, first), &mut x);
            }
            x
        };
        let mut s = at[degree];
        for _ in 0..10 {
            s += dot(&minus(place, curve(s)), &along);
            // the nearest vertex of the curve is another one
            if s < 0.5 * at[degree] || s > 0.5 * (at[degree] + whole) {
                return None;
            }
        }
        let share = |k: usize| k as f64 / degree as f64;
        let along_chord = |k: usize| if k < degree { share(k) * s } else { s + share(k - degree) * (whole - s) };
        (length(minus(place, curve(s))) < 0.5 * whole)
            .then(|| (0..=2 * degree).map(|k| curve(along_chord(k))).collect())
    }

    /// Give the points of a passage new places, and the other edges at its vertex straight shifts. Return false, and
    /// change nothing, if a cell at the vertex becomes too small.
    fn set_passage(&mut self, passage: &Passage, points: Vec<[f64; 2]>, cells: &[Vec<u32>]) -> bool {
        let degree = self.order.degree();
        let vertex = passage[degree];
        let step = minus(points[degree], self.points[vertex as usize]);
        let area = |cell: &[u32], step: [f64; 2]| {
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
        let mut inner: BTreeMap<u32, f64> = BTreeMap::new();
        for cell in cells {
            for (ends, inside) in edges(cell, 2) {
                let Some(end) = ends.iter().position(|&end| cell[end] == vertex) else { continue };
                let share = |k: usize| if end == 1 { k } else { degree - k } as f64 / degree as f64;
                let points = (1..).zip(inside).filter(|(_, point)| !passage.contains(point));
                inner.extend(points.map(|(k, &point)| (point, share(k))));
            }
        }
        for (point, share) in inner {
            (0..2).for_each(|c| self.points[point as usize][c] += share * step[c]);
        }
        // the ends stay to the last digit
        passage.iter().zip(points).skip(1).take(2 * degree - 1).for_each(|(&at, x)| self.points[at as usize] = x);
        true
    }
}

/// Return the points of an edge in a row from the end with the smaller number.
fn row(edge: &[u32]) -> Vec<u32> {
    turned(&[&edge[..1], &edge[2..], &edge[1..2]].concat(), edge[0] > edge[1]).into_vec()
}

/// Return whether the two edges through points in a row have one tangent in the middle, where they meet.
fn is_smooth(x: &[[f64; 2]]) -> bool {
    let degree = x.len() / 2;
    // the derivative of the polynomial at 0 has the weights -(-1)^r C(k, r)/r at the points r = 1, ..., k of
    // differences from the first one
    let tangent = |at: &dyn Fn(usize) -> [f64; 2]| {
        let (mut tangent, mut binomial) = ([0.0; 2], -1.0);
        for r in 1..=degree {
            binomial *= -((degree + 1 - r) as f64) / r as f64;
            axpy(binomial / r as f64, &minus(at(r), at(0)), &mut tangent);
        }
        tangent
    };
    let (before, after) = (tangent(&|r| x[degree - r]).map(|x| -x), tangent(&|r| x[degree + r]));
    (before[0] * after[1] - before[1] * after[0]).atan2(dot(&before, &after)).abs() < SMOOTH
}

#[cfg(test)]
mod tests {
    use super::super::{Group, Mesh};
    use super::{length, minus};
    use crate::problem::Order;

    /// Return `count` squares in a row, each two quadratic triangles, with the curve `top` of all and the curve `end`
    /// at the last edge. `shape` gives places.
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

    /// On an arc the vertex and the points of its edges stay on the arc, to the error of polynomials of the order of
    /// the mesh, and nothing folds.
    #[test]
    fn vertices_move_along_an_arc() {
        let arc = |angle: f64, radius: f64| [radius * angle.sin(), radius * angle.cos()];
        for (degree, most) in [(2, 2e-4), (3, 1e-5), (4, 1e-6), (6, 1e-9), (8, 1e-11)] {
            let mut still = row(4, |x| x).lower_order().higher_order(Order::new(degree).unwrap());
            still.points.iter_mut().for_each(|x| *x = arc(0.2 * x[0], 1.0 + x[1]));
            let mut mesh = still.clone();
            let place = arc(0.2 * 1.7, 2.0);
            mesh.move_vertices_to(&[[place[0], place[1], 0.0]]);
            let top = mesh.group("top").unwrap();
            let off = |point: &u32| {
                let [x, y] = mesh.points[*point as usize];
                (x.hypot(y) - 2.0).abs()
            };
            let largest = top.connectivity.iter().map(off).fold(0.0, f64::max);
            assert!(largest < most, "{degree}: {largest}");
            let nearest = top.connectivity.iter().map(|&point| length(minus(mesh.points[point as usize], place)));
            assert!(nearest.fold(1.0, f64::min) < most, "{degree}");
            let changed = (0..still.points.len()).filter(|&i| mesh.points[i] != still.points[i]).count();
            // the vertex, and the points inside the edges of the boundary and of three others beside it
            assert_eq!(changed, 1 + 4 * (degree - 1), "{degree}");
            mesh.straighten();
            assert_eq!(mesh.straightened, 0, "{degree}");
        }
    }
}
