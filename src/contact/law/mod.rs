//! Laws of Winkler layers: pressure against compression.
//!
//! The paper writes sigma_n = g(w) with w = -c; here p(c) = -g(-c). A law is monotone with p(0) = 0 and a
//! bounded tangent on bounded ranges, conditions (6)-(7). A new law is a new file, a form in
//! [`layer`](crate::problem::layer) and a line in [`make`].

mod cubic;
mod exponential;
mod linear;
mod make;
mod power;
mod quadrature;
mod scaled;
mod table;
#[cfg(test)]
mod tests;
mod typed;

pub use cubic::Cubic;
pub use exponential::Exponential;
pub use linear::Linear;
pub use make::make;
pub use power::Power;
pub use scaled::Scaled;
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

    /// g'(-c) of (38): the tangent of the paper's law g, which also runs through tension as an odd function. For `c > 0` it is
    /// p'(c). Robin terms of open points use it; pressure never does.
    fn robin_tangent(&self, point: usize, c: f64) -> f64 {
        self.response(point, c.abs()).tangent
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
}
