//! Bounds of the spectrum of G^-1 F1'' from the directions that a method went along.

use crate::model::Model;
use crate::model::field::{Field, apply_stiffness, local_dot};
use crate::model::layer::Layer;
use nalgebra::{DMatrix, SymmetricEigen};

/// Directions kept: the oldest ones, which hold the modes that die first, and the newest, which hold the slow ones.
const MOST: usize = 12;

/// How many of them are the oldest.
const OLDEST: usize = 4;

/// Share of a direction that must be new; what is less is rounding.
const NEW: f64 = 1e-8;

/// Rayleigh-Ritz values on the span of some directions.
///
/// Only their products with K are kept: F1'' and G differ from it by springs at the contact points, so their values are those
/// of the iterate that is asked for, whatever the contact was when a direction came. They lie inside the spectrum.
#[derive(Debug, Default)]
pub struct Ritz {
    fields: Vec<Field>,
    /// v_i'K v_j of the bodies that live here, i <= j.
    stiffness: Vec<Vec<f64>>,
    bounds: Option<(f64, f64)>,
}

impl Ritz {
    /// Takes a direction in. No message.
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

    /// Smallest and largest value for an iterate with this `layer` and Robin term `weight` = omega psi kappa. One message.
    pub fn bounds(&mut self, model: &Model, layer: &Layer, weight: &[f64]) -> Option<(f64, f64)> {
        let tangent: Vec<f64> = model.weight.iter().zip(&layer.tangent).map(|(w, k)| w * k).collect();
        self.bounds = self.extremes(model, &tangent, weight);
        self.bounds
    }

    /// What [`Ritz::bounds`] gave last.
    pub fn known(&self) -> Option<(f64, f64)> {
        self.bounds
    }

    /// Extreme Ritz values of G^-1 (K + B' diag(`spring`) B).
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

/// Extreme eigenvalues of A x = lambda B x for symmetric A and positive semidefinite B, in the directions that B knows; none if
/// they are not positive and finite.
fn pencil(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<(f64, f64)> {
    // directions shrink as a method converges: they are compared at length one
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
    // a is symmetric; sums of products are the same on all processors, which `*` of large matrices is not
    let values = SymmetricEigen::new(basis.tr_mul(&a.tr_mul(&basis))).eigenvalues;
    let (low, high) = (values.min(), values.max());
    (low > 0.0 && high.is_finite()).then_some((low, high))
}
