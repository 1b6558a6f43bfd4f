//! What the user wrote: options for all solvers, and for one.

use super::{Chosen, check_of_scene, looks};
use crate::error::Result;
use crate::petsc::{Entry, Session, is_of_family};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashSet};

thread_local! {
    /// Names that stand in the scene: as good as typed, but weaker, and gone with the scene. PETSc's table is one for the process too.
    static OF_SCENE: RefCell<BTreeSet<String>> = const { RefCell::new(BTreeSet::new()) };
}

/// Prefixes of solvers, to be looked up.
pub(super) struct Prefixes<'a>(HashSet<&'a str>);

impl<'a> Prefixes<'a> {
    pub(super) fn new(names: &[&'a str]) -> Self {
        Self(names.iter().copied().collect())
    }

    /// The solver whose prefix an option has, and the option without it; of `brick` and `brick_1` the longer one.
    pub(super) fn split<'b>(&self, name: &'b str) -> Option<(&'b str, &'b str)> {
        let bare = name.trim_start_matches('-');
        let mut parts = bare.rmatch_indices('_').map(|(at, _)| (&bare[..at], &bare[at + 1..]));
        parts.find(|(first, _)| self.0.contains(first))
    }

    /// The option without dash and prefix.
    pub(super) fn bare<'b>(&self, name: &'b str) -> &'b str {
        self.split(name).map_or(name.trim_start_matches('-'), |(_, bare)| bare)
    }

    /// Whether an option is a plain one of an object family, and of no solver.
    pub(super) fn is_plain(&self, name: &str) -> bool {
        self.split(name).is_none() && is_of_family(name.trim_start_matches('-'))
    }
}

/// Sets an option that stands in the scene, unless the command line says something else: that option, or the plain one for
/// one of a body.
///
/// # Errors
/// When it is not one that a scene may have, or PETSc refuses the name.
pub fn set_of_scene(session: &Session, bodies: &[&str], name: &str, value: Option<&str>) -> Result<()> {
    check_of_scene(name, value)?;
    let options = session.options();
    let typed = |name: &str| options.has(name) && !OF_SCENE.with_borrow(|names| names.contains(name));
    let plain = Prefixes::new(bodies).split(name).map(|(_, bare)| format!("-{bare}"));
    if typed(name) || plain.is_some_and(|plain| typed(&plain)) {
        return Ok(());
    }
    options.set(name, value)?;
    OF_SCENE.with_borrow_mut(|names| names.insert(name.to_owned()));
    Ok(())
}

/// Takes what stood in the scene out of the table, so that another scene of the process starts from the typed options.
pub fn withdraw(session: &Session) -> Result<()> {
    OF_SCENE.take().iter().try_for_each(|name| session.options().clear(name))
}

/// The options that the user wrote for solvers, on the command line, in files, and in the scene.
#[derive(Default)]
pub struct Typed {
    /// Those for all solvers, without dash.
    plain: Vec<Entry>,
    /// Those for one, by its prefix, without that.
    own: BTreeMap<String, Vec<Entry>>,
}

impl Typed {
    /// Reads PETSc's table. `prefixes` are those of all solvers of the run, on every rank.
    pub fn read(session: &Session, prefixes: &[&str]) -> Result<Self> {
        let known = Prefixes::new(prefixes);
        let (mut plain, mut own) = (Vec::new(), BTreeMap::<String, Vec<Entry>>::new());
        for (name, value) in session.options().all()? {
            if let Some((prefix, bare)) = known.split(&name) {
                own.entry(prefix.to_owned()).or_default().push((bare.to_owned(), value));
            } else if known.is_plain(&name) {
                plain.push((name.trim_start_matches('-').to_owned(), value));
            }
        }
        Ok(Self { plain, own })
    }

    /// What they say of one solver.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen::new(prefix);
        let own = self.own.get(prefix).map_or(&[][..], Vec::as_slice);
        own.iter().for_each(|(name, value)| chosen.write(name, value.as_deref(), true));
        self.plain.iter().for_each(|(name, value)| chosen.write(name, value.as_deref(), false));
        chosen
    }

    /// Number of solvers that have an option of this bare name of their own.
    pub(super) fn owners(&self, bare: &str) -> usize {
        self.own.values().filter(|own| own.iter().any(|(name, _)| name.eq_ignore_ascii_case(bare))).count()
    }

    /// The combinations of options that solvers have: that for all, and that of each one with options of its own.
    pub(super) fn combinations(&self) -> Vec<Vec<Entry>> {
        let of = |own: &[Entry]| -> Vec<Entry> {
            let is_own = |name: &str| own.iter().any(|(known, _)| known.eq_ignore_ascii_case(name));
            self.plain.iter().filter(|(name, _)| !is_own(name)).chain(own).cloned().collect()
        };
        std::iter::once(of(&[])).chain(self.own.values().map(|own| of(own))).collect()
    }
}

/// The options that the user typed and that look at a solver, with their dash.
pub fn watching(session: &Session, bodies: &[&str]) -> Result<Vec<String>> {
    let prefixes = Prefixes::new(bodies);
    let watches = |name: &String| looks(prefixes.bare(name)) && is_of_family(prefixes.bare(name));
    Ok(session.options().all()?.into_iter().map(|(name, _)| name).filter(watches).collect())
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
