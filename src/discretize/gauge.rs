//! Rigid motions that neither supports nor contact can resist: sliding on a plane, spin of a roller.
//!
//! If the loads do no work on such a motion, the solution is unique only up to it. One node is then fixed against the motion,
//! without reaction. If the loads do work on it, there is no solution, and the run reports this.

use super::interface::{Interface, Unconstrained};
use super::part::Part;
use crate::fem::rigid;

/// Fix the motions of a body that nothing resists and on which no load works, and return their names. `unconstrained` becomes the
/// set of the remaining motions.
pub fn fix<const D: usize>(
    part: &mut Part<D>,
    interface: &Interface<D>,
    unconstrained: &mut Unconstrained<D>,
) -> Vec<String> {
    let mut fixed = Vec::new();
    if unconstrained.unresisted.is_empty() {
        return fixed;
    }
    loop {
        let idle = unconstrained.unresisted.iter().find_map(|(_, weights)| {
            let motion = rigid::combine(&unconstrained.left, weights);
            (interface.works(part, std::slice::from_ref(&motion)) == [0.0]).then_some(motion)
        });
        let Some(motion) = idle else { return fixed };
        let Some(found) = interface.candidate(part, &motion) else { return fixed };
        part.fix(&found);
        *unconstrained = interface.unconstrained(part);
        fixed.push(motion.name);
    }
}
