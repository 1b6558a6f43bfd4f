//! A layer's law typed in the scene.

use super::quadrature::integral;
use super::root::{meeting, root};
use super::{LayerLaw, Response};
use crate::error::{Error, Result, shown};
use crate::expression::Expression;
use crate::linalg::portable::pow;

/// An expression p(c) at one place, continued as a straight line beyond its end.
#[derive(Debug, Clone)]
pub struct Typed {
    law: Expression,
    /// Where it holds (x, y, z).
    place: [f64; 3],
    /// Compression from which it is a straight line, and the law there; infinite if it never is.
    end: f64,
    at_end: Response,
}

/// Pressures beyond this only come up in trial states, and a law is a straight line from there: 1e60 is beyond every unit of stress, and five
/// of them multiplied are a number.
pub(super) const HUGE: f64 = 1e60;
/// Compressions to look at in a factor of ten.
const STEPS: i32 = 24;
/// How many factors of ten.
const DECADES: i32 = 9;

impl Typed {
    /// The law at a place, checked for compressions up to `end`, or else up to `size`, the extent of the surfaces: p(0) = 0,
    /// p increasing, p' finite.
    ///
    /// # Errors
    /// A refusal that points at the expression and names the compression.
    pub fn new(law: &Expression, place: [f64; 3], end: Option<f64>, size: f64) -> Result<Self> {
        let mut typed = Self { law: law.clone(), place, end: f64::INFINITY, at_end: Response::default() };
        let top = end.unwrap_or(size);
        typed.refuse_outside(0.0)?;
        let (first, first_slope) = typed.value(0.0);
        let least = typed.value(top * 10f64.powi(-DECADES)).0;
        let largest = typed.value(top * 1e-3).0.abs();
        // a formula may miss zero by rounding; one that is not a number misses it, too
        let is_zero = first == 0.0 || first.abs() <= 1e-12 * largest;
        if !is_zero {
            return Err(
                typed.refuse(format!("p(0) is {}, not 0", shown(first)), "without compression there is no pressure")
            );
        }
        if first_slope.is_infinite() {
            let advice = "p' must be finite: add a linear part, or begin with a power of c of at least 1";
            return Err(typed.refuse("the layer is infinitely stiff at first touch, p'(0) = infinity".into(), advice));
        }
        let mut before = (0.0, first.min(least - f64::MIN_POSITIVE));
        for step in 0..=DECADES * STEPS {
            let c = top * pow(10.0, f64::from(step) / f64::from(STEPS) - f64::from(DECADES));
            let (pressure, slope) = typed.value(c);
            if before.1 > HUGE {
                break;
            }
            let advice = match (before.0 > 0.0, end) {
                (false, _) => {
                    "the pressure grows with the compression c from c = 0 on: look for a wrong sign".to_owned()
                }
                (_, Some(_)) => {
                    format!("take a smaller up_to, such as {:.1e}: the law increases that far", 0.9 * before.0)
                }
                (_, None) => format!(
                    "say how far the law goes, as in {{ pressure = \"...\", up_to = {:.1e} }}: it goes on linearly from there",
                    0.9 * before.0
                ),
            };
            if !(pressure.is_finite() && slope.is_finite()) {
                typed.refuse_outside(c).map_err(|error| error.help(advice.clone()))?;
                return Err(
                    typed.refuse(format!("p is {} and p' {} at c = {c:.3e}", shown(pressure), shown(slope)), &advice)
                );
            }
            if pressure <= before.1 || slope < 0.0 {
                return Err(typed.refuse(format!("p does not increase at c = {c:.3e}"), &advice));
            }
            before = (c, pressure);
        }
        if before.0 < top || end.is_some() {
            typed.at_end = typed.compressed(0, before.0);
            typed.end = before.0;
        }
        Ok(typed)
    }

    /// p and p'.
    fn value(&self, c: f64) -> (f64, f64) {
        let [x, y, z] = self.place;
        self.law.eval_by(0, &[c, x, y, z])
    }

    /// p of the expression, without its continuation.
    fn curve(&self, c: f64) -> f64 {
        let [x, y, z] = self.place;
        self.law.eval(&[c, x, y, z])
    }

    /// Refuses a compression for which data have no value.
    fn refuse_outside(&self, c: f64) -> Result<()> {
        let [x, y, z] = self.place;
        self.law.outside("the pressure of the layer", &[c, x, y, z]).map_or(Ok(()), Err)
    }

    fn refuse(&self, what: String, advice: &str) -> Error {
        let [x, y, z] = self.place;
        Error::scene(self.law.place(), format!("this is no law of a layer: {what}"))
            .because(format!("looked at ({x}, {y}, {z})"))
            .help(advice)
    }
}

impl LayerLaw for Typed {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        if c > self.end {
            return self.at_end.straight(c - self.end);
        }
        let (pressure, tangent) = self.value(c);
        Response { pressure, tangent, energy: integral(&|c| self.curve(c), 0.0, c) }
    }

    fn pressure(&self, point: usize, c: f64) -> f64 {
        // the energy costs most
        if c > 0.0 && c <= self.end { self.curve(c) } else { self.response(point, c).pressure }
    }

    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        if c <= self.end {
            return self.value(c);
        }
        let Response { pressure, tangent, .. } = self.at_end.straight(c - self.end);
        (pressure, tangent)
    }

    fn meet_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        let beyond = self.at_end.straight_meet(self.end, s, rho);
        if beyond > 0.0 {
            return self.end + beyond;
        }
        let high = s.min(self.end);
        meeting(s, rho, [0.0, high], high, |c| self.value(c))
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        if self.end.is_finite() && pressure > self.at_end.pressure {
            return self.end + self.at_end.straight_compression(pressure);
        }
        // expressions come in any units
        let (start, high) = if self.end.is_finite() { (self.end, self.end) } else { (1.0, f64::MAX) };
        root(pressure, [0.0, high], start, |c| self.value(c)).unwrap_or(f64::INFINITY)
    }

    fn end(&self, _point: usize) -> f64 {
        self.end
    }
}
