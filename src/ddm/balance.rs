//! Stopping where the error of the iteration is small beside that of the discretisation: more would change nothing.

use crate::error::Result;
use crate::model::Model;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;

/// Knows how far the discrete problem is from the continuous one.
pub trait Discretisation {
    /// Relative error of the discrete solution near an iterate, in the norm of [`Row::error`](super::Row): the part of it that
    /// iterates share a space with, so that it bounds what the nodal values are worth.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn error(&mut self, model: &mut Model, linear: &mut dyn LinearStep, iterate: &Field, layer: &Layer) -> Result<f64>;
}

/// Share of the discretisation's error that the iteration's may have.
pub const SHARE: f64 = 0.1;

/// Asks seldom: an estimate costs about as much as a Newton step.
pub(super) struct Balance {
    rule: Box<dyn Discretisation>,
    /// The last answer; before the first all of the solution, of which the discretisation misses a part.
    last: f64,
}

impl Balance {
    pub fn new(rule: Box<dyn Discretisation>) -> Self {
        Self { rule, last: 1.0 }
    }

    /// Whether an iterate with this estimated error is good enough. A good last answer is confirmed at this iterate.
    ///
    /// # Errors
    /// Failures of the solver library.
    pub fn is_met(
        &mut self,
        model: &mut Model,
        linear: &mut dyn LinearStep,
        iterate: &Field,
        layer: &Layer,
        error: f64,
    ) -> Result<bool> {
        if error.is_nan() || error > SHARE * self.last {
            return Ok(false);
        }
        let now = self.rule.error(model, linear, iterate, layer)?;
        self.last = now;
        Ok(error <= SHARE * now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::Serial;
    use crate::robin::Sweeps;
    use std::cell::Cell;
    use std::rc::Rc;

    struct Fixed(Rc<Cell<usize>>, Vec<f64>);

    impl Discretisation for Fixed {
        fn error(&mut self, _: &mut Model, _: &mut dyn LinearStep, _: &Field, _: &Layer) -> Result<f64> {
            self.0.set(self.0.get() + 1);
            Ok(self.1.remove(0))
        }
    }

    #[test]
    fn it_asks_first_when_worth_it_and_again_to_confirm() {
        let asked = Rc::new(Cell::new(0));
        let mut balance = Balance::new(Box::new(Fixed(asked.clone(), vec![0.1, 0.02, 0.02])));
        let mut model = Model::new(Vec::new(), Vec::new(), std::rc::Rc::new(Serial));
        let layer = Layer::default();
        let mut linear = Sweeps::carried();
        let mut ask = |error: f64| {
            let met = balance.is_met(&mut model, &mut linear, &Field::default(), &layer, error).unwrap();
            (met, asked.get())
        };
        assert_eq!(ask(f64::NAN), (false, 0));
        assert_eq!(ask(0.2), (false, 0));
        // 0.02 > 0.1 * 0.1
        assert_eq!(ask(0.02), (false, 1));
        assert_eq!(ask(0.015), (false, 1));
        // worth asking again, and the answer is now 0.02
        assert_eq!(ask(0.009), (false, 2));
        assert_eq!(ask(0.0019), (true, 3));
    }
}
