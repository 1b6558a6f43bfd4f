//! Sums that do not depend on the distribution of their terms over ranks.

use serde::{Deserialize, Serialize};

/// A sum with the rounding errors of its additions. The rounded total of both is the same in any order of the terms, but for rare last digits.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Total {
    sum: f64,
    lost: f64,
}

impl Total {
    /// Add a term.
    pub fn add(&mut self, term: f64) {
        let next = self.sum + term;
        let added = next - self.sum;
        self.lost += (self.sum - (next - added)) + (term - added);
        self.sum = next;
    }

    /// Add all terms of another sum.
    pub fn join(&mut self, other: &Self) {
        self.add(other.sum);
        self.add(other.lost);
    }

    /// Return the sum.
    pub fn value(&self) -> f64 {
        self.sum + self.lost
    }
}

impl FromIterator<f64> for Total {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut total = Self::default();
        terms.into_iter().for_each(|term| total.add(term));
        total
    }
}

#[cfg(test)]
mod tests {
    use super::Total;

    /// Terms of very different sizes, shared in two ways: a plain sum would lose the small ones, and differ.
    #[test]
    fn parts_of_a_sum_are_its_parts_in_any_order() {
        let terms: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k % 17)).collect();
        let whole: Total = terms.iter().copied().collect();
        let mut joined = Total::default();
        terms.rchunks(37).for_each(|part| joined.join(&part.iter().copied().collect()));
        assert_eq!(whole.value(), joined.value());
        let plain: f64 = terms.iter().sum();
        let back: f64 = terms.iter().rev().sum();
        assert!(plain != back && (plain - whole.value()).abs() > 0.0);
    }
}
