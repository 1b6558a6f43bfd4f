//! A first Newton step from contact pressures that are known roughly, from a coarser mesh say.
//!
//! From a start that knows nothing, Newton's steps grow the contact point by point: where the layer is open the linear model has no
//! resistance, and the line search cuts. With pressures p0 the model is the tangent of each law at its own p0 instead,
//!
//! ```text
//! K (u + d) + B' omega (p0 + kappa0 (c + B d - c0)) = f,      p(c0) = p0, kappa0 = p'(c0),     open where p0 = 0,
//! ```
//!
//! so that one linear solve leads to about the displacement of these pressures.

use crate::contact::law::LayerLaw;
use crate::ddm::layer::Layer;
use crate::ddm::model::Model;

/// The tangents of the layers at pressures that they do not have yet.
pub(super) struct Predicted {
    /// omega kappa0 at the points; zero where they are open.
    pub weight: Vec<f64>,
    /// omega times what the tangents give at the iterate more than the layers do: force at the points.
    pub force: Vec<f64>,
    /// How far the linear system is to be solved, so that the pressures have a digit or two.
    pub precision: f64,
}

/// Error of the pressures that a predicted step may leave, as a share of them.
const ERROR: f64 = 0.05;

impl Predicted {
    /// At the iterate of `layer`, for the `pressure` at the points.
    pub fn new(model: &Model, layer: &Layer, pressure: &[f64]) -> Self {
        let mut predicted = Self { weight: Vec::new(), force: Vec::new(), precision: 1.0 };
        // squared energies of the springs at the predicted pressures, and of their way from the iterate to there
        let (mut there, mut way) = (0.0, 0.0);
        for (i, pair) in model.pairs.iter().enumerate() {
            for q in model.range(i) {
                let point = q - model.offset[i];
                let (slope, at_iterate) = match compression(&*pair.law, point, pressure[q]) {
                    Some(c) => {
                        let response = pair.law.response(point, c);
                        (response.tangent, response.pressure + response.tangent * (layer.compression[q] - c))
                    }
                    None => (0.0, 0.0),
                };
                let spring = model.weight[q] * slope;
                predicted.weight.push(spring);
                if spring > 0.0 {
                    let c = pressure[q] / slope;
                    there += spring * c * c;
                    way += spring * (layer.compression[q] - c).powi(2);
                }
                predicted.force.push(model.weight[q] * (at_iterate - layer.pressure[q]));
            }
        }
        // what a solve leaves of the way is an error of the compressions
        let share = if way > 0.0 { (there / way).sqrt() } else { 1.0 };
        predicted.precision = (ERROR * share).clamp(1e-6, 1e-2);
        predicted
    }
}

/// The compression at which a layer has this pressure; `None` where that is none, or beyond what it can have.
fn compression(law: &dyn LayerLaw, point: usize, pressure: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.0);
    // laws have any units: from far above down to the decade, then bisection
    while law.pressure(point, high) < pressure {
        high *= 16.0;
        if high > 1e30 {
            return None;
        }
    }
    while high > 1e-30 && law.pressure(point, high / 16.0) >= pressure {
        high /= 16.0;
    }
    if pressure.is_nan() || pressure <= 0.0 || high <= 1e-30 {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if law.pressure(point, middle) < pressure { low = middle } else { high = middle }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::compression;
    use crate::contact::law::{Linear, Power};

    #[test]
    fn a_law_is_inverted_in_any_units() {
        for (b, a, p) in [(2.5e-5, 0.5, 10.0), (1e-9, 1.0, 1e6), (3.0, 0.1, 1e-4)] {
            let law = Power::new(b, a);
            let c = compression(&law, 0, p).expect("a compression");
            let expected = b * p.powf(a);
            assert!((c / expected - 1.0).abs() < 1e-9, "{c} {expected}");
        }
        assert_eq!(compression(&Linear { stiffness: 1e7 }, 0, 0.0), None);
    }
}
