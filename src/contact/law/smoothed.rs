//! Laws smoothed by an energy per area mu, as on the central path of an interior-point method.
//!
//! Let c = phi(p) be the inverse of a law. The smoothed law is
//!
//! ```text
//! c = phi(p) - mu/p,   p > 0,        kappa = dp/dc = 1 / (phi'(p) + mu/p^2)
//! ```
//!
//! It is strictly monotone and has no corner. At every pressure p the gap s = mu/p remains, so that s p = mu, which is the perturbed
//! complementarity condition.

use super::root::root;
use super::{LayerLaw, Response};

/// A state (c, p) on a law or a smoothed law, with the tangent there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawState {
    /// Compression c.
    pub compression: f64,
    /// Pressure p, force per area.
    pub pressure: f64,
    /// Tangent kappa = dp/dc.
    pub tangent: f64,
}

/// Return Minty's resolvent: the only state with c + p/rho = `sum` on the law smoothed by `mu`.
///
/// `mu` is an energy per area and `rho > 0` a stiffness per area. With `mu` = 0 the result is the state on the law itself.
///
/// The law need not be inverted. Let P(s) be the pressure at which the law itself meets the line with the sum s. A state with the
/// remaining gap y = mu/p has p = P(`sum` + y), so y is the root of y P(`sum` + y) = mu, where the left side increases with y. The root
/// is least for a rigid layer, P(s) = rho s, whose gap has a closed form.
pub fn resolve(law: &dyn LayerLaw, point: usize, sum: f64, rho: f64, mu: f64) -> LawState {
    if mu == 0.0 || !sum.is_finite() {
        return on_law(law, point, sum, rho);
    }
    let value = |gap: f64| {
        let LawState { pressure, tangent, .. } = on_law(law, point, sum + gap, rho);
        (gap * pressure, pressure + gap * tangent / (1.0 + tangent / rho))
    };
    let diagonal = sum.hypot(2.0 * (mu / rho).sqrt());
    let rigid = if sum > 0.0 { 2.0 * mu / rho / (sum + diagonal) } else { 0.5 * (diagonal - sum) };
    // With an infinite rho the gap of a closed point has no lower bound.
    let start = if rigid > 0.0 { rigid } else { 1.0 };
    let least = rigid * (1.0 - 4.0 * f64::EPSILON);
    let (Ok(gap) | Err(gap)) = root(mu, [least, f64::MAX], start, value);
    let LawState { compression, tangent, .. } = on_law(law, point, sum + gap, rho);
    let pressure = mu / gap;
    LawState { compression: compression - gap, pressure, tangent: (tangent.recip() + gap / pressure).recip() }
}

/// Return the state on the law itself with c + p/rho = `sum`.
fn on_law(law: &dyn LayerLaw, point: usize, sum: f64, rho: f64) -> LawState {
    let compression = law.meet(point, sum, rho);
    let (pressure, tangent) = match compression > 0.0 {
        true => law.pressure_and_tangent(point, compression),
        false => {
            let Response { pressure, tangent, .. } = law.response(point, compression);
            (pressure, tangent)
        }
    };
    LawState { compression, pressure, tangent }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::tests::all_laws;

    /// Return the pressure at which phi(p) - mu/p + p/rho is the sum, by bisection of its logarithm. Here the law is inverted.
    fn bisected(law: &dyn LayerLaw, sum: f64, rho: f64, mu: f64) -> f64 {
        let excess = |pressure: f64| law.compression(0, pressure) - mu / pressure + pressure / rho - sum;
        let (mut low, mut high) = (f64::MIN_POSITIVE, 1e300);
        while high / low > 1.0 + 4.0 * f64::EPSILON {
            let middle = if high / low > 4.0 { low.sqrt() * high.sqrt() } else { 0.5 * (low + high) };
            if excess(middle) < 0.0 { low = middle } else { high = middle }
        }
        high
    }

    /// All laws are checked from open to strongly compressed points, for soft to infinite slopes and for much to hardly any smoothing.
    #[test]
    fn states_are_those_of_the_inverted_law() {
        for (law, scale) in all_laws() {
            let level = law.pressure(0, scale);
            for share in [-1e3, -1.0, -1e-6, 0.0, 1e-6, 0.3, 2.0] {
                for rho in [1e-3, 1.0, 1e3, f64::INFINITY].map(|times: f64| times * level / scale) {
                    for mu in [1e-12, 1e-4, 1.0, 1e3].map(|times| times * level * scale) {
                        let sum = share * scale;
                        let state = resolve(&*law, 0, sum, rho, mu);
                        let expected = bisected(&*law, sum, rho, mu);
                        let error = state.pressure / expected - 1.0;
                        assert!(
                            error.abs() < 1e-7,
                            "{law:?} sum {sum:e} rho {rho:e} mu {mu:e}: {state:?} {expected:e}"
                        );
                        // The compression c is the difference of phi and the gap.
                        let size = sum.abs().max(mu / state.pressure).max(state.pressure / rho);
                        let off = state.compression + state.pressure / rho - sum;
                        assert!(off.abs() <= 1e-12 * size, "{law:?} sum {sum:e} rho {rho:e} mu {mu:e}: {off:e}");
                        assert!(state.tangent > 0.0 && state.tangent.is_finite(), "{law:?}: {state:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_tangent_is_the_slope_and_no_smoothing_is_the_law() {
        for (law, scale) in all_laws() {
            let level = law.pressure(0, scale);
            let (rho, mu) = (level / scale, 0.1 * level * scale);
            for share in [-2.0, -0.5, 0.0, 0.4] {
                let at = |share: f64| resolve(&*law, 0, share * scale, rho, mu);
                let [low, here, high] = [share - 1e-5, share, share + 1e-5].map(at);
                let slope = (high.pressure - low.pressure) / (high.compression - low.compression);
                assert!((here.tangent / slope - 1.0).abs() < 1e-2, "{law:?}: {here:?} {slope}");
                let exact = resolve(&*law, 0, share * scale, rho, 0.0);
                assert_eq!(exact.compression, law.meet(0, share * scale, rho));
                assert_eq!(exact.pressure, law.pressure(0, exact.compression));
            }
            for sum in [f64::NEG_INFINITY, f64::INFINITY] {
                assert_eq!(resolve(&*law, 0, sum, rho, mu).compression, sum);
            }
            assert!(resolve(&*law, 0, f64::NAN, rho, mu).pressure.is_nan());
        }
    }
}
