//! The library: a scene is built in Rust and solved, and its solution is read as arrays. The command line goes the same
//! way.
//!
//! Lengths and stresses are in any consistent units; forces are in stress times length squared, in the plane for a
//! thickness of one length. Points and vectors have three components, z = 0 in the plane. docs/library.md has more
//! examples.
//!
//! In the example two squares of side 1 are pressed together by a pressure of 1. They have Young's modulus 100 and
//! Poisson's ratio 0; the pressure in the layer is 50 times its compression. Each square becomes 1/100 shorter, and the
//! layer 1/50 thinner.
//!
//! ```
//! use winkler::api::{BodySpec, ContactSpec, LayerSpec, MeshArrays, Scene, Session, solve};
//!
//! let square = |y: f64| [[0.0, y, 0.0], [1.0, y, 0.0], [1.0, y + 1.0, 0.0], [0.0, y + 1.0, 0.0]];
//! let mesh = MeshArrays::new([square(0.0), square(1.0)].concat())
//!     .group("lower", 2, vec![0, 1, 2, 0, 2, 3])
//!     .group("upper", 2, vec![4, 5, 6, 4, 6, 7])
//!     .group("base", 1, vec![0, 1])
//!     .group("below", 1, vec![3, 2])
//!     .group("above", 1, vec![4, 5])
//!     .group("top", 1, vec![6, 7]);
//! let scene = Scene::new(2, mesh)
//!     .body(BodySpec::new("lower", 100.0, 0.0).fix("base", [Some(0.0), Some(0.0)]))
//!     .body(BodySpec::new("upper", 100.0, 0.0).fix("top", [Some(0.0), None]).pressure("top", 1.0))
//!     .contact(ContactSpec::new("below", "above", LayerSpec::linear(50.0)));
//!
//! let session = Session::start(&[])?;
//! let solution = solve(&session, scene)?;
//! assert!(solution.is_converged());
//! assert!(solution.contact(0).pressure.iter().all(|p| (p - 1.0).abs() < 1e-8));
//! let upper = solution.body(1).expect("one rank has all bodies")?;
//! let sunk = 0.01 + 0.02 + 0.01;
//! for (u, x) in upper.displacement.iter().zip(&upper.points) {
//!     assert!(x[1] < 2.0 || (u[1] + sunk).abs() < 1e-8);
//! }
//! # Ok::<(), winkler::api::Error>(())
//! ```

pub use crate::contact::law::{LayerLaw, PerPoint, Power};
pub use crate::data::{Data, DataSpec, Detrend, Interpolation, Library, Outside};
pub use crate::ddm::gamma::{GammaRule, Iterate};
pub use crate::ddm::{Observer, Row, Silent, Status};
pub use crate::error::{Error, Kind, Result};
pub use crate::expression::Field;
pub use crate::model::field::Unbounded;
pub use crate::output::{BodyField, CellKind, ContactTable, PairReport, PairResult, Report};
pub use crate::petsc::Session;
pub use crate::problem::{
    AxesSpec, BodySpec, Constants, ContactSpec, ElasticitySpec, Gamma, GroupArrays, History, LayerSpec, Linear, Load,
    LoadKind, LoadStep, MeshArrays, MeshSource, MethodName, MethodSpec, OneOrVector, Order, Orthotropic, Overlap,
    Plane, Preset, RegionSpec, RobinRule, SolverSpec, SpringSpec, Start, StopRule, Support, Units, Vector, Zone,
};
pub use crate::run::recorder::Recorder;
pub use crate::scene::{AdaptSpec, OutputSpec, Precision, Quantity, Scene, load};

use crate::estimate::Estimate;
use crate::interrupt::Interrupt;
use crate::run::{self, All, Begin, Clock, Done, report, results, verdict};
use std::rc::Rc;

/// The solution of a scene.
pub struct Solution {
    done: Done,
    recovered: Rc<All>,
    estimate: Option<Estimate>,
    report: Report,
}

/// Solve a scene, built in Rust or [loaded](load) from a file. Collective: all ranks call it with the same scene.
///
/// A run that does not converge is no error: see [`Solution::status`].
///
/// # Errors
/// Refusals of scene, mesh, laws and PETSc options, and failures of PETSc. Of several ranks only one has the message.
pub fn solve(session: &Session, scene: Scene) -> Result<Solution> {
    solve_with(session, scene, &mut Silent)
}

/// Solve a scene as [`solve`] does, and show the rows of the history to an observer while the run iterates.
///
/// # Errors
/// Those of [`solve`].
pub fn solve_with(session: &Session, scene: Scene, keep: &mut dyn Recorder) -> Result<Solution> {
    scene.check()?;
    let (interrupt, mut clock) = (Interrupt::default(), Clock::default());
    let built = run::build(session, scene, &interrupt, &mut clock)?;
    let ready = run::set_up(session, built, Begin::default(), &mut clock)?;
    let mut done = run::iterate(ready, &interrupt, keep, &mut clock)?;
    let estimate = run::estimate(&mut done, &mut clock)?;
    let recovered = results::recover(&done);
    let report = report::report(session, &done, &recovered, estimate.as_ref(), &clock);
    Ok(Solution { done, recovered, estimate, report })
}

impl Solution {
    /// Return how the run ended.
    pub fn status(&self) -> &Status {
        &self.done.outcome.status
    }

    /// Return whether the tolerance is reached, or the accuracy that double precision allows.
    pub fn is_converged(&self) -> bool {
        verdict::exit_code(&self.done) == 0
    }

    /// Return the contents of `report.json`: counters, forces, approaches, largest stresses, times, warnings and
    /// settings.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Return the rows of the history, one for each iteration.
    pub fn history(&self) -> &[Row] {
        &self.done.outcome.rows
    }

    /// Return the number of pairs of contact surfaces. Pairs of the scene come first, in its order, then those that
    /// were found.
    pub fn pairs(&self) -> usize {
        self.done.model().pairs.len()
    }

    /// Return positions, gaps, compressions, pressures and normal displacements at the contact points of a pair, on
    /// every rank. `pair` is less than [`Solution::pairs`].
    ///
    /// # Panics
    /// When there is no such pair.
    pub fn contact(&self, pair: usize) -> ContactTable {
        report::contact_table(&self.done, self.estimate.as_ref(), pair)
    }

    /// Return displacements and stresses at the nodes of a body; none on ranks that have no part of it. Bodies are in
    /// the order of the scene.
    ///
    /// If a body is distributed over ranks, each rank has the nodes of its part. Every cell is in one part; nodes
    /// between parts are in several.
    ///
    /// # Errors
    /// The failure of a solver that should have found the interior of the body.
    ///
    /// # Panics
    /// When there is no such body.
    pub fn body(&self, body: usize) -> Option<Result<&BodyField>> {
        let info = &self.done.built.discrete.bodies[body];
        match self.recovered[body].as_ref()? {
            Ok(recovered) => Some(Ok(recovered.field(info))),
            Err(error) => Some(Err(Error::new(error.kind(), error.message()))),
        }
    }

    /// Return for each node of [`Solution::body`] its index among the points of the mesh. These are
    /// [`MeshArrays::points`], or the points of a file that a group uses. Nodes that are not vertices have `u32::MAX`
    /// if the order of the body or of the mesh is above two.
    ///
    /// # Panics
    /// When there is no such body.
    pub fn points(&self, body: usize) -> &[u32] {
        &self.done.built.discrete.bodies[body].points
    }
}

#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
struct Page;
