//! One normal at each point of a pair, made of the normals of both sides at places that face each other.
//!
//! Let n_a and -n_b be unit vectors from side a to side b, and let kappa_a and kappa_b be the curvatures of the surfaces. The direction is
//!
//! ```text
//! n = unit(kappa_b n_a - kappa_a n_b)
//! ```
//!
//! so that the less curved surface counts; two flats, and surfaces of equal curvature, give the plain mean (docs/theory.md, "The normals").

use super::basis::PressureBasis;
use super::pieces::Intersection;
use super::side::{ROUNDING, Side};
use crate::fem::{element, length, unit};
use crate::linalg::dot;
use crate::problem::order::Order;

/// The surface of side b that faces a node of side a: integrals of functions around the node.
#[derive(Clone, Copy)]
struct Facing<const D: usize> {
    weight: f64,
    /// Area of the facets around the node, over which the curvature is the plain mean: one that extrapolates could be negative.
    area: f64,
    normal: [f64; D],
    curvature: f64,
}

impl<const D: usize> Side<'_, D> {
    /// Replace the directions of this side by those made of both normals, where `common` are its common pieces with side b. Return whether
    /// some have changed.
    pub fn towards(&mut self, b: &Side<D>, common: &Intersection<D>) -> bool {
        let mut changed = false;
        for (at, facing) in facing(self, b, common).into_iter().enumerate() {
            let Some(Facing { normal, curvature, .. }) = facing else { continue };
            let own = &mut self.nodes[at];
            // beyond a plane of symmetry the other side goes on, too
            let normal = unit(self.mirrors.mean(self.space, own.node, normal, -1.0));
            let tilt: [f64; D] = std::array::from_fn(|c| own.normal[c] + normal[c]);
            let faces = dot(&own.normal, &normal) < 0.0;
            if !faces || length(tilt) <= ROUNDING {
                continue;
            }
            let sum = own.curvature + curvature;
            let weight = if sum > 0.0 { curvature / sum } else { 0.5 };
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
    let none = Facing { weight: 0.0, area: 0.0, normal: [0.0; D], curvature: 0.0 };
    let mut sums = vec![none; a.nodes.len()];
    for chunk in common.points.chunk_by(|p, q| p.facet_a == q.facet_a) {
        let on = a.on_facet(chunk[0].facet_a);
        // The vertices, between which directions are interpolated, need not carry points up to order two; all other
        // nodes do so by their own functions.
        let [vertices, all] = [(Order::P1, D), (a.facets.order, on.len())]
            .map(|(order, count)| PressureBasis::on(order, count, chunk, &b.facets));
        for point in chunk {
            let phi = element::values(a.facets.order, &point.at_a);
            let (normal, curvature) = surface_at(b, point.facet_b, &point.at_b);
            for (i, &at) in on.iter().enumerate() {
                let is_linear = i < D && a.facets.order <= Order::P2;
                let value = if is_linear {
                    vertices.value(i, &point.at_a, &point.at_a)
                } else {
                    all.value(i, &phi, &point.at_a)
                };
                let (mu, sum) = (point.weight * value, &mut sums[at as usize]);
                sum.weight += mu;
                sum.area += point.weight;
                sum.curvature += point.weight * curvature;
                (0..D).for_each(|c| sum.normal[c] += mu * normal[c]);
            }
        }
    }
    let mean = |sum: Facing<D>| {
        let is_faced = sum.weight > 0.0 && length(sum.normal) > 0.0;
        is_faced.then(|| Facing { normal: unit(sum.normal), curvature: sum.curvature / sum.area, ..sum })
    };
    let mut means: Vec<Option<Facing<D>>> = sums.into_iter().map(mean).collect();
    spread(a, &mut means);
    means
}

/// Give nodes that nothing faces the surface before the nearest nodes, facet by facet, so that directions do not jump where side b ends.
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

/// Return the unit normal and the curvature of a side at barycentric coordinates of a facet.
fn surface_at<const D: usize>(side: &Side<D>, facet: usize, at: &[f64; D]) -> ([f64; D], f64) {
    let mut normal = [0.0; D];
    for (node, phi) in side.facet_nodes(facet).zip(element::values(side.facets.order, at)) {
        (0..D).for_each(|c| normal[c] += phi * node.normal[c]);
    }
    (unit(normal), side.facet_nodes(facet).zip(at).map(|(node, l)| l * node.curvature).sum())
}
