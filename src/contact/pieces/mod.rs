//! Common pieces of two surfaces: where facets face each other along the normals of side a, cut so that
//! products of shape functions of both sides are integrated exactly.
//!
//! Normals are interpolated between the vertices of side a, so that curved surfaces are covered without gaps or
//! overlaps between neighbouring facets. A piece is an interval ([`plane`]) or a convex polygon ([`space`]) in the
//! parameters of one facet of side a.

mod plane;
mod polygon;
mod reach;
mod search;
mod space;

pub use plane::plane;
pub use reach::{Reach, Refused};
pub use search::Search;
pub use space::space;

use super::side::Side;

/// An integration point that both surfaces share.
#[derive(Debug, Clone, Copy)]
pub struct Shared<const D: usize> {
    /// Facet of side a.
    pub facet_a: usize,
    /// Barycentric coordinates in it.
    pub at_a: [f64; D],
    /// Facet of side b.
    pub facet_b: usize,
    /// Barycentric coordinates of the projection along the normal of side a.
    pub at_b: [f64; D],
    /// Length (area) that belongs to the point, measured on side a; in bodies of revolution the area of a ring.
    pub weight: f64,
    /// Distance to the projection, negative where the surfaces overlap.
    pub gap: f64,
}

/// What two surfaces share.
#[derive(Debug, Clone, Default)]
pub struct Common<const D: usize> {
    /// Integration points of the common pieces, grouped by facet of side a.
    pub points: Vec<Shared<D>>,
    /// What lies before each facet of side a and was refused.
    pub refused: Vec<Refused>,
}

/// Finds the common pieces of two surfaces on those facets of side a that are asked for.
pub type Cut<const D: usize> = fn(&Side<D>, &Side<D>, &Reach, &dyn Fn(usize) -> bool) -> Common<D>;

/// The search for a point on a facet came to no end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lost;

/// Steps of Newton's method for a point on a facet. It begins within a facet's size of the point, and from there the digits double: six
/// steps are enough for a double, twice as many make up for a bad start.
const MOST_STEPS: usize = 30;

/// A sum that is zero may be this share of the sizes of its terms. The coordinate of a point on a facet adds six products, whose factors
/// have three roundings each, to a point that was found in the same way: less than 32 roundings of half an epsilon.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Parameters beyond this are no place on a facet or near it: they have fewer digits than [`SNAP`] asks for.
const AWAY: f64 = SNAP / f64::EPSILON;

/// Parameters closer than this to a facet's end are its end: surfaces that match do match.
const SNAP: f64 = 1e-9;

/// How far outside its parameters a ray may meet a facet in the plane, where pieces end exactly where facets do.
const ON_FACET: f64 = 1e-6;
