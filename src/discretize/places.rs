//! Where a rank has the nodes of a body whose dofs are dealt out.

use crate::linalg::Csr;
use crate::model::Distribution;

/// Where a rank has the nodes of a body.
pub struct Places {
    /// Place of each node: own ones, then ghosts; -1 for others.
    pub of_node: Vec<i32>,
    /// The rank that speaks for the body.
    pub leader: usize,
}

impl Places {
    /// Whether a node is an own one of `distribution`.
    pub fn is_own<const D: usize>(&self, distribution: &Distribution, node: usize) -> bool {
        (0..distribution.own.len() as i32 / D as i32).contains(&self.of_node[node])
    }

    /// Own rows of a matrix over the dofs of the body, whose other rows are empty, in columns of own dofs and ghosts.
    pub fn rows<const D: usize>(&self, distribution: &Distribution, matrix: Csr) -> Csr {
        let Csr { ptr, mut col, mut values, .. } = matrix;
        let mut starts = vec![0];
        let mut row = Vec::new();
        for &dof in &distribution.own {
            let range = ptr[dof as usize] as usize..ptr[dof as usize + 1] as usize;
            let place = |&j: &i32| D as i32 * self.of_node[j as usize / D] + j % D as i32;
            row.clear();
            row.extend(col[range.clone()].iter().map(place).zip(values[range.clone()].iter().copied()));
            row.sort_unstable_by_key(|entry| entry.0);
            for (k, &(j, value)) in range.clone().zip(&row) {
                (col[k], values[k]) = (j, value);
            }
            starts.push(range.end as i32);
        }
        Csr { columns: distribution.own.len() + distribution.ghosts.len(), ptr: starts, col, values }
    }

    /// Values (dof, value) at dofs of the body that are here, by their places, sorted.
    pub fn entries<const D: usize>(&self, all: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let place = |&(dof, value): &(usize, f64)| {
            let place = usize::try_from(self.of_node[dof / D]).ok()?;
            Some((D * place + dof % D, value))
        };
        let mut here: Vec<_> = all.iter().filter_map(place).collect();
        here.sort_unstable_by_key(|entry| entry.0);
        here
    }
}
