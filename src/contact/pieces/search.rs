//! Which facets of side b may face a facet of side a.

use super::reach::{Reach, Refused};
use crate::contact::side::{Side, length, unit};
use crate::fem::minus;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

/// The corners of a box with the least and the largest coordinates.
pub type Bounds<const D: usize> = ([f64; D], [f64; D]);

/// An R-tree of the boxes of facets of side b, or of bodies.
pub struct Search<const D: usize> {
    tree: RTree<GeomWithData<Rectangle<[f64; D]>, usize>>,
}

impl<const D: usize> Search<D> {
    /// Build the tree of the facets of a side.
    pub fn new(b: &Side<D>) -> Self {
        Self::of_boxes((0..b.facets.count()).map(|i| b.bounds(i)))
    }

    /// Build the tree of boxes, which are numbered in their order.
    pub fn of_boxes(boxes: impl Iterator<Item = Bounds<D>>) -> Self {
        let boxed = |((low, high), i): (Bounds<D>, usize)| GeomWithData::new(Rectangle::from_corners(low, high), i);
        Self { tree: RTree::bulk_load(boxes.zip(0..).map(boxed).collect()) }
    }

    /// Return the facets whose boxes come within `distance` of the box of facet `i` of side a.
    pub fn near(&self, a: &Side<D>, i: usize, distance: f64) -> impl Iterator<Item = usize> + '_ {
        self.near_box(a.bounds(i), distance)
    }

    /// Return the numbers of the boxes within `distance` of a box.
    pub fn near_box(&self, (low, high): Bounds<D>, distance: f64) -> impl Iterator<Item = usize> + '_ {
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
        let (low, high) = a.bounds(i);
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
    pub(super) fn pieces<P>(
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
        let (mut low, mut high) = a.bounds(i);
        for &node in &a.facets.facet(i)[..D] {
            let (x, n) = (a.space.nodes[node as usize], a.normals[&node]);
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
        let nodes = &a.facets.facet(i)[..D];
        let mean = |value: &dyn Fn(u32) -> [f64; D]| -> [f64; D] {
            std::array::from_fn(|c| nodes.iter().map(|&node| value(node)[c]).sum::<f64>() / D as f64)
        };
        let axis = unit(mean(&|node| a.normals[&node]));
        let differences = nodes.iter().map(|node| length(minus(a.normals[node], axis)));
        let (low, high) = a.bounds(i);
        Self {
            middle: mean(&|node| a.space.nodes[node as usize]),
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
