//! Internal forces and strain energies of displacements, cell by cell, without a matrix.
//!
//! They check the results of solvers that use assembled matrices. Therefore they share with assembly only shape functions, quadrature
//! and Hooke's law.

use super::elasticity::Elasticity;
use super::material::Material;
use super::space::Space;
use super::{assemble, element};
use crate::linalg::dot;

/// The internal forces of the cells of a body on its nodes, and the scales that these forces are compared with.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Internal {
    /// K u, one entry a dof.
    pub force: Vec<f64>,
    /// Bound of the rounding errors in `force`, one entry a node.
    pub rounding: Vec<f64>,
    /// Bound of the diagonal entries of K, one entry a node.
    pub diagonal: Vec<f64>,
    /// Integral of the norm of Hooke's law, shared among the nodes of each cell, one entry a node.
    pub bulk: Vec<f64>,
}

/// An integration point of a cell, as [`visit`] presents it.
struct Point<'a, const D: usize> {
    /// Nodes of the cell.
    cell: &'a [u32],
    at: [f64; D],
    /// Values of the shape functions.
    phi: [f64; element::MOST],
    /// Gradients of the shape functions.
    gradient: &'a [[f64; D]],
    /// Weight of the point in an integral over the body.
    weight: f64,
    material: Material,
}

/// Visit the integration points of some cells, which are those of [`assemble::stiffness`]. A cell that cannot be integrated is skipped,
/// since assembly has already failed on it.
fn visit<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    cells: impl Iterator<Item = usize>,
    mut each: impl FnMut(Point<D>),
) {
    let rules = assemble::Rules::new::<D>(space.order);
    let stride = space.stride;
    let mut x = vec![[0.0; D]; stride];
    for index in cells {
        let cell = space.cell(index);
        x.iter_mut().zip(cell).for_each(|(x, &node)| *x = space.nodes[node as usize]);
        let constant = elasticity.constant_in(index);
        for (l, weight) in rules.of(&x, constant.is_some(), space.axisymmetric).iter() {
            let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
            let phi = element::values(space.order, l);
            let at = assemble::interpolate(&x, &phi);
            let material = match constant {
                Some(material) => *material,
                None => match elasticity.at(index, space.in_scene(at)) {
                    Ok(material) => material,
                    Err(_) => continue,
                },
            };
            let weight = weight * measure * space.circle(&at);
            each(Point { cell, at, phi, gradient: &gradient[..stride], weight, material });
        }
    }
}

/// Return the internal forces of some cells for a displacement `u`, one entry a dof. They are complete at nodes all of whose cells are
/// visited.
///
/// A force is a sum over stresses, each stress is a sum over strains, and each strain is a sum over displacements. A sum of n terms has a
/// rounding error of at most n eps times the sum of their sizes. The bound is therefore eps times the lengths of all three sums times
/// the sizes.
pub fn forces<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    cells: impl Iterator<Item = usize>,
    u: &[f64],
) -> Internal {
    let count = space.nodes.len();
    let zero = || vec![0.0; count];
    let mut sums = Internal { force: vec![0.0; D * count], rounding: zero(), diagonal: zero(), bulk: zero() };
    let mut terms = zero();
    visit(space, elasticity, cells, |point: Point<D>| {
        point.cell.iter().for_each(|&node| terms[node as usize] += 1.0);
        sums.add(space, &point, u);
    });
    // A strain has D * stride terms, a stress has six, and a force has D for each integration point.
    let inner = (D * space.stride + 6 + D) as f64;
    sums.rounding.iter_mut().zip(terms).for_each(|(rounding, terms)| *rounding *= f64::EPSILON * (inner + terms));
    sums
}

impl Internal {
    /// Add the forces and bounds of an integration point; `rounding` is still without the factor of eps and the lengths of sums.
    fn add<const D: usize>(&mut self, space: &Space<D>, point: &Point<D>, u: &[f64]) {
        let Point { cell, at, phi, gradient, weight, material } = point;
        let size = |v: &[f64]| v.iter().map(|v| v.abs()).sum::<f64>();
        let stress = material.stress(&space.slope(cell, at, phi, gradient, u).strain());
        let stiffness = weight * material.norm();
        let slope = |a: usize| size(&gradient[a]) + space.hoop(at, phi[a]).abs();
        let size_of_strain = |(a, &node): (usize, &u32)| slope(a) * size(&u[D * node as usize..][..D]);
        let strains: f64 = cell.iter().enumerate().map(size_of_strain).sum();
        for (a, &node) in cell.iter().enumerate() {
            let node = node as usize;
            let force = nodal_force(&stress, &gradient[a], space.hoop(at, phi[a]));
            (0..D).for_each(|c| self.force[D * node + c] += weight * force[c]);
            self.rounding[node] += stiffness * slope(a) * strains;
            self.diagonal[node] += stiffness * slope(a).powi(2);
            self.bulk[node] += stiffness / space.stride as f64;
        }
    }
}

/// Return the force of a stress on the node of a shape function with this gradient. In a body of revolution `hoop` is the function over
/// the radius, in other bodies zero.
fn nodal_force<const D: usize>(stress: &[f64; 6], gradient: &[f64; D], hoop: f64) -> [f64; D] {
    const COMPONENT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
    let mut force = std::array::from_fn(|c| (0..D).map(|j| stress[COMPONENT[c][j]] * gradient[j]).sum());
    force[0] += stress[2] * hoop;
    force
}

/// Return the products v_i'K v_j of n displacements, with one entry a dof each, over some cells: an n x n matrix by rows.
pub fn products<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    cells: impl Iterator<Item = usize>,
    fields: &[Vec<f64>],
) -> Vec<f64> {
    let n = fields.len();
    let mut products = vec![0.0; n * n];
    visit(space, elasticity, cells, |Point { cell, at, phi, gradient, weight, material }: Point<D>| {
        let strain = |u: &Vec<f64>| space.slope(cell, &at, &phi, gradient, u).strain();
        let strains: Vec<[f64; 6]> = fields.iter().map(strain).collect();
        for (i, strain) in strains.iter().enumerate() {
            let stress = material.stress(strain);
            (0..n).for_each(|j| products[n * i + j] += weight * dot(&stress, &strains[j]));
        }
    });
    products
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::sample::block;
    use crate::fem::{Frame, NodeGraph};
    use crate::problem::{BodySpec, Order, Plane};

    /// Check that the assembled matrix gives the same forces, and that its entries lie below the bounds.
    fn same_as_matrix<const D: usize>(order: Order, plane: Plane) {
        let mut space = block::<D>(2, order);
        space.axisymmetric = plane == Plane::Axisymmetric;
        space.nodes.iter_mut().for_each(|x| x[0] += 1.0);
        let spec = BodySpec::new("block", 3.0, 0.3).elasticity;
        let elasticity = Elasticity::new(&[&spec], Vec::new(), D, plane).expect("a material");
        let graph = NodeGraph::new(&space, &[], &Frame::default());
        let matrix = assemble::stiffness(&space, &graph, &Frame::default(), &elasticity).expect("a matrix");
        let u: Vec<f64> = (0..space.dofs()).map(|i| (i as f64 * 0.7).sin()).collect();
        let v: Vec<f64> = (0..space.dofs()).map(|i| (i as f64 * 0.3).cos()).collect();
        let mut expected = vec![0.0; u.len()];
        matrix.multiply(&u, &mut expected);
        let found = forces(&space, &elasticity, 0..space.cell_count(), &u);
        for (i, (force, expected)) in found.force.iter().zip(&expected).enumerate() {
            assert!((force - expected).abs() <= 2.0 * found.rounding[i / D], "{i}: {force} {expected}");
            assert!(matrix.diagonal(i) <= found.diagonal[i / D] && found.rounding[i / D] < 1e-8);
        }
        let fields = [u, v];
        let products = products(&space, &elasticity, 0..space.cell_count(), &fields);
        for (j, field) in fields.iter().enumerate() {
            assert!((products[j] - dot(&expected, field)).abs() < 1e-12 * products[0]);
        }
        assert!((products[1] - products[2]).abs() < 1e-12 * products[0]);
    }

    #[test]
    fn internal_forces_are_those_of_the_matrix() {
        for order in [Order::P1, Order::P2] {
            for plane in [Plane::Strain, Plane::Stress, Plane::Axisymmetric] {
                same_as_matrix::<2>(order, plane);
            }
            same_as_matrix::<3>(order, Plane::Strain);
        }
    }
}
