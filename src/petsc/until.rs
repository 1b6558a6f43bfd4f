//! A linear solve with a stopping test of the caller.

use super::call::petsc;
use super::error::Result;
use super::ksp::Solved;
use super::lanczos::Lanczos;
use super::subspace::ERROR;
use super::vector::slice;
use super::{Ksp, ffi};
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// An iterate of a linear solver.
#[derive(Debug)]
pub struct KspIterate<'a> {
    /// The solution so far; one entry for each row of this process.
    pub x: &'a [f64],
    /// The norm of its residual, as the solver measures it (its `-ksp_norm_type`).
    pub residual: f64,
    /// The norm of the residual of the first guess, which is zero or the exact solution in a
    /// [`Subspace`](super::Subspace).
    pub first: f64,
    /// The least eigenvalue of the preconditioned matrix that conjugate gradients in the natural norm have found so
    /// far.
    pub least: Option<f64>,
}

/// A stopping test, called after each iteration. It returns whether the iterate is accurate enough.
pub type ConvergenceTest<'a> = dyn FnMut(&KspIterate) -> bool + 'a;

/// A convergence test of PETSc.
type PetscTest =
    unsafe extern "C" fn(ffi::KSP, super::Int, f64, *mut ffi::KSPConvergedReason, *mut c_void) -> ffi::PetscErrorCode;

/// The context of [`is_enough`] during a solve.
struct Test<'a, 'b> {
    enough: &'a mut ConvergenceTest<'b>,
    /// The norm of the first residual.
    first: f64,
    /// The test that the solver had before.
    own: Option<PetscTest>,
    /// The context of that test.
    own_context: *mut c_void,
    /// The eigenvalues that conjugate gradients find, if their norm is the natural one.
    lanczos: Option<Lanczos>,
}

impl Ksp {
    /// Solve `A x = b` from a zero guess until `enough` returns true, or the solver reaches its own tolerances.
    ///
    /// Collective: `enough` has to return the same on all processes.
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
    pub fn solve_until(&self, b: &[f64], x: &mut [f64], enough: &mut ConvergenceTest) -> Result<Solved> {
        let (mut rest, mut start) = (b.to_vec(), vec![0.0; b.len()]);
        let started = self.start(&mut rest, &mut start)?;
        let mut whole = vec![0.0; b.len()];
        // PETSc iterates on what is left after the exact solve in the subspace
        let mut of_whole = |iterate: &KspIterate| {
            whole.iter_mut().zip(&start).zip(iterate.x).for_each(|((whole, start), x)| *whole = start + x);
            enough(&KspIterate { x: &whole, ..*iterate })
        };
        let enough: &mut ConvergenceTest = if started.is_some() { &mut of_whole } else { enough };
        let (mut own, mut own_context, mut destroy) = (None, null_mut(), None);
        // SAFETY: the solver's own test is taken out with its context, and put back below whatever the outcome of the
        // solve.
        unsafe { petsc!(KSPGetAndClearConvergenceTest(self.ksp, &mut own, &mut own_context, &mut destroy)) }?;
        let mut norm = ffi::KSPNormType_KSP_NORM_DEFAULT;
        // SAFETY: the solver of this wrapper.
        unsafe { petsc!(KSPGetNormType(self.ksp, &mut norm)) }?;
        let has_spectrum = self.ksp_type() == "cg" && norm == ffi::KSPNormType_KSP_NORM_NATURAL;
        let lanczos = has_spectrum.then(Lanczos::default);
        let mut test = Test { enough, first: f64::NAN, own, own_context, lanczos };
        let context: *mut Test = &mut test;
        // SAFETY: the test reads this context, which lives until the test is replaced below.
        unsafe { petsc!(KSPSetConvergenceTest(self.ksp, Some(is_enough), context.cast(), None)) }?;
        let solved = self.solve(&rest, x);
        // SAFETY: the test and the context that PETSc returned above.
        unsafe { petsc!(KSPSetConvergenceTest(self.ksp, own, own_context, destroy)) }?;
        x.iter_mut().zip(&start).for_each(|(x, start)| *x += start);
        solved
    }
}

/// The callback: apply the solver's own test, then the caller's.
unsafe extern "C" fn is_enough(
    ksp: ffi::KSP,
    iteration: super::Int,
    norm: f64,
    reason: *mut ffi::KSPConvergedReason,
    context: *mut c_void,
) -> ffi::PetscErrorCode {
    // SAFETY: `solve_until` sets this callback with its `Test`, which outlives the solve and which nothing else uses
    // meanwhile; PETSc passes its own solver and a variable for the reason.
    let (test, reason) = unsafe { (&mut *context.cast::<Test>(), &mut *reason) };
    if let Some(own) = test.own {
        // SAFETY: the solver's own test with its own context.
        let code = unsafe { own(ksp, iteration, norm, reason, test.own_context) };
        if code != 0 {
            return code;
        }
    }
    if iteration == 0 {
        test.first = norm;
    }
    if *reason != 0 || (iteration == 0 && test.lanczos.is_none()) {
        return 0;
    }
    let (mut vector, mut array, mut rows) = (null_mut(), null(), 0);
    // SAFETY: PETSc's solver, which has an iterate during a solve; its vector is only read.
    let read = (|| unsafe {
        petsc!(KSPBuildSolution(ksp, null_mut(), &mut vector))?;
        test.lanczos.as_mut().map_or(Ok(()), |lanczos| lanczos.follow(ksp, vector, norm * norm))?;
        petsc!(VecGetLocalSize(vector, &mut rows))?;
        petsc!(VecGetArrayRead(vector, &mut array))
    })();
    let Ok(()) = read else { return ERROR };
    if iteration == 0 {
        return give_back(vector, array);
    }
    // SAFETY: PETSc's array has that many entries here, and nobody writes to it before it is given back.
    let x = unsafe { slice(array, rows as usize) };
    let least = test.lanczos.as_mut().and_then(Lanczos::least);
    if (test.enough)(&KspIterate { x, residual: norm, first: test.first, least }) {
        *reason = ffi::KSPConvergedReason_KSP_CONVERGED_RTOL;
    }
    give_back(vector, array)
}

/// Give an array back that was read from a vector.
fn give_back(vector: ffi::Vec, mut array: *const f64) -> ffi::PetscErrorCode {
    // SAFETY: PETSc's own array.
    unsafe { petsc!(VecRestoreArrayRead(vector, &mut array)) }.map_or(ERROR, |()| 0)
}
