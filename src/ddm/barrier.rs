//! Places on laws that are rounded at their foot: the central path of interior-point methods.
//!
//! The energy -mu log p, per area, keeps pressures positive. With it a layer's law is c = c(p) - mu/p: a smooth curve that is mu/p to the
//! left of the law, and goes to it with mu. No point is open or closed on it, so contact sets that follow each other in a circle cannot.

use crate::contact::LayerLaw;
use crate::model::Model;
use crate::model::layer::Layer;

/// Relative error of a pressure: the barrier itself is a larger one.
const DIGITS: f64 = 1e-12;

/// The places where lines of slope -`rho` through the states (c, p) meet the laws with the barrier `mu`, an energy per area.
pub(super) fn meet(model: &Model, compression: &[f64], pressure: &[f64], rho: &[f64], mu: f64) -> Layer {
    let mut layer = Layer::new(model, compression.to_vec());
    for (i, pair) in model.pairs.iter().enumerate() {
        for q in model.range(i) {
            let point = q - model.offset[i];
            let sum = compression[q] + pressure[q] / rho[q];
            let p = root(&*pair.law, point, (sum, rho[q], mu));
            let c = pair.law.compression(point, p);
            // the tangents of the law and of the barrier in series
            let tangent = (pair.law.response(point, c).tangent.recip() + mu / (p * p)).recip();
            (layer.compression[q], layer.pressure[q], layer.tangent[q]) = (c - mu / p, p, tangent);
            layer.force[q] = model.weight[q] * p;
        }
    }
    layer
}

/// The pressure with c(p) - mu/p + p/rho = s, to [`DIGITS`]; the left side grows with p.
fn root(law: &dyn LayerLaw, point: usize, (s, rho, mu): (f64, f64, f64)) -> f64 {
    let beyond = |p: f64| law.compression(point, p) - mu / p + p / rho > s;
    // that of a rigid layer
    let half = (s * s + 4.0 * mu / rho).sqrt();
    let rigid = if s > 0.0 { 0.5 * rho * (half + s) } else { 2.0 * mu / (half - s) };
    // a gap can be so wide that the pressure is below all numbers
    let mut high = if rigid.is_finite() { rigid } else { law.pressure(point, s) }.max(f64::MIN_POSITIVE);
    while !beyond(high) && high < f64::MAX {
        high = (1e2 * high).min(f64::MAX);
    }
    let mut low = high;
    while low > 0.0 && beyond(low) {
        high = low;
        low *= 1e-2;
    }
    while high > low * (1.0 + DIGITS) {
        let middle = (low * high).sqrt();
        if !(middle > low && middle < high) {
            break;
        }
        if beyond(middle) { high = middle } else { low = middle }
    }
    low.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::Linear;

    /// Of a linear law the pressure is known on both sides of the corner, with a barrier and almost without.
    #[test]
    fn lines_meet_the_rounded_law() {
        let law = Linear { stiffness: 4.0 };
        for (s, rho, mu) in [
            (3.0, 2.0, 0.1),
            (-3.0, 2.0, 0.1),
            (0.0, 2.0, 1e-20),
            (3.0, f64::INFINITY, 1e-30),
            (0.0, f64::INFINITY, 1.0),
        ] {
            let p = root(&law, 0, (s, rho, mu));
            // p (1/k + 1/rho) - mu/p = s
            let flat = 1.0 / 4.0 + 1.0 / rho;
            let wide = (s * s + 4.0 * mu * flat).sqrt();
            let exact: f64 = if s > 0.0 { 0.5 * (s + wide) / flat } else { 2.0 * mu / (wide - s) };
            assert!((p / exact - 1.0).abs() < 1e-11, "{s} {rho} {mu}: {p} of {exact}");
        }
        // less than all numbers
        assert_eq!(root(&law, 0, (-1e200, 2.0, 1e-200)), f64::MIN_POSITIVE);
    }
}
