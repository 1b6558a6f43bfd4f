//! Exact derivatives of expressions, by running the same program on pairs of a value and its derivative.

use super::operators::{Binary, Two, Unary};
use super::program::Number;
use crate::data::Data;

/// A value and its derivative by one variable.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Dual {
    pub value: f64,
    pub slope: f64,
}

/// Return the derivative of a function times the slope of its argument. It is zero for a constant argument, even if the derivative is infinite.
fn times(derivative: f64, slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { derivative * slope }
}

impl Number for Dual {
    fn constant(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }

    fn one(self, function: &Unary) -> Self {
        let value = (function.value)(self.value);
        Dual { value, slope: function.slope.map_or(0.0, |slope| times(slope(self.value, value), self.slope)) }
    }

    fn two(self, other: Self, function: &Binary) -> Self {
        let (a, b) = (self.value, other.value);
        match function.kind {
            Two::Smooth(value, slopes) => {
                let value = value(a, b);
                let [by_self, by_other] = slopes(a, b, value);
                Dual { value, slope: times(by_self, self.slope) + times(by_other, other.slope) }
            }
            Two::Truth(value) => Self::constant(value(a, b)),
            Two::Pick(is_first) => {
                if is_first(a, b) {
                    self
                } else {
                    other
                }
            }
        }
    }

    fn data(data: &Data, place: &[Dual]) -> Self {
        let mut values = [0.0; 2];
        values.iter_mut().zip(place).for_each(|(value, dual)| *value = dual.value);
        let sample = data.sample(&values[..place.len()]);
        let slope = place.iter().zip(sample.gradient).map(|(dual, by)| times(by, dual.slope)).sum();
        Dual { value: sample.value, slope }
    }
}
