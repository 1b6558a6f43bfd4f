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
//! 4. what stands in a scene chooses solvers and sets their parameters, and does nothing else ([`check_of_scene`]);
//! 5. [`unread()`] finds what nobody read: a slip of the keyboard ends the run before it starts.

mod chosen;
mod looks;
mod probe;
mod refused;
mod scene;
mod split;
mod typed;
mod unread;

pub use chosen::Chosen;
pub use looks::looks;
pub use probe::show_help;
pub use refused::{refuse_log, refuse_traps};
pub use scene::{check_of_scene, pairs};
pub use split::split;
pub use typed::{Typed, set_of_scene, watching, withdraw};
pub use unread::{Unread, UnreadKind, unread};
