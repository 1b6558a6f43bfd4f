//! The integration points of a pair one by one, for an estimate of the error: there the compression of the layer and the gap
//! are those of the points themselves, not means around the nodes.

use serde::{Deserialize, Serialize};
use crate::exchange::Plain;
use super::basis::{Carriers, PressureBasis};
use super::near::Near;
use super::pair::ContactPair;
use super::pieces::{Common, Shared};
use super::side::{Side, length, unit};
use crate::fem::{Facets, element};
use crate::linalg::Csr;
use std::collections::HashMap;

/// The shared integration points of a pair.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Fine<const D: usize> {
    /// Numbers of the two bodies.
    pub bodies: [usize; 2],
    /// Length (area) of each point.
    pub weight: Vec<f64>,
    /// Gap of each point: distance of the meshes along the normal, and the scene's own gap.
    pub gap: Vec<f64>,
    /// Size of the facet of side a under each point: its length, or the side of the square that two such triangles make.
    pub size: Vec<f64>,
    /// Unit normal from side a to side b at each point.
    pub normal: Vec<[f64; D]>,
    /// The contact point nearest to each: for laws that differ from point to point.
    pub nearest: Vec<usize>,
    /// Whether the contact points of its facet are at mid-edges.
    pub at_edges: Vec<bool>,
    /// Values at the contact points -> values at the integration points, by the shape functions of side a.
    pub interpolation: Csr,
    /// Values at the contact points -> what the functions of the points make of them at the integration points: the pressure that
    /// the discrete problem has there.
    pub pressing: Csr,
    /// Where the points lie on each side.
    pub sides: [FineSide<D>; 2],
    /// Where the contact points lie on side b.
    pub near: Near<D>,
}

/// Where the points lie on a surface.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct FineSide<const D: usize> {
    /// The facets.
    pub facets: Facets<D>,
    /// Facet of each point.
    pub facet: Vec<usize>,
    /// Barycentric coordinates in it.
    pub at: Vec<[f64; D]>,
}

impl<const D: usize> Fine<D> {
    /// The points of `pair`, made of these sides and common pieces; `gap(x)` is the scene's own gap. The distance of the meshes does not
    /// count where they are `touching`.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Common<D>,
        pair: &ContactPair,
        gap: &dyn Fn([f64; 3]) -> f64,
        touching: bool,
    ) -> Self {
        let shared = &common.points;
        let point_of: HashMap<u32, usize> = pair.nodes.iter().enumerate().map(|(q, &node)| (node, q)).collect();
        let side = |side: &Side<D>, facet: fn(&Shared<D>) -> usize, at: fn(&Shared<D>) -> [f64; D]| FineSide {
            facets: side.facets.clone(),
            facet: shared.iter().map(facet).collect(),
            at: shared.iter().map(at).collect(),
        };
        let mut fine = Self {
            bodies: pair.bodies,
            weight: shared.iter().map(|point| point.weight).collect(),
            gap: Vec::new(),
            size: Vec::new(),
            normal: Vec::new(),
            nearest: Vec::new(),
            at_edges: Vec::new(),
            interpolation: Csr::new(pair.len()),
            pressing: Csr::new(pair.len()),
            near: Near::new(a, b, common, pair, (!touching).then_some(gap)),
            sides: [side(a, |p| p.facet_a, |p| p.at_a), side(b, |p| p.facet_b, |p| p.at_b)],
        };
        // that of the coordinates of both sides, along any normal
        let coordinates = 2.0 * (D as f64).sqrt() * a.rounding();
        for chunk in shared.chunk_by(|p, q| p.facet_a == q.facet_a) {
            let nodes = a.facets.facet(chunk[0].facet_a);
            let basis = PressureBasis::on(a.facets.order, nodes.len(), chunk);
            for point in chunk {
                let normal =
                    unit(std::array::from_fn(|c| (0..D).map(|k| point.at_a[k] * a.normals[&nodes[k]][c]).sum()));
                let x = a.facets.coordinates(point.facet_a, a.space);
                let from = crate::fem::assemble::interpolate(&x, &element::values(a.facets.order, &point.at_a));
                let rounding = coordinates.max(1e-12 * length(a.area(point.facet_a)).powf(1.0 / (D - 1) as f64));
                let distance = if point.gap.abs() < rounding { 0.0 } else { point.gap };
                fine.gap.push(distance + gap(a.space.in_scene(from)));
                let sides = (D - 1) as f64;
                fine.size.push((sides * length(a.area(point.facet_a))).powf(1.0 / sides));
                fine.normal.push(normal);
                let row = |values: [f64; element::MOST]| {
                    let of_point = |(node, value): (&u32, f64)| point_of.get(node).map(|&q| (q, value));
                    let entries = nodes.iter().zip(values).filter(|(_, value)| *value != 0.0).filter_map(of_point);
                    let mut row: Vec<(usize, f64)> = entries.collect();
                    row.sort_unstable_by_key(|entry| entry.0);
                    row
                };
                let phi = element::values(a.facets.order, &point.at_a);
                let mu = |i| if i < nodes.len() { basis.value(i, &phi, &point.at_a) } else { 0.0 };
                fine.pressing.push_row(row(std::array::from_fn(mu)));
                fine.at_edges.push(basis.carriers() == Carriers::MidEdges);
                let row = row(basis.carriers().interpolation(a.facets.order, &point.at_a));
                let nearest = row.iter().max_by(|p, q| p.1.total_cmp(&q.1));
                fine.nearest.push(nearest.map_or(0, |entry| entry.0));
                fine.interpolation.push_row(row);
            }
        }
        fine
    }
}
