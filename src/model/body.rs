//! The interface of a body for the methods.

use super::states::States;
use crate::error::Result;
use crate::linalg::Csr;
use serde::{Deserialize, Serialize};

/// The terms of one body in the functional F1 (25).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// u'Ku, twice the strain energy.
    pub strain: f64,
    /// u'Ku/2 - f'u.
    pub potential: f64,
}

/// The outcome of a solve G z = r.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solved {
    /// Krylov iterations; 0 for a direct solver.
    pub iterations: usize,
    /// Why the inner solver gave up, in its own message; `None` if it reached its tolerance.
    pub failure: Option<String>,
}

/// A load on all dofs of a body, as the dofs of a state see it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReducedLoad {
    /// The right-hand side of [`Body::solve`] with the same effect.
    pub force: Vec<f64>,
    /// Work of the load while the state does not change: r_I' K_II^-1 r_I with the load r_I on eliminated dofs I; zero if there are none.
    pub work: f64,
}

/// Counters of the work of a body so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyCounts {
    /// Number of numeric factorisations or preconditioner set-ups.
    pub factorizations: usize,
    /// Number of dense factorisations of the Robin matrices of condensed bodies.
    pub dense_factorizations: usize,
    /// Number of local corrections (exact solves near the contact) that were set up in place of preconditioners.
    pub patches: usize,
    /// Number of symbolic factorisations.
    pub symbolic: usize,
    /// Number of numeric factorisations of K that were reused from an earlier run.
    pub factorizations_avoided: usize,
    /// Number of solves G z = r.
    pub solves: usize,
    /// Number of Krylov iterations in these solves.
    pub inner_iterations: usize,
    /// Number of changes of the Robin term that changed the matrix.
    pub robin_updates: usize,
    /// Number of requested changes that left the Robin term as it was.
    pub robin_skipped: usize,
    /// Wall seconds in factorisations or preconditioner set-ups.
    pub factor_seconds: f64,
    /// Wall seconds of the first one, which contains the symbolic factorisation. They are included in `factor_seconds`.
    pub first_seconds: f64,
    /// Wall seconds in solves, without set-ups.
    pub solve_seconds: f64,
}

impl std::ops::AddAssign for BodyCounts {
    fn add_assign(&mut self, other: Self) {
        self.factorizations += other.factorizations;
        self.dense_factorizations += other.dense_factorizations;
        self.patches += other.patches;
        self.symbolic += other.symbolic;
        self.factorizations_avoided += other.factorizations_avoided;
        self.solves += other.solves;
        self.inner_iterations += other.inner_iterations;
        self.robin_updates += other.robin_updates;
        self.robin_skipped += other.robin_skipped;
        self.factor_seconds += other.factor_seconds;
        self.first_seconds += other.first_seconds;
        self.solve_seconds += other.solve_seconds;
    }
}

/// New loads of a body whose K stays.
#[derive(Debug)]
pub struct Loads {
    /// f, one entry a dof.
    pub force: Vec<f64>,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// The rigid motion by which supports move the body, one entry a dof; empty for none.
    pub imposed: Vec<f64>,
    /// Work of f on each rigid motion that supports leave free.
    pub work: Vec<f64>,
}

/// An elastic body with stiffness K, load f and contact rows B (one row for each contact point of each of its surfaces).
///
/// Its [`States`] describe a state. Solves may be inexact, but [`Body::residual`] is exact. For a body that is distributed over ranks
/// `residual` and `recover` are collective. Errors are failures of the solver library.
pub trait Body {
    /// Return what a state of the body is. Only [`Body::reload`] changes it.
    fn states(&self) -> &States;

    /// Compute the equilibrium residual (26) r = f - K u - B' force, with `product` = K u and `force` = omega p at each row. Return the
    /// energies of u.
    fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy;

    /// Return the squared energy norm of forces r at the dofs of a state, taken for each dof alone: r'D^-1 r with the diagonal D of
    /// K + B' diag(`springs`) B, for `springs` at each row.
    fn unbalanced(&self, r: &[f64], springs: &[f64]) -> f64;

    /// Compute y = K u, for a body that has not given its K away.
    fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]);

    /// Return K on the dofs of a state; it is empty if the inner solver stores K, or if it was given away.
    fn stiffness(&self) -> &Csr;

    /// Give K away to a matrix of all bodies ([`Joint`]). Return `None` if the body needs it itself.
    fn give_stiffness(&mut self) -> Option<Csr> {
        None
    }

    /// Form the Robin matrix G = K + B' diag(weight) B (37)-(38), with `weight` = omega psi kappa at each row. Nothing happens if the weights
    /// are those of the last call.
    fn robin(&mut self, weight: &[f64]) -> Result<()>;

    /// Factor G, or set up its preconditioner, if that has not been done since G changed.
    fn set_up(&mut self) -> Result<()>;

    /// Solve G z = r (41) with zero initial guess. A solve that does not converge is reported in [`Solved`].
    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved>;

    /// Compute z = M^-1 r with a fixed symmetric M that approximates G. This preconditions conjugate gradients over all bodies. It costs no more than
    /// a solve, and for an iterative inner solver only one application of its preconditioner.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        self.solve(r, z)
    }

    /// Set the relative tolerance of iterative solves, unless the user has set one. Return false if solves do not depend on
    /// it.
    fn precision(&mut self, _rtol: f64) -> Result<bool> {
        Ok(false)
    }

    /// Return a load on all dofs as a force on a state. What acts on supports is left out.
    fn reduce(&mut self, load: &[f64]) -> Result<ReducedLoad> {
        Ok(ReducedLoad { force: self.states().reduce(load), work: 0.0 })
    }

    /// Return the displacements of the owned and ghost nodes of this rank for a state, without the motion that supports impose.
    fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        Ok(self.states().recover(u))
    }

    /// Return the counters of the work so far.
    fn counts(&self) -> BodyCounts;

    /// Set the counters to zero for another run with the same K and f. Work that need not be repeated counts as avoided.
    fn begin_anew(&mut self);

    /// Replace the loads and keep what was made of K. Return false, with nothing changed, if other dofs are prescribed or K is needed
    /// again.
    fn reload(&mut self, _loads: &Loads) -> Result<bool> {
        Ok(false)
    }

    /// Return one line about the inner solver.
    fn describe(&self) -> String;
}

/// A body as this rank has it.
#[derive(Default)]
pub enum Local {
    /// The body lives on other ranks.
    #[default]
    Elsewhere,
    /// The body will be condensed when solvers are set up.
    Uncondensed {
        /// What the condensed body says of its inner solver.
        words: String,
        /// The elimination of the interior.
        condense: Condensation,
    },
    /// The body, or the part of it that this rank owns.
    Ready(Box<dyn Body>),
}

/// The elimination of the interior of a body, which returns the condensed body.
pub type Condensation = Box<dyn FnOnce() -> Result<Box<dyn Body>>>;

impl Local {
    /// Return the body, if it is ready. A body that is still to be condensed gives `None`, as one of another rank does.
    pub fn as_ref(&self) -> Option<&dyn Body> {
        match self {
            Self::Ready(body) => Some(&**body),
            _ => None,
        }
    }

    /// Return the body for changes, if it is ready.
    pub fn as_mut(&mut self) -> Option<&mut (dyn Body + 'static)> {
        match self {
            Self::Ready(body) => Some(&mut **body),
            _ => None,
        }
    }

    /// Return one line about the inner solver; it is empty on ranks that do not own the body.
    pub fn describe(&self) -> String {
        match self {
            Self::Uncondensed { words, .. } => words.clone(),
            Self::Ready(body) if body.states().leads() => body.describe(),
            Self::Elsewhere | Self::Ready(_) => String::new(),
        }
    }

    /// Condense the body, if it is still to be condensed.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn condense(&mut self) -> Result<()> {
        *self = match std::mem::take(self) {
            Self::Uncondensed { condense, .. } => Self::Ready(condense()?),
            local => local,
        };
        Ok(())
    }
}

/// K of all bodies, in the matrix that serves the linear step. The bodies then have no K of their own.
pub trait Joint {
    /// Return K v for every local body, from their states. Rigid motions contribute nothing, because they cause no strain. Collective.
    fn multiply(&mut self, states: &[Vec<f64>]) -> Vec<Vec<f64>>;
}
