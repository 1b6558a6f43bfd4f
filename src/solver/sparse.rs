//! A body whose state has all its dofs and its rigid motion.

use super::{InnerSolver, RobinMatrix};
use crate::error::{Error, Kind, Result};
use crate::fem::rigid::FreeMotion;
use crate::fem::{Couplings, ElasticBody};
use crate::linalg::portable::log2;
use crate::linalg::{Csr, axpy, dot};
use crate::model::{Body, BodyCounts, Distribution, Energy, Matrices, Solved};
use crate::petsc::Rows;
use nalgebra::DVector;
use std::rc::Rc;

/// A body with assembled K and f, its contact rows B, and a solver for G = K + B' diag(d) B.
///
/// A state is (v, a) for the displacement v + R a (`RigidSplit`).
pub struct SparseBody<S> {
    body: ElasticBody,
    rows: Csr,
    split: RigidSplit,
    /// How its dofs are distributed over the ranks, if they are. K and B then have the dofs that this rank owns. The columns of K are those of the
    /// distributed matrix that has its rows.
    distribution: Option<Rc<Distribution>>,
    robin: Lazy<S>,
    /// The size of each row of K, if K itself is in the solver or was given away; else empty.
    sizes: Vec<RowSize>,
}

/// The matrix G, which is made when something is first solved. A body that is only measured, or joined with others, needs none.
enum Lazy<S> {
    Later {
        /// The function that makes a solver of K; `None` if it has failed.
        make: Option<SolverBuilder<S>>,
        /// Description of the solver to be made, for reports.
        words: String,
    },
    Now(Box<RobinMatrix<S>>),
}

/// A function that makes a solver of K.
type SolverBuilder<S> = Box<dyn FnOnce(Rows) -> Result<S>>;

/// What remains of a row of K.
struct RowSize {
    diagonal: f64,
    /// Sum of the magnitudes of all entries.
    sum: f64,
}

impl<S: InnerSolver> SparseBody<S> {
    /// Join a body, whose K has a pattern that holds that of B'B, its contact rows B (columns: its dofs, none of them prescribed), and the rigid motions
    /// `free` that its supports leave. `make` makes a solver of K when something is first solved, and `words` describe that solver.
    ///
    /// A distributed body has the dofs that this rank owns, while `rows` and `free` have those of its owned and ghost nodes. If the body gets a matrix of its
    /// own, that is distributed over all ranks.
    pub fn new(
        mut body: ElasticBody,
        rows: Csr,
        free: &[FreeMotion],
        distribution: Option<Distribution>,
        make: impl FnOnce(Rows) -> Result<S> + 'static,
        words: String,
    ) -> Self {
        let robin = Lazy::Later { make: Some(Box::new(make)), words };
        let distribution = distribution.map(Rc::new);
        let split = RigidSplit::new(free, &rows, distribution.clone());
        body.held = Couplings::default();
        let owned = |places: &[u32]| rows.of_columns(places.len(), |dof| places.binary_search(&(dof as u32)).ok());
        let rows = distribution.as_ref().map(|distribution| owned(&distribution.places)).unwrap_or(rows);
        Self { body, rows, split, distribution, robin, sizes: Vec::new() }
    }

    /// Replace the loads by those of a body without K, and keep K. The work of the loads on the motions that supports leave is in `free`.
    pub fn reload(&mut self, with_loads: ElasticBody, free: &[FreeMotion]) {
        self.body = ElasticBody { stiffness: std::mem::take(&mut self.body.stiffness), ..with_loads };
        self.split = RigidSplit::new(free, &self.rows, None);
    }

    /// Return the displacements of all dofs for a state.
    pub fn join(&self, u: &[f64]) -> Vec<f64> {
        self.split.join(u)
    }

    /// Return the number of dofs of a state, which its rigid motions follow.
    fn dofs(&self) -> usize {
        self.body.load.len()
    }

    /// Return G, which is made of K first if it does not exist.
    fn robin_matrix(&mut self) -> Result<&mut RobinMatrix<S>> {
        if let Lazy::Later { make, .. } = &mut self.robin
            && let Some(make) = make.take()
        {
            let stiffness = if S::HAS_ROWS { self.take_stiffness() } else { self.body.stiffness.clone() };
            let diagonal = |i: usize| self.sizes.get(i).map_or_else(|| stiffness.diagonal(i), |size| size.diagonal);
            let square = |q: usize| self.rows.row(q).map(|(i, b)| b * b * diagonal(i)).sum();
            let mut row_stiffness: Vec<f64> = (0..self.rows.rows()).map(square).collect();
            if let Some(distribution) = &self.distribution {
                distribution.exchange.sum(&mut row_stiffness);
            }
            let start = self.distribution.as_ref().map(|distribution| distribution.start);
            let rows = matrix_rows(&self.rows, &self.distribution);
            let matrix = RobinMatrix::new(super::rows(stiffness, start)?, rows, row_stiffness, None, make)?;
            self.robin = Lazy::Now(Box::new(matrix));
        }
        match &mut self.robin {
            Lazy::Now(robin) => Ok(robin),
            Lazy::Later { .. } => Err(Error::new(Kind::Solver, "an inner solver could not be made")),
        }
    }

    /// Return K and keep the sizes of its rows.
    fn take_stiffness(&mut self) -> Csr {
        let k = std::mem::replace(&mut self.body.stiffness, Csr::new(0));
        let first = self.distribution.as_ref().map_or(0, |distribution| distribution.first);
        let diagonal = |i: usize| k.position(i, first + i).map_or(0.0, |at| k.values[at]);
        let size = |i: usize| RowSize { diagonal: diagonal(i), sum: k.row(i).map(|(_, a)| a.abs()).sum() };
        self.sizes = (0..k.rows()).map(size).collect();
        k
    }

    /// Return G, if it was made.
    fn made(&self) -> Option<&RobinMatrix<S>> {
        match &self.robin {
            Lazy::Now(robin) => Some(robin),
            Lazy::Later { .. } => None,
        }
    }

    /// Make one solve, or one application of the preconditioner.
    fn apply(&mut self, z: &mut [f64], solve: impl FnOnce(&mut S, &mut [f64]) -> Result<Solved>) -> Result<Solved> {
        let n = self.dofs();
        let solved = self.robin_matrix()?.apply(|solver| solve(solver, &mut z[..n]))?;
        z[n..].fill(0.0);
        self.split.separate(z);
        Ok(solved)
    }
}

/// Return the contact rows in the columns of the matrix that has the rows of K.
fn matrix_rows<'a>(rows: &'a Csr, distribution: &'a Option<Rc<Distribution>>) -> &'a Csr {
    distribution.as_ref().map_or(rows, |distribution| &distribution.rows)
}

impl<S: InnerSolver> Body for SparseBody<S> {
    fn state_len(&self) -> usize {
        self.dofs() + self.split.count()
    }

    fn rest(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.state_len()];
        for &(dof, value) in &self.body.prescribed {
            u[dof] = value;
        }
        u
    }

    fn trace(&self, u: &[f64], t: &mut [f64]) {
        let (v, rigid) = u.split_at(self.dofs());
        self.rows.multiply(v, t);
        self.split.add_trace(rigid, t);
    }

    fn add_rows(&self, rows: &[f64], y: &mut [f64]) {
        let (y, rigid) = y.split_at_mut(self.dofs());
        self.rows.add_transpose(1.0, rows, y);
        self.split.add_rows(1.0, rows, rigid);
    }

    fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        let n = self.dofs();
        let (v, rigid) = u.split_at(n);
        for i in 0..n {
            r[i] = self.body.load[i] - product[i];
        }
        let work = dot(&self.body.load, v) + dot(self.split.work(), rigid);
        let quadratic = dot(v, &product[..n]);
        self.rows.add_transpose(-1.0, force, &mut r[..n]);
        r[n..].copy_from_slice(self.split.work());
        self.split.add_rows(-1.0, force, &mut r[n..]);
        self.split.balance(r);
        Energy {
            strain: quadratic + 2.0 * dot(&self.body.lifting, v) + self.body.strain_constant,
            potential: 0.5 * quadratic - work + self.body.energy_constant,
        }
    }

    fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]) {
        let n = self.dofs();
        let rows = matrix_rows(&self.rows, &self.distribution);
        match &mut self.robin {
            Lazy::Now(robin) if S::HAS_ROWS => robin.multiply_stiffness(rows, &u[..n], &mut y[..n]),
            _ => self.body.stiffness.multiply(&u[..n], &mut y[..n]),
        }
        y[n..].fill(0.0);
    }

    fn give_stiffness(&mut self) -> Option<Csr> {
        self.made().is_none().then(|| self.take_stiffness())
    }

    fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.robin_matrix()?;
        let rows = matrix_rows(&self.rows, &self.distribution);
        match &mut self.robin {
            Lazy::Now(robin) => robin.update(rows, weight),
            Lazy::Later { .. } => Ok(()),
        }
    }

    fn set_up(&mut self) -> Result<()> {
        self.robin_matrix()?.set_up()
    }

    fn precision(&mut self, rtol: f64) -> Result<bool> {
        self.robin_matrix()?.solver_mut().precision(rtol)
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        let n = self.dofs();
        self.apply(z, |solver, z| solver.solve(&r[..n], z))
    }

    fn accuracy(&self) -> f64 {
        self.made().map_or(1.0, |robin| robin.solver().accuracy())
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        let n = self.dofs();
        self.apply(z, |solver, z| solver.precondition(&r[..n], z))
    }

    fn rounding(&self, u: &[f64], force: &[f64]) -> f64 {
        let k = &self.body.stiffness;
        let mut size: Vec<f64> = self.body.load.iter().map(|f| f.abs()).collect();
        for (i, size) in size.iter_mut().enumerate() {
            *size += match self.sizes.get(i) {
                None => k.row(i).map(|(j, a)| (a * u[j]).abs()).sum::<f64>(),
                // without K, neighbours are taken to move by as much
                Some(row) => row.sum * u[i].abs(),
            };
        }
        for q in 0..self.rows.rows() {
            for (i, b) in self.rows.row(q) {
                size[i] += (b * force[q]).abs();
            }
        }
        let diagonal = |i: usize| match self.sizes.get(i) {
            None => k.position(i, i).map_or(f64::INFINITY, |at| k.values[at]),
            Some(row) => row.diagonal,
        };
        let sum: f64 = size.iter().enumerate().map(|(i, size)| size * size / diagonal(i)).sum();
        sum * f64::EPSILON * f64::EPSILON
    }

    fn reduce(&mut self, load: &[f64]) -> Result<Vec<f64>> {
        let mut r = match &self.distribution {
            None => load.to_vec(),
            Some(distribution) => distribution.scatter(load),
        };
        self.body.prescribed.iter().for_each(|&(dof, _)| r[dof] = 0.0);
        r.extend(self.split.rigid_part(&r));
        Ok(r)
    }

    fn counts(&self) -> BodyCounts {
        self.made().map_or_else(BodyCounts::default, |robin| robin.counts())
    }

    fn begin_anew(&mut self) {
        if let Lazy::Now(robin) = &mut self.robin {
            robin.begin_anew();
        }
    }

    fn matrices(&self) -> Option<Matrices<'_>> {
        let (motions, traces) = (self.split.motions(), self.split.traces());
        Some(Matrices { stiffness: &self.body.stiffness, rows: &self.rows, motions, traces })
    }

    fn rigid(&self) -> usize {
        self.split.count()
    }

    fn separate(&self, state: &mut [f64]) {
        self.split.separate(state);
    }

    fn distribution(&self) -> Option<&Distribution> {
        self.distribution.as_deref()
    }

    fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        let owned = self.join(u);
        Ok(match &self.distribution {
            None => owned,
            Some(distribution) => distribution.near(&owned),
        })
    }

    fn carried(&self) -> &[f64] {
        &self.body.carried
    }

    fn describe(&self) -> String {
        match &self.robin {
            Lazy::Now(robin) => robin.solver().describe(),
            Lazy::Later { words, .. } => words.clone(),
        }
    }
}

/// Orthogonal rigid motions that a body's supports leave free, with their traces on its contact rows.
///
/// Displacements are stored as deformation and rigid motion apart.
///
/// K R = 0 holds for the rigid motions R that supports leave free, but only in exact numbers. Entries of K and u are rounded, and
/// f - K u has an error of eps |K| |u| however it is summed. A body that falls far onto a soft layer loses its strains in that error. So
/// its displacement is v + R a with v orthogonal to R, a state is (v, a), and K multiplies v alone. A force is (r, R'r), so that the product of a force and a
/// state is the work on the displacement. The rigid part R'r comes from loads and contact forces, without K.
#[derive(Default)]
pub struct RigidSplit {
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

impl RigidSplit {
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
        let split = RigidSplit::new(&free, &rows, None);
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
