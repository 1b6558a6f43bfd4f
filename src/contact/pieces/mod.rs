//! Common pieces of two surfaces. Facets of side a face facets of side b along the normals of side a. They are cut into pieces
//! on which products of shape functions of both sides are integrated exactly.
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
    /// Barycentric coordinates in this facet.
    pub at_a: [f64; D],
    /// Facet of side b.
    pub facet_b: usize,
    /// Barycentric coordinates there of the projection along the normal of side a.
    pub at_b: [f64; D],
    /// Length (area) that belongs to the point, measured on side a; in bodies of revolution the area of a ring.
    pub weight: f64,
    /// Distance to the projection, negative where the surfaces overlap.
    pub gap: f64,
}

/// The common pieces of two surfaces.
#[derive(Debug, Clone, Default)]
pub struct Common<const D: usize> {
    /// Integration points of the common pieces, grouped by facet of side a.
    pub points: Vec<Shared<D>>,
    /// What was refused before each facet of side a.
    pub refused: Vec<Refused>,
}

impl<const D: usize> Common<D> {
    /// Return the facets of both sides that face each other, but are too far apart.
    pub fn far(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.refused.iter().enumerate().flat_map(|(i, refused)| refused.far.iter().map(move |&j| (i, j)))
    }
}

/// A function that finds the common pieces of two surfaces.
pub type Cut<const D: usize> = fn(&Side<D>, &Side<D>, &Reach) -> Common<D>;

/// The failure of a search for a point on a facet: it did not converge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lost;

/// Largest number of Newton steps for a point on a facet. The start is within a facet's size of the point, and from there each step
/// doubles the number of correct digits: six steps are enough for a double, and twice as many make up for a bad start.
const MOST_STEPS: usize = 12;

/// Rounding of a sum that is zero, as a share of the sizes of its terms. A coordinate of a point on a facet adds six products, whose
/// factors have three roundings each, to a point that was found in the same way: less than 32 roundings of half an epsilon.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Parameter beyond which a point is neither on a facet nor near it: it has fewer digits than [`SNAP`] needs.
const AWAY: f64 = SNAP / f64::EPSILON;

/// Distance from the end of a facet, in its parameter, within which a point is moved to the end, so that matching surfaces match exactly.
const SNAP: f64 = 1e-9;

/// Largest distance outside of the parameters of a facet at which a ray may meet it in the plane, where pieces end exactly where facets do.
const ON_FACET: f64 = 1e-6;

fn plus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] + b[c])
}
