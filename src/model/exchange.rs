//! What the ranks of a run tell each other.

/// What the ranks of a parallel run tell each other; every call is collective.
pub trait Exchange {
    /// Replaces `values` on every rank by the sum over the ranks: the same numbers everywhere, as MPI promises. Where every body lives
    /// on one rank, every entry is non-zero on one only, so that sums are exact.
    fn sum(&self, values: &mut [f64]);
    /// Number of ranks.
    fn ranks(&self) -> usize;
    /// Number of this one.
    fn rank(&self) -> usize;
    /// The bytes of each rank, in their order.
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>>;
    /// The bytes of the first rank.
    fn tell(&self, mine: Vec<u8>) -> Vec<u8>;
    /// The bytes that the first rank makes for this one; `of_rank` is called there alone, rank by rank.
    fn deal(&self, of_rank: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8>;
    /// Sums and shares so far between several ranks.
    fn messages(&self) -> usize;
}

/// One process: nothing to exchange.
#[cfg(test)]
#[derive(Debug, Default)]
pub struct Serial;

#[cfg(test)]
impl Exchange for Serial {
    fn sum(&self, _values: &mut [f64]) {}
    fn ranks(&self) -> usize {
        1
    }
    fn rank(&self) -> usize {
        0
    }
    fn share(&self, mine: Vec<u8>) -> Vec<Vec<u8>> {
        vec![mine]
    }
    fn tell(&self, mine: Vec<u8>) -> Vec<u8> {
        mine
    }
    fn deal(&self, of_rank: &mut dyn FnMut(usize) -> Vec<u8>) -> Vec<u8> {
        of_rank(0)
    }
    fn messages(&self) -> usize {
        0
    }
}
