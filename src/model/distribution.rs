//! How the dofs of a body are dealt out over the ranks, as one of them sees it.
//!
//! A state is (v, a): v has the dofs of this rank alone, the rigid motion a is the same on all. Of forces every rank has a part, also
//! of those on the rigid motion, so that work is a sum over ranks.

use crate::exchange::Exchange;
use crate::linalg::Csr;
use std::rc::Rc;

/// The dofs of a body that one rank owns, and where they are in the matrix of all ranks that has their rows of K: that of all bodies, or
/// one of the body's own.
pub struct Distribution {
    /// Number of dofs of the body.
    pub dofs: usize,
    /// Those of this rank, sorted.
    pub own: Vec<u32>,
    /// Number of the first of them in that matrix; the others follow.
    pub first: usize,
    /// First row of that matrix on this rank.
    pub start: usize,
    /// Rows of that matrix.
    pub total: usize,
    /// All contact rows of the body; columns: rows of that matrix.
    pub rows: Csr,
    /// Whether this rank speaks for the body: one of those that own most of it.
    pub leads: bool,
    /// Connection to the other ranks.
    pub exchange: Rc<dyn Exchange>,
}

impl Distribution {
    /// Values at all dofs of the body, on every rank, with `rest` behind them. Collective.
    pub fn gather(&self, own: &[f64], rest: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.dofs];
        self.own.iter().zip(own).for_each(|(&dof, &value)| all[dof as usize] = value);
        self.exchange.sum(&mut all);
        all.extend(rest);
        all
    }

    /// The values of own dofs among those of all, with what stands behind them.
    pub fn scatter(&self, all: &[f64]) -> Vec<f64> {
        let own = self.own.iter().map(|&dof| all[dof as usize]);
        own.chain(all[self.dofs..].iter().copied()).collect()
    }

    /// Rows over all dofs of the body as rows over own ones.
    pub fn of_rows(&self, rows: &Csr) -> Csr {
        let mut here = Csr::new(self.own.len());
        for q in 0..rows.rows() {
            here.push_row(
                rows.row(q).filter_map(|(dof, value)| Some((self.own.binary_search(&(dof as u32)).ok()?, value))),
            );
        }
        here
    }
}
