//! Do the pressures stand still? What they still miss, judged by how they moved while the residual fell.
//!
//! A last step that moves nothing proves little: it may have been short, or have gone along modes that the contact does not
//! feel, while others are far from their end. While the residual falls to a share s of what it was, errors in the long
//! run fall as it does, so that the change of a pressure since then is 1 - s of its error then, and s/(1 - s) of that
//! change is left.

/// Share of an earlier residual below which the pressures of that iterate tell something.
const FALLEN: f64 = 0.1;

/// Pressures of earlier iterates, with residuals that fall from each to the next by this share or more.
#[derive(Debug, Default, Clone)]
pub struct Steady {
    past: Vec<(f64, Vec<f64>)>,
}

impl Steady {
    /// Largest estimated error of the pressures `now` of an iterate with this residual; zero if it is the first one. An error larger
    /// than their `peak` is no measure of those that follow: laws are far from linear there.
    pub fn missing(&self, residual: f64, now: &[f64], peak: f64) -> f64 {
        let left = |(then, before): &(f64, Vec<f64>)| {
            let moved = most_apart(before, now).min(peak);
            // a residual that has not fallen tells that nothing is known
            if residual < *then { moved * residual / (then - residual) } else { moved }
        };
        // from a good start it may never have fallen so far
        let told = self.past.iter().rfind(|(then, _)| residual <= FALLEN * then).or(self.past.first());
        told.map_or(0.0, left)
    }

    /// Takes an iterate into the past.
    pub fn note(&mut self, residual: f64, pressure: &[f64]) {
        self.past.retain(|(then, _)| *then > residual);
        if self.past.last().is_none_or(|(then, _)| residual <= FALLEN * then) {
            self.past.push((residual, pressure.to_vec()));
        }
    }
}

/// Largest difference of two sets of pressures.
fn most_apart(before: &[f64], now: &[f64]) -> f64 {
    before.iter().zip(now).fold(0.0, |most, (before, now)| most.max((now - before).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One mode with the factor 0.99: its error is a hundred times each of its steps.
    #[test]
    fn a_slow_mode_is_not_still() {
        let mut steady = Steady::default();
        let error = |k: i32| 0.99f64.powi(k);
        for k in 0..1000 {
            if k > 300 {
                let missing = steady.missing(error(k), &[1.0 - error(k)], 1.0);
                assert!((missing / error(k) - 1.0).abs() < 1e-9, "{k}: {missing}");
            }
            steady.note(error(k), &[1.0 - error(k)]);
        }
        assert!(steady.past.len() < 12, "{} iterates are kept", steady.past.len());
    }

    /// A step that is short, or a residual that grew in between, hides nothing.
    #[test]
    fn neither_short_steps_nor_peaks_deceive() {
        let mut steady = Steady::default();
        assert_eq!(steady.missing(1e-9, &[3.0], 3.0), 0.0);
        let iterates = [(1.0, 0.0), (1e-5, 0.9), (1e-2, 0.95), (1e-3, 0.999), (0.99e-3, 0.999)];
        iterates.iter().for_each(|(residual, p)| steady.note(*residual, &[*p]));
        // since 1e-2 the pressure has moved by 0.049
        let missing = steady.missing(0.99e-3, &[0.999], 1.0);
        assert!((missing / (0.049 * 0.099 / 0.901) - 1.0).abs() < 1e-9, "{missing}");
        // from a start that was nearly as good
        let mut near = Steady::default();
        near.note(2e-8, &[1.0]);
        assert!((near.missing(1e-8, &[1.5], 1.5) - 0.5).abs() < 1e-12);
        assert_eq!(near.missing(3e-8, &[1.5], 1.5), 0.5);
        // what a start far off every scale had to lose tells nothing
        let mut wild = Steady::default();
        wild.note(1.0, &[1e30]);
        assert!(wild.missing(1e-10, &[1.0], 1.0) < 1.1e-10);
    }
}
