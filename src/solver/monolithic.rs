//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one.
//!
//! With whole bodies it is the reference for methods that decompose: same functional, one big sparse factorisation. With
//! condensed bodies it is small and dense, and cheaper than the sweeps that it saves. Of bodies that are dealt out over ranks each
//! rank has its rows; of bodies that live whole on several ranks, condensed ones, every rank has the matrix and solves for itself.

use super::{InnerSolver, Krylov, RigidSpace, RobinMatrix};
use crate::error::Result;
use crate::exchange::share;
use crate::linalg::{Csr, axpy, countable, dot};
use crate::model::linear::{Failure, LinearStep, Solution, Solved, System, Trial};
use crate::model::{Body, BodyCounts, BodySlot, Field, Joint, Matrices, Model};
use crate::petsc::{Iterate, Rows};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

/// Stiffness matrices side by side and the rows that couple them, on the states of the bodies.
///
/// A state is (v, a) for v + R a, K meets v alone, and B v + B R a is what contact feels. So a rigid motion, however large,
/// leaves no rounding in the strains. v + R a is not unique: as many springs as R has columns, each under one dof of v, make
/// it so. They carry no force, since the rows for a say that all forces are balanced without them.
pub struct Union {
    /// Stiffness matrix of all bodies with these springs, with the pattern of B'B: the rows of this rank.
    pub stiffness: Csr,
    /// One row a contact point, [B_a B_a R_a B_b B_b R_b]: all of them.
    pub rows: Csr,
    /// First entry here of each body's state, and the number of all.
    pub offset: Vec<usize>,
    /// Number of the first row here, if other ranks have the others; columns are counted through all.
    start: Option<usize>,
    /// b diag(K) b' of each row b.
    row_stiffness: Vec<f64>,
    /// Rigid motions, if the rows of nodes leave them in v.
    coarse: Option<RigidSpace>,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
}

impl Union {
    /// Of the bodies of a model, which keep what they have. `None` if one has no matrices. Collective.
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

    /// Of the nodes of bodies, which give their K away; rigid motions stay part of v. Multigrid wants to see nodes only, and bodies that
    /// are dealt out have nothing else. `None` if a body needs its K.
    ///
    /// # Errors
    /// More entries than 32 bits can count.
    pub fn of_nodes(model: &mut Model) -> Result<Option<Self>> {
        let give = |slot: &mut BodySlot| slot.local.as_mut().and_then(|body| body.give_stiffness());
        let given = model.bodies.iter_mut().map(give).collect::<Option<Vec<Csr>>>();
        let Some(given) = given else { return Ok(None) };
        let parts = given.iter().zip(matrices(model)).map(|(stiffness, rest)| {
            let Matrices { rows, .. } = rest?;
            Some(Matrices { stiffness, rows, motions: &[], traces: &[] })
        });
        let parts = parts.collect::<Option<Vec<_>>>();
        let Some(parts) = parts else { return Ok(None) };
        let union = Self::new(model, &parts)?;
        let coarse = RigidSpace::of(model, &union.offset, &union.rows, union.start.unwrap_or(0));
        Ok(Some(Self { coarse, ..union }))
    }

    fn new(model: &Model, parts: &[Matrices]) -> Result<Self> {
        let bodies: Vec<Option<&dyn Body>> = model.bodies.iter().map(|slot| slot.local.as_deref()).collect();
        let distribution = |body: usize| bodies[body].and_then(|body| body.distribution());
        let shared = (0..parts.len()).find_map(distribution);
        let mut offset = vec![0];
        for part in parts {
            offset.push(offset[offset.len() - 1] + part.len());
        }
        let n = offset[parts.len()];
        let start = shared.map(|shared| shared.start);
        let (first, total) = (start.unwrap_or(0), shared.map_or(n, |shared| shared.total));
        // the two rows of each contact point as (body, row of the body)
        let mut points = vec![[(0, 0); 2]; model.points()];
        for body in 0..parts.len() {
            for (row, place) in model.trace_ranges(body).flatten().enumerate() {
                points[place % model.points()][place / model.points()] = (body, row);
            }
        }
        let mut rows = Csr::new(total);
        // columns that are to be there in a row, besides those of K
        let mut coupled: HashMap<usize, Vec<i32>> = HashMap::new();
        for sides in &points {
            let mut entries = Vec::new();
            for &(body, row) in sides {
                let part = &parts[body];
                match distribution(body) {
                    Some(distribution) => entries.extend(distribution.rows.row(row)),
                    None => {
                        let rigid = part.traces.iter().enumerate().map(|(k, t)| (part.stiffness.rows() + k, t[row]));
                        entries.extend(part.rows.row(row).chain(rigid).map(|(i, value)| (offset[body] + i, value)));
                    }
                }
            }
            for &(i, _) in entries.iter().filter(|entry| (first..first + n).contains(&entry.0)) {
                coupled.entry(i - first).or_default().extend(entries.iter().map(|&(j, _)| j as i32));
            }
            rows.push_row(entries);
        }
        for columns in coupled.values_mut() {
            columns.sort_unstable();
            columns.dedup();
        }
        let known: usize = parts.iter().map(|part| part.stiffness.values.len()).sum();
        let room = known + coupled.values().map(Vec::len).sum::<usize>();
        countable("the matrix of all bodies together", room)?;
        let mut stiffness = Csr { columns: total, ptr: vec![0], ..Csr::default() };
        stiffness.ptr.reserve_exact(n);
        stiffness.col.reserve_exact(room);
        stiffness.values.reserve_exact(room);
        for (body, (&begin, part)) in offset.iter().zip(parts).enumerate() {
            let (own, pins) = (part.stiffness, pins(part.motions));
            // K of a body that is dealt out has the columns of the whole
            let shift = if shared.is_some() { 0 } else { begin as i32 };
            for i in 0..part.len() {
                let known = if i < own.rows() { own.range(i) } else { 0..0 };
                let known = own.col[known.clone()].iter().map(|j| shift + j).zip(&own.values[known]);
                let mut known = known.peekable();
                // a rigid motion that no contact row feels has nothing but its diagonal
                let (coupled, diagonal) = (coupled.remove(&(begin + i)), [(begin + i) as i32]);
                for &j in coupled.as_deref().unwrap_or(if i < own.rows() { &[] } else { &diagonal }) {
                    while let Some((before, value)) = known.next_if(|entry| entry.0 < j) {
                        stiffness.col.push(before);
                        stiffness.values.push(*value);
                    }
                    stiffness.col.push(j);
                    stiffness.values.push(known.next_if(|entry| entry.0 == j).map_or(0.0, |entry| *entry.1));
                }
                for (j, value) in known {
                    stiffness.col.push(j);
                    stiffness.values.push(*value);
                }
                stiffness.ptr.push(stiffness.col.len() as i32);
            }
            for pin in pins.into_iter().map(|pin| begin + pin) {
                // of the size that the stiffness had before elimination: what is left of it may be nothing but rounding
                match stiffness.position(pin, pin) {
                    Some(at) => stiffness.values[at] += model.bodies[body].scale,
                    None => unreachable!("a stiffness matrix has its diagonal"),
                }
            }
        }
        stiffness.col.shrink_to_fit();
        stiffness.values.shrink_to_fit();
        let (sides, points) = (model.row_stiffness(), model.points());
        let row_stiffness = (0..points).map(|q| sides[q] + sides[points + q]).collect();
        Ok(Self { stiffness, rows, offset, start, row_stiffness, coarse: None, is_redundant: false })
    }

    /// The same with all entries of K stored, row by row.
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

/// All bodies as one.
pub struct Monolithic<S> {
    joined: Rc<RefCell<Joined<S>>>,
    /// Whether every rank has the whole matrix and some of the bodies.
    is_redundant: bool,
}

/// The matrix of all bodies.
struct Joined<S> {
    matrix: RobinMatrix<S>,
    rows: Csr,
    offset: Vec<usize>,
    /// Number of the first row here.
    first: usize,
}

impl<S> Joined<S> {
    /// Where each body's state is in that of all.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.offset.windows(2).map(|part| part[0]..part[1])
    }

    /// The states of all bodies as one, without rigid motions that it does not have; zero for bodies of other ranks.
    fn whole(&self, states: &[Vec<f64>]) -> Vec<f64> {
        let mut whole = vec![0.0; self.offset[self.offset.len() - 1]];
        for (part, state) in self.parts().zip(states).filter(|(_, state)| !state.is_empty()) {
            whole[part.clone()].copy_from_slice(&state[..part.len()]);
        }
        whole
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
    /// The joined bodies, with the solver that `make` makes of their K.
    pub fn new(union: Union, make: impl FnOnce(Rows) -> Result<S>) -> Result<Self> {
        let Union { stiffness, rows, offset, start, row_stiffness, coarse, is_redundant } = union;
        let matrix = RobinMatrix::new(super::rows(stiffness, start)?, &rows, row_stiffness, make)?.with_coarse(coarse);
        Ok(Self {
            joined: Rc::new(RefCell::new(Joined { matrix, rows, offset, first: start.unwrap_or(0) })),
            is_redundant,
        })
    }
}

impl Monolithic<Krylov> {
    /// K of all bodies, for a model whose bodies gave theirs away.
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
        let mut whole = joined.whole(residual);
        if self.is_redundant {
            model.exchange.sum(&mut whole);
        }
        let mut x = vec![0.0; whole.len()];
        let Joined { matrix, rows, first, .. } = joined;
        matrix.update(rows, springs)?;
        let points = model.points();
        let mut left = None;
        let mut enough = |iterate: &Iterate| {
            // one message: B x of the rows here, then the energy
            let here =
                |q: usize| rows.row(q).filter_map(|(i, b)| Some(b * iterate.x.get(i.checked_sub(*first)?)?)).sum();
            let mut closing: Vec<f64> = (0..points).map(here).collect();
            closing.push(dot(iterate.x, &whole));
            model.exchange.sum(&mut closing);
            let energy = closing.pop().unwrap_or_default().max(0.0);
            let error = match iterate.least {
                // r'A^-1 r is at most r'M^-1 r over the least eigenvalue of M^-1 A
                Some(least) => iterate.residual / least.sqrt(),
                None => iterate.residual / iterate.first * energy.sqrt(),
            };
            left = Some(error);
            enough(model, &Trial { closing: &closing, energy, error })
        };
        let failure = matrix.apply(|solver| solver.solve_until(&whole, &mut x, &mut enough))?.failure;
        if let (false, Some(reason)) = (self.is_redundant, &failure) {
            return Ok(Err(Failure { body: None, reason: reason.clone() }));
        }
        let state = |(slot, part): (&BodySlot, Range<usize>)| {
            let Some(body) = &slot.local else { return Vec::new() };
            let mut state = x[part].to_vec();
            state.resize(body.len(), 0.0);
            body.separate(&mut state);
            state
        };
        let states: Vec<Vec<f64>> = model.bodies.iter().zip(joined.parts()).map(state).collect();
        let energy: f64 = states.iter().zip(residual).map(|(x, r)| dot(x, r)).sum();
        let mut field = Field { states, trace: vec![0.0; 2 * model.points()] };
        // one message: traces, then the energy, then whether a rank has failed, each in the rounding of its processor
        field.trace_here(model);
        field.trace.extend([energy, f64::from(u8::from(failure.is_some()))]);
        model.exchange.sum(&mut field.trace);
        let failures = field.trace.pop().unwrap_or_default();
        let energy = field.trace.pop().unwrap_or_default();
        if failures > 0.0 {
            let reason =
                failure.unwrap_or_else(|| "the matrix of all bodies cannot be factored on another rank".to_owned());
            return Ok(Err(Failure { body: None, reason }));
        }
        let accuracy = joined.matrix.solver().accuracy();
        let error = left.unwrap_or(accuracy * energy.max(0.0).sqrt());
        Ok(Ok(Solution { field, energy, error, is_exact: accuracy == 0.0 }))
    }

    fn counts(&self) -> BodyCounts {
        self.joined.borrow().matrix.counts()
    }

    fn describe(&self) -> String {
        self.joined.borrow().matrix.solver().describe()
    }
}

/// The matrices of a condensed body as every rank gets them: K without its values, which go apart.
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

/// Matrices of the bodies that are here.
fn matrices(model: &Model) -> impl Iterator<Item = Option<Matrices<'_>>> {
    model.bodies.iter().map(|slot| slot.local.as_ref().and_then(|body| body.matrices()))
}

/// Gives every rank the matrices of all bodies, each of which lives on one; one message. `None` if a body has none.
fn gather(model: &Model) -> Option<Vec<Gathered>> {
    let here = matrices(model).map(|matrices| {
        let Matrices { stiffness, rows, motions, traces } = matrices?;
        let (motions, traces) = (motions.to_vec(), traces.to_vec());
        Some(Gathered { stiffness: stiffness.clone(), rows: rows.clone(), motions, traces })
    });
    let mut all = share(&*model.exchange, here.collect::<Vec<_>>());
    let of = |body: usize| all.iter_mut().find_map(|of_rank| of_rank.get_mut(body)?.take());
    (0..model.bodies.len()).map(of).collect()
}

/// As many dofs as there are motions such that no combination of these leaves them all at rest: the pivots of an elimination.
fn pins(motions: &[Rc<[f64]>]) -> Vec<usize> {
    let mut left: Vec<Vec<f64>> = motions.iter().map(|motion| motion.to_vec()).collect();
    let mut pins = Vec::new();
    while let Some(mut motion) = left.pop() {
        let largest =
            |motion: &Vec<f64>| (0..motion.len()).max_by(|&i, &j| motion[i].abs().total_cmp(&motion[j].abs()));
        let Some(pin) = largest(&motion) else { break };
        let pivot = motion[pin];
        motion.iter_mut().for_each(|u| *u /= pivot);
        left.iter_mut().for_each(|other| axpy(-other[pin], &motion, other));
        pins.push(pin);
    }
    pins
}
