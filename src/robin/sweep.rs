//! One sweep (41): every body solves its own linear problem, independently of the others. A sweep needs the Robin
//! coefficient, and a start, which is a trace extended into every body.

use crate::error::{Error, Result};
use crate::exchange::{self, ASKS, asks};
use crate::linalg::{Blocks, axpy, dot};
use crate::model::body::Energy;
use crate::model::field::{DisplacementField, add_forces, residual};
use crate::model::layer::Layer;
use crate::model::linear::{Failure, Solved};
use crate::model::motions::{self, NamedMotion, TOLERANCE, combined};
use crate::model::rigid_parts::{RigidParts, WithoutRigidParts};
use crate::model::{Model, closing};
use crate::problem::method::{RobinRule, Zone};
use nalgebra::DMatrix;

/// Result of a sweep at an iterate: G z = r in every body. Numbers are sums over all bodies and ranks.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// r of each body that lives on this rank.
    pub residual: Vec<Vec<f64>>,
    /// z.
    pub correction: DisplacementField,
    /// r'z = r'G^-1 r.
    pub decrement: f64,
    /// u'Ku of the iterate.
    pub strain: f64,
    /// u'Ku/2 - f'u of the iterate.
    pub potential: f64,
    /// y'z for another residual y, if one was given.
    pub product: f64,
    /// Numeric factorisations so far.
    pub factorizations: usize,
    /// Krylov iterations so far.
    pub inner_iterations: usize,
    /// The first body whose inner solver failed, with the reason if this rank knows it.
    pub failed: Option<Failure>,
    /// Requests from outside, of all ranks (see [`exchange::asked`]).
    pub asked: u8,
}

/// Makes sweeps, and counts them.
#[derive(Debug, Default, Clone)]
pub struct Sweeper {
    /// Sweeps made.
    pub sweeps: usize,
    /// The motions of obstacles, with the bodies that follow them, for the last Robin term.
    obstacles: Option<RigidParts>,
}

impl Sweeper {
    /// Solve G_s z_s = r_s in every body at `iterate` with its `layer`, with the Robin term that the model carries. The
    /// requests `asked` of this rank go with the message.
    pub fn sweep(&mut self, model: &mut Model, iterate: &DisplacementField, layer: &Layer, asked: u8) -> Result<Sweep> {
        let products = model.multiply(&iterate.displacements);
        let (residual, energy) = residual(model, products, iterate, &layer.force);
        let sweep = self.solve(model, residual, energy, None, asked)?;
        self.with_obstacles(model, sweep, None)
    }

    /// Apply G^-1 to any residual as a preconditioner; the result keeps the residual. `product` of the result is
    /// `other`'z.
    pub fn precondition(&mut self, model: &mut Model, residual: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Result<Sweep> {
        let sweep = self.solve(model, residual, Energy::default(), Some(other), 0)?;
        self.with_obstacles(model, sweep, Some(other))
    }

    /// Add the part of a correction by which obstacles move, and bodies follow them.
    ///
    /// By itself, an obstacle would follow the body only as far as the layer gives way: where the body has the
    /// stiffness k and the layer kappa, an error falls by the factor 1 - gamma k/(2 kappa) in a sweep.
    fn with_obstacles(&mut self, model: &mut Model, mut sweep: Sweep, other: Option<&[Vec<f64>]>) -> Result<Sweep> {
        let (known, weight) = (self.obstacles.take(), model.robin.clone());
        match RigidParts::update(known, self, model, &weight)? {
            Ok(obstacles) => self.obstacles = obstacles,
            Err(failure) => sweep.failed = Some(sweep.failed.unwrap_or(failure)),
        }
        let Some(mut obstacles) = self.obstacles.take() else { return Ok(sweep) };
        if !obstacles.are_resisted() {
            // an obstacle and the body before it are free together: each by itself is held by the other
            obstacles.part_from_bodies(self, model);
        }
        let moved = obstacles.step(obstacles.joint_works(model, &sweep.residual));
        sweep.decrement += moved.energy;
        sweep.product += other.map_or(0.0, |other| obstacles.joint_works(model, other).dot(&moved.amounts));
        obstacles.add_to(&moved.amounts, &mut sweep.correction);
        self.obstacles = Some(obstacles);
        Ok(sweep)
    }

    /// Solve in every body that lives on this rank, and sum the results over the ranks in one message. With `other` the
    /// solves are those of a preconditioner.
    fn solve(
        &mut self,
        model: &mut Model,
        residual: Vec<Vec<f64>>,
        energy: Energy,
        other: Option<&[Vec<f64>]>,
        asked: u8,
    ) -> Result<Sweep> {
        let (bodies, mut reasons) = (model.bodies.len(), vec![String::new(); model.bodies.len()]);
        let mut corrections: Vec<Vec<f64>> = residual.iter().map(|r| vec![0.0; r.len()]).collect();
        let (mut sums, mut failed) = ([0.0; 6], vec![0.0; bodies]);
        (sums[1], sums[2]) = (energy.strain, energy.potential);
        for index in 0..bodies {
            if is_obstacle(model, index) {
                continue;
            }
            let Some(body) = model.bodies[index].local.as_mut() else { continue };
            let (r, z) = (&residual[index], &mut corrections[index]);
            let solved = if other.is_some() { body.precondition(r, z)? } else { body.solve(r, z)? };
            if let Some(failure) = solved.failure {
                (failed[index], reasons[index]) = (1.0, failure);
            }
            sums[0] += dot(r, z);
            sums[3] += other.map_or(0.0, |other| dot(&other[index], z));
            // a body that is distributed over several ranks counts once
            if body.dofs().leads() {
                let counts = body.counts();
                sums[4] += counts.factorizations as f64;
                sums[5] += counts.inner_iterations as f64;
            }
        }
        let (correction, numbers) = DisplacementField::of_step(
            model,
            corrections,
            &vec![Vec::new(); bodies],
            &[&sums[..], &failed, &asks(asked)].concat(),
        );
        let (sums, rest) = numbers.split_at(sums.len());
        let (failed, asked) = rest.split_at(bodies);
        let failed = failed.iter().position(|&failed| failed != 0.0);
        self.sweeps += 1;
        Ok(Sweep {
            residual,
            correction,
            decrement: sums[0],
            strain: sums[1],
            potential: sums[2],
            product: sums[3],
            factorizations: sums[4] as usize,
            inner_iterations: sums[5] as usize,
            failed: failed.map(|body| Failure { body: Some(body), reason: std::mem::take(&mut reasons[body]) }),
            asked: exchange::asked(&asked[..ASKS]),
        })
    }
}

impl WithoutRigidParts for Sweeper {
    fn is_apart(&self, model: &Model, body: usize) -> bool {
        is_obstacle(model, body)
    }

    /// Return the closings of the contact rows (2n) as the bodies before obstacles have them: with those of the
    /// obstacles.
    fn closings(&self, model: &Model, trace: &[f64]) -> Vec<f64> {
        let (points, mut rows) = (model.points(), trace.to_vec());
        for q in before_obstacles(model) {
            rows[q] += std::mem::take(&mut rows[points + q]);
        }
        rows
    }

    fn solve_bodies(
        &mut self,
        model: &mut Model,
        force: &[f64],
        _near: Option<DisplacementField>,
    ) -> Result<Solved<(DisplacementField, f64)>> {
        let mut residual = DisplacementField::zero(model).displacements;
        add_forces(model, force, &mut residual);
        let sweep = self.solve(model, residual, Energy::default(), None, 0)?;
        Ok(sweep.failed.map_or(Ok((sweep.correction, 0.0)), Err))
    }

    fn multiply_bodies(&mut self, model: &mut Model, v: &[Vec<f64>]) -> Vec<Vec<f64>> {
        model.multiply(v)
    }
}

/// Return whether a rigid part is an obstacle, the only partner of the body before it.
fn is_obstacle(model: &Model, body: usize) -> bool {
    let slot = &model.bodies[body];
    slot.is_rigid && slot.segments.iter().any(|segment| model.pairs[segment.pair].bodies[1] == body)
}

/// Return the points of all pairs with an obstacle.
fn before_obstacles(model: &Model) -> impl Iterator<Item = usize> + '_ {
    (0..model.pairs.len()).filter(|&pair| is_obstacle(model, model.pairs[pair].bodies[1])).flat_map(|i| model.range(i))
}

/// Give both sides of a pair with an obstacle the larger of their weights (2n): they have one system.
fn join_obstacles(model: &Model, weight: &mut [f64]) {
    for q in before_obstacles(model) {
        let larger = weight[q].max(weight[model.points() + q]);
        (weight[q], weight[model.points() + q]) = (larger, larger);
    }
}

/// The zone and the rule of the Robin term, with the weights that a frozen rule keeps.
///
/// Any symmetric positive definite G leads to the same solution; G decides how fast. There is one weight for each
/// contact row, in the layout of a trace vector, because the two bodies of a pair may need different weights.
pub struct Coefficient {
    zone: Zone,
    /// The surfaces of `between` at sides a and b of each pair.
    sides: Vec<[usize; 2]>,
    rule: RobinRule,
    /// Weights of the first call under the rule `frozen`.
    frozen: Option<Vec<f64>>,
}

impl Coefficient {
    /// Return a coefficient that has kept no weights yet.
    pub fn new(zone: Zone, sides: Vec<[usize; 2]>, rule: RobinRule) -> Self {
        Self { zone, sides, rule, frozen: None }
    }

    /// Return omega psi kappa of every contact row (2n, layout of a trace vector) for layers in these states in
    /// iteration `k`.
    ///
    /// # Errors
    /// A condition of a zone has no value at a contact point; all ranks find this.
    pub fn weight(&mut self, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
        if let Some(frozen) = &self.frozen {
            return Ok(frozen.clone());
        }
        let tangent = self.tangents(model, layer, k).map_err(Error::common)?;
        let mut weight = match &self.rule {
            RobinRule::Tangent => tangent,
            RobinRule::Floor(floor) => {
                let points = model.points();
                tangent.into_iter().enumerate().map(|(i, w)| w.max(floor * model.area[i % points])).collect()
            }
            RobinRule::Frozen | RobinRule::Auto => constrained(model, tangent),
        };
        join_obstacles(model, &mut weight);
        if self.rule == RobinRule::Frozen {
            self.frozen = Some(weight.clone());
        }
        Ok(weight)
    }

    /// Return omega psi kappa of every contact row, 2n, in iteration `k`.
    fn tangents(&self, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
        let mut weight = vec![0.0; 2 * model.points()];
        for (i, side) in (0..model.pairs.len()).flat_map(|i| [(i, 0), (i, 1)]) {
            let (pair, surface) = (&model.pairs[i], self.sides[i][side]);
            for (point, q) in model.range(i).enumerate() {
                if is_inside(&self.zone, surface, layer.tangent[q], pair.position[point], k)? {
                    // a smoothed law has a tangent where the law itself has none
                    let tangent = match layer.tangent[q] {
                        0.0 => pair.law.robin_tangent(point, layer.compression[q]),
                        tangent => tangent,
                    };
                    weight[side * model.points() + q] = model.area[q] * tangent;
                }
            }
        }
        Ok(weight)
    }
}

/// Return whether a point at x with this tangent of the layer is in the zone of a surface, 0 or 1 of `between`, in
/// iteration `k`.
fn is_inside(zone: &Zone, surface: usize, tangent: f64, x: [f64; 3], k: usize) -> Result<bool> {
    match zone {
        Zone::None => Ok(false),
        Zone::Full => Ok(true),
        Zone::Active => Ok(tangent > 0.0),
        Zone::Subset(holds) => holds.is_true_at(x, k),
        Zone::Sides(zones) => is_inside(&zones[surface], surface, tangent, x, k),
    }
}

/// Return the first body that is unconstrained under the Robin term `weight` (omega psi kappa of the contact rows, 2n),
/// and its motion. Springs below [`TOLERANCE`] of the largest stiffness in the body are lost in its rounding.
pub fn underconstrained(model: &Model, weight: &[f64]) -> Option<NamedMotion> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        let springs = springs(model, body, &model.of_body(body, weight));
        // a rigid part has no stiffness of its own to compare with
        let full = if slot.is_rigid { springs.diagonal().max().max(f64::MIN_POSITIVE) } else { slot.scale };
        let free = Blocks::free(&springs, full, TOLERANCE);
        let names = slot.free_motions().iter().map(|motion| &motion.name[..]);
        Some(NamedMotion { body, name: combined(names, free.first()?.iter().copied()) })
    })
}

/// Share of the stiffness of the body's own surface below which a motion is not held safely. At this share, a sweep
/// would move the body by a thousand times what its surface gives way.
const WEAK: f64 = 1e-3;

/// Return the weights (2n). Every body that they do not hold safely gets at least the stiffness of its own surface as a
/// whole.
fn constrained(model: &Model, mut weight: Vec<f64>) -> Vec<f64> {
    let holding = model.holding_stiffness();
    for (body, _) in model.bodies.iter().enumerate().filter(|(_, slot)| slot.free > 0) {
        // the stiffness under each row, spread over all rows
        let mut surface = model.of_body(body, &holding);
        let rows = surface.len().max(1) as f64;
        surface.iter_mut().for_each(|stiffness| *stiffness /= rows);
        let natural = springs(model, body, &surface);
        let mut safe = springs(model, body, &model.of_body(body, &weight)) - WEAK * &natural;
        // a motion that no contact row resists is not required to be held
        let largest = natural.diagonal().max();
        (0..safe.nrows()).for_each(|i| safe[(i, i)] += TOLERANCE * largest);
        if safe.cholesky().is_some() {
            continue;
        }
        let now = model.of_body(body, &weight);
        let more: Vec<f64> = now.iter().zip(&surface).map(|(now, surface)| now.max(*surface)).collect();
        model.put(body, &more, &mut weight);
    }
    weight
}

/// Return the stiffness of springs at a body's contact rows in terms of its free motions, a square matrix.
fn springs(model: &Model, body: usize, weight: &[f64]) -> DMatrix<f64> {
    let motions = model.bodies[body].free_motions();
    DMatrix::from_fn(motions.len(), motions.len(), |i, j| {
        let (s, t) = (&motions[i].trace, &motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    })
}

/// Springs of the constraint B u = t over the stiffness of the nodes under them. The trace of an extension differs by
/// about a ten-thousandth of what loads move the body; with 1e6 its rounding shows in the last of eight digits of
/// Aitken's rule.
const STIFF: f64 = 1e4;

/// Give every body the Robin term of its extension, and set up the solvers of those that have none yet. A refusal of
/// the solver or of an option then comes before the first sweep, and the extension needs no other factorisation.
pub fn prepare(model: &mut Model) -> Result<()> {
    let bodies = model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
    let is_new: Vec<bool> = bodies.map(|body| !body.is_set_up()).collect();
    model.robin(&stiff_springs(model))?;
    let bodies = model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut()).zip(is_new);
    bodies.filter(|(_, is_new)| *is_new).try_for_each(|(body, _)| body.set_up())
}

/// Return the springs of an extension at the contact rows, 2n.
fn stiff_springs(model: &Model) -> Vec<f64> {
    model.holding_stiffness().iter().map(|k| STIFF * k).collect()
}

/// Return the springs of an extension with the matrix of all bodies, n.
pub fn stiff_joint_springs(model: &Model) -> Vec<f64> {
    closing(&stiff_springs(model)).collect()
}

/// Return the iterate with the given trace (2n). Values at rows that a support prescribes are ignored. Collective.
///
/// # Errors
/// Failures of the solver library.
///
/// The sweep (41) depends on the iterate through its traces only, so a start is a trace. The extension minimises the
/// energy of the body among all displacements with that trace, which springs much stiffer than the body impose.
pub fn extend(model: &mut Model, trace: &[f64]) -> Result<Solved<DisplacementField>> {
    let springs = stiff_springs(model);
    model.robin(&springs)?;
    let mut iterate = DisplacementField::rest(model);
    let products = model.multiply(&iterate.displacements);
    let (mut r, energy) = residual(model, products, &iterate, &vec![0.0; model.points()]);
    let pull: Vec<f64> = springs.iter().zip(trace).map(|(spring, u)| spring * u).collect();
    for (index, r) in r.iter_mut().enumerate() {
        match model.bodies[index].local.as_ref() {
            // the motions of the start have moved it
            Some(_) if model.bodies[index].is_rigid => r.fill(0.0),
            Some(body) => body.dofs().rows.add_transpose(1.0, &model.of_body(index, &pull), r),
            None => {}
        }
    }
    let sweep = Sweeper::default().solve(model, r, energy, None, 0)?;
    if let Some(failure) = sweep.failed {
        return Ok(Err(failure));
    }
    // with the traces of the rigid parts, which go into the gap
    iterate.add(1.0, &sweep.correction);
    let fallen = motions::trace(model, &iterate.rigid);
    axpy(-1.0, &fallen, &mut iterate.trace);
    model.close_gap(&fallen);
    Ok(Ok(iterate))
}
