//! Common pieces of two plane curves: intervals of the facets of side a.

use super::{Common, ON_FACET, Reach, Refused, SNAP, Search, Shared};
use crate::contact::side::{Side, length, unit};
use crate::fem::{element, quadrature};
use crate::linalg::dot;
use crate::problem::order::Order;

/// The common pieces of two plane curves on those facets of side a that are `asked` for.
pub fn plane(a: &Side<2>, b: &Side<2>, reach: &Reach, asked: &dyn Fn(usize) -> bool) -> Common<2> {
    let search = Search::new(b);
    let quadratic = a.facets.order == Order::P2 || b.facets.order == Order::P2;
    let rule = quadrature::gauss(if quadratic { 4 } else { 3 });
    let mut common = Common { points: Vec::new(), refused: vec![Refused::default(); a.facets.count()] };
    for i in (0..a.facets.count()).filter(|&i| asked(i)) {
        let facet = Curve::of(a, i);
        let refused = &mut common.refused[i];
        let mut found: Vec<Piece> = search
            .around(a, i, reach)
            .into_iter()
            .filter_map(|index| Piece::between(&facet, Curve::of(b, index), index))
            .filter(|piece| refused.admits(reach, piece.gap, facet.direction, piece.other.direction))
            .collect();
        found.sort_by(|p, q| p.gap.abs().total_cmp(&q.gap.abs()).then(p.index.cmp(&q.index)));
        let mut free = vec![(0.0, 1.0)];
        let mut pieces = Vec::new();
        for piece in &found {
            for (low, high) in take(&mut free, piece.range) {
                pieces.push((low, high, piece));
            }
        }
        pieces.sort_by(|p, q| p.0.total_cmp(&q.0));
        for (low, high, Piece { index, other, .. }) in pieces {
            for &(position, weight) in &rule {
                let s = low + (high - low) * position;
                let (from, normal) = (facet.at(s), facet.normal(s));
                let Some(t) = other.hit(from, normal) else { continue };
                let gap = other.distance(t, from, normal);
                if !reach.holds(gap) {
                    refused.far = true;
                    continue;
                }
                common.points.push(Shared {
                    facet_a: i,
                    at_a: [1.0 - s, s],
                    facet_b: *index,
                    at_b: [1.0 - t, t],
                    weight: weight * (high - low) * length(facet.tangent(s)) * a.space.circle(&from),
                    gap,
                });
            }
        }
    }
    common
}

/// Removes `range` from the free intervals and returns what it got of them.
fn take(free: &mut Vec<(f64, f64)>, range: (f64, f64)) -> Vec<(f64, f64)> {
    let (mut got, mut left) = (Vec::new(), Vec::new());
    for &(low, high) in free.iter() {
        let (from, to) = (low.max(range.0), high.min(range.1));
        if to - from <= SNAP {
            left.push((low, high));
            continue;
        }
        got.push((from, to));
        left.extend([(low, from), (to, high)].into_iter().filter(|(l, h)| h - l > SNAP));
    }
    *free = left;
    got
}

/// A facet of side a or b as a parametrised curve x(s), s from 0 to 1.
struct Curve {
    order: Order,
    x: Vec<[f64; 2]>,
    normals: [[f64; 2]; 2],
    /// Outer unit normal in the middle.
    direction: [f64; 2],
}

impl Curve {
    fn of(side: &Side<2>, i: usize) -> Self {
        let nodes = side.facets.facet(i);
        Self {
            order: side.facets.order,
            x: side.facets.coordinates(i, side.space),
            normals: [side.normals[&nodes[0]], side.normals[&nodes[1]]],
            direction: unit(side.area(i)),
        }
    }

    fn at(&self, s: f64) -> [f64; 2] {
        crate::fem::assemble::interpolate(&self.x, &element::values(self.order, &[1.0 - s, s]))
    }

    fn tangent(&self, s: f64) -> [f64; 2] {
        let d = element::derivatives(self.order, &[1.0 - s, s]);
        std::array::from_fn(|c| (0..self.x.len()).map(|n| (d[n][1] - d[n][0]) * self.x[n][c]).sum())
    }

    fn normal(&self, s: f64) -> [f64; 2] {
        std::array::from_fn(|c| (1.0 - s) * self.normals[0][c] + s * self.normals[1][c])
    }

    /// Parameter at which the line through `x` along `n` meets the curve: cross(x(s) - x, n) = 0. `None` if it does not.
    fn hit(&self, x: [f64; 2], n: [f64; 2]) -> Option<f64> {
        newton(|s| {
            let here = self.at(s);
            cross([here[0] - x[0], here[1] - x[1]], n) / cross(self.tangent(s), n)
        })
        .filter(|s| (-ON_FACET..=1.0 + ON_FACET).contains(s))
    }

    /// Distance of the point at `s` from `x` along `n`, signed.
    fn distance(&self, s: f64, x: [f64; 2], n: [f64; 2]) -> f64 {
        let here = self.at(s);
        (0..2).map(|c| (here[c] - x[c]) * n[c]).sum::<f64>() / length(n)
    }

    /// Parameter whose normal passes through `x`: cross(x - x(s), n(s)) = 0.
    fn foot(&self, x: [f64; 2]) -> Option<f64> {
        let turn: [f64; 2] = std::array::from_fn(|c| self.normals[1][c] - self.normals[0][c]);
        newton(|s| {
            let (here, t, n) = (self.at(s), self.tangent(s), self.normal(s));
            let arm = [x[0] - here[0], x[1] - here[1]];
            cross(arm, n) / (cross(arm, turn) - cross(t, n))
        })
    }
}

/// Zero of a function near the middle of \[0, 1\] by Newton's method; `step(s)` is value over slope. `None` if it runs away.
fn newton(step: impl Fn(f64) -> f64) -> Option<f64> {
    let mut s = 0.5;
    let mut last = f64::INFINITY;
    for _ in 0..30 {
        last = step(s);
        s -= last;
        if !s.is_finite() || s.abs() > 1e3 {
            return None;
        }
        if last.abs() < 1e-14 {
            break;
        }
    }
    // rounding may keep the last digits moving
    (last.abs() < SNAP * (1.0 + s.abs())).then_some(s)
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Part of a facet of side a that faces one facet of side b.
struct Piece {
    range: (f64, f64),
    index: usize,
    other: Curve,
    gap: f64,
}

impl Piece {
    fn between(a: &Curve, b: Curve, index: usize) -> Option<Self> {
        if dot(&a.direction, &b.direction) >= 0.0 {
            return None;
        }
        // between these places the normals of a either all meet b or all miss it; the foot of an end that lies behind the
        // centre of the curve means nothing, but does no harm as a place
        let mut places = vec![0.0, 1.0];
        places.extend(b.x[..2].iter().filter_map(|&x| a.foot(x)).filter(|s| *s > SNAP && *s < 1.0 - SNAP));
        places.sort_by(f64::total_cmp);
        let meets = |low: f64, high: f64| {
            let middle = 0.5 * (low + high);
            let (from, normal) = (a.at(middle), a.normal(middle));
            b.hit(from, normal).map(|t| b.distance(t, from, normal))
        };
        let within = places.windows(2).filter(|ends| ends[1] - ends[0] > SNAP);
        let mut met = within.filter(|ends| meets(ends[0], ends[1]).is_some());
        let first = met.next()?;
        let range = (first[0], met.next_back().unwrap_or(first)[1]);
        let gap = meets(range.0, range.1)?;
        Some(Self { range, index, other: b, gap })
    }
}

#[cfg(test)]
mod tests {
    use super::take;

    #[test]
    fn intervals_are_given_away_once() {
        let mut free = vec![(0.0, 1.0)];
        assert_eq!(take(&mut free, (0.25, 0.5)), [(0.25, 0.5)]);
        assert_eq!(take(&mut free, (0.0, 0.75)), [(0.0, 0.25), (0.5, 0.75)]);
        assert_eq!(free, [(0.75, 1.0)]);
        assert_eq!(take(&mut free, (0.25, 0.75)), []);
    }
}
