//! The law that a scene asks for, at the points of a pair: laws of a known form, expressions, and the check of laws that a Rust program
//! supplies.

use super::forms;
use super::numeric::{integral, line_intersection, root};
use super::table::Table;
use super::{LayerLaw, PerPoint, Response};
use crate::error::{Error, Kind, Result, shown};
use crate::expression::Expression;
use crate::linalg::{diagonal, portable::pow};
use crate::problem::Own;
use crate::problem::layer::LayerSpec;
use std::rc::Rc;

/// Make the law of a layer at the contact points `position`. `laws` are the laws that the program brings, by name.
///
/// A law whose parameters are constant is one object for all points.
///
/// # Errors
/// Parameters out of their range at a point, and expressions or the program's own laws that are not the law of a layer.
pub fn make(spec: &LayerSpec, laws: &OwnLaws, position: &[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> {
    match spec {
        LayerSpec::Form { form, values } => forms::make(form, values, position),
        LayerSpec::Own(name) => own(laws, name, position, extent(position)),
        LayerSpec::Table(points) => Ok(Rc::new(Table::new(points))),
        LayerSpec::Pressure { law, up_to } => {
            let size = extent(position);
            let at = |&x: &[f64; 3]| ExpressionLaw::new(law, x, *up_to, size);
            match law.uses_only_first() {
                true => Ok(Rc::new(at(&position[0])?)),
                false => Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?))),
            }
        }
    }
}

/// Return the diagonal of the box around all points. No layer is compressed by more.
fn extent(position: &[[f64; 3]]) -> f64 {
    let size = diagonal(position);
    if size > 0.0 { size } else { 1.0 }
}

/// The expression p(c) of a law at one point, continued as a straight line beyond its end.
#[derive(Debug, Clone)]
pub struct ExpressionLaw {
    law: Expression,
    /// The contact point (x, y, z).
    place: [f64; 3],
    /// Compression from which the law is a straight line; infinite if it never is.
    end: f64,
    /// The law there.
    at_end: Response,
}

/// Pressure beyond which a law is a straight line, since only trial states get there. It exceeds every unit of stress, and a product of five
/// such pressures is still finite.
const HUGE: f64 = 1e60;
/// Number of checked compressions in a factor of ten.
const STEPS_OF_EXPRESSION: i32 = 24;

impl ExpressionLaw {
    /// Make the law at a point, checked for compressions up to `end`, or else up to `size`, the extent of the surfaces. It must have
    /// p(0) = 0, increasing p and finite p'.
    ///
    /// # Errors
    /// A refusal that points at the expression and names the compression.
    pub fn new(law: &Expression, place: [f64; 3], end: Option<f64>, size: f64) -> Result<Self> {
        let mut typed = Self { law: law.clone(), place, end: f64::INFINITY, at_end: Response::default() };
        let top = end.unwrap_or(size);
        let first = typed.check_first_touch(top)?;
        let last = typed.check_increase(first, top, end)?;
        if last < top || end.is_some() {
            typed.at_end = typed.compressed(0, last);
            typed.end = last;
        }
        Ok(typed)
    }

    /// Check that p(0) is zero and p'(0) finite, and return p(0). `top` is the largest compression that will be checked.
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

    /// Check that p increases from `first` = p(0) up to the compression `top`, and return the largest compression that was checked. It
    /// is smaller than `top` if the pressure exceeds [`HUGE`] before. `end` is that of the scene, for advice.
    fn check_increase(&self, first: f64, top: f64, end: Option<f64>) -> Result<f64> {
        let least = self.value(top * 10f64.powi(-DECADES)).0;
        let (mut last, mut below) = (0.0, first.min(least - f64::MIN_POSITIVE));
        for step in 0..=DECADES * STEPS_OF_EXPRESSION {
            if below > HUGE {
                break;
            }
            let c = top * pow(10.0, f64::from(step) / f64::from(STEPS_OF_EXPRESSION) - f64::from(DECADES));
            let (pressure, slope) = self.value(c);
            if !(pressure.is_finite() && slope.is_finite()) {
                let advice = advice(last, end);
                self.refuse_outside(c).map_err(|error| error.help(advice.clone()))?;
                return Err(
                    self.refuse(format!("p is {} and p' {} at c = {c:.3e}", shown(pressure), shown(slope)), &advice)
                );
            }
            if pressure <= below || slope < 0.0 {
                return Err(self.refuse(format!("p does not increase at c = {c:.3e}"), &advice(last, end)));
            }
            (last, below) = (c, pressure);
        }
        Ok(last)
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
    fn compressed(&self, _point: usize, c: f64) -> Response {
        if c > self.end {
            return self.at_end.straight(c - self.end);
        }
        let (pressure, tangent) = self.value(c);
        Response { pressure, tangent, energy: integral(&|c| self.curve(c), 0.0, c) }
    }

    fn pressure(&self, point: usize, c: f64) -> f64 {
        // The energy of a response costs most.
        if c > 0.0 && c <= self.end { self.curve(c) } else { self.response(point, c).pressure }
    }

    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        if c <= self.end {
            return self.value(c);
        }
        let Response { pressure, tangent, .. } = self.at_end.straight(c - self.end);
        (pressure, tangent)
    }

    fn resolvent_loaded(&self, _point: usize, s: f64, rho: f64) -> f64 {
        let beyond = self.at_end.straight_meet(self.end, s, rho);
        if beyond > 0.0 {
            return self.end + beyond;
        }
        let high = s.min(self.end);
        line_intersection(s, rho, [0.0, high], high, |c| self.value(c))
    }

    fn compression_loaded(&self, _point: usize, pressure: f64) -> f64 {
        if self.end.is_finite() && pressure > self.at_end.pressure {
            return self.end + self.at_end.straight_compression(pressure);
        }
        // Without an end the unit of length is unknown, so no start is better than another.
        let (start, high) = if self.end.is_finite() { (self.end, self.end) } else { (1.0, f64::MAX) };
        root(pressure, [0.0, high], start, |c| self.value(c)).unwrap_or(f64::INFINITY)
    }

    fn end(&self, _point: usize) -> f64 {
        self.end
    }
}

/// The laws of a Rust program by name. Each entry makes the law of a pair from its contact points.
pub type OwnLaws = Own<dyn Fn(&[[f64; 3]]) -> Box<dyn LayerLaw>>;

/// Number of checked compressions in a factor of ten.
const STEPS: i32 = 8;
/// Number of factors of ten that are checked below the extent of the surfaces, or below the end of an expression.
const DECADES: i32 = 9;
/// Share of a compression over which a tangent is compared with a difference of pressures. For p ~ c^n the difference has a relative error
/// of n^2/6 times the square of this share, and a rounding error of 1e-16 divided by it.
const CLOSE: f64 = 1e-4;
/// Largest relative error of a tangent. It allows for n up to 700, where e^c overflows.
const OFF: f64 = 1e-3;
/// Rounding of an energy, as a share of the largest one: a formula may be a difference of terms that are 1e6 times the energy.
const ROUNDING: f64 = 1e-10;

/// Return the law of this name for the contact points `position`. It is checked at the first point for compressions up to `size`, the
/// extent of the surfaces.
///
/// # Errors
/// An unknown name, and a function that is not the law of a layer.
fn own(laws: &OwnLaws, name: &str, position: &[[f64; 3]], size: f64) -> Result<Rc<dyn LayerLaw>> {
    let law = laws.get("law of a layer", name)?(position);
    let refuse = |what| Error::new(Kind::Scene, format!("`{name}` is no law of a layer: {what}"));
    check(&*law, size).map_err(refuse)?;
    Ok(law.into())
}

/// Check that p(c) increases from 0, that the tangent is its derivative where the law is smooth, and that the energy is its integral.
/// A law may end with values that are not finite, at a rigid stop.
///
/// # Errors
/// A message that says what is wrong.
fn check(law: &dyn LayerLaw, size: f64) -> Result<(), String> {
    let mut samples: Vec<(f64, Response)> = vec![(0.0, Response::default())];
    for step in 0..=DECADES * STEPS {
        let c = size * 10f64.powf(f64::from(step) / f64::from(STEPS) - f64::from(DECADES));
        let response = law.compressed(0, c);
        if step > 0 && (response.pressure.is_nan() || response.pressure >= HUGE) {
            break;
        }
        samples.push((c, response));
    }
    let rounding = ROUNDING * samples[samples.len() - 1].1.energy.abs();
    let (mut kinks, mut mismatch) = (0, String::new());
    for two in samples.windows(2) {
        let [(before, last), (c, response)] = [two[0], two[1]];
        if !(response.pressure > last.pressure && response.pressure.is_finite()) {
            return Err(format!(
                "p is {} at c = {c:.3e} and {} before",
                shown(response.pressure),
                shown(last.pressure)
            ));
        }
        if !(response.tangent >= 0.0 && response.tangent.is_finite()) {
            return Err(format!("p' is {} at c = {c:.3e}", shown(response.tangent)));
        }
        // Since p increases, its integral lies between two rectangles.
        let (work, width) = (response.energy - last.energy, c - before);
        if !(work >= width * last.pressure - rounding && work <= width * response.pressure + rounding) {
            return Err(format!("the energy is not the integral of p at c = {c:.3e}"));
        }
        let [low, high] = [-CLOSE, CLOSE].map(|share| law.pressure(0, c * (1.0 + share)));
        let slope = (high - low) / (2.0 * CLOSE * c);
        let agrees = (slope - response.tangent).abs() <= OFF * slope.max(response.tangent);
        if !agrees {
            kinks += 1;
            mismatch =
                format!("p' is {:.3e} at c = {c:.3e}, where differences of p give {slope:.3e}", response.tangent);
        }
    }
    // A law may have kinks, but not at most of its points.
    if 2 * kinks > samples.len() { Err(mismatch) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::forms::{Cubic, Exponential, Power};

    #[test]
    fn the_extent_is_a_diagonal() {
        assert_eq!(extent(&[[1.0, -2.0, 5.0], [2.0, 2.0, 5.0], [-2.0, 1.0, 5.0]]), 32f64.sqrt());
        assert_eq!(extent(&[[1.0; 3]]), 1.0);
    }

    /// The law p = c^2 with mistakes.
    #[derive(Debug, Default)]
    struct Wrong {
        pressure: f64,
        tangent: f64,
        energy: f64,
        end: f64,
    }

    impl LayerLaw for Wrong {
        fn compressed(&self, _point: usize, c: f64) -> Response {
            let Wrong { pressure: cubic, tangent, energy, end } = *self;
            let pressure = if end > 0.0 && c > end { f64::INFINITY } else { c * c * (1.0 - cubic * c) };
            let tangent = (2.0 * c - 3.0 * cubic * c * c) * (1.0 + tangent);
            Response { pressure, tangent, energy: c * c * c * (1.0 / 3.0 - cubic * c / 4.0) * (1.0 + energy) }
        }
    }

    #[test]
    fn laws_pass() {
        let table = Table::new(&[[0.1, 1.0], [0.2, 1.5], [0.5, 30.0]]);
        let laws: [Box<dyn LayerLaw>; 6] = [
            Box::new(Power::new(2.5e-5, 0.2)),
            Box::new(Exponential::new(1e-3, 2e-3)),
            Box::new(Cubic { k1: 1.0, k3: 1e9 }),
            Box::new(table),
            Box::new(Wrong::default()),
            Box::new(Wrong { end: 1e-2, ..Wrong::default() }),
        ];
        for law in laws {
            assert_eq!(check(&*law, 1.0), Ok(()), "{law:?}");
        }
    }

    #[test]
    fn what_is_no_law_is_refused() {
        for (law, words) in [
            (Wrong { pressure: 2.0, ..Wrong::default() }, "before"),
            (Wrong { tangent: 0.01, ..Wrong::default() }, "where differences of p give"),
            (Wrong { tangent: -2.0, ..Wrong::default() }, "p' is -2e-9"),
            (Wrong { energy: 0.6, ..Wrong::default() }, "the energy is not the integral"),
            (Wrong { end: 1e-20, ..Wrong::default() }, "p is inf at c = 1.000e-9"),
        ] {
            let message = check(&law, 1.0).expect_err(words);
            assert!(message.contains(words), "{message}");
        }
        let mut laws = OwnLaws::default();
        laws.insert("film", Rc::new(|_| Box::new(Wrong::default())));
        let error = own(&laws, "flim", &[[0.0; 3]], 1.0).expect_err("a slip");
        assert!(error.to_string().contains("did you mean `film`?"), "{error}");
    }
}
