//! Which facets of side b may face a facet of side a.

use super::reach::Reach;
use crate::contact::side::{Side, length};
use crate::fem::minus;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

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
    pub fn around(&self, a: &Side<D>, i: usize, reach: &Reach) -> Vec<usize> {
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
