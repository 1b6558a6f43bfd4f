//! What the method asks of a body.

use super::distribution::Distribution;
use crate::error::Result;
use crate::linalg::Csr;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Quadratic terms of F1 (25) of one body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// u'Ku, twice the strain energy.
    pub strain: f64,
    /// u'Ku/2 - f'u.
    pub potential: f64,
}

/// How a solve G z = r ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solved {
    /// Krylov iterations; 0 for a direct solver.
    pub iterations: usize,
    /// Why the inner solver gave up, in its own words; `None` if it reached its tolerance.
    pub failure: Option<String>,
}

/// What a body did so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyCounts {
    /// Numeric factorisations or preconditioner set-ups.
    pub factorizations: usize,
    /// Dense factorisations of the Robin matrices of condensed bodies.
    pub dense_factorizations: usize,
    /// Exact solves near the contact made instead of preconditioner set-ups.
    pub patches: usize,
    /// Symbolic factorisations (patterns analysed).
    pub symbolic: usize,
    /// Numeric factorisations of K that an earlier run has left.
    pub factorizations_avoided: usize,
    /// Solves G z = r.
    pub solves: usize,
    /// Krylov iterations in them.
    pub inner_iterations: usize,
    /// Changes of the Robin term that reached the matrix.
    pub robin_updates: usize,
    /// Changes asked for that changed nothing and cost nothing.
    pub robin_skipped: usize,
    /// Wall seconds in factorisations or preconditioner set-ups.
    pub factor_seconds: f64,
    /// Of these, seconds in the first one, which has the symbolic factorisation in it.
    pub first_seconds: f64,
    /// Wall seconds in solves, set-ups apart.
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

/// Matrices of a body whose states are (v, a): the displacement v + R a, with rigid motions R that its supports leave.
#[derive(Debug, Clone, Copy)]
pub struct Matrices<'a> {
    /// K, of the dofs v.
    pub stiffness: &'a Csr,
    /// B, of the dofs v.
    pub rows: &'a Csr,
    /// R: one vector over the dofs v for each number in a.
    pub motions: &'a [Rc<[f64]>],
    /// B R: one vector over the contact rows each.
    pub traces: &'a [Vec<f64>],
}

impl Matrices<'_> {
    /// Length of a state.
    pub fn len(&self) -> usize {
        self.stiffness.rows() + self.motions.len()
    }

    /// Whether states are empty; they never are.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Loads of a body whose K stays.
#[derive(Debug)]
pub struct Loads {
    /// f, one entry a dof.
    pub force: Vec<f64>,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// See [`Body::carried`].
    pub carried: Vec<f64>,
    /// Work of f on each rigid motion that supports leave.
    pub work: Vec<f64>,
}

/// An elastic body with stiffness K, load f and contact rows B (one row a contact point of each of its surfaces).
///
/// A state is a vector of `len()` numbers whose meaning is the body's own: all dofs, or those that were retained.
/// Solves need not be exact; what is exact is [`Body::residual`].
pub trait Body {
    /// Length of a state.
    fn len(&self) -> usize;

    /// Whether states are empty; they never are.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The undeformed state: zero on free dofs, prescribed values on supports.
    fn rest(&self) -> Vec<f64>;

    /// t = B u: outer normal displacement at each row, without what prescribed dofs contribute.
    fn trace(&self, u: &[f64], t: &mut [f64]);

    /// y += B' rows: forces at the contact rows as forces at the dofs.
    fn add_rows(&self, rows: &[f64], y: &mut [f64]);

    /// r = f - K u - B' force, `product` = K u, `force` = omega p at each row: the equilibrium residual (26). Also returns the
    /// energies of u.
    fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy;

    /// y = K u, for a body with K of its own.
    fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]);

    /// Gives K away to a matrix of all bodies ([`Joint`](super::Joint)); none if the body needs it itself.
    fn give_stiffness(&mut self) -> Option<Csr> {
        None
    }

    /// Makes G = K + B' diag(weight) B (37)-(38), `weight` = omega psi kappa at each row. Nothing happens if the weights
    /// are those of the last call.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn robin(&mut self, weight: &[f64]) -> Result<()>;

    /// Factors G, or sets its preconditioner up, if that has not been done since it changed.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn set_up(&mut self) -> Result<()>;

    /// Solves G z = r (41) with zero guess.
    ///
    /// # Errors
    /// Failures of the solver library; not converging is told in [`Solved`].
    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved>;

    /// How far solves have to reduce r, unless the user says: a hint to iterative inner solvers. False if solves are what they
    /// are.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn precision(&mut self, _rtol: f64) -> Result<bool> {
        Ok(false)
    }

    /// Share of the energy norm of z that solves may be off: zero for a direct solver.
    fn accuracy(&self) -> f64 {
        0.0
    }

    /// Makes [`Body::matrices`] known, which may take an elimination.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn reveal(&mut self) -> Result<()> {
        Ok(())
    }

    /// z = M^-1 r with a fixed symmetric M near G: what preconditions conjugate gradients over all bodies. Costs no more than
    /// a solve, and for an iterative inner solver only one application of its preconditioner.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        self.solve(r, z)
    }

    /// Size of the rounding errors in [`Body::residual`], as |e|_{diag(G)^-1} squared.
    fn rounding(&self, u: &[f64], force: &[f64]) -> f64;

    /// A load on all dofs as the right-hand side r of [`Body::solve`] that has the same effect; supports take their part.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn reduce(&mut self, load: &[f64]) -> Result<Vec<f64>>;

    /// What was done so far.
    fn counts(&self) -> BodyCounts;

    /// Starts the counts anew for another run with the same K and f; what need not be done again counts as avoided.
    fn begin_anew(&mut self);

    /// Takes other loads and keeps what was made of K. False, and nothing has changed, where other dofs are prescribed or K is needed
    /// anew.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn reload(&mut self, _loads: &Loads) -> Result<bool> {
        Ok(false)
    }

    /// Its matrices, if they are in this process's memory: for methods that join the bodies.
    fn matrices(&self) -> Option<Matrices<'_>> {
        None
    }

    /// How many numbers at the end of a state are rigid motion.
    fn rigid(&self) -> usize {
        0
    }

    /// Gives a state that was made from [`Body::matrices`] the body's own shares of deformation and rigid motion.
    fn separate(&self, _state: &mut [f64]) {}

    /// The rigid motion by which supports carry the body, one entry a dof of the nodes that this rank knows; empty for none. It is no part of
    /// states.
    fn carried(&self) -> &[f64] {
        &[]
    }

    /// How its dofs are dealt out over the ranks; none for a body of this rank alone. Of a body that is dealt out, `residual`,
    /// `separate` and `recover` are collective.
    fn distribution(&self) -> Option<&Distribution> {
        None
    }

    /// Whether this rank speaks for the body.
    fn leads(&self) -> bool {
        self.distribution().is_none_or(|distribution| distribution.leads)
    }

    /// Displacements of the nodes that this rank knows for a state, without the motion of [`Body::carried`]: of all, or of those of its part.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn recover(&self, u: &[f64]) -> Result<Vec<f64>>;

    /// One line about the inner solver.
    fn describe(&self) -> String;
}
