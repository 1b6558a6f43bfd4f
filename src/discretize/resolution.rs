//! What the mesh of a contact surface leaves out of a gap that varies faster than its nodes can follow.

use super::surface::ContactSurface;
use crate::expression::Field;
use crate::fem::element;
use crate::output::vtu::CellKind;
use crate::problem::order::Order;

/// How a mesh follows a gap g: compared with I g, which has the values of g at the nodes of the facets and their shape between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Root mean square of g from its mean over the surface.
    pub height: f64,
    /// Share of the variance that is left out: the integral of (g - I g)^2 over that of (g - mean g)^2.
    pub variance: f64,
    /// Share of the surface whose facets have a root mean square of g - I g above a tenth of the height.
    pub area: f64,
    /// Mean length of the facets' sides.
    pub side: f64,
}

/// Places to look at in all; facets are looked at less closely beyond.
const MOST: usize = 4_000_000;
/// Sub-intervals of a side at least: a wave of the length of a facet shows in each of four.
const LEAST: usize = 4;
/// Share of the height above which a facet misses the gap. An error that is as large as this everywhere is a hundredth of the variance.
const MISSED: f64 = 0.1;

/// How a surface follows a gap that has no detail below a length.
pub fn resolution(surface: &ContactSurface, gap: &Field, detail: f64) -> Resolution {
    let (cell, facets) = surface.facets();
    let facets: Vec<Vec<[f64; 3]>> = facets.collect();
    let look = |nodes: &[[f64; 3]], cuts: usize| match cell {
        CellKind::Line => along(nodes, Order::P1, cuts, gap),
        CellKind::QuadraticLine => along(nodes, Order::P2, cuts, gap),
        CellKind::QuadraticTriangle => across(nodes, Order::P2, cuts, gap),
        _ => across(nodes, Order::P1, cuts, gap),
    };
    let corners = if matches!(cell, CellKind::Line | CellKind::QuadraticLine) { 2 } else { 3 };
    let side = |nodes: &Vec<[f64; 3]>| {
        (0..corners).map(|k| distance(nodes[k], nodes[(k + 1) % corners])).sum::<f64>() / corners as f64
    };
    let limit = (MOST / facets.len().max(1)).max(1) as f64;
    let limit = if corners == 2 { limit } else { limit.sqrt() };
    let looked: Vec<(f64, Misses)> = facets
        .iter()
        .map(|nodes| {
            let cuts = (side(nodes) / detail).ceil().clamp(1.0, limit) as usize;
            (measure(nodes, corners), look(nodes, cuts.max(LEAST)))
        })
        .collect();
    let mean = |of: &dyn Fn(&Misses) -> f64| {
        let (sum, whole) =
            looked.iter().fold((0.0, 0.0), |(sum, whole), (area, misses)| (sum + area * of(misses), whole + area));
        sum / whole
    };
    let middle = mean(&|misses| misses.value);
    let variance = mean(&|misses| misses.square - 2.0 * middle * misses.value + middle * middle);
    Resolution {
        height: variance.sqrt(),
        variance: if variance > 0.0 { mean(&|misses| misses.miss) / variance } else { 0.0 },
        area: mean(&|misses| if misses.miss > MISSED * MISSED * variance { 1.0 } else { 0.0 }),
        side: facets.iter().map(side).sum::<f64>() / facets.len().max(1) as f64,
    }
}

/// Means over a facet: of g, of g^2, of (g - I g)^2.
#[derive(Default)]
struct Misses {
    value: f64,
    square: f64,
    miss: f64,
}

/// A facet of the plane, in equal pieces.
fn along(nodes: &[[f64; 3]], order: Order, cuts: usize, gap: &Field) -> Misses {
    let places = (0..cuts).map(|k| (k as f64 + 0.5) / cuts as f64);
    misses(nodes, order, places.map(|t| [1.0 - t, t]), gap)
}

/// A triangle, in equal ones.
fn across(nodes: &[[f64; 3]], order: Order, cuts: usize, gap: &Field) -> Misses {
    let rows = (0..cuts).flat_map(|j| (0..2 * (cuts - j) - 1).map(move |i| (i, j)));
    let centre = |(i, j): (usize, usize)| {
        // every second one stands on its tip
        let shift = if i % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
        let [u, v] = [(i / 2) as f64 + shift, j as f64 + shift].map(|steps| steps / cuts as f64);
        [1.0 - u - v, u, v]
    };
    misses(nodes, order, rows.map(centre), gap)
}

fn misses<const N: usize>(
    nodes: &[[f64; 3]],
    order: Order,
    places: impl Iterator<Item = [f64; N]>,
    gap: &Field,
) -> Misses {
    let values: Vec<f64> = nodes.iter().map(|&x| gap.eval(x)).collect();
    let (mut sums, mut count) = (Misses::default(), 0.0);
    for place in places {
        let shape = element::values(order, &place);
        let x = std::array::from_fn(|c| nodes.iter().zip(shape).map(|(node, shape)| shape * node[c]).sum());
        let (found, held) = (gap.eval(x), values.iter().zip(shape).map(|(value, shape)| shape * value).sum::<f64>());
        // what has no value between the nodes is no contact's business
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

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt()
}

/// Length or area of a facet with straight sides.
fn measure(nodes: &[[f64; 3]], corners: usize) -> f64 {
    if corners == 2 {
        return distance(nodes[0], nodes[1]);
    }
    // Heron's formula
    let [a, b, c] = [0, 1, 2].map(|k| distance(nodes[k], nodes[(k + 1) % 3]));
    let half = 0.5 * (a + b + c);
    (half * (half - a) * (half - b) * (half - c)).max(0.0).sqrt()
}
