//! The Robin zone psi: where the bodies carry a Robin term.

use super::layer::Layer;
use super::model::Model;

/// psi of (38), a characteristic function of a part of the contact surfaces.
pub enum RobinZone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\], equation (36).
    Active,
    /// psi = \[x in S^k\], any subsets: position and iteration k decide.
    Subset(Box<dyn Fn([f64; 3], usize) -> bool>),
}

impl RobinZone {
    /// omega psi kappa at every point in iteration `k`.
    pub fn robin_weight(&self, model: &Model, layer: &Layer, k: usize) -> Vec<f64> {
        let inside = |pair: usize, q: usize| match self {
            RobinZone::None => false,
            RobinZone::Full => true,
            RobinZone::Active => layer.compression[q] > 0.0,
            RobinZone::Subset(holds) => holds(model.pairs[pair].position[q - model.offset[pair]], k),
        };
        let mut weight = vec![0.0; model.points()];
        for pair in 0..model.pairs.len() {
            for q in model.range(pair) {
                if inside(pair, q) {
                    let law = &model.pairs[pair].law;
                    weight[q] = model.weight[q] * law.robin_tangent(q - model.offset[pair], layer.compression[q]);
                }
            }
        }
        weight
    }
}
