//! What one rank has of the dofs of a distributed body.

use crate::fem::Prolongation;
use crate::linalg::Csr;
use crate::model::Distribution;
use serde::{Deserialize, Serialize};

/// What one rank has of the dofs of a distributed body.
#[derive(Clone, Serialize, Deserialize)]
pub struct OwnedDofs {
    /// Dofs of this rank.
    pub distribution: Distribution,
    /// Numbers of the nodes that this rank has, in the matrix with the rows of the body.
    pub number: Vec<u32>,
    /// Local indices of the coarse nodes among the nodes of this rank; empty if no interpolation is requested.
    pub coarse_nodes: Vec<u32>,
    /// Numbers of these nodes among the coarse nodes of the bodies in one matrix.
    pub coarse_number: Vec<u32>,
    /// Number of coarse nodes of these bodies on all ranks.
    pub coarse_count: usize,
    /// Number of coarse nodes of this body that this rank owns.
    pub own_coarse: usize,
}

impl OwnedDofs {
    /// Return the rows of owned dofs of the interpolation that `whole` makes from coarse nodes. Columns are numbered
    /// through all bodies in one matrix.
    pub fn interpolation<const D: usize>(&self, whole: impl FnOnce(&[u32]) -> Prolongation) -> Prolongation {
        let whole = whole(&self.coarse_nodes);
        let mut rows = Csr::new(D * self.coarse_count);
        for &dof in &self.distribution.owned_positions {
            let number = |j: usize| D * self.coarse_number[j / D] as usize + j % D;
            rows.push_row(whole.rows.row(dof as usize).map(|(j, weight)| (number(j), weight)));
        }
        Prolongation { rows, own: D * self.own_coarse }
    }

    /// Return whether this rank owns a node, given by its local index.
    pub fn is_own<const D: usize>(&self, node: usize) -> bool {
        let Distribution { first, own, .. } = &self.distribution;
        (*first..first + own.len()).contains(&(D * self.number[node] as usize))
    }

    /// Restrict K, which was assembled for owned nodes, to the owned dofs. Its columns become those of the matrix with
    /// its rows.
    pub fn restrict<const D: usize>(&self, stiffness: Csr) -> Csr {
        let Csr { ptr, mut col, mut values, .. } = stiffness;
        let mut starts = vec![0];
        let mut row = Vec::new();
        for &dof in &self.distribution.owned_positions {
            let range = ptr[dof as usize] as usize..ptr[dof as usize + 1] as usize;
            let number = |&j: &i32| D as i32 * self.number[j as usize / D] as i32 + j % D as i32;
            row.clear();
            row.extend(col[range.clone()].iter().map(number).zip(values[range.clone()].iter().copied()));
            row.sort_unstable_by_key(|entry| entry.0);
            for (k, &(j, value)) in range.clone().zip(&row) {
                (col[k], values[k]) = (j, value);
            }
            starts.push(range.end as i32);
        }
        Csr { columns: self.distribution.total, ptr: starts, col, values }
    }
}
