//! Rigid parts beside bodies whose system has no unknowns for them: their few amounts are eliminated around it.
//!
//! Let G = K + B'DB be the matrix of the bodies, with springs D, N the closings of the springs by the motions of rigid
//! parts, and a their amounts. Then
//!
//! ```text
//! G x + B'D N a = r            x = x_0 - X a,     G x_0 = r,   G X = B'D N
//! N'D (B x + N a) = s          S a = s - N'D B x_0,     S = N'D (N - B X) = (N - B X)'D (N - B X) + X'K X
//! ```
//!
//! where s is the work that is left on the motions. X stays as long as the springs do. The last form of S is the energy
//! of the motions with the bodies that follow them. It stays positive, and errors of X are in it squared, where a body
//! follows so well that nearly nothing of N'D N is left. N'D B x_0 = X'r if x_0 and X are exact: the first form has the
//! rigid parts in balance with an inexact x_0, and the second one is symmetric, as a preconditioner must be.

use super::Model;
use super::field::{DisplacementField, local_dot};
use super::linear::Solved;
use super::motions::Motions;
use crate::error::Result;
use crate::linalg::dot;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Relative error of the columns of X, in the energy norm, by an iterative solver. The error of a step by them is that
/// share of the part of the step that moves the rigid parts. `meshes/indenter`, `meshes/bolt`, and a sphere on 81 675
/// dofs take 74, 299 and 131 iterations of multigrid, instead of 200, 349 and 325 with 1e-2, and 82, 290 and 280 with
/// 1e-8.
pub const ACCURACY: f64 = 1e-4;

/// A motion of a rigid part.
#[derive(Debug, Clone, Copy)]
struct PartMotion {
    /// Number of the rigid part.
    body: usize,
    /// Number of the motion among those of the part.
    motion: usize,
}

impl PartMotion {
    /// Return the motion alone.
    fn alone(&self, model: &Model) -> DisplacementField {
        let mut field = DisplacementField::zero(model);
        field.rigid[self.body][self.motion] = 1.0;
        model.put(self.body, &model.bodies[self.body].motions[self.motion].trace, &mut field.trace);
        field
    }
}

/// The system of bodies with springs, without the rigid parts.
pub trait WithoutRigidParts {
    /// Return whether a rigid part is eliminated around the system.
    fn is_apart(&self, model: &Model, body: usize) -> bool;

    /// Return the change of length of each spring by a trace (2n).
    fn closings(&self, model: &Model, trace: &[f64]) -> Vec<f64>;

    /// Solve G x = B' `force` for forces at the points, n, starting from `near`. Return x with the estimated energy
    /// norm of its error. Collective.
    fn solve_bodies(
        &mut self,
        model: &mut Model,
        force: &[f64],
        near: Option<DisplacementField>,
    ) -> Result<Solved<(DisplacementField, f64)>>;

    /// Return K v for the displacements v of every local body. Collective.
    fn multiply_bodies(&mut self, model: &mut Model, v: &[Vec<f64>]) -> Vec<Vec<f64>>;
}

/// The rigid parts around a system with one set of springs.
#[derive(Debug, Clone)]
pub struct RigidParts {
    motions: Vec<PartMotion>,
    /// D. The first n are those at the contact points, which rigid parts close.
    springs: Vec<f64>,
    /// -D N at the points, n each.
    pulls: Vec<Vec<f64>>,
    /// (-X, 1) of each motion.
    columns: Vec<DisplacementField>,
    /// Estimated energy norms of the errors of X.
    errors: Vec<f64>,
    /// The factor of S; `None` if nothing resists some motion.
    stiffness: Option<Cholesky<f64, Dyn>>,
}

/// What the rigid parts do in a step.
pub struct RigidStep {
    /// a.
    pub amounts: DVector<f64>,
    /// What they add to the squared energy norm of the step.
    pub energy: f64,
    /// Estimated energy norm of the error by that of X.
    pub error: f64,
}

impl RigidParts {
    /// Return the rigid parts around a system with these `springs`; `None` if the model has none there. The parts
    /// `known` from before serve if their springs are the same, and are near otherwise. Each motion costs a solve in
    /// the bodies. Collective.
    ///
    /// # Errors
    /// Failures of the solver library, and the failure of a solver.
    pub fn update(
        known: Option<Self>,
        system: &mut dyn WithoutRigidParts,
        model: &mut Model,
        springs: &[f64],
    ) -> Result<Solved<Option<Self>>> {
        if known.as_ref().is_some_and(|known| known.springs == springs) {
            return Ok(Ok(known));
        }
        let motions: Vec<PartMotion> = (0..model.bodies.len())
            .filter(|&body| model.bodies[body].is_rigid && system.is_apart(model, body))
            .flat_map(|body| (0..model.bodies[body].motions.len()).map(move |motion| PartMotion { body, motion }))
            .collect();
        if motions.is_empty() {
            return Ok(Ok(None));
        }
        let mut before = known.map_or(Vec::new(), |known| known.columns).into_iter();
        let (pulls, columns, errors, stiffness) = (Vec::new(), Vec::new(), Vec::new(), None);
        let mut parts = Self { motions, springs: springs.to_vec(), pulls, columns, errors, stiffness };
        for motion in parts.motions.clone() {
            let alone = motion.alone(model);
            let closing = alone.closing();
            let near = before.next().map(|mut column| {
                column.add(-1.0, &alone);
                column
            });
            let pull: Vec<f64> = closing.iter().zip(springs).map(|(closing, spring)| -spring * closing).collect();
            let (mut column, error) = match system.solve_bodies(model, &pull, near)? {
                Ok(solved) => solved,
                Err(failure) => return Ok(Err(failure)),
            };
            column.add(1.0, &alone);
            parts.columns.push(column);
            parts.pulls.push(pull);
            parts.errors.push(error);
        }
        parts.factor(system, model);
        Ok(Ok(Some(parts)))
    }

    /// Let each rigid part move alone, while the bodies stay. Collective.
    pub fn part_from_bodies(&mut self, system: &mut dyn WithoutRigidParts, model: &mut Model) {
        self.columns = self.motions.iter().map(|motion| motion.alone(model)).collect();
        self.factor(system, model);
    }

    /// Factor S. One message.
    fn factor(&mut self, system: &mut dyn WithoutRigidParts, model: &mut Model) {
        let (count, columns) = (self.columns.len(), &self.columns);
        let products: Vec<_> =
            columns.iter().map(|column| system.multiply_bodies(model, &column.displacements)).collect();
        let mut strain = DMatrix::from_fn(count, count, |i, j| local_dot(&columns[i].displacements, &products[j]));
        model.exchange.sum(strain.as_mut_slice());
        let closings: Vec<Vec<f64>> = columns.iter().map(|column| system.closings(model, &column.trace)).collect();
        let force = |closing: &Vec<f64>| closing.iter().zip(&self.springs).map(|(c, d)| c * d).collect::<Vec<f64>>();
        let forces: Vec<Vec<f64>> = closings.iter().map(force).collect();
        let all = strain + DMatrix::from_fn(count, count, |i, j| dot(&closings[i], &forces[j]));
        // rounding makes it asymmetric
        self.stiffness = (0.5 * (&all + all.transpose())).cholesky();
    }

    /// Return whether something resists every motion.
    pub fn are_resisted(&self) -> bool {
        self.stiffness.is_some()
    }

    /// Return the work s of a residual on each motion. One message.
    pub fn works(&self, model: &Model, residual: &[Vec<f64>]) -> Vec<f64> {
        let motions = Motions::of(model);
        let all = motions.work_of(model, residual);
        self.motions.iter().map(|part| all[motions.of_body(part.body).start + part.motion]).collect()
    }

    /// Return how the parts move where x_0 closes the points by `closing`, n, and `works` are the works s.
    pub fn moved(&self, works: &[f64], closing: &[f64]) -> RigidStep {
        let lacking = works.iter().zip(&self.pulls).map(|(work, pull)| work + dot(pull, closing));
        self.step(DVector::from_iterator(works.len(), lacking))
    }

    /// Return the works s - X'r of a residual on the motions. Two messages.
    pub fn joint_works(&self, model: &Model, residual: &[Vec<f64>]) -> DVector<f64> {
        let mut works: Vec<f64> =
            self.columns.iter().map(|column| local_dot(&column.displacements, residual)).collect();
        model.exchange.sum(&mut works);
        let on_motions = Motions::of(model).work_of(model, residual);
        let rigid = self.columns.iter().map(|column| dot(&column.rigid.concat(), on_motions.as_slice()));
        DVector::from_iterator(works.len(), works.iter().zip(rigid).map(|(work, rigid)| work + rigid))
    }

    /// Return the step by which the parts follow works that are left on them.
    pub fn step(&self, lacking: DVector<f64>) -> RigidStep {
        let amounts = self.stiffness.as_ref().map_or(DVector::zeros(lacking.len()), |factor| factor.solve(&lacking));
        let error = self.errors.iter().zip(amounts.iter()).map(|(error, a)| (error * a).abs()).sum();
        RigidStep { energy: amounts.dot(&lacking), amounts, error }
    }

    /// Add the motions by these amounts, with the bodies that follow, to a step.
    pub fn add_to(&self, amounts: &DVector<f64>, step: &mut DisplacementField) {
        self.columns.iter().zip(amounts.iter()).for_each(|(column, &a)| step.add(a, column));
    }

    /// Add to `closing`, n, what the motions by these amounts close, with the bodies that follow.
    pub fn close(&self, amounts: &DVector<f64>, closing: &mut [f64]) {
        for (column, a) in self.columns.iter().zip(amounts.iter()) {
            closing.iter_mut().zip(column.closing()).for_each(|(sum, c)| *sum += a * c);
        }
    }
}
