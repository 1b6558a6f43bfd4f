//! What a user should know of a pair: overlaps that facets make where they leave their curved surface, and points where the pair ends
//! because its surfaces are farther apart than its largest distance.

use super::pair::ContactPair;
use super::pieces::Intersection;
use super::side::Side;
use crate::fem::{element, minus};
use crate::linalg::{dot, range};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashSet};

/// An overlap of two meshes that is mostly made by their facets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Chords {
    /// Largest distance between a facet where the bodies overlap and its curved surface.
    pub sagitta: f64,
    /// Largest overlap of the contact points.
    pub deepest: f64,
    /// Mean overlap, weighted by the areas of the points, if it is positive.
    pub mean: Option<f64>,
}

/// Difference of the gaps, as a share of the overlap, up to which the gap is uniform. Bodies are stiffer against a gap that changes from facet
/// to facet than against a uniform one, by about the radius over the size of a facet. So a tenth can change pressures by all of their mean.
///
/// On rings in space with six and seven chords on a quarter, an overlap of 0.01 at the radius 2 differs by half of its largest value, and the
/// mean pressure is 1.4 times that of Lame.
const UNIFORM: f64 = 0.1;

impl Chords {
    /// Return the overlap of a pair if its facets make most of it, `None` otherwise.
    ///
    /// A chord adds at most its sagitta s to the overlap of the curved surfaces. If the meshes overlap by o at most, the curved surfaces
    /// overlap by o - s or more, and most of it comes from facets if s > o - s. What facets add differs from point to point: where those of
    /// both surfaces match, the gap is uniform however coarse they are. So it must vary, too.
    ///
    /// Surfaces that touch at a point or along a line overlap as well where their facets do not match, within one facet from there. They are no
    /// fit: on more than half of a fit what facets add is the whole distance, 2 s at most, as that of two facets.
    pub fn of<const D: usize>(a: &Side<D>, b: &Side<D>, common: &Intersection<D>, pair: &ContactPair) -> Option<Self> {
        let [least, most] = range(pair.gap.iter().copied());
        let deepest = -least;
        if deepest <= 0.0 || most - least <= UNIFORM * deepest {
            return None;
        }
        let overlapping = pair.on_side.iter().zip(&pair.gap).filter(|(_, gap)| **gap < 0.0).map(|(&at, _)| at);
        let overlapping: HashSet<u32> = overlapping.collect();
        let mut facets = [HashSet::new(), HashSet::new()];
        for point in &common.points {
            if a.on_facet(point.facet_a).iter().any(|at| overlapping.contains(at)) {
                facets[0].insert(point.facet_a);
                facets[1].insert(point.facet_b);
            }
        }
        let sagitta = largest_sagitta(a, &facets[0]).max(largest_sagitta(b, &facets[1]));
        let area: f64 = pair.weight.iter().sum();
        let mean = -pair.weight.iter().zip(&pair.gap).map(|(w, gap)| w * gap).sum::<f64>() / area;
        let close = pair.weight.iter().zip(&pair.gap).filter(|(_, gap)| gap.abs() <= 2.0 * sagitta);
        let is_fit = 2.0 * close.map(|(w, _)| w).sum::<f64>() > area;
        (is_fit && 2.0 * sagitta > deepest).then_some(Self {
            sagitta,
            deepest,
            mean: Some(mean).filter(|&mean| mean > 0.0),
        })
    }
}

/// Return the largest distance of straight facets from their curved surface.
///
/// The edge from x_i to x_j is a chord. Between its ends the normal of the surface turns from n_i to n_j, so that the parabola over it
/// rises by (n_j - n_i).(x_j - x_i)/8.
fn largest_sagitta<const D: usize>(side: &Side<D>, facets: &HashSet<usize>) -> f64 {
    let mut largest: f64 = 0.0;
    for &facet in facets {
        let x = side.facets.coordinates(facet, side.space);
        if !element::is_straight(&x, D) {
            continue;
        }
        let normals: Vec<[f64; D]> = side.facet_nodes(facet).map(|at| at.normal).collect();
        for i in 0..D {
            for j in i + 1..D {
                largest = largest.max(0.125 * dot(&minus(normals[j], normals[i]), &minus(x[j], x[i])).abs());
            }
        }
    }
    largest
}

/// A contact point on a facet, or beside one, that has no partner or only a part of one, because what lies before it is too far away.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UncoveredPoint {
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

impl UncoveredPoint {
    /// Return the ends of a pair whose facets may be apart by `distance`. `far` are the nodes of facets of side a that were found to be too far
    /// away before the pair was made. `drawn` gives the distance of the meshes at a contact point; with `None` the surfaces touch at any distance.
    pub fn all<const D: usize>(
        a: &Side<D>,
        common: &Intersection<D>,
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
