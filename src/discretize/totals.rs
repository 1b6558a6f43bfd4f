//! Sums over ranks.

use crate::exchange::{Exchange, share};
use crate::linalg::Total;

/// Sums over all ranks, the same in whatever parts these have the terms but for rare last digits; collective.
pub fn totals(exchange: &dyn Exchange, mine: &[Total]) -> Vec<f64> {
    let mut of_ranks = share(exchange, mine.to_vec()).into_iter();
    let mut all = of_ranks.next().unwrap_or_default();
    of_ranks.for_each(|of_rank| all.iter_mut().zip(&of_rank).for_each(|(all, more)| all.join(more)));
    all.iter().map(Total::value).collect()
}
