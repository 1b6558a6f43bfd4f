//! Options that nobody read: mistyped ones, and valid ones that have no effect.

use super::Chosen;
use super::names::{self, WHOLE, bare, looks, nest_of};
use crate::error::{Error, Kind, Result};
use crate::petsc::{Ksp, Matrix, Session, is_global, is_of_family, printed};
use mpi::collective::SystemOperation;
use mpi::traits::CommunicatorCollectives;
use std::cell::Cell;

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
        let is_late = !solvers.is_empty() && nest_of(&option[1..], "ksp_converged_reason").is_some();
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
