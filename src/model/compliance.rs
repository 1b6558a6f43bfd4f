//! The linear step (35) of condensed bodies by their compliance at the contact points.
//!
//! Let x = v + E a with the free rigid motions E and with v = 0 at as many dofs of each body, its *pins*, as it has
//! such motions. K without the pins is positive definite, and K E = 0, so that the pins carry nothing while the forces
//! on a body are in equilibrium. With the forces l = D B x of the springs D at the contact points,
//!
//! ```text
//! v = K^-1 (r - B'l)                 F = B K^-1 B',   g = B K^-1 r
//! (F + D^-1) l - B E a = g           the springs
//! (B E)' l             = E'r         equilibrium of each body
//! ```
//!
//! F does not depend on the springs. So a change of them costs one dense factorisation over the points that have a
//! spring, instead of one over the dofs at the contact. An obstacle, or the offset of a gap, has motions and no K.

use super::dofs::pins;
use super::field::add_forces;
use super::linear::{Failure, LinearSolution, LinearStep, Solved, System};
use super::motions::Motions;
use super::{Body, BodySlot, DisplacementField, Model};
use crate::error::{Error, Kind, Result};
use crate::exchange::{Exchange, broadcast};
use crate::linalg::{axpy, dot, full_product};
use crate::petsc::{cholesky, cholesky_inverse, cholesky_solve};
use crate::solver::BodyCounts;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::rc::Rc;
use std::time::Instant;

/// The linear step by the compliance of all bodies.
pub struct ComplianceStep {
    /// K without pins of each body; `None` for rigid parts and bodies of other ranks.
    bodies: Vec<Option<PinnedStiffness>>,
    /// F, n x n, on the first rank.
    compliance: Vec<f64>,
    /// B E of each motion, n each.
    closings: Vec<Vec<f64>>,
    /// The springs of the last solve.
    springs: Vec<f64>,
    /// Whether the first rank has factored the system for these springs.
    is_factored: bool,
    /// This system.
    factored: Option<SpringSystem>,
    exchange: Rc<dyn Exchange>,
    counts: BodyCounts,
    /// Counters of the solver that it replaces in a history.
    earlier: BodyCounts,
}

impl ComplianceStep {
    /// Make the compliance of the condensed bodies of a model. The result is `None` where it does not pay:
    /// for one body, which has as many points as dofs. It is also `None` for bodies on springs to the ground, whose
    /// compliance has few digits of the strains if the springs are soft, and where some K is not positive definite
    /// without its pins. Collective.
    ///
    /// # Errors
    /// Failures of LAPACK.
    pub fn new(model: &Model) -> Result<Option<Self>> {
        let n = model.points();
        let is_sprung = model.bodies.iter().any(BodySlot::is_sprung);
        let mut is_missing = [f64::from(u8::from(is_sprung || model.meshed() == 1))];
        let mut bodies: Vec<Option<PinnedStiffness>> = model.bodies.iter().map(|_| None).collect();
        let mut compliance = vec![0.0; n * n];
        for (index, body) in model.locals().filter(|(index, _)| !model.bodies[*index].is_rigid) {
            let Some(pinned) = PinnedStiffness::new(body)? else {
                is_missing[0] += 1.0;
                continue;
            };
            pinned.add_compliance(body, &points_of_rows(model, index), n, &mut compliance);
            bodies[index] = Some(pinned);
        }
        model.exchange.sum(&mut is_missing);
        if is_missing[0] > 0.0 {
            return Ok(None);
        }
        model.exchange.sum(&mut compliance);
        let (exchange, counts) = (model.exchange.clone(), BodyCounts::default());
        let (springs, closings) = (vec![0.0; n], closings(model));
        if exchange.rank() > 0 {
            compliance = Vec::new();
        }
        Ok(Some(Self {
            bodies,
            compliance,
            closings,
            springs,
            is_factored: false,
            factored: None,
            exchange,
            counts,
            earlier: counts,
        }))
    }

    /// Take these springs, and factor their system if it has changed. Return whether it is positive definite, on the
    /// first rank.
    fn factor(&mut self, springs: &[f64]) -> Result<bool> {
        if springs == self.springs {
            self.counts.robin_skipped += 1;
        } else {
            self.counts.robin_updates += 1;
            self.springs.copy_from_slice(springs);
            self.is_factored = false;
        }
        if !self.is_factored {
            self.is_factored = true;
            let began = Instant::now();
            if self.exchange.rank() == 0 {
                self.factored = Some(SpringSystem::new(&self.compliance, springs, &self.closings)?);
            }
            let seconds = began.elapsed().as_secs_f64();
            self.counts.dense_factorizations += 1;
            self.counts.factor_seconds += seconds;
            if self.counts.dense_factorizations == 1 {
                self.counts.first_seconds = seconds;
            }
        }
        Ok(self.factored.as_ref().is_some_and(|factored| factored.stiffness.is_some()))
    }

    /// Add to a state what is left of the equations. Collective.
    fn correct(&self, model: &Model, left: &ContactResidual, found: &mut ContactState) -> Result<()> {
        let mut g = closing_of(model, &self.pinned_displacements(&left.forces));
        model.exchange.sum(&mut g);
        axpy(-1.0, &left.closing, &mut g);
        let (force, amounts) = self.equilibrium(&g, left.works.as_slice())?;
        let mut rest = left.forces.clone();
        for (index, body) in model.locals().filter(|(index, _)| !model.bodies[*index].is_rigid) {
            body.dofs().rows.add_transpose(-1.0, &model.at_rows(index, &force), &mut rest[index]);
        }
        let change = self.pinned_displacements(&rest);
        found.v.iter_mut().zip(&change).for_each(|(v, change)| axpy(1.0, change, v));
        axpy(1.0, &force, &mut found.force);
        found.amounts += DVector::from_vec(amounts);
        Ok(())
    }

    /// Return K^-1 r for forces on the dofs of each body that this rank has; zero for others.
    fn pinned_displacements(&self, r: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of_body = |(body, r): (&Option<PinnedStiffness>, &Vec<f64>)| match body {
            Some(body) => body.solve(r),
            None => vec![0.0; r.len()],
        };
        self.bodies.iter().zip(r).map(of_body).collect()
    }

    /// Return the forces l of the springs, n, and the amounts a, from g, n, and the works E'r. The first rank solves.
    fn equilibrium(&self, g: &[f64], works: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        broadcast(&*self.exchange, || match &self.factored {
            Some(factored) => factored.solve(g, works),
            None => Err(Error::new(Kind::Solver, "the springs of the contact were not set")),
        })
    }
}

impl LinearStep for ComplianceStep {
    fn name(&self) -> &'static str {
        "newton"
    }

    fn set_up(&mut self, springs: &[f64]) -> Result<()> {
        self.factor(springs).map(|_| ())
    }

    fn renew(&mut self, model: &Model) {
        // rigid parts may have other motions, and others of their motions may be free
        let before = std::mem::replace(&mut self.closings, closings(model));
        self.is_factored &= before == self.closings;
    }

    fn count_on(&mut self, earlier: BodyCounts) {
        self.earlier = earlier;
    }

    fn begin_anew(&mut self) {
        (self.counts, self.earlier) = (BodyCounts::default(), BodyCounts::default());
    }

    fn solve(&mut self, system: System) -> Result<Solved<LinearSolution>> {
        let System { model, springs, residual, .. } = system;
        let is_definite = self.factor(springs)?;
        if !broadcast(&*self.exchange, || Ok(is_definite))? {
            let reason = "the Robin matrix is not positive definite".to_owned();
            return Ok(Err(Failure { body: None, reason }));
        }
        let began = Instant::now();
        let works = Motions::of(model).work_of(model, residual);
        let mut found = ContactState::zero(model, residual);
        let (forces, closing) = (residual.to_vec(), vec![0.0; model.points()]);
        self.correct(model, &ContactResidual { forces, closing, works: works.clone() }, &mut found)?;
        // F has the flexibility of a whole body in every entry. That is 1e6 times the flexibility of its surface where
        // a beam is 100 times as long as thick, so that one solve has six digits less than numbers have.
        let left = found.left(model, springs, residual, &works);
        self.correct(model, &left, &mut found)?;
        let ContactState { v, amounts, .. } = found;
        let own: f64 = v.iter().zip(residual).map(|(v, r)| dot(v, r)).sum();
        let (field, sums) = DisplacementField::of_step(model, v, &Motions::of(model).of_bodies(&amounts), &[own]);
        self.counts.solves += 1;
        self.counts.solve_seconds += began.elapsed().as_secs_f64();
        let energy = sums[0] + amounts.dot(&works);
        Ok(Ok(LinearSolution { field, energy, error: 0.0, is_exact: true }))
    }

    fn counts(&self) -> BodyCounts {
        let mut counts = self.counts;
        counts += self.earlier;
        counts
    }

    fn describe(&self) -> String {
        "dense Cholesky".to_owned()
    }
}

/// An iterate of the equations of the contact.
struct ContactState {
    /// v of each body that this rank has.
    v: Vec<Vec<f64>>,
    /// l, n.
    force: Vec<f64>,
    /// a.
    amounts: DVector<f64>,
}

/// What an iterate leaves of the equations.
struct ContactResidual {
    /// r - K v - B'l of each body that this rank has.
    forces: Vec<Vec<f64>>,
    /// D^-1 l - B (v + E a) at the points with a spring, n.
    closing: Vec<f64>,
    /// E'r - (B E)'l.
    works: DVector<f64>,
}

impl ContactState {
    fn zero(model: &Model, residual: &[Vec<f64>]) -> Self {
        let v = residual.iter().map(|r| vec![0.0; r.len()]).collect();
        Self { v, force: vec![0.0; model.points()], amounts: DVector::zeros(Motions::of(model).count()) }
    }

    /// Return what is left of the equations for the forces r and the works E'r. Collective.
    fn left(&self, model: &mut Model, springs: &[f64], r: &[Vec<f64>], works: &DVector<f64>) -> ContactResidual {
        let mut forces = model.multiply(&self.v);
        let model = &*model;
        add_forces(model, &self.force, &mut forces);
        forces.iter_mut().zip(r).for_each(|(left, r)| left.iter_mut().zip(r).for_each(|(left, r)| *left = r - *left));
        let motions = Motions::of(model);
        let mut closing = closing_of(model, &self.v);
        model.exchange.sum(&mut closing);
        axpy(1.0, &motions.closing(&self.amounts), &mut closing);
        for ((closing, force), spring) in closing.iter_mut().zip(&self.force).zip(springs) {
            *closing = if has_spring(*spring) { force / spring - *closing } else { 0.0 };
        }
        ContactResidual { forces, closing, works: works - motions.work(&self.force) }
    }
}

/// Return whether a point has a spring: one that is not so soft that its compliance leaves the range of numbers.
fn has_spring(spring: f64) -> bool {
    spring.recip().is_finite()
}

/// Return the point of each contact row of a body.
fn points_of_rows(model: &Model, body: usize) -> Vec<usize> {
    model.trace_ranges(body).flatten().map(|place| place % model.points()).collect()
}

/// Return by how much each motion of all bodies closes the points, n each.
fn closings(model: &Model) -> Vec<Vec<f64>> {
    let motions = Motions::of(model);
    let unit = |i: usize| DVector::from_fn(motions.count(), |k, _| f64::from(u8::from(k == i)));
    (0..motions.count()).map(|i| motions.closing(&unit(i))).collect()
}

/// Return by how much displacements of the local bodies close the points, n.
fn closing_of(model: &Model, u: &[Vec<f64>]) -> Vec<f64> {
    let mut closing = vec![0.0; model.points()];
    for (index, body) in model.locals().filter(|(index, _)| !model.bodies[*index].is_rigid) {
        let mut rows = vec![0.0; body.dofs().rows.rows()];
        body.dofs().rows.multiply(&u[index], &mut rows);
        points_of_rows(model, index).into_iter().zip(rows).for_each(|(q, row)| closing[q] += row);
    }
    closing
}

/// The inverse of K of a body without its pins.
struct PinnedStiffness {
    count: usize,
    pins: Vec<usize>,
    /// K^-1, with ones on the diagonal at the pins.
    inverse: Vec<f64>,
}

impl PinnedStiffness {
    /// Invert K of a body; `None` if K without pins is not positive definite.
    fn new(body: &Body) -> Result<Option<Self>> {
        let (Some(mut inverse), count) = (body.condensed_stiffness(), body.dofs().count) else { return Ok(None) };
        let pins = pins(&body.dofs().unconstrained_modes);
        for &pin in &pins {
            inverse[pin * count..][..count].fill(0.0);
            inverse.iter_mut().skip(pin).step_by(count).for_each(|k| *k = 0.0);
            inverse[pin * count + pin] = 1.0;
        }
        if !cholesky(&mut inverse, count)? {
            return Ok(None);
        }
        cholesky_inverse(&mut inverse, count)?;
        Ok(Some(Self { count, pins, inverse }))
    }

    /// Return K^-1 r.
    fn solve(&self, r: &[f64]) -> Vec<f64> {
        let mut forces = r.to_vec();
        self.pins.iter().for_each(|&pin| forces[pin] = 0.0);
        let mut u = vec![0.0; self.count];
        full_product(&self.inverse, &forces, &mut u);
        u
    }

    /// Add B K^-1 B' to F, n x n, for the contact rows of the body at these points.
    fn add_compliance(&self, body: &Body, points: &[usize], n: usize, compliance: &mut [f64]) {
        let rows = &body.dofs().rows;
        let free = |q: usize| rows.row(q).filter(|(i, _)| !self.pins.contains(i));
        for (q, &own) in points.iter().enumerate() {
            let mut column = vec![0.0; self.count];
            free(q).for_each(|(i, b)| axpy(b, &self.inverse[i * self.count..][..self.count], &mut column));
            for (p, &point) in points.iter().enumerate() {
                compliance[own * n + point] += free(p).map(|(i, b)| b * column[i]).sum::<f64>();
            }
        }
    }
}

/// The system of the points that have a spring.
struct SpringSystem {
    /// These points.
    points: Vec<usize>,
    /// The factor of F + D^-1 there.
    factor: Vec<f64>,
    /// B E there, one column a motion.
    motions: DMatrix<f64>,
    /// (F + D^-1)^-1 B E.
    following: DMatrix<f64>,
    /// The factor of (B E)' (F + D^-1)^-1 B E; `None` if nothing resists some motion.
    stiffness: Option<Cholesky<f64, Dyn>>,
    /// Number of all points.
    count: usize,
}

impl SpringSystem {
    fn new(compliance: &[f64], springs: &[f64], closings: &[Vec<f64>]) -> Result<Self> {
        let count = springs.len();
        let points: Vec<usize> = (0..count).filter(|&q| has_spring(springs[q])).collect();
        let m = points.len();
        let mut factor = vec![0.0; m * m];
        for (i, &q) in points.iter().enumerate() {
            // the factorisation reads the entries up to the diagonal
            let row = &mut factor[i * m..][..=i];
            row.iter_mut().zip(&points).for_each(|(entry, &p)| *entry = compliance[q * count + p]);
            row[i] += springs[q].recip();
        }
        let is_definite = cholesky(&mut factor, m)?;
        let motions = DMatrix::from_fn(m, closings.len(), |i, k| closings[k][points[i]]);
        let mut following = motions.clone();
        cholesky_solve(&factor, m, following.as_mut_slice())?;
        let stiffness = motions.tr_mul(&following);
        // rounding makes it asymmetric
        let stiffness = (0.5 * (&stiffness + stiffness.transpose())).cholesky().filter(|_| is_definite);
        Ok(Self { points, factor, motions, following, stiffness, count })
    }

    /// Return l at all points and a, from g at all points and the works E'r.
    fn solve(&self, g: &[f64], works: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        let mut forces = DVector::from_iterator(self.points.len(), self.points.iter().map(|&q| g[q]));
        cholesky_solve(&self.factor, self.points.len(), forces.as_mut_slice())?;
        let lacking = DVector::from_column_slice(works) - self.motions.tr_mul(&forces);
        let amounts = self.stiffness.as_ref().map_or(lacking.clone(), |factor| factor.solve(&lacking));
        forces += &self.following * &amounts;
        let mut all = vec![0.0; self.count];
        self.points.iter().zip(forces.iter()).for_each(|(&q, force)| all[q] = *force);
        Ok((all, amounts.as_slice().to_vec()))
    }
}
