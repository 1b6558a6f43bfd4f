//! Semismooth Newton (35) with exact line search on F1.

use super::predicted::Predicted;
use super::{Here, Method, Step, cg};
use crate::ddm::BodyCounts;
use crate::ddm::field::{Field, local_dot};
use crate::ddm::held;
use crate::ddm::line::Line;
use crate::ddm::model::Model;
use crate::error::Result;
use crate::linalg::axpy;

/// How the Newton system is solved.
pub enum Inner {
    /// Conjugate gradients preconditioned by the Robin sweep.
    Sweep,
    /// One factorisation of all bodies together.
    Direct(Box<dyn Coupled>),
}

/// The Newton matrix of all bodies together, factored.
pub trait Coupled {
    /// Solves (K + B' diag(weight) B) x = r with `weight` = omega kappa at the points; `None` if the matrix is singular.
    /// `model` has the bodies that were joined; an iterative solver reduces r by `reduction`.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn solve(&mut self, model: &Model, weight: &[f64], r: &[Vec<f64>], reduction: f64) -> Result<Option<Field>>;

    /// What was done so far.
    fn counts(&self) -> BodyCounts;

    /// Whether it solves only as far as it is told.
    fn is_inexact(&self) -> bool;
}

/// Newton's method.
pub struct Newton {
    inner: Inner,
    amplification: f64,
    spectrum: Option<(f64, f64)>,
    last: f64,
    /// What the linear model of the last step missed, as a share of all contact forces.
    missed: f64,
    /// Share of the error that the last step left.
    left: f64,
    /// Pressures for the first step.
    predicted: Option<Vec<f64>>,
}

/// Residual below which most of the contact is known.
const NEAR: f64 = 0.1;

/// Share of the residual asked for that an inexact solve aims at.
const MARGIN: f64 = 0.1;

/// Most conjugate gradient steps for one Newton system.
const MOST: usize = 400;

impl Newton {
    /// With this solver of its linear systems.
    pub fn new(inner: Inner) -> Self {
        let nothing = f64::INFINITY;
        let (amplification, last, missed) = (f64::NAN, nothing, nothing);
        Self { inner, amplification, spectrum: None, last, missed, left: 1.0, predicted: None }
    }

    /// Forcing term: how far the linear system is solved. Far away a rough step does; near the end more would be lost than
    /// the quadratic convergence gives, and never more than the run asks for.
    fn forcing(&mut self, here: &Here) -> f64 {
        if self.is_inexact() {
            // what the model missed last is about what the next step can gain; near the end the noise of rough solves opens points
            let (low, high) = (1e-6, if here.residual < NEAR { 0.02 } else { 0.1 });
            return self.missed.clamp(low, high).max(0.2 * MARGIN * here.target / here.residual).min(high);
        }
        let ratio = here.residual / self.last;
        let (low, high, margin) = match self.inner {
            Inner::Direct(_) if self.last.is_infinite() => (0.1, 0.1, MARGIN),
            Inner::Direct(_) => (1e-6, 0.1, MARGIN),
            Inner::Sweep => (1e-3, 0.3, 0.5),
        };
        self.last = here.residual;
        // a start without energy has no relative residual
        if !here.residual.is_finite() {
            return high;
        }
        let wish = (0.9 * ratio * ratio).clamp(low, high);
        wish.max(margin * here.target / here.residual).min(high)
    }
}

impl Newton {
    /// Solves (K + B' diag(omega slope) B) x = r; returns x and x'r.
    fn solve(&mut self, here: &mut Here, slope: &[f64], forcing: f64) -> Result<(Field, f64)> {
        let weight: Vec<f64> = here.model.weight.iter().zip(slope).map(|(w, k)| w * k).collect();
        let direct = match &mut self.inner {
            Inner::Direct(_) if held::joint_is_weak(here.model, &weight) => None,
            Inner::Direct(coupled) => coupled.solve(here.model, &weight, &here.sweep.residual, forcing)?,
            Inner::Sweep => None,
        };
        Ok(match direct {
            Some(x) => {
                let mut product = [local_dot(&x.states, &here.sweep.residual)];
                here.model.exchange.sum(&mut product);
                (x, product[0])
            }
            None => {
                let solution = cg::solve(here, &weight, forcing, MOST)?;
                self.spectrum = solution.spectrum.or(self.spectrum);
                (solution.x, solution.energy)
            }
        })
    }

    /// As `solve`, roughly, for slopes that differ much from the tangents: the bodies get Robin terms that fit them.
    fn solve_stiffer(&mut self, here: &mut Here, slope: &[f64]) -> Result<Field> {
        let points = here.model.points();
        let fit = |i: usize| here.weight[i].max(here.model.weight[i % points] * slope[i % points]);
        let weight: Vec<f64> = (0..2 * points).map(fit).collect();
        if matches!(self.inner, Inner::Direct(_)) {
            return Ok(self.solve(here, slope, ROUGH)?.0);
        }
        here.model.robin(&weight)?;
        let residual = here.sweep.residual.clone();
        let sweep = here.sweeper.precondition(here.model, residual, &here.sweep.residual)?;
        let mut there = Here {
            model: here.model,
            sweeper: here.sweeper,
            k: here.k,
            layer: here.layer,
            weight: &weight,
            sweep: &sweep,
            residual: here.residual,
            target: here.target,
        };
        Ok(self.solve(&mut there, slope, ROUGH)?.0)
    }
}

impl Newton {
    /// The step to about the displacements of the predicted pressures, once, if they hold all bodies and F1 falls.
    fn foresee(&mut self, here: &mut Here) -> Result<Option<Step>> {
        let (Some(pressure), Inner::Direct(coupled)) = (self.predicted.take(), &mut self.inner) else {
            return Ok(None);
        };
        let Predicted { weight, mut force, precision } = Predicted::new(here.model, here.layer, &pressure);
        if held::joint_is_weak(here.model, &weight) {
            return Ok(None);
        }
        let push: Vec<f64> = force.iter().map(|force| -force).collect();
        let mut r = here.sweep.residual.clone();
        cg::add_rows(here.model, &push, &mut r);
        let Some(direction) = coupled.solve(here.model, &weight, &r, precision)? else { return Ok(None) };
        // a share of it would leave the same share of the way open, much more than the layers' compression
        let length = if change(here, &direction, 1.0) < 0.0 { 1.0 } else { here.search(&direction).unwrap_or(0.0) };
        if length == 0.0 {
            return Ok(None);
        }
        axpy(1.0, &here.layer.force, &mut force);
        self.missed = missed(here, &force, &weight, &direction, length);
        Ok(Some(Step::Along(direction, length)))
    }

    /// Whether the linear systems are solved only as far as the forcing term says.
    fn is_inexact(&self) -> bool {
        matches!(&self.inner, Inner::Direct(coupled) if coupled.is_inexact())
    }
}

/// How much larger the error of a pressure may be than the forcing term of the step says.
const SPREAD: f64 = 5.0;

/// Most solves with secants in a step.
const ROUNDS: usize = 12;

/// Forcing term of solves with secants.
const ROUGH: f64 = 0.3;

/// A step that is cut to this share of its direction or less comes from a law that stiffens on the way.
const SHORT: f64 = 0.01;

/// What F1 changes by along a direction.
fn change(here: &mut Here, direction: &Field, length: f64) -> f64 {
    Line::new(here.model, here.layer, &here.sweep.residual, direction).change(length)
}

/// What a linear model of the layers misses after a step, as a share of all contact forces there: at the iterate it gives `force`
/// at the points, with the slopes `weight` = omega kappa. A step that is not the whole direction misses what it leaves of it.
fn missed(here: &Here, force: &[f64], weight: &[f64], direction: &Field, length: f64) -> f64 {
    let closing = direction.closing();
    let (mut apart, mut all) = (0.0, 0.0);
    for (i, pair) in here.model.pairs.iter().enumerate() {
        for q in here.model.range(i) {
            let step = length * closing[q];
            let pressure = pair.law.pressure(q - here.model.offset[i], here.layer.compression[q] + step);
            let there = here.model.weight[q] * pressure;
            apart += (there - force[q] - weight[q] * step).abs();
            all += there;
        }
    }
    let share: f64 = apart / all;
    if share.is_nan() { f64::INFINITY } else { share.max((1.0 - length).abs()) }
}

/// Slopes of the layer from the iterate to where its law gives the pressures that the linear model predicts at the end of
/// a direction.
///
/// A law that stiffens is far too soft at its foot: a direction from its tangent there goes much too far. The predicted
/// pressure is nearly right all the same, and the secant to it leads there. Any slopes give a direction of descent.
fn secants(here: &Here, slope: &[f64], direction: &Field) -> Vec<f64> {
    let closing = direction.closing();
    let mut secants = slope.to_vec();
    let points = here.model.points();
    // stiffness of the bodies' surfaces, where an open point has none to predict with
    let mut springs = vec![0.0; 2 * points];
    for body in 0..here.model.bodies.len() {
        here.model.put(body, &held::natural_springs(here.model, body), &mut springs);
    }
    for (i, pair) in here.model.pairs.iter().enumerate() {
        for q in here.model.range(i) {
            let law = |c: f64| pair.law.response(q - here.model.offset[i], c).pressure;
            let (c, p) = (here.layer.compression[q], here.layer.pressure[q]);
            let end = c + closing[q];
            // what opens, or follows its line, is modelled well
            if closing[q] <= 0.0 || end <= 0.0 {
                continue;
            }
            let mut predicted = p + slope[q] * closing[q];
            if slope[q] == 0.0 {
                // an open point that closes: at most what the bodies' own stiffness pushes back
                predicted = end * springs[q].min(springs[points + q]) / here.model.weight[q];
            }
            if law(end) <= 1.01 * predicted {
                continue;
            }
            let (mut low, mut high) = (c.max(0.0), end);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if law(middle) < predicted { low = middle } else { high = middle }
            }
            secants[q] = (predicted - p) / (high - c);
        }
    }
    secants
}

impl Method for Newton {
    fn name(&self) -> &'static str {
        match self.inner {
            Inner::Sweep => "newton-robin",
            Inner::Direct(_) => "newton",
        }
    }

    fn step(&mut self, here: &mut Here) -> Result<Step> {
        self.left = 1.0;
        if let Some(step) = self.foresee(here)? {
            return Ok(step);
        }
        let forcing = self.forcing(here);
        let tangent = here.layer.tangent.clone();
        let (mut direction, energy) = self.solve(here, &tangent, forcing)?;
        self.amplification = (energy / here.decrement()).max(1.0);
        let Ok(mut length) = here.search(&direction) else { return Ok(Step::Unbounded) };
        let mut slope = tangent;
        let mut best = change(here, &direction, length);
        let mut last = direction.clone();
        for _ in 0..ROUNDS {
            if length > SHORT {
                break;
            }
            slope = secants(here, &slope, &last);
            last = self.solve_stiffer(here, &slope)?;
            let Ok(other) = here.search(&last) else { break };
            let gain = change(here, &last, other);
            if gain < best {
                (best, length, direction) = (gain, other, last.clone());
            }
            if other > SHORT {
                break;
            }
        }
        if length == 0.0 {
            return Ok(match here.search(&here.sweep.correction.clone()) {
                Ok(gamma) => Step::Sweep(gamma),
                Err(_) => Step::Unbounded,
            });
        }
        if self.is_inexact() {
            let weight: Vec<f64> = here.model.weight.iter().zip(&here.layer.tangent).map(|(w, k)| w * k).collect();
            self.missed = missed(here, &here.layer.force, &weight, &direction, length);
            if self.missed <= here.target {
                self.left = (SPREAD * forcing).min(1.0);
            }
        }
        Ok(Step::Along(direction, length))
    }

    fn left(&self) -> f64 {
        self.left
    }

    fn predict(&mut self, pressure: Vec<f64>) {
        self.predicted = Some(pressure);
    }

    fn coupled(&self) -> BodyCounts {
        match &self.inner {
            Inner::Direct(coupled) => coupled.counts(),
            Inner::Sweep => BodyCounts::default(),
        }
    }

    fn is_joint(&self) -> bool {
        matches!(self.inner, Inner::Direct(_))
    }

    fn precision(&self) -> f64 {
        match self.inner {
            Inner::Direct(_) => super::COARSE,
            Inner::Sweep => super::ROUGH,
        }
    }

    fn amplification(&self) -> f64 {
        self.amplification
    }

    fn spectrum(&self) -> Option<(f64, f64)> {
        self.spectrum
    }
}
