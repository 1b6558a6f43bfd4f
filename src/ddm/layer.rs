//! The layer between the surfaces, evaluated at an iterate.

use super::model::Model;

/// State of the layers at every contact point.
#[derive(Debug, Clone, Default)]
pub struct Layer {
    /// c = B_a u_a + B_b u_b - d.
    pub compression: Vec<f64>,
    /// p(c).
    pub pressure: Vec<f64>,
    /// kappa = p'(c).
    pub tangent: Vec<f64>,
    /// omega p, force at each point.
    pub force: Vec<f64>,
    /// sum omega P(c) of each pair: energy of the layer.
    pub energy: Vec<f64>,
    /// sum omega p c over all pairs.
    pub work: f64,
    /// Points with c > 0.
    pub closed: usize,
}

impl Layer {
    /// Evaluates the laws at a trace vector.
    pub fn at(model: &Model, trace: &[f64]) -> Self {
        let points = model.points();
        let mut layer = Layer::default();
        for (i, pair) in model.pairs.iter().enumerate() {
            let mut energy = 0.0;
            for q in model.range(i) {
                // + 0.0 turns -0.0, which depends on the order of a sum, into 0.0
                let c = trace[q] + trace[points + q] - model.gap[q] + 0.0;
                let response = pair.law.response(q - model.offset[i], c);
                let force = model.weight[q] * response.pressure;
                energy += model.weight[q] * response.energy;
                layer.work += force * c;
                layer.closed += usize::from(c > 0.0);
                layer.compression.push(c);
                layer.pressure.push(response.pressure);
                layer.tangent.push(response.tangent);
                layer.force.push(force);
            }
            layer.energy.push(energy);
        }
        layer
    }
}
