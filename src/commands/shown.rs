//! The files of pairs of surfaces: their names, and which pairs have none of their own.

use crate::output::{PairReport, safe_name};
use crate::run::stages::Done;
use crate::run::words::numbered;

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
