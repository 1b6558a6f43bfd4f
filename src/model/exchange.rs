//! What the ranks of a run tell each other.

/// What the ranks of a parallel run tell each other; every call is collective.
pub trait Exchange {
    /// Replaces `values` on every rank by the sum over the ranks: the same numbers everywhere, as MPI promises. Where every body lives
    /// on one rank, every entry is non-zero on one only, so that sums are exact.
    fn sum(&self, values: &mut [f64]);
    /// Number of ranks.
    fn ranks(&self) -> usize;
    /// The bytes of each rank, in their order.
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>>;
    /// Sums and shares so far between several ranks.
    fn messages(&self) -> usize;
}

/// One process: nothing to exchange.
#[derive(Debug, Default)]
pub struct Serial;

impl Exchange for Serial {
    fn sum(&self, _values: &mut [f64]) {}
    fn ranks(&self) -> usize {
        1
    }
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        vec![mine]
    }
    fn messages(&self) -> usize {
        0
    }
}
