//! Supports that move a body as one. That motion is subtracted before anything is rounded.

use super::part::Part;
use crate::exchange::Plain;
use crate::fem::rigid::{self, RigidMotion};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// The displacements that supports prescribe.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Supported<const D: usize> {
    /// Rigid motion by which the supports move the body as one.
    pub carried: Option<RigidMotion<D>>,
    /// Prescribed (dof, value) relative to this motion, sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
}

/// Return the displacements that the supports of a body prescribe. `free` are the rigid motions of the free body.
pub fn supported<const D: usize>(part: &Part<D>, free: &[RigidMotion<D>]) -> Supported<D> {
    let prescribed = part.prescribed_sorted();
    let value = |k: usize, dof: usize| part.dof_of(&free[k], dof);
    match carried(free.len(), &value, &prescribed).filter(|_| part.springs.is_empty()) {
        None => Supported { carried: None, prescribed },
        Some((weights, rest)) => Supported { carried: Some(rigid::sum(free, &weights)), prescribed: rest },
    }
}

/// Share of the largest prescribed displacement up to which supports agree with a rigid motion.
const AGREES: f64 = 1e-9;

/// Prescribed (dof, value).
type Prescribed = Vec<(usize, f64)>;

/// Return the weights of the `count` motions whose sum the supports prescribe, and the prescribed values relative to this sum.
/// `value(k, dof)` is the displacement of motion k at a dof. The result is `None` if the supports prescribe zero or deform the
/// body.
fn carried(
    count: usize,
    value: &dyn Fn(usize, usize) -> f64,
    prescribed: &[(usize, f64)],
) -> Option<(DVector<f64>, Prescribed)> {
    let largest = prescribed.iter().fold(0.0f64, |max, (_, u)| max.max(u.abs()));
    if largest == 0.0 {
        return None;
    }
    let at = DMatrix::from_fn(prescribed.len(), count, |i, j| value(j, prescribed[i].0));
    let values = DVector::from_fn(prescribed.len(), |i, _| prescribed[i].1);
    let factors = at.clone().svd(true, true);
    let mut weights = factors.solve(&values, 1e-7).ok()?;
    // The weights are refined, since every lost digit is a digit of the strains.
    weights += factors.solve(&(&values - &at * &weights), 1e-7).ok()?;
    let noise = 1e-14 * weights.amax();
    weights.iter_mut().filter(|weight| weight.abs() < noise).for_each(|weight| *weight = 0.0);
    let moved = at * &weights;
    let rest: Prescribed = prescribed.iter().zip(&moved).map(|(&(dof, u), moved)| (dof, u - moved)).collect();
    rest.iter().all(|(_, u)| u.abs() <= AGREES * largest).then_some((weights, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Extent;
    use crate::fem::rigid::modes;

    #[test]
    fn supports_carry_a_body_or_deform_it() {
        let nodes = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let all = modes(&Extent::of(nodes.into_iter()));
        let value = |k: usize, dof: usize| all[k].at(&nodes[dof / 2])[dof % 2];
        // The upper edge moves down by 0.3, and one node is constrained along x.
        let (weights, rest) = carried(3, &value, &[(0, 0.0), (5, -0.3), (7, -0.3)]).expect("a translation");
        assert!(weights[0].abs() < 1e-15 && (weights[1] + 0.3).abs() < 1e-15 && weights[2].abs() < 1e-15);
        assert!(rest.iter().all(|(_, u)| u.abs() < 1e-15));
        assert!(carried(3, &value, &[(1, 0.0), (3, 0.0), (5, -0.3), (7, -0.3)]).is_none());
        assert!(carried(3, &value, &[(1, 0.0), (3, 0.0)]).is_none());
    }
}
