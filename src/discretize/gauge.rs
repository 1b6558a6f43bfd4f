//! Rigid motions that neither supports nor contact can hold: sliding on a plane, spin of a roller.
//!
//! If the loads do no work on such a motion, the solution is free up to it: one node is fixed against it, without reaction. If
//! they do, there is no solution, and the run says so.

use super::part::Part;
use crate::ddm::Motion;
use crate::fem::rigid::{self, RigidMotion};
use crate::linalg::{Csr, dot, kernel};
use nalgebra::{DMatrix, DVector};

/// Share of the largest possible work below which the work of the loads is rounding.
const NO_WORK: f64 = 1e-9;

/// Fixes the motions of a body that nothing feels and no load works on, and names them.
pub fn fix<const D: usize>(part: &mut Part<D>, free: &[RigidMotion], rows: &Csr, load: &[f64]) -> Vec<String> {
    let mut in_rows = vec![false; part.space.dofs()];
    rows.col.iter().for_each(|&dof| in_rows[dof as usize] = true);
    let mut fixed = Vec::new();
    loop {
        let left = part.left(free);
        let motions: Vec<Motion> = left.iter().map(|motion| super::trace_of(motion, rows, load)).collect();
        let idle = felt_by_none(&motions).into_iter().find_map(|(_, weights)| {
            let motion = rigid::combine(&left, &weights);
            (work(&motion.displacement, load) == 0.0).then_some(motion)
        });
        let Some(motion) = idle else { return fixed };
        // a dof outside the contact rows, so that these stay as they are
        let candidates = (0..in_rows.len()).filter(|dof| !in_rows[*dof] && !part.held.prescribed.contains_key(dof));
        let size = |dof: &usize| motion.displacement[*dof].abs();
        let Some(dof) = candidates.max_by(|a, b| size(a).total_cmp(&size(b))).filter(|dof| size(dof) > 1e-3) else {
            return fixed;
        };
        part.held.prescribed.insert(dof, 0.0);
        fixed.push(motion.name);
    }
}

/// Work of a load on a displacement; exactly zero if it is rounding.
pub fn work(displacement: &[f64], load: &[f64]) -> f64 {
    let work = dot(displacement, load);
    let largest: f64 = displacement.iter().zip(load).map(|(u, f)| (u * f).abs()).sum();
    if work.abs() <= NO_WORK * largest { 0.0 } else { work }
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
