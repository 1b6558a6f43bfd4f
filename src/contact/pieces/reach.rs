//! Which facets may be partners: limits of their distance and their angle.

use crate::contact::side::{Side, length};
use crate::linalg::dot;
use std::collections::BTreeSet;

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
        let ((low, high), (from, to)) = (a.extent(), b.extent());
        let diagonal: [f64; D] = std::array::from_fn(|c| high[c].max(to[c]) - low[c].min(from[c]));
        let gap = length(diagonal);
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
    pub(super) fn admits<const D: usize>(
        &mut self,
        reach: &Reach,
        index: usize,
        gap: f64,
        normals: [[f64; D]; 2],
    ) -> bool {
        let (faces, holds) = (reach.faces(normals[0], normals[1]), reach.holds(gap));
        self.steep |= holds && !faces;
        if faces && gap > reach.gap {
            self.far.insert(index);
        }
        faces && holds
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
