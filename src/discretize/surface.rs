//! A contact surface of a pair: its mesh for output, which holds the facets of side a and the contact points from which their values come,
//! and the part of a gap that it misses because the gap varies faster than its nodes can follow.

use crate::contact::{Carriers, ContactPair, Side};
use crate::expression::Field;
use crate::fem::{element, length, minus};
use crate::output::fields::{CellKind, UnstructuredGrid};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// The facets of the side that carries the contact points.
#[derive(Serialize, Deserialize)]
pub struct ContactSurface {
    points: Vec<[f64; 3]>,
    cell: CellKind,
    connectivity: Vec<u32>,
    /// For each point of the mesh, the contact points from which its values come, with their shares. The list is empty where no
    /// contact point contributes.
    sources: Vec<Vec<(usize, f64)>>,
    /// The nodes of each facet that are contact points; `None` if the facet is not paired.
    carriers: Vec<Option<Carriers>>,
    /// Share of each facet that is paired.
    cover: Vec<f64>,
}

impl ContactSurface {
    /// Collect the facets of side a. Facets without a partner have no values.
    pub fn new<const D: usize>(a: &Side<D>, pair: &ContactPair) -> Self {
        let point_of = pair.point_of(a.nodes.len());
        let order = a.facets.order;
        let places = element::nodes::<D>(order);
        let mut surface = Self {
            points: Vec::new(),
            cell: match (D, order) {
                (2, Order::P1) => CellKind::Line,
                (2, Order::P2) => CellKind::QuadraticLine,
                (_, Order::P1) => CellKind::Triangle,
                (_, Order::P2) => CellKind::QuadraticTriangle,
            },
            connectivity: Vec::new(),
            sources: Vec::new(),
            carriers: pair.cover.iter().map(|cover| cover.carriers).collect(),
            cover: Vec::new(),
        };
        let mut number: HashMap<u32, u32> = HashMap::new();
        let mut sums: Vec<(f64, BTreeMap<usize, f64>)> = Vec::new();
        for (facet, cover) in pair.cover.iter().enumerate() {
            let nodes = a.on_facet(facet);
            surface.cover.push(cover.share);
            for (place, node) in places.iter().zip(nodes) {
                let at = *number.entry(*node).or_insert(surface.points.len() as u32);
                surface.connectivity.push(at);
                if at as usize == surface.points.len() {
                    surface.points.push(a.space.in_scene(a.space.nodes[a.nodes[*node as usize].node as usize]));
                    sums.push((0.0, BTreeMap::new()));
                }
                let Some(carriers) = cover.carriers else { continue };
                let (facets, sum) = &mut sums[at as usize];
                *facets += 1.0;
                for (shape, of) in carriers.interpolation(order, place).iter().zip(nodes) {
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
            if let Some(q) = point_of[*node as usize] {
                surface.sources[at as usize] = vec![(q, 1.0)];
            }
        }
        surface
    }

    /// Return the kind of the facets. For each paired facet, return the coordinates of its nodes and which of them are contact
    /// points.
    pub fn facets(&self) -> (CellKind, impl Iterator<Item = (Vec<[f64; 3]>, Carriers)> + '_) {
        let nodes = self.connectivity.chunks_exact(self.cell.stride()).zip(&self.carriers);
        let points = |nodes: &[u32]| nodes.iter().map(|&node| self.points[node as usize]).collect();
        (self.cell, nodes.filter_map(move |(nodes, carriers)| Some((points(nodes), (*carriers)?))))
    }

    /// Return the mesh with arrays of values at the contact points; each array has a name, a number of components per point, and
    /// its values. Points of the mesh without a contact point get NaN. Extrapolated values stay between those from which they
    /// come, so that a pressure is never negative nor above its peak.
    pub fn grid(&self, name: String, arrays: &[(&str, usize, Vec<f64>)]) -> UnstructuredGrid {
        let spread = |components: usize, values: &[f64]| {
            let at = |sources: &Vec<(usize, f64)>, c: usize| {
                let of = |q: usize| values[components * q + c];
                let extreme =
                    |pick: fn(f64, f64) -> f64| sources.iter().fold(f64::NAN, |all, &(q, _)| pick(all, of(q)));
                let value: f64 = sources.iter().map(|&(q, share)| share * of(q)).sum();
                // Without sources the bounds are NaN, which `max` would ignore.
                if sources.is_empty() { f64::NAN } else { value.max(extreme(f64::min)).min(extreme(f64::max)) }
            };
            self.sources
                .iter()
                .flat_map(|sources| (0..components).map(|c| at(sources, c)).collect::<Vec<_>>())
                .collect()
        };
        UnstructuredGrid {
            title: name,
            points: self.points.clone(),
            cell: self.cell,
            connectivity: self.connectivity.clone(),
            at_points: arrays
                .iter()
                .map(|(name, components, values)| ((*name).to_owned(), *components as u32, spread(*components, values)))
                .collect(),
            at_cells: vec![("cover".to_owned(), 1, self.cover.clone())],
        }
    }
}

/// How well a mesh follows a gap g. It is compared with its interpolation I g, which has the values of g at the contact points of
/// each facet and varies between them as pressures do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Root mean square of g minus its mean over the surface.
    pub height: f64,
    /// Share of the variance that the mesh misses: the integral of (g - I g)^2 over that of (g - mean g)^2.
    pub variance: f64,
    /// Share of the surface whose facets have a root mean square of g - I g above a tenth of the height.
    pub area: f64,
    /// Mean length of the sides of the facets.
    pub side: f64,
}

/// Largest number of sample points in all. They take about a second of one core: two faces with 1024 x 1024 heights took 0.5 to
/// 0.8 s. Surfaces that need more are sampled less densely.
const MOST: usize = 4_000_000;
/// Smallest number of sub-intervals of a side. A wave of the length of a facet shows in each of four.
const LEAST: usize = 4;
/// Share of the height above which a facet misses the gap. An error of this size everywhere is a hundredth of the variance.
const MISSED: f64 = 0.1;

/// Return how well a surface follows a gap that has no detail below the length `detail`.
pub fn resolution(surface: &ContactSurface, gap: &Field, detail: f64) -> Resolution {
    let (cell, facets) = surface.facets();
    let facets: Vec<GapFacet> = facets.map(|(nodes, carriers)| GapFacet { nodes, carriers, gap }).collect();
    let (corners, order) = match cell {
        CellKind::Line => (2, Order::P1),
        CellKind::QuadraticLine => (2, Order::P2),
        CellKind::QuadraticTriangle => (3, Order::P2),
        _ => (3, Order::P1),
    };
    let each = (MOST / facets.len().max(1)) as f64;
    let most = if corners == 2 { each } else { each.sqrt() };
    let look = |facet: &GapFacet| {
        let cuts = ((facet.side(corners) / detail).ceil().min(most) as usize).max(LEAST);
        let misses = if corners == 2 { facet.along(order, cuts) } else { facet.across(order, cuts) };
        (facet.measure(corners), misses)
    };
    let looked: Vec<(f64, Misses)> = facets.iter().map(look).collect();
    let whole: f64 = looked.iter().map(|(area, _)| area).sum();
    let mean = |of: &dyn Fn(&Misses) -> f64| looked.iter().map(|(area, misses)| area * of(misses)).sum::<f64>() / whole;
    let middle = mean(&|misses| misses.value);
    let variance = mean(&|misses| misses.square - 2.0 * middle * misses.value + middle * middle);
    Resolution {
        height: variance.sqrt(),
        variance: if variance > 0.0 { mean(&|misses| misses.miss) / variance } else { 0.0 },
        area: mean(&|misses| if misses.miss > MISSED * MISSED * variance { 1.0 } else { 0.0 }),
        side: facets.iter().map(|facet| facet.side(corners)).sum::<f64>() / facets.len().max(1) as f64,
    }
}

/// A facet in front of a gap.
struct GapFacet<'a> {
    nodes: Vec<[f64; 3]>,
    carriers: Carriers,
    gap: &'a Field,
}

/// Means over a facet: of g, of g^2, and of (g - I g)^2.
#[derive(Default)]
struct Misses {
    value: f64,
    square: f64,
    miss: f64,
}

impl GapFacet<'_> {
    /// Return the means over a facet in the plane, cut into equal intervals.
    fn along(&self, order: Order, cuts: usize) -> Misses {
        let places = (0..cuts).map(|k| (k as f64 + 0.5) / cuts as f64);
        self.misses(order, places.map(|t| [1.0 - t, t]))
    }

    /// Return the means over a triangle, cut into equal triangles.
    fn across(&self, order: Order, cuts: usize) -> Misses {
        let rows = (0..cuts).flat_map(|j| (0..2 * (cuts - j) - 1).map(move |i| (i, j)));
        let centre = |(i, j): (usize, usize)| {
            // Every second triangle of a row stands on its tip.
            let shift = if i % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
            let [u, v] = [(i / 2) as f64 + shift, j as f64 + shift].map(|steps| steps / cuts as f64);
            [1.0 - u - v, u, v]
        };
        self.misses(order, rows.map(centre))
    }

    fn misses<const N: usize>(&self, order: Order, places: impl Iterator<Item = [f64; N]>) -> Misses {
        let values: Vec<f64> = self.nodes.iter().map(|&x| self.gap.eval(x)).collect();
        let (mut sums, mut count) = (Misses::default(), 0.0);
        for place in places {
            let (shape, held) = (element::values(order, &place), self.carriers.interpolation(order, &place));
            let x = std::array::from_fn(|c| self.nodes.iter().zip(shape).map(|(node, shape)| shape * node[c]).sum());
            // Nodes that are not contact points contribute nothing, even where the gap has no value.
            let held = values.iter().zip(held).filter(|(_, share)| *share != 0.0).map(|(value, share)| share * value);
            let (found, held) = (self.gap.eval(x), held.sum::<f64>());
            if found.is_finite() && held.is_finite() {
                sums.value += found;
                sums.square += found * found;
                sums.miss += (found - held).powi(2);
                count += 1.0;
            }
        }
        let count = f64::max(count, 1.0);
        Misses { value: sums.value / count, square: sums.square / count, miss: sums.miss / count }
    }

    /// Return the mean length of the sides. In the plane it is the length of the facet.
    fn side(&self, corners: usize) -> f64 {
        (0..corners).map(|k| length(minus(self.nodes[k], self.nodes[(k + 1) % corners]))).sum::<f64>() / corners as f64
    }

    /// Return the length or area of the facet with straight sides.
    fn measure(&self, corners: usize) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| length(minus(self.nodes[k % corners], self.nodes[(k + 1) % corners])));
        let half = 0.5 * (a + b + c);
        // This is Heron's formula.
        if corners == 2 { a } else { (half * (half - a) * (half - b) * (half - c)).max(0.0).sqrt() }
    }
}
