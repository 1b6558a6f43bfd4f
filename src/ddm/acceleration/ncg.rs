//! Nonlinear conjugate gradients, preconditioned by the Robin sweep.

use super::{Acceleration, Iterate, Step};
use crate::ddm::forecast::gradients_factor;
use crate::error::Result;
use crate::model::field::{Field, local_dot};
use crate::model::line::Line;
use crate::robin::Ritz;

/// Conjugate gradients by the rule of Polak and Ribière with exact line search on F1. They restart when the contact set changes.
#[derive(Default)]
pub struct Conjugate {
    last: Option<Last>,
    ritz: Ritz,
}

/// The last iterate, and the direction taken from it.
struct Last {
    direction: Field,
    residual: Vec<Vec<f64>>,
    /// r'z.
    decrement: f64,
    /// Whether each point was closed.
    closed: Vec<bool>,
}

impl Acceleration for Conjugate {
    fn name(&self) -> &'static str {
        "ncg"
    }

    fn step(&mut self, here: &mut Iterate) -> Result<Step> {
        let closed: Vec<bool> = here.layer.compression.iter().map(|&c| c > 0.0).collect();
        let z = &here.sweep.correction;
        let mut direction = z.clone();
        if let Some(last) = self.last.take().filter(|last| last.closed == closed) {
            let mut products =
                [local_dot(&last.residual, &z.states), local_dot(&here.sweep.residual, &last.direction.states)];
            here.model.exchange.sum(&mut products);
            let beta = ((here.decrement() - products[0]) / last.decrement).max(0.0);
            // if F1 does not fall along the new direction, it is not conjugate any more
            if here.decrement() + beta * products[1] > 0.0 {
                direction = last.direction;
                direction.add_to(beta, z);
            }
        }
        let line = Line::new(here.model, here.layer, &here.sweep.residual, &direction);
        let Ok(length) = line.minimize(1e-8) else { return Ok(Step::Unbounded) };
        self.ritz.observe(here.model, &direction);
        self.ritz.bounds(here.model, here.layer, here.weight);
        let residual = here.sweep.residual.clone();
        self.last = Some(Last { direction: direction.clone(), residual, decrement: here.decrement(), closed });
        Ok(Step::Along(direction, length))
    }

    fn ritz(&mut self) -> &mut Ritz {
        &mut self.ritz
    }

    fn factor(&mut self) -> Option<f64> {
        self.spectrum().map(gradients_factor)
    }

    fn restart(&mut self) {
        self.last = None;
    }
}
