//! How PETSc options reach a body.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`).
//! PETSc never falls back from a prefix to the plain name, and nested objects read their options late. So every solver has a list of
//! its options ([`Chosen`]):
//!
//! 1. [`Typed`] reads what the user wrote; plain options of the object families are those of every solver that has not its own;
//! 2. [`Chosen::set_default`] and [`Chosen::prefer_mumps`] add what the program chooses where nothing was written;
//! 3. the list is [lent](Chosen::lend) to PETSc's table while the solver is made and set up: the table holds 512 options, and a scene
//!    may have thousands of bodies;
//! 4. [`unread()`] finds what nobody read: a slip of the keyboard ends the run before it starts.

mod chosen;
mod global;
mod looks;
mod probe;
mod refused;
mod split;
mod typed;
mod unread;

pub use chosen::Chosen;
pub use looks::looks;
pub use probe::show_help;
pub use refused::{refuse_log, refuse_traps, refuse_words};
pub use split::split;
pub use typed::{Typed, set_of_scene, watching, withdraw};
pub use unread::{Unread, UnreadKind, unread};

use crate::petsc::FAMILIES;

/// Why a name cannot be that of a body; `None` for a good one. A body's name begins its options, so it is
/// `[a-z][a-z0-9_]*`, no word that begins options of PETSc, and between two `_` none of a solver inside another.
///
/// ```
/// use winkler::solver::options::forbidden_body_name;
/// assert_eq!(forbidden_body_name("upper2"), None);
/// assert!(forbidden_body_name("Upper").is_some_and(|reason| reason.contains("small letters")));
/// assert!(forbidden_body_name("mg").is_some_and(|reason| reason.contains("PETSc")));
/// ```
pub fn forbidden_body_name(name: &str) -> Option<&'static str> {
    let letters = name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
    if !letters || !name.starts_with(|first: char| first.is_ascii_lowercase()) {
        return Some(
            "it begins the PETSc options of the body, so it has small letters, digits and _ only, a letter first",
        );
    }
    let family = name.split('_').any(|word| FAMILIES.iter().any(|family| family.strip_suffix('_') == Some(word)));
    if family || global::is_global_word(name) || MORE_WORDS.contains(&name) {
        return Some("options of PETSc itself begin with this word");
    }
    None
}

/// Words that begin options of PETSc, besides [`FAMILIES`] and those of PETSc as a whole.
const MORE_WORDS: [&str; 29] = [
    "snes",
    "ts",
    "tao",
    "dm",
    "is",
    "da",
    "dmda",
    "dmplex",
    "petscspace",
    "petscfv",
    "petscds",
    "sf",
    "sfnode",
    "partitioner",
    "petscpartitioner",
    "vecscatter",
    "ao",
    "pf",
    "ps",
    "eps",
    "svd",
    "st",
    "bv",
    "hypre",
    "mumps",
    "npc",
    "no",
    "not",
    "winklerprobe",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forbidden_names_have_their_reason() {
        for name in ["ksp", "pc", "mat", "vec", "sub", "mg", "snes", "ts", "tao", "dm", "is", "log", "options", "help"]
        {
            assert!(forbidden_body_name(name).is_some_and(|reason| reason.contains("PETSc itself")), "{name}");
        }
        for name in ["", "2up", "up-per", "üb", "a b"] {
            assert!(forbidden_body_name(name).is_some_and(|reason| reason.contains("letter")), "{name}");
        }
        assert_eq!(forbidden_body_name("punch"), None);
    }
}
