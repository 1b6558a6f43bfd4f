//! How PETSc options reach a solver.
//!
//! Users type PETSc options as in any PETSc program, for all bodies (`-ksp_type cg`) or for one (`-upper_ksp_type cg`). An option
//! for all bodies is called *plain* here, and an option that starts with the name of a body is that body's *own*.
//!
//! 1. [`Typed`] reads what the user wrote, once in a run, and gives each solver its options ([`Chosen`]). A plain option of a PETSc object (KSP,
//!    PC, Mat) applies to every solver that has no own option of that name. The program adds its choice where the user wrote nothing.
//! 2. These options are [lent](Chosen::lend) to PETSc's table under the prefix of the solver while it works, since PETSc never falls back from
//!    a prefixed name to the plain one, and its table holds only 512 options.
//! 3. An option that stands in a scene may choose a solver or set a parameter of one, and nothing else ([`check_of_scene`]).
//! 4. When all solvers are set up, [`unread()`] goes through what nobody has read. A mistyped name ends the run before it starts.

mod chosen;
mod command_line;
mod names;
mod scene;
mod unread;

pub use chosen::{Chosen, Typed};
pub use command_line::{refuse_log, refuse_traps, split};
pub use names::{WHOLE, looks};
pub use scene::{check_of_scene, pairs, set_of_scene};
pub use unread::{show_help, unread};
