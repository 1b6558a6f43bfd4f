//! The rigid-body split: displacements as deformation and rigid motion, stored apart.
//!
//! K R = 0 holds for the rigid motions R that supports leave free, but only in exact numbers. Entries of K and u are rounded, and
//! f - K u has an error of eps |K| |u| however it is summed. A body that falls far onto a soft layer loses its strains in that error. So
//! its displacement is v + R a with v orthogonal to R, a state is (v, a), and K multiplies v alone. A force is (r, R'r), so that the product of a force and a
//! state is the work on the displacement. The rigid part R'r comes from loads and contact forces, without K.

use crate::fem::rigid::FreeMotion;
use crate::linalg::portable::log2;
use crate::linalg::{Csr, axpy, dot};
use crate::model::Distribution;
use nalgebra::DVector;
use std::rc::Rc;

/// Orthogonal rigid motions that a body's supports leave free, with their traces on its contact rows.
#[derive(Default)]
pub struct Split {
    /// R, one vector over the dofs for each motion. Their lengths lie between 1 and 2. They are scaled by powers of two, so that a
    /// translation of a flat surface has the same few digits at all points.
    motions: Vec<Rc<[f64]>>,
    /// The diagonal of R'R, which has no other entries.
    squares: Vec<f64>,
    /// B R, one vector over the contact rows for each motion.
    traces: Vec<Vec<f64>>,
    /// R'f, one entry a motion; zero on ranks that do not own the body.
    work: Vec<f64>,
    /// How the dofs are distributed over the ranks, if they are. R then has the dofs that this rank owns.
    distribution: Option<Rc<Distribution>>,
}

impl Split {
    /// Orthogonalise the independent rigid motions `free` that a body's supports leave; `rows` are its contact rows. For a distributed body both have
    /// the dofs of the owned and ghost nodes of this rank, and forces on rigid motions belong to the rank that owns the body.
    pub fn new(free: &[FreeMotion], rows: &Csr, distribution: Option<Rc<Distribution>>) -> Self {
        let mut split = Self { distribution, ..Self::default() };
        let mut combinations: Vec<DVector<f64>> = Vec::new();
        for (number, FreeMotion { displacement, work }) in free.iter().enumerate() {
            let (mut motion, mut work) = (displacement.clone(), *work);
            // the motion as amounts of those in `free`
            let mut combination = DVector::from_fn(free.len(), |k, _| f64::from(u8::from(k == number)));
            // Gram-Schmidt, done twice for orthogonality to rounding
            for _ in 0..2 {
                for (k, other) in combinations.iter().enumerate() {
                    let earlier = (&split.motions[k][..], other);
                    let part = split.product(earlier, (&motion, &combination)) / split.squares[k];
                    axpy(-part, &split.motions[k], &mut motion);
                    combination.axpy(-part, other, 1.0);
                    work -= part * split.work[k];
                }
            }
            let square = split.product((&motion, &combination), (&motion, &combination));
            let scale = log2(square.sqrt()).floor().exp2();
            motion.iter_mut().for_each(|u| *u /= scale);
            combination /= scale;
            split.squares.push(split.product((&motion, &combination), (&motion, &combination)));
            let mut trace = vec![0.0; rows.rows()];
            rows.multiply(&motion, &mut trace);
            split.traces.push(trace);
            split.work.push(work / scale);
            split.motions.push(motion.into());
            combinations.push(combination);
        }
        if let Some(distribution) = &split.distribution {
            split.motions.iter_mut().for_each(|motion| *motion = distribution.of_known(motion).into());
            if !distribution.leads {
                split.work.fill(0.0);
            }
        }
        split
    }

    /// Return the product of two motions over all dofs of the body. Each motion is given by its displacements of the dofs of this rank, and by its amounts of
    /// the motions that supports leave. The amounts serve a distributed body, whose dofs belong to many ranks.
    fn product(&self, x: (&[f64], &DVector<f64>), y: (&[f64], &DVector<f64>)) -> f64 {
        match &self.distribution {
            None => dot(x.0, y.0),
            Some(distribution) => x.1.dot(&(&distribution.products * y.1)),
        }
    }

    /// Return sums over all dofs of the body, one a motion, from those over the dofs of this rank. One message.
    fn sums(&self, local: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums: Vec<f64> = local.collect();
        if let Some(distribution) = &self.distribution {
            distribution.exchange.sum(&mut sums);
        }
        sums
    }

    /// Return whether forces on rigid motions belong to this rank, which then owns the body.
    fn leads(&self) -> bool {
        self.distribution.as_ref().is_none_or(|distribution| distribution.leads)
    }

    /// Return the number of motions. A state has so many entries after its dofs.
    pub fn count(&self) -> usize {
        self.motions.len()
    }

    /// Return R, one vector over the dofs for each motion.
    pub fn motions(&self) -> &[Rc<[f64]>] {
        &self.motions
    }

    /// Return B R, one vector over the contact rows for each motion.
    pub fn traces(&self) -> &[Vec<f64>] {
        &self.traces
    }

    /// Move the rigid part of the dofs of a state to the entries for rigid motions at its end.
    pub fn separate(&self, state: &mut [f64]) {
        let (dofs, rigid) = state.split_at_mut(state.len() - self.count());
        let parts = self.sums(self.motions.iter().map(|motion| dot(motion, dofs)));
        for (k, part) in parts.into_iter().enumerate() {
            let amount = part / self.squares[k];
            axpy(-amount, &self.motions[k], dofs);
            rigid[k] += amount;
        }
    }

    /// Return the displacements v + R a of all dofs for a state.
    pub fn join(&self, state: &[f64]) -> Vec<f64> {
        let (dofs, rigid) = state.split_at(state.len() - self.count());
        let mut u = dofs.to_vec();
        self.motions.iter().zip(rigid).for_each(|(motion, &a)| axpy(a, motion, &mut u));
        u
    }

    /// Add B R a to the trace t, on the rank that owns the body.
    pub fn add_trace(&self, rigid: &[f64], t: &mut [f64]) {
        if self.leads() {
            self.traces.iter().zip(rigid).for_each(|(trace, &a)| axpy(a, trace, t));
        }
    }

    /// Add s (B R)' force to y, which has one entry a motion, on the rank that owns the body.
    pub fn add_rows(&self, s: f64, force: &[f64], y: &mut [f64]) {
        if self.leads() {
            self.traces.iter().zip(y).for_each(|(trace, y)| *y += s * dot(trace, force));
        }
    }

    /// Return R'r for a force r at the dofs.
    pub fn rigid_part(&self, force: &[f64]) -> Vec<f64> {
        self.motions.iter().map(|motion| dot(motion, force)).collect()
    }

    /// Return R'f, one entry a motion; zero on ranks that do not own the body.
    pub fn work(&self) -> &[f64] {
        &self.work
    }

    /// Correct the dofs of a force so that their rigid part R'r is the one at its end.
    pub fn balance(&self, force: &mut [f64]) {
        let (dofs, rigid) = force.split_at_mut(force.len() - self.count());
        let lacking = self.sums(self.motions.iter().zip(&*rigid).map(|(motion, part)| part - dot(motion, dofs)));
        for (k, lacking) in lacking.into_iter().enumerate() {
            axpy(lacking / self.squares[k], &self.motions[k], dofs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes on a line slide and turn. Deformation and rigid motion are separated and joined again, and sliding moves
    /// all contact rows by the same amount.
    #[test]
    fn states_come_apart_and_together() {
        let free = |displacement: [f64; 6]| FreeMotion { displacement: displacement.to_vec(), work: 3.0 };
        let mut rows = Csr::new(6);
        (0..3).for_each(|node| rows.push_row([(2 * node, 1.0)]));
        let free = [free([1.0, 0.0, 1.0, 0.0, 1.0, 0.0]), free([0.5, 0.5, 0.5, 0.0, 0.5, -0.5])];
        let split = Split::new(&free, &rows, None);
        assert_eq!(split.traces()[0], [1.0; 3]);
        assert!(dot(&split.motions()[0], &split.motions()[1]).abs() < 1e-15);
        // half of the first motion is taken away from the second, with its work
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
