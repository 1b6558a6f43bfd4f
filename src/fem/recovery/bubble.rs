//! Polynomials that the nodal interpolant of an element does not see.

/// A function of barycentric coordinates that vanishes at the nodes of an element.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bubble {
    /// L_i L_j.
    Edge(usize, usize),
    /// L_i L_j (L_i - L_j).
    OddEdge(usize, usize),
    /// L_i L_j L_k.
    Face(usize, usize, usize),
}

impl Bubble {
    /// Value at a barycentric point.
    pub fn value<const N: usize>(self, l: &[f64; N]) -> f64 {
        match self {
            Self::Edge(i, j) => l[i] * l[j],
            Self::OddEdge(i, j) => l[i] * l[j] * (l[i] - l[j]),
            Self::Face(i, j, k) => l[i] * l[j] * l[k],
        }
    }

    /// Derivatives with respect to the barycentric coordinates.
    pub fn slopes<const N: usize>(self, l: &[f64; N]) -> [f64; N] {
        let mut d = [0.0; N];
        match self {
            Self::Edge(i, j) => (d[i], d[j]) = (l[j], l[i]),
            Self::OddEdge(i, j) => {
                (d[i], d[j]) = (l[j] * (2.0 * l[i] - l[j]), l[i] * (l[i] - 2.0 * l[j]));
            }
            Self::Face(i, j, k) => (d[i], d[j], d[k]) = (l[j] * l[k], l[i] * l[k], l[i] * l[j]),
        }
        d
    }
}
