//! The linear step by conjugate gradients preconditioned by the Robin sweep: every iteration solves each body once,
//! independently.
//!
//! One iteration carries information from a body to its neighbours only, so the rigid motions Z that supports leave
//! free are deflated (balancing: Mandel, Comm. Numer. Meth. Engng 9, 1993). With the matrix H of (35), a correction z =
//! G^-1 r becomes (I - Z (Z'HZ)^- Z'H) z: what is left of z after whole bodies have moved until they are in balance
//! again. Every rank has all contact points, so this needs no message and no solve.

use super::sweep::{Coefficient, Sweep, Sweeper};
use crate::error::Result;
use crate::linalg::{DIGIT, Factor, axpy, dot};
use crate::model::Model;
use crate::model::field::{DisplacementField, add_forces, local_dot};
use crate::model::linear::{Failure, LinearSolution, LinearStep, Solved, StoppingTest, System, Trial};
use crate::model::motions::Motions;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::rc::Rc;

/// Most iterations of a linear step: long before, rounding spoils the conjugacy of the directions.
pub(super) const MOST_SWEEPS: usize = 400;

/// Iterations whose gain of energy estimates the error before them (Hestenes and Stiefel). What later iterations gain
/// is missing; the least eigenvalue covers that ([`Lanczos::squared_error`]).
const GAINS: usize = 4;

/// Relative accuracy of iterative solves of bodies as preconditioner, and of a step.
const ROUGH: f64 = 1e-2;

/// The linear step by conjugate gradients around sweeps.
pub struct SweepCg {
    coefficient: Option<Coefficient>,
    sweeper: Sweeper,
    systems: usize,
    /// Least eigenvalue found in any system so far.
    least: f64,
}

impl SweepCg {
    /// Return a solver that gives the bodies' matrices the Robin term of this coefficient.
    pub fn new(coefficient: Coefficient) -> Self {
        Self { coefficient: Some(coefficient), ..Self::with_robin_term() }
    }

    /// Return a solver that takes the Robin term that the bodies carry.
    pub fn with_robin_term() -> Self {
        Self { coefficient: None, sweeper: Sweeper::default(), systems: 0, least: f64::INFINITY }
    }
}

impl LinearStep for SweepCg {
    fn name(&self) -> &'static str {
        "newton-robin"
    }

    fn solve(&mut self, system: System) -> Result<Solved<LinearSolution>> {
        let System { model, layer, springs, residual, enough } = system;
        model.set_tolerance(ROUGH)?;
        if let Some(coefficient) = &mut self.coefficient {
            let weight = coefficient.weight(model, layer, self.systems)?;
            model.robin(&weight)?;
        }
        self.systems += 1;
        let before = self.sweeper.sweeps;
        let found = match conjugate_gradients(
            model,
            &mut self.sweeper,
            springs,
            residual,
            (enough, MOST_SWEEPS),
            self.least,
        )? {
            Ok(found) => found,
            Err(failure) => return Ok(Err(failure)),
        };
        let (solution, lanczos) = found;
        self.least = lanczos.spectrum().map_or(self.least, |(low, _)| low.min(self.least));
        let LinearSolution { energy, error, .. } = solution;
        if self.sweeper.sweeps - before > MOST_SWEEPS && error * error > DIGIT * DIGIT * energy {
            let relative = error / energy.sqrt();
            let reason = format!("{MOST_SWEEPS} sweeps leave an error of {relative:.0e} of the linear step");
            return Ok(Err(Failure { body: None, reason }));
        }
        Ok(Ok(solution))
    }

    /// In its first iterations, the estimated error of a solve that stagnates is too small.
    fn roughest(&self) -> f64 {
        ROUGH
    }

    fn sweeps(&self) -> usize {
        self.sweeper.sweeps
    }
}

/// Solve (K + B' diag(springs) B) x = r with the Robin term that the model carries, until `enough` says so or for
/// `most` iterations. Return the solution with the coefficients of the iteration. `springs` are omega kappa at the
/// points (n). `least` is the least eigenvalue of earlier systems, infinite if there were none: the first iterations do
/// not see the slow modes.
pub(super) fn conjugate_gradients(
    model: &mut Model,
    sweeper: &mut Sweeper,
    springs: &[f64],
    residual: &[Vec<f64>],
    (enough, most): (&mut StoppingTest, usize),
    least: f64,
) -> Result<Solved<(LinearSolution, Lanczos)>> {
    let mut state = ConjugateGradients::new(model, springs, residual, least);
    let squared = loop {
        let before = state.previous.as_ref().map_or(&state.r, |previous| &previous.residual);
        let sweep = sweeper.precondition(model, state.r.clone(), before)?;
        if let Some(failure) = sweep.failed {
            return Ok(Err(failure));
        }
        let rz = sweep.decrement;
        let lanczos = &state.lanczos;
        let error = lanczos.squared_error(rz);
        let trial = Trial { closing: &state.x.closing(), energy: lanczos.energy, error: error.max(0.0).sqrt() };
        if error == 0.0 || enough(model, &trial) || lanczos.alphas.len() == most {
            break error;
        }
        let Sweep { correction, product, residual, .. } = sweep;
        let direction = state.direction(model, correction, rz - product);
        if !state.advance(model, &direction, rz) {
            break if error.is_finite() { error } else { rz.max(0.0) };
        }
        state.previous = Some(Previous { direction, decrement: rz, residual });
    };
    let ConjugateGradients { x, lanczos, .. } = state;
    let solution = LinearSolution { field: x, energy: lanczos.energy, error: squared.max(0.0).sqrt(), is_exact: false };
    Ok(Ok((solution, lanczos)))
}

/// Conjugate gradients under way.
struct ConjugateGradients<'a> {
    /// omega kappa, n.
    springs: &'a [f64],
    /// Z'HZ.
    coarse: Rc<Factor>,
    /// The residual, on the dofs of each body that lives on this rank.
    r: Vec<Vec<f64>>,
    /// Its work on the free motions of all bodies.
    work: DVector<f64>,
    x: DisplacementField,
    lanczos: Lanczos,
    previous: Option<Previous>,
}

/// The previous iteration.
struct Previous {
    direction: DisplacementField,
    /// r'G^-1 r.
    decrement: f64,
    residual: Vec<Vec<f64>>,
}

impl<'a> ConjugateGradients<'a> {
    /// Start with the solution in the space of rigid motions.
    fn new(model: &Model, springs: &'a [f64], residual: &[Vec<f64>], least: f64) -> Self {
        let motions = Motions::of(model);
        let coarse = motions.springs(springs).factor();
        let work = motions.work_of(model, residual);
        let y = coarse.solve(&work);
        let lanczos = Lanczos { energy: y.dot(&work), least, ..Lanczos::default() };
        let (mut x, mut r) = (DisplacementField::zero(model), residual.to_vec());
        add_motions(model, 1.0, &y, &mut x);
        let push: Vec<f64> = springs.iter().zip(motions.closing(&y)).map(|(spring, s)| -spring * s).collect();
        add_forces(model, &push, &mut r);
        let work = work + motions.work(&push);
        Self { springs, coarse, r, work, x, lanczos, previous: None }
    }

    /// Return the next direction: the deflated correction, conjugate to the previous direction. `change` is z'(r -
    /// r_previous): with this flexible rule, the preconditioner may be an inexact solve.
    fn direction(&mut self, model: &Model, mut correction: DisplacementField, change: f64) -> DisplacementField {
        let force: Vec<f64> = self.springs.iter().zip(correction.closing()).map(|(spring, s)| spring * s).collect();
        let y = self.coarse.solve(&Motions::of(model).work(&force));
        add_motions(model, -1.0, &y, &mut correction);
        match self.previous.take() {
            None => correction,
            Some(Previous { mut direction, decrement, .. }) => {
                let beta = (change / decrement).max(0.0);
                self.lanczos.betas.push(beta);
                direction.add_to(beta, &correction);
                direction
            }
        }
    }

    /// Go along a direction p to the least energy. Return false if only rounding is left of p; `rz` is r'G^-1 r.
    fn advance(&mut self, model: &mut Model, p: &DisplacementField, rz: f64) -> bool {
        let mut image = model.multiply(&p.displacements);
        let closing = p.closing();
        let spring: Vec<f64> = self.springs.iter().zip(&closing).map(|(w, s)| w * s).collect();
        // r'p, not r'z: rounding leaves rigid motions in r that p does not have
        let mut sums = [local_dot(&image, &p.displacements), local_dot(&self.r, &p.displacements)];
        model.exchange.sum(&mut sums);
        let rigid = DVector::from_vec(p.rigid.concat());
        let (curvature, slope) = (sums[0] + dot(&spring, &closing), sums[1] + self.work.dot(&rigid));
        // p'Gp is at least r'z, so if deflation leaves only rounding of p, its curvature is negligible compared with
        // r'z
        if !(slope > 0.0 && curvature > f64::EPSILON * rz) {
            return false;
        }
        add_forces(model, &spring, &mut image);
        let alpha = slope / curvature;
        self.x.add(alpha, p);
        self.lanczos.gain(alpha, alpha * slope);
        self.r.iter_mut().zip(&image).for_each(|(r, y)| axpy(-alpha, y, r));
        self.work.axpy(-alpha, &Motions::of(model).work(&spring), 1.0);
        true
    }
}

/// v += s Z y.
fn add_motions(model: &Model, s: f64, y: &DVector<f64>, v: &mut DisplacementField) {
    let motions = Motions::of(model);
    v.rigid.iter_mut().zip(motions.of_bodies(y)).for_each(|(rigid, y)| axpy(s, &y, rigid));
    axpy(s, &motions.trace(model, y), &mut v.trace);
}

/// The coefficients of conjugate gradients, from which the spectrum and the error are estimated.
#[derive(Default)]
pub(super) struct Lanczos {
    alphas: Vec<f64>,
    betas: Vec<f64>,
    /// Least eigenvalue known from earlier systems.
    least: f64,
    /// Squared energy norm that each iteration gained.
    gains: Vec<f64>,
    /// Squared energy norm of x.
    energy: f64,
}

/// Iterations after which recent gains alone estimate the error: the eigenvalues of the Lanczos matrix take n^3
/// operations in each of n iterations, and the least one is known by then.
const SETTLED: usize = 64;

impl Lanczos {
    /// Note an iteration of step length `alpha` that gained this squared energy norm.
    fn gain(&mut self, alpha: f64, gain: f64) {
        self.alphas.push(alpha);
        self.gains.push(gain);
        self.energy += gain;
    }

    /// Estimate the squared energy norm of the error where r'G^-1 r is `rz`. It is at most `rz` over the least
    /// eigenvalue, and about what the last iterations gained.
    fn squared_error(&self, rz: f64) -> f64 {
        let lately = match self.gains.len() {
            0 => return if rz > 0.0 { f64::INFINITY } else { 0.0 },
            n => self.gains[n - n.min(GAINS)..].iter().sum(),
        };
        // both estimates are too small as long as a slow mode has not appeared; if the solve ends early, the recent
        // gains are all there are
        let low = if self.alphas.len() <= SETTLED {
            self.spectrum().map_or(0.0, |(low, _)| low.min(self.least))
        } else {
            0.0
        };
        let by_spectrum = rz.max(0.0) / low;
        if self.gains.len() <= GAINS || by_spectrum.is_infinite() {
            by_spectrum.min(lately)
        } else {
            by_spectrum.max(lately)
        }
    }

    /// Return the extreme eigenvalues of the Lanczos matrix; none before the first iteration, or if they are not
    /// positive and finite.
    pub fn spectrum(&self) -> Option<(f64, f64)> {
        let (n, alphas, betas) = (self.alphas.len(), &self.alphas, &self.betas);
        let mut t = DMatrix::zeros(n, n);
        for i in 0..n {
            t[(i, i)] = alphas[i].recip() + if i > 0 { betas[i - 1] / alphas[i - 1] } else { 0.0 };
            if i + 1 < n {
                let off = betas.get(i).copied().unwrap_or(0.0).sqrt() / alphas[i];
                t[(i, i + 1)] = off;
                t[(i + 1, i)] = off;
            }
        }
        if n == 0 {
            return None;
        }
        let values = SymmetricEigen::new(t).eigenvalues;
        let (low, high) = (values.min(), values.max());
        (low > 0.0 && high.is_finite()).then_some((low, high))
    }
}
