//! Schur complements by MUMPS itself.
//!
//! Through PETSc, MUMPS would take a poor ordering and return the complement in part only.

use super::Session;
use super::call::fit;
use super::error::{Error, Result};
use super::ffi::{DMUMPS_STRUC_C, MumpsInt, dmumps_c};
use super::metis::{self, Graph};
use mpi::ffi::{RSMPI_COMM_SELF, RSMPI_Comm_c2f};
use std::ptr::null_mut;

/// Space beyond the estimate of the analysis, in per cent; the values are tried one after the other.
pub(super) const EXTRA_SPACE: [i32; 4] = [20, 60, 200, 1000];

/// Values of ICNTL(7): the elimination order by MUMPS' approximate minimum degree, and a given one. With a Schur
/// complement MUMPS replaces PORD by minimum degree. `groove3d` with n = 40 (237 636 dofs) takes 1226 MB with it, and
/// 1032 MB with METIS.
const MINIMUM_DEGREE: MumpsInt = 0;
const GIVEN: MumpsInt = 1;

/// Largest number of dofs of a plane body that is ordered by minimum degree.
///
/// Up to this size nested dissection takes a third to half of the time of everything else, and saves at most 8 % of the
/// fill. It saves 18 % at 50 000 dofs, and in space a quarter at 12 000.
const SMALL: usize = 20_000;

/// Controls ICNTL that this module sets itself.
const RESERVED: [(usize, &str); 8] = [
    (5, "format of the matrix"),
    (10, "iterative refinement, which has no matrix any more"),
    (11, "error analysis, which has no matrix any more"),
    (18, "distribution of the matrix"),
    (19, "Schur complement"),
    (20, "format of right-hand sides"),
    (21, "distribution of solutions"),
    (26, "condensation"),
];

/// A sparse symmetric positive definite matrix K whose interior dofs are eliminated.
///
/// R are the interface dofs and I the interior dofs, which are all others. The Schur complement is S = K_RR - K_RI
/// K_II^-1 K_IR. One symbolic and one numeric factorisation of K_II give S, condensed right-hand sides, and the
/// solution in the interior.
///
/// ```
/// use winkler::petsc::{Schur, Session};
/// // the chain 0 - 1 - 2 of springs, held to the ground at 0 and 2, of which dof 2 is on the interface
/// let session = Session::start(&[])?;
/// let lower = [(0, 0, 2.0), (1, 0, -1.0), (1, 1, 2.0), (2, 1, -1.0), (2, 2, 2.0)];
/// let mut schur = Schur::analyse(&session, &[], 1, 3, &lower, &[2])?;
/// schur.factor()?;
/// assert!((schur.take_complement()[0] - (2.0 - 2.0 / 3.0)).abs() < 1e-14);
/// let condensed = schur.condense(&[3.0, 0.0, 1.0])?;
/// assert!((condensed[0] - 2.0).abs() < 1e-14);
/// let x = schur.expand(&[3.0, 0.0, 1.0], &[1.5])?;
/// assert!((x[0] - 2.5).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14 && x[2] == 1.5);
/// # Ok::<(), winkler::error::Error>(())
/// ```
pub struct Schur {
    /// The struct of MUMPS, which keeps pointers into the arrays below.
    mumps: Box<DMUMPS_STRUC_C>,
    rows: Vec<MumpsInt>,
    columns: Vec<MumpsInt>,
    values: Vec<f64>,
    positions: Vec<MumpsInt>,
    interface: Vec<MumpsInt>,
    complement: Vec<f64>,
    /// Powers of two D, one for each dof, with which D K D has diagonal entries near one.
    scale: Vec<f64>,
    _session: Session,
}

impl Schur {
    /// Analyse the elimination of all dofs but the `interface` ones, which may be none.
    ///
    /// `lower` holds (row, column, value) of the lower triangle, row by row, each entry once. `block_size` dofs belong
    /// to one node. The `controls` are options `mat_mumps_icntl_<i>` and `mat_mumps_cntl_<i>` with their values.
    ///
    /// The order of elimination is nested dissection by METIS (ICNTL(7) = 1). Small plane bodies take MUMPS' own
    /// approximate minimum degree (0).
    ///
    /// MUMPS treats pivots below an absolute size (about 1e-20) as zeros, and does not scale a matrix with a Schur
    /// complement. It gets D K D with powers of two D, which round nothing. What counts as small then depends neither
    /// on units nor on other regions.
    ///
    /// # Errors
    /// When a control cannot be used, or MUMPS refuses the pattern.
    pub fn analyse(
        session: &Session,
        controls: &[(&str, &str)],
        block_size: usize,
        rows: usize,
        lower: &[(usize, usize, f64)],
        interface: &[usize],
    ) -> Result<Schur> {
        let one = |i: usize| i as MumpsInt + 1;
        let inside = lower.iter().all(|&(i, j, _)| i < rows && j <= i) && interface.iter().all(|&i| i < rows);
        if !inside || interface.len() >= rows || !rows.is_multiple_of(block_size) {
            return Err(Error::new("not a lower triangle with interior rows"));
        }
        fit::<MumpsInt>("MUMPS", "dofs", rows + 1)?;
        // MUMPS needs MPI
        let scale = scales(rows, lower);
        let mut schur = Schur {
            // SAFETY: MUMPS' struct is plain C data; zeros are null pointers and sizes of nothing.
            mumps: Box::new(unsafe { std::mem::zeroed() }),
            rows: lower.iter().map(|entry| one(entry.0)).collect(),
            columns: lower.iter().map(|entry| one(entry.1)).collect(),
            values: lower.iter().map(|&(i, j, value)| value * scale[i] * scale[j]).collect(),
            scale,
            positions: Vec::new(),
            interface: interface.iter().map(|&i| one(i)).collect(),
            complement: vec![0.0; interface.len() * interface.len()],
            _session: session.clone(),
        };
        schur.start()?;
        schur.mumps.icntl[6] = if Self::is_large(block_size, rows) { GIVEN } else { MINIMUM_DEGREE };
        controls.iter().try_for_each(|(name, value)| schur.control(name, value))?;
        let mumps = &mut *schur.mumps;
        if mumps.icntl[6] == GIVEN {
            schur.positions = positions(block_size, rows, lower, interface)?;
            mumps.perm_in = schur.positions.as_mut_ptr();
        }
        mumps.n = rows as MumpsInt;
        mumps.nnz = schur.values.len() as i64;
        mumps.irn = schur.rows.as_mut_ptr();
        mumps.jcn = schur.columns.as_mut_ptr();
        mumps.a = schur.values.as_mut_ptr();
        mumps.size_schur = schur.interface.len() as MumpsInt;
        mumps.listvar_schur = schur.interface.as_mut_ptr();
        mumps.schur = schur.complement.as_mut_ptr();
        schur.call(1)?;
        Ok(schur)
    }

    /// Return whether a body with so many dofs at a node is eliminated by nested dissection.
    pub fn is_large(block_size: usize, rows: usize) -> bool {
        block_size > 2 || rows > SMALL
    }

    /// Return the memory in megabytes that the factorisation will take, without S.
    pub fn expected_megabytes(&self) -> usize {
        self.mumps.infog[15].max(0) as usize
    }

    /// Eliminate the interior. The functions below need that.
    ///
    /// # Errors
    /// When the interior is singular, or memory does not suffice.
    pub fn factor(&mut self) -> Result<()> {
        let requested = self.mumps.icntl[13];
        for percent in EXTRA_SPACE {
            self.mumps.icntl[13] = requested.max(percent);
            match self.call(2) {
                // the analysis underestimated the space
                Err(_) if matches!(self.mumps.infog[0], -8 | -9) && percent < EXTRA_SPACE[EXTRA_SPACE.len() - 1] => {}
                done => {
                    done?;
                    break;
                }
            }
        }
        // MUMPS has a copy of its own by now
        let mumps = &mut *self.mumps;
        (self.rows, self.columns, self.values) = Default::default();
        (mumps.irn, mumps.jcn, mumps.a) = (null_mut(), null_mut(), null_mut());
        self.complete();
        Ok(())
    }

    /// Undo the scaling of S and fill its upper triangle. MUMPS writes the lower triangle, row by row.
    fn complete(&mut self) {
        let (n, scale) = (self.interface.len(), &self.scale);
        let of = |i: usize| scale[self.interface[i] as usize - 1];
        for i in 0..n {
            for j in 0..=i {
                let value = self.complement[i * n + j] / of(i) / of(j);
                self.complement[i * n + j] = value;
                self.complement[j * n + i] = value;
            }
        }
    }

    /// Take S out, both triangles, row by row, in the order of the interface dofs. No function of this type needs it.
    pub fn take_complement(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.complement)
    }

    /// Return the condensed right-hand side b_R - K_RI K_II^-1 b_I.
    pub fn condense(&mut self, b: &[f64]) -> Result<Vec<f64>> {
        let mut reduced = vec![0.0; self.interface.len()];
        if reduced.is_empty() {
            return Ok(reduced);
        }
        self.solve(1, &mut self.scaled(b), &mut reduced)?;
        self.interface.iter().zip(&mut reduced).for_each(|(&dof, value)| *value /= self.scale[dof as usize - 1]);
        Ok(reduced)
    }

    /// Return x with the given x_R = `x_interface` and K_II x_I = b_I - K_IR x_R.
    pub fn expand(&mut self, b: &[f64], x_interface: &[f64]) -> Result<Vec<f64>> {
        self.condense(b)?;
        self.expand_condensed(b, x_interface)
    }

    /// Return the same x for the right-hand side of the last [`condense`](Self::condense), whose intermediate result
    /// MUMPS has kept.
    pub fn expand_condensed(&mut self, b: &[f64], x_interface: &[f64]) -> Result<Vec<f64>> {
        let mut x = self.scaled(b);
        let mut reduced: Vec<f64> =
            self.interface.iter().zip(x_interface).map(|(&dof, x)| x / self.scale[dof as usize - 1]).collect();
        self.solve(2, &mut x, &mut reduced)?;
        x.iter_mut().zip(&self.scale).for_each(|(x, scale)| *x *= scale);
        for (&dof, value) in self.interface.iter().zip(x_interface) {
            x[dof as usize - 1] = *value;
        }
        Ok(x)
    }

    /// Return D b.
    fn scaled(&self, b: &[f64]) -> Vec<f64> {
        b.iter().zip(&self.scale).map(|(b, scale)| b * scale).collect()
    }

    /// Do one phase of the solution (ICNTL(26)): phase 1 condenses `b` into `reduced`, phase 2 expands `reduced` into
    /// `b`.
    fn solve(&mut self, phase: MumpsInt, b: &mut [f64], reduced: &mut [f64]) -> Result<()> {
        let mumps = &mut *self.mumps;
        if b.len() != mumps.n as usize || reduced.len() != self.interface.len() {
            return Err(Error::new("a right-hand side of the wrong length for a Schur complement"));
        }
        (mumps.rhs, mumps.nrhs, mumps.lrhs) = (b.as_mut_ptr(), 1, mumps.n);
        (mumps.redrhs, mumps.lredrhs) = (reduced.as_mut_ptr(), reduced.len() as MumpsInt);
        mumps.icntl[25] = if reduced.is_empty() { 0 } else { phase };
        let called = self.call(3);
        (self.mumps.rhs, self.mumps.redrhs) = (null_mut(), null_mut());
        called
    }

    /// Start MUMPS on this process alone, without output, for a symmetric positive definite matrix.
    fn start(&mut self) -> Result<()> {
        let mumps = &mut *self.mumps;
        (mumps.sym, mumps.par) = (1, 1);
        // SAFETY: a constant of MPI, which runs as long as the session.
        mumps.comm_fortran = unsafe { RSMPI_Comm_c2f(RSMPI_COMM_SELF) };
        self.call(-1)?;
        let icntl = &mut self.mumps.icntl;
        icntl[..4].copy_from_slice(&[-1, -1, -1, 0]);
        icntl[18] = MumpsInt::from(!self.interface.is_empty());
        Ok(())
    }

    /// Set a control by the name of its option.
    fn control(&mut self, name: &str, value: &str) -> Result<()> {
        let refuse = |cause: String| {
            Error::new(format!("-{name} {value} cannot be used with the condensed solver"))
                .because(cause)
                .help("leave it out, or choose -ksp_type and -pc_type for a solver of PETSc")
        };
        let number = |start: &str, last: usize| {
            let number = name.strip_prefix(start)?.parse::<usize>().ok()?;
            (1..=last).contains(&number).then_some(number)
        };
        if let Some(number) = number("mat_mumps_icntl_", 60) {
            if let Some((_, what)) = RESERVED.iter().find(|reserved| reserved.0 == number) {
                return Err(refuse(format!("the program itself sets ICNTL({number}), the {what}")));
            }
            self.mumps.icntl[number - 1] = value.parse().map_err(|_| refuse("not a whole number".to_owned()))?;
        } else if let Some(number) = number("mat_mumps_cntl_", 15) {
            self.mumps.cntl[number - 1] = value.parse().map_err(|_| refuse("not a number".to_owned()))?;
        } else {
            return Err(refuse("MUMPS has no such control".to_owned()));
        }
        Ok(())
    }

    /// Run a job of MUMPS.
    fn call(&mut self, job: MumpsInt) -> Result<()> {
        self.mumps.job = job;
        // SAFETY: every pointer in the struct is null or leads to an array of ours that has the length set beside it.
        unsafe { dmumps_c(&raw mut *self.mumps) };
        let (first, second) = (self.mumps.infog[0], self.mumps.infog[1]);
        if first >= 0 { Ok(()) } else { Err(failure(job, first, second)) }
    }
}

impl Drop for Schur {
    fn drop(&mut self) {
        // an error can no longer be returned
        let _ = self.call(-2);
    }
}

/// Return the powers of two nearest to 1/sqrt(K_ii), one for each row; 1 where the diagonal is not positive.
fn scales(rows: usize, lower: &[(usize, usize, f64)]) -> Vec<f64> {
    let mut scale = vec![1.0; rows];
    for &(i, _, diagonal) in lower.iter().filter(|&&(i, j, value)| i == j && value > 0.0 && value.is_finite()) {
        scale[i] = (-0.5 * diagonal.log2()).round().exp2();
    }
    scale
}

/// Return the position of each dof in the order of elimination, from 1: nested dissection of the nodes, then the
/// interface dofs in their order.
fn positions(
    block_size: usize,
    rows: usize,
    lower: &[(usize, usize, f64)],
    interface: &[usize],
) -> Result<Vec<MumpsInt>> {
    let nodes = rows / block_size;
    // the rows of a node follow each other, so that each edge is found once
    let mut seen = vec![usize::MAX; nodes];
    let mut edges: Vec<(usize, usize)> = Vec::new();
    for (node, other) in lower.iter().map(|&(i, j, _)| (i / block_size, j / block_size)) {
        if node != other && seen[other] != node {
            seen[other] = node;
            edges.push((node, other));
        }
    }
    fit::<i32>("METIS", "couplings of nodes", 2 * edges.len())?;
    let mut ptr = vec![0i32; nodes + 1];
    edges.iter().flat_map(|&(i, j)| [i, j]).for_each(|node| ptr[node + 1] += 1);
    for i in 0..nodes {
        ptr[i + 1] += ptr[i];
    }
    let mut next = ptr.clone();
    let mut col = vec![0; 2 * edges.len()];
    for (i, j) in edges.into_iter().flat_map(|(i, j)| [(i, j), (j, i)]) {
        col[next[i] as usize] = j as i32;
        next[i] += 1;
    }
    let order = metis::nested_dissection(Graph { ptr, col })?;
    let mut node_at = vec![0; nodes];
    order.iter().enumerate().for_each(|(node, &at)| node_at[at as usize] = node);
    let mut position = vec![0; rows];
    for (i, &dof) in interface.iter().enumerate() {
        position[dof] = (rows - interface.len() + i + 1) as MumpsInt;
    }
    let mut next = 1;
    for dof in node_at.into_iter().flat_map(|node| node * block_size..(node + 1) * block_size) {
        if position[dof] == 0 {
            position[dof] = next;
            next += 1;
        }
    }
    Ok(position)
}

/// Return the error of a job of MUMPS by INFOG(1) and INFOG(2).
fn failure(job: MumpsInt, first: MumpsInt, second: MumpsInt) -> Error {
    let phase = match job {
        1 => "analysis",
        2 => "factorisation",
        3 => "solution",
        _ => "start",
    };
    // sizes below zero are in millions
    let size = if second < 0 { format!("{} million", -i64::from(second)) } else { second.to_string() };
    let error = Error::new(format!("MUMPS failed in its {phase} (INFOG(1)={first}, INFOG(2)={second})"));
    match first {
        -5 | -7 | -13 | -19 => error
            .because(format!("it could not get memory for {size} numbers"))
            .help("take multigrid, which needs far less: --set solver=hypre"),
        -8 | -9 | -11 | -14 | -15 => error
            .because(format!("its work space is too small by {size} numbers"))
            .help("raise -mat_mumps_icntl_14 (per cent), or take multigrid: --set solver=hypre"),
        -6 | -10 => error
            .because("the interior of the body is singular to rounding")
            .help("look for cells without stiffness, or for parts of the body that nothing joins to it"),
        _ => error.because("see INFOG in the users' guide of MUMPS"),
    }
}

#[cfg(test)]
mod tests {
    use super::failure;

    #[test]
    fn numbers_of_mumps_become_words() {
        for (first, second, words) in [
            (-9, -3, "too small by 3 million numbers"),
            (-13, 70, "could not get memory for 70 numbers"),
            (-10, 4, "singular to rounding"),
            (-53, 0, "users' guide"),
        ] {
            let error = failure(2, first, second);
            assert!(error.message.contains(&format!("INFOG(1)={first}")), "{error}");
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
