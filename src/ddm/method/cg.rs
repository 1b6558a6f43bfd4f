//! Conjugate gradients for the Newton system (35), preconditioned by the Robin sweep.

use super::Here;
use crate::ddm::coarse::Coarse;
use crate::ddm::field::{Field, apply_stiffness, local_dot};
use crate::ddm::model::Model;
use crate::error::Result;
use crate::linalg::{axpy, dot};
use nalgebra::{DMatrix, SymmetricEigen};

/// What conjugate gradients found. A direction without stiffness (a body that its contact does not hold now) ends them; if
/// it is the first one, it is the result: a line search along it closes the contact.
pub struct Solution {
    /// x with F1'' x = r, approximately.
    pub x: Field,
    /// x'r: the squared Newton decrement.
    pub energy: f64,
    /// Bounds of the spectrum of G^-1 F1'' from the Lanczos matrix of the iteration.
    pub spectrum: Option<(f64, f64)>,
}

/// Steps without a smaller residual after which deflated conjugate gradients end.
const STUCK: usize = 30;

/// Share of r'z that a first direction without stiffness has at least.
const FLAT: f64 = 1e-8;

/// Solves (K + B' diag(omega kappa) B) x = r until r'G^-1 r has fallen by `reduction` squared, or after `most` steps. The sweep
/// at the iterate is the first preconditioned residual. `kappa_weight` is omega kappa at the points.
///
/// # Errors
/// Failures of the solver library.
pub fn solve(here: &mut Here, kappa_weight: &[f64], reduction: f64, most: usize) -> Result<Solution> {
    let mut r = here.sweep.residual.clone();
    let mut z = here.sweep.correction.clone();
    let mut rz: f64 = here.decrement();
    let goal = rz * reduction * reduction;
    let coarse = Coarse::new(here.model, kappa_weight);
    let image = coarse.as_ref().map(|coarse| coarse.deflate(here.model, &mut z));
    let mut x = z.zero_like();
    let mut direction = z;
    let mut energy = 0.0;
    let mut best = (f64::INFINITY, 0);
    let (mut alphas, mut betas) = (Vec::new(), Vec::new());
    for step in 0..most {
        // the first step is the best in the span of the sweep and the rigid motions; what follows begins anew from there
        let first = coarse.as_ref().zip(image.as_ref()).filter(|_| step == 0);
        let mut image = apply_stiffness(here.model, &direction);
        let closing = direction.closing();
        let spring: Vec<f64> = kappa_weight.iter().zip(&closing).map(|(w, s)| w * s).collect();
        let mut sums = vec![local_dot(&image, &direction.states)];
        sums.extend(first.iter().flat_map(|(coarse, _)| coarse.part_here(&r)));
        here.model.exchange.sum(&mut sums);
        let layer: f64 = spring.iter().zip(&closing).map(|(f, s)| f * s).sum();
        let curvature = sums[0] + layer;
        if let Some((coarse, image)) = first {
            let motion = coarse.motion(&sums[1..]);
            coarse.add(here.model, 1.0, &motion, &mut x);
            let push: Vec<f64> = kappa_weight.iter().zip(x.closing()).map(|(w, s)| -w * s).collect();
            add_rows(here.model, &push, &mut r);
            energy += dot(motion.as_slice(), &sums[1..]);
            rz -= motion.dot(image);
        }
        // p'Gp of the direction is at least r'z: a flat direction has a curvature that is nothing beside it. One of which rigid
        // motions leave nothing but rounding is flat, too
        if curvature.is_nan() || curvature <= 1e-13 * rz {
            if step == 0 && rz > FLAT * here.decrement() {
                x = direction;
            }
            break;
        }
        add_rows(here.model, &spring, &mut image);
        let alpha = rz.max(0.0) / curvature;
        x.add(alpha, &direction);
        energy += alpha * rz;
        let old = r.clone();
        for (r, y) in r.iter_mut().zip(&image) {
            axpy(-alpha, y, r);
        }
        if first.is_none() {
            alphas.push(alpha);
        }
        let last = step + 1 == most;
        if last {
            break;
        }
        let sweep = here.sweeper.precondition(here.model, r, &old)?;
        r = sweep.residual;
        let new: f64 = sweep.decrement.iter().sum();
        let mut z = sweep.correction;
        if let Some(coarse) = &coarse {
            coarse.deflate(here.model, &mut z);
        }
        if new < best.0 {
            best = (new, step);
        }
        // rigid motions that are out of balance by rounding stay so: no direction has a part in them
        let stuck = coarse.is_some() && step - best.1 > STUCK;
        if !new.is_finite() || new <= goal || stuck {
            break;
        }
        // the flexible rule: the preconditioner may be an inexact solve
        if first.is_some() {
            direction = z;
        } else {
            let beta = (new - sweep.product) / rz;
            betas.push(beta.max(0.0));
            direction.add_to(beta, &z);
        }
        rz = new;
    }
    Ok(Solution { x, energy, spectrum: ritz(&alphas, &betas) })
}

/// y += B' `force` in every body that lives here, for forces at the points.
pub(super) fn add_rows(model: &Model, force: &[f64], y: &mut [Vec<f64>]) {
    for (index, y) in y.iter_mut().enumerate() {
        if let Some(body) = &model.bodies[index].local {
            body.add_rows(&model.at_rows(index, force), y);
        }
    }
}

/// Extreme eigenvalues of the Lanczos matrix of a conjugate gradient iteration.
fn ritz(alphas: &[f64], betas: &[f64]) -> Option<(f64, f64)> {
    let n = alphas.len();
    if n == 0 {
        return None;
    }
    let mut t = DMatrix::zeros(n, n);
    for i in 0..n {
        t[(i, i)] = alphas[i].recip() + if i > 0 { betas[i - 1] / alphas[i - 1] } else { 0.0 };
        if i + 1 < n {
            let off = betas.get(i).copied().unwrap_or(0.0).sqrt() / alphas[i];
            t[(i, i + 1)] = off;
            t[(i + 1, i)] = off;
        }
    }
    let values = SymmetricEigen::new(t).eigenvalues;
    let (low, high) = (values.min(), values.max());
    (low > 0.0 && high.is_finite()).then_some((low, high))
}
