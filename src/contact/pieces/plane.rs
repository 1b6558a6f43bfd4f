//! Common pieces of two plane curves: intervals of the facets of side a.

use super::{
    AWAY, BoxTree, Facet, IntegrationPoint, Intersection, Lost, MOST_STEPS, ON_FACET, ROUNDING, Reach, Refused, SNAP,
    plus,
};
use crate::contact::side::Side;
use crate::fem::{element, length, minus};
use crate::linalg::dot;
use crate::problem::order::Order;

/// Return the common pieces of two plane curves.
pub fn in_plane(a: &Side<2>, b: &Side<2>, reach: &Reach) -> Intersection<2> {
    let search = BoxTree::new(b);
    let quadratic = a.facets.order == Order::P2 || b.facets.order == Order::P2;
    let rule = element::gauss(if quadratic { 4 } else { 3 });
    let mut common = Intersection { points: Vec::new(), refused: vec![Refused::default(); a.facets.count()] };
    for i in 0..a.facets.count() {
        let facet = Facet::of(a, i);
        let refused = &mut common.refused[i];
        let pieces = search.pieces(a, i, reach, refused, |near, refused| facing(&facet, b, near, reach, refused));
        for (low, high, FacetSegment { index, other, .. }) in nearest(&pieces) {
            let offset = minus(facet.from, other.from);
            for &(position, weight) in &rule {
                let s = low + (high - low) * position;
                let (on_a, normal) = (facet.at(&place(s)), facet.normal(&place(s)));
                let from = plus(on_a, offset);
                let Ok(Some(t)) = other.hit(from, normal) else {
                    // The normals on both sides of this point hit the facet, so this one is lost.
                    refused.lost += 1;
                    continue;
                };
                let gap = other.distance(t, from, normal);
                if !reach.holds(gap) {
                    refused.far.insert(*index);
                    continue;
                }
                common.points.push(IntegrationPoint {
                    facet_a: i,
                    at_a: place(s),
                    facet_b: *index,
                    at_b: place(t),
                    weight: weight * (high - low) * length(facet.tangent(s)) * a.space.circle(&plus(on_a, facet.from)),
                    gap,
                });
            }
        }
    }
    common
}

/// Return the pieces of a facet of side a that face facets of side b, the nearest first. Note in `refused` why others are none.
fn facing(facet: &Facet<2>, b: &Side<2>, near: &[usize], reach: &Reach, refused: &mut Refused) -> Vec<FacetSegment> {
    let mut pieces: Vec<FacetSegment> = Vec::new();
    for &index in near {
        let other = Facet::of(b, index);
        let directions = [facet.direction, other.direction];
        match FacetSegment::between(facet, other, index) {
            Ok(piece) => pieces.extend(piece.filter(|p| refused.admits(reach, index, p.gap, directions))),
            Err(Lost) => {
                let points: Vec<_> =
                    b.facets.coordinates(index, b.space).into_iter().map(|x| minus(x, facet.from)).collect();
                let is_met = facet.may_meet(&points);
                refused.lost += usize::from(is_met && reach.faces(directions[0], directions[1]));
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

impl Facet<2> {
    fn tangent(&self, s: f64) -> [f64; 2] {
        let [tangent] = self.tangents(&place(s));
        tangent
    }

    /// Return the parameter s at which the line through `x` along `n` meets the curve, cross(x(s) - x, n) = 0; `None` if it does
    /// not meet it.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    fn hit(&self, x: [f64; 2], n: [f64; 2]) -> Result<Option<f64>, Lost> {
        let found = newton(|s| Equation {
            value: cross(minus(self.at(&place(s)), x), n),
            slope: cross(self.tangent(s), n),
            terms: (self.terms(&place(s)) + length(x)) * length(n),
        })?;
        Ok(found.filter(|s| (-ON_FACET..=1.0 + ON_FACET).contains(s)))
    }

    /// Return the signed distance of the point at `s` from `x` along `n`.
    fn distance(&self, s: f64, x: [f64; 2], n: [f64; 2]) -> f64 {
        dot(&minus(self.at(&place(s)), x), &n) / length(n)
    }

    /// Return the parameter s whose normal n(s) passes through `x`, cross(x - x(s), n(s)) = 0; `None` if there is none.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    fn foot(&self, x: [f64; 2]) -> Result<Option<f64>, Lost> {
        let turn = minus(self.normals[1], self.normals[0]);
        newton(|s| {
            let (t, n) = (self.tangent(s), self.normal(&place(s)));
            let arm = minus(x, self.at(&place(s)));
            Equation {
                value: cross(arm, n),
                slope: cross(arm, turn) - cross(t, n),
                terms: (self.terms(&place(s)) + length(x)) * (1.0 + 2.0 * s.abs()),
            }
        })
    }
}

/// The value and slope of an equation in the parameter of a curve.
struct Equation {
    value: f64,
    slope: f64,
    /// Bound of the sum of the sizes of the terms that the value adds.
    terms: f64,
}

/// Return a zero of the equation by Newton's method from the middle of \[0, 1\]; `None` if the iterates run away. A value counts as
/// zero once it is within the rounding of its own evaluation.
///
/// # Errors
/// [`Lost`] if the values stay larger.
fn newton(equation: impl Fn(f64) -> Equation) -> Result<Option<f64>, Lost> {
    let mut s = 0.5;
    for _ in 0..MOST_STEPS {
        let Equation { value, slope, terms } = equation(s);
        let next = s - value / slope;
        let is_away = !next.is_finite() || next.abs() > AWAY;
        if value.abs() <= ROUNDING * terms {
            return Ok(Some(if is_away { s } else { next }));
        }
        if is_away {
            return Ok(None);
        }
        s = next;
    }
    Err(Lost)
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
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
        // Between two neighbouring breaks the normals of a either all hit b or all miss it. The foot of an end of b behind the
        // centre of the curve has no meaning, but an additional break does no harm.
        let offset = minus(b.from, a.from);
        let mut breaks = vec![0.0, 1.0];
        for &x in &b.x[..2] {
            breaks.extend(a.foot(plus(x, offset))?.filter(|s| *s > SNAP && *s < 1.0 - SNAP));
        }
        breaks.sort_by(f64::total_cmp);
        let gap_in_middle = |low: f64, high: f64| -> Result<Option<f64>, Lost> {
            let middle = 0.5 * (low + high);
            let (from, normal) = (minus(a.at(&place(middle)), offset), a.normal(&place(middle)));
            Ok(b.hit(from, normal)?.map(|t| b.distance(t, from, normal)))
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
