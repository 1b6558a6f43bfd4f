//! Rigid surfaces that turn: the displacement of their nodes follows from that of one node and a rotation.
//!
//! The nodes i of such a surface move by u_i = u_A + theta x (x_i - x_A), where A is the master. The rotation has the dofs of a second
//! node, the pole: v = L theta, with the distance L of the pole from the master. So v is a displacement like all other dofs, and with
//! the farthest node as the pole no node moves by more than v. In the plane theta is the first dof, and the other one is zero.

use super::{cross, length, minus, pad, unit};
use crate::exchange::Plain;
use crate::linalg::dot;
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The levers of a rigid surface that turns.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct Levers<const D: usize> {
    /// Node whose dofs v are those of the rotation.
    pub pole: u32,
    /// Matrix R of each tied node, also of the pole: the rotation moves the node by R v.
    pub matrix: BTreeMap<u32, [[f64; D]; D]>,
    /// Weights G of a few tied nodes, which give the rotation of a rigid displacement: v is the sum of G (u - u_master).
    pub weights: BTreeMap<u32, [[f64; D]; D]>,
    /// Distance L of the pole from the master.
    length: f64,
    /// Vector from the master to the centre of the surface.
    arm: [f64; D],
}

/// The rotation that moves a node.
#[derive(Clone, Copy)]
pub struct Rotation<'a, const D: usize> {
    /// Node whose dofs v are the rotation.
    pub pole: u32,
    /// Matrix R: the displacement of the node has the summand R v.
    pub matrix: &'a [[f64; D]; D],
}

impl<const D: usize> Rotation<'_, D> {
    /// Return a force at the node as a force R'f at the dofs of the rotation.
    pub fn turning(&self, force: [f64; D]) -> [f64; D] {
        times_transposed(self.matrix, force)
    }
}

impl<const D: usize> Levers<D> {
    /// Make the levers of a surface with these `nodes`, the first of which is its master. `x` gives the place of a node. The nodes of a
    /// surface in space must not lie on one line.
    pub fn new(nodes: &[u32], x: impl Fn(u32) -> [f64; D], centre: [f64; D]) -> Self {
        let (master, tied) = (nodes[0], &nodes[1..]);
        let arm = |node: u32| minus(x(node), x(master));
        let farthest = |distance: &dyn Fn(u32) -> f64| {
            tied.iter().copied().max_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(master)
        };
        let pole = farthest(&|node| length(arm(node)));
        let size = length(arm(pole));
        let along = pad(unit(arm(pole)));
        let third = farthest(&|node| length(cross(along, pad(arm(node)))));
        let matrix: BTreeMap<u32, _> = tied.iter().map(|&node| (node, rotation(arm(node), size))).collect();
        let used = if D == 2 { vec![pole] } else { vec![pole, third] };
        let of_node = |node: &u32| SMatrix::<f64, D, D>::from_fn(|i, j| matrix[node][i][j]);
        // Least squares; in the plane the second dof does not move anything.
        let mut normal: SMatrix<f64, D, D> = used.iter().map(|node| of_node(node).transpose() * of_node(node)).sum();
        if D == 2 {
            normal[(1, 1)] = 1.0;
        }
        let inverse = normal.cholesky().map(|factor| factor.inverse()).unwrap_or(SMatrix::repeat(f64::NAN));
        let weight = |node: &u32| {
            let weight = inverse * of_node(node).transpose();
            (*node, std::array::from_fn(|i| std::array::from_fn(|j| weight[(i, j)])))
        };
        Self { pole, weights: used.iter().map(weight).collect(), matrix, length: size, arm: minus(centre, x(master)) }
    }

    /// Return the levers with other numbers of nodes. Tied nodes without a number are left out; the result is `None` if the pole has
    /// no number, or a node with weights.
    pub fn renumbered(&self, number: impl Fn(&u32) -> Option<u32>) -> Option<Self> {
        let matrix = self.matrix.iter().filter_map(|(node, matrix)| Some((number(node)?, *matrix)));
        let weights = self.weights.iter().map(|(node, weight)| Some((number(node)?, *weight)));
        Some(Self {
            pole: number(&self.pole)?,
            matrix: matrix.collect(),
            weights: weights.collect::<Option<_>>()?,
            ..*self
        })
    }

    /// Return the rotation that moves a node, if it is a tied node of the surface.
    pub fn rotation_of(&self, node: u32) -> Option<Rotation<'_, D>> {
        self.matrix.get(&node).map(|matrix| Rotation { pole: self.pole, matrix })
    }

    /// Return nodal forces, given by `force`, as a force at the dofs of the rotation.
    pub fn turning(&self, force: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        self.matrix.iter().map(|(&node, matrix)| times_transposed(matrix, force(node))).fold([0.0; D], plus)
    }

    /// Return the dofs v of the rotation of a rigid displacement. `relative` is the displacement of a node relative to the master.
    pub fn dofs(&self, relative: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        let of_node = |(node, weight): (&u32, &[[f64; D]; D])| times(weight, relative(*node));
        self.weights.iter().map(of_node).fold([0.0; D], plus)
    }

    /// Return the displacement of a node by the rotation with the dofs v.
    pub fn displacement(&self, node: u32, v: [f64; D]) -> [f64; D] {
        self.matrix.get(&node).map_or([0.0; D], |matrix| times(matrix, v))
    }

    /// Return nodal forces with the total `force` that acts at the centre and the `moment` (x, y, z) about the centre. `master` is the
    /// master of the surface.
    pub fn forces(&self, master: u32, force: [f64; D], moment: [f64; 3]) -> Vec<(u32, [f64; D])> {
        let about_master = cross(pad(self.arm), pad(force));
        let moment: [f64; 3] = std::array::from_fn(|c| moment[c] + about_master[c]);
        let at_pole = std::array::from_fn(|k| dot(&moment, &axis::<D>(k)) / self.length);
        let couple = |(node, weight): (&u32, &[[f64; D]; D])| (*node, times_transposed(weight, at_pole));
        let mut forces: Vec<_> = self.weights.iter().map(couple).collect();
        // The force of the couple at the master is last, so that without a total force the sum is zero to the last digit.
        let opposite = forces.iter().fold([0.0; D], |sum, entry| minus(sum, entry.1));
        forces.extend([(master, opposite), (master, force)]);
        forces
    }
}

/// Return the axis of rotation of a dof of the pole. It is zero for the second one in the plane.
fn axis<const D: usize>(dof: usize) -> [f64; 3] {
    let about = if D == 2 { dof + 2 } else { dof };
    std::array::from_fn(|c| if c == about { 1.0 } else { 0.0 })
}

/// Return the matrix R of a node at `arm` from the master, where the pole is at the distance `length`.
fn rotation<const D: usize>(arm: [f64; D], length: f64) -> [[f64; D]; D] {
    let columns: [[f64; 3]; D] = std::array::from_fn(|dof| cross(axis::<D>(dof), pad(arm)));
    std::array::from_fn(|c| columns.map(|column| column[c] / length))
}

/// Return the sum of two vectors.
fn plus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// Return the product of a matrix and a vector.
fn times<const D: usize>(matrix: &[[f64; D]; D], v: [f64; D]) -> [f64; D] {
    matrix.map(|row| dot(&row, &v))
}

/// Return the product of a transposed matrix and a vector.
fn times_transposed<const D: usize>(matrix: &[[f64; D]; D], v: [f64; D]) -> [f64; D] {
    std::array::from_fn(|j| (0..D).map(|i| matrix[i][j] * v[i]).sum())
}
