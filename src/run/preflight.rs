//! Estimates before the first sweep: how strongly the bodies of a pair are coupled, and how many sweeps each method needs.
//!
//! A mode of the interface with body stiffness k and layer tangent kappa has theta = kappa/(k + kappa). With theta_a and theta_b
//! of its two sides, the pair has theta = sqrt(theta_a theta_b). The plain iteration has the error factors 1 - gamma (1 +-
//! theta). Conjugate gradients over the same sweep have the condition (1 + theta)/(1 - theta).
//!
//! The estimate uses uniform pressure, the stiffest single mode that is known without a solve. The pressure is the one that
//! evenly spread loads would give. The result is an order of magnitude.

use super::stages::Built;
use crate::contact::ContactPair;
use crate::linalg::dot;
use crate::problem::method::Gamma;

/// The estimates for a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    /// Mean pressure that the loads give.
    pub pressure: f64,
    /// theta of side a and side b.
    pub theta: [f64; 2],
    /// Expected sweeps to a relative residual of 1e-8, by method. The number is infinite where the estimate predicts no
    /// convergence.
    pub sweeps: Vec<(&'static str, f64)>,
}

/// Logarithm ln(1e8) of the reduction of the residual in the estimates.
const DIGITS: f64 = 18.42;

/// Return the coupling of pair `i`.
pub fn coupling(built: &Built, i: usize) -> Coupling {
    let Built { scene, discrete, .. } = built;
    let pair = &discrete.model.pairs[i];
    let area: f64 = pair.weight.iter().sum();
    let pressure =
        pair.bodies.map(|body| pressing(pair, discrete.bodies[body].load)).into_iter().fold(0.0, f64::max) / area;
    let tangent = tangent_at(pair, pressure);
    let theta = pair.bodies.map(|body| {
        let stiffness = discrete.bodies[body].stiffness;
        if tangent == 0.0 { 0.0 } else { tangent / (stiffness + tangent) }
    });
    let both = (theta[0] * theta[1]).sqrt();
    let gamma = match scene.method.gamma {
        Gamma::Stationary(gamma) => gamma,
        _ => 1.0,
    };
    let factor = (1.0 - gamma * (1.0 - both)).abs().max((1.0 - gamma * (1.0 + both)).abs());
    let relaxed = if factor < 1.0 { (DIGITS / -factor.ln()).max(2.0) } else { f64::INFINITY };
    let condition = (1.0 + both) / (1.0 - both);
    let gradients = if both < 1.0 { (0.5 * condition.sqrt() * (DIGITS + 0.7)).max(2.0) } else { f64::INFINITY };
    let sweeps = vec![("robin", relaxed), ("ncg", gradients), ("newton-robin", 1.5 * gradients + 5.0), ("newton", 6.0)];
    Coupling { pressure, theta, sweeps }
}

/// Return the part of a load that presses the surface of a pair: along the mean normal where the surface faces one way, and the whole
/// load where its normals turn around, as those of a pin in a hole do.
///
/// On a flat surface the load along the mean normal is the mean of |n.F|. Where it is less than half of that mean, the normals cancel.
fn pressing(pair: &ContactPair, load: [f64; 3]) -> f64 {
    let mean = |value: &dyn Fn(&[f64; 3]) -> f64| {
        pair.weight.iter().zip(&pair.normal).map(|(weight, normal)| weight * value(normal)).sum::<f64>()
            / pair.weight.iter().sum::<f64>()
    };
    let along_each = mean(&|normal| dot(&load, normal).abs());
    let size = dot(&load, &load).sqrt();
    // A load across all normals leaves rounding along them, which is treated as zero.
    if along_each <= f64::EPSILON.sqrt() * size {
        return 0.0;
    }
    let normal: [f64; 3] = std::array::from_fn(|c| mean(&|normal| normal[c]));
    let along_mean = dot(&load, &normal).abs() / dot(&normal, &normal).sqrt().max(f64::MIN_POSITIVE);
    if along_mean < 0.5 * along_each { size } else { along_mean }
}

/// Return the tangent p' of the layer at the pair's first point where it carries `pressure`. The result is zero for a pressure
/// that the layer cannot reach.
fn tangent_at(pair: &ContactPair, pressure: f64) -> f64 {
    let compression = pair.law.compression(0, pressure);
    if compression > 0.0 && compression.is_finite() { pair.law.response(0, compression).tangent } else { 0.0 }
}
