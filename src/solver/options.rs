//! How PETSc options reach a solver.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`).
//! An option for all bodies is called *plain* here, and an option that starts with the name of a body is that body's
//! *own*.
//!
//! 1. [`UserOptions`] gives each solver its options ([`Chosen`]). A solver for which an own option was typed has the
//!    name of its body, or `newton` for the matrix of all bodies, as prefix in PETSc's table, and reads only options
//!    with this prefix. All others have no prefix and read the plain options, as in a program with one solver.
//! 2. The program adds its choice where the user wrote nothing. What solvers without a prefix may have differently,
//!    such as types and tolerances, is set by calls of PETSc ([`Ksp::set_default`]).
//! 3. When all solvers are set up, [`unread()`] goes through what nobody has read. A mistyped name ends the run before
//!    it starts.

use super::names::{self, is_control_of_mumps, looks, nest_of};
use crate::error::{Error, Kind, Result};
use crate::exchange::all_gather;
use crate::parallel::Ranks;
use crate::petsc::{Entry, Ksp, Matrix, Session, is_family, is_global};
use std::collections::BTreeMap;

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

    /// Return the options of the solver with this name: its own ones, or the plain ones if it has none.
    pub fn of(&self, name: &str) -> Chosen {
        let own = format!("{}_", name.to_ascii_lowercase());
        let [own, plain] = [own, String::new()].map(|prefix| {
            let start = format!("-{prefix}");
            let mut chosen = Chosen { name: name.to_owned(), prefix, choices: BTreeMap::new() };
            for (option, value) in &self.0 {
                // no name of a body has a word of a family in it
                let option = option.to_ascii_lowercase();
                if let Some(name) = option.strip_prefix(&start).filter(|name| is_of_family(name)) {
                    chosen.add(name, value.as_deref(), true);
                }
            }
            chosen
        });
        if own.choices.is_empty() { plain } else { own }
    }
}

/// Return whether an option, without its dash and the prefix of its solver, belongs to a family of objects.
fn is_of_family(bare: &str) -> bool {
    bare.split_once('_').is_some_and(|(first, _)| is_family(first))
}

#[derive(Debug, Clone, PartialEq)]
struct SolverOption {
    value: Option<String>,
    /// Whether the user wrote it; if not, the program chose it.
    is_typed: bool,
}

impl SolverOption {
    /// Return the value, empty for an option without one.
    fn value(&self) -> &str {
        self.value.as_deref().unwrap_or_default()
    }
}

/// The options of one solver: those that the user wrote, and the program's choice where the user wrote nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chosen {
    /// The name of the body, or `newton`.
    name: String,
    /// What the names of its options begin with in PETSc's table: nothing, or the name with an underscore.
    prefix: String,
    /// Keys are names in small letters, because PETSc ignores the case of names.
    choices: BTreeMap<String, SolverOption>,
}

impl Chosen {
    /// Add an option, unless one of this name is there already.
    fn add(&mut self, name: &str, value: Option<&str>, is_typed: bool) {
        let choice = || SolverOption { value: value.map(str::to_owned), is_typed };
        self.choices.entry(name.to_owned()).or_insert_with(choice);
    }

    /// Set an option that is not set yet, as the program's choice. It never counts as typed.
    pub fn set_default(&mut self, name: &str, value: &str) {
        self.add(name, Some(value), false);
    }

    /// Return name and value of each option that the program chose.
    pub fn defaults(&self) -> impl Iterator<Item = (&str, &str)> {
        let chosen = self.choices.iter().filter(|(_, choice)| !choice.is_typed);
        chosen.map(|(name, choice)| (name.as_str(), choice.value()))
    }

    /// Choose MUMPS for `cholesky` and `lu`, in this solver and in those nested in it (`-sub_pc_type lu`), where
    /// `-pc_factor_mat_solver_type` was not given. PETSc's own factorisation is over 20 times slower.
    pub fn prefer_mumps(&mut self) {
        let direct = self.choices.iter().filter(|(_, choice)| matches!(choice.value(), "cholesky" | "lu"));
        let nests: Vec<String> = direct.filter_map(|(name, _)| nest_of(name, "pc_type")).map(str::to_owned).collect();
        nests.iter().for_each(|nest| self.set_default(&format!("{nest}pc_factor_mat_solver_type"), "mumps"));
    }

    /// Return the name of the body, or `newton`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Return what the names of the options begin with in PETSc's table.
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
        choice.is_typed.then(|| choice.value())
    }

    /// Return name, in small letters, and value of each option that the user wrote.
    pub fn all_typed(&self) -> impl Iterator<Item = (&str, &str)> {
        let typed = self.choices.iter().filter(|(_, choice)| choice.is_typed);
        typed.map(|(name, choice)| (name.as_str(), choice.value()))
    }

    /// Return the options of a family that the user wrote and that only [look](looks), as they were typed.
    pub fn all_looking(&self, family: &str) -> impl Iterator<Item = String> {
        let looking = self.all_typed().filter(move |(name, _)| name.starts_with(family) && looks(name));
        looking.map(|(name, _)| self.written(name))
    }

    /// Return the name of an option as the user writes it.
    fn written(&self, name: &str) -> String {
        format!("-{}{name}", self.prefix)
    }

    /// Return the controls of MUMPS that the user wrote, and mark them as read.
    pub fn controls_of_mumps(&self, session: &Session) -> Vec<(&str, &str)> {
        let controls: Vec<_> = self.all_typed().filter(|(name, _)| is_control_of_mumps(name)).collect();
        for (name, _) in &controls {
            session.options().has(&self.written(name));
        }
        controls
    }

    /// Return all options as they would be typed for all solvers.
    pub fn in_words(&self) -> String {
        let words = self.choices.iter().map(|(name, choice)| match &choice.value {
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
        idle.map_or(Ok(()), |(name, value)| Err(Ksp::idle(&self.written(name), value).into()))
    }

    /// Name the option of an unknown type of KSP or PC, if that is why PETSc refused a solver, or return PETSc's error.
    pub fn explain(&self, error: Error) -> Error {
        let text = error.to_string();
        let is_refused = |(name, choice): &(&String, &SolverOption)| {
            let object = names::object_of_type(name);
            object.is_some_and(|object| text.contains(&format!("requested {object} type {} ", choice.value())))
        };
        let Some((name, choice)) = self.choices.iter().find(is_refused) else { return error };
        let (name, value) = (self.written(name), choice.value());
        let advice = names::type_instead(&name, value);
        Error::new(Kind::Solver, format!("{name} {value}: this PETSc does not know the type `{value}`")).help(advice)
    }

    /// Return whether the user wrote an option for this solver alone.
    pub fn has_own(&self) -> bool {
        !self.prefix.is_empty()
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

/// Return the warnings of options that none of the `solvers` has read on any rank, with common names. Collective; to be
/// called after all solvers are set up.
///
/// # Errors
/// An option that is not among the common names was not read either: the name is taken for a typing mistake.
pub fn unread(session: &Session, bodies: &[&str], solvers: &[Chosen]) -> Result<Vec<String>> {
    let options = session.options();
    let typed: Vec<String> = options.typed().into_iter().map(|(name, _)| name).collect();
    let is_read = |name: &&String| is_global(&name[1..]) || options.used(name) || is_read_by_solves(name, solvers);
    let mine: Vec<String> = typed.iter().filter(is_read).cloned().collect();
    let read = all_gather(&Ranks::new(session), mine).concat();
    // without this option PETSc would list what is left at its end once more
    let is_listed = options.has("-options_left");
    let (mut warnings, mut watching) = (Vec::new(), Vec::new());
    for option in &typed {
        let bare = names::bare(option, bodies);
        let is_read = read.contains(option);
        if is_read || !is_listed {
            options.has(option);
        }
        if is_read {
            continue;
        }
        if solvers.is_empty() && is_of_family(bare) && looks(bare) {
            watching.push(option.as_str());
        } else if names::is_common(bare) {
            warnings.push(format!("option {option} was not used: no solver of this run reads it"));
        } else {
            let error = Error::new(Kind::Solver, format!("no solver of this run reads the option {option}"));
            let near = || names::meant(option, bodies).map(|near| format!("did you mean -{near}?"));
            let advice = names::instead(bare).map(str::to_owned).or_else(near);
            return Err(error.help(advice.unwrap_or_else(|| "`-help` lists the options of this run".to_owned())));
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
fn is_read_by_solves(option: &str, solvers: &[Chosen]) -> bool {
    let is_of = |chosen: &Chosen| {
        let mut names = chosen.all_typed().filter(|(name, _)| name.ends_with("ksp_converged_reason"));
        names.any(|(name, _)| chosen.written(name).eq_ignore_ascii_case(option))
    };
    solvers.iter().any(is_of)
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
    fn own_options_replace_those_of_all_and_win_over_defaults() {
        let options = [("-KSP_type", "gmres"), ("-b_1_pc_type", "icc"), ("-B_ksp_type", "cg"), ("-pc_type", "lu")];
        let typed = UserOptions::of_test(&options);
        let mut chosen = typed.of("b");
        chosen.set_default("pc_type", "hypre");
        chosen.set_default("ksp_type", "minres");
        let names = ["ksp_type", "pc_type", "none"];
        assert_eq!(names.map(|name| chosen.get(name)), [Some("cg"), Some("hypre"), None]);
        assert_eq!(names.map(|name| chosen.typed(name)), [Some("cg"), None, None]);
        assert!(chosen.defaults().eq([("pc_type", "hypre")]));
        assert_eq!(["ksp_type", "pc_type"].map(|name| typed.of("b_1").get(name).is_some()), [false, true]);
        let plain = typed.of("c");
        assert_eq!(["ksp_type", "PC_type"].map(|name| plain.get(name)), [Some("gmres"), Some("lu")]);
        assert_eq!(["b", "b_1", "c"].map(|name| typed.of(name).prefix().to_owned()), ["b_", "b_1_", ""]);
        assert!(chosen.has_own() && !plain.has_own() && plain.has_typed_of("pc_"));
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
