//! What a user should know of a pair: how far straight facets leave curved surfaces, and where the pair ends because
//! its surfaces are farther apart than its largest distance.

use super::pair::ContactPair;
use super::pieces::Intersection;
use super::side::Side;
use crate::fem::{element, minus};
use crate::linalg::dot;
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};

/// The height of curved surfaces above straight facets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chords {
    /// Largest distance between a facet and its curved surface.
    pub sagitta: f64,
    /// Mean height of both surfaces above their facets around each contact point, by which the gap is too large, n.
    pub height: Vec<f64>,
    /// Length of a wave of pressures that the corners between facets make: that of a facet. It is zero for linear
    /// elements, which do not show such waves.
    pub wave: f64,
}

impl Chords {
    /// Return the heights at a pair, `None` if no facet is a chord of a curved surface.
    ///
    /// Where facets of both sides match, one surface lies above its facets by as much as the other lies below, and the
    /// heights cancel.
    pub fn of<const D: usize>(a: &Side<D>, b: &Side<D>, common: &Intersection<D>, pair: &ContactPair) -> Option<Self> {
        let (mut sums, mut sagitta) = (HashMap::<u32, [f64; 2]>::new(), 0.0f64);
        let rises: [Vec<Vec<f64>>; 2] = [a, b].map(|side| (0..side.facets.count()).map(|i| rises(side, i)).collect());
        for point in &common.points {
            let on = [(&rises[0][point.facet_a], &point.at_a), (&rises[1][point.facet_b], &point.at_b)];
            let height: f64 = on.iter().flat_map(|(rises, l)| rises.iter().zip(products(l))).map(|(r, l)| r * l).sum();
            on.iter().flat_map(|(rises, _)| *rises).for_each(|rise| sagitta = sagitta.max(0.25 * rise.abs()));
            for (at, share) in a.on_facet(point.facet_a).iter().zip(point.at_a.into_iter().chain(products(&point.at_a)))
            {
                let sum = sums.entry(*at).or_default();
                *sum = [sum[0] + point.weight * share * height, sum[1] + point.weight * share];
            }
        }
        let mean = |at: &u32| sums.get(at).map_or(0.0, |[height, weight]| height / weight);
        let wave = if a.facets.order == Order::P1 { 0.0 } else { a.mean_measure().powf(1.0 / (D - 1) as f64) };
        (sagitta > 0.0).then(|| Self { sagitta, height: pair.on_side.iter().map(mean).collect(), wave })
    }
}

/// Return the rise of a curved surface over each edge of a facet, in the order of [`products`]: the factor of l_i l_j
/// in the height of the surface above the facet. It is zero on a facet that is curved itself.
///
/// The edge from x_i to x_j is a chord if the normals at both ends turn away from the facet to opposite sides. Beside
/// an edge of a part only one of them does. The smaller turn counts.
pub(super) fn rises<const D: usize>(side: &Side<D>, facet: usize) -> Vec<f64> {
    let x = side.facets.coordinates(facet, side.space);
    let is_straight = element::is_straight(side.facets.order, &x, D);
    let normals: Vec<[f64; D]> = side.facet_nodes(facet).map(|at| at.normal).collect();
    let rise = |(i, j): (usize, usize)| {
        let along = minus(x[j], x[i]);
        let (first, last) = (-dot(&normals[i], &along), dot(&normals[j], &along));
        if is_straight && first * last > 0.0 { first.signum() * first.abs().min(last.abs()) } else { 0.0 }
    };
    edges::<D>().map(rise).collect()
}

/// Return l_i l_j for each edge of a facet.
pub(super) fn products<const D: usize>(l: &[f64; D]) -> impl Iterator<Item = f64> {
    edges::<D>().map(|(i, j)| l[i] * l[j])
}

fn edges<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    element::EDGES[..D * (D - 1) / 2].iter().copied()
}

/// Return the contact points beside which the pair ends because what lies before side a is too far away. `far` are the
/// nodes of facets of side a that were found to be too far away before the pair was made.
pub fn ends<const D: usize>(
    a: &Side<D>,
    common: &Intersection<D>,
    pair: &ContactPair,
    far: &BTreeSet<u32>,
) -> Vec<usize> {
    let own: BTreeSet<u32> = common.far().flat_map(|(i, _)| a.facets.facet(i).iter().copied()).collect();
    let is_end = |point: &usize| [&own, far].iter().any(|nodes| nodes.contains(&pair.nodes[*point]));
    (0..pair.len()).filter(is_end).collect()
}
