//! The rigid motions of the start as the origin of displacements.
//!
//! A body that falls far onto its neighbour comes with traces that are huge beside the compression of the layer: each sum
//! of two of them, less the gap, is rounded anew, and the pressures of a stiff layer tremble with it. So the gap takes the
//! motions of the start, once, and the iteration works on what is left.

use super::field::Field;
use super::model::Model;

/// How many times an iterate's displacement its origin may be.
const FAR: f64 = 10.0;

/// How many times what was left of the iterate with the origin its displacement may become.
const MOVED: f64 = 1e3;

/// Binary digits that an origin's amounts have.
const DIGITS: u32 = 24;

/// Rigid motions that were taken out of an iterate, and the gap as it was with them.
pub struct Origin {
    motion: Field,
    gap: Vec<f64>,
    /// Largest trace of what was left of the iterate.
    left: f64,
    /// What the loads have gained on these motions: to be added to F1.
    pub energy: f64,
}

impl Origin {
    /// Takes the rigid motions out of `iterate` and into the gap of `model`. Collective.
    pub fn take(model: &mut Model, iterate: &mut Field) -> Self {
        let mut motion = iterate.zero_like();
        let mut energy = [0.0];
        for (index, slot) in model.bodies.iter_mut().enumerate() {
            let Some(body) = slot.local.as_mut().filter(|body| body.rigid() > 0) else { continue };
            let (state, origin) = (&mut iterate.states[index], &mut motion.states[index]);
            let deformation = state.len() - body.rigid();
            for (origin, state) in origin[deformation..].iter_mut().zip(&mut state[deformation..]) {
                *origin = short(*state);
                *state -= *origin;
            }
            // the residual at rest without contact is the load
            let mut load = vec![0.0; origin.len()];
            body.residual(&body.rest(), &vec![0.0; slot.row_stiffness.len()], &mut load);
            energy[0] -= crate::linalg::dot(&load[deformation..], &origin[deformation..]);
        }
        // one message: the energy, then the traces of motions and of what is left
        motion.trace_here(model);
        iterate.trace_here(model);
        let mut message = [&energy[..], &motion.trace, &iterate.trace].concat();
        model.exchange.sum(&mut message);
        iterate.trace = message.split_off(1 + motion.trace.len());
        motion.trace = message.split_off(1);
        let gap = model.gap.clone();
        model.gap.iter_mut().zip(motion.closing()).for_each(|(gap, closing)| *gap -= closing);
        Self { left: largest(&iterate.trace), motion, gap, energy: message[0] }
    }

    /// Traces of the motions.
    pub fn trace(&self) -> &[f64] {
        &self.motion.trace
    }

    /// Whether another origin would be a better one: motions so much larger than where the iterate is that they do more harm than
    /// good, as the start was no good; or an iterate that has moved much farther than what bodies deform.
    pub fn is_far_from(&self, iterate: &Field) -> bool {
        let whole: Vec<f64> = self.motion.trace.iter().zip(&iterate.trace).map(|(a, b)| a + b).collect();
        let moved = self.left > 0.0 && largest(&iterate.trace) > MOVED * self.left;
        moved || largest(&self.motion.trace) > FAR * largest(&whole)
    }

    /// Gives the motions back.
    pub fn give(self, model: &mut Model, iterate: &mut Field) {
        iterate.add(1.0, &self.motion);
        model.gap = self.gap;
    }
}

/// Largest entry by size.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, value| max.max(value.abs()))
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
