//! Curves of a run, for plots.

use crate::contact::ContactPair;
use crate::ddm::Outcome;
use crate::discretize::Discrete;
use crate::linalg::bounds;
use crate::output::{Color, ConvergenceSeries, Plot, Series, Style};
use crate::problem::units::label;
use crate::run::stages::Done;
use crate::scene::Scene;

/// Residual and increment of a run against the iteration.
pub fn convergence(label: &str, outcome: &Outcome) -> ConvergenceSeries {
    let rows = outcome.rows.iter().map(|row| (row.iteration, row.residual, row.increment)).collect();
    ConvergenceSeries { label: label.to_owned(), rows }
}

/// Pressure of pair `i` along its surface (the coordinate that varies most).
pub fn pressure(label: &str, done: &Done, i: usize) -> Series {
    let model = done.model();
    let (axis, _) = main_axis(&model.pairs[i]);
    let pressure = &done.outcome.layer.pressure[model.range(i)];
    let points = model.pairs[i].position.iter().zip(pressure).map(|(x, &p)| (x[axis], p)).collect();
    Series::new(label, points, Style::Line)
}

/// The scene's reference pressure of pair `i`.
pub fn reference(discrete: &Discrete, i: usize) -> Option<Series> {
    let field = discrete.contacts[i].spec.reference.as_ref()?;
    let (axis, _) = main_axis(&discrete.model.pairs[i]);
    let points = discrete.model.pairs[i].position.iter().map(|&x| (x[axis], field.eval(x))).collect();
    Some(Series::new("reference", points, Style::Dashed).color(Color::Grey))
}

/// The plot of pressures along pair `i`, in the units of the scene.
pub fn pressure_plot(title: &str, scene: &Scene, pair: &ContactPair, curves: Vec<Series>) -> Plot {
    let units = scene.units.as_ref();
    let x = label(main_axis(pair).1, units.map(|units| units.length));
    Plot::pressure(title, &x, &label("contact pressure", units.map(|units| units.stress)), curves)
}

/// The coordinate along which a pair's points spread most, and its name.
fn main_axis(pair: &ContactPair) -> (usize, &'static str) {
    let [low, high] = bounds(pair.position.iter().copied());
    let spread = |k: usize| high[k] - low[k];
    let axis = (0..3).max_by(|&i, &j| spread(i).total_cmp(&spread(j)).then(j.cmp(&i))).unwrap_or(0);
    (axis, ["x", "y", "z"][axis])
}
