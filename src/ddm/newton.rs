//! Semismooth Newton (35) with a state of its own in every layer.
//!
//! Each contact point keeps a place (c_q, p_q) on its law, with the tangent kappa_q there:
//!
//! ```text
//! linear step    K u + B' omega (p_q + kappa_q (B u - d - c_q)) = f           all bodies together
//! update         c = B u - d,   p = p_q + kappa_q (c - c_q)                   in equilibrium
//!                the place where the law meets c_q + p_q/rho = c + p/rho      (Minty)
//! ```
//!
//! A fixed point has c = c_q and p = p_q: the equations (26). The gap between (c, p) and the law bounds the error of u.

use super::bound::{Gap, Reached, contact_energy};
use super::line::Line;
use super::linear::resisting;
use super::run::{End, Run};
use super::{barrier, start};
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, residual};
use crate::model::layer::{Layer, meeting_slopes};
use crate::model::linear::{LinearStep, System};

/// Iterates from displacements and places until a rule ends it.
///
/// # Errors
/// Failures of the solver library. Not converging is a status.
pub(super) fn iterate(run: &mut Run, linear: &mut dyn LinearStep, mut u: Field, mut places: Layer) -> Result<End> {
    let rho = meeting_slopes(run.model);
    let (mut forcing, mut progress) = (Forcing::default(), Progress::default());
    loop {
        let springs = resisting(run.model, places.springs(run.model));
        let force = run.model.forces(&places.linear(&run.model.compression(&u.trace)));
        let (r, _) = residual(run.model, &u, &force);
        let reduction = forcing.reduction();
        let most = forcing.most(contact_energy(run.model, &places));
        let system = System { model: run.model, places: &places, springs: &springs, residual: &r, reduction, most };
        let x = match linear.solve(system)? {
            Ok(solution) => solution,
            Err(failure) => return Ok(End::failed(failure, u, places, linear.sweeps())),
        };
        u.add(1.0, &x.field);
        u.retrace(run.model);

        let c = run.model.compression(&u.trace);
        let p = places.linear(&c);
        let met = start::meet(run.model, &c, &p, &rho);

        let gap = Gap::new(run.model, &c, &p, &met, &rho);
        let (rest, energy) = residual(run.model, &u, &run.model.forces(&p));
        let mut measured = run.measure(energy, &Layer::new(run.model, c.clone()), linear);
        let mut reached = Reached::new(run.model, &run.scale, measured.strain, &gap, &x, &p, &met);
        let mut exact = true;
        if run.is_enough(&reached) {
            // a step has the rounding of its size, or what an iterative solver thought small: its matrix tells how large that is
            let (residual, reduction) = (&rest[..], 0.5);
            let system = System { model: run.model, places: &places, springs: &springs, residual, reduction, most };
            let before = linear.counts();
            let more = linear.solve(system)?;
            measured.inner_iterations += linear.counts().inner_iterations - before.inner_iterations;
            measured.factorizations += linear.counts().factorizations - before.factorizations;
            if let Ok(more) = more {
                reached.add_rounding(&run.scale, measured.strain, &more, &places, &met);
                exact = run.is_enough(&reached);
            }
        }
        if let Some(status) = run.end_of_step(&u, &x.field, &measured, &reached, &met, linear)? {
            return Ok(End { status, iterate: u, layer: met, weight: Vec::new(), sweeps: linear.sweeps(), skipped: 0 });
        }
        forcing.learn(&gap, &reached, run.stop.residual);
        // a step that knew of no contact runs through the other body
        let blind = places.closed == 0 && met.closed > 0;
        if blind {
            search(run.model, &mut u, &x.field)?;
        }
        let barrier = progress.barrier(gap.change, run.model);
        if exact {
            places = match barrier {
                _ if blind => Layer::at(run.model, &u.trace),
                0.0 => met,
                barrier => barrier::meet(run.model, &c, &p, &rho, barrier),
            };
        }
    }
}

/// How far inexact linear steps are solved.
#[derive(Debug)]
struct Forcing(f64);

/// Error of the first linear step of an inexact solver, as a share of it: its places are a guess of the start.
const FIRST: f64 = 1e-2;

/// Share of what the places missed last that an inexact step may miss, too.
const SHARE: f64 = 0.1;

impl Default for Forcing {
    fn default() -> Self {
        Self(FIRST)
    }
}

impl Forcing {
    fn reduction(&self) -> f64 {
        self.0
    }

    /// The error of a step in the energy norm that leaves the pressures of a contact with this energy a digit: else stiff layers answer
    /// errors of compressions with any pressure.
    fn most(&self, contact: f64) -> f64 {
        if contact > 0.0 { SHARE * contact.sqrt() } else { f64::INFINITY }
    }

    /// After a step with this gap: the next may miss a share of what this one did, and need not do better than what the run asks for.
    fn learn(&mut self, gap: &Gap, reached: &Reached, target: Option<f64>) {
        let enough = SHARE * target.unwrap_or(0.0) / reached.error.max(reached.pressure);
        self.0 = (SHARE * gap.share).max(enough).clamp(f64::EPSILON.sqrt(), FIRST);
    }
}

/// Recognises contact sets that follow each other in a circle, or one point at a time: of 4879 random scenes of stiff layers on few
/// quadratic elements two came into a cycle. Then the laws have a barrier, until a step changes less than half of all before.
#[derive(Debug)]
struct Progress {
    /// Least work that a step changed, and the steps since one has halved it.
    best: f64,
    since: usize,
    /// Energy per area, now and where it began.
    barrier: f64,
    first: f64,
    /// What it falls to in a step.
    rate: f64,
}

/// Steps in a row without progress before there is a barrier: contact that has just been found may take one.
const PATIENCE: usize = 2;

impl Default for Progress {
    fn default() -> Self {
        Self { best: f64::INFINITY, since: 0, barrier: 0.0, first: 0.0, rate: SHARE }
    }
}

impl Progress {
    /// The barrier after a step that changed this work, sum omega (p - p_q)(c_q - c): on a law with a barrier mu, p times the gap is mu
    /// where the layer is open, so it begins at the mean over the area, and falls with each step. Where that ends without progress, it
    /// begins again and falls slower: close enough to the path of the solutions over mu, Newton's method follows it.
    fn barrier(&mut self, change: f64, model: &Model) -> f64 {
        self.since = if change < 0.5 * self.best { 0 } else { self.since + 1 };
        self.best = self.best.min(change);
        if self.since == 0 {
            self.barrier = 0.0;
        } else if self.barrier > f64::EPSILON.sqrt() * self.first {
            self.barrier *= self.rate;
        } else if self.since >= PATIENCE {
            if self.barrier > 0.0 {
                self.rate = self.rate.sqrt();
            }
            self.first = change / model.weight.iter().sum::<f64>();
            self.barrier = self.first;
        }
        self.barrier
    }
}

/// Replaces a step x that led to u by the exact search on F1 along it.
fn search(model: &mut Model, u: &mut Field, x: &Field) -> Result<()> {
    u.add(-1.0, x);
    u.retrace(model);
    let layer = Layer::at(model, &u.trace);
    let (r, _) = residual(model, u, &layer.force);
    let line = Line::new(model, &layer, &r, x);
    u.add(line.minimize(1e-2).unwrap_or(0.0), x);
    u.retrace(model);
    Ok(())
}
