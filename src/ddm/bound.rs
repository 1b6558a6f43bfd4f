//! How far an iterate in equilibrium is from the solution: a bound by duality.
//!
//! After a linear step, displacements u and pressures p are in equilibrium: K u + B' omega p = f. Let P be the energy of the law and P* its
//! complementary energy. Then convex duality (Fenchel; engineers know it as the error in the constitutive relation) gives
//!
//! ```text
//! |u - u_exact|_K^2 / 2  <=  F1(u) - min F1  <=  gap = sum omega ( P(c) + P*(p) - c p ),      c = B u - d,
//! ```
//!
//! Each term of the gap is zero on the graph of the law and positive elsewhere. The bound needs no spectrum, no history and no constants.

use super::path::Equilibrium;
use super::scale::Scale;
use crate::contact::LayerLaw;
use crate::model::Model;
use crate::model::layer::Layer;
use crate::model::linear::Solution;
use crate::model::rigid::PART;
use crate::model::surface::{meeting_slopes, surface_slopes};

/// The distance of layer states from the laws at the compressions of the bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OffLaws {
    /// The duality gap, an energy.
    gap: f64,
    /// Largest difference of a pressure.
    mismatch: f64,
    /// The pair with that difference.
    pair: usize,
}

impl OffLaws {
    /// Measure the distance of the layer states `places` where the bodies have these compressions, n, which are known but for their `roundoff`, n.
    pub(super) fn new(model: &Model, places: &Layer, compression: &[f64], roundoff: &[f64]) -> Self {
        let mut off = Self::default();
        // bodies and layer answer an error of a compression like springs in series; a steep law alone would make any pressure of it
        let rho = meeting_slopes(model);
        let resolved = Layer::resolve(model, compression, &places.pressure, &rho, &[]);
        for (i, pair) in model.pairs.iter().enumerate() {
            for q in model.range(i) {
                let (point, p) = (q - model.offset[i], places.pressure[q]);
                let c = nearest(&*pair.law, point, compression[q], roundoff[q], p);
                let mismatch = if rho[q] < f64::INFINITY {
                    let known = rho[q] * roundoff[q] + f64::EPSILON * (p.abs() + resolved.pressure[q].abs());
                    // `clamp` keeps NaN
                    ((p - resolved.pressure[q]).abs() - known).clamp(0.0, f64::INFINITY)
                } else {
                    (p - pair.law.pressure(point, c)).abs()
                };
                off.gap += model.weight[q] * pair.law.duality_gap(point, c, p);
                if mismatch.is_nan() || mismatch > off.mismatch {
                    (off.mismatch, off.pair) = (mismatch, i);
                }
            }
        }
        off
    }
}

/// The relative errors that end a run of Newton's method.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reached {
    /// Error in the energy norm: that of the layers from the duality gap, that of the linear step from its solver.
    pub error: f64,
    /// Whether `error` is a bound: no pressure is negative, and the linear step is exact to rounding.
    pub is_bound: bool,
    /// Error of the pressures. It is the largest difference from the law, relative to the largest pressure, or the error of an inexact linear
    /// step, relative to the energy of the contact alone.
    pub pressure: f64,
    /// Forces out of balance on a body, as a share of its contact forces: the largest over all bodies.
    pub imbalance: f64,
}

/// Return the energy that the pressures give the layers and the surfaces under them, sum omega p^2 (1/kappa + 1/rho0). The energy of the whole
/// bodies may be much larger, and an error that is small relative to that one may be large for the pressures.
pub(super) fn contact_energy(model: &Model, places: &Layer) -> f64 {
    let slopes = surface_slopes(model);
    let at = |q: usize| places.force[q] * places.pressure[q] * (places.tangent[q].recip() + slopes[q].recip());
    (0..slopes.len()).filter(|&q| places.force[q] > 0.0).map(at).sum()
}

/// Return the part of [`contact_energy`] that is in the surfaces, sum omega p^2 / rho0.
pub(super) fn surface_energy(model: &Model, places: &Layer) -> f64 {
    let slopes = surface_slopes(model);
    (0..slopes.len()).map(|q| places.force[q] * places.pressure[q] / slopes[q]).sum()
}

/// Return the compression within c -+ `roundoff` at which the pressure of a law is nearest to p.
fn nearest(law: &dyn LayerLaw, point: usize, c: f64, roundoff: f64, p: f64) -> f64 {
    let difference = if p > 0.0 { law.compression(point, p) - c } else { c.min(0.0) - c };
    if difference.is_finite() { c + difference.clamp(-roundoff, roundoff) } else { c }
}

impl Reached {
    /// Measure an iterate with u'Ku = `strain` after the linear step `step`. `state` is its equilibrium, `places` are the resolved states on the
    /// laws.
    ///
    /// A compression is known only to its roundoff. Of the admissible values, the one that is closest to the law is used: a stiff law would answer
    /// roundoff with any pressure. Where a pressure is negative, the gap is infinite, and the work of its change to the resolved state
    /// replaces the gap.
    pub(super) fn new(
        model: &Model,
        scale: &Scale,
        strain: f64,
        step: &Solution,
        state: &Equilibrium,
        places: &Layer,
    ) -> Self {
        let Equilibrium { compression, roundoff, pressure, rho } = *state;
        let (mut gap, mut mismatch, mut is_bound) = (0.0, 0.0f64, step.is_exact);
        for (i, pair) in model.pairs.iter().enumerate() {
            for q in model.range(i) {
                let (point, weight, p) = (q - model.offset[i], model.weight[q], pressure[q]);
                let c = nearest(&*pair.law, point, compression[q], roundoff[q], p);
                let changed = (p - places.pressure[q]).powi(2) / rho[q];
                mismatch = mismatch.max((p - pair.law.pressure(point, c)).abs());
                gap += weight * if p < 0.0 { changed } else { pair.law.duality_gap(point, c, p) };
                is_bound &= p >= 0.0;
            }
        }
        let (linear, energy) = (step.error, strain + places.work);
        let absolute = (2.0 * gap).sqrt() + linear;
        let contact = if linear > 0.0 { contact_energy(model, places) } else { 0.0 };
        let missed = if linear > 0.0 { scale.relative(linear * linear, contact) } else { 0.0 };
        let mismatch = if mismatch == 0.0 { 0.0 } else { mismatch / scale.peak(&places.pressure, strain) };
        Self {
            error: scale.relative(absolute * absolute, energy),
            is_bound,
            pressure: mismatch.max(missed),
            imbalance: scale.imbalance(model, &model.forces(pressure), strain),
        }
    }

    /// Return the errors of a result with u'Ku = `strain`. Its layer states `places` have the distance `off` from the laws, and the forces out of
    /// balance have the energy norm `unbalanced`; in results `of_steps` of Newton's method this is an error of the pressures, too, as in
    /// [`Reached::new`]. The second value is the pair whose distance from its law is the largest of all errors, if one is.
    pub(super) fn of_result(
        model: &Model,
        scale: &Scale,
        strain: f64,
        unbalanced: f64,
        off: &OffLaws,
        places: &Layer,
        of_steps: bool,
    ) -> (Self, Option<usize>) {
        let (energy, absolute) = (strain + places.work, (2.0 * off.gap).sqrt() + unbalanced);
        // pressures are measured by at least PART of what the bodies carry, and energies by its square
        let contact = contact_energy(model, places).max(PART * PART * energy);
        let missed = if of_steps { scale.relative(unbalanced * unbalanced, contact) } else { 0.0 };
        let mismatch = if off.mismatch == 0.0 { 0.0 } else { off.mismatch / scale.peak(&places.pressure, strain) };
        let reached = Self {
            error: scale.relative(absolute * absolute, energy),
            is_bound: false,
            pressure: if mismatch.is_nan() || mismatch > missed { mismatch } else { missed },
            imbalance: scale.imbalance(model, &places.force, strain),
        };
        let is_worst = mismatch > missed && mismatch >= reached.worst();
        (reached, is_worst.then_some(off.pair))
    }

    /// Add what rounding left of the equilibrium of a step from the states `before` to `places`. A further step `more` with the same matrix shows
    /// it. If that one is exact, it is rounded, too, and may miss as much again; an inexact one knows its own error. Return the larger error
    /// that was added.
    pub(super) fn add_rounding(
        &mut self,
        (scale, strain): (&Scale, f64),
        more: &Solution,
        before: &Layer,
        places: &Layer,
    ) -> f64 {
        let times = if more.is_exact { 2.0 } else { 1.0 };
        let missed = scale.relative(more.energy + more.error * more.error, strain + places.work);
        let closing = more.field.closing();
        let change = closing.iter().zip(&before.tangent).map(|(s, tangent)| (s * tangent).abs()).fold(0.0, f64::max);
        let change = if change == 0.0 { 0.0 } else { change / scale.peak(&places.pressure, strain) };
        self.error += times * missed;
        self.pressure += times * change;
        times * missed.max(change)
    }

    /// Return the largest of the errors, NaN if one of them is.
    pub fn worst(&self) -> f64 {
        let all = [self.error, self.pressure, self.imbalance];
        all.into_iter().fold(0.0, |worst, error| if error.is_nan() || error > worst { error } else { worst })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Field;
    use crate::model::sample::{WEIGHT, two_pairs};

    fn close(x: f64, y: f64) {
        assert!((x - y).abs() <= 1e-12 * y.abs(), "{x} {y}");
    }

    fn step(trace: Vec<f64>, energy: f64, error: f64) -> Solution {
        Solution { field: Field { states: Vec::new(), trace }, energy, error, is_exact: error == 0.0 }
    }

    fn state<'a>(compression: &'a [f64], pressure: &'a [f64], rho: &'a [f64]) -> Equilibrium<'a> {
        Equilibrium { compression, roundoff: &[0.0; 4], pressure, rho }
    }

    /// Points beside the laws p = 4 c and p = c^2 by known gaps: (4 c - p)^2/8, and c^3/3 + 2 p^1.5/3 - c p.
    #[test]
    fn a_gap_in_closed_form() {
        let model = two_pairs();
        // with p = 2, 4, 4, 1
        let places = Layer::new(&model, vec![0.5, 1.0, 2.0, 1.0]);
        let (c, rho, scale) = ([0.5, 1.0, 2.0, 3.0], [2.0, 0.5, 0.25, 3.0], Scale::default());
        let exact = step(vec![0.0; 8], 0.0, 0.0);
        let of = |p: [f64; 4]| Reached::new(&model, &scale, 5.0, &exact, &state(&c, &p, &rho), &places);
        let energy = |reached: &Reached| reached.error.powi(2) * (5.0 + places.work) / 2.0;
        let beside = of([2.0, 5.0, 1.0, 9.0]);
        close(energy(&beside), 2.0 / 8.0 + 3.0 * (8.0 / 3.0 + 2.0 / 3.0 - 2.0));
        assert!(beside.is_bound && beside.imbalance == 0.0);
        close(beside.pressure, 3.0 / 4.0);
        // a negative pressure leaves no bound, and counts by the work of its change
        let negative = of([2.0, 4.0, 4.0, -1.0]);
        assert!(!negative.is_bound);
        close(energy(&negative), 0.25 * 4.0 / 3.0);
    }

    #[test]
    fn errors_in_closed_form() {
        let model = two_pairs();
        let places = Layer::new(&model, vec![0.5, -1.0, 2.0, 1.0]);
        let slopes = surface_slopes(&model);
        let at = |q: usize| WEIGHT[q] * places.pressure[q].powi(2) * (1.0 / places.tangent[q] + 1.0 / slopes[q]);
        let contact = contact_energy(&model, &places);
        close(contact, at(0) + at(2) + at(3));
        // the first pressure is 4 c - 0.4
        let (scale, p, rho) = (Scale::default(), [1.6, 0.0, 4.0, 1.0], [1.0; 4]);
        let (gap, all): (f64, f64) = (0.5 * 0.4f64.powi(2) / 8.0, 5.0 + 0.5 * 1.0 + 3.0 * 8.0 + 0.25);
        let of = |error| {
            let step = step(vec![0.0; 8], 0.0, error);
            Reached::new(&model, &scale, 5.0, &step, &state(&places.compression, &p, &rho), &places)
        };
        let inexact = of(0.3);
        close(inexact.error, ((2.0 * gap).sqrt() + 0.3) / all.sqrt());
        close(inexact.pressure, f64::max(0.4 / 4.0, 0.3 / contact.sqrt()));
        assert!(!inexact.is_bound);
        let mut exact = of(0.0);
        close(exact.error, (2.0 * gap / all).sqrt());
        close(exact.pressure, 0.1);
        assert!(exact.is_bound);
        // a further step that closes the points by 0.01, -0.03, 0 and 0.02
        let more = step(vec![0.01, -0.01, 0.0, 0.0, 0.0, -0.02, 0.0, 0.02], 0.05, 0.1);
        close(exact.add_rounding((&scale, 5.0), &more, &places, &places), (0.06 / all).sqrt());
        close(exact.error, ((2.0 * gap).sqrt() + 0.06f64.sqrt()) / all.sqrt());
        close(exact.pressure, 0.1 + 0.04 / 4.0);
    }

    /// The law p = 4 c, and an open point, whose law has zero pressure at any c < 0.
    #[test]
    fn compressions_are_known_to_their_roundoff() {
        let law = &*two_pairs().pairs[0].law;
        let all = [(1.0, 4.2), (1.0, 5.0), (1.0, -1.0), (0.05, 0.0), (-1.0, 0.0)];
        assert_eq!(all.map(|(c, p)| nearest(law, 0, c, 0.1, p)), [1.05, 1.1, 0.9, 0.0, -1.0]);
        assert!(nearest(law, 0, f64::NAN, 0.1, 1.0).is_nan());
    }

    #[test]
    fn the_worst_of_all_errors() {
        let of = |error, pressure, imbalance| Reached { error, pressure, imbalance, ..Reached::default() }.worst();
        assert_eq!([of(3.0, 1.0, 2.0), of(1.0, 3.0, 2.0), of(1.0, 2.0, 3.0)], [3.0; 3]);
        assert!(of(f64::NAN, 1.0, 2.0).is_nan() && of(1.0, 2.0, f64::NAN).is_nan() && of(1.0, f64::NAN, 2.0).is_nan());
    }
}
