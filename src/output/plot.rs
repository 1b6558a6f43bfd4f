//! Plots: curves over two axes, as SVG, with a legend beside the axes, where it hides nothing.

use super::axis::Axis;
use super::escape;
use super::folder::MARK;
use std::fmt::Write as _;
use std::io::{self, Write};

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
    /// A line with a number at its end, dashed after each turn of the palette, so that more curves than colours can be
    /// told apart.
    Numbered(usize),
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

/// Width and height of a picture in pixels.
const SIZE: [f64; 2] = [900.0, 560.0];
/// Most names in a legend: with 19 pixels each they fill the height of a picture.
pub const LEGEND: usize = 24;

/// Colours of Okabe and Ito that stand out on white: colour-blind readers can tell them apart.
const PALETTE: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];
const GREY: &str = "#5A5A5A";
/// Dash patterns.
const DASHES: [&str; 3] = ["", " stroke-dasharray=\"6.4 4.2\"", " stroke-dasharray=\"1.6 3\""];
/// Marks around their middle, as SVG paths: a disc, a square, a triangle, a diamond.
const MARKS: [&str; 4] = [
    "m-3.9,0a3.9,3.9 0 1 0 7.8,0a3.9,3.9 0 1 0 -7.8,0z",
    "m-3.5,-3.5h7v7h-7z",
    "m0,-5l4.6,8.4h-9.2z",
    "m0,-5.2l4.4,5.2l-4.4,5.2l-4.4,-5.2z",
];

/// The style, colour and mark of a series.
#[derive(Clone, Copy)]
struct Pen {
    style: Style,
    color: &'static str,
    mark: &'static str,
}

/// The box of the axes in pixels.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    /// Return the place of shares of the axes in pixels.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + x * (self.right - self.left), self.bottom + y * (self.top - self.bottom)]
    }
}

impl Plot {
    /// Write the plot as SVG, 900 by 560 pixels, on white.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(self.svg().as_bytes())
    }

    /// Return the SVG text that [`Self::write`] writes.
    pub fn svg(&self) -> String {
        let pens = self.pens();
        let mut entries: Vec<(String, Pen)> =
            self.series.iter().zip(&pens).map(|(series, pen)| (cut(&series.label, 36), *pen)).collect();
        // one series needs no legend
        entries.retain(|(label, _)| !label.is_empty() && self.series.len() > 1);
        let longest = entries.iter().map(|(label, _)| label.chars().count()).max();
        let legend = longest.map_or(0.0, |longest| 56.0 + 7.6 * longest as f64);
        let top = if self.title.is_empty() { 16.0 } else { 44.0 };
        let frame = Frame { left: 84.0, right: SIZE[0] - 24.0 - legend, top, bottom: SIZE[1] - 60.0 };
        let points = self.series.iter().flat_map(|series| &series.points).filter(|point| self.can_show(point));
        let (xs, ys): (Vec<f64>, Vec<f64>) = points.copied().unzip();
        let axes = [Axis::new(&xs, self.x.log), Axis::new(&ys, self.y.log)];
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"12.5\" stroke-linejoin=\"round\">\n<!-- {MARK} -->\n<rect width=\"100%\" height=\"100%\" fill=\"#FFF\"/>\n"
        );
        self.draw_axes(&frame, &axes, &mut svg);
        for (series, pen) in self.series.iter().zip(&pens) {
            let place = |point: &(f64, f64)| {
                self.can_show(point).then(|| frame.place([axes[0].share(point.0), axes[1].share(point.1)]))
            };
            let places: Vec<Option<[f64; 2]>> = series.points.iter().map(place).collect();
            for piece in places.split(Option::is_none).filter(|piece| !piece.is_empty()) {
                pen.draw(&piece.iter().flatten().copied().collect::<Vec<_>>(), &mut svg);
            }
        }
        draw_legend(&entries, frame.right + 18.0, &mut svg);
        svg + "</svg>\n"
    }

    /// Draw title, grid, labels and frame.
    fn draw_axes(&self, frame: &Frame, [x, y]: &[Axis; 2], svg: &mut String) {
        let Frame { left, right, top, bottom } = *frame;
        let middle = 0.5 * (left + right);
        text(
            svg,
            [middle, 26.0],
            "text-anchor=\"middle\" font-size=\"17\" font-weight=\"bold\"",
            &cut(&self.title, 90),
        );
        let mut grid = String::new();
        for tick in &x.ticks {
            let [at, _] = frame.place([x.share(tick.value), 0.0]);
            let _ = write!(grid, "M{at:.2},{bottom:.2}V{top:.2}");
            text(svg, [at, bottom + 19.0], "text-anchor=\"middle\"", &tick.label);
        }
        for tick in &y.ticks {
            let [_, at] = frame.place([0.0, y.share(tick.value)]);
            let _ = write!(grid, "M{left:.2},{at:.2}H{right:.2}");
            text(svg, [left - 8.0, at + 4.0], "text-anchor=\"end\"", &tick.label);
        }
        let _ = writeln!(svg, "<path d=\"{grid}\" stroke=\"#DEDEDE\" stroke-width=\"0.9\"/>");
        let _ =
            writeln!(svg, "<path d=\"M{left:.2},{top:.2}V{bottom:.2}H{right:.2}\" fill=\"none\" stroke=\"#3C3C3C\"/>");
        let [across, up] = [x.title(&cut(&self.x.label, 70)), y.title(&cut(&self.y.label, 60))];
        text(svg, [middle, bottom + 46.0], "text-anchor=\"middle\" font-size=\"14\"", &across);
        let centre = 0.5 * (top + bottom);
        let turned = format!("text-anchor=\"middle\" font-size=\"14\" transform=\"rotate(-90 20 {centre:.2})\"");
        text(svg, [20.0, centre], &turned, &up);
    }

    /// Return whether both axes can show a point. A point that one axis cannot show must not stretch the other.
    fn can_show(&self, point: &(f64, f64)) -> bool {
        Axis::shows(point.0, self.x.log) && Axis::shows(point.1, self.y.log)
    }

    /// Return the pen of each series.
    fn pens(&self) -> Vec<Pen> {
        let mut next = 0;
        let mut pen = |(index, series): (usize, &Series)| {
            let number = match series.color {
                Color::Grey => index,
                Color::Palette(number) => number,
                Color::Next => {
                    next += 1;
                    next - 1
                }
            };
            let color = if series.color == Color::Grey { GREY } else { PALETTE[number % PALETTE.len()] };
            Pen { style: series.style, color, mark: MARKS[number % MARKS.len()] }
        };
        self.series.iter().enumerate().map(&mut pen).collect()
    }
}

impl Pen {
    /// Draw one unbroken piece of a series. A single point becomes a mark.
    fn draw(&self, places: &[[f64; 2]], svg: &mut String) {
        let Self { style, color, mark } = self;
        let (width, dashes) = match style {
            Style::Dashed => (1.6, DASHES[1]),
            Style::Line | Style::LineMarkers => (1.9, ""),
            Style::Numbered(number) => (1.9, DASHES[(number - 1) / PALETTE.len() % DASHES.len()]),
        };
        let points: Vec<String> = places.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        // writing to a String does not fail
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"{dashes}/>",
            points.join(" ")
        );
        if *style == Style::LineMarkers || places.len() == 1 {
            let marks: String = points.iter().map(|place| format!("M{place}{mark}")).collect();
            let _ = writeln!(svg, "<path d=\"{marks}\" fill=\"{color}\"/>");
        }
        if let (Style::Numbered(number), Some([x, y])) = (style, places.last()) {
            text(svg, [x + 3.0, y + 4.0], &format!("fill=\"{color}\" font-weight=\"bold\""), &number.to_string());
        }
    }
}

/// Draw the names of series, each behind a sample.
fn draw_legend(entries: &[(String, Pen)], left: f64, svg: &mut String) {
    let row = |k: usize| 36.0 + 19.0 * k as f64;
    for (k, (label, pen)) in entries.iter().take(LEGEND).enumerate() {
        let line = [[left, row(k)], [left + 30.0, row(k)]];
        Pen { style: if pen.style == Style::LineMarkers { Style::Line } else { pen.style }, ..*pen }.draw(&line, svg);
        if pen.style == Style::LineMarkers {
            pen.draw(&[[left + 15.0, row(k)]], svg);
        }
        text(svg, [left + 36.0 + if let Style::Numbered(_) = pen.style { 18.0 } else { 0.0 }, row(k) + 4.0], "", label);
    }
    if entries.len() > LEGEND {
        text(svg, [left + 36.0, row(LEGEND) + 4.0], "", &format!("and {} more", entries.len() - LEGEND));
    }
}

/// Write a text at a place.
fn text(svg: &mut String, [x, y]: [f64; 2], attributes: &str, text: &str) {
    if !text.is_empty() {
        let _ = writeln!(svg, "<text x=\"{x:.2}\" y=\"{y:.2}\" {attributes}>{}</text>", escape(text));
    }
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
    use super::*;

    /// Numbers of points of the curves of a picture.
    fn curves(plot: &Plot) -> Vec<usize> {
        let svg = plot.svg();
        let points = svg.split("points=\"").skip(1).map(|rest| rest.split('"').next().unwrap_or_default());
        points.map(|text| text.split_whitespace().count()).collect()
    }

    #[test]
    fn values_that_cannot_be_shown_leave_gaps() {
        let heights = [1.0, f64::NAN, 0.1, 0.01, 0.0, -1.0, 0.1, f64::INFINITY];
        let points = heights.iter().enumerate().map(|(k, &v)| (k as f64, v)).collect();
        let series = vec![Series::new("", points, Style::Line)];
        let plot = Plot { title: "<a & b>".into(), x: PlotAxis::default(), y: PlotAxis::log("y"), series };
        assert_eq!(curves(&plot), [1, 2, 1]);
        assert!(plot.svg().contains("&lt;a &amp; b&gt;"));
    }
}
