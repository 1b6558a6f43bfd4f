//! The distribution of the dofs of a body over the ranks, as one of them sees it.
//!
//! A state is (v, a): v has the dofs that this rank owns, and the rigid motion a is the same on all ranks. Every rank has a part of a force, also
//! of the force on the rigid motion, so that work is a sum over ranks.

use crate::exchange::{Exchange, Serial, all_to_all};
use crate::linalg::Csr;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// The dofs of a body that one rank owns, and their places in the distributed matrix that has their rows of K. That is the matrix of all bodies, or
/// one of the body's own.
#[derive(Serialize, Deserialize)]
pub struct Distribution {
    /// Number of dofs of the body.
    pub dofs: usize,
    /// The dofs that this rank owns, sorted.
    pub own: Vec<u32>,
    /// Their positions among the dofs of the owned and ghost nodes of this rank, sorted.
    pub places: Vec<u32>,
    /// For each other rank, the ghost dofs that it owns: their positions among the dofs of the owned and ghost nodes, and their rows in the matrix.
    pub near: Vec<(Vec<u32>, Vec<u32>)>,
    /// Products, over all dofs of the body, of the rigid motions that its supports leave free.
    pub products: DMatrix<f64>,
    /// Row of the first owned dof of the body in the matrix; the others follow.
    pub first: usize,
    /// First row of the matrix that this rank owns.
    pub start: usize,
    /// Number of rows of the matrix.
    pub total: usize,
    /// All contact rows of the body; columns: rows of the matrix.
    pub rows: Csr,
    /// Whether this rank owns the body. It is one of the ranks that own most of its dofs.
    pub leads: bool,
    /// Connection to the other ranks; whoever receives a distribution sets it.
    #[serde(skip, default = "alone")]
    pub exchange: Rc<dyn Exchange>,
}

fn alone() -> Rc<dyn Exchange> {
    Rc::new(Serial)
}

impl Distribution {
    /// Return the values at all dofs of the body, on every rank, from those at owned dofs. `rest` is appended. Collective.
    pub fn gather(&self, own: &[f64], rest: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.dofs];
        self.own.iter().zip(own).for_each(|(&dof, &value)| all[dof as usize] = value);
        self.exchange.sum(&mut all);
        all.extend(rest);
        all
    }

    /// Return the values at the dofs of the owned and ghost nodes of this rank, from those at the owned dofs of every rank. Collective.
    pub fn near(&self, own: &[f64]) -> Vec<f64> {
        let requested = all_to_all(&*self.exchange, self.near.iter().map(|(_, rows)| rows.clone()).collect());
        let value = |row: u32| own[row as usize - self.first];
        let answers = requested.into_iter().map(|rows| rows.into_iter().map(value).collect::<Vec<f64>>());
        let ghosts: usize = self.near.iter().map(|(positions, _)| positions.len()).sum();
        let mut known = vec![0.0; self.places.len() + ghosts];
        self.places.iter().zip(own).for_each(|(&at, &value)| known[at as usize] = value);
        for ((positions, _), values) in self.near.iter().zip(all_to_all(&*self.exchange, answers.collect())) {
            positions.iter().zip(values).for_each(|(&at, value)| known[at as usize] = value);
        }
        known
    }

    /// Return the values at owned dofs from those at the dofs of owned and ghost nodes.
    pub fn of_known(&self, known: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&at| known[at as usize]).collect()
    }

    /// Return the values at owned dofs from those at all dofs, and append the entries behind the latter.
    pub fn scatter(&self, all: &[f64]) -> Vec<f64> {
        let own = self.own.iter().map(|&dof| all[dof as usize]);
        own.chain(all[self.dofs..].iter().copied()).collect()
    }
}
