//! The plots of runs: residuals over iterations, pressures along contacts, and forces over approaches.

use crate::contact::ContactPair;
use crate::ddm::Row;
use crate::error::Result;
use crate::expression::Field;
use crate::fem::length;
use crate::linalg::bounds;
use crate::output::{Color, Folder, Plot, PlotAxis, Series, StepReport, Style, UnitWords};
use crate::problem::{Plane, Units, label};
use crate::run::{Done, numbered, results};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// The plots of runs on the same pairs of surfaces.
#[derive(Default)]
pub struct Plots {
    /// Title of the first run.
    title: String,
    /// Label and iterations of each run.
    histories: Vec<(String, Vec<Row>)>,
    /// The pressures of all runs along each pair, and last the reference.
    pressures: BTreeMap<usize, Plot>,
}

impl Plots {
    /// Add a run. Pressures of the `shown` pairs are plotted only along curves: points of a surface over one coordinate would be a cloud.
    pub fn add(&mut self, label: &str, done: &Done, shown: &[usize]) {
        let pairs = &done.model().pairs;
        if self.histories.is_empty() {
            self.title.clone_from(&done.built.scene.title);
        }
        self.histories.push((label.to_owned(), history(done)));
        for &i in shown.iter().filter(|&&i| pairs.get(i).is_some_and(|pair| pair.along_curve)) {
            let Plot { series, .. } = self.pressures.entry(i).or_insert_with(|| pressure_plot(done, i));
            let pressure = &done.outcome.layer.pressure[done.model().range(i)];
            let curve = curve(label, &pairs[i], Style::Line, |q, _| pressure[q]);
            series.insert(series.iter().position(|curve| curve.style == Style::Dashed).unwrap_or(series.len()), curve);
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

    /// Return the plot of residual (solid) and increment (dashed) of the runs over the iteration, and of the error of a single one.
    pub fn convergence(&self) -> Plot {
        let runs = &self.histories;
        let is_one = runs.len() == 1;
        let has_increments = runs.iter().flat_map(|(_, rows)| rows).any(|row| row.increment > 0.0);
        let mut series = Vec::new();
        for (index, (label, rows)) in runs.iter().enumerate() {
            let curve = |label: &str, style, value: fn(&Row) -> f64| {
                let points = rows.iter().map(|row| (row.iteration as f64, value(row))).collect();
                Series::new(label, points, style).color(Color::Palette(index))
            };
            series.push(curve(if is_one { "residual" } else { label }, Style::Line, |row| row.residual));
            if has_increments {
                series.push(curve(if is_one { "increment" } else { "" }, Style::Dashed, |row| row.increment));
            }
            if is_one && rows.iter().any(|row| row.error > 0.0) {
                series.push(curve("error", Style::LineMarkers, |row| row.error).color(Color::Palette(1)));
            }
        }
        if !is_one && has_increments {
            for (label, style) in [("residual", Style::Line), ("increment", Style::Dashed)] {
                series.push(Series::new(label, Vec::new(), style).color(Color::Grey));
            }
        }
        Plot { title: self.title.clone(), x: PlotAxis::linear("iteration"), y: PlotAxis::log("relative size"), series }
    }

    /// Return the plots of pressures, in the order of [`Self::files`].
    pub fn pressures(&self) -> impl Iterator<Item = &Plot> {
        self.pressures.values()
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

/// Return the plot of the contact force of the `shown` pairs over their approach, if the run has several load steps. A single curve has no name.
pub fn approaches(done: &Done, shown: &[usize]) -> Option<Plot> {
    let (names, steps) = (results::pair_names(&done.built), &done.steps);
    let curve = |&i: &usize| {
        let of_step = |step: &StepReport| (step.pairs[i].approach.unwrap_or(f64::NAN), length(step.pairs[i].force));
        let name = if shown.len() == 1 { "" } else { &names[i] };
        Series::new(name, steps.iter().map(of_step).collect(), Style::LineMarkers)
    };
    let scene = &done.built.scene;
    let (unit, force) = units(scene).map(|units| (units.length, units.force)).unzip();
    (steps.len() > 1).then(|| Plot {
        title: scene.title.clone(),
        x: PlotAxis::linear(label("approach", unit.as_deref())),
        y: PlotAxis::linear(label("contact force", force.as_deref())),
        series: shown.iter().map(curve).collect(),
    })
}

/// Return the plot of pressures along pair `i` in the units of the scene, with the curve of its reference alone. Among several pairs each has the names of
/// its surfaces.
fn pressure_plot(done: &Done, i: usize) -> Plot {
    let (scene, pairs) = (&done.built.scene, &done.model().pairs);
    let title = match pairs.len() {
        1 => scene.title.clone(),
        _ => format!("{}: {}", scene.title, done.built.discrete.surfaces(i).join(" - ")),
    };
    let (unit, stress) = scene.units.as_ref().map(|units| (units.length.as_str(), units.stress.as_str())).unzip();
    let reference = done.built.discrete.specs[i].reference.as_ref();
    let curve = |field: &Field| curve("reference", &pairs[i], Style::Dashed, |_, x| field.eval(x)).color(Color::Grey);
    Plot {
        title,
        x: PlotAxis::linear(label(["x", "y", "z"][main_axis(&pairs[i])], unit)),
        y: PlotAxis::linear(label("contact pressure", stress)),
        series: reference.map(curve).into_iter().collect(),
    }
}

/// Return the values at the points of a pair, given by their number and place, against the coordinate that varies most.
fn curve(label: &str, pair: &ContactPair, style: Style, value: impl Fn(usize, [f64; 3]) -> f64) -> Series {
    let axis = main_axis(pair);
    let mut points: Vec<(f64, f64)> = pair.position.iter().enumerate().map(|(q, &x)| (x[axis], value(q, x))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    Series::new(label, points, style)
}

/// Return the coordinate along which a pair's points spread most.
fn main_axis(pair: &ContactPair) -> usize {
    let [low, high] = bounds(pair.position.iter().copied());
    let spread = |k: usize| high[k] - low[k];
    (0..3).max_by(|&i, &j| spread(i).total_cmp(&spread(j)).then(j.cmp(&i))).unwrap_or(0)
}
