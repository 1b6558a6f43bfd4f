//! A profile whose points have any distances: straight lines between them.

use super::rule::Sample;

/// Points (x, value), x increasing; at least two.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots(pub Vec<[f64; 2]>);

impl Knots {
    /// First and last place.
    pub fn range(&self) -> [f64; 2] {
        [self.0[0][0], self.0[self.0.len() - 1][0]]
    }

    /// The value at a place; beyond the ends that of the end, or nothing.
    pub fn sample(&self, x: f64, holds: bool) -> Sample {
        let [first, last] = self.range();
        let is_within = (first..=last).contains(&x);
        if x.is_nan() || !(is_within || holds) {
            return Sample::NONE;
        }
        let above = self.0.partition_point(|point| point[0] <= x).clamp(1, self.0.len() - 1);
        let ([a, low], [b, high]) = (self.0[above - 1], self.0[above]);
        let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
        let slope = if is_within { (high - low) / (b - a) } else { 0.0 };
        Sample { value: low + t * (high - low), gradient: [slope, 0.0] }
    }
}
