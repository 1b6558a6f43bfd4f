//! Options that nobody read: slips of the keyboard, and good options that have no effect.

use super::probe::Names;
use super::typed::{Prefixes, Typed};
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

/// Options of solvers that are read only in a solve.
const LATE: &str = "ksp_converged_reason";

/// The options that the user typed and that nobody has read on any rank. Call it on every rank with the same bodies,
/// after all solvers are set up; `all_reduce` combines the flags of all ranks by "or". What is returned counts as read
/// from then on, so that PETSc does not repeat it at its end.
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
/// let told: Vec<_> = unread.iter().map(|u| (u.name.as_str(), u.kind, u.nearest.as_deref())).collect();
/// assert_eq!(told, [
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
    // one that every solver has of its own serves none, and is no mistake
    let is_served =
        |name: &str| prefixes.is_plain(name) && !bodies.is_empty() && typed.owners(bare(name)) == bodies.len();
    let mut read: Vec<u8> =
        candidates.iter().map(|(name, _)| u8::from(options.used(name) || is_served(name))).collect();
    all_reduce(&mut read);
    let mut left: Vec<&Entry> = Vec::new();
    for (entry, read) in candidates.into_iter().zip(read) {
        // Here for all ranks: PETSc's -options_left knows only its own.
        options.mark_used(&entry.0)?;
        if read == 0 {
            left.push(entry);
        }
    }
    if left.is_empty() {
        return Ok(Vec::new());
    }

    let names = Names::collect(session, &typed.combinations())?;
    let found = left.into_iter().map(|(name, _)| {
        let valid = names.contains(prefixes.bare(name));
        Unread {
            name: name.clone(),
            kind: if valid { UnreadKind::NotInUse } else { UnreadKind::Unknown },
            nearest: if valid { None } else { near(name, bodies, &names) },
        }
    });
    Ok(found.collect())
}

fn bare(name: &str) -> &str {
    name.trim_start_matches('-')
}

/// The most similar name that PETSc knows, plain or of a body whose name resembles the beginning of `name`.
fn near(name: &str, bodies: &[&str], names: &Names) -> Option<String> {
    let heads = bare(name).match_indices('_').map(|(at, _)| &bare(name)[..at]);
    let bodies: BTreeSet<&str> = heads.filter_map(|head| nearest(head, bodies.iter().copied())).collect();
    let prefixes = std::iter::once(String::new()).chain(bodies.iter().map(|body| format!("{body}_")));
    let known: Vec<String> =
        prefixes.flat_map(|prefix| names.iter().map(move |name| format!("-{prefix}{name}"))).collect();
    nearest(name, known.iter().map(String::as_str)).map(str::to_owned)
}

/// Whether an option is not read by the objects at set-up: one of PETSc as a whole, or one read later.
fn is_late(name: &str, prefixes: &Prefixes) -> bool {
    let bare = match prefixes.split(name) {
        Some((_, own)) => own,
        None => {
            let bare = bare(name);
            if is_global(bare) {
                return true;
            }
            bare
        }
    };
    // Also in a nested solver, as sub_ksp_converged_reason.
    bare.strip_suffix(LATE).is_some_and(|nest| nest.is_empty() || nest.ends_with('_'))
}
