//! A contact surface of a pair: its mesh for output, which holds the facets of side a and the contact points from which
//! their values come.

use crate::contact::{ContactPair, Coverage, Side};
use crate::fem::{element, lagrange, space};
use crate::output::{CellKind, FieldArray, UnstructuredGrid};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};

/// The facets of the side that carries the contact points.
#[derive(Serialize, Deserialize)]
pub struct ContactSurface {
    points: Vec<[f64; 3]>,
    cell: CellKind,
    connectivity: Vec<u32>,
    /// For each point of the mesh, the contact points from which its values come, with their shares. The list is empty
    /// where no contact point contributes.
    sources: Vec<Vec<(usize, f64)>>,
    /// Share of each facet that is paired.
    cover: Vec<f64>,
    /// Contact points of the same facet: in the plane one after the other along it, in space any two.
    neighbours: Vec<Neighbours>,
}

/// Two contact points of one facet.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Neighbours {
    pub points: [usize; 2],
    /// Share of the facet that is paired.
    pub share: f64,
}

impl ContactSurface {
    /// Collect the facets of side a. Facets without a partner have no values.
    pub fn new<const D: usize>(a: &Side<D>, pair: &ContactPair) -> Self {
        let point_of = pair.point_of(a.nodes.len());
        let (order, places) = (a.facets.order, places::<D>(a.facets.order));
        let mut surface = Self {
            points: Vec::new(),
            cell: CellKind { dimension: D - 1, order: order.degree() },
            connectivity: Vec::new(),
            sources: Vec::new(),
            cover: Vec::new(),
            neighbours: neighbours(a, pair, &point_of),
        };
        // the same points as in the fields of the body
        let points = space::at_equally_spaced(a.space, Cow::Borrowed(&a.space.nodes));
        let mut number: HashMap<u32, u32> = HashMap::new();
        let mut at_node = Vec::new();
        let mut sums: Vec<(f64, BTreeMap<usize, f64>)> = Vec::new();
        for (facet, cover) in pair.cover.iter().enumerate() {
            let nodes = a.on_facet(facet);
            surface.cover.push(cover.share);
            for (k, (place, node)) in places.iter().zip(nodes).enumerate() {
                let at = *number.entry(*node).or_insert(surface.points.len() as u32);
                surface.connectivity.push(at);
                if at as usize == surface.points.len() {
                    surface.points.push(a.space.in_scene(points[a.nodes[*node as usize].node as usize]));
                    // the points of higher orders are not at the nodes
                    at_node.push(k < D || order <= Order::P2);
                    sums.push((0.0, BTreeMap::new()));
                }
                let Some(basis) = &cover.basis else { continue };
                let (facets, sum) = &mut sums[at as usize];
                *facets += 1.0;
                for (shape, of) in basis.interpolation(place).iter().zip(nodes) {
                    let source = point_of[*of as usize].filter(|_| *shape != 0.0);
                    source.into_iter().for_each(|q| *sum.entry(q).or_insert(0.0) += shape);
                }
            }
        }
        // A node that is not a contact point takes the mean of the values that the facets around it interpolate there.
        surface.sources = sums
            .into_iter()
            .map(|(facets, sum)| sum.into_iter().map(|(q, share)| (q, share / facets)).collect())
            .collect();
        for (node, &at) in &number {
            if let Some(q) = point_of[*node as usize].filter(|_| at_node[at as usize]) {
                surface.sources[at as usize] = vec![(q, 1.0)];
            }
        }
        surface
    }

    /// Return the points of the mesh, before deformation.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Return the points of all facets, facet by facet in the order of their nodes.
    pub fn connectivity(&self) -> &[u32] {
        &self.connectivity
    }

    /// Return the middle of the corners of a facet.
    pub fn middle(&self, facet: usize) -> [f64; 3] {
        let corners = &self.connectivity[facet * self.cell.stride()..][..self.cell.dimension + 1];
        let mean = |c: usize| corners.iter().map(|&at| self.points[at as usize][c]).sum::<f64>() / corners.len() as f64;
        std::array::from_fn(mean)
    }

    /// Return contact points that are neighbours on a facet.
    pub fn neighbours(&self) -> &[Neighbours] {
        &self.neighbours
    }

    /// Return the contact points on the corners of facets without a partner because facets before them were refused,
    /// each once or more. `cover` is the coverage of the facets.
    pub fn beside_cut_short(&self, cover: &[Coverage]) -> impl Iterator<Item = usize> {
        let facets = self.connectivity.chunks_exact(self.cell.stride()).zip(cover);
        let cut = facets.filter(|(_, cover)| cover.share == 0.0 && cover.is_cut_short());
        let nodes = cut.flat_map(|(facet, _)| facet);
        nodes.flat_map(|&node| &self.sources[node as usize]).map(|(q, _)| *q)
    }

    /// Return the values of an array at the points of the mesh from those at the contact points, and `other` at points
    /// of the mesh without a contact point. Extrapolated values stay between those from which they come, so that a
    /// pressure is never negative nor above its peak.
    pub fn spread(&self, components: usize, values: &[f64], other: f64) -> Vec<f64> {
        let at = |sources: &Vec<(usize, f64)>, c: usize| {
            let of = |q: usize| values[components * q + c];
            let extreme = |pick: fn(f64, f64) -> f64| sources.iter().fold(f64::NAN, |all, &(q, _)| pick(all, of(q)));
            let value: f64 = sources.iter().map(|&(q, share)| share * of(q)).sum();
            // Without sources the bounds are NaN, which `max` would ignore.
            if sources.is_empty() { other } else { value.max(extreme(f64::min)).min(extreme(f64::max)) }
        };
        self.sources.iter().flat_map(|sources| (0..components).map(|c| at(sources, c)).collect::<Vec<_>>()).collect()
    }

    /// Return the mesh with arrays of values at the contact points. Points of the mesh without a contact point get NaN.
    pub fn grid(&self, name: String, arrays: Vec<FieldArray>) -> UnstructuredGrid {
        UnstructuredGrid {
            title: name,
            points: self.points.clone(),
            cell: self.cell,
            connectivity: self.connectivity.clone(),
            at_points: arrays
                .into_iter()
                .map(|array| FieldArray { values: self.spread(array.components, &array.values, f64::NAN), ..array })
                .collect(),
            at_cells: vec![FieldArray::new("cover", 1, self.cover.clone())],
        }
    }
}

/// Return the corners of a facet or edge as sorted points of the mesh. A facet in space has three; in place of those
/// that others lack there is no point.
pub fn corners(points: impl Iterator<Item = u32>) -> [u32; 3] {
    let mut corners = [u32::MAX; 3];
    corners.iter_mut().zip(points).for_each(|(corner, point)| *corner = point);
    corners.sort_unstable();
    corners
}

/// Return the barycentric coordinates of the points of a facet that are in files, in the order of its nodes.
pub fn places<const D: usize>(order: Order) -> Vec<[f64; D]> {
    match order {
        Order::P1 | Order::P2 => element::nodes(order),
        _ => lagrange::equally_spaced(order, D).iter().map(|l| std::array::from_fn(|k| l[k])).collect(),
    }
}

/// Return the contact points that are neighbours on the facets of side a. `point_of` is the contact point of each node
/// on a face.
fn neighbours<const D: usize>(a: &Side<D>, pair: &ContactPair, point_of: &[Option<usize>]) -> Vec<Neighbours> {
    let mut all = Vec::new();
    for (facet, share) in pair.cover.iter().map(|cover| cover.share).enumerate().filter(|(_, share)| *share > 0.0) {
        let nodes = a.on_facet(facet);
        // the second node of an edge is its other end
        let order: Vec<u32> = if D == 2 { [&nodes[..1], &nodes[2..], &nodes[1..2]].concat() } else { nodes.to_vec() };
        let points: Vec<usize> = order.iter().filter_map(|&at| point_of[at as usize]).collect();
        for (i, &q) in points.iter().enumerate() {
            let last = if D == 2 { points.len().min(i + 2) } else { points.len() };
            all.extend(points[i + 1..last].iter().map(|&r| Neighbours { points: [q, r], share }));
        }
    }
    all
}
