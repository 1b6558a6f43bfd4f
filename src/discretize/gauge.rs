//! Rigid motions that neither supports nor contact can hold: sliding on a plane, spin of a roller.
//!
//! If the loads do no work on such a motion, the solution is free up to it: one node is fixed against it, without reaction. If
//! they do, there is no solution, and the run says so.

use super::interface::{Interface, Unconstrained};
use super::part::Part;
use crate::fem::rigid;

/// Fixes the motions of a body that nothing feels and no load works on, and names them; `unconstrained` becomes what is left.
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
