//! Conjugate gradients for the Newton system (35), preconditioned by the Robin sweep.

use super::Here;
use crate::ddm::field::{Field, apply_stiffness, local_dot};
use crate::error::Result;
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
    let mut direction = z.clone();
    let mut x = z.zero_like();
    let mut energy = 0.0;
    let (mut alphas, mut betas) = (Vec::new(), Vec::new());
    for step in 0..most {
        let mut image = apply_stiffness(here.model, &direction);
        let closing = direction.closing();
        let spring: Vec<f64> = kappa_weight.iter().zip(&closing).map(|(w, s)| w * s).collect();
        let mut stiffness = [local_dot(&image, &direction.states)];
        here.model.exchange.sum(&mut stiffness);
        let layer: f64 = spring.iter().zip(&closing).map(|(f, s)| f * s).sum();
        let curvature = stiffness[0] + layer;
        // p'Gp of the direction is at least r'z: a flat direction has a curvature that is nothing beside it
        if curvature.is_nan() || curvature <= 1e-13 * rz {
            if step == 0 {
                x = direction;
            }
            break;
        }
        for (index, y) in image.iter_mut().enumerate() {
            let rows = here.model.at_rows(index, &spring);
            if let Some(body) = &here.model.bodies[index].local {
                body.add_rows(&rows, y);
            }
        }
        let alpha = rz / curvature;
        x.add(alpha, &direction);
        energy += alpha * rz;
        let old = r.clone();
        for (r, y) in r.iter_mut().zip(&image) {
            crate::linalg::axpy(-alpha, y, r);
        }
        alphas.push(alpha);
        let last = step + 1 == most;
        if last {
            break;
        }
        let sweep = here.sweeper.precondition(here.model, r, &old)?;
        r = sweep.residual;
        let new: f64 = sweep.decrement.iter().sum();
        z = sweep.correction;
        if !new.is_finite() || new <= goal {
            break;
        }
        // the flexible rule: the preconditioner may be an inexact solve
        let beta = (new - sweep.product) / rz;
        betas.push(beta.max(0.0));
        rz = new;
        direction.add_to(beta, &z);
    }
    Ok(Solution { x, energy, spectrum: ritz(&alphas, &betas) })
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
