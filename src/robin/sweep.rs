//! One sweep (41): every body solves its own linear problem, independently.

use crate::error::Result;
use crate::exchange::{self, ASKS, asks};
use crate::linalg::{axpy, dot};
use crate::model::Model;
use crate::model::body::{Energy, Solved};
use crate::model::field::{Field, residuals};
use crate::model::layer::Layer;
use crate::model::linear::Failure;

/// Numbers that a body adds to the message of a sweep: decrement, strain, potential, failed, skipped,
/// factorisations, inner iterations, and a product with another residual.
const SCALARS: usize = 8;

/// Result of a sweep at an iterate: G z = r in every body.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// r of each body that lives here.
    pub residual: Vec<Vec<f64>>,
    /// z.
    pub correction: Field,
    /// r'z = r'G^-1 r of each body.
    pub decrement: Vec<f64>,
    /// Energies of the iterate in each body.
    pub energy: Vec<Energy>,
    /// The first body whose inner solver failed, with its reason where that is known.
    pub failed: Option<Failure>,
    /// Numeric factorisations so far, all bodies.
    pub factorizations: usize,
    /// Krylov iterations so far, all bodies.
    pub inner_iterations: usize,
    /// What ranks were asked for.
    pub asked: u8,
    /// y'z for another residual y, if one was given.
    pub product: f64,
    /// Whether each body was open: no pressure and no Robin term.
    open: Vec<bool>,
}

/// |r - s r0| and |r|, squared, of the numbers here.
fn apart(r: &[f64], s: f64, r0: &[f64]) -> [f64; 2] {
    let difference = r.iter().zip(r0).map(|(r, r0)| (r - s * r0).powi(2)).sum();
    [difference, dot(r, r)]
}

/// Does sweeps and remembers what need not be done again.
#[derive(Debug, Default, Clone)]
pub struct Sweeper {
    /// Sweeps done.
    pub sweeps: usize,
    /// Solves of a body that were avoided.
    pub solves_skipped: usize,
}

impl Sweeper {
    /// Solves G_s z_s = r_s in every body, at `iterate` with its `layer` and the Robin term that the model carries
    /// (`weight` = omega psi kappa of the contact rows).
    ///
    /// A body without pressure and Robin term now and in the `last` sweep (which led here with relaxation gamma) has
    /// r = (1 - gamma) r_last and the same G: its z is known and nothing is solved, as long as rounding is far below r. What this
    /// rank was `asked` for goes with the message.
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
        let is_open = |index: usize| {
            let (force, springs) = (model.at_rows(index, &layer.force), model.of_body(index, weight));
            force.iter().chain(&springs).all(|&value| value == 0.0)
        };
        let open: Vec<bool> = (0..model.bodies.len()).map(is_open).collect();
        let (residual, energies) = residuals(model, iterate, &layer.force);
        let known = |index: usize| {
            let (last, gamma) = last.filter(|(last, _)| open[index] && last.open[index])?;
            let body = model.bodies[index].local.as_ref()?;
            let mut sums = apart(&residual[index], 1.0 - gamma, &last.residual[index]);
            if body.distribution().is_some() {
                model.exchange.sum(&mut sums);
            }
            // r = (1 - gamma) r_last to rounding
            (sums[0] <= 1e-12 * sums[1]).then(|| {
                let mut z = vec![0.0; body.len()];
                axpy(1.0 - gamma, &last.correction.states[index], &mut z);
                z
            })
        };
        let known: Vec<_> = (0..model.bodies.len()).map(known).collect();
        let mut sweep = self.solve(model, residual, known, energies, None, asked)?;
        sweep.open = open;
        Ok(sweep)
    }

    /// G^-1 r for any r (consumed into the result): a sweep as preconditioner. `product` of the result is `other`'z.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn precondition(&mut self, model: &mut Model, residual: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Result<Sweep> {
        let bodies = model.bodies.len();
        self.solve(model, residual, vec![None; bodies], vec![Energy::default(); bodies], Some(other), 0)
    }

    fn solve(
        &mut self,
        model: &mut Model,
        residual: Vec<Vec<f64>>,
        mut known: Vec<Option<Vec<f64>>>,
        energies: Vec<Energy>,
        other: Option<&[Vec<f64>]>,
        asked: u8,
    ) -> Result<Sweep> {
        let (bodies, rows) = (model.bodies.len(), 2 * model.points());
        // one message: traces, then SCALARS of each body, and what is asked
        let end = rows + SCALARS * bodies;
        let mut buffer = vec![0.0; end + ASKS];
        buffer[end..].copy_from_slice(&asks(asked));
        let mut sweep = Sweep::default();
        let mut reasons = vec![String::new(); bodies];
        for index in 0..bodies {
            let Some(body) = &mut model.bodies[index].local else {
                sweep.correction.states.push(Vec::new());
                continue;
            };
            let r = &residual[index];
            let scalars = &mut buffer[rows + SCALARS * index..rows + SCALARS * (index + 1)];
            let skipped = known[index].is_some();
            let z = match known[index].take() {
                Some(z) => z,
                None => {
                    let mut z = vec![0.0; r.len()];
                    let Solved { failure, .. } = match other {
                        Some(_) => body.precondition(r, &mut z)?,
                        None => body.solve(r, &mut z)?,
                    };
                    if let Some(reason) = failure {
                        reasons[index] = reason;
                        scalars[3] = 1.0;
                    }
                    z
                }
            };
            scalars[0] = dot(r, &z);
            scalars[1] = energies[index].strain;
            scalars[2] = energies[index].potential;
            if body.leads() {
                let counts = body.counts();
                scalars[4] = f64::from(skipped);
                scalars[5] = counts.factorizations as f64;
                scalars[6] = counts.inner_iterations as f64;
            }
            scalars[7] = other.map_or(0.0, |other| dot(&other[index], &z));
            let mut trace = vec![0.0; model.bodies[index].row_stiffness.len()];
            if let Some(body) = &model.bodies[index].local {
                body.trace(&z, &mut trace);
            }
            model.put(index, &trace, &mut buffer[..rows]);
            sweep.correction.states.push(z);
        }
        model.exchange.sum(&mut buffer);
        sweep.asked = exchange::asked(&buffer[end..]);
        for (index, scalars) in buffer[rows..end].chunks_exact(SCALARS).enumerate() {
            sweep.decrement.push(scalars[0]);
            sweep.energy.push(Energy { strain: scalars[1], potential: scalars[2] });
            if scalars[3] != 0.0 && sweep.failed.is_none() {
                sweep.failed = Some(Failure { body: Some(index), reason: reasons[index].clone() });
            }
            self.solves_skipped += usize::from(scalars[4] != 0.0);
            sweep.factorizations += scalars[5] as usize;
            sweep.inner_iterations += scalars[6] as usize;
            sweep.product += scalars[7];
        }
        buffer.truncate(rows);
        sweep.correction.trace = buffer;
        sweep.residual = residual;
        self.sweeps += 1;
        Ok(sweep)
    }
}
