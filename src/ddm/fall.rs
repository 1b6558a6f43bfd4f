//! How bodies that contact alone holds fall onto their layers: the rigid motions at which contact forces balance the loads, without a
//! solve of any body.

use super::joint::Joint;
use super::layer::Layer;
use super::line::Unbounded;
use super::model::Model;
use crate::linalg::{axpy, dot};
use nalgebra::DVector;

/// Newton steps of the small problem.
const STEPS: usize = 50;

/// Factor between the caps of laws that are too stiff to be met at once.
const STIFFER: f64 = 10.0;

/// Most caps: from a gap to compressions of 1e-30 of it.
const CAPS: usize = 30;

/// Share of the largest load that the small problem may lack in balance.
const BALANCED: f64 = 1e-6;

/// The trace of the rigid displacements that minimise F1 over the motions that supports leave free, on which loads do this `work`,
/// and whether contact forces there balance the loads.
///
/// # Errors
/// [`Unbounded`] if F1 falls for ever along such a motion.
pub fn balance(model: &Model, joint: &Joint, work: &DVector<f64>) -> Result<(Vec<f64>, bool), Unbounded> {
    let rest = vec![0.0; 2 * model.points()];
    if work.iter().all(|&work| work == 0.0) {
        return Ok((rest, true));
    }
    let fall = Fall { model, joint, work };
    match fall.descend(rest.clone(), f64::INFINITY)? {
        End::Balanced(trace) => return Ok((trace, true)),
        End::Overflow => return Ok((rest, false)),
        End::Stuck(_) => {}
    }
    // a stiff layer that closes first hides the way on: with all layers as soft as the gaps are wide, all of them close, and
    // each next cap begins near its end
    let reach = model.gap.iter().fold(0.0f64, |most, gap| most.max(gap.abs()));
    let mut cap = work.amax() / (model.weight.iter().sum::<f64>() * if reach > 0.0 { reach } else { 1.0 });
    let mut trace = rest;
    for _ in 0..CAPS {
        let (End::Balanced(next) | End::Stuck(next)) = fall.descend(trace.clone(), cap)? else { break };
        trace = next;
        if fall.capped(&trace, cap).0 == Layer::at(model, &trace).force {
            break;
        }
        cap *= STIFFER;
    }
    Ok(match fall.descend(trace.clone(), f64::INFINITY)? {
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

/// The small problem: the free motions of all bodies, and the work of the loads on them.
struct Fall<'a> {
    model: &'a Model,
    joint: &'a Joint<'a>,
    work: &'a DVector<f64>,
}

impl Fall<'_> {
    /// Forces of the layers and their tangents omega kappa, where no pressure is more than `cap` times the compression.
    fn capped(&self, trace: &[f64], cap: f64) -> (Vec<f64>, Vec<f64>) {
        let layer = Layer::at(self.model, trace);
        let point = |q: usize| {
            let (c, weight) = (layer.compression[q], self.model.weight[q]);
            let soft = layer.pressure[q] <= cap * c || c <= 0.0 || cap.is_infinite();
            if soft { (layer.force[q], weight * layer.tangent[q]) } else { (weight * cap * c, weight * cap) }
        };
        (0..self.model.points()).map(point).unzip()
    }

    /// Minimises F1 from a trace on, under a `cap` of the layers, by Newton's method.
    fn descend(&self, mut trace: Vec<f64>, cap: f64) -> Result<End, Unbounded> {
        let soft = self.model.bodies.iter().map(|body| body.scale).fold(0.0, f64::max) * 1e-9;
        for _ in 0..STEPS {
            let (force, spring) = self.capped(&trace, cap);
            if force.iter().any(|force| !force.is_finite()) {
                return Ok(End::Overflow);
            }
            let gradient = self.joint.work(&force) - self.work;
            if gradient.amax() <= BALANCED * self.work.amax() {
                return Ok(End::Balanced(trace));
            }
            let mut stiffness = self.joint.stiffness(&spring);
            (0..stiffness.nrows()).for_each(|i| stiffness[(i, i)] += soft);
            let Some(factor) = stiffness.cholesky() else { break };
            let step = factor.solve(&(-&gradient));
            let direction = self.joint.trace(self.model, &step);
            let (closing, gain) = (self.joint.closing(&step), step.dot(self.work));
            let slope = |t: f64| {
                let mut moved = trace.clone();
                axpy(t, &direction, &mut moved);
                let push = dot(&self.capped(&moved, cap).0, &closing);
                if push.is_nan() { f64::INFINITY } else { push - gain }
            };
            match minimum(slope) {
                Some(t) => axpy(t, &direction, &mut trace),
                None => return Err(Unbounded),
            }
        }
        Ok(End::Stuck(trace))
    }
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
