//! Options that nobody read: mistyped ones, and valid ones that have no effect.

use super::chosen::nest_of;
use super::probe::Names;
use super::typed::{Prefixes, Typed, without_dash};
use crate::error::{Result, nearest};
use crate::petsc::{Entry, Session, is_global};
use std::collections::BTreeSet;

/// An option that the user typed and nobody read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unread {
    /// Its name as typed, with the dash.
    pub name: String,
    /// What it is.
    pub kind: UnreadKind,
    /// The most similar name that PETSc knows, with the dash, for an unknown one.
    pub nearest: Option<String>,
}

/// What an unread option is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnreadKind {
    /// PETSc knows no such option: an error.
    Unknown,
    /// PETSc knows it, but no solver of this run has it: a warning.
    NotInUse,
}

/// An option that a solver reads only when it solves.
const LATE: &str = "ksp_converged_reason";

/// Return the options that the user typed and that nobody has read on any rank. Call it on every rank with the same bodies,
/// after all solvers are set up. `all_reduce` combines the flags of all ranks by "or". The returned options count as read
/// from then on, so that PETSc does not report them again when it finalizes.
///
/// ```
/// use winkler::{petsc::{Ksp, Matrix, Session}, solver::options::*};
/// let words = ["-ksp_tpye", "cg", "-pc_gamg_threshold", "0.1", "-ksp_max_it", "9", "-uper_pc_type", "icc", "-log"];
/// let session = Session::start(&words.map(String::from))?;
/// let mut upper = Typed::read(&session, &["upper"])?.of("upper");
/// upper.set_default("pc_type", "jacobi");
/// let matrix = Matrix::from_csr(&session, 1, vec![0, 1], vec![0], vec![2.0])?;
/// upper.lend(&session, || {
///     let mut ksp = Ksp::new(&session, "upper_")?;
///     ksp.set_operator(&matrix)?;
///     ksp.set_from_options()?;
///     ksp.set_up()
/// })?;
/// let unread = unread(&session, &["upper"], &|_| ())?;
/// let found: Vec<_> = unread.iter().map(|u| (u.name.as_str(), u.kind, u.nearest.as_deref())).collect();
/// assert_eq!(found, [
///     ("-ksp_tpye", UnreadKind::Unknown, Some("-ksp_type")),
///     ("-pc_gamg_threshold", UnreadKind::NotInUse, None),
///     ("-uper_pc_type", UnreadKind::Unknown, Some("-upper_pc_type")),
/// ]);
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub fn unread(session: &Session, bodies: &[&str], all_reduce: &dyn Fn(&mut [u8])) -> Result<Vec<Unread>> {
    let options = session.options();
    let (prefixes, typed) = (Prefixes::new(bodies), Typed::read(session, bodies)?);
    let all = options.all()?;
    let candidates: Vec<&Entry> = all.iter().filter(|(name, _)| !is_late(name, &prefixes)).collect();
    // a plain option serves no solver if every solver has an own option of that name; this is no mistake
    let is_replaced =
        |name: &str| prefixes.is_plain(name) && !bodies.is_empty() && typed.owners(without_dash(name)) == bodies.len();
    let flag = |(name, _): &&Entry| u8::from(options.used(name) || is_replaced(name));
    let mut read: Vec<u8> = candidates.iter().map(flag).collect();
    all_reduce(&mut read);
    let mut left: Vec<&str> = Vec::new();
    for ((name, _), read) in candidates.into_iter().zip(read) {
        // an option that another rank read is marked here, too: PETSc's -options_left knows only its own process
        options.mark_used(name)?;
        if read == 0 {
            left.push(name);
        }
    }
    if left.is_empty() {
        return Ok(Vec::new());
    }

    let names = Names::collect(session, &typed.combinations())?;
    let found = left.into_iter().map(|name| {
        let (kind, nearest) = match names.contains(prefixes.bare(name)) {
            true => (UnreadKind::NotInUse, None),
            false => (UnreadKind::Unknown, most_similar(name, bodies, &names)),
        };
        Unread { name: name.to_owned(), kind, nearest }
    });
    Ok(found.collect())
}

/// Return the most similar name that PETSc knows, as a plain option or with the prefix of a body whose name resembles the beginning of `name`.
fn most_similar(name: &str, bodies: &[&str], names: &Names) -> Option<String> {
    let bare = without_dash(name);
    let heads = bare.match_indices('_').map(|(at, _)| &bare[..at]);
    let bodies: BTreeSet<&str> = heads.filter_map(|head| nearest(head, bodies.iter().copied())).collect();
    let prefixes = std::iter::once(String::new()).chain(bodies.iter().map(|body| format!("{body}_")));
    let known: Vec<String> =
        prefixes.flat_map(|prefix| names.iter().map(move |name| format!("-{prefix}{name}"))).collect();
    nearest(name, known.iter().map(String::as_str)).map(str::to_owned)
}

/// Return whether an option is not read by objects when they are set up. It belongs to PETSc as a whole, or a solver, which may be nested
/// (`sub_ksp_converged_reason`), reads it later.
fn is_late(name: &str, prefixes: &Prefixes) -> bool {
    let is_of_petsc = prefixes.split(name).is_none() && is_global(without_dash(name));
    is_of_petsc || nest_of(prefixes.bare(name), LATE).is_some()
}
