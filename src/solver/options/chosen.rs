//! The options of one solver, which PETSc sees only while that solver is made and set up.

use super::looks;
use crate::error::Result;
use crate::petsc::{Session, is_of_family};
use std::collections::BTreeMap;

/// Why a solver has an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    /// The user wrote it with the prefix of this solver, so that it stands in PETSc's table.
    Own,
    /// The user wrote it for all solvers.
    Plain,
    /// The program's choice.
    Default,
}

#[derive(Debug, Clone)]
struct Choice {
    name: String,
    value: Option<String>,
    origin: Origin,
}

/// What a solver is to be: its own options, those of all solvers that it has not itself, and the program's choice where nothing
/// was written.
///
/// PETSc's table holds 512 options, so it does not keep these: they are [lent](Self::lend) to it.
///
/// ```
/// use winkler::{petsc::{Ksp, Session}, solver::options::*};
/// let words = ["-ksp_type", "cg", "-lower_ksp_type", "gmres"];
/// let session = Session::start(&words.map(String::from))?;
/// let typed = Typed::read(&session, &["upper", "lower"])?;
/// let mut upper = typed.of("upper");
/// upper.set_default("ksp_type", "minres");
/// upper.set_default("ksp_max_it", "7");
/// assert_eq!([upper.get("ksp_type"), upper.typed("ksp_type")], [Some("cg"); 2]);
/// assert_eq!([upper.get("ksp_max_it"), upper.typed("ksp_max_it")], [Some("7"), None]);
/// assert_eq!(typed.of("lower").get("ksp_type"), Some("gmres"));
///
/// // PETSc reads them, learns that the one for all was read, and forgets the copies
/// let ksp = upper.lend(&session, || {
///     let mut ksp = Ksp::new(&session, "upper_")?;
///     ksp.set_from_options()?;
///     Ok(ksp)
/// })?;
/// assert_eq!(ksp.ksp_type(), "cg");
/// assert_eq!(session.options().all()?.len(), 2);
/// assert_eq!(session.options().left()?.len(), 1);
/// # session.options().mark_used("-lower_ksp_type")?;
/// # Ok::<(), winkler::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Chosen {
    prefix: String,
    /// By name in small letters: PETSc does not tell capitals from them.
    choices: BTreeMap<String, Choice>,
}

impl Chosen {
    /// Without options. `prefix` is the word before their underscore: the body's name.
    pub(super) fn new(prefix: &str) -> Self {
        Self { prefix: prefix.to_owned(), choices: BTreeMap::new() }
    }

    /// Takes an option that the user wrote, unless one is there: options with the prefix come first.
    pub(super) fn write(&mut self, name: &str, value: Option<&str>, with_prefix: bool) {
        self.put(name, value, if with_prefix { Origin::Own } else { Origin::Plain });
    }

    fn put(&mut self, name: &str, value: Option<&str>, origin: Origin) {
        let choice = || Choice { name: name.to_owned(), value: value.map(str::to_owned), origin };
        self.choices.entry(name.to_lowercase()).or_insert_with(choice);
    }

    /// The word before the underscore of its options.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Sets an option that is not set: the program's choice, which never counts as typed.
    pub fn set_default(&mut self, name: &str, value: &str) {
        self.put(name, Some(value), Origin::Default);
    }

    fn choice(&self, name: &str) -> Option<&Choice> {
        self.choices.get(&name.to_lowercase())
    }

    /// The value in force; empty for an option without one.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.choice(name).map(|choice| choice.value.as_deref().unwrap_or_default())
    }

    /// The same, if the user wrote it.
    pub fn typed(&self, name: &str) -> Option<&str> {
        self.get(name).filter(|_| self.choice(name).is_some_and(|choice| choice.origin != Origin::Default))
    }

    /// Whether the user wrote an option that chooses or steers the solver or its matrix, besides controls of MUMPS: then it is a KSP of
    /// PETSc that is asked for. One that [`looks`] at a run asks for nothing.
    ///
    /// ```
    /// use winkler::{petsc::Session, solver::options::*};
    /// let words = ["-up_pc_type", "icc", "-mat_mumps_icntl_14", "50", "-log_view", "-ksp_view"];
    /// let session = Session::start(&words.map(String::from))?;
    /// let typed = Typed::read(&session, &["up", "low"])?;
    /// let mut low = typed.of("low");
    /// low.set_default("pc_type", "gamg");
    /// assert!(typed.of("up").asks_for_ksp() && !low.asks_for_ksp());
    /// # session.options().clear("-log_view")?;
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn asks_for_ksp(&self) -> bool {
        self.choices.values().filter(|choice| choice.origin != Origin::Default).any(|Choice { name, .. }| {
            is_of_family(name)
                && !looks(name)
                && !["mat_mumps_icntl_", "mat_mumps_cntl_"].iter().any(|control| name.starts_with(control))
        })
    }

    /// Whether the user wrote an option for this solver alone.
    pub fn has_own(&self) -> bool {
        self.choices.values().any(|choice| choice.origin == Origin::Own)
    }

    /// Whether the user wrote an option whose name begins so.
    pub fn has_typed_of(&self, family: &str) -> bool {
        self.choices.iter().any(|(name, choice)| choice.origin != Origin::Default && name.starts_with(family))
    }

    /// Options that the user wrote whose names end so, with their values.
    pub fn typed_that_end<'a>(&'a self, end: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
        let typed = self.choices.iter().filter(|(_, choice)| choice.origin != Origin::Default);
        typed
            .filter(move |(name, _)| name.ends_with(end))
            .map(|(name, choice)| (&name[..], choice.value.as_deref().unwrap_or_default()))
    }

    /// Whether the user wrote an option that this solver has.
    pub fn has_typed(&self) -> bool {
        self.choices.values().any(|choice| choice.origin != Origin::Default)
    }

    /// Lets `cholesky` and `lu` mean MUMPS, in this solver and in those nested in it (`-sub_pc_type lu`), where
    /// `-pc_factor_mat_solver_type` was not given: PETSc's own factorisation is over 20 times slower.
    ///
    /// ```
    /// use winkler::{petsc::Session, solver::options::*};
    /// let words = ["-pc_type", "asm", "-sub_pc_type", "lu", "-low_pc_type", "cholesky", "-low_pc_factor_mat_solver_type", "petsc"];
    /// let session = Session::start(&words.map(String::from))?;
    /// let typed = Typed::read(&session, &["up", "low"])?;
    /// let [mut up, mut low] = ["up", "low"].map(|body| typed.of(body));
    /// up.prefer_mumps();
    /// low.prefer_mumps();
    /// assert_eq!(up.get("sub_pc_factor_mat_solver_type"), Some("mumps"));
    /// assert_eq!(up.get("pc_factor_mat_solver_type"), None);
    /// assert_eq!(low.get("pc_factor_mat_solver_type"), Some("petsc"));
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn prefer_mumps(&mut self) {
        let factors = |(name, choice): (&String, &Choice)| {
            let nest = name.strip_suffix("pc_type")?;
            let direct = matches!(choice.value.as_deref(), Some("cholesky" | "lu"));
            (direct && (nest.is_empty() || nest.ends_with('_'))).then(|| format!("{nest}pc_factor_mat_solver_type"))
        };
        let names: Vec<String> = self.choices.iter().filter_map(factors).collect();
        names.iter().for_each(|name| self.set_default(name, "mumps"));
    }

    /// Does some work of this solver with its options in PETSc's table, under its prefix, and takes them out again. What the work read
    /// of the options for all counts as read.
    ///
    /// # Errors
    /// Those of the work, and of PETSc's table, which is full at 512 options.
    pub fn lend<T>(&self, session: &Session, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let options = session.options();
        let lent = || self.choices.values().filter(|choice| choice.origin != Origin::Own);
        let own = |choice: &Choice| format!("-{}_{}", self.prefix, choice.name);
        let put = |choice: &Choice| options.set(&own(choice), choice.value.as_deref());
        let done = lent().try_for_each(put).and_then(|()| work());
        let take_back = |choice: &Choice| {
            let (own, plain) = (own(choice), format!("-{}", choice.name));
            if choice.origin == Origin::Plain && options.used(&own) && !options.used(&plain) {
                options.mark_used(&plain)?;
            }
            options.clear(&own)
        };
        // all of them, whatever became of one
        let taken = lent().map(take_back).fold(Ok(()), Result::and);
        done.and_then(|done| taken.map(|()| done))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first that writes a name wins, however its letters are written, and a default is the last.
    #[test]
    fn own_options_win_over_those_of_all_and_over_defaults() {
        let mut chosen = Chosen::new("b7");
        chosen.write("ksp_type", Some("cg"), true);
        chosen.write("KSP_type", Some("gmres"), false);
        chosen.write("pc_type", Some("lu"), false);
        chosen.set_default("pc_type", "hypre");
        chosen.set_default("ksp_rtol", "1e-6");
        assert_eq!(
            ["ksp_type", "pc_type", "ksp_rtol"].map(|name| chosen.get(name)),
            [Some("cg"), Some("lu"), Some("1e-6")]
        );
        assert_eq!(["pc_type", "ksp_rtol", "none"].map(|name| chosen.typed(name)), [Some("lu"), None, None]);
        assert!(chosen.has_own() && chosen.has_typed() && chosen.asks_for_ksp());
        let mut plain = Chosen::new("b8");
        plain.set_default("ksp_type", "cg");
        assert!(!plain.has_typed() && !plain.asks_for_ksp());
    }
}
