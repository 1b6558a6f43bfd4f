//! The drawing of a [`Plot`] as SVG by plotters: axes, ticks and curves, with a legend beside the axes, where it hides nothing.

use super::plot::{Color, Plot, Series, Style};
use super::scale::{DIVIDED, Scale, is_drawable};
use plotters::chart::{ChartBuilder, ChartContext, SeriesLabelPosition};
use plotters::coord::Shift;
use plotters::element::{DashedPathElement, DynElement, IntoDynElement, PathElement, Polygon};
use plotters::prelude::{Cartesian2d, DrawingArea, IntoDrawingArea, SVGBackend};
use plotters::style::{Color as _, FontFamily, FontStyle, RGBColor, ShapeStyle, TextStyle, WHITE};
use std::io::{self, Write};

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
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A position on the picture in units of plotters.
type At = (i32, i32);

/// An area of the picture.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Plot {
    /// Write the plot as SVG, 900 by 560 pixels, on white.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.svg()?.as_bytes())
    }

    /// Return the SVG text that [`Self::write`] writes.
    ///
    /// # Errors
    /// Those of drawing to memory; none is known.
    pub fn svg(&self) -> io::Result<String> {
        let mut text = String::new();
        let [width, height] = [SIZE.0, SIZE.1].map(|size| size * FINE as u32);
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        self.draw(&area).map_err(io::Error::other)?;
        drop(area);
        let shown = format!("width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"", SIZE.0, SIZE.1);
        Ok(text.replacen(&format!("width=\"{width}\" height=\"{height}\""), &shown, 1))
    }

    /// Draw axes, curves and legend.
    fn draw(&self, area: &Area) -> Result<(), Failure> {
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
            let positions: Vec<Option<At>> = series.points.iter().map(position).collect();
            for piece in positions.split(Option::is_none).filter(|piece| !piece.is_empty()) {
                let piece: Vec<At> = piece.iter().flatten().copied().collect();
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
    ) -> Result<ChartContext<'a, SVGBackend<'b>, Cartesian2d<Scale, Scale>>, Failure> {
        let points = self.series.iter().flat_map(|series| &series.points).filter(|point| self.can_show(point));
        let (xs, ys): (Vec<f64>, Vec<f64>) = points.copied().unzip();
        let (x, y) = (Scale::new(&xs, self.x.log), Scale::new(&ys, self.y.log));
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

/// Draw the legend.
fn draw_legend(area: &Area, entries: &[(String, Pen)]) -> Result<(), Failure> {
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

/// Return the pens of all series.
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
    fn elements<'a>(&self, points: &[At]) -> Vec<DynElement<'static, SVGBackend<'a>, At>> {
        let line = |width: f64| ShapeStyle::from(self.color).stroke_width(fine(width) as u32);
        let mut elements = match self.style {
            Style::Line | Style::LineMarkers => vec![PathElement::new(points, line(1.9)).into_dyn()],
            Style::Dashed => vec![DashedPathElement::new(points.to_vec(), fine(6.4), fine(4.2), line(1.6)).into_dyn()],
        };
        for &(x, y) in points.iter().filter(|_| self.style == Style::LineMarkers || points.len() == 1) {
            let corners: Vec<At> = self.mark.iter().map(|(u, v)| (x + fine(*u), y + fine(*v))).collect();
            elements.push(Polygon::new(corners, self.color.filled()).into_dyn());
        }
        elements
    }

    /// Return a sample for the legend as one polygon: a line to the right with its mark in the middle.
    fn sample<'a>(&self, (x, y): At) -> DynElement<'static, SVGBackend<'a>, At> {
        if self.style == Style::Dashed {
            let style = ShapeStyle::from(self.color).stroke_width(fine(1.6) as u32);
            return DashedPathElement::new(vec![(x, y), (x + fine(30.0), y)], fine(6.4), fine(4.2), style).into_dyn();
        }
        let line = [(15.0, 0.95), (0.0, 0.95), (0.0, -0.95), (30.0, -0.95), (30.0, 0.95), (15.0, 0.95)];
        let marked = self.style != Style::Line;
        let mark = self.mark.iter().chain(self.mark.first()).filter(|_| marked).map(|(u, v)| (15.0 + u, *v));
        let corners = line.into_iter().chain(mark).map(|(u, v)| (x + fine(u), y + fine(v)));
        Polygon::new(corners.collect::<Vec<At>>(), self.color.filled()).into_dyn()
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

#[cfg(test)]
mod tests {
    use super::super::plot::Axis;
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
