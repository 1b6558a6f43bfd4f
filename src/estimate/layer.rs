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
    /// The recovered displacements belong to the pressures of the contact points, interpolated. With s the compliance of the bodies to a
    /// pressure that changes within a facet, a pressure p there leaves the compression c* - s (p - p_i), and the law meets this line.
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
            let met = |state: f64| {
                let c = pair.law.meet(nearest, state, 1.0 / compliance);
                (c, pair.law.response(nearest, c).pressure)
            };
            let (c_h, p_h) = met(between(&|q| compression[q] + compliance * pressure[q]));
            let lacking: f64 = carriers().map(|(q, share)| share * beyond[q]).sum();
            let here = giving - points.gap[g] - lacking;
            let (c, p) = met(here + compliance * between(&|q| pressure[q]).max(0.0));
            error.energy += points.weight[g] * (p - p_h) * (c - c_h);
            let (mut discrete, mut amplified) = (0.0, 0.0);
            for (q, mu) in points.pressing.row(g) {
                discrete += mu * pressure[q];
                amplified += mu * mu;
            }
            let stiffness = carriers().map(|(q, _)| tangent[q]).fold(0.0, f64::max) * compliance;
            let of_law = match () {
                () if is_whole => weight_of_law(stiffness, 1.0),
                // with the weight below quadratic facets in space had 0.57 of the error under a layer of 1e8
                () if points.at_edges[g] => 1.0,
                () => weight_of_law(stiffness / (1.0 + stiffness), amplified),
            };
            error.pressure.push(discrete + of_law * (p - discrete));
        }
        error
    }
}

/// Weight of the law's pressure beside that of the discrete problem: where displacements miss e, the law misses a share of e/s, `stiffness`, and
/// the discrete pressure, made of such that miss e/s each, the root of `amplified` times e/s. The mean of the two with the least variance has weights
/// as one over their squares.
///
/// In a facet whose points are all closed the law misses kappa e, as c* and p_i do together; else e/(s + 1/kappa).
fn weight_of_law(stiffness: f64, amplified: f64) -> f64 {
    amplified / (amplified + stiffness * stiffness)
}
