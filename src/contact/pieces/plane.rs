//! Common pieces of two plane curves: intervals of the facets of side a.

use super::{AWAY, Common, Lost, MOST_STEPS, ON_FACET, ROUNDING, Reach, Refused, SNAP, Search, Shared};
use crate::contact::side::{Side, length, unit};
use crate::fem::{area_vector, element, quadrature};
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
        let near = search.around(a, i, reach).into_iter().map(|index| (index, Curve::of(b, index)));
        let found = facing(&facet, near, reach, refused);
        let mut free = vec![(0.0, 1.0)];
        let mut pieces = Vec::new();
        for piece in &found {
            for (low, high) in take(&mut free, piece.range) {
                pieces.push((low, high, piece));
            }
        }
        pieces.sort_by(|p, q| p.0.total_cmp(&q.0));
        for (low, high, Piece { index, other, .. }) in pieces {
            let offset = minus(facet.from, other.from);
            for &(position, weight) in &rule {
                let s = low + (high - low) * position;
                let (here, normal) = (facet.at(s), facet.normal(s));
                let from = plus(here, offset);
                let Ok(Some(t)) = other.hit(from, normal) else {
                    // a normal on either side has met this very facet
                    refused.lost += 1;
                    continue;
                };
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
                    weight: weight * (high - low) * length(facet.tangent(s)) * a.space.circle(&plus(here, facet.from)),
                    gap,
                });
            }
        }
    }
    common
}

/// Return the pieces of a facet of side a that face facets of side b, the nearest first; note in `refused` what is none.
fn facing(
    facet: &Curve,
    near: impl Iterator<Item = (usize, Curve)>,
    reach: &Reach,
    refused: &mut Refused,
) -> Vec<Piece> {
    let mut found: Vec<Piece> = Vec::new();
    for (index, other) in near {
        let direction = other.direction;
        match Piece::between(facet, other, index) {
            Ok(piece) => {
                found.extend(piece.filter(|p| refused.admits(reach, p.gap, facet.direction, direction)));
            }
            Err(Lost) => refused.lost += usize::from(reach.faces(facet.direction, direction)),
        }
    }
    found.sort_by(|p, q| p.gap.abs().total_cmp(&q.gap.abs()).then(p.index.cmp(&q.index)));
    found
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

/// A facet of side a or b as a parametrised curve x(s), s from 0 to 1. Coordinates are measured from its first end: what is interpolated
/// or subtracted then rounds relative to the facet, wherever it lies.
struct Curve {
    order: Order,
    /// Its first end.
    from: [f64; 2],
    /// Its nodes, measured from there.
    x: Vec<[f64; 2]>,
    /// The largest distance of a node from there.
    size: f64,
    normals: [[f64; 2]; 2],
    /// Outer unit normal in the middle.
    direction: [f64; 2],
}

impl Curve {
    fn of(side: &Side<2>, i: usize) -> Self {
        let nodes = side.facets.facet(i);
        let mut x = side.facets.coordinates(i, side.space);
        let from = x[0];
        x.iter_mut().for_each(|x| *x = minus(*x, from));
        Self {
            order: side.facets.order,
            from,
            size: x.iter().map(|&x| length(x)).fold(0.0, f64::max),
            normals: [side.normals[&nodes[0]], side.normals[&nodes[1]]],
            direction: unit(area_vector(side.facets.order, &x, &[0.5; 2])),
            x,
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

    /// Return a bound of the sum of sizes of the terms that [`Curve::at`] adds.
    fn terms(&self, s: f64) -> f64 {
        let reach = 1.0 + 2.0 * s.abs();
        // |l (2l - 1)| and |4 l m| of the three quadratic functions together are below 3 reach^2
        self.size * if self.order == Order::P1 { reach } else { 3.0 * reach * reach }
    }

    /// Parameter at which the line through `x` along `n` meets the curve: cross(x(s) - x, n) = 0. `None` if it does not.
    fn hit(&self, x: [f64; 2], n: [f64; 2]) -> Result<Option<f64>, Lost> {
        let found = newton(|s| Equation {
            value: cross(minus(self.at(s), x), n),
            slope: cross(self.tangent(s), n),
            terms: (self.terms(s) + length(x)) * length(n),
        })?;
        Ok(found.filter(|s| (-ON_FACET..=1.0 + ON_FACET).contains(s)))
    }

    /// Distance of the point at `s` from `x` along `n`, signed.
    fn distance(&self, s: f64, x: [f64; 2], n: [f64; 2]) -> f64 {
        let here = self.at(s);
        (0..2).map(|c| (here[c] - x[c]) * n[c]).sum::<f64>() / length(n)
    }

    /// Parameter whose normal passes through `x`: cross(x - x(s), n(s)) = 0. `None` if there is none.
    fn foot(&self, x: [f64; 2]) -> Result<Option<f64>, Lost> {
        let turn = minus(self.normals[1], self.normals[0]);
        newton(|s| {
            let (t, n) = (self.tangent(s), self.normal(s));
            let arm = minus(x, self.at(s));
            Equation {
                value: cross(arm, n),
                slope: cross(arm, turn) - cross(t, n),
                terms: (self.terms(s) + length(x)) * (1.0 + 2.0 * s.abs()),
            }
        })
    }
}

/// An equation in the parameter of a curve at one place.
struct Equation {
    value: f64,
    slope: f64,
    /// A bound of the sum of sizes of the terms that the value adds.
    terms: f64,
}

/// Return a zero near the middle of \[0, 1\] by Newton's method; `None` if it runs away. A value is a zero once it is within the
/// rounding of its own evaluation.
///
/// # Errors
/// [`Lost`] if values stay larger.
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

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|c| a[c] + b[c])
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
    /// Return the piece before one facet of b, if it has one.
    ///
    /// # Errors
    /// [`Lost`] if the search for an end of the piece fails.
    fn between(a: &Curve, b: Curve, index: usize) -> Result<Option<Self>, Lost> {
        if dot(&a.direction, &b.direction) >= 0.0 {
            return Ok(None);
        }
        // between these places the normals of a either all meet b or all miss it; the foot of an end that lies behind the
        // centre of the curve means nothing, but does no harm as a place
        let offset = minus(b.from, a.from);
        let mut places = vec![0.0, 1.0];
        for &x in &b.x[..2] {
            places.extend(a.foot(plus(x, offset))?.filter(|s| *s > SNAP && *s < 1.0 - SNAP));
        }
        places.sort_by(f64::total_cmp);
        let meets = |low: f64, high: f64| -> Result<Option<f64>, Lost> {
            let middle = 0.5 * (low + high);
            let (from, normal) = (minus(a.at(middle), offset), a.normal(middle));
            Ok(b.hit(from, normal)?.map(|t| b.distance(t, from, normal)))
        };
        let mut met: Vec<&[f64]> = Vec::new();
        for ends in places.windows(2).filter(|ends| ends[1] - ends[0] > SNAP) {
            met.extend(meets(ends[0], ends[1])?.map(|_| ends));
        }
        let (Some(first), Some(last)) = (met.first(), met.last()) else { return Ok(None) };
        let range = (first[0], last[1]);
        Ok(meets(range.0, range.1)?.map(|gap| Self { range, index, other: b, gap }))
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
