//! The plots of a run: convergence, contact pressure, and lines in general.

/// A plot: curves over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Heading; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, drawn in this order.
    pub series: Vec<Series>,
}

/// An axis; its range and ticks follow the data.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Axis {
    /// Title of the axis, with the unit.
    pub label: String,
    /// Logarithmic, with ticks at powers of ten.
    pub log: bool,
}

/// A curve, or marks.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none. A named series without points only explains a style there.
    pub label: String,
    /// Points (x, y). Values that the axes cannot show (NaN, infinite, not positive on a logarithmic axis) leave
    /// a gap in the curve.
    pub points: Vec<(f64, f64)>,
    /// Line and marks.
    pub style: Style,
    /// Colour.
    pub color: Color,
}

/// The lines and marks of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A solid line.
    Line,
    /// A dashed line.
    Dashed,
    /// A solid line with marks at the points.
    LineMarkers,
}

/// Colour of a series.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Color {
    /// The next entry of the palette among the series without a colour of their own.
    #[default]
    Next,
    /// An entry of the palette, which starts again after its end; entries can be told apart by colour-blind readers.
    Palette(usize),
    /// Dark grey: references and explanations.
    Grey,
}

impl Series {
    /// Return a series in the next colour.
    pub fn new(label: impl Into<String>, points: Vec<(f64, f64)>, style: Style) -> Self {
        Self { label: label.into(), points, style, color: Color::Next }
    }

    /// Return the series in another colour.
    pub fn color(self, color: Color) -> Self {
        Self { color, ..self }
    }
}

impl Axis {
    /// Return an axis with even steps.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: false }
    }

    /// Return a logarithmic axis.
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: true }
    }
}

/// The history of one run, for [`Plot::convergence`].
#[derive(Debug, Clone, PartialEq)]
pub struct ConvergenceSeries {
    /// Name of the run.
    pub label: String,
    /// Iteration, relative residual, increment; NaN where there is none.
    pub rows: Vec<(usize, f64, f64)>,
}

impl Plot {
    /// Return the plot of residual (solid) and increment (dashed) of one or more runs over the iteration, on a logarithmic axis.
    pub fn convergence(title: &str, runs: &[ConvergenceSeries]) -> Self {
        let (solid, dashed) = ("residual", "increment");
        let mut series = Vec::new();
        let has_increments = runs.iter().flat_map(|run| &run.rows).any(|row| row.2 > 0.0);
        for (index, run) in runs.iter().enumerate() {
            let curve = |label: &str, style, value: fn(&(usize, f64, f64)) -> f64| {
                let points = run.rows.iter().map(|row| (row.0 as f64, value(row))).collect();
                Series::new(label, points, style).color(Color::Palette(index))
            };
            let (residual, increment) = if runs.len() == 1 { (solid, dashed) } else { (run.label.as_str(), "") };
            series.push(curve(residual, Style::Line, |row| row.1));
            if has_increments {
                series.push(curve(increment, Style::Dashed, |row| row.2));
            }
        }
        if runs.len() > 1 && has_increments {
            for (label, style) in [(solid, Style::Line), (dashed, Style::Dashed)] {
                series.push(Series::new(label, Vec::new(), style).color(Color::Grey));
            }
        }
        let y = if has_increments { "relative residual, increment" } else { "relative residual" };
        Self { title: title.into(), x: Axis::linear("iteration"), y: Axis::log(y), series }
    }

    /// Return the plot of the contact force of pairs over their approach, step by step, with the labels `[x, y]`. A single curve
    /// has no name.
    pub fn approach<'a>(
        title: &str,
        [x, y]: [String; 2],
        pairs: impl ExactSizeIterator<Item = (&'a str, Vec<(f64, f64)>)>,
    ) -> Self {
        let one = pairs.len() == 1;
        let curve = |(name, points)| Series::new(if one { "" } else { name }, points, Style::LineMarkers);
        Self { title: title.into(), x: Axis::linear(x), y: Axis::linear(y), series: pairs.map(curve).collect() }
    }

    /// Return the plot of the contact pressure along a surface from points (coordinate, pressure) in any order. Dashed reference
    /// curves are drawn on top.
    pub fn pressure(title: &str, x: &str, y: &str, mut series: Vec<Series>) -> Self {
        series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
        series.sort_by_key(|series| series.style == Style::Dashed);
        Self { title: title.into(), x: Axis::linear(x), y: Axis::linear(y), series }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(label: &str) -> ConvergenceSeries {
        let rows = vec![(0, 1.0, f64::NAN), (1, 0.1, 0.5), (2, 0.0, 0.05)];
        ConvergenceSeries { label: label.into(), rows }
    }

    #[test]
    fn several_runs_share_one_explanation_of_the_line_styles() {
        let labels = |plot: &Plot| -> Vec<String> {
            plot.series.iter().map(|s| s.label.clone()).filter(|l| !l.is_empty()).collect()
        };
        let one = Plot::convergence("", &[run("a")]);
        assert_eq!(labels(&one), ["residual", "increment"]);
        let two = Plot::convergence("", &[run("a"), run("b")]);
        assert_eq!(labels(&two), ["a", "b", "residual", "increment"]);
        assert_eq!(two.series[2].color, two.series[3].color);
        assert_eq!(two.series[2].points, [(0.0, 1.0), (1.0, 0.1), (2.0, 0.0)]);
        assert_eq!(two.series[3].points[1..], [(1.0, 0.5), (2.0, 0.05)]);
    }

    #[test]
    fn references_come_last_and_points_in_order() {
        let curve = |label: &str, style| Series::new(label, vec![(1.0, 5.0), (0.0, 7.0)], style);
        let plot = Plot::pressure("", "x", "p", vec![curve("exact", Style::Dashed), curve("run", Style::Line)]);
        assert_eq!(plot.series[0].label, "run");
        assert_eq!(plot.series[0].points, [(0.0, 7.0), (1.0, 5.0)]);
        assert_eq!(plot.series[1].style, Style::Dashed);
    }
}
