//! The Robin form G_s = K_s + B_s' omega psi kappa B_s of every body s: its coefficient psi kappa, and the sweep, which
//! solves with G_s in every body. Starts from a trace, linear steps, and bounds of the spectrum of G^-1 F1'' are made
//! of sweeps alone. Where a function says nothing else, its errors are failures of the solver library.

mod cg;
pub mod spectrum;
pub mod sweep;

pub use cg::SweepCg;
pub use sweep::{Coefficient, Sweep, prepare, stiff_joint_springs};
