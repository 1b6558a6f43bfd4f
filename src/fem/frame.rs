//! Linear constraints on the nodes of a body. Its dofs v give the nodal displacements u = T v:
//!
//! ```text
//! u_i = sum_j C_ij v_j
//! ```
//!
//! with D x D blocks. Nodes without a row have u_i = v_i. There are rows of three kinds.
//!
//! - A support along an inclined direction turns the axes of its nodes, so that it prescribes one component there: u_i
//!   = Q' v_i. So does a contact, where unknowns are eliminated, so that its rows have one component there.
//! - A rigid surface ties its nodes to one of them, the master: u_i = u_A.
//! - The nodes of a rigid surface that turns move by u_i = u_A + theta x (x_i - x_A). The rotation has the dofs of a
//!   second node, the pole: v_P = L theta, with the distance L of the pole from the master. So v is a displacement like
//!   all other dofs, and with the farthest node as the pole no node moves by more than v. In the plane theta is the
//!   first dof, and the other one is zero.
//!
//! The dofs of tied nodes other than the pole must be prescribed as zero: they are what a displacement differs from the
//! constraint. In v every support is a prescribed dof, and the blocks of K keep their size. Dofs of a displacement are
//! asked for rigid motions alone, whose rotation is known, so that no inverse of T is needed.

use super::{cross, length, minus, pad};
use crate::exchange::Plain;
use crate::linalg::dot;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A row of blocks: for each node of the row its matrix.
pub type Combination<const D: usize> = Vec<(u32, SMatrix<f64, D, D>)>;

/// Return orthonormal axes of which the first ones are given.
pub fn completed<const D: usize>(mut axes: Vec<[f64; D]>) -> [[f64; D]; D] {
    for c in 0..D {
        let mut rest: [f64; D] = std::array::from_fn(|i| f64::from(u8::from(i == c)));
        for axis in &axes {
            let along = dot(&rest, axis);
            (0..D).for_each(|i| rest[i] -= along * axis[i]);
        }
        let size = dot(&rest, &rest).sqrt();
        // some coordinate axis is always this far from a smaller subspace
        if axes.len() < D && size > 0.5 {
            axes.push(rest.map(|r| r / size));
        }
    }
    std::array::from_fn(|i| axes[i])
}

/// Constraints of nodes, as rows of u = T v.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct Frame<const D: usize> {
    /// C: the dofs that move a node. The first entry of a tied node is that of its master, the entry of a turned node
    /// its own.
    moved: BTreeMap<u32, Combination<D>>,
    /// The pole of each rigid surface that turns, and its distance from the master.
    poles: BTreeMap<u32, f64>,
}

/// Return the position of a node in a sorted slice.
pub fn place(nodes: &[u32], node: u32) -> Option<u32> {
    nodes.binary_search(&node).ok().map(|place| place as u32)
}

impl<const D: usize> Frame<D> {
    /// Give a node orthonormal axes of its own: v_i = axis_i . u. If it is the master of others, `tied` are these.
    pub fn turn(&mut self, node: u32, axes: [[f64; D]; D], tied: &[u32]) {
        let turned = SMatrix::from_fn(|c, i| axes[i][c]);
        for &moved in tied.iter().chain([&node]) {
            self.moved.insert(moved, vec![(node, turned)]);
        }
    }

    /// Tie nodes to the first of them.
    pub fn tie(&mut self, nodes: &[u32]) {
        for &node in &nodes[1..] {
            self.moved.insert(node, vec![(nodes[0], SMatrix::identity())]);
        }
    }

    /// Let nodes that are tied to the first of them turn as one. `x` gives the place of a node. Return the pole.
    pub fn let_turn(&mut self, nodes: &[u32], x: impl Fn(u32) -> [f64; D]) -> u32 {
        let (master, tied) = (nodes[0], &nodes[1..]);
        let arm = |node: u32| minus(x(node), x(master));
        let distance = |node: u32| length(arm(node));
        let pole = tied.iter().copied().max_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(master);
        for &node in tied {
            let turning = rotation(arm(node), distance(pole));
            self.moved.insert(node, vec![(master, SMatrix::identity()), (pole, turning)]);
        }
        self.poles.insert(pole, distance(pole));
        pole
    }

    /// Return the force at the dofs of a pole that does the work of a moment (x, y, z) on the rotation.
    pub fn moment(&self, pole: u32, moment: [f64; 3]) -> [f64; D] {
        std::array::from_fn(|k| dot(&moment, &axis::<D>(k)) / self.poles[&pole])
    }

    /// Return whether no node has a row.
    pub fn is_empty(&self) -> bool {
        self.moved.is_empty()
    }

    /// Return the node whose dofs move a node as a translation: its master, or the node itself.
    pub fn node(&self, node: u32) -> u32 {
        self.moved.get(&node).map_or(node, |row| row[0].0)
    }

    /// Return the tied nodes.
    pub fn tied(&self) -> impl Iterator<Item = u32> + '_ {
        self.moved.iter().filter(|(node, row)| row[0].0 != **node).map(|(node, _)| *node)
    }

    /// Return the rotations of surfaces that turn, each as its pole and its master.
    pub fn poles(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.poles.keys().map(|&pole| [pole, self.node(pole)])
    }

    /// Return the row of a node in u = T v; it is empty if the node has none.
    pub fn row(&self, node: u32) -> &[(u32, SMatrix<f64, D, D>)] {
        self.moved.get(&node).map_or(&[], Vec::as_slice)
    }

    /// Return the nodes on which the displacements of others depend, in any order and with repetitions.
    pub fn leaders(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        self.moved.iter().flat_map(|(node, row)| row.iter().map(|entry| entry.0).filter(move |other| other != node))
    }

    /// Return the constraints of the sorted `nodes`, renumbered by their positions in this slice. It must contain the
    /// [`Frame::leaders`].
    pub fn on(&self, nodes: &[u32]) -> Self {
        let here = |node: &u32| place(nodes, *node);
        let entry = |(node, matrix): &(u32, SMatrix<f64, D, D>)| Some((here(node)?, *matrix));
        let row = |(node, row): (&u32, &Combination<D>)| Some((here(node)?, row.iter().filter_map(entry).collect()));
        Self {
            moved: self.moved.iter().filter_map(row).collect(),
            poles: self.poles.iter().filter_map(|(pole, size)| Some((here(pole)?, *size))).collect(),
        }
    }

    /// Return a force at a node, or the entries of a row of B, as forces at dofs: the nodes of these dofs and the
    /// components.
    pub fn force(&self, node: u32, force: [f64; D]) -> impl Iterator<Item = (u32, [f64; D])> {
        let row = self.row(node);
        let own = row.is_empty().then_some((node, force));
        own.into_iter().chain(row.iter().map(move |(to, matrix)| (*to, matrix.tr_mul(&SVector::from(force)).into())))
    }

    /// Replace nodal forces f by forces at dofs, T'f.
    pub fn forces(&self, f: &mut [f64]) {
        let take = |(&node, row): (&u32, &Combination<D>)| {
            let at = D * node as usize;
            let force = SVector::<f64, D>::from_fn(|c, _| std::mem::take(&mut f[at + c]));
            row.iter().map(move |(to, matrix)| (*to, matrix.tr_mul(&force))).collect::<Vec<_>>()
        };
        let moved: Vec<_> = self.moved.iter().flat_map(take).collect();
        for (node, force) in moved {
            (0..D).for_each(|c| f[D * node as usize + c] += force[c]);
        }
    }

    /// Replace numbers at nodes by their sums over the nodes that the dofs of a node move.
    pub fn sum(&self, per_node: &mut [f64]) {
        let taken: Vec<_> =
            self.moved.iter().map(|(&node, row)| (std::mem::take(&mut per_node[node as usize]), row)).collect();
        for (value, row) in taken {
            row.iter().for_each(|(to, _)| per_node[*to as usize] += value);
        }
    }

    /// Return the nodal displacements of dofs, u = T v.
    pub fn displacements(&self, v: &[f64]) -> Vec<f64> {
        let mut u = v.to_vec();
        for (&node, row) in &self.moved {
            let at = |node: &u32| SVector::<f64, D>::from_column_slice(&v[D * *node as usize..][..D]);
            let of_node: SVector<f64, D> = row.iter().map(|(node, matrix)| matrix * at(node)).sum();
            u[D * node as usize..][..D].copy_from_slice(of_node.as_slice());
        }
        u
    }

    /// Return the values at the dofs of a node in a rigid motion with the displacements `u` and this rotation vector.
    pub fn dofs(&self, node: u32, u: impl Fn(u32) -> [f64; D], rotation: [f64; 3]) -> [f64; D] {
        if let Some(size) = self.poles.get(&node) {
            return std::array::from_fn(|k| size * dot(&rotation, &axis::<D>(k)));
        }
        match self.row(node) {
            [] => u(node),
            [(own, turned)] if *own == node => turned.tr_mul(&SVector::from(u(node))).into(),
            [(master, _)] => minus(u(node), u(*master)),
            // a surface that turns follows any rigid motion
            _ => [0.0; D],
        }
    }

    /// Return the direction of the displacement that a dof of a node is, which is not tied.
    pub fn direction(&self, node: u32, component: usize) -> [f64; D] {
        match self.row(node) {
            [(own, turned)] if *own == node => turned.column(component).into_owned().into(),
            _ => std::array::from_fn(|c| f64::from(u8::from(c == component))),
        }
    }
}

/// Return the axis of rotation of a dof of the pole. It is zero for the second one in the plane.
fn axis<const D: usize>(dof: usize) -> [f64; 3] {
    let about = if D == 2 { dof + 2 } else { dof };
    std::array::from_fn(|c| if c == about { 1.0 } else { 0.0 })
}

/// Return the matrix R of a node at `arm` from the master, where the pole is at the distance `length`.
fn rotation<const D: usize>(arm: [f64; D], length: f64) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|c, dof| cross(axis::<D>(dof), pad(arm))[c] / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_do_the_same_work_in_both_coordinates() {
        let (s, c) = (0.6, 0.8);
        let mut frame = Frame::<2>::default();
        frame.tie(&[2, 0, 3]);
        frame.turn(1, [[c, s], [-s, c]], &[]);
        frame.turn(2, [[s, c], [c, -s]], &[0, 3]);
        let v = [0.0, 0.0, 0.3, -0.7, 1.1, 0.4, 0.0, 0.0, 5.0, 6.0];
        let u = frame.displacements(&v);
        assert_eq!(u[0..2], u[4..6]);
        assert!((u[2] - (c * 0.3 + s * 0.7)).abs() < 1e-15 && u[8..] == v[8..]);
        let mut f = [1.0, 2.0, 3.0, -4.0, 5.0, 6.0, -7.0, 8.0, 9.0, 1.0];
        let work = dot(&f, &u);
        frame.forces(&mut f);
        assert!((dot(&f, &v) - work).abs() < 1e-13);
        assert_eq!(frame.force(3, [0.0, 5.0]).collect::<Vec<_>>(), [(2, [4.0, -3.0])]);
    }
}
