//! An exact solve in a subspace around the preconditioner of a solver (PETSc's PCDEFLATION).
//!
//! W has the vectors of the space as columns. With the matrix A, the preconditioner M, and Q = W (W'AW)^-1 W', a solve of A x = b starts from
//! x = Q b, and M becomes (I - Q A) M. All residuals then have W'r = 0 (Tang, Nabben, Vuik, Erlangga, J. Sci. Comput. 39, 2009, "A-DEF2").
//!
//! PCDEFLATION forms W'A and W'AW only once, and destroys the preconditioner inside when it is reset. So each change of A gets a new one, and the
//! preconditioner inside is behind a PCSHELL.

use super::error::ERROR;
use super::integers::flag;
use super::library::{self, petsc};
use super::matrix::tall;
use super::mumps::{EXTRA_SPACE, is_lack_of_space};
use super::vector::slice;
use super::{Int, Matrix, Scope, ffi};
use crate::error::Result;
use mpi::ffi::RSMPI_COMM_SELF;
use std::ffi::c_void;
use std::ptr::{null, null_mut};

/// Vectors of a deflation space, such as rigid motions of bodies, in the rows of this process.
#[derive(Debug, Default)]
pub struct Motions {
    /// The number of vectors of all processes.
    pub count: usize,
    /// Entries of the vectors.
    pub parts: Vec<MotionPart>,
}

/// Some entries of a vector. All others that are not listed are zero.
#[derive(Debug)]
pub struct MotionPart {
    /// The number of the vector, the same on all processes.
    pub motion: usize,
    /// The first row, counted from the first one of this process.
    pub first: usize,
    /// The entries from that row on.
    pub values: Vec<f64>,
}

/// An entry of W.
struct Entry {
    /// The row, counted from the first one of this process.
    row: usize,
    column: usize,
    value: f64,
}

/// PCDEFLATION around the preconditioner that options chose.
pub(super) struct Deflation {
    pub(super) outer: ffi::PC,
    /// The preconditioner inside.
    pub(super) inner: ffi::PC,
    /// One iteration of Richardson's method: an exact solve in the space before and after one application of the preconditioner.
    pub(super) once: ffi::KSP,
}

impl Drop for Deflation {
    fn drop(&mut self) {
        // SAFETY: the references of this type. The solver has another preconditioner by now, or is gone.
        unsafe {
            let _ = petsc!(KSPDestroy(&mut self.once));
            let _ = petsc!(PCDestroy(&mut self.outer));
            let _ = petsc!(PCDestroy(&mut self.inner));
        }
    }
}

/// Options by which MUMPS factors W'AW: PETSc would take LU by another package.
const FACTOR: [(&str, &str); 2] =
    [("-winkler_deflation_pc_type", "cholesky"), ("-winkler_deflation_pc_factor_mat_solver_type", "mumps")];

impl Deflation {
    /// Make the preconditioner of the space of `dofs` and `motions` around the preconditioner `inner` of a matrix. Return `None` if W'AW is not positive
    /// definite to rounding. Collective.
    pub(super) fn new(
        matrix: &Matrix,
        inner: ffi::PC,
        (dofs, layers): (&[usize], usize),
        motions: Option<&Motions>,
    ) -> Result<Option<Self>> {
        let dofs = of_whole_nodes(around(matrix, dofs, layers)?, matrix.block_size());
        let mut space = space(matrix, &dofs, motions)?;
        let made = Self::definite(matrix, inner, space);
        // SAFETY: our reference; PETSc keeps its own.
        unsafe { petsc!(MatDestroy(&mut space)) }?;
        made
    }

    /// Make the preconditioner of a space, with more work space for MUMPS where its analysis foresees too little. Return `None` if W'AW is not positive
    /// definite to rounding.
    fn definite(matrix: &Matrix, inner: ffi::PC, space: ffi::Mat) -> Result<Option<Self>> {
        let options = matrix.session().options();
        for percent in EXTRA_SPACE {
            let percent = percent.to_string();
            let set = [FACTOR[0], FACTOR[1], ("-winkler_deflation_mat_mumps_icntl_14", &percent)];
            set.iter().try_for_each(|(name, value)| options.set(name, Some(value)))?;
            let made = Self::make(matrix, inner, space);
            set.iter().try_for_each(|(name, _)| options.clear(name))?;
            let made = made?;
            match made.failure(matrix)? {
                0 => return Ok(Some(made)),
                info if is_lack_of_space(info) => {}
                _ => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Make and set up the preconditioner of a space.
    ///
    /// The first process factors W'AW. For two spheres of 99 900 dofs (8166 of them in the space) on two processes the run takes 5.4 CPU s and 267 MB,
    /// and 6.7 s and 249 MB with MUMPS on both, the least of five pairs.
    fn make(matrix: &Matrix, inner: ffi::PC, space: ffi::Mat) -> Result<Self> {
        let (session, scope) = (matrix.session(), matrix.scope());
        let (comm, mut within) = (scope.comm(session), null_mut());
        // SAFETY: our own reference to the preconditioner.
        unsafe { petsc!(PetscObjectReference(inner.cast())) }?;
        let mut made = Self { outer: null_mut(), inner, once: null_mut() };
        // SAFETY: new objects of one communicator. The context of the shell is `inner`, which lives as long as `made`.
        unsafe {
            petsc!(PCCreate(comm, &mut made.outer))?;
            petsc!(PCSetOptionsPrefix(made.outer, c"winkler_".as_ptr()))?;
            petsc!(PCSetType(made.outer, c"deflation".as_ptr()))?;
            petsc!(PCSetOperators(made.outer, matrix.raw(), matrix.raw()))?;
            petsc!(PCDeflationSetSpace(made.outer, space, flag(false)))?;
            petsc!(PCDeflationSetReductionFactor(made.outer, scope.processes(session) as Int))?;
            petsc!(PCSetUp(made.outer))?;
            petsc!(PCDeflationGetPC(made.outer, &mut within))?;
            petsc!(PCSetType(within, c"shell".as_ptr()))?;
            petsc!(PCShellSetContext(within, inner.cast()))?;
            petsc!(PCShellSetApply(within, Some(apply)))?;
            petsc!(PCShellSetView(within, Some(view)))?;
            petsc!(PCSetUp(within))?;
            petsc!(KSPCreate(comm, &mut made.once))?;
            petsc!(KSPSetPC(made.once, made.outer))?;
            petsc!(KSPSetOperators(made.once, matrix.raw(), matrix.raw()))?;
            petsc!(KSPSetType(made.once, c"richardson".as_ptr()))?;
            petsc!(KSPSetNormType(made.once, ffi::KSPNormType_KSP_NORM_NONE))?;
            petsc!(KSPSetTolerances(made.once, 0.5, 0.0, 1e5, 1))?;
        }
        Ok(made)
    }

    /// Return MUMPS' INFOG(1) if W'AW could not be factored, 0 if it could. Collective.
    fn failure(&self, matrix: &Matrix) -> Result<Int> {
        let (mut coarse, mut gathered, mut solver, mut pc) = (null_mut(), null_mut(), null_mut(), null_mut());
        let (mut reason, mut factor, mut info) = (ffi::PCFailedReason_PC_NOERROR, null_mut(), 0);
        // SAFETY: PETSc gathers W'AW on one process (PCTELESCOPE), and the others have no solver. MUMPS has factored.
        unsafe {
            petsc!(PCDeflationGetCoarseKSP(self.outer, &mut coarse))?;
            petsc!(KSPGetPC(coarse, &mut gathered))?;
            petsc!(PCTelescopeGetKSP(gathered, &mut solver))?;
            if !solver.is_null() {
                petsc!(KSPGetPC(solver, &mut pc))?;
                petsc!(PCGetFailedReason(pc, &mut reason))?;
                petsc!(PCFactorGetMatrix(pc, &mut factor))?;
                petsc!(MatMumpsGetInfog(factor, 1, &mut info))?;
            }
        }
        let failed = reason != ffi::PCFailedReason_PC_NOERROR;
        let mut code = [if failed { info.min(-1) as f64 } else { 0.0 }];
        matrix.scope().sum(matrix.session(), &mut code);
        Ok(code[0] as Int)
    }
}

/// Return the `rows` of a matrix with the rows within `layers` of its graph around them, sorted. Collective.
fn around(matrix: &Matrix, rows: &[usize], layers: usize) -> Result<Vec<usize>> {
    let numbers: Vec<Int> = rows.iter().map(|&row| row as Int).collect();
    let (mut set, mut count, mut found) = (null_mut(), numbers.len() as Int, null());
    // SAFETY: PETSc copies the numbers, replaces the set by a new one, and its array is read before it is given back.
    unsafe {
        let copy = ffi::PetscCopyMode_PETSC_COPY_VALUES;
        petsc!(ISCreateGeneral(RSMPI_COMM_SELF, count, numbers.as_ptr(), copy, &mut set))?;
        petsc!(MatIncreaseOverlap(matrix.raw(), 1, &mut set, layers as Int))?;
        petsc!(ISSort(set))?;
        petsc!(ISGetLocalSize(set, &mut count))?;
        petsc!(ISGetIndices(set, &mut found))?;
        let rows = slice(found, count as usize).iter().map(|row| *row as usize).collect();
        petsc!(ISRestoreIndices(set, &mut found))?;
        petsc!(ISDestroy(&mut set))?;
        Ok(rows)
    }
}

/// Return all dofs of the nodes that the sorted `dofs` belong to.
fn of_whole_nodes(mut dofs: Vec<usize>, block_size: usize) -> Vec<usize> {
    dofs.iter_mut().for_each(|dof| *dof /= block_size);
    dofs.dedup();
    dofs.into_iter().flat_map(|node| node * block_size..(node + 1) * block_size).collect()
}

/// Return W: the unit vectors of `dofs`, which are sorted, and the `motions`. Collective.
///
/// A unit vector belongs to the process that owns its dof. The motions belong to the first process, after its unit vectors.
fn space(matrix: &Matrix, dofs: &[usize], motions: Option<&Motions>) -> Result<ffi::Mat> {
    let (session, scope, own) = (matrix.session(), matrix.scope(), matrix.own());
    let count = motions.map_or(0, |motions| motions.count);
    let owned = dofs.partition_point(|dof| *dof < own.start)..dofs.partition_point(|dof| *dof < own.end);
    let is_first = scope == Scope::Process || session.rank() == 0;
    let mut first_motion = [if is_first { owned.end as f64 } else { 0.0 }];
    scope.sum(session, &mut first_motion);
    let first_motion = first_motion[0] as usize;
    let column = |place: usize| if place < first_motion { place } else { place + count };
    let mut entries: Vec<Entry> =
        owned.clone().map(|place| Entry { row: dofs[place] - own.start, column: column(place), value: 1.0 }).collect();
    for MotionPart { motion, first, values } in motions.iter().flat_map(|motions| &motions.parts) {
        let column = first_motion + motion;
        let nonzero = values.iter().enumerate().filter(|(_, value)| **value != 0.0);
        entries.extend(nonzero.map(|(i, value)| Entry { row: first + i, column, value: *value }));
    }
    entries.sort_unstable_by_key(|entry| (entry.row, entry.column));
    let ptr: Vec<Int> = (0..=own.len()).map(|row| entries.partition_point(|entry| entry.row < row) as Int).collect();
    let columns: Vec<Int> = entries.iter().map(|entry| entry.column as Int).collect();
    let values: Vec<f64> = entries.iter().map(|entry| entry.value).collect();
    tall(matrix, [&ptr, &columns], &values, owned.len() + if is_first { count } else { 0 })
}

/// The callback for PCApply.
unsafe extern "C" fn apply(pc: ffi::PC, r: ffi::Vec, z: ffi::Vec) -> ffi::PetscErrorCode {
    // SAFETY: PETSc passes its own preconditioner, and two vectors.
    unsafe { inside(pc, |petsc, inner| petsc.PCApply(inner, r, z)) }
}

/// The callback for PCView.
unsafe extern "C" fn view(pc: ffi::PC, viewer: ffi::PetscViewer) -> ffi::PetscErrorCode {
    // SAFETY: as above.
    unsafe { inside(pc, |petsc, inner| petsc.PCView(inner, viewer)) }
}

/// Call PETSc with the preconditioner inside. PETSc itself reports an error of the call.
unsafe fn inside(pc: ffi::PC, call: impl FnOnce(&ffi::Library, ffi::PC) -> ffi::PetscErrorCode) -> ffi::PetscErrorCode {
    let Ok(petsc) = library::running() else { return ERROR };
    let mut inner = null_mut::<c_void>();
    // SAFETY: the context of the shell is the preconditioner inside.
    unsafe {
        let code = petsc.PCShellGetContext(pc, (&raw mut inner).cast());
        if code as i64 == 0 { call(petsc, inner.cast()) } else { code }
    }
}
