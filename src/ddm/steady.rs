//! Estimates of the error of the pressures, from their change while the residual fell.
//!
//! A last step that moves nothing proves little. It may have been short, or along modes that do not change the contact, while other modes are far
//! from their end. In the long run, errors fall as the residual does. While the residual falls to a share s of its earlier value, a pressure
//! changes by 1 - s of its earlier error. So s/(1 - s) of that change is left as its error.

/// Share of an earlier residual below which the pressures of that iterate give an estimate.
const FALLEN: f64 = 0.1;

/// Earlier iterates, whose residuals fall from each to the next at least to the share [`FALLEN`].
#[derive(Debug, Default, Clone)]
pub struct Steady {
    past: Vec<Earlier>,
}

/// An earlier iterate.
#[derive(Debug, Clone)]
struct Earlier {
    residual: f64,
    /// n.
    pressure: Vec<f64>,
}

impl Steady {
    /// Estimate the largest error of the pressures `now` (n) of an iterate with this residual; zero if it is the first one. Changes above their `peak`
    /// count as the peak: laws are far from linear there, so that larger errors say nothing about those that follow.
    pub fn missing(&self, residual: f64, now: &[f64], peak: f64) -> f64 {
        // from a good start the residual may never have fallen so far
        let earlier = self.past.iter().rfind(|earlier| residual <= FALLEN * earlier.residual).or(self.past.first());
        earlier.map_or(0.0, |earlier| {
            let change = largest_difference(&earlier.pressure, now).min(peak);
            // without a fall of the residual, no smaller error is known
            if residual < earlier.residual { change * residual / (earlier.residual - residual) } else { change }
        })
    }

    /// Note an iterate.
    pub fn note(&mut self, residual: f64, pressure: &[f64]) {
        self.past.retain(|earlier| earlier.residual > residual);
        if self.past.last().is_none_or(|earlier| residual <= FALLEN * earlier.residual) {
            self.past.push(Earlier { residual, pressure: pressure.to_vec() });
        }
    }
}

fn largest_difference(before: &[f64], now: &[f64]) -> f64 {
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
        // a change from pressures above the peak gives no estimate
        let mut wild = Steady::default();
        wild.note(1.0, &[1e30]);
        assert!(wild.missing(1e-10, &[1.0], 1.0) < 1.1e-10);
    }
}
