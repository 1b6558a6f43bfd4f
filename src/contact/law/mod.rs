//! Laws of Winkler layers: pressure against compression.
//!
//! The paper writes sigma_n = g(w) with w = -c; here p(c) = -g(-c). A law is monotone with p(0) = 0 and a
//! bounded tangent on bounded ranges, conditions (6)-(7). A new law is a new file, a form in
//! [`layer`](crate::problem::layer) and a line in [`make`]; or in a program over this library the trait alone: [`OwnLaws`].
//!
//! With p = 0 for c <= 0 a law is a maximal monotone graph of points (c, p). Its points are found from the compression
//! ([`LayerLaw::response`]), from the pressure ([`LayerLaw::compression`]) or from a line of slope -rho that meets the
//! graph ([`LayerLaw::meet`], of smoothed laws [`resolve`]); [`LayerLaw::duality_gap`] says how far any (c, p) is from the graph. These handle the
//! open layer and the ends of the range; a law implements the methods named `loaded`, if it has a better way than the
//! common search.

mod asperities;
mod cubic;
mod exponential;
mod gap;
mod linear;
mod make;
mod own;
mod power;
mod quadrature;
mod root;
mod scaled;
mod smoothed;
mod table;
#[cfg(test)]
mod tests;
mod typed;

pub use cubic::Cubic;
pub use exponential::Exponential;
pub use linear::Linear;
pub use make::make;
pub use own::OwnLaws;
pub use power::Power;
pub use scaled::Scaled;
pub use smoothed::{LawState, resolve};
pub use table::Table;
pub use typed::Typed;

/// Answer of a layer at one point.
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
    /// The response `beyond` this one along the tangent.
    fn straight(self, beyond: f64) -> Self {
        Response {
            pressure: self.pressure + self.tangent * beyond,
            tangent: self.tangent,
            energy: self.energy + beyond * (self.pressure + 0.5 * self.tangent * beyond),
        }
    }

    /// How far beyond this response a straight line has `pressure`.
    fn straight_compression(self, pressure: f64) -> f64 {
        (pressure - self.pressure) / self.tangent
    }

    /// How far beyond this response, at compression `c`, a straight line meets c + p/rho = s; negative if it does
    /// before.
    fn straight_meet(self, c: f64, s: f64, rho: f64) -> f64 {
        (s - c - self.pressure / rho) / (1.0 + self.tangent / rho)
    }
}

/// A layer's law at the points of one pair.
pub trait LayerLaw: std::fmt::Debug {
    /// Response at contact point `point` to a compression `c > 0`.
    fn compressed(&self, point: usize, c: f64) -> Response;

    /// Response to any compression: nothing for `c <= 0`, where the layer is open; NaN stays NaN.
    fn response(&self, point: usize, c: f64) -> Response {
        if c <= 0.0 { Response::default() } else { self.compressed(point, c) }
    }

    /// The pressure alone, for searches that need nothing else.
    fn pressure(&self, point: usize, c: f64) -> f64 {
        self.response(point, c).pressure
    }

    /// Compression up to which the law is given at contact point `point`; infinite if it is for all. Beyond it the law goes on as a straight
    /// line, so that iterates may pass it.
    fn end(&self, _point: usize) -> f64 {
        f64::INFINITY
    }

    /// g'(-c) of (38): the tangent of the paper's law g, which also runs through tension as an odd function. For `c > 0` it is
    /// p'(c). Robin terms of open points use it; pressure never does.
    fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        self.response(point, c.abs()).tangent
    }

    /// Pressure and tangent at a compression `c > 0`, for searches that need no energy.
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        let Response { pressure, tangent, .. } = self.compressed(point, c);
        (pressure, tangent)
    }

    /// The compression c of the only point (c, p) of the graph with c + p/rho = s, for a stiffness per area `rho > 0`
    /// (Minty's parametrisation): s itself for `s <= 0` and for an infinite rho; NaN stays NaN.
    ///
    /// c and p/rho grow with s, and neither by more than s does. The equation holds to the rounding of p(c): a few
    /// times 1e-16 s times the exponent of the law at c.
    fn meet(&self, point: usize, s: f64, rho: f64) -> f64 {
        // written so that NaN stays
        if s > 0.0 && s < f64::INFINITY && rho < f64::INFINITY { self.meet_loaded(point, s, rho) } else { s }
    }

    /// [`LayerLaw::meet`] for finite `s > 0` and `rho > 0`.
    fn meet_loaded(&self, point: usize, s: f64, rho: f64) -> f64 {
        root::meeting(s, rho, [0.0, s], s, |c| self.pressure_and_tangent(point, c))
    }

    /// The compression at which the layer has this pressure: 0 for `pressure <= 0`, infinity for one that it cannot
    /// reach in double numbers; NaN stays NaN.
    fn compression(&self, point: usize, pressure: f64) -> f64 {
        if pressure > 0.0 && pressure < f64::INFINITY {
            self.compression_loaded(point, pressure)
        } else {
            pressure.clamp(0.0, f64::INFINITY)
        }
    }

    /// [`LayerLaw::compression`] for a finite `pressure > 0`.
    fn compression_loaded(&self, point: usize, pressure: f64) -> f64 {
        // laws come in any units
        let start = 1.0;
        root::root(pressure, [0.0, f64::MAX], start, |c| self.pressure_and_tangent(point, c)).unwrap_or(f64::INFINITY)
    }

    /// Fenchel's gap P(c) + P*(p) - c p of a compression `c` and a `pressure` that need not be the law's, energy per
    /// area, with the complementary energy P*(p) = sup_c (p c - P(c)): not negative, zero on the graph, infinite for
    /// `pressure < 0` and for a pressure that the layer cannot reach; NaN stays NaN.
    ///
    /// It is the area between the graph and the corner (c, p), computed without the difference of large numbers. Near
    /// the graph it follows the difference p(c) - p, which is exact for the p(c) that [`LayerLaw::pressure`] gives: a
    /// relative error below 1e-3 as long as |p(c) - p| >= 1e-13 p. Where a kink of the law is between the two, within
    /// 1e-12 c, it is only a bound, at most the ratio of the tangents too large. Closer to the graph it is of the order
    /// of 1e-30 p^2/p'(c) or 0.
    ///
    /// What p(c) itself has of rounding, 1e-16 p times the exponent of the law, is no error of the gap: it is that of a
    /// law with parameters as far off as double numbers are.
    fn duality_gap(&self, point: usize, c: f64, pressure: f64) -> f64 {
        if c.is_nan() || pressure.is_nan() {
            f64::NAN
        } else if pressure < 0.0 || pressure == f64::INFINITY || c.is_infinite() {
            // an open layer without pressure is on the graph at any distance
            if pressure == 0.0 && c < 0.0 { 0.0 } else { f64::INFINITY }
        } else if pressure == 0.0 {
            self.response(point, c).energy
        } else {
            // below c = 0 the area is a rectangle and no more
            self.gap_loaded(point, c.max(0.0), pressure) + pressure * (-c).max(0.0)
        }
    }

    /// [`LayerLaw::duality_gap`] for a finite `c >= 0` and a finite `pressure > 0`.
    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        let (law, tangent) = (|c| self.pressure(point, c), |c| self.pressure_and_tangent(point, c).1);
        gap::by_quadrature((c, pressure, self.compression(point, pressure)), law, tangent)
    }
}

/// A law with a parameter that varies over the surface: one law a point.
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

    fn meet_loaded(&self, point: usize, s: f64, rho: f64) -> f64 {
        self.0[point].meet_loaded(0, s, rho)
    }

    fn compression_loaded(&self, point: usize, pressure: f64) -> f64 {
        self.0[point].compression_loaded(0, pressure)
    }

    fn gap_loaded(&self, point: usize, c: f64, pressure: f64) -> f64 {
        self.0[point].gap_loaded(0, c, pressure)
    }

    fn end(&self, point: usize) -> f64 {
        self.0[point].end(0)
    }
}
