//! The size of a contact and where it ends: in the plane from the curve between the contact points, in space from the
//! areas of the points.

use super::stages::Done;
use crate::contact::Measure;
use crate::discretize::Neighbours;
use crate::estimate::softness;
use crate::fem::{length, minus};
use crate::output::Extent;

/// Return the sizes of the parts in contact and open.
fn extent(measure: Measure, contact: f64, open: f64) -> Extent {
    match measure {
        Measure::Length => Extent::Length { contact_length: contact, open_length: open },
        Measure::Ring | Measure::Area => Extent::Area { contact_area: contact, open_area: open },
    }
}

/// Return the compressions of pair `i` beyond those that stay without pressure: a layer that was crushed is open below
/// these. The sizes of slips, which open nothing, are those of the shear of a bond.
pub fn beyond_rest(done: &Done, i: usize) -> Vec<f64> {
    let (pair, range) = (&done.model().pairs[i], done.model().range(i));
    let compression = done.outcome.layer.compression[range].iter().enumerate();
    let is_slip = done.built.discrete.specs[i].slip.is_some();
    compression.map(|(point, c)| if is_slip { c.abs() } else { c - pair.law.rest(point) }).collect()
}

/// Return by how much pair `i` is open at its points.
pub fn opening(done: &Done, i: usize) -> Vec<f64> {
    beyond_rest(done, i).into_iter().map(|c| (-c).max(0.0)).collect()
}

/// Return the size of the contact of pair `i`, and in the plane the points where it begins or ends, in the order of the
/// contact points.
///
/// Along a curve each interval between neighbouring points is closed, open or divided by an end. The intervals are
/// chords; together they have the length (area) of the points.
pub fn of(done: &Done, i: usize) -> (Extent, Vec<[f64; 3]>) {
    let (model, layer) = (done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let (c, p) = (beyond_rest(done, i), &layer.pressure[range]);
    if done.built.discrete.specs[i].slip.is_some() {
        return (extent(pair.measure, pair.area.iter().sum(), 0.0), Vec::new());
    }
    let neighbours = done.built.discrete.contacts[i].surface.neighbours();
    if !pair.measure.is_along_curve() || neighbours.is_empty() {
        let areas = || pair.area.iter().zip(&c);
        let sum = |counts: fn(f64) -> bool| areas().filter(|(_, c)| counts(**c)).fold(0.0, |sum, (area, _)| sum + area);
        return (extent(pair.measure, sum(|c| c > 0.0), sum(|c| c < 0.0)), Vec::new());
    }
    let soft = if pair.law.is_bonded() { 0.0 } else { softness(model, i) };
    let (mut closed, mut open, mut all, mut ends) = (0.0, 0.0, 0.0, Vec::new());
    for &Neighbours { points: [q, r], share } in neighbours {
        let [q, r] = if c[q] >= c[r] { [q, r] } else { [r, q] };
        let [x, y] = [q, r].map(|q| pair.position[q]);
        let size = length(minus(y, x));
        // an interval of a body of revolution is a ring, whose radius grows along it
        let radius = |part: f64| if pair.measure == Measure::Ring { x[0] + 0.5 * part * (y[0] - x[0]) } else { 1.0 };
        let measure = |part: f64| share * size * part * radius(part);
        let is_divided = c[q] > 0.0 && c[r] < 0.0;
        let part = if is_divided { end([c[q], -c[r]], soft * size * p[q]) } else { f64::from(u8::from(c[q] > 0.0)) };
        if is_divided {
            ends.push((q.min(r), std::array::from_fn(|k| x[k] + part * (y[k] - x[k]))));
        }
        all += measure(1.0);
        closed += measure(part);
        open += if c[r] < 0.0 { measure(1.0) - measure(part) } else { 0.0 };
    }
    let scale = pair.area.iter().sum::<f64>() / all;
    ends.sort_by_key(|(q, _)| *q);
    (extent(pair.measure, scale * closed, scale * open), ends.into_iter().map(|(_, x)| x).collect())
}

/// Return where contact ends between a closed and an open point, as a share t of the interval from the closed one. `c`
/// is the compression of the closed point and the opening of the other one, and `give` the deflection h p/E* of the
/// bodies under the pressure p of the closed point over the interval h.
///
/// Beside the end of a contact without a layer, p is A sqrt(d) at the distance d inside, and the opening 4/(3 E*) A
/// d^(3/2) outside, as in Hertz's solution. A soft layer adds a compression B d inside and an opening B d outside. With
/// A and B from the closed point, t h from the end, the opening of the other one is
///
/// ```text
/// 4/3 give (1 - t)^(3/2) t^(-1/2) + c (1 - t)/t
/// ```
///
/// which decreases from infinity to zero. Under a layer that is soft beside the bodies, where `give` is small, it is
/// linear interpolation.
fn end([compression, opening]: [f64; 2], give: f64) -> f64 {
    let beyond = |t: f64| (1.0 - t) * (4.0 / 3.0 * give * (t * (1.0 - t)).sqrt() + compression) > opening * t;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if beyond(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pressure and opening of two half-planes pressed together by Hertz are those of a contact that ends at t; so are
    /// the lines of a soft layer.
    #[test]
    fn the_end_between_two_points() {
        for t in [0.02, 0.3, 0.5, 0.97] {
            let give = 1e-3 * f64::sqrt(t);
            let opening = 4.0 / 3.0 * 1e-3 * (1.0 - t) * f64::sqrt(1.0 - t);
            assert!((end([1e-12, opening], give) - t).abs() < 1e-6, "{t}");
            assert!((end([1e-3 * t, 1e-3 * (1.0 - t)], 0.0) - t).abs() < 1e-12, "{t}");
        }
    }
}
