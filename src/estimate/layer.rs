//! The pressure of a layer between its contact points.

use crate::contact::ContactPair;
use crate::discretize::meshes::FinePoints;
use crate::model::Layer;
use std::ops::Range;

/// What a pair lacks between its contact points.
pub(super) struct LayerError {
    /// Squared energy error of the layer there.
    pub energy: f64,
    /// Estimated pressure at each integration point; where it is no better than that of the discrete problem, that.
    pub pressure: Vec<f64>,
}

impl LayerError {
    /// That of a pair with contact points `range`; `giving` is what the recovered displacements of both bodies close at each
    /// integration point, `beyond` what the compression of each contact point lacks as a mean.
    ///
    /// With s the compliance of the bodies to a pressure that changes within a facet, the state c + s p is interpolated, and the law meets
    /// it at the place (c_h, p_h). Under a soft layer the state is the compression; under a stiff one it is the pressure inside the
    /// contact and the gap outside, and contact ends where it vanishes.
    pub fn new(
        pair: &ContactPair,
        points: &FinePoints,
        layer: &Layer,
        range: Range<usize>,
        giving: &[f64],
        beyond: &[f64],
    ) -> Self {
        let (compression, pressure) = (&layer.compression[range.clone()], &layer.pressure[range.clone()]);
        let tangent = &layer.tangent[range];
        let mut error = Self { energy: 0.0, pressure: Vec::with_capacity(giving.len()) };
        for (g, giving) in giving.iter().enumerate() {
            let (compliance, nearest) = (points.compliance[g], points.nearest[g]);
            let carriers = || points.interpolation.row(g);
            let is_whole = carriers().all(|(q, _)| compression[q] >= 0.0);
            // a curve through points of which some are open may rise above all of them, more so the faster the gap grows: no
            // pressure is made of that
            let between = |value: &dyn Fn(usize) -> f64| {
                let curve: f64 = carriers().map(|(q, share)| share * value(q)).sum();
                let largest = || carriers().map(|(q, _)| value(q)).fold(f64::NEG_INFINITY, f64::max);
                if is_whole { curve } else { curve.min(largest()) }
            };
            let at = |c: f64| pair.law.response(nearest, c).pressure;
            let state = between(&|q| compression[q] + compliance * pressure[q]);
            let c_h = pair.law.meet(nearest, state, 1.0 / compliance);
            let p_h = at(c_h);
            let off = giving - points.gap[g] - between(&|q| compression[q] + beyond[q]);
            let rise = at(c_h + off) - p_h;
            let slope = if off == 0.0 { 0.0 } else { rise / off };
            let of_layer = weight_of_layer(slope * compliance);
            error.energy += points.weight[g] * of_layer * rise * off;
            // between closed points p_h is made of nodal pressures alone, with their noise
            let of_state = if is_whole {
                of_layer
            } else {
                let along = carriers().map(|(q, _)| tangent[q]).fold(0.0, f64::max) * compliance;
                weight_of_layer(along / (1.0 + along))
            };
            let discrete: f64 = points.pressing.row(g).map(|(q, mu)| mu * pressure[q]).sum();
            error.pressure.push(discrete + of_state * (p_h - discrete) + of_layer * rise);
        }
        error
    }
}

/// Weight of a pressure that follows from a compression or a state, beside the one of the discrete problem: where displacements miss
/// e, the first misses `slope` e and the second e over the compliance of the bodies. The mean of the two with the least variance has
/// weights as one over their squares. `stiffness` is the slope times the compliance.
fn weight_of_layer(stiffness: f64) -> f64 {
    1.0 / (1.0 + stiffness * stiffness)
}
