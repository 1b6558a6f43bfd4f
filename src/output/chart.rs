//! Drawing of a [`Plot`] as SVG by plotters: axes, ticks, curves, and a legend beside the axes, where it covers nothing.

use super::format::{superscript, trimmed};
use super::plot::{Axis, Color, Plot, Series, Style};
use plotters::chart::{ChartBuilder, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::element::{DashedPathElement, DynElement, IntoDynElement, PathElement, Polygon};
use plotters::prelude::{DrawingArea, IntoDrawingArea, IntoLogRange, SVGBackend};
use plotters::style::{Color as _, FontFamily, FontStyle, RGBColor, ShapeStyle, TextStyle, WHITE};
use std::io::{self, Write};
use std::ops::Range;

/// Width and height of a picture in pixels.
const SIZE: (u32, u32) = (900, 560);
/// plotters rounds to whole units: drawn 20 times larger and shown smaller, curves stay smooth.
const FINE: f64 = 20.0;
/// Labels that an axis has at most, about.
const TICKS: usize = 8;
/// Labels for which plotters divides a decade by all its numbers.
const DIVIDED: usize = 12;
/// Names that a legend has room for.
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
/// Corners of the marks in pixels from their middle.
const MARKS: [&[(f64, f64)]; 4] = [
    &[(-1.6, -3.7), (1.6, -3.7), (3.7, -1.6), (3.7, 1.6), (1.6, 3.7), (-1.6, 3.7), (-3.7, 1.6), (-3.7, -1.6)],
    &[(-3.5, -3.5), (3.5, -3.5), (3.5, 3.5), (-3.5, 3.5)],
    &[(0.0, -5.0), (4.6, 3.4), (-4.6, 3.4)],
    &[(0.0, -5.2), (4.4, 0.0), (0.0, 5.2), (-4.4, 0.0)],
];

/// What plotters reports; drawing to memory has no failure that is known.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A place on the picture in units of plotters.
type At = (i32, i32);

impl Plot {
    /// Writes the plot as SVG, 900 by 560 pixels, on white.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.svg()?.as_bytes())
    }

    /// The SVG text that [`Self::write`] writes.
    ///
    /// # Errors
    /// None that is known: those of drawing to memory.
    pub fn svg(&self) -> io::Result<String> {
        let mut text = String::new();
        let [width, height] = [SIZE.0, SIZE.1].map(|size| size * FINE as u32);
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        self.draw(&area).map_err(io::Error::other)?;
        drop(area);
        let shown = format!("width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"", SIZE.0, SIZE.1);
        Ok(text.replacen(&format!("width=\"{width}\" height=\"{height}\""), &shown, 1))
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failure> {
        area.fill(&WHITE)?;
        // a point that one axis cannot show must not stretch the other
        let shown = |(x, y): &&(f64, f64)| drawable(*x, self.x.log) && drawable(*y, self.y.log);
        let points = || self.series.iter().flat_map(|series| &series.points).filter(shown);
        let [xs, ys] = [|point: &(f64, f64)| point.0, |point: &(f64, f64)| point.1];
        let (x, y) = (Scale::new(points().map(xs), self.x.log), Scale::new(points().map(ys), self.y.log));
        let counts = [x.labels(points().map(xs)), y.labels(points().map(ys))];
        let titles = [x.title(&self.x, 70), y.title(&self.y, 60)];
        let named: Vec<(String, Look)> = self
            .series
            .iter()
            .zip(looks(&self.series))
            .map(|(series, look)| (cut(&series.label, 36), look))
            .filter(|(label, _)| !label.is_empty() && self.series.len() > 1)
            .collect();
        let legend = match named.iter().map(|(label, _)| label.chars().count()).max() {
            Some(longest) => 56.0 + 7.6 * longest as f64,
            None => 0.0,
        };

        let (left, right) = area.split_horizontally(fine(f64::from(SIZE.0) - legend));
        let mut builder = ChartBuilder::on(&left);
        builder.margin(fine(12.0)).margin_right(fine(24.0));
        builder.x_label_area_size(fine(48.0)).y_label_area_size(fine(68.0));
        if !self.title.is_empty() {
            let mut style = font(17.0);
            style.font = style.font.style(FontStyle::Bold);
            builder.caption(cut(&self.title, 90), style);
        }
        let mut chart = builder.build_cartesian_2d(x, y)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&titles[0]).y_desc(&titles[1]).x_labels(counts[0]).y_labels(counts[1]);
        let [across, up] = counts.map(|count| if count == DIVIDED { 1 } else { 10 });
        mesh.x_max_light_lines(across).y_max_light_lines(up);
        mesh.label_style(font(12.5)).axis_desc_style(font(14.0)).set_all_tick_mark_size(fine(5.0));
        let grey = |level: u8, width: f64| RGBColor(level, level, level).stroke_width(fine(width) as u32);
        mesh.axis_style(grey(60, 1.0)).bold_line_style(grey(222, 0.9)).light_line_style(grey(243, 0.8)).draw()?;

        for (series, look) in self.series.iter().zip(looks(&self.series)) {
            let place = |point: &(f64, f64)| shown(&point).then(|| chart.backend_coord(point));
            let places: Vec<Option<At>> = series.points.iter().map(place).collect();
            for piece in places.split(Option::is_none).filter(|piece| !piece.is_empty()) {
                let piece: Vec<At> = piece.iter().flatten().copied().collect();
                look.elements(&piece).iter().try_for_each(|element| area.draw(element))?;
            }
        }

        // a legend stands on a chart: this one has nothing else
        let mut chart = ChartBuilder::on(&right).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
        let nothing = || std::iter::empty::<PathElement<(f64, f64)>>();
        for (label, look) in named.iter().take(NAMES).cloned() {
            chart.draw_series(nothing())?.label(label).legend(move |at| look.sample(at));
        }
        if named.len() > NAMES {
            chart.draw_series(nothing())?.label(format!("and {} more", named.len() - NAMES));
        }
        let mut labels = chart.configure_series_labels();
        labels.position(SeriesLabelPosition::Coordinate(0, fine(30.0))).margin(0).legend_area_size(fine(38.0));
        labels.label_font(font(13.0)).draw()?;
        Ok(area.present()?)
    }
}

/// An axis of plotters.
enum Scale {
    /// Of values in units of this power of ten.
    Linear(RangedCoordf64, i32),
    Log(LogCoord<f64>),
}

impl Scale {
    /// An axis that shows all these values; a logarithmic one begins at a power of ten.
    fn new(values: impl Iterator<Item = f64>, log: bool) -> Self {
        let bounds = values.fold(None, |bounds: Option<(f64, f64)>, value| {
            let (low, high) = bounds.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        });
        if log {
            let (low, high) = bounds.map_or((0.0, 1.0), |(low, high)| (low.log10().floor(), high.log10()));
            let power = high.floor();
            let high = match high - low {
                // with fewer labels than three, other numbers than powers have one
                decades if decades < 2.0 => power + (10f64.powf(high - power).floor() + 1.0).log10(),
                _ => high.ceil(),
            };
            // ticks at both ends in spite of rounding
            return Self::Log((10f64.powf(low) * (1.0 - 1e-9)..10f64.powf(high) * (1.0 + 1e-9)).log_scale().into());
        }
        let (low, high) = bounds.unwrap_or((0.0, 1.0));
        let size = low.abs().max(high.abs());
        let width = high - low;
        let (low, high) = if width <= 1e-9 * size || size < TINY {
            // one value only: room on both sides
            let room = if size < TINY { 1.0 } else { 0.5 * size };
            (low - room, high + room)
        } else {
            // data that begins near zero shows zero, and nothing beyond
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

    /// Labels to ask for; whole numbers have no ticks between them.
    fn labels(&self, mut values: impl Iterator<Item = f64>) -> usize {
        match self {
            Self::Log(axis) if axis.range().end < 99.0 * axis.range().start => DIVIDED,
            Self::Log(_) => TICKS,
            Self::Linear(axis, 0) if values.all(|value| value.fract() == 0.0) => {
                let range = axis.range();
                TICKS.min((range.end.floor() - range.start.ceil()) as usize + 1)
            }
            Self::Linear(..) => TICKS,
        }
    }

    /// What the axis shows, with the power of ten that its labels leave out.
    fn title(&self, axis: &Axis, most: usize) -> String {
        let label = cut(&axis.label, most);
        match self {
            Self::Linear(_, power) if *power != 0 => format!("{label} (×10{})", superscript(*power)),
            _ => label,
        }
    }
}

impl Ranged for Scale {
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
            Self::Log(axis) => {
                // plotters has the last number of a decade and the first of the next one
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

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        match self {
            Self::Linear(axis, power) => {
                let width = axis.range().end - axis.range().start;
                // key points carry errors of rounding
                let digits = (9.0 - width.log10()).clamp(0.0, 15.0) as usize;
                let text = format!("{:.digits$}", value / 10f64.powi(*power));
                if trimmed(&text) == "-0" { "0".to_owned() } else { trimmed(&text).replace('-', "−") }
            }
            Self::Log(_) => {
                let power = (value.log10() + 1e-6).floor();
                let exponent = superscript(power as i32);
                match (value / 10f64.powf(power)).round() as i32 {
                    1 => format!("10{exponent}"),
                    digit @ (2 | 5) => format!("{digit}·10{exponent}"),
                    _ => String::new(),
                }
            }
        }
    }
}

/// How a series is drawn, with its colour and mark chosen.
#[derive(Clone, Copy)]
struct Look {
    style: Style,
    color: RGBColor,
    mark: &'static [(f64, f64)],
}

/// Colours and marks of all series.
fn looks(series: &[Series]) -> Vec<Look> {
    let mut next = 0;
    let look = |(place, series): (usize, &Series)| {
        let (color, number) = match series.color {
            Color::Grey => (GREY, place),
            Color::Palette(number) => (PALETTE[number % PALETTE.len()], number),
            Color::Next => {
                next += 1;
                (PALETTE[(next - 1) % PALETTE.len()], next - 1)
            }
        };
        Look { style: series.style, color, mark: MARKS[number % MARKS.len()] }
    };
    series.iter().enumerate().map(look).collect()
}

impl Look {
    /// The elements of one unbroken piece of a series; a point on its own becomes a mark.
    fn elements<'a>(&self, points: &[At]) -> Vec<DynElement<'static, SVGBackend<'a>, At>> {
        let line = |width: f64| ShapeStyle::from(self.color).stroke_width(fine(width) as u32);
        let mut elements = match self.style {
            Style::Line | Style::LineMarkers => vec![PathElement::new(points, line(1.9)).into_dyn()],
            Style::Dashed => vec![DashedPathElement::new(points.to_vec(), fine(6.4), fine(4.2), line(1.6)).into_dyn()],
            Style::Markers => Vec::new(),
        };
        let marked = matches!(self.style, Style::Markers | Style::LineMarkers);
        for &(x, y) in points.iter().filter(|_| marked || points.len() == 1) {
            let corners: Vec<At> = self.mark.iter().map(|(u, v)| (x + fine(*u), y + fine(*v))).collect();
            elements.push(Polygon::new(corners, self.color.filled()).into_dyn());
        }
        elements
    }

    /// A sample for the legend: a line to the right, its mark in the middle; both as one area.
    fn sample<'a>(&self, (x, y): At) -> DynElement<'static, SVGBackend<'a>, At> {
        if self.style == Style::Dashed {
            let style = ShapeStyle::from(self.color).stroke_width(fine(1.6) as u32);
            return DashedPathElement::new(vec![(x, y), (x + fine(30.0), y)], fine(6.4), fine(4.2), style).into_dyn();
        }
        let half = if self.style == Style::Markers { 0.0 } else { 0.95 };
        let line = [(15.0, half), (0.0, half), (0.0, -half), (30.0, -half), (30.0, half), (15.0, half)];
        let marked = self.style != Style::Line;
        let mark = self.mark.iter().chain(self.mark.first()).filter(|_| marked).map(|(u, v)| (15.0 + u, *v));
        let corners = line.into_iter().chain(mark).map(|(u, v)| (x + fine(u), y + fine(v)));
        Polygon::new(corners.collect::<Vec<At>>(), self.color.filled()).into_dyn()
    }
}

/// Numbers and ranges below it count as zero.
const TINY: f64 = 1e-290;

/// Whether a value has a place on an axis.
fn drawable(value: f64, log: bool) -> bool {
    // far from overflow, so that differences are finite, and on a logarithmic axis quotients, too
    if log { (1e-150..1e150).contains(&value) } else { value.abs() < 1e290 }
}

/// A length in pixels in plotters' units.
fn fine(length: f64) -> i32 {
    (length * FINE).round() as i32
}

/// A sans-serif font; the SVG backend divides its size by 1.24.
fn font(size: f64) -> TextStyle<'static> {
    TextStyle::from((FontFamily::SansSerif, size * FINE * 1.24))
}

/// A text without control characters, which XML does not allow, of at most so many letters.
fn cut(text: &str, most: usize) -> String {
    let printable = || text.chars().filter(|c| !c.is_control());
    match printable().count() {
        count if count <= most => printable().collect(),
        _ => printable().take(most - 1).chain(['…']).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<(f64, f64)>, log: bool) -> Plot {
        Plot {
            title: String::new(),
            x: Axis::default(),
            y: Axis { label: String::new(), log },
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
            (&[3.0, 15.0], true, "10⁰ 2·10⁰ 5·10⁰ 10¹ 2·10¹"),
        ] {
            assert_eq!(labels(values, log), format!("{expected} −1 0 1"));
        }
    }

    #[test]
    fn every_scale_covers_its_values_and_has_ticks() {
        for (a, b) in [(1.0, 1.0), (0.0, 5e-324), (-3.0, -1e-3), (1e-12, 1e12), (5.0, 5.1), (1e-280, 1e280)] {
            for log in [false, true] {
                let values = || [a, b].into_iter().filter(|&value| drawable(value, log));
                let scale = Scale::new(values(), log);
                let range = scale.range();
                assert!(values().all(|value| range.contains(&value)), "{a} {b} {log} {range:?}");
                let ticks = scale.key_points(TICKS).into_iter().filter(|tick| range.contains(tick)).count();
                assert!((1..=TICKS + 1).contains(&ticks), "{a} {b} {log} {ticks}");
            }
        }
    }

    /// Numbers of points of the curves of a picture.
    fn curves(plot: &Plot) -> Vec<Vec<At>> {
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
    fn the_legend_stands_beside_the_axes() {
        let mut plot = plot((0..400).map(|k| (f64::from(k), f64::from(k % 2))).collect(), false);
        plot.series[0].label = "a curve with a long name".into();
        plot.series.push(Series::new("marks", vec![(1.0, 0.5)], Style::LineMarkers));
        let right = curves(&plot).iter().flatten().map(|point| point.0).max().unwrap();
        let svg = plot.svg().unwrap();
        let before = svg.split("a curve with").next().unwrap().rsplit("<text x=\"").next().unwrap();
        let at: i32 = before.split('"').next().unwrap().parse().unwrap();
        assert!(at > right, "{at} {right}");
        // one series needs no legend
        plot.series.pop();
        assert!(!plot.svg().unwrap().contains("a curve with"));
    }

    #[test]
    fn the_picture_is_one_element_of_the_shown_size() {
        let mut plot = plot(vec![(0.0, 1.0), (2.1e6, 2.0)], false);
        plot.title = "a < b & \u{1}c".into();
        plot.x.label = "places".into();
        let text = plot.svg().unwrap();
        assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>"));
        assert_eq!(text.matches("<svg").count(), 1);
        assert!(
            text.contains("width=\"900\" height=\"560\"") && text.contains("viewBox=\"0 0 18000 11200\""),
            "{text}"
        );
        assert!(text.contains("a &lt; b &amp; c") && text.contains("places (×10⁶)"), "{text}");
    }
}
