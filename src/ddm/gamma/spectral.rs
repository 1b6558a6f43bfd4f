//! The best stationary gamma, from bounds of the spectrum of G^-1 F1'' that are estimated during the run.

use super::{GammaRule, Here, LineSearch, Unbounded};
use crate::ddm::field::local_dot;
use nalgebra::{DMatrix, SymmetricEigen};
use std::collections::VecDeque;

/// Ritz values of G^-1 F1'' from the iterates of a relaxed iteration.
///
/// While contact stands still, z_{j+1} = (I - gamma_j G^-1 F1'') z_j: the corrections span a Krylov space. With r_j = G z_j the
/// products r_i'z_j give the Gram matrix of that space and its image, and a small eigenproblem the Ritz values.
#[derive(Debug)]
pub struct Lanczos {
    depth: usize,
    /// Oldest first.
    steps: VecDeque<Stored>,
    /// r_i'z_j of the stored steps.
    gram: VecDeque<VecDeque<f64>>,
    bounds: Option<(f64, f64)>,
}

#[derive(Debug)]
struct Stored {
    residual: Vec<Vec<f64>>,
    gamma: f64,
}

impl Lanczos {
    /// Keeps `depth` corrections.
    pub fn new(depth: usize) -> Self {
        Self { depth, steps: VecDeque::new(), gram: VecDeque::new(), bounds: None }
    }

    /// Takes the sweep at an iterate in, before its gamma is known.
    pub fn observe(&mut self, here: &Here) {
        let (r, z) = (&here.sweep.residual, &here.sweep.correction.states);
        let mut products: Vec<f64> = self.steps.iter().map(|step| local_dot(&step.residual, z)).collect();
        products.push(local_dot(r, z));
        here.model.exchange.sum(&mut products);
        if self.steps.len() == self.depth {
            self.steps.pop_front();
            self.gram.pop_front();
            for row in &mut self.gram {
                row.pop_front();
            }
            products.remove(0);
        }
        for (row, product) in self.gram.iter_mut().zip(&products) {
            row.push_back(*product);
        }
        self.gram.push_back(products.into());
        self.steps.push_back(Stored { residual: r.clone(), gamma: f64::NAN });
        if let Some(bounds) = self.ritz() {
            self.bounds = Some(bounds);
        }
    }

    /// Notes the gamma that followed the last sweep.
    pub fn took(&mut self, gamma: f64) {
        if let Some(last) = self.steps.back_mut() {
            last.gamma = gamma;
        }
    }

    /// Smallest and largest Ritz value seen last.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        self.bounds
    }

    fn ritz(&self) -> Option<(f64, f64)> {
        let n = self.steps.len().checked_sub(1).filter(|&n| n >= 2)?;
        // corrections shrink: scaled to norm one before they are compared
        let scale: Vec<f64> = (0..=n).map(|i| self.gram[i][i].sqrt().recip()).collect();
        let product = |i: usize, j: usize| {
            let (row, column) = (i.min(j), i.max(j));
            self.gram[row][column] * scale[i] * scale[j]
        };
        let gram = DMatrix::from_fn(n, n, product);
        let image = DMatrix::from_fn(n, n, |i, j| {
            let next = self.gram[i.min(j + 1)][i.max(j + 1)] * scale[i] * scale[j];
            (product(i, j) - next) / self.steps[j].gamma
        });
        let image = 0.5 * (&image + image.transpose());
        // directions that rounding has made dependent are left out
        let eigen = SymmetricEigen::new(gram);
        let largest = eigen.eigenvalues.max();
        let kept: Vec<usize> = (0..n).filter(|&i| eigen.eigenvalues[i] > 1e-8 * largest).collect();
        let basis = DMatrix::from_fn(n, kept.len(), |i, j| {
            eigen.eigenvectors[(i, kept[j])] / eigen.eigenvalues[kept[j]].sqrt()
        });
        let values = SymmetricEigen::new(basis.transpose() * image * &basis).eigenvalues;
        let (low, high) = (values.min(), values.max());
        (low > 0.0 && high.is_finite()).then_some((low, high))
    }
}

/// gamma = 2 / (lambda_min + lambda_max) of the estimated bounds; exact line searches until there are some.
#[derive(Debug)]
pub struct Spectral {
    lanczos: Lanczos,
    last: Option<(f64, usize)>,
}

impl Default for Spectral {
    fn default() -> Self {
        Self { lanczos: Lanczos::new(6), last: None }
    }
}

impl GammaRule for Spectral {
    fn gamma(&mut self, here: &mut Here) -> Result<f64, Unbounded> {
        self.lanczos.observe(here);
        // a residual that grows, or contact that moves, makes the estimate one of the past
        let steady =
            self.last.is_some_and(|(residual, closed)| here.residual < residual && here.layer.closed == closed);
        self.last = Some((here.residual, here.layer.closed));
        let gamma = match self.lanczos.bounds() {
            Some((low, high)) if steady && here.k > 5 => 2.0 / (low + high),
            _ => LineSearch.gamma(here)?,
        };
        self.lanczos.took(gamma);
        Ok(gamma)
    }

    fn spectrum(&self) -> Option<(f64, f64)> {
        self.lanczos.bounds()
    }
}
