//! The integration points of a pair one by one, for an estimate of the error.
//!
//! At these points the compression of the layer and the gap are those of the points themselves, not means around the nodes.

use super::basis::{Carriers, PressureBasis};
use super::cover::Left;
use super::near::{Projections, rise};
use super::pair::ContactPair;
use super::pieces::{Common, Shared};
use super::rim::facets_at_rim;
use super::side::{Side, length, unit};
use crate::exchange::Plain;
use crate::fem::{Facets, element};
use crate::linalg::Csr;
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The integration points that both surfaces of a pair share.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Fine<const D: usize> {
    /// Indices of the two bodies.
    pub bodies: [usize; 2],
    /// Length (area) of each point.
    pub weight: Vec<f64>,
    /// Gap of each point: distance of the surfaces along the normal plus the gap that the scene adds. Between surfaces
    /// that do not touch as wholes, it is less by the heights of both curved surfaces above their straight facets (`near::rise`).
    pub gap: Vec<f64>,
    /// Size of the facet of side a under each point: its length, or the side of the square that two such triangles make.
    pub size: Vec<f64>,
    /// Unit normal from side a to side b at each point.
    pub normal: Vec<[f64; D]>,
    /// Sum of the outer unit normals of both sides at each point, zero where they are opposite.
    pub tilt: Vec<[f64; D]>,
    /// Contact point nearest to each point, for laws that differ from point to point.
    pub nearest: Vec<usize>,
    /// Whether the contact points of the facet under each point are at mid-edges.
    pub at_edges: Vec<bool>,
    /// Whether the facet of side a under each point lies at a rim, where the pressure may be singular.
    pub at_rim: Vec<bool>,
    /// Whether the pressure on the facet under each point is a polynomial of second degree. It is on quadratic elements in the plane where facets
    /// are fully covered; on a part of a facet three values do not show more than a mean.
    pub is_quadratic: Vec<bool>,
    /// Matrix from values at the contact points to values at the integration points, by the shape functions of side a.
    pub interpolation: Csr,
    /// Matrix from the pressures of the contact points to the pressures that the discrete problem has at the integration
    /// points, by the functions mu_q of the contact points.
    pub pressing: Csr,
    /// Location of the points on each side.
    pub sides: [FineSide<D>; 2],
    /// Location of the contact points on side b.
    pub near: Projections<D>,
}

/// The location of the integration points on one surface.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct FineSide<const D: usize> {
    /// Facets of the surface.
    pub facets: Facets<D>,
    /// Facet of each point.
    pub facet: Vec<usize>,
    /// Barycentric coordinates of each point in its facet.
    pub at: Vec<[f64; D]>,
}

impl<const D: usize> Fine<D> {
    /// Collect the integration points of `pair`, which was made of these sides and common pieces.
    ///
    /// `gap(x)` is the gap that the scene adds to the distance of the meshes. If the surfaces are `touching`, the difference
    /// between that distance at a contact point and its mean around it counts as zero, as does the height of surfaces above their facets.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Common<D>,
        pair: &ContactPair,
        gap: &dyn Fn([f64; 3]) -> f64,
        touching: bool,
    ) -> Self {
        let points = &common.points;
        let point_of: HashMap<u32, usize> = pair.nodes.iter().enumerate().map(|(q, &node)| (node, q)).collect();
        let side = |side: &Side<D>, facet: fn(&Shared<D>) -> usize, at: fn(&Shared<D>) -> [f64; D]| FineSide {
            facets: side.facets.clone(),
            facet: points.iter().map(facet).collect(),
            at: points.iter().map(at).collect(),
        };
        let rounding = a.rounding_along_normals();
        let rise_of_both = |point: &Shared<D>| match touching {
            true => 0.0,
            false => rise(a, point.facet_a, &point.at_a) + rise(b, point.facet_b, &point.at_b),
        };
        let at_rim = facets_at_rim(a, b, common, &pair.cover);
        let is_quadratic =
            |facet: usize| D == 2 && a.facets.order == Order::P2 && pair.cover[facet].left == Left::Nothing;
        let mut fine = Self {
            bodies: pair.bodies,
            weight: points.iter().map(|point| point.weight).collect(),
            gap: points.iter().map(|point| gap_at(a, point, rounding, gap) - rise_of_both(point)).collect(),
            size: points.iter().map(|point| size_under(a, point)).collect(),
            normal: points.iter().map(|point| normal_at(a, point.facet_a, &point.at_a)).collect(),
            tilt: points.iter().map(|point| tilt_at(a, b, point)).collect(),
            nearest: Vec::new(),
            at_edges: Vec::new(),
            at_rim: points.iter().map(|point| at_rim[point.facet_a]).collect(),
            is_quadratic: points.iter().map(|point| is_quadratic(point.facet_a)).collect(),
            interpolation: Csr::new(pair.len()),
            pressing: Csr::new(pair.len()),
            near: Projections::new(a, b, common, pair, (!touching).then_some(gap)),
            sides: [side(a, |p| p.facet_a, |p| p.at_a), side(b, |p| p.facet_b, |p| p.at_b)],
        };
        for chunk in points.chunk_by(|p, q| p.facet_a == q.facet_a) {
            fine.push_rows(a, chunk, &point_of);
        }
        fine
    }

    /// Append the rows of the integration points on one facet of side a. `point_of` gives the contact point of a node.
    fn push_rows(&mut self, a: &Side<D>, chunk: &[Shared<D>], point_of: &HashMap<u32, usize>) {
        let (order, nodes) = (a.facets.order, a.facets.facet(chunk[0].facet_a));
        let basis = PressureBasis::on(order, nodes.len(), chunk, &self.sides[1].facets);
        let carriers = basis.carriers();
        let row = |values: [f64; element::MOST]| {
            let of_point = |(node, value): (&u32, f64)| point_of.get(node).map(|&q| (q, value));
            let entries = nodes.iter().zip(values).filter(|(_, value)| *value != 0.0).filter_map(of_point);
            let mut row: Vec<(usize, f64)> = entries.collect();
            row.sort_unstable_by_key(|entry| entry.0);
            row
        };
        for point in chunk {
            let phi = element::values(order, &point.at_a);
            let mu = |i| if i < nodes.len() { basis.value(i, &phi, &point.at_a) } else { 0.0 };
            self.pressing.push_row(row(std::array::from_fn(mu)));
            let interpolation = row(carriers.interpolation(order, &point.at_a));
            let nearest = interpolation.iter().max_by(|p, q| p.1.total_cmp(&q.1));
            self.nearest.push(nearest.map_or(0, |entry| entry.0));
            self.interpolation.push_row(interpolation);
            self.at_edges.push(carriers == Carriers::MidEdges);
        }
    }
}

/// Return the gap at an integration point. A distance below `rounding`, or below that of the facet's size, counts as zero.
fn gap_at<const D: usize>(a: &Side<D>, point: &Shared<D>, rounding: f64, gap: &dyn Fn([f64; 3]) -> f64) -> f64 {
    let at = a.facets.point(point.facet_a, a.space, &point.at_a);
    let rounding = rounding.max(1e-12 * length(a.area(point.facet_a)).powf(1.0 / (D - 1) as f64));
    let distance = if point.gap.abs() < rounding { 0.0 } else { point.gap };
    distance + gap(a.space.in_scene(at))
}

/// Return the size of the facet of side a under an integration point.
fn size_under<const D: usize>(a: &Side<D>, point: &Shared<D>) -> f64 {
    let sides = (D - 1) as f64;
    (sides * length(a.area(point.facet_a))).powf(1.0 / sides)
}

/// Return the unit normal of a side at barycentric coordinates `l` of a facet, interpolated between the vertices of the facet.
fn normal_at<const D: usize>(side: &Side<D>, facet: usize, l: &[f64; D]) -> [f64; D] {
    let nodes = side.facets.facet(facet);
    unit(std::array::from_fn(|c| (0..D).map(|k| l[k] * side.normals[&nodes[k]][c]).sum()))
}

/// Return the sum of the unit normals of both sides at an integration point.
fn tilt_at<const D: usize>(a: &Side<D>, b: &Side<D>, point: &Shared<D>) -> [f64; D] {
    let (n_a, n_b) = (normal_at(a, point.facet_a, &point.at_a), normal_at(b, point.facet_b, &point.at_b));
    std::array::from_fn(|c| n_a[c] + n_b[c])
}
