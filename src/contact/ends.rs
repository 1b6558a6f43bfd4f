//! Contact points where a pair ends because its surfaces are farther apart than its largest distance.

use super::pair::ContactPair;
use super::pieces::Common;
use super::side::Side;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A contact point on a facet, or beside one, that has no partner or only a part of one, because what lies before it is too far away.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// Index of the contact point.
    pub point: usize,
    /// Compression of the layer from which the contact probably goes on where the pair has ended.
    pub compression: f64,
}

/// Approach of the surfaces, as a share of the largest distance of the pair, from which a contact at the end of the pair goes on beyond it.
///
/// On a curved surface the distance at an end is nearly the largest one. It grows with the square of the place r, and the end is within a facet
/// of size h from the largest distance: its share is (r/(r + h))^2 or more, which is a half if r is 2.4 facets. So every contact of three facets
/// that reaches the end counts. At a step of the surface the distance at the end is less, and the surfaces have to approach by all of the step,
/// which is more than the largest distance, until what lies beyond touches. Spheres whose contact ends where they are 0.02 apart are
/// found with largest distances from 0.004 to 0.016, on elements of both orders (`tests/geometry/ends.rs`).
const NEARLY: f64 = 0.5;

impl End {
    /// Return the ends of a pair whose facets may be apart by `distance`. `far` are the nodes of facets of side a that were found to be too far
    /// away before the pair was made. `drawn` gives the distance of the meshes at a contact point; with `None` the surfaces touch at any distance.
    pub fn all<const D: usize>(
        a: &Side<D>,
        common: &Common<D>,
        pair: &ContactPair,
        far: &BTreeSet<u32>,
        distance: f64,
        drawn: Option<&dyn Fn(usize) -> f64>,
    ) -> Vec<Self> {
        let ends: BTreeSet<u32> = common.far().flat_map(|(i, _)| a.facets.facet(i).iter().copied()).collect();
        let is_end = |point: &usize| [&ends, far].iter().any(|nodes| nodes.contains(&pair.nodes[*point]));
        let compression = |point: usize| drawn.map_or(0.0, |drawn| (NEARLY * distance - drawn(point)).max(0.0));
        (0..pair.len()).filter(is_end).map(|point| Self { point, compression: compression(point) }).collect()
    }
}
