//! The integration points of a pair, on which everything that both surfaces share is integrated.

/// An integration point that both surfaces share.
#[derive(Debug, Clone, Copy)]
pub struct IntegrationPoint<const D: usize> {
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
