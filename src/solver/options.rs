//! How PETSc options reach a body.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`). An option
//! for all bodies is called *plain* here, and an option that starts with the name of a body is that body's *own*.
//! PETSc never falls back from a prefixed name to the plain one, and nested objects read their options late. So every solver has a list of
//! its options ([`Chosen`]):
//!
//! 1. [`Typed`] reads what the user wrote. A plain option of a PETSc object (KSP, PC, Mat) applies to every solver that has no own option of that name.
//! 2. [`Chosen::set_default`] and [`Chosen::prefer_mumps`] add what the program chooses where the user wrote nothing.
//! 3. The list is [lent](Chosen::lend) to PETSc's table while the solver is made and set up, since the table holds only 512 options and a scene
//!    may have thousands of bodies.
//! 4. An option that stands in a scene may choose a solver or set a parameter of one, and nothing else ([`check_of_scene`]).
//! 5. [`unread()`] finds options that nobody read, so that a mistyped name ends the run before it starts.

mod chosen;
mod command_line;
mod probe;
mod scene;
mod typed;
mod unread;

pub use chosen::{Chosen, looks};
pub use command_line::{refuse_log, refuse_traps, split};
pub use probe::show_help;
pub use scene::{check_of_scene, pairs, set_of_scene, withdraw};
pub use typed::{Typed, watching};
pub use unread::{Unread, UnreadKind, unread};
