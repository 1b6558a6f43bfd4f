//! What is asked of a run from outside, as numbers of a message that ranks send anyway.

/// Kinds of asking: bits of [`Observer::asked`](super::Observer::asked).
pub const ASKS: usize = 5;

/// One number a kind: each rank adds its own.
pub(super) fn numbers(asked: u8) -> [f64; ASKS] {
    std::array::from_fn(|bit| f64::from(asked >> bit & 1))
}

/// What at least one rank asks, from the sums over the ranks.
pub(super) fn joined(sums: &[f64]) -> u8 {
    sums.iter().enumerate().fold(0, |all, (bit, &count)| all | u8::from(count > 0.0) << bit)
}
