//! What the user wrote, and the options of one solver, which PETSc sees only while that solver works.

use super::names::{looks, nest_of};
use crate::error::Result;
use crate::petsc::{Entry, Session, is_of_family};
use std::collections::BTreeMap;

/// The options that the user wrote: on the command line, in files, and in the scene.
#[derive(Default)]
pub struct Typed(Vec<Entry>);

impl Typed {
    /// Read PETSc's table.
    pub fn read(session: &Session) -> Result<Self> {
        session.options().all().map(Self)
    }

    /// Return the options of the solver with a prefix: its own ones, and plain ones of PETSc's objects that it has not as its own.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen::new(prefix);
        for (start, origin) in [(format!("-{prefix}_"), Origin::Own), ("-".to_owned(), Origin::Plain)] {
            for (option, value) in &self.0 {
                let name = option.to_ascii_lowercase();
                // no name of a body has a word of a family in it
                if let Some(name) = name.strip_prefix(&start).filter(|name| is_of_family(name)) {
                    chosen.add(name, value.as_deref(), origin);
                }
            }
        }
        chosen
    }
}

/// Why a solver has an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// The user wrote it with the prefix of this solver, so that it stands in PETSc's table.
    Own,
    /// The user wrote it for all solvers.
    Plain,
    /// The program chose it.
    Default,
}

#[derive(Debug, Clone)]
struct Choice {
    name: String,
    value: Option<String>,
    origin: Origin,
}

impl Choice {
    /// Return the value, empty for an option without one.
    fn value(&self) -> &str {
        self.value.as_deref().unwrap_or_default()
    }
}

/// The options of one solver: its own ones, plain ones that it has not as its own, and the program's choice where the user wrote
/// nothing.
///
/// PETSc's table holds only 512 options, so these are not kept there; they are [lent](Self::lend) to it.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    prefix: String,
    /// Keys are names in small letters, because PETSc ignores the case of names.
    choices: BTreeMap<String, Choice>,
}

impl Chosen {
    /// Return an empty list. `prefix` is the word before the underscore of the solver's own options: the body's name.
    pub(super) fn new(prefix: &str) -> Self {
        Self { prefix: prefix.to_owned(), choices: BTreeMap::new() }
    }

    /// Add an option, unless one of this name is there already. So own options are added first, then plain ones, then defaults.
    fn add(&mut self, name: &str, value: Option<&str>, origin: Origin) {
        let choice = || Choice { name: name.to_owned(), value: value.map(str::to_owned), origin };
        self.choices.entry(name.to_ascii_lowercase()).or_insert_with(choice);
    }

    /// Set an option that is not set yet, as the program's choice. It never counts as typed.
    pub fn set_default(&mut self, name: &str, value: &str) {
        self.add(name, Some(value), Origin::Default);
    }

    /// Choose MUMPS for `cholesky` and `lu`, in this solver and in those nested in it (`-sub_pc_type lu`), where
    /// `-pc_factor_mat_solver_type` was not given. PETSc's own factorisation is over 20 times slower.
    pub fn prefer_mumps(&mut self) {
        let direct = self.choices.iter().filter(|(_, choice)| matches!(choice.value(), "cholesky" | "lu"));
        let nests: Vec<String> = direct.filter_map(|(name, _)| nest_of(name, "pc_type")).map(str::to_owned).collect();
        nests.iter().for_each(|nest| self.set_default(&format!("{nest}pc_factor_mat_solver_type"), "mumps"));
    }

    /// Return the word before the underscore of the solver's own options.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Return the value in force, empty for an option without one.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.choices.get(&name.to_ascii_lowercase()).map(Choice::value)
    }

    /// Return the value in force if the user wrote it.
    pub fn typed(&self, name: &str) -> Option<&str> {
        let choice = self.choices.get(&name.to_ascii_lowercase())?;
        (choice.origin != Origin::Default).then(|| choice.value())
    }

    /// Return name, in small letters, and value of each option that the user wrote.
    pub fn all_typed(&self) -> impl Iterator<Item = (&str, &str)> {
        let typed = self.choices.iter().filter(|(_, choice)| choice.origin != Origin::Default);
        typed.map(|(name, choice)| (name.as_str(), choice.value()))
    }

    /// Return name and value of each option that chooses a type. The other options of a solver depend on these.
    pub(super) fn types(&self) -> impl Iterator<Item = (&str, &str)> {
        let types = self.choices.iter().filter(|(name, _)| name.ends_with("_type"));
        types.map(|(name, choice)| (name.as_str(), choice.value()))
    }

    /// Return whether the user wrote an option that chooses or steers the solver or its matrix: then the user wants a KSP of PETSc. Controls of
    /// MUMPS and options that only [look](looks) at a solver do not count.
    pub fn asks_for_ksp(&self) -> bool {
        let is_control = |name: &str| name.starts_with("mat_mumps_icntl_") || name.starts_with("mat_mumps_cntl_");
        self.all_typed().any(|(name, _)| is_of_family(name) && !looks(name) && !is_control(name))
    }

    /// Return whether the user wrote an option for this solver alone.
    pub fn has_own(&self) -> bool {
        self.choices.values().any(|choice| choice.origin == Origin::Own)
    }

    /// Return whether the user wrote an option whose name begins with `family`.
    pub fn has_typed_of(&self, family: &str) -> bool {
        self.all_typed().any(|(name, _)| name.starts_with(family))
    }

    /// Return whether the user wrote an option that applies to this solver.
    pub fn has_typed(&self) -> bool {
        self.all_typed().next().is_some()
    }

    /// Run `work` while the options of this solver stand in PETSc's table under its prefix, and take them out again. Plain options that
    /// the work read count as read afterwards.
    ///
    /// # Errors
    /// Those of the work, and of PETSc's table, which is full at 512 options.
    pub fn lend<T>(&self, session: &Session, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let options = session.options();
        let copy = |choice: &Choice| format!("-{}_{}", self.prefix, choice.name);
        // own options stand in the table already
        let lent = || self.choices.values().filter(|choice| choice.origin != Origin::Own);
        let done =
            lent().try_for_each(|choice| options.set(&copy(choice), choice.value.as_deref())).and_then(|()| work());
        let take_back = |choice: &Choice| {
            let (copy, plain) = (copy(choice), format!("-{}", choice.name));
            if choice.origin == Origin::Plain && options.used(&copy) && !options.used(&plain) {
                options.mark_used(&plain)?;
            }
            options.clear(&copy)
        };
        // every option is taken back, even if taking back another one failed
        let taken = lent().map(take_back).fold(Ok(()), Result::and);
        done.and_then(|done| taken.map(|()| done))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(options: &[(&str, &str)]) -> Typed {
        Typed(options.iter().map(|(name, value)| ((*name).to_owned(), Some((*value).to_owned()))).collect())
    }

    #[test]
    fn own_options_win_over_those_of_all_and_over_defaults() {
        let typed =
            typed(&[("-KSP_type", "gmres"), ("-b_1_pc_type", "icc"), ("-b_ksp_type", "cg"), ("-pc_type", "lu")]);
        let mut chosen = typed.of("b");
        chosen.set_default("pc_type", "hypre");
        chosen.set_default("ksp_rtol", "1e-6");
        let names = ["ksp_type", "PC_type", "ksp_rtol", "none"];
        assert_eq!(names.map(|name| chosen.get(name)), [Some("cg"), Some("lu"), Some("1e-6"), None]);
        assert_eq!(names.map(|name| chosen.typed(name)), [Some("cg"), Some("lu"), None, None]);
        assert_eq!(
            ["ksp_type", "pc_type"].map(|name| typed.of("b_1").get(name).map(str::to_owned)),
            ["gmres", "icc"].map(|value| Some(value.to_owned()))
        );
        assert!(chosen.has_own() && !typed.of("c").has_own() && typed.of("c").has_typed_of("pc_"));
    }

    /// Options that look and controls of MUMPS leave the choice of the solver to the program.
    #[test]
    fn some_options_ask_for_a_solver_of_petsc() {
        for (name, asks) in
            [("-mat_mumps_icntl_14", false), ("-log_view", false), ("-ksp_view", false), ("-b_ksp_rtol", true)]
        {
            let mut chosen = typed(&[(name, "1")]).of("b");
            chosen.set_default("pc_type", "gamg");
            assert_eq!(chosen.asks_for_ksp(), asks, "{name}");
        }
    }

    #[test]
    fn factorisations_are_those_of_mumps() {
        let mut chosen = typed(&[("-pc_type", "asm"), ("-sub_pc_type", "lu")]).of("b");
        chosen.prefer_mumps();
        let package = |nest: &str| chosen.get(&format!("{nest}pc_factor_mat_solver_type"));
        assert_eq!([package("sub_"), package("")], [Some("mumps"), None]);
    }
}
