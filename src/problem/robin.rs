//! The Robin term of bodies: on which zone it acts, and how stiff it is.

use crate::expression::Field;

/// The rule for the Robin coefficient kappa on the zone. p is the law of the layer and c^k the compression at iterate k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobinRule {
    /// kappa = p'(c^k), as in the paper.
    Tangent,
    /// The coefficient of the start in every iteration, made safe as in `Auto`. It needs one factorisation in a run. Theorem 3 allows it.
    Frozen,
    /// kappa = max(p'(c^k), F) everywhere on the contact surfaces; F > 0 is this number.
    Floor(f64),
    /// The tangent on the zone, and more for a body that the tangent does not constrain safely.
    Auto,
}

/// The Robin zone: psi of (38), a characteristic function of a part of the contact surfaces. c is the compression of the layer.
#[derive(Debug, Clone)]
pub enum Zone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\], equation (36).
    Active,
    /// psi = 1 where the expression in x, y, z and the iteration k = 0, 1, ... is > 0 (true is 1).
    Subset(Field),
}
