//! Dense Cholesky factorisation by the LAPACK that PETSc uses, for matrices without zeros.

use super::{Change, InnerSolver, SolveOutcome, Write};
use crate::error::Result;
use crate::linalg::full_product;
use crate::petsc::{Rows, cholesky, cholesky_solve};

/// G as a dense matrix, which is factored when it is first needed after a change.
pub struct Dense {
    rows: usize,
    /// All entries of G, row by row.
    values: Vec<f64>,
    /// Its factor; empty before the first factorisation.
    factor: Vec<f64>,
    /// Whether G was positive definite when it was factored; `None` if it has not been factored since the last change.
    made: Option<bool>,
    factorizations: usize,
}

impl Dense {
    /// Make the solver of a symmetric matrix with all entries stored.
    pub fn make(matrix: Rows) -> Result<Box<dyn InnerSolver>> {
        let (rows, values) = (matrix.own().len(), matrix.into_values());
        Ok(Box::new(Self { rows, values, factor: Vec::new(), made: None, factorizations: 0 }))
    }
}

impl InnerSolver for Dense {
    fn values(&self) -> &[f64] {
        &self.values
    }

    fn multiply(&mut self, [to_stiffness, restore]: [&Write; 2], x: &[f64], y: &mut [f64]) -> Result<()> {
        to_stiffness(&mut self.values);
        full_product(&self.values, x, y);
        restore(&mut self.values);
        Ok(())
    }

    fn update(&mut self, change: Change) -> Result<()> {
        (change.write)(&mut self.values);
        self.made = None;
        Ok(())
    }

    fn set_up(&mut self) -> Result<()> {
        if self.made.is_none() {
            self.factorizations += 1;
            self.factor.clone_from(&self.values);
            self.made = Some(cholesky(&mut self.factor, self.rows)?);
        }
        Ok(())
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        self.set_up()?;
        if self.made == Some(false) {
            z.fill(0.0);
            let failure = Some("the Robin matrix is not positive definite".to_owned());
            return Ok(SolveOutcome { iterations: 0, failure });
        }
        z.copy_from_slice(r);
        cholesky_solve(&self.factor, self.rows, z)?;
        Ok(SolveOutcome::default())
    }

    fn factorizations(&self) -> [usize; 3] {
        [usize::from(self.factorizations > 0), self.factorizations, 0]
    }

    fn is_dense(&self) -> bool {
        true
    }

    fn describe(&self) -> String {
        "dense Cholesky".to_owned()
    }
}
