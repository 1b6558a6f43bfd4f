//! The integration points of a pair one by one, for an estimate of the error.
//!
//! At these points the compression of the layer and the gap are those of the points themselves, not means around the
//! nodes. Contact points are also projected to side b, and facets at rims of the contact are marked.

use super::basis::PressureBasis;
use super::pair::ContactPair;
use super::pieces::{Coverage, IntegrationPoint, Intersection};
use super::review::{products, rises};
use super::side::Side;
use super::slip::{Tangents, Turns};
use crate::exchange::Plain;
use crate::fem::{Facets, lagrange, length, minus};
use crate::linalg::{Csr, dot};
use crate::problem::order::Order;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap, HashSet};

/// An integration point that both surfaces of a pair share.
#[derive(Serialize, Deserialize)]
pub struct FinePoint {
    /// Length (area) of the point.
    pub weight: f64,
    /// Distance of the surfaces along the normal plus the gap that the scene adds. Between surfaces that do not touch
    /// as wholes, it is less by the heights of both curved surfaces above their straight facets (`rise`).
    pub gap: f64,
    /// Facet of side a under the point. Points on one facet follow each other.
    pub facet: usize,
    /// First barycentric coordinate in this facet.
    pub along: f64,
    /// Size of this facet: its length, or the side of the square that two such triangles make.
    pub size: f64,
    /// Whether this facet lies at a rim, where the pressure may be singular.
    pub at_rim: bool,
    /// Whether the contact points of this facet are at mid-edges.
    pub at_edges: bool,
    /// Degree of the pressure on this facet as a polynomial. It is that of the elements in the plane where facets are
    /// fully covered or of order three or more; on a part of another facet, and in space, its values do not show more
    /// than a mean, which counts as one.
    pub degree: usize,
    /// Contact point nearest to the point, for laws that differ from point to point.
    pub nearest: usize,
}

/// The integration points of a pair without the space dimension.
#[derive(Serialize, Deserialize)]
pub struct FinePoints {
    /// Order of the elements of side a.
    pub order: Order,
    /// Each point.
    pub each: Vec<FinePoint>,
    /// Matrix from values at the contact points to values at the integration points, by the shape functions of side a.
    pub interpolation: Csr,
    /// Matrix from the pressures of the contact points to the pressures that the discrete problem has at the
    /// integration points, by the functions mu_q of the contact points.
    pub pressing: Csr,
    /// Places of the scene where the gap that the scene adds has a kink, on facets in the plane of order three or more.
    pub kinks: Vec<[f64; 3]>,
}

/// The integration points of a pair.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Fine<const D: usize> {
    /// The points.
    pub points: FinePoints,
    /// Unit normal from side a to side b at each point.
    pub normal: Vec<[f64; D]>,
    /// Location of the points on each side.
    pub sides: [FineSide<D>; 2],
    /// Location of the contact points on side b.
    pub near: Projections<D>,
    /// The turns of the surfaces in the slip, for a pair that is the shear of a bond.
    pub turns: Option<Turns>,
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
    /// Collect the integration points of `pair`, which was made of these sides and common pieces. `jumps` has the nodes
    /// of both sides where the material of their body jumps, or the law of the layer.
    ///
    /// `gap(x)` is the gap that the scene adds to the distance of the meshes. If the surfaces are `touching`, the
    /// difference between that distance at a contact point and its mean around it counts as zero, as does the height of
    /// surfaces above their facets.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Intersection<D>,
        pair: &ContactPair,
        gap: &dyn Fn([f64; 3]) -> f64,
        touching: bool,
        jumps: [&HashSet<u32>; 2],
    ) -> Self {
        let shared = &common.points;
        let side = |side: &Side<D>,
                    facet: fn(&IntegrationPoint<D>) -> usize,
                    at: fn(&IntegrationPoint<D>) -> [f64; D]| FineSide {
            facets: side.facets.clone(),
            facet: shared.iter().map(facet).collect(),
            at: shared.iter().map(at).collect(),
        };
        let rounding = a.rounding_along_normals();
        let rise_of_both = |point: &IntegrationPoint<D>| {
            if touching { 0.0 } else { rise(a, point.facet_a, &point.at_a) + rise(b, point.facet_b, &point.at_b) }
        };
        let at_rim = facets_at_rim(a, b, common, &pair.cover, jumps);
        let normal_a = |point: &IntegrationPoint<D>| a.vector_at(point.facet_a, &point.at_a, |at| at.normal);
        let direction = |point: &IntegrationPoint<D>| a.vector_at(point.facet_a, &point.at_a, |at| at.direction);
        let degree = |cover: &Coverage| {
            let shows_all = cover.basis.as_ref().is_some_and(PressureBasis::is_of_part) || D == 2 && cover.is_whole();
            if shows_all { a.facets.order.degree() } else { 1 }
        };
        let of_point = |point: &IntegrationPoint<D>| FinePoint {
            weight: point.weight * dot(&normal_a(point), &direction(point)),
            gap: gap_at(a, point, rounding, gap) - rise_of_both(point),
            facet: point.facet_a,
            along: point.at_a[0],
            size: size_under(a, point),
            at_rim: at_rim[point.facet_a],
            at_edges: D == 3 && pair.cover[point.facet_a].basis.as_ref().is_some_and(|basis| !basis.carries(0)),
            degree: degree(&pair.cover[point.facet_a]),
            nearest: 0,
        };
        let mut points = FinePoints {
            order: a.facets.order,
            each: shared.iter().map(of_point).collect(),
            interpolation: Csr::new(pair.len()),
            pressing: Csr::new(pair.len()),
            kinks: kinks(a, &pair.cover, gap),
        };
        points.push_rows(a, shared, pair);
        Self {
            points,
            normal: shared.iter().map(direction).collect(),
            near: Projections::new(a, b, common, pair, (!touching).then_some(gap)),
            turns: None,
            sides: [side(a, |p| p.facet_a, |p| p.at_a), side(b, |p| p.facet_b, |p| p.at_b)],
        }
    }
}

impl<const D: usize> Fine<D> {
    /// Let slip along the surface take the place of the compression, as [`ContactPair::slide`] does.
    #[must_use]
    pub fn slide(mut self, tangents: Tangents, turns: Turns) -> Self {
        self.turns = Some(turns);
        self.normal.iter_mut().chain(&mut self.near.normal).for_each(|normal| *normal = tangents.at(*normal));
        self
    }

    /// Add the turns of a side for displacements `u` of all nodes of its body to the values at the integration points.
    pub fn add_turns(&self, side: usize, u: &[f64], values: &mut [f64]) {
        let Some(Turns(rows)) = &self.turns else { return };
        let mut turns = vec![0.0; values.len()];
        rows[side].multiply(u, &mut turns);
        crate::linalg::axpy(1.0, &turns, values);
    }
}

impl FinePoints {
    /// Return the contact points of each edge of order three or more; none of facets in space and of lower orders.
    pub fn edges(&self) -> Vec<Vec<usize>> {
        if self.order <= Order::P2 {
            return Vec::new();
        }
        let mut first = 0;
        let of_facet = |chunk: &[FinePoint]| {
            let on_facet = first..first + chunk.len();
            first = on_facet.end;
            let points: BTreeSet<usize> = on_facet.flat_map(|g| self.interpolation.row(g)).map(|(q, _)| q).collect();
            points.into_iter().collect()
        };
        self.each.chunk_by(|p, q| p.facet == q.facet).map(of_facet).collect()
    }

    /// Append the rows of the points, facet by facet of side a, and find the contact point nearest to each.
    fn push_rows<const D: usize>(&mut self, a: &Side<D>, shared: &[IntegrationPoint<D>], pair: &ContactPair) {
        let point_of = pair.point_of(a.nodes.len());
        let mut each = self.each.iter_mut();
        for chunk in shared.chunk_by(|p, q| p.facet_a == q.facet_a) {
            let nodes = a.on_facet(chunk[0].facet_a);
            let Some(basis) = &pair.cover[chunk[0].facet_a].basis else { continue };
            let row = |values: DVector<f64>| {
                let of_point = |(node, value): (&u32, &f64)| Some((point_of[*node as usize]?, *value));
                let entries = nodes.iter().zip(&values).filter(|(_, value)| **value != 0.0).filter_map(of_point);
                let mut row: Vec<(usize, f64)> = entries.collect();
                row.sort_unstable_by_key(|entry| entry.0);
                row
            };
            for (point, fine) in chunk.iter().zip(&mut each) {
                self.pressing.push_row(row(basis.functions(&point.at_a)));
                let interpolation = row(basis.interpolation(&point.at_a));
                let nearest = interpolation.iter().max_by(|p, q| p.1.total_cmp(&q.1));
                fine.nearest = nearest.map_or(0, |entry| entry.0);
                self.interpolation.push_row(interpolation);
            }
        }
    }
}

/// Return the gap at an integration point. A distance below `rounding`, or below that of the facet's size, counts as
/// zero.
fn gap_at<const D: usize>(
    a: &Side<D>,
    point: &IntegrationPoint<D>,
    rounding: f64,
    gap: &dyn Fn([f64; 3]) -> f64,
) -> f64 {
    let at = a.facets.point(point.facet_a, a.space, &point.at_a);
    let rounding = rounding.max(1e-12 * length(a.area(point.facet_a)).powf(1.0 / (D - 1) as f64));
    let distance = if point.gap.abs() < rounding { 0.0 } else { point.gap };
    distance + gap(a.space.in_scene(at))
}

/// Return where the gap has a kink on the covered facets of side a, if these are edges of order three or more.
fn kinks<const D: usize>(a: &Side<D>, cover: &[Coverage], gap: &dyn Fn([f64; 3]) -> f64) -> Vec<[f64; 3]> {
    if D > 2 || a.facets.order <= Order::P2 {
        return Vec::new();
    }
    let of_facet = |facet: usize| {
        let place = |along: f64| {
            let l: [f64; D] = std::array::from_fn(|k| if k == 0 { 1.0 - along } else { along });
            a.space.in_scene(a.facets.point(facet, a.space, &l))
        };
        kink(a.facets.order, &|along| gap(place(along))).map(place)
    };
    (0..a.facets.count()).filter(|&facet| cover[facet].share > 0.0).filter_map(of_facet).collect()
}

/// Halvings of an edge that find a kink to a millionth of it, and the least number of them that show that there is one.
const HALVINGS: [usize; 2] = [20, 8];

/// Return where a function on \[0, 1\] has a kink, if it has one: the limit of the halves in which polynomials of the
/// order of the elements miss it most.
///
/// What polynomials of degree k miss of a smooth function falls by 2^-(k + 1) in each halving, and of |x|^s by 2^-s.
/// The mean of both powers, with s = 1, tells them apart. The first interval is a little larger, so that neither an end
/// nor the middle of an edge is an end of a half.
fn kink(order: Order, function: &dyn Fn(f64) -> f64) -> Option<f64> {
    let (shapes, tests) = (lagrange::of(order, 2), lagrange::gauss(order.degree() + 1));
    let missed = |from: f64, size: f64| -> f64 {
        let at_nodes: Vec<f64> = shapes.nodes.iter().map(|l| function(from + size * l[1])).collect();
        let missed_at =
            |along: f64| function(from + size * along) - dot(&shapes.values(&[1.0 - along, along]), &at_nodes);
        tests.iter().map(|(along, _)| missed_at(*along).abs()).fold(0.0, f64::max)
    };
    let rounding = 1e3 * f64::EPSILON * tests.iter().map(|(along, _)| function(*along).abs()).fold(0.0, f64::max);
    let (mut from, mut size) = (-0.06, 1.11);
    let mut least = missed(from, size);
    for halving in 1..=HALVINGS[0] {
        size *= 0.5;
        least *= 0.5f64.powf(0.5 * (order.degree() as f64 + 2.0));
        let [left, right] = [from, from + size].map(|from| missed(from, size));
        if right > left {
            from += size;
        }
        let worse = left.max(right);
        if worse <= rounding || halving == HALVINGS[0] {
            return (halving >= HALVINGS[1]).then_some(from + 0.5 * size);
        }
        if worse < least {
            return None;
        }
    }
    None
}

/// Return the size of the facet of side a under an integration point.
fn size_under<const D: usize>(a: &Side<D>, point: &IntegrationPoint<D>) -> f64 {
    let sides = (D - 1) as f64;
    (sides * length(a.area(point.facet_a))).powf(1.0 / sides)
}

/// The projections of the contact points of a pair to side b, one entry a point.
#[derive(Default, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Projections<const D: usize> {
    /// Nearest facet of side b.
    pub facet: Vec<usize>,
    /// Barycentric coordinates of the projection along the normal. It lies outside of the facet by a part of the
    /// facet's size where side b ends before.
    pub at: Vec<[f64; D]>,
    /// Unit normal from side a to side b.
    pub normal: Vec<[f64; D]>,
    /// Mean distance of the meshes around the point less the distance at the point itself.
    pub distance: Vec<f64>,
}

impl<const D: usize> Projections<D> {
    /// Project the points of `pair`, which was made of these sides and common pieces. `gap(x)` is the gap that the
    /// scene adds to the distance of the meshes; with `None` all differences of distances are zero.
    pub fn new(
        a: &Side<D>,
        b: &Side<D>,
        common: &Intersection<D>,
        pair: &ContactPair,
        gap: Option<&dyn Fn([f64; 3]) -> f64>,
    ) -> Self {
        let rounding = a.rounding_along_normals();
        let position = |q: usize| -> [f64; D] { std::array::from_fn(|c| pair.position[q][c] - a.space.datum[c]) };
        let mut projections = Self::default();
        for (q, facet) in nearest_facets(a, common, pair, position).into_iter().enumerate() {
            let (from, normal) = (position(q), std::array::from_fn(|c| pair.normal[q][c]));
            let at = project(b, facet, from, normal);
            let difference = |gap: &dyn Fn([f64; 3]) -> f64| {
                pair.gap[q] - gap(pair.position[q]) - distance(b, facet, &at, from, normal)
            };
            // Between planes the difference is no more than the rounding of the coordinates.
            let rounding = rounding.max(1e-12 * length(b.area(facet)).powf(1.0 / (D - 1) as f64));
            let difference = gap.map(difference).filter(|difference| difference.abs() >= rounding);
            projections.distance.push(difference.unwrap_or(0.0));
            projections.facet.push(facet);
            projections.at.push(at);
            projections.normal.push(normal);
        }
        projections
    }
}

/// Return the facet of side b for each contact point: the partner of the nearest integration point on the facets of
/// side a at its node. `position` gives the place of a contact point, measured from the datum of the mesh.
fn nearest_facets<const D: usize>(
    a: &Side<D>,
    common: &Intersection<D>,
    pair: &ContactPair,
    position: impl Fn(usize) -> [f64; D],
) -> Vec<usize> {
    let point_of = pair.point_of(a.nodes.len());
    let mut nearest = vec![(f64::INFINITY, 0); pair.len()];
    for point in &common.points {
        let from = a.facets.point(point.facet_a, a.space, &point.at_a);
        for q in a.on_facet(point.facet_a).iter().filter_map(|&node| point_of[node as usize]) {
            let distance = length(minus(position(q), from));
            if distance < nearest[q].0 {
                nearest[q] = (distance, point.facet_b);
            }
        }
    }
    nearest.into_iter().map(|(_, facet)| facet).collect()
}

/// Return where the line from a point along a normal meets the plane of a facet's corners, in barycentric coordinates.
fn project<const D: usize>(b: &Side<D>, facet: usize, from: [f64; D], normal: [f64; D]) -> [f64; D] {
    let x = b.facets.coordinates(facet, b.space);
    let matrix = DMatrix::from_fn(D, D, |c, k| if k + 1 < D { x[k + 1][c] - x[0][c] } else { normal[c] });
    let right = DVector::from_fn(D, |c, _| from[c] - x[0][c]);
    let Some(solution) = matrix.lu().solve(&right) else { return [1.0 / D as f64; D] };
    let others: f64 = (0..D - 1).map(|k| solution[k]).sum();
    std::array::from_fn(|k| if k == 0 { 1.0 - others } else { solution[k - 1] })
}

/// Return the distance along a normal from a point to the surface at the barycentric coordinates `at` of a facet.
fn distance<const D: usize>(b: &Side<D>, facet: usize, at: &[f64; D], from: [f64; D], normal: [f64; D]) -> f64 {
    dot(&normal, &minus(b.facets.point(facet, b.space, at), from)) - rise(b, facet, at)
}

/// Return the height of the surface of a side above a facet at barycentric coordinates.
///
/// A curved facet is the surface itself. So is a straight one of order two or more, unless it is a chord ([`rises`]).
/// Over a linear facet the surface is taken to rise by l_i l_j (n_j - n_i).(x_j - x_i)/2 for each edge ij, since a
/// curve between two normals is a parabola. Here l_i is the barycentric coordinate, n_i the normal and x_i the place of
/// corner i.
fn rise<const D: usize>(side: &Side<D>, facet: usize, at: &[f64; D]) -> f64 {
    if side.facets.order != Order::P1 {
        return rises(side, facet).iter().zip(products(at)).map(|(rise, l)| rise * l).sum();
    }
    let x = side.facets.coordinates(facet, side.space);
    let normals: Vec<[f64; D]> = side.facet_nodes(facet).map(|at| at.normal).collect();
    let mut rise = 0.0;
    for i in 0..D {
        for j in i + 1..D {
            rise += 0.5 * at[i] * at[j] * dot(&minus(normals[j], normals[i]), &minus(x[j], x[i]));
        }
    }
    rise
}

/// Return, for each facet of side a, whether it lies at a rim, where the pressure may be singular, since one of the
/// surfaces ends there. `cover` is the coverage of these facets.
///
/// Near the edge of a contact surface the pressure of bodies without a layer is K r^(lambda - 1) at the distance r from
/// the edge, with 1/2 <= lambda. The edge is no rim where the surface goes on as its mirror image: on an axis of
/// revolution, and on a plane of symmetry. A facet lies at a rim if such an edge of side a bounds it. It does, too, if
/// side b ends on it, where side a ends with a mirror image, or on a facet beside it, at such an edge of b: the covered
/// part of that facet may be a sliver.
///
/// The pressure may be singular where an interface of two materials ends in the contact, too, on the softer one as at a
/// corner of the stiffer one. It jumps with the law of a layer, and no polynomial on a facet follows that.
fn facets_at_rim<const D: usize>(
    a: &Side<D>,
    b: &Side<D>,
    common: &Intersection<D>,
    cover: &[Coverage],
    jumps: [&HashSet<u32>; 2],
) -> Vec<bool> {
    let at_jump = |side: usize, nodes: &[u32]| nodes.iter().any(|node| jumps[side].contains(node));
    let (edges_a, edges_b) = (a.facets.by_edge(), b.facets.by_edge());
    let (mut above_rim_of_b, mut at_interface) = (vec![false; a.facets.count()], vec![false; a.facets.count()]);
    for point in &common.points {
        above_rim_of_b[point.facet_a] |= is_at_rim(b, &edges_b, point.facet_b);
        at_interface[point.facet_a] |=
            at_jump(0, a.facets.facet(point.facet_a)) || at_jump(1, b.facets.facet(point.facet_b));
    }
    let is_partial = |i: usize| !cover[i].is_whole();
    let is_last = |i: usize| a.facets.edges(i).into_iter().any(|edge| edges_a[&edge].len() == 1);
    let beside = |i: usize| a.facets.edges(i).into_iter().flat_map(|edge| &edges_a[&edge]).filter(move |&&k| k != i);
    let ends_beside = |i: usize| beside(i).any(|&k| is_partial(k) && (above_rim_of_b[i] || above_rim_of_b[k]));
    let b_ends = |i: usize| (is_partial(i) || is_last(i)) && above_rim_of_b[i] || ends_beside(i);
    let at_rim = |i: usize| cover[i].share > 0.0 && (at_interface[i] || is_at_rim(a, &edges_a, i) || b_ends(i));
    (0..a.facets.count()).map(at_rim).collect()
}

/// Return whether a surface ends at facet `i`, and does not go on as its mirror image. `facets` are those at each edge.
fn is_at_rim<const D: usize>(side: &Side<D>, facets: &HashMap<[u32; D], Vec<usize>>, i: usize) -> bool {
    side.facets.edges(i).into_iter().any(|edge| facets[&edge].len() == 1 && !is_mirrored(side, i, edge))
}

/// Return whether the surface goes on beyond an edge of facet `i` as its mirror image, on an axis of revolution or a
/// plane of symmetry.
fn is_mirrored<const D: usize>(side: &Side<D>, i: usize, edge: [u32; D]) -> bool {
    let nodes: Vec<(u32, [f64; D])> =
        side.facet_nodes(i).filter(|at| edge[..D - 1].contains(&at.node)).map(|at| (at.node, at.normal)).collect();
    nodes.iter().all(|(node, _)| side.space.on_axis(*node)) || side.mirrors.continue_beyond(&nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kinks of several powers are found inside an edge, at its middle and at its ends; smooth functions have none.
    #[test]
    fn kinks_of_gaps_are_found() {
        for order in (3..=8).filter_map(Order::new) {
            for (place, power) in [(0.3, 1.0), (0.3, 1.5), (0.5, 1.0), (0.0, 1.0), (1.0, 1.5), (0.71, 2.0)] {
                let found = kink(order, &|x| 2.0 + x + (x - place).abs().powf(power) * f64::from(u8::from(x > place)));
                assert!(found.is_some_and(|x| (x - place).abs() < 1e-4), "{order:?} {place} {power}: {found:?}");
            }
            let smooth: [&dyn Fn(f64) -> f64; 4] =
                [&|_| 0.0, &|x| 3.0 - x * x, &|x| (2.0 * x).cos(), &|x| (3.0 * x).exp()];
            assert!(smooth.iter().all(|function| kink(order, function).is_none()), "{order:?}");
        }
    }
}
