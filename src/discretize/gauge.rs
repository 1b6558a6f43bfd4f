//! Rigid motions that neither supports nor contact can hold: sliding on a plane, spin of a roller.
//!
//! If the loads do no work on such a motion, the solution is free up to it: one node is fixed against it, without reaction. If
//! they do, there is no solution, and the run says so.

use super::mechanism::Draft;
use super::part::Part;
use crate::ddm::Motion;
use crate::fem::rigid;
use crate::linalg::{Csr, dot, kernel};
use nalgebra::{DMatrix, DVector};

/// Share of the largest possible work below which the work of the loads is rounding.
pub const NO_WORK: f64 = 1e-9;

/// Fixes the motions of a body that nothing feels and no load works on, and names them.
pub fn fix<const D: usize>(part: &mut Part<D>, draft: &Draft) -> Vec<String> {
    let mut fixed = Vec::new();
    loop {
        let left = part.left(&draft.free);
        let idle = felt_by_none(&draft.motions::<D>(&left)).into_iter().find_map(|(_, weights)| {
            let motion = rigid::combine(&left, &weights);
            (work::<D>(&motion.displacement, &draft.load) == 0.0).then_some(motion)
        });
        let Some(motion) = idle else { return fixed };
        let Some(dof) = candidate(part, &draft.rows, &motion.displacement) else { return fixed };
        part.held.prescribed.insert(dof, 0.0);
        fixed.push(motion.name);
    }
}

/// The dof outside the contact rows, so that these stay as they are, that a motion moves most, unless that is little.
pub fn candidate<const D: usize>(part: &Part<D>, rows: &Csr, displacement: &[f64]) -> Option<usize> {
    let mut in_rows = vec![false; displacement.len()];
    rows.col.iter().for_each(|&dof| in_rows[dof as usize] = true);
    let candidates = (0..in_rows.len()).filter(|dof| !in_rows[*dof] && !part.held.prescribed.contains_key(dof));
    let size = |dof: &usize| displacement[*dof].abs();
    candidates.max_by(|a, b| size(a).total_cmp(&size(b))).filter(|dof| size(dof) > 1e-3)
}

/// Work of a load on a displacement; exactly zero if it is rounding.
pub fn work<const D: usize>(displacement: &[f64], load: &[f64]) -> f64 {
    let [work, largest] = works::<D>(displacement, load);
    if work.abs() <= NO_WORK * largest { 0.0 } else { work }
}

/// Work of a load on a displacement, and the largest that forces and displacements of these sizes can do, node by node.
pub fn works<const D: usize>(displacement: &[f64], load: &[f64]) -> [f64; 2] {
    let size = |v: &[f64]| dot(v, v).sqrt();
    let nodes = displacement.chunks_exact(D).zip(load.chunks_exact(D));
    [dot(displacement, load), nodes.map(|(u, f)| size(u) * size(f)).sum()]
}

/// Combinations of motions that no contact row feels: name and weights.
pub fn felt_by_none(motions: &[Motion]) -> Vec<(String, DVector<f64>)> {
    let felt = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    kernel(&felt, rows as f64, 1e-13)
        .into_iter()
        .map(|weights| {
            let parts = (0..motions.len()).filter(|&i| weights[i].abs() > 1e-6 * weights.amax());
            (parts.map(|i| motions[i].name.as_str()).collect::<Vec<_>>().join(" with "), weights.clone())
        })
        .collect()
}
