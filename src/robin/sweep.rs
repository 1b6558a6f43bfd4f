//! One sweep (41): every body solves its own linear problem, independently of the others.

use crate::error::Result;
use crate::exchange::{self, ASKS, asks};
use crate::linalg::{axpy, dot};
use crate::model::Model;
use crate::model::body::{Body, Energy};
use crate::model::field::{Field, residuals};
use crate::model::layer::Layer;
use crate::model::linear::Failure;

// Positions of the numbers that a body adds to the message of a sweep.
const DECREMENT: usize = 0;
const STRAIN: usize = 1;
const POTENTIAL: usize = 2;
const FAILED: usize = 3;
const SKIPPED: usize = 4;
const FACTORIZATIONS: usize = 5;
const INNER_ITERATIONS: usize = 6;
const PRODUCT: usize = 7;

/// How many numbers these are.
const SCALARS: usize = 8;

/// Result of a sweep at an iterate: G z = r in every body.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// r of each body that lives on this rank.
    pub residual: Vec<Vec<f64>>,
    /// z.
    pub correction: Field,
    /// r'z = r'G^-1 r of each body.
    pub decrement: Vec<f64>,
    /// Energies of the iterate in each body.
    pub energy: Vec<Energy>,
    /// The first body whose inner solver failed, with the reason if this rank knows it.
    pub failed: Option<Failure>,
    /// Numeric factorisations so far, all bodies.
    pub factorizations: usize,
    /// Krylov iterations so far, all bodies.
    pub inner_iterations: usize,
    /// Requests from outside, of all ranks (see [`exchange::asked`]).
    pub asked: u8,
    /// y'z for another residual y, if one was given.
    pub product: f64,
    /// Whether each body was open: no pressure and no Robin term.
    open: Vec<bool>,
}

/// Makes sweeps, and reuses results that are known without a solve.
#[derive(Debug, Default, Clone)]
pub struct Sweeper {
    /// Sweeps made.
    pub sweeps: usize,
    /// Solves of a body that were not needed.
    pub solves_skipped: usize,
}

/// What a sweep solves: G z = `residual` in every body.
struct Task<'a> {
    /// r of each body that lives on this rank.
    residual: Vec<Vec<f64>>,
    /// z of each body where it is known without a solve.
    known: Vec<Option<Vec<f64>>>,
    /// Energies of the iterate in each body.
    energies: Vec<Energy>,
    /// The residual y of the product y'z. A sweep that is given one serves as a preconditioner.
    other: Option<&'a [Vec<f64>]>,
    /// Requests from outside, of this rank.
    asked: u8,
}

impl Sweeper {
    /// Solve G_s z_s = r_s in every body at `iterate` with its `layer`. The model carries the Robin term `weight` = omega psi kappa of the
    /// contact rows (2n). `last` is the sweep that led here, with its relaxation gamma. The requests `asked` of this rank go with the message.
    ///
    /// A body without pressure and Robin term, now and in the last sweep, has r = (1 - gamma) r_last and the same G. Its z is known without a
    /// solve, as long as rounding is far below r.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn sweep(
        &mut self,
        model: &mut Model,
        iterate: &Field,
        layer: &Layer,
        weight: &[f64],
        last: Option<(&Sweep, f64)>,
        asked: u8,
    ) -> Result<Sweep> {
        let open: Vec<bool> = (0..model.bodies.len()).map(|index| is_open(model, index, layer, weight)).collect();
        let (residual, energies) = residuals(model, iterate, &layer.force);
        let known = |index: usize| {
            let (last, gamma) = last.filter(|(last, _)| open[index] && last.open[index])?;
            known_correction(model, index, &residual[index], last, 1.0 - gamma)
        };
        let known = (0..model.bodies.len()).map(known).collect();
        let mut sweep = self.solve(model, Task { residual, known, energies, other: None, asked })?;
        sweep.open = open;
        Ok(sweep)
    }

    /// Apply G^-1 to any residual as a preconditioner; the result keeps the residual. `product` of the result is `other`'z.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn precondition(&mut self, model: &mut Model, residual: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Result<Sweep> {
        let bodies = model.bodies.len();
        let (known, energies) = (vec![None; bodies], vec![Energy::default(); bodies]);
        self.solve(model, Task { residual, known, energies, other: Some(other), asked: 0 })
    }

    /// Solve in every body that lives on this rank, and sum the results over the ranks.
    fn solve(&mut self, model: &mut Model, mut task: Task) -> Result<Sweep> {
        let (bodies, rows) = (model.bodies.len(), 2 * model.points());
        // one message: the traces, SCALARS numbers of each body, and the requests
        let end = rows + SCALARS * bodies;
        let mut message = vec![0.0; end + ASKS];
        message[end..].copy_from_slice(&asks(task.asked));
        let mut states = Vec::with_capacity(bodies);
        let mut reasons = vec![String::new(); bodies];
        for index in 0..bodies {
            let slot = &mut model.bodies[index];
            let Some(body) = &mut slot.local else {
                states.push(Vec::new());
                continue;
            };
            let scalars = &mut message[rows + SCALARS * index..][..SCALARS];
            let z = task.solve_body(index, &mut **body, scalars, &mut reasons[index])?;
            let mut trace = vec![0.0; slot.row_stiffness.len()];
            body.trace(&z, &mut trace);
            model.put(index, &trace, &mut message[..rows]);
            states.push(z);
        }
        model.exchange.sum(&mut message);
        let mut sweep = Sweep { residual: task.residual, asked: exchange::asked(&message[end..]), ..Sweep::default() };
        self.collect(&mut sweep, &message[rows..end], &reasons);
        message.truncate(rows);
        sweep.correction = Field { states, trace: message };
        Ok(sweep)
    }

    /// Take the sums of the bodies' numbers, [`SCALARS`] a body, into the result, and count the sweep.
    fn collect(&mut self, sweep: &mut Sweep, sums: &[f64], reasons: &[String]) {
        for (index, scalars) in sums.chunks_exact(SCALARS).enumerate() {
            sweep.decrement.push(scalars[DECREMENT]);
            sweep.energy.push(Energy { strain: scalars[STRAIN], potential: scalars[POTENTIAL] });
            if scalars[FAILED] != 0.0 && sweep.failed.is_none() {
                sweep.failed = Some(Failure { body: Some(index), reason: reasons[index].clone() });
            }
            self.solves_skipped += usize::from(scalars[SKIPPED] != 0.0);
            sweep.factorizations += scalars[FACTORIZATIONS] as usize;
            sweep.inner_iterations += scalars[INNER_ITERATIONS] as usize;
            sweep.product += scalars[PRODUCT];
        }
        self.sweeps += 1;
    }
}

impl Task<'_> {
    /// Return z of a body. Its numbers for the message go to `scalars`; if its inner solver fails, the cause goes to `reason`.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn solve_body(
        &mut self,
        index: usize,
        body: &mut dyn Body,
        scalars: &mut [f64],
        reason: &mut String,
    ) -> Result<Vec<f64>> {
        let r = &self.residual[index];
        let known = self.known[index].take();
        let is_skipped = known.is_some();
        let mut z = known.unwrap_or_else(|| vec![0.0; r.len()]);
        if !is_skipped {
            let solved = if self.other.is_some() { body.precondition(r, &mut z)? } else { body.solve(r, &mut z)? };
            if let Some(failure) = solved.failure {
                *reason = failure;
                scalars[FAILED] = 1.0;
            }
        }
        scalars[DECREMENT] = dot(r, &z);
        scalars[STRAIN] = self.energies[index].strain;
        scalars[POTENTIAL] = self.energies[index].potential;
        scalars[PRODUCT] = self.other.map_or(0.0, |other| dot(&other[index], &z));
        // a body that is distributed over several ranks counts once
        if body.leads() {
            let counts = body.counts();
            scalars[SKIPPED] = f64::from(is_skipped);
            scalars[FACTORIZATIONS] = counts.factorizations as f64;
            scalars[INNER_ITERATIONS] = counts.inner_iterations as f64;
        }
        Ok(z)
    }
}

/// Whether a body has neither pressure nor Robin term.
fn is_open(model: &Model, body: usize, layer: &Layer, weight: &[f64]) -> bool {
    let (force, springs) = (model.at_rows(body, &layer.force), model.of_body(body, weight));
    force.iter().chain(&springs).all(|&value| value == 0.0)
}

/// Return z = `factor` z_last of a body that lives on this rank, if r = `factor` r_last to rounding. Collective for a distributed body.
fn known_correction(model: &Model, index: usize, r: &[f64], last: &Sweep, factor: f64) -> Option<Vec<f64>> {
    let body = model.bodies[index].local.as_ref()?;
    // |r - factor r_last|^2 and |r|^2
    let difference = r.iter().zip(&last.residual[index]).map(|(r, last)| (r - factor * last).powi(2)).sum();
    let mut sums = [difference, dot(r, r)];
    if body.distribution().is_some() {
        model.exchange.sum(&mut sums);
    }
    (sums[0] <= 1e-12 * sums[1]).then(|| {
        let mut z = vec![0.0; body.len()];
        axpy(factor, &last.correction.states[index], &mut z);
        z
    })
}
