//! Common pieces of two surfaces. Facets of side a face facets of side b along the normals of side a. They are cut into pieces
//! on which products of shape functions of both sides are integrated exactly.
//!
//! Normals are interpolated between the vertices of side a, so that curved surfaces are covered without gaps or
//! overlaps between neighbouring facets. A piece is an interval ([`in_plane`]) or a convex polygon ([`in_space`]) in the
//! parameters of one facet of side a.

mod plane;
mod space;

pub use plane::in_plane;
pub use space::in_space;

use super::side::{FaceNode, Side};
use crate::fem::{area_vector, element, length, minus, unit};
use crate::linalg::{around, dot};
use crate::problem::order::Order;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};
use std::collections::BTreeSet;

/// An integration point that both surfaces share.
#[derive(Debug, Clone, Copy)]
pub struct IntegrationPoint<const D: usize> {
    /// Facet of side a.
    pub facet_a: usize,
    /// Barycentric coordinates in this facet.
    pub at_a: [f64; D],
    /// Facet of side b.
    pub facet_b: usize,
    /// Barycentric coordinates there of the projection along the normal of side a.
    pub at_b: [f64; D],
    /// Length (area) that belongs to the point, measured on side a; in bodies of revolution the area of a ring.
    pub weight: f64,
    /// Distance to the projection, negative where the surfaces overlap.
    pub gap: f64,
}

/// The common pieces of two surfaces.
#[derive(Debug, Clone, Default)]
pub struct Intersection<const D: usize> {
    /// Integration points of the common pieces, grouped by facet of side a.
    pub points: Vec<IntegrationPoint<D>>,
    /// What was refused before each facet of side a.
    pub refused: Vec<Refused>,
}

impl<const D: usize> Intersection<D> {
    /// Return the facets of both sides that face each other, but are too far apart.
    pub fn far(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.refused.iter().enumerate().flat_map(|(i, refused)| refused.far.iter().map(move |&j| (i, j)))
    }
}

/// A function that finds the common pieces of two surfaces.
pub type Cut<const D: usize> = fn(&Side<D>, &Side<D>, &Reach) -> Intersection<D>;

/// The failure of a search for a point on a facet: it did not converge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lost;

/// Largest number of Newton steps for a point on a facet. The start is within a facet's size of the point, and from there each step
/// doubles the number of correct digits: six steps are enough for a double, and twice as many make up for a bad start.
const MOST_STEPS: usize = 12;

/// Rounding of a sum that is zero, as a share of the sizes of its terms. A coordinate of a point on a facet adds six products, whose
/// factors have three roundings each, to a point that was found in the same way: less than 32 roundings of half an epsilon.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Parameter beyond which a point is neither on a facet nor near it: it has fewer digits than [`SNAP`] needs.
const AWAY: f64 = SNAP / f64::EPSILON;

/// Distance from the end of a facet, in its parameter, within which a point is moved to the end, so that matching surfaces match exactly.
const SNAP: f64 = 1e-9;

/// Largest distance outside of the parameters of a facet at which a ray may meet it in the plane, where pieces end exactly where facets do.
const ON_FACET: f64 = 1e-6;

/// Share from which a facet counts as fully paired: by quadrature, the length of a curve differs a little between a facet and
/// its pieces.
pub(super) const WHOLE: f64 = 1.0 - 1e-3;

/// A facet of side a or b as a parametrised curve or surface x(l), where l are barycentric coordinates.
///
/// Coordinates are measured from its first corner, so that interpolation and subtraction round relative to the size of the facet.
/// This holds also if the two bodies of a pair lie far from the others of the scene.
struct Facet<const D: usize> {
    order: Order,
    /// First corner.
    from: [f64; D],
    /// Nodes, measured from the first corner.
    x: Vec<[f64; D]>,
    /// Largest distance of a node from the first corner.
    size: f64,
    /// Directions at the corners along which the facet faces the other side: normals, unless they are made of those of both sides.
    normals: [[f64; D]; D],
    /// Outer unit normal in the middle.
    direction: [f64; D],
}

impl<const D: usize> Facet<D> {
    fn of(side: &Side<D>, i: usize) -> Self {
        let (order, on) = (side.facets.order, side.on_facet(i));
        let mut x = side.facets.coordinates(i, side.space);
        let from = x[0];
        x.iter_mut().for_each(|x| *x = minus(*x, from));
        Self {
            order,
            from,
            size: x.iter().map(|&x| length(x)).fold(0.0, f64::max),
            normals: std::array::from_fn(|k| side.nodes[on[k] as usize].direction),
            direction: unit(area_vector(order, &x, &[1.0 / D as f64; D])),
            x,
        }
    }

    fn at(&self, l: &[f64; D]) -> [f64; D] {
        element::interpolate(&self.x, &element::values(self.order, l))
    }

    /// Return a bound of the sum of the sizes of the terms that [`Facet::at`] adds.
    fn terms(&self, l: &[f64; D]) -> f64 {
        let reach = 1.0 + 2.0 * l[1..].iter().map(|l| l.abs()).sum::<f64>();
        // The quadratic functions, l (2l - 1) and 4 l m for barycentric coordinates l and m, sum to less than 3 reach^2 in size.
        self.size * if self.order == Order::P1 { reach } else { 3.0 * reach * reach }
    }

    fn normal(&self, l: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|c| (0..D).map(|k| l[k] * self.normals[k][c]).sum())
    }

    /// Return whether a normal of this facet may meet the convex hull of points, which are measured from its first corner. Where none does, a
    /// failed search loses nothing.
    ///
    /// The points lie in a ball, and the normals in a cone around that in the middle. The facet is within its nodes, curved ones but for a small part.
    fn may_meet(&self, points: &[[f64; D]]) -> bool {
        let mean = |points: &[[f64; D]]| -> [f64; D] {
            std::array::from_fn(|c| points.iter().map(|x| x[c]).sum::<f64>() / points.len() as f64)
        };
        let radius = |middle: [f64; D], points: &[[f64; D]]| -> f64 {
            points.iter().map(|&x| length(minus(x, middle))).fold(0.0, f64::max)
        };
        let (middle, center) = (mean(&self.x), mean(points));
        let (axis, away) = (unit(mean(&self.normals)), minus(center, middle));
        let across = |v: [f64; D]| {
            let along = dot(&v, &axis);
            [length(std::array::from_fn::<f64, D, _>(|c| v[c] - along * axis[c])), along]
        };
        let spread = self
            .normals
            .iter()
            .map(|&n| across(n))
            .map(|[off, along]| if along > 0.0 { off / along } else { f64::INFINITY });
        let ([off, along], ball) = (across(away), radius(center, points));
        let cone = spread.fold(0.0, f64::max) * (along.abs() + ball);
        off <= radius(middle, &self.x) + ball + cone
    }

    /// Return the derivatives of x by the coordinates l_1, ..., of which l_0 is the complement to one.
    fn tangents<const N: usize>(&self, l: &[f64; D]) -> [[f64; D]; N] {
        let d = element::derivatives(self.order, l);
        let along = |k: usize, c: usize| (0..self.x.len()).map(|n| (d[n][k + 1] - d[n][0]) * self.x[n][c]).sum();
        std::array::from_fn(|k| std::array::from_fn(|c| along(k, c)))
    }
}

fn plus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// The limits of distance and inclination within which two facets face each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Largest distance along the normal.
    pub gap: f64,
    /// Largest overlap.
    pub overlap: f64,
    /// How far away facets can be at all: facets beyond `gap` are no partners, but they are known to be too far away.
    pub farthest: f64,
    /// Least cosine between the normal of one facet and minus that of the other.
    pub facing: f64,
}

/// The reasons why facets of side b that lie before a facet of side a are not its partners.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Refused {
    /// The angle between the normals is too large.
    pub steep: bool,
    /// Facets of side b whose distance is too large.
    pub far: BTreeSet<usize>,
    /// Number of pieces and of points of pieces that the search has lost.
    pub lost: usize,
}

impl Reach {
    /// Return the limits for two surfaces whose facets may be inclined by `angle` degrees and, if it is given, be apart by `distance`.
    ///
    /// The overlap is at most the size of the smaller surface, and at most the thickness of a body behind its surface, its volume
    /// over the area: a larger overlap would reach the far side of a thin body.
    pub fn between<const D: usize>(a: &Side<D>, b: &Side<D>, angle: f64, distance: Option<f64>) -> Self {
        let area = |side: &Side<D>| side.mean_measure() * side.facets.count() as f64;
        let extent = |side: &Side<D>| area(side).powf(1.0 / (D - 1) as f64);
        let thickness = |side: &Side<D>| side.space.measure() / area(side);
        let anywhere = Self::anywhere(a, b, angle);
        let overlap = extent(a).min(extent(b)).min(thickness(a)).min(thickness(b));
        let gap = distance.unwrap_or(anywhere.gap);
        Self { gap, overlap: gap.min(overlap), ..anywhere }
    }

    /// Return the limits that end at the angle alone. The distance is the diagonal of the box around both surfaces.
    pub fn anywhere<const D: usize>(a: &Side<D>, b: &Side<D>, angle: f64) -> Self {
        let [low, high] = around(a.extent(), b.extent());
        let gap = length(minus(high, low));
        Self { gap, overlap: gap, farthest: gap, facing: angle.to_radians().cos() }
    }

    /// Return whether a signed distance is within the limits.
    pub fn holds(&self, gap: f64) -> bool {
        gap <= self.gap && -gap <= self.overlap
    }

    /// Return whether facets with these unit normals face each other.
    pub fn faces<const D: usize>(&self, normal: [f64; D], other: [f64; D]) -> bool {
        -dot(&normal, &other) > self.facing
    }
}

impl Refused {
    /// Return whether `reach` admits facet `index` of side b at this distance, where a facet of side a has one of these unit `normals` and the
    /// other one is its own. Note the reason if not.
    fn admits<const D: usize>(&mut self, reach: &Reach, index: usize, gap: f64, normals: [[f64; D]; 2]) -> bool {
        let (faces, holds) = (reach.faces(normals[0], normals[1]), reach.holds(gap));
        self.steep |= holds && !faces;
        if faces && gap > reach.gap {
            self.far.insert(index);
        }
        faces && holds
    }
}

/// An R-tree of the boxes of facets of side b, or of bodies.
pub struct BoxTree<const D: usize> {
    tree: RTree<GeomWithData<Rectangle<[f64; D]>, usize>>,
}

impl<const D: usize> BoxTree<D> {
    /// Build the tree of the facets of a side.
    pub fn new(b: &Side<D>) -> Self {
        Self::of_boxes((0..b.facets.count()).map(|i| b.bounds(i)))
    }

    /// Build the tree of boxes, which are numbered in their order.
    pub fn of_boxes(boxes: impl Iterator<Item = [[f64; D]; 2]>) -> Self {
        let boxed = |([low, high], i): ([[f64; D]; 2], usize)| GeomWithData::new(Rectangle::from_corners(low, high), i);
        Self { tree: RTree::bulk_load(boxes.zip(0..).map(boxed).collect()) }
    }

    /// Return the facets whose boxes come within `distance` of the box of facet `i` of side a.
    pub fn near(&self, a: &Side<D>, i: usize, distance: f64) -> impl Iterator<Item = usize> + '_ {
        self.near_box(a.bounds(i), distance)
    }

    /// Return the numbers of the boxes within `distance` of a box.
    pub fn near_box(&self, [low, high]: [[f64; D]; 2], distance: f64) -> impl Iterator<Item = usize> + '_ {
        self.intersecting(low.map(|x| x - distance), high.map(|x| x + distance))
    }

    fn intersecting(&self, low: [f64; D], high: [f64; D]) -> impl Iterator<Item = usize> + '_ {
        self.tree.locate_in_envelope_intersecting(AABB::from_corners(low, high)).map(|candidate| candidate.data)
    }

    /// Return the facets near the prism of facet `i` of side a along its normals.
    ///
    /// The height of the prism is more than twice the distance of the nearest facet, so that tilted surfaces are found too,
    /// and at most `reach` plus the size of the facet.
    fn around(&self, a: &Side<D>, i: usize, reach: &Reach) -> Vec<usize> {
        let [low, high] = a.bounds(i);
        let middle: [f64; D] = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
        let size = length(minus(high, low));
        let Some(nearest) = self.tree.nearest_neighbor(middle) else { return Vec::new() };
        let (from, to) = (nearest.geom().lower(), nearest.geom().upper());
        // The facet lies somewhere in its box, so its farthest corner counts.
        let away: [f64; D] = std::array::from_fn(|c| (from[c] - middle[c]).abs().max((middle[c] - to[c]).abs()));
        let height = 2.0 * length(away) + size;
        let found = self.within(a, i, reach.overlap.min(height) + size, reach.gap.min(height) + size);
        // The nearest facet need not face this one: a partner may be farther away.
        if found.is_empty() { self.within(a, i, reach.overlap, reach.gap) } else { found }
    }

    /// Return the pieces of facet `i` of side a that `facing` makes of facets of side b, and note in `refused` why others are none.
    ///
    /// If no facet near it is a partner, those farther away are tried. They add to what is too far, while steep facets count near the facet
    /// alone. Where a partner ends, nothing farther away takes its place: means over a facet have no meaning where distances jump by more than its size.
    fn pieces<P>(
        &self,
        a: &Side<D>,
        i: usize,
        reach: &Reach,
        refused: &mut Refused,
        facing: impl Fn(&[usize], &mut Refused) -> Vec<P>,
    ) -> Vec<P> {
        let near = self.around(a, i, reach);
        let pieces = facing(&near, refused);
        if !pieces.is_empty() {
            return pieces;
        }
        let mut farther = Refused::default();
        let pieces = facing(&self.before(a, i, reach, &near), &mut farther);
        refused.far.append(&mut farther.far);
        pieces
    }

    /// Return the facets that rays from facet `i` of side a along its normals may meet at any distance before it, without those in `known`.
    fn before(&self, a: &Side<D>, i: usize, reach: &Reach, known: &[usize]) -> Vec<usize> {
        let rays = self.tree.locate_with_selection_function(Rays::from(a, i, reach.farthest));
        rays.map(|candidate| candidate.data).filter(|index| !known.contains(index)).collect()
    }

    /// Return the facets whose boxes intersect the box of a prism. It extends from `below` behind facet `i` to `above` before it.
    fn within(&self, a: &Side<D>, i: usize, below: f64, above: f64) -> Vec<usize> {
        let [mut low, mut high] = a.bounds(i);
        for at in a.facet_nodes(i).take(D) {
            let (x, n) = (a.space.nodes[at.node as usize], at.direction);
            for c in 0..D {
                for end in [x[c] - below * n[c], x[c] + above * n[c]] {
                    low[c] = low[c].min(end);
                    high[c] = high[c].max(end);
                }
            }
        }
        let slack = 1e-9 * length(minus(high, low));
        self.intersecting(low.map(|x| x - slack), high.map(|x| x + slack)).collect()
    }
}

/// The rays from a facet along its normals.
struct Rays<const D: usize> {
    /// Mean of the vertices.
    middle: [f64; D],
    /// Mean of the normals at the vertices, of length one.
    axis: [f64; D],
    /// Length of the rays.
    length: f64,
    /// Largest distance of a ray from the axis at the facet.
    radius: f64,
    /// By how much this distance grows along the rays at most, per length.
    spread: f64,
}

impl<const D: usize> Rays<D> {
    fn from(a: &Side<D>, i: usize, length_of_rays: f64) -> Self {
        let nodes: Vec<&FaceNode<D>> = a.facet_nodes(i).take(D).collect();
        let mean = |value: &dyn Fn(&FaceNode<D>) -> [f64; D]| -> [f64; D] {
            std::array::from_fn(|c| nodes.iter().map(|at| value(at)[c]).sum::<f64>() / D as f64)
        };
        let axis = unit(mean(&|at| at.direction));
        let differences = nodes.iter().map(|at| length(minus(at.direction, axis)));
        let [low, high] = a.bounds(i);
        Self {
            middle: mean(&|at| a.space.nodes[at.node as usize]),
            axis,
            length: length_of_rays,
            radius: length(minus(high, low)),
            spread: differences.fold(0.0, f64::max),
        }
    }

    /// Return whether some ray may enter a box: whether the axis enters it once it is enlarged by the largest distance of a ray from the axis.
    fn may_enter(&self, envelope: &AABB<[f64; D]>) -> bool {
        let (low, high) = (envelope.lower(), envelope.upper());
        let farthest = |c: usize| (self.middle[c] - low[c]).abs().max((high[c] - self.middle[c]).abs());
        let away = length::<D>(std::array::from_fn(farthest)).min(self.length);
        let slack = self.radius + self.spread * away;
        let (mut from, mut to) = (0.0_f64, self.length);
        for c in 0..D {
            let ends = [low[c] - slack, high[c] + slack].map(|x| x - self.middle[c]);
            if self.axis[c] == 0.0 {
                if ends[0] > 0.0 || ends[1] < 0.0 {
                    return false;
                }
                continue;
            }
            let [p, q] = ends.map(|end| end / self.axis[c]);
            (from, to) = (from.max(p.min(q)), to.min(p.max(q)));
        }
        from <= to
    }
}

impl<const D: usize> SelectionFunction<GeomWithData<Rectangle<[f64; D]>, usize>> for Rays<D> {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; D]>) -> bool {
        self.may_enter(envelope)
    }

    fn should_unpack_leaf(&self, leaf: &GeomWithData<Rectangle<[f64; D]>, usize>) -> bool {
        self.may_enter(&leaf.geom().envelope())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A refused facet is steep where the distance would do, and far where the direction would do.
    #[test]
    fn refusals_have_their_reasons() {
        let reach = Reach { gap: 2.0, overlap: 1.0, farthest: 9.0, facing: 0.5 };
        let (up, down, steep) = ([0.0, 1.0], [0.0, -1.0], [1.0, 0.0]);
        for (gap, other, admitted, is_steep, is_far) in [
            (1.0, down, true, false, false),
            (-0.5, down, true, false, false),
            (3.0, down, false, false, true),
            (-2.0, down, false, false, false),
            (1.0, steep, false, true, false),
            (3.0, steep, false, false, false),
        ] {
            let mut refused = Refused::default();
            assert_eq!(refused.admits(&reach, 7, gap, [up, other]), admitted, "{gap} {other:?}");
            assert_eq!((refused.steep, refused.far.contains(&7)), (is_steep, is_far), "{gap} {other:?}");
        }
        assert!(!reach.faces(up, up) && !reach.faces(up, [0.9, -0.4]) && reach.faces(up, [0.8, -0.6]));
    }
}
