//! The rigid motions of all bodies, in which a matrix of all bodies is solved exactly around its preconditioner.
//!
//! Many bodies on each other are a frame whose joints are layers. No smoother reduces errors in which the frame moves as a whole, and coarse levels of
//! multigrid do so only as far as they have the rigid motions of each body.

use crate::linalg::{axpy, fit};
use crate::model::{Model, Motion};
use crate::petsc::{MotionPart, Motions};

/// Return the rigid motions of all bodies, or `None` if no two bodies in contact can both move freely. Then no bodies move together, and the space would
/// save nothing. `offset` is the first entry of each body in a vector of this rank, and its length.
pub fn motions(model: &Model, offset: &[usize]) -> Option<Motions> {
    let mut free_sides = vec![0; model.pairs.len()];
    for slot in model.bodies.iter().filter(|slot| !slot.motions.is_empty()) {
        slot.segments.iter().for_each(|segment| free_sides[segment.pair] += 1);
    }
    if !free_sides.contains(&2) {
        return None;
    }
    let mut motions = Motions::default();
    for (slot, part) in model.bodies.iter().zip(offset.windows(2)) {
        let first_motion = motions.count;
        motions.count += slot.motions.len();
        let Some(matrices) = slot.local.as_ref().and_then(|body| body.matrices()) else { continue };
        for (motion, Motion { trace, .. }) in (first_motion..).zip(&slot.motions) {
            let mut values = vec![0.0; part[1] - part[0]];
            fit(matrices.traces, trace)
                .iter()
                .zip(matrices.motions)
                .for_each(|(a, shape)| axpy(*a, shape, &mut values));
            motions.parts.push(MotionPart { motion, first: part[0], values });
        }
    }
    Some(motions)
}
