//! The rigid motions of the start as the origin of displacements.
//!
//! A body that falls far onto its neighbour has traces that are huge compared with the compression of the layer. Each sum of two
//! traces, less the gap, is rounded anew, and the pressures of a stiff layer vary with these rounding errors. So the motions of the start are
//! subtracted from the gaps once, and the iteration works on displacements relative to them. The motions come from the scene alone, not from a method
//! or its start, and have few digits. So every method sees the same gaps.

use super::{Field, Model, Motions};
use crate::linalg::dot;
use nalgebra::DVector;

/// Binary digits of the amounts of motions in an origin. Their products with coordinates of 29 digits are then exact.
const DIGITS: u32 = 24;

/// Largest relative difference between an amount of the start and that in its origin.
pub const ROUNDING: f64 = 1.0 / (1 << DIGITS) as f64;

/// Rigid motions that were subtracted from displacements and gaps.
pub struct Origin {
    motion: Field,
    /// The gaps without the motions, n.
    gap: Vec<f64>,
    /// Minus the work of the loads on the motions, which must be added to F1.
    pub energy: f64,
    /// The start relative to the origin: the part of its motions that the digits of the origin do not hold.
    pub rest: Field,
}

impl Origin {
    /// Subtract the motions of a start from the gaps of `model`. `amounts` has one entry for each motion of [`Motions::with_springs`]. Return `None` if all
    /// are zero. Collective.
    pub fn take(model: &mut Model, amounts: &DVector<f64>) -> Option<Self> {
        if amounts.iter().all(|&amount| amount == 0.0) {
            return None;
        }
        let mut motion = Motions::with_springs(model).field(model, amounts);
        let mut rest = Field::rest(model);
        let mut energy = [0.0];
        for (index, slot) in model.bodies.iter_mut().enumerate() {
            let state = &mut motion.states[index];
            // a motion that springs resist is not free, so it stays part of the displacements
            if slot.sprung.is_some() {
                state.fill(0.0);
                continue;
            }
            let Some(body) = slot.local.as_mut() else { continue };
            let Some(count) = body.matrices().map(|matrices| matrices.traces.len()) else { continue };
            let deformation = state.len() - count;
            for (origin, beyond) in state[deformation..].iter_mut().zip(&mut rest.states[index][deformation..]) {
                let amount = *origin;
                *origin = short(amount);
                *beyond += amount - *origin;
            }
            // at rest and without contact the residual is the load; rigid motions cause no strain, so K u = 0
            let mut load = vec![0.0; state.len()];
            body.residual(&body.rest(), &vec![0.0; state.len()], &vec![0.0; slot.row_stiffness.len()], &mut load);
            energy[0] -= dot(&load[deformation..], &state[deformation..]);
        }
        // one message has the energy and both traces
        motion.trace_here(model);
        rest.trace_here(model);
        let mut message = [&energy[..], &motion.trace, &rest.trace].concat();
        model.exchange.sum(&mut message);
        rest.trace = message.split_off(1 + motion.trace.len());
        motion.trace = message.split_off(1);
        let gap = model.gap.clone();
        model.gap.iter_mut().zip(motion.closing()).for_each(|(gap, closing)| *gap -= closing);
        Some(Self { motion, gap, energy: message[0], rest })
    }

    /// Return the traces of the motions, 2n.
    pub fn trace(&self) -> &[f64] {
        &self.motion.trace
    }

    /// Subtract the motions from displacements.
    pub fn take_from(&self, model: &Model, iterate: &mut Field) {
        iterate.add(-1.0, &self.motion);
        iterate.retrace(model);
    }

    /// Add the motions to displacements again, and restore the gaps.
    pub fn give(self, model: &mut Model, iterate: &mut Field) {
        iterate.add(1.0, &self.motion);
        model.gap = self.gap;
    }
}

/// Return `amount` rounded to its leading [`DIGITS`]. Its products with the motion of a flat surface along an axis are then exact, and rounding does not
/// depend on the start.
fn short(amount: f64) -> f64 {
    let digits = f64::MANTISSA_DIGITS - DIGITS;
    let scale = (1u64 << digits) as f64 + 1.0;
    let product = amount * scale;
    // Dekker's splitting of a number into two
    if product.is_finite() { product - (product - amount) } else { amount }
}

#[cfg(test)]
mod tests {
    use super::short;

    /// An amount is rounded to the nearest number of 24 binary digits, and its products with small integers are exact.
    #[test]
    fn few_digits_are_left() {
        for amount in [10.0 + 3e-9, -0.1, 1e-300, 7.0f64.sqrt() * 1e40] {
            let head = short(amount);
            assert!(((head - amount) / amount).abs() <= 2f64.powi(-24), "{head}");
            assert_eq!(short(head), head);
            assert_eq!(3.0 * head - 2.0 * head, head);
        }
        assert_eq!(short(10.0 + 3e-9), 10.0);
        assert_eq!(short(1e308), 1e308);
    }
}
