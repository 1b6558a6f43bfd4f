//! One sweep (41): every body solves its own linear problem, independently of the others. A sweep needs the Robin coefficient, and a start, which is
//! a trace extended into every body.

use crate::error::{Error, Result};
use crate::exchange::{self, ASKS, Exchange, asks};
use crate::linalg::{Blocks, axpy, dot};
use crate::model::body::{Body, Energy};
use crate::model::field::{Field, residuals};
use crate::model::layer::Layer;
use crate::model::linear::Failure;
use crate::model::rigid::{Moved, TOLERANCE, combined};
use crate::model::{BodySlot, Model};
use crate::problem::method::{RobinRule, Zone};
use nalgebra::DMatrix;

// Positions of the numbers that a body adds to the message of a sweep.
const DECREMENT: usize = 0;
const STRAIN: usize = 1;
const POTENTIAL: usize = 2;
const FAILED: usize = 3;
const SKIPPED: usize = 4;
const FACTORIZATIONS: usize = 5;
const INNER_ITERATIONS: usize = 6;
const PRODUCT: usize = 7;

/// How many numbers these are.
const SCALARS: usize = 8;

/// Result of a sweep at an iterate: G z = r in every body.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// r of each body that lives on this rank.
    pub residual: Vec<Vec<f64>>,
    /// z.
    pub correction: Field,
    /// r'z = r'G^-1 r of each body.
    pub decrement: Vec<f64>,
    /// Energies of the iterate in each body.
    pub energy: Vec<Energy>,
    /// The first body whose inner solver failed, with the reason if this rank knows it.
    pub failed: Option<Failure>,
    /// Numeric factorisations so far, all bodies.
    pub factorizations: usize,
    /// Krylov iterations so far, all bodies.
    pub inner_iterations: usize,
    /// Requests from outside, of all ranks (see [`exchange::asked`]).
    pub asked: u8,
    /// y'z for another residual y, if one was given.
    pub product: f64,
    /// Whether each body was open: no pressure and no Robin term.
    open: Vec<bool>,
}

/// Makes sweeps, and reuses results that are known without a solve.
#[derive(Debug, Default, Clone)]
pub struct Sweeper {
    /// Sweeps made.
    pub sweeps: usize,
    /// Solves of a body that were not needed.
    pub solves_skipped: usize,
}

/// What a sweep solves: G z = `residual` in every body.
struct Task<'a> {
    /// r of each body that lives on this rank.
    residual: Vec<Vec<f64>>,
    /// z of each body where it is known without a solve.
    known: Vec<Option<Vec<f64>>>,
    /// Energies of the iterate in each body.
    energies: Vec<Energy>,
    /// The residual y of the product y'z. A sweep that is given one serves as a preconditioner.
    other: Option<&'a [Vec<f64>]>,
    /// Requests from outside, of this rank.
    asked: u8,
}

impl Sweeper {
    /// Solve G_s z_s = r_s in every body at `iterate` with its `layer`. The model carries the Robin term `weight` = omega psi kappa of the
    /// contact rows (2n). `last` is the sweep that led here, with its relaxation gamma. The requests `asked` of this rank go with the message.
    ///
    /// A body without pressure and Robin term, now and in the last sweep, has r = (1 - gamma) r_last and the same G. Its z is known without a
    /// solve, as long as rounding is far below r.
    pub fn sweep(
        &mut self,
        model: &mut Model,
        iterate: &Field,
        layer: &Layer,
        weight: &[f64],
        last: Option<(&Sweep, f64)>,
        asked: u8,
    ) -> Result<Sweep> {
        let open: Vec<bool> = (0..model.bodies.len()).map(|index| is_open(model, index, layer, weight)).collect();
        let (residual, energies) = residuals(model, iterate, &layer.force);
        let known = |index: usize| {
            let (last, gamma) = last.filter(|(last, _)| open[index] && last.open[index])?;
            known_correction(model, index, &residual[index], last, 1.0 - gamma)
        };
        let known = (0..model.bodies.len()).map(known).collect();
        let mut sweep = self.solve(model, Task { residual, known, energies, other: None, asked })?;
        sweep.open = open;
        Ok(sweep)
    }

    /// Apply G^-1 to any residual as a preconditioner; the result keeps the residual. `product` of the result is `other`'z.
    pub fn precondition(&mut self, model: &mut Model, residual: Vec<Vec<f64>>, other: &[Vec<f64>]) -> Result<Sweep> {
        let bodies = model.bodies.len();
        let (known, energies) = (vec![None; bodies], vec![Energy::default(); bodies]);
        self.solve(model, Task { residual, known, energies, other: Some(other), asked: 0 })
    }

    /// Solve in every body that lives on this rank, and sum the results over the ranks.
    fn solve(&mut self, model: &mut Model, mut task: Task) -> Result<Sweep> {
        let (bodies, rows) = (model.bodies.len(), 2 * model.points());
        // one message: the traces, SCALARS numbers of each body, and the requests
        let end = rows + SCALARS * bodies;
        let mut message = vec![0.0; end + ASKS];
        message[end..].copy_from_slice(&asks(task.asked));
        let mut states = Vec::with_capacity(bodies);
        let mut reasons = vec![String::new(); bodies];
        for index in 0..bodies {
            let slot = &mut model.bodies[index];
            let Some(body) = slot.local.as_mut() else {
                states.push(Vec::new());
                continue;
            };
            let scalars = &mut message[rows + SCALARS * index..][..SCALARS];
            let z = task.solve_body(index, body, scalars, &mut reasons[index])?;
            let mut trace = vec![0.0; slot.row_stiffness.len()];
            body.states().trace(&z, &mut trace);
            model.put(index, &trace, &mut message[..rows]);
            states.push(z);
        }
        model.exchange.sum(&mut message);
        let mut sweep = Sweep { residual: task.residual, asked: exchange::asked(&message[end..]), ..Sweep::default() };
        self.collect(&mut sweep, &message[rows..end], &reasons);
        message.truncate(rows);
        sweep.correction = Field { states, trace: message };
        Ok(sweep)
    }

    /// Take the sums of the bodies' numbers, [`SCALARS`] a body, into the result, and count the sweep.
    fn collect(&mut self, sweep: &mut Sweep, sums: &[f64], reasons: &[String]) {
        for (index, scalars) in sums.chunks_exact(SCALARS).enumerate() {
            sweep.decrement.push(scalars[DECREMENT]);
            sweep.energy.push(Energy { strain: scalars[STRAIN], potential: scalars[POTENTIAL], ..Energy::default() });
            if scalars[FAILED] != 0.0 && sweep.failed.is_none() {
                sweep.failed = Some(Failure { body: Some(index), reason: reasons[index].clone() });
            }
            self.solves_skipped += usize::from(scalars[SKIPPED] != 0.0);
            sweep.factorizations += scalars[FACTORIZATIONS] as usize;
            sweep.inner_iterations += scalars[INNER_ITERATIONS] as usize;
            sweep.product += scalars[PRODUCT];
        }
        self.sweeps += 1;
    }
}

impl Task<'_> {
    /// Return z of a body. Its numbers for the message go to `scalars`; if its inner solver fails, the cause goes to `reason`.
    fn solve_body(
        &mut self,
        index: usize,
        body: &mut dyn Body,
        scalars: &mut [f64],
        reason: &mut String,
    ) -> Result<Vec<f64>> {
        let r = &self.residual[index];
        let known = self.known[index].take();
        let is_skipped = known.is_some();
        let mut z = known.unwrap_or_else(|| vec![0.0; r.len()]);
        if !is_skipped {
            let solved = if self.other.is_some() { body.precondition(r, &mut z)? } else { body.solve(r, &mut z)? };
            if let Some(failure) = solved.failure {
                *reason = failure;
                scalars[FAILED] = 1.0;
            }
        }
        scalars[DECREMENT] = dot(r, &z);
        scalars[STRAIN] = self.energies[index].strain;
        scalars[POTENTIAL] = self.energies[index].potential;
        scalars[PRODUCT] = self.other.map_or(0.0, |other| dot(&other[index], &z));
        // a body that is distributed over several ranks counts once
        if body.states().leads() {
            let counts = body.counts();
            scalars[SKIPPED] = f64::from(is_skipped);
            scalars[FACTORIZATIONS] = counts.factorizations as f64;
            scalars[INNER_ITERATIONS] = counts.inner_iterations as f64;
        }
        Ok(z)
    }
}

/// Whether a body has neither pressure nor Robin term.
fn is_open(model: &Model, body: usize, layer: &Layer, weight: &[f64]) -> bool {
    let (force, springs) = (model.at_rows(body, &layer.force), model.of_body(body, weight));
    force.iter().chain(&springs).all(|&value| value == 0.0)
}

/// Return z = `factor` z_last of a body that lives on this rank, if r = `factor` r_last to rounding. Collective for a distributed body.
fn known_correction(model: &Model, index: usize, r: &[f64], last: &Sweep, factor: f64) -> Option<Vec<f64>> {
    let body = model.bodies[index].local.as_ref()?;
    // |r - factor r_last|^2 and |r|^2
    let difference = r.iter().zip(&last.residual[index]).map(|(r, last)| (r - factor * last).powi(2)).sum();
    let mut sums = [difference, dot(r, r)];
    if body.states().distribution.is_some() {
        model.exchange.sum(&mut sums);
    }
    (sums[0] <= 1e-12 * sums[1]).then(|| {
        let mut z = vec![0.0; body.states().size()];
        axpy(factor, &last.correction.states[index], &mut z);
        z
    })
}

/// The zone and the rule of the Robin term, with the weights that a frozen rule keeps.
///
/// Any symmetric positive definite G leads to the same solution; G decides how fast. There is one weight for each contact row, in the layout
/// of a trace vector, because the two bodies of a pair may need different weights.
pub struct Coefficient {
    zone: Zone,
    rule: RobinRule,
    /// Weights of the first call under the rule `frozen`.
    frozen: Option<Vec<f64>>,
}

impl Coefficient {
    /// Return a coefficient that has kept no weights yet.
    pub fn new(zone: Zone, rule: RobinRule) -> Self {
        Self { zone, rule, frozen: None }
    }

    /// Return omega psi kappa of every contact row (2n, layout of a trace vector) for layers in these states in iteration `k`.
    ///
    /// # Errors
    /// A condition of the zone has no value at a contact point; all ranks find this.
    pub fn weight(&mut self, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
        if let Some(frozen) = &self.frozen {
            return Ok(frozen.clone());
        }
        let points = tangents(&self.zone, model, layer, k).map_err(Error::common)?;
        let tangent = [&points[..], &points[..]].concat();
        Ok(match &self.rule {
            RobinRule::Tangent => tangent,
            RobinRule::Frozen => self.frozen.insert(constrained(model, tangent)).clone(),
            RobinRule::Floor(floor) => {
                let points = model.points();
                tangent.into_iter().enumerate().map(|(i, w)| w.max(floor * model.weight[i % points])).collect()
            }
            RobinRule::Auto => constrained(model, tangent),
        })
    }
}

/// Return omega psi kappa at every point, n, in iteration `k`.
fn tangents(zone: &Zone, model: &Model, layer: &Layer, k: usize) -> Result<Vec<f64>> {
    let mut weight = vec![0.0; model.points()];
    for (pair, contact) in model.pairs.iter().enumerate() {
        for q in model.range(pair) {
            let point = q - model.offset[pair];
            let inside = match zone {
                Zone::None => false,
                Zone::Full => true,
                Zone::Active => layer.tangent[q] > 0.0,
                Zone::Subset(holds) => holds.is_true_at(contact.position[point], k)?,
            };
            if inside {
                // a smoothed law has a tangent where the law itself has none
                let tangent = match layer.tangent[q] {
                    0.0 => contact.law.robin_tangent(point, layer.compression[q]),
                    tangent => tangent,
                };
                weight[q] = model.weight[q] * tangent;
            }
        }
    }
    Ok(weight)
}

/// Return the first body that is unconstrained under the Robin term `weight` (omega psi kappa of the contact rows, 2n), and its motion. Springs
/// below [`TOLERANCE`] of the largest stiffness in the body are lost in its rounding.
pub fn underconstrained(model: &Model, weight: &[f64]) -> Option<Moved> {
    (0..model.bodies.len()).find_map(|body| {
        let slot = &model.bodies[body];
        let springs = springs(model, body, &model.of_body(body, weight));
        let free = Blocks::free(&springs, slot.scale, TOLERANCE);
        let names = slot.motions.iter().map(|motion| &motion.name[..]);
        Some(Moved { body, name: combined(names, free.first()?.iter().copied()) })
    })
}

/// Share of the stiffness of the body's own surface below which a motion is not held safely. At this share, a sweep would move the body by a
/// thousand times what its surface gives way.
const WEAK: f64 = 1e-3;

/// Return the weights (2n). Every body that they do not hold safely gets at least the stiffness of its own surface as a whole.
fn constrained(model: &Model, mut weight: Vec<f64>) -> Vec<f64> {
    for (body, slot) in model.bodies.iter().enumerate().filter(|(_, slot)| !slot.motions.is_empty()) {
        // the stiffness under each row, spread over all rows
        let rows = slot.row_stiffness.len().max(1) as f64;
        let surface: Vec<f64> = slot.row_stiffness.iter().map(|stiffness| stiffness / rows).collect();
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
    let motions = &model.bodies[body].motions;
    DMatrix::from_fn(motions.len(), motions.len(), |i, j| {
        let (s, t) = (&motions[i].trace, &motions[j].trace);
        (0..weight.len()).map(|q| weight[q] * s[q] * t[q]).sum()
    })
}

/// Springs of the constraint B u = t over the stiffness of the nodes under them: half the digits of a number are left to the body.
const STIFF: f64 = 1e4;

/// Steps of the augmented Lagrangian method; each gains a factor of about `STIFF` over the surface's compliance.
const STEPS: usize = 4;

/// Give every body that lives on this rank the Robin term of its extension, and set its solver up. A refusal of the solver or of an option
/// then comes before the first sweep, and the extension needs no other factorisation.
pub fn prepare(model: &mut Model) -> Result<()> {
    for index in 0..model.bodies.len() {
        let springs = extension_springs(&model.bodies[index]);
        if let Some(body) = model.bodies[index].local.as_mut() {
            body.robin(&springs)?;
            body.set_up()?;
        }
    }
    Ok(())
}

fn extension_springs(slot: &BodySlot) -> Vec<f64> {
    slot.row_stiffness.iter().map(|k| STIFF * k).collect()
}

/// Return the iterate with the given trace (2n). Values at rows that a support prescribes are ignored. Collective.
///
/// # Errors
/// Failures of the solver library.
///
/// The sweep (41) depends on the iterate through its traces only, so a start is a trace. The extension minimises the energy of the body among
/// all displacements with that trace. It is found by the augmented Lagrangian method with springs much stiffer than the body: in every step
/// the error shrinks by the ratio of the two stiffnesses.
pub fn extend(model: &mut Model, trace: &[f64]) -> Result<std::result::Result<Field, Failure>> {
    let mut iterate = Field { states: Vec::new(), trace: vec![0.0; trace.len()] };
    let mut failed = vec![0.0; model.bodies.len()];
    let mut reasons = vec![String::new(); model.bodies.len()];
    for index in 0..model.bodies.len() {
        let target = model.of_body(index, trace);
        let slot = &mut model.bodies[index];
        let springs = extension_springs(slot);
        let Some(body) = slot.local.as_mut() else {
            iterate.states.push(Vec::new());
            continue;
        };
        let Extension { state, rows, failure } = extend_body(body, &*model.exchange, &springs, &target)?;
        model.put(index, &rows, &mut iterate.trace);
        iterate.states.push(state);
        if let Some(reason) = failure {
            failed[index] = 1.0;
            reasons[index] = reason;
        }
    }
    // one message: traces, then which inner solvers failed
    let mut message = [&iterate.trace[..], &failed[..]].concat();
    model.exchange.sum(&mut message);
    let failed = message.split_off(trace.len());
    iterate.trace = message;
    Ok(match failed.iter().position(|&failed| failed != 0.0) {
        Some(body) => Err(Failure { body: Some(body), reason: std::mem::take(&mut reasons[body]) }),
        None => Ok(iterate),
    })
}

/// The extension of a trace into one body.
struct Extension {
    state: Vec<f64>,
    /// B u of the state.
    rows: Vec<f64>,
    /// Why the inner solver failed last, if it did.
    failure: Option<String>,
}

/// Extend the trace `target` of a body, with springs of this stiffness at its contact rows. Collective for a distributed body.
fn extend_body(body: &mut dyn Body, exchange: &dyn Exchange, springs: &[f64], target: &[f64]) -> Result<Extension> {
    body.robin(springs)?;
    let mut u = body.states().rest();
    let [mut r, mut z, mut product] = [(); 3].map(|()| vec![0.0; u.len()]);
    let [mut rows, mut multiplier, mut force] = [(); 3].map(|()| vec![0.0; springs.len()]);
    let (mut first, mut failure) = (None, None);
    for step in 0..STEPS {
        body.states().trace(&u, &mut rows);
        if body.states().distribution.is_some() {
            exchange.sum(&mut rows);
        }
        let mut violation = 0.0f64;
        for q in 0..rows.len() {
            let difference = if springs[q] > 0.0 { rows[q] - target[q] } else { 0.0 };
            violation = violation.max(difference.abs());
            if step > 0 {
                multiplier[q] += springs[q] * difference;
            }
            force[q] = multiplier[q] + springs[q] * difference;
        }
        // the interior is in equilibrium from the first solve on
        if first.is_some_and(|first: f64| violation <= 1e-9 * first) {
            break;
        }
        first.get_or_insert(violation.max(f64::MIN_POSITIVE));
        body.apply_stiffness(&u, &mut product);
        body.residual(&u, &product, &force, &mut r);
        failure = body.solve(&r, &mut z)?.failure.or(failure);
        axpy(1.0, &z, &mut u);
    }
    body.states().trace(&u, &mut rows);
    Ok(Extension { state: u, rows, failure })
}
