//! The linear step by conjugate gradients over the Robin sweep: every iteration solves each body once, independently.
//!
//! One iteration tells a body of its neighbours alone, so the rigid motions Z that supports leave free are deflated ([`Coarse`]): with the
//! matrix H of (35), a correction z = G^-1 r becomes (I - Z (Z'HZ)^- Z'H) z, what is left of it when whole bodies have moved so that
//! they are in balance again. Every rank knows the contact points: no message, no solve.

use super::coefficient::Coefficient;
use super::sweep::Sweeper;
use crate::error::Result;
use crate::linalg::{axpy, dot};
use crate::model::Model;
use crate::model::coarse::{Coarse, Space};
use crate::model::field::{Field, add_forces, apply_stiffness, local_dot};
use crate::model::linear::{Enough, Failure, LinearStep, Solution, Solved, System, Trial};
use crate::model::rigid::Motions;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::rc::Rc;

/// Iterations at most: conjugate gradients lose their directions to rounding long before.
const MOST: usize = 400;

/// Error of a linear step, as a share of it, above which the step is not solved after [`MOST`] iterations. Newton's method converges with
/// any share below one, and the worse the larger it is (Dembo, Eisenstat, Steihaug, Inexact Newton methods, 1982).
const LEAST: f64 = 0.1;

/// Iterations over which the gain of energy tells the error before them (Hestenes and Stiefel).
const DELAY: usize = 4;

/// Precision of iterative solves of bodies as preconditioner, and of a step.
const ROUGH: f64 = 1e-2;

/// Solves linear steps by sweeps.
pub struct Sweeps {
    coefficient: Option<Coefficient>,
    sweeper: Sweeper,
    systems: usize,
    spectrum: Option<(f64, f64)>,
    /// Least eigenvalue that any system showed.
    least: f64,
}

impl Sweeps {
    /// With this Robin coefficient in the bodies' matrices.
    pub fn new(coefficient: Coefficient) -> Self {
        Self { coefficient: Some(coefficient), ..Self::carried() }
    }

    /// With the Robin term that bodies carry.
    pub fn carried() -> Self {
        Self { coefficient: None, sweeper: Sweeper::default(), systems: 0, spectrum: None, least: f64::INFINITY }
    }
}

impl LinearStep for Sweeps {
    fn name(&self) -> &'static str {
        "newton-robin"
    }

    fn solve(&mut self, system: System) -> Result<Solved> {
        let System { model, places, springs, residual, enough } = system;
        model.precision(ROUGH)?;
        if let Some(coefficient) = &mut self.coefficient {
            let weight = coefficient.weight(model, places, self.systems)?;
            model.robin(&weight)?;
        }
        self.systems += 1;
        let before = self.sweeper.sweeps;
        let found = gradients(model, &mut self.sweeper, springs, residual, (enough, MOST), self.least)?;
        Ok(found.and_then(|found| {
            self.spectrum = found.spectrum.or(self.spectrum);
            self.least = found.spectrum.map_or(self.least, |(low, _)| low.min(self.least));
            let Solution { energy, error, .. } = found.solution;
            match self.sweeper.sweeps - before > MOST && error * error > LEAST * LEAST * energy {
                true => {
                    let share = error / energy.sqrt();
                    let reason = format!("{MOST} sweeps leave an error of {share:.0e} of the linear step");
                    Err(Failure { body: None, reason })
                }
                false => Ok(found.solution),
            }
        }))
    }

    /// The error of a young iteration that stands still is larger than it seems.
    fn roughest(&self) -> f64 {
        ROUGH
    }

    fn sweeps(&self) -> usize {
        self.sweeper.sweeps
    }

    fn spectrum(&self) -> Option<(f64, f64)> {
        self.spectrum
    }
}

/// What conjugate gradients found.
pub(super) struct Found {
    pub solution: Solution,
    /// Bounds of the spectrum of G^-1 H from the Lanczos matrix of the iteration.
    pub spectrum: Option<(f64, f64)>,
}

/// Solves (K + B' diag(springs) B) x = r with the Robin term that the model carries, until that is `enough`, or
/// after `most` iterations. `least` is the least eigenvalue that earlier systems showed, infinite
/// if there were none: a young iteration knows of no slow mode.
///
/// # Errors
/// Failures of the solver library.
pub(super) fn gradients(
    model: &mut Model,
    sweeper: &mut Sweeper,
    springs: &[f64],
    residual: &[Vec<f64>],
    (enough, most): (&mut Enough, usize),
    least: f64,
) -> Result<std::result::Result<Found, Failure>> {
    let coarse = Coarse::new(Rc::new(Space::of(model, None)), springs);
    // v += s Z y
    let add = |model: &Model, s: f64, y: &DVector<f64>, v: &mut Field| {
        coarse.add(s, y, &mut v.states);
        axpy(s, &Motions::of(model).trace(model, y), &mut v.trace);
    };
    let (mut r, mut x) = (residual.to_vec(), Field::zero(model));
    let (y, energy) = coarse.solve(&r);
    add(model, 1.0, &y, &mut x);
    let push: Vec<f64> = coarse.forces(&y).iter().map(|force| -force).collect();
    add_forces(model, &push, &mut r);
    let mut lanczos = Lanczos { energy, least, ..Lanczos::default() };
    let mut last: Option<(Field, f64, Vec<Vec<f64>>)> = None;
    let squared = loop {
        let before = last.as_ref().map_or(&r, |(_, _, r)| r);
        let sweep = sweeper.precondition(model, r.clone(), before)?;
        if let Some(failure) = sweep.failed {
            return Ok(Err(failure));
        }
        let rz: f64 = sweep.decrement.iter().sum();
        let error = lanczos.squared_error(rz);
        let trial = Trial { closing: &x.closing(), energy: lanczos.energy, error: error.max(0.0).sqrt() };
        if error == 0.0 || enough(model, &trial) || lanczos.alphas.len() == most {
            break error;
        }
        let mut p = sweep.correction;
        add(model, -1.0, &coarse.part(&p.closing(), false), &mut p);
        // the flexible rule: the preconditioner may be an inexact solve
        if let Some((mut direction, old, _)) = last.take() {
            let beta = ((rz - sweep.product) / old).max(0.0);
            lanczos.betas.push(beta);
            direction.add_to(beta, &p);
            p = direction;
        }
        let mut image = apply_stiffness(model, &p);
        let closing = p.closing();
        let spring: Vec<f64> = springs.iter().zip(&closing).map(|(w, s)| w * s).collect();
        let mut sums = [local_dot(&image, &p.states), local_dot(&r, &p.states)];
        model.exchange.sum(&mut sums);
        let curvature = sums[0] + dot(&spring, &closing);
        // r'z but for what rounding left of rigid motions in r, which p has not: the least energy along p is where r'p says
        let slope = sums[1];
        // p'Gp is r'z at least: a direction of which deflation leaves nothing but rounding has no curvature beside it
        if !(slope > 0.0 && curvature > f64::EPSILON * rz) {
            break if error.is_finite() { error } else { rz.max(0.0) };
        }
        add_forces(model, &spring, &mut image);
        let alpha = slope / curvature;
        x.add(alpha, &p);
        lanczos.gain(alpha, alpha * slope);
        let old = r.clone();
        r.iter_mut().zip(&image).for_each(|(r, y)| axpy(-alpha, y, r));
        last = Some((p, rz, old));
    };
    let solution = Solution { field: x, energy: lanczos.energy, error: squared.max(0.0).sqrt(), is_exact: false };
    Ok(Ok(Found { solution, spectrum: lanczos.spectrum() }))
}

/// What the numbers of conjugate gradients tell of the spectrum and of the error.
#[derive(Default)]
struct Lanczos {
    alphas: Vec<f64>,
    betas: Vec<f64>,
    /// Least eigenvalue that is known from elsewhere.
    least: f64,
    /// Squared energy norm that each iteration gained, and that of x.
    gains: Vec<f64>,
    energy: f64,
}

/// Iterations after which the least eigenvalue is known as well as it will be.
const SETTLED: usize = 64;

impl Lanczos {
    fn gain(&mut self, alpha: f64, gain: f64) {
        self.alphas.push(alpha);
        self.gains.push(gain);
        self.energy += gain;
    }

    /// Estimate of the squared energy norm of the error where r'G^-1 r is `rz`: at most that over the least eigenvalue, and about what
    /// the last iterations gained.
    fn squared_error(&self, rz: f64) -> f64 {
        let lately = match self.gains.len() {
            0 => return if rz > 0.0 { f64::INFINITY } else { 0.0 },
            n => self.gains[n - n.min(DELAY)..].iter().sum(),
        };
        // either is too small as long as a slow mode has not come up; a run that ends early has gained all of it lately
        let low = if self.alphas.len() <= SETTLED {
            self.spectrum().map_or(0.0, |(low, _)| low.min(self.least))
        } else {
            0.0
        };
        let by_spectrum = rz.max(0.0) / low;
        if self.gains.len() <= DELAY || by_spectrum.is_infinite() {
            by_spectrum.min(lately)
        } else {
            by_spectrum.max(lately)
        }
    }

    /// Extreme eigenvalues of the Lanczos matrix.
    fn spectrum(&self) -> Option<(f64, f64)> {
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
