//! A profile whose points are at any distances, with straight lines between them.

use super::rule::Sample;

/// The points (x, value) of a profile, at least two, with increasing x.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots(pub Vec<[f64; 2]>);

impl Knots {
    /// Return the first and the last place.
    pub fn range(&self) -> [f64; 2] {
        [self.0[0][0], self.0[self.0.len() - 1][0]]
    }

    /// Return the value at a place. Beyond an end it is the value there if `holds`, else there is none.
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
