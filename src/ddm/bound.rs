//! How far an iterate in equilibrium is from the solution: a bound by duality.
//!
//! After a linear step, displacements u and pressures p are in equilibrium: K u + B' omega p = f. Let P be the energy
//! of the law, P* its complementary energy, c = B u - d, and (u*, c*, p*) the solution. Then convex duality (Fenchel;
//! engineers know it as the error in the constitutive relation) gives an identity,
//!
//! ```text
//! gap = sum omega ( P(c) + P*(p) - c p )  =  |u - u*|_K^2 + sum omega ( D_P(c, c*) + D_P*(p, p*) ),
//! ```
//!
//! with the Bregman distances D_P(c, c*) = P(c) - P(c*) - p* (c - c*) >= 0 and D_P* alike. So the root of the gap is
//! the error of bodies, compressions and pressures together, and a bound of |u - u*|_K. Each term of the gap is zero on
//! the graph of the law and positive elsewhere. The bound needs no spectrum, no history and no constants.
//!
//! Beside the bound stand what errors are measured by ([`Scale`]), and what roundoff makes of compressions and
//! pressures where displacements are far larger than compressions.

use super::start;
use super::step::Equilibrium;
use crate::contact::law::Law;
use crate::linalg::dot;
use crate::model::Model;
use crate::model::layer::{Layer, in_series, surface_slopes};
use crate::model::linear::LinearSolution;
use crate::model::motions::PART;

/// Energy norm of the unbalanced forces, relative to bodies and layers, up to which a linear step is exact: half of the
/// digits, the root of epsilon. An inexact factorisation leaves more, and no bound holds then.
pub(super) const EXACT: f64 = 1.5e-8;

/// The relative errors that end a run of Newton's method.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reached {
    /// Error in the energy norm: that of the layers from the duality gap, that of the linear step from its solver.
    pub error: f64,
    /// Whether `error` is a bound: no pressure of a layer that lets go is negative, and the linear step is exact to
    /// rounding.
    pub is_bound: bool,
    /// Error of the pressures. It is the largest difference from the law, relative to the largest pressure, or the
    /// error of an inexact linear step, relative to the energy of the contact alone.
    pub pressure: f64,
    /// Forces out of balance on a body, as a share of its contact forces: the largest over all bodies, by the pressures
    /// of the layers, which are the result.
    pub imbalance: f64,
}

/// Return the energy that the pressures give the layers and the surfaces under them, sum omega p^2 (1/kappa + 1/rho0).
/// The energy of the whole bodies may be much larger, and an error that is small relative to that one may be large for
/// the pressures.
pub(super) fn contact_energy(model: &Model, layer: &Layer) -> f64 {
    let slopes = surface_slopes(model);
    let at = |q: usize| layer.force[q] * layer.pressure[q] * (layer.tangent[q].recip() + slopes[q].recip());
    (0..slopes.len()).filter(|&q| layer.force[q] != 0.0).map(at).sum()
}

/// Return the part of [`contact_energy`] that is in the surfaces, sum omega p^2 / rho0.
pub(super) fn surface_energy(model: &Model, layer: &Layer) -> f64 {
    let slopes = surface_slopes(model);
    (0..slopes.len()).map(|q| layer.force[q] * layer.pressure[q] / slopes[q]).sum()
}

/// Return the compression within c -+ `roundoff` at which the pressure of a law is nearest to p.
fn nearest(law: &Law, point: usize, c: f64, roundoff: f64, p: f64) -> f64 {
    let difference =
        if p > 0.0 || law.is_bonded() { law.compression(point, p) - c } else { c.min(law.rest(point)) - c };
    if difference.is_finite() { c + difference.clamp(-roundoff, roundoff) } else { c }
}

impl Reached {
    /// Measure an iterate with u'Ku = `strain` after the linear step `step`. `state` is its equilibrium, `layer` has
    /// the resolved states on the laws.
    ///
    /// A compression is known only to its roundoff. Of the admissible values, the one that is closest to the law is
    /// used: a stiff law would answer roundoff with any pressure. Where a pressure is negative, the gap is infinite,
    /// and the work of its change to the resolved state replaces the gap.
    pub(super) fn new(
        model: &Model,
        scale: &Scale,
        strain: f64,
        step: &LinearSolution,
        state: &Equilibrium,
        layer: &Layer,
    ) -> Self {
        let Equilibrium { compression, roundoff, pressure, rho } = *state;
        let (mut gap, mut mismatch, mut is_bound) = (0.0, 0.0f64, step.is_exact);
        for (q, pair, point) in model.each_point() {
            let p = pressure[q];
            let c = nearest(&pair.law, point, compression[q], roundoff[q], p);
            let changed = (p - layer.pressure[q]).powi(2) / rho[q];
            mismatch = mismatch.max((p - pair.law.pressure(point, c)).abs());
            let is_on_side = p >= 0.0 || pair.law.is_bonded();
            gap += model.area[q] * if is_on_side { pair.law.duality_gap(point, c, p) } else { changed };
            is_bound &= is_on_side;
        }
        let (linear, energy) = (step.error, strain + layer.work);
        let absolute = gap.sqrt() + linear;
        let contact = if linear > 0.0 { contact_energy(model, layer) } else { 0.0 };
        let missed = if linear > 0.0 { scale.relative(linear * linear, contact) } else { 0.0 };
        let mismatch = if mismatch == 0.0 { 0.0 } else { mismatch / scale.peak(&layer.pressure, strain) };
        Self {
            error: scale.relative(absolute * absolute, energy),
            is_bound,
            pressure: mismatch.max(missed),
            imbalance: scale.imbalance(model, &layer.force, strain),
        }
    }

    /// Verify the equilibrium after a step that its solver takes for exact: f - K u - B' omega p has the relative
    /// energy norm `unbalanced`.
    pub(super) fn verify(&mut self, unbalanced: f64) {
        self.is_bound &= unbalanced <= EXACT;
    }

    /// Add twice what is left of equilibrium after a step from the states `before` to `layer`. The solution `more` with
    /// the same matrix shows it.
    pub(super) fn add_unbalanced(
        &mut self,
        scale: &Scale,
        strain: f64,
        more: &LinearSolution,
        before: &Layer,
        layer: &Layer,
    ) {
        let missed = scale.relative(more.energy + more.error * more.error, strain + layer.work);
        let closing = more.field.closing();
        let change = closing.iter().zip(&before.tangent).map(|(s, tangent)| (s * tangent).abs()).fold(0.0, f64::max);
        let change = if change == 0.0 { 0.0 } else { change / scale.peak(&layer.pressure, strain) };
        self.error += 2.0 * missed;
        self.verify(missed);
        self.pressure += 2.0 * change;
    }

    /// Return the largest of the errors, NaN if one of them is.
    pub fn worst(&self) -> f64 {
        let all = [self.error, self.pressure, self.imbalance];
        all.into_iter().fold(0.0, |worst, error| if error.is_nan() || error > worst { error } else { worst })
    }
}

/// What errors are measured by where a contact vanishes: a reference energy, and the pressure that gives it to the
/// surfaces.
///
/// Unconstrained bodies that only an initial overlap presses together move apart until no pressure is left. Then
/// everything that a relative tolerance could refer to vanishes with the error, and rest or the automatic start is the
/// reference. Its layers may answer an overlap with any pressure, so the surfaces deflect first ([`start::at`]). Under
/// loads the start alone is the reference: an overlap says nothing of the pressures that carry them. A contact may also
/// vanish while bodies carry other loads. Then the reference is the energy of their strains, as a pressure on all
/// surfaces. Bodies that expand have the energy of hindered expansion as a reference, too: free ones carry the rounding
/// of it.
///
/// A solution below [`PART`] of a reference is measured by that share of it. With a tolerance of 1e-8 this is 1e-14 of
/// what the bodies carry, which is lost in the rounding of their forces. A start that the scene gives is no reference,
/// because it may be any displacement.
#[derive(Debug, Clone, Default)]
pub struct Scale {
    /// [`PART`] squared of the energy of a start, sum omega p c, or of hindered expansion.
    energy: f64,
    /// Energy of [`PART`] of the last displacements of the surfaces, as deflections.
    moved: f64,
    /// Area of all contact surfaces, sum omega.
    area: f64,
    /// Energy that a unit pressure gives all surfaces, sum omega/rho0.
    compliance: f64,
}

impl Scale {
    /// Return the scales of a model, from traces (2n each) that a run may begin with.
    pub fn new(model: &Model, traces: &[&[f64]]) -> Self {
        let energy = |trace: &&[f64]| dot(&start::at(model, trace).force, &model.compression(trace));
        let heat = model.bodies.iter().map(|slot| slot.heat).sum();
        Self {
            energy: PART * PART * traces.iter().map(energy).fold(heat, f64::max),
            moved: 0.0,
            area: model.area.iter().sum(),
            compliance: surface_slopes(model).iter().zip(&model.area).map(|(slope, area)| area / slope).sum(),
        }
    }

    /// Take note of displacements of the surfaces (trace, 2n): [`PART`] of them, as deflections, are a reference, too.
    /// Supports may move a body as a whole and without contact, so that strains are the rounding of zero.
    pub fn note_displacements(&mut self, model: &Model, trace: &[f64]) {
        let (one, other) = trace.split_at(trace.len() / 2);
        let square = |q: usize| one[q].powi(2) + other[q].powi(2);
        let energy = surface_slopes(model).into_iter().enumerate().map(|(q, slope)| slope * model.area[q] * square(q));
        self.moved = PART * PART * energy.sum::<f64>();
    }

    /// Return the energy by which an error is measured where the iterate has this `energy`.
    pub fn energy(&self, energy: f64) -> f64 {
        energy.max(self.energy).max(self.moved)
    }

    /// Whether an energy is infinite, or so small that its rounding, eps^2 of it, is below the range of numbers. A zero
    /// energy is out of range if the layers carry pressures, up to `peak`.
    pub fn is_out_of_range(&self, energy: f64, peak: f64) -> bool {
        const LEAST: f64 = f64::MIN_POSITIVE / (f64::EPSILON * f64::EPSILON);
        let energy = self.energy(energy);
        if energy == 0.0 { peak > 0.0 } else { !(LEAST..f64::INFINITY).contains(&energy) }
    }

    /// The relative residual: root of `numerator` = r'G^-1 r over `reference` = u'Ku + sum omega p c. A zero reference
    /// asks for an absolute zero.
    pub fn relative(&self, numerator: f64, reference: f64) -> f64 {
        if numerator.is_nan() || reference.is_nan() {
            return f64::NAN;
        }
        // rounding can make a tiny numerator negative
        if numerator <= 0.0 { 0.0 } else { (numerator / self.energy(reference)).sqrt() }
    }

    /// Return the pressure that gives all contact surfaces the reference energy, or [`PART`] of the one that gives them
    /// the energy u'Ku of the bodies. The pressure of soft layers between stiff bodies is no measure of what the bodies
    /// carry.
    fn pressure(&self, strain: f64) -> f64 {
        let energy = self.energy.max(PART * PART * strain);
        if self.compliance > 0.0 { (energy / self.compliance).sqrt() } else { 0.0 }
    }

    /// Return the pressure by which errors of pressures are measured in bodies with u'Ku = `strain`: the largest one
    /// (n), or the least scale.
    pub fn peak(&self, pressure: &[f64], strain: f64) -> f64 {
        pressure.iter().map(|p| p.abs()).fold(self.pressure(strain), f64::max)
    }

    /// Return the forces out of balance on a body under the contact forces `force` (n), relative to these forces: the
    /// largest over all rigid motions that supports leave free. `strain` is u'Ku over all bodies. For such a motion m,
    /// K m = 0, so that only loads and contact forces work on it.
    ///
    /// The residual shows too little of an imbalance where the Robin term that holds the body is much stiffer than the
    /// layer.
    pub fn imbalance(&self, model: &Model, force: &[f64], strain: f64) -> f64 {
        let mut most = 0.0f64;
        let least = self.area * self.pressure(strain);
        for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| slot.free > 0) {
            let force = model.at_rows(body, force);
            let total = least.max(force.iter().map(|force| force.abs()).sum());
            for motion in slot.free_motions() {
                let arm = motion.trace.iter().fold(0.0f64, |max, m| max.max(m.abs()));
                let lacking = (motion.work - dot(&force, &motion.trace)).abs();
                if lacking > 0.0 {
                    most = most.max(lacking / (arm * total));
                }
            }
        }
        most
    }
}

/// Return the error of every compression c = u_a + u_b - d by rounding of the gap d and of both displacements, n.
/// `trace` is a trace vector (2n).
pub(super) fn compression_roundoff(model: &Model, trace: &[f64]) -> Vec<f64> {
    let points = model.points();
    let terms = |q: usize| trace[q].abs() + trace[points + q].abs() + model.gap[q].abs();
    (0..points).map(|q| f64::EPSILON * terms(q)).collect()
}

/// Return the largest error of a pressure by rounding of the gap and of both displacements, relative to the `peak` by
/// which pressures are measured. Traces and gaps are sums, which are rounded before they are added, so that the
/// roundoff of a compression counts twice. `trace` is a trace vector (2n); `answer`, n, is the stiffness per area with
/// which the bodies answer an error of the gap.
///
/// Where bodies fall far, the origin keeps the digits of every iterate, but the gap is data with the digits that it
/// has. Layer and bodies answer an error of the gap like springs in series, 1/(1/kappa + 1/answer). In Newton's method
/// pressures are in equilibrium, the bodies answer with their surfaces, and layer states lie on lines of slope rho.
/// Sweeps take pressures from compressions, so that the layer answers alone: `answer` is infinite.
pub(super) fn pressure_roundoff(model: &Model, trace: &[f64], layer: &Layer, answer: &[f64], peak: f64) -> f64 {
    let roundoff = compression_roundoff(model, trace);
    let error = |q: usize| in_series(layer.tangent[q], answer[q]) * roundoff[q];
    let most = (0..roundoff.len()).filter(|&q| layer.pressure[q] != 0.0).map(error).fold(0.0, f64::max);
    if most > 0.0 { 2.0 * most / peak } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::DisplacementField;
    use crate::model::sample::{AREA, two_pairs};

    fn close(x: f64, y: f64) {
        assert!((x - y).abs() <= 1e-12 * y.abs(), "{x} {y}");
    }

    fn step(trace: Vec<f64>, energy: f64, error: f64) -> LinearSolution {
        LinearSolution {
            field: DisplacementField { trace, ..DisplacementField::default() },
            energy,
            error,
            is_exact: error == 0.0,
        }
    }

    fn state<'a>(compression: &'a [f64], pressure: &'a [f64], rho: &'a [f64]) -> Equilibrium<'a> {
        Equilibrium { compression, roundoff: &[0.0; 4], pressure, rho }
    }

    /// Points beside the laws p = 4 c and p = c^2 by known bounds of gaps: (4 c - p)^2/4, and (c - p^0.5) (c^2 - p).
    #[test]
    fn a_gap_in_closed_form() {
        let model = two_pairs();
        // with p = 2, 4, 4, 1
        let layer = Layer::new(&model, vec![0.5, 1.0, 2.0, 1.0]);
        let (c, rho, scale) = ([0.5, 1.0, 2.0, 3.0], [2.0, 0.5, 0.25, 3.0], Scale::default());
        let exact = step(vec![0.0; 8], 0.0, 0.0);
        let of = |p: [f64; 4]| Reached::new(&model, &scale, 5.0, &exact, &state(&c, &p, &rho), &layer);
        let energy = |reached: &Reached| reached.error.powi(2) * (5.0 + layer.work);
        let beside = of([2.0, 5.0, 1.0, 9.0]);
        close(energy(&beside), 2.0 / 4.0 + 3.0 * 1.0 * 3.0);
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
        let layer = Layer::new(&model, vec![0.5, -1.0, 2.0, 1.0]);
        let slopes = surface_slopes(&model);
        let at = |q: usize| AREA[q] * layer.pressure[q].powi(2) * (1.0 / layer.tangent[q] + 1.0 / slopes[q]);
        let contact = contact_energy(&model, &layer);
        close(contact, at(0) + at(2) + at(3));
        // the first pressure is 4 c - 0.4
        let (scale, p, rho) = (Scale::default(), [1.6, 0.0, 4.0, 1.0], [1.0; 4]);
        let (gap, all): (f64, f64) = (0.5 * 0.4f64.powi(2) / 4.0, 5.0 + 0.5 * 1.0 + 3.0 * 8.0 + 0.25);
        let of = |error| {
            let step = step(vec![0.0; 8], 0.0, error);
            Reached::new(&model, &scale, 5.0, &step, &state(&layer.compression, &p, &rho), &layer)
        };
        let inexact = of(0.3);
        close(inexact.error, (gap.sqrt() + 0.3) / all.sqrt());
        close(inexact.pressure, f64::max(0.4 / 4.0, 0.3 / contact.sqrt()));
        assert!(!inexact.is_bound);
        let verified = |unbalanced: f64| {
            let mut reached = of(0.0);
            reached.verify(unbalanced);
            reached.is_bound
        };
        assert_eq!([1e-10, 0.5, f64::NAN].map(verified), [true, false, false]);
        let mut exact = of(0.0);
        close(exact.error, (gap / all).sqrt());
        close(exact.pressure, 0.1);
        assert!(exact.is_bound);
        // a further step that closes the points by 0.01, -0.03, 0 and 0.02
        let more = step(vec![0.01, -0.01, 0.0, 0.0, 0.0, -0.02, 0.0, 0.02], 0.05, 0.1);
        exact.add_unbalanced(&scale, 5.0, &more, &layer, &layer);
        close(exact.error, (gap.sqrt() + 2.0 * 0.06f64.sqrt()) / all.sqrt());
        close(exact.pressure, 0.1 + 2.0 * 0.04 / 4.0);
        assert!(!exact.is_bound, "a step that lacks so much of equilibrium is not exact");
    }

    /// The law p = 4 c, and an open point, whose law has zero pressure at any c < 0.
    #[test]
    fn compressions_are_known_to_their_roundoff() {
        let law = &two_pairs().pairs[0].law;
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
