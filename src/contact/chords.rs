//! How far straight facets leave the curved surface that they stand for.

use super::pair::ContactPair;
use super::pieces::Common;
use super::side::Side;
use crate::fem::{element, minus};
use crate::linalg::dot;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

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
    pub fn of<const D: usize>(a: &Side<D>, b: &Side<D>, common: &Common<D>, pair: &ContactPair) -> Option<Self> {
        let least = pair.gap.iter().copied().fold(f64::INFINITY, f64::min);
        let most = pair.gap.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let deepest = -least;
        if deepest <= 0.0 || most - least <= UNIFORM * deepest {
            return None;
        }
        let overlapping = pair.nodes.iter().zip(&pair.gap).filter(|(_, gap)| **gap < 0.0).map(|(&node, _)| node);
        let overlapping: HashSet<u32> = overlapping.collect();
        let mut facets = [HashSet::new(), HashSet::new()];
        for point in &common.points {
            if a.facets.facet(point.facet_a).iter().any(|node| overlapping.contains(node)) {
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
        let normals: Vec<[f64; D]> = side.facets.facet(facet)[..D].iter().map(|node| side.normals[node]).collect();
        for i in 0..D {
            for j in i + 1..D {
                largest = largest.max(0.125 * dot(&minus(normals[j], normals[i]), &minus(x[j], x[i])).abs());
            }
        }
    }
    largest
}
