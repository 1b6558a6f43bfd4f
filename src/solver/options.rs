//! How PETSc options reach a solver.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`). An option
//! for all bodies is called *plain* here, and an option that starts with the name of a body is that body's *own*.
//!
//! 1. [`UserOptions`] reads what the user wrote, once in a run, and gives each solver its options ([`Chosen`]). A plain option of a PETSc object (KSP,
//!    PC, Mat) applies to every solver that has no own option of that name. The program adds its choice where the user wrote nothing.
//! 2. These options are [lent](Chosen::lend) to PETSc's table under the prefix of the solver while it works, since PETSc never falls back from
//!    a prefixed name to the plain one, and its table holds only 512 options.
//! 3. An option that stands in a scene may choose a solver or set a parameter of one, and nothing else ([`check_of_scene`]).
//! 4. When all solvers are set up, [`unread()`] goes through what nobody has read. A mistyped name ends the run before it starts.

use super::names::{self, Takes, WHOLE, bare, corrected, ends, looks, nest_of, of_scenes, takes};
use crate::error::{Error, Kind, Result};
use crate::petsc::{Entry, Ksp, Matrix, Session, is_global, is_of_family, printed};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::OpenOptions;
use std::path::Path;

/// The options that the user wrote: on the command line, in files, and in the scene.
#[derive(Default)]
pub struct UserOptions(Vec<Entry>);

impl UserOptions {
    /// Read PETSc's table.
    pub fn read(session: &Session) -> Result<Self> {
        session.options().all().map(Self)
    }

    /// Return the options of the solver with a prefix: its own ones, and plain ones of PETSc's objects that it has not as its own.
    pub fn of(&self, prefix: &str) -> Chosen {
        let mut chosen = Chosen::new(prefix);
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

#[derive(Debug, Clone)]
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

/// The options of one solver: its own ones, plain ones that it has not as its own, and the program's choice where the user wrote
/// nothing.
///
/// PETSc's table holds only 512 options, so these are not kept there; they are [lent](Self::lend) to it.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    prefix: String,
    /// Keys are names in small letters, because PETSc ignores the case of names.
    choices: BTreeMap<String, SolverOption>,
}

impl Chosen {
    /// Return an empty list. `prefix` is the word before the underscore of the solver's own options: the body's name.
    pub(super) fn new(prefix: &str) -> Self {
        Self { prefix: prefix.to_owned(), choices: BTreeMap::new() }
    }

    /// Add an option, unless one of this name is there already. So own options are added first, then plain ones, then defaults.
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
        self.choices.values().any(|choice| choice.origin == OptionOrigin::Own)
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
        let copy = |choice: &SolverOption| format!("-{}_{}", self.prefix, choice.name);
        // own options stand in the table already
        let lent = || self.choices.values().filter(|choice| choice.origin != OptionOrigin::Own);
        let done =
            lent().try_for_each(|choice| options.set(&copy(choice), choice.value.as_deref())).and_then(|()| work());
        let take_back = |choice: &SolverOption| {
            let (copy, plain) = (copy(choice), format!("-{}", choice.name));
            if choice.origin == OptionOrigin::Plain && options.used(&copy) && !options.used(&plain) {
                options.mark_used(&plain)?;
            }
            options.clear(&copy)
        };
        // every option is taken back, even if taking back another one failed
        let taken = lent().map(take_back).fold(Ok(()), Result::and);
        done.and_then(|done| taken.map(|()| done))
    }
}

thread_local! {
    /// Names of the scene's options in PETSc's table, which is one for the process. They are weaker than typed ones, and go with the scene.
    static OF_SCENE: RefCell<BTreeSet<String>> = const { RefCell::new(BTreeSet::new()) };
}

/// Controls of MUMPS that a scene may not set: 1 to 3 are numbers of Fortran files that MUMPS writes to, and 22 lets MUMPS write its factors to a
/// disk.
const WRITING: [&str; 4] = ["1", "2", "3", "22"];

/// Return the kind of value that an option takes, given its name without dash; `None` if a scene may not have it. The name may begin with the
/// prefixes of a body and of nested solvers.
fn takes_in_scene(name: &str) -> Option<Takes> {
    let name = name.to_ascii_lowercase();
    let writes = |number: &str| WRITING.contains(&number.trim_start_matches('0'));
    let is_plain = name.chars().all(|sign| sign.is_ascii_alphanumeric() || sign == '_') && !is_global(&name);
    let is_writing = name.rsplit_once("mat_mumps_icntl_").is_some_and(|(_, number)| writes(number));
    ends(&name).find_map(|(_, leaf)| takes(leaf)).filter(|_| is_plain && !is_writing)
}

impl Takes {
    /// Return whether a value is of this kind; an option without a value has an empty one. No such value can name a file or a viewer.
    fn allows(self, value: &str) -> bool {
        let is_in = |list: &str| list.split_whitespace().any(|known| known.eq_ignore_ascii_case(value));
        let is_number = |word: &str| {
            word.parse::<f64>().is_ok() || ["default", "decide"].contains(&word.to_ascii_lowercase().as_str())
        };
        let is_sign = |sign: char| sign.is_ascii_alphanumeric() || "_-+/".contains(sign);
        match self {
            Self::Switch => value.is_empty() || is_in("true false yes no on off") || value.split(',').all(is_number),
            Self::Numbers => value.split(',').all(is_number),
            Self::Word => value.starts_with(|sign: char| sign.is_ascii_alphanumeric()) && value.chars().all(is_sign),
            Self::OneOf(list) => is_in(list),
        }
    }

    /// Return what the user may write, for a message.
    fn words(self) -> String {
        match self {
            Self::Switch => "nothing, true or false, or a number".to_owned(),
            Self::Numbers => "a number, or several with commas between them".to_owned(),
            Self::Word => "a word".to_owned(),
            Self::OneOf(list) => format!("one of {list}"),
        }
    }
}

/// Split the words of a scene's options into options, each with its value if it has one.
///
/// # Errors
/// A word that belongs to no option.
pub fn pairs(words: &[String]) -> Result<Vec<(&str, Option<&str>)>> {
    let (mut words, mut pairs) = (words.iter().peekable(), Vec::new());
    while let Some(word) = words.next() {
        if !word.starts_with('-') {
            return Err(Error::new(Kind::Scene, format!("`{word}` is no PETSc option"))
                .help("options start with a dash and take one value: -ksp_rtol 1e-10"));
        }
        let is_value = |next: &&String| !next.starts_with('-') || next.parse::<f64>().is_ok();
        pairs.push((word.as_str(), words.next_if(is_value).map(String::as_str)));
    }
    Ok(pairs)
}

/// Check that an option chooses a solver or sets a parameter of one, and can do nothing else: then a scene may have it.
///
/// PETSc's options also write files, remove folders, call a shell, load libraries and read more options. A scene may come from anybody, so it
/// may only have options of the lists in [`names`]. An option that PETSc adds later is not among them.
///
/// # Errors
/// Any other option, and a value that such an option does not take.
pub fn check_of_scene(name: &str, value: Option<&str>) -> Result<()> {
    let Some(takes) = name.strip_prefix('-').and_then(takes_in_scene) else {
        let near = corrected(name, &of_scenes().collect::<Vec<_>>(), &[]).filter(|_| !looks(name));
        let typed = value.map_or(name.to_owned(), |value| format!("{name} {value}"));
        let help = format!(
            "a scene chooses solvers and sets their parameters; what else PETSc can do is for the command line: winkler solve SCENE {typed}"
        );
        let error = Error::new(Kind::Solver, format!("a scene may not have the option {name}"));
        return Err(error.help(near.map_or(help, |near| format!("did you mean -{near}?"))));
    };
    if takes.allows(value.unwrap_or_default()) {
        return Ok(());
    }
    let given = value.map_or("nothing".to_owned(), |value| format!("`{value}`"));
    let error = Error::new(Kind::Solver, format!("in a scene {name} takes {}, not {given}", takes.words()));
    Err(error.help("what PETSc takes besides is for the command line"))
}

/// Put the options of a scene into PETSc's table, in place of those of the scene before. One is left out if the command line has the same option,
/// or the plain one for an option of one body.
///
/// # Errors
/// An option is not one that a scene may have, or PETSc refuses the name.
pub fn set_of_scene(session: &Session, bodies: &[&str], words: &[String]) -> Result<()> {
    let options = session.options();
    OF_SCENE.take().iter().try_for_each(|name| options.clear(name))?;
    for (name, value) in pairs(words)? {
        check_of_scene(name, value)?;
        let of_scene =
            |name: &str| OF_SCENE.with_borrow(|names| names.contains(&format!("-{name}").to_ascii_lowercase()));
        if !bare(name, bodies).any(|name| options.has(name) && !of_scene(name)) {
            options.set(name, value)?;
            OF_SCENE.with_borrow_mut(|names| names.insert(name.to_ascii_lowercase()));
        }
    }
    Ok(())
}

/// Split the arguments (without the program's name) into words of the program and words of PETSc, each in order.
///
/// A PETSc option has one dash and two or more letters. It takes the next word as its value unless that looks like an
/// option. A scene file (`*.toml`) or a command is never a value, except of `-options_file`. All words after `--` belong to the program.
pub fn split(words: impl IntoIterator<Item = String>) -> (Vec<String>, Vec<String>) {
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
        let is_value = |next: &String| !is_option(next) && (takes_file || !is_scene_or_command(next));
        petsc.extend(words.next_if(is_value));
    }
    (program, petsc)
}

/// Return whether a word is a scene file or a command, which is never meant as the value of an option.
fn is_scene_or_command(word: &str) -> bool {
    word.ends_with(".toml") || ["solve", "check", "sweep", "bench", "mesh", "new", "completions", "man"].contains(&word)
}

/// Return whether a word is one dash and two or more characters, the first of them a letter. A whole string of options (for `bench --solver`) is
/// no option.
fn is_petsc_option(word: &str) -> bool {
    let bare = word.strip_prefix('-').filter(|bare| bare.len() >= 2 && !bare.contains(char::is_whitespace));
    bare.is_some_and(|bare| bare.starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// Return whether a word begins with a dash and a letter, or with two dashes.
fn is_option(word: &str) -> bool {
    word.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c == '-' || c.is_ascii_alphabetic()))
}

/// Refuse options with which PETSc would stop at numbers that are not finite, and values that PETSc would read beyond their end.
///
/// # Errors
/// `-fp_trap` is on; a variable in a value, such as `${HOME}`, is not closed.
pub fn refuse_traps(session: &Session) -> Result<()> {
    let is_off = |value: &str| ["false", "no", "off", "0"].contains(&value.to_lowercase().as_str());
    let is_open = |value: &str| value.rsplit_once("${").is_some_and(|(_, rest)| !rest.contains('}'));
    for (name, value) in session.options().all()? {
        let value = value.unwrap_or_default();
        if is_open(&value) {
            // PETSc also reads the value when it finalizes, so the option is removed
            session.options().clear(&name)?;
            let message = format!("the value `{value}` of {name} begins a variable that it does not end");
            return Err(Error::new(Kind::Solver, message).help("write `${NAME}`"));
        }
        if name == "-fp_trap" && !is_off(&value) {
            let message = "-fp_trap would end this program: it computes with infinities on purpose";
            return Err(Error::new(Kind::Solver, message)
                .help("a number that should be finite and is not ends a run anyway, with the status `not-finite`"));
        }
    }
    Ok(())
}

/// Refuse a log file that cannot be written. PETSc writes it when it finalizes, where the user would not see the failure. The file may lie in the
/// folder of results.
///
/// # Errors
/// The file cannot be written.
pub fn refuse_log(session: &Session) -> Result<()> {
    // the value has the form TYPE:FILE:FORMAT
    let log = session.options().get("-log_view").unwrap_or_default();
    let Some(path) = log.split(':').nth(1).filter(|file| !file.is_empty() && session.rank() == 0).map(Path::new) else {
        return Ok(());
    };
    let is_new = !path.exists();
    OpenOptions::new().append(true).create(true).open(path).map_err(|cause| {
        Error::file(path, "write", &cause).help("-log_view names this file: let it lie in a folder that is there")
    })?;
    if is_new {
        // PETSc creates it anew
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// Return the warnings of options that the user typed and that nobody has read on any rank. Collective; to be called after all solvers are set up,
/// with the options of those that are PETSc's.
///
/// PETSc's own list `-options_left` at the end of the process has them, if the user asked for it.
///
/// # Errors
/// PETSc knows no such option, as far as this program can tell.
pub fn unread(session: &Session, bodies: &[&str], solvers: &[Chosen]) -> Result<Vec<String>> {
    let left = left(session, bodies, solvers)?;
    if left.is_empty() {
        return Ok(Vec::new());
    }
    let help = help_of(session, solvers.first())?;
    let mut known: Vec<&str> = names::all();
    known.extend(names_in(&help));
    let is_known = |option: &&String| bare(option, bodies).any(|name| names::is_known(name, &known));
    if let Some(option) = left.iter().find(|option| !is_known(option)) {
        let error = Error::new(Kind::Solver, format!("PETSc knows no option {option}"));
        let near = names::corrected(option, &known, &[bodies, &[WHOLE]].concat());
        let help = || "`-help` lists the options of this run".to_owned();
        return Err(error.help(near.map_or_else(help, |near| format!("did you mean -{near}?"))));
    }
    let is_watching = |name: &str| solvers.is_empty() && looks(name) && is_of_family(name);
    let (watching, other): (Vec<String>, Vec<String>) =
        left.into_iter().partition(|option| bare(option, bodies).any(is_watching));
    let warning = |option: String| format!("option {option} was not used: no solver of this run reads it");
    let mut warnings: Vec<String> = other.into_iter().map(warning).collect();
    if !watching.is_empty() {
        warnings.push(format!(
            "nothing to show for {}: the bodies are condensed, so that PETSc has no solver here; --set solver=mumps gives each body one",
            watching.join(" ")
        ));
    }
    Ok(warnings)
}

/// Return the options of solvers that nobody has read on any rank. PETSc knows of the others that they are read.
fn left(session: &Session, bodies: &[&str], solvers: &[Chosen]) -> Result<Vec<String>> {
    let options = session.options();
    let mut all: Vec<String> = options.all()?.into_iter().map(|(name, _)| name).collect();
    // PETSc as a whole reads its options at any time
    all.retain(|option| !is_global(&option[1..].to_ascii_lowercase()));
    let prefixes: Vec<&str> = solvers.iter().map(Chosen::prefix).collect();
    let own = |prefix: &&str, option: &str| {
        let own = format!("-{prefix}_{}", &option[1..]);
        all.iter().any(|option| option.eq_ignore_ascii_case(&own))
    };
    let is_read = |option: &String| {
        // a solve reads this one
        let is_late =
            !solvers.is_empty() && bare(option, bodies).any(|name| names::is_nested(name, "ksp_converged_reason"));
        // an option has no effect if every solver has an own one of this name; this is no mistake
        let is_replaced =
            [bodies, &prefixes].iter().any(|all| !all.is_empty() && all.iter().all(|prefix| own(prefix, option)));
        u8::from(options.used(option) || is_late || is_replaced)
    };
    let mine: Vec<u8> = all.iter().map(is_read).collect();
    let mut read = mine.clone();
    if session.size() > 1 && !mine.is_empty() {
        session.world().all_reduce_into(&mine[..], &mut read[..], SystemOperation::max());
    }
    // without -options_left PETSc would list what is left at its end once more
    let is_listed = options.has("-options_left");
    let mut marked = all.iter().zip(&read).filter(|(_, read)| **read == 1 || !is_listed);
    marked.try_for_each(|(option, _)| options.mark_used(option))?;
    Ok(all.into_iter().zip(read).filter(|(_, read)| *read == 0).map(|(option, _)| option).collect())
}

/// Return the help of a solver with the types of this one, without the prefix of its options. Without a solver it is that of PETSc's default.
fn help_of(session: &Session, solver: Option<&Chosen>) -> Result<String> {
    thread_local! {
        /// PETSc prints the help of a prefix only once, so each solver has its own prefix.
        static COUNT: Cell<usize> = const { Cell::new(0) };
    }
    COUNT.set(COUNT.get() + 1);
    let mut chosen = Chosen::new(&format!("winklerprobe{}", COUNT.get()));
    solver.into_iter().flat_map(Chosen::types).for_each(|(name, value)| chosen.set_default(name, value));
    let prefix = format!("{}_", chosen.prefix());
    let options = session.options();
    let had_help = options.has("-help");
    options.set("-help", None)?;
    // a type that does not fit the small matrix prints its options all the same
    let (_, help) = printed(session, || chosen.lend(session, || make(session, &prefix)));
    if !had_help {
        options.clear("-help")?;
    }
    Ok(help.replace(&prefix, ""))
}

/// Return the names in a help text: the words that begin its lines with a dash.
fn names_in(help: &str) -> impl Iterator<Item = &str> {
    let words = help.lines().filter_map(|line| line.trim_start().strip_prefix('-'));
    words.filter_map(|word| word.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next())
}

/// Print the options of a solver as `-help` does, for a run that makes no solver of PETSc.
pub fn show_help(session: &Session) -> Result<()> {
    make(session, "")
}

/// Set up a solver for a matrix of one entry, with options of this prefix. Nested objects (MUMPS, blocks) print their help only then.
fn make(session: &Session, prefix: &str) -> Result<()> {
    let matrix = Matrix::from_csr(session, 1, vec![0, 1], vec![0], vec![1.0])?;
    let mut ksp = Ksp::new(session, prefix)?;
    ksp.set_operator(&matrix)?;
    ksp.set_from_options()?;
    ksp.set_up()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(options: &[(&str, &str)]) -> UserOptions {
        UserOptions(options.iter().map(|(name, value)| ((*name).to_owned(), Some((*value).to_owned()))).collect())
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

    /// Check that the options of a text, separated by `|`, pass or do not pass.
    fn check_all(options: &str, pass: bool) {
        for option in options.split('|').map(str::trim) {
            let (name, value) = option.split_once(' ').map_or((option, None), |(name, value)| (name, Some(value)));
            assert_eq!(check_of_scene(name, value).is_ok(), pass, "{option}");
        }
    }

    #[test]
    fn solvers_and_their_parameters_pass() {
        let passing = "-ksp_rtol 1e-8 | -KSP_Type gmres | -upper_ksp_type minres | -pc_hypre_boomeramg_P_max 4 | -ksp_divtol inf | \
            -newton_mg_coarse_pc_hypre_boomeramg_relax_type_all symmetric-SOR/Jacobi | -mg_levels_3_esteig_ksp_max_it 12 | \
            -ksp_chebyshev_esteig 0,0.1,0,1.1 | -pc_fieldsplit_fields 0,1 | -ksp_knoll | -ksp_reuse_preconditioner false | \
            -pc_hypre_boomeramg_print_statistics 1 | -sub_pc_factor_mat_ordering_type rcm | -mat_mumps_cntl_7 1e-3";
        check_all(passing, true);
    }

    #[test]
    fn what_writes_loads_or_reads_is_refused() {
        let refused = "-ksp_view :f | -ksp_monitor | -upper_ksp_view_mat binary:f | -draw_save $(touch f) | -log_view :f | \
            -options_file f | -OPTIONS_FILE f | -prefix_push x_ | -dll_append f.so | -mat_mumps_ooc_tmpdir f | \
            -mat_mumps_icntl_01 7 | -mat_mumps_icntl_22 1 | -mat_mumps_icntl_+4 7 | -pc_type shell | -pc_type hpddm | \
            -ksp_type python | -pc_python_type a.b | -pc_hypre_type euclid | -pc_hypre_boomeramg_smooth_type Euclid | \
            -ksp_rtol 1e-8:f | -ksp_norm_type :f | -ksp_norm_type ../f | -ksp_norm_type ${HOME} | \
            -pc_factor_mat_ordering_type | --ksp_type cg | -ksp type cg | -help | -h | -";
        check_all(refused, false);
    }

    #[test]
    fn advice_is_a_name_or_the_command_line() {
        let advice = |name| check_of_scene(name, Some("x")).unwrap_err().advice().unwrap_or_default().to_owned();
        assert!(advice("-ksp_tpye").contains("-ksp_type"));
        assert!(advice("-ksp_view").ends_with("winkler solve SCENE -ksp_view x"));
        assert!(advice("-draw_save").contains("command line"));
    }

    fn check(words: &str, program: &str, petsc: &str) {
        let (p, q) = split(words.split_whitespace().map(String::from));
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
        let string = ["--solver", "-ksp_type cg -pc_type icc"].map(String::from);
        assert_eq!(split(string.clone()), (string.to_vec(), Vec::new()));
    }
}
