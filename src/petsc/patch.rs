//! A local correction: an exact solve on a few dofs before and after the preconditioner of a solver.
//!
//! A preconditioner M may belong to a matrix that differs from A on some dofs P. A symmetric multiplicative Schwarz
//! step makes it one of A:
//!
//! ```text
//! y = S r_P,   z = P y + M (r - A P y),   z += P S (r - A z)_P       S = (P'AP)^-1
//! ```
//!
//! r is the residual and z the result. The last product needs the columns P of A only; each process has its rows of
//! these columns.

use super::call::{flag, petsc};
use super::error::Result;
use super::matrix::Indices;
use super::subspace::Subspace;
use super::vector::Vector;
use super::{Ksp, Matrix, ffi};

/// The space of the dofs P, with the columns P of A and the factor of P'AP.
struct PatchSpace {
    /// Local indices of the dofs P that this process owns.
    inside: Vec<usize>,
    /// Local indices of the owned rows that have entries in the columns P.
    touched: Vec<usize>,
    /// The rows `touched` and the columns P of A.
    columns: ffi::Mat,
    /// PETSc's header of a vector over the rows `touched`.
    over_touched: Vector,
    /// PETSc's header of a vector over P.
    over_inside: Vector,
    /// MUMPS with the factor of P'AP.
    factor: Ksp,
}

impl Ksp {
    /// Add a local correction to the preconditioner of this solver, which stays that of an older matrix.
    ///
    /// The correction solves exactly on the `dofs` of the `matrix` of this solver and on those within `layers` of its
    /// graph around them. `dofs` are global indices, the same on all processes. Collective. New values of the matrix
    /// need a new correction.
    ///
    /// Return false, and add nothing, if P'AP is not positive definite to rounding.
    ///
    /// ```
    /// use winkler::petsc::{Ksp, Matrix, Session};
    /// let session = Session::start(&["-ksp_type", "cg", "-pc_type", "jacobi"].map(String::from))?;
    /// // a spring in a chain of ten becomes a million times as stiff
    /// let (mut ptr, mut columns, mut values) = (vec![0], vec![], vec![]);
    /// for i in 0..10 {
    ///     for j in [i - 1, i, i + 1].into_iter().filter(|j| (0..10).contains(j)) {
    ///         columns.push(j);
    ///         values.push(if i == j { 2.0 } else { -1.0 });
    ///     }
    ///     ptr.push(columns.len() as _);
    /// }
    /// let mut matrix = Matrix::from_csr(&session, 1, ptr, columns, values)?;
    /// matrix.set_spd()?;
    /// let mut ksp = Ksp::new(&session, "")?;
    /// ksp.set_operator(&matrix)?;
    /// ksp.set_from_options()?;
    /// ksp.set_up()?;
    /// ksp.set_reuse_preconditioner(true)?;
    /// matrix.update(|values| [9, 12].map(|at| values[at] += 1e6))?;
    /// matrix.update(|values| [10, 11].map(|at| values[at] -= 1e6))?;
    /// let mut x = [0.0; 10];
    /// let worn = ksp.solve(&[1.0; 10], &mut x)?.iterations;
    /// ksp.patch(&matrix, &[3, 4], 0)?;
    /// let patched = ksp.solve(&[1.0; 10], &mut x)?.iterations;
    /// assert!(patched < worn && (x[3] - x[4]).abs() < 1e-4 && x[3] > 12.0, "{worn} {patched} {x:?}");
    /// ksp.unwrap()?;
    /// assert_eq!(ksp.pc_type(), "jacobi");
    /// # Ok::<(), winkler::error::Error>(())
    /// ```
    pub fn patch(&mut self, matrix: &Matrix, dofs: &[usize], layers: usize) -> Result<bool> {
        self.recover()?;
        let Some(patch) = PatchSpace::new(matrix, dofs, layers)? else { return Ok(false) };
        let name = c"exact solve on some dofs around the preconditioner";
        self.wrap(matrix, name, Box::new(patch))?;
        Ok(true)
    }
}

impl PatchSpace {
    fn new(matrix: &Matrix, dofs: &[usize], layers: usize) -> Result<Option<Self>> {
        let (session, scope, owned) = (matrix.session(), matrix.scope(), matrix.own());
        let header = |rows: &[usize]| Vector::new(session, scope, rows.len(), 1);
        let mut dofs = of_whole_nodes(Indices::around(matrix, dofs, layers)?, matrix.block_size());
        // The factor of all rows costs little more than that of most of them. With it nothing is left to the iteration,
        // whose digits the soft motions of a small stiff rest would take.
        if 2 * dofs.len() > matrix.total() {
            dofs = (0..matrix.total()).collect();
        }
        let mut touched = Indices::around(matrix, &dofs, 1)?;
        touched.retain(|i| owned.contains(i));
        let mut inside: Vec<usize> = dofs.iter().copied().filter(|i| owned.contains(i)).collect();
        let inside_set = Indices::new(scope.comm(session), &inside)?;
        let factor = factor(matrix, &inside_set, inside.len())?;
        if factor.failure().is_some() {
            return Ok(None);
        }
        let (over_touched, over_inside) = (header(&touched)?, header(&inside)?);
        let columns = Indices::new(scope.comm(session), &touched)?.submatrix(matrix, &inside_set)?;
        inside.iter_mut().chain(&mut touched).for_each(|i| *i -= owned.start);
        Ok(Some(Self { inside, touched, columns, over_touched, over_inside, factor }))
    }
}

/// Return all dofs of the nodes that the sorted `dofs` belong to.
fn of_whole_nodes(mut dofs: Vec<usize>, block_size: usize) -> Vec<usize> {
    dofs.iter_mut().for_each(|dof| *dof /= block_size);
    dofs.dedup();
    dofs.into_iter().flat_map(|node| node * block_size..(node + 1) * block_size).collect()
}

/// Factor P'AP, where `inside` are the `count` dofs P that this process owns. Collective.
fn factor(matrix: &Matrix, inside: &Indices, count: usize) -> Result<Ksp> {
    let mut block = inside.submatrix(matrix, inside)?;
    // SAFETY: a matrix of rows and columns of one that is positive definite.
    unsafe {
        petsc!(MatSetOption(block, ffi::MatOption_MAT_SYMMETRIC, flag(true)))?;
        petsc!(MatSetOption(block, ffi::MatOption_MAT_SPD, flag(true)))?;
    }
    let solver = Ksp::factored(matrix.session(), matrix.scope(), block, count);
    // SAFETY: our reference; the solver has its own.
    unsafe { petsc!(MatDestroy(&mut block)) }?;
    solver
}

impl Subspace for PatchSpace {
    fn correct(&self, r: &[f64], z: &mut [f64]) -> Result<()> {
        let part: Vec<f64> = self.touched.iter().map(|&i| z[i]).collect();
        let (mut rest, mut y) = (vec![0.0; self.inside.len()], vec![0.0; self.inside.len()]);
        // SAFETY: the product reads one and writes to the other.
        let product = |part, az| unsafe { petsc!(MatMultTranspose(self.columns, part, az)) };
        self.over_touched.map(("z", &part), &self.over_inside, ("A z", &mut rest), product)?;
        rest.iter_mut().zip(&self.inside).for_each(|(rest, &i)| *rest = r[i] - *rest);
        self.factor.solve(&rest, &mut y)?;
        self.inside.iter().zip(&y).for_each(|(&i, y)| z[i] += y);
        Ok(())
    }
}

impl Drop for PatchSpace {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(MatDestroy(&mut self.columns)) };
    }
}
