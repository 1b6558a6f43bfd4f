//! Nodal stresses recovered from displacements.

use super::elasticity::Elasticity;
use super::space::Space;
use super::{assemble, element, quadrature};
use crate::problem::order::Order;
use nalgebra::Matrix3;

/// Return the stress (xx yy zz xy yz xz) at every node: the mean of the stresses that the cells around the node have there, weighted by
/// their measures. In bodies of revolution zz is the stress along the circles.
///
/// `u` has one entry a dof. Where the elasticity has no value at a node, as on the axis of cylindrical axes, that of an integration
/// point of the cell is used.
pub fn nodal<const D: usize>(space: &Space<D>, elasticity: &Elasticity, u: &[f64]) -> Vec<[f64; 6]> {
    let rule = quadrature::simplex(D + 1, if space.order == Order::P1 { 2 } else { 5 });
    let inside = element::values(space.order, &rule.points[0]);
    let mut sum = vec![[0.0; 6]; space.nodes.len()];
    let mut volume = vec![0.0; space.nodes.len()];
    for index in 0..space.cell_count() {
        let x = space.cell_nodes(index);
        let cell = space.cell(index);
        for (place, &node) in cell.iter().enumerate() {
            let l = &element::place(D + 1, place)[..=D];
            let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
            let at = space.nodes[node as usize];
            let slope = space.slope(cell, &at, &element::values(space.order, l), &gradient, u);
            let material = elasticity
                .at(index, space.in_scene(at))
                .or_else(|_| elasticity.at(index, space.in_scene(assemble::interpolate(&x, &inside))));
            // Assembly has evaluated this integration point, so it has a value.
            let Ok(material) = material else { continue };
            let stress = material.stress(&slope.strain());
            volume[node as usize] += measure;
            for (sum, stress) in sum[node as usize].iter_mut().zip(stress) {
                *sum += measure * stress;
            }
        }
    }
    for (sum, volume) in sum.iter_mut().zip(volume) {
        sum.iter_mut().for_each(|s| *s /= volume);
    }
    sum
}

/// Return the principal stresses of (xx yy zz xy yz xz), the largest first (tension is positive); NaN if the stress is not finite.
pub fn principal(s: &[f64; 6]) -> [f64; 3] {
    if s.iter().any(|s| !s.is_finite()) {
        return [f64::NAN; 3];
    }
    let [xx, yy, zz, xy, yz, xz] = *s;
    let values = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz).symmetric_eigenvalues();
    let mut sorted = [values[0], values[1], values[2]];
    sorted.sort_by(|a, b| b.total_cmp(a));
    sorted
}

/// Return the von Mises stress of (xx yy zz xy yz xz).
pub fn von_mises(s: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *s;
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariants_of_a_stress() {
        // The principal stresses are 7, 2, -3 along the rows of Q = I - 2 v v'/(v'v) with v = (1, 1, 1).
        let q = |i: usize, j: usize| f64::from(i == j) - 2.0 / 3.0;
        let values = [7.0, 2.0, -3.0];
        let s = |i: usize, j: usize| (0..3).map(|k| q(i, k) * values[k] * q(j, k)).sum::<f64>();
        let stress = [s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(0, 2)];
        let found = principal(&stress);
        assert!((0..3).all(|k| (found[k] - values[k]).abs() < 1e-14), "{found:?}");
        // The expected value is sqrt(((7-2)^2 + (2+3)^2 + (7+3)^2) / 2).
        assert!((von_mises(&stress) - 75f64.sqrt()).abs() < 1e-13);
        assert!(principal(&[f64::NAN; 6])[0].is_nan());
    }
}
