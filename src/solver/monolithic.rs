//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one. omega is the area of a contact
//! point, kappa the tangent of its layer's law.
//!
//! With whole bodies it is the reference for methods that decompose: the same functional with one big sparse factorisation. With
//! condensed bodies it is small and dense, and cheaper than the sweeps that it saves. Where bodies are distributed over ranks, each
//! rank owns some rows. Where whole bodies live on several ranks, as condensed ones do, every rank has the whole matrix and solves for itself.

use super::{InnerSolver, Krylov, RobinMatrix, Union};
use crate::error::Result;
use crate::linalg::{Csr, dot};
use crate::model::linear::{Failure, LinearStep, Solution, Solved, System, Trial};
use crate::model::{BodyCounts, BodySlot, Field, Joint, Model};
use crate::petsc::{Iterate, Rows};
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

/// The linear step with one matrix of all bodies.
pub struct Monolithic<S> {
    joined: Rc<RefCell<Joined<S>>>,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
}

/// The matrix of all bodies and its contact rows.
struct Joined<S> {
    matrix: RobinMatrix<S>,
    rows: Csr,
    offset: Vec<usize>,
    /// Number of the first row that this rank owns.
    first: usize,
}

impl<S> Joined<S> {
    /// Return the range of each body's state in a vector of all bodies.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.offset.windows(2).map(|part| part[0]..part[1])
    }

    /// Return the states of all bodies as one vector; it is zero for bodies of other ranks. Where the matrix has no entries for rigid motions, these are left
    /// out.
    fn whole(&self, states: &[Vec<f64>]) -> Vec<f64> {
        let mut whole = vec![0.0; self.offset[self.offset.len() - 1]];
        for (part, state) in self.parts().zip(states).filter(|(_, state)| !state.is_empty()) {
            whole[part.clone()].copy_from_slice(&state[..part.len()]);
        }
        whole
    }

    /// Return the state of each local body from a vector of all bodies.
    fn states(&self, model: &Model, x: &[f64]) -> Vec<Vec<f64>> {
        let state = |(slot, part): (&BodySlot, Range<usize>)| {
            let Some(body) = &slot.local else { return Vec::new() };
            let mut state = x[part].to_vec();
            state.resize(body.len(), 0.0);
            body.separate(&mut state);
            state
        };
        model.bodies.iter().zip(self.parts()).map(state).collect()
    }
}

impl Joint for Joined<Krylov> {
    fn multiply(&mut self, states: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let x = self.whole(states);
        let mut y = vec![0.0; x.len()];
        self.matrix.multiply_stiffness(&self.rows, &x, &mut y);
        let of_body = |(part, state): (Range<usize>, &Vec<f64>)| {
            let mut product = y[part].to_vec();
            product.resize(state.len(), 0.0);
            product
        };
        self.parts().zip(states).map(of_body).collect()
    }
}

impl<S: InnerSolver> Monolithic<S> {
    /// Join bodies. `make` makes a solver of their K.
    pub fn new(union: Union, make: impl FnOnce(Rows) -> Result<S>) -> Result<Self> {
        let Union { stiffness, rows, offset, start, row_stiffness, coarse, is_redundant } = union;
        let matrix = RobinMatrix::new(super::rows(stiffness, start)?, &rows, row_stiffness, coarse, make)?;
        Ok(Self {
            joined: Rc::new(RefCell::new(Joined { matrix, rows, offset, first: start.unwrap_or(0) })),
            is_redundant,
        })
    }
}

impl Monolithic<Krylov> {
    /// Return K of all bodies, for a model whose bodies have given theirs away.
    pub fn joint(&self) -> Rc<RefCell<dyn Joint>> {
        self.joined.clone()
    }
}

impl<S: InnerSolver> LinearStep for Monolithic<S> {
    fn name(&self) -> &'static str {
        "newton"
    }

    fn set_up(&mut self, springs: &[f64]) -> Result<()> {
        let Joined { matrix, rows, .. } = &mut *self.joined.borrow_mut();
        matrix.update(rows, springs)?;
        matrix.set_up()
    }

    fn solve(&mut self, system: System) -> Result<Solved> {
        let System { model, springs, residual, enough, .. } = system;
        let joined = &mut *self.joined.borrow_mut();
        let mut r = joined.whole(residual);
        if self.is_redundant {
            model.exchange.sum(&mut r);
        }
        let mut x = vec![0.0; r.len()];
        let Joined { matrix, rows, first, .. } = joined;
        matrix.update(rows, springs)?;
        let mut last_error = None;
        let mut enough = |iterate: &Iterate| {
            let (closing, energy) = closing_and_energy(model, rows, *first, iterate.x, &r);
            let error = estimated_error(iterate, energy);
            last_error = Some(error);
            enough(model, &Trial { closing: &closing, energy, error })
        };
        let failure = matrix.apply(|solver| solver.solve_until(&r, &mut x, &mut enough))?.failure;
        if let (false, Some(reason)) = (self.is_redundant, &failure) {
            return Ok(Err(Failure { body: None, reason: reason.clone() }));
        }
        let Some((field, energy)) = collect(model, joined.states(model, &x), residual, failure.is_some()) else {
            let elsewhere = || "the matrix of all bodies cannot be factored on another rank".to_owned();
            return Ok(Err(Failure { body: None, reason: failure.unwrap_or_else(elsewhere) }));
        };
        let accuracy = joined.matrix.solver().accuracy();
        let error = last_error.unwrap_or(accuracy * energy.max(0.0).sqrt());
        Ok(Ok(Solution { field, energy, error, is_exact: accuracy == 0.0 }))
    }

    fn counts(&self) -> BodyCounts {
        self.joined.borrow().matrix.counts()
    }

    fn describe(&self) -> String {
        self.joined.borrow().matrix.solver().describe()
    }
}

/// Return B x at the points, n, and x'r, the squared energy norm of an iterate x. `x` and `r` have the rows of this rank, from number `first` on. One message.
fn closing_and_energy(model: &Model, rows: &Csr, first: usize, x: &[f64], r: &[f64]) -> (Vec<f64>, f64) {
    let owned = |q: usize| rows.row(q).filter_map(|(i, b)| Some(b * x.get(i.checked_sub(first)?)?)).sum();
    let mut closing: Vec<f64> = (0..model.points()).map(owned).collect();
    closing.push(dot(x, r));
    model.exchange.sum(&mut closing);
    let energy = closing.pop().unwrap_or_default().max(0.0);
    (closing, energy)
}

/// Return the estimated energy norm of the error of an iterate with this squared energy norm.
fn estimated_error(iterate: &Iterate, energy: f64) -> f64 {
    match iterate.least {
        // r'A^-1 r is at most r'M^-1 r over the least eigenvalue of M^-1 A
        Some(least) => iterate.residual / least.sqrt(),
        None => iterate.residual / iterate.first * energy.sqrt(),
    }
}

/// Collect a solution x of all ranks from the `states` of the local bodies. Return x with the traces of all bodies, and x'r, or `None` if the solver of some rank
/// has failed. One message, so that all ranks have the same numbers although their processors may round differently.
fn collect(model: &Model, states: Vec<Vec<f64>>, residual: &[Vec<f64>], has_failed: bool) -> Option<(Field, f64)> {
    let energy: f64 = states.iter().zip(residual).map(|(x, r)| dot(x, r)).sum();
    let mut field = Field { states, trace: vec![0.0; 2 * model.points()] };
    field.trace_here(model);
    field.trace.extend([energy, f64::from(u8::from(has_failed))]);
    model.exchange.sum(&mut field.trace);
    let failures = field.trace.pop().unwrap_or_default();
    let energy = field.trace.pop().unwrap_or_default();
    (failures <= 0.0).then_some((field, energy))
}
