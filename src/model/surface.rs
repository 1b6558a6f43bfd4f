//! Stiffness per area of the surfaces of bodies at the contact points: for whole surfaces, for a contact, and for single nodes.

use super::Model;

/// Stiffness of an elastic foundation over E*/a, in the plane and in space, for which it has the contact of Hertz (Johnson, Contact Mechanics, 1985,
/// section 4.3). E* is the modulus of the contact, and a its half width or radius.
const FOUNDATION: [f64; 2] = [1.18, 1.70];

/// Factor on that stiffness. The contact of spheres is then an eighth wider than that of Hertz, because steps that open points are better than
/// steps that close them. Spheres and cylinders took the fewest steps at this factor, among 0.3 to 1.2 (docs/methods.md).
const LARGER: f64 = 0.7;

/// Return rho0, n: the stiffness per area of the two bodies in series, for contact all over their surfaces.
pub fn surface_slopes(model: &Model) -> Vec<f64> {
    contact_slopes(model, |_| true)
}

/// Return the stiffness per area of the two bodies in series, n, for contact at the points that are `closed`. Each body deforms as over its depth, or as
/// over its contact if that is smaller.
pub fn contact_slopes(model: &Model, closed: impl Fn(usize) -> bool) -> Vec<f64> {
    let (points, rows) = (model.points(), model.row_stiffness());
    // `foundation` is the stiffness per area of the contact over the modulus
    let stiffness = |body: usize, foundation: f64| {
        let slot = &model.bodies[body];
        slot.modulus * foundation.max(slot.depth.recip())
    };
    let largest = (0..model.bodies.len()).map(|body| stiffness(body, 0.0)).fold(f64::MIN_POSITIVE, f64::max);
    let mut slopes = Vec::with_capacity(points);
    for (i, pair) in model.pairs.iter().enumerate() {
        let area: f64 = model.range(i).filter(|&q| closed(q)).map(|q| model.weight[q]).sum();
        let is_plane = pair.measure == "length";
        let half = if is_plane { 0.5 * area } else { (area / std::f64::consts::PI).sqrt() };
        let foundation = LARGER * FOUNDATION[usize::from(!is_plane)] / half;
        slopes.extend(model.range(i).map(|q| {
            // a row without stiffness has prescribed dofs only, which do not move
            let compliance = |side: usize| match rows[side * points + q] {
                0.0 => 0.0,
                _ => stiffness(pair.bodies[side], foundation).recip(),
            };
            let sum = compliance(0) + compliance(1);
            if sum > 0.0 { sum.recip() } else { largest }
        }));
    }
    slopes
}

/// Return the stiffness of two springs in series, either of which may be zero or infinite.
pub fn in_series(a: f64, b: f64) -> f64 {
    (a.recip() + b.recip()).recip()
}

/// Factor on the stiffness of the nodes under a point that gives the slope rho of the resolvents in Newton's method. Any slope leads to the same solution.
/// With this factor random scenes took the fewest steps; with 0.003 to 1 they took three per cent more at most, and with 3 some came into cycles
/// (docs/methods.md).
const SLOPE: f64 = 0.1;

/// Return rho, n: `SLOPE` times the stiffness per area of the softer of the two surfaces, as their elements have it.
pub fn meeting_slopes(model: &Model) -> Vec<f64> {
    let points = model.points();
    let rows = model.row_stiffness();
    let slope = |q: usize| {
        // a row without stiffness has prescribed dofs only, so the other side alone moves; without stiffness on both, rho is infinite and the resolvent is at c
        let sides = [rows[q], rows[points + q]].into_iter().filter(|stiffness| *stiffness > 0.0);
        let softer = sides.fold(f64::INFINITY, f64::min) / model.weight[q];
        SLOPE * softer
    };
    (0..points).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sample::two_pairs;

    /// A slope is a tenth of the stiffness of the softer side over the area. A row without stiffness is one of prescribed dofs.
    #[test]
    fn slopes_are_those_of_the_softer_side() {
        let slopes = meeting_slopes(&two_pairs());
        for (slope, expected) in slopes.iter().zip([0.8, 0.6, 0.5 / 3.0, 2.4]) {
            assert!((slope - expected).abs() < 1e-14, "{slopes:?}");
        }
    }
}
