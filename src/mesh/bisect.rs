//! Nodes over ranks by their places: recursive bisection of coordinates.
//!
//! Every rank knows all nodes, so that each finds the same parts; nodes of two bodies that lie together in a contact are in one part, or in parts
//! next to each other.
//!
//! Iterations of all linear steps with hypre on 1, 2, 3, 5, 8 ranks: groove3d n = 24 50, 53, 54, 54, 54; hertz-sphere n = 26, edge = 1, P1 53, 58,
//! 57, 52, 55; flange 110, 109, 109, 113, 107. Parts that METIS made of the graph of the nodes took as many to some per cent.

use std::ops::Range;

/// The part of each of `count` points, of `parts` of equal weight to that of one point: across the longest side of the box around them, then
/// likewise on either side. `at` says where a point is.
pub fn parts<const D: usize>(
    count: usize,
    at: impl Fn(u32) -> [f64; D],
    weight: &dyn Fn(u32) -> u64,
    parts: usize,
) -> Vec<u32> {
    let mut part = vec![0; count];
    let mut order: Vec<u32> = (0..count as u32).collect();
    split((&at, weight), &mut order, 0..parts, &mut part);
    part
}

/// Deals the points of these numbers out to some parts.
fn split<const D: usize>(
    all: (&impl Fn(u32) -> [f64; D], &dyn Fn(u32) -> u64),
    these: &mut [u32],
    parts: Range<usize>,
    part: &mut [u32],
) {
    if parts.len() < 2 || these.is_empty() {
        these.iter().for_each(|&point| part[point as usize] = parts.start as u32);
        return;
    }
    let (at, weight) = all;
    let size = |axis: usize| {
        let along = || these.iter().map(|&point| at(point)[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let longest = (0..D).rev().max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
    // planes of equal coordinates are cut along the other axes
    let key = |point: u32| std::array::from_fn::<f64, D, _>(|k| at(point)[(longest + k) % D]);
    let order = |&a: &u32, &b: &u32| {
        let by_place = key(a).iter().zip(&key(b)).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
        by_place.unwrap_or(a.cmp(&b))
    };
    let weigh = |these: &[u32]| these.iter().map(|&point| weight(point)).sum::<u64>();
    let middle = parts.start + parts.len() / 2;
    let mut share = weigh(these) * (middle - parts.start) as u64 / parts.len() as u64;
    // those before `low` are below the cut, those from `high` on above it
    let (mut low, mut high) = (0, these.len());
    while low < high {
        let half = (low + high) / 2;
        these[low..high].select_nth_unstable_by(half - low, order);
        match share.checked_sub(weigh(&these[low..=half])) {
            Some(rest) => (low, share) = (half + 1, rest),
            None => high = half,
        }
    }
    let (below, above) = these.split_at_mut(low);
    split(all, below, parts.start..middle, part);
    split(all, above, middle..parts.end, part);
}

#[cfg(test)]
mod tests {
    use super::parts as of;

    fn parts<const D: usize>(points: &[[f64; D]], count: usize) -> Vec<u32> {
        of(points.len(), |point| points[point as usize], &|_| 1, count)
    }

    /// A long box is cut across; points of a plane, of which a whole number of parts has not room, along the next axis; parts differ by one
    /// point at most, and are those of any order of the points.
    #[test]
    fn boxes_are_cut_across() {
        let points: Vec<[f64; 3]> =
            (0..480).map(|i| [f64::from(i % 4), f64::from(i / 4 % 5), f64::from(i / 20)]).collect();
        let halves = parts(&points, 2);
        assert!(points.iter().zip(&halves).all(|(x, &half)| (x[2] < 12.0) == (half == 0)));
        let fifths = parts(&points, 5);
        let counts: Vec<usize> = (0..5).map(|part| fifths.iter().filter(|&&of| of == part).count()).collect();
        assert_eq!(counts, [96; 5]);
        // planes of the lower half weigh twice as much: two thirds of the weight, below the ninth of 24 planes
        let weights = |node: u32| if points[node as usize][2] < 12.0 { 2 } else { 1 };
        let halves = of(points.len(), |point| points[point as usize], &weights, 2);
        assert!(points.iter().zip(&halves).all(|(x, &half)| (x[2] < 9.0) == (half == 0)));
        let back: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        assert!(parts(&back, 5).iter().rev().eq(&fifths));
        // two points of a place may be in two parts, and more parts than points leave some empty
        assert_eq!(parts(&[[0.0, 0.0]; 2], 2), [0, 1]);
        let few = parts(&[[0.0], [1.0]], 5);
        assert!(few[0] < few[1] && few[1] < 5);
        assert!(parts::<2>(&[], 3).is_empty());
    }
}
