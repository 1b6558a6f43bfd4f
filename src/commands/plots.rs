//! The plots of runs: residuals over iterations, pressures along contacts, and forces over approaches.

use crate::contact::ContactPair;
use crate::ddm::Row;
use crate::error::Result;
use crate::fem::length;
use crate::linalg::bounds;
use crate::output::{Color, ConvergenceSeries, Folder, Plot, Series, StepReport, Style, UnitWords};
use crate::problem::{Plane, Units, force_labels, label};
use crate::run::{Done, numbered, results};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// The plots of runs on the same pairs of surfaces.
#[derive(Default)]
pub struct Plots {
    /// Title of the first run.
    title: String,
    /// Residual, increment and error of each run.
    histories: Vec<ConvergenceSeries>,
    /// The pressures of all runs along each pair.
    pressures: BTreeMap<usize, Plot>,
}

impl Plots {
    /// Add a run. Pressures of the `shown` pairs are plotted only along curves: points of a surface over one coordinate would be a cloud.
    pub fn add(&mut self, label: &str, done: &Done, shown: &[usize]) {
        let pairs = &done.model().pairs;
        if self.histories.is_empty() {
            self.title.clone_from(&done.built.scene.title);
        }
        self.histories.push(ConvergenceSeries { label: label.to_owned(), rows: history(done) });
        for &i in shown.iter().filter(|&&i| pairs.get(i).is_some_and(|pair| pair.along_curve)) {
            let plot = self.pressures.entry(i).or_insert_with(|| pressure_plot(done, i));
            plot.series.push(pressure_curve(label, done, i));
            if plot.series.iter().all(|curve| curve.style != Style::Dashed) {
                plot.series.extend(reference_curve(done, i));
            }
        }
    }

    /// Return the names of the plots of pressures, each with the number of its pair.
    pub fn files(&self) -> impl Iterator<Item = (usize, String)> {
        let names = numbered(self.pressures.iter().map(|_| "pressure".to_owned()));
        self.pressures.keys().copied().zip(names.into_iter().map(|name| format!("{name}.svg")))
    }

    /// Write all plots.
    pub fn write(&self, folder: &Folder) -> Result<()> {
        folder.write("convergence.svg", |out| self.convergence().write(out))?;
        self.files().zip(self.pressures()).try_for_each(|((_, file), plot)| folder.write(&file, |out| plot.write(out)))
    }

    /// Return the plot of residuals over iterations.
    pub fn convergence(&self) -> Plot {
        Plot::convergence(&self.title, &self.histories)
    }

    /// Return the plots of pressures, in the order of [`Self::files`].
    pub fn pressures(&self) -> impl Iterator<Item = Plot> {
        let sorted = |Plot { title, x, y, series }: &Plot| Plot::pressure(title, &x.label, &y.label, series.clone());
        self.pressures.values().map(sorted)
    }
}

/// Return the iterations of a run, those of several load steps numbered through.
fn history(done: &Done) -> Vec<Row> {
    let mut rows: Vec<Row> = done.earlier.iter().chain(&done.outcome.rows).cloned().collect();
    if done.steps.len() > 1 {
        rows.iter_mut().enumerate().for_each(|(k, row)| row.iteration = k);
    }
    rows
}

/// Return the units of a scene, with a force by length of thickness for bodies in the plane.
pub fn units(scene: &Scene) -> Option<Units> {
    let is_whole = scene.dimension.value == 3 || scene.plane == Plane::Axisymmetric;
    scene.units.clone().map(|units| if is_whole { units } else { units.per_thickness() })
}

/// Return the units of a scene as they stand behind the numbers of the closing lines.
pub fn unit_words(scene: &Scene) -> UnitWords {
    let has_thickness = scene.dimension.value == 2 && scene.plane != Plane::Axisymmetric;
    let without = UnitWords { is_plane: scene.dimension.value == 2, ..UnitWords::default() };
    units(scene).map_or(without.clone(), |units| UnitWords {
        length: format!(" {}", units.length),
        extent: format!(" {}{}", units.length, if has_thickness { "" } else { "²" }),
        stress: format!(" {}", units.stress),
        force: format!(" {}", units.force),
        ..without
    })
}

/// Return the plot of the contact force of the `shown` pairs over their approach, if the run has several load steps.
pub fn approaches(done: &Done, shown: &[usize]) -> Option<Plot> {
    let names = results::pair_names(&done.built);
    let curves = shown.iter().map(|&i| (names[i].as_str(), approach(&done.steps, i)));
    let scene = &done.built.scene;
    (done.steps.len() > 1).then(|| Plot::approach(&scene.title, force_labels(units(scene).as_ref()), curves))
}

/// Return the approach and the force of pair `i` in each step.
fn approach(steps: &[StepReport], i: usize) -> Vec<(f64, f64)> {
    let of_step = |step: &StepReport| {
        let pair = &step.pairs[i];
        (pair.approach.unwrap_or(f64::NAN), length(pair.force))
    };
    steps.iter().map(of_step).collect()
}

/// Return the plot of pressures along pair `i` without its curves, in the units of the scene. Among several pairs each has the names of its surfaces.
fn pressure_plot(done: &Done, i: usize) -> Plot {
    let (scene, pairs) = (&done.built.scene, &done.model().pairs);
    let title = match pairs.len() {
        1 => scene.title.clone(),
        _ => format!("{}: {}", scene.title, done.built.discrete.surfaces(i).join(" - ")),
    };
    let units = scene.units.as_ref();
    let along = label(["x", "y", "z"][main_axis(&pairs[i])], units.as_ref().map(|units| units.length.as_str()));
    Plot::pressure(
        &title,
        &along,
        &label("contact pressure", units.as_ref().map(|units| units.stress.as_str())),
        Vec::new(),
    )
}

/// Return the pressure of pair `i` along its surface, against the coordinate that varies most.
fn pressure_curve(label: &str, done: &Done, i: usize) -> Series {
    let (model, pair) = (done.model(), &done.model().pairs[i]);
    let axis = main_axis(pair);
    let pressure = &done.outcome.layer.pressure[model.range(i)];
    Series::new(label, pair.position.iter().zip(pressure).map(|(x, &p)| (x[axis], p)).collect(), Style::Line)
}

/// Return the scene's reference pressure of pair `i`, if it has one.
fn reference_curve(done: &Done, i: usize) -> Option<Series> {
    let field = done.built.discrete.specs[i].reference.as_ref()?;
    let pair = &done.model().pairs[i];
    let axis = main_axis(pair);
    let points = pair.position.iter().map(|&x| (x[axis], field.eval(x))).collect();
    Some(Series::new("reference", points, Style::Dashed).color(Color::Grey))
}

/// Return the coordinate along which a pair's points spread most.
fn main_axis(pair: &ContactPair) -> usize {
    let [low, high] = bounds(pair.position.iter().copied());
    let spread = |k: usize| high[k] - low[k];
    (0..3).max_by(|&i, &j| spread(i).total_cmp(&spread(j)).then(j.cmp(&i))).unwrap_or(0)
}
