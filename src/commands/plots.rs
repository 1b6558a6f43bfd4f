//! The plots of runs: residuals over iterations, pressures along contacts, and forces over load steps.

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

/// The iterations of a run.
struct History {
    label: String,
    rows: Vec<Row>,
    /// Whether the run ends by the increment alone.
    by_increment: bool,
    is_solved: bool,
}

/// The plots of runs on the same pairs of surfaces.
#[derive(Default)]
pub struct Plots {
    /// Title of the first run.
    title: String,
    /// The iterations of each run.
    histories: Vec<History>,
    /// The pressures of all runs along each pair, and last the reference.
    pressures: BTreeMap<usize, Plot>,
}

impl Plots {
    /// Add a run. Pressures of the `shown` pairs are plotted only along curves: points of a surface over one coordinate
    /// would be a cloud.
    pub fn add(&mut self, label: &str, done: &Done, shown: &[usize]) {
        let pairs = &done.model().pairs;
        if self.histories.is_empty() {
            self.title.clone_from(&done.built.scene.title);
        }
        let stop = &done.built.scene.method.stop;
        self.histories.push(History {
            label: label.to_owned(),
            rows: history(done),
            by_increment: stop.increment.is_some() && stop.residual.is_none(),
            is_solved: done.outcome.status.is_solved(),
        });
        for &i in shown.iter().filter(|&&i| pairs.get(i).is_some_and(|pair| pair.measure.is_along_curve())) {
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

    /// Return the plot of the iterations of one run, or of several.
    pub fn convergence(&self) -> Plot {
        let (name, series) = match &self.histories[..] {
            [run] => ("relative size", of_one(run)),
            runs if runs.iter().all(|run| run.by_increment) => {
                ("relative increment", of_several(runs, |row| row.increment))
            }
            runs => ("relative residual", of_several(runs, |row| row.residual)),
        };
        Plot { title: self.title.clone(), x: PlotAxis::linear("iteration"), y: PlotAxis::log(name), series }
    }

    /// Return the plots of pressures, in the order of [`Self::files`].
    pub fn pressures(&self) -> impl Iterator<Item = &Plot> {
        self.pressures.values()
    }
}

/// Return the curves of residual (solid), increment (dashed) and error of a run.
fn of_one(run: &History) -> Vec<Series> {
    let curve = |label: &str, style, color, value: fn(&Row) -> f64| {
        let points: Vec<_> = run.rows.iter().map(|row| (row.iteration as f64, value(row))).collect();
        let has_points = label == "residual" || points.iter().any(|point| point.1 > 0.0);
        has_points.then(|| Series::new(label, points, style).color(Color::Palette(color)))
    };
    let all = [
        curve("residual", Style::Line, 0, |row| row.residual),
        curve("increment", Style::Dashed, 0, |row| row.increment),
        curve("error", Style::LineMarkers, 1, |row| row.error),
    ];
    all.into_iter().flatten().collect()
}

/// Return a curve of each run. Runs that are not solved do not stretch the axes: they are cut where those of solved
/// runs end.
fn of_several(runs: &[History], value: fn(&Row) -> f64) -> Vec<Series> {
    let solved = || runs.iter().filter(|run| run.is_solved).flat_map(|run| &run.rows);
    let last = solved().map(|row| row.iteration).max().unwrap_or(usize::MAX);
    let largest = solved().map(value).reduce(f64::max).unwrap_or(f64::INFINITY);
    let curve = |(index, run): (usize, &History)| {
        let shown = run.rows.iter().filter(|row| row.iteration <= last);
        let points = shown.map(|row| (row.iteration as f64, value(row))).filter(|point| point.1 <= largest).collect();
        Series::new(&run.label[..], points, Style::Numbered(index + 1)).color(Color::Palette(index))
    };
    runs.iter().enumerate().map(curve).collect()
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

/// Return the plots of the contact forces of the `shown` pairs, over their approach and over the time, with the names
/// of their files, if the run has several load steps. A single curve has no name.
pub fn of_steps(done: &Done, shown: &[usize]) -> Vec<(&'static str, Plot)> {
    let (scene, names) = (&done.built.scene, results::pair_names(&done.built));
    let (unit, force) = units(scene).map(|units| (units.length, units.force)).unzip();
    let plot = |axis: String, place: fn(&StepReport, usize) -> f64| {
        let curve = |&i: &usize| {
            let of_step = |step: &StepReport| (place(step, i), length(step.pairs[i].force[0]));
            let name = if shown.len() == 1 { "" } else { &names[i] };
            Series::new(name, done.steps.iter().map(of_step).collect(), Style::LineMarkers)
        };
        Plot {
            title: scene.title.clone(),
            x: PlotAxis::linear(axis),
            y: PlotAxis::linear(label("contact force", force.as_deref())),
            series: shown.iter().map(curve).collect(),
        }
    };
    if done.steps.len() < 2 {
        return Vec::new();
    }
    let approach = |step: &StepReport, i: usize| step.pairs[i].approach.unwrap_or(f64::NAN);
    let [over_approach, over_time] = OF_STEPS;
    vec![
        (over_approach, plot(label("approach", unit.as_deref()), approach)),
        (over_time, plot("time".to_owned(), |step, _| step.time)),
    ]
}

/// The files of the plots over load steps.
pub const OF_STEPS: [&str; 2] = ["force-approach.svg", "force-time.svg"];

/// Return the plot of pressures along pair `i` in the units of the scene, with the curve of its reference alone. Among
/// several pairs each has the names of its surfaces.
fn pressure_plot(done: &Done, i: usize) -> Plot {
    let (scene, pairs) = (&done.built.scene, &done.model().pairs);
    let title = match pairs.len() {
        1 => scene.title.clone(),
        _ => format!("{}: {}", scene.title, done.built.discrete.surfaces(i).join(" - ")),
    };
    let (unit, stress) = scene.units.as_ref().map(|units| (units.length.as_str(), units.stress.as_str())).unzip();
    let spec = &done.built.discrete.specs[i];
    let pressure = if spec.slip.is_some() { "traction" } else { "contact pressure" };
    let reference = spec.reference.as_ref();
    let curve = |field: &Field| curve("reference", &pairs[i], Style::Dashed, |_, x| field.eval(x)).color(Color::Grey);
    Plot {
        title,
        x: PlotAxis::linear(label(["x", "y", "z"][main_axis(&pairs[i])], unit)),
        y: PlotAxis::linear(label(pressure, stress)),
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
