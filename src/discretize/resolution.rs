//! The part of a gap that the mesh of a contact surface misses because the gap varies faster than its nodes can follow.

use super::surface::ContactSurface;
use crate::contact::Carriers;
use crate::expression::Field;
use crate::fem::element;
use crate::output::fields::CellKind;
use crate::problem::order::Order;

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
    let facets: Vec<Facet> = facets.map(|(nodes, carriers)| Facet { nodes, carriers, gap }).collect();
    let (corners, order) = match cell {
        CellKind::Line => (2, Order::P1),
        CellKind::QuadraticLine => (2, Order::P2),
        CellKind::QuadraticTriangle => (3, Order::P2),
        _ => (3, Order::P1),
    };
    let each = (MOST / facets.len().max(1)) as f64;
    let most = if corners == 2 { each } else { each.sqrt() };
    let look = |facet: &Facet| {
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
struct Facet<'a> {
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

impl Facet<'_> {
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
        (0..corners).map(|k| distance(self.nodes[k], self.nodes[(k + 1) % corners])).sum::<f64>() / corners as f64
    }

    /// Return the length or area of the facet with straight sides.
    fn measure(&self, corners: usize) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| distance(self.nodes[k % corners], self.nodes[(k + 1) % corners]));
        let half = 0.5 * (a + b + c);
        // This is Heron's formula.
        if corners == 2 { a } else { (half * (half - a) * (half - b) * (half - c)).max(0.0).sqrt() }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt()
}
