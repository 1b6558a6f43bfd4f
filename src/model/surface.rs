//! Stiffness per area of the surfaces of bodies, at the contact points: of whole surfaces, of a contact, and of single nodes.

use super::Model;

/// Stiffness of an elastic foundation over E*/a, with the half width or radius a of the contact, in the plane and in space: it then has
/// the contact of Hertz (Johnson, Contact Mechanics, 1985, section 4.3).
const FOUNDATION: [f64; 2] = [1.18, 1.70];

/// Share of that stiffness, for a contact of spheres that is an eighth wider than Hertz's: steps that let points open are better than
/// those that close them. Spheres and cylinders took the fewest steps at this share, of 0.3 to 1.2 (docs/methods.md).
const LARGER: f64 = 0.7;

/// rho0: stiffness per area of the two bodies of each point in series, for contact all over their surfaces.
pub fn surface_slopes(model: &Model) -> Vec<f64> {
    contact_slopes(model, |_| true)
}

/// The same for contact at the points that are `closed`: each body gives way as over its depth, or as over its contact if that is
/// smaller.
pub fn contact_slopes(model: &Model, closed: impl Fn(usize) -> bool) -> Vec<f64> {
    let (points, rows) = (model.points(), model.row_stiffness());
    let stiffness = |body: usize, per_modulus: f64| {
        let slot = &model.bodies[body];
        slot.modulus * per_modulus.max(slot.depth.recip())
    };
    let largest = (0..model.bodies.len()).map(|body| stiffness(body, 0.0)).fold(f64::MIN_POSITIVE, f64::max);
    let mut slopes = Vec::with_capacity(points);
    for (i, pair) in model.pairs.iter().enumerate() {
        let area: f64 = model.range(i).filter(|&q| closed(q)).map(|q| model.weight[q]).sum();
        let half = if pair.measure == "length" { 0.5 * area } else { (area / std::f64::consts::PI).sqrt() };
        let per_modulus = LARGER * FOUNDATION[usize::from(pair.measure != "length")] / half;
        slopes.extend(model.range(i).map(|q| {
            // a row without stiffness cannot move
            let compliance = |side: usize| match rows[side * points + q] {
                0.0 => 0.0,
                _ => stiffness(pair.bodies[side], per_modulus).recip(),
            };
            let sum = compliance(0) + compliance(1);
            if sum > 0.0 { sum.recip() } else { largest }
        }));
    }
    slopes
}

/// Stiffness of two springs in a row, either of which may be zero or infinite.
pub fn in_series(a: f64, b: f64) -> f64 {
    (a.recip() + b.recip()).recip()
}

/// Share of the stiffness of the nodes under a point at which Newton's places are taken. Any slope leads to the same solution. At this share
/// random scenes took the fewest steps, from 0.003 to 1 three per cent more at most; with 3 some came into cycles (docs/methods.md).
const SLOPE: f64 = 0.1;

/// rho at every point: stiffness per area of the softer of the two surfaces, as their elements have it.
pub fn meeting_slopes(model: &Model) -> Vec<f64> {
    let points = model.points();
    let rows = model.row_stiffness();
    let slope = |q: usize| {
        // a row without stiffness has prescribed dofs only: the other side alone gives way, and without one the place is at c
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

    /// A tenth of the stiffness of the softer side over the area; a row without stiffness is that of prescribed dofs.
    #[test]
    fn slopes_are_those_of_the_softer_side() {
        let slopes = meeting_slopes(&two_pairs());
        for (slope, expected) in slopes.iter().zip([0.8, 0.6, 0.5 / 3.0, 2.4]) {
            assert!((slope - expected).abs() < 1e-14, "{slopes:?}");
        }
    }
}
