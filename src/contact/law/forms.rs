//! Laws of a known form: linear, cubic, power and exponential.

use super::numeric::{exp_less_line, gap_by_quadrature, line_intersection};
use super::{LayerLaw, PerPoint, Response};
use crate::error::{Error, Kind, Result, shown};
use crate::expression::Field;
use crate::linalg::portable::{cbrt, exp, expm1, log, log1p, pow};
use crate::problem::layer::{LawForm, LawKind, Parameter};
use std::rc::Rc;

/// Make the law of a form with these values of its parameters, for the contact points `position`.
///
/// # Errors
/// A parameter that is not finite or out of its range at a point.
pub fn make(form: &LawForm, values: &[Field], position: &[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> {
    match form.kind {
        LawKind::Linear => formed(form, values, position, |v| LinearLaw { stiffness: v[0] }),
        LawKind::Power => formed(form, values, position, |v| Power::new(v[0], v[1])),
        LawKind::Exponential => formed(form, values, position, |v| Exponential::new(v[0], v[1])),
        LawKind::Cubic => formed(form, values, position, |v| Cubic { k1: v[0], k3: v[1] }),
    }
}

/// Make a law of a known form: one for all points, or one a point where a parameter varies.
///
/// # Errors
/// A parameter that is not finite or out of its range at a point.
fn formed<L: LayerLaw + 'static>(
    form: &LawForm,
    values: &[Field],
    position: &[[f64; 3]],
    new: fn(&[f64]) -> L,
) -> Result<Rc<dyn LayerLaw>> {
    let at = |&x: &[f64; 3]| -> Result<L> {
        let parameters = form.parameters.iter().zip(values).map(|(parameter, field)| checked(parameter, field, x));
        Ok(new(&parameters.collect::<Result<Vec<f64>>>()?))
    };
    match values.iter().all(Field::is_constant) {
        true => Ok(Rc::new(at(&[0.0; 3])?)),
        false => Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?))),
    }
}

/// Return the value of a parameter at a point.
///
/// # Errors
/// A value that is not finite or out of its range.
fn checked(parameter: &Parameter, field: &Field, x: [f64; 3]) -> Result<f64> {
    let value = field.eval_finite(parameter.what, x)?;
    let Some(breach) = parameter.bounds.breach(value) else { return Ok(value) };
    let message = format!("{} is {} at ({}, {}, {})", parameter.what, shown(value), x[0], x[1], x[2]);
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

    fn resolvent_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        s / (1.0 + self.stiffness / rho)
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        pressure / self.stiffness
    }

    fn gap_loaded(&self, _point: usize, c: f64, pressure: f64) -> f64 {
        let excess = self.stiffness * c - pressure;
        0.5 * excess * (excess / self.stiffness)
    }
}

/// The law p(c) = k1 c + k3 c^3 of a layer that hardens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cubic {
    /// Pressure per unit of compression at first touch, > 0.
    pub k1: f64,
    /// Pressure per cube of compression, >= 0.
    pub k3: f64,
}

impl Cubic {
    /// Return the c > 0 with k1 c + k3 c^3 = target > 0, for a k1 that need not be the law's.
    fn root(self, k1: f64, target: f64) -> f64 {
        // Without one of the terms c is larger. From there Newton's iterates decrease, since the function is convex.
        let mut c = (target / k1).min(cbrt(target / self.k3));
        for _ in 0..MOST_NEWTON {
            let square = c * c;
            let step = (c * (k1 + self.k3 * square) - target) / (k1 + 3.0 * self.k3 * square);
            c -= step;
            if step.abs() <= SHORT * c {
                break;
            }
        }
        c
    }
}

/// Largest number of Newton steps. The worst start, at twice the target, needs 4, and the limit also ends steps of rounding.
const MOST_NEWTON: usize = 8;
/// Relative step at which Newton's method stops. The next step would be its square, which is rounding.
const SHORT: f64 = 1e-8;

impl LayerLaw for Cubic {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let (k1, k3, square) = (self.k1, self.k3, c * c);
        Response {
            pressure: c * (k1 + k3 * square),
            tangent: k1 + 3.0 * k3 * square,
            energy: square * (0.5 * k1 + 0.25 * k3 * square),
        }
    }

    fn resolvent_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        self.root(rho + self.k1, rho * s)
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        self.root(self.k1, pressure)
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let (k1, k3, on_graph) = (self.k1, self.k3, self.root(self.k1, pressure));
        // The difference of compressions follows from that of pressures, since direct subtraction may lose all digits.
        let secant = k1 + k3 * (c * c + c * on_graph + on_graph * on_graph);
        let distance = (self.pressure(point, c) - pressure) / secant;
        distance * distance * (0.5 * k1 + k3 * (1.5 * on_graph * on_graph + distance * (on_graph + 0.25 * distance)))
    }
}

/// Value of log((c + p/rho)/s) below which the next error, of fourth order, is rounding. For exponents up to 50 even 1e-4
/// would leave 1e-14.
const SETTLED: f64 = 1e-5;
/// Largest number of steps. The worst start needs 3, for exponents of 3 to 50.
const MOST_HOUSEHOLDER: usize = 12;

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

    fn resolvent_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        let m = self.exponent;
        if m == 1.0 {
            return s / (1.0 + 1.0 / self.b / rho);
        }
        if m == 2.0 {
            return 2.0 * s / (1.0 + (1.0 + 4.0 * (s / self.b) / self.b / rho).sqrt());
        }
        // Householder's method of fourth order solves for log c with the function log(c + p(c)/rho), whose derivatives cost
        // nothing. It starts at the smaller of the c that p = 0 and c = 0 would give. The sum is between s and 2 s there.
        let pressure_over_rho = |c: f64| pow(c / self.b, m) / rho;
        let all_pressure = self.compression_loaded(0, rho * s);
        let (mut c, mut p_rho) = if s < all_pressure { (s, pressure_over_rho(s)) } else { (all_pressure, s) };
        // The start `all_pressure` has the rounding of an inverse, so the method must not stop there.
        let mut exact = s < all_pressure;
        for _ in 0..MOST_HOUSEHOLDER {
            let sum = c + p_rho;
            let excess = log(sum / s);
            let share = p_rho / sum;
            let slope = 1.0 + (m - 1.0) * share;
            let second = (m - 1.0).powi(2) * share * (1.0 - share);
            let third = second * (m - 1.0) * (1.0 - 2.0 * share);
            let newton = excess / slope;
            let (bend, twist) = (0.5 * newton * second / slope, newton * newton * third / (6.0 * slope));
            c *= exp(-newton * (1.0 - bend) / (1.0 - 2.0 * bend + twist));
            if exact && excess.abs() < SETTLED {
                break;
            }
            (p_rho, exact) = (pressure_over_rho(c), true);
        }
        c
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        self.b * pow(pressure, 1.0 / self.exponent)
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let (m, at_c) = (self.exponent, self.pressure(point, c));
        let excess = (at_c - pressure) / pressure;
        if excess.abs() < 0.5 {
            // With u = log(p(c)/p) the gap is c p (e^u - 1 + m (e^(-u/m) - 1))/(m + 1), whose terms of first order cancel.
            let u = log1p(excess);
            c * pressure * (exp_less_line(u) + m * exp_less_line(-u / m)) / (m + 1.0)
        } else {
            (c * at_c + m * self.compression_loaded(point, pressure) * pressure) / (m + 1.0) - c * pressure
        }
    }
}

/// The law p(c) = p0 (e^(c/c0) - 1), continued as a straight line beyond c = 60 c0. No load compresses a layer so far, but trial
/// states do, and their values must stay finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    p0: f64,
    c0: f64,
    /// Compression from which the law is a straight line.
    end: f64,
    at_end: Response,
}

/// Ratio c/c0 beyond which the law is a straight line. The pressure is exp(60) = 1e26 times p0 there: no solution gets so far, and the squares of such
/// pressures are finite.
const LINE: f64 = 60.0;

impl Exponential {
    /// Make the law from a pressure p0 > 0 and the compression c0 > 0 over which the slope grows by e.
    pub fn new(p0: f64, c0: f64) -> Self {
        let mut law = Self { p0, c0, end: LINE * c0, at_end: Response::default() };
        law.at_end = law.compressed(0, law.end);
        law
    }
}

impl LayerLaw for Exponential {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let s = (c / self.c0).min(LINE);
        let growth = expm1(s);
        let curve = Response {
            pressure: self.p0 * growth,
            tangent: self.p0 / self.c0 * exp(s),
            energy: self.p0 * self.c0 * exp_less_line(s),
        };
        if c <= self.end { curve } else { curve.straight(c - self.end) }
    }

    fn resolvent_loaded(&self, point: usize, s: f64, rho: f64) -> f64 {
        let beyond = self.at_end.straight_meet(self.end, s, rho);
        if beyond > 0.0 {
            return self.end + beyond;
        }
        // The start is the smaller of the c that p = 0 and c = 0 would give. The sum c + p/rho is between s and 2 s there.
        let start = s.min(self.compression_loaded(point, rho * s));
        line_intersection(s, rho, [0.0, s.min(self.end)], start, |c| self.pressure_and_tangent(point, c))
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        match pressure <= self.at_end.pressure {
            true => self.c0 * log1p(pressure / self.p0),
            false => self.end + self.at_end.straight_compression(pressure),
        }
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        if c > self.end || pressure > self.at_end.pressure {
            let (law, tangent) = (|c| self.pressure(point, c), |c| self.pressure_and_tangent(point, c).1);
            return gap_by_quadrature(c, pressure, self.compression(point, pressure), law, tangent);
        }
        // The gap is (p + p0) c0 (e^d - 1 - d), where d is the distance of c from the graph in units of c0.
        let slope = pressure + self.p0;
        let distance = log1p((self.pressure(point, c) - pressure) / slope);
        slope * self.c0 * exp_less_line(distance)
    }
}
