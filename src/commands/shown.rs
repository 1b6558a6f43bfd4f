//! The files of pairs of surfaces: their names, and which pairs have none of their own.

use super::stages::Done;
use crate::output::{PairReport, safe_name};
use std::collections::HashMap;

/// What the pairs lack that are not `shown` and how to get it, in words; none if all are.
pub fn left_out(pairs: &[PairReport], shown: &[usize]) -> Option<String> {
    let (all, left) = (pairs.len(), pairs.len() - shown.len());
    (left > 0).then(|| {
        format!(
            "{left} of {all} pairs, those with the smallest forces, have no table and plot of their own; contacts.csv has a row of \
             each, and --set output.pairs=all writes all"
        )
    })
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
    fn every_name_is_there_once() {
        let names = ["a-b", "a-c", "a-b", "a-b"].map(str::to_owned);
        assert_eq!(numbered(names.into_iter()), ["a-b", "a-c", "a-b-2", "a-b-3"]);
    }
}
