//! Where bodies carry a Robin term, and how stiff it is.

use crate::expression::Field;

/// Rule for the Robin coefficient kappa on the zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobinRule {
    /// kappa = p'(c^k), as in the paper.
    Tangent,
    /// That of the start all the way, made safe as in `Auto`: one factorisation a run (Theorem 3 allows it).
    Frozen,
    /// kappa = max(p'(c^k), this number > 0) everywhere on the contact surfaces.
    Floor(f64),
    /// The tangent on the zone, and enough more for a body that it does not hold safely.
    Auto,
}

/// Robin zone: psi of (38), a characteristic function of a part of the contact surfaces.
#[derive(Debug, Clone)]
pub enum Zone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\], equation (36).
    Active,
    /// psi = \[expression is true, or a number > 0\], in x, y, z and the iteration k = 0, 1, ...
    Subset(Field),
}
