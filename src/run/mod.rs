//! A run: from a scene to what was found, for the library and for the command line. Its types are the [`stages`], each
//! made from the one before by [`build`], [`set_up`], [`iterate`] and [`estimate`].
//!
//! Errors are failures of the solver library, but for what functions say of their own.

mod extent;
pub mod inner;
pub mod meshed;
pub mod phases;
mod plan;
pub mod recorder;
pub mod report;
pub mod results;
pub mod stages;
pub mod steps;
pub mod verdict;
mod warnings;

pub use phases::{build, build_after, estimate, set_up, targets};
pub use recorder::Recorder;
pub use stages::{All, Begin, Built, Clock, Done, Prepared, Recovered};
pub use steps::iterate;
pub use warnings::{in_parts, made_straight};

use crate::error::few;
use std::collections::HashMap;

/// Return the names of bodies as part of a sentence.
pub fn in_words<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let mut names = few(names.map(|name| format!("`{name}`")));
    match names.pop() {
        Some(last) if !names.is_empty() => format!("{} and {last}", names.join(", ")),
        last => last.unwrap_or_default(),
    }
}

/// Return the names made unique: a name gets a number from its second occurrence on.
pub fn numbered(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut counts: HashMap<String, usize> = HashMap::new();
    let unique = |name: String| match counts.entry(name.clone()).and_modify(|count| *count += 1).or_insert(1) {
        1 => name,
        count => format!("{name}-{count}"),
    };
    names.map(unique).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_cut() {
        let names = |count: usize| (0..count).map(|i| format!("b{i}")).collect::<Vec<_>>();
        let text = |count: usize| in_words(names(count).iter());
        assert_eq!([text(0), text(1), text(3)], ["", "`b0`", "`b0`, `b1` and `b2`"]);
        assert!(text(13).ends_with("`b11` and `b12`"));
        assert!(text(4096).ends_with("`b11` and 4084 others"));
    }

    #[test]
    fn every_name_is_there_once() {
        let names = ["a-b", "a-c", "a-b", "a-b"].map(str::to_owned);
        assert_eq!(numbered(names.into_iter()), ["a-b", "a-c", "a-b-2", "a-b-3"]);
    }
}
