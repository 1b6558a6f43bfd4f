//! Bounds of the spectrum of G^-1 F1'' from the directions that a method has taken.

use crate::model::Model;
use crate::model::field::{Field, apply_stiffness, local_dot};
use crate::model::layer::Layer;
use nalgebra::{DMatrix, SymmetricEigen};

/// Directions kept: the oldest ones, which contain the modes that decay first, and the newest, which contain the slow ones.
const MOST: usize = 12;

/// How many of them are the oldest.
const OLDEST: usize = 4;

/// Share of a direction that must be linearly independent of the others; less is rounding.
const NEW: f64 = 1e-8;

/// Rayleigh-Ritz values on the span of some directions. They lie inside the spectrum.
///
/// Only products of the directions with K are kept, because F1'' and G differ from K by springs at the contact points. So the values can be
/// computed for any iterate, whatever the contact was when a direction was taken.
#[derive(Debug, Default)]
pub struct Ritz {
    fields: Vec<Field>,
    /// v_i'K v_j of the bodies that live on this rank: row j has the entries i <= j.
    stiffness: Vec<Vec<f64>>,
    /// Values that were computed last.
    bounds: Option<(f64, f64)>,
}

impl Ritz {
    /// Add a direction. No message.
    pub fn observe(&mut self, model: &mut Model, v: &Field) {
        if self.fields.len() == MOST {
            self.fields.remove(OLDEST);
            self.stiffness.remove(OLDEST);
            for row in &mut self.stiffness[OLDEST..] {
                row.remove(OLDEST);
            }
        }
        let image = apply_stiffness(model, v);
        self.fields.push(v.clone());
        self.stiffness.push(self.fields.iter().map(|field| local_dot(&field.states, &image)).collect());
    }

    /// Compute the smallest and the largest value for an iterate with this `layer` and Robin term `weight` = omega psi kappa (2n). One message.
    pub fn bounds(&mut self, model: &Model, layer: &Layer, weight: &[f64]) -> Option<(f64, f64)> {
        let tangent: Vec<f64> = model.weight.iter().zip(&layer.tangent).map(|(w, k)| w * k).collect();
        self.bounds = self.extremes(model, &tangent, weight);
        self.bounds
    }

    /// Return the last result of [`Ritz::bounds`].
    pub fn known(&self) -> Option<(f64, f64)> {
        self.bounds
    }

    /// Return the extreme Ritz values of G^-1 (K + B' diag(`spring`) B) with `spring` = omega kappa (n).
    fn extremes(&self, model: &Model, spring: &[f64], weight: &[f64]) -> Option<(f64, f64)> {
        let n = self.fields.len();
        if n < 2 {
            return None;
        }
        let mut sums = self.stiffness.concat();
        model.exchange.sum(&mut sums);
        let stiffness = |i: usize, j: usize| {
            let (row, column) = (i.max(j), i.min(j));
            sums[row * (row + 1) / 2 + column]
        };
        let closing: Vec<Vec<f64>> = self.fields.iter().map(Field::closing).collect();
        let springs = |weight: &[f64], v: &[f64], w: &[f64]| -> f64 {
            weight.iter().zip(v).zip(w).map(|((weight, v), w)| weight * v * w).sum()
        };
        let traces = |i: usize, j: usize| springs(weight, &self.fields[i].trace, &self.fields[j].trace);
        let gram = DMatrix::from_fn(n, n, |i, j| stiffness(i, j) + traces(i, j));
        let form = DMatrix::from_fn(n, n, |i, j| stiffness(i, j) + springs(spring, &closing[i], &closing[j]));
        pencil(&form, &gram)
    }
}

/// Return the extreme eigenvalues of A x = lambda B x for symmetric A and positive semidefinite B, in the range of B; none if they are not
/// positive and finite.
fn pencil(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<(f64, f64)> {
    // directions shrink as a method converges: scale them to length one
    let kept: Vec<usize> = (0..b.nrows()).filter(|&i| b[(i, i)] > 0.0 && b[(i, i)].is_finite()).collect();
    let scaled = |m: &DMatrix<f64>| {
        DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            let (i, j) = (kept[i], kept[j]);
            m[(i, j)] / b[(i, i)].sqrt() / b[(j, j)].sqrt()
        })
    };
    let (a, b) = (scaled(a), scaled(b));
    if kept.is_empty() || a.iter().chain(b.iter()).any(|value| !value.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(b);
    let largest = eigen.eigenvalues.max();
    let new: Vec<usize> = (0..kept.len()).filter(|&i| eigen.eigenvalues[i] > NEW * largest).collect();
    if new.is_empty() {
        return None;
    }
    let basis = DMatrix::from_fn(kept.len(), new.len(), |i, j| {
        eigen.eigenvectors[(i, new[j])] / eigen.eigenvalues[new[j]].sqrt()
    });
    // a is symmetric, so a' = a; sums of products are the same on all processors, while `*` of large matrices is not
    let values = SymmetricEigen::new(basis.tr_mul(&a.tr_mul(&basis))).eigenvalues;
    let (low, high) = (values.min(), values.max());
    (low > 0.0 && high.is_finite()).then_some((low, high))
}
