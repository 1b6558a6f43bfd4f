//! Plots: curves over two axes, drawn as SVG by plotters, with a legend beside the axes, where it hides nothing.

use super::{superscript, trimmed};
use plotters::chart::{ChartBuilder, ChartContext, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, DynElement, IntoDynElement, PathElement, Polygon};
use plotters::prelude::{Cartesian2d, DrawingArea, IntoDrawingArea, IntoLogRange, SVGBackend};
use plotters::style::{Color as _, FontFamily, FontStyle, RGBColor, ShapeStyle, TextStyle, WHITE};
use std::io::{self, Write};
use std::ops::Range;

/// A plot: curves over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Heading; empty for none.
    pub title: String,
    /// Horizontal axis.
    pub x: PlotAxis,
    /// Vertical axis.
    pub y: PlotAxis,
    /// Curves, drawn in this order.
    pub series: Vec<Series>,
}

/// An axis; its range and ticks follow the data.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PlotAxis {
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

impl PlotAxis {
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
        Self { title: title.into(), x: PlotAxis::linear("iteration"), y: PlotAxis::log(y), series }
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
        Self { title: title.into(), x: PlotAxis::linear(x), y: PlotAxis::linear(y), series: pairs.map(curve).collect() }
    }

    /// Return the plot of the contact pressure along a surface from points (coordinate, pressure) in any order. Dashed reference
    /// curves are drawn on top.
    pub fn pressure(title: &str, x: &str, y: &str, mut series: Vec<Series>) -> Self {
        series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
        series.sort_by_key(|series| series.style == Style::Dashed);
        Self { title: title.into(), x: PlotAxis::linear(x), y: PlotAxis::linear(y), series }
    }
}

/// Width and height of a picture in pixels.
const SIZE: (u32, u32) = (900, 560);
/// Units of plotters per pixel. plotters rounds to whole units, so the picture is drawn larger and curves stay smooth.
const FINE: f64 = 20.0;
/// Most names in a legend.
const NAMES: usize = 24;

/// Colours of Okabe and Ito that stand out on white: colour-blind readers can tell them apart.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
const GREY: RGBColor = RGBColor(90, 90, 90);
/// Corners of the marks in pixels from their centre.
const MARKS: [&[(f64, f64)]; 4] = [
    &[(-1.6, -3.7), (1.6, -3.7), (3.7, -1.6), (3.7, 1.6), (1.6, 3.7), (-1.6, 3.7), (-3.7, 1.6), (-3.7, -1.6)],
    &[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)],
    &[(0.0, -5.0), (4.6, 3.4), (-4.6, 3.4)],
    &[(0.0, -5.2), (4.4, 0.0), (0.0, 5.2), (-4.4, 0.0)],
];

/// An error of plotters. No failure of drawing to memory is known.
type PlotError = Box<dyn std::error::Error + Send + Sync>;

/// A position on the picture in units of plotters.
type Pixel = (i32, i32);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Plot {
    /// Write the plot as SVG, 900 by 560 pixels, on white.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.svg()?.as_bytes())
    }

    /// Return the SVG text that [`Self::write`] writes.
    pub fn svg(&self) -> io::Result<String> {
        let mut text = String::new();
        let [width, height] = [SIZE.0, SIZE.1].map(|size| size * FINE as u32);
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        self.draw(&area).map_err(io::Error::other)?;
        drop(area);
        let shown = format!("width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"", SIZE.0, SIZE.1);
        Ok(text.replacen(&format!("width=\"{width}\" height=\"{height}\""), &shown, 1))
    }

    fn draw(&self, area: &Area) -> Result<(), PlotError> {
        area.fill(&WHITE)?;
        let pens = pens(&self.series);
        let mut entries: Vec<(String, Pen)> =
            self.series.iter().zip(&pens).map(|(series, pen)| (cut(&series.label, 36), *pen)).collect();
        // one series needs no legend
        entries.retain(|(label, _)| !label.is_empty() && self.series.len() > 1);
        let longest = entries.iter().map(|(label, _)| label.chars().count()).max();
        let legend = longest.map_or(0.0, |longest| 56.0 + 7.6 * longest as f64);
        let (left, right) = area.split_horizontally(fine(f64::from(SIZE.0) - legend));
        let chart = self.draw_axes(&left)?;
        for (series, pen) in self.series.iter().zip(&pens) {
            let position = |point: &(f64, f64)| self.can_show(point).then(|| chart.backend_coord(point));
            let positions: Vec<Option<Pixel>> = series.points.iter().map(position).collect();
            for piece in positions.split(Option::is_none).filter(|piece| !piece.is_empty()) {
                let piece: Vec<Pixel> = piece.iter().flatten().copied().collect();
                pen.elements(&piece).iter().try_for_each(|element| area.draw(element))?;
            }
        }
        draw_legend(&right, &entries)?;
        Ok(area.present()?)
    }

    /// Draw the title and the axes, whose ranges follow the points that can be shown.
    fn draw_axes<'a, 'b>(
        &self,
        area: &'a Area<'b>,
    ) -> Result<ChartContext<'a, SVGBackend<'b>, Cartesian2d<AxisScale, AxisScale>>, PlotError> {
        let points = self.series.iter().flat_map(|series| &series.points).filter(|point| self.can_show(point));
        let (xs, ys): (Vec<f64>, Vec<f64>) = points.copied().unzip();
        let (x, y) = (AxisScale::new(&xs, self.x.log), AxisScale::new(&ys, self.y.log));
        let labels = [x.labels(&xs), y.labels(&ys)];
        let titles = [x.title(cut(&self.x.label, 70)), y.title(cut(&self.y.label, 60))];
        let mut builder = ChartBuilder::on(area);
        builder.margin(fine(12.0)).margin_right(fine(24.0));
        builder.x_label_area_size(fine(48.0)).y_label_area_size(fine(68.0));
        if !self.title.is_empty() {
            let mut style = font(17.0);
            style.font = style.font.style(FontStyle::Bold);
            builder.caption(cut(&self.title, 90), style);
        }
        let mut chart = builder.build_cartesian_2d(x, y)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&titles[0]).y_desc(&titles[1]).x_labels(labels[0]).y_labels(labels[1]);
        let [across, up] = labels.map(|count| if count == DIVIDED { 1 } else { 10 });
        mesh.x_max_light_lines(across).y_max_light_lines(up);
        mesh.label_style(font(12.5)).axis_desc_style(font(14.0)).set_all_tick_mark_size(fine(5.0));
        let grey = |level: u8, width: f64| RGBColor(level, level, level).stroke_width(fine(width) as u32);
        mesh.axis_style(grey(60, 1.0)).bold_line_style(grey(222, 0.9)).light_line_style(grey(243, 0.8)).draw()?;
        Ok(chart)
    }

    /// Whether both axes can show a point. A point that one axis cannot show must not stretch the other.
    fn can_show(&self, point: &(f64, f64)) -> bool {
        is_drawable(point.0, self.x.log) && is_drawable(point.1, self.y.log)
    }
}

fn draw_legend(area: &Area, entries: &[(String, Pen)]) -> Result<(), PlotError> {
    // plotters draws a legend only on a chart: this one is empty
    let mut chart = ChartBuilder::on(area).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
    let nothing = || std::iter::empty::<PathElement<(f64, f64)>>();
    for (label, pen) in entries.iter().take(NAMES).cloned() {
        chart.draw_series(nothing())?.label(label).legend(move |at| pen.sample(at));
    }
    if entries.len() > NAMES {
        chart.draw_series(nothing())?.label(format!("and {} more", entries.len() - NAMES));
    }
    let mut labels = chart.configure_series_labels();
    labels.position(SeriesLabelPosition::Coordinate(0, fine(30.0))).margin(0).legend_area_size(fine(38.0));
    labels.label_font(font(13.0)).draw()?;
    Ok(())
}

/// The style, colour and mark of a series.
#[derive(Clone, Copy)]
struct Pen {
    style: Style,
    color: RGBColor,
    mark: &'static [(f64, f64)],
}

fn pens(series: &[Series]) -> Vec<Pen> {
    let (mut next, mut pens) = (0, Vec::new());
    for (index, series) in series.iter().enumerate() {
        let number = match series.color {
            Color::Grey => index,
            Color::Palette(number) => number,
            Color::Next => {
                next += 1;
                next - 1
            }
        };
        let color = if series.color == Color::Grey { GREY } else { PALETTE[number % PALETTE.len()] };
        pens.push(Pen { style: series.style, color, mark: MARKS[number % MARKS.len()] });
    }
    pens
}

impl Pen {
    /// Return the elements of one unbroken piece of a series. A single point becomes a mark.
    fn elements<'a>(&self, points: &[Pixel]) -> Vec<DynElement<'static, SVGBackend<'a>, Pixel>> {
        let line = |width: f64| ShapeStyle::from(self.color).stroke_width(fine(width) as u32);
        let mut elements = match self.style {
            Style::Line | Style::LineMarkers => vec![PathElement::new(points, line(1.9)).into_dyn()],
            Style::Dashed => vec![DashedPathElement::new(points.to_vec(), fine(6.4), fine(4.2), line(1.6)).into_dyn()],
        };
        for &(x, y) in points.iter().filter(|_| self.style == Style::LineMarkers || points.len() == 1) {
            let corners: Vec<Pixel> = self.mark.iter().map(|(u, v)| (x + fine(*u), y + fine(*v))).collect();
            elements.push(Polygon::new(corners, self.color.filled()).into_dyn());
        }
        elements
    }

    /// Return a sample for the legend as one polygon: a line to the right with its mark in the middle.
    fn sample<'a>(&self, (x, y): Pixel) -> DynElement<'static, SVGBackend<'a>, Pixel> {
        if self.style == Style::Dashed {
            let style = ShapeStyle::from(self.color).stroke_width(fine(1.6) as u32);
            return DashedPathElement::new(vec![(x, y), (x + fine(30.0), y)], fine(6.4), fine(4.2), style).into_dyn();
        }
        let line = [(15.0, 0.95), (0.0, 0.95), (0.0, -0.95), (30.0, -0.95), (30.0, 0.95), (15.0, 0.95)];
        let marked = self.style != Style::Line;
        let mark = self.mark.iter().chain(self.mark.first()).filter(|_| marked).map(|(u, v)| (15.0 + u, *v));
        let corners = line.into_iter().chain(mark).map(|(u, v)| (x + fine(u), y + fine(v)));
        Polygon::new(corners.collect::<Vec<Pixel>>(), self.color.filled()).into_dyn()
    }
}

/// Convert a length in pixels to units of plotters.
fn fine(length: f64) -> i32 {
    (length * FINE).round() as i32
}

/// Return a sans-serif font of a size in pixels. The SVG backend divides its size by 1.24.
fn font(size: f64) -> TextStyle<'static> {
    TextStyle::from((FontFamily::SansSerif, size * FINE * 1.24))
}

/// Return a text of at most `most` characters without control characters, which XML does not allow.
fn cut(text: &str, most: usize) -> String {
    let printable = || text.chars().filter(|c| !c.is_control());
    match printable().count() {
        count if count <= most => printable().collect(),
        _ => printable().take(most - 1).chain(['…']).collect(),
    }
}

/// Approximate upper limit of the labels of an axis.
const TICKS: usize = 8;
/// Number of labels for which plotters divides a decade by all its digits.
const DIVIDED: usize = 12;
/// Numbers and ranges below this count as zero.
const TINY: f64 = 1e-290;

/// Whether an axis can show a value.
fn is_drawable(value: f64, log: bool) -> bool {
    // the limits keep differences finite, and on a logarithmic axis also quotients
    if log { (1e-150..1e150).contains(&value) } else { value.abs() < 1e290 }
}

enum AxisScale {
    /// An even scale; plotters sees values in units of this power of ten.
    Linear(RangedCoordf64, i32),
    Log(LogCoord<f64>),
}

impl AxisScale {
    /// Return a scale that shows all these values.
    pub fn new(values: &[f64], log: bool) -> Self {
        let low = values.iter().copied().reduce(f64::min);
        let high = values.iter().copied().reduce(f64::max);
        let bounds = low.zip(high);
        if log { Self::logarithmic(bounds) } else { Self::linear(bounds.unwrap_or((0.0, 1.0))) }
    }

    /// Return a logarithmic scale. It begins and ends at a power of ten, or at a multiple of one if it has fewer than three of them, since
    /// other numbers have labels then, too.
    fn logarithmic(bounds: Option<(f64, f64)>) -> Self {
        let (low, high) = bounds.map_or((0.0, 1.0), |(low, high)| (low.log10(), high.log10()));
        let digit = |log: f64| 10f64.powf(log - log.floor()).floor();
        let (low, high) = match high - low.floor() {
            decades if decades < 2.0 => (low.floor() + digit(low).log10(), high.floor() + (digit(high) + 1.0).log10()),
            _ => (low.floor(), high.ceil()),
        };
        // the margin keeps the ticks at both ends in spite of rounding
        Self::Log((10f64.powf(low) * (1.0 - 1e-9)..10f64.powf(high) * (1.0 + 1e-9)).log_scale().into())
    }

    /// Return an even scale.
    fn linear((low, high): (f64, f64)) -> Self {
        let size = low.abs().max(high.abs());
        let width = high - low;
        let (low, high) = if width <= 1e-9 * size || size < TINY {
            // a single value has room on both sides
            let room = if size < TINY { 1.0 } else { 0.5 * size };
            (low - room, high + room)
        } else {
            // if the data begins near zero, the axis begins at zero
            let pad = 0.03 * width;
            let low = if low >= 0.0 && low < 0.25 * width { 0.0 } else { low - pad };
            (low, if high <= 0.0 && -high < 0.25 * width { 0.0 } else { high + pad })
        };
        let power = match low.abs().max(high.abs()) {
            size if (0.01..1e5).contains(&size) => 0,
            size => size.log10().floor() as i32,
        };
        let unit = 10f64.powi(power);
        Self::Linear((low / unit..high / unit).into(), power)
    }

    /// Return the number of labels to ask plotters for. Whole numbers have no ticks between them.
    pub fn labels(&self, values: &[f64]) -> usize {
        match self {
            Self::Log(axis) if is_divided(axis) => DIVIDED,
            Self::Log(_) => TICKS,
            Self::Linear(axis, 0) if values.iter().all(|value| value.fract() == 0.0) => {
                let range = axis.range();
                TICKS.min((range.end.floor() - range.start.ceil()) as usize + 1)
            }
            Self::Linear(..) => TICKS,
        }
    }

    /// Return the title of an axis with the power of ten that its labels leave out.
    pub fn title(&self, label: String) -> String {
        match self {
            Self::Linear(_, power) if *power != 0 => format!("{label} (×10{})", superscript(*power)),
            _ => label,
        }
    }
}

/// Whether a logarithmic axis has fewer than three powers of ten.
fn is_divided(axis: &LogCoord<f64>) -> bool {
    axis.range().end < 99.0 * axis.range().start
}

/// Return the multiples of powers of ten in a range. plotters finds them only if the range begins at a power of ten.
fn multiples(range: &Range<f64>) -> Vec<f64> {
    let [first, last] = [range.start, range.end].map(|end| end.log10().floor() as i32);
    let all = (first..=last).flat_map(|power| (1..10).map(move |digit| f64::from(digit) * 10f64.powi(power)));
    all.filter(|value| range.contains(value)).collect()
}

impl Ranged for AxisScale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        match self {
            Self::Linear(axis, power) => axis.map(&(value / 10f64.powi(*power)), limit),
            Self::Log(axis) => axis.map(value, limit),
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match self {
            Self::Linear(axis, power) => axis.key_points(hint).iter().map(|key| key * 10f64.powi(*power)).collect(),
            Self::Log(axis) if is_divided(axis) => multiples(&axis.range()),
            Self::Log(axis) => {
                // plotters returns both the last number of a decade and the first of the next one
                let mut keys = axis.key_points(hint);
                keys.dedup_by(|a, b| *a <= *b * (1.0 + 1e-6));
                keys
            }
        }
    }

    fn range(&self) -> Range<f64> {
        match self {
            Self::Linear(axis, power) => {
                let unit = 10f64.powi(*power);
                axis.range().start * unit..axis.range().end * unit
            }
            Self::Log(axis) => axis.range(),
        }
    }
}

impl ValueFormatter<f64> for AxisScale {
    fn format_ext(&self, value: &f64) -> String {
        match self {
            Self::Linear(axis, power) => {
                let width = axis.range().end - axis.range().start;
                // key points have rounding errors
                let digits = (9.0 - width.log10()).clamp(0.0, 15.0) as usize;
                let text = format!("{:.digits$}", value / 10f64.powi(*power));
                if trimmed(&text) == "-0" { "0".to_owned() } else { trimmed(&text).replace('-', "−") }
            }
            Self::Log(axis) => {
                let power = (value.log10() + 1e-6).floor();
                let exponent = superscript(power as i32);
                let is_short = axis.range().end < 10.0 * axis.range().start;
                match (value / 10f64.powf(power)).round() as i32 {
                    1 => format!("10{exponent}"),
                    digit if is_short || matches!(digit, 2 | 5) => format!("{digit}·10{exponent}"),
                    _ => String::new(),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>, log: bool) -> Plot {
        Plot {
            title: String::new(),
            x: PlotAxis::default(),
            y: PlotAxis { label: String::new(), log },
            series: vec![Series::new("", points, Style::Line)],
        }
    }

    /// The labels of the vertical axis from below, then those of the horizontal one.
    fn labels(values: &[f64], log: bool) -> String {
        let points: Vec<(f64, f64)> = values.iter().map(|&value| (0.0, value)).collect();
        let svg = plot(points, log).svg().unwrap();
        let texts = svg.split("</text>").filter_map(|part| part.rsplit_once(">\n")).map(|(_, text)| text.trim());
        texts.filter(|text| !text.is_empty()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn ticks_are_round() {
        for (values, log, expected) in [
            (&[0.0, 0.7, 1.0][..], false, "0 0.2 0.4 0.6 0.8 1"),
            (&[-1.0, 0.1, 1.0], false, "−1 −0.5 0 0.5 1"),
            (&[0.0, 2.1e6], false, "(×10⁶) 0 0.5 1 1.5 2"),
            (&[0.0, 4e-6], false, "(×10⁻⁶) 0 1 2 3 4"),
            (&[1.0, 2e-3, f64::NAN, 0.0, -1.0], true, "10⁻³ 10⁻² 10⁻¹ 10⁰"),
            (&[1.0, 1e-16], true, "10⁻¹⁴ 10⁻¹² 10⁻¹⁰ 10⁻⁸ 10⁻⁶ 10⁻⁴ 10⁻² 10⁰"),
            (&[3.0, 15.0], true, "3·10⁰ 4·10⁰ 5·10⁰ 6·10⁰ 7·10⁰ 8·10⁰ 9·10⁰ 10¹ 2·10¹"),
            (&[3006.0, 5688.0], true, "3·10³ 4·10³ 5·10³ 6·10³"),
            (&[3.0, 45.0], true, "5·10⁰ 10¹ 2·10¹ 5·10¹"),
        ] {
            assert_eq!(labels(values, log), format!("{expected} −1 0 1"));
        }
    }

    /// Numbers of points of the curves of a picture.
    fn curves(plot: &Plot) -> Vec<Vec<Pixel>> {
        let svg = plot.svg().unwrap();
        let lines = svg.split("<polyline").filter(|line| line.contains("#0072B2"));
        let points = lines.filter_map(|line| line.split("points=\"").nth(1)?.split('"').next().map(str::to_owned));
        let place = |text: &str| text.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()));
        points.map(|text| text.split_whitespace().filter_map(place).collect()).collect()
    }

    #[test]
    fn values_that_cannot_be_shown_leave_gaps() {
        let heights = [1.0, f64::NAN, 0.1, 0.01, 0.0, -1.0, 0.1, f64::INFINITY];
        let points = heights.iter().enumerate().map(|(k, &v)| (k as f64, v)).collect();
        assert_eq!(curves(&plot(points, true)).iter().map(Vec::len).collect::<Vec<_>>(), [1, 2, 1]);
    }

    #[test]
    fn every_scale_covers_its_values_and_has_ticks() {
        for (a, b) in [(1.0, 1.0), (0.0, 5e-324), (-3.0, -1e-3), (1e-12, 1e12), (5.0, 5.1), (1e-280, 1e280)] {
            for log in [false, true] {
                let values: Vec<f64> = [a, b].into_iter().filter(|&value| is_drawable(value, log)).collect();
                let scale = AxisScale::new(&values, log);
                let range = scale.range();
                assert!(values.iter().all(|value| range.contains(value)), "{a} {b} {log} {range:?}");
                let ticks = scale.key_points(TICKS).into_iter().filter(|tick| range.contains(tick)).count();
                // a divided axis has all digits of two decades
                let most = if log { 18 } else { TICKS };
                assert!((1..=most + 1).contains(&ticks), "{a} {b} {log} {ticks}");
            }
        }
    }
}
