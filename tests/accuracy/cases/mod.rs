//! The cases of `meshes/` with their known answers (docs/verification.md), on meshes so coarse that this is quick.

mod bearing;
mod flange;
mod gasket;
mod hertz;
mod ring;
mod rough;
mod spheres;
mod walls;
mod westergaard;

use crate::common::here::solve_here;
use crate::common::{Report, case};

/// Solves a case with some values of its scene replaced; it must converge.
fn solved(name: &str, sets: &[&str]) -> Report {
    solve_here(case(name), sets).converged()
}

/// That a value is the expected one within a relative tolerance.
fn close(what: &str, ours: f64, exact: f64, tolerance: f64) {
    assert!((ours / exact - 1.0).abs() < tolerance, "{what}: {ours}, closed form {exact}");
}
