//! A facet as a parametrised curve or surface: where a line meets it, which of its normals passes through a point, and
//! what its normals may meet at all.

use crate::contact::side::Side;
use crate::fem::{area_vector, element, length, minus, unit};
use crate::linalg::{axpy, dot};
use crate::problem::order::Order;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTreeObject, SelectionFunction};

/// The failure of a search for a point on a facet: it did not converge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lost;

/// Largest number of Newton steps for a point on a facet. The start is within a facet's size of the point, and from
/// there each step doubles the number of correct digits: six steps are enough for a double, and twice as many make up
/// for a bad start.
const MOST_STEPS: usize = 12;

/// Rounding of a sum that is zero, as a share of the sizes of its terms. A coordinate of a point on a facet adds six
/// products, whose factors have three roundings each, to a point that was found in the same way: less than 32 roundings
/// of half an epsilon.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Distance from the end of a facet, in its parameter, within which a point is moved to the end, so that matching
/// surfaces match exactly. Points are found to [`ROUNDING`], and a piece of this share of a facet would change no
/// pressure in nine digits.
pub(super) const SNAP: f64 = 1e-9;

/// Parameter beyond which a point is neither on a facet nor near it: it has fewer digits than [`SNAP`] needs.
const AWAY: f64 = SNAP / f64::EPSILON;

/// A facet of side a or b as a parametrised curve or surface x(l), where l are barycentric coordinates.
///
/// Coordinates are measured from its first corner, so that interpolation and subtraction round relative to the size of
/// the facet. This holds also if the two bodies of a pair lie far from the others of the scene.
pub(super) struct Facet<const D: usize> {
    pub order: Order,
    /// First corner.
    pub from: [f64; D],
    /// Nodes, measured from the first corner.
    pub x: Vec<[f64; D]>,
    /// Largest distance of a node from the first corner.
    pub size: f64,
    /// Directions at the corners along which the facet faces the other side: normals, unless they are made of those of
    /// both sides.
    pub normals: [[f64; D]; D],
    /// Outer unit normal in the middle.
    pub direction: [f64; D],
}

impl<const D: usize> Facet<D> {
    pub fn of(side: &Side<D>, i: usize) -> Self {
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

    /// Return the point of the facet with barycentric coordinates `l`. An edge of an order above two goes on along its
    /// tangents beyond its ends, where its polynomial would amplify rounding.
    pub fn at(&self, l: &[f64; D]) -> [f64; D] {
        let on_facet = self.nearest(l);
        let mut x = element::interpolate(&self.x, &element::values(self.order, &on_facet));
        if on_facet[1] != l[1] {
            axpy(l[1] - on_facet[1], &self.tangent(0, l), &mut x);
        }
        x
    }

    /// Return the coordinates of the nearest point on an edge of an order above two. Other facets go on as polynomials.
    fn nearest(&self, l: &[f64; D]) -> [f64; D] {
        if self.order <= Order::P2 { *l } else { l.map(|l| l.clamp(0.0, 1.0)) }
    }

    pub fn normal(&self, l: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|c| (0..D).map(|k| l[k] * self.normals[k][c]).sum())
    }

    /// Return a bound of the sum of the sizes of the terms that [`Facet::at`] adds.
    fn terms(&self, l: &[f64; D]) -> f64 {
        let reach = 1.0 + 2.0 * l[1..].iter().map(|l| l.abs()).sum::<f64>();
        // The quadratic functions, l (2l - 1) and 4 l m for barycentric coordinates l and m, sum to less than 3 reach^2
        // in size, those of higher orders to less than 2.3 on their edge, along which tangents are near its size.
        self.size * if self.order == Order::P1 { reach } else { 3.0 * reach * reach }
    }

    /// Return the derivative of x by the barycentric coordinate l[k + 1]. When that coordinate grows, l[0] becomes
    /// smaller by as much.
    pub fn tangent(&self, k: usize, l: &[f64; D]) -> [f64; D] {
        element::tangent(self.order, &self.x, &self.nearest(l), k)
    }

    /// Return where the line x + t n meets the surface, as barycentric coordinates and t, at most `beside` outside of
    /// the facet; `None` if it does not meet it there.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    pub fn hit(&self, x: [f64; D], n: [f64; D], beside: f64) -> Result<Option<([f64; D], f64)>, Lost> {
        let distance = |on_facet: [f64; D], _: [f64; D]| dot(&minus(on_facet, x), &n) / dot(&n, &n);
        let found = self.search(distance, |l, t| Equations {
            value: std::array::from_fn(|c| self.at(l)[c] - x[c] - t * n[c]),
            columns: std::array::from_fn(|k| if k + 1 < D { self.tangent(k, l) } else { n.map(|n| -n) }),
            terms: self.terms(l) + length(x) + t.abs() * length(n),
        })?;
        Ok(found.filter(|(l, _)| l.iter().all(|l| (-beside..=1.0 + beside).contains(l))))
    }

    /// Return the barycentric coordinates whose normal passes through `x`, `None` if there are none.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    pub fn foot(&self, x: [f64; D]) -> Result<Option<[f64; D]>, Lost> {
        let distance = |on_facet: [f64; D], normal: [f64; D]| dot(&minus(x, on_facet), &normal) / dot(&normal, &normal);
        let found = self.search(distance, |l, t| {
            let (on_facet, normal) = (self.at(l), self.normal(l));
            let column = |k: usize| -> [f64; D] {
                let (along, turn) = (self.tangent(k, l), minus(self.normals[k + 1], self.normals[0]));
                std::array::from_fn(|c| along[c] + t * turn[c])
            };
            Equations {
                value: std::array::from_fn(|c| on_facet[c] + t * normal[c] - x[c]),
                columns: std::array::from_fn(|k| if k + 1 < D { column(k) } else { normal }),
                terms: self.terms(l) + length(x) + t.abs() * (1.0 + 2.0 * l[1..].iter().map(|l| l.abs()).sum::<f64>()),
            }
        })?;
        Ok(found.map(|(l, _)| l))
    }

    /// Solve equations in a point of the facet and a distance t by Newton's method from the middle of the facet: from
    /// elsewhere it may find points that lie on another branch, far from the facet. `distance` gives the start of t
    /// from the point and its normal.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    fn search(
        &self,
        distance: impl Fn([f64; D], [f64; D]) -> f64,
        equations: impl Fn(&[f64; D], f64) -> Equations<D>,
    ) -> Result<Option<([f64; D], f64)>, Lost> {
        let middle = [1.0 / D as f64; D];
        newton(middle, distance(self.at(&middle), self.normal(&middle)), equations)
    }
}

/// The values and derivatives of D equations in the coordinates l_1, ... of a point on a facet and in a distance.
struct Equations<const D: usize> {
    value: [f64; D],
    /// Derivatives by each of the coordinates and by the distance.
    columns: [[f64; D]; D],
    /// Bound of the sum of the sizes of the terms that a value adds.
    terms: f64,
}

/// Return a zero of the equations by Newton's method from barycentric coordinates and a distance; `None` if the
/// iterates run away.
///
/// A value counts as zero once it is within the rounding of its own evaluation, since double precision cannot tell
/// whether another step improves it. That step is made all the same, since the value may have come from far above by a
/// quadratic step.
///
/// # Errors
/// [`Lost`] if the values stay larger.
fn newton<const D: usize>(
    mut l: [f64; D],
    mut t: f64,
    equations: impl Fn(&[f64; D], f64) -> Equations<D>,
) -> Result<Option<([f64; D], f64)>, Lost> {
    for _ in 0..MOST_STEPS {
        let Equations { value, columns, terms } = equations(&l, t);
        let matrix: [[f64; D]; D] = std::array::from_fn(|c| std::array::from_fn(|k| columns[k][c]));
        let next = element::invert(&matrix).map(|(inverse, _)| {
            let step = inverse.map(|row| dot(&row, &value));
            let mut next = l;
            (1..D).for_each(|k| next[k] -= step[k - 1]);
            next[0] = 1.0 - next[1..].iter().sum::<f64>();
            (next, t - step[D - 1])
        });
        let next = next.filter(|(l, t)| t.is_finite() && l[1..].iter().all(|l| l.abs() <= AWAY));
        if value.iter().all(|value| value.abs() <= ROUNDING * terms) {
            return Ok(Some(next.unwrap_or((l, t))));
        }
        let Some(next) = next else { return Ok(None) };
        (l, t) = next;
    }
    Err(Lost)
}

/// The normals of a facet, as a cone: they begin in a ball and turn from its axis by no more than an angle. Curved
/// facets bulge out of the ball of their nodes by a small part of it.
pub(super) struct Rays<const D: usize> {
    /// Middle of the nodes of the facet.
    middle: [f64; D],
    /// Largest distance of a node from the middle.
    radius: f64,
    /// Mean of the normals, of length one.
    axis: [f64; D],
    /// Tangent of the largest angle between a normal and the axis.
    spread: f64,
    /// How far the normals reach behind the facet and before it.
    ends: [f64; 2],
}

impl<const D: usize> Rays<D> {
    /// Return the normals of a facet. They reach behind it and before it by the lengths `ends`.
    pub fn of(facet: &Facet<D>, ends: [f64; 2]) -> Self {
        let (axis, (middle, radius)) = (unit(mean(&facet.normals)), ball(&facet.x));
        let spread = |normal: &[f64; D]| {
            let along = dot(normal, &axis);
            let off: [f64; D] = std::array::from_fn(|c| normal[c] - along * axis[c]);
            if along > 0.0 { length(off) / along } else { f64::INFINITY }
        };
        Self {
            middle: plus(facet.from, middle),
            radius,
            axis,
            spread: facet.normals.iter().map(spread).fold(0.0, f64::max),
            ends,
        }
    }

    /// Return whether a normal may meet the convex hull of points.
    pub fn may_meet(&self, points: &[[f64; D]]) -> bool {
        let (center, radius) = ball(points);
        let away = minus(center, self.middle);
        let (along, reach) = (dot(&away, &self.axis), self.radius + radius);
        let off = length::<D>(std::array::from_fn(|c| away[c] - along * self.axis[c]));
        let [behind, before] = self.ends;
        -along <= behind + reach && along <= before + reach && off <= reach + self.spread * (along.abs() + reach)
    }
}

impl<const D: usize> SelectionFunction<GeomWithData<Rectangle<[f64; D]>, usize>> for Rays<D> {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; D]>) -> bool {
        self.may_meet(&[envelope.lower(), envelope.upper()])
    }

    fn should_unpack_leaf(&self, leaf: &GeomWithData<Rectangle<[f64; D]>, usize>) -> bool {
        self.should_unpack_parent(&leaf.geom().envelope())
    }
}

pub(super) fn plus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// Return the center and the radius of a ball around points: around the middle of all.
fn ball<const D: usize>(points: &[[f64; D]]) -> ([f64; D], f64) {
    let center = mean(points);
    (center, points.iter().map(|&x| length(minus(x, center))).fold(0.0, f64::max))
}

fn mean<const D: usize>(points: &[[f64; D]]) -> [f64; D] {
    std::array::from_fn(|c| points.iter().map(|x| x[c]).sum::<f64>() / points.len() as f64)
}
