//! Dense Cholesky factorisation in pure Rust: the reference that tests compare with, without PETSc.

use super::InnerSolver;
use crate::ddm::Solved;
use crate::error::Result;
use crate::linalg::Csr;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// G as a dense matrix, factored when it is first needed after a change.
pub struct Dense {
    pattern: Csr,
    factor: Option<Option<Cholesky<f64, Dyn>>>,
    factorizations: usize,
}

impl Dense {
    /// Starts from G = K.
    pub fn new(stiffness: &Csr) -> Self {
        Self { pattern: stiffness.clone(), factor: None, factorizations: 0 }
    }

    fn matrix(&self) -> DMatrix<f64> {
        let n = self.pattern.rows();
        let mut matrix = DMatrix::zeros(n, n);
        for i in 0..n {
            for (j, value) in self.pattern.row(i) {
                matrix[(i, j)] = value;
            }
        }
        matrix
    }
}

impl InnerSolver for Dense {
    fn update(&mut self, write: &mut dyn FnMut(&mut [f64]), _far: bool) -> Result<()> {
        write(&mut self.pattern.values);
        self.factor = None;
        Ok(())
    }

    fn set_up(&mut self) -> Result<()> {
        if self.factor.is_none() {
            self.factorizations += 1;
            self.factor = Some(self.matrix().cholesky());
        }
        Ok(())
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<Solved> {
        self.set_up()?;
        match self.factor.as_ref().and_then(Option::as_ref) {
            Some(factor) => {
                let solution = factor.solve(&DVector::from_column_slice(r));
                z.copy_from_slice(solution.as_slice());
                Ok(Solved::default())
            }
            None => {
                z.fill(0.0);
                let failure = Some("the Robin matrix is not positive definite".to_owned());
                Ok(Solved { iterations: 0, failure })
            }
        }
    }

    fn factorizations(&self) -> (usize, usize) {
        (usize::from(self.factorizations > 0), self.factorizations)
    }

    fn describe(&self) -> String {
        "dense Cholesky".to_owned()
    }
}
