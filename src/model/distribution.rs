//! How the dofs of a body are dealt out over the ranks, as one of them sees it.
//!
//! A state is (v, a): v has the dofs of this rank alone, the rigid motion a is the same on all. Of forces every rank has a part, also
//! of those on the rigid motion, so that work is a sum over ranks.

use serde::{Deserialize, Serialize};
use crate::exchange::{Exchange, Serial, trade};
use crate::linalg::Csr;
use nalgebra::DMatrix;
use std::rc::Rc;

/// The dofs of a body that one rank owns, and where they are in the matrix of all ranks that has their rows of K: that of all bodies, or
/// one of the body's own.
#[derive(Serialize, Deserialize)]
pub struct Distribution {
    /// Number of dofs of the body.
    pub dofs: usize,
    /// Those of this rank, sorted.
    pub own: Vec<u32>,
    /// Their places among the dofs of the nodes that this rank knows, sorted.
    pub places: Vec<u32>,
    /// For each rank those of its dofs that are known here: their places, and their numbers in the matrix.
    pub near: Vec<(Vec<u32>, Vec<u32>)>,
    /// Products of the rigid motions that supports leave the body, over all its dofs.
    pub products: DMatrix<f64>,
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
    /// Connection to the other ranks; whoever receives a distribution sets it.
    #[serde(skip, default = "alone")]
    pub exchange: Rc<dyn Exchange>,
}

fn alone() -> Rc<dyn Exchange> {
    Rc::new(Serial)
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

    /// Values at the dofs of the nodes that this rank knows, from those of own dofs on every rank. Collective.
    pub fn near(&self, own: &[f64]) -> Vec<f64> {
        let asked = trade(&*self.exchange, self.near.iter().map(|(_, numbers)| numbers.clone()).collect());
        let value = |number: u32| own[number as usize - self.first];
        let answers = asked.into_iter().map(|numbers| numbers.into_iter().map(value).collect::<Vec<f64>>());
        let others: usize = self.near.iter().map(|(places, _)| places.len()).sum();
        let mut known = vec![0.0; self.places.len() + others];
        self.places.iter().zip(own).for_each(|(&place, &value)| known[place as usize] = value);
        for ((places, _), values) in self.near.iter().zip(trade(&*self.exchange, answers.collect())) {
            places.iter().zip(values).for_each(|(&place, value)| known[place as usize] = value);
        }
        known
    }

    /// The values of own dofs among those of the nodes that this rank knows.
    pub fn of_known(&self, known: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&place| known[place as usize]).collect()
    }

    /// The values of own dofs among those of all, with what stands behind them.
    pub fn scatter(&self, all: &[f64]) -> Vec<f64> {
        let own = self.own.iter().map(|&dof| all[dof as usize]);
        own.chain(all[self.dofs..].iter().copied()).collect()
    }
}
