//! How PETSc options reach a solver.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`).
//! An option for all bodies is called *plain* here, and an option that starts with the name of a body is that body's
//! *own*.
//!
//! 1. [`UserOptions`] gives each solver its options ([`Chosen`]). A plain option of a PETSc object (KSP, PC, Mat)
//!    applies to every solver that has no own option of that name. The program adds its choice where the user wrote
//!    nothing.
//! 2. PETSc does not fall back from a prefixed name to the plain one. So these options stand in its table under the
//!    prefix of a [`OptionGroup`] for as long as its solvers live. The prefix is the name of the body if the body has
//!    options of its own, and `newton` for the matrix of all bodies. Other bodies with the same options share a prefix,
//!    such as `hypre_bodies`, since the table holds only 512 options.
//! 3. When all solvers are set up, [`unread()`] goes through what nobody has read. A mistyped name ends the run before
//!    it starts.

use super::names::{self, WHOLE, is_control_of_mumps, looks, nest_of};
use crate::error::{Error, Kind, Result};
use crate::exchange::all_gather;
use crate::parallel::Ranks;
use crate::petsc::{Entry, Ksp, Matrix, Options, Session, is_family, is_global};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::{Rc, Weak};

/// The options of solvers that the user wrote, on the command line, in the environment and in files.
#[derive(Default)]
pub struct UserOptions(Vec<Entry>);

impl UserOptions {
    /// Return options with these names, which begin with a dash, and values.
    #[cfg(test)]
    pub fn of_test(options: &[(&str, &str)]) -> Self {
        Self(options.iter().map(|(name, value)| ((*name).to_owned(), Some((*value).to_owned()))).collect())
    }

    /// Read the options of a session.
    pub fn read(session: &Session) -> Self {
        Self(session.options().typed())
    }

    /// Return the options of the solver with a prefix: its own ones, and plain ones of PETSc's objects that it has not
    /// as its own.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen { prefix: prefix.to_owned(), choices: BTreeMap::new() };
        for (start, origin) in [(format!("-{prefix}_"), OptionOrigin::Own), ("-".to_owned(), OptionOrigin::Plain)] {
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

/// Return whether an option, without its dash and the prefix of its solver, belongs to a family of objects.
fn is_of_family(bare: &str) -> bool {
    bare.split_once('_').is_some_and(|(first, _)| is_family(first))
}

/// Why a solver has an option.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OptionOrigin {
    /// The user wrote it with the prefix of this solver, so that it stands in PETSc's table.
    Own,
    /// The user wrote it for all solvers.
    Plain,
    /// The program chose it.
    Default,
}

#[derive(Debug, Clone, PartialEq)]
struct SolverOption {
    name: String,
    value: Option<String>,
    origin: OptionOrigin,
}

impl SolverOption {
    /// Return the value, empty for an option without one.
    fn value(&self) -> &str {
        self.value.as_deref().unwrap_or_default()
    }
}

/// The options of one solver: its own ones, plain ones that it has not as its own, and the program's choice where the
/// user wrote nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chosen {
    /// The word before the underscore of the solver's own options: the name of the body.
    prefix: String,
    /// Keys are names in small letters, because PETSc ignores the case of names.
    choices: BTreeMap<String, SolverOption>,
}

impl Chosen {
    /// Add an option, unless one of this name is there already. So own options are added first, then plain ones, then
    /// defaults.
    fn add(&mut self, name: &str, value: Option<&str>, origin: OptionOrigin) {
        let choice = || SolverOption { name: name.to_owned(), value: value.map(str::to_owned), origin };
        self.choices.entry(name.to_ascii_lowercase()).or_insert_with(choice);
    }

    /// Set an option that is not set yet, as the program's choice. It never counts as typed.
    pub fn set_default(&mut self, name: &str, value: &str) {
        self.add(name, Some(value), OptionOrigin::Default);
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
        self.choices.get(&name.to_ascii_lowercase()).map(SolverOption::value)
    }

    /// Return the value in force if the user wrote it.
    pub fn typed(&self, name: &str) -> Option<&str> {
        let choice = self.choices.get(&name.to_ascii_lowercase())?;
        (choice.origin != OptionOrigin::Default).then(|| choice.value())
    }

    /// Return name, in small letters, and value of each option that the user wrote.
    pub fn all_typed(&self) -> impl Iterator<Item = (&str, &str)> {
        let typed = self.choices.iter().filter(|(_, choice)| choice.origin != OptionOrigin::Default);
        typed.map(|(name, choice)| (name.as_str(), choice.value()))
    }

    /// Return the options of a family that the user wrote and that only [look](looks), as they were typed.
    pub fn all_looking(&self, family: &str) -> impl Iterator<Item = String> {
        let looking = self.choices.iter().filter(move |(name, _)| name.starts_with(family) && looks(name));
        looking.map(|(name, choice)| self.written(name, choice))
    }

    /// Return the name of an option as the user wrote it.
    fn written(&self, name: &str, choice: &SolverOption) -> String {
        match choice.origin {
            OptionOrigin::Own => format!("-{}_{name}", self.prefix),
            _ => format!("-{name}"),
        }
    }

    /// Return the controls of MUMPS that the user wrote, and mark them as read.
    pub fn controls_of_mumps(&self, session: &Session) -> Vec<(&str, &str)> {
        let controls: Vec<_> = self.all_typed().filter(|(name, _)| is_control_of_mumps(name)).collect();
        for (name, _) in &controls {
            let _ = [format!("-{}_{name}", self.prefix), format!("-{name}")].map(|name| session.options().has(&name));
        }
        controls
    }

    /// Return all options as they would be typed.
    pub fn in_words(&self) -> String {
        let words = self.choices.values().map(|SolverOption { name, value, .. }| match value {
            Some(value) => format!("-{name} {value}"),
            None => format!("-{name}"),
        });
        words.collect::<Vec<_>>().join(" ")
    }

    /// Return whether the user wrote an option that chooses or steers the solver or its matrix: then the user wants a
    /// KSP of PETSc. Controls of MUMPS and options that only [look](looks) at a solver do not count.
    pub fn asks_for_ksp(&self) -> bool {
        self.all_typed().any(|(name, _)| is_of_family(name) && !looks(name) && !is_control_of_mumps(name))
    }

    /// Return whether the user wrote an option that steers the iteration of the solver. Then a solve is one, also where
    /// one application of the preconditioner would do.
    pub fn steers_iteration(&self) -> bool {
        let steers = |name: &str| name.starts_with("ksp_") && name != "ksp_reuse_preconditioner" && !looks(name);
        self.all_typed().any(|(name, _)| steers(name))
    }

    /// Return whether a solve that only preconditions is one application of a multigrid.
    pub fn is_applied_once(&self) -> bool {
        matches!(self.get("pc_type"), Some("hypre" | "gamg" | "ml" | "mg")) && !self.steers_iteration()
    }

    /// Refuse limits of no iteration that the user wrote for the solver, or for the estimates of eigenvalues that
    /// multigrid needs for its smoothers. A smoother itself may have none.
    pub fn refuse_idle(&self) -> Result<()> {
        let iterates = self.get("ksp_type") != Some("preonly");
        let is_limit = |name: &str| (iterates && name == "ksp_max_it") || name.ends_with("esteig_ksp_max_it");
        let is_idle =
            |(name, value): &(&str, &str)| is_limit(name) && value.parse::<i64>().is_ok_and(|limit| limit < 1);
        let idle = self.all_typed().find(is_idle);
        idle.map_or(Ok(()), |(name, value)| Err(Ksp::idle(&format!("-{}_{name}", self.prefix), value).into()))
    }

    /// Name the option of an unknown type of KSP or PC, if that is why PETSc refused a solver, or return PETSc's error.
    pub fn explain(&self, error: Error) -> Error {
        let text = error.to_string();
        let is_refused = |(name, choice): &(&String, &SolverOption)| {
            let object = names::object_of_type(name);
            object.is_some_and(|object| text.contains(&format!("requested {object} type {} ", choice.value())))
        };
        let Some((name, choice)) = self.choices.iter().find(is_refused) else { return error };
        let (name, value) = (self.written(name, choice), choice.value());
        let advice = names::type_instead(&name, value);
        Error::new(Kind::Solver, format!("{name} {value}: this PETSc does not know the type `{value}`")).help(advice)
    }

    /// Return whether the user wrote an option for this solver alone.
    pub fn has_own(&self) -> bool {
        self.choices.values().any(|choice| choice.origin == OptionOrigin::Own)
    }

    /// Return whether the user wrote an option whose name begins with `family`.
    pub fn has_typed_of(&self, family: &str) -> bool {
        self.all_typed().any(|(name, _)| name.starts_with(family))
    }

    /// Return whether a preconditioner that the user wrote, also a nested one, does not work with rows on several
    /// ranks.
    pub fn is_for_one_rank(&self) -> bool {
        let works = |name: &str, value: &str| match value {
            "hypre" | "gamg" | "jacobi" | "pbjacobi" | "none" | "mg" => true,
            "cholesky" | "lu" => {
                let package = name.replace("pc_type", "pc_factor_mat_solver_type");
                self.typed(&package).is_none_or(|package| package == "mumps")
            }
            _ => false,
        };
        self.all_typed().any(|(name, value)| name.ends_with("pc_type") && !works(name, value))
    }

    /// Put the options into PETSc's table, and return the group of solvers that has them. They leave it with the last
    /// solver that holds the group.
    ///
    /// # Errors
    /// PETSc's table is full, at 512 options.
    pub fn group(&self, session: &Session) -> Result<Rc<OptionGroup>> {
        let live = live_groups();
        let is_apart = self.has_own() || self.prefix == WHOLE;
        if let Some(same) = live.iter().find(|group| !is_apart && group.options.choices == self.choices) {
            return Ok(same.clone());
        }
        let shared = format!("{}_bodies", self.get("pc_type").unwrap_or("plain"));
        let names = std::iter::once(shared.clone()).chain((2..).map(|number| format!("{shared}{number}")));
        let is_free = |name: &String| !live.iter().any(|group| group.prefix == *name);
        let prefix = if is_apart { self.prefix.clone() } else { names.into_iter().find(is_free).unwrap_or(shared) };
        let mut group = OptionGroup { prefix, options: self.clone(), copies: Vec::new(), table: session.options() };
        for choice in self.choices.values().filter(|choice| choice.origin != OptionOrigin::Own) {
            let copy = format!("-{}_{}", group.prefix, choice.name);
            group.table.put(&copy, choice.value.as_deref())?;
            group.copies.push((copy, format!("-{}", choice.name)));
        }
        let group = Rc::new(group);
        GROUPS.with_borrow_mut(|groups| groups.push(Rc::downgrade(&group)));
        Ok(group)
    }
}

/// Solvers with the same options, which stand in PETSc's table under one prefix.
pub struct OptionGroup {
    /// The prefix, without its underscore.
    pub prefix: String,
    options: Chosen,
    /// The names of the options that the user has not typed with this prefix, and the plain name of each.
    copies: Vec<(String, String)>,
    table: Options,
}

thread_local! {
    /// The groups of this process, which has one table of options.
    static GROUPS: RefCell<Vec<Weak<OptionGroup>>> = const { RefCell::new(Vec::new()) };
}

/// Return the groups whose solvers live.
fn live_groups() -> Vec<Rc<OptionGroup>> {
    GROUPS.with_borrow_mut(|groups| {
        groups.retain(|group| group.strong_count() > 0);
        groups.iter().filter_map(Weak::upgrade).collect()
    })
}

impl Drop for OptionGroup {
    fn drop(&mut self) {
        let live = live_groups();
        let is_kept = |copy: &str| live.iter().any(|group| group.copies.iter().any(|(other, _)| other == copy));
        for (copy, _) in self.copies.iter().filter(|(copy, _)| !is_kept(copy)) {
            // an error can no longer be returned
            let _ = self.table.clear(copy);
        }
    }
}

/// Split the arguments (without the program's name) into words of the program and words of PETSc, each in order.
///
/// A PETSc option has one dash and two or more letters. It takes the next word as its value unless that looks like an
/// option. A scene file (`*.toml`) or one of the `commands` is never a value, except of `-options_file`. All words
/// after `--` belong to the program.
pub fn split(words: impl IntoIterator<Item = String>, commands: &[&str]) -> (Vec<String>, Vec<String>) {
    let (mut program, mut petsc) = (Vec::new(), Vec::new());
    let mut words = words.into_iter().peekable();
    while let Some(word) = words.next() {
        if word == "--" {
            program.push(word);
            program.extend(words);
            break;
        }
        if !is_petsc_option(&word) {
            program.push(word);
            continue;
        }
        let takes_file = word == "-options_file";
        petsc.push(word);
        let is_value = |next: &String| {
            !is_option(next) && (takes_file || !(next.ends_with(".toml") || commands.contains(&next.as_str())))
        };
        petsc.extend(words.next_if(is_value));
    }
    (program, petsc)
}

/// Return whether a word is one dash and two or more characters, the first of them a letter. A whole string of options
/// (for `bench --solver`) is no option.
fn is_petsc_option(word: &str) -> bool {
    let bare = word.strip_prefix('-').filter(|bare| bare.len() >= 2 && !bare.contains(char::is_whitespace));
    bare.is_some_and(|bare| bare.starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// Return whether a word begins with a dash and a letter, or with two dashes.
fn is_option(word: &str) -> bool {
    word.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c == '-' || c.is_ascii_alphabetic()))
}

/// Return the warnings of options that no solver of any rank has read, with common names. Collective; to be called
/// after all solvers are set up.
///
/// # Errors
/// An option that is not among the common names was not read either: the name is taken for a typing mistake.
pub fn unread(session: &Session, bodies: &[&str]) -> Result<Vec<String>> {
    let (options, groups) = (session.options(), live_groups());
    let typed: Vec<String> = options.typed().into_iter().map(|(name, _)| name).collect();
    let is_read = |name: &&String| {
        let mut copies = groups.iter().flat_map(|group| &group.copies);
        let is_copy_read = copies.any(|(copy, plain)| plain.eq_ignore_ascii_case(name) && options.used(copy));
        is_copy_read || is_global(&name[1..]) || options.used(name) || is_read_by_solves(name, &groups)
    };
    let mine: Vec<String> = typed.iter().filter(is_read).cloned().collect();
    let (read, has_solvers): (Vec<_>, Vec<_>) =
        all_gather(&Ranks::new(session), (mine, !groups.is_empty())).into_iter().unzip();
    let (read, has_solvers) = (read.concat(), has_solvers.contains(&true));
    // without this option PETSc would list what is left at its end once more
    let is_listed = options.has("-options_left");
    let (mut warnings, mut watching) = (Vec::new(), Vec::new());
    for option in &typed {
        let bare = names::bare(option, bodies);
        let is_read = read.contains(option);
        if is_read || !is_listed {
            options.has(option);
        }
        match () {
            () if is_read => {}
            () if !has_solvers && is_of_family(bare) && looks(bare) => watching.push(option.as_str()),
            () if names::is_common(bare) => {
                warnings.push(format!("option {option} was not used: no solver of this run reads it"));
            }
            () => {
                let error = Error::new(Kind::Solver, format!("no solver of this run reads the option {option}"));
                let near = || names::meant(option, bodies).map(|near| format!("did you mean -{near}?"));
                let advice = names::instead(bare).map(str::to_owned).or_else(near);
                return Err(error.help(advice.unwrap_or_else(|| "`-help` lists the options of this run".to_owned())));
            }
        }
    }
    if !watching.is_empty() {
        warnings.push(format!(
            "nothing to show for {}: the bodies are condensed, so that PETSc has no solver here; --set solver=mumps gives each body one",
            watching.join(" ")
        ));
    }
    Ok(warnings)
}

/// Return whether an option is one that solvers read in each solve, and not in their set-up.
fn is_read_by_solves(option: &str, groups: &[Rc<OptionGroup>]) -> bool {
    let option = option[1..].to_ascii_lowercase();
    let is_of = |group: &Rc<OptionGroup>| {
        group.options.all_typed().any(|(name, _)| {
            name.ends_with("ksp_converged_reason")
                && (name == option || option.strip_suffix(name) == Some(&format!("{}_", group.options.prefix)))
        })
    };
    groups.iter().any(is_of)
}

/// Print the options of a solver as `-help` does, for a run that makes no solver of PETSc.
pub fn show_help(session: &Session) -> Result<()> {
    let matrix = Matrix::from_csr(session, 1, vec![0, 1], vec![0], vec![1.0])?;
    let mut ksp = Ksp::new(session, "")?;
    ksp.set_operator(&matrix)?;
    ksp.set_from_options()?;
    Ok(ksp.set_up()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_options_win_over_those_of_all_and_over_defaults() {
        let options = [("-KSP_type", "gmres"), ("-b_1_pc_type", "icc"), ("-b_ksp_type", "cg"), ("-pc_type", "lu")];
        let typed = UserOptions::of_test(&options);
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
            let mut chosen = UserOptions::of_test(&[(name, "1")]).of("b");
            chosen.set_default("pc_type", "gamg");
            assert_eq!(chosen.asks_for_ksp(), asks, "{name}");
        }
    }

    #[test]
    fn factorisations_are_those_of_mumps() {
        let mut chosen = UserOptions::of_test(&[("-pc_type", "asm"), ("-sub_pc_type", "lu")]).of("b");
        chosen.prefer_mumps();
        let package = |nest: &str| chosen.get(&format!("{nest}pc_factor_mat_solver_type"));
        assert_eq!([package("sub_"), package("")], [Some("mumps"), None]);
    }

    fn check(words: &str, program: &str, petsc: &str) {
        let (p, q) = split(words.split_whitespace().map(String::from), &["solve", "bench", "schema"]);
        assert_eq!((p.join(" "), q.join(" ")), (program.to_owned(), petsc.to_owned()), "{words}");
    }

    #[test]
    fn words_go_where_they_belong() {
        check("solve s.toml", "solve s.toml", "");
        check("-options_file all.toml solve s.toml", "solve s.toml", "-options_file all.toml");
        check("solve -ksp_view s.toml", "solve s.toml", "-ksp_view");
        check("solve s.toml -ksp_view -o x -log_view --quiet", "solve s.toml -o x --quiet", "-ksp_view -log_view");
        check("-up_mat_shift -.5 -v s.toml", "-v s.toml", "-up_mat_shift -.5");
        check("-1e-3 - -o", "-1e-3 - -o", "");
        check("-ksp_type cg -- -ksp_type x", "-- -ksp_type x", "-ksp_type cg");
        check("-ksp_monitor", "", "-ksp_monitor");
        check("-ksp_monitor bench", "bench", "-ksp_monitor");
        check("-ksp_monitor schema", "schema", "-ksp_monitor");
        let string = ["--solver", "-ksp_type cg -pc_type icc"].map(String::from);
        assert_eq!(split(string.clone(), &[]), (string.to_vec(), Vec::new()));
    }
}
