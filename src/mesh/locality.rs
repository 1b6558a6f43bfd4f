//! What lies near each other in space stays together: an order of cells in memory, and a partition of points over
//! ranks.
//!
//! Gmsh lists tetrahedra in the order in which its Delaunay kernel found them, and nodes are numbered in the order of
//! the cells. A product with the stiffness matrix then jumps through memory. With cells in the order of Morton's curve
//! through their centres it does not.
//!
//! Points are partitioned by recursive bisection of coordinates. Points of two bodies that lie together in a contact
//! are in the same part, or in neighbouring parts. Iterations of all linear steps with hypre on 1, 2, 3, 5, 8 ranks:
//! groove3d n = 24 50, 53, 54, 54, 54; hertz-sphere n = 26, edge = 1, P1 53, 58, 57, 52, 55; flange 110, 109, 109, 113,
//! 107. Partitions by METIS of the graph of the nodes took as many, within some per cent.

use super::{Group, Mesh};
use crate::linalg::{bounds, pad};
use std::cmp::Ordering;
use std::ops::Range;

/// Bits of a coordinate in a position on the curve. Three coordinates fit 64 bits.
const BITS: u32 = 21;

impl<const D: usize> Mesh<D> {
    /// Sort the cells of each group along Morton's curve. Structured meshes in the plane already have a good order, so
    /// only cells in space are sorted.
    pub fn sort_cells(&mut self) {
        if D < 3 {
            return;
        }
        let [low, high] = bounds(self.points.iter().copied().map(pad));
        let size = (0..D).map(|c| high[c] - low[c]).fold(f64::MIN_POSITIVE, f64::max);
        let scale = f64::from((1u32 << BITS) - 1) / size;
        let points = &self.points;
        for group in self.groups.iter_mut().filter(|group| group.dimension == D) {
            sort(group, |cell| {
                let centre = |c: usize| cell[..=D].iter().map(|&p| points[p as usize][c]).sum::<f64>() / (D + 1) as f64;
                (0..D).fold(0, |place, c| place | spread(((centre(c) - low[c]) * scale) as u64) << c)
            });
        }
    }
}

/// Sort the simplices of a group by a key. Simplices with equal keys keep their order.
fn sort(group: &mut Group, key: impl Fn(&[u32]) -> u64) {
    let mut order: Vec<(u64, u32)> = group.simplices().zip(0..).map(|(simplex, i)| (key(simplex), i)).collect();
    order.sort_unstable();
    let old = std::mem::take(&mut group.connectivity);
    group.connectivity =
        order.iter().flat_map(|&(_, i)| &old[i as usize * group.stride..][..group.stride]).copied().collect();
    if !group.tags.is_empty() {
        group.tags = order.iter().map(|&(_, i)| group.tags[i as usize]).collect();
    }
}

/// Return a number with two zeros inserted before each of its bits.
fn spread(x: u64) -> u64 {
    (0..BITS).fold(0, |spread, bit| spread | (x >> bit & 1) << (3 * bit))
}

/// Return the part of each point, from 0 to `parts - 1`. All points are cut across the longest side of the box around
/// them, then those on either side likewise. Each cut divides the weight in proportion to the parts on its sides, to
/// within the weight of one point.
pub fn bisect<const D: usize>(points: &[[f64; D]], weight: &[u32], parts: usize) -> Vec<u32> {
    let mut part_of = vec![0; points.len()];
    let all: Vec<u32> = (0..points.len() as u32).collect();
    let mut pieces: Vec<(Vec<u32>, Range<usize>)> = vec![(all, 0..parts)];
    while let Some((mut own, parts)) = pieces.pop() {
        if parts.len() <= 1 {
            own.iter().for_each(|&point| part_of[point as usize] = parts.start as u32);
            continue;
        }
        let middle = parts.start + parts.len() / 2;
        let axis = longest(own.iter().map(|&point| points[point as usize]));
        let total: u64 = own.iter().map(|&point| u64::from(weight[point as usize])).sum();
        let share = total * (parts.len() / 2) as u64 / parts.len() as u64;
        own.sort_unstable_by(|&a, &b| compare(axis, (&points[a as usize], a), (&points[b as usize], b)));
        let mut below = 0;
        let is_above = |point: &u32| {
            below += u64::from(weight[*point as usize]);
            below > share
        };
        let above = own.split_off(own.iter().position(is_above).unwrap_or(own.len()));
        pieces.push((own, parts.start..middle));
        pieces.push((above, middle..parts.end));
    }
    part_of
}

/// Return the axis of the longest side of the box around points.
fn longest<const D: usize>(points: impl Iterator<Item = [f64; D]>) -> usize {
    let [low, high] = bounds(points.map(pad));
    (0..D).rev().max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0)
}

/// Compare two points, given with their numbers, along an axis. Points with equal coordinates are compared along the
/// other axes, and then by number.
fn compare<const D: usize>(axis: usize, a: (&[f64; D], u32), b: (&[f64; D], u32)) -> Ordering {
    let along = (0..D).map(|k| (axis + k) % D).map(|c| a.0[c].total_cmp(&b.0[c]));
    along.fold(Ordering::Equal, Ordering::then).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::order::Order;

    /// Tetrahedra on a line, in an order that jumps.
    #[test]
    fn neighbours_come_one_after_the_other() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let cell = |i: u8| corners.map(|x: [f64; 3]| [x[0] + f64::from(i), x[1], x[2]]);
        let points = [3, 0, 2, 1].into_iter().flat_map(cell).collect();
        let (name, connectivity, tags) = ("body".into(), (0..16).collect(), vec![7, 8, 9, 10]);
        let group = Group { name, dimension: 3, stride: 4, connectivity, tags };
        let mut mesh = Mesh::new("line.msh".into(), points, Order::P1, vec![group].into());
        mesh.sort_cells();
        let first: Vec<f64> = mesh.groups[0].simplices().map(|cell| mesh.points[cell[0] as usize][0]).collect();
        assert_eq!((first, &mesh.groups[0].tags[..]), (vec![0.0, 1.0, 2.0, 3.0], &[8, 10, 9, 7][..]));
        assert!(mesh.groups[0].simplices().all(|cell| cell[1] == cell[0] + 1 && cell[3] == cell[0] + 3));
    }

    /// A long box is cut across. A plane of points that does not belong to one part as a whole is cut along the next
    /// axis. Parts have equal weights to within those of a few points, and do not depend on the order of the points.
    #[test]
    fn boxes_are_cut_across() {
        let points: Vec<[f64; 3]> =
            (0..480).map(|i| [f64::from(i % 4), f64::from(i / 4 % 5), f64::from(i / 20)]).collect();
        let parts = |points: &[[f64; 3]], count| bisect(points, &vec![1; points.len()], count);
        assert!(points.iter().zip(&parts(&points, 2)).all(|(x, &half)| (x[2] < 12.0) == (half == 0)));
        let fifths = parts(&points, 5);
        assert!((0..5).all(|part| fifths.iter().filter(|&&of| of == part).count() == 96));
        let back: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        assert!(parts(&back, 5).iter().rev().eq(&fifths));
        let weights: Vec<u32> = (0..480).map(|number| number % 5 + number / 160).collect();
        for count in [2, 3, 8, 13] {
            let mut sums = vec![0; count];
            bisect(&points, &weights, count)
                .iter()
                .zip(&weights)
                .for_each(|(&part, weight)| sums[part as usize] += weight);
            let (least, most) = (sums.iter().min().expect("parts"), sums.iter().max().expect("parts"));
            assert!(most - least < 30, "{sums:?}");
        }
        // Two points at the same position may be in two parts, and more parts than points leave some parts empty.
        assert_eq!(bisect(&[[0.0, 0.0]; 2], &[1, 1], 2), [0, 1]);
        assert!(bisect::<2>(&[], &[], 3).is_empty());
    }
}
