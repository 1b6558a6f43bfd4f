//! A body whose state has all its dofs and its rigid motion.

use super::{InnerSolver, RobinMatrix};
use crate::error::{Error, Kind, Result};
use crate::fem::{Couplings, ElasticBody};
use crate::linalg::{Csr, dot};
use crate::model::{Body, BodyCounts, Distribution, Energy, FreeMotion, Solved, States};
use crate::petsc::Rows;
use std::rc::Rc;

/// A body with assembled K and f, its contact rows B, and a solver for G = K + B' diag(d) B.
///
/// A state is (v, a) for the displacement v + R a ([`States`]). If the body is distributed, K has the dofs that this rank owns, and its
/// columns are those of the distributed matrix that has its rows.
pub struct SparseBody<S> {
    body: ElasticBody,
    states: States,
    robin: Lazy<S>,
    /// The diagonal of K, if K itself is in the solver or was given away; else empty.
    diagonal: Vec<f64>,
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
        body.held = Couplings::default();
        let prescribed = std::mem::take(&mut body.prescribed);
        let states = States::new(body.load.len(), prescribed, rows, free, distribution);
        Self { body, states, robin, diagonal: Vec::new() }
    }

    /// Replace the loads by those of a body without K, and keep K. The work of the loads on the motions that supports leave is in `free`.
    pub fn reload(&mut self, with_loads: ElasticBody, free: &[FreeMotion]) {
        self.body = ElasticBody { stiffness: std::mem::take(&mut self.body.stiffness), ..with_loads };
        let rows = std::mem::take(&mut self.states.rows);
        self.states = States::new(self.body.load.len(), Vec::new(), rows, free, None);
    }

    /// Return G, which is made of K first if it does not exist.
    fn robin_matrix(&mut self) -> Result<&mut RobinMatrix<S>> {
        if let Lazy::Later { make, .. } = &mut self.robin
            && let Some(make) = make.take()
        {
            let stiffness = if S::HAS_ROWS { self.take_stiffness() } else { self.body.stiffness.clone() };
            let diagonal = |i: usize| self.diagonal.get(i).map_or_else(|| stiffness.diagonal(i), |value| *value);
            let square = |q: usize| self.states.rows.row(q).map(|(i, b)| b * b * diagonal(i)).sum();
            let mut row_stiffness: Vec<f64> = (0..self.states.rows.rows()).map(square).collect();
            if let Some(distribution) = &self.states.distribution {
                distribution.exchange.sum(&mut row_stiffness);
            }
            let start = self.states.distribution.as_ref().map(|distribution| distribution.start);
            let rows = self.states.matrix_rows();
            let matrix = RobinMatrix::new(super::rows(stiffness, start)?, rows, row_stiffness, None, make)?;
            self.robin = Lazy::Now(Box::new(matrix));
        }
        match &mut self.robin {
            Lazy::Now(robin) => Ok(robin),
            Lazy::Later { .. } => Err(Error::new(Kind::Solver, "an inner solver could not be made")),
        }
    }

    /// Return K and keep its diagonal.
    fn take_stiffness(&mut self) -> Csr {
        let k = std::mem::replace(&mut self.body.stiffness, Csr::new(0));
        let first = self.states.distribution.as_ref().map_or(0, |distribution| distribution.first);
        let diagonal = |i: usize| k.position(i, first + i).map_or(0.0, |at| k.values[at]);
        self.diagonal = (0..k.rows()).map(diagonal).collect();
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
        let n = self.states.dofs;
        let solved = self.robin_matrix()?.apply(|solver| solve(solver, &mut z[..n]))?;
        z[n..].fill(0.0);
        self.states.separate(z);
        Ok(solved)
    }
}

impl<S: InnerSolver> Body for SparseBody<S> {
    fn states(&self) -> &States {
        &self.states
    }

    fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        let n = self.states.dofs;
        let (v, rigid) = u.split_at(n);
        for i in 0..n {
            r[i] = self.body.load[i] - product[i];
        }
        r[n..].copy_from_slice(&self.states.work);
        let work = dot(&self.body.load, v) + dot(&self.states.work, rigid);
        let quadratic = dot(v, &product[..n]);
        self.states.add_rows(-1.0, force, r);
        self.states.balance(r);
        Energy {
            strain: quadratic + 2.0 * dot(&self.body.lifting, v) + self.body.strain_constant,
            potential: 0.5 * quadratic - work + self.body.energy_constant,
        }
    }

    fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]) {
        let n = self.states.dofs;
        let rows = self.states.matrix_rows();
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
        let rows = self.states.matrix_rows();
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
        let n = self.states.dofs;
        self.apply(z, |solver, z| solver.solve(&r[..n], z))
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        let n = self.states.dofs;
        self.apply(z, |solver, z| solver.precondition(&r[..n], z))
    }

    fn unbalanced(&self, r: &[f64], springs: &[f64]) -> f64 {
        let mut diagonal = match self.diagonal.is_empty() {
            true => (0..self.states.dofs).map(|i| self.body.stiffness.diagonal(i)).collect(),
            false => self.diagonal.clone(),
        };
        for (q, spring) in springs.iter().enumerate().filter(|(_, spring)| **spring > 0.0) {
            self.states.rows.row(q).for_each(|(i, b)| diagonal[i] += spring * b * b);
        }
        let squared = |(r, diagonal): (&f64, &f64)| if *r == 0.0 { 0.0 } else { r * r / diagonal };
        r.iter().zip(&diagonal).map(squared).sum()
    }

    fn counts(&self) -> BodyCounts {
        self.made().map_or_else(BodyCounts::default, |robin| robin.counts())
    }

    fn begin_anew(&mut self) {
        if let Lazy::Now(robin) = &mut self.robin {
            robin.begin_anew();
        }
    }

    fn stiffness(&self) -> &Csr {
        &self.body.stiffness
    }

    fn describe(&self) -> String {
        match &self.robin {
            Lazy::Now(robin) => robin.solver().describe(),
            Lazy::Later { words, .. } => words.clone(),
        }
    }
}
