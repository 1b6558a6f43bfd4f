//! Bounds of the spectrum of G^-1 F1'': the interval (33) of gamma in which Theorem 3 promises convergence, and estimates from the directions that a
//! method has taken.

use super::sweep::Sweeper;
use super::sweeps::gradients;
use crate::contact::law::LayerLaw;
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{Field, apply_stiffness, local_dot, zero};
use crate::model::layer::Layer;
use crate::model::linear::Trial;
use crate::model::rigid::Motions;
use nalgebra::{DMatrix, SymmetricEigen};

/// Bounds of F1'' in the norm of the Robin form G over a level set: `lower` G <= F1'' <= `upper` G.
///
/// The theorem asks for constants of F1' over all displacements. A layer has such constants on bounded ranges only. So they are taken over
/// the level set {F1 <= F1(u0)} of the start u0, which an iteration that descends never leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// B_Phi of Theorem 3; zero if nothing but contact, which may open, holds a body.
    pub lower: f64,
    /// D_Phi.
    pub upper: f64,
}

impl Interval {
    /// Return 2 gamma* = 2 B_Phi B_G / D_Phi^2 of (33), the end of the interval that begins at zero. In the norm of G, B_G is one.
    pub fn theorem(&self) -> f64 {
        2.0 * self.lower / (self.upper * self.upper)
    }

    /// Return 2 / D_Phi. With a smaller gamma, F1 falls in every step. This uses that F1' is a gradient, which the theorem does not.
    pub fn descent(&self) -> f64 {
        2.0 / self.upper
    }
}

/// Most steps of a Lanczos iteration.
const MOST: usize = 300;

/// Parts of a range of compressions at whose ends the tangent is evaluated, for laws that neither stiffen nor soften all the way.
const PARTS: usize = 32;

/// Return the interval at a solution with this `layer`, for the Robin term that the model carries; none if the eigenvalues cannot be found.
/// `excess` is F1(u0) - F1 of the solution. Collective: solves with G.
pub fn interval(model: &mut Model, layer: &Layer, excess: f64) -> Result<Option<Interval>> {
    let (mut least, mut most) = (vec![0.0; model.points()], vec![0.0; model.points()]);
    for (i, pair) in model.pairs.iter().enumerate() {
        for q in model.range(i) {
            let point = q - model.offset[i];
            let (low, high) = range(&*pair.law, point, layer.compression[q], excess.max(0.0) / model.weight[q]);
            (least[q], most[q]) = tangents(&*pair.law, point, low, high);
        }
    }
    let start = loads(model);
    let Some((_, upper)) = spectrum(model, &most, &start)? else { return Ok(None) };
    let springs = model.forces(&least);
    let motions = Motions::of(model);
    let lower = match motions.springs(&springs).factor().rank() < motions.count() {
        true => 0.0,
        false => spectrum(model, &least, &start)?.map_or(0.0, |(low, _)| low),
    };
    // displacements without a trace have the eigenvalue one
    Ok(Some(Interval { lower: lower.min(1.0), upper: upper.max(1.0) }))
}

/// Relative error of the solution of a system after which the extreme eigenvalues have settled.
const SETTLED: f64 = 1e-9;

/// Return the extreme eigenvalues of G^-1 (K + B' diag(omega slope) B) among the displacements that loads on the contact rows cause, with the
/// Robin term that the model carries. `slope` has one entry a point, n; `load` is a state of each body.
fn spectrum(model: &mut Model, slope: &[f64], load: &[Vec<f64>]) -> Result<Option<(f64, f64)>> {
    let springs = model.forces(slope);
    let mut enough = |_: &Model, trial: &Trial| trial.is_within(SETTLED);
    let found = gradients(model, &mut Sweeper::default(), &springs, load, (&mut enough, MOST), f64::INFINITY)?;
    Ok(found.ok().and_then(|found| found.spectrum))
}

/// Return forces on the contact rows in which every mode has a part, as a state of each body that lives on this rank.
fn loads(model: &Model) -> Vec<Vec<f64>> {
    let points = model.points();
    // multiples of the golden ratio spread evenly over (0, 1) without a period
    let pressure = |i: usize| 0.1 + (0.618_033_988_749_895 * (i + 1) as f64).fract();
    let rows: Vec<f64> = (0..2 * points).map(|i| model.weight[i % points] * pressure(i)).collect();
    let mut loads: Vec<Vec<f64>> = Vec::new();
    for (index, slot) in model.bodies.iter().enumerate() {
        let mut load = vec![0.0; slot.local.as_ref().map_or(0, |body| body.states().size())];
        if let Some(body) = slot.local.as_ref() {
            body.states().add_rows(1.0, &model.of_body(index, &rows), &mut load);
        }
        loads.push(load);
    }
    loads
}

/// Accuracy of the ends of a range, relative to the excess, which is a difference of energies with sixteen digits. The range is taken larger
/// by this, so that it ends outside of the level set.
const DIGITS: f64 = 1e-13;

/// Return the least and the largest compression that a point can have in the level set, if it has c at the solution. F1 is convex, and its
/// excess over the minimum is at least that of any one point alone: with the law's energy P and pressure p per area,
/// P(c) - P(c0) - p(c0) (c - c0) <= `excess`, also per area.
fn range(law: &dyn LayerLaw, point: usize, c: f64, excess: f64) -> (f64, f64) {
    let (here, excess) = (law.response(point, c), excess * (1.0 + DIGITS));
    let rise = |other: f64| law.response(point, other).energy - here.energy - here.pressure * (other - c);
    // below zero, a compression has no energy: all open states are the same
    let (first, can_open) = (c.max(0.0), c <= 0.0 || rise(0.0) <= excess);
    let way = |side: f64| {
        let beyond = |way: f64| rise(first + side * way) - excess;
        zero(beyond, beyond(0.0), DIGITS).unwrap_or(f64::INFINITY)
    };
    let low = if can_open { 0.0 } else { c - way(-1.0) };
    (low, first + way(1.0))
}

/// Return the least and the largest p' over the compressions from `low` to `high`.
fn tangents(law: &dyn LayerLaw, point: usize, low: f64, high: f64) -> (f64, f64) {
    let compressions = (0..=PARTS).map(|i| low + (high - low) * i as f64 / PARTS as f64);
    let all = compressions.map(|c| law.response(point, c).tangent);
    all.fold((f64::INFINITY, 0.0), |(least, most), k| (least.min(k), f64::max(most, k)))
}

/// Directions kept: the oldest ones, which contain the modes that decay first, and the newest, which contain the slow ones.
const KEPT: usize = 12;

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
        if self.fields.len() == KEPT {
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
        let springs =
            |weight: &[f64], v: &[f64], w: &[f64]| -> f64 { (0..weight.len()).map(|i| weight[i] * v[i] * w[i]).sum() };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::{LinearLaw, Power};

    /// The energy of a linear layer exceeds its minimum by k (c - c0)^2/2.
    #[test]
    fn ranges_of_a_linear_layer() {
        let law = LinearLaw { stiffness: 4.0 };
        let (low, high) = range(&law, 0, 3.0, 8.0);
        assert!((low - 1.0).abs() < 1e-12 && (high - 5.0).abs() < 1e-12, "{low} {high}");
        assert_eq!(tangents(&law, 0, low, high), (4.0, 4.0));
        // with 18 it may open: k 3^2/2
        let (low, high) = range(&law, 0, 3.0, 18.1);
        assert!(low == 0.0 && high > 6.0);
        assert_eq!(tangents(&law, 0, low, high), (0.0, 4.0));
        // an open point closes by k c^2/2
        let (low, high) = range(&law, 0, -7.0, 8.0);
        assert!(low == 0.0 && (high - 2.0).abs() < 1e-12);
    }

    /// (c/B)^2 from c0 = 0: the energy is c^3/(3 B^2), the largest tangent 2 c/B^2.
    #[test]
    fn a_layer_that_stiffens() {
        let law = Power::new(0.5, 0.5);
        let (low, high) = range(&law, 0, 0.0, 36.0);
        assert!((high - 3.0).abs() < 1e-12);
        let (least, most) = tangents(&law, 0, low, high);
        assert!(least == 0.0 && (most - 24.0).abs() < 1e-10);
    }
}
