//! Linear solvers.

use super::error::{petsc, string};
use super::matrix::same;
use super::options::text;
use super::vector::Vector;
use super::{ConvergedReason, Int, Matrix, Session, ffi, print};
use crate::error::{Error, Kind, Result};
use mpi::ffi::RSMPI_COMM_SELF;
use std::ffi::c_char;
use std::ptr::{null, null_mut};

/// What a linear solve reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Number of iterations; 1 for a direct solve.
    pub iterations: usize,
    /// Why the solver stopped.
    pub reason: ConvergedReason,
    /// Norm of the last residual as the solver measures it (its `-ksp_norm_type`); 0 for a solver that measures none,
    /// such as `preonly`.
    pub residual: f64,
}

/// A linear solver, any KSP with any PC of PETSc, chosen by options.
///
/// Not converging is an outcome, not an error (unless the user typed `-ksp_error_if_not_converged`).
///
/// ```
/// use winkler::petsc::{Ksp, Matrix, Session};
/// let session = Session::start(&["-a_ksp_type", "cg", "-a_pc_type", "jacobi", "-a_ksp_rtol", "1e-12"].map(String::from))?;
/// let mut a = Matrix::from_csr(&session, 1, vec![0, 2, 4], vec![0, 1, 0, 1], vec![4.0, 1.0, 1.0, 3.0])?;
/// a.set_spd()?;
/// let mut ksp = Ksp::new(&session, "a_")?;
/// ksp.set_operator(&a)?;
/// ksp.set_from_options()?;
/// ksp.set_up()?;
/// let mut x = [0.0; 2];
/// let solved = ksp.solve(&[1.0, 2.0], &mut x)?;
/// assert!((x[0] - 1.0 / 11.0).abs() < 1e-12 && (x[1] - 7.0 / 11.0).abs() < 1e-12);
/// assert!(solved.iterations == 2 && solved.reason.converged());
/// assert_eq!((ksp.ksp_type(), ksp.pc_type(), ksp.factor_package()), ("cg".into(), "jacobi".into(), None));
/// assert!(ksp.describe()?.contains("type: cg"));
///
/// ksp.set_tolerance(0.9)?;
/// assert_eq!(ksp.tolerance(), 0.9);
/// assert_eq!(ksp.solve(&[1.0, 2.0], &mut x)?.iterations, 1);
///
/// // A preconditioner kept from another matrix still leads cg to the solution.
/// ksp.set_tolerance(1e-12)?;
/// ksp.set_reuse_preconditioner(true)?;
/// a.update(|values| values[3] = 1.0)?;
/// ksp.solve(&[1.0, 2.0], &mut x)?;
/// assert!((x[1] - 7.0 / 3.0).abs() < 1e-10);
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub struct Ksp {
    ksp: ffi::KSP,
    /// Right-hand side and solution, made with the operator.
    vectors: Option<[Vector; 2]>,
    rows: usize,
    prefix: String,
    session: Session,
}

impl Ksp {
    /// A solver that reads its options under a prefix, such as `upper_`.
    ///
    /// # Errors
    /// When PETSc does not accept the prefix.
    pub fn new(session: &Session, prefix: &str) -> Result<Ksp> {
        // SAFETY: the constant of MPI itself.
        let comm = unsafe { RSMPI_COMM_SELF };
        let mut ksp = null_mut();
        petsc!(KSPCreate(comm, &mut ksp))?;
        let solver = Ksp {
            ksp,
            vectors: None,
            rows: 0,
            prefix: prefix.to_owned(),
            session: session.clone(),
        };
        let prefix = text(prefix)?;
        petsc!(KSPSetOptionsPrefix(ksp, prefix.as_ptr()))?;
        petsc!(KSPSetErrorIfNotConverged(ksp, ffi::PetscBool_PETSC_FALSE))?;
        Ok(solver)
    }

    /// Sets the matrix, of the system and of the preconditioner. The solver keeps it alive and sees its updates.
    ///
    /// # Errors
    /// When the solver had a matrix of another size.
    pub fn set_operator(&mut self, matrix: &Matrix) -> Result<()> {
        petsc!(KSPSetOperators(self.ksp, matrix.raw(), matrix.raw()))?;
        if self.vectors.is_none() || self.rows != matrix.rows() {
            let new = || Vector::new(&self.session, matrix.rows(), matrix.block_size());
            self.vectors = Some([new()?, new()?]);
            self.rows = matrix.rows();
        }
        Ok(())
    }

    /// Reads the options of the solver. `preonly` never keeps a preconditioner of an older matrix, whatever is typed:
    /// its answer would be wrong.
    ///
    /// # Errors
    /// When PETSc refuses an option, and for `-ksp_diagonal_scale`, which changes the matrix itself.
    pub fn set_from_options(&mut self) -> Result<()> {
        let options = self.own_options();
        petsc!(KSPSetFromOptions(self.ksp))
            .map_err(|error| error.help(format!("correct one of {options}*")))?;
        let mut scaled = ffi::PetscBool_PETSC_FALSE;
        petsc!(KSPGetDiagonalScale(self.ksp, &mut scaled))?;
        if scaled != ffi::PetscBool_PETSC_FALSE {
            return Err(Error::new(
                Kind::Solver,
                format!("{options}ksp_diagonal_scale cannot be used here"),
            )
            .because("it changes the values of the matrix, which belong to the program")
            .help(format!("leave it out, or take `{options}pc_type jacobi`")));
        }
        if self.applies_only() {
            petsc!(KSPSetReusePreconditioner(
                self.ksp,
                ffi::PetscBool_PETSC_FALSE
            ))?;
        }
        Ok(())
    }

    /// Makes the preconditioner or factorisation of the current matrix, if it is not there yet; every solve does it too.
    /// A factorisation that fails is told by [`failure`](Self::failure) and by the next solve.
    ///
    /// # Errors
    /// When PETSc cannot use the matrix with the types chosen.
    pub fn set_up(&self) -> Result<()> {
        let advise = |error: Error| {
            error.help(format!(
                "choose other {0}ksp_type, {0}pc_type, ...",
                self.own_options()
            ))
        };
        petsc!(KSPSetUp(self.ksp)).map_err(advise)?;
        petsc!(KSPSetUpOnBlocks(self.ksp)).map_err(advise)
    }

    /// What went wrong in making the preconditioner, such as a zero pivot; `None` if nothing did.
    pub fn failure(&self) -> Option<String> {
        let pc = self.pc().ok()?;
        let mut reason = ffi::PCFailedReason_PC_NOERROR;
        petsc!(PCGetFailedReason(pc, &mut reason)).ok()?;
        let text = match reason {
            ffi::PCFailedReason_PC_NOERROR => return None,
            ffi::PCFailedReason_PC_FACTOR_STRUCT_ZEROPIVOT => {
                "a zero pivot in the pattern of the factorisation"
            }
            ffi::PCFailedReason_PC_FACTOR_NUMERIC_ZEROPIVOT => "a zero pivot in the factorisation",
            ffi::PCFailedReason_PC_FACTOR_OUTMEMORY => "not enough memory for the factorisation",
            ffi::PCFailedReason_PC_FACTOR_OTHER => "the factorisation failed",
            ffi::PCFailedReason_PC_SUBPC_ERROR => "a preconditioner inside it failed",
            _ => "its set-up failed",
        };
        Some(match self.mumps_info(pc) {
            Some((first, second)) => {
                format!("{text}; MUMPS says INFOG(1)={first}, INFOG(2)={second}")
            }
            None => text.to_owned(),
        })
    }

    /// Solves `A x = b` from a zero guess, without copies.
    ///
    /// # Errors
    /// When a slice has not one entry a row, or no matrix was set. Divergence is told in [`Solved::reason`].
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<Solved> {
        let Some([right, left]) = &self.vectors else {
            return Err(Error::new(
                Kind::Solver,
                "a linear solver was called before it had a matrix",
            ));
        };
        same("b", b.len(), self.rows)?;
        same("x", x.len(), self.rows)?;
        let mut guess = ffi::PetscBool_PETSC_FALSE;
        petsc!(KSPGetInitialGuessNonzero(self.ksp, &mut guess))?;
        if guess != ffi::PetscBool_PETSC_FALSE {
            x.fill(0.0);
        }
        {
            let right = right.place(b.as_ptr())?;
            let left = left.place(x.as_mut_ptr())?;
            petsc!(KSPSolve(self.ksp, right.vec(), left.vec()))?;
        }
        let (mut iterations, mut reason, mut residual) = (0, 0, 0.0);
        petsc!(KSPGetIterationNumber(self.ksp, &mut iterations))?;
        petsc!(KSPGetConvergedReason(self.ksp, &mut reason))?;
        petsc!(KSPGetResidualNorm(self.ksp, &mut residual))?;
        let reason = ConvergedReason::from_raw(reason, || {
            self.failure()
                .unwrap_or_else(|| "it is infinite or not a number where it was applied".to_owned())
        });
        Ok(Solved {
            iterations: iterations as usize,
            reason,
            residual,
        })
    }

    /// Sets the relative tolerance.
    ///
    /// # Errors
    /// When it is not between 0 and 1.
    pub fn set_tolerance(&self, rtol: f64) -> Result<()> {
        let [_, atol, dtol] = self.tolerances()?.0;
        let limit = self.tolerances()?.1;
        petsc!(KSPSetTolerances(self.ksp, rtol, atol, dtol, limit))
    }

    /// The relative tolerance in force.
    pub fn tolerance(&self) -> f64 {
        self.tolerances()
            .map_or(f64::NAN, |(tolerances, _)| tolerances[0])
    }

    /// Relative, absolute and divergence tolerance; iteration limit.
    fn tolerances(&self) -> Result<([f64; 3], Int)> {
        let ([mut rtol, mut atol, mut dtol], mut limit) = ([0.0; 3], 0);
        petsc!(KSPGetTolerances(
            self.ksp, &mut rtol, &mut atol, &mut dtol, &mut limit
        ))?;
        Ok(([rtol, atol, dtol], limit))
    }

    /// Type of the solver, such as `cg`; empty before it is known (after the options or the set-up).
    pub fn ksp_type(&self) -> String {
        let mut name: *const c_char = null();
        match petsc!(KSPGetType(self.ksp, &mut name)) {
            // SAFETY: PETSc's text, copied.
            Ok(()) => unsafe { string(name) },
            Err(_) => String::new(),
        }
    }

    /// Type of the preconditioner, such as `gamg`; empty before it is known (after the options or the set-up).
    pub fn pc_type(&self) -> String {
        let mut name: *const c_char = null();
        match self.pc().and_then(|pc| petsc!(PCGetType(pc, &mut name))) {
            // SAFETY: PETSc's text, copied.
            Ok(()) => unsafe { string(name) },
            Err(_) => String::new(),
        }
    }

    /// Package that factors, such as `mumps`; `None` for a preconditioner that is no factorisation, or before the
    /// set-up.
    pub fn factor_package(&self) -> Option<String> {
        let mut name: *const c_char = null();
        let pc = self.pc().ok()?;
        petsc!(PCFactorGetMatSolverType(pc, &mut name)).ok()?;
        // SAFETY: PETSc's text, copied.
        (!name.is_null()).then(|| unsafe { string(name) })
    }

    /// Keeps the preconditioner as it is while the matrix changes, or not.
    ///
    /// # Errors
    /// For `preonly`, whose answer would be that of an older matrix.
    pub fn set_reuse_preconditioner(&self, reuse: bool) -> Result<()> {
        if reuse && self.applies_only() {
            let name = self.ksp_type();
            return Err(Error::new(
                Kind::Solver,
                format!("`{name}` cannot keep the factorisation of an older matrix"),
            )
            .because("it applies it once and would return the solution of the older system")
            .help(format!(
                "take an iterative method, e.g. `{}ksp_type cg`",
                self.own_options()
            )));
        }
        petsc!(KSPSetReusePreconditioner(self.ksp, reuse as ffi::PetscBool))
    }

    /// All about the solver and its preconditioner, as `-ksp_view` prints it.
    ///
    /// # Errors
    /// When PETSc cannot show the solver.
    pub fn describe(&self) -> Result<String> {
        // SAFETY: the constant of MPI itself.
        let comm = unsafe { RSMPI_COMM_SELF };
        let (viewed, text) = print::caught(|| {
            let mut viewer = null_mut();
            petsc!(PetscViewerASCIIGetStdout(comm, &mut viewer))?;
            petsc!(KSPView(self.ksp, viewer))
        });
        viewed.map(|()| text)
    }

    /// Whether the solver applies its preconditioner once and calls that the solution.
    fn applies_only(&self) -> bool {
        matches!(self.ksp_type().as_str(), "preonly" | "none")
    }

    /// How its options begin, for messages.
    fn own_options(&self) -> String {
        format!("-{}", self.prefix)
    }

    /// PETSc's preconditioner, which belongs to the solver.
    fn pc(&self) -> Result<ffi::PC> {
        let mut pc = null_mut();
        petsc!(KSPGetPC(self.ksp, &mut pc))?;
        Ok(pc)
    }

    /// MUMPS' INFOG(1) and INFOG(2), where MUMPS factors.
    fn mumps_info(&self, pc: ffi::PC) -> Option<(Int, Int)> {
        if self.factor_package()? != "mumps" {
            return None;
        }
        let mut factor = null_mut();
        petsc!(PCFactorGetMatrix(pc, &mut factor)).ok()?;
        let (mut first, mut second) = (0, 0);
        petsc!(MatMumpsGetInfog(factor, 1, &mut first)).ok()?;
        petsc!(MatMumpsGetInfog(factor, 2, &mut second)).ok()?;
        Some((first, second))
    }
}

impl Drop for Ksp {
    fn drop(&mut self) {
        let _ = petsc!(KSPDestroy(&mut self.ksp));
    }
}
