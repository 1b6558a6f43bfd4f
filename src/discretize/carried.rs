//! Supports that move a body as one: that motion is taken out before anything is rounded.

use super::part::Part;
use crate::fem::rigid::RigidMotion;
use crate::linalg::axpy;
use nalgebra::{DMatrix, DVector};

/// What supports prescribe.
pub struct Supported {
    /// Displacement by which they move the body as one, one entry a dof; empty for none.
    pub carried: Vec<f64>,
    /// (dof, value) besides it, sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
}

/// What the supports of a body prescribe; `free` are the rigid motions of the free body.
pub fn supported<const D: usize>(part: &Part<D>, free: &[RigidMotion]) -> Supported {
    let prescribed = part.prescribed_sorted();
    let whole = self::carried(free, &prescribed).filter(|_| part.springs.is_empty());
    let (carried, prescribed) = whole.unwrap_or((Vec::new(), prescribed));
    Supported { carried, prescribed }
}

/// Supports agree with a rigid motion to this share of the largest prescribed displacement.
const AGREES: f64 = 1e-9;

/// Prescribed (dof, value).
type Prescribed = Vec<(usize, f64)>;

/// The rigid motion that the prescribed (dof, value) give the body, one entry a dof, and what they prescribe besides it; `None`
/// if they prescribe zero or deform the body.
fn carried(motions: &[RigidMotion], prescribed: &[(usize, f64)]) -> Option<(Vec<f64>, Prescribed)> {
    let largest = prescribed.iter().fold(0.0f64, |max, (_, u)| max.max(u.abs()));
    if largest == 0.0 {
        return None;
    }
    let at = DMatrix::from_fn(prescribed.len(), motions.len(), |i, j| motions[j].displacement[prescribed[i].0]);
    let values = DVector::from_fn(prescribed.len(), |i, _| prescribed[i].1);
    let factors = at.clone().svd(true, true);
    let mut weights = factors.solve(&values, 1e-7).ok()?;
    // refined, as every digit lost is a digit of the strains
    weights += factors.solve(&(&values - &at * &weights), 1e-7).ok()?;
    let noise = 1e-14 * weights.amax();
    weights.iter_mut().filter(|weight| weight.abs() < noise).for_each(|weight| *weight = 0.0);
    let mut displacement = vec![0.0; motions[0].displacement.len()];
    for (motion, &weight) in motions.iter().zip(weights.iter()) {
        axpy(weight, &motion.displacement, &mut displacement);
    }
    let rest: Prescribed = prescribed.iter().map(|&(dof, u)| (dof, u - displacement[dof])).collect();
    rest.iter().all(|(_, u)| u.abs() <= AGREES * largest).then_some((displacement, rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rigid::modes;

    #[test]
    fn supports_carry_a_body_or_deform_it() {
        let all = modes(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
        // the upper edge down by 0.3, x held at one node
        let (u, rest) = carried(&all, &[(0, 0.0), (5, -0.3), (7, -0.3)]).expect("a translation");
        assert!(u.iter().skip(1).step_by(2).all(|y| (y + 0.3).abs() < 1e-15));
        assert!(rest.iter().all(|(_, u)| u.abs() < 1e-15));
        assert!(carried(&all, &[(1, 0.0), (3, 0.0), (5, -0.3), (7, -0.3)]).is_none());
        assert!(carried(&all, &[(1, 0.0), (3, 0.0)]).is_none());
    }
}
