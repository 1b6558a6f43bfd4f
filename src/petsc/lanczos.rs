//! The least eigenvalue of a preconditioned matrix, from the iterates of conjugate gradients (Lanczos).
//!
//! PETSc estimates it, too, but stores coefficients for as many iterations as the limit allows, and computes all
//! eigenvalues each time. Its QL iteration does not end where rounding makes a number that is none.

use super::call::petsc;
use super::error::Result;
use super::ffi;
use std::ptr::null_mut;

/// Conjugate gradients that are followed from iterate to iterate.
#[derive(Default)]
pub(super) struct Lanczos {
    /// The last iterate and its residual.
    last: Option<[ffi::Vec; 2]>,
    /// r'z of the last iterate.
    squared: f64,
    matrix: Tridiagonal,
}

impl Lanczos {
    /// Note the iterate x of a solver, with r'z of its residual. A step is s = alpha p, where p'r = r'z of the residual
    /// r before. Collective.
    pub fn follow(&mut self, ksp: ffi::KSP, x: ffi::Vec, squared: f64) -> Result<()> {
        let [last, residual] = match self.last {
            Some([last, residual]) => {
                let mut gain = 0.0;
                // SAFETY: vectors of one size and the same processes.
                unsafe {
                    petsc!(VecAYPX(last, -1.0, x))?;
                    petsc!(VecDot(last, residual, &mut gain))?;
                }
                self.matrix.push(gain / self.squared, squared / self.squared);
                [last, residual]
            }
            None => *self.last.insert([duplicate(x)?, duplicate(x)?]),
        };
        let mut result = residual;
        // SAFETY: the solver writes its residual to the second vector; it may use the first one for that.
        unsafe {
            petsc!(KSPBuildResidual(ksp, last, residual, &mut result))?;
            petsc!(VecCopy(x, last))?;
        }
        self.squared = squared;
        Ok(())
    }

    /// Return the least eigenvalue that has been found; none before the first step.
    pub fn least(&mut self) -> Option<f64> {
        self.matrix.least()
    }
}

/// Return a new vector like another one.
fn duplicate(x: ffi::Vec) -> Result<ffi::Vec> {
    let mut copy = null_mut();
    // SAFETY: PETSc makes a vector with memory of its own.
    unsafe { petsc!(VecDuplicate(x, &mut copy)) }?;
    Ok(copy)
}

impl Drop for Lanczos {
    fn drop(&mut self) {
        for mut vector in self.last.into_iter().flatten() {
            // SAFETY: the one reference of this type.
            let _ = unsafe { petsc!(VecDestroy(&mut vector)) };
        }
    }
}

/// Relative accuracy of the least eigenvalue: the estimated error of an iterate changes by half as much.
const ACCURACY: f64 = 1e-3;

/// The tridiagonal matrix T of the Lanczos method, whose least eigenvalue is above that of the preconditioned matrix.
#[derive(Default)]
struct Tridiagonal {
    diagonal: Vec<f64>,
    /// The square of the entry before each one of the diagonal, in its row.
    squares: Vec<f64>,
    /// Length of the last step, and the factor by which r'z has changed in it.
    step: Option<(f64, f64)>,
    /// Whether rounding has spoiled a step. It and those after it are left out.
    is_spoiled: bool,
    /// A number just below the least eigenvalue; zero before the first step.
    low: f64,
}

impl Tridiagonal {
    /// Append a step of this length, after which r'z is `growth` times as large.
    fn push(&mut self, length: f64, growth: f64) {
        self.is_spoiled |= !(length > 0.0 && length.is_finite() && growth.is_finite());
        if self.is_spoiled {
            return;
        }
        let (before, grown) = self.step.replace((length, growth)).unwrap_or((1.0, 0.0));
        self.diagonal.push(length.recip() + grown / before);
        self.squares.push(grown / (before * before));
        if self.low == 0.0 {
            self.low = length.recip();
        }
    }

    /// Return the least eigenvalue from below. Parts of T have no less one than T has, so it falls from step to step,
    /// and is soon known.
    fn least(&mut self) -> Option<f64> {
        let mut high = self.low;
        while !self.is_below(self.low) {
            (high, self.low) = (self.low, 0.5 * self.low);
            if self.low < f64::MIN_POSITIVE {
                return None;
            }
        }
        while high > (1.0 + ACCURACY) * self.low {
            let middle = self.low * (high / self.low).sqrt();
            if self.is_below(middle) {
                self.low = middle;
            } else {
                high = middle;
            }
        }
        Some(self.low).filter(|low| *low > 0.0)
    }

    /// Return whether all eigenvalues are above x, so that T - x has positive pivots.
    fn is_below(&self, x: f64) -> bool {
        let mut pivot = f64::INFINITY;
        self.diagonal.iter().zip(&self.squares).all(|(diagonal, square)| {
            pivot = diagonal - x - square / pivot;
            pivot > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{ACCURACY, Tridiagonal};

    /// The matrix with 2 on its diagonal and 1 beside it has the least eigenvalue 2 - 2 cos(pi/(n+1)). A step that is
    /// none changes nothing.
    #[test]
    fn the_least_eigenvalue_comes_from_steps() {
        let (mut matrix, mut before) = (Tridiagonal::default(), 0.0);
        assert_eq!(matrix.least(), None);
        for n in 1..50 {
            let length = f64::recip(2.0 - before);
            matrix.push(length, length * length);
            before = length;
            let exact = 2.0 - 2.0 * (std::f64::consts::PI / f64::from(n + 1)).cos();
            let least = matrix.least().expect("an eigenvalue");
            assert!(least <= exact * (1.0 + 1e-12) && least > exact * (1.0 - 2.0 * ACCURACY), "{n}: {least} {exact}");
        }
        let least = matrix.least();
        for (length, growth) in [(f64::NAN, 1.0), (1.0, f64::INFINITY), (1.0, 1.0)] {
            matrix.push(length, growth);
            assert_eq!(matrix.least(), least);
        }
    }
}
