//! Moving obstacles in the sweep: an obstacle has no stiffness, so that its motions are unknowns of the body before it.
//!
//! By itself, an obstacle would follow the body only as far as the layer gives way: where the body has the stiffness k
//! and the layer kappa, an error falls by the factor 1 - gamma k/(2 kappa) in a sweep. Together they have the system
//!
//! ```text
//! G   z + B'W N a = r             W = omega psi kappa at the points,  N: their closings by the motions
//! N'W B z + N'W N a = s
//! ```
//!
//! which is solved by z = G^-1 r - X a and a = S^-1 (s - X'r), with the columns X = G^-1 B'W N and the stiffness S of
//! the motions (-X, 1).

use crate::error::Result;
use crate::linalg::dot;
use crate::model::field::{Field, local_dot};
use crate::model::linear::Failure;
use crate::model::rigid::Motions;
use crate::model::{Model, field::add_forces};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A motion of an obstacle.
#[derive(Debug, Clone, Copy)]
struct ObstacleMotion {
    /// Number of the obstacle.
    obstacle: usize,
    /// Number of the motion among those of the obstacle.
    motion: usize,
    pair: usize,
}

/// Return whether a rigid part is an obstacle, the only partner of the body before it.
pub(super) fn is_obstacle(model: &Model, body: usize) -> bool {
    let slot = &model.bodies[body];
    slot.is_rigid && slot.segments.iter().any(|segment| model.pairs[segment.pair].bodies[1] == body)
}

fn motions(model: &Model) -> Vec<ObstacleMotion> {
    let obstacles = (0..model.bodies.len()).filter(|&body| is_obstacle(model, body));
    let of = |obstacle: usize| {
        let slot = &model.bodies[obstacle];
        (0..slot.motions.len()).map(move |motion| ObstacleMotion { obstacle, motion, pair: slot.segments[0].pair })
    };
    obstacles.flat_map(of).collect()
}

/// Give both sides of a pair with an obstacle the larger of their weights (2n): they have one system.
pub(super) fn join(model: &Model, weight: &mut [f64]) {
    let points = model.points();
    let pairs = (0..model.pairs.len()).filter(|&pair| is_obstacle(model, model.pairs[pair].bodies[1]));
    for q in pairs.flat_map(|pair| model.range(pair)) {
        let larger = weight[q].max(weight[points + q]);
        (weight[q], weight[points + q]) = (larger, larger);
    }
}

/// Solves G_s z_s = r_s in every body but obstacles, with the Robin term that the model carries.
pub(super) type SolveBodies<'a> =
    dyn FnMut(&mut Model, Vec<Vec<f64>>) -> Result<std::result::Result<Field, Failure>> + 'a;

/// The motions of all obstacles with the bodies that follow them, for one Robin term.
#[derive(Debug, Clone)]
pub(super) struct Obstacles {
    /// The Robin term, 2n.
    weight: Vec<f64>,
    /// (-X, 1) of each motion.
    columns: Vec<Field>,
    /// S.
    stiffness: Cholesky<f64, Dyn>,
}

impl Obstacles {
    /// Return the motions of the obstacles for the Robin term that the model carries; none if no obstacle moves, or if
    /// `known` is of that term. Each costs a solve in every body. Collective.
    pub fn update(
        known: Option<Self>,
        solve: &mut SolveBodies,
        model: &mut Model,
    ) -> Result<std::result::Result<Option<Self>, Failure>> {
        let motions = motions(model);
        if motions.is_empty() || known.as_ref().is_some_and(|known| known.weight == model.robin) {
            return Ok(Ok(known));
        }
        let mut columns = Vec::new();
        for motion in &motions {
            match Self::column(*motion, solve, model)? {
                Ok(column) => columns.push(column),
                Err(failure) => return Ok(Err(failure)),
            }
        }
        let mut stiffness = Self::stiffness(model, &columns).cholesky();
        if stiffness.is_none() {
            // an obstacle and the body before it are free together: each by itself is held by the other
            columns = motions.iter().map(|motion| motion.alone(model)).collect();
            stiffness = Self::stiffness(model, &columns).cholesky();
        }
        let weight = model.robin.clone();
        Ok(Ok(stiffness.map(|stiffness| Self { weight, columns, stiffness })))
    }

    /// Return (-X, 1) of a motion.
    fn column(
        motion: ObstacleMotion,
        solve: &mut SolveBodies,
        model: &mut Model,
    ) -> Result<std::result::Result<Field, Failure>> {
        let (alone, range) = (motion.alone(model), model.range(motion.pair));
        let mut force = vec![0.0; model.points()];
        let trace = &alone.trace[model.points()..];
        range.for_each(|q| force[q] = -model.robin[q] * trace[q]);
        let mut residual = Field::zero(model).displacements;
        add_forces(model, &force, &mut residual);
        Ok(solve(model, residual)?.map(|mut column| {
            column.add(1.0, &alone);
            column
        }))
    }

    /// Return S: twice the energies of bodies and springs. One message.
    fn stiffness(model: &mut Model, columns: &[Field]) -> DMatrix<f64> {
        let count = columns.len();
        let products: Vec<_> = columns.iter().map(|column| model.multiply(&column.displacements)).collect();
        let mut strain = DMatrix::from_fn(count, count, |i, j| local_dot(&columns[i].displacements, &products[j]));
        model.exchange.sum(strain.as_mut_slice());
        let rows: Vec<Vec<f64>> = columns.iter().map(|column| joint_rows(model, &column.trace)).collect();
        let forces: Vec<Vec<f64>> =
            rows.iter().map(|rows| rows.iter().zip(&model.robin).map(|(s, w)| s * w).collect()).collect();
        let all = strain + DMatrix::from_fn(count, count, |i, j| dot(&rows[i], &forces[j]));
        // rounding makes it asymmetric
        0.5 * (&all + all.transpose())
    }

    /// Return the amounts a of the motions for these works.
    pub fn amounts(&self, works: &DVector<f64>) -> DVector<f64> {
        self.stiffness.solve(works)
    }

    /// Return the works s - X'r of a residual on the motions. Two messages.
    pub fn works(&self, model: &Model, residual: &[Vec<f64>]) -> DVector<f64> {
        let mut works: Vec<f64> =
            self.columns.iter().map(|column| local_dot(&column.displacements, residual)).collect();
        model.exchange.sum(&mut works);
        let on_motions = Motions::of(model).work_of(model, residual);
        let rigid = self.columns.iter().map(|column| dot(&column.rigid.concat(), on_motions.as_slice()));
        DVector::from_iterator(works.len(), works.iter().zip(rigid).map(|(work, rigid)| work + rigid))
    }

    /// Add the motions by these amounts to a correction.
    pub fn add_to(&self, amounts: &DVector<f64>, correction: &mut Field) {
        self.columns.iter().zip(amounts.iter()).for_each(|(column, &a)| correction.add(a, column));
    }
}

impl ObstacleMotion {
    /// Return the motion alone.
    fn alone(&self, model: &Model) -> Field {
        let (slot, mut field) = (&model.bodies[self.obstacle], Field::zero(model));
        field.rigid[self.obstacle][self.motion] = 1.0;
        model.put(self.obstacle, &slot.motions[self.motion].trace, &mut field.trace);
        field
    }
}

/// Return the closings of the contact rows (2n) as the bodies before obstacles have them: with those of the obstacles.
fn joint_rows(model: &Model, trace: &[f64]) -> Vec<f64> {
    let (points, mut rows) = (model.points(), trace.to_vec());
    let pairs = (0..model.pairs.len()).filter(|&pair| is_obstacle(model, model.pairs[pair].bodies[1]));
    for q in pairs.flat_map(|pair| model.range(pair)) {
        rows[q] += std::mem::take(&mut rows[points + q]);
    }
    rows
}
