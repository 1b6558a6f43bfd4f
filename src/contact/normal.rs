//! One normal at each point of a pair, made of the normals of both sides at places that face each other.
//!
//! Let n_a and -n_b be unit vectors from side a to side b, and let kappa_a and kappa_b be the curvatures of the
//! surfaces. The direction is
//!
//! ```text
//! n = unit(kappa_b n_a - kappa_a n_b)
//! ```
//!
//! so that the less curved surface counts; two flats, and surfaces of equal curvature, give the plain mean
//! (docs/theory.md, "The normals").
//!
//! The spread of n is that of both sides with the same weights: the mean of (n_f - n_a)(n_f - n_a)' over the unit
//! normals n_f of the facets around n_a, and the like for n_b. Surfaces that turn away from each other add nothing to
//! it.

use super::basis::PressureBasis;
use super::pieces::Intersection;
use super::side::{ROUNDING, Side, Spread};
use crate::fem::{element, length, unit};
use crate::linalg::{axpy, dot};
use crate::problem::order::Order;

/// The surface of side b that faces a node of side a: integrals of functions around the node.
#[derive(Clone, Copy)]
struct Facing<const D: usize> {
    weight: f64,
    /// Area of the facets around the node, over which the curvature is the plain mean: one that extrapolates could be
    /// negative.
    area: f64,
    normal: [f64; D],
    curvature: f64,
    spread: Spread<D>,
}

impl<const D: usize> Side<'_, D> {
    /// Replace the directions of this side by those made of both normals, where `common` are its common pieces with
    /// side b. Return whether some have changed.
    pub fn towards(&mut self, b: &Side<D>, common: &Intersection<D>) -> bool {
        let mut changed = false;
        for (at, facing) in facing(self, b, common).into_iter().enumerate() {
            let Some(Facing { normal, curvature, spread, .. }) = facing else { continue };
            let own = &mut self.nodes[at];
            // beyond a plane of symmetry the other side goes on, too
            let normal = unit(self.mirrors.mean(self.space, own.node, normal, -1.0));
            let tilt: [f64; D] = std::array::from_fn(|c| own.normal[c] + normal[c]);
            if dot(&own.normal, &normal) >= 0.0 {
                continue;
            }
            let sum = own.curvature + curvature;
            let weight = if sum > 0.0 { curvature / sum } else { 0.5 };
            let mixed = |i: usize, j: usize| weight * own.spread[i][j] + (1.0 - weight) * spread[i][j];
            own.spread = std::array::from_fn(|i| std::array::from_fn(|j| mixed(i, j)));
            if length(tilt) <= ROUNDING {
                continue;
            }
            let sum = std::array::from_fn(|c| weight * own.normal[c] - (1.0 - weight) * normal[c]);
            own.direction = unit(self.mirrors.mean(self.space, own.node, sum, -1.0));
            own.tilt = length(tilt);
            changed = true;
        }
        changed
    }
}

/// Return the mean normal and curvature of side b before each node of side a, `None` where nothing faces a node.
fn facing<const D: usize>(a: &Side<D>, b: &Side<D>, common: &Intersection<D>) -> Vec<Option<Facing<D>>> {
    let none = Facing { weight: 0.0, area: 0.0, normal: [0.0; D], curvature: 0.0, spread: [[0.0; D]; D] };
    let mut sums = vec![none; a.nodes.len()];
    for chunk in common.points.chunk_by(|p, q| p.facet_a == q.facet_a) {
        let on = a.on_facet(chunk[0].facet_a);
        // The vertices, between which directions are interpolated, need not carry points up to order two; all other
        // nodes do so by their own functions.
        let linear = if a.facets.order <= Order::P2 { D } else { 0 };
        let ends = common.cover[chunk[0].facet_a].ends;
        let [vertices, all] =
            [Order::P1, a.facets.order].map(|order| PressureBasis::on(order, a, &b.facets, ends, chunk));
        for point in chunk {
            let [at_vertices, at_all] = [&vertices, &all].map(|basis| basis.functions(&point.at_a));
            let before = surface_at(b, point.facet_b, &point.at_b);
            for (i, &at) in on.iter().enumerate() {
                let value = if i < linear { at_vertices[i] } else { at_all[i] };
                let (mu, sum) = (point.weight * value, &mut sums[at as usize]);
                sum.weight += mu;
                sum.area += point.weight;
                sum.curvature += point.weight * before.curvature;
                (0..D).for_each(|c| sum.normal[c] += mu * before.normal[c]);
                (0..D).for_each(|c| axpy(point.weight, &before.spread[c], &mut sum.spread[c]));
            }
        }
    }
    let mean = |sum: Facing<D>| {
        let is_faced = sum.weight > 0.0 && length(sum.normal) > 0.0;
        is_faced.then(|| Facing {
            normal: unit(sum.normal),
            curvature: sum.curvature / sum.area,
            spread: sum.spread.map(|row| row.map(|value| value / sum.area)),
            ..sum
        })
    };
    let mut means: Vec<Option<Facing<D>>> = sums.into_iter().map(mean).collect();
    spread(a, &mut means);
    means
}

/// Give nodes that nothing faces the surface before the nearest nodes, facet by facet, so that directions do not jump
/// where side b ends.
fn spread<const D: usize>(a: &Side<D>, facing: &mut [Option<Facing<D>>]) {
    loop {
        let mut found: Vec<(u32, Facing<D>)> = Vec::new();
        for on in (0..a.facets.count()).map(|i| a.on_facet(i)) {
            let Some(known) = on.iter().find_map(|&at| facing[at as usize]) else { continue };
            found.extend(on.iter().filter(|at| facing[**at as usize].is_none()).map(|&at| (at, known)));
        }
        if found.is_empty() {
            return;
        }
        found.into_iter().for_each(|(at, known)| facing[at as usize] = Some(known));
    }
}

/// Return what side b is at barycentric coordinates of a facet. Curvatures and spreads are means over nodes, which are
/// not negative.
fn surface_at<const D: usize>(side: &Side<D>, facet: usize, at: &[f64; D]) -> Facing<D> {
    let mut found = Facing { weight: 1.0, area: 1.0, normal: [0.0; D], curvature: 0.0, spread: [[0.0; D]; D] };
    let phi = element::values(side.facets.order, at);
    let all: f64 = phi.iter().map(|phi| phi.abs()).sum();
    for (node, phi) in side.facet_nodes(facet).zip(phi) {
        (0..D).for_each(|c| found.normal[c] += phi * node.normal[c]);
        (0..D).for_each(|c| axpy(phi.abs() / all, &node.spread[c], &mut found.spread[c]));
    }
    found.normal = unit(found.normal);
    found.curvature = side.facet_nodes(facet).zip(at).map(|(node, l)| l * node.curvature).sum();
    found
}
