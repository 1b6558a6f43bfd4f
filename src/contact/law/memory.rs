//! Layers that remember, such as gaskets and rough faces: what was compressed once is unloaded along another curve.
//!
//! Let m be the largest compression of a point so far and p_m the pressure of the law there. Up to m the pressure is
//!
//! ```text
//! p(c) = max(0, p_m - q(m - c)),      q the law of unloading,
//! ```
//!
//! and beyond m it is that of the law. It increases, so that each load step is a convex problem like any other. The
//! pressure ends at c = m - x with q(x) = p_m, which is how far the layer stays compressed without pressure. That is
//! 0 or more if q(m) >= p_m; softer unloading is refused.

use super::forms::Power;
use super::{Law, LayerLaw, PerPoint, extended, extended_energy};
use crate::error::{Error, Kind, Result};
use std::rc::Rc;

/// How the pressure falls from the largest compression so far.
#[derive(Debug, Clone)]
pub enum Unloading {
    /// Along this law, of the way back and of how far the pressure has fallen.
    Law(Rc<dyn LayerLaw>),
    /// Along straight lines. The slope depends on the largest pressure so far: points (pressure, slope), by increasing
    /// pressures, between which it is linear.
    Slopes(Vec<[f64; 2]>),
}

impl Unloading {
    /// Return the slope at a largest pressure. It is constant before the first point and after the last one.
    fn slope(points: &[[f64; 2]], pressure: f64) -> f64 {
        match points.iter().position(|[p, _]| *p >= pressure) {
            Some(0) => points[0][1],
            Some(next) => {
                let ([p0, k0], [p1, k1]) = (points[next - 1], points[next]);
                k0 + (pressure - p0) / (p1 - p0) * (k1 - k0)
            }
            None => points.last().map_or(0.0, |last| last[1]),
        }
    }

    /// Return the law of unloading of each point for its largest pressure so far.
    fn at(&self, pressures: &[f64]) -> Law {
        match self {
            Self::Law(law) => law.clone().into(),
            Self::Slopes(points) => {
                let line = |&pressure: &f64| Power::linear(Self::slope(points, pressure));
                Law::new(PerPoint(pressures.iter().map(line).collect()))
            }
        }
    }
}

/// Share of a pressure by which a law of unloading may be softer that is as stiff as the layer: a slope p/c that a
/// table has with ten digits is off by 5e-11 of it.
const SAME: f64 = 1e-9;

/// A law with the largest compressions that its points have seen.
#[derive(Debug)]
pub struct Memory {
    loading: Rc<dyn LayerLaw>,
    unloading: Law,
    /// What each point remembers; `None` if it was never compressed.
    points: Vec<Option<PointMemory>>,
}

/// What a point remembers.
#[derive(Debug, Clone, Copy)]
struct PointMemory {
    /// m, the largest compression so far.
    largest: f64,
    /// p_m.
    pressure: f64,
    /// x with q(x) = p_m.
    fall: f64,
}

impl Memory {
    /// Return the law after its points have had compressions up to `largest`.
    ///
    /// # Errors
    /// Unloading is so soft that there would be pressure left where the layer opens.
    pub fn new(loading: Rc<dyn LayerLaw>, unloading: &Unloading, largest: &[f64]) -> Result<Self> {
        let pressure = |(point, &m): (usize, &f64)| if m > 0.0 { extended(&*loading, point, m).0 } else { 0.0 };
        let pressures: Vec<f64> = largest.iter().enumerate().map(pressure).collect();
        let unloading = unloading.at(&pressures);
        let memory = |(point, (&largest, &pressure)): (usize, (&f64, &f64))| {
            if largest <= 0.0 {
                return Ok(None);
            }
            let fallen = unloading.pressure(point, largest);
            if fallen < pressure * (1.0 - SAME) {
                return Err(too_soft(largest, pressure, fallen));
            }
            let fall = unloading.compression(point, pressure).min(largest);
            Ok(Some(PointMemory { largest, pressure, fall }))
        };
        let points = largest.iter().zip(&pressures).enumerate().map(memory).collect::<Result<_>>()?;
        Ok(Self { loading, unloading, points })
    }

    /// Return the energy of a layer that was unloaded by `back` from its largest compression.
    fn unloaded_energy(&self, point: usize, memory: PointMemory, back: f64) -> f64 {
        let PointMemory { pressure, fall, .. } = memory;
        let fallen = |x: f64| self.unloading.energy(point, x);
        if back < fall { pressure * (fall - back) - (fallen(fall) - fallen(back)) } else { 0.0 }
    }
}

/// Return the error of unloading that takes away less than all of a pressure.
fn too_soft(largest: f64, pressure: f64, fallen: f64) -> Error {
    let [largest, pressure, fallen] = [largest, pressure, fallen].map(|value| format!("{value:.3e}"));
    let message = format!(
        "`unload` is softer than the layer: on the way back from c = {largest} the pressure falls by {fallen} of {pressure}"
    );
    Error::new(Kind::Scene, message)
        .because("a layer cannot press where it is open")
        .help("unload by a law that takes away the whole pressure within the compression, such as a stiffer one")
}

impl LayerLaw for Memory {
    fn pressure_and_tangent(&self, point: usize, c: f64) -> (f64, f64) {
        let Some(PointMemory { largest, pressure, fall }) = self.points[point].filter(|memory| c < memory.largest)
        else {
            return extended(&*self.loading, point, c);
        };
        if largest - c >= fall {
            return (0.0, 0.0);
        }
        let (fallen, tangent) = self.unloading.pressure_and_tangent(point, largest - c);
        (pressure - fallen, tangent)
    }

    fn energy(&self, point: usize, c: f64) -> f64 {
        let loaded = |c: f64| extended_energy(&*self.loading, point, c);
        let Some(memory) = self.points[point] else { return loaded(c) };
        let largest = memory.largest;
        let unloaded = self.unloaded_energy(point, memory, (largest - c).max(0.0));
        unloaded + if c > largest { loaded(c) - loaded(largest) } else { 0.0 }
    }

    fn given(&self, point: usize) -> f64 {
        self.loading.given(point)
    }

    fn rest(&self, point: usize) -> f64 {
        self.points[point].map_or(0.0, |memory| memory.largest - memory.fall)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::law::numeric::integral;

    /// A law p = (c/1e-4)^2 that was compressed to 2e-4 at the first point, and never at the second.
    fn crushed(unloading: Unloading) -> Result<Law> {
        let loading: Rc<dyn LayerLaw> = Rc::new(Power::new(1e-4, 0.5));
        let mut law = Law { unloading: Some(unloading), ..Law::from(loading) };
        law.remember(&[2e-4, -1.0])?;
        Ok(law)
    }

    #[test]
    fn energy_and_inverse_belong_to_the_pressure() {
        let linear = || Rc::new(Power::linear(1e5)) as Rc<dyn LayerLaw>;
        for unloading in [Unloading::Law(linear()), Unloading::Slopes(vec![[3.0, 5e4], [5.0, 1.5e5]])] {
            let law = crushed(unloading).expect("a stiff law");
            // p_m = 4 falls along the slope 1e5, so that 4e-5 of the compression are elastic
            assert!((law.rest(0) - 1.6e-4).abs() < 1e-18 && law.rest(1) == 0.0);
            assert!((law.pressure(0, 1.8e-4) - 2.0).abs() < 1e-12 && law.pressure(0, 1.5e-4) == 0.0);
            assert_eq!((law.pressure(0, 2e-4), law.pressure(0, 3e-4)), (law.pressure(1, 2e-4), law.pressure(1, 3e-4)));
            for c in [1e-4, 1.7e-4, 2e-4, 2.5e-4] {
                let pressure = law.pressure(0, c);
                let sum = integral(&|c| law.pressure(0, c), law.rest(0).min(c), c.min(2e-4));
                let sum = sum + integral(&|c| law.pressure(0, c), 2e-4, c.max(2e-4));
                assert!((law.energy(0, c) - sum).abs() < 1e-12 * law.energy(0, 2.5e-4), "{c}");
                assert!(pressure == 0.0 || (law.compression(0, pressure) / c - 1.0).abs() < 1e-12, "{c}");
                // on the graph, also where the layer stays compressed without pressure
                assert!(law.duality_gap(0, c, pressure) < 1e-20, "{c}");
                let (rho, state) = (3e4, law.resolvent(0, c + pressure / 3e4, 3e4));
                assert!((state + law.pressure(0, state) / rho - c - pressure / rho).abs() < 1e-15, "{c}");
            }
        }
    }

    #[test]
    fn soft_unloading_is_refused() {
        let error = crushed(Unloading::Law(Rc::new(Power::linear(1e4)))).expect_err("2 of 4");
        assert!(error.to_string().contains("softer"), "{error}");
    }
}
