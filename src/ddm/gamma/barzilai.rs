//! The rule of Barzilai and Borwein.

use super::{GammaRule, Iterate, Ritz, Unbounded};
use crate::linalg::dot;
use crate::model::line::Line;
use std::collections::VecDeque;

/// Number of recent iterates whose largest F1 no step may exceed.
const WINDOW: usize = 10;

/// gamma^k = s'G s / s'y, the inverse of a Rayleigh quotient of G^-1 F1''. Here s is the last step and y the change of the residual. The first step is
/// an exact line search.
///
/// The rule is not monotone. F1 may rise, but not above the largest of the last `WINDOW` iterates (the nonmonotone line search of Grippo,
/// Lampariello and Lucidi, 1986, as Raydan uses it, 1997). A step that goes further is replaced by the exact line search.
#[derive(Debug, Default)]
pub struct BarzilaiBorwein {
    last: Option<Last>,
    /// F1 of the last iterates minus F1 of the present one.
    recent: VecDeque<f64>,
}

/// The last iterate.
#[derive(Debug)]
struct Last {
    gamma: f64,
    /// r'z.
    decrement: f64,
    /// z'K z.
    curvature: f64,
    /// B_a z_a + B_b z_b, n.
    closing: Vec<f64>,
    /// Contact forces, n.
    force: Vec<f64>,
}

impl GammaRule for BarzilaiBorwein {
    fn gamma(&mut self, here: &mut Iterate, _ritz: &mut Ritz) -> Result<f64, Unbounded> {
        let quotient = self.last.as_ref().map(|last| {
            // s = gamma z, G s = gamma r, y = K s + B' (change of force)
            let stiffer: Vec<f64> = here.layer.force.iter().zip(&last.force).map(|(now, then)| now - then).collect();
            last.gamma * last.decrement / (last.gamma * last.curvature + dot(&stiffer, &last.closing))
        });
        let decrement = here.decrement();
        let line = Line::new(here.model, here.layer, &here.sweep.residual, &here.sweep.correction);
        let worst = self.recent.iter().copied().fold(0.0, f64::max);
        let gamma = match quotient {
            Some(gamma) if gamma > 0.0 && gamma.is_finite() && line.change(gamma) <= worst => gamma,
            _ => line.minimize(1e-6)?,
        };
        let change = line.change(gamma);
        if self.recent.len() == WINDOW - 1 {
            self.recent.pop_front();
        }
        self.recent.push_back(0.0);
        self.recent.iter_mut().for_each(|above| *above -= change);
        let (curvature, closing) = (line.curvature(), here.sweep.correction.closing());
        self.last = Some(Last { gamma, decrement, curvature, closing, force: here.layer.force.clone() });
        Ok(gamma)
    }

    fn restart(&mut self) {
        *self = Self::default();
    }
}
