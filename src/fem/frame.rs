//! The coordinates v in which a body is solved. Nodal displacements are u = T v.
//!
//! A support along an inclined direction rotates the axes of its nodes, so that it prescribes one component there. A rigid
//! surface ties its nodes to one of them, the master, whose dofs move all of them. In v every support is a prescribed dof, and the
//! blocks of K keep their size.
//!
//! The nodes i of a rigid surface that turns move by u_i = u_A + theta x (x_i - x_A), where A is the master. The rotation has the dofs of
//! a second node, the pole: v = L theta, with the distance L of the pole from the master. So v is a displacement like all other dofs, and
//! with the farthest node as the pole no node moves by more than v. In the plane theta is the first dof, and the other one is zero.

use super::{cross, length, minus, pad, unit};
use crate::exchange::Plain;
use crate::linalg::{Csr, dot};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The map T from dofs v to nodal displacements u, and the transposed map for forces. Nodes without an entry have the same values
/// in both.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct Frame<const D: usize> {
    /// Orthonormal axes of rotated nodes: v_i = axis_i . u.
    pub axes: BTreeMap<u32, [[f64; D]; D]>,
    /// Master of each tied node: u = v + v_master + R v_pole, and v = 0 must be prescribed, except at the pole. The rotation R v_pole is
    /// zero where the surface does not turn. The pole moves by u = v_master + R v.
    pub master: BTreeMap<u32, u32>,
    /// Levers R of the surfaces that turn, by their master. None of their nodes has axes of its own.
    pub levers: BTreeMap<u32, Levers<D>>,
}

/// Return the position of a node in a sorted slice.
pub fn place(nodes: &[u32], node: u32) -> Option<u32> {
    nodes.binary_search(&node).ok().map(|place| place as u32)
}

/// The nodes whose dofs move a node.
#[derive(Clone, Copy)]
pub struct Movers<'a, const D: usize> {
    /// Master of the node, or the node itself. The displacement of the node has the dofs of this one as a summand.
    pub node: u32,
    /// Rotation, where the node is on a surface that turns.
    pub rotation: Option<Rotation<'a, D>>,
}

impl<const D: usize> Frame<D> {
    /// Return the node whose dofs move a node as a translation: its master, or the node itself.
    pub fn node(&self, node: u32) -> u32 {
        self.master.get(&node).copied().unwrap_or(node)
    }

    /// Return the nodes whose dofs move a node.
    pub fn movers(&self, node: u32) -> Movers<'_, D> {
        let master = self.node(node);
        let rotation = self.levers.get(&master).and_then(|levers| levers.rotation_of(node));
        Movers { node: master, rotation }
    }

    /// Return the nodes on which the displacements or dofs of tied nodes depend, in any order and with repetitions.
    pub fn leaders(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        let turning = self.levers.values().flat_map(|levers| levers.weights.keys().chain([&levers.pole]));
        self.master.values().chain(turning).copied()
    }

    /// Return the map for the sorted `nodes`, renumbered by their positions in this slice. It must contain the [`Frame::leaders`].
    pub fn on(&self, nodes: &[u32]) -> Self {
        let number = |node: &u32| place(nodes, *node);
        let axes = self.axes.iter().filter_map(|(node, axes)| Some((number(node)?, *axes)));
        let master = self.master.iter().filter_map(|(node, master)| Some((number(node)?, number(master)?)));
        let levers = self.levers.iter().filter_map(|(master, of)| Some((number(master)?, of.renumbered(number)?)));
        Self { axes: axes.collect(), master: master.collect(), levers: levers.collect() }
    }

    /// Return a force at a node, or the entries of a row of B, as forces at dofs: the nodes of these dofs and the components.
    pub fn force(&self, node: u32, force: [f64; D]) -> impl Iterator<Item = (u32, [f64; D])> {
        let Movers { node, rotation } = self.movers(node);
        let at_pole = rotation.map(|rotation| (rotation.pole, rotation.turning(force)));
        std::iter::once((node, self.along_axes(node, force))).chain(at_pole)
    }

    /// Return the components of a vector along the axes of a node.
    fn along_axes(&self, node: u32, vector: [f64; D]) -> [f64; D] {
        match self.axes.get(&node) {
            None => vector,
            Some(axes) => axes.map(|axis| (0..D).map(|c| axis[c] * vector[c]).sum()),
        }
    }

    /// Replace nodal forces f by forces at dofs, T'f. The forces of tied nodes go to their master, and their moments to the pole.
    pub fn forces(&self, f: &mut [f64]) {
        let at_pole = |levers: &Levers<D>| (levers.pole, levers.turning(|node| vector(f, node)));
        let moments: Vec<(u32, [f64; D])> = self.levers.values().map(at_pole).collect();
        for (&node, &master) in &self.master {
            for c in 0..D {
                f[D * master as usize + c] += std::mem::take(&mut f[D * node as usize + c]);
            }
        }
        moments.iter().for_each(|(pole, moment)| f[D * *pole as usize..][..D].copy_from_slice(moment));
        self.rotate(f);
    }

    /// Replace numbers at nodes by their sums over the nodes that the dofs of a node move.
    pub fn sum(&self, per_node: &mut [f64]) {
        let at_pole =
            |levers: &Levers<D>| (levers.pole, levers.matrix.keys().map(|&node| per_node[node as usize]).sum());
        let sums: Vec<(u32, f64)> = self.levers.values().map(at_pole).collect();
        self.master.iter().for_each(|(&node, &master)| per_node[master as usize] += per_node[node as usize]);
        sums.iter().for_each(|(pole, sum)| per_node[*pole as usize] = *sum);
    }

    /// Return the dofs of nodal displacements, v = T^-1 u.
    pub fn dofs(&self, u: &[f64]) -> Vec<f64> {
        let mut v = u.to_vec();
        for &node in self.master.keys() {
            v[D * node as usize..][..D].copy_from_slice(&self.at(node, |node| vector(u, node)));
        }
        self.rotate(&mut v);
        v
    }

    /// Return the value at a dof of a field with the nodal displacements `u`.
    pub fn dof(&self, dof: usize, u: impl Fn(u32) -> [f64; D]) -> f64 {
        self.at((dof / D) as u32, u)[dof % D]
    }

    /// Return the values at the dofs of a node of a field with the nodal displacements `u`.
    pub fn at(&self, node: u32, u: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        let Some(&master) = self.master.get(&node) else { return self.along_axes(node, u(node)) };
        let relative = |node: u32| minus(u(node), u(master));
        match self.levers.get(&master) {
            None => relative(node),
            Some(levers) if levers.pole == node => levers.dofs(relative),
            Some(levers) => minus(relative(node), levers.displacement(node, levers.dofs(relative))),
        }
    }

    /// Return the nodal displacements of dofs, u = T v.
    pub fn displacements(&self, v: &[f64]) -> Vec<f64> {
        let mut u = v.to_vec();
        for (&node, axes) in &self.axes {
            for c in 0..D {
                u[D * node as usize + c] = (0..D).map(|i| axes[i][c] * v[D * node as usize + i]).sum();
            }
        }
        self.levers.values().for_each(|levers| u[D * levers.pole as usize..][..D].fill(0.0));
        for (&node, &master) in &self.master {
            let turned = self.levers.get(&master).map(|levers| levers.displacement(node, vector(v, levers.pole)));
            for c in 0..D {
                u[D * node as usize + c] += u[D * master as usize + c] + turned.map_or(0.0, |turned| turned[c]);
            }
        }
        u
    }

    /// Replace the vectors at rotated nodes by their components along the axes there.
    fn rotate(&self, values: &mut [f64]) {
        for &node in self.axes.keys() {
            let at = D * node as usize;
            let rotated = self.along_axes(node, std::array::from_fn(|c| values[at + c]));
            values[at..at + D].copy_from_slice(&rotated);
        }
    }

    /// Rotate the rows and columns of a symmetric matrix of D x D blocks in place. The matrix may have the rows of some nodes only.
    /// Its pattern already accounts for tied nodes.
    pub fn turn_matrix(&self, k: &mut Csr) {
        if self.axes.is_empty() {
            return;
        }
        let mut is_rotated = vec![false; k.columns / D];
        for &node in self.axes.keys() {
            is_rotated[node as usize] = true;
            let first = D * node as usize;
            let rows: [_; D] = std::array::from_fn(|c| k.range(first + c).start);
            for entry in 0..k.range(first).len() {
                let column = self.along_axes(node, rows.map(|row| k.values[row + entry]));
                rows.iter().zip(column).for_each(|(row, value)| k.values[row + entry] = value);
            }
        }
        for block in (0..k.values.len()).step_by(D) {
            let node = k.col[block] as usize / D;
            if is_rotated[node] {
                let rotated = self.along_axes(node as u32, std::array::from_fn(|c| k.values[block + c]));
                k.values[block..block + D].copy_from_slice(&rotated);
            }
        }
    }
}

/// Return the vector at a node.
fn vector<const D: usize>(all: &[f64], node: u32) -> [f64; D] {
    std::array::from_fn(|c| all[D * node as usize + c])
}

/// The levers of a rigid surface that turns.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Levers<const D: usize> {
    /// Node whose dofs v are those of the rotation.
    pub pole: u32,
    /// Matrix R of each tied node, also of the pole: the rotation moves the node by R v.
    pub matrix: BTreeMap<u32, SMatrix<f64, D, D>>,
    /// Weights G of a few tied nodes, which give the rotation of a rigid displacement: v is the sum of G (u - u_master).
    pub weights: BTreeMap<u32, SMatrix<f64, D, D>>,
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
    pub matrix: &'a SMatrix<f64, D, D>,
}

impl<const D: usize> Rotation<'_, D> {
    /// Return a force at the node as a force R'f at the dofs of the rotation.
    pub fn turning(&self, force: [f64; D]) -> [f64; D] {
        self.matrix.tr_mul(&SVector::from(force)).into()
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
        // Least squares; in the plane the second dof does not move anything.
        let mut normal: SMatrix<f64, D, D> = used.iter().map(|node| matrix[node].transpose() * matrix[node]).sum();
        if D == 2 {
            normal[(1, 1)] = 1.0;
        }
        let inverse = normal.cholesky().map(|factor| factor.inverse()).unwrap_or(SMatrix::repeat(f64::NAN));
        let weight = |node: &u32| (*node, inverse * matrix[node].transpose());
        Self { pole, weights: used.iter().map(weight).collect(), matrix, length: size, arm: minus(centre, x(master)) }
    }

    /// Return the levers with other numbers of nodes. Tied nodes without a number are left out; the result is `None` if the pole has
    /// no number, or a node with weights.
    fn renumbered(&self, number: impl Fn(&u32) -> Option<u32>) -> Option<Self> {
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
    fn rotation_of(&self, node: u32) -> Option<Rotation<'_, D>> {
        self.matrix.get(&node).map(|matrix| Rotation { pole: self.pole, matrix })
    }

    /// Return nodal forces, given by `force`, as a force at the dofs of the rotation.
    fn turning(&self, force: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        let of_node = |(&node, matrix): (&u32, &SMatrix<f64, D, D>)| matrix.tr_mul(&SVector::from(force(node)));
        self.matrix.iter().map(of_node).sum::<SVector<f64, D>>().into()
    }

    /// Return the dofs v of the rotation of a rigid displacement. `relative` is the displacement of a node relative to the master.
    fn dofs(&self, relative: impl Fn(u32) -> [f64; D]) -> [f64; D] {
        let of_node = |(&node, weight): (&u32, &SMatrix<f64, D, D>)| weight * SVector::from(relative(node));
        self.weights.iter().map(of_node).sum::<SVector<f64, D>>().into()
    }

    /// Return the displacement of a node by the rotation with the dofs v.
    fn displacement(&self, node: u32, v: [f64; D]) -> [f64; D] {
        self.matrix.get(&node).map_or([0.0; D], |matrix| (matrix * SVector::from(v)).into())
    }

    /// Return nodal forces with the total `force` that acts at the centre and the `moment` (x, y, z) about the centre. `master` is the
    /// master of the surface.
    pub fn forces(&self, master: u32, force: [f64; D], moment: [f64; 3]) -> Vec<(u32, [f64; D])> {
        let about_master = cross(pad(self.arm), pad(force));
        let moment: [f64; 3] = std::array::from_fn(|c| moment[c] + about_master[c]);
        let at_pole = SVector::from_fn(|k, _| dot(&moment, &axis::<D>(k)) / self.length);
        let couple = |(node, weight): (&u32, &SMatrix<f64, D, D>)| (*node, weight.tr_mul(&at_pole).into());
        let mut forces: Vec<(u32, [f64; D])> = self.weights.iter().map(couple).collect();
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
fn rotation<const D: usize>(arm: [f64; D], length: f64) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|c, dof| cross(axis::<D>(dof), pad(arm))[c] / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_do_the_same_work_in_both_coordinates() {
        let (s, c) = (0.6, 0.8);
        let frame = Frame::<2> {
            axes: BTreeMap::from([(1, [[c, s], [-s, c]]), (2, [[s, c], [c, -s]])]),
            master: BTreeMap::from([(0, 2), (3, 2)]),
            levers: BTreeMap::new(),
        };
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

    #[test]
    fn a_turned_matrix_is_the_same_form() {
        let frame = Frame::<2> { axes: BTreeMap::from([(1, [[0.8, 0.6], [-0.6, 0.8]])]), ..Frame::default() };
        // The matrix couples the nodes 0 - 1 - 2 by symmetric blocks.
        let dense = |i: usize, j: usize| {
            let (i, j) = (i.min(j), i.max(j));
            if j / 2 - i / 2 > 1 { 0.0 } else { 1.0 + i as f64 + 0.3 * (j * j) as f64 }
        };
        let mut k = Csr::new(6);
        for i in 0..6 {
            k.push_row((0..6).map(|j| (j, dense(i, j))));
        }
        let quadratic = |k: &Csr, u: &[f64]| {
            let mut ku = [0.0; 6];
            k.multiply(u, &mut ku);
            dot(u, &ku)
        };
        let v = [0.1, -0.2, 0.3, 0.5, 0.7, -1.1];
        let before = quadratic(&k, &frame.displacements(&v));
        frame.turn_matrix(&mut k);
        assert!((quadratic(&k, &v) - before).abs() < 1e-13 * before.abs());
        assert!((0..6).all(|i| k.row(i).all(|(j, a)| (a - k.values[k.position(j, i).unwrap()]).abs() < 1e-14)));
    }
}
