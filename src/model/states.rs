//! What a state of a body is: deformation and rigid motion apart, with the contact rows, and how its dofs are distributed over the ranks.

use crate::exchange::{Exchange, Serial, all_to_all};
use crate::linalg::portable::log2;
use crate::linalg::{Csr, axpy, dot};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// A rigid motion that supports leave unconstrained.
#[derive(Debug, Clone)]
pub struct FreeMotion {
    /// Displacement, one entry a dof of the nodes that this rank has, zero at supports.
    pub displacement: Vec<f64>,
    /// Work of all loads on the motion.
    pub work: f64,
}

impl FreeMotion {
    /// Make the motion from the displacements of dofs, which are set to zero at prescribed ones, and the work of the loads.
    pub fn new(mut displacement: Vec<f64>, prescribed: &[(usize, f64)], work: f64) -> Self {
        prescribed.iter().for_each(|entry| displacement[entry.0] = 0.0);
        Self { work, displacement }
    }
}

/// The states of a body: their dofs, contact rows and prescribed values, and the rigid motions that supports leave free.
///
/// K R = 0 holds for the rigid motions R that supports leave free, but only in exact numbers. Entries of K and u are rounded, and
/// f - K u has an error of eps |K| |u| however it is summed. A body that falls far onto a soft layer loses its strains in that error. So
/// its displacement is v + R a with v orthogonal to R, a state is (v, a), and K multiplies v alone. A force is (r, R'r), so that the product of a force and a
/// state is the work on the displacement. The rigid part R'r comes from loads and contact forces, without K.
#[derive(Default)]
pub struct States {
    /// Number of dofs of a state. The amounts of the rigid motions come after the dofs.
    pub dofs: usize,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// B, one row for each contact point of each surface; columns: the dofs of a state.
    pub rows: Csr,
    /// R, one vector over the dofs for each motion. Their lengths lie between 1 and 2. They are scaled by powers of two, so that a
    /// translation of a flat surface has the same few digits at all points.
    pub motions: Vec<Rc<[f64]>>,
    /// The diagonal of R'R, which has no other entries.
    squares: Vec<f64>,
    /// B R, one vector over the contact rows for each motion.
    pub traces: Vec<Vec<f64>>,
    /// R'f, one entry a motion; zero on ranks that do not own the body.
    pub work: Vec<f64>,
    /// How the dofs are distributed over the ranks, if they are. B and R then have the dofs that this rank owns.
    pub distribution: Option<Rc<Distribution>>,
}

impl States {
    /// Make the states of a body.
    ///
    /// - `dofs` is the number of dofs of a state.
    /// - `prescribed` lists the prescribed dofs with their values.
    /// - `rows` are the contact rows B of the body.
    /// - `free` are independent rigid motions that its supports leave. This function makes them orthogonal.
    ///
    /// If the body is distributed, the columns of `rows` and the displacements of `free` belong to the owned and ghost nodes of this rank.
    pub fn new(
        dofs: usize,
        prescribed: Vec<(usize, f64)>,
        rows: Csr,
        free: &[FreeMotion],
        distribution: Option<Rc<Distribution>>,
    ) -> Self {
        let mut states = Self { dofs, prescribed, rows, distribution, ..Self::default() };
        states.orthogonalise(free);
        let Some(distribution) = &states.distribution else { return states };
        let place = |dof: usize| distribution.places.binary_search(&(dof as u32)).ok();
        states.rows = states.rows.of_columns(distribution.places.len(), place);
        states.motions.iter_mut().for_each(|motion| *motion = distribution.of_known(motion).into());
        if !distribution.leads {
            states.work.fill(0.0);
        }
        states
    }

    /// Append the rigid motions `free`, made orthogonal, with their traces and the work of loads on them.
    fn orthogonalise(&mut self, free: &[FreeMotion]) {
        let mut combinations: Vec<DVector<f64>> = Vec::new();
        for (number, FreeMotion { displacement, work }) in free.iter().enumerate() {
            let (mut motion, mut work) = (displacement.clone(), *work);
            // the motion as amounts of those in `free`
            let mut combination = DVector::from_fn(free.len(), |k, _| f64::from(u8::from(k == number)));
            // Gram-Schmidt, done twice for orthogonality to rounding
            for _ in 0..2 {
                for (k, other) in combinations.iter().enumerate() {
                    let earlier = (&self.motions[k][..], other);
                    let part = self.product(earlier, (&motion, &combination)) / self.squares[k];
                    axpy(-part, &self.motions[k], &mut motion);
                    combination.axpy(-part, other, 1.0);
                    work -= part * self.work[k];
                }
            }
            let square = self.product((&motion, &combination), (&motion, &combination));
            let scale = log2(square.sqrt()).floor().exp2();
            motion.iter_mut().for_each(|u| *u /= scale);
            combination /= scale;
            self.squares.push(self.product((&motion, &combination), (&motion, &combination)));
            let mut trace = vec![0.0; self.rows.rows()];
            self.rows.multiply(&motion, &mut trace);
            self.traces.push(trace);
            self.work.push(work / scale);
            self.motions.push(motion.into());
            combinations.push(combination);
        }
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

    /// Return whether this rank owns the body. Then forces on rigid motions belong to it.
    pub fn leads(&self) -> bool {
        self.distribution.as_ref().is_none_or(|distribution| distribution.leads)
    }

    /// Return the number of rigid motions. A state ends with one amount for each.
    pub fn rigid(&self) -> usize {
        self.motions.len()
    }

    /// Return the length of a state.
    pub fn size(&self) -> usize {
        self.dofs + self.rigid()
    }

    /// Return the undeformed state: zero on free dofs, prescribed values on supports.
    pub fn rest(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.size()];
        self.prescribed.iter().for_each(|&(dof, value)| u[dof] = value);
        u
    }

    /// Return the contact rows in the columns of the matrix that has the rows of K.
    pub fn matrix_rows(&self) -> &Csr {
        self.distribution.as_ref().map_or(&self.rows, |distribution| &distribution.rows)
    }

    /// Compute t = B u, the outer normal displacement at each row, without what prescribed dofs contribute.
    pub fn trace(&self, u: &[f64], t: &mut [f64]) {
        let (v, rigid) = u.split_at(self.dofs);
        self.rows.multiply(v, t);
        if self.leads() {
            self.traces.iter().zip(rigid).for_each(|(trace, &a)| axpy(a, trace, t));
        }
    }

    /// Add s B' rows to y: forces at the contact rows as forces at the dofs and on the rigid motions.
    pub fn add_rows(&self, s: f64, rows: &[f64], y: &mut [f64]) {
        let (y, rigid) = y.split_at_mut(self.dofs);
        self.rows.add_transpose(s, rows, y);
        if self.leads() {
            self.traces.iter().zip(rigid).for_each(|(trace, y)| *y += s * dot(trace, rows));
        }
    }

    /// Move the rigid part of the dofs of a state to the entries for rigid motions at its end.
    pub fn separate(&self, state: &mut [f64]) {
        let (dofs, rigid) = state.split_at_mut(state.len() - self.rigid());
        let parts = self.sums(self.motions.iter().map(|motion| dot(motion, dofs)));
        for (k, part) in parts.into_iter().enumerate() {
            let amount = part / self.squares[k];
            axpy(-amount, &self.motions[k], dofs);
            rigid[k] += amount;
        }
    }

    /// Return the displacements v + R a of the dofs of a state.
    pub fn join(&self, state: &[f64]) -> Vec<f64> {
        let (dofs, rigid) = state.split_at(state.len() - self.rigid());
        let mut u = dofs.to_vec();
        self.motions.iter().zip(rigid).for_each(|(motion, &a)| axpy(a, motion, &mut u));
        u
    }

    /// Return the displacements of the owned and ghost nodes of this rank for a state. Collective for a distributed body.
    pub fn recover(&self, state: &[f64]) -> Vec<f64> {
        let owned = self.join(state);
        match &self.distribution {
            None => owned,
            Some(distribution) => distribution.near(&owned),
        }
    }

    /// Return a load on all dofs of the body as a force on a state. What acts on supports is left out.
    pub fn reduce(&self, load: &[f64]) -> Vec<f64> {
        let mut r = match &self.distribution {
            None => load.to_vec(),
            Some(distribution) => distribution.scatter(load),
        };
        self.prescribed.iter().for_each(|&(dof, _)| r[dof] = 0.0);
        r.extend(self.rigid_part(&r));
        r
    }

    /// Return R'r for a force r at the dofs.
    pub fn rigid_part(&self, force: &[f64]) -> Vec<f64> {
        self.motions.iter().map(|motion| dot(motion, force)).collect()
    }

    /// Correct the dofs of a force so that their rigid part R'r is the one at its end.
    pub fn balance(&self, force: &mut [f64]) {
        let (dofs, rigid) = force.split_at_mut(force.len() - self.rigid());
        let lacking = self.sums(self.motions.iter().zip(&*rigid).map(|(motion, part)| part - dot(motion, dofs)));
        for (k, lacking) in lacking.into_iter().enumerate() {
            axpy(lacking / self.squares[k], &self.motions[k], dofs);
        }
    }
}

/// The distribution of the dofs of a body over the ranks, as one of them sees it: the dofs that it owns, and their places in the
/// distributed matrix that has their rows of K. The matrix is that of all bodies, or one of the body's own.
///
/// A state is (v, a): v has the dofs that this rank owns, and the rigid motion a is the same on all ranks. Every rank has a part of a
/// force, also of the force on the rigid motion, so that work is a sum over ranks.
#[derive(Clone, Serialize, Deserialize)]
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
        let states = States::new(6, Vec::new(), rows, &free, None);
        assert_eq!(states.traces[0], [1.0; 3]);
        assert!(dot(&states.motions[0], &states.motions[1]).abs() < 1e-15);
        // half of the first motion is taken away from the second, with its work
        assert_eq!(states.work[0], 3.0);
        let shape = states.motions[1][1] / 0.5;
        assert!((states.work[1] - 1.5 * shape).abs() < 1e-14);
        let u = [0.3, 1.0, -0.2, 0.4, 0.7, -2.0];
        let mut state = [&u[..], &[0.0, 0.0]].concat();
        states.separate(&mut state);
        assert!(states.motions.iter().all(|motion| dot(motion, &state[..6]).abs() < 1e-15));
        assert!(states.join(&state).iter().zip(u).all(|(a, b)| (a - b).abs() < 1e-15));
        let mut force = [&u[..], &[0.25, -4.0]].concat();
        states.balance(&mut force);
        let parts = states.rigid_part(&force[..6]);
        assert!((parts[0] - 0.25).abs() < 1e-15 && (parts[1] + 4.0).abs() < 1e-14, "{parts:?}");
    }
}
