//! Warnings of tables of a layer whose columns are probably in the wrong order.

use super::preflight::coupling;
use super::stages::Built;
use crate::linalg::bounds;
use crate::output::sci;
use crate::problem::LayerSpec;

/// Return a warning for each pair whose table is probably written as (p, c).
pub fn warnings(built: &Built) -> Vec<String> {
    (0..built.discrete.model.pairs.len()).filter_map(|i| warning(built, i)).collect()
}

/// Return the warning for pair `i`, if its layer is a table that makes sense the other way round alone.
///
/// Numbers have no units here, so that two facts of the bodies decide. The stiffness of the layer, p/c at the end of the table, is compared
/// with that of the stiffer body against a uniform pressure, its modulus over its depth: c/p is nearer to it than p/c. And the table does not
/// fit: its largest pressure is below the mean pressure of the loads, or without loads its largest compression exceeds the contact surface.
/// A layer that is really as soft as that has a table which reaches to its loads.
fn warning(built: &Built, i: usize) -> Option<String> {
    let (pair, contact) = (&built.discrete.model.pairs[i], &built.discrete.contacts[i]);
    let LayerSpec::Table(points) = &contact.spec.layer else { return None };
    let &[c, p] = points.last()?;
    let stiffness = pair.bodies.map(|body| built.discrete.bodies[body].stiffness).into_iter().fold(0.0, f64::max);
    let distance = |other: f64| (other / stiffness).ln().abs();
    let load = coupling(built, i).pressure;
    let fits = if load > 0.0 { load <= p } else { c <= extent(&pair.position) };
    if stiffness == 0.0 || fits || distance(c / p) >= distance(p / c) {
        return None;
    }
    let [a, b] = &pair.surfaces;
    let loads =
        if load > 0.0 { format!(", and the loads give a mean pressure of {}", sci(load, 2)) } else { String::new() };
    Some(format!(
        "{a} - {b}: the table of the layer ends at a compression of {} with a pressure of {}: its stiffness is {}, that of the bodies (modulus \
         over depth) {}{loads}; points are [compression, pressure]: if these are [pressure, compression], swap the columns",
        sci(c, 2),
        sci(p, 2),
        sci(p / c, 2),
        sci(stiffness, 2)
    ))
}

/// Return the diagonal of the box around all points.
fn extent(points: &[[f64; 3]]) -> f64 {
    let [low, high] = bounds(points.iter().copied());
    (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt()
}
