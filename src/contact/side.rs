//! One contact surface of a body: facets with averaged nodal normals.

pub use crate::fem::{length, unit};

use crate::fem::{Facets, Frame, Space, area_vector, element, minus};
use crate::mesh::datum;
use std::collections::HashMap;

/// Difference between the unit normal of a facet and the mean normal beyond which the facets form an edge.
///
/// It is half of the angle between chords that leave their arc by 3 % of its radius, the worst polygon that is taken for round.
const EDGE: f64 = 0.245;

/// One contact surface of a body.
#[derive(Debug, Clone)]
pub struct Side<'a, const D: usize> {
    /// Name of the mesh group.
    pub name: &'a str,
    /// The body's space.
    pub space: &'a Space<D>,
    /// The facets, oriented outwards.
    pub facets: Facets<D>,
    /// Values of the prescribed dofs of the body.
    pub prescribed: &'a HashMap<usize, f64>,
    /// Dofs of nodes with rotated axes and of tied nodes.
    pub frame: &'a Frame<D>,
    /// Outer unit normal at each node of the surface: the mean over the facets around it.
    pub normals: HashMap<u32, [f64; D]>,
}

impl<'a, const D: usize> Side<'a, D> {
    /// Compute the nodal normals of a surface.
    pub fn new(
        name: &'a str,
        space: &'a Space<D>,
        facets: Facets<D>,
        prescribed: &'a HashMap<usize, f64>,
        frame: &'a Frame<D>,
    ) -> Self {
        let mut normals: HashMap<u32, [f64; D]> = HashMap::new();
        let places = element::nodes::<D>(facets.order);
        for i in 0..facets.count() {
            let x = facets.coordinates(i, space);
            for (l, &node) in places.iter().zip(facets.facet(i)) {
                let area = area_vector(facets.order, &x, l);
                let sum = normals.entry(node).or_insert([0.0; D]);
                (0..D).for_each(|c| sum[c] += area[c]);
            }
        }
        for (&node, normal) in &mut normals {
            // A surface of revolution continues beyond the axis as its mirror image.
            if space.on_axis(node) && normal[1] != 0.0 {
                normal[0] = 0.0;
            }
            *normal = unit(*normal);
        }
        Self { name, space, facets, prescribed, frame, normals }
    }

    /// Return the surface of the facets that `keep` marks, with their own normals.
    pub fn only(&self, keep: &[bool]) -> Self {
        Self::new(self.name, self.space, self.facets.only(keep), self.prescribed, self.frame)
    }

    /// Return the uncertainty of the normal near each node: the largest difference between the unit normals of facets and
    /// nodes, over all nodes that share a facet with it. Edges do not count. Where the surface is flat, the result is the
    /// rounding of the normals.
    pub fn spread(&self) -> HashMap<u32, f64> {
        let (places, rounding) = (element::nodes::<D>(self.facets.order), self.rounding());
        let mut at_node: HashMap<u32, f64> = HashMap::new();
        for i in 0..self.facets.count() {
            let x = self.facets.coordinates(i, self.space);
            for (l, node) in places.iter().zip(self.facets.facet(i)) {
                let (area, mean) = (area_vector(self.facets.order, &x, l), self.normals[node]);
                let difference = length(minus(unit(area), mean));
                let least = f64::EPSILON + 2.0 * rounding / length(area).powf(1.0 / (D - 1) as f64);
                let largest = at_node.entry(*node).or_default();
                *largest = largest.max(least).max(if difference < EDGE { difference } else { 0.0 });
            }
        }
        let mut spread: HashMap<u32, f64> = HashMap::new();
        for nodes in (0..self.facets.count()).map(|i| self.facets.facet(i)) {
            let on_facet = nodes.iter().map(|node| at_node[node]).fold(0.0, f64::max);
            for node in nodes {
                let largest = spread.entry(*node).or_default();
                *largest = largest.max(on_facet);
            }
        }
        spread
    }

    /// Return the mean length (area) of a facet.
    pub fn mean_measure(&self) -> f64 {
        let total: f64 = (0..self.facets.count()).map(|i| length(self.area(i))).sum();
        total / self.facets.count().max(1) as f64
    }

    /// Return the outer normal times the length (area) at the middle of facet `i`.
    pub fn area(&self, i: usize) -> [f64; D] {
        let x = self.facets.coordinates(i, self.space);
        area_vector(self.facets.order, &x, &[1.0 / D as f64; D])
    }

    /// Return the largest rounding error of a coordinate of the surface's nodes.
    pub fn rounding(&self) -> f64 {
        datum::rounding(&self.space.datum, self.facets.nodes.iter().map(|&node| &self.space.nodes[node as usize]))
    }

    /// Return the rounding error of a distance between this side and its partner: that of the coordinates of both sides, along
    /// any normal.
    pub fn rounding_along_normals(&self) -> f64 {
        2.0 * (D as f64).sqrt() * self.rounding()
    }

    /// Return the corners of the box around all facets.
    pub fn extent(&self) -> ([f64; D], [f64; D]) {
        let join = |(low, high): ([f64; D], [f64; D]), (from, to): ([f64; D], [f64; D])| {
            (std::array::from_fn(|c| low[c].min(from[c])), std::array::from_fn(|c| high[c].max(to[c])))
        };
        (0..self.facets.count()).map(|i| self.bounds(i)).fold(([f64::MAX; D], [f64::MIN; D]), join)
    }

    /// Return the corners of the box around facet `i`.
    pub fn bounds(&self, i: usize) -> ([f64; D], [f64; D]) {
        let x = self.facets.coordinates(i, self.space);
        let corner = |pick: fn(f64, f64) -> f64| -> [f64; D] {
            std::array::from_fn(|c| x[1..].iter().fold(x[0][c], |value, x| pick(value, x[c])))
        };
        (corner(f64::min), corner(f64::max))
    }
}
