//! A body whose state is all its dofs and its rigid motion, and whose G is a sparse matrix.

use super::{InnerSolver, RobinMatrix, Split};
use crate::error::{Error, Kind, Result};
use crate::fem::{Couplings, ElasticBody, rigid::FreeMotion};
use crate::linalg::{Csr, dot};
use crate::model::{Body, BodyCounts, Distribution, Energy, Matrices, Solved};
use crate::petsc::Rows;
use std::rc::Rc;

/// A body with assembled K and f, its contact rows B, and a solver for G = K + B' diag(d) B.
///
/// A state is (v, a) for the displacement v + R a ([`Split`]).
pub struct SparseBody<S> {
    body: ElasticBody,
    rows: Csr,
    split: Split,
    /// Where its dofs are dealt out over the ranks: how. K and B have the dofs of this rank then, K with the columns of the matrix that its
    /// rows are in.
    distribution: Option<Rc<Distribution>>,
    robin: Lazy<S>,
    /// Diagonal and sum of magnitudes of each row of K, if the solver has it or it was given away.
    sizes: Vec<[f64; 2]>,
}

/// G, made when something is first to be solved: a body that is only measured, or joined with others, needs none.
enum Lazy<S> {
    Later {
        /// Makes a solver of K; gone if it failed.
        make: Option<Maker<S>>,
        /// What it will be, for reports.
        words: String,
    },
    Now(Box<RobinMatrix<S>>),
}

/// Makes a solver of K.
type Maker<S> = Box<dyn FnOnce(Rows) -> Result<S>>;

impl<S: InnerSolver> SparseBody<S> {
    /// Joins a body, its contact rows (columns: its dofs, none of them prescribed) and a solver that `make` makes of K, on a
    /// pattern that holds B'B, when something is first to be solved. `free` are the rigid motions that its supports leave. Where the body is
    /// dealt out, it has its own dofs, and rows and motions those of the nodes that this rank knows; the matrix, if it gets one of its own,
    /// is one of all ranks.
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
        let split = Split::new(free, &rows, distribution.clone());
        body.held = Couplings::default();
        let own = |places: &Vec<u32>| rows.of_columns(places.len(), |dof| places.binary_search(&(dof as u32)).ok());
        let rows = distribution.as_ref().map(|distribution| own(&distribution.places)).unwrap_or(rows);
        Self { body, rows, split, distribution, robin, sizes: Vec::new() }
    }

    /// Takes the loads of a body without K on the K that is here; their work on the motions that its supports leave is in `free`.
    pub fn reload(&mut self, loaded: ElasticBody, free: &[FreeMotion]) {
        self.body = ElasticBody { stiffness: std::mem::take(&mut self.body.stiffness), ..loaded };
        self.split = Split::new(free, &self.rows, None);
    }

    /// Displacements of all dofs for a state.
    pub fn join(&self, u: &[f64]) -> Vec<f64> {
        self.split.join(u)
    }

    fn dofs(&self) -> usize {
        self.body.load.len()
    }

    /// G, made of K if it is not there.
    fn robin_matrix(&mut self) -> Result<&mut RobinMatrix<S>> {
        if let Lazy::Later { make, .. } = &mut self.robin
            && let Some(make) = make.take()
        {
            let stiffness = if S::HAS_ROWS { self.take_stiffness() } else { self.body.stiffness.clone() };
            let diagonal = |i: usize| self.sizes.get(i).map_or_else(|| stiffness.diagonal(i), |sizes| sizes[0]);
            let square = |q: usize| self.rows.row(q).map(|(i, b)| b * b * diagonal(i)).sum();
            let mut row_stiffness: Vec<f64> = (0..self.rows.rows()).map(square).collect();
            let (mut start, mut rows) = (None, &self.rows);
            if let Some(distribution) = &self.distribution {
                distribution.exchange.sum(&mut row_stiffness);
                (start, rows) = (Some(distribution.start), &distribution.rows);
            }
            let matrix = RobinMatrix::new(super::rows(stiffness, start)?, rows, row_stiffness, make)?;
            self.robin = Lazy::Now(Box::new(matrix));
        }
        match &mut self.robin {
            Lazy::Now(robin) => Ok(robin),
            Lazy::Later { .. } => Err(Error::new(Kind::Solver, "an inner solver could not be made")),
        }
    }

    /// K, of which diagonal and sizes stay.
    fn take_stiffness(&mut self) -> Csr {
        let k = std::mem::replace(&mut self.body.stiffness, Csr::new(0));
        let first = self.distribution.as_ref().map_or(0, |distribution| distribution.first);
        let diagonal = |i: usize| k.position(i, first + i).map_or(0.0, |at| k.values[at]);
        let sizes = |i: usize| [diagonal(i), k.row(i).map(|(_, a)| a.abs()).sum()];
        self.sizes = (0..k.rows()).map(sizes).collect();
        k
    }

    /// G, if it was made.
    fn made(&self) -> Option<&RobinMatrix<S>> {
        match &self.robin {
            Lazy::Now(robin) => Some(robin),
            Lazy::Later { .. } => None,
        }
    }

    /// One solve, or one application of the preconditioner.
    fn apply(&mut self, z: &mut [f64], solve: impl FnOnce(&mut S, &mut [f64]) -> Result<Solved>) -> Result<Solved> {
        let n = self.dofs();
        let solved = self.robin_matrix()?.apply(|solver| solve(solver, &mut z[..n]))?;
        z[n..].fill(0.0);
        self.split.separate(z);
        Ok(solved)
    }
}

impl<S: InnerSolver> Body for SparseBody<S> {
    fn len(&self) -> usize {
        self.dofs() + self.split.count()
    }

    fn rest(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.len()];
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
        let rows = self.distribution.as_ref().map_or(&self.rows, |distribution| &distribution.rows);
        match &mut self.robin {
            Lazy::Now(robin) if S::HAS_ROWS => robin.multiply_stiffness(rows, &u[..n], &mut y[..n]),
            _ => self.body.stiffness.multiply(&u[..n], &mut y[..n]),
        }
        y[n..].fill(0.0);
    }

    fn give_stiffness(&mut self) -> Option<Csr> {
        if self.made().is_some() {
            return None;
        }
        Some(self.take_stiffness())
    }

    fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.robin_matrix()?;
        let rows = self.distribution.as_ref().map_or(&self.rows, |distribution| &distribution.rows);
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
                // neighbours move by about as much
                Some([_, row]) => row * u[i].abs(),
            };
        }
        for q in 0..self.rows.rows() {
            for (i, b) in self.rows.row(q) {
                size[i] += (b * force[q]).abs();
            }
        }
        let diagonal = |i: usize| match self.sizes.get(i) {
            None => k.position(i, i).map_or(f64::INFINITY, |at| k.values[at]),
            Some([diagonal, _]) => *diagonal,
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
        let own = self.join(u);
        Ok(match &self.distribution {
            None => own,
            Some(distribution) => distribution.near(&own),
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
