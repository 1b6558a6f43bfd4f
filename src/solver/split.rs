//! Displacements as deformation and rigid motion, kept apart.
//!
//! K R = 0 for the rigid motions R that supports leave free, but only for exact numbers: entries of K and u are rounded, and
//! f - K u is wrong by eps |K| |u| however it is summed. A body that falls far onto a soft layer loses its strains in that. So
//! its displacement is v + R a with v orthogonal to R, a state is (v, a), and K meets v alone. Forces are (r, R'r), so that
//! sums over states are the work on displacements; their rigid part comes from loads and contact forces, without K.

use crate::fem::rigid::FreeMotion;
use crate::linalg::{Csr, axpy, dot};

/// Orthonormal rigid motions that a body's supports leave free, with what they do at its contact rows.
#[derive(Debug, Default)]
pub struct Split {
    /// R, one vector over the dofs each.
    motions: Vec<Vec<f64>>,
    /// B R.
    traces: Vec<Vec<f64>>,
    /// R'f.
    work: Vec<f64>,
}

impl Split {
    /// From motions that a body's supports leave free, independent ones; `rows` are its contact rows.
    pub fn new(free: &[FreeMotion], rows: &Csr) -> Self {
        let mut split = Self::default();
        for FreeMotion { displacement, work } in free {
            let (mut motion, mut work) = (displacement.clone(), *work);
            // twice is enough
            for _ in 0..2 {
                for (other, its_work) in split.motions.iter().zip(&split.work) {
                    let part = dot(other, &motion);
                    axpy(-part, other, &mut motion);
                    work -= part * its_work;
                }
            }
            let norm = dot(&motion, &motion).sqrt();
            motion.iter_mut().for_each(|u| *u /= norm);
            let mut trace = vec![0.0; rows.rows()];
            rows.multiply(&motion, &mut trace);
            split.traces.push(trace);
            split.work.push(work / norm);
            split.motions.push(motion);
        }
        split
    }

    /// Number of motions: a state is this much longer than the dofs.
    pub fn count(&self) -> usize {
        self.motions.len()
    }

    /// R, one vector over the dofs each.
    pub fn motions(&self) -> &[Vec<f64>] {
        &self.motions
    }

    /// B R, one vector over the contact rows each.
    pub fn traces(&self) -> &[Vec<f64>] {
        &self.traces
    }

    /// Moves the rigid part of the dofs of a state to its end.
    pub fn separate(&self, state: &mut [f64]) {
        let (dofs, rigid) = state.split_at_mut(state.len() - self.count());
        for (motion, a) in self.motions.iter().zip(rigid) {
            let part = dot(motion, dofs);
            axpy(-part, motion, dofs);
            *a += part;
        }
    }

    /// Displacements of all dofs.
    pub fn join(&self, state: &[f64]) -> Vec<f64> {
        let (dofs, rigid) = state.split_at(state.len() - self.count());
        let mut u = dofs.to_vec();
        self.motions.iter().zip(rigid).for_each(|(motion, &a)| axpy(a, motion, &mut u));
        u
    }

    /// t += B R a.
    pub fn add_trace(&self, rigid: &[f64], t: &mut [f64]) {
        self.traces.iter().zip(rigid).for_each(|(trace, &a)| axpy(a, trace, t));
    }

    /// y += (B R)' force, one entry a motion.
    pub fn add_rows(&self, s: f64, force: &[f64], y: &mut [f64]) {
        self.traces.iter().zip(y).for_each(|(trace, y)| *y += s * dot(trace, force));
    }

    /// R'r of a force at the dofs.
    pub fn rigid_part(&self, force: &[f64]) -> Vec<f64> {
        self.motions.iter().map(|motion| dot(motion, force)).collect()
    }

    /// R'f.
    pub fn work(&self) -> &[f64] {
        &self.work
    }

    /// Gives the dofs of a force the rigid part that its end says.
    pub fn balance(&self, force: &mut [f64]) {
        let (dofs, rigid) = force.split_at_mut(force.len() - self.count());
        for (motion, &a) in self.motions.iter().zip(&*rigid) {
            let off = a - dot(motion, dofs);
            axpy(off, motion, dofs);
        }
    }
}
