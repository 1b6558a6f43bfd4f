//! Loads that lack balance on rigid motions, changed so that they do no work on these.
//!
//! Each nodal force f changes along the motions m_j in proportion to its magnitude, by -|f| sum_j b_j m_j at its node,
//! so that nodes with equal loads get equal corrections. If w_j are the works of the loads, the amounts b_j solve
//!
//! ```text
//! sum_k G_jk b_k = w_j,      G_jk = sum_nodes |f| m_j . m_k.
//! ```

use super::length;
use crate::linalg::{TOLERANCE, dot};
use nalgebra::{DMatrix, DVector};

/// The matrix G of motions, one row and column each. The displacements of a node are (number of the motion, its
/// displacement there), for the motions that move the node.
pub struct Balance {
    products: DMatrix<f64>,
}

impl Balance {
    /// Begin with G = 0 for `count` motions.
    pub fn new(count: usize) -> Self {
        Self { products: DMatrix::zeros(count, count) }
    }

    /// Add the force at a node.
    pub fn add<const D: usize>(&mut self, force: [f64; D], moved: &[(usize, [f64; D])]) {
        let size = length(force);
        for (j, u) in moved {
            moved.iter().for_each(|(k, v)| self.products[(*j, *k)] += size * dot(u, v));
        }
    }

    /// Return the entries of G, to be summed over ranks.
    pub fn sums(&mut self) -> &mut [f64] {
        self.products.as_mut_slice()
    }

    /// Return the amounts b for the works w. Forces that cannot balance a motion, all of which act where it moves
    /// nothing, do not change.
    pub fn amounts(self, works: &DVector<f64>) -> DVector<f64> {
        let largest = self.products.diagonal().max();
        let solved = self.products.svd(true, true).solve(works, TOLERANCE * largest);
        solved.unwrap_or_else(|_| DVector::zeros(works.len()))
    }
}

/// Return the force at a node, changed by these amounts.
pub fn balanced<const D: usize>(force: [f64; D], moved: &[(usize, [f64; D])], amounts: &DVector<f64>) -> [f64; D] {
    let size = length(force);
    moved.iter().fold(force, |sum, (j, u)| std::array::from_fn(|c| sum[c] - size * amounts[*j] * u[c]))
}
