//! A partition of points over ranks: recursive bisection of coordinates.
//!
//! Points of two bodies that lie together in a contact are in the same part, or in neighbouring parts.
//!
//! Iterations of all linear steps with hypre on 1, 2, 3, 5, 8 ranks: groove3d n = 24 50, 53, 54, 54, 54; hertz-sphere n = 26,
//! edge = 1, P1 53, 58, 57, 52, 55; flange 110, 109, 109, 113, 107. Partitions by METIS of the graph of the nodes took as many,
//! within some per cent.

use crate::linalg::{bounds, pad};
use std::cmp::Ordering;
use std::ops::Range;

/// Return the part of each point, from 0 to `parts - 1`. All points are cut across the longest side of the box around them,
/// then those on either side likewise. Each cut divides the weight in proportion to the parts on its sides, to within the
/// weight of one point.
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
        let along = |a: &u32, b: &u32| compare(axis, (&points[*a as usize], *a), (&points[*b as usize], *b));
        let below = split(&mut own, share, &|point| u64::from(weight[point as usize]), &along);
        let above = own.split_off(below);
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

/// Move the first points of an order to the front, as many as together weigh no more than `share`, and return their number. The
/// time is linear, since each step halves the range in which the last of these points may be.
fn split(points: &mut [u32], share: u64, weight: &dyn Fn(u32) -> u64, order: &dyn Fn(&u32, &u32) -> Ordering) -> usize {
    let (mut open, mut before) = (0..points.len(), 0);
    while !open.is_empty() {
        let middle = open.start + open.len() / 2;
        points[open.clone()].select_nth_unstable_by(middle - open.start, order);
        let below = before + points[open.start..middle].iter().map(|&point| weight(point)).sum::<u64>();
        let with_middle = below + weight(points[middle]);
        if below > share {
            open.end = middle;
        } else if with_middle > share {
            return middle;
        } else {
            (open.start, before) = (middle + 1, with_middle);
        }
    }
    open.start
}

/// Compare two points, given with their numbers, along an axis. Points with equal coordinates are compared along the other
/// axes, and then by number.
fn compare<const D: usize>(axis: usize, a: (&[f64; D], u32), b: (&[f64; D], u32)) -> Ordering {
    let along = (0..D).map(|k| (axis + k) % D).map(|c| a.0[c].total_cmp(&b.0[c]));
    along.fold(Ordering::Equal, Ordering::then).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::bisect;

    fn parts<const D: usize>(points: &[[f64; D]], count: usize) -> Vec<u32> {
        bisect(points, &vec![1; points.len()], count)
    }

    /// A long box is cut across. A plane of points that does not belong to one part as a whole is cut along the next axis.
    /// Parts differ by at most one point and do not depend on the order of the points.
    #[test]
    fn boxes_are_cut_across() {
        let points: Vec<[f64; 3]> =
            (0..480).map(|i| [f64::from(i % 4), f64::from(i / 4 % 5), f64::from(i / 20)]).collect();
        let halves = parts(&points, 2);
        assert!(points.iter().zip(&halves).all(|(x, &half)| (x[2] < 12.0) == (half == 0)));
        let fifths = parts(&points, 5);
        let counts: Vec<usize> = (0..5).map(|part| fifths.iter().filter(|&&of| of == part).count()).collect();
        assert_eq!(counts, [96; 5]);
        // Planes of the lower half weigh twice as much and have two thirds of the weight. Half of the weight is that of the
        // first nine of 24 planes.
        let weights: Vec<u32> = points.iter().map(|x| if x[2] < 12.0 { 2 } else { 1 }).collect();
        let halves = bisect(&points, &weights, 2);
        assert!(points.iter().zip(&halves).all(|(x, &half)| (x[2] < 9.0) == (half == 0)));
        let back: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        assert!(parts(&back, 5).iter().rev().eq(&fifths));
        // Two points at the same position may be in two parts, and more parts than points leave some parts empty.
        assert_eq!(parts(&[[0.0, 0.0]; 2], 2), [0, 1]);
        let few = parts(&[[0.0], [1.0]], 5);
        assert!(few[0] < few[1] && few[1] < 5);
        assert!(parts::<2>(&[], 3).is_empty());
    }

    /// Parts have equal weights to within those of a few points, whatever the weights of the points.
    #[test]
    fn parts_weigh_the_same() {
        let points: Vec<[f64; 3]> =
            (0..3000).map(|i| [f64::from(i % 10), f64::from(i / 10 % 15), 0.1 * f64::from(i / 150 % 7)]).collect();
        let weights: Vec<u32> = (0..3000).map(|number| number % 5 + number / 1000).collect();
        for parts in [2, 3, 8, 13] {
            let mut sums = vec![0; parts];
            bisect(&points, &weights, parts)
                .iter()
                .zip(&weights)
                .for_each(|(&part, weight)| sums[part as usize] += weight);
            let (least, most) = (sums.iter().min().expect("parts"), sums.iter().max().expect("parts"));
            assert!(most - least < 30, "{sums:?}");
        }
    }
}
