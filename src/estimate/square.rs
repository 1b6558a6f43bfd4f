//! Squared norms over contact surfaces.

use crate::model::Model;

/// Return the integral of the squares of values at all contact points over the surface of a pair.
pub(super) fn square(model: &Model, pair: usize, values: &[f64]) -> f64 {
    model.range(pair).map(|q| model.weight[q] * values[q] * values[q]).sum()
}
