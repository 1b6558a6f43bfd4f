//! The matrix of a linear system with springs at contact points, G = K + B' diag(d) B, and what solves it.

use super::{Change, InnerSolver, RigidSpace, Seen};
use crate::error::Result;
use crate::linalg::Csr;
use crate::model::{BodyCounts, Solved};
use crate::petsc::Rows;
use std::ops::Range;
use std::rc::Rc;
use std::time::Instant;

/// G of one body, or of all bodies together.
///
/// Of K it keeps what G differs from; the rest is in the solver alone. The rows B stay with the owner, who passes the same ones
/// to every call that wants them.
pub struct RobinMatrix<S> {
    solver: S,
    /// Springs d of G, one a row of B.
    weight: Vec<f64>,
    /// Those that the preconditioner bears: what it has seen, at most as stiff as the elements where stiff rows are solved exactly.
    prepared: Vec<f64>,
    /// The springs that double the stiffness under a row.
    soft: Vec<f64>,
    coupling: Coupling,
    /// Rigid motions around the preconditioner, if G is of several bodies.
    coarse: Option<Rc<RigidSpace>>,
    counts: BodyCounts,
    /// The factorisations of the solver before the counts began.
    before: [usize; 3],
}

impl<S: InnerSolver> RobinMatrix<S> {
    /// Starts from G = K, on a pattern that holds B'B; `make` turns K into its solver. `row_stiffness` is b diag(K) b' of each row b,
    /// also of those on other ranks.
    pub fn new(
        stiffness: Rows,
        rows: &Csr,
        row_stiffness: Vec<f64>,
        make: impl FnOnce(Rows) -> Result<S>,
    ) -> Result<Self> {
        let weight = vec![0.0; rows.rows()];
        let square = |q| rows.row(q).map(|(_, b)| b * b).sum::<f64>();
        let soft = row_stiffness.iter().enumerate().map(|(q, stiffness)| stiffness / square(q).powi(2)).collect();
        Ok(Self {
            prepared: weight.clone(),
            weight,
            soft,
            coupling: Coupling::new(&stiffness, rows),
            coarse: None,
            counts: BodyCounts::default(),
            before: [0; 3],
            solver: make(stiffness)?,
        })
    }

    /// With rigid motions around the preconditioner.
    pub fn with_coarse(self, coarse: Option<RigidSpace>) -> Self {
        Self { coarse: coarse.map(Rc::new), ..self }
    }

    /// Sets the springs d.
    pub fn update(&mut self, rows: &Csr, weight: &[f64]) -> Result<()> {
        if weight == self.weight {
            self.counts.robin_skipped += 1;
            return Ok(());
        }
        self.weight.copy_from_slice(weight);
        self.counts.robin_updates += 1;
        let softened: Vec<f64> = weight.iter().zip(&self.soft).map(|(weight, soft)| weight.min(*soft)).collect();
        let (coupling, soft, prepared) = (&self.coupling, &self.soft, &self.prepared);
        let change = Change {
            write: &|g| coupling.write(rows, weight, g),
            far: &|| far(rows, soft, prepared, weight),
            stiff: &|| far(rows, soft, &softened, weight),
            coarse: &|| self.coarse.as_ref().map(|coarse| coarse.with(weight)),
        };
        let began = Instant::now();
        match self.solver.update(change)? {
            Seen::Older => {}
            Seen::Patched => self.prepared = softened,
            Seen::Whole => self.prepared.copy_from_slice(weight),
        }
        self.note(began.elapsed().as_secs_f64());
        Ok(())
    }

    /// Adds the seconds of a factorisation or set-up.
    fn note(&mut self, seconds: f64) {
        self.counts.factor_seconds += seconds;
        if self.counts.first_seconds == 0.0 && self.solver.factorizations()[1] > self.before[1] {
            self.counts.first_seconds = seconds;
        }
    }

    /// Factors G, or makes its preconditioner, if it changed since.
    pub fn set_up(&mut self) -> Result<()> {
        let began = Instant::now();
        let done = self.solver.set_up();
        self.note(began.elapsed().as_secs_f64());
        done
    }

    /// One solve, or one application of the preconditioner, counted and timed apart from the set-up it may need.
    pub fn apply(&mut self, solve: impl FnOnce(&mut S) -> Result<Solved>) -> Result<Solved> {
        self.set_up()?;
        self.counts.solves += 1;
        let began = Instant::now();
        let mut solved = solve(&mut self.solver)?;
        if let (Some(reason), Some(ratio)) = (&mut solved.failure, self.steepest()) {
            *reason +=
                &format!(": springs of the contact are up to {ratio:.0e} times as stiff as the bodies under them");
        }
        self.counts.solve_seconds += began.elapsed().as_secs_f64();
        self.counts.inner_iterations += solved.iterations;
        Ok(solved)
    }

    /// How many times the stiffness under its row a spring has at most, if that takes more than half of the digits of K.
    fn steepest(&self) -> Option<f64> {
        let ratio = self.weight.iter().zip(&self.soft).map(|(weight, soft)| weight / soft);
        let most = ratio.filter(|ratio| ratio.is_finite()).fold(0.0, f64::max);
        (most > f64::EPSILON.sqrt().recip()).then_some(most)
    }

    /// y = K x, by G with the springs taken out meanwhile; numbers that are none if PETSc fails, with which the run ends. The solver has G in
    /// rows.
    pub fn multiply_stiffness(&mut self, rows: &Csr, x: &[f64], y: &mut [f64]) {
        let (coupling, weight) = (&self.coupling, &self.weight);
        let product = self
            .solver
            .matrix_mut()
            .map(|matrix| matrix.multiply_changed(|g| coupling.reset(g), |g| coupling.write(rows, weight, g), x, y));
        if !matches!(product, Some(Ok(()))) {
            y.fill(f64::NAN);
        }
    }

    /// What was done so far.
    pub fn counts(&self) -> BodyCounts {
        let made = self.solver.factorizations();
        let [symbolic, factorizations, patches] = std::array::from_fn(|kind| made[kind] - self.before[kind]);
        if self.solver.is_dense() {
            return BodyCounts { dense_factorizations: factorizations, ..self.counts };
        }
        BodyCounts { symbolic, factorizations, patches, ..self.counts }
    }

    /// Counts from zero.
    pub fn begin_anew(&mut self) {
        self.before = self.solver.factorizations();
        self.counts = BodyCounts::default();
    }

    /// The solver.
    pub fn solver(&self) -> &S {
        &self.solver
    }

    /// The solver, for what does not change G.
    pub fn solver_mut(&mut self) -> &mut S {
        &mut self.solver
    }
}

/// Where B' diag(d) B goes in the values of G.
struct Coupling {
    /// Dofs of this rank.
    own: Range<usize>,
    /// Position in the values of G of every product b_i b_j of every row with i here, in the order of rows, i and j.
    positions: Vec<u32>,
    /// Each position that some row has, once.
    touched: Vec<u32>,
    /// The value of K there.
    stiffness: Vec<f64>,
}

impl Coupling {
    fn new(stiffness: &Rows, rows: &Csr) -> Self {
        let own = stiffness.own();
        let here = |q: usize| rows.row(q).map(|entry| entry.0).filter(|i| own.contains(i));
        let products = (0..rows.rows()).map(|q| here(q).count() * rows.range(q).len()).sum();
        let mut positions = Vec::with_capacity(products);
        for q in 0..rows.rows() {
            for i in here(q) {
                for (j, _) in rows.row(q) {
                    match stiffness.position(i - own.start, j) {
                        Some(position) => positions.push(position as u32),
                        None => unreachable!("the pattern holds the couplings of every contact row"),
                    }
                }
            }
        }
        let mut touched = positions.clone();
        touched.sort_unstable();
        touched.dedup();
        touched.shrink_to_fit();
        let stiffness = touched.iter().map(|&at| stiffness.values()[at as usize]).collect();
        Self { own, positions, touched, stiffness }
    }

    /// Makes K of G.
    fn reset(&self, g: &mut [f64]) {
        self.touched.iter().zip(&self.stiffness).for_each(|(&at, stiffness)| g[at as usize] = *stiffness);
    }

    /// Writes K + B' diag(d) B where it differs from K; the rest of G is K already.
    fn write(&self, rows: &Csr, weight: &[f64], g: &mut [f64]) {
        self.reset(g);
        let mut left = &self.positions[..];
        for (q, &weight) in weight.iter().enumerate() {
            let b = &rows.values[rows.range(q)];
            let here = rows.row(q).filter(|entry| self.own.contains(&entry.0));
            let (mine, others) = left.split_at(here.clone().count() * b.len());
            left = others;
            if weight == 0.0 {
                continue;
            }
            let products = here.flat_map(|(_, x)| b.iter().map(move |y| x * y));
            mine.iter().zip(products).for_each(|(&at, product)| g[at as usize] += weight * product);
        }
    }
}

/// Growth of the stiffness under a contact row, either way, beyond which a preconditioner is poor there. With 1.2, 1.5, 2 and 3 `groove3d` (n = 16,
/// layer 1e7) takes 50, 50, 56 and 56 iterations, `hertz-sphere` (P1, n = 12, layer 1e6) 56, 54, 56 and 117.
const FAR: f64 = 1.5;

/// Dofs of the contact rows where springs `new` make the stiffness [`FAR`] times that with springs `old`, or a share of it; `soft` are the springs
/// that double it. The eigenvalues of G_old^-1 G_new lie between the least and the largest ratio of the springs; where the body is stiff
/// beside them they do not come near that, and only the sum of both counts.
fn far(rows: &Csr, soft: &[f64], old: &[f64], new: &[f64]) -> Vec<usize> {
    let is_far = |q: &usize| {
        let (before, after) = (soft[*q] + old[*q], soft[*q] + new[*q]);
        after > FAR * before || before > FAR * after
    };
    let mut dofs: Vec<usize> = (0..rows.rows()).filter(is_far).flat_map(|q| rows.row(q).map(|entry| entry.0)).collect();
    dofs.sort_unstable();
    dofs.dedup();
    dofs
}
