//! What the user wrote: options for all solvers, and for one.

use super::chosen::Origin;
use super::{Chosen, looks};
use crate::error::Result;
use crate::petsc::{Entry, Session, is_of_family};
use std::collections::{BTreeMap, HashSet};

/// The prefixes of all solvers of a run: names of bodies, and that of the matrix of all bodies.
pub(super) struct Prefixes<'a>(HashSet<&'a str>);

impl<'a> Prefixes<'a> {
    pub(super) fn new(names: &[&'a str]) -> Self {
        Self(names.iter().copied().collect())
    }

    /// Split a name into the prefix of a solver and the rest, which has no dash. Where both `brick` and `brick_1` fit, the longer prefix counts.
    pub(super) fn split<'b>(&self, name: &'b str) -> Option<(&'b str, &'b str)> {
        let name = without_dash(name);
        let mut parts = name.rmatch_indices('_').map(|(at, _)| (&name[..at], &name[at + 1..]));
        parts.find(|(prefix, _)| self.0.contains(prefix))
    }

    /// Return the name without dash and prefix.
    pub(super) fn bare<'b>(&self, name: &'b str) -> &'b str {
        self.split(name).map_or(without_dash(name), |(_, bare)| bare)
    }

    /// Return whether an option of a PETSc object is written without the prefix of a solver.
    pub(super) fn is_plain(&self, name: &str) -> bool {
        self.split(name).is_none() && is_of_family(without_dash(name))
    }
}

/// Return the name of an option without its dash.
pub(super) fn without_dash(name: &str) -> &str {
    name.trim_start_matches('-')
}

/// The options that the user wrote for solvers: on the command line, in files, and in the scene.
#[derive(Default)]
pub struct Typed {
    /// Options for all solvers, without dash.
    plain: Vec<Entry>,
    /// Options for one solver under its prefix, without dash and prefix.
    own: BTreeMap<String, Vec<Entry>>,
}

impl Typed {
    /// Read PETSc's table. `prefixes` are those of all solvers of the run, on every rank.
    pub fn read(session: &Session, prefixes: &[&str]) -> Result<Self> {
        let prefixes = Prefixes::new(prefixes);
        let (mut plain, mut own) = (Vec::new(), BTreeMap::<String, Vec<Entry>>::new());
        for (name, value) in session.options().all()? {
            if let Some((prefix, bare)) = prefixes.split(&name) {
                own.entry(prefix.to_owned()).or_default().push((bare.to_owned(), value));
            } else if prefixes.is_plain(&name) {
                plain.push((without_dash(&name).to_owned(), value));
            }
        }
        Ok(Self { plain, own })
    }

    /// Return the options of one solver: its own ones, and plain ones that it has not as its own.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen::new(prefix);
        let own = self.own.get(prefix).into_iter().flatten();
        own.for_each(|(name, value)| chosen.add(name, value.as_deref(), Origin::Own));
        self.plain.iter().for_each(|(name, value)| chosen.add(name, value.as_deref(), Origin::Plain));
        chosen
    }

    /// Return the number of solvers that have an own option of this bare name.
    pub(super) fn owners(&self, bare: &str) -> usize {
        self.own.values().filter(|own| own.iter().any(|(name, _)| name.eq_ignore_ascii_case(bare))).count()
    }

    /// Return the combinations of options that solvers have: first the plain options, then one combination for each solver with own options.
    pub(super) fn combinations(&self) -> Vec<Vec<Entry>> {
        let of = |own: &[Entry]| -> Vec<Entry> {
            let is_own = |name: &str| own.iter().any(|(known, _)| known.eq_ignore_ascii_case(name));
            self.plain.iter().filter(|(name, _)| !is_own(name)).chain(own).cloned().collect()
        };
        std::iter::once(of(&[])).chain(self.own.values().map(|own| of(own))).collect()
    }
}

/// Return the options that the user typed and that only look at a solver, with their dash.
pub fn watching(session: &Session, bodies: &[&str]) -> Result<Vec<String>> {
    let prefixes = Prefixes::new(bodies);
    let is_watching = |name: &String| looks(prefixes.bare(name)) && is_of_family(prefixes.bare(name));
    Ok(session.options().all()?.into_iter().map(|(name, _)| name).filter(is_watching).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_hides_a_family_that_its_name_begins_with() {
        let prefixes = Prefixes::new(&["u", "up"]);
        assert!(prefixes.is_plain("-mat_view"));
        assert!(!prefixes.is_plain("-up_mat_view"));
        assert!(!prefixes.is_plain("-log_view"));
        assert_eq!(prefixes.split("-up_ksp_type"), Some(("up", "ksp_type")));
        assert_eq!(prefixes.split("-upper_ksp_type"), None);
        let prefixes = Prefixes::new(&["brick", "brick_1", "brick_12"]);
        assert_eq!(prefixes.split("-brick_12_ksp_type"), Some(("brick_12", "ksp_type")));
        assert_eq!(prefixes.split("-brick_2_ksp_type"), Some(("brick", "2_ksp_type")));
    }

    #[test]
    fn combinations_have_what_is_for_all_and_for_one() {
        let entry = |name: &str, value: &str| (name.to_owned(), Some(value.to_owned()));
        let plain = vec![entry("ksp_type", "cg"), entry("pc_type", "asm")];
        let own = [("b7".to_owned(), vec![entry("PC_type", "lu")])].into();
        let typed = Typed { plain: plain.clone(), own };
        assert_eq!(typed.combinations(), [plain, vec![entry("ksp_type", "cg"), entry("PC_type", "lu")]]);
        assert_eq!([typed.owners("pc_type"), typed.owners("ksp_type")], [1, 0]);
    }
}
