//! A body whose state is all its dofs and its rigid motion, and whose G is a sparse matrix.

use super::{InnerSolver, Split};
use crate::error::{Error, Kind, Result};
use crate::fem::{ElasticBody, rigid::FreeMotion};
use crate::linalg::{Csr, dot};
use crate::model::{Body, BodyCounts, Energy, Matrices, Solved};
use std::time::Instant;

/// A body with assembled K and f, its contact rows B, and a solver for G = K + B' diag(d) B.
///
/// A state is (v, a) for the displacement v + R a ([`Split`]).
pub struct SparseBody<S> {
    body: ElasticBody,
    rows: Csr,
    split: Split,
    solver: Solver<S>,
    /// Robin weight of each row that G has now.
    weight: Vec<f64>,
    /// Robin weight of each row when G was last far from what its preconditioner was made of.
    prepared: Vec<f64>,
    /// b diag(K) b' of each row.
    row_stiffness: Vec<f64>,
    coupling: Coupling,
    counts: BodyCounts,
    /// Symbolic and numeric factorisations before the counts began.
    before: (usize, usize),
    product: Vec<f64>,
}

impl<S: InnerSolver> SparseBody<S> {
    /// Joins a body, its contact rows (columns: its dofs, none of them prescribed) and a solver that `make` makes of K, on a
    /// pattern that holds B'B, when something is first to be solved. `free` are the rigid motions that its supports leave.
    pub fn new(
        body: ElasticBody,
        rows: Csr,
        free: &[FreeMotion],
        make: impl FnOnce(&Csr) -> Result<S> + 'static,
        words: String,
    ) -> Self {
        let solver = Solver::Later { make: Some(Box::new(make)), words };
        let coupling = Coupling::new(&body.stiffness, &rows);
        let split = Split::new(free, &rows);
        let weight = vec![0.0; rows.rows()];
        let prepared = weight.clone();
        let row_stiffness = body.row_stiffness(&rows);
        let product = vec![0.0; body.load.len()];
        let (counts, before) = (BodyCounts::default(), (0, 0));
        Self { body, rows, split, solver, weight, prepared, row_stiffness, coupling, counts, before, product }
    }

    /// Displacements of all dofs for a state.
    pub fn join(&self, u: &[f64]) -> Vec<f64> {
        self.split.join(u)
    }

    fn dofs(&self) -> usize {
        self.body.load.len()
    }
}

/// Makes a solver of K.
type Maker<S> = Box<dyn FnOnce(&Csr) -> Result<S>>;

/// An inner solver, made when it is first needed: a body that is only measured, or joined with others, needs none.
enum Solver<S> {
    Later {
        make: Option<Maker<S>>,
        /// What it will be, for reports.
        words: String,
    },
    Now(S),
}

impl<S> Solver<S> {
    /// The solver, made of K if it is not there.
    fn of(&mut self, stiffness: &Csr) -> Result<&mut S> {
        if let Solver::Later { make, .. } = self
            && let Some(make) = make.take()
        {
            *self = Solver::Now(make(stiffness)?);
        }
        match self {
            Solver::Now(solver) => Ok(solver),
            Solver::Later { .. } => Err(Error::new(Kind::Solver, "an inner solver could not be made")),
        }
    }

    /// The solver, if it was made.
    fn made(&self) -> Option<&S> {
        match self {
            Solver::Now(solver) => Some(solver),
            Solver::Later { .. } => None,
        }
    }
}

/// Where B' diag(d) B goes in the values of G.
struct Coupling {
    /// Positions in the values that some row touches, sorted, each once.
    touched: Vec<u32>,
    /// (index into `touched`, row, b_i b_j).
    terms: Vec<(u32, u32, f64)>,
}

impl Coupling {
    fn new(pattern: &Csr, rows: &Csr) -> Self {
        let mut places = Vec::new();
        for q in 0..rows.rows() {
            for (i, a) in rows.row(q) {
                for (j, b) in rows.row(q) {
                    match pattern.position(i, j) {
                        Some(position) => places.push((position as u32, q as u32, a * b)),
                        None => unreachable!("the pattern holds the couplings of every contact row"),
                    }
                }
            }
        }
        places.sort_by_key(|place| (place.0, place.1));
        let mut touched: Vec<u32> = Vec::new();
        let terms = places
            .into_iter()
            .map(|(position, q, product)| {
                if touched.last() != Some(&position) {
                    touched.push(position);
                }
                (touched.len() as u32 - 1, q, product)
            })
            .collect();
        Self { touched, terms }
    }

    /// Writes K + B' diag(d) B where it differs from K; the rest of G is K already.
    fn write(&self, stiffness: &[f64], weight: &[f64], g: &mut [f64]) {
        for &position in &self.touched {
            g[position as usize] = stiffness[position as usize];
        }
        for &(slot, q, product) in &self.terms {
            g[self.touched[slot as usize] as usize] += weight[q as usize] * product;
        }
    }
}

/// Growth of the stiffness under a contact point, either way, beyond which a preconditioner is poor.
const FAR: f64 = 3.0;

/// One row in so many may be far: each is an eigenvalue apart from the others, and costs conjugate gradients about one step.
const FEW: usize = 64;

/// Whether Robin terms `old` and `new` change the stiffness under too many contact rows by more than [`FAR`]. The eigenvalues of
/// G_old^-1 G_new lie between the least and the largest ratio of the weights; where the body is stiff beside the Robin term
/// they do not come near that, and only the sum of both counts.
fn is_far(rows: &Csr, row_stiffness: &[f64], old: &[f64], new: &[f64]) -> bool {
    let far = |q: &usize| {
        let square: f64 = rows.row(*q).map(|(_, b)| b * b).sum();
        let (before, after) =
            (row_stiffness[*q] + old[*q] * square * square, row_stiffness[*q] + new[*q] * square * square);
        after > FAR * before || before > FAR * after
    };
    (0..rows.rows()).filter(far).nth(rows.rows() / FEW).is_some()
}

impl<S: InnerSolver> SparseBody<S> {
    /// One solve, or one application of the preconditioner, counted and timed apart from the set-up it may need.
    fn apply(&mut self, z: &mut [f64], solve: impl FnOnce(&mut S, &mut [f64]) -> Result<Solved>) -> Result<Solved> {
        self.set_up()?;
        self.counts.solves += 1;
        let began = Instant::now();
        let solver = self.solver.of(&self.body.stiffness)?;
        let solved = solve(solver, &mut z[..self.body.load.len()])?;
        self.counts.solve_seconds += began.elapsed().as_secs_f64();
        self.counts.inner_iterations += solved.iterations;
        z[self.body.load.len()..].fill(0.0);
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

    fn residual(&mut self, u: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        let n = self.dofs();
        let (v, rigid) = u.split_at(n);
        self.body.stiffness.multiply(v, &mut self.product);
        for i in 0..n {
            r[i] = self.body.load[i] - self.product[i];
        }
        let work = dot(&self.body.load, v) + dot(self.split.work(), rigid);
        let quadratic = dot(v, &self.product);
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
        self.body.stiffness.multiply(&u[..n], &mut y[..n]);
        y[n..].fill(0.0);
    }

    fn robin(&mut self, weight: &[f64]) -> Result<()> {
        if weight == self.weight {
            self.counts.robin_skipped += 1;
            return Ok(());
        }
        self.weight.copy_from_slice(weight);
        self.counts.robin_updates += 1;
        let (coupling, stiffness) = (&self.coupling, &self.body.stiffness.values);
        let far = is_far(&self.rows, &self.row_stiffness, &self.prepared, weight);
        if far {
            self.prepared.copy_from_slice(weight);
        }
        self.solver.of(&self.body.stiffness)?.update(&mut |g| coupling.write(stiffness, weight, g), far)
    }

    fn set_up(&mut self) -> Result<()> {
        let began = Instant::now();
        let done = self.solver.of(&self.body.stiffness).and_then(InnerSolver::set_up);
        let seconds = began.elapsed().as_secs_f64();
        self.counts.factor_seconds += seconds;
        if self.counts.first_seconds == 0.0 {
            self.counts.first_seconds = seconds;
        }
        done
    }

    fn precision(&mut self, rtol: f64) -> Result<bool> {
        self.solver.of(&self.body.stiffness)?.precision(rtol)
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        let n = self.dofs();
        self.apply(z, |solver, z| solver.solve(&r[..n], z))
    }

    fn accuracy(&self) -> f64 {
        self.solver.made().map_or(1.0, InnerSolver::accuracy)
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        let n = self.dofs();
        self.apply(z, |solver, z| solver.precondition(&r[..n], z))
    }

    fn rounding(&self, u: &[f64], force: &[f64]) -> f64 {
        let k = &self.body.stiffness;
        let mut size: Vec<f64> = self.body.load.iter().map(|f| f.abs()).collect();
        for (i, size) in size.iter_mut().enumerate() {
            *size += k.row(i).map(|(j, a)| (a * u[j]).abs()).sum::<f64>();
        }
        for q in 0..self.rows.rows() {
            for (i, b) in self.rows.row(q) {
                size[i] += (b * force[q]).abs();
            }
        }
        let diagonal = |i: usize| k.position(i, i).map_or(f64::INFINITY, |at| k.values[at]);
        let sum: f64 = size.iter().enumerate().map(|(i, size)| size * size / diagonal(i)).sum();
        sum * f64::EPSILON * f64::EPSILON
    }

    fn reduce(&mut self, load: &[f64]) -> Result<Vec<f64>> {
        let mut r = load.to_vec();
        self.body.prescribed.iter().for_each(|&(dof, _)| r[dof] = 0.0);
        r.extend(self.split.rigid_part(&r));
        Ok(r)
    }

    fn counts(&self) -> BodyCounts {
        let Some(solver) = self.solver.made() else { return self.counts };
        let (symbolic, factorizations) = solver.factorizations();
        let (symbolic, factorizations) = (symbolic - self.before.0, factorizations - self.before.1);
        if solver.is_dense() {
            return BodyCounts { dense_factorizations: factorizations, ..self.counts };
        }
        BodyCounts { symbolic, factorizations, ..self.counts }
    }

    fn begin_anew(&mut self) {
        self.before = self.solver.made().map_or((0, 0), InnerSolver::factorizations);
        self.counts = BodyCounts::default();
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

    fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        Ok(self.join(u))
    }

    fn carried(&self) -> &[f64] {
        &self.body.carried
    }

    fn describe(&self) -> String {
        match &self.solver {
            Solver::Now(solver) => solver.describe(),
            Solver::Later { words, .. } => words.clone(),
        }
    }
}
