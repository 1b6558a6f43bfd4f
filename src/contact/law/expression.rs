//! Laws given by an expression p(c), and the check that a function is the law of a layer.

use super::LayerLaw;
use super::numeric::integral;
use crate::error::{Error, Place, Result, Source, shown};
use crate::expression::{Expression, KnownNames};
use crate::linalg::portable::pow;
use std::sync::Arc;

/// The expression p(c) of a law at one point, continued as a straight line beyond its end.
#[derive(Debug, Clone)]
pub struct ExpressionLaw {
    law: Expression,
    /// The values of its variables after c: the contact point (x, y, z), or the parameters of a known law.
    place: [f64; 3],
    /// Compression from which the law is a straight line; infinite if it never is.
    end: f64,
}

impl ExpressionLaw {
    /// Make the law at a point, checked for compressions up to `end`, or else up to `size`, the extent of the surfaces.
    /// It must have p(0) = 0, increasing p and finite p'.
    ///
    /// # Errors
    /// A refusal that points at the expression and names the compression.
    pub fn new(law: &Expression, place: [f64; 3], end: Option<f64>, size: f64) -> Result<Self> {
        let typed = Self { law: law.clone(), place, end: f64::INFINITY };
        let top = end.unwrap_or(size);
        let first = typed.check_first_touch(top)?;
        let last = increases(first, top, |c| typed.value(c)).map_err(|breach| {
            let advice = advice(breach.last, end);
            let outside = typed.refuse_outside(breach.c).err().filter(|_| !breach.is_finite);
            outside.map_or_else(|| typed.refuse(breach.what, &advice), |error| error.help(advice.clone()))
        })?;
        Ok(if last < top || end.is_some() { Self { end: last, ..typed } } else { typed })
    }

    /// Return the expression of a known law in c and its parameters x and y.
    ///
    /// # Errors
    /// Those of [`Expression::parse`].
    pub fn text(text: &str) -> Result<Expression> {
        let source = Source { name: "a law of a layer".into(), text: text.to_owned() };
        let place = Place { span: 0..text.len(), source: Arc::new(source) };
        Expression::parse(text, &place, KnownNames::of(&["c", "x", "y"]))
    }

    /// Make a known law of two parameters, which is a straight line beyond `end`.
    pub fn known(law: &Expression, x: f64, y: f64, end: f64) -> Self {
        Self { law: law.clone(), place: [x, y, 0.0], end }
    }

    /// Check that p(0) is zero and p'(0) finite, and return p(0). `top` is the largest compression that will be
    /// checked.
    fn check_first_touch(&self, top: f64) -> Result<f64> {
        self.refuse_outside(0.0)?;
        let (first, slope) = self.value(0.0);
        let comparable = self.value(top * 1e-3).0.abs();
        // A formula may miss zero by rounding. The comparisons are false for NaN.
        let is_zero = first == 0.0 || first.abs() <= 1e-12 * comparable;
        if !is_zero {
            return Err(
                self.refuse(format!("p(0) is {}, not 0", shown(first)), "without compression there is no pressure")
            );
        }
        if slope.is_infinite() {
            let advice = "p' must be finite: add a linear part, or begin with a power of c of at least 1";
            return Err(self.refuse("the layer is infinitely stiff at first touch, p'(0) = infinity".into(), advice));
        }
        Ok(first)
    }

    /// Return p and p' of the expression, without its continuation.
    fn value(&self, c: f64) -> (f64, f64) {
        let [x, y, z] = self.place;
        self.law.eval_by(0, &[c, x, y, z])
    }

    /// Return p of the expression, without its continuation.
    fn curve(&self, c: f64) -> f64 {
        let [x, y, z] = self.place;
        self.law.eval(&[c, x, y, z])
    }

    /// Refuse a compression for which data have no value.
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

/// Return what a user may do about a law that increases up to compression `last` only. `end` is that of the scene.
fn advice(last: f64, end: Option<f64>) -> String {
    match end {
        _ if last <= 0.0 => "the pressure grows with the compression c from c = 0 on: look for a wrong sign".to_owned(),
        Some(_) => format!("take a smaller up_to, such as {:.1e}: the law increases that far", 0.9 * last),
        None => format!(
            "say how far the law goes, as in {{ pressure = \"...\", up_to = {:.1e} }}: it goes on linearly from there",
            0.9 * last
        ),
    }
}

impl LayerLaw for ExpressionLaw {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        self.value(c)
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        integral(&|c| self.curve(c), 0.0, c)
    }

    fn end(&self, _point: usize) -> f64 {
        self.end
    }
}

/// Pressure beyond which a law is a straight line, since only trial states get there. It exceeds every unit of stress,
/// and a product of five such pressures is still finite.
const HUGE: f64 = 1e60;
/// Number of checked compressions in a factor of ten.
const STEPS: i32 = 24;
/// Number of factors of ten that are checked below the largest compression.
const DECADES: i32 = 9;

/// Where a function is no law of a layer.
#[derive(Debug)]
pub struct Breach {
    /// What is wrong there.
    pub what: String,
    /// The compression.
    pub c: f64,
    /// The largest compression up to which it is a law.
    pub last: f64,
    /// Whether its values there are finite.
    pub is_finite: bool,
}

/// Check that a pressure increases from `first` = p(0) up to the compression `top`, and return the largest compression
/// that was checked. It is smaller than `top` if the pressure exceeds [`HUGE`] before. `value` gives p and p'.
///
/// # Errors
/// The first compression at which it does not increase, or is not finite.
pub fn increases(first: f64, top: f64, value: impl Fn(f64) -> (f64, f64)) -> Result<f64, Breach> {
    let least = value(top * 10f64.powi(-DECADES)).0;
    let (mut last, mut below) = (0.0, first.min(least - f64::MIN_POSITIVE));
    for step in 0..=DECADES * STEPS {
        if below > HUGE {
            break;
        }
        let c = top * pow(10.0, f64::from(step) / f64::from(STEPS) - f64::from(DECADES));
        let (pressure, slope) = value(c);
        let is_finite = pressure.is_finite() && slope.is_finite();
        if !is_finite {
            let what = format!("p is {} and p' {} at c = {c:.3e}", shown(pressure), shown(slope));
            return Err(Breach { what, c, last, is_finite });
        }
        if pressure <= below || slope < 0.0 {
            return Err(Breach { what: format!("p does not increase at c = {c:.3e}"), c, last, is_finite });
        }
        (last, below) = (c, pressure);
    }
    Ok(last)
}
