//! Rigid motions that neither supports nor contact can hold: sliding on a plane, spin of a roller.
//!
//! If the loads do no work on such a motion, the solution is free up to it: one node is fixed against it, without reaction. If
//! they do, there is no solution, and the run says so.

use super::draft::{Draft, Loose};
use super::part::Part;
use crate::fem::rigid;

/// Fixes the motions of a body that nothing feels and no load works on, and names them; `loose` becomes what is left.
pub fn fix<const D: usize>(part: &mut Part<D>, draft: &Draft<D>, loose: &mut Loose<D>) -> Vec<String> {
    let mut fixed = Vec::new();
    if loose.unfelt.is_empty() {
        return fixed;
    }
    loop {
        let idle = loose.unfelt.iter().find_map(|(_, weights)| {
            let motion = rigid::combine(&loose.left, weights);
            (draft.works(part, std::slice::from_ref(&motion)) == [0.0]).then_some(motion)
        });
        let Some(motion) = idle else { return fixed };
        let Some(found) = draft.candidate(part, &motion) else { return fixed };
        part.fix(&found);
        *loose = draft.loose(part);
        fixed.push(motion.name);
    }
}
