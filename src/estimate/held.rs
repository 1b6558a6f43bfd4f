//! Rigid motions that only springs to the ground resist, where these springs carry next to nothing. They keep a body in
//! place whose loads balance.
//!
//! A spring of stiffness k carries what the mesh leaves of the balance of the loads, however soft the spring is. This
//! force F moves the bodies by F/k and stores the energy F^2/k. Both grow without bound as k decreases, and so do their
//! errors. They do not concern deformations and pressures, so neither the error nor the solution includes them.

use crate::discretize::meshes::KeptMeshes;
use crate::fem::balance::{Balance, balanced};
use crate::linalg::dot;
use crate::model::motions::Motions;
use crate::model::{BodySlot, Layer, Model};
use nalgebra::{DMatrix, DVector};

/// Share of the work that the contact forces could do, up to which loads may work on a motion that springs only keep in
/// place. What a coarse mesh leaves of the balance of loads is below this share. The benchmark is two rings in a press
/// fit on springs of stiffness 1e-9 to 1. The estimated errors are 1.4e-2 in displacements and 0.106 in energy for
/// every stiffness. With the motions on springs included, the estimates are 3.8e5 and 7.4.
const CARRIED: f64 = 1e-2;

/// The motions n_k of all bodies that springs only keep in place, as amounts of the motions of each body.
pub struct HoldingSprings {
    motions: Vec<DVector<f64>>,
    /// Amount of each motion in the solution.
    amounts: DVector<f64>,
    /// Energy of the springs in the solution, u'Ku of these motions.
    pub energy: f64,
}

impl HoldingSprings {
    /// Find the motions that neither the closed contacts of `layer` nor supports resist, and on which springs carry
    /// next to nothing.
    pub fn of(model: &Model, layer: &Layer) -> Self {
        let none = || Self { motions: Vec::new(), amounts: DVector::zeros(0), energy: 0.0 };
        if !model.bodies.iter().any(BodySlot::is_sprung) {
            return none();
        }
        let all = Motions::all(model);
        let ground = all.ground(model);
        let (loads, acting) = (all.loads(), all.sizes(&layer.force));
        let only_holds = |motion: &DVector<f64>| {
            let could = motion.iter().zip(acting.iter()).map(|(amount, size)| (amount * size).abs()).sum::<f64>();
            motion.dot(&ground.multiply(motion)) > 0.0 && motion.dot(&loads).abs() <= CARRIED * could
        };
        let mut motions = all.springs(&layer.springs(model)).factor().kernel();
        motions.retain(only_holds);
        let pulls: Vec<DVector<f64>> = motions.iter().map(|motion| ground.multiply(motion)).collect();
        let stiffness = DMatrix::from_fn(motions.len(), motions.len(), |i, j| motions[i].dot(&pulls[j]));
        let work = DVector::from_fn(motions.len(), |k, _| motions[k].dot(&loads));
        // The factor does not exist if springs do not resist all of the motions.
        let Some(factor) = stiffness.cholesky() else { return none() };
        let amounts = factor.solve(&work);
        let energy = amounts.dot(&work);
        Self { motions, amounts, energy }
    }

    /// Add `sign` times the trace of these motions in the solution to `trace`.
    pub fn add_trace(&self, model: &Model, sign: f64, trace: &mut [f64]) {
        let all = Motions::all(model);
        for (motion, amount) in self.motions.iter().zip(self.amounts.iter()) {
            crate::linalg::axpy(sign * amount, &all.trace(model, motion), trace);
        }
    }

    /// Balance the loads at all nodes of the bodies on these motions ([`Balance`]). `loads` is empty for bodies of
    /// other ranks. Collective.
    ///
    /// The forces that the springs would carry then act on the bodies themselves, as in a solution without springs.
    pub fn balance<const D: usize>(&self, meshes: &KeptMeshes<D>, model: &Model, loads: &mut [Vec<f64>]) {
        let count = self.motions.len();
        if count == 0 {
            return;
        }
        let all = Motions::all(model);
        let moved: Vec<Vec<Vec<f64>>> = (0..loads.len())
            .map(|body| {
                let amounts = |k: usize| &self.motions[k].as_slice()[all.of_body(body)];
                let is_here = !loads[body].is_empty();
                (0..count).filter(|_| is_here).map(|k| meshes.moved(body, amounts(k))).collect()
            })
            .collect();
        let at = |body: usize, node: usize| -> Vec<(usize, [f64; D])> {
            moved[body].iter().map(|u| vector::<D>(u, node)).enumerate().collect()
        };
        let (mut balance, mut works) = (Balance::new(count), DVector::zeros(count));
        for (body, load) in loads.iter().enumerate() {
            moved[body].iter().enumerate().for_each(|(k, u)| works[k] += dot(u, load));
            (0..load.len() / D).for_each(|node| balance.add(vector::<D>(load, node), &at(body, node)));
        }
        model.exchange.sum(works.as_mut_slice());
        model.exchange.sum(balance.sums());
        let amounts = balance.amounts(&works);
        for (body, load) in loads.iter_mut().enumerate() {
            for node in 0..load.len() / D {
                let changed = balanced(vector::<D>(load, node), &at(body, node), &amounts);
                load[D * node..][..D].copy_from_slice(&changed);
            }
        }
    }
}

/// Return the components at a node of a vector over the displacements of nodes.
fn vector<const D: usize>(all: &[f64], node: usize) -> [f64; D] {
    std::array::from_fn(|c| all[D * node + c])
}
