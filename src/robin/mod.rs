//! The Robin form G_s = K_s + B_s' omega psi kappa B_s of every body s: its coefficient psi kappa, and the sweep, which solves with G_s in every
//! body. Starts from a trace, linear steps, and bounds of the spectrum of G^-1 F1'' are made of sweeps alone.

pub mod coefficient;
pub mod extend;
pub mod interval;
pub mod ritz;
pub mod sweep;
pub mod sweeps;

pub use coefficient::Coefficient;
pub use extend::prepare;
pub use interval::Interval;
pub use ritz::Ritz;
pub use sweep::{Sweep, Sweeper};
pub use sweeps::Sweeps;
