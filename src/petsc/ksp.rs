//! Linear solvers (KSP with a preconditioner PC): their options, solves, subspaces around the preconditioner, why a
//! solve stopped, and how a solver recovers from a factorisation that failed.

use super::call::{flag, is_set, petsc, string, text, text_from};
use super::error::{Error, Result};
use super::mumps::EXTRA_SPACE;
use super::subspace::{Started, Subspace, Wrapper};
use super::vector::Vector;
use super::{Int, Matrix, Scope, Session, ffi};
use std::cell::Cell;
use std::ffi::CStr;
use std::fmt;
use std::ptr::{null, null_mut};

/// The outcome of a linear solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The number of iterations; 1 for a direct solve.
    pub iterations: usize,
    /// Why the solver stopped.
    pub reason: ConvergedReason,
    /// The norm of the last residual as the solver measures it (its `-ksp_norm_type`); 0 for a solver without a norm,
    /// such as `preonly`.
    pub residual: f64,
}

/// A linear solver: any KSP with any PC of PETSc, chosen by options.
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
/// assert_eq!(ksp.failure(), None);
/// let mut x = [0.0; 2];
/// let solved = ksp.solve(&[1.0, 2.0], &mut x)?;
/// assert!((x[0] - 1.0 / 11.0).abs() < 1e-12 && (x[1] - 7.0 / 11.0).abs() < 1e-12);
/// assert!(solved.iterations == 2 && solved.reason.converged());
/// assert_eq!((ksp.ksp_type(), ksp.pc_type(), ksp.factor_package()), ("cg".into(), "jacobi".into(), None));
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
    pub(super) ksp: ffi::KSP,
    /// PETSc's headers of right-hand side and solution, created with the operator.
    vectors: Option<[Vector; 2]>,
    /// Whether the last set-up of the preconditioner failed.
    has_failed: Cell<bool>,
    /// The subspaces around the preconditioner, the innermost first.
    wrappers: Vec<Wrapper>,
    prefix: String,
    scope: Scope,
    session: Session,
}

impl Ksp {
    /// Create a solver of this process that reads its options under a prefix, such as `upper_`.
    ///
    /// # Errors
    /// When PETSc does not accept the prefix.
    pub fn new(session: &Session, prefix: &str) -> Result<Ksp> {
        Self::of(session, Scope::Process, prefix)
    }

    /// Create a solver for matrices of this [`Scope`]. All calls are collective over its processes.
    ///
    /// # Errors
    /// When PETSc does not accept the prefix.
    pub fn of(session: &Session, scope: Scope, prefix: &str) -> Result<Ksp> {
        let (comm, mut ksp) = (scope.comm(session), null_mut());
        // SAFETY: all processes of the scope create it.
        unsafe { petsc!(KSPCreate(comm, &mut ksp)) }?;
        let solver = Ksp {
            ksp,
            vectors: None,
            has_failed: Cell::new(false),
            wrappers: Vec::new(),
            prefix: prefix.to_owned(),
            scope,
            session: session.clone(),
        };
        let name = text(prefix)?;
        // PETSc would print an empty prefix as a blank
        let pointer = if prefix.is_empty() { null() } else { name.as_ptr() };
        // SAFETY: PETSc copies the text.
        unsafe {
            petsc!(KSPSetOptionsPrefix(ksp, pointer))?;
            petsc!(KSPSetErrorIfNotConverged(ksp, flag(false)))?;
        }
        Ok(solver)
    }

    /// Factor a symmetric positive definite matrix with `rows` rows on this process by MUMPS, whatever options say.
    ///
    /// [`failure`](Self::failure) reports whether the factorisation succeeded.
    pub(super) fn factored(session: &Session, scope: Scope, matrix: ffi::Mat, rows: usize) -> Result<Ksp> {
        let mut solver = Self::of(session, scope, "patch_")?;
        let new = || Vector::new(session, scope, rows, 1);
        solver.vectors = Some([new()?, new()?]);
        let pc = solver.pc()?;
        // SAFETY: solver and preconditioner of this wrapper, which take references to the matrix.
        unsafe {
            petsc!(KSPSetOperators(solver.ksp, matrix, matrix))?;
            petsc!(KSPSetType(solver.ksp, c"preonly".as_ptr()))?;
            petsc!(PCSetType(pc, c"cholesky".as_ptr()))?;
            petsc!(PCFactorSetMatSolverType(pc, c"mumps".as_ptr()))?;
        }
        solver.set_up()?;
        Ok(solver)
    }

    /// Set the matrix of the system and of the preconditioner. The solver keeps it alive and sees its updates.
    ///
    /// # Errors
    /// When the solver had a matrix of another size, or belongs to other processes.
    pub fn set_operator(&mut self, matrix: &Matrix) -> Result<()> {
        if matrix.scope() != self.scope {
            return Err(Error::new("a matrix and its solver belong to different processes"));
        }
        // SAFETY: the solver takes references to the matrix.
        unsafe { petsc!(KSPSetOperators(self.ksp, matrix.raw(), matrix.raw())) }?;
        if self.vectors.as_ref().is_none_or(|[vector, _]| vector.len() != matrix.rows()) {
            let new = || Vector::new(&self.session, self.scope, matrix.rows(), matrix.block_size());
            self.vectors = Some([new()?, new()?]);
        }
        Ok(())
    }

    /// Choose the types of the solver and of its preconditioner, which options may replace.
    ///
    /// # Errors
    /// When PETSc does not know a type.
    pub fn set_types(&self, ksp: Option<&str>, pc: Option<&str>) -> Result<()> {
        // SAFETY: the solver of this wrapper.
        unsafe { set_types(self.ksp, ksp, pc) }
    }

    /// Choose the value of an option, by its name without prefix, that the user has not typed for this solver. To be
    /// called after [`set_types`](Self::set_types) and before the options are read.
    ///
    /// Types, tolerances, norms, and what a factorisation needs are set for this solver alone, also those of both
    /// levels of a multigrid ([`set_interpolation`](Self::set_interpolation)). Other options are put into PETSc's
    /// table, from where all solvers with this prefix read them.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let session = Session::start(&["-ksp_rtol".to_owned(), "1e-3".to_owned()])?;
    /// let a = Matrix::from_csr(&session, 1, vec![0, 1], vec![0], vec![2.0])?;
    /// let [mut direct, mut iterative] = [Ksp::new(&session, "")?, Ksp::new(&session, "")?];
    /// direct.set_types(Some("preonly"), Some("lu"))?;
    /// direct.set_default("pc_factor_mat_solver_type", "mumps")?;
    /// iterative.set_types(Some("cg"), Some("gamg"))?;
    /// iterative.set_default("ksp_norm_type", "natural")?;
    /// iterative.set_default("pc_gamg_threshold", "0.1")?;
    /// for ksp in [&mut direct, &mut iterative] {
    ///     ksp.set_operator(&a)?;
    ///     ksp.set_from_options()?;
    ///     ksp.set_up()?;
    /// }
    /// assert_eq!((direct.ksp_type(), direct.factor_package()), ("preonly".into(), Some("mumps".into())));
    /// assert_eq!((iterative.pc_type(), iterative.tolerance()), ("gamg".into(), 1e-3));
    /// assert!(session.options().used("-pc_gamg_threshold") && session.options().typed().len() == 1);
    /// session.clear_defaults();
    /// assert!(!session.options().has("-pc_gamg_threshold"));
    /// iterative.set_default("pc_gamg_threshold", "0.1")?;
    /// session.options().set("pc_gamg_threshold", Some("0.2"))?;
    /// session.clear_defaults();
    /// assert!(session.options().has("-pc_gamg_threshold")); // it is the user's now
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    ///
    /// # Errors
    /// When PETSc refuses the value.
    pub fn set_default(&self, name: &str, value: &str) -> Result<()> {
        let levels = [("mg_coarse_", 0), ("mg_levels_", 1)];
        let level = levels.into_iter().find_map(|(start, level)| Some((level, name.strip_prefix(start)?)));
        let (solver, bare) = match level {
            Some((level, bare)) => (self.smoother(level)?, bare),
            None => (self.ksp, name),
        };
        // SAFETY: the solver of this wrapper, or one that belongs to its preconditioner.
        if unsafe { set_value(solver, bare, value) }? {
            return Ok(());
        }
        self.session.options().set_default(&format!("{}{name}", self.prefix), value)
    }

    /// Read the options of the solver. `preonly` never keeps a preconditioner of an older matrix, whatever is typed:
    /// its answer would be wrong.
    ///
    /// # Errors
    /// When PETSc refuses an option, and for `-ksp_max_it 0`.
    pub fn set_from_options(&mut self) -> Result<()> {
        // SAFETY: the solver of this wrapper.
        unsafe { petsc!(KSPSetFromOptions(self.ksp)) }.map_err(|error| {
            error.help(format!(
                "options of this solver begin with `-{}`; -help lists all options and types",
                self.prefix
            ))
        })?;
        if self.applies_only() {
            // SAFETY: the solver of this wrapper.
            return unsafe { petsc!(KSPSetReusePreconditioner(self.ksp, flag(false))) };
        }
        let (mut limit, none) = (0, null_mut());
        // SAFETY: the solver of this wrapper; PETSc writes to no null pointer.
        unsafe { petsc!(KSPGetTolerances(self.ksp, none, none, none, &mut limit)) }?;
        // PETSc's conjugate gradients go through one iteration all the same, and may write where they have allocated
        // nothing
        if limit < 1 { Err(Self::idle(&format!("{}ksp_max_it", self.own_options()), limit)) } else { Ok(()) }
    }

    /// Return the refusal of an option that limits the number of iterations to none.
    pub(crate) fn idle(option: &str, limit: impl fmt::Display) -> Error {
        Error::new(format!("{option} is {limit}: the solver would do nothing"))
            .help("give 1 or more; `-ksp_type preonly` applies the preconditioner once")
    }

    /// Name the solver in what `-ksp_view` prints.
    pub fn set_name(&self, name: &str) -> Result<()> {
        let name = text(name)?;
        // SAFETY: PETSc copies the text.
        unsafe { petsc!(PetscObjectSetName(self.ksp.cast(), name.as_ptr())) }
    }

    /// Return whether the preconditioner is kept when the matrix changes.
    pub fn reuses_preconditioner(&self) -> bool {
        let mut reuse = flag(false);
        // SAFETY: the solver of this wrapper.
        let asked = unsafe { petsc!(KSPGetReusePreconditioner(self.ksp, &mut reuse)) };
        asked.is_ok() && is_set(reuse)
    }

    /// Set up the preconditioner or factorisation of the current matrix, if that has not been done. Every solve does
    /// so, too.
    ///
    /// [`failure`](Self::failure) and the next solve report a factorisation that failed.
    ///
    /// # Errors
    /// When PETSc cannot use the matrix with the chosen types.
    pub fn set_up(&self) -> Result<()> {
        let own = self.own_options();
        let advise = |error: Error| {
            match self.scope {
            Scope::Process => error.help(format!("choose other {own}ksp_type, {own}pc_type, ...")),
            Scope::World => error.help(format!(
                "several ranks have rows of this matrix: choose {own}pc_type hypre, {own}pc_type cholesky with mumps, or for a \
                 solver of one rank {own}pc_type bjacobi {own}sub_pc_type icc"
            )),
        }
        };
        self.recover()?;
        let pc = self.pc()?;
        // SAFETY: solver and preconditioner of this wrapper; without a matrix PETSc refuses.
        let make = || unsafe {
            petsc!(KSPSetUp(self.ksp))?;
            // KSPSetUp itself leaves new values of a known matrix to the first application
            petsc!(PCSetUp(pc))?;
            petsc!(KSPSetUpOnBlocks(self.ksp))
        };
        make().map_err(advise)?;
        // the first value is MUMPS' own default
        for &percent in &EXTRA_SPACE[1..] {
            if !self.lacks_space() {
                break;
            }
            self.reset()?;
            self.set_extra_space(Int::from(percent))?;
            make().map_err(advise)?;
        }
        self.note_failure()
    }

    /// Solve `A x = b` from a zero guess, without copies. [`Solved::reason`] reports divergence.
    ///
    /// # Errors
    /// When a slice does not have one entry for each row, or no matrix was set.
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<Solved> {
        let Some([right, left]) = &self.vectors else {
            return Err(Error::new("a linear solver was called before it had a matrix"));
        };
        let mut guess = flag(false);
        // SAFETY: the solver of this wrapper.
        unsafe { petsc!(KSPGetInitialGuessNonzero(self.ksp, &mut guess)) }?;
        if is_set(guess) {
            x.fill(0.0);
        }
        self.recover()?;
        // SAFETY: the solver reads `b` and writes to `x`.
        let solve = |b, x| unsafe { petsc!(KSPSolve(self.ksp, b, x)) };
        right
            .map(("b", b), left, ("x", x), solve)
            .map_err(|error| self.wrappers.iter().find_map(Wrapper::failure).unwrap_or(error))?;
        self.note_failure()?;
        let (mut iterations, mut reason, mut residual) = (0, 0, 0.0);
        // SAFETY: the solver of this wrapper.
        unsafe {
            petsc!(KSPGetIterationNumber(self.ksp, &mut iterations))?;
            petsc!(KSPGetConvergedReason(self.ksp, &mut reason))?;
            petsc!(KSPGetResidualNorm(self.ksp, &mut residual))?;
        }
        // SAFETY: PETSc's text.
        let mut text =
            unsafe { text_from(|text| petsc!(KSPGetConvergedReasonString(self.ksp, text))) }.unwrap_or_default();
        if let Some(failure) = self.failure().filter(|_| reason < 0) {
            text = format!("{text}: {failure}");
        }
        Ok(Solved { iterations: iterations as usize, reason: ConvergedReason { number: reason, text }, residual })
    }

    /// Apply the preconditioner once, `z = M^-1 r`, and set it up before if that has not been done.
    ///
    /// # Errors
    /// When a slice does not have one entry for each row, or no matrix was set.
    pub fn precondition(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        let Some([right, left]) = &self.vectors else {
            return Err(Error::new("a preconditioner was applied before it had a matrix"));
        };
        self.set_up()?;
        let pc = self.outermost_pc()?;
        // SAFETY: as in `solve`.
        right.map(("r", r), left, ("z", z), |r, z| unsafe { petsc!(PCApply(pc, r, z)) })
    }

    /// Set the relative tolerance, and leave the other limits as they are.
    ///
    /// # Errors
    /// When it is not between 0 and 1.
    pub fn set_tolerance(&self, rtol: f64) -> Result<()> {
        // SAFETY: the solver of this wrapper; -2 is PETSC_DEFAULT, which keeps a value.
        unsafe { petsc!(KSPSetTolerances(self.ksp, rtol, -2.0, -2.0, -2)) }
    }

    /// Return the relative tolerance in force.
    pub fn tolerance(&self) -> f64 {
        let (mut rtol, none) = (f64::NAN, null_mut());
        // SAFETY: the solver of this wrapper; PETSc writes to no null pointer. A failure leaves the tolerance unknown.
        let _ = unsafe { petsc!(KSPGetTolerances(self.ksp, &mut rtol, none, none, null_mut())) };
        rtol
    }

    /// Return the type of the solver, such as `cg`. It is empty until options were read or the solver was set up.
    pub fn ksp_type(&self) -> String {
        // SAFETY: null, or PETSc's text.
        unsafe { text_from(|name| petsc!(KSPGetType(self.ksp, name))) }.unwrap_or_default()
    }

    /// Return the type of the preconditioner, such as `gamg`. It is empty until options were read or the solver was set
    /// up.
    pub fn pc_type(&self) -> String {
        // SAFETY: as above.
        unsafe { text_from(|name| self.pc().and_then(|pc| petsc!(PCGetType(pc, name)))) }.unwrap_or_default()
    }

    /// Return the package that factors, such as `mumps`. It is `None` before the set-up and for preconditioners that do
    /// not factor.
    pub fn factor_package(&self) -> Option<String> {
        // SAFETY: as above.
        unsafe { text_from(|name| self.pc().and_then(|pc| petsc!(PCFactorGetMatSolverType(pc, name)))) }
    }

    /// Set whether the preconditioner is kept when the matrix changes.
    ///
    /// # Errors
    /// When `preonly` is to keep it: its answer would be that of an older matrix.
    pub fn set_reuse_preconditioner(&self, reuse: bool) -> Result<()> {
        if reuse && self.applies_only() {
            let name = self.ksp_type();
            return Err(Error::new(format!("`{name}` cannot keep the factorisation of an older matrix"))
                .because("it applies it once and would return the solution of the older system")
                .help(format!("take an iterative method, e.g. `{}ksp_type cg`", self.own_options())));
        }
        // SAFETY: the solver of this wrapper.
        unsafe { petsc!(KSPSetReusePreconditioner(self.ksp, flag(reuse))) }
    }

    /// Return whether the solver applies its preconditioner once and takes that for the solution.
    fn applies_only(&self) -> bool {
        matches!(self.ksp_type().as_str(), "preonly" | "none")
    }

    /// Return the beginning of the options of this solver, for messages.
    fn own_options(&self) -> String {
        format!("-{}", self.prefix)
    }
}

impl Ksp {
    /// Put an exact solve in a subspace around the preconditioner of this solver, and around subspaces that were added
    /// before.
    ///
    /// `matrix` is the matrix of this solver, and `name` is what `-ksp_view` shows. Collective. New values of the
    /// matrix need a new subspace.
    ///
    /// ```
    /// use std::{cell::Cell, rc::Rc};
    /// use winkler::petsc::{Error, Ksp, Matrix, Session, Subspace};
    /// /// The first unknown of diag(1e6, 2, 3), and how often it was solved.
    /// struct First(Rc<Cell<usize>>);
    /// impl Subspace for First {
    ///     fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<(), Error> {
    ///         self.0.set(self.0.get() + 1);
    ///         z[0] = r[0] / 1e6;
    ///         Ok(())
    ///     }
    /// }
    /// let options = ["-ksp_type", "cg", "-pc_type", "none", "-ksp_rtol", "1e-12"].map(String::from);
    /// let session = Session::start(&options)?;
    /// let a = Matrix::from_csr(&session, 1, vec![0, 1, 2, 3], vec![0, 1, 2], vec![1e6, 2.0, 3.0])?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&a)?;
    /// ksp.set_from_options()?;
    /// let calls = Rc::new(Cell::new(0));
    /// ksp.wrap(&a, c"first", Box::new(First(calls.clone())))?;
    /// let mut x = [0.0; 3];
    /// // two eigenvalues are left; the space is solved in before, and each application corrects afterwards alone
    /// assert_eq!(ksp.solve_until(&[1e6, 2.0, 3.0], &mut x, &mut |_| false)?.iterations, 2);
    /// assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12));
    /// assert_eq!(calls.get(), 4);
    /// // one application by itself corrects before and after
    /// ksp.precondition(&[1e6, 2.0, 3.0], &mut x)?;
    /// assert_eq!((x, calls.get()), ([1.0, 2.0, 3.0], 6));
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn wrap(&mut self, matrix: &Matrix, name: &'static CStr, subspace: Box<dyn Subspace>) -> Result<()> {
        let wrapper = Wrapper::new(matrix, self.outermost_pc()?, name, subspace)?;
        // SAFETY: a preconditioner of the same matrix.
        unsafe { petsc!(KSPSetPC(self.ksp, wrapper.pc)) }?;
        self.wrappers.push(wrapper);
        Ok(())
    }

    /// Go back to the preconditioner that options chose.
    pub fn unwrap(&mut self) -> Result<()> {
        if let Some(innermost) = self.wrappers.first() {
            // SAFETY: the preconditioner that this solver had.
            unsafe { petsc!(KSPSetPC(self.ksp, innermost.inner())) }?;
        }
        // the outermost first
        while self.wrappers.pop().is_some() {}
        Ok(())
    }

    /// Solve exactly in the outermost subspace before the iteration: set `x` to Q b and replace `rest` = b by b - A x.
    ///
    /// All residuals of conjugate gradients from there have Q r = 0 up to rounding. So an application needs no solve
    /// before M, which saves half of the work in the space, until the returned guard is dropped. Return `None` without
    /// a subspace, or for another method than `cg`.
    pub(super) fn start(&self, rest: &mut Vec<f64>, x: &mut [f64]) -> Result<Option<Started<'_>>> {
        let Some(outermost) = self.wrappers.last().filter(|_| self.ksp_type() == "cg") else { return Ok(None) };
        outermost.start(rest, x).map(Some)
    }

    /// Return the preconditioner that options chose, without the subspaces around it.
    pub(super) fn pc(&self) -> Result<ffi::PC> {
        match self.wrappers.first() {
            Some(innermost) => Ok(innermost.inner()),
            None => self.outermost_pc(),
        }
    }

    /// Return the solver on a level of a multigrid.
    pub(super) fn smoother(&self, level: Int) -> Result<ffi::KSP> {
        let (pc, mut smoother) = (self.pc()?, null_mut());
        // SAFETY: the smoother belongs to the preconditioner. PETSc refuses another one than multigrid.
        unsafe { petsc!(PCMGGetSmoother(pc, level, &mut smoother)) }?;
        Ok(smoother)
    }

    /// Return the preconditioner with all subspaces around it.
    fn outermost_pc(&self) -> Result<ffi::PC> {
        let mut pc = null_mut();
        // SAFETY: the solver of this wrapper, which owns its preconditioner.
        unsafe { petsc!(KSPGetPC(self.ksp, &mut pc)) }?;
        Ok(pc)
    }
}

/// Choose the types of a solver and of its preconditioner.
///
/// # Safety
/// The solver lives.
unsafe fn set_types(ksp: ffi::KSP, solver: Option<&str>, preconditioner: Option<&str>) -> Result<()> {
    let [solver, preconditioner] = [solver, preconditioner].map(|name| name.map(text).transpose());
    let mut pc = null_mut();
    // SAFETY: the caller's promise; the texts live until the end of the calls, and the solver owns its preconditioner.
    unsafe {
        if let Some(name) = solver? {
            petsc!(KSPSetType(ksp, name.as_ptr()))?;
        }
        if let Some(name) = preconditioner? {
            petsc!(KSPGetPC(ksp, &mut pc))?;
            petsc!(PCSetType(pc, name.as_ptr()))?;
        }
    }
    Ok(())
}

/// Set the value of an option of a solver, by its name without prefix, by a call. Return false if there is no call for
/// it.
///
/// # Safety
/// The solver lives.
unsafe fn set_value(ksp: ffi::KSP, name: &str, value: &str) -> Result<bool> {
    let (text, keep) = (text(value)?, -2.0);
    let mut pc = null_mut();
    // SAFETY: the caller's promise; the text lives until the end of the call, and the solver owns its preconditioner.
    // -2 is PETSC_DEFAULT, which keeps a value.
    unsafe {
        petsc!(KSPGetPC(ksp, &mut pc))?;
        match (name, value.parse::<f64>().ok()) {
            ("ksp_type", _) => set_types(ksp, Some(value), None)?,
            ("pc_type", _) => set_types(ksp, None, Some(value))?,
            ("ksp_rtol", Some(rtol)) => petsc!(KSPSetTolerances(ksp, rtol, keep, keep, -2))?,
            ("ksp_atol", Some(atol)) => petsc!(KSPSetTolerances(ksp, keep, atol, keep, -2))?,
            ("ksp_max_it", Some(limit)) => petsc!(KSPSetTolerances(ksp, keep, keep, keep, limit as Int))?,
            ("ksp_norm_type", _) if value == "natural" => {
                petsc!(KSPSetNormType(ksp, ffi::KSPNormType_KSP_NORM_NATURAL))?;
            }
            ("pc_factor_mat_solver_type", _) => petsc!(PCFactorSetMatSolverType(pc, text.as_ptr()))?,
            ("pc_factor_levels", Some(levels)) => petsc!(PCFactorSetLevels(pc, levels as Int))?,
            _ => return Ok(false),
        }
    }
    Ok(true)
}

impl Drop for Ksp {
    fn drop(&mut self) {
        // SAFETY: the one reference of this wrapper.
        let _ = unsafe { petsc!(KSPDestroy(&mut self.ksp)) };
    }
}

impl Ksp {
    /// Return why the set-up of the preconditioner failed, such as a zero pivot, or `None` if it did not.
    pub fn failure(&self) -> Option<String> {
        let pc = self.pc().ok()?;
        let reason = self.failed_reason().ok().filter(|reason| *reason != ffi::PCFailedReason_PC_NOERROR)?;
        // SAFETY: PETSc's texts, one for each of its reasons.
        let text = unsafe { string(*ffi::PCFailedReasons.offset(reason as isize)) };
        Some(match self.mumps_info(pc) {
            Some((first, second)) => format!("{text} (MUMPS: INFOG(1)={first}, INFOG(2)={second})"),
            None => text,
        })
    }

    /// Reset a preconditioner that failed: PETSc's interface to MUMPS never factors again after a failure.
    pub(super) fn recover(&self) -> Result<()> {
        if self.has_failed.replace(false) { self.reset() } else { Ok(()) }
    }

    /// Reset the preconditioner, and keep the matrix and everything else.
    pub(super) fn reset(&self) -> Result<()> {
        let pc = self.pc()?;
        let (mut matrix, mut same) = (null_mut(), null_mut());
        // SAFETY: the reset drops the matrix; our reference keeps it until it is set again.
        unsafe {
            petsc!(PCGetOperators(pc, &mut matrix, &mut same))?;
            petsc!(PetscObjectReference(matrix.cast()))?;
            let set = petsc!(PCReset(pc)).and_then(|()| petsc!(KSPSetOperators(self.ksp, matrix, matrix)));
            petsc!(PetscObjectDereference(matrix.cast()))?;
            set
        }
    }

    /// Return whether MUMPS' factorisation needed more space or message buffers than its analysis foresaw.
    ///
    /// The need of several ranks depends on the order of their messages.
    fn lacks_space(&self) -> bool {
        let info = || self.mumps_info(self.pc().ok()?);
        self.failure().is_some() && info().is_some_and(|(first, _)| matches!(first, -8 | -9 | -17 | -20))
    }

    /// Allow the next factorisation `percent` more space than MUMPS' analysis foresees. To be called before its set-up.
    fn set_extra_space(&self, percent: Int) -> Result<()> {
        let (pc, mut factor) = (self.pc()?, null_mut());
        // SAFETY: the matrix of the factors belongs to the preconditioner; PETSc refuses one that is not of MUMPS.
        unsafe {
            petsc!(PCFactorSetUpMatSolverType(pc))?;
            petsc!(PCFactorGetMatrix(pc, &mut factor))?;
            petsc!(MatMumpsSetIcntl(factor, 14, percent))
        }
    }

    /// Note whether the preconditioner failed.
    pub(super) fn note_failure(&self) -> Result<()> {
        self.has_failed.set(self.failed_reason()? != ffi::PCFailedReason_PC_NOERROR);
        Ok(())
    }

    /// Return PETSc's reason for a failure of the preconditioner.
    fn failed_reason(&self) -> Result<ffi::PCFailedReason> {
        let mut reason = ffi::PCFailedReason_PC_NOERROR;
        let pc = self.pc()?;
        // SAFETY: the preconditioner of this solver.
        unsafe { petsc!(PCGetFailedReason(pc, &mut reason)) }?;
        Ok(reason)
    }

    /// Return MUMPS' INFOG(1) and INFOG(2), if MUMPS factors.
    fn mumps_info(&self, pc: ffi::PC) -> Option<(Int, Int)> {
        if self.factor_package()? != "mumps" {
            return None;
        }
        let mut factor = null_mut();
        let (mut first, mut second) = (0, 0);
        // SAFETY: MUMPS has factored, and the factors belong to the preconditioner.
        unsafe {
            petsc!(PCFactorGetMatrix(pc, &mut factor)).ok()?;
            petsc!(MatMumpsGetInfog(factor, 1, &mut first)).ok()?;
            petsc!(MatMumpsGetInfog(factor, 2, &mut second)).ok()?;
        }
        Some((first, second))
    }
}

/// The reason why a linear solver stopped, displayed in PETSc's words: `CONVERGED_RTOL`, `DIVERGED_ITS`, ...
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConvergedReason {
    /// PETSc's number of the reason, positive for convergence.
    pub number: ffi::KSPConvergedReason,
    text: String,
}

impl ConvergedReason {
    /// Return whether the solver converged. An iteration that has not ended did not.
    pub fn converged(&self) -> bool {
        self.number > 0
    }
}

impl fmt::Display for ConvergedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
