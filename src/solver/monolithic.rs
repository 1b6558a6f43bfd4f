//! The Newton matrix (35) of all bodies together: K + B' diag(omega kappa) B with B = [B_a B_b], factored as one.
//!
//! With whole bodies it is the reference for methods that decompose: same functional, one big sparse factorisation. With
//! condensed bodies it is small and dense, and cheaper than the sweeps that it saves. One rank.

use super::{InnerSolver, RobinMatrix};
use crate::error::Result;
use crate::linalg::{Csr, axpy, countable, dot};
use crate::model::linear::{Failure, LinearStep, Solution, Solved, System};
use crate::model::{BodyCounts, Field, Model};
use std::collections::HashMap;

/// Stiffness matrices side by side and the rows that couple them, on the states of the bodies.
///
/// A state is (v, a) for v + R a, K meets v alone, and B v + B R a is what contact feels. So a rigid motion, however large,
/// leaves no rounding in the strains. v + R a is not unique: as many springs as R has columns, each under one dof of v, make
/// it so. They carry no force, since the rows for a say that all forces are balanced without them.
pub struct Union {
    /// Stiffness matrix of all bodies with these springs, with the pattern of B'B.
    pub stiffness: Csr,
    /// One row a contact point: [B_a B_a R_a B_b B_b R_b].
    pub rows: Csr,
    /// First entry of each body's state, and the number of all.
    pub offset: Vec<usize>,
}

impl Union {
    /// Of the bodies of a model; `None` if one of them has no matrices in this process. Without `rigid` the rigid motions stay
    /// part of v: multigrid wants to see nodes only.
    ///
    /// # Errors
    /// More entries than 32 bits can count.
    pub fn of(model: &Model, rigid: bool) -> Result<Option<Self>> {
        let parts = model.bodies.iter().map(|slot| slot.local.as_ref()?.matrices());
        let Some(mut parts) = parts.collect::<Option<Vec<_>>>() else { return Ok(None) };
        if !rigid {
            parts.iter_mut().for_each(|part| (part.motions, part.traces) = (&[], &[]));
        }
        let mut offset = vec![0];
        for part in &parts {
            offset.push(offset[offset.len() - 1] + part.len());
        }
        let n = offset[parts.len()];
        // the two rows of each contact point as (body, row of the body)
        let mut points = vec![[(0, 0); 2]; model.points()];
        for body in 0..parts.len() {
            for (row, place) in model.trace_ranges(body).flatten().enumerate() {
                points[place % model.points()][place / model.points()] = (body, row);
            }
        }
        let mut rows = Csr::new(n);
        // columns that are to be there in a row, besides those of K
        let mut coupled: HashMap<usize, Vec<i32>> = HashMap::new();
        for sides in &points {
            let mut entries = Vec::new();
            for &(body, row) in sides {
                let part = &parts[body];
                let rigid = part.traces.iter().enumerate().map(|(k, trace)| (part.stiffness.rows() + k, trace[row]));
                entries.extend(part.rows.row(row).chain(rigid).map(|(i, value)| (offset[body] + i, value)));
            }
            for &(i, _) in &entries {
                coupled.entry(i).or_default().extend(entries.iter().map(|&(j, _)| j as i32));
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
        let mut stiffness = Csr { columns: n, ptr: vec![0], ..Csr::default() };
        stiffness.ptr.reserve_exact(n);
        stiffness.col.reserve_exact(room);
        stiffness.values.reserve_exact(room);
        for ((&first, part), slot) in offset.iter().zip(&parts).zip(&model.bodies) {
            let (own, pins) = (part.stiffness, pins(part.motions));
            for i in 0..part.len() {
                let known = if i < own.rows() { own.range(i) } else { 0..0 };
                let known = own.col[known.clone()].iter().map(|j| first as i32 + j).zip(&own.values[known]);
                let mut known = known.peekable();
                // a rigid motion that no contact row feels has nothing but its diagonal
                let (coupled, diagonal) = (coupled.remove(&(first + i)), [(first + i) as i32]);
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
            for pin in pins.into_iter().map(|pin| first + pin) {
                // of the size that the stiffness had before elimination: what is left of it may be nothing but rounding
                match stiffness.position(pin, pin) {
                    Some(at) => stiffness.values[at] += slot.scale,
                    None => unreachable!("a stiffness matrix has its diagonal"),
                }
            }
        }
        stiffness.col.shrink_to_fit();
        stiffness.values.shrink_to_fit();
        Ok(Some(Self { stiffness, rows, offset }))
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
    matrix: RobinMatrix<S>,
    rows: Csr,
    offset: Vec<usize>,
}

impl<S: InnerSolver> Monolithic<S> {
    /// The joined bodies, with the solver that `make` makes of their K.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn new(union: Union, make: impl FnOnce(Csr) -> Result<S>) -> Result<Self> {
        let Union { stiffness, rows, offset } = union;
        Ok(Self { matrix: RobinMatrix::new(stiffness, &rows, make)?, rows, offset })
    }
}

impl<S: InnerSolver> LinearStep for Monolithic<S> {
    fn name(&self) -> &'static str {
        "newton"
    }

    fn set_up(&mut self, springs: &[f64]) -> Result<()> {
        self.matrix.update(&self.rows, springs)?;
        self.matrix.set_up()
    }

    fn solve(&mut self, system: System) -> Result<Solved> {
        let System { model, springs, residual, reduction, .. } = system;
        self.matrix.solver_mut().precision(reduction)?;
        self.matrix.update(&self.rows, springs)?;
        let parts = || self.offset.windows(2).map(|part| part[0]..part[1]);
        let whole: Vec<f64> = parts().zip(residual).flat_map(|(part, r)| &r[..part.len()]).copied().collect();
        let mut x = vec![0.0; whole.len()];
        if let Some(reason) = self.matrix.apply(|solver| solver.solve(&whole, &mut x))?.failure {
            return Ok(Err(Failure { body: None, reason }));
        }
        let mut states: Vec<Vec<f64>> = parts().map(|part| x[part].to_vec()).collect();
        for (slot, state) in model.bodies.iter().zip(&mut states) {
            if let Some(body) = &slot.local {
                state.resize(body.len(), 0.0);
                body.separate(state);
            }
        }
        let energy: f64 = states.iter().zip(residual).map(|(x, r)| dot(x, r)).sum();
        let mut field = Field { states, trace: vec![0.0; 2 * model.points()] };
        field.retrace(model);
        let accuracy = self.matrix.solver().accuracy();
        Ok(Ok(Solution { field, energy, error: accuracy * energy.max(0.0).sqrt(), is_exact: accuracy == 0.0 }))
    }

    fn counts(&self) -> BodyCounts {
        self.matrix.counts()
    }

    fn describe(&self) -> String {
        self.matrix.solver().describe()
    }
}

/// As many dofs as there are motions such that no combination of these leaves them all at rest: the pivots of an elimination.
fn pins(motions: &[Vec<f64>]) -> Vec<usize> {
    let mut left = motions.to_vec();
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
