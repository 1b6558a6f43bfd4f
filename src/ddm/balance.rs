//! The stop rule that ends a run when the error of the iteration is small relative to the error of the discretisation: further iterations would
//! change nothing.

use crate::error::Result;
use crate::model::Model;
use crate::model::field::Field;
use crate::model::layer::Layer;
use crate::model::linear::LinearStep;

/// An estimator of the error of the discrete solution relative to the continuous one.
pub trait Discretisation {
    /// Estimate the relative error of the discrete solution near an iterate, in the norm of [`Row::error`](super::Row). It is the part of the error
    /// that lies in the space of the iterates, so that it bounds the accuracy of nodal values.
    ///
    /// # Errors
    /// Failures of the solver library.
    fn error(&mut self, model: &mut Model, linear: &mut dyn LinearStep, iterate: &Field, layer: &Layer) -> Result<f64>;
}

/// Largest error of the iteration, as a share of the error of the discretisation.
pub const SHARE: f64 = 0.1;

/// The stop rule. It asks for few estimates, because one costs about as much as a Newton step.
pub(super) struct Balance {
    estimator: Box<dyn Discretisation>,
    /// The last estimate; before the first one, a relative error of one.
    last: f64,
}

impl Balance {
    pub fn new(estimator: Box<dyn Discretisation>) -> Self {
        Self { estimator, last: 1.0 }
    }

    /// Whether an iterate with this estimated error is good enough. If it is by the last estimate, a new estimate at this iterate has to confirm it.
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
        self.last = self.estimator.error(model, linear, iterate, layer)?;
        Ok(error <= SHARE * self.last)
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
