//! What the ranks of a run tell each other.

/// What the ranks of a parallel run tell each other; every call is collective.
pub trait Exchange {
    /// Replaces `values` on every rank by the sum over the ranks: the same numbers everywhere, as MPI promises. Where every body lives
    /// on one rank, every entry is non-zero on one only, so that sums are exact.
    fn sum(&self, values: &mut [f64]);
    /// Sends the first `to[0]` values to rank 0, the next `to[1]` to rank 1, ...; returns `from[r]` values of each rank r.
    fn swap(&self, values: &[f64], to: &[i32], from: &[i32]) -> Vec<f64>;
    /// Number of ranks.
    fn ranks(&self) -> usize;
    /// The bytes of each rank, in their order.
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>>;
    /// Sums, swaps and shares so far between several ranks.
    fn messages(&self) -> usize;
}

/// One process: nothing to exchange.
#[derive(Debug, Default)]
pub struct Serial;

impl Exchange for Serial {
    fn sum(&self, _values: &mut [f64]) {}
    fn swap(&self, values: &[f64], _to: &[i32], _from: &[i32]) -> Vec<f64> {
        values.to_vec()
    }
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
