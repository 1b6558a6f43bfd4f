//! Pairs whose error of the pressures is a guess, since the mesh does not show how they vary.

use super::rim::RimError;
use super::square::square;
use crate::discretize::meshes::{FinePoints, Meshes};
use crate::model::{Layer, Model};

/// A reason why the estimated error of a pair's pressures is a guess, and a place.
#[derive(Debug, Clone, Copy)]
pub struct Guess {
    /// The reason.
    pub cause: Cause,
    /// The place in the scene.
    pub place: [f64; 3],
}

/// The reasons for a guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Most of the error is at an edge of the contact, where pressures may be singular. The place is that of the largest part.
    Rim,
    /// Contact ends within the facets that carry most of the pressure, so that they do not show how it varies. The place is that of the peak.
    FewFacets,
}

/// Relative error of the pressures below which an error at rims is no guess: a hundred times the default tolerance of the iteration, at
/// which differences within a facet are those of an unfinished iteration.
const UNFINISHED: f64 = 1e-6;

/// Least share of the squared pressure that facets in contact as a whole carry where a mesh resolves the contact. With p^2 = 1 - r^2 of a contact of
/// Hertz with the radius one, those within 1 - h carry 1 - (1 - (1 - h)^2)^2, a half for a radius of 2.2 facets. On the parts of docs/theory.md,
/// the estimates of contacts with less were 0.6 to 4.6 times the true error.
const RESOLVED: f64 = 0.5;

/// Return for each pair whether its estimated error is a guess. `error` has the errors of the pressures, n, and `rims` those at rims.
pub(super) fn of_pairs(
    meshes: &dyn Meshes,
    model: &Model,
    layer: &Layer,
    error: &[f64],
    rims: &[RimError],
) -> Vec<Option<Guess>> {
    let of_pair = |(pair, rim): (usize, &RimError)| {
        let least = UNFINISHED.powi(2) * square(model, pair, &layer.pressure);
        let position = &model.pairs[pair].position;
        if rim.squared > square(model, pair, error).max(least) {
            return Some(Guess { cause: Cause::Rim, place: position[rim.worst] });
        }
        let pressure = &layer.pressure[model.range(pair)];
        let is_resolved = share_of_whole_facets(&meshes.points(pair), pressure) >= RESOLVED;
        let peak = (0..pressure.len()).max_by(|&p, &q| pressure[p].total_cmp(&pressure[q]))?;
        (!is_resolved).then(|| Guess { cause: Cause::FewFacets, place: position[peak] })
    };
    rims.iter().enumerate().map(of_pair).collect()
}

/// Return the share of the squared pressure at integration points between contact points that are all under pressure, one if there is no pressure.
/// `pressure` has the pressures of the pair's contact points.
fn share_of_whole_facets(points: &FinePoints, pressure: &[f64]) -> f64 {
    let (mut whole, mut all) = (0.0, 0.0);
    for (g, weight) in points.weight.iter().enumerate() {
        let carriers = || points.interpolation.row(g);
        let value: f64 = carriers().map(|(q, share)| share * pressure[q]).sum();
        all += weight * value * value;
        if carriers().all(|(q, _)| pressure[q] > 0.0) {
            whole += weight * value * value;
        }
    }
    if all > 0.0 { whole / all } else { 1.0 }
}
