//! The law that a scene asks for, at the points of a pair.

use super::expression::{Breach, ExpressionLaw, increases};
use super::forms;
use super::memory::Unloading;
use super::table::Table;
use super::{Law, LayerLaw, PerPoint};
use crate::error::{Error, Kind, Result};
use crate::linalg::diagonal;
use crate::problem::layer::{LayerSpec, UnloadSpec};
use crate::problem::{ContactSpec, Own};
use std::rc::Rc;

/// Make the law of a pair at the contact points `position`, in compression and, where it is bonded, in tension. `laws`
/// are those that the program brings, by name.
///
/// # Errors
/// See [`make`].
pub fn of_pair(spec: &ContactSpec, laws: &OwnLaws, position: &[[f64; 3]]) -> Result<Law> {
    let compression = make(&spec.layer, laws, position)?;
    let tension = match &spec.tension {
        _ if !spec.bond => None,
        None => Some(compression.clone()),
        Some(tension) => Some(make(tension, laws, position)?),
    };
    let unloading = spec.unload.as_ref().map(|unload| unloading(unload, laws, position)).transpose()?;
    Ok(Law { compression, tension, unloading })
}

/// Return how a layer is unloaded.
///
/// # Errors
/// See [`make`].
fn unloading(spec: &UnloadSpec, laws: &OwnLaws, position: &[[f64; 3]]) -> Result<Unloading> {
    Ok(match spec {
        UnloadSpec::Law(law) => Unloading::Law(make(law, laws, position)?),
        UnloadSpec::Slopes(rows) => {
            Unloading::Slopes(rows.iter().map(|[_, pressure, slope]| [*pressure, *slope]).collect())
        }
    })
}

/// Make the law of a layer at the contact points `position`. `laws` are the laws that the program brings, by name.
///
/// A law whose parameters are constant is one object for all points.
///
/// # Errors
/// Parameters out of their range at a point, and expressions or the program's own laws that are not the law of a layer.
pub fn make(spec: &LayerSpec, laws: &OwnLaws, position: &[[f64; 3]]) -> Result<Rc<dyn LayerLaw>> {
    match spec {
        LayerSpec::Own(name) => own(laws, name, position, extent(position)),
        LayerSpec::Table(points) => Ok(Rc::new(Table::new(points))),
        LayerSpec::Pressure { law, up_to } => {
            let size = extent(position);
            let at = |&x: &[f64; 3]| ExpressionLaw::new(law, x, *up_to, size);
            if law.uses_only_first() {
                Ok(Rc::new(at(&position[0])?))
            } else {
                Ok(Rc::new(PerPoint(position.iter().map(at).collect::<Result<_>>()?)))
            }
        }
        form => forms::make(form, position),
    }
}

/// Return the diagonal of the box around all points. No layer is compressed by more.
fn extent(position: &[[f64; 3]]) -> f64 {
    let size = diagonal(position);
    if size > 0.0 { size } else { 1.0 }
}

/// A function from the contact points of a pair to its law.
pub type LawMaker<'a> = dyn Fn(&[[f64; 3]]) -> Result<Law> + 'a;

/// The laws of a Rust program by name. Each entry makes the law of a pair from its contact points.
pub type OwnLaws = Own<dyn Fn(&[[f64; 3]]) -> Box<dyn LayerLaw>>;

/// Return the law of this name for the contact points `position`. Its pressure, and the energy as its integral, are
/// checked at the first point for compressions up to `size`, the extent of the surfaces.
///
/// # Errors
/// An unknown name, and a function that is not the law of a layer.
fn own(laws: &OwnLaws, name: &str, position: &[[f64; 3]], size: f64) -> Result<Rc<dyn LayerLaw>> {
    let law = Law::from(Rc::<dyn LayerLaw>::from(laws.get("law of a layer", name)?(position)));
    let refuse = |what: String| Error::new(Kind::Scene, format!("`{name}` is no law of a layer: {what}"));
    let last = match increases(0.0, size, |c| law.pressure_and_tangent(0, c)) {
        // a law may end at a rigid stop, beyond which its values are not finite
        Err(Breach { last, is_finite: false, .. }) if last > 0.0 => last,
        Err(Breach { what, .. }) => return Err(refuse(what)),
        Ok(last) => last,
    };
    match wrong_energy(&law, last) {
        Some(c) => Err(refuse(format!("the energy is not the integral of p at c = {c:.3e}"))),
        None => Ok(law.compression),
    }
}

/// Number of compressions in a factor of ten between which an energy is compared with pressures: neighbours differ by
/// 2.3 %, and so the bounds of the energy differ by that times the exponent of the law.
const FINE_STEPS: i32 = 100;

/// Number of factors of ten below the largest compression in which they are compared. A formula such as p0 (c0
/// (exp(c/c0) - 1) - c) loses all digits at smaller ones, without harm: the energy counts relative to that of the
/// solution.
const ENERGY_DECADES: i32 = 4;

/// Rounding of an energy that a program sums over many pieces, relative to it.
const SUMMED: f64 = 1e-9;

/// Return the first compression up to `last` at which the energy P cannot be the integral of the pressure: p increases,
/// so that between neighbouring compressions P grows by their distance times a pressure between both of theirs.
fn wrong_energy(law: &Law, last: f64) -> Option<f64> {
    let at = |step: i32| {
        let c = last * 10f64.powf(f64::from(step) / f64::from(FINE_STEPS) - f64::from(ENERGY_DECADES));
        [c, law.pressure(0, c), law.energy(0, c)]
    };
    let mut before = [0.0; 3];
    for step in 0..=ENERGY_DECADES * FINE_STEPS {
        let now @ [c, pressure, energy] = at(step);
        let (grown, distance, slack) = (energy - before[2], c - before[0], SUMMED * energy.abs());
        let fits = grown >= distance * before[1] - slack && grown <= distance * pressure + slack;
        if !fits {
            return Some(c);
        }
        before = now;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_is_a_diagonal() {
        assert_eq!(extent(&[[1.0, -2.0, 5.0], [2.0, 2.0, 5.0], [-2.0, 1.0, 5.0]]), 32f64.sqrt());
        assert_eq!(extent(&[[1.0; 3]]), 1.0);
    }

    /// The law p = c^2, which ends, or decreases from some compression on.
    #[derive(Debug, Default)]
    struct Square {
        cubic: f64,
        end: f64,
        /// Factor of the energy, which must be one.
        energy: f64,
    }

    impl LayerLaw for Square {
        fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
            let pressure = if self.end > 0.0 && c > self.end { f64::INFINITY } else { c * c * (1.0 - self.cubic * c) };
            (pressure, 2.0 * c - 3.0 * self.cubic * c * c)
        }

        fn energy(&self, _point: usize, c: f64) -> f64 {
            self.energy * (c.powi(3) / 3.0 - self.cubic * c.powi(4) / 4.0)
        }
    }

    #[test]
    fn laws_of_a_program_are_checked() {
        let made = |cubic: f64, end: f64, energy: f64| {
            let mut laws = OwnLaws::default();
            laws.insert("film", Rc::new(move |_| Box::new(Square { cubic, end, energy })));
            own(&laws, "film", &[[0.0; 3]], 1.0)
        };
        assert!(made(0.0, 0.0, 1.0).is_ok() && made(0.0, 1e-2, 1.0).is_ok());
        for (cubic, end, energy, words) in [
            (2.0, 0.0, 1.0, "p does not increase at c = 3"),
            (0.0, 1e-20, 1.0, "p is inf"),
            (0.0, 0.0, 1.5, "the energy is not the integral"),
            (0.0, 0.0, 0.9, "the energy is not the integral"),
            (0.0, 0.0, -1.0, "the energy is not the integral"),
        ] {
            let error = made(cubic, end, energy).expect_err(words);
            assert!(error.to_string().contains(words), "{error}");
        }
        let error = own(&OwnLaws::default(), "flim", &[[0.0; 3]], 1.0).expect_err("a slip");
        assert!(error.to_string().contains("flim"), "{error}");
    }
}
