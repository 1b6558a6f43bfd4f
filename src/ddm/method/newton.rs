//! Semismooth Newton (35) with exact line search on F1.

use super::{Here, Method, Step, cg};
use crate::ddm::field::Field;
use crate::error::Result;

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
    ///
    /// # Errors
    /// Failures of the solver library.
    fn solve(&mut self, weight: &[f64], r: &[Vec<f64>]) -> Result<Option<Field>>;

    /// Factorisations of the whole so far.
    fn factorizations(&self) -> usize;
}

/// Newton's method.
pub struct Newton {
    inner: Inner,
    amplification: f64,
    spectrum: Option<(f64, f64)>,
    last: f64,
}

/// Most conjugate gradient steps for one Newton system.
const MOST: usize = 400;

impl Newton {
    /// With this solver of its linear systems.
    pub fn new(inner: Inner) -> Self {
        Self { inner, amplification: f64::NAN, spectrum: None, last: f64::INFINITY }
    }

    /// Forcing term: how far the linear system is solved. Far away a rough step does; near the end more would be lost than
    /// the quadratic convergence gives, and never more than the run asks for.
    fn forcing(&mut self, here: &Here) -> f64 {
        let ratio = here.residual / self.last;
        self.last = here.residual;
        let wish = (0.9 * ratio * ratio).clamp(1e-3, 0.3);
        wish.max(0.5 * here.target / here.residual).min(0.3)
    }
}

impl Method for Newton {
    fn name(&self) -> &'static str {
        match self.inner {
            Inner::Sweep => "newton-robin",
            Inner::Direct(_) => "newton",
        }
    }

    fn step(&mut self, here: &mut Here) -> Result<Step> {
        let forcing = self.forcing(here);
        let weight: Vec<f64> = here.model.weight.iter().zip(&here.layer.tangent).map(|(w, k)| w * k).collect();
        let direct = match &mut self.inner {
            Inner::Direct(coupled) => coupled.solve(&weight, &here.sweep.residual)?,
            Inner::Sweep => None,
        };
        let (direction, energy) = match direct {
            Some(x) => {
                let mut product = [crate::ddm::field::local_dot(&x.states, &here.sweep.residual)];
                here.model.exchange.sum(&mut product);
                (x, product[0])
            }
            None => {
                let solution = cg::solve(here, &weight, forcing, MOST)?;
                self.spectrum = solution.spectrum.or(self.spectrum);
                (solution.x, solution.energy)
            }
        };
        self.amplification = (energy / here.decrement()).max(1.0);
        Ok(match here.search(&direction) {
            Ok(0.0) => match here.search(&here.sweep.correction.clone()) {
                Ok(gamma) => Step::Sweep(gamma),
                Err(_) => Step::Unbounded,
            },
            Ok(length) => Step::Along(direction, length),
            Err(_) => Step::Unbounded,
        })
    }

    fn factorizations(&self) -> usize {
        match &self.inner {
            Inner::Direct(coupled) => coupled.factorizations(),
            Inner::Sweep => 0,
        }
    }

    fn amplification(&self) -> f64 {
        self.amplification
    }

    fn spectrum(&self) -> Option<(f64, f64)> {
        self.spectrum
    }
}
