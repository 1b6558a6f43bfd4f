//! One sweep (41): every body solves its own linear problem, independently.

use super::body::{Energy, Solved};
use super::layer::Layer;
use super::model::Model;
use crate::error::Result;
use crate::linalg::{axpy, dot};

/// An iterate u^k: states of the bodies that live here, traces of all.
#[derive(Debug, Clone)]
pub struct Iterate {
    /// State of each body; empty where the body lives on another rank.
    pub states: Vec<Vec<f64>>,
    /// B u of all contact rows (see [`super::model`] for the layout).
    pub trace: Vec<f64>,
}

impl Iterate {
    /// u <- u + gamma z (42).
    pub fn advance(&mut self, gamma: f64, sweep: &Sweep) {
        for (u, z) in self.states.iter_mut().zip(&sweep.corrections) {
            axpy(gamma, z, u);
        }
        axpy(gamma, &sweep.trace, &mut self.trace);
    }
}

/// Numbers that a body adds to the message of a sweep: decrement, strain, potential, failed, skipped,
/// factorisations, inner iterations.
const SCALARS: usize = 7;

/// Result of a sweep at an iterate: G z = r in every body.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// z of each body; empty where the body lives on another rank.
    pub corrections: Vec<Vec<f64>>,
    /// B z of all contact rows.
    pub trace: Vec<f64>,
    /// r'z = r'G^-1 r of each body.
    pub decrement: Vec<f64>,
    /// Energies of the iterate in each body.
    pub energy: Vec<Energy>,
    /// Body whose inner solver failed, with its reason where that is known.
    pub failed: Option<(usize, String)>,
    /// Numeric factorisations so far, all bodies.
    pub factorizations: usize,
    /// Krylov iterations so far, all bodies.
    pub inner_iterations: usize,
    /// Whether each body was open: no pressure and no Robin term.
    open: Vec<bool>,
}

/// Does sweeps and remembers what need not be done again.
#[derive(Debug, Default)]
pub struct Sweeper {
    /// Sweeps done.
    pub sweeps: usize,
    /// Solves of a body that were avoided.
    pub solves_skipped: usize,
}

impl Sweeper {
    /// Solves G_s z_s = r_s in every body, at `iterate` with its `layer` and the Robin term that the model carries
    /// (`weight` = omega psi kappa at the points).
    ///
    /// A body without pressure and Robin term now and in the `last` sweep (which led here with relaxation gamma) has
    /// r = (1 - gamma) r_last and the same G: its z is known and nothing is solved.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn sweep(
        &mut self,
        model: &mut Model,
        iterate: &Iterate,
        layer: &Layer,
        weight: &[f64],
        last: Option<(&Sweep, f64)>,
    ) -> Result<Sweep> {
        let (bodies, rows) = (model.bodies.len(), 2 * model.points());
        // one message: traces, then SCALARS of each body
        let mut buffer = vec![0.0; rows + SCALARS * bodies];
        let mut sweep = Sweep::default();
        let mut reasons = vec![String::new(); bodies];
        for index in 0..bodies {
            let force = model.at_rows(index, &layer.force);
            let springs = model.at_rows(index, weight);
            let open = force.iter().chain(&springs).all(|&value| value == 0.0);
            sweep.open.push(open);
            let Some(body) = &mut model.bodies[index].local else {
                sweep.corrections.push(Vec::new());
                continue;
            };
            let u = &iterate.states[index];
            let mut r = vec![0.0; u.len()];
            let energy = body.residual(u, &force, &mut r);
            let mut z = vec![0.0; u.len()];
            let known = last.filter(|(last, _)| open && last.open[index]);
            let scalars = &mut buffer[rows + SCALARS * index..rows + SCALARS * (index + 1)];
            if let Some((last, gamma)) = known {
                axpy(1.0 - gamma, &last.corrections[index], &mut z);
                scalars[4] = 1.0;
            } else {
                let Solved { failure, .. } = body.solve(&r, &mut z)?;
                if let Some(reason) = failure {
                    reasons[index] = reason;
                    scalars[3] = 1.0;
                }
            }
            scalars[0] = dot(&r, &z);
            scalars[1] = energy.strain;
            scalars[2] = energy.potential;
            let counts = body.counts();
            scalars[5] = counts.factorizations as f64;
            scalars[6] = counts.inner_iterations as f64;
            let mut trace = vec![0.0; force.len()];
            body.trace(&z, &mut trace);
            model.put(index, &trace, &mut buffer[..rows]);
            sweep.corrections.push(z);
        }
        model.exchange.sum(&mut buffer);
        for (index, scalars) in buffer[rows..].chunks_exact(SCALARS).enumerate() {
            sweep.decrement.push(scalars[0]);
            sweep.energy.push(Energy { strain: scalars[1], potential: scalars[2] });
            if scalars[3] != 0.0 && sweep.failed.is_none() {
                sweep.failed = Some((index, reasons[index].clone()));
            }
            self.solves_skipped += usize::from(scalars[4] != 0.0);
            sweep.factorizations += scalars[5] as usize;
            sweep.inner_iterations += scalars[6] as usize;
        }
        buffer.truncate(rows);
        sweep.trace = buffer;
        self.sweeps += 1;
        Ok(sweep)
    }
}
