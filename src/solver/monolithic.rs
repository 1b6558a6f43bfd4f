//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one. omega is the area of a contact
//! point, kappa the tangent of its layer's law.
//!
//! With whole bodies it is the reference for methods that decompose: the same functional with one big sparse factorisation. With
//! condensed bodies it is small and dense, and cheaper than the sweeps that it saves. Where bodies are distributed over ranks, each
//! rank owns some rows. Where whole bodies live on several ranks, as condensed ones do, every rank has the whole matrix and solves for itself.

use super::{InnerSolver, Krylov, RigidSpace, RobinMatrix};
use crate::error::Result;
use crate::exchange::all_gather;
use crate::linalg::{Csr, axpy, countable, dot};
use crate::model::linear::{Failure, LinearResult, LinearSolution, LinearStep, System, Trial};
use crate::model::{Body, BodyCounts, BodySlot, Distribution, Field, Joint, Model, States};
use crate::petsc::{KspIterate, Rows};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

/// The linear step with one matrix of all bodies.
pub struct Monolithic<S> {
    joined: Rc<RefCell<JointMatrix<S>>>,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
}

/// The matrix of all bodies and its contact rows.
struct JointMatrix<S> {
    matrix: RobinMatrix<S>,
    rows: Csr,
    offset: Vec<usize>,
    /// Number of the first row that this rank owns.
    first: usize,
}

impl<S> JointMatrix<S> {
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
            let Some(states) = slot.local.as_ref().map(|body| body.states()) else { return Vec::new() };
            let mut state = x[part].to_vec();
            state.resize(states.size(), 0.0);
            states.separate(&mut state);
            state
        };
        model.bodies.iter().zip(self.parts()).map(state).collect()
    }
}

impl Joint for JointMatrix<Krylov> {
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
            joined: Rc::new(RefCell::new(JointMatrix { matrix, rows, offset, first: start.unwrap_or(0) })),
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
        let JointMatrix { matrix, rows, .. } = &mut *self.joined.borrow_mut();
        matrix.update(rows, springs)?;
        matrix.set_up()
    }

    fn solve(&mut self, system: System) -> Result<LinearResult> {
        let System { model, springs, residual, enough, .. } = system;
        let joined = &mut *self.joined.borrow_mut();
        let mut r = joined.whole(residual);
        if self.is_redundant {
            model.exchange.sum(&mut r);
        }
        let mut x = vec![0.0; r.len()];
        let JointMatrix { matrix, rows, first, .. } = joined;
        matrix.update(rows, springs)?;
        let mut last_error = None;
        let mut enough = |iterate: &KspIterate| {
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
        Ok(Ok(LinearSolution { field, energy, error, is_exact: accuracy == 0.0 }))
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
fn estimated_error(iterate: &KspIterate, energy: f64) -> f64 {
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

/// The stiffness matrices of all bodies side by side and the contact rows that couple them, on the states of the bodies.
///
/// A state is (v, a) for the displacement v + R a with rigid motions R. K multiplies v alone, and a contact point sees B v + B R a. So a rigid motion,
/// however large, leaves no rounding in the strains. To make v + R a unique, there are as many springs as R has columns, each under one dof of v.
/// They carry no force, since the rows for a require that all forces are balanced without them.
pub struct Union {
    /// Stiffness matrix of all bodies with these springs, in a pattern that holds that of B'B: the rows that this rank owns.
    pub stiffness: Csr,
    /// One row [B_a B_a R_a B_b B_b R_b] for each contact point, also for those of other ranks.
    pub rows: Csr,
    /// First entry of each body's state in a vector of this rank, and the length of that vector.
    pub offset: Vec<usize>,
    /// Number of the first row that this rank owns, if other ranks own the others. Columns then count through all ranks.
    pub(super) start: Option<usize>,
    /// b diag(K) b' of each row b.
    pub(super) row_stiffness: Vec<f64>,
    /// Rigid motions for the preconditioner, if v still contains them.
    pub(super) coarse: Option<RigidSpace>,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
}

impl Union {
    /// Join copies of the matrices of a model's bodies. Return `None` if a body has no matrices. Collective.
    ///
    /// # Errors
    /// More entries than 32 bits can count.
    pub fn of(model: &Model) -> Result<Option<Self>> {
        if model.exchange.ranks() > 1 {
            let Some(gathered) = gather(model) else { return Ok(None) };
            let union = Self::new(model, &gathered.iter().map(Gathered::matrices).collect::<Vec<_>>())?;
            return Ok(Some(Self { is_redundant: true, ..union }));
        }
        let parts = matrices(model).collect::<Option<Vec<_>>>();
        parts.map(|parts| Self::new(model, &parts)).transpose()
    }

    /// Join the matrices of bodies that give their K away, without entries for rigid motions, which stay part of v. Multigrid needs the dofs of nodes only,
    /// and distributed bodies have no others. Return `None` if a body needs its K.
    ///
    /// # Errors
    /// More entries than 32 bits can count.
    pub fn of_nodes(model: &mut Model) -> Result<Option<Self>> {
        let give = |slot: &mut BodySlot| slot.local.as_mut().and_then(|body| body.give_stiffness());
        let given = model.bodies.iter_mut().map(give).collect::<Option<Vec<Csr>>>();
        let Some(given) = given else { return Ok(None) };
        let parts = given
            .iter()
            .zip(matrices(model))
            .map(|(stiffness, matrices)| Some(Matrices { stiffness, rows: matrices?.rows, motions: &[], traces: &[] }));
        let parts = parts.collect::<Option<Vec<_>>>();
        let Some(parts) = parts else { return Ok(None) };
        let union = Self::new(model, &parts)?;
        let coarse = RigidSpace::of(model, &union.offset, &union.rows, union.start.unwrap_or(0));
        Ok(Some(Self { coarse, ..union }))
    }

    fn new(model: &Model, parts: &[Matrices]) -> Result<Self> {
        let layout = Layout::new(model, parts);
        let (rows, coupled) = layout.contact_rows();
        let mut stiffness = layout.stiffness(coupled)?;
        layout.add_springs(&mut stiffness);
        let sides = model.row_stiffness();
        let (side_a, side_b) = sides.split_at(model.points());
        let row_stiffness = side_a.iter().zip(side_b).map(|(a, b)| a + b).collect();
        let Layout { offset, start, .. } = layout;
        Ok(Self { stiffness, rows, offset, start, row_stiffness, coarse: None, is_redundant: false })
    }

    /// Return the union with all entries of K stored, row by row.
    pub fn without_zeros(mut self) -> Self {
        let n = self.stiffness.rows();
        let mut values = vec![0.0; n * n];
        for i in 0..n {
            self.stiffness.row(i).for_each(|(j, value)| values[i * n + j] = value);
        }
        self.stiffness = Csr::full(n, values);
        self
    }
}

/// The matrices of a body whose states are (v, a) for the displacement v + R a, with the rigid motions R that its supports leave free.
struct Matrices<'a> {
    /// K on the dofs v.
    stiffness: &'a Csr,
    /// B on the dofs v.
    rows: &'a Csr,
    /// R, one vector over the dofs v for each entry of a.
    motions: &'a [Rc<[f64]>],
    /// B R, one vector over the contact rows for each entry of a.
    traces: &'a [Vec<f64>],
}

impl<'a> Matrices<'a> {
    fn of(body: &'a dyn Body) -> Self {
        let States { rows, motions, traces, .. } = body.states();
        Self { stiffness: body.stiffness(), rows, motions, traces }
    }

    fn state_len(&self) -> usize {
        self.stiffness.rows() + self.motions.len()
    }
}

/// The places of all bodies in one matrix.
struct Layout<'a> {
    model: &'a Model,
    parts: &'a [Matrices<'a>],
    /// How each body is distributed over the ranks, if it is.
    distributions: Vec<Option<&'a Distribution>>,
    /// First row of each body on this rank, and the number of rows of this rank.
    offset: Vec<usize>,
    /// Number of the first row that this rank owns, if other ranks own the others.
    start: Option<usize>,
    /// Number of columns, which is that of the rows of all ranks.
    total: usize,
}

/// Columns, sorted, that a row of the matrix gets besides those of K, by the number of the row on this rank.
type Coupled = HashMap<usize, Vec<i32>>;

/// A contact row of a body.
#[derive(Clone, Copy, Default)]
struct BodyRow {
    body: usize,
    row: usize,
}

impl<'a> Layout<'a> {
    fn new(model: &'a Model, parts: &'a [Matrices<'a>]) -> Self {
        let distribution = |slot: &'a BodySlot| slot.distribution();
        let distributions: Vec<_> = model.bodies.iter().map(distribution).collect();
        let mut offset = vec![0];
        for part in parts {
            offset.push(offset[offset.len() - 1] + part.state_len());
        }
        let shared = distributions.iter().copied().flatten().next();
        let total = shared.map_or(offset[parts.len()], |shared| shared.total);
        Self { model, parts, distributions, offset, start: shared.map(|shared| shared.start), total }
    }

    /// Return B of all bodies together, and the columns that its products couple in the rows of this rank.
    fn contact_rows(&self) -> (Csr, Coupled) {
        let first = self.start.unwrap_or(0);
        let owned = first..first + self.offset[self.parts.len()];
        let (mut rows, mut coupled) = (Csr::new(self.total), Coupled::new());
        for sides in self.rows_of_points() {
            let entries: Vec<(usize, f64)> = sides.into_iter().flat_map(|side| self.entries(side)).collect();
            for &(i, _) in entries.iter().filter(|(i, _)| owned.contains(i)) {
                coupled.entry(i - first).or_default().extend(entries.iter().map(|&(j, _)| j as i32));
            }
            rows.push_row(entries);
        }
        for columns in coupled.values_mut() {
            columns.sort_unstable();
            columns.dedup();
        }
        (rows, coupled)
    }

    /// Return the row of each of the two bodies for each contact point.
    fn rows_of_points(&self) -> Vec<[BodyRow; 2]> {
        let points = self.model.points();
        let mut rows = vec![[BodyRow::default(); 2]; points];
        for body in 0..self.parts.len() {
            for (row, place) in self.model.trace_ranges(body).flatten().enumerate() {
                rows[place % points][place / points] = BodyRow { body, row };
            }
        }
        rows
    }

    /// Return the entries (column of the whole matrix, value) of a contact row: those of B, then those of B R.
    fn entries(&self, BodyRow { body, row }: BodyRow) -> Vec<(usize, f64)> {
        if let Some(distribution) = self.distributions[body] {
            return distribution.rows.row(row).collect();
        }
        let (part, offset) = (&self.parts[body], self.offset[body]);
        let dofs = part.stiffness.rows();
        let rigid = part.traces.iter().enumerate().map(|(k, trace)| (dofs + k, trace[row]));
        part.rows.row(row).chain(rigid).map(|(i, value)| (offset + i, value)).collect()
    }

    /// Return K of all bodies, in the rows of this rank, with zeros at the `coupled` columns that K does not have.
    fn stiffness(&self, mut coupled: Coupled) -> Result<Csr> {
        let stored: usize = self.parts.iter().map(|part| part.stiffness.values.len()).sum();
        let room = stored + coupled.values().map(Vec::len).sum::<usize>();
        countable("the matrix of all bodies together", room)?;
        let mut stiffness = Csr { columns: self.total, ptr: vec![0], ..Csr::default() };
        stiffness.ptr.reserve_exact(self.offset[self.parts.len()]);
        stiffness.col.reserve_exact(room);
        stiffness.values.reserve_exact(room);
        for (&begin, part) in self.offset.iter().zip(self.parts) {
            let own = part.stiffness;
            // K of a distributed body has the columns of the whole matrix already
            let shift = if self.start.is_some() { 0 } else { begin as i32 };
            for i in 0..own.rows() {
                let known = own.range(i).map(|k| (shift + own.col[k], own.values[k]));
                push_merged(&mut stiffness, known, coupled.remove(&(begin + i)).as_deref().unwrap_or_default());
            }
            for i in begin + own.rows()..begin + part.state_len() {
                // a rigid motion that no contact row sees has only its diagonal
                let columns = coupled.remove(&i).unwrap_or_else(|| vec![i as i32]);
                push_merged(&mut stiffness, std::iter::empty(), &columns);
            }
        }
        stiffness.col.shrink_to_fit();
        stiffness.values.shrink_to_fit();
        Ok(stiffness)
    }

    /// Add the springs that make v + R a unique.
    fn add_springs(&self, stiffness: &mut Csr) {
        for ((begin, part), slot) in self.offset.iter().zip(self.parts).zip(&self.model.bodies) {
            for dof in pins(part.motions).into_iter().map(|pin| begin + pin) {
                // the spring is as stiff as K was before elimination; K itself may be nothing but rounding now
                match stiffness.position(dof, dof) {
                    Some(at) => stiffness.values[at] += slot.scale,
                    None => unreachable!("a stiffness matrix has its diagonal"),
                }
            }
        }
    }
}

/// Append a row with the entries (column, value) `known` and with zeros at the other ones of `columns`. Both are sorted by column.
fn push_merged(matrix: &mut Csr, known: impl Iterator<Item = (i32, f64)>, columns: &[i32]) {
    let mut known = known.peekable();
    let mut push = |column: i32, value: f64| {
        matrix.col.push(column);
        matrix.values.push(value);
    };
    for &column in columns {
        while let Some((before, value)) = known.next_if(|entry| entry.0 < column) {
            push(before, value);
        }
        push(column, known.next_if(|entry| entry.0 == column).map_or(0.0, |entry| entry.1));
    }
    known.for_each(|(column, value)| push(column, value));
    matrix.ptr.push(matrix.col.len() as i32);
}

/// The matrices of a condensed body, as they are sent to every rank.
#[derive(Clone, Serialize, Deserialize)]
struct Gathered {
    stiffness: Csr,
    rows: Csr,
    motions: Vec<Rc<[f64]>>,
    traces: Vec<Vec<f64>>,
}

impl Gathered {
    fn matrices(&self) -> Matrices<'_> {
        let Self { stiffness, rows, motions, traces } = self;
        Matrices { stiffness, rows, motions, traces }
    }
}

/// Return the matrices of the local bodies.
fn matrices(model: &Model) -> impl Iterator<Item = Option<Matrices<'_>>> {
    model.bodies.iter().map(|slot| slot.local.as_ref().map(Matrices::of))
}

/// Send the matrices of all bodies to every rank. Each body lives on one rank. One message. Return `None` if a body has no matrices.
fn gather(model: &Model) -> Option<Vec<Gathered>> {
    let local = matrices(model).map(|matrices| {
        let Matrices { stiffness, rows, motions, traces } = matrices?;
        let (motions, traces) = (motions.to_vec(), traces.to_vec());
        Some(Gathered { stiffness: stiffness.clone(), rows: rows.clone(), motions, traces })
    });
    let mut all = all_gather(&*model.exchange, local.collect::<Vec<_>>());
    let of = |body: usize| all.iter_mut().find_map(|of_rank| of_rank.get_mut(body)?.take());
    (0..model.bodies.len()).map(of).collect()
}

/// Return as many dofs as there are motions, such that no combination of the motions leaves all these dofs at rest. They are the pivots of an elimination.
fn pins(motions: &[Rc<[f64]>]) -> Vec<usize> {
    let mut remaining: Vec<Vec<f64>> = motions.iter().map(|motion| motion.to_vec()).collect();
    let mut pins = Vec::new();
    while let Some(mut motion) = remaining.pop() {
        let Some(pin) = (0..motion.len()).max_by(|&i, &j| motion[i].abs().total_cmp(&motion[j].abs())) else { break };
        let pivot = motion[pin];
        motion.iter_mut().for_each(|u| *u /= pivot);
        remaining.iter_mut().for_each(|other| axpy(-other[pin], &motion, other));
        pins.push(pin);
    }
    pins
}
