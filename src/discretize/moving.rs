//! Rigid motions of some bodies together, and the change of loads so that they do no work on these motions.

use super::interface::Interface;
use super::part::Part;
use crate::fem::RigidMotion;
use crate::linalg::dot;
use nalgebra::{DMatrix, DVector};

/// A motion of some bodies, each of which is rigid.
pub struct Moving<const D: usize> {
    /// Indices of the bodies that it moves.
    pub bodies: Vec<usize>,
    /// Rigid motion of each of these bodies.
    pub motions: Vec<RigidMotion<D>>,
    /// Name of the motion.
    pub name: String,
    /// Gap change per unit of the motion: the root of the sum over pairs of its mean square.
    pub error: f64,
}

impl<const D: usize> Moving<D> {
    /// Return the work of the loads on the motion, and the largest work that forces of their magnitudes could do.
    pub fn works(&self, parts: &[Part<D>], interfaces: &[Interface<D>]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (&body, motion) in self.bodies.iter().zip(&self.motions) {
            let works = interfaces[body].load.works(|node| parts[body].at_dofs(motion, node));
            (0..2).for_each(|k| sums[k] += works[k]);
        }
        sums
    }

    /// Return the rigid motion of a body, if the motion moves it.
    fn of(&self, body: usize) -> Option<&RigidMotion<D>> {
        let place = self.bodies.iter().position(|&moved| moved == body)?;
        Some(&self.motions[place])
    }
}

/// Change the loads so that they do no work on any of these motions m_j. `works` holds the works w_j that the loads do on them.
/// Return whether this was possible, since rigid surfaces keep their forces.
///
/// Each nodal force f changes along the motions in proportion to its magnitude, by -|f| sum_j b_j m_j at its node. The amounts
/// b_j solve
///
/// ```text
/// sum_k G_jk b_k = w_j,      G_jk = sum_nodes |f| m_j . m_k,
/// ```
///
/// so that nodes with equal loads get equal corrections.
pub fn balance<const D: usize>(
    all: &[&Moving<D>],
    works: &[f64],
    parts: &[Part<D>],
    interfaces: &mut [Interface<D>],
) -> bool {
    let count = all.len();
    let mut products = DMatrix::zeros(count, count);
    for (body, (part, interface)) in parts.iter().zip(&*interfaces).enumerate() {
        let motions: Vec<(usize, &RigidMotion<D>)> =
            all.iter().enumerate().filter_map(|(j, moving)| Some((j, moving.of(body)?))).collect();
        for (node, force) in interface.nodal_load.iter().filter(|_| !motions.is_empty()) {
            let size = dot(&force, &force).sqrt();
            let at = motions.iter().map(|(j, motion)| (*j, motion.at(&part.space.nodes[node as usize])));
            let at: Vec<(usize, [f64; D])> = at.collect();
            for (j, u) in &at {
                at.iter().for_each(|(k, v)| products[(*j, *k)] += size * dot(u, v));
            }
        }
    }
    let Some(factor) = products.cholesky() else { return false };
    let amounts = factor.solve(&DVector::from_column_slice(works));
    for (body, (part, interface)) in parts.iter().zip(interfaces).enumerate() {
        let moved = |x: &[f64; D]| {
            let mut sum = [0.0; D];
            for (moving, amount) in all.iter().zip(amounts.iter()) {
                let at = moving.of(body).map_or([0.0; D], |motion| motion.at(x));
                (0..D).for_each(|c| sum[c] += amount * at[c]);
            }
            sum
        };
        interface.change_loads(part, moved);
    }
    true
}
