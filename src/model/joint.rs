//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one. omega
//! is the area of a contact point, kappa the tangent of its layer's law.
//!
//! With whole bodies it is the reference for methods that decompose: the same functional with one big sparse
//! factorisation. With condensed bodies it is small and dense, and cheaper than the sweeps that it saves. Where bodies
//! are distributed over ranks, each rank owns some rows. Where whole bodies live on several ranks, as condensed ones
//! do, every rank has the whole matrix and solves for itself.

use super::coarse::RigidSpace;
use super::dofs::pins;
use super::field::add_forces;
use super::linear::{Failure, LinearSolution, LinearStep, Solved, StoppingTest, System, Trial};
use super::rigid_parts::{ACCURACY, RigidParts, WithoutRigidParts};
use super::{BodySlot, DisplacementField, Distribution, Dofs, Model, closing};
use crate::error::{Error, Kind, Result};
use crate::exchange::all_gather;
use crate::linalg::{Csr, countable, dot};
use crate::petsc::KspIterate;
use crate::solver::{BodyCounts, MakeSolver, SpringMatrix, rows_of};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// The linear step with one matrix of all bodies.
///
/// Layers may be far softer than the rounding of K, which resists rigid motions E of a free body by that. So where a
/// matrix is factored, some dofs of each body are *pins*, as many as it has free motions. Its displacements are v + E
/// a, v is zero at the pins, and a stands in their place among the unknowns. Since K E = 0, the rows of K for a are
/// zero, exactly, and a contact row has B E there. Rigid parts have no unknowns: they are eliminated around the matrix
/// ([`RigidParts`]).
pub struct JointStep {
    /// K of all bodies in G.
    matrix: SpringMatrix,
    /// B of all bodies: one row [B_a B_b] for each contact point, also for those of other ranks.
    rows: Csr,
    /// First entry of each body in a vector of this rank, and the length of that vector.
    offset: Vec<usize>,
    /// Pins of each body.
    pins: Vec<Vec<usize>>,
    /// The row of K of each pin, which the matrix does not have.
    pinned: Csr,
    /// Number of the first row that this rank owns.
    first: usize,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
    /// Counters of the solver that it replaces in a history.
    earlier: BodyCounts,
    /// The rigid parts, for the springs of the last solve.
    parts_apart: Option<RigidParts>,
}

impl JointStep {
    /// Join the bodies of a model. The matrix takes the `stiffness` K of those of this rank that are not condensed, by
    /// their numbers; condensed ones keep theirs. `make` makes a solver of K; with `is_dense` it gets all entries of K,
    /// row by row.
    ///
    /// With `of_nodes` the unknowns are the displacements of nodes, as multigrid and distributed bodies need them.
    /// Otherwise there are pins, and every rank has the whole matrix. Collective.
    ///
    /// # Errors
    /// More entries than 32 bits can count, a body without K, and failures of the solver library.
    pub fn new(
        model: &Model,
        stiffness: BTreeMap<usize, Csr>,
        of_nodes: bool,
        is_dense: bool,
        make: MakeSolver,
    ) -> Result<Self> {
        let layout = Layout::new(model, matrices(model, stiffness, of_nodes)?);
        let (rows, coupled) = layout.contact_rows();
        let (offset, pins, start) = (layout.offset.clone(), layout.pins.clone(), layout.start);
        let (mut stiffness, pinned) = layout.stiffness(coupled)?;
        if is_dense {
            stiffness = without_zeros(&stiffness);
        }
        let first = start.unwrap_or(0);
        let coarse = if of_nodes { RigidSpace::of(model, &offset, &rows, first) } else { None };
        let sides = model.row_stiffness();
        let (side_a, side_b) = sides.split_at(model.points());
        let row_stiffness = side_a.iter().zip(side_b).map(|(a, b)| a + b).collect();
        let matrix = SpringMatrix::new(rows_of(stiffness, start)?, &rows, row_stiffness, coarse, make)?;
        let is_redundant = !of_nodes && model.exchange.ranks() > 1;
        let (earlier, parts_apart) = (BodyCounts::default(), None);
        Ok(Self { matrix, rows, offset, pins, pinned, first, is_redundant, earlier, parts_apart })
    }

    /// Solve G x = r with the matrix until `enough` accepts an iterate. Return the estimated energy norm of the error
    /// of x, by an iterative solver, or why the solver gave up.
    fn solve_matrix(
        &mut self,
        model: &Model,
        r: &[f64],
        x: &mut [f64],
        enough: &mut StoppingTest,
    ) -> Result<Solved<Option<f64>>> {
        let (rows, first, mut last_error) = (&self.rows, self.first, None);
        let mut test = |iterate: &KspIterate| {
            let (closing, energy) = closing_and_energy(model, rows, first, iterate.x, r);
            let error = estimated_error(iterate, energy);
            last_error = Some(error);
            enough(model, &Trial { closing: &closing, energy, error })
        };
        let failure = self.matrix.apply(|solver| solver.solve_until(r, x, &mut test))?.failure;
        Ok(failure.map_or(Ok(last_error), |reason| Err(Failure { body: None, reason })))
    }

    /// Bring the rigid parts around the matrix to its springs. Return why a solver gave up, if it did.
    fn update_parts(&mut self, model: &mut Model, springs: &[f64]) -> Result<Option<Failure>> {
        let known = self.parts_apart.take();
        self.parts_apart = match RigidParts::update(known, self, model, springs)? {
            Ok(parts) => parts,
            Err(failure) => return Ok(Some(failure)),
        };
        let is_free = self.parts_apart.as_ref().is_some_and(|parts| !parts.are_resisted());
        let reason = || "nothing resists a motion of a rigid part".to_owned();
        Ok(is_free.then(|| Failure { body: None, reason: reason() }))
    }

    /// Solve G x = r for the loads r of the local bodies, without rigid parts, until `enough` accepts an iterate.
    /// Collective.
    fn solve_around(
        &mut self,
        model: &Model,
        r: &[Vec<f64>],
        enough: &mut StoppingTest,
    ) -> Result<Solved<LinearSolution>> {
        let load = self.load(model, r);
        let mut x = vec![0.0; load.len()];
        let (last_error, failure) = match self.solve_matrix(model, &load, &mut x, enough)? {
            Ok(last_error) => (last_error, None),
            // other ranks may have solved the same system
            Err(failure) if self.is_redundant => (None, Some(failure)),
            Err(failure) => return Ok(Err(failure)),
        };
        let local = self.parts().zip(r).filter(|(_, r)| !r.is_empty());
        let energy = local.map(|(part, _)| dot(&x[part.clone()], &load[part])).sum::<f64>();
        let [displacements, apart] = self.displacements(&x, r);
        let (field, sums) =
            DisplacementField::of_step(model, displacements, &apart, &[energy, f64::from(u8::from(failure.is_some()))]);
        let (energy, failures) = (sums[0], sums[1]);
        if failures > 0.0 {
            let elsewhere = || "the matrix of all bodies cannot be factored on another rank".to_owned();
            return Ok(Err(failure.unwrap_or_else(|| Failure { body: None, reason: elsewhere() })));
        }
        let accuracy = self.matrix.solver().accuracy();
        let error = last_error.unwrap_or(accuracy * energy.max(0.0).sqrt());
        Ok(Ok(LinearSolution { field, energy, error, is_exact: accuracy == 0.0 }))
    }

    /// Return the range of each body in a vector of all bodies.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.offset.windows(2).map(|part| part[0]..part[1])
    }

    /// Return the place of each pin in a vector of all bodies.
    fn all_pins(&self) -> impl Iterator<Item = usize> + '_ {
        self.offset.iter().zip(&self.pins).flat_map(|(begin, pins)| pins.iter().map(move |pin| begin + pin))
    }

    /// Return a load of the local bodies on the unknowns of the matrix. Collective.
    fn load(&self, model: &Model, r: &[Vec<f64>]) -> Vec<f64> {
        let mut load = self.whole(r);
        for (body, (r, pins)) in r.iter().zip(&self.pins).enumerate() {
            let motions =
                model.bodies[body].local.as_ref().into_iter().flat_map(|body| &body.dofs().unconstrained_modes);
            pins.iter().zip(motions).for_each(|(pin, motion)| load[self.offset[body] + pin] = dot(motion, r));
        }
        if self.is_redundant {
            model.exchange.sum(&mut load);
        }
        load
    }

    /// Return v and the amounts a of each local body from the unknowns of the matrix, for its displacements v + E a.
    /// `like` has a vector of each local body.
    fn displacements(&self, x: &[f64], like: &[Vec<f64>]) -> [Vec<Vec<f64>>; 2] {
        let mut all = self.apart(x, like);
        let amounts = all.iter_mut().zip(&self.pins).map(|(u, pins)| {
            if u.is_empty() { Vec::new() } else { pins.iter().map(|&pin| std::mem::take(&mut u[pin])).collect() }
        });
        let amounts = amounts.collect();
        [all, amounts]
    }

    /// Return vectors of the local bodies as one vector; it is zero for bodies of other ranks.
    fn whole(&self, states: &[Vec<f64>]) -> Vec<f64> {
        let mut whole = vec![0.0; self.offset[self.offset.len() - 1]];
        for (part, state) in self.parts().zip(states).filter(|(part, state)| part.len() == state.len()) {
            whole[part].copy_from_slice(state);
        }
        whole
    }

    /// Return the vector of each local body from a vector of all bodies. `like` has a vector of each local body.
    fn apart(&self, x: &[f64], like: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of_body = |(part, like): (Range<usize>, &Vec<f64>)| match like.len() {
            // a body of another rank, or a rigid part
            count if count != part.len() => vec![0.0; count],
            _ => x[part].to_vec(),
        };
        self.parts().zip(like).map(of_body).collect()
    }
}

impl LinearStep for JointStep {
    fn name(&self) -> &'static str {
        "newton"
    }

    fn set_up(&mut self, springs: &[f64]) -> Result<()> {
        self.matrix.update(&self.rows, springs)?;
        self.matrix.set_up()
    }

    fn renew(&mut self, _model: &Model) {
        self.parts_apart = None;
    }

    fn count_on(&mut self, earlier: BodyCounts) {
        self.earlier = earlier;
    }

    fn begin_anew(&mut self) {
        self.earlier = BodyCounts::default();
        self.matrix.begin_anew();
    }

    fn multiply(&mut self, _model: &mut Model, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let x = self.whole(v);
        let mut y = vec![0.0; x.len()];
        self.matrix.multiply_stiffness(&self.rows, &x, &mut y);
        // the matrix has zeros in the rows and columns of pins
        let at_pins: Vec<f64> = self.all_pins().map(|pin| x[pin]).collect();
        self.pinned.add_transpose(1.0, &at_pins, &mut y);
        let mut products = vec![0.0; at_pins.len()];
        self.pinned.multiply(&x, &mut products);
        self.all_pins().zip(products).for_each(|(pin, product)| y[pin] = product);
        self.apart(&y, v)
    }

    fn solve(&mut self, system: System) -> Result<Solved<LinearSolution>> {
        let System { model, springs, residual, enough, .. } = system;
        self.matrix.update(&self.rows, springs)?;
        if let Some(failure) = self.update_parts(model, springs)? {
            return Ok(Err(failure));
        }
        let Some(parts) = self.parts_apart.take() else { return self.solve_around(model, residual, enough) };
        let works = parts.works(model, residual);
        let mut test = |model: &Model, trial: &Trial| {
            let (moved, mut closing) = (parts.moved(&works, trial.closing), trial.closing.to_vec());
            parts.close(&moved.amounts, &mut closing);
            let (energy, error) = (trial.energy + moved.energy, trial.error + moved.error);
            enough(model, &Trial { closing: &closing, energy, error })
        };
        let mut solved = self.solve_around(model, residual, &mut test)?;
        if let Ok(LinearSolution { field, energy, error, .. }) = &mut solved {
            let moved = parts.moved(&works, &field.closing());
            parts.add_to(&moved.amounts, field);
            (*energy, *error) = (*energy + moved.energy, *error + moved.error);
            self.parts_apart = Some(parts);
        }
        Ok(solved)
    }

    fn counts(&self) -> BodyCounts {
        let mut counts = self.matrix.counts();
        counts += self.earlier;
        counts
    }

    fn describe(&self) -> String {
        self.matrix.solver().describe()
    }
}

impl WithoutRigidParts for JointStep {
    fn is_apart(&self, _model: &Model, _body: usize) -> bool {
        true
    }

    fn closings(&self, _model: &Model, trace: &[f64]) -> Vec<f64> {
        closing(trace).collect()
    }

    fn solve_bodies(
        &mut self,
        model: &mut Model,
        force: &[f64],
        near: Option<DisplacementField>,
    ) -> Result<Solved<(DisplacementField, f64)>> {
        let mut x = near.unwrap_or_else(|| DisplacementField::zero(model));
        let mut rest = self.multiply(model, &x.displacements);
        rest.iter_mut().flatten().for_each(|r| *r = -*r);
        let held = x.closing().into_iter().zip(self.matrix.springs()).map(|(closing, spring)| closing * spring);
        let left: Vec<f64> = force.iter().zip(held).map(|(force, held)| force - held).collect();
        add_forces(model, &left, &mut rest);
        let known = dot(force, &x.closing());
        let mut enough = |_: &Model, trial: &Trial| trial.error <= ACCURACY * (known + trial.energy).sqrt();
        Ok(self.solve_around(model, &rest, &mut enough)?.map(|change| {
            x.add(1.0, &change.field);
            (x, change.error)
        }))
    }

    fn multiply_bodies(&mut self, model: &mut Model, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.multiply(model, v)
    }
}

/// Return B x at the points, n, and x'r, the squared energy norm of an iterate x. `x` and `r` have the rows of this
/// rank, from number `first` on. One message.
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

/// Return the matrix with all entries stored, row by row.
fn without_zeros(matrix: &Csr) -> Csr {
    let n = matrix.rows();
    let mut values = vec![0.0; n * n];
    for i in 0..n {
        matrix.row(i).for_each(|(j, value)| values[i * n + j] = value);
    }
    Csr::full(n, values)
}

/// The matrices of a body.
#[derive(Serialize, Deserialize)]
struct BodyMatrices {
    stiffness: Csr,
    /// B.
    rows: Csr,
    /// E, if amounts of motions are to stand in the place of pins.
    modes: Vec<Vec<f64>>,
}

/// Return the matrices of all bodies. `stiffness` has K of those of this rank that are not condensed. Bodies that are
/// not distributed go to all ranks, in one message.
fn matrices(model: &Model, mut stiffness: BTreeMap<usize, Csr>, of_nodes: bool) -> Result<Vec<BodyMatrices>> {
    let of_body = |(index, slot): (usize, &BodySlot)| {
        let body = slot.local.as_ref().filter(|_| !slot.is_rigid)?;
        let Dofs { count, rows, unconstrained_modes, .. } = body.dofs();
        let condensed = || Some(Csr::full(*count, body.condensed_stiffness().filter(|_| !of_nodes)?));
        let stiffness = stiffness.remove(&index).or_else(condensed)?;
        let modes = if of_nodes { Vec::new() } else { unconstrained_modes.clone() };
        Some(BodyMatrices { stiffness, rows: rows.clone(), modes })
    };
    let mine: Vec<Option<BodyMatrices>> = model.bodies.iter().enumerate().map(of_body).collect();
    let mut all = if of_nodes { vec![mine] } else { all_gather(&*model.exchange, mine) };
    let of = |(index, slot): (usize, &BodySlot)| {
        let rows = Csr::without_columns(slot.row_stiffness.len());
        let rigid = BodyMatrices { stiffness: Csr::new(0), rows, modes: Vec::new() };
        if slot.is_rigid { Some(rigid) } else { all.iter_mut().find_map(|of_rank| of_rank[index].take()) }
    };
    let missing = || Error::new(Kind::Solver, "a body has no matrices to be joined").help("choose newton-robin");
    model.bodies.iter().enumerate().map(of).collect::<Option<_>>().ok_or_else(missing)
}

/// The places of all bodies in one matrix.
struct Layout<'a> {
    model: &'a Model,
    parts: Vec<BodyMatrices>,
    /// How each body is distributed over the ranks, if it is.
    distributions: Vec<Option<&'a Distribution>>,
    /// First row of each body on this rank, and the number of rows of this rank.
    offset: Vec<usize>,
    /// Pins of each body.
    pins: Vec<Vec<usize>>,
    /// Number of the first row that this rank owns, if other ranks own the others.
    start: Option<usize>,
    /// Number of columns, which is that of the rows of all ranks.
    total: usize,
}

/// A contact row of a body.
#[derive(Clone, Copy)]
struct BodyRow {
    body: usize,
    row: usize,
}

impl<'a> Layout<'a> {
    fn new(model: &'a Model, parts: Vec<BodyMatrices>) -> Self {
        let distribution = |slot: &'a BodySlot| slot.distribution();
        let distributions: Vec<_> = model.bodies.iter().map(distribution).collect();
        let mut offset = vec![0];
        for part in &parts {
            offset.push(offset[offset.len() - 1] + part.stiffness.rows());
        }
        let shared = distributions.iter().copied().flatten().next();
        let total = shared.map_or(offset[parts.len()], |shared| shared.total);
        let pins = parts.iter().map(|part| pins(&part.modes)).collect();
        Self { model, parts, distributions, offset, pins, start: shared.map(|shared| shared.start), total }
    }

    /// Return B of all bodies together, and the columns, sorted, that its products couple in the rows of this rank, by
    /// the number of the row there.
    fn contact_rows(&self) -> (Csr, HashMap<usize, Vec<i32>>) {
        let first = self.start.unwrap_or(0);
        let owned = first..first + self.offset[self.parts.len()];
        let (mut rows, mut coupled) = (Csr::new(self.total), HashMap::<usize, Vec<i32>>::new());
        for sides in self.rows_of_points() {
            let mut entries: Vec<(usize, f64)> = sides.iter().flat_map(|&side| self.entries(side)).collect();
            if sides[0].body == sides[1].body {
                merge(&mut entries);
            }
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

    /// Return the rows of the bodies and rigid parts for each contact point, that of side a first.
    fn rows_of_points(&self) -> Vec<Vec<BodyRow>> {
        let points = self.model.points();
        let mut sides = [vec![Vec::new(); points], vec![Vec::new(); points]];
        for body in 0..self.parts.len() {
            for (row, place) in self.model.trace_ranges(body).flatten().enumerate() {
                sides[place / points][place % points].push(BodyRow { body, row });
            }
        }
        let [a, b] = sides;
        a.into_iter().zip(b).map(|(a, b)| [a, b].concat()).collect()
    }

    /// Return the entries (column of the whole matrix, value) of a contact row.
    fn entries(&self, BodyRow { body, row }: BodyRow) -> Vec<(usize, f64)> {
        if let Some(distribution) = self.distributions[body] {
            return distribution.rows.row(row).collect();
        }
        let (offset, pins) = (self.offset[body], &self.pins[body]);
        let rows = self.parts[body].rows.row(row).filter(|(i, _)| !pins.contains(i));
        let closings = self.model.bodies[body].motions.iter().map(|motion| motion.trace[row]);
        let mut entries: Vec<(usize, f64)> = rows.chain(pins.iter().copied().zip(closings)).collect();
        entries.sort_unstable_by_key(|entry| entry.0);
        entries.into_iter().map(|(i, value)| (offset + i, value)).collect()
    }

    /// Return K of all bodies, in the rows of this rank, with zeros at the `coupled` columns that K does not have, and
    /// in the rows and columns of pins; and the rows of K of the pins.
    fn stiffness(self, mut coupled: HashMap<usize, Vec<i32>>) -> Result<(Csr, Csr)> {
        let Self { parts, offset, pins, start, total, .. } = self;
        let stored: usize = parts.iter().map(|part| part.stiffness.values.len()).sum();
        let room = stored + coupled.values().map(Vec::len).sum::<usize>();
        countable("the matrix of all bodies together", room)?;
        let mut stiffness = Csr { columns: total, ptr: vec![0], ..Csr::default() };
        stiffness.ptr.reserve_exact(offset[parts.len()]);
        stiffness.col.reserve_exact(room);
        stiffness.values.reserve_exact(room);
        let mut pinned = Csr::new(offset[parts.len()]);
        // K of a body is freed before the next one is copied
        for ((begin, BodyMatrices { stiffness: own, .. }), pins) in offset.into_iter().zip(parts).zip(&pins) {
            let is_pin = |i: usize| pins.contains(&i);
            // K of a distributed body has the columns of the whole matrix already
            let shift = if start.is_some() { 0 } else { begin as i32 };
            for i in 0..own.rows() {
                let mut columns = coupled.remove(&(begin + i)).unwrap_or_default();
                if is_pin(i) && columns.is_empty() {
                    // a motion that no contact row sees has only its diagonal
                    columns.push((begin + i) as i32);
                }
                let known = own.range(i).filter(|&k| !is_pin(i) && !is_pin(own.col[k] as usize));
                push_merged(&mut stiffness, known.map(|k| (shift + own.col[k], own.values[k])), &columns);
            }
            pins.iter().for_each(|&pin| pinned.push_row(own.row(pin).map(|(j, k)| (begin + j, k))));
        }
        stiffness.col.shrink_to_fit();
        stiffness.values.shrink_to_fit();
        Ok((stiffness, pinned))
    }
}

/// Add entries of the same column, where one body is at both sides of a point.
fn merge(entries: &mut Vec<(usize, f64)>) {
    entries.sort_by_key(|entry| entry.0);
    entries.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        kept.1 += if is_same { next.1 } else { 0.0 };
        is_same
    });
}

/// Append a row with the entries (column, value) `known` and with zeros at the other ones of `columns`. Both are sorted
/// by column.
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
