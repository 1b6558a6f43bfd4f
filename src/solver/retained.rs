//! Which dofs of a body a condensed solver retains, and the axes in which it sees them.
//!
//! The method feels a body through its contact rows alone, so their columns are retained. Where one normal serves all rows
//! that touch a node, the node is turned to axes (n, t, ...), and of its dofs one is left. Dofs of a few more nodes are
//! retained where supports and contact do not hold the interior safely.

use serde::{Deserialize, Serialize};
use crate::fem::rigid::AtDofs;
use crate::linalg::{Blocks, Csr, dot};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// Rows of a node count as parallel below this sine of their angle.
const PARALLEL: f64 = 1e-12;

/// A rigid motion held by less than this share of what all held dofs could do gets a dof of its own. Not the question whether it
/// is held at all, but how well the interior is: its condition is about 1/SAFE times that of a clamped body, which leaves ten
/// digits of sixteen.
const SAFE: f64 = 1e-6;

/// The retained dofs of a body.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Retained {
    /// Dofs, sorted, in the turned axes.
    pub dofs: Vec<usize>,
    /// Contact rows over the retained dofs.
    pub rows: Csr,
    /// Axes of the turned nodes, one after the other; the first is the normal.
    axes: BTreeMap<usize, Vec<Vec<f64>>>,
    dimension: usize,
}

impl Retained {
    /// Chooses the dofs for contact `rows` (columns: all dofs, `dimension` of them a node), `prescribed` (dof, value) and the
    /// `motions` of the free body.
    pub fn new(dimension: usize, rows: &Csr, prescribed: &[(usize, f64)], motions: AtDofs) -> Self {
        let prescribed: HashSet<usize> = prescribed.iter().map(|entry| entry.0).collect();
        let mut vectors: BTreeMap<usize, Vec<Vec<f64>>> = BTreeMap::new();
        for q in 0..rows.rows() {
            let mut of_row: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
            for (dof, value) in rows.row(q) {
                of_row.entry(dof / dimension).or_insert_with(|| vec![0.0; dimension])[dof % dimension] = value;
            }
            of_row.into_iter().for_each(|(node, vector)| vectors.entry(node).or_default().push(vector));
        }
        let axes = vectors.into_iter().filter_map(|(node, vectors)| {
            let free = (node * dimension..(node + 1) * dimension).all(|dof| !prescribed.contains(&dof));
            let normal = common_direction(&vectors).filter(|_| free)?;
            // along an axis of the scene nothing is to be turned
            (normal.iter().filter(|n| **n != 0.0).count() > 1).then(|| (node, frame(normal)))
        });
        let mut retained = Self { dofs: Vec::new(), rows: Csr::new(0), axes: axes.collect(), dimension };
        let turned = retained.turn_rows(rows);
        let mut kept: BTreeSet<usize> = turned.col.iter().map(|&dof| dof as usize).collect();
        retained.hold(&mut kept, &prescribed, rows.columns, motions);
        retained.dofs = kept.into_iter().collect();
        let place = |dof: usize| retained.dofs.binary_search(&dof).ok();
        retained.rows = turned.of_columns(retained.dofs.len(), place);
        retained
    }

    /// Adds dofs until supports and retained dofs together hold every rigid motion.
    fn hold(&self, kept: &mut BTreeSet<usize>, prescribed: &HashSet<usize>, dofs: usize, motions: AtDofs) {
        let AtDofs { count: motions, at: motion } = motions;
        loop {
            let mut gram = DMatrix::zeros(motions, motions);
            let held: BTreeSet<usize> = kept.iter().chain(prescribed).copied().collect();
            for &dof in &held {
                let at = DVector::from_fn(motions, |k, _| self.turned(dof, |dof| motion(k, dof)));
                gram.syger(1.0, &at, &at, 1.0);
            }
            gram.fill_upper_triangle_with_lower_triangle();
            let free = Blocks::free(&gram, held.len().max(1) as f64, SAFE);
            let Some(weights) = free.first() else { return };
            let size = |dof: usize| {
                let sum = |dof: usize| (0..motions).map(|k| weights[k] * motion(k, dof)).sum();
                (!held.contains(&dof)).then(|| self.turned(dof, sum).abs() / weights.amax())
            };
            let sizes = (0..dofs).filter_map(|dof| Some((dof, size(dof)?)));
            match sizes.max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((dof, size)) if size > 1e-3 => kept.insert(dof),
                _ => return,
            };
        }
    }

    /// Entry of a vector in the turned axes.
    fn turned(&self, dof: usize, u: impl Fn(usize) -> f64) -> f64 {
        let (node, c) = (dof / self.dimension, dof % self.dimension);
        match self.axes.get(&node) {
            None => u(dof),
            Some(axes) => axes[c].iter().enumerate().map(|(k, axis)| axis * u(node * self.dimension + k)).sum(),
        }
    }

    /// A vector over all dofs in the turned axes.
    pub fn turn(&self, u: &[f64]) -> Vec<f64> {
        let mut turned = u.to_vec();
        for (&node, axes) in &self.axes {
            let at = node * self.dimension..(node + 1) * self.dimension;
            axes.iter().zip(at.clone()).for_each(|(axis, i)| turned[i] = dot(axis, &u[at.clone()]));
        }
        turned
    }

    /// The inverse of [`Retained::turn`].
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

    fn turn_rows(&self, rows: &Csr) -> Csr {
        let mut turned = Csr::new(rows.columns);
        for q in 0..rows.rows() {
            let entries = rows.row(q).collect::<Vec<_>>();
            let nodes = entries.chunk_by(|a, b| a.0 / self.dimension == b.0 / self.dimension);
            turned.push_row(nodes.flat_map(|entries| {
                let start = entries[0].0 / self.dimension * self.dimension;
                match self.axes.get(&(entries[0].0 / self.dimension)) {
                    // the other components are rounding
                    Some(axes) => {
                        let along = entries.iter().map(|(dof, value)| axes[0][dof - start] * value).sum();
                        vec![(start, along)]
                    }
                    None => entries.to_vec(),
                }
            }));
        }
        turned
    }

    /// The lower triangle of a symmetric matrix with whole blocks of nodes, in the turned axes, without its zeros:
    /// (row, column, value), row by row.
    pub fn lower_triangle(&self, matrix: &Csr) -> Vec<(usize, usize, f64)> {
        let d = self.dimension;
        let mut lower = Vec::with_capacity(matrix.values.len() / 2 + matrix.rows());
        let mut block = vec![vec![0.0; d]; d];
        for node in 0..matrix.rows() / d {
            let range = matrix.range(node * d);
            for k in range.clone().step_by(d) {
                let other = matrix.col[k] as usize / d;
                if other > node {
                    break;
                }
                for (r, row) in block.iter_mut().enumerate() {
                    let start = matrix.range(node * d + r).start + (k - range.start);
                    row.copy_from_slice(&matrix.values[start..start + d]);
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

/// The unit vector that all vectors are multiples of, if there is one.
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

/// Orthonormal axes of which the first is a given unit vector.
fn frame(normal: Vec<f64>) -> Vec<Vec<f64>> {
    let dimension = normal.len();
    let mut axes = vec![normal];
    while axes.len() < dimension {
        // what the axes so far leave of the coordinate axis that is farthest from them
        let left = |c: usize| {
            let mut rest = vec![0.0; dimension];
            rest[c] = 1.0;
            for _ in 0..2 {
                for axis in &axes {
                    let along = dot(&rest, axis);
                    rest.iter_mut().zip(axis).for_each(|(x, n)| *x -= along * n);
                }
            }
            rest
        };
        let rests = (0..dimension).map(left).max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
        let Some(mut rest) = rests else { return axes };
        let size = dot(&rest, &rest).sqrt();
        rest.iter_mut().for_each(|x| *x /= size);
        axes.push(rest);
    }
    axes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{Extent, rigid};

    /// Nodes of a square with side 2; the dofs of node i are 2 i and 2 i + 1.
    const NODES: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    fn of(rows: &Csr, prescribed: &[(usize, f64)]) -> Retained {
        let motions = rigid::modes(&Extent::of(NODES.into_iter()));
        let at = |k: usize, dof: usize| motions[k].at(&NODES[dof / 2])[dof % 2];
        let largest = |size: &dyn Fn(usize) -> Option<f64>| {
            let sizes = (0..8).filter_map(|dof| Some((dof, size(dof)?)));
            sizes.max_by(|a, b| a.1.total_cmp(&b.1))
        };
        Retained::new(2, rows, prescribed, AtDofs { count: 3, at: &at, largest: &largest })
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
        let retained = of(&plane, &supported);
        assert_eq!(retained.dofs, [4, 6]);
        assert!((retained.rows.values[0] - 1.0).abs() < 1e-15 && (retained.rows.values[1] - 0.5).abs() < 1e-15);
        let u = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        let turned = retained.turn(&u);
        assert!((turned[4] - 1.1 * s).abs() < 1e-15);
        assert!(retained.turn_back(&turned).iter().zip(u).all(|(a, b)| (a - b).abs() < 1e-15));
        let corner = rows(&[&[(4, s), (5, s)], &[(4, 1.0), (6, 1.0)]]);
        let retained = of(&corner, &supported);
        assert_eq!(retained.dofs, [4, 5, 6]);
    }

    /// Contact holds one translation and the rotation; the other translation takes one more dof, and none if a support has it.
    #[test]
    fn what_contact_does_not_hold_gets_a_dof() {
        let flat = rows(&[&[(5, 1.0)], &[(7, 1.0)]]);
        let retained = of(&flat, &[]);
        assert_eq!(retained.dofs.len(), 3);
        assert!(retained.dofs.iter().any(|dof| dof % 2 == 0), "{:?}", retained.dofs);
        assert_eq!(of(&flat, &[(0, 0.0)]).dofs, [5, 7]);
        assert_eq!(of(&rows(&[]), &[]).dofs.len(), 3);
    }

    #[test]
    fn a_turned_matrix_is_the_same_form() {
        let s = [0.6, 0.8];
        let flat = rows(&[&[(4, s[0]), (5, s[1])]]);
        let retained = of(&flat, &[(0, 0.0), (1, 0.0), (3, 0.0)]);
        assert_eq!(retained.dofs, [4]);
        let mut matrix = Csr::new(8);
        for i in 0..8usize {
            matrix.push_row((0..8).map(|j: usize| (j, 1.0 / (1.0 + i as f64 + j as f64))));
        }
        let lower = retained.lower_triangle(&matrix);
        assert_eq!(lower.len(), 36);
        let u: Vec<f64> = (0..8).map(|i| (i as f64).sin()).collect();
        let mut product = vec![0.0; 8];
        matrix.multiply(&u, &mut product);
        let v = retained.turn(&u);
        let form: f64 = lower.iter().map(|&(i, j, value)| if i == j { 1.0 } else { 2.0 } * value * v[i] * v[j]).sum();
        assert!((form - dot(&u, &product)).abs() < 1e-14, "{form}");
    }
}
