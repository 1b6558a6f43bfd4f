//! The automatic start: bodies that contact alone holds are pushed, rigidly, until the layers carry their loads; then surfaces
//! that overlap far too much give way.

use super::cone::Cone;
use super::fall::balance;
use super::held::{self, FreeMotion};
use super::joint::Joint;
use super::layer::Layer;
use super::model::Model;
use crate::linalg::axpy;
use nalgebra::DVector;

/// Forces of a contact below this share of the largest may be none.
const FAINT: f64 = 1e-3;

/// The trace of the rigid displacements that minimise F1 over the motions that supports leave free: no body is solved. Zero
/// where supports hold everything, or where the layers answer beyond the range of numbers. Contacts that nothing presses but
/// an overlap are opened.
///
/// # Errors
/// Which bodies move how, if F1 falls for ever along such a motion. As bodies are elastic, F1 as a whole then has no minimum
/// either: loads push bodies away from all that could stop them.
pub fn rigid_closing(model: &Model) -> Result<Vec<f64>, Vec<FreeMotion>> {
    let joint = Joint::of(model);
    let work: Vec<f64> = model.bodies.iter().flat_map(|slot| &slot.motions).map(|motion| motion.work).collect();
    let work = DVector::from_vec(work);
    let (trace, balanced) = balance(model, &joint, &work).unwrap_or((vec![0.0; 2 * model.points()], false));
    if !balanced && let Some(motion) = Cone::new(&joint).gain(&work) {
        return Err(held::parts(model, &joint, &motion));
    }
    Ok(opened(model, &joint, &work, trace))
}

/// The trace with contacts opened that an overlap alone presses together, and loads do not: any part of the overlap that is left
/// would be a pressure that vanishes slowly.
fn opened(model: &Model, joint: &Joint, work: &DVector<f64>, mut trace: Vec<f64>) -> Vec<f64> {
    let layer = Layer::at(model, &trace);
    let force = |pair: usize| layer.force[model.range(pair)].iter().sum::<f64>();
    let most = (0..model.pairs.len()).map(force).fold(0.0, f64::max);
    let closed = |pair: usize| layer.compression[model.range(pair)].iter().any(|&c| c > 0.0);
    let idle = work.iter().all(|&work| work == 0.0);
    let may_open = |pair: usize| closed(pair) && (idle || force(pair) <= FAINT * most);
    if joint.count() == 0 || !(0..model.pairs.len()).any(may_open) {
        return trace;
    }
    let Some(motion) = Cone::new(joint).opening(work) else { return trace };
    let opens = |(c, closing): (&f64, f64)| *c > 0.0 && closing < -0.5;
    if layer.compression.iter().zip(joint.closing(&motion)).any(opens) {
        // bodies give way by about what they are compressed elsewhere
        let deepest = layer.compression.iter().copied().fold(0.0, f64::max);
        axpy(2.0 * deepest, &joint.trace(model, &motion), &mut trace);
    }
    trace
}

/// Layers that push this many times harder than loads and surfaces could make them start too deep.
const DEEP: f64 = 10.0;

/// The automatic start: the trace of [`rigid_closing`], or zero without a minimum (the run then ends before its first sweep).
///
/// An overlap of the scene, or supports that drive bodies together, can make the pressure of a stiff law there any number. The
/// surfaces then give way, each point by itself, until law and surface are in balance.
pub fn automatic_start(model: &Model) -> Vec<f64> {
    let points = model.points();
    let mut trace = rigid_closing(model).unwrap_or(vec![0.0; 2 * points]);
    let layer = Layer::at(model, &trace);
    let mut springs = vec![0.0; 2 * points];
    for body in 0..model.bodies.len() {
        model.put(body, &held::natural_springs(model, body), &mut springs);
    }
    // a row without stiffness has prescribed dofs only and cannot move
    let compliance = |i: usize| if springs[i] > 0.0 { springs[i].recip() } else { 0.0 };
    let too_deep = |q: usize| {
        let (c, soft) = (layer.compression[q].max(0.0), compliance(q).max(compliance(points + q)));
        if soft > 0.0 { layer.force[q] - DEEP * c / soft } else { 0.0 }
    };
    let excess: f64 = (0..points).map(|q| too_deep(q).max(0.0)).sum();
    let load: f64 = model.bodies.iter().flat_map(|slot| &slot.motions).map(|motion| motion.work.abs()).sum();
    if excess <= DEEP * load {
        return trace;
    }
    for (i, pair) in model.pairs.iter().enumerate() {
        for q in model.range(i) {
            if too_deep(q) <= 0.0 {
                continue;
            }
            // side a carries the points: it can move at each by itself
            let side = if compliance(q) > 0.0 { q } else { points + q };
            let (soft, c) = (compliance(side), layer.compression[q]);
            // way of the surface from 0 to c; a pressure that is no number pushes back
            let (mut low, mut high) = (0.0, c);
            for _ in 0..60 {
                let way = 0.5 * (low + high);
                let force = model.weight[q] * pair.law.response(q - model.offset[i], c - way).pressure;
                if force * soft <= way { high = way } else { low = way }
            }
            trace[side] -= high;
        }
    }
    trace
}
