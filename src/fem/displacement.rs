//! What follows from the displacement of a body: stresses, strains, and its error against a known one.

use super::elasticity::Elasticity;
use super::element::{self, Rule};
use super::space::{CellPoint, Slope, Space};
use crate::linalg::dot;
use crate::problem::order::Order;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Return the stress (xx yy zz xy yz xz) at every node: the mean of the stresses that the cells around the node have
/// there, weighted by their measures. In bodies of revolution zz is the stress along the circles.
///
/// `u` has one entry a dof. The nodes of the space are cut apart where the material jumps ([`Split`](super::Split)), so
/// that a mean is over cells of one material. Where the elasticity has no value at a node, as on the axis of
/// cylindrical axes, that of an integration point of the cell is used.
pub fn nodal_stresses<const D: usize>(space: &Space<D>, elasticity: &Elasticity, u: &[f64]) -> Vec<[f64; 6]> {
    let mut sum = vec![[0.0; 6]; space.nodes.len()];
    let mut volume = vec![0.0; space.nodes.len()];
    let nodes = Rule::at_nodes(space.order, D + 1);
    for index in 0..space.cell_count() {
        for (point, &node) in space.points(index, &nodes).zip(space.cell(index)) {
            let Some((measure, stress)) = point.and_then(|at| stress_at(space, elasticity, u, index, &at)) else {
                continue;
            };
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

/// Return the stress of a cell at barycentric coordinates `l`, after its measure per share; none where it has no value.
fn stress_in_cell<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    u: &[f64],
    index: usize,
    l: &[f64],
) -> Option<(f64, [f64; 6])> {
    stress_at(space, elasticity, u, index, &space.point(index, &space.cell_nodes(index), l, 1.0)?)
}

/// Return the stress at a point of a cell, after the measure of the cell per share there; none where it has no value.
fn stress_at<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    u: &[f64],
    index: usize,
    point: &CellPoint<D>,
) -> Option<(f64, [f64; 6])> {
    let inside = || {
        let rule = element::rule(D + 1, if space.order == Order::P1 { 2 } else { 5 });
        element::interpolate(&space.cell_nodes(index), &element::values(space.order, &rule.points[0]))
    };
    let strain = point.slope(u).strain();
    let stress = |at: [f64; D]| elasticity.stress(index, space.in_scene(at), &strain);
    // Assembly has evaluated the integration point, so it has a value.
    Some((point.measure, stress(point.at).or_else(|_| stress(inside())).ok()?))
}

/// Return by how much the stress changes from a node, where it is `stress`, to the middles of the cells around the
/// node: the largest von Mises stress of the differences, relative to that at the node. It is about the relative error
/// of the stress at the node with linear elements, and the square of it with quadratic ones, where it is small.
pub fn change_within_cells<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    u: &[f64],
    node: u32,
    stress: &[f64; 6],
) -> f64 {
    let middle = [1.0 / (D + 1) as f64; 4];
    let around = (0..space.cell_count()).filter(|&index| space.cell(index).contains(&node));
    let inside = around.filter_map(|index| stress_in_cell(space, elasticity, u, index, &middle[..=D]));
    let change = |(_, s): (f64, [f64; 6])| von_mises(&std::array::from_fn(|c| s[c] - stress[c]));
    inside.map(change).fold(0.0, f64::max) / von_mises(stress)
}

/// Return the principal stresses of (xx yy zz xy yz xz), the largest first (tension is positive); NaN if the stress is
/// not finite.
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

/// Largest strain that counts as small. The strain e of linear theory differs there by 1.5 per cent from Green's strain
/// e + e^2/2 and from the logarithmic strain e - e^2/2. This is no more than the uncertainty of moduli.
pub const SMALL: f64 = 0.03;

/// The largest strain in some cells of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Strained {
    /// Largest principal strain in absolute value, at the centres of cells.
    pub most: f64,
    /// Centre of the cell with this strain (x, y, z) in the scene.
    pub at: [f64; 3],
    /// Measure (area or volume) of the cells with more than [`SMALL`], and of all cells.
    pub measure: [f64; 2],
}

impl Strained {
    /// The value for no cells.
    pub const NONE: Self = Self { most: 0.0, at: [0.0; 3], measure: [0.0; 2] };

    /// Return the largest strain in the cells of both values.
    pub fn with(self, other: Self) -> Self {
        let larger = if other.most > self.most { other } else { self };
        Self { measure: std::array::from_fn(|k| self.measure[k] + other.measure[k]), ..larger }
    }
}

/// Return the integral over some cells of the rotation vector (x, y, z) of the displacement `u`, one entry a dof. It is
/// zero in a body of revolution, which does not turn.
pub fn rotation<const D: usize>(space: &Space<D>, cells: impl Iterator<Item = usize>, u: &[f64]) -> [f64; 3] {
    let centre = [1.0 / (D + 1) as f64; 4];
    let mut sum = [0.0; 3];
    for index in cells.filter(|_| !space.axisymmetric) {
        let Some(point) = space.point(index, &space.cell_nodes(index), &centre[..=D], 1.0) else { continue };
        let h = point.slope(u).h;
        for (axis, sum) in sum.iter_mut().enumerate() {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += if i < D && j < D { 0.5 * point.weight * (h[j][i] - h[i][j]) } else { 0.0 };
        }
    }
    sum
}

/// Return the largest strain at the centres of some cells of a space for the displacement `u`, one entry a dof.
///
/// At its centre a linear element has its mean strain. The value at a singular corner is therefore that of a cell and
/// is not extrapolated to the corner. The norm of a strain is no less than its largest principal strain, so that few
/// cells need the latter.
pub fn largest_strain<const D: usize>(space: &Space<D>, cells: impl Iterator<Item = usize>, u: &[f64]) -> Strained {
    let centre = [1.0 / (D + 1) as f64; 4];
    let mut found = Strained::NONE;
    for index in cells {
        let Some(point) = space.point(index, &space.cell_nodes(index), &centre[..=D], 1.0) else { continue };
        let strain = point.slope(u).strain();
        found.measure[1] += point.weight;
        if norm(&strain) <= found.most.min(SMALL) {
            continue;
        }
        let principal = largest_principal(&strain);
        found.measure[0] += if principal > SMALL { point.weight } else { 0.0 };
        if principal > found.most {
            (found.most, found.at) = (principal, space.in_scene(point.at));
        }
    }
    found
}

/// Return the root of the sum of the squares of the tensor's nine components. `strain` holds twice each shear strain,
/// which occurs two times in the tensor.
fn norm(strain: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *strain;
    (xx * xx + yy * yy + zz * zz + 0.5 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

/// Return the largest principal strain in absolute value.
fn largest_principal(strain: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *strain;
    let [first, _, last] = principal(&[xx, yy, zz, 0.5 * xy, 0.5 * yz, 0.5 * xz]);
    first.abs().max(last.abs())
}

/// Return the norms of u_h - u and of u, in this order, over some cells of a space, by a rule exact to degree five, or
/// that of products of two displacements and one more. They are roots of integrals:
///
/// - the L2 norm, of u.u,
/// - the H1 seminorm, of grad u : grad u, plus (u_r/r)^2 in bodies of revolution,
/// - the energy norm, of eps : C eps with the strain eps of u, without the initial strain.
///
/// The argument `u` is the finite element displacement u_h, one entry a dof, and `exact` gives the components u_i of
/// the known displacement and their derivatives du_i/dx_j. Points without elasticity, which assembly refuses, count
/// without energy. The norms are NaN where `exact` is not finite.
pub fn norms_of_error<const D: usize>(
    space: &Space<D>,
    cells: impl Iterator<Item = usize>,
    elasticity: &Elasticity,
    u: &[f64],
    exact: &dyn Fn([f64; D]) -> ([f64; D], [[f64; D]; D]),
) -> [[f64; 3]; 2] {
    let rule = element::rule_of_products(D + 1, space.order.max(Order::P2)).with_shapes(space.order);
    let mut squares = [[0.0; 3]; 2];
    for index in cells {
        for point in space.points(index, &rule).flatten() {
            let (known, gradient) = exact(point.at);
            let value = point.value(u);
            let exact_slope = Slope { h: gradient, hoop: space.hoop(&point.at, known[0]) };
            let mut difference = point.slope(u);
            difference.add(-1.0, &exact_slope);
            let error = std::array::from_fn(|i| value[i] - known[i]);
            let material = elasticity.at(index, space.in_scene(point.at)).ok();
            let initial = elasticity.initial_strain(index, space.in_scene(point.at)).unwrap_or_default();
            let of_both = [(error, difference, [0.0; 6]), (known, exact_slope, initial)];
            for (sum, (value, slope, initial)) in squares.iter_mut().zip(of_both) {
                let strain = slope.strain();
                let strain = std::array::from_fn(|i| strain[i] - initial[i]);
                let stress = material.map_or([0.0; 6], |material| material.stress(&strain));
                let integrands = [value.iter().map(|v| v * v).sum::<f64>(), slope.square(), dot(&stress, &strain)];
                (0..3).for_each(|k| sum[k] += point.weight * integrands[k]);
            }
        }
    }
    squares.map(|sum| sum.map(f64::sqrt))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;

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

    /// A shear of 0.08 in the upper half of a cube has principal strains of 0.04 and -0.04, whatever the elements.
    #[test]
    fn half_a_cube_is_sheared() {
        for order in [Order::P1, Order::P2] {
            let space = block::<3>(2, order);
            let u: Vec<f64> = space.nodes.iter().flat_map(|x| [0.08 * (x[2] - 0.5).max(0.0), 0.0, 0.0]).collect();
            let found = largest_strain(&space, 0..space.cell_count(), &u);
            assert!((found.most - 0.04).abs() < 1e-12 && found.at[2] > 0.5, "{found:?}");
            assert!((found.measure[0] / found.measure[1] - 0.5).abs() < 1e-12, "{found:?}");
            let lower = |cell: &usize| space.cell_nodes(*cell)[..4].iter().all(|x| x[2] < 0.6);
            let still = largest_strain(&space, (0..space.cell_count()).filter(lower), &u);
            assert_eq!((still.most, still.measure[0]), (0.0, 0.0));
            let both = still.with(found);
            assert_eq!((both.most, both.measure[0]), (found.most, found.measure[0]));
        }
    }
}
