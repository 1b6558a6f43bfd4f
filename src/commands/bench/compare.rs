//! The error of a contact pressure, against the tables of another run or against the closed form of the scene.

use crate::error::{Error, Kind, Result};
use crate::estimate::interpolate::{EXACT, PointTree, Squares, mean};
use crate::linalg::{bounds, length, minus};
use crate::scene::Scene;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The contact points of one pair, in the order of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct PairPoints {
    /// Name of the file, without its folder.
    name: String,
    /// Positions, n.
    at: Vec<[f64; 3]>,
    /// Areas (lengths in the plane), n.
    weight: Vec<f64>,
    pressure: Vec<f64>,
}

/// The columns that are read of a row of the file.
#[derive(Deserialize)]
struct PressureRow {
    x: f64,
    y: f64,
    z: f64,
    weight: f64,
    pressure: f64,
}

/// Read the contact tables in a folder of results, in the order of their names.
pub(super) fn tables(folder: &Path) -> Result<Vec<PairPoints>> {
    let entries = std::fs::read_dir(folder).map_err(|cause| Error::file(folder, "read", &cause))?;
    let is_table = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("contact-") && name.ends_with(".csv")
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_table).collect();
    paths.sort();
    paths.iter().map(|path| PairPoints::read(path)).collect()
}

impl PairPoints {
    fn read(path: &Path) -> Result<Self> {
        let refuse = |why: String| Error::new(Kind::File, format!("{} is no contact table: {why}", path.display()));
        let bytes = crate::file::read(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut points = Self { name, ..Self::default() };
        for point in csv::Reader::from_reader(&bytes[..]).deserialize() {
            let PressureRow { x, y, z, weight, pressure } = point.map_err(|cause| refuse(cause.to_string()))?;
            points.at.push([x, y, z]);
            points.weight.push(weight);
            points.pressure.push(pressure);
        }
        Ok(points)
    }
}

/// Return the relative error in L2 of the pressures of a run against those of another run, over all pairs; `None` where
/// they cannot be compared.
pub(super) fn difference(run: &[PairPoints], reference: &[PairPoints]) -> Option<f64> {
    if run.is_empty() || run.len() != reference.len() {
        return None;
    }
    let known = |own: &PairPoints| -> Option<Vec<f64>> {
        // tables of the same pair, or the only two
        let other = reference.iter().find(|other| other.name == own.name || reference.len() == 1)?;
        let known = Known::of(other);
        Some(own.at.iter().map(|&x| known.at(x)).collect())
    };
    relative(run, &run.iter().map(known).collect::<Option<Vec<_>>>()?)
}

/// The pressures of a reference, known between its points on both sides of the end of contact.
///
/// Pressures of closed points continue a smooth function, those of open points are zero, and there is a kink between
/// them. Near the end of contact the pressure is that of the closed points alone, or zero beyond its zero.
struct Known {
    /// Whether each coordinate varies on the reference. A plane reference has none along the thickness of a slice of
    /// space, where all its points would be about as near.
    varies: [bool; 3],
    all: PointTree,
    is_open: Vec<bool>,
    closed: PointTree,
    /// Pressures of the closed points.
    pressures: Vec<f64>,
}

impl Known {
    fn of(reference: &PairPoints) -> Self {
        let [low, high] = bounds(reference.at.iter().copied());
        let extent = minus(high, low);
        let varies = extent.map(|size| size > FLAT * length(extent));
        let at: Vec<[f64; 3]> = reference.at.iter().map(|&x| along(varies, x)).collect();
        let is_open: Vec<bool> = reference.pressure.iter().map(|pressure| *pressure == 0.0).collect();
        let closed: Vec<usize> = (0..at.len()).filter(|&q| !is_open[q]).collect();
        Self {
            varies,
            closed: PointTree::new(&closed.iter().map(|&q| at[q]).collect::<Vec<_>>()),
            pressures: closed.iter().map(|&q| reference.pressure[q]).collect(),
            all: PointTree::new(&at),
            is_open,
        }
    }

    fn at(&self, x: [f64; 3]) -> f64 {
        let x = along(self.varies, x);
        let nearest = self.all.plane(&x, EXACT);
        let open = nearest.iter().filter(|(q, _)| self.is_open[*q]).count();
        if open == nearest.len() {
            return 0.0;
        }
        let pressure = mean(&self.closed.plane(&x, EXACT), &self.pressures);
        // a bond, which also pulls, has no open points
        if open == 0 { pressure } else { pressure.max(0.0) }
    }
}

/// Extent of a reference along an axis, relative to its size, up to which it does not vary there. Tables have 16
/// digits, and a surface in a plane is drawn to 1e-12 of its size; steps between points are above 1e-4.
const FLAT: f64 = 1e-9;

/// Return a point without the coordinates that do not vary.
fn along(varies: [bool; 3], x: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| if varies[c] { x[c] } else { 0.0 })
}

/// Return the relative error in L2 of the pressures of a run against the `reference` of its contact; `None` without
/// one, or with several pairs.
pub(super) fn closed_form(scene: &Scene, run: &[PairPoints]) -> Option<f64> {
    // with several pairs it is not known which table belongs to which contact
    let (&[contact], [own]) = (&scene.pairs().collect::<Vec<_>>()[..], run) else { return None };
    let field = contact.reference.as_ref()?;
    let known: Vec<f64> = own.at.iter().map(|&x| field.eval(x)).collect();
    relative(run, &[known])
}

/// Return the relative error of a run against the known pressures at its points, n for each pair; `None` if it is not
/// finite.
fn relative(run: &[PairPoints], known: &[Vec<f64>]) -> Option<f64> {
    let mut squares = Squares::default();
    for (run, known) in run.iter().zip(known) {
        (0..known.len()).for_each(|q| squares.add(run.weight[q], known[q], run.pressure[q]));
    }
    let norms = squares.norms();
    Some(norms.difference / norms.old).filter(|relative| relative.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(at: Vec<[f64; 3]>, p: impl Fn(&[f64; 3]) -> f64) -> PairPoints {
        PairPoints { name: String::new(), weight: vec![1.0; at.len()], pressure: at.iter().map(p).collect(), at }
    }

    #[test]
    fn a_linear_pressure_is_met_on_a_curve_and_on_a_surface() {
        let p = |x: &[f64; 3]| 3.0 + 2.0 * x[0] - 0.5 * x[1];
        let curve = points((0..9).map(|k| [f64::from(k), 0.0, 0.0]).collect(), p);
        let between = points(vec![[0.5, 0.0, 0.0], [3.25, 0.0, 0.0]], p);
        let grid = points((0..36).map(|k| [f64::from(k % 6), f64::from(k / 6), 2.0]).collect(), p);
        let own = points(vec![[2.3, 1.7, 2.0], [3.0, 3.0, 2.0], [0.1, 4.9, 2.0]], p);
        for (run, reference) in [(between, curve), (own, grid)] {
            let error = |run: PairPoints| difference(&[run], std::slice::from_ref(&reference)).expect("an error");
            let off = points(run.at.clone(), |x| 1.01 * p(x));
            assert!(error(run) < 1e-9 && (error(off) - 0.01).abs() < 1e-9);
        }
    }

    /// The pressure of a linear layer ends with a kink between two points of the reference, on a curve, which is also
    /// that of a slice of space, and on a surface.
    #[test]
    fn the_end_of_contact_is_met() {
        let p = |x: &[f64; 3]| (2.03 - x[0]).max(0.0);
        let curve = points((0..41).map(|k| [0.1 * f64::from(k), 1.0, 0.0]).collect(), p);
        let grid = points((0..1681).map(|k| [0.1 * f64::from(k % 41), 0.1 * f64::from(k / 41), 2.0]).collect(), p);
        let run = |y: f64, z: f64| points((0..80).map(|k| [0.047 * f64::from(k), y, z]).collect(), p);
        for (run, reference) in [(run(1.0, 0.0), &curve), (run(1.0, 0.5), &curve), (run(1.33, 2.0), &grid)] {
            let error = difference(&[run], std::slice::from_ref(reference)).expect("an error");
            assert!(error < 1e-9, "{error}");
        }
    }
}
