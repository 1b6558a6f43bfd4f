//! Points over ranks by their places: recursive bisection of coordinates.
//!
//! What is known of the parts are the cuts between them, one less than parts: who knows a point knows its part. Points of two bodies that lie together
//! in a contact are in one part, or in parts next to each other.
//!
//! Iterations of all linear steps with hypre on 1, 2, 3, 5, 8 ranks: groove3d n = 24 50, 53, 54, 54, 54; hertz-sphere n = 26, edge = 1, P1 53, 58,
//! 57, 52, 55; flange 110, 109, 109, 113, 107. Parts that METIS made of the graph of the nodes took as many to some per cent.

use crate::exchange::{Exchange, share};
use crate::linalg::{around, bounds, pad};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
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

/// A point that is to be cut from others: where it is, and its number among all.
pub type Point<const D: usize> = ([f64; D], u32);

/// Points that are to be cut into some parts.
struct Piece {
    /// Those of this rank.
    own: Vec<u32>,
    parts: Range<usize>,
    /// The place of the first of its cuts.
    place: usize,
}

/// The search for the cut of a piece.
struct Search<'a> {
    axis: usize,
    /// Points of this rank that may be the first above the cut.
    candidates: Cow<'a, [u32]>,
    /// The first known to be above.
    found: Option<Cut>,
    /// Weight that points before the first one above may have, from the first candidate on.
    share: f64,
    /// Whether a rank has candidates.
    is_open: bool,
}

/// How many of its candidates a rank proposes at once: each round leaves about one of them in so many, takes the logarithm of that many comparisons for each,
/// and two messages. 10^6 points of a lattice into 16 parts on one rank, and into 8 on eight ranks of two cores: 2 take 0.36 s and 60 rounds, and 0.16 s and 37;
/// 8 take 0.26 s and 30, 0.13 s and 17; 16 take 0.30 s and 21, 0.15 s and 12; 64 take 0.34 s and 13, 0.17 s and 9; 256 take 0.41 s and 12, 0.23 s and 7.
const PROPOSED: usize = 16;

impl Cuts {
    /// Of the points of all ranks, of which this one has `count`, into `parts` of equal weight to that of one point: across the longest side of the
    /// box around them, then likewise on either side. Collective.
    pub fn new<const D: usize>(
        count: usize,
        at: &dyn Fn(u32) -> Point<D>,
        weight: &dyn Fn(u32) -> u64,
        parts: usize,
        exchange: &dyn Exchange,
    ) -> Self {
        let mut cuts = Self { parts, cuts: vec![None; parts.saturating_sub(1)] };
        let mut pieces = vec![Piece { own: (0..count as u32).collect(), parts: 0..parts, place: 0 }];
        pieces.retain(|piece| piece.parts.len() > 1);
        while !pieces.is_empty() {
            let found = search(&pieces, at, weight, exchange);
            let mut next = Vec::new();
            for (Piece { own, parts, place }, cut) in pieces.into_iter().zip(found) {
                cuts.cuts[place] = cut;
                let middle = parts.start + parts.len() / 2;
                let is_above = |point: &u32| cut.is_some_and(|cut| cut.is_below(at(*point)));
                let (above, below) = own.into_iter().partition(is_above);
                next.push(Piece { own: below, parts: parts.start..middle, place: place + 1 });
                next.push(Piece { own: above, parts: middle..parts.end, place: place + middle - parts.start });
            }
            pieces = next;
            pieces.retain(|piece| piece.parts.len() > 1);
        }
        cuts
    }

    /// The part of a point, by its place and its number among all.
    pub fn part<const D: usize>(&self, x: &[f64; D], number: u32) -> usize {
        let (mut parts, mut place) = (0..self.parts, 0);
        while parts.len() > 1 {
            let middle = parts.start + parts.len() / 2;
            let is_above = |cut: &Cut| cut.is_below((*x, number));
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
}

impl Cut {
    /// Whether the cut is below a point.
    fn is_below<const D: usize>(&self, point: Point<D>) -> bool {
        compare(self.axis, point, self.point()).is_ge()
    }

    fn point<const D: usize>(&self) -> Point<D> {
        (std::array::from_fn(|c| self.at[c]), self.number)
    }
}

/// The first point above the cut of each of these pieces; none where there is none. Collective.
fn search<const D: usize>(
    pieces: &[Piece],
    at: &dyn Fn(u32) -> Point<D>,
    weight: &dyn Fn(u32) -> u64,
    exchange: &dyn Exchange,
) -> Vec<Option<Cut>> {
    let weigh = |points: &[u32]| points.iter().map(|&point| weight(point)).sum::<u64>() as f64;
    let of_own = |Piece { own, .. }: &Piece| (bounds(own.iter().map(|&point| pad(at(point).0))), weigh(own));
    let mine: Vec<_> = pieces.iter().map(of_own).collect();
    let all = share(exchange, mine);
    let searches = pieces.iter().enumerate().map(|(number, piece)| {
        let [low, high] = all.iter().map(|of_rank| of_rank[number].0).fold(bounds([]), around);
        let axis = (0..D).rev().max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        let total = all.iter().map(|of_rank| of_rank[number].1).sum::<f64>() as u64;
        let Piece { own, parts, .. } = piece;
        let share = (total * (parts.len() / 2) as u64 / parts.len() as u64) as f64;
        Search { axis, candidates: Cow::Borrowed(own), found: None, share, is_open: true }
    });
    let mut searches: Vec<Search> = searches.collect();
    while searches.iter().any(|search| search.is_open) {
        let mine: Vec<Vec<Cut>> = searches.iter().map(|search| search.propose(at)).collect();
        let mut proposed: Vec<Vec<Cut>> = searches.iter().map(|_| Vec::new()).collect();
        for of_rank in share(exchange, mine) {
            proposed.iter_mut().zip(of_rank).for_each(|(all, more)| all.extend(more));
        }
        proposed.iter_mut().for_each(|cuts| cuts.sort_unstable_by(|a, b| compare::<D>(a.axis, a.point(), b.point())));
        // of candidates from each proposed point down to the one before: their weight, and how many they are
        let mut sums: Vec<Vec<[f64; 2]>> = Vec::new();
        let mut places: Vec<Vec<u32>> = Vec::new();
        for (search, cuts) in searches.iter().zip(&proposed) {
            let is_before = |cut: &Cut, x: Point<D>| compare(cut.axis, cut.point(), x).is_lt();
            let place = |&point: &u32| cuts.partition_point(|cut| is_before(cut, at(point))) as u32;
            places.push(search.candidates.iter().map(place).collect());
            let mut of_search = vec![[0.0; 2]; cuts.len() + 1];
            for (&point, &place) in search.candidates.iter().zip(&places[places.len() - 1]) {
                of_search[place as usize][0] += weight(point) as f64;
                of_search[place as usize][1] += 1.0;
            }
            sums.push(of_search);
        }
        let mut all = sums.concat();
        exchange.sum(all.as_flattened_mut());
        let mut rest = &all[..];
        for ((search, cuts), places) in searches.iter_mut().zip(&proposed).zip(&places) {
            let own;
            (own, rest) = rest.split_at(cuts.len() + 1);
            search.narrow(cuts, own, places, at);
        }
    }
    searches.into_iter().map(|search| search.found).collect()
}

impl Search<'_> {
    /// Some candidates of this rank, by steps of the golden ratio, which no regular order of them shares: any two of the first so many are far apart.
    fn propose<const D: usize>(&self, at: &dyn Fn(u32) -> Point<D>) -> Vec<Cut> {
        let count = self.candidates.len();
        let golden = |k: usize| ((k as f64 * 0.618_033_988_749_895).fract() * count as f64) as usize;
        let places: Vec<usize> =
            if count <= PROPOSED { (0..count).collect() } else { (0..PROPOSED).map(golden).collect() };
        let cut = |place: usize| {
            let (x, number) = at(self.candidates[place]);
            Cut { axis: self.axis, at: pad(x), number }
        };
        places.into_iter().map(cut).collect()
    }

    /// Chooses between proposed points, with the sums of weights and numbers of candidates up to each and above all; own candidates have these
    /// `places` between them.
    fn narrow<const D: usize>(
        &mut self,
        proposed: &[Cut],
        sums: &[[f64; 2]],
        places: &[u32],
        at: &dyn Fn(u32) -> Point<D>,
    ) {
        let mut chosen = proposed.len();
        for (place, [weight, _]) in sums[..proposed.len()].iter().enumerate() {
            if *weight > self.share {
                chosen = place;
                break;
            }
            self.share -= weight;
        }
        let mut left = sums[chosen][1];
        if let Some(&cut) = proposed.get(chosen) {
            self.found = Some(cut);
            left -= 1.0;
        }
        self.is_open = left > 0.0;
        let is_left = |&(&point, &place): &(&u32, &u32)| {
            place as usize == chosen && self.is_open && proposed.get(chosen).is_none_or(|cut| cut.number != at(point).1)
        };
        self.candidates = self.candidates.iter().zip(places).filter(is_left).map(|(&point, _)| point).collect();
    }
}

/// The order of two points along an axis; planes of equal coordinates are cut along the other axes.
fn compare<const D: usize>(axis: usize, a: Point<D>, b: Point<D>) -> Ordering {
    let along = (0..D).map(|k| (axis + k) % D).map(|c| a.0[c].total_cmp(&b.0[c]));
    along.fold(Ordering::Equal, Ordering::then).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::Cuts;
    use crate::exchange::{Serial, crowd};

    fn of<const D: usize>(points: &[[f64; D]], weight: &dyn Fn(u32) -> u64, parts: usize) -> Vec<usize> {
        let cuts = Cuts::new(points.len(), &|point| (points[point as usize], point), weight, parts, &Serial);
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

    /// Ranks with some of the points each find the cuts of one that has all, whatever the weights.
    #[test]
    fn ranks_cut_together() {
        let points: Vec<[f64; 3]> =
            (0..3000).map(|i| [f64::from(i % 10), f64::from(i / 10 % 15), 0.1 * f64::from(i / 150 % 7)]).collect();
        let weight = |number: u32| u64::from(number % 5 + number / 1000);
        for parts in [2, 3, 8, 13] {
            let alone = of(&points, &weight, parts);
            let mut sums = vec![0; parts];
            alone.iter().zip(0..).for_each(|(&part, number)| sums[part] += weight(number));
            let (least, most) = (sums.iter().min().expect("parts"), sums.iter().max().expect("parts"));
            assert!(most - least < 30, "{sums:?}");
            let together = crowd::on(4, |exchange| {
                // the last rank has none
                let own: Vec<u32> = (0..3000).filter(|number| number * 7 % 3 == exchange.rank() as u32).collect();
                let at = |k: u32| (points[own[k as usize] as usize], own[k as usize]);
                let cuts = Cuts::new(own.len(), &at, &|k| weight(own[k as usize]), parts, exchange);
                points.iter().zip(0..).map(|(x, number)| cuts.part(x, number)).collect::<Vec<_>>()
            });
            assert!(together.iter().all(|of_rank| *of_rank == alone), "{parts}");
        }
    }
}
