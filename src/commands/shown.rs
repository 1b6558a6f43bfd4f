//! Which pairs of surfaces have a table and a plot of their own, and the names of these files.

use super::stages::Done;
use crate::output::{PairReport, safe_name};
use std::collections::HashMap;

/// The pairs with files of their own: those with the largest forces.
pub struct Shown {
    /// Whether each pair is one of them.
    is: Vec<bool>,
}

impl Shown {
    /// The `most` pairs with the largest forces; of equal ones the first.
    pub fn busiest(pairs: &[PairReport], most: usize) -> Self {
        let size = |i: &usize| pairs[*i].force[0].iter().map(|f| f * f).sum::<f64>();
        // a force that is not a number is none
        let size = |i: &usize| Some(size(i)).filter(|size| size.is_finite()).unwrap_or(0.0);
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|i, j| size(j).total_cmp(&size(i)));
        let mut is = vec![false; pairs.len()];
        order.into_iter().take(most).for_each(|i| is[i] = true);
        Self { is }
    }

    /// Whether a pair is one of them.
    pub fn has(&self, pair: usize) -> bool {
        self.is.get(pair).copied().unwrap_or(false)
    }

    /// What the others lack and how to get it, in words; none if there are no others.
    pub fn left_out(&self) -> Option<String> {
        let (all, left) = (self.is.len(), self.is.iter().filter(|&&is| !is).count());
        (left > 0).then(|| {
            format!(
                "{left} of {all} pairs, those with the smallest forces, have no table and plot of their own; contacts.csv has a row of \
                 each, and --set output.pairs=all writes all"
            )
        })
    }
}

/// `contact-<a>-<b>` of each pair, safe as a file name, with a number from the second pair of the same bodies on.
pub fn stems(done: &Done) -> Vec<String> {
    let model = done.model();
    let names = (0..model.pairs.len()).map(|i| {
        let [a, b] = done.built.discrete.sides(i).map(|side| &model.bodies[model.pairs[i].bodies[side]].name);
        format!("contact-{}-{}", safe_name(a), safe_name(b))
    });
    numbered(names)
}

/// Each name once: with a number from its second time on.
pub fn numbered(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    let once = |name: String| match counts.entry(name.clone()).and_modify(|count| *count += 1).or_insert(1) {
        1 => name,
        count => format!("{name}-{count}"),
    };
    names.map(once).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_busiest_pairs_are_shown() {
        let pair = |x: f64, y: f64| PairReport { force: [[x, y, 0.0]; 2], ..PairReport::default() };
        let pairs = [pair(3.0, 4.0), pair(f64::NAN, 0.0), pair(0.0, -9.0), pair(5.0, 0.0)];
        let shown = |most: usize| (0..4).map(|i| Shown::busiest(&pairs, most).has(i)).collect::<Vec<_>>();
        assert_eq!(shown(1), [false, false, true, false]);
        assert_eq!(shown(2), [true, false, true, false]);
        assert_eq!(shown(9), [true; 4]);
        assert_eq!(Shown::busiest(&pairs, 4).left_out(), None);
        assert!(Shown::busiest(&pairs, 1).left_out().is_some_and(|words| words.starts_with("3 of 4 pairs")));
    }

    #[test]
    fn every_name_is_there_once() {
        let names = ["a-b", "a-c", "a-b", "a-b"].map(str::to_owned);
        assert_eq!(numbered(names.into_iter()), ["a-b", "a-c", "a-b-2", "a-b-3"]);
    }
}
