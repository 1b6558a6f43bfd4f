//! The options of one solver, which PETSc sees only while that solver is made and set up.

use crate::error::Result;
use crate::petsc::{Options, Session, is_of_family};
use std::collections::BTreeMap;

/// Words in the names of PETSc options that print or draw. All such options have one of them in their name, except for [`LOOKING_NAMES`].
const LOOKING_WORDS: [&str; 6] = ["view", "monitor", "print", "printstat", "statprint", "log"];

/// Options that print and have no such word in their name.
const LOOKING_NAMES: &str = "ksp_converged_reason ksp_converged_rate ksp_compute_singularvalues ksp_compute_eigenvalues \
    ksp_compute_eigenvalues_explicitly ksp_final_residual mat_umfpack_prl";

/// Return whether an option of a PETSc object only looks at a solver: it prints or draws, and does not change what is computed. The name is
/// without dash and without the prefix of a body.
///
/// ```
/// use winkler::solver::options::looks;
/// for name in ["ksp_view", "ksp_monitor_true_residual", "mg_levels_1_ksp_view", "ksp_converged_reason", "mat_view_info"] {
///     assert!(looks(name), "{name}");
/// }
/// for name in ["ksp_type", "ksp_rtol", "pc_type", "pc_hypre_type", "mat_type", "ksp_error_if_not_converged", "pc_gamg_threshold"] {
///     assert!(!looks(name), "{name}");
/// }
/// ```
pub fn looks(name: &str) -> bool {
    name.split('_').any(|word| LOOKING_WORDS.contains(&word))
        || LOOKING_NAMES.split_whitespace().any(|known| nest_of(name, known).is_some())
}

/// Return the prefix of the nested solver in an option name that ends in `leaf`: `sub_` for `sub_pc_type` with the leaf `pc_type`, and an empty
/// prefix for the leaf itself. `None` for other names.
pub(super) fn nest_of<'a>(name: &'a str, leaf: &str) -> Option<&'a str> {
    name.strip_suffix(leaf).filter(|nest| nest.is_empty() || nest.ends_with('_'))
}

/// Why a solver has an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
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

    fn is_typed(&self) -> bool {
        self.origin != Origin::Default
    }
}

/// The options of one solver: its own ones, plain ones that it has not as its own, and the program's choice where the user wrote
/// nothing.
///
/// PETSc's table holds only 512 options, so these are not kept there; they are [lent](Self::lend) to it.
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
/// // PETSc reads them, notes that the plain option was read, and forgets the copies
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
    /// Keys are names in small letters, because PETSc ignores the case of names.
    choices: BTreeMap<String, Choice>,
}

impl Chosen {
    /// Return an empty list. `prefix` is the word before the underscore of the solver's own options: the body's name.
    pub(super) fn new(prefix: &str) -> Self {
        Self { prefix: prefix.to_owned(), choices: BTreeMap::new() }
    }

    /// Add an option, unless one of this name is there already. So own options are added first, then plain ones, then defaults.
    pub(super) fn add(&mut self, name: &str, value: Option<&str>, origin: Origin) {
        let choice = || Choice { name: name.to_owned(), value: value.map(str::to_owned), origin };
        self.choices.entry(name.to_lowercase()).or_insert_with(choice);
    }

    /// Return the word before the underscore of the solver's own options.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Set an option that is not set yet, as the program's choice. It never counts as typed.
    pub fn set_default(&mut self, name: &str, value: &str) {
        self.add(name, Some(value), Origin::Default);
    }

    fn choice(&self, name: &str) -> Option<&Choice> {
        self.choices.get(&name.to_lowercase())
    }

    /// Return the value in force, empty for an option without one.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.choice(name).map(Choice::value)
    }

    /// Return the value in force if the user wrote it.
    pub fn typed(&self, name: &str) -> Option<&str> {
        self.choice(name).filter(|choice| choice.is_typed()).map(Choice::value)
    }

    /// Return the options that the user wrote, each under its name in small letters.
    fn all_typed(&self) -> impl Iterator<Item = (&str, &Choice)> {
        self.choices.iter().filter(|(_, choice)| choice.is_typed()).map(|(name, choice)| (name.as_str(), choice))
    }

    /// Return whether the user wrote an option that chooses or steers the solver or its matrix: then the user wants a KSP of PETSc. Controls of
    /// MUMPS and options that only [look](looks) at a solver do not count.
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
        let is_control = |name: &str| name.starts_with("mat_mumps_icntl_") || name.starts_with("mat_mumps_cntl_");
        self.all_typed().any(|(_, Choice { name, .. })| is_of_family(name) && !looks(name) && !is_control(name))
    }

    /// Return whether the user wrote an option for this solver alone.
    pub fn has_own(&self) -> bool {
        self.choices.values().any(|choice| choice.origin == Origin::Own)
    }

    /// Return whether the user wrote an option whose name begins with `family`.
    pub fn has_typed_of(&self, family: &str) -> bool {
        self.all_typed().any(|(name, _)| name.starts_with(family))
    }

    /// Return the name and value of each option that the user wrote and whose name ends with `end`.
    pub fn typed_that_end<'a>(&'a self, end: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.all_typed().filter(move |(name, _)| name.ends_with(end)).map(|(name, choice)| (name, choice.value()))
    }

    /// Return whether the user wrote an option that applies to this solver.
    pub fn has_typed(&self) -> bool {
        self.all_typed().next().is_some()
    }

    /// Choose MUMPS for `cholesky` and `lu`, in this solver and in those nested in it (`-sub_pc_type lu`), where
    /// `-pc_factor_mat_solver_type` was not given. PETSc's own factorisation is over 20 times slower.
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
        let direct = self.choices.iter().filter(|(_, choice)| matches!(choice.value(), "cholesky" | "lu"));
        let nests: Vec<String> = direct.filter_map(|(name, _)| nest_of(name, "pc_type")).map(str::to_owned).collect();
        nests.iter().for_each(|nest| self.set_default(&format!("{nest}pc_factor_mat_solver_type"), "mumps"));
    }

    /// Run `work` while the options of this solver stand in PETSc's table under its prefix, and take them out again. Plain options that
    /// the work read count as read afterwards.
    ///
    /// # Errors
    /// Those of the work, and of PETSc's table, which is full at 512 options.
    pub fn lend<T>(&self, session: &Session, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let options = session.options();
        // own options stand in the table already
        let lent = || self.choices.values().filter(|choice| choice.origin != Origin::Own);
        let put = |choice: &Choice| options.set(&self.prefixed(choice), choice.value.as_deref());
        let done = lent().try_for_each(put).and_then(|()| work());
        // every option is taken back, even if taking back another one failed
        let taken = lent().map(|choice| self.take_back(&options, choice)).fold(Ok(()), Result::and);
        done.and_then(|done| taken.map(|()| done))
    }

    /// Return the name of an option with dash and prefix, as it stands in PETSc's table while it is lent.
    fn prefixed(&self, choice: &Choice) -> String {
        format!("-{}_{}", self.prefix, choice.name)
    }

    /// Take a lent option out of PETSc's table. If it was read, the plain option that it is a copy of counts as read.
    fn take_back(&self, options: &Options, choice: &Choice) -> Result<()> {
        let (copy, plain) = (self.prefixed(choice), format!("-{}", choice.name));
        if choice.origin == Origin::Plain && options.used(&copy) && !options.used(&plain) {
            options.mark_used(&plain)?;
        }
        options.clear(&copy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The option that is added first wins, whatever the case of its letters, and a default is added last.
    #[test]
    fn own_options_win_over_those_of_all_and_over_defaults() {
        let mut chosen = Chosen::new("b7");
        chosen.add("ksp_type", Some("cg"), Origin::Own);
        chosen.add("KSP_type", Some("gmres"), Origin::Plain);
        chosen.add("pc_type", Some("lu"), Origin::Plain);
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
