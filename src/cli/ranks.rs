//! The refusal of ranks that were started with different command lines. They would wait for each other without end.

use crate::error::{Error, Kind, Result, few};
use crate::exchange::{all_gather, broadcast};
use crate::parallel::{Ranks, differences};
use crate::petsc::Session;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;

/// Variables with options of PETSc, which uses those of the first rank on all ranks.
const VARIABLES: [&str; 2] = ["PETSC_OPTIONS", "PETSC_OPTIONS_YAML"];

/// Refuse ranks that differ in the version of the program, in the words of the command line after the program's name, or in the options of PETSc
/// in the environment. Collective.
///
/// # Errors
/// A collective error with what the ranks were started with.
pub(super) fn refuse_other_words(session: &Session, words: &[OsString]) -> Result<()> {
    let words = words.iter().skip(1).map(shown).collect::<Vec<_>>().join(" ");
    let mut facts =
        BTreeMap::from([(PROGRAM.to_owned(), env!("CARGO_PKG_VERSION").to_owned()), (WORDS.to_owned(), words)]);
    let variables = VARIABLES.map(|name| std::env::var_os(name).map(|value| value.to_string_lossy().into_owned()));
    let first = broadcast(&Ranks::new(session), || Ok(variables.clone()))?;
    for ((name, own), first) in VARIABLES.iter().zip(variables).zip(first) {
        // a launcher need not pass variables on to other machines: a rank without a variable has that of the first rank
        facts.extend(own.or(first).map(|value| ((*name).to_owned(), value)));
    }
    let different: BTreeSet<String> = differences(session, &facts).into_iter().map(|found| found.what).collect();
    let Some(what) = [PROGRAM, WORDS].into_iter().chain(VARIABLES).find(|what| different.contains(*what)) else {
        return Ok(());
    };
    let values = all_gather(&Ranks::new(session), facts.remove(what).unwrap_or_default());
    let kind = if VARIABLES.contains(&what) { Kind::Solver } else { Kind::Usage };
    let mut error = Error::new(kind, format!("the ranks were started with different {}", plural(what)));
    for text in few(groups(&values)) {
        error = error.because(text);
    }
    Err(error.help("start all ranks alike: mpiexec -n 2 winkler solve SCENE").common())
}

const PROGRAM: &str = "version";
const WORDS: &str = "command line";

fn plural(what: &str) -> String {
    if VARIABLES.contains(&what) { format!("values of {what}") } else { format!("{what}s") }
}

/// Return a line for each different value with the ranks that have it, in the order of the first such rank.
fn groups(values: &[String]) -> Vec<String> {
    let mut groups: Vec<(&String, Vec<usize>)> = Vec::new();
    for (rank, value) in values.iter().enumerate() {
        match groups.iter_mut().find(|(known, _)| *known == value) {
            Some((_, ranks)) => ranks.push(rank),
            None => groups.push((value, vec![rank])),
        }
    }
    let line = |(value, ranks): (&String, Vec<usize>)| {
        let word = if ranks.len() == 1 { "rank" } else { "ranks" };
        format!("{word} {}: {}", few(ranks).join(", "), if value.is_empty() { "nothing" } else { value })
    };
    groups.into_iter().map(line).collect()
}

/// Return a word as it could be typed.
fn shown(word: &OsString) -> String {
    match word.to_str() {
        Some(text) if !text.is_empty() && !text.contains(|c: char| c.is_whitespace() || "\"'\\".contains(c)) => {
            text.to_owned()
        }
        _ => format!("{word:?}"),
    }
}
