//! How much the pressures depend on which of two surfaces gives the normals.

use crate::contact::ContactPair;
use crate::discretize::meshes::FinePoints;
use crate::model::Layer;
use std::ops::Range;

/// Return the relative change of the pressures of a pair with contact points `range` if the normals were those of side b.
/// `change` is the change of the compression at each integration point.
///
/// Compression and gap are measured along the normals n_a of the undeformed side a, which carries the contact points. Along the
/// normals of side b the compression changes by -(n_a + n_b) . (u_a - u_b). The bodies yield to a change of pressure over the
/// closed surface with the compliance S of a wave of its length, so that the pressure changes by change/(S + 1/kappa).
pub(super) fn dependence(
    pair: &ContactPair,
    points: &FinePoints,
    layer: &Layer,
    range: Range<usize>,
    change: &[f64],
) -> f64 {
    let (pressure, tangent) = (&layer.pressure[range.clone()], &layer.tangent[range]);
    let closed = pair.weight.iter().zip(pressure).filter(|(_, p)| **p > 0.0).map(|(weight, _)| weight).sum::<f64>();
    let extent = if pair.measure == "length" { closed } else { closed.sqrt() };
    let (mut changed, mut whole) = (0.0, 0.0);
    for (g, change) in change.iter().enumerate() {
        let at = |values: &[f64]| points.interpolation.row(g).map(|(q, share)| share * values[q]).sum::<f64>();
        let (p, stiffness) = (at(pressure).max(0.0), at(tangent).max(0.0));
        let compliance = points.compliance[g] * extent / points.size[g];
        changed += points.weight[g] * (stiffness * change / (1.0 + compliance * stiffness)).powi(2);
        whole += points.weight[g] * p * p;
    }
    if changed == 0.0 { 0.0 } else { f64::sqrt(changed / whole) }
}
