//! Displacements as deformation and rigid motion, kept apart.
//!
//! K R = 0 for the rigid motions R that supports leave free, but only for exact numbers: entries of K and u are rounded, and
//! f - K u is wrong by eps |K| |u| however it is summed. A body that falls far onto a soft layer loses its strains in that. So
//! its displacement is v + R a with v orthogonal to R, a state is (v, a), and K meets v alone. Forces are (r, R'r), so that
//! sums over states are the work on displacements; their rigid part comes from loads and contact forces, without K.

use crate::fem::rigid::FreeMotion;
use crate::linalg::portable::log2;
use crate::linalg::{Csr, axpy, dot};
use crate::model::Distribution;
use nalgebra::DVector;
use std::rc::Rc;

/// Orthogonal rigid motions that a body's supports leave free, with what they do at its contact rows.
#[derive(Default)]
pub struct Split {
    /// R, one vector over the dofs each. Their lengths lie between 1 and 2: they are scaled by powers of two, which leaves a
    /// translation of a flat surface the same digits at all points, and few of them.
    motions: Vec<Rc<[f64]>>,
    /// R'R, of which nothing but the diagonal is left.
    squares: Vec<f64>,
    /// B R.
    traces: Vec<Vec<f64>>,
    /// R'f.
    work: Vec<f64>,
    /// Where the dofs are dealt out over the ranks: how. R has the dofs of this rank then.
    distribution: Option<Rc<Distribution>>,
}

impl Split {
    /// From motions that a body's supports leave free, independent ones; `rows` are its contact rows. Of a body that is dealt out both are
    /// those of the dofs that this rank knows; forces on rigid motions belong to the rank that speaks for it.
    pub fn new(free: &[FreeMotion], rows: &Csr, distribution: Option<Rc<Distribution>>) -> Self {
        let mut split = Self { distribution, ..Self::default() };
        let mut weights: Vec<DVector<f64>> = Vec::new();
        let products = split.distribution.clone();
        // of two sums of motions: over the dofs, or by their weights where the dofs are those of many ranks
        let product = |x: (&[f64], &DVector<f64>), y: (&[f64], &DVector<f64>)| match &products {
            None => dot(x.0, y.0),
            Some(distribution) => x.1.dot(&(&distribution.products * y.1)),
        };
        for (number, FreeMotion { displacement, work }) in free.iter().enumerate() {
            let (mut motion, mut work) = (displacement.clone(), *work);
            let mut weight = DVector::from_fn(free.len(), |k, _| f64::from(u8::from(k == number)));
            // twice is enough
            for _ in 0..2 {
                for (k, (other, square)) in split.motions.iter().zip(&split.squares).enumerate() {
                    let part = product((other, &weights[k]), (&motion, &weight)) / square;
                    axpy(-part, other, &mut motion);
                    weight.axpy(-part, &weights[k], 1.0);
                    work -= part * split.work[k];
                }
            }
            let scale = log2(product((&motion, &weight), (&motion, &weight)).sqrt()).floor().exp2();
            motion.iter_mut().for_each(|u| *u /= scale);
            weight /= scale;
            split.squares.push(product((&motion, &weight), (&motion, &weight)));
            let mut trace = vec![0.0; rows.rows()];
            rows.multiply(&motion, &mut trace);
            split.traces.push(trace);
            split.work.push(work / scale);
            split.motions.push(motion.into());
            weights.push(weight);
        }
        if let Some(distribution) = &split.distribution {
            split.motions.iter_mut().for_each(|motion| *motion = distribution.of_known(motion).into());
            if !distribution.leads {
                split.work.fill(0.0);
            }
        }
        split
    }

    /// Sums over dofs, one a motion, from those over the dofs here; one message.
    fn sums(&self, here: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums: Vec<f64> = here.collect();
        if let Some(distribution) = &self.distribution {
            distribution.exchange.sum(&mut sums);
        }
        sums
    }

    /// Whether forces on rigid motions are this rank's.
    fn leads(&self) -> bool {
        self.distribution.as_ref().is_none_or(|distribution| distribution.leads)
    }

    /// Number of motions: a state is this much longer than the dofs.
    pub fn count(&self) -> usize {
        self.motions.len()
    }

    /// R, one vector over the dofs each.
    pub fn motions(&self) -> &[Rc<[f64]>] {
        &self.motions
    }

    /// B R, one vector over the contact rows each.
    pub fn traces(&self) -> &[Vec<f64>] {
        &self.traces
    }

    /// Moves the rigid part of the dofs of a state to its end.
    pub fn separate(&self, state: &mut [f64]) {
        let (dofs, rigid) = state.split_at_mut(state.len() - self.count());
        let parts = self.sums(self.motions.iter().map(|motion| dot(motion, dofs)));
        for (((motion, square), part), a) in self.motions.iter().zip(&self.squares).zip(parts).zip(rigid) {
            axpy(-part / square, motion, dofs);
            *a += part / square;
        }
    }

    /// Displacements of all dofs.
    pub fn join(&self, state: &[f64]) -> Vec<f64> {
        let (dofs, rigid) = state.split_at(state.len() - self.count());
        let mut u = dofs.to_vec();
        self.motions.iter().zip(rigid).for_each(|(motion, &a)| axpy(a, motion, &mut u));
        u
    }

    /// t += B R a, on the rank that speaks for the body.
    pub fn add_trace(&self, rigid: &[f64], t: &mut [f64]) {
        if !self.leads() {
            return;
        }
        self.traces.iter().zip(rigid).for_each(|(trace, &a)| axpy(a, trace, t));
    }

    /// y += (B R)' force, one entry a motion, on the rank that speaks for the body.
    pub fn add_rows(&self, s: f64, force: &[f64], y: &mut [f64]) {
        if !self.leads() {
            return;
        }
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
        let lacking = self.sums(self.motions.iter().zip(&*rigid).map(|(motion, a)| a - dot(motion, dofs)));
        for ((motion, square), lacking) in self.motions.iter().zip(&self.squares).zip(lacking) {
            axpy(lacking / square, motion, dofs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes on a line that slides and turns: deformation and rigid motion come apart and together again, and sliding moves
    /// all contact rows by the same number.
    #[test]
    fn states_come_apart_and_together() {
        let free = |displacement: [f64; 6]| FreeMotion { displacement: displacement.to_vec(), work: 3.0 };
        let mut rows = Csr::new(6);
        (0..3).for_each(|node| rows.push_row([(2 * node, 1.0)]));
        let free = [free([1.0, 0.0, 1.0, 0.0, 1.0, 0.0]), free([0.5, 0.5, 0.5, 0.0, 0.5, -0.5])];
        let split = Split::new(&free, &rows, None);
        assert_eq!(split.traces()[0], [1.0; 3]);
        assert!(dot(&split.motions()[0], &split.motions()[1]).abs() < 1e-15);
        // of the second motion half the first is taken away, with its work
        assert_eq!(split.work()[0], 3.0);
        let shape = split.motions()[1][1] / 0.5;
        assert!((split.work()[1] - 1.5 * shape).abs() < 1e-14);
        let u = [0.3, 1.0, -0.2, 0.4, 0.7, -2.0];
        let mut state = [&u[..], &[0.0, 0.0]].concat();
        split.separate(&mut state);
        assert!(split.motions().iter().all(|motion| dot(motion, &state[..6]).abs() < 1e-15));
        assert!(split.join(&state).iter().zip(u).all(|(a, b)| (a - b).abs() < 1e-15));
        let mut force = [&u[..], &[0.25, -4.0]].concat();
        split.balance(&mut force);
        let parts = split.rigid_part(&force[..6]);
        assert!((parts[0] - 0.25).abs() < 1e-15 && (parts[1] + 4.0).abs() < 1e-14, "{parts:?}");
    }
}
