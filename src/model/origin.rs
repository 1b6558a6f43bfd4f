//! The rigid motions of the start as the origin of displacements.
//!
//! A body that falls far onto its neighbour comes with traces that are huge beside the compression of the layer: each sum of two of
//! them, less the gap, is rounded anew, and the pressures of a stiff layer tremble with it. So the gap takes the motions of the
//! start, once, and the iteration works on what is left. They come from the scene alone, not from a method or its start, and have few
//! digits: every method sees the same gaps.

use super::{Field, Model, Motions};
use crate::linalg::dot;
use nalgebra::DVector;

/// Binary digits that an origin's amounts have: products with coordinates of 29 digits are then exact.
const DIGITS: u32 = 24;

/// Share of an amount that its origin may lack.
pub const ROUNDING: f64 = 1.0 / (1 << DIGITS) as f64;

/// Rigid motions that were taken out of the displacements, and the gap as it was with them.
pub struct Origin {
    motion: Field,
    gap: Vec<f64>,
    /// What the loads have gained on these motions: to be added to F1.
    pub energy: f64,
    /// The start itself, seen from here: what it has beyond the digits of the motions.
    pub rest: Field,
}

impl Origin {
    /// Takes the motions of a start, in these `amounts`, into the gap of `model`; none if nothing moves. Collective.
    pub fn take(model: &mut Model, amounts: &DVector<f64>) -> Option<Self> {
        if amounts.iter().all(|&amount| amount == 0.0) {
            return None;
        }
        let mut motion = Motions::with_springs(model).field(model, amounts);
        let mut rest = Field::rest(model);
        let mut energy = [0.0];
        for (index, slot) in model.bodies.iter_mut().enumerate() {
            let state = &mut motion.states[index];
            // what springs hold is no free motion: it stays part of the displacements
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
            // the residual at rest without contact is the load
            let mut load = vec![0.0; state.len()];
            // rigid motions strain nothing
            body.residual(&body.rest(), &vec![0.0; state.len()], &vec![0.0; slot.row_stiffness.len()], &mut load);
            energy[0] -= dot(&load[deformation..], &state[deformation..]);
        }
        // one message: the energy, then the traces
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

    /// Traces of the motions.
    pub fn trace(&self) -> &[f64] {
        &self.motion.trace
    }

    /// Takes the motions out of displacements.
    pub fn take_from(&self, model: &Model, iterate: &mut Field) {
        iterate.add(-1.0, &self.motion);
        iterate.retrace(model);
    }

    /// Gives the motions back to the displacements.
    pub fn give(self, model: &mut Model, iterate: &mut Field) {
        iterate.add(1.0, &self.motion);
        model.gap = self.gap;
    }
}

/// `amount` with the leading digits only. Its products with the motion of a flat surface along an axis are then exact, and what
/// rounding there is does not depend on the start.
fn short(amount: f64) -> f64 {
    let digits = f64::MANTISSA_DIGITS - DIGITS;
    let scale = (1u64 << digits) as f64 + 1.0;
    let product = amount * scale;
    // Dekker's splitting
    if product.is_finite() { product - (product - amount) } else { amount }
}

#[cfg(test)]
mod tests {
    use super::short;

    /// 24 binary digits, nearest, and products with small whole numbers without rounding.
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
