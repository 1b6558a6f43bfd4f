//! Common pieces of two plane curves: intervals of the facets of side a.

use super::facet::{Facet, Lost, Rays, SNAP, plus};
use super::{BoxTree, Coverage, IntegrationPoint, Intersection, Reach};
use crate::contact::side::Side;
use crate::fem::{element, length, minus};
use crate::linalg::dot;

/// Largest distance outside of the parameters of a facet at which a ray may meet it in the plane, where pieces end
/// exactly where facets do. It is far above the rounding of a search and far below the spacing of integration points,
/// so that it decides only at ends.
const ON_FACET: f64 = 1e-6;

/// Return the common pieces of two plane curves.
pub fn in_plane(a: &Side<2>, b: &Side<2>, reach: &Reach) -> Intersection<2> {
    let search = BoxTree::new(b);
    // products of functions of both sides, and one degree more for curved facets
    let rule = element::gauss((a.facets.order.degree() + b.facets.order.degree() + 3) / 2 + 1);
    let mut common = Intersection { points: Vec::new(), cover: vec![Coverage::default(); a.facets.count()] };
    for i in 0..a.facets.count() {
        let facet = Facet::of(a, i);
        let cover = &mut common.cover[i];
        let pieces = search.pieces(&facet, reach, cover, |near, cover| facing(&facet, b, near, reach, cover));
        for (low, high, FacetSegment { index, other, .. }) in nearest(&pieces) {
            let offset = minus(facet.from, other.from);
            for (k, &(position, weight)) in rule.iter().enumerate() {
                let s = low + (high - low) * position;
                let (on_a, normal) = (facet.at(&place(s)), facet.normal(&place(s)));
                let Ok(Some((at_b, t))) = other.hit(plus(on_a, offset), normal, ON_FACET) else {
                    // The normals on both sides of this point hit the facet, so this one is lost.
                    cover.lost += 1;
                    continue;
                };
                let gap = t * length(normal);
                if !reach.holds(gap) {
                    cover.far.insert(*index);
                    continue;
                }
                // a piece of which points are too far apart ends at its last point that is not
                let [from, to] = [if k == 0 { low } else { s }, if k + 1 == rule.len() { high } else { s }];
                cover.ends = [cover.ends[0].min(from), cover.ends[1].max(to)];
                common.points.push(IntegrationPoint {
                    facet_a: i,
                    at_a: place(s),
                    facet_b: *index,
                    at_b,
                    weight: weight
                        * (high - low)
                        * length(facet.tangent(0, &place(s)))
                        * a.space.circle(&plus(on_a, facet.from)),
                    gap,
                });
            }
        }
    }
    common
}

/// Return the pieces of a facet of side a that face facets of side b, the nearest first. Note in `cover` why others
/// are none.
fn facing(facet: &Facet<2>, b: &Side<2>, near: &[usize], reach: &Reach, cover: &mut Coverage) -> Vec<FacetSegment> {
    let mut pieces: Vec<FacetSegment> = Vec::new();
    for &index in near {
        let other = Facet::of(b, index);
        let directions = [facet.direction, other.direction];
        match FacetSegment::between(facet, other, index) {
            Ok(piece) => pieces.extend(piece.filter(|p| cover.admits(reach, index, p.gap, directions))),
            Err(Lost) => {
                let is_met = Rays::of(facet, [f64::INFINITY; 2]).may_meet(&b.facets.coordinates(index, b.space));
                cover.lost += usize::from(is_met && reach.faces(directions[0], directions[1]));
            }
        }
    }
    pieces.sort_by(|p, q| p.gap.abs().total_cmp(&q.gap.abs()).then(p.index.cmp(&q.index)));
    pieces
}

/// Return the intervals of a facet of side a with the piece that is nearest there, ordered along the facet.
fn nearest(pieces: &[FacetSegment]) -> Vec<(f64, f64, &FacetSegment)> {
    let mut free = vec![(0.0, 1.0)];
    let mut intervals = Vec::new();
    for piece in pieces {
        intervals.extend(claim(&mut free, piece.range).into_iter().map(|(low, high)| (low, high, piece)));
    }
    intervals.sort_by(|p, q| p.0.total_cmp(&q.0));
    intervals
}

/// Remove `range` from the free intervals and return the parts of it that were free.
fn claim(free: &mut Vec<(f64, f64)>, range: (f64, f64)) -> Vec<(f64, f64)> {
    let (mut claimed, mut remaining) = (Vec::new(), Vec::new());
    for &(low, high) in free.iter() {
        let (from, to) = (low.max(range.0), high.min(range.1));
        if to - from <= SNAP {
            remaining.push((low, high));
            continue;
        }
        claimed.push((from, to));
        remaining.extend([(low, from), (to, high)].into_iter().filter(|(l, h)| h - l > SNAP));
    }
    *free = remaining;
    claimed
}

/// Return the barycentric coordinates of the parameter s, which runs from 0 to 1 along a facet.
fn place(s: f64) -> [f64; 2] {
    [1.0 - s, s]
}

/// The part of a facet of side a that faces one facet of side b.
struct FacetSegment {
    /// Interval of the parameter on side a.
    range: (f64, f64),
    /// Index of the facet of side b.
    index: usize,
    other: Facet<2>,
    /// Signed distance in the middle of the piece.
    gap: f64,
}

impl FacetSegment {
    /// Return the piece that faces one facet of b, if there is one.
    ///
    /// # Errors
    /// [`Lost`] if the search for an end of the piece fails.
    fn between(a: &Facet<2>, b: Facet<2>, index: usize) -> Result<Option<Self>, Lost> {
        if dot(&a.direction, &b.direction) >= 0.0 {
            return Ok(None);
        }
        // Between two neighbouring breaks the normals of a either all hit b or all miss it. The foot of an end of b
        // behind the centre of the curve has no meaning, but an additional break does no harm.
        let offset = minus(b.from, a.from);
        let mut breaks = vec![0.0, 1.0];
        for &x in &b.x[..2] {
            let foot = match a.foot(plus(x, offset)) {
                // normals turn by less than a right angle however far they are continued, so that some points have no
                // foot
                Err(Lost) if !Rays::of(a, [f64::INFINITY; 2]).may_meet(&[plus(x, b.from)]) => None,
                found => found?,
            };
            breaks.extend(foot.map(|[_, s]| s).filter(|s| *s > SNAP && *s < 1.0 - SNAP));
        }
        breaks.sort_by(f64::total_cmp);
        let gap_in_middle = |low: f64, high: f64| -> Result<Option<f64>, Lost> {
            let middle = 0.5 * (low + high);
            let (from, normal) = (minus(a.at(&place(middle)), offset), a.normal(&place(middle)));
            Ok(b.hit(from, normal, ON_FACET)?.map(|(_, t)| t * length(normal)))
        };
        let mut hits: Vec<&[f64]> = Vec::new();
        for ends in breaks.windows(2).filter(|ends| ends[1] - ends[0] > SNAP) {
            hits.extend(gap_in_middle(ends[0], ends[1])?.map(|_| ends));
        }
        let (Some(first), Some(last)) = (hits.first(), hits.last()) else { return Ok(None) };
        let range = (first[0], last[1]);
        Ok(gap_in_middle(range.0, range.1)?.map(|gap| Self { range, index, other: b, gap }))
    }
}

#[cfg(test)]
mod tests {
    use super::claim;

    #[test]
    fn intervals_are_given_away_once() {
        let mut free = vec![(0.0, 1.0)];
        assert_eq!(claim(&mut free, (0.25, 0.5)), [(0.25, 0.5)]);
        assert_eq!(claim(&mut free, (0.0, 0.75)), [(0.0, 0.25), (0.5, 0.75)]);
        assert_eq!(free, [(0.75, 1.0)]);
        assert_eq!(claim(&mut free, (0.25, 0.75)), []);
    }
}
