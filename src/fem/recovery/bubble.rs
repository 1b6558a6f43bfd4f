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
    pub fn value(self, l: &[f64]) -> f64 {
        match self {
            Self::Edge(i, j) => l[i] * l[j],
            Self::OddEdge(i, j) => l[i] * l[j] * (l[i] - l[j]),
            Self::Face(i, j, k) => l[i] * l[j] * l[k],
        }
    }

    /// Derivatives with respect to the barycentric coordinates, of which there are at most four.
    pub fn slopes(self, l: &[f64]) -> [f64; 4] {
        let mut d = [0.0; 4];
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
