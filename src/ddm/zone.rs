//! The Robin zone psi: where the bodies carry a Robin term.

use super::layer::Layer;
use super::model::Model;
use crate::problem::robin::Zone;

impl Zone {
    /// omega psi kappa at every point in iteration `k`.
    pub fn robin_weight(&self, model: &Model, layer: &Layer, k: usize) -> Vec<f64> {
        let inside = |pair: usize, q: usize| match self {
            Zone::None => false,
            Zone::Full => true,
            Zone::Active => layer.compression[q] > 0.0,
            Zone::Subset(holds) => holds.is_true_at(model.pairs[pair].position[q - model.offset[pair]], k),
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
