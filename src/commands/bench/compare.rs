//! The error of a contact pressure, against the tables of another run or against the closed form of the scene.

use crate::commands::interpolate::{EXACT, PointTree, Squares, mean};
use crate::error::{Error, Kind, Result};
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
        let scattered = PointTree::new(&other.at);
        Some(own.at.iter().map(|x| mean(&scattered.plane(x, EXACT), &other.pressure)).collect())
    };
    relative(run, &run.iter().map(known).collect::<Option<Vec<_>>>()?)
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
}
