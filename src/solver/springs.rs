//! The matrix G = K + B' diag(d) B of a linear system with springs d at contact points, together with its solver.

use super::{BodyCounts, Change, InnerSolver, SolveOutcome, Write};
use crate::error::Result;
use crate::linalg::Csr;
use crate::petsc::{Rows, Subspace};
use std::ops::Range;
use std::time::Instant;

/// A function that makes a solver of K.
pub type MakeSolver = Box<dyn FnOnce(Rows) -> Result<Box<dyn InnerSolver>>>;

/// A function that returns a coarse space around a preconditioner, for spring stiffnesses, one a row of B.
pub type MakeSubspace = Box<dyn Fn(&[f64]) -> Box<dyn Subspace>>;

/// G of one body, or of all bodies together.
///
/// Only the entries of K that differ from G are stored here; the others are in the solver alone. The rows B stay with
/// the owner, who passes the same rows to every call that needs them.
pub struct SpringMatrix {
    solver: Box<dyn InnerSolver>,
    /// Spring stiffnesses d of G, one a row of B.
    springs: Vec<f64>,
    /// Spring stiffnesses that double the stiffness under a row.
    soft: Vec<f64>,
    coupling: Coupling,
    /// Rigid motions that are put around the preconditioner, if G is of several bodies.
    coarse: Option<MakeSubspace>,
    counts: BodyCounts,
    /// Factorisations of the solver before the counters were last set to zero.
    before: [usize; 3],
}

impl SpringMatrix {
    /// Start from G = K, whose pattern holds that of B'B. `make` turns K into its solver. `row_stiffness` is b diag(K)
    /// b' of each row b of B, with the parts of all ranks. With a `coarse` space, rigid motions are put around the
    /// preconditioner.
    pub fn new(
        stiffness: Rows,
        rows: &Csr,
        row_stiffness: Vec<f64>,
        coarse: Option<MakeSubspace>,
        make: MakeSolver,
    ) -> Result<Self> {
        let springs = vec![0.0; rows.rows()];
        let square = |q| rows.row(q).map(|(_, b)| b * b).sum::<f64>();
        let soft = row_stiffness.iter().enumerate().map(|(q, stiffness)| stiffness / square(q).powi(2)).collect();
        Ok(Self {
            springs,
            soft,
            coupling: Coupling::new(&stiffness, rows),
            coarse,
            counts: BodyCounts::default(),
            before: [0; 3],
            solver: make(stiffness)?,
        })
    }

    /// Set the spring stiffnesses d, one a row of B.
    pub fn update(&mut self, rows: &Csr, springs: &[f64]) -> Result<()> {
        if springs == self.springs {
            self.counts.robin_skipped += 1;
            return Ok(());
        }
        self.springs.copy_from_slice(springs);
        self.counts.robin_updates += 1;
        let change = Change {
            write: &|g| self.coupling.write(rows, springs, g),
            rows,
            springs,
            soft: &self.soft,
            coarse: &|| self.coarse.as_ref().map(|coarse| coarse(springs)),
        };
        let began = Instant::now();
        self.solver.update(change)?;
        self.count_seconds(began.elapsed().as_secs_f64());
        Ok(())
    }

    /// Return the spring stiffnesses d of G, one a row of B.
    pub fn springs(&self) -> &[f64] {
        &self.springs
    }

    /// Count the seconds of a factorisation or set-up.
    fn count_seconds(&mut self, seconds: f64) {
        self.counts.factor_seconds += seconds;
        if self.counts.first_seconds == 0.0 && self.solver.factorizations()[1] > self.before[1] {
            self.counts.first_seconds = seconds;
        }
    }

    /// Factor G, or set up its preconditioner, if G has changed since.
    pub fn set_up(&mut self) -> Result<()> {
        let began = Instant::now();
        let done = self.solver.set_up();
        self.count_seconds(began.elapsed().as_secs_f64());
        done
    }

    /// Make one solve, or one application of the preconditioner. It is counted and timed apart from the set-up that it
    /// may need.
    pub fn apply(&mut self, solve: impl FnOnce(&mut dyn InnerSolver) -> Result<SolveOutcome>) -> Result<SolveOutcome> {
        self.set_up()?;
        self.counts.solves += 1;
        let began = Instant::now();
        let mut solved = solve(&mut *self.solver)?;
        if let (Some(reason), Some(ratio)) = (&mut solved.failure, self.steepest()) {
            *reason +=
                &format!(": springs of the contact are up to {ratio:.0e} times as stiff as the bodies under them");
        }
        self.counts.solve_seconds += began.elapsed().as_secs_f64();
        self.counts.inner_iterations += solved.iterations;
        Ok(solved)
    }

    /// Return the largest ratio of a spring stiffness to the stiffness under its row, if it is so large that more than
    /// half of the digits of K are lost in G.
    fn steepest(&self) -> Option<f64> {
        let ratios = self.springs.iter().zip(&self.soft).map(|(spring, soft)| spring / soft);
        let largest = ratios.filter(|ratio| ratio.is_finite()).fold(0.0, f64::max);
        (largest > f64::EPSILON.sqrt().recip()).then_some(largest)
    }

    /// Return the values of K, in the order of the pattern of G.
    pub fn stiffness(&self) -> Vec<f64> {
        let mut values = self.solver.values().to_vec();
        self.coupling.reset(&mut values);
        values
    }

    /// Compute y = K x with G, from which the springs are taken out meanwhile. If PETSc fails, y is NaN, and the run
    /// ends with that.
    pub fn multiply_stiffness(&mut self, rows: &Csr, x: &[f64], y: &mut [f64]) {
        let Self { solver, coupling, springs, .. } = self;
        let changes: [&Write; 2] = [&|g| coupling.reset(g), &|g| coupling.write(rows, springs, g)];
        if solver.multiply(changes, x, y).is_err() {
            y.fill(f64::NAN);
        }
    }

    /// Return whether G was factored, or its preconditioner set up.
    pub fn is_set_up(&self) -> bool {
        self.solver.factorizations()[1] > 0
    }

    /// Return the counters since the start or the last [`Self::begin_anew`].
    pub fn counts(&self) -> BodyCounts {
        let made = self.solver.factorizations();
        let [symbolic, factorizations, patches] = std::array::from_fn(|kind| made[kind] - self.before[kind]);
        if self.solver.is_dense() {
            return BodyCounts { dense_factorizations: factorizations, ..self.counts };
        }
        BodyCounts { symbolic, factorizations, patches, ..self.counts }
    }

    /// Set the counters to zero.
    pub fn begin_anew(&mut self) {
        self.before = self.solver.factorizations();
        self.counts = BodyCounts::default();
    }

    /// Return the solver.
    pub fn solver(&self) -> &dyn InnerSolver {
        &*self.solver
    }

    /// Return the solver, for calls that do not change G.
    pub fn solver_mut(&mut self) -> &mut dyn InnerSolver {
        &mut *self.solver
    }
}

/// The positions of B' diag(d) B in the values of G.
struct Coupling {
    /// Dofs that this rank owns.
    own: Range<usize>,
    /// Position in the values of G of every product b_i b_j of every row b, where this rank owns i. Ordered by row,
    /// then by i, then by j.
    positions: Vec<u32>,
    /// The distinct ones of these positions, sorted.
    touched: Vec<u32>,
    /// The value of K at each of the `touched` positions.
    stiffness: Vec<f64>,
}

impl Coupling {
    fn new(stiffness: &Rows, rows: &Csr) -> Self {
        let own = stiffness.own();
        let owned = |q: usize| rows.row(q).map(|(i, _)| i).filter(|i| own.contains(i));
        let products = (0..rows.rows()).map(|q| owned(q).count() * rows.range(q).len()).sum();
        let mut positions = Vec::with_capacity(products);
        for q in 0..rows.rows() {
            for i in owned(q) {
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

    /// Write the values of K into those of G.
    fn reset(&self, g: &mut [f64]) {
        self.touched.iter().zip(&self.stiffness).for_each(|(&at, stiffness)| g[at as usize] = *stiffness);
    }

    /// Write K + B' diag(d) B into the values of G, where it differs from K. Elsewhere the values are those of K
    /// already.
    fn write(&self, rows: &Csr, springs: &[f64], g: &mut [f64]) {
        self.reset(g);
        let mut remaining = &self.positions[..];
        for (q, &spring) in springs.iter().enumerate() {
            let b = &rows.values[rows.range(q)];
            let owned = rows.row(q).filter(|(i, _)| self.own.contains(i));
            let (positions, others) = remaining.split_at(owned.clone().count() * b.len());
            remaining = others;
            if spring == 0.0 {
                continue;
            }
            let products = owned.flat_map(|(_, x)| b.iter().map(move |y| x * y));
            positions.iter().zip(products).for_each(|(&at, product)| g[at as usize] += spring * product);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Dense, rows_of};
    use super::*;

    /// The one matrix of a dense solver serves for K, for products with K, and for solves with G.
    #[test]
    fn springs_leave_the_stiffness_as_it_is() -> Result<()> {
        let mut rows = Csr::new(2);
        rows.push_row([(1, 2.0)]);
        let stiffness = vec![3.0, -1.0, -1.0, 2.0];
        let k = rows_of(Csr::full(2, stiffness.clone()), None)?;
        let mut matrix = SpringMatrix::new(k, &rows, vec![8.0], None, Box::new(Dense::make))?;
        for spring in [5.0, 0.0, 0.25] {
            matrix.update(&rows, &[spring])?;
            let (x, mut y, mut z) = ([1.0, 2.0], [0.0; 2], [0.0; 2]);
            matrix.multiply_stiffness(&rows, &x, &mut y);
            assert_eq!((y, matrix.stiffness()), ([1.0, 3.0], stiffness.clone()));
            matrix.apply(|solver| solver.solve(&[1.0, 3.0 + 8.0 * spring], &mut z))?;
            assert!(z.iter().zip(x).all(|(z, x)| (z - x).abs() < 1e-14), "{z:?}");
        }
        Ok(())
    }
}
