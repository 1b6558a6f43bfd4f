//! Rigid parts beside a matrix that has complete nodes only: their few unknowns are eliminated around it.
//!
//! Let G = K + B'DB be the matrix, with springs D at the contact points, N the closings of the points by the motions of
//! rigid parts, and a their amounts. Then
//!
//! ```text
//! G x + B'D N a = r            x = x_0 - X a,     G x_0 = r,   G X = B'D N
//! N'D (B x + N a) = s          S a = s - N'D B x_0,     S = N'D (N - B X) = (N - B X)'D (N - B X) + X'K X
//! ```
//!
//! where s is the work that is left on the motions. X stays as long as the springs do. The last form of S is the energy
//! of the motions with the bodies that follow them. It stays positive, and errors of X are in it squared, where a body
//! follows so well that nearly nothing of N'D N is left.

use super::Model;
use super::rigid::Motions;
use crate::linalg::{axpy, dot};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Relative error of the columns of X, in the energy norm. The error of a step by them is that share of the part of the
/// step that moves the rigid parts. `meshes/indenter`, `meshes/bolt`, and a sphere on 81 675 dofs take 74, 299 and 131
/// iterations of multigrid, instead of 200, 349 and 325 with 1e-2, and 82, 290 and 280 with 1e-8.
pub(super) const ACCURACY: f64 = 1e-4;

/// A motion of a rigid part.
pub(super) struct BorderMotion {
    /// Number of the rigid part.
    pub body: usize,
    /// Number of the motion among those of all bodies.
    motion: usize,
    /// N, its closings, n.
    closing: Vec<f64>,
}

/// Return the motions of the rigid parts of a model.
pub(super) fn motions(model: &Model) -> Vec<BorderMotion> {
    let all = Motions::of(model);
    let unit = |i: usize| DVector::from_fn(all.count(), |k, _| f64::from(u8::from(k == i)));
    let of_body = |body: usize| {
        let all = &all;
        all.of_body(body).map(move |motion| BorderMotion { body, motion, closing: all.closing(&unit(motion)) })
    };
    (0..model.bodies.len()).filter(|&body| model.bodies[body].is_rigid).flat_map(of_body).collect()
}

/// The eliminated unknowns for one set of springs.
pub(super) struct Border {
    /// D, n.
    pub springs: Vec<f64>,
    /// D N, n each.
    pub forces: Vec<Vec<f64>>,
    /// X in the rows of this rank.
    pub columns: Vec<Vec<f64>>,
    /// N - B X, n each.
    left: Vec<Vec<f64>>,
    /// Energy norms of the errors of X.
    errors: Vec<f64>,
    /// S, the rows up to the diagonal.
    stiffness: Vec<Vec<f64>>,
    /// Factor of S.
    factor: Option<Cholesky<f64, Dyn>>,
}

/// What the rigid parts do in a step.
pub(super) struct BorderStep {
    /// a.
    pub amounts: Vec<f64>,
    /// (N - B X) a, n, by which all points close besides B x_0.
    pub closing: Vec<f64>,
    /// What they add to the squared energy norm of the step.
    pub energy: f64,
    /// Estimated energy norm of the error by that of X.
    pub error: f64,
}

impl Border {
    /// Start with D N.
    pub fn new(motions: &[BorderMotion], springs: &[f64]) -> Self {
        let force = |motion: &BorderMotion| motion.closing.iter().zip(springs).map(|(n, spring)| n * spring).collect();
        let forces = motions.iter().map(force).collect();
        Self {
            springs: springs.to_vec(),
            forces,
            columns: Vec::new(),
            left: Vec::new(),
            errors: Vec::new(),
            stiffness: Vec::new(),
            factor: None,
        }
    }

    /// Append a column of X, which closes the points by B X, n, with K X and the energy norm of its error. Collective.
    pub fn push(
        &mut self,
        model: &Model,
        motion: &BorderMotion,
        (column, product): (Vec<f64>, &[f64]),
        closing: &[f64],
        error: f64,
    ) {
        self.columns.push(column);
        self.left.push(motion.closing.iter().zip(closing).map(|(n, closing)| n - closing).collect());
        self.errors.push(error);
        let mut row: Vec<f64> = self.columns.iter().map(|column| dot(column, product)).collect();
        model.exchange.sum(&mut row);
        let last = &self.left[self.left.len() - 1];
        let held: Vec<f64> = last.iter().zip(&self.springs).map(|(left, spring)| left * spring).collect();
        row.iter_mut().zip(&self.left).for_each(|(sum, left)| *sum += dot(left, &held));
        self.stiffness.push(row);
    }

    /// Factor S once it is complete. Return whether something resists every motion.
    pub fn factor(&mut self) -> bool {
        let count = self.stiffness.len();
        self.factor = DMatrix::from_fn(count, count, |i, j| self.stiffness[i.max(j)][i.min(j)]).cholesky();
        self.factor.is_some()
    }

    /// Return how the rigid parts move where x_0 closes the points by `closing`, n, and `work` is the work s on their
    /// motions.
    pub fn moved(&self, work: &[f64], closing: &[f64]) -> BorderStep {
        let count = work.len();
        let lacking = DVector::from_fn(count, |i, _| work[i] - dot(&self.forces[i], closing));
        let amounts = self.factor.as_ref().map_or(DVector::zeros(count), |factor| factor.solve(&lacking));
        let mut all = vec![0.0; closing.len()];
        self.left.iter().zip(amounts.iter()).for_each(|(left, &a)| axpy(a, left, &mut all));
        let error = self.errors.iter().zip(amounts.iter()).map(|(error, a)| (error * a).abs()).sum();
        BorderStep { energy: amounts.dot(&lacking), amounts: amounts.as_slice().to_vec(), closing: all, error }
    }
}

/// Return the work of the residual, on the dofs of the local bodies, on each motion. One message.
pub(super) fn works(model: &Model, motions: &[BorderMotion], residual: &[Vec<f64>]) -> Vec<f64> {
    let all = Motions::of(model).work_of(model, residual);
    motions.iter().map(|motion| all[motion.motion]).collect()
}
