//! Linear constraints on the nodes of a body. Its dofs v give the nodal displacements u = T v:
//!
//! ```text
//! u_i = sum_j C_ij v_j        v_i = sum_j D_ij u_j
//! ```
//!
//! with D x D blocks. Nodes without a row have u_i = v_i. There are rows of three kinds.
//!
//! - A support along an inclined direction turns the axes of its nodes, so that it prescribes one component there: u_i
//!   = Q' v_i.
//! - A rigid surface ties its nodes to one of them, the master: u_i = u_A.
//! - The nodes of a rigid surface that turns move by u_i = u_A + theta x (x_i - x_A). The rotation has the dofs of a
//!   second node, the pole: v_P = L theta, with the distance L of the pole from the master. So v is a displacement like
//!   all other dofs, and with the farthest node as the pole no node moves by more than v. In the plane theta is the
//!   first dof, and the other one is zero.
//!
//! The dofs of tied nodes other than the pole must be prescribed as zero. By the second formula they are what a
//! displacement differs from the constraint. In v every support is a prescribed dof, and the blocks of K keep their
//! size.

use super::{cross, length, minus, pad, unit};
use crate::exchange::Plain;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A row of blocks: for each node of the row its matrix.
pub type Row<const D: usize> = Vec<(u32, SMatrix<f64, D, D>)>;

/// Constraints of nodes, as rows of u = T v and of the inverse map.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct Frame<const D: usize> {
    /// C: the dofs that move a node. The first entry of a tied node is that of its master, the entry of a turned node
    /// its own.
    moved: BTreeMap<u32, Row<D>>,
    /// D: the displacements that give the dofs of a node.
    given: BTreeMap<u32, Row<D>>,
}

/// Return the position of a node in a sorted slice.
pub fn place(nodes: &[u32], node: u32) -> Option<u32> {
    nodes.binary_search(&node).ok().map(|place| place as u32)
}

impl<const D: usize> Frame<D> {
    /// Give a node orthonormal axes of its own: v_i = axis_i . u. If it is the master of others, `tied` are these.
    pub fn turn(&mut self, node: u32, axes: [[f64; D]; D], tied: &[u32]) {
        let turned = SMatrix::from_fn(|i, c| axes[i][c]);
        self.given.insert(node, vec![(node, turned)]);
        for &moved in tied.iter().chain([&node]) {
            self.moved.insert(moved, vec![(node, turned.transpose())]);
        }
    }

    /// Tie nodes to the first of them.
    pub fn tie(&mut self, nodes: &[u32]) {
        let (one, master) = (SMatrix::identity(), nodes[0]);
        for &node in &nodes[1..] {
            self.moved.insert(node, vec![(master, one)]);
            self.given.insert(node, vec![(node, one), (master, -one)]);
        }
    }

    /// Let nodes that are tied to the first of them turn as one. `x` gives the place of a node. In space they must not
    /// lie on one line. Return the pole.
    pub fn let_turn(&mut self, nodes: &[u32], x: impl Fn(u32) -> [f64; D]) -> u32 {
        let (one, master, tied) = (SMatrix::identity(), nodes[0], &nodes[1..]);
        let arm = |node: u32| minus(x(node), x(master));
        let farthest = |distance: &dyn Fn(u32) -> f64| {
            tied.iter().copied().max_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(master)
        };
        let pole = farthest(&|node| length(arm(node)));
        let along = pad(unit(arm(pole)));
        let third = farthest(&|node| length(cross(along, pad(arm(node)))));
        let turning = |node: u32| rotation(arm(node), length(arm(pole)));
        // the rotation of two nodes (in the plane of one) by least squares; in the plane the second dof does not move
        // anything
        let used = if D == 2 { vec![pole] } else { vec![pole, third] };
        let mut normal: SMatrix<f64, D, D> = used.iter().map(|&node| turning(node).transpose() * turning(node)).sum();
        if D == 2 {
            normal[(1, 1)] = 1.0;
        }
        let inverse = normal.cholesky().map(|factor| factor.inverse()).unwrap_or(SMatrix::repeat(f64::NAN));
        let weights: Row<D> = used.iter().map(|&node| (node, inverse * turning(node).transpose())).collect();
        let of_master: SMatrix<f64, D, D> = weights.iter().map(|(_, weight)| -weight).sum();
        let rotated: Row<D> = weights.into_iter().chain([(master, of_master)]).collect();
        for &node in tied {
            let matrix = turning(node);
            self.moved.insert(node, vec![(master, one), (pole, matrix)]);
            let rest = rotated.iter().map(|(other, weight)| (*other, -matrix * weight));
            self.given.insert(node, summed([(node, one), (master, -one)].into_iter().chain(rest)));
        }
        self.given.insert(pole, rotated);
        pole
    }

    /// Return nodal forces that do the work of a moment (x, y, z) on the rotation of the surface with this master and
    /// pole. `x` gives the place of a node. Without rounding their sum is zero.
    pub fn couple(
        &self,
        [master, pole]: [u32; 2],
        moment: [f64; 3],
        x: impl Fn(u32) -> [f64; D],
    ) -> Vec<(u32, [f64; D])> {
        let size = length(minus(x(pole), x(master)));
        let at_pole = SVector::<f64, D>::from_fn(|k, _| crate::linalg::dot(&moment, &axis::<D>(k)) / size);
        let row = self.given.get(&pole).map_or(&[][..], Vec::as_slice);
        let mut forces: Vec<(u32, [f64; D])> = row
            .iter()
            .filter(|entry| entry.0 != master)
            .map(|(node, weight)| (*node, weight.tr_mul(&at_pole).into()))
            .collect();
        // the sum is zero to the last digit
        let opposite = forces.iter().fold([0.0; D], |sum, entry| minus(sum, entry.1));
        forces.push((master, opposite));
        forces
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
        let pole = |(&node, row): (&u32, &Row<D>)| (row.len() > 1 && row[1].0 == node).then(|| [node, row[0].0]);
        self.moved.iter().filter_map(pole)
    }

    /// Return the row of a node in u = T v; it is empty if the node has none.
    pub fn row(&self, node: u32) -> &[(u32, SMatrix<f64, D, D>)] {
        self.moved.get(&node).map_or(&[], Vec::as_slice)
    }

    /// Return the nodes on which the displacements or dofs of others depend, in any order and with repetitions.
    pub fn leaders(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        let rows = self.moved.iter().chain(&self.given);
        rows.flat_map(|(node, row)| row.iter().map(|entry| entry.0).filter(move |other| other != node))
    }

    /// Return the constraints of the sorted `nodes`, renumbered by their positions in this slice. It must contain the
    /// [`Frame::leaders`].
    pub fn on(&self, nodes: &[u32]) -> Self {
        let on = |rows: &BTreeMap<u32, Row<D>>| {
            let entry = |(node, matrix): &(u32, SMatrix<f64, D, D>)| Some((place(nodes, *node)?, *matrix));
            rows.iter()
                .filter_map(|(node, row)| Some((place(nodes, *node)?, row.iter().filter_map(entry).collect())))
                .collect()
        };
        Self { moved: on(&self.moved), given: on(&self.given) }
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
        let take = |(&node, row): (&u32, &Row<D>)| {
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

    /// Return the dofs of nodal displacements, v = T^-1 u.
    pub fn dofs(&self, u: &[f64]) -> Vec<f64> {
        apply(&self.given, u)
    }

    /// Return the nodal displacements of dofs, u = T v.
    pub fn displacements(&self, v: &[f64]) -> Vec<f64> {
        apply(&self.moved, v)
    }

    /// Return the value at a dof of a field with the nodal displacements `u`.
    pub fn dof(&self, dof: usize, u: impl Fn(u32) -> [f64; D]) -> f64 {
        self.at((dof / D) as u32, u)[dof % D]
    }

    /// Return the values at the dofs of a node of a field with the nodal displacements `u`.
    pub fn at(&self, node: u32, u: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        match self.given.get(&node) {
            None => u(node),
            Some(row) => product(row, |node| SVector::from(u(node))).into(),
        }
    }

    /// Return the row of D of a dof that is not tied: the direction of the displacement that it is.
    pub fn direction(&self, node: u32, component: usize) -> [f64; D] {
        match self.given.get(&node) {
            Some(row) => row[0].1.row(component).transpose().into(),
            None => std::array::from_fn(|c| f64::from(u8::from(c == component))),
        }
    }
}

/// Return the product of a row of blocks with the vectors at its nodes.
fn product<const D: usize>(row: &Row<D>, x: impl Fn(u32) -> SVector<f64, D>) -> SVector<f64, D> {
    row.iter().map(|(node, matrix)| matrix * x(*node)).sum()
}

/// Return the product of rows of blocks with the vectors at all nodes. Nodes without a row keep their vectors.
fn apply<const D: usize>(rows: &BTreeMap<u32, Row<D>>, x: &[f64]) -> Vec<f64> {
    let mut y = x.to_vec();
    for (&node, row) in rows {
        let of_node = product(row, |node| SVector::from_fn(|c, _| x[D * node as usize + c]));
        y[D * node as usize..][..D].copy_from_slice(of_node.as_slice());
    }
    y
}

/// Add the matrices of nodes that occur several times.
fn summed<const D: usize>(entries: impl Iterator<Item = (u32, SMatrix<f64, D, D>)>) -> Row<D> {
    let mut row: Row<D> = Vec::new();
    for (node, matrix) in entries {
        match row.iter_mut().find(|entry| entry.0 == node) {
            Some(entry) => entry.1 += matrix,
            None => row.push((node, matrix)),
        }
    }
    row
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
    use crate::linalg::dot;

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
        let back = frame.dofs(&u);
        assert!(back.iter().zip(&v).all(|(a, b)| (a - b).abs() < 1e-15), "{back:?}");
        let mut f = [1.0, 2.0, 3.0, -4.0, 5.0, 6.0, -7.0, 8.0, 9.0, 1.0];
        let work = dot(&f, &u);
        frame.forces(&mut f);
        assert!((dot(&f, &v) - work).abs() < 1e-13);
        assert_eq!(frame.force(3, [0.0, 5.0]).collect::<Vec<_>>(), [(2, [4.0, -3.0])]);
    }
}
