//! The coarse space of conjugate gradients over the bodies: the rigid motions E that supports leave free, deflated.
//!
//! With H = F1'' and A = E'HE, a correction z = G^-1 r of the sweep becomes (I - E A^+ E'H) z: what is left of it when whole bodies
//! have moved so that they are in balance again. Without that, the news of a body out of balance passes along a chain of bodies by
//! one a sweep. As K E = 0, E'H and A are sums over contact points, which every rank knows: no message, no solve.

use super::field::Field;
use super::joint::Joint;
use super::model::Model;
use crate::linalg::{axpy, dot, fit};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Share of the largest eigenvalue of A, scaled to ones on its diagonal, below which contact does not resist a motion.
const FREE: f64 = 1e-7;

/// E and A^+ for springs at the contact points. Motions are numbered through body by body.
pub struct Coarse<'a> {
    /// First motion of each body.
    first: Vec<usize>,
    /// For each body that lives here, each of its motions as the end of a state.
    amounts: Vec<Vec<Vec<f64>>>,
    weight: &'a [f64],
    inverse: DMatrix<f64>,
}

impl<'a> Coarse<'a> {
    /// For springs `weight` = omega kappa at the points; none if supports hold all bodies.
    pub fn new(model: &Model, weight: &'a [f64]) -> Option<Self> {
        let joint = Joint::of(model);
        if joint.count() == 0 {
            return None;
        }
        let amounts = model.bodies.iter().map(|slot| match slot.local.as_ref().and_then(|body| body.matrices()) {
            Some(matrices) => slot.motions.iter().map(|motion| fit(matrices.traces, &motion.trace)).collect(),
            None => Vec::new(),
        });
        let inverse = pseudo_inverse(&joint.stiffness(weight));
        let first = (0..model.bodies.len()).map(|body| joint.of_body(body).start).collect();
        Some(Self { amounts: amounts.collect(), first, weight, inverse })
    }

    /// The part of E'r of the bodies that live here; the caller exchanges.
    pub fn part_here(&self, r: &[Vec<f64>]) -> Vec<f64> {
        let mut part = vec![0.0; self.inverse.nrows()];
        for (body, amounts) in self.amounts.iter().enumerate() {
            for (amounts, part) in amounts.iter().zip(&mut part[self.first[body]..]) {
                *part = dot(amounts, &r[body][r[body].len() - amounts.len()..]);
            }
        }
        part
    }

    /// A^+ `load`: how far bodies move under a load E'r.
    pub fn motion(&self, load: &[f64]) -> DVector<f64> {
        &self.inverse * DVector::from_column_slice(load)
    }

    /// v += s E `motion`.
    pub fn add(&self, model: &Model, s: f64, motion: &DVector<f64>, v: &mut Field) {
        let mut trace = vec![0.0; v.trace.len()];
        for (body, slot) in model.bodies.iter().enumerate() {
            let mut rows = vec![0.0; slot.row_stiffness.len()];
            let own = &motion.as_slice()[self.first[body]..];
            slot.motions.iter().zip(own).for_each(|(m, &a)| axpy(s * a, &m.trace, &mut rows));
            model.put(body, &rows, &mut trace);
            for (amounts, &a) in self.amounts[body].iter().zip(own) {
                let state = &mut v.states[body];
                let end = state.len() - amounts.len();
                axpy(s * a, amounts, &mut state[end..]);
            }
        }
        axpy(1.0, &trace, &mut v.trace);
    }

    /// z <- (I - E A^+ E'H) z; returns E'H z of the old one.
    pub fn deflate(&self, model: &Model, z: &mut Field) -> DVector<f64> {
        let spring: Vec<f64> = self.weight.iter().zip(z.closing()).map(|(w, s)| w * s).collect();
        let each = model.bodies.iter().enumerate().flat_map(|(body, slot)| {
            let rows = model.at_rows(body, &spring);
            slot.motions.iter().map(move |motion| dot(&rows, &motion.trace))
        });
        let image = DVector::from_iterator(self.inverse.nrows(), each);
        self.add(model, -1.0, &self.motion(image.as_slice()), z);
        image
    }
}

/// The pseudo-inverse of a positive semidefinite matrix whose rows may differ much in size.
fn pseudo_inverse(form: &DMatrix<f64>) -> DMatrix<f64> {
    let n = form.nrows();
    let scale: Vec<f64> = (0..n).map(|i| if form[(i, i)] > 0.0 { form[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| scale[i] * form[(i, j)] * scale[j]);
    let eigen = SymmetricEigen::new(scaled);
    let largest = eigen.eigenvalues.max();
    let inverse = |value: f64| if value > FREE * largest { value.recip() } else { 0.0 };
    let vectors = DMatrix::from_fn(n, n, |i, j| scale[i] * eigen.eigenvectors[(i, j)]);
    let values = DMatrix::from_diagonal(&eigen.eigenvalues.map(inverse));
    &vectors * values * vectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two springs 1e4 and 1 in a chain whose last body is free have an inverse; a body without any is left out.
    #[test]
    fn pseudo_inverses() {
        let chain = DMatrix::from_row_slice(2, 2, &[1e4 + 1.0, -1.0, -1.0, 1.0]);
        let error = (&chain * pseudo_inverse(&chain) - DMatrix::identity(2, 2)).amax();
        assert!(error < 1e-9, "{error}");
        let floating = DMatrix::from_row_slice(3, 3, &[2.0, -2.0, 0.0, -2.0, 2.0, 0.0, 0.0, 0.0, 0.0]);
        let inverse = pseudo_inverse(&floating);
        let expected = DMatrix::from_row_slice(3, 3, &[0.125, -0.125, 0.0, -0.125, 0.125, 0.0, 0.0, 0.0, 0.0]);
        assert!((inverse - expected).amax() < 1e-14);
    }
}
