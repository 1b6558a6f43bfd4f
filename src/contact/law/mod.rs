//! Laws of Winkler layers: pressure against compression.
//!
//! The paper writes sigma_n = g(w) with w = -c, where c is the compression. Here the pressure is p(c) = -g(-c). A law
//! is monotone with p(0) = 0 and has a bounded tangent on bounded ranges, conditions (6)-(7) of the paper. A new law is
//! a new type with the trait [`LayerLaw`], which says p, p' and the energy P at c > 0, a form in
//! [`layer`](crate::problem::layer) and a line in `make`. A program that uses this library implements the trait alone:
//! [`OwnLaws`].
//!
//! Everything else follows from these functions. With p = 0 for c <= 0 a law is a maximal monotone graph of points (c,
//! p), a [`Law`]. A point is found from its compression ([`Law::pressure_and_tangent`]), from its pressure
//! ([`Law::compression`]) or from a line of slope -rho that meets the graph ([`Law::resolvent`], or [`Law::resolve`]
//! for smoothed laws), by one root finder (`numeric`) where a law has no closed form. [`Law::duality_gap`] measures the
//! distance of any (c, p) from the graph. These methods handle the open layer, bonds and the ends of the range.

mod expression;
mod forms;
mod make;
mod memory;
mod numeric;
mod table;
#[cfg(test)]
mod tests;

use crate::error::Result;
pub use forms::Power;
pub use make::{LawMaker, OwnLaws, make, of_pair};
use memory::{Memory, Unloading};
use std::rc::Rc;
pub use table::Table;

/// The law of a layer at the points of one pair, for compressions c > 0.
pub trait LayerLaw: std::fmt::Debug {
    /// Return the pressure p (force per area) and the tangent p' (stiffness per area) of contact point `point` at a
    /// compression `c > 0`.
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64);

    /// Return P(c), the integral of p from 0 to `c > 0`: energy per area.
    fn energy(&self, point: usize, c: f64) -> f64;

    /// Return the compression up to which the law is given, infinite if it has no end. Beyond it the law goes on along
    /// its tangent there, so that iterates may pass it.
    fn end(&self, _point: usize) -> f64 {
        f64::INFINITY
    }

    /// Return the compression up to which the user has given the law: its end, or that of the law that a layer which
    /// remembers goes on along.
    fn given(&self, point: usize) -> f64 {
        self.end(point)
    }

    /// Return the compression up to which there is no pressure: 0, or more where a layer stays compressed.
    fn rest(&self, _point: usize) -> f64 {
        0.0
    }

    /// Return the law as a power of the compression if it is one, for which states have closed forms.
    fn as_power(&self, _point: usize) -> Option<Power> {
        None
    }
}

/// A law with a parameter that varies over the surface: one law for each contact point.
#[derive(Debug)]
pub struct PerPoint<L>(pub Vec<L>);

impl<L: LayerLaw> LayerLaw for PerPoint<L> {
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        self.0[point].pressure_and_tangent(0, c)
    }

    fn energy(&self, point: usize, c: f64) -> f64 {
        self.0[point].energy(0, c)
    }

    fn end(&self, point: usize) -> f64 {
        self.0[point].end(0)
    }

    fn as_power(&self, point: usize) -> Option<Power> {
        self.0[point].as_power(0)
    }
}

/// The graph of a layer: the points (c, p) that compression and pressure of a contact point may have. It is odd where
/// the layer pulls by the law by which it pushes, and p = 0 for c <= 0 where it lets go.
#[derive(Debug, Clone)]
pub struct Law {
    /// The law for c > 0.
    pub compression: Rc<dyn LayerLaw>,
    /// The law of a bonded layer for c < 0, of the stretch -c and the tension -p.
    pub tension: Option<Rc<dyn LayerLaw>>,
    /// How the layer is unloaded, if not along the law for c > 0.
    unloading: Option<Unloading>,
}

impl From<Rc<dyn LayerLaw>> for Law {
    /// Return the graph of a layer that lets go.
    fn from(compression: Rc<dyn LayerLaw>) -> Self {
        Self { compression, tension: None, unloading: None }
    }
}

impl Law {
    /// Return the graph of a layer that lets go.
    pub fn new(law: impl LayerLaw + 'static) -> Self {
        Self::from(Rc::new(law) as Rc<dyn LayerLaw>)
    }

    /// Return the law of the side on which `x`, a compression or a pressure, lies, and the sign of compressions and
    /// pressures there; `None` where the layer lets go. NaN lies on the side of compressions.
    fn side(&self, x: f64) -> Option<(&dyn LayerLaw, f64)> {
        match &self.tension {
            Some(tension) if x < 0.0 => Some((&**tension, -1.0)),
            None if x <= 0.0 => None,
            _ => Some((&*self.compression, 1.0)),
        }
    }

    /// Return whether the layer is unloaded along another curve than it was loaded.
    pub fn has_memory(&self) -> bool {
        self.unloading.is_some()
    }

    /// Let the points of the law have had compressions up to `largest`; those up to 0 count as none.
    ///
    /// # Errors
    /// The law of unloading is too soft.
    pub fn remember(&mut self, largest: &[f64]) -> Result<()> {
        if let Some(unloading) = &self.unloading {
            self.compression = Rc::new(Memory::new(self.compression.clone(), unloading, largest)?);
        }
        Ok(())
    }

    /// Return the compression up to which there is no pressure: 0, or more where a layer stays compressed.
    pub fn rest(&self, point: usize) -> f64 {
        self.compression.rest(point)
    }

    /// Return whether the layer pulls where it is stretched, at c < 0. Such a law has one state without pressure, at
    /// the origin.
    pub fn is_bonded(&self) -> bool {
        self.tension.is_some()
    }

    /// Return the compression up to which the law is given at a point, infinite if it has no end.
    pub fn end(&self, point: usize) -> f64 {
        self.compression.given(point)
    }

    /// Return the stretch up to which the law of a bonded layer is given, in the same way.
    pub fn end_in_tension(&self, point: usize) -> f64 {
        self.tension.as_ref().map_or(f64::INFINITY, |law| law.end(point))
    }

    /// Return p and p' at any compression. They are zero where the layer is open; NaN stays NaN.
    pub fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        let Some((law, sign)) = self.side(c) else { return (0.0, 0.0) };
        let (pressure, tangent) = extended(law, point, sign * c);
        match c {
            // between compression and tension, where the tangent of a power is not finite
            0.0 => (0.0, if tangent.is_finite() { tangent } else { 0.0 }),
            _ => (sign * pressure, tangent),
        }
    }

    /// Return p at any compression.
    pub fn pressure(&self, point: usize, c: f64) -> f64 {
        self.pressure_and_tangent(point, c).0
    }

    /// Return P(c), the integral of p from 0 to any compression.
    pub fn energy(&self, point: usize, c: f64) -> f64 {
        let Some((law, sign)) = self.side(c).filter(|_| c != 0.0) else { return 0.0 };
        extended_energy(law, point, sign * c)
    }

    /// Return g'(-c) of (38), the tangent of the paper's law g, which continues into tension as an odd function. Where
    /// the layer is compressed, it is p'(c), and where it stays compressed without pressure, p' at the end of that. The
    /// Robin terms of open points use it, the pressure never does.
    pub fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        let rest = self.rest(point);
        let size = if rest > 0.0 && c.abs() <= rest { rest * (1.0 + f64::EPSILON) } else { c.abs() };
        self.pressure_and_tangent(point, if self.is_bonded() && c < 0.0 { c } else { size }).1
    }

    /// Return the compression c of the only point (c, p) of the graph with c + p/rho = s, for a stiffness per area
    /// `rho > 0` (Minty's parametrisation). It is s itself where the layer is open and for an infinite rho; NaN stays
    /// NaN.
    ///
    /// Both c and p/rho grow with s, but not by more than s does. The equation holds to the rounding of p(c), which is
    /// a few times 1e-16 s times the exponent of the law at c.
    pub fn resolvent(&self, point: usize, s: f64, rho: f64) -> f64 {
        let Some((law, sign)) = self.side(s) else { return s };
        // All comparisons are false for NaN, which is then returned as it is.
        if !(s != 0.0 && s.abs() < f64::INFINITY && rho < f64::INFINITY) {
            return s;
        }
        let size = s.abs();
        let closed_form = law.as_power(point).and_then(|power| power.resolvent(size, rho));
        let found = closed_form.unwrap_or_else(|| {
            let sum = |c: f64| {
                let (pressure, tangent) = extended(law, point, c);
                (c + pressure / rho, 1.0 + tangent / rho)
            };
            // A law that is NaN from some compression on has a rigid stop there.
            let (Ok(c) | Err(c)) = numeric::root(size, [0.0, size], size, sum);
            c
        });
        sign * found
    }

    /// Return the compression at which the layer has this pressure. It is 0 for a tension that it does not have and
    /// infinite for a pressure that it cannot reach in double precision; NaN stays NaN.
    pub fn compression(&self, point: usize, pressure: f64) -> f64 {
        // All graphs pass through the origin, so that pressures have the signs of compressions.
        let Some((law, sign)) = self.side(pressure) else { return 0.0 };
        if pressure == 0.0 || !pressure.is_finite() {
            return pressure;
        }
        let size = pressure.abs();
        // Without an end the unit of length is unknown, so no start is better than another.
        let (rest, start) = (law.rest(point), law.end(point).min(1.0));
        let search = || numeric::root(size, [rest, f64::MAX], start.max(2.0 * rest), |c| extended(law, point, c));
        sign * match law.as_power(point) {
            Some(power) => power.compression(size),
            None => search().unwrap_or(f64::INFINITY),
        }
    }

    /// Return a bound of Fenchel's gap P(c) + P*(p) - c p of a compression `c` and a `pressure` p, which need not be a
    /// point of the graph.
    ///
    /// The gap is an energy per area. P*(p) = sup_c (p c - P(c)) is the complementary energy of P, the energy of the
    /// law. It is the area between the graph and the corner (c, p), and the bound is the rectangle around it,
    ///
    /// ```text
    /// (c - phi(p)) (p(c) - p),      phi(p) the compression at the pressure p,
    /// ```
    ///
    /// which is twice the gap where the law is straight. It is not negative, and zero on the graph to rounding. It is
    /// infinite for `pressure < 0` unless the layer is bonded, and for a pressure that the layer cannot reach; NaN
    /// stays NaN.
    ///
    /// The rounding of p(c) itself, 1e-16 p times the exponent of the law, does not count as an error of the gap. It
    /// equals a change of the law's parameters within double precision.
    pub fn duality_gap(&self, point: usize, c: f64, pressure: f64) -> f64 {
        if c.is_nan() || pressure.is_nan() {
            return f64::NAN;
        }
        if pressure == 0.0 && c <= 0.0 && !self.is_bonded() {
            // An open layer without pressure is on the graph at any distance.
            return 0.0;
        }
        let on_graph = if pressure == 0.0 && c > 0.0 { self.rest(point) } else { self.compression(point, pressure) };
        let at_c = self.pressure(point, c);
        let gap = (c - on_graph) * (at_c - pressure);
        // NaN comes from values that overflow or lie beyond the end of a law.
        if pressure < 0.0 && !self.is_bonded() || gap.is_nan() { f64::INFINITY } else { gap.max(0.0) }
    }

    /// Return Minty's resolvent: the only state with c + p/rho = `sum` on the law smoothed by `mu`.
    ///
    /// `mu` is an energy per area and `rho > 0` a stiffness per area. With `mu` = 0 the result is the state on the law
    /// itself.
    ///
    /// Let c = phi(p) be the inverse of the law. The smoothed law, as on the central path of an interior-point method,
    /// is
    ///
    /// ```text
    /// c = phi(p) - mu/p,   p > 0,        kappa = dp/dc = 1 / (phi'(p) + mu/p^2)
    /// ```
    ///
    /// It is strictly monotone and has no corner. At every pressure p the gap s = mu/p remains, so that s p = mu, which
    /// is the perturbed complementarity condition.
    ///
    /// The law need not be inverted. Let P(s) be the pressure at which the law itself meets the line with the sum s. A
    /// state with the remaining gap y = mu/p has p = P(`sum` + y), so y is the root of y P(`sum` + y) = mu, where the
    /// left side increases with y. The root is least for a rigid layer, P(s) = rho s, whose gap has a closed form.
    ///
    /// A bonded layer neither opens nor closes, so that nothing is smoothed.
    pub fn resolve(&self, point: usize, sum: f64, rho: f64, mu: f64) -> LawState {
        if mu == 0.0 || !sum.is_finite() || self.is_bonded() {
            return self.on_law(point, sum, rho);
        }
        let value = |gap: f64| {
            let LawState { pressure, tangent, .. } = self.on_law(point, sum + gap, rho);
            (gap * pressure, pressure + gap * tangent / (1.0 + tangent / rho))
        };
        let diagonal = sum.hypot(2.0 * (mu / rho).sqrt());
        let rigid = if sum > 0.0 { 2.0 * mu / rho / (sum + diagonal) } else { 0.5 * (diagonal - sum) };
        // With an infinite rho the gap of a closed point has no lower bound.
        let start = if rigid > 0.0 { rigid } else { 1.0 };
        let least = rigid * (1.0 - 4.0 * f64::EPSILON);
        let (Ok(gap) | Err(gap)) = numeric::root(mu, [least, f64::MAX], start, value);
        let LawState { compression, tangent, .. } = self.on_law(point, sum + gap, rho);
        let pressure = mu / gap;
        LawState { compression: compression - gap, pressure, tangent: (tangent.recip() + gap / pressure).recip() }
    }

    /// Return the state on the law itself with c + p/rho = `sum`.
    fn on_law(&self, point: usize, sum: f64, rho: f64) -> LawState {
        let compression = self.resolvent(point, sum, rho);
        let (pressure, tangent) = self.pressure_and_tangent(point, compression);
        LawState { compression, pressure, tangent }
    }
}

/// Return p and p' of a law at c > 0, beyond its end along its tangent there.
fn extended(law: &dyn LayerLaw, point: usize, c: f64) -> (f64, f64) {
    let end = law.end(point);
    if c > end {
        let (pressure, tangent) = law.pressure_and_tangent(point, end);
        (pressure + tangent * (c - end), tangent)
    } else {
        law.pressure_and_tangent(point, c)
    }
}

/// Return P(c), the integral of the pressure of [`extended`].
fn extended_energy(law: &dyn LayerLaw, point: usize, c: f64) -> f64 {
    let end = law.end(point);
    if c > end {
        let (pressure, tangent) = law.pressure_and_tangent(point, end);
        law.energy(point, end) + (c - end) * (pressure + 0.5 * tangent * (c - end))
    } else {
        law.energy(point, c)
    }
}

/// A state (c, p) on a law or a smoothed law, with the tangent there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawState {
    /// Compression c.
    pub compression: f64,
    /// Pressure p, force per area.
    pub pressure: f64,
    /// Tangent kappa = dp/dc.
    pub tangent: f64,
}
