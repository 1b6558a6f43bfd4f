//! The interval (33) of gamma, in which Theorem 3 promises convergence, from bounds of the spectrum of G^-1 F1''.

use super::cg::{MOST_SWEEPS, conjugate_gradients};
use super::sweep::Sweeper;
use crate::contact::law::Law;
use crate::error::Result;
use crate::model::Model;
use crate::model::field::{DisplacementField, zero};
use crate::model::layer::Layer;
use crate::model::linear::Trial;
use crate::model::motions::Motions;

/// Bounds of F1'' in the norm of the Robin form G over the level set {F1 <= F1(u0)} of the start u0, which an iteration
/// that descends never leaves: `lower` G <= F1'' <= `upper` G. A layer has such constants on bounded ranges only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// B_Phi of Theorem 3; zero if nothing but contact, which may open, holds a body.
    pub lower: f64,
    /// D_Phi.
    pub upper: f64,
}

impl Interval {
    /// Return 2 gamma* = 2 B_Phi B_G / D_Phi^2 of (33), the end of the interval that begins at zero. In the norm of G,
    /// B_G is one.
    pub fn theorem(&self) -> f64 {
        2.0 * self.lower / (self.upper * self.upper)
    }

    /// Return 2 / D_Phi. With a smaller gamma, F1 falls in every step. This uses that F1' is a gradient, which the
    /// theorem does not.
    pub fn descent(&self) -> f64 {
        2.0 / self.upper
    }
}

/// Relative error of the solution of a Lanczos iteration after which the extreme eigenvalues have settled: a mode that
/// it has not seen has no more than this share of the solution.
const SEEN: f64 = 1e-9;
/// Parts of a range of compressions at whose ends the tangent is evaluated, for laws that neither stiffen nor soften
/// all the way. A bend narrower than one part may be missed; the interval is reported, and no iteration depends on it.
const PARTS: usize = 32;
/// Accuracy of the ends of a range, relative to the excess, which is a difference of energies with sixteen digits.
const DIGITS: f64 = 1e-13;

/// Return the interval at a solution with this `layer`, for the Robin term that the model carries; none if the
/// eigenvalues cannot be found. `excess` is F1(u0) - F1 of the solution. Collective: solves with G.
pub fn interval(model: &mut Model, layer: &Layer, excess: f64) -> Result<Option<Interval>> {
    let (mut least, mut most) = (Vec::new(), Vec::new());
    for (q, pair, point) in model.each_point() {
        let weight = model.area[q];
        let [low, high] = tangents(&pair.law, point, layer.compression[q], excess.max(0.0) / weight);
        least.push(weight * low);
        most.push(weight * high);
    }
    let Some((_, upper)) = extremes(model, &most)? else { return Ok(None) };
    let motions = Motions::of(model);
    let is_held = motions.springs(&least).factor().rank() == motions.count();
    let lower = if is_held { extremes(model, &least)?.map_or(0.0, |(low, _)| low) } else { 0.0 };
    // displacements without a trace have the eigenvalue one
    Ok(Some(Interval { lower: lower.min(1.0), upper: upper.max(1.0) }))
}

/// Return the extreme eigenvalues of G^-1 (K + B' diag(`springs`) B), springs at the points (n), among the
/// displacements that forces on the contact rows cause. Every mode has a part in these forces: multiples of the golden
/// ratio spread evenly over (0, 1) without a period.
fn extremes(model: &mut Model, springs: &[f64]) -> Result<Option<(f64, f64)>> {
    let (points, mut load) = (model.points(), DisplacementField::zero(model).displacements);
    let force = |i: usize| model.area[i % points] * (0.1 + (0.618_033_988_749_895 * (i + 1) as f64).fract());
    let rows: Vec<f64> = (0..2 * points).map(force).collect();
    for (index, body) in model.locals() {
        body.dofs().rows.add_transpose(1.0, &model.of_body(index, &rows), &mut load[index]);
    }
    let mut enough = |_: &Model, trial: &Trial| trial.is_within(SEEN);
    let found =
        conjugate_gradients(model, &mut Sweeper::default(), springs, &load, (&mut enough, MOST_SWEEPS), f64::INFINITY)?;
    Ok(found.ok().and_then(|(_, lanczos)| lanczos.spectrum()))
}

/// Return the least and the largest p' at a point over the compressions that it can have in the level set, if it has c
/// at the solution. F1 is convex, and its excess over the minimum is at least that of any one point alone: with the
/// law's energy P and pressure p per area, P(c) - P(c0) - p(c0) (c - c0) <= `excess`, also per area.
fn tangents(law: &Law, point: usize, c: f64, excess: f64) -> [f64; 2] {
    let (pressure, energy, excess) = (law.pressure(point, c), law.energy(point, c), excess * (1.0 + DIGITS));
    let rise = |other: f64| law.energy(point, other) - energy - pressure * (other - c);
    // below zero, a compression has no energy: all open states are the same
    let (first, can_open) = if law.is_bonded() { (c, false) } else { (c.max(0.0), c <= 0.0 || rise(0.0) <= excess) };
    let way = |side: f64| {
        let beyond = |way: f64| rise(first + side * way) - excess;
        zero(beyond, beyond(0.0), DIGITS).unwrap_or(f64::INFINITY)
    };
    let (low, high) = (if can_open { 0.0 } else { c - way(-1.0) }, first + way(1.0));
    let all = (0..=PARTS).map(|i| law.pressure_and_tangent(point, low + (high - low) * i as f64 / PARTS as f64).1);
    all.fold([f64::INFINITY, 0.0], |[least, most], k| [least.min(k), f64::max(most, k)])
}
