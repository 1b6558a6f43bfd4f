//! A body as this rank has it: K, f and contact rows B on its dofs, and a solver for G = K + B' diag(d) B.

use super::Motion;
use super::dofs::{Distribution, Dofs};
use crate::error::{Error, Kind, Result};
use crate::fem::Loads;
use crate::fem::assemble::InitialLoad;
use crate::file::available_memory;
use crate::linalg::{Csr, dot};
use crate::petsc::{Schur, Session};
use crate::solver::options::Chosen;
use crate::solver::{BodyCounts, Dense, MakeSolver, SolveOutcome, SpringMatrix, rows_of};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Instant;

/// The terms of one body in the functional F1 (25).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// u'Ku, twice the strain energy.
    pub strain: f64,
    /// u'Ku/2 - f'u.
    pub potential: f64,
}

/// An elastic body with stiffness K, load f and contact rows B (one row for each contact point of each of its
/// surfaces).
///
/// If the body is distributed over ranks, K has the dofs that this rank owns, and its columns are those of the
/// distributed matrix that has its rows. A condensed body has its interface dofs; its displacements stand for those of
/// the whole body with its interior in equilibrium, so that residual, energies and all output have the values of the
/// whole body. Solves may be inexact, but [`Body::residual`] is exact. Errors are failures of the solver library.
pub struct Body {
    dofs: Dofs,
    loads: Loads,
    /// The diagonal of K.
    diagonal: Vec<f64>,
    stiffness: Stiffness,
    /// Description of the solver to be made, for reports.
    words: String,
    /// Counters of the body that it replaces in a history.
    earlier: BodyCounts,
    interior: Option<Interior>,
}

/// The place of the stiffness matrix K of a body, which is stored once.
enum Stiffness {
    /// The matrix of all bodies has it.
    Joint,
    /// It waits for the solver that this function makes of it. Before that, a body that is to be condensed eliminates
    /// its interior from it.
    Waiting(Csr, MakeSolver),
    /// The solver of the body has it in G.
    Subdomain(SpringMatrix),
}

/// The interior of a condensed body.
struct Interior {
    session: Session,
    /// PETSc options of the body. Those for MUMPS apply.
    chosen: Chosen,
    /// Number of dofs of a node.
    dimension: usize,
    /// Interface dofs, sorted.
    interface: Vec<usize>,
    /// The loads on all dofs of the body.
    whole: Loads,
    /// The factor, once the interior is eliminated.
    schur: Option<RefCell<Schur>>,
    /// Eliminations in this run: none if one of an earlier run serves.
    eliminations: usize,
    /// Wall seconds of the elimination.
    seconds: f64,
}

impl Body {
    /// Return a body with its contact rows B (columns: its dofs, none of them prescribed) and the rigid motions
    /// `unconstrained_modes` that its supports and springs leave, one vector over the dofs each. `stiffness` is its K,
    /// with a pattern that holds that of B'B, which goes to the matrix of all bodies. `words` describe the solver.
    ///
    /// A distributed body has the dofs that this rank owns, while `rows` and `unconstrained_modes` have those of its
    /// owned and ghost nodes. If the body gets a matrix of its own, that is distributed over all ranks.
    pub fn new(
        stiffness: &Csr,
        mut loads: Loads,
        rows: Csr,
        unconstrained_modes: Vec<Vec<f64>>,
        distribution: Option<Distribution>,
        words: String,
    ) -> Self {
        let prescribed = std::mem::take(&mut loads.prescribed);
        let first = distribution.as_ref().map_or(0, |distribution| distribution.first);
        let dofs = Dofs::new(loads.load.len(), prescribed, rows, unconstrained_modes, distribution.map(Rc::new));
        let diagonal = stiffness.diagonal(first);
        let earlier = BodyCounts::default();
        Self { dofs, loads, diagonal, stiffness: Stiffness::Joint, words, earlier, interior: None }
    }

    /// Return the body with a solver of its own, which `make` makes of its K when something is first solved.
    #[must_use]
    pub fn with_solver(self, stiffness: Csr, make: MakeSolver) -> Self {
        Self { stiffness: Stiffness::Waiting(stiffness, make), ..self }
    }

    /// Return a rigid part, whose dofs are the amounts of its `motions`, without a stiffness.
    pub fn rigid(motions: &[Motion]) -> Self {
        let (count, points) = (motions.len(), motions.first().map_or(0, |motion| motion.trace.len()));
        let mut rows = Csr::new(count);
        (0..points).for_each(|q| rows.push_row(motions.iter().map(|motion| motion.trace[q]).enumerate()));
        let unit = |k: usize| (0..count).map(|i| f64::from(u8::from(i == k))).collect();
        let loads = Loads { load: motions.iter().map(|motion| motion.work).collect(), ..Loads::default() };
        let stiffness = Csr::full(count, vec![0.0; count * count]);
        let body = Self::new(&stiffness, loads, rows, (0..count).map(unit).collect(), None, "rigid".to_owned());
        body.with_solver(stiffness, Box::new(Dense::make))
    }

    /// Return a body that is to be condensed to its `interface` dofs, which are its `dofs`. `stiffness` and `whole` are
    /// on all dofs.
    pub fn to_condense(
        session: Session,
        chosen: Chosen,
        dimension: usize,
        stiffness: Csr,
        whole: Loads,
        dofs: Dofs,
        interface: Vec<usize>,
    ) -> Self {
        let words = format!("condensed to {} dofs by mumps", interface.len());
        let interior =
            Some(Interior { session, chosen, dimension, interface, whole, schur: None, eliminations: 0, seconds: 0.0 });
        let stiffness = Stiffness::Waiting(stiffness, Box::new(Dense::make));
        let (loads, diagonal, earlier) = (Loads::default(), Vec::new(), BodyCounts::default());
        Self { dofs, loads, diagonal, stiffness, words, earlier, interior }
    }

    /// Eliminate the interior, if the body is to be condensed and is not yet.
    ///
    /// # Errors
    /// Failures of MUMPS, and a factorisation that needs more memory than is free.
    pub fn condense(&mut self) -> Result<()> {
        let Some(interior) = self.interior.as_mut().filter(|interior| interior.schur.is_none()) else { return Ok(()) };
        if let Stiffness::Waiting(whole, make) = std::mem::replace(&mut self.stiffness, Stiffness::Joint) {
            let schur = interior.eliminate(whole)?;
            (self.loads, self.diagonal) = (interior.loads()?, schur.diagonal(0));
            self.stiffness = Stiffness::Subdomain(self.solver(schur, make)?);
        }
        Ok(())
    }

    /// Return whether the solver of G was set up.
    pub fn is_set_up(&self) -> bool {
        matches!(&self.stiffness, Stiffness::Subdomain(matrix) if matrix.is_set_up())
    }

    /// Return the dofs.
    pub fn dofs(&self) -> &Dofs {
        &self.dofs
    }

    /// Compute the equilibrium residual (26) r = f - K u - B' force, with `product` = K u and `force` = omega p at each
    /// row. Return the energies of u.
    pub fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        let Loads { load, lifting, strain_constant, energy_constant, .. } = &self.loads;
        for (r, (load, product)) in r.iter_mut().zip(load.iter().zip(product)) {
            *r = load - product;
        }
        self.dofs.rows.add_transpose(-1.0, force, r);
        let quadratic = dot(u, product);
        Energy {
            strain: quadratic + 2.0 * dot(lifting, u) + strain_constant,
            potential: 0.5 * quadratic - dot(load, u) + energy_constant,
        }
    }

    /// Return the squared energy norm of forces r at the dofs, taken for each dof alone: r'D^-1 r with the diagonal D
    /// of K + B' diag(`springs`) B, for `springs` at each row.
    pub fn unbalanced(&self, r: &[f64], springs: &[f64]) -> f64 {
        let mut diagonal = self.diagonal.clone();
        for (q, spring) in springs.iter().enumerate().filter(|(_, spring)| **spring > 0.0) {
            self.dofs.rows.row(q).for_each(|(i, b)| diagonal[i] += spring * b * b);
        }
        let squared = |(r, diagonal): (&f64, &f64)| if *r == 0.0 { 0.0 } else { r * r / diagonal };
        r.iter().zip(&diagonal).map(squared).sum()
    }

    /// Return K of a condensed body, all entries row by row.
    pub fn condensed_stiffness(&self) -> Option<Vec<f64>> {
        match &self.stiffness {
            Stiffness::Subdomain(matrix) if self.interior.is_some() => Some(matrix.stiffness()),
            _ => None,
        }
    }

    /// Compute y = K u, for a body whose K the matrix of all bodies does not have.
    pub fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]) {
        match &mut self.stiffness {
            Stiffness::Subdomain(matrix) => matrix.multiply_stiffness(self.dofs.matrix_rows(), u, y),
            Stiffness::Waiting(stiffness, _) => stiffness.multiply(u, y),
            Stiffness::Joint => unreachable!("the step with the matrix of all bodies multiplies by it"),
        }
    }

    /// Make G of K and the solver of G.
    fn solver(&self, stiffness: Csr, make: MakeSolver) -> Result<SpringMatrix> {
        let square = |q: usize| self.dofs.rows.row(q).map(|(i, b)| b * b * self.diagonal[i]).sum();
        let mut row_stiffness: Vec<f64> = (0..self.dofs.rows.rows()).map(square).collect();
        if let Some(distribution) = &self.dofs.distribution {
            distribution.exchange.sum(&mut row_stiffness);
        }
        let start = self.dofs.distribution.as_ref().map(|distribution| distribution.start);
        SpringMatrix::new(rows_of(stiffness, start)?, self.dofs.matrix_rows(), row_stiffness, None, make)
    }

    /// Return G, which is made of K first if it does not exist.
    fn spring_matrix(&mut self) -> Result<&mut SpringMatrix> {
        self.stiffness = match std::mem::replace(&mut self.stiffness, Stiffness::Joint) {
            Stiffness::Waiting(stiffness, make) => Stiffness::Subdomain(self.solver(stiffness, make)?),
            known => known,
        };
        match &mut self.stiffness {
            Stiffness::Subdomain(matrix) => Ok(matrix),
            _ => Err(Error::new(Kind::Solver, "an inner solver could not be made")),
        }
    }

    /// Form the Robin matrix G = K + B' diag(weight) B (37)-(38), with `weight` = omega psi kappa at each row. Nothing
    /// happens if the weights are those of the last call.
    pub fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.spring_matrix()?;
        let Self { dofs, stiffness: Stiffness::Subdomain(matrix), .. } = self else { return Ok(()) };
        matrix.update(dofs.matrix_rows(), weight)
    }

    /// Factor G, or set up its preconditioner, if that has not been done since G changed.
    pub fn set_up(&mut self) -> Result<()> {
        self.spring_matrix()?.set_up()
    }

    /// Set the relative tolerance of iterative solves, unless the user has set one.
    pub fn set_tolerance(&mut self, rtol: f64) -> Result<()> {
        self.spring_matrix()?.solver_mut().set_tolerance(rtol)
    }

    /// Solve G z = r (41) with zero initial guess. A solve that does not converge is reported in [`SolveOutcome`].
    pub fn solve(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        self.spring_matrix()?.apply(|solver| solver.solve(r, z))
    }

    /// Compute z = M^-1 r with a fixed symmetric M that approximates G. This preconditions conjugate gradients over all
    /// bodies. It costs no more than a solve, and for an iterative inner solver only one application of its
    /// preconditioner.
    pub fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> Result<SolveOutcome> {
        self.spring_matrix()?.apply(|solver| solver.precondition(r, z))
    }

    /// Return a load on all dofs as a force on those of the body, and its work while the interface dofs do not move:
    /// r_I' K_II^-1 r_I with the load r_I on eliminated dofs I, zero if there are none. What acts on supports is left
    /// out.
    pub fn reduce(&mut self, load: &[f64]) -> Result<(Vec<f64>, f64)> {
        match &mut self.interior {
            None => Ok((self.dofs.reduce(load), 0.0)),
            Some(interior) => interior.reduce(load),
        }
    }

    /// Return the displacements of the owned and ghost nodes of this rank from those of the dofs. Collective for a
    /// distributed body.
    pub fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        self.interior.as_ref().map_or_else(|| Ok(self.dofs.recover(u)), |interior| interior.recover(u))
    }

    /// Return the counters of the work so far.
    pub fn counts(&self) -> BodyCounts {
        let counts = match &self.stiffness {
            Stiffness::Subdomain(matrix) => matrix.counts(),
            _ => BodyCounts::default(),
        };
        let mut all = self.interior.as_ref().map_or(counts, |interior| interior.count(counts));
        all += self.earlier;
        all
    }

    /// Count on from these counters.
    pub fn count_on(&mut self, earlier: BodyCounts) {
        self.earlier = earlier;
    }

    /// Set the counters to zero for another run.
    pub fn begin_anew(&mut self) {
        self.earlier = BodyCounts::default();
        self.interior.iter_mut().for_each(|interior| interior.eliminations = 0);
        if let Stiffness::Subdomain(matrix) = &mut self.stiffness {
            matrix.begin_anew();
        }
    }

    /// Replace the loads f on all dofs that this rank knows, those of `initial` strains, and the values of the
    /// `prescribed` (dof, value), which are the same dofs as before. What was made of K stays.
    pub fn reload(&mut self, load: Vec<f64>, initial: &InitialLoad, prescribed: Vec<(usize, f64)>) -> Result<()> {
        if let Some(interior) = &mut self.interior {
            let is_same = interior.reload(load, initial, prescribed);
            if !is_same && interior.schur.is_some() {
                self.loads = interior.loads()?;
            }
            return Ok(());
        }
        let mut loads = std::mem::take(&mut self.loads);
        loads.reload(load, initial, prescribed);
        self.loads = match &self.dofs.distribution {
            Some(distribution) => distribution.restrict(loads),
            None => loads,
        };
        self.dofs.prescribed = std::mem::take(&mut self.loads.prescribed);
        Ok(())
    }

    /// Return one line about the inner solver.
    pub fn describe(&self) -> String {
        match &self.stiffness {
            Stiffness::Subdomain(matrix) if self.interior.is_none() => matrix.solver().describe(),
            _ => self.words.clone(),
        }
    }
}

impl Interior {
    /// Eliminate the interior from K of the whole body, and return the Schur complement on the interface dofs.
    fn eliminate(&mut self, whole: Csr) -> Result<Csr> {
        let (began, name) = (Instant::now(), self.chosen.name());
        let lower = whole.lower_triangle();
        drop(whole);
        let (dofs, interface) = (self.whole.load.len(), &self.interface);
        let controls = self.chosen.controls_of_mumps(&self.session);
        let mut schur = Schur::analyse(&self.session, &controls, self.dimension, dofs, &lower, interface)?;
        drop(lower);
        let (needed, available) = (schur.expected_megabytes(), available_memory() / 1_000_000);
        if needed > available {
            let message =
                format!("body `{name}`: its factorisation needs {needed} MB of memory, {available} MB are free");
            return Err(Error::new(Kind::Solver, message).help("take multigrid: --set solver=hypre"));
        }
        schur.factor()?;
        let stiffness = Csr::full(interface.len(), schur.take_complement());
        self.schur = Some(RefCell::new(schur));
        (self.eliminations, self.seconds) = (1, began.elapsed().as_secs_f64());
        Ok(stiffness)
    }

    /// Replace the loads and prescribed values of the whole body. Return whether these are the same as before.
    fn reload(&mut self, load: Vec<f64>, initial: &InitialLoad, prescribed: Vec<(usize, f64)>) -> bool {
        let of = |whole: &Loads| [whole.load.clone(), whole.lifting.clone()];
        let before = of(&self.whole);
        self.whole.reload(load, initial, prescribed);
        before == of(&self.whole)
    }

    /// Do some work with the factor.
    fn with_factor<T>(&self, work: impl FnOnce(&mut Schur) -> Result<T>) -> Result<T> {
        let missing = || Error::new(Kind::Solver, "the interior of a body is not eliminated yet");
        work(&mut self.schur.as_ref().ok_or_else(missing)?.borrow_mut())
    }

    /// Return the loads on the interface dofs. None of these dofs is prescribed.
    fn loads(&self) -> Result<Loads> {
        let Self { interface, whole, .. } = self;
        let Loads { load, lifting: whole_lifting, .. } = whole;
        let at_rest = vec![0.0; interface.len()];
        self.with_factor(|schur| {
            let lifting = if whole_lifting.is_empty() { Vec::new() } else { schur.condense(whole_lifting)? };
            let reduced = schur.condense(load)?;
            // displacement of the interior under the loads alone, with the interface dofs at rest
            let interior = schur.expand_condensed(load, &at_rest)?;
            let work = dot(load, &interior);
            Ok(Loads {
                load: reduced,
                lifting,
                energy_constant: whole.energy_constant - 0.5 * work,
                strain_constant: whole.strain_constant + work + 2.0 * dot(whole_lifting, &interior),
                ..Loads::default()
            })
        })
    }

    /// See [`Body::reduce`].
    fn reduce(&self, load: &[f64]) -> Result<(Vec<f64>, f64)> {
        let mut load = load.to_vec();
        self.whole.prescribed.iter().for_each(|&(dof, _)| load[dof] = 0.0);
        self.with_factor(|schur| {
            let force = schur.condense(&load)?;
            let interior = schur.expand_condensed(&load, &vec![0.0; force.len()])?;
            Ok((force, dot(&load, &interior)))
        })
    }

    /// See [`Body::recover`].
    fn recover(&self, u: &[f64]) -> Result<Vec<f64>> {
        self.with_factor(|schur| Ok(schur.expand(&self.whole.load, u)?))
    }

    /// Add the elimination to the counters of the body.
    fn count(&self, counts: BodyCounts) -> BodyCounts {
        let eliminations = self.eliminations;
        let seconds = eliminations as f64 * self.seconds;
        BodyCounts {
            factorizations: eliminations,
            condensations: eliminations,
            symbolic: eliminations,
            first_seconds: seconds,
            factor_seconds: counts.factor_seconds + seconds,
            ..counts
        }
    }
}
