//! A body as this rank has it: K, f and contact rows B on its dofs, and a solver for G = K + B' diag(d) B.

use super::Motion;
use super::dofs::{Distribution, Dofs};
use crate::error::{Error, Kind, Result};
use crate::fem::ElasticBody;
use crate::fem::assemble::InitialLoad;
use crate::file::available_memory;
use crate::linalg::{Csr, dot};
use crate::petsc::{Rows, Schur, Session};
use crate::solver::options::Chosen;
use crate::solver::{BodyCounts, Dense, InterfaceDofs, MakeSolver, SolveOutcome, SpringMatrix, rows_of};
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
    /// K and the loads. K is empty if a solver stores it, or if it was given away.
    elastic: ElasticBody,
    /// The diagonal of K, if K itself is in a solver or was given away; else empty.
    diagonal: Vec<f64>,
    /// G, which is made when something is first solved. A body that is only measured, or joined with others, needs
    /// none.
    matrix: Option<SpringMatrix>,
    /// The function that makes the solver of G; `None` once it was used.
    make: Option<MakeSolver>,
    /// Whether K stays here when a solver is made of it.
    keeps_stiffness: bool,
    /// Description of the solver to be made, for reports.
    words: String,
    /// Counters of the body that it replaces in a history.
    earlier: BodyCounts,
    interior: Option<Interior>,
}

/// The interior of a condensed body.
struct Interior {
    session: Session,
    /// PETSc options of the body. Those for MUMPS apply.
    chosen: Chosen,
    /// Number of dofs of a node.
    dimension: usize,
    interface: InterfaceDofs,
    /// The loads on all dofs of the body, and K until it is eliminated.
    whole: ElasticBody,
    /// The factor, once the interior is eliminated.
    schur: Option<RefCell<Schur>>,
    /// Eliminations in this run: none if one of an earlier run serves.
    eliminations: usize,
    /// Wall seconds of the elimination.
    seconds: f64,
}

impl Body {
    /// Join a body, whose K has a pattern that holds that of B'B, its contact rows B (columns: its dofs, none of them
    /// prescribed), and the rigid motions `unconstrained_modes` that its supports and springs leave, one vector over
    /// the dofs each. `make` makes a solver of K when something is first solved, and `words` describe that solver.
    ///
    /// A distributed body has the dofs that this rank owns, while `rows` and `unconstrained_modes` have those of its
    /// owned and ghost nodes. If the body gets a matrix of its own, that is distributed over all ranks.
    pub fn new(
        mut elastic: ElasticBody,
        rows: Csr,
        unconstrained_modes: Vec<Vec<f64>>,
        distribution: Option<Distribution>,
        make: MakeSolver,
        words: String,
    ) -> Self {
        let prescribed = std::mem::take(&mut elastic.prescribed);
        let dofs = Dofs::new(elastic.load.len(), prescribed, rows, unconstrained_modes, distribution.map(Rc::new));
        let (diagonal, make) = (Vec::new(), Some(make));
        let earlier = BodyCounts::default();
        Self { dofs, elastic, diagonal, matrix: None, make, keeps_stiffness: false, words, earlier, interior: None }
    }

    /// Return a rigid part, whose dofs are the amounts of its `motions`, without a stiffness.
    pub fn rigid(motions: &[Motion]) -> Self {
        let (count, points) = (motions.len(), motions.first().map_or(0, |motion| motion.trace.len()));
        let mut rows = Csr::new(count);
        (0..points).for_each(|q| rows.push_row(motions.iter().map(|motion| motion.trace[q]).enumerate()));
        let unit = |k: usize| (0..count).map(|i| f64::from(u8::from(i == k))).collect();
        let elastic = ElasticBody {
            stiffness: Csr::full(count, vec![0.0; count * count]),
            load: motions.iter().map(|motion| motion.work).collect(),
            ..ElasticBody::default()
        };
        let make: MakeSolver = Box::new(|stiffness: Rows| Ok(Box::new(Dense::new(stiffness))));
        let body = Self::new(elastic, rows, (0..count).map(unit).collect(), None, make, "rigid".to_owned());
        Self { keeps_stiffness: true, ..body }
    }

    /// Return a body that is to be condensed to its interface dofs. `whole` and `unconstrained_modes` are on all dofs.
    pub fn to_condense(
        session: Session,
        chosen: Chosen,
        dimension: usize,
        whole: ElasticBody,
        unconstrained_modes: &[Vec<f64>],
        interface: InterfaceDofs,
    ) -> Self {
        let on_interface = |motion: &Vec<f64>| interface.dofs.iter().map(|&dof| motion[dof]).collect();
        let modes = unconstrained_modes.iter().map(on_interface).collect();
        let dofs = Dofs::new(interface.dofs.len(), Vec::new(), interface.rows.clone(), modes, None);
        let words = interface.in_words();
        let interior =
            Interior { session, chosen, dimension, interface, whole, schur: None, eliminations: 0, seconds: 0.0 };
        let make: MakeSolver = Box::new(|stiffness: Rows| Ok(Box::new(Dense::new(stiffness))));
        let (elastic, diagonal) = (ElasticBody::default(), Vec::new());
        let (make, interior) = (Some(make), Some(interior));
        let earlier = BodyCounts::default();
        Self { dofs, elastic, diagonal, matrix: None, make, keeps_stiffness: true, words, earlier, interior }
    }

    /// Eliminate the interior, if the body is to be condensed and is not yet.
    ///
    /// # Errors
    /// Failures of MUMPS, and a factorisation that needs more memory than is free.
    pub fn condense(&mut self) -> Result<()> {
        if let Some(interior) = self.interior.as_mut().filter(|interior| interior.schur.is_none()) {
            self.elastic = interior.eliminate()?;
        }
        Ok(())
    }

    /// Return whether the solver of G was made.
    pub fn has_solver(&self) -> bool {
        self.matrix.is_some()
    }

    /// Return the dofs.
    pub fn dofs(&self) -> &Dofs {
        &self.dofs
    }

    /// Compute the equilibrium residual (26) r = f - K u - B' force, with `product` = K u and `force` = omega p at each
    /// row. Return the energies of u.
    pub fn residual(&self, u: &[f64], product: &[f64], force: &[f64], r: &mut [f64]) -> Energy {
        let ElasticBody { load, lifting, strain_constant, energy_constant, .. } = &self.elastic;
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
        let mut diagonal = if self.diagonal.is_empty() {
            (0..self.dofs.count).map(|i| self.elastic.stiffness.diagonal(i)).collect()
        } else {
            self.diagonal.clone()
        };
        for (q, spring) in springs.iter().enumerate().filter(|(_, spring)| **spring > 0.0) {
            self.dofs.rows.row(q).for_each(|(i, b)| diagonal[i] += spring * b * b);
        }
        let squared = |(r, diagonal): (&f64, &f64)| if *r == 0.0 { 0.0 } else { r * r / diagonal };
        r.iter().zip(&diagonal).map(squared).sum()
    }

    /// Return K on the dofs; it is empty if the inner solver stores K, or if it was given away.
    pub fn stiffness(&self) -> &Csr {
        &self.elastic.stiffness
    }

    /// Compute y = K u, for a body that has not given its K away.
    pub fn apply_stiffness(&mut self, u: &[f64], y: &mut [f64]) {
        match &mut self.matrix {
            Some(matrix) if self.elastic.stiffness.rows() == 0 => {
                matrix.multiply_stiffness(self.dofs.matrix_rows(), u, y)
            }
            _ => self.elastic.stiffness.multiply_symmetric(u, y),
        }
    }

    /// Give K away to a matrix of all bodies, and keep its diagonal. Return `None` if the body needs it itself.
    pub fn give_stiffness(&mut self) -> Option<Csr> {
        (self.matrix.is_none() && self.interior.is_none()).then(|| self.take_stiffness())
    }

    fn take_stiffness(&mut self) -> Csr {
        let k = std::mem::replace(&mut self.elastic.stiffness, Csr::new(0));
        let first = self.dofs.distribution.as_ref().map_or(0, |distribution| distribution.first);
        let diagonal = |i: usize| k.position(i, first + i).map_or(0.0, |at| k.values[at]);
        self.diagonal = (0..k.rows()).map(diagonal).collect();
        k
    }

    /// Return G, which is made of K first if it does not exist.
    fn spring_matrix(&mut self) -> Result<&mut SpringMatrix> {
        if let Some(make) = self.make.take() {
            let stiffness = if self.keeps_stiffness { self.elastic.stiffness.clone() } else { self.take_stiffness() };
            let diagonal = |i: usize| self.diagonal.get(i).map_or_else(|| stiffness.diagonal(i), |value| *value);
            let square = |q: usize| self.dofs.rows.row(q).map(|(i, b)| b * b * diagonal(i)).sum();
            let mut row_stiffness: Vec<f64> = (0..self.dofs.rows.rows()).map(square).collect();
            if let Some(distribution) = &self.dofs.distribution {
                distribution.exchange.sum(&mut row_stiffness);
            }
            let start = self.dofs.distribution.as_ref().map(|distribution| distribution.start);
            let rows = self.dofs.matrix_rows();
            self.matrix = Some(SpringMatrix::new(rows_of(stiffness, start)?, rows, row_stiffness, None, make)?);
        }
        self.matrix.as_mut().ok_or_else(|| Error::new(Kind::Solver, "an inner solver could not be made"))
    }

    /// Form the Robin matrix G = K + B' diag(weight) B (37)-(38), with `weight` = omega psi kappa at each row. Nothing
    /// happens if the weights are those of the last call.
    pub fn robin(&mut self, weight: &[f64]) -> Result<()> {
        self.spring_matrix()?;
        let rows = self.dofs.matrix_rows();
        self.matrix.as_mut().map_or(Ok(()), |matrix| matrix.update(rows, weight))
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
        let counts = self.matrix.as_ref().map_or_else(BodyCounts::default, SpringMatrix::counts);
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
        self.matrix.iter_mut().for_each(SpringMatrix::begin_anew);
    }

    /// Replace the loads f on all dofs that this rank knows, those of `initial` strains, and the values of the
    /// `prescribed` (dof, value), which are the same dofs as before. What was made of K stays.
    pub fn reload(&mut self, load: Vec<f64>, initial: &InitialLoad, prescribed: Vec<(usize, f64)>) -> Result<()> {
        let stiffness = std::mem::take(&mut self.elastic.stiffness);
        if let Some(interior) = &mut self.interior {
            let is_same = interior.reload(load, initial, prescribed);
            if !is_same && interior.schur.is_some() {
                self.elastic = interior.loads()?;
            }
        } else {
            let held = std::mem::take(&mut self.elastic.held);
            let mut whole = ElasticBody { held, ..ElasticBody::default() };
            whole.reload(load, initial, prescribed);
            let own = self.dofs.distribution.as_ref().map(|distribution| distribution.restrict(&whole));
            self.elastic = ElasticBody { held: std::mem::take(&mut whole.held), ..own.unwrap_or(whole) };
            self.dofs.prescribed = std::mem::take(&mut self.elastic.prescribed);
        }
        self.elastic.stiffness = stiffness;
        Ok(())
    }

    /// Return one line about the inner solver.
    pub fn describe(&self) -> String {
        match &self.matrix {
            Some(matrix) if self.interior.is_none() => matrix.solver().describe(),
            _ => self.words.clone(),
        }
    }
}

impl Interior {
    /// Factor the interior and return the body on its interface dofs.
    fn eliminate(&mut self) -> Result<ElasticBody> {
        let (began, name) = (Instant::now(), self.chosen.name());
        let lower = self.whole.stiffness.lower_triangle();
        self.whole.stiffness = Csr::new(0);
        let (dofs, interface) = (self.whole.load.len(), &self.interface.dofs);
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
        let body = ElasticBody { stiffness, ..self.loads()? };
        (self.eliminations, self.seconds) = (1, began.elapsed().as_secs_f64());
        Ok(body)
    }

    /// Replace the loads and prescribed values of the whole body. Return whether these are the same as before.
    fn reload(&mut self, load: Vec<f64>, initial: &InitialLoad, prescribed: Vec<(usize, f64)>) -> bool {
        let of = |whole: &ElasticBody| [whole.load.clone(), whole.lifting.clone()];
        let before = of(&self.whole);
        self.whole.reload(load, initial, prescribed);
        before == of(&self.whole)
    }

    /// Do some work with the factor.
    fn with_factor<T>(&self, work: impl FnOnce(&mut Schur) -> Result<T>) -> Result<T> {
        let missing = || Error::new(Kind::Solver, "the interior of a body is not eliminated yet");
        work(&mut self.schur.as_ref().ok_or_else(missing)?.borrow_mut())
    }

    /// Return the body on the interface dofs, with its loads and without K. None of these dofs is prescribed.
    fn loads(&self) -> Result<ElasticBody> {
        let Self { interface, whole, .. } = self;
        let ElasticBody { load, lifting: whole_lifting, .. } = whole;
        let at_rest = vec![0.0; interface.dofs.len()];
        self.with_factor(|schur| {
            let lifting = if whole_lifting.is_empty() { Vec::new() } else { schur.condense(whole_lifting)? };
            let reduced = schur.condense(load)?;
            // displacement of the interior under the loads alone, with the interface dofs at rest
            let interior = schur.expand_condensed(load, &at_rest)?;
            let work = dot(load, &interior);
            Ok(ElasticBody {
                load: reduced,
                lifting,
                energy_constant: whole.energy_constant - 0.5 * work,
                strain_constant: whole.strain_constant + work + 2.0 * dot(whole_lifting, &interior),
                ..ElasticBody::default()
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
