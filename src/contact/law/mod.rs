//! Laws of Winkler layers: pressure against compression.
//!
//! The paper writes sigma_n = g(w) with w = -c, where c is the compression. Here the pressure is p(c) = -g(-c). A law
//! is monotone with p(0) = 0 and has a bounded tangent on bounded ranges, conditions (6)-(7) of the paper. A new law is
//! a new type, a form in [`layer`](crate::problem::layer) and a line in `make`. A program that uses this library
//! implements the trait alone: [`OwnLaws`].
//!
//! With p = 0 for c <= 0 a law is a maximal monotone graph of points (c, p). A point is found from its compression
//! ([`LayerLaw::response`]), from its pressure ([`LayerLaw::compression`]) or from a line of slope -rho that meets the
//! graph ([`LayerLaw::resolvent`], or [`resolve`] for smoothed laws), by one root finder (`numeric`) where a law has no
//! closed form. [`LayerLaw::duality_gap`] measures the distance of any (c, p) from the graph. These methods handle the
//! open layer and the ends of the range.

mod bonded;
mod expression;
mod forms;
mod make;
mod numeric;
mod table;
#[cfg(test)]
mod tests;

pub use bonded::Bonded;
pub use forms::LinearLaw;
#[cfg(test)]
pub use forms::Power;
pub use make::{LawMaker, OwnLaws, make, of_pair};
pub use table::Table;

/// The response of a layer at one point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Response {
    /// p(c), force per area.
    pub pressure: f64,
    /// p'(c).
    pub tangent: f64,
    /// P(c), the integral of p from 0 to c: energy per area.
    pub energy: f64,
}

impl Response {
    /// Return the response at a compression larger by `beyond`, along the tangent.
    fn straight(self, beyond: f64) -> Self {
        Response {
            pressure: self.pressure + self.tangent * beyond,
            tangent: self.tangent,
            energy: self.energy + beyond * (self.pressure + 0.5 * self.tangent * beyond),
        }
    }
}

/// The law of a layer at the points of one pair.
pub trait LayerLaw: std::fmt::Debug {
    /// Return the response at contact point `point` to a compression `c > 0`.
    fn compressed(&self, point: usize, c: f64) -> Response;

    /// Return the response to any compression. It is zero for `c <= 0`, where the layer is open; NaN stays NaN.
    fn response(&self, point: usize, c: f64) -> Response {
        if c <= 0.0 { Response::default() } else { self.compressed(point, c) }
    }

    /// Return the pressure alone, for searches that need nothing else.
    fn pressure(&self, point: usize, c: f64) -> f64 {
        self.response(point, c).pressure
    }

    /// Return whether the layer is bonded: whether it pulls where it is stretched, at `c < 0`. Such a law has no state
    /// without pressure but `c = 0`.
    fn is_bonded(&self) -> bool {
        false
    }

    /// Return the compression up to which the law is given at contact point `point`, infinite if it has no end. Beyond
    /// it the law continues as a straight line, so that iterates may pass it.
    fn end(&self, _point: usize) -> f64 {
        f64::INFINITY
    }

    /// Return the stretch up to which the law of a bonded layer is given, in the same way.
    fn end_in_tension(&self, _point: usize) -> f64 {
        f64::INFINITY
    }

    /// Return g'(-c) of (38), the tangent of the paper's law g, which continues into tension as an odd function. For `c > 0` it is
    /// p'(c). The Robin terms of open points use it, the pressure never does.
    fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        self.response(point, c.abs()).tangent
    }

    /// Return the pressure and the tangent at a compression `c > 0`, for searches that need no energy.
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        let Response { pressure, tangent, .. } = self.compressed(point, c);
        (pressure, tangent)
    }

    /// Return the compression c of the only point (c, p) of the graph with c + p/rho = s, for a stiffness per area `rho > 0`
    /// (Minty's parametrisation). It is s itself for `s <= 0` and for an infinite rho; NaN stays NaN.
    ///
    /// Both c and p/rho grow with s, but not by more than s does. The equation holds to the rounding of p(c), which is
    /// a few times 1e-16 s times the exponent of the law at c.
    fn resolvent(&self, point: usize, s: f64, rho: f64) -> f64 {
        search(self, point, s, rho)
    }

    /// Return the compression at which the layer has this pressure. It is 0 for `pressure <= 0` and infinite for a
    /// pressure that the layer cannot reach in double precision; NaN stays NaN.
    fn compression(&self, point: usize, pressure: f64) -> f64 {
        if !(pressure > 0.0 && pressure < f64::INFINITY) {
            return pressure.clamp(0.0, f64::INFINITY);
        }
        // Without an end the unit of length is unknown, so no start is better than another.
        let start = self.end(point).min(1.0);
        numeric::root(pressure, [0.0, f64::MAX], start, |c| self.pressure_and_tangent(point, c))
            .unwrap_or(f64::INFINITY)
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
    fn duality_gap(&self, point: usize, c: f64, pressure: f64) -> f64 {
        if c.is_nan() || pressure.is_nan() {
            return f64::NAN;
        }
        if pressure == 0.0 && c <= 0.0 && !self.is_bonded() {
            // An open layer without pressure is on the graph at any distance.
            return 0.0;
        }
        let (at_c, on_graph) = (self.pressure(point, c), self.compression(point, pressure));
        let gap = (c - on_graph) * (at_c - pressure);
        // NaN comes from values that overflow or lie beyond the end of a law.
        if pressure < 0.0 && !self.is_bonded() || gap.is_nan() { f64::INFINITY } else { gap.max(0.0) }
    }
}

/// Return [`LayerLaw::resolvent`] by a search for the root.
fn search(law: &(impl LayerLaw + ?Sized), point: usize, s: f64, rho: f64) -> f64 {
    // All comparisons are false for NaN, which is then returned as it is.
    if !(s > 0.0 && s < f64::INFINITY && rho < f64::INFINITY) {
        return s;
    }
    let sum = |c: f64| {
        let (pressure, tangent) = law.pressure_and_tangent(point, c);
        (c + pressure / rho, 1.0 + tangent / rho)
    };
    // A law that is NaN from some compression on has a rigid stop there.
    let (Ok(c) | Err(c)) = numeric::root(s, [0.0, s], s, sum);
    c
}

/// A law with a parameter that varies over the surface: one law for each contact point.
#[derive(Debug)]
pub struct PerPoint<L>(pub Vec<L>);

impl<L: LayerLaw> LayerLaw for PerPoint<L> {
    fn compressed(&self, point: usize, c: f64) -> Response {
        self.0[point].compressed(0, c)
    }

    fn pressure(&self, point: usize, c: f64) -> f64 {
        self.0[point].pressure(0, c)
    }

    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        self.0[point].pressure_and_tangent(0, c)
    }

    fn end(&self, point: usize) -> f64 {
        self.0[point].end(0)
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

/// Return Minty's resolvent: the only state with c + p/rho = `sum` on the law smoothed by `mu`.
///
/// `mu` is an energy per area and `rho > 0` a stiffness per area. With `mu` = 0 the result is the state on the law
/// itself.
///
/// Let c = phi(p) be the inverse of the law. The smoothed law, as on the central path of an interior-point method, is
///
/// ```text
/// c = phi(p) - mu/p,   p > 0,        kappa = dp/dc = 1 / (phi'(p) + mu/p^2)
/// ```
///
/// It is strictly monotone and has no corner. At every pressure p the gap s = mu/p remains, so that s p = mu, which is
/// the perturbed complementarity condition.
///
/// The law need not be inverted. Let P(s) be the pressure at which the law itself meets the line with the sum s. A
/// state with the remaining gap y = mu/p has p = P(`sum` + y), so y is the root of y P(`sum` + y) = mu, where the left
/// side increases with y. The root is least for a rigid layer, P(s) = rho s, whose gap has a closed form.
///
/// A bonded layer neither opens nor closes, so that nothing is smoothed.
pub fn resolve(law: &dyn LayerLaw, point: usize, sum: f64, rho: f64, mu: f64) -> LawState {
    if mu == 0.0 || !sum.is_finite() || law.is_bonded() {
        return on_law(law, point, sum, rho);
    }
    let value = |gap: f64| {
        let LawState { pressure, tangent, .. } = on_law(law, point, sum + gap, rho);
        (gap * pressure, pressure + gap * tangent / (1.0 + tangent / rho))
    };
    let diagonal = sum.hypot(2.0 * (mu / rho).sqrt());
    let rigid = if sum > 0.0 { 2.0 * mu / rho / (sum + diagonal) } else { 0.5 * (diagonal - sum) };
    // With an infinite rho the gap of a closed point has no lower bound.
    let start = if rigid > 0.0 { rigid } else { 1.0 };
    let least = rigid * (1.0 - 4.0 * f64::EPSILON);
    let (Ok(gap) | Err(gap)) = numeric::root(mu, [least, f64::MAX], start, value);
    let LawState { compression, tangent, .. } = on_law(law, point, sum + gap, rho);
    let pressure = mu / gap;
    LawState { compression: compression - gap, pressure, tangent: (tangent.recip() + gap / pressure).recip() }
}

/// Return the state on the law itself with c + p/rho = `sum`.
fn on_law(law: &dyn LayerLaw, point: usize, sum: f64, rho: f64) -> LawState {
    let compression = law.resolvent(point, sum, rho);
    let (pressure, tangent) = if compression > 0.0 {
        law.pressure_and_tangent(point, compression)
    } else {
        let Response { pressure, tangent, .. } = law.response(point, compression);
        (pressure, tangent)
    };
    LawState { compression, pressure, tangent }
}
