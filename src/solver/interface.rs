//! The interface dofs of a body that is condensed to its contact.
//!
//! Let R be the interface dofs and I the interior ones, in axes turned to the contact normals. Then S = K_RR - K_RI
//! K_II^-1 K_IR is the stiffness and g = f_R - K_RI K_II^-1 f_I the load of a body with the same contact rows. Its
//! matrix G = S + B_R' diag(weight) B_R is dense and small.
//!
//! The method sees a body only through its contact rows, so the dofs in these rows are interface dofs. Where all rows
//! that touch a node have the same normal n, the node is turned to axes (n, t, ...), and only its dof along n is an
//! interface dof. Some more dofs are added where supports and contact do not constrain the interior well.

use crate::fem::rigid::AtDofs;
use crate::linalg::{Blocks, Csr, PART, dot};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// Normals at a node count as parallel if the sine of their angle is at most this. Components across the common normal
/// are dropped as rounding, which is 1e-16 for facets in one plane; four digits are left for coordinates of a mesh far
/// from the origin.
const PARALLEL: f64 = 1e-12;

/// One more interface dof is added for a rigid motion that is constrained by less than this share of what all
/// constrained dofs could do. This is about accuracy, not only about whether the motion is constrained at all: the
/// condition of the interior is about 1/SAFE times that of a clamped body, which leaves ten of sixteen digits.
const SAFE: f64 = 1e-6;

/// The interface dofs of a body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct InterfaceDofs {
    /// Dofs, sorted, in the turned axes.
    pub dofs: Vec<usize>,
    /// Contact rows; columns: the interface dofs.
    pub rows: Csr,
    /// Axes of each turned node, by its number; the first axis is the normal.
    axes: BTreeMap<usize, Vec<Vec<f64>>>,
    dimension: usize,
}

impl InterfaceDofs {
    /// Return the description of the inner solver of a body that is condensed to these dofs.
    pub fn in_words(&self) -> String {
        format!("condensed to {} dofs by mumps", self.dofs.len())
    }

    /// Choose the dofs for contact `rows` (columns: all dofs, `dimension` of them a node), `prescribed` (dof, value)
    /// and the rigid `motions` of the free body.
    pub fn new(dimension: usize, rows: &Csr, prescribed: &[(usize, f64)], motions: AtDofs) -> Self {
        let prescribed: HashSet<usize> = prescribed.iter().map(|entry| entry.0).collect();
        let axes = normals(dimension, rows).into_iter().filter_map(|(node, normals)| {
            let is_free = (node * dimension..(node + 1) * dimension).all(|dof| !prescribed.contains(&dof));
            let normal = common_direction(&normals).filter(|_| is_free)?;
            // a normal along an axis of the scene needs no turn
            (normal.iter().filter(|n| **n != 0.0).count() > 1).then(|| (node, frame(normal)))
        });
        let mut interface = Self { dofs: Vec::new(), rows: Csr::new(0), axes: axes.collect(), dimension };
        let turned = interface.turn_rows(rows);
        let mut dofs: BTreeSet<usize> = turned.col.iter().map(|&dof| dof as usize).collect();
        interface.constrain(&mut dofs, &prescribed, rows.columns, motions);
        interface.dofs = dofs.into_iter().collect();
        let number = |dof: usize| interface.dofs.binary_search(&dof).ok();
        interface.rows = turned.of_columns(interface.dofs.len(), number);
        interface
    }

    /// Add dofs to the `interface` ones until they constrain every rigid motion together with the `prescribed` ones.
    fn constrain(&self, interface: &mut BTreeSet<usize>, prescribed: &HashSet<usize>, dofs: usize, motions: AtDofs) {
        let AtDofs { count: motions, at: motion } = motions;
        loop {
            let mut gram = DMatrix::zeros(motions, motions);
            let constrained: BTreeSet<usize> = interface.iter().chain(prescribed).copied().collect();
            for &dof in &constrained {
                let at = DVector::from_fn(motions, |k, _| self.turned(dof, |dof| motion(k, dof)));
                gram.syger(1.0, &at, &at, 1.0);
            }
            gram.fill_upper_triangle_with_lower_triangle();
            let free = Blocks::free(&gram, constrained.len().max(1) as f64, SAFE);
            let Some(amounts) = free.first() else { return };
            // displacement of a dof in the free motion, unless the dof is constrained
            let size = |dof: usize| {
                let sum = |dof: usize| (0..motions).map(|k| amounts[k] * motion(k, dof)).sum();
                (!constrained.contains(&dof)).then(|| self.turned(dof, sum).abs() / amounts.amax())
            };
            let sizes = (0..dofs).filter_map(|dof| Some((dof, size(dof)?)));
            match sizes.max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((dof, size)) if size > PART => interface.insert(dof),
                _ => return,
            };
        }
    }

    /// Return the entry at `dof`, in the turned axes, of the vector with the entries `u` in the axes of the scene.
    fn turned(&self, dof: usize, u: impl Fn(usize) -> f64) -> f64 {
        let (node, c) = (dof / self.dimension, dof % self.dimension);
        match self.axes.get(&node) {
            None => u(dof),
            Some(axes) => axes[c].iter().enumerate().map(|(k, axis)| axis * u(node * self.dimension + k)).sum(),
        }
    }

    /// Return a vector over all dofs in the turned axes.
    pub fn turn(&self, u: &[f64]) -> Vec<f64> {
        let mut turned = u.to_vec();
        for (&node, axes) in &self.axes {
            let at = node * self.dimension..(node + 1) * self.dimension;
            axes.iter().zip(at.clone()).for_each(|(axis, i)| turned[i] = dot(axis, &u[at.clone()]));
        }
        turned
    }

    /// Return a vector in the axes of the scene; the inverse of [`InterfaceDofs::turn`].
    pub fn turn_back(&self, turned: &[f64]) -> Vec<f64> {
        let mut u = turned.to_vec();
        for (&node, axes) in &self.axes {
            let start = node * self.dimension;
            for c in 0..self.dimension {
                u[start + c] = axes.iter().enumerate().map(|(i, axis)| axis[c] * turned[start + i]).sum();
            }
        }
        u
    }

    /// Return contact rows in the turned axes.
    fn turn_rows(&self, rows: &Csr) -> Csr {
        let mut turned = Csr::new(rows.columns);
        for q in 0..rows.rows() {
            let entries = rows.row(q).collect::<Vec<_>>();
            let nodes = entries.chunk_by(|a, b| a.0 / self.dimension == b.0 / self.dimension);
            turned.push_row(nodes.flat_map(|entries| self.turn_entries(entries)));
        }
        turned
    }

    /// Return the entries (dof, value) of a contact row at one node in the turned axes. Only the component along the
    /// normal of a turned node is left; the others are rounding.
    fn turn_entries(&self, entries: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let node = entries[0].0 / self.dimension;
        let start = node * self.dimension;
        match self.axes.get(&node) {
            Some(axes) => vec![(start, entries.iter().map(|(dof, value)| axes[0][dof - start] * value).sum())],
            None => entries.to_vec(),
        }
    }

    /// Return the lower triangle of a symmetric `matrix` that stores whole blocks of nodes, in the turned axes: (row,
    /// column, value), node by node. Zeros are left out, except on the diagonal.
    pub fn lower_triangle(&self, matrix: &Csr) -> Vec<(usize, usize, f64)> {
        let d = self.dimension;
        let mut lower = Vec::with_capacity(matrix.values.len() / 2 + matrix.rows());
        let mut block = vec![vec![0.0; d]; d];
        for node in 0..matrix.rows() / d {
            let starts: Vec<usize> = (node * d..node * d + d).map(|row| matrix.range(row).start).collect();
            let others = matrix.col[matrix.range(node * d)].iter().step_by(d).map(|&dof| dof as usize / d);
            for (k, other) in others.take_while(|&other| other <= node).enumerate() {
                for (row, start) in block.iter_mut().zip(&starts) {
                    row.copy_from_slice(&matrix.values[start + k * d..][..d]);
                }
                self.turn_block(node, other, &mut block);
                for (r, row) in block.iter().enumerate() {
                    for (c, &value) in row.iter().enumerate() {
                        let (i, j) = (node * d + r, other * d + c);
                        if j <= i && (value != 0.0 || i == j) {
                            lower.push((i, j, value));
                        }
                    }
                }
            }
        }
        lower
    }

    /// Turn a block of a matrix, with the rows of `node` and the columns of the `other` node.
    fn turn_block(&self, node: usize, other: usize, block: &mut [Vec<f64>]) {
        if let Some(axes) = self.axes.get(&other) {
            for row in block.iter_mut() {
                *row = axes.iter().map(|axis| dot(row, axis)).collect();
            }
        }
        if let Some(axes) = self.axes.get(&node) {
            for c in 0..self.dimension {
                let column: Vec<f64> = block.iter().map(|row| row[c]).collect();
                block.iter_mut().zip(axes).for_each(|(row, axis)| row[c] = dot(&column, axis));
            }
        }
    }
}

/// Return the entries of contact rows at each node as vectors, by the number of the node. They are multiples of
/// normals.
fn normals(dimension: usize, rows: &Csr) -> BTreeMap<usize, Vec<Vec<f64>>> {
    let mut normals: BTreeMap<usize, Vec<Vec<f64>>> = BTreeMap::new();
    for q in 0..rows.rows() {
        let mut of_row: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (dof, value) in rows.row(q) {
            of_row.entry(dof / dimension).or_insert_with(|| vec![0.0; dimension])[dof % dimension] = value;
        }
        of_row.into_iter().for_each(|(node, vector)| normals.entry(node).or_default().push(vector));
    }
    normals
}

/// Return the unit vector of which all vectors are multiples, if there is one.
fn common_direction(vectors: &[Vec<f64>]) -> Option<Vec<f64>> {
    let size = |vector: &[f64]| dot(vector, vector).sqrt();
    let longest = vectors.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let unit: Vec<f64> = longest.iter().map(|x| x / size(longest)).collect();
    let aside = |vector: &Vec<f64>| {
        let along = dot(vector, &unit);
        vector.iter().zip(&unit).map(|(x, n)| (x - along * n).powi(2)).sum::<f64>().sqrt()
    };
    vectors.iter().all(|vector| aside(vector) <= PARALLEL * size(longest)).then_some(unit)
}

/// Return orthonormal axes, the first of which is the unit vector `normal`.
fn frame(normal: Vec<f64>) -> Vec<Vec<f64>> {
    let dimension = normal.len();
    let mut axes = vec![normal];
    while axes.len() < dimension {
        // the coordinate axis that is farthest from the axes so far gives the next one
        let rests = (0..dimension).map(|c| orthogonal_part(c, &axes));
        let Some(mut rest) = rests.max_by(|a, b| dot(a, a).total_cmp(&dot(b, b))) else { return axes };
        let size = dot(&rest, &rest).sqrt();
        rest.iter_mut().for_each(|x| *x /= size);
        axes.push(rest);
    }
    axes
}

/// Return the part of coordinate axis `c` that is orthogonal to `axes`, which are orthonormal.
fn orthogonal_part(c: usize, axes: &[Vec<f64>]) -> Vec<f64> {
    let mut rest = vec![0.0; axes[0].len()];
    rest[c] = 1.0;
    // Gram-Schmidt, done twice for orthogonality to rounding
    for axis in axes.iter().chain(axes) {
        let along = dot(&rest, axis);
        rest.iter_mut().zip(axis).for_each(|(x, n)| *x -= along * n);
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{PointExtent, rigid};

    /// Nodes of a square with side 2. The dofs of node i are 2 i and 2 i + 1.
    const NODES: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    fn of(rows: &Csr, prescribed: &[(usize, f64)]) -> InterfaceDofs {
        let motions = rigid::modes(&PointExtent::of(NODES.into_iter()));
        let at = |k: usize, dof: usize| motions[k].at(&NODES[dof / 2])[dof % 2];
        InterfaceDofs::new(2, rows, prescribed, AtDofs { count: 3, at: &at })
    }

    fn rows(list: &[&[(usize, f64)]]) -> Csr {
        let mut rows = Csr::new(8);
        list.iter().for_each(|row| rows.push_row(row.iter().copied()));
        rows
    }

    #[test]
    fn a_plane_keeps_one_dof_a_node_and_a_corner_all() {
        let supported = [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0)];
        let s = 0.5f64.sqrt();
        let plane = rows(&[&[(4, s), (5, s), (6, 0.5 * s), (7, 0.5 * s)], &[(6, s), (7, s)]]);
        let interface = of(&plane, &supported);
        assert_eq!(interface.dofs, [4, 6]);
        assert!((interface.rows.values[0] - 1.0).abs() < 1e-15 && (interface.rows.values[1] - 0.5).abs() < 1e-15);
        let u = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        let turned = interface.turn(&u);
        assert!((turned[4] - 1.1 * s).abs() < 1e-15);
        assert!(interface.turn_back(&turned).iter().zip(u).all(|(a, b)| (a - b).abs() < 1e-15));
        let corner = rows(&[&[(4, s), (5, s)], &[(4, 1.0), (6, 1.0)]]);
        let interface = of(&corner, &supported);
        assert_eq!(interface.dofs, [4, 5, 6]);
    }

    /// Contact constrains one translation and the rotation. The other translation takes one more dof, and none if a
    /// support constrains it.
    #[test]
    fn what_contact_does_not_constrain_gets_a_dof() {
        let flat = rows(&[&[(5, 1.0)], &[(7, 1.0)]]);
        let interface = of(&flat, &[]);
        assert_eq!(interface.dofs.len(), 3);
        assert!(interface.dofs.iter().any(|dof| dof % 2 == 0), "{:?}", interface.dofs);
        assert_eq!(of(&flat, &[(0, 0.0)]).dofs, [5, 7]);
        assert_eq!(of(&rows(&[]), &[]).dofs.len(), 3);
    }

    #[test]
    fn a_turned_matrix_is_the_same_form() {
        let s = [0.6, 0.8];
        let flat = rows(&[&[(4, s[0]), (5, s[1])]]);
        let interface = of(&flat, &[(0, 0.0), (1, 0.0), (3, 0.0)]);
        assert_eq!(interface.dofs, [4]);
        let mut matrix = Csr::new(8);
        for i in 0..8usize {
            matrix.push_row((0..8).map(|j: usize| (j, 1.0 / (1.0 + i as f64 + j as f64))));
        }
        let lower = interface.lower_triangle(&matrix);
        assert_eq!(lower.len(), 36);
        let u: Vec<f64> = (0..8).map(|i| (i as f64).sin()).collect();
        let mut product = vec![0.0; 8];
        matrix.multiply(&u, &mut product);
        let v = interface.turn(&u);
        let form: f64 = lower.iter().map(|&(i, j, value)| if i == j { 1.0 } else { 2.0 } * value * v[i] * v[j]).sum();
        assert!((form - dot(&u, &product)).abs() < 1e-14, "{form}");
    }
}
