//! The files of pairs of surfaces: their names, and which pairs have none of their own.

use crate::output::{PairReport, safe_name};
use crate::run::measure::pair_names;
use crate::run::stages::Done;

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
    pair_names(&done.built).into_iter().map(|name| format!("contact-{}", safe_name(&name))).collect()
}
