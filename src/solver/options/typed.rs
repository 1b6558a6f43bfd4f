//! What the user wrote: options for all solvers, and for one.

use super::Chosen;
use super::chosen::Origin;
use crate::error::Result;
use crate::petsc::{Session, is_of_family};
use std::collections::HashSet;

/// Prefix of the options of the matrix of all bodies.
pub const WHOLE: &str = "newton";

/// The prefixes of solvers: names of bodies, and that of the matrix of all bodies.
pub(super) struct Prefixes<'a>(HashSet<&'a str>);

impl<'a> Prefixes<'a> {
    pub(super) fn new(bodies: &[&'a str]) -> Self {
        Self(bodies.iter().copied().chain([WHOLE]).collect())
    }

    /// Split a name into the prefix of a solver, if it has one, and the rest, which has no dash. Where both `brick` and `brick_1` fit, the longer prefix
    /// counts.
    pub(super) fn split<'b>(&self, name: &'b str) -> (Option<&'b str>, &'b str) {
        let name = name.trim_start_matches('-');
        let mut parts = name.rmatch_indices('_').map(|(at, _)| (&name[..at], &name[at + 1..]));
        parts.find(|(prefix, _)| self.0.contains(prefix)).map_or((None, name), |(prefix, bare)| (Some(prefix), bare))
    }
}

/// An option in PETSc's table.
pub(super) struct Word {
    /// The name as typed, with its dash.
    pub option: String,
    /// The prefix of the solver that it is for; none if it is for all.
    pub prefix: Option<String>,
    /// The name without dash and prefix, in small letters, since PETSc ignores the case of names.
    pub name: String,
    /// The value, if it has one.
    pub value: Option<String>,
}

/// The options that the user wrote: on the command line, in files, and in the scene.
#[derive(Default)]
pub struct Typed(pub(super) Vec<Word>);

impl Typed {
    /// Read PETSc's table. `bodies` are those of the run, on every rank.
    pub fn read(session: &Session, bodies: &[&str]) -> Result<Self> {
        let prefixes = Prefixes::new(bodies);
        let word = |(option, value): (String, Option<String>)| {
            let lower = option.to_ascii_lowercase();
            let (prefix, name) = prefixes.split(&lower);
            Word { prefix: prefix.map(str::to_owned), name: name.to_owned(), value, option }
        };
        Ok(Self(session.options().all()?.into_iter().map(word).collect()))
    }

    /// Return the options of one solver: its own ones, and plain ones of PETSc's objects that it has not as its own.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen::new(prefix);
        let own = self.0.iter().filter(|word| word.prefix.as_deref() == Some(prefix));
        own.for_each(|word| chosen.add(&word.name, word.value.as_deref(), Origin::Own));
        let plain = self.0.iter().filter(|word| word.prefix.is_none() && is_of_family(&word.name));
        plain.for_each(|word| chosen.add(&word.name, word.value.as_deref(), Origin::Plain));
        chosen
    }

    /// Return whether each of the solvers with these prefixes has an own option of this name.
    pub(super) fn all_own(&self, prefixes: &[&str], name: &str) -> bool {
        let owns = |prefix: &&str| {
            let is_it = |word: &Word| word.prefix.as_deref() == Some(prefix) && word.name == name;
            self.0.iter().any(is_it)
        };
        !prefixes.is_empty() && prefixes.iter().all(owns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_name_of_a_body_counts() {
        let prefixes = Prefixes::new(&["u", "up", "brick", "brick_1", "brick_12"]);
        for (option, prefix, name) in [
            ("-mat_view", None, "mat_view"),
            ("-up_mat_view", Some("up"), "mat_view"),
            ("-upper_ksp_type", None, "upper_ksp_type"),
            ("-newton_ksp_type", Some("newton"), "ksp_type"),
            ("-brick_12_ksp_type", Some("brick_12"), "ksp_type"),
            ("-brick_2_ksp_type", Some("brick"), "2_ksp_type"),
        ] {
            assert_eq!(prefixes.split(option), (prefix, name), "{option}");
        }
    }
}
