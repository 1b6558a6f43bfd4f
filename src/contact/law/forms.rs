//! Laws of a known form: linear and power, and cubic and exponential ones, which are expressions.

use super::expression::ExpressionLaw;
use super::{LayerLaw, PerPoint};
use crate::error::{Error, Kind, Result, shown};
use crate::linalg::portable::pow;
use crate::problem::layer::{LayerSpec, Parameter};
use std::rc::Rc;

/// The law p0 (e^(c/c0) - 1) of the parameters x = p0 and y = c0, in a form that keeps its digits where c is small.
pub const EXPONENTIAL: &str = "2*x*sinh(c/(2*y))*exp(c/(2*y))";
/// The law of the parameters x = k1 and y = k3 of a layer that hardens.
pub const CUBIC: &str = "x*c + y*c^3";

/// Ratio c/c0 beyond which an exponential law is a straight line. The pressure is exp(60) = 1e26 times p0 there: no
/// solution gets so far, and the squares of such pressures are finite.
pub const LINE: f64 = 60.0;

/// Make a law with parameters for the contact points `position`.
///
/// # Errors
/// A parameter that is not finite or out of its range at a point.
pub fn make(spec: &LayerSpec, position: &[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> {
    let (_, parameters) = spec.parameters();
    match spec {
        LayerSpec::Linear(_) => formed(&parameters, position, |v| Power::linear(v[0])),
        LayerSpec::Power(_) => formed(&parameters, position, |v| Power::new(v[0], v[1])),
        LayerSpec::Exponential(_) => {
            let law = ExpressionLaw::text(EXPONENTIAL)?;
            formed(&parameters, position, |v| ExpressionLaw::known(&law, v[0], v[1], LINE * v[1]))
        }
        LayerSpec::Cubic(_) => {
            let law = ExpressionLaw::text(CUBIC)?;
            formed(&parameters, position, |v| ExpressionLaw::known(&law, v[0], v[1], f64::INFINITY))
        }
        LayerSpec::Table(_) | LayerSpec::Own(_) | LayerSpec::Pressure { .. } => {
            Err(Error::new(Kind::Scene, "a law without parameters"))
        }
    }
}

/// Make a law of a known form: one for all points, or one a point where a parameter varies.
///
/// # Errors
/// A parameter that is not finite or out of its range at a point.
fn formed<L: LayerLaw + 'static>(
    parameters: &[Parameter<'_>],
    position: &[[f64; 3]],
    new: impl Fn(&[f64]) -> L,
) -> Result<Rc<dyn LayerLaw>> {
    let at = |&x: &[f64; 3]| -> Result<L> {
        let values = parameters.iter().map(|parameter| checked(parameter, x));
        Ok(new(&values.collect::<Result<Vec<f64>>>()?))
    };
    if parameters.iter().all(|parameter| parameter.value.is_constant()) {
        Ok(Rc::new(at(&[0.0; 3])?))
    } else {
        Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?)))
    }
}

/// Return the value of a parameter at a point.
///
/// # Errors
/// A value that is not finite or out of its range.
fn checked(&Parameter { key, value: field, bounds }: &Parameter<'_>, x: [f64; 3]) -> Result<f64> {
    let value = field.eval_finite(key, x)?;
    let Some(breach) = bounds.breach(value) else { return Ok(value) };
    let message = format!("{} is {} at ({}, {}, {})", key, shown(value), x[0], x[1], x[2]);
    let error = Error::new(Kind::Scene, message);
    Err(match field.place() {
        Some(place) => error.at(place).label(breach),
        None => error.help(breach),
    })
}

/// The law p(c) = (k c)^m with m >= 1: the straight line, and the power 1/a of the rough surface in the paper's
/// numerical section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// k, one over the compression at unit pressure; with m = 1 a stiffness per area.
    k: f64,
    exponent: f64,
}

impl Power {
    /// Make the law p = (c/B)^(1/a) from the compression B > 0 at unit pressure and 0 < a <= 1.
    pub fn new(b: f64, a: f64) -> Self {
        Self { k: b.recip(), exponent: a.recip() }
    }

    /// Make the law p = `stiffness` c.
    pub fn linear(stiffness: f64) -> Self {
        Self { k: stiffness, exponent: 1.0 }
    }

    /// Return the compression c > 0 with c + p/rho = s for s > 0 and a finite rho, if it has a closed form.
    ///
    /// That of a line puts a linear layer in full contact on its law without rounding. That of a parabola is there
    /// since the search takes a tenth of the time of `blocks` with 1000 blocks.
    pub(super) fn resolvent(&self, s: f64, rho: f64) -> Option<f64> {
        let Self { k, exponent } = *self;
        if exponent == 1.0 {
            Some(s / (1.0 + k / rho))
        } else if exponent == 2.0 {
            Some(2.0 * s / (1.0 + (1.0 + 4.0 * (s * k) * k / rho).sqrt()))
        } else {
            None
        }
    }

    /// Return the compression at a pressure > 0.
    pub(super) fn compression(&self, pressure: f64) -> f64 {
        pow(pressure, self.exponent.recip()) / self.k
    }
}

impl LayerLaw for Power {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        let Self { k, exponent } = *self;
        if exponent == 1.0 {
            // exactly constant, so that a settled contact set changes no matrix
            return (k * c, k);
        }
        let pressure = pow(k * c, exponent);
        (pressure, exponent * pressure / c)
    }

    fn energy(&self, point: usize, c: f64) -> f64 {
        self.pressure_and_tangent(point, c).0 * c / (self.exponent + 1.0)
    }

    fn as_power(&self, _point: usize) -> Option<Power> {
        Some(*self)
    }
}
