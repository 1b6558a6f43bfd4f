//! Common pieces of two surfaces. Facets of side a face facets of side b along the normals of side a. They are cut into
//! pieces on which products of shape functions of both sides are integrated exactly.
//!
//! Normals are interpolated between the vertices of side a, so that curved surfaces are covered without gaps or
//! overlaps between neighbouring facets. A piece is an interval ([`in_plane`]) or a convex polygon ([`in_space`]) in
//! the parameters of one facet of side a.

mod facet;
mod plane;
mod space;

pub use super::point::IntegrationPoint;
pub use plane::in_plane;
pub use space::in_space;

use super::basis::PressureBasis;
use super::side::Side;
use crate::fem::{area_vector, element, length, minus};
use crate::linalg::{around, dot};
use facet::{Facet, Rays, plus};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The common pieces of two surfaces.
#[derive(Debug, Clone, Default)]
pub struct Intersection<const D: usize> {
    /// Integration points of the common pieces, grouped by facet of side a.
    pub points: Vec<IntegrationPoint<D>>,
    /// What was found before each facet of side a.
    pub cover: Vec<Coverage>,
}

impl<const D: usize> Intersection<D> {
    /// Return the facets of both sides that face each other, but are too far apart.
    pub fn far(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.cover.iter().enumerate().flat_map(|(i, cover)| cover.far.iter().map(move |&j| (i, j)))
    }
}

impl<const D: usize> Intersection<D> {
    /// Return the integration points of all facets of a side that is before a rigid obstacle. The obstacle has the
    /// facets of the side itself, at no distance, so that its forces are the opposite ones.
    pub fn of_one(a: &Side<D>) -> Self {
        let order = a.facets.order;
        let rule = if D == 2 { element::rule(2, 2 * order.degree() + 3) } else { element::rule_of_products(D, order) };
        let mut points = Vec::new();
        for facet in 0..a.facets.count() {
            let x = a.facets.coordinates(facet, a.space);
            for (l, weight) in rule.iter() {
                let at: [f64; D] = std::array::from_fn(|k| l[k]);
                let ring = a.space.circle(&a.facets.point(facet, a.space, l));
                let weight = weight * length(area_vector(a.facets.order, &x, l)) * ring;
                points.push(IntegrationPoint { facet_a: facet, at_a: at, facet_b: facet, at_b: at, weight, gap: 0.0 });
            }
        }
        Self { points, cover: vec![Coverage { ends: [0.0, 1.0], ..Coverage::default() }; a.facets.count()] }
    }

    /// Take the surfaces as touching everywhere.
    pub fn close(&mut self) {
        self.points.iter_mut().for_each(|point| point.gap = 0.0);
    }
}

/// A function that finds the common pieces of two surfaces.
pub type Cut<const D: usize> = fn(&Side<D>, &Side<D>, &Reach) -> Intersection<D>;

/// Share from which a facet counts as fully paired: by quadrature, the length of a curve differs a little between a
/// facet and its pieces.
pub(super) const WHOLE: f64 = 1.0 - 1e-3;

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

/// What lies before a facet of side a.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Its length (area), in bodies of revolution the area of a ring.
    pub measure: f64,
    /// Share of it that is paired.
    pub share: f64,
    /// Ends of the part of an edge that is paired, from 0 to 1 along it.
    pub ends: [f64; 2],
    /// Its pressure functions, if it is paired at all. They do not go from rank to rank.
    #[serde(skip)]
    pub basis: Option<PressureBasis>,
    /// Facets of side b whose distance is too large.
    pub far: BTreeSet<usize>,
    /// Whether facets of side b within the limits of distance are inclined by too much.
    pub is_inclined: bool,
    /// Number of pieces and of points of pieces that the search has lost, if it is not fully paired.
    pub lost: usize,
}

impl Default for Coverage {
    fn default() -> Self {
        Self {
            measure: 0.0,
            share: 0.0,
            ends: [1.0, 0.0],
            basis: None,
            far: BTreeSet::new(),
            is_inclined: false,
            lost: 0,
        }
    }
}

impl Reach {
    /// Return the limits for two surfaces whose facets may be inclined by `angle` degrees and, if it is given, be apart
    /// by `distance`.
    ///
    /// The overlap is at most the size of the smaller surface, and at most the thickness of a body behind its surface,
    /// its volume over the area: a larger overlap would reach the far side of a thin body.
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

impl Coverage {
    /// Return whether the facet is fully paired.
    pub fn is_whole(&self) -> bool {
        self.share > WHOLE
    }

    /// Return whether facets of side b lie before it that are too far away or inclined by too much.
    pub fn is_cut_short(&self) -> bool {
        self.is_inclined || !self.far.is_empty()
    }

    /// Return whether `reach` admits facet `index` of side b at this distance, where a facet of side a has one of these
    /// unit `normals` and the other one is its own. Note it if it is too far away.
    fn admits<const D: usize>(&mut self, reach: &Reach, index: usize, gap: f64, normals: [[f64; D]; 2]) -> bool {
        let faces = reach.faces(normals[0], normals[1]);
        if faces && gap > reach.gap {
            self.far.insert(index);
        }
        self.is_inclined |= !faces && reach.holds(gap);
        faces && reach.holds(gap)
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
        let near = AABB::from_corners(low.map(|x| x - distance), high.map(|x| x + distance));
        self.tree.locate_in_envelope_intersecting(near).map(|candidate| candidate.data)
    }

    /// Return the pieces of a facet of side a that `facing` makes of facets of side b, and note in `cover` why others
    /// are none.
    ///
    /// Facets that normals meet within twice the distance of the nearest one and the size of the facet are tried first,
    /// so that tilted surfaces are found, too. If none of them is a partner, those at any distance are. Where a partner
    /// ends, nothing farther away takes its place: means over a facet have no meaning where distances jump by more than
    /// its size.
    fn pieces<P>(
        &self,
        facet: &Facet<D>,
        reach: &Reach,
        cover: &mut Coverage,
        facing: impl Fn(&[usize], &mut Coverage) -> Vec<P>,
    ) -> Vec<P> {
        let met = |ends: [f64; 2]| -> Vec<usize> {
            self.tree.locate_with_selection_function(Rays::of(facet, ends)).map(|candidate| candidate.data).collect()
        };
        let middle = plus(facet.from, facet.at(&[1.0 / D as f64; D]));
        let Some(nearest) = self.tree.nearest_neighbor(middle) else { return Vec::new() };
        // The nearest facet lies somewhere in its box, so its farthest corner counts.
        let [from, to] = [nearest.geom().lower(), nearest.geom().upper()].map(|corner| minus(corner, middle));
        let away: [f64; D] = std::array::from_fn(|c| from[c].abs().max(to[c].abs()));
        let height = 2.0 * (length(away) + facet.size);
        let pieces = facing(&met([reach.overlap.min(height), reach.gap.min(height)]), cover);
        if !pieces.is_empty() {
            return pieces;
        }
        let mut farther = Coverage::default();
        let pieces = facing(&met([reach.overlap, reach.farthest]), &mut farther);
        cover.far.append(&mut farther.far);
        cover.is_inclined |= farther.is_inclined;
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A refused facet is far where the direction would do.
    #[test]
    fn refusals_have_their_reasons() {
        let reach = Reach { gap: 2.0, overlap: 1.0, farthest: 9.0, facing: 0.5 };
        let (up, down, steep) = ([0.0, 1.0], [0.0, -1.0], [1.0, 0.0]);
        for (gap, other, admitted, is_far) in [
            (1.0, down, true, false),
            (-0.5, down, true, false),
            (3.0, down, false, true),
            (-2.0, down, false, false),
            (1.0, steep, false, false),
            (3.0, steep, false, false),
        ] {
            let mut cover = Coverage::default();
            assert_eq!(cover.admits(&reach, 7, gap, [up, other]), admitted, "{gap} {other:?}");
            assert_eq!(cover.far.contains(&7), is_far, "{gap} {other:?}");
            assert_eq!(cover.is_inclined, gap == 1.0 && other == steep, "{gap} {other:?}");
        }
        assert!(!reach.faces(up, up) && !reach.faces(up, [0.9, -0.4]) && reach.faces(up, [0.8, -0.6]));
    }
}
