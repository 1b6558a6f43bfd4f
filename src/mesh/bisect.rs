//! Points over ranks by their places: recursive bisection of coordinates.
//!
//! What is known of the parts are the cuts between them, one less than parts: who knows a point knows its part. Points of two bodies that lie together
//! in a contact are in one part, or in parts next to each other.
//!
//! Iterations of all linear steps with hypre on 1, 2, 3, 5, 8 ranks: groove3d n = 24 50, 53, 54, 54, 54; hertz-sphere n = 26, edge = 1, P1 53, 58,
//! 57, 52, 55; flange 110, 109, 109, 113, 107. Parts that METIS made of the graph of the nodes took as many to some per cent.

use crate::linalg::pad;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::ops::Range;

/// Cuts of space into parts, each of a part into two: first that of all, then those below it, then those above.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Cuts {
    parts: usize,
    cuts: Vec<Option<Cut>>,
}

/// The first point above a cut; the axis of its coordinate comes first.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Cut {
    axis: usize,
    at: [f64; 3],
    number: u32,
}

impl Cuts {
    /// Of `count` points into `parts` of equal weight to that of one point: across the longest side of the box around them, then likewise on either
    /// side. `at` says where a point is.
    pub fn new<const D: usize>(
        count: usize,
        at: impl Fn(u32) -> [f64; D],
        weight: &dyn Fn(u32) -> u64,
        parts: usize,
    ) -> Self {
        let mut cuts = Self { parts, cuts: vec![None; parts.saturating_sub(1)] };
        let mut order: Vec<u32> = if parts > 1 { (0..count as u32).collect() } else { Vec::new() };
        cuts.split((&at, weight), &mut order, 0..parts, 0);
        cuts
    }

    /// The part of a point, by its place and its number among all.
    pub fn part<const D: usize>(&self, x: &[f64; D], number: u32) -> usize {
        let (mut parts, mut place) = (0..self.parts, 0);
        while parts.len() > 1 {
            let middle = parts.start + parts.len() / 2;
            let is_above = |cut: &Cut| {
                let of_cut = std::array::from_fn(|c| cut.at[c]);
                compare(cut.axis, (x, number), (&of_cut, cut.number)).is_ge()
            };
            if self.cuts[place].as_ref().is_some_and(is_above) {
                place += middle - parts.start;
                parts.start = middle;
            } else {
                place += 1;
                parts.end = middle;
            }
        }
        parts.start
    }

    /// Cuts the points of these numbers into some parts; the first of the cuts has this place.
    fn split<const D: usize>(
        &mut self,
        all: (&impl Fn(u32) -> [f64; D], &dyn Fn(u32) -> u64),
        these: &mut [u32],
        parts: Range<usize>,
        place: usize,
    ) {
        if parts.len() < 2 || these.is_empty() {
            return;
        }
        let (at, weight) = all;
        let size = |axis: usize| {
            let along = || these.iter().map(|&point| at(point)[axis]);
            along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
        };
        let axis = (0..D).rev().max_by(|&a, &b| size(a).total_cmp(&size(b))).unwrap_or(0);
        let order = |&a: &u32, &b: &u32| compare(axis, (&at(a), a), (&at(b), b));
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
        let first = above.iter().copied().min_by(order);
        self.cuts[place] = first.map(|number| Cut { axis, at: pad(at(number)), number });
        self.split(all, below, parts.start..middle, place + 1);
        self.split(all, above, middle..parts.end, place + middle - parts.start);
    }
}

/// The order of two points along an axis; planes of equal coordinates are cut along the other axes.
fn compare<const D: usize>(axis: usize, a: (&[f64; D], u32), b: (&[f64; D], u32)) -> Ordering {
    let along = (0..D).map(|k| (axis + k) % D).map(|c| a.0[c].total_cmp(&b.0[c]));
    along.fold(Ordering::Equal, Ordering::then).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::Cuts;

    fn of<const D: usize>(points: &[[f64; D]], weight: &dyn Fn(u32) -> u64, parts: usize) -> Vec<usize> {
        let cuts = Cuts::new(points.len(), |point| points[point as usize], weight, parts);
        points.iter().zip(0..).map(|(x, number)| cuts.part(x, number)).collect()
    }

    fn parts<const D: usize>(points: &[[f64; D]], count: usize) -> Vec<usize> {
        of(points, &|_| 1, count)
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
        let halves = of(&points, &weights, 2);
        assert!(points.iter().zip(&halves).all(|(x, &half)| (x[2] < 9.0) == (half == 0)));
        let back: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        assert!(parts(&back, 5).iter().rev().eq(&fifths));
        // two points of a place may be in two parts, and more parts than points leave some empty
        assert_eq!(parts(&[[0.0, 0.0]; 2], 2), [0, 1]);
        let few = parts(&[[0.0], [1.0]], 5);
        assert!(few[0] < few[1] && few[1] < 5);
        assert!(parts::<2>(&[], 3).is_empty());
        assert_eq!(Cuts::default().part(&[1.0, 2.0], 3), 0);
    }
}
