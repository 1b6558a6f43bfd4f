//! A linear solve that ends when the caller says so.

use super::around::ERROR;
use super::ksp::Solved;
use super::library::petsc;
use super::vector::slice;
use super::{Ksp, ffi};
use crate::error::Result;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// An iterate of a solver.
#[derive(Debug)]
pub struct Iterate<'a> {
    /// One entry a row of this process.
    pub x: &'a [f64],
    /// Norm of its residual, as the solver measures it (its `-ksp_norm_type`).
    pub residual: f64,
    /// The same of the first guess: zero, or what a [`Subspace`](super::Subspace) has solved exactly.
    pub first: f64,
    /// Least eigenvalue of the preconditioned matrix that conjugate gradients have seen.
    pub least: Option<f64>,
}

/// Asked after each iteration: whether that is enough.
pub type Enough<'a> = dyn FnMut(&Iterate) -> bool + 'a;

/// A test of PETSc.
type Test =
    unsafe extern "C" fn(ffi::KSP, super::Int, f64, *mut ffi::KSPConvergedReason, *mut c_void) -> ffi::PetscErrorCode;

/// What [`is_enough`] needs during a solve.
struct Until<'a, 'b> {
    enough: &'a mut Enough<'b>,
    /// Norm of the first residual.
    first: f64,
    /// The test that the solver had, with its data.
    test: Option<Test>,
    data: *mut c_void,
}

impl Ksp {
    /// Has conjugate gradients estimate the spectrum of the preconditioned matrix as they go (Lanczos). Before the set-up.
    ///
    /// # Errors
    /// PETSc's.
    pub fn estimate_spectrum(&self) -> Result<()> {
        // SAFETY: a solver of ours and a flag.
        unsafe { petsc!(KSPSetComputeSingularValues(self.ksp, ffi::PetscBool_PETSC_TRUE)) }
    }

    /// Solves `A x = b` from a zero guess until `enough` is true after an iteration, or the tolerances of the solver end it. Collective: the
    /// answers of all processes have to be the same.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let session = Session::start(&["-ksp_type", "cg", "-pc_type", "none", "-ksp_rtol", "1e-12"].map(String::from))?;
    /// let a = Matrix::from_csr(&session, 1, vec![0, 1, 2, 3], vec![0, 1, 2], vec![1.0, 2.0, 4.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_from_options()?;
    /// let (mut x, mut seen) = ([0.0; 3], Vec::new());
    /// let solved = ksp.solve_until(&[1.0, 1.0, 1.0], &mut x, &mut |iterate| {
    ///     seen.push((iterate.x.to_vec(), iterate.residual / iterate.first));
    ///     seen.len() == 2
    /// })?;
    /// assert!(solved.iterations == 2 && solved.reason.converged());
    /// assert!(seen[1].0 == x && seen[1].1 < seen[0].1 && seen[0].1 < 1.0);
    /// // the next solve ends by its tolerance
    /// assert_eq!(ksp.solve(&[1.0, 1.0, 1.0], &mut x)?.iterations, 3);
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`solve`](Self::solve).
    pub fn solve_until(&self, b: &[f64], x: &mut [f64], enough: &mut Enough) -> Result<Solved> {
        let (mut rest, mut start) = (b.to_vec(), vec![0.0; b.len()]);
        let started = self.start(&mut rest, &mut start)?;
        let mut whole = vec![0.0; b.len()];
        let mut of_whole = |iterate: &Iterate| {
            whole.iter_mut().zip(&start).zip(iterate.x).for_each(|((whole, start), x)| *whole = start + x);
            enough(&Iterate { x: &whole, ..*iterate })
        };
        let enough: &mut Enough = if started.is_some() { &mut of_whole } else { enough };
        let (mut test, mut data, mut destroy) = (None, null_mut(), None);
        // SAFETY: the solver's own test is taken out with its data, and put back below whatever the solve came to.
        unsafe { petsc!(KSPGetAndClearConvergenceTest(self.ksp, &mut test, &mut data, &mut destroy)) }?;
        let mut until = Until { enough, first: f64::NAN, test, data };
        let context: *mut Until = &mut until;
        // SAFETY: the test reads this context, which lives until the test is replaced below.
        unsafe { petsc!(KSPSetConvergenceTest(self.ksp, Some(is_enough), context.cast(), None)) }?;
        let solved = self.solve(&rest, x);
        // SAFETY: what PETSc gave above.
        unsafe { petsc!(KSPSetConvergenceTest(self.ksp, test, data, destroy)) }?;
        x.iter_mut().zip(&start).for_each(|(x, start)| *x += start);
        solved
    }
}

/// The solver's own test, then the caller's.
unsafe extern "C" fn is_enough(
    ksp: ffi::KSP,
    iteration: super::Int,
    norm: f64,
    reason: *mut ffi::KSPConvergedReason,
    context: *mut c_void,
) -> ffi::PetscErrorCode {
    // SAFETY: `solve_until` sets this test with its `Until`, which outlives the solve and which nothing else uses meanwhile; PETSc
    // passes its own solver and a place for the reason.
    let (until, reason) = unsafe { (&mut *context.cast::<Until>(), &mut *reason) };
    if let Some(test) = until.test {
        // SAFETY: the solver's own test with its own data.
        let code = unsafe { test(ksp, iteration, norm, reason, until.data) };
        if code != 0 {
            return code;
        }
    }
    if iteration == 0 {
        until.first = norm;
    }
    if iteration == 0 || *reason != 0 {
        return 0;
    }
    let (mut vector, mut array, mut rows) = (null_mut(), null(), 0);
    // SAFETY: PETSc's solver, which is in a solve and has an iterate; its vector is its own and is only read.
    let read = (|| unsafe {
        petsc!(KSPBuildSolution(ksp, null_mut(), &mut vector))?;
        petsc!(VecGetLocalSize(vector, &mut rows))?;
        petsc!(VecGetArrayRead(vector, &mut array))
    })();
    let Ok(()) = read else { return ERROR };
    // SAFETY: PETSc's array has that many entries here, and nobody writes to it before it is given back.
    let x = unsafe { slice(array, rows as usize) };
    let least = extreme(ksp).map(|extreme| extreme[0]).filter(|least| *least > 0.0);
    if (until.enough)(&Iterate { x, residual: norm, first: until.first, least }) {
        *reason = ffi::KSPConvergedReason_KSP_CONVERGED_RTOL;
    }
    // SAFETY: gives back what was read above.
    match unsafe { petsc!(VecRestoreArrayRead(vector, &mut array)) } {
        Ok(()) => 0,
        Err(_) => ERROR,
    }
}

/// Extreme eigenvalues that conjugate gradients have seen, if they were to look.
fn extreme(ksp: ffi::KSP) -> Option<[f64; 2]> {
    let (mut least, mut most, mut looks) = (0.0, 0.0, ffi::PetscBool_PETSC_FALSE);
    // SAFETY: PETSc's solver, which is in a solve, and places for its answers.
    unsafe {
        petsc!(KSPGetComputeSingularValues(ksp, &mut looks)).ok()?;
        if looks == ffi::PetscBool_PETSC_FALSE {
            return None;
        }
        petsc!(KSPComputeExtremeSingularValues(ksp, &mut most, &mut least)).ok()?;
    }
    Some([least, most])
}
