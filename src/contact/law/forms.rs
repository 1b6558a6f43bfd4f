//! Laws of a known form: linear and power, and cubic and exponential ones, which are expressions.

use super::expression::ExpressionLaw;
use super::{LayerLaw, PerPoint, Response, search};
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
        LayerSpec::Linear(_) => formed(&parameters, position, |v| LinearLaw { stiffness: v[0] }),
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

/// The law p(c) = stiffness * c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearLaw {
    /// Pressure per unit of compression, > 0.
    pub stiffness: f64,
}

impl LayerLaw for LinearLaw {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        Response { pressure: self.stiffness * c, tangent: self.stiffness, energy: 0.5 * self.stiffness * c * c }
    }

    /// In closed form, so that a linear layer in full contact is on its law without rounding.
    fn resolvent(&self, _point: usize, s: f64, rho: f64) -> f64 {
        if s > 0.0 && s < f64::INFINITY { s / (1.0 + self.stiffness / rho) } else { s }
    }
}

/// The law p(c) = (c/B)^(1/a) of the rough surface in the paper's numerical section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    b: f64,
    exponent: f64,
}

impl Power {
    /// Make the law from the compression B > 0 at unit pressure and 0 < a <= 1.
    pub fn new(b: f64, a: f64) -> Self {
        Self { b, exponent: 1.0 / a }
    }
}

impl LayerLaw for Power {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let pressure = pow(c / self.b, self.exponent);
        Response {
            pressure,
            // For a = 1 the tangent is exactly constant, so that a settled contact set changes no matrix.
            tangent: if self.exponent == 1.0 { 1.0 / self.b } else { self.exponent * pressure / c },
            energy: pressure * c / (self.exponent + 1.0),
        }
    }

    /// In closed form for p = (c/B)^2, since the search takes a tenth of the time of `blocks` with 1000 blocks.
    fn resolvent(&self, point: usize, s: f64, rho: f64) -> f64 {
        if self.exponent == 2.0 && s > 0.0 && s < f64::INFINITY {
            2.0 * s / (1.0 + (1.0 + 4.0 * (s / self.b) / self.b / rho).sqrt())
        } else {
            search(self, point, s, rho)
        }
    }

    fn compression(&self, _point: usize, pressure: f64) -> f64 {
        // The comparison is false for NaN, which is then returned as it is.
        if pressure <= 0.0 { 0.0 } else { self.b * pow(pressure, self.exponent.recip()) }
    }
}
