//! How bodies that contact alone holds fall onto their layers: the rigid motions at which contact forces balance the loads, without a
//! solve of any body.

use super::layer::Layer;
use super::line::Unbounded;
use super::model::Model;
use crate::linalg::{axpy, dot};
use nalgebra::{DMatrix, DVector};

/// Newton steps of the small problem.
const STEPS: usize = 50;

/// Factor between the caps of laws that are too stiff to be met at once.
const STIFFER: f64 = 10.0;

/// Most caps: from a gap to compressions of 1e-30 of it.
const CAPS: usize = 30;

/// Share of the largest load that the small problem may lack in balance.
const BALANCED: f64 = 1e-6;

/// The trace of the rigid displacements that minimise F1 over the motions that supports leave free, and whether contact forces
/// there balance the loads.
///
/// # Errors
/// [`Unbounded`] if F1 falls for ever along such a motion.
pub fn balance(model: &Model) -> Result<(Vec<f64>, bool), Unbounded> {
    let motions: Vec<(Vec<f64>, f64)> = (0..model.bodies.len())
        .flat_map(|body| model.bodies[body].motions.iter().map(move |motion| (body, motion)))
        .map(|(body, motion)| {
            let mut trace = vec![0.0; 2 * model.points()];
            model.put(body, &motion.trace, &mut trace);
            (trace, motion.work)
        })
        .collect();
    let rest = vec![0.0; 2 * model.points()];
    if motions.iter().all(|(_, work)| *work == 0.0) {
        return Ok((rest, true));
    }
    match descend(model, &motions, rest.clone(), f64::INFINITY)? {
        End::Balanced(trace) => return Ok((trace, true)),
        End::Overflow => return Ok((rest, false)),
        End::Stuck(_) => {}
    }
    // a stiff layer that closes first hides the way on: with all layers as soft as the gaps are wide, all of them close, and
    // each next cap begins near its end
    let reach = model.gap.iter().fold(0.0f64, |most, gap| most.max(gap.abs()));
    let load = motions.iter().map(|(_, work)| work.abs()).fold(0.0, f64::max);
    let mut cap = load / (model.weight.iter().sum::<f64>() * if reach > 0.0 { reach } else { 1.0 });
    let mut trace = rest;
    for _ in 0..CAPS {
        let Some(next) = descend(model, &motions, trace.clone(), cap)?.trace() else { break };
        trace = next;
        let (force, _) = capped(model, &trace, cap);
        if force == Layer::at(model, &trace).force {
            break;
        }
        cap *= STIFFER;
    }
    Ok(match descend(model, &motions, trace.clone(), f64::INFINITY)? {
        End::Balanced(trace) => (trace, true),
        End::Stuck(trace) => (trace, false),
        End::Overflow => (trace, false),
    })
}

/// How the small problem ended.
enum End {
    /// At its minimum.
    Balanced(Vec<f64>),
    /// Somewhere, out of steps.
    Stuck(Vec<f64>),
    /// At forces that are no numbers.
    Overflow,
}

impl End {
    fn trace(self) -> Option<Vec<f64>> {
        match self {
            End::Balanced(trace) | End::Stuck(trace) => Some(trace),
            End::Overflow => None,
        }
    }
}

/// Forces of the layers and their tangents omega kappa, where no pressure is more than `cap` times the compression.
fn capped(model: &Model, trace: &[f64], cap: f64) -> (Vec<f64>, Vec<f64>) {
    let layer = Layer::at(model, trace);
    let point = |q: usize| {
        let (c, weight) = (layer.compression[q], model.weight[q]);
        let soft = layer.pressure[q] <= cap * c || c <= 0.0 || cap.is_infinite();
        if soft { (layer.force[q], weight * layer.tangent[q]) } else { (weight * cap * c, weight * cap) }
    };
    (0..model.points()).map(point).unzip()
}

/// Minimises F1 over `motions` (trace, work of the loads) from a trace on, under a `cap` of the layers, by Newton's method.
fn descend(model: &Model, motions: &[(Vec<f64>, f64)], mut trace: Vec<f64>, cap: f64) -> Result<End, Unbounded> {
    let points = model.points();
    let closing = |trace: &[f64], q: usize| trace[q] + trace[points + q];
    let soft = model.bodies.iter().map(|body| body.scale).fold(0.0, f64::max) * 1e-9;
    let count = motions.len();
    let load = motions.iter().map(|(_, work)| work.abs()).fold(0.0, f64::max);
    for _ in 0..STEPS {
        let (force, spring) = capped(model, &trace, cap);
        if force.iter().any(|force| !force.is_finite()) {
            return Ok(End::Overflow);
        }
        let gradient = DVector::from_fn(count, |i, _| {
            (0..points).map(|q| force[q] * closing(&motions[i].0, q)).sum::<f64>() - motions[i].1
        });
        if gradient.amax() <= BALANCED * load {
            return Ok(End::Balanced(trace));
        }
        let mut stiffness = DMatrix::from_fn(count, count, |i, j| {
            (0..points).map(|q| spring[q] * closing(&motions[i].0, q) * closing(&motions[j].0, q)).sum::<f64>()
        });
        for i in 0..count {
            stiffness[(i, i)] += soft;
        }
        let Some(factor) = stiffness.cholesky() else { break };
        let step = factor.solve(&(-&gradient));
        let mut direction = vec![0.0; 2 * points];
        motions.iter().zip(step.iter()).for_each(|((motion, _), &s)| axpy(s, motion, &mut direction));
        let work = dot(step.as_slice(), &motions.iter().map(|(_, work)| *work).collect::<Vec<_>>());
        let slope = |t: f64| {
            let mut moved = trace.clone();
            axpy(t, &direction, &mut moved);
            let (force, _) = capped(model, &moved, cap);
            let push: f64 = (0..points).map(|q| force[q] * closing(&direction, q)).sum();
            if push.is_nan() { f64::INFINITY } else { push - work }
        };
        match minimum(slope) {
            Some(t) => axpy(t, &direction, &mut trace),
            None => return Err(Unbounded),
        }
    }
    Ok(End::Stuck(trace))
}

/// Zero of an increasing function that is negative at 0, roughly; `None` if there is none below 1e12.
fn minimum(slope: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1.0);
    while slope(high) < 0.0 {
        low = high;
        high *= 4.0;
        if high > 1e12 {
            return None;
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
        if high - low <= 1e-3 * high {
            break;
        }
    }
    Some(high)
}
