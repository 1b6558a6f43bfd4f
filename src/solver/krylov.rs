//! Any KSP and PC of PETSc as inner solver.

use super::options::Chosen;
use super::{Change, InnerSolver, SolveOutcome, Write};
use crate::error::{Error, Kind, Result};
use crate::fem::Prolongation;
use crate::linalg::Csr;
use crate::linalg::portable::log10;
use crate::petsc::{ConvergenceTest, Ksp, Matrix, Rows, Session};

/// G as a PETSc matrix with a KSP that takes its options from PETSc's table.
///
/// A multigrid preconditioner is kept while G changes, if the user has not decided this by `-ksp_reuse_preconditioner`.
/// Dofs at which it is poor then are solved exactly around it. This local correction is called a patch.
pub struct Krylov {
    session: Session,
    chosen: Chosen,
    matrix: Matrix,
    ksp: Ksp,
    /// Whether G has changed since the last set-up.
    changed: bool,
    /// Number of factorisations or preconditioner set-ups.
    set_ups: usize,
    /// Whether the preconditioner is a multigrid, which takes about as many iterations for any size, and whose set-up
    /// costs more than its use.
    multigrid: bool,
    /// Whether one application of it preconditions all bodies together, unless the user wants a whole solve.
    is_applied_once: bool,
    /// Whether the preconditioner is kept while G changes.
    keeps: bool,
    /// Whether the method may set the tolerance of solves, because the user has not.
    free: bool,
    /// Whether the next change of G gets a new preconditioner.
    stale: bool,
    /// Spring stiffnesses in the matrix that the preconditioner was set up with. Where stiff rows are solved exactly,
    /// they are at most those that double the stiffness under a row.
    prepared: Vec<f64>,
    /// Iterations per digit of the first solve with this preconditioner.
    fresh: Option<f64>,
    /// Relative residual that the last solve reached.
    reached: f64,
    /// Number of patches that were set up.
    patches: usize,
    /// Whether rigid motions of bodies have been put around the preconditioner.
    has_rigid_space: bool,
}

/// Growth of the iterations, over those with a fresh preconditioner, at which a new one is set up: a kept one costs at
/// most half as many iterations again.
const WORN: f64 = 1.5;

/// A patch has at most one in so many dofs. With 1, 2, 4, 8 and without patches `flange` (P1, n = 4, layer 1e8) takes
/// 150, 150, 150, 401 and 434 iterations, 1.6, 1.6, 1.6, 2.2 and 1.9 s, and `hertz-sphere` (P1, n = 12) 54, 54, 54, 65
/// and 75, 2.4, 2.4, 2.4, 2.2 and 2.1 s.
const PATCHED: usize = 4;

/// Number of iterations up to which a solve is too short to judge the preconditioner: one iteration more or less is a
/// tenth of it.
const FEW: usize = 12;

impl Krylov {
    /// Start from G = K, with the options that were chosen. `near_null_space` has the rigid motions for the algebraic
    /// multigrid GAMG, one entry a dof each. With an `interpolation` from a coarse level, PETSc's `mg` has two levels.
    /// Collective if other ranks have rows of K.
    ///
    /// # Errors
    /// PETSc's refusal of a matrix or an option value.
    pub fn new(
        session: &Session,
        chosen: Chosen,
        dimension: usize,
        stiffness: Rows,
        near_null_space: &[Vec<f64>],
        interpolation: Option<Prolongation>,
    ) -> Result<Self> {
        let mut matrix = Matrix::new(session, dimension, stiffness)?;
        let levels = if interpolation.is_some() { 2 } else { 1 };
        matrix.set_spd()?;
        let mut ksp = Ksp::of(session, matrix.scope(), chosen.prefix())?;
        if !chosen.has_own() {
            ksp.set_name(chosen.name())?;
        }
        ksp.set_operator(&matrix)?;
        let explain = |error: crate::petsc::Error| chosen.explain(error.into());
        ksp.set_types(chosen.get("ksp_type"), chosen.get("pc_type")).map_err(explain)?;
        if let Some(interpolation) = interpolation {
            let Prolongation { rows: Csr { ptr, col, values, .. }, own } = interpolation;
            ksp.set_interpolation(&matrix, [&super::integers(ptr), &super::integers(col)], &values, own)?;
        }
        chosen.refuse_idle()?;
        chosen.defaults().try_for_each(|(name, value)| ksp.set_default(name, value)).map_err(explain)?;
        ksp.set_from_options().map_err(explain)?;
        if ksp.pc_type() == "gamg" && !near_null_space.is_empty() {
            matrix.set_near_null_space(near_null_space)?;
        }
        let multigrid = match ksp.pc_type().as_str() {
            "hypre" | "gamg" | "ml" => true,
            // with other numbers of levels it is what the user makes of it
            "mg" => check_levels(&ksp, chosen.name(), levels)? == 2,
            _ => false,
        } && ksp.ksp_type() != "preonly";
        let is_applied_once = multigrid && !chosen.steers_iteration();
        let keeps = multigrid && chosen.get("ksp_reuse_preconditioner").is_none();
        let free = ksp.ksp_type() != "preonly" && chosen.typed("ksp_rtol").is_none();
        let session = session.clone();
        Ok(Self {
            session,
            chosen,
            matrix,
            ksp,
            free,
            changed: true,
            set_ups: 0,
            multigrid,
            is_applied_once,
            keeps,
            stale: true,
            prepared: Vec::new(),
            fresh: None,
            reached: 1.0,
            patches: 0,
            has_rigid_space: false,
        })
    }

    /// Make a solve within the stage of PETSc's log for solves.
    fn staged(&mut self, solve: impl FnOnce(&Ksp) -> Result<crate::petsc::Solved>) -> Result<SolveOutcome> {
        self.set_up()?;
        let stage = self.session.stage("linear solve");
        let solved = solve(&self.ksp)?;
        drop(stage);
        let direct = self.ksp.ksp_type() == "preonly";
        Ok(SolveOutcome {
            iterations: if direct { 0 } else { solved.iterations },
            failure: (!solved.reason.converged()).then(|| solved.reason.to_string()),
        })
    }

    /// Return how many layers of the graph of G are added around the dofs of a patch. hypre smooths with the matrix of
    /// its set-up, so it needs one layer. The smoothers of two levels of multigrid use G itself, so they need none.
    fn layers(&self) -> usize {
        usize::from(self.ksp.pc_type() != "mg")
    }

    /// Keep the preconditioner and put a patch around it at the dofs where it is poor. Return false if the patch would
    /// cost more than a new preconditioner or cannot be made.
    fn patch(&mut self, dofs: &[usize]) -> Result<bool> {
        let layers = self.layers();
        if dofs.len() * (1 + layers) * PATCHED > self.matrix.total() {
            return Ok(false);
        }
        self.ksp.set_reuse_preconditioner(true)?;
        if !dofs.is_empty() {
            let _stage = self.session.stage("set-up");
            if !self.ksp.patch(&self.matrix, dofs, layers)? {
                return Ok(false);
            }
            self.patches += 1;
        }
        self.changed = false;
        Ok(true)
    }

    /// Keep the preconditioner or set up a new one, after a change of G. Rows that have changed much, or are stiff for
    /// a new one, are solved exactly.
    fn renew(&mut self, change: &Change) -> Result<()> {
        let &Change { rows, springs, soft, .. } = change;
        self.prepared.resize(springs.len(), 0.0);
        self.stale |= self.set_ups == 0;
        if !self.stale && self.patch(&poor_dofs(rows, soft, &self.prepared, springs))? {
            if self.ksp.pc_type() == "mg" {
                // PETSc's smoothers use the new G, but their bounds of eigenvalues are those of their set-up
                self.ksp.renew_smoother(&self.matrix)?;
            }
            return Ok(());
        }
        self.stale = true;
        self.set_up()?;
        let softened: Vec<f64> = springs.iter().zip(soft).map(|(spring, soft)| spring.min(*soft)).collect();
        let is_patched = self.patch(&poor_dofs(rows, soft, &softened, springs))?;
        self.prepared = if is_patched { softened } else { springs.to_vec() };
        Ok(())
    }

    /// Compare the iterations per digit of a solve with those of the first solve. The next change of G gets a new
    /// preconditioner if they have grown too much.
    fn judge(&mut self, solved: &SolveOutcome) {
        if self.keeps && solved.iterations > FEW {
            let pace = solved.iterations as f64 / -log10(self.reached);
            self.stale |= pace > WORN * *self.fresh.get_or_insert(pace);
        }
    }
}

impl InnerSolver for Krylov {
    fn values(&self) -> &[f64] {
        self.matrix.values()
    }

    fn multiply(&mut self, [to_stiffness, restore]: [&Write; 2], x: &[f64], y: &mut [f64]) -> Result<()> {
        Ok(self.matrix.multiply_changed(to_stiffness, restore, x, y)?)
    }

    fn update(&mut self, change: Change) -> Result<()> {
        self.ksp.unwrap()?;
        self.matrix.update(change.write)?;
        self.changed = true;
        if self.keeps {
            self.renew(&change)?;
        }
        // other preconditioners stay as the user chose them
        if self.multigrid
            && let Some(coarse) = (change.coarse)()
        {
            self.set_up()?;
            self.has_rigid_space = true;
            self.ksp.wrap(&self.matrix, c"rigid motions of bodies around the preconditioner", coarse)?;
        }
        Ok(())
    }

    fn set_up(&mut self) -> Result<()> {
        if self.changed {
            self.changed = false;
            if self.keeps {
                self.ksp.set_reuse_preconditioner(!self.stale)?;
            }
            if self.set_ups == 0 || !self.ksp.reuses_preconditioner() {
                self.set_ups += 1;
                self.stale = false;
                self.fresh = None;
            }
            self.ksp.set_up().map_err(|error| self.chosen.explain(error.into()))?;
        }
        Ok(())
    }

    fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        self.reached = self.ksp.tolerance();
        let solved = self.staged(|ksp| Ok(ksp.solve(r, z)?))?;
        self.judge(&solved);
        Ok(solved)
    }

    fn solve_until(&mut self, r: &[f64], z: &mut [f64], enough: &mut ConvergenceTest) -> Result<SolveOutcome> {
        if !self.free {
            return self.solve(r, z);
        }
        self.ksp.set_tolerance(f64::EPSILON)?;
        let mut reached = 1.0;
        let solved = self.staged(|ksp| {
            Ok(ksp.solve_until(r, z, &mut |iterate| {
                reached = iterate.residual / iterate.first;
                enough(iterate)
            })?)
        })?;
        self.reached = reached;
        self.judge(&solved);
        Ok(solved)
    }

    fn set_tolerance(&mut self, rtol: f64) -> Result<()> {
        if self.free {
            self.ksp.set_tolerance(rtol)?;
        }
        Ok(())
    }

    fn accuracy(&self) -> f64 {
        match (self.ksp.ksp_type().as_str(), self.ksp.pc_type().as_str()) {
            ("preonly", "cholesky" | "lu") => 0.0,
            // one application of a preconditioner may leave an error of any size
            ("preonly", _) => 1.0,
            _ => self.reached,
        }
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        if !self.is_applied_once {
            return self.solve(r, z);
        }
        self.set_up()?;
        self.ksp.precondition(r, z)?;
        Ok(SolveOutcome { iterations: 1, failure: self.ksp.failure() })
    }

    fn factorizations(&self) -> [usize; 3] {
        [usize::from(self.set_ups > 0), self.set_ups, self.patches]
    }

    fn describe(&self) -> String {
        let coarse = || self.chosen.get("mg_coarse_pc_type").map(str::to_owned);
        let inside = self.ksp.factor_package().or_else(coarse).map_or(String::new(), |name| format!(" by {name}"));
        let around = if self.has_rigid_space { " with rigid motions of all bodies" } else { "" };
        format!("{} + {}{inside}{around}", self.ksp.ksp_type(), self.ksp.pc_type())
    }
}

/// Return the number of levels of PETSc's `mg`, which must not exceed `most`: PETSc would call interpolations between
/// further levels that do not exist.
///
/// # Errors
/// There are more levels.
fn check_levels(ksp: &Ksp, name: &str, most: usize) -> Result<usize> {
    let levels = ksp.multigrid_levels()?;
    if levels <= most {
        return Ok(levels);
    }
    let only = if most == 1 {
        "elements of one order have one level"
    } else {
        "quadratic elements have two levels, for the vertices and all nodes"
    };
    Err(Error::new(
        Kind::Solver,
        format!("`{name}`: multigrid `mg` has {levels} levels here, and the mesh has only {most}"),
    )
    .because(only)
    .help("give no more by -pc_mg_levels, or take a multigrid that makes its own levels: -pc_type gamg or hypre"))
}

/// Ratio of the stiffnesses under a contact row beyond which a preconditioner is poor there, in either direction. With
/// 1.2, 1.5, 2 and 3 `groove3d` (n = 16, layer 1e7) takes 50, 50, 56 and 56 iterations, `hertz-sphere` (P1, n = 12,
/// layer 1e6) 56, 54, 56 and 117.
const POOR: f64 = 1.5;

/// Return the dofs, sorted, of contact rows at which a preconditioner with springs `old` is poor for springs `new`: the
/// stiffnesses under the row differ by more than the factor [`POOR`]. `soft` are the springs that double the stiffness
/// under a row; all three have one entry a row.
///
/// The eigenvalues of G_old^-1 G_new lie between the smallest and the largest ratio of the springs. Where the body is
/// stiff compared with its springs, they do not come near these bounds. So the stiffness of the body counts with that
/// of the spring.
fn poor_dofs(rows: &Csr, soft: &[f64], old: &[f64], new: &[f64]) -> Vec<usize> {
    let is_poor = |q: &usize| {
        let (before, after) = (soft[*q] + old[*q], soft[*q] + new[*q]);
        after > POOR * before || before > POOR * after
    };
    let mut dofs: Vec<usize> = (0..rows.rows()).filter(is_poor).flat_map(|q| rows.row(q).map(|(i, _)| i)).collect();
    dofs.sort_unstable();
    dofs.dedup();
    dofs
}
