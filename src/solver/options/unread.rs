//! Options that nobody read: mistyped ones, and valid ones that have no effect.

use super::names::{self, looks, nest_of};
use super::typed::{Typed, Word};
use super::{Chosen, WHOLE};
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
    let typed = Typed::read(session, bodies)?;
    let left = left(session, &typed, bodies, solvers)?;
    if left.is_empty() {
        return Ok(Vec::new());
    }
    let help = help_of(session, solvers.first())?;
    let mut known: Vec<&str> = names::all();
    known.extend(names_in(&help));
    if let Some(word) = left.iter().find(|word| !names::is_known(&word.name, &known)) {
        let error = Error::new(Kind::Solver, format!("PETSc knows no option {}", word.option));
        let near = names::corrected(word.option.trim_start_matches('-'), &known, &[bodies, &[WHOLE]].concat());
        let help = || "`-help` lists the options of this run".to_owned();
        return Err(error.help(near.map_or_else(help, |near| format!("did you mean -{near}?"))));
    }
    let (watching, other): (Vec<&Word>, Vec<&Word>) =
        left.into_iter().partition(|word| solvers.is_empty() && looks(&word.name) && is_of_family(&word.name));
    let warning = |word: &Word| format!("option {} was not used: no solver of this run reads it", word.option);
    let mut warnings: Vec<String> = other.into_iter().map(warning).collect();
    if !watching.is_empty() {
        let names: Vec<&str> = watching.iter().map(|word| word.option.as_str()).collect();
        warnings.push(format!(
            "nothing to show for {}: the bodies are condensed, so that PETSc has no solver here; --set solver=mumps gives each body one",
            names.join(" ")
        ));
    }
    Ok(warnings)
}

/// Return the options of solvers that nobody has read on any rank. PETSc knows of the others that they are read.
fn left<'a>(session: &Session, typed: &'a Typed, bodies: &[&str], solvers: &[Chosen]) -> Result<Vec<&'a Word>> {
    let options = session.options();
    let prefixes: Vec<&str> = solvers.iter().map(Chosen::prefix).collect();
    // PETSc as a whole reads its options at any time
    let words = typed.0.iter().filter(|word| word.prefix.is_some() || !is_global(&word.name));
    let is_read = |word: &&Word| {
        // a solve reads this one
        let is_late = !solvers.is_empty() && nest_of(&word.name, "ksp_converged_reason").is_some();
        // a plain option has no effect if every solver has an own one of this name; this is no mistake
        let is_replaced =
            word.prefix.is_none() && [bodies, &prefixes].into_iter().any(|all| typed.all_own(all, &word.name));
        u8::from(options.used(&word.option) || is_late || is_replaced)
    };
    let mine: Vec<u8> = words.clone().map(|word| is_read(&word)).collect();
    let mut read = mine.clone();
    if session.size() > 1 && !mine.is_empty() {
        session.world().all_reduce_into(&mine[..], &mut read[..], SystemOperation::max());
    }
    // without -options_left PETSc would list what is left at its end once more
    let is_listed = options.has("-options_left");
    let mut left = Vec::new();
    for (word, read) in words.zip(read) {
        if read == 1 || !is_listed {
            options.mark_used(&word.option)?;
        }
        if read == 0 {
            left.push(word);
        }
    }
    Ok(left)
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
