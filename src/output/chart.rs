//! Drawing of a [`Plot`] as SVG: axes by plotters, curves, legend.

use super::folder::write_whole;
use super::format::{shorten, superscript, text_width};
use super::look::{Area, FINE, GREY, Look, Place, SAMPLE, fine, looks};
use super::plot::{Axis, Plot, Series};
use super::ticks::{Scale, drawable};
use crate::error::Result;
use plotters::chart::ChartBuilder;
use plotters::element::Rectangle;
use plotters::prelude::{IntoDrawingArea, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, Color, FontFamily, FontStyle, RGBColor, TextStyle, WHITE};
use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

/// Width and height of a picture, in pixels.
const SIZE: (f64, f64) = (900.0, 560.0);

const TITLE_SIZE: f64 = 17.0;
const LABEL_SIZE: f64 = 14.0;
const TICK_SIZE: f64 = 12.5;
/// Labels that an axis has at most, about.
const TICKS: usize = 8;

const LEGEND_SIZE: f64 = 13.0;
/// Height of a line of the legend.
const LINE: f64 = 20.0;
const PADDING: f64 = 9.0;
/// Distance of the legend from the axes.
const APART: f64 = 12.0;
/// Widest label of a legend.
const WIDEST: f64 = 230.0;
/// Most entries of a legend that stands inside the axes.
const INSIDE: usize = 4;

const FRAME: RGBColor = RGBColor(60, 60, 60);
const GRID: RGBColor = RGBColor(222, 222, 222);
const FINE_GRID: RGBColor = RGBColor(241, 241, 241);

impl Plot {
    /// Writes the plot as SVG, 900 by 560 pixels, on white.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(draw(self)?.as_bytes())
    }

    /// Writes the plot as an SVG file, the whole file or nothing.
    ///
    /// # Errors
    /// [`Kind::File`](crate::error::Kind::File) when it cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| self.write(out))
    }
}

/// Draws a plot and returns the SVG text.
///
/// # Errors
/// Those of plotters; drawing to memory has none that are known.
fn draw(plot: &Plot) -> io::Result<String> {
    let legend = Legend::new(plot);
    match picture(plot, &legend, false)? {
        Some(text) => Ok(text),
        None => Ok(picture(plot, &legend, true)?.unwrap_or_default()),
    }
}

/// The SVG text with the legend beside the axes, or inside them; none if it would cover a curve there.
fn picture(plot: &Plot, legend: &Legend, beside: bool) -> io::Result<Option<String>> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (fine(SIZE.0) as u32, fine(SIZE.1) as u32)).into_drawing_area();
        area.fill(&WHITE).map_err(io::Error::other)?;
        let (curves, frame) = draw_axes(plot, &area, if beside { legend.width() + APART } else { 0.0 })?;
        let corner = match beside {
            true => Some((frame.0.end + fine(APART), frame.1.start)),
            false => legend.corner(&frame, &curves),
        };
        let Some(corner) = corner else { return Ok(None) };
        for (pieces, look) in curves.iter().zip(looks(&plot.series)) {
            pieces.iter().try_for_each(|piece| look.draw(&area, piece))?;
        }
        if curves.iter().all(Vec::is_empty) {
            let middle = ((frame.0.start + frame.0.end) / 2, (frame.1.start + frame.1.end) / 2);
            let style = font(LABEL_SIZE).pos(Pos::new(HPos::Center, VPos::Center)).color(&GREY);
            area.draw_text("nothing to show", &style, middle).map_err(io::Error::other)?;
        }
        legend.draw(&area, corner, frame.1.end)?;
        area.present().map_err(io::Error::other)?;
    }
    // plotters' outer element takes the fine size for the shown one: put ours around the content
    let content = text.find('>').zip(text.rfind("</svg>")).and_then(|(head, tail)| text.get(head + 1..tail));
    let content = content.ok_or_else(|| io::Error::other("plotters wrote no SVG element"))?;
    let (width, height) = SIZE;
    Ok(Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" \
         stroke-linejoin=\"round\">{content}</svg>\n",
        fine(width),
        fine(height)
    )))
}

/// For each series its pieces between gaps.
type Curves = Vec<Vec<Vec<Place>>>;

/// Rectangle of the axes.
type Frame = (Range<i32>, Range<i32>);

/// Draws title and axes, with room of some pixels at the right; where the curves and the axes are.
fn draw_axes(plot: &Plot, area: &Area, room: f64) -> io::Result<(Curves, Frame)> {
    // a point that one axis cannot show must not stretch the other
    let shown = |(x, y): &&(f64, f64)| drawable(*x, plot.x.log) && drawable(*y, plot.y.log);
    let points = || plot.series.iter().flat_map(|series| &series.points).filter(shown);
    let y = Scale::new(points().map(|point| point.1), plot.y.log, TICKS);
    let left = 44.0 + y.widest_label(TICK_SIZE);
    let width = SIZE.0 - left - 32.0 - room;
    // long numbers get fewer ticks
    let x_scale = |ticks| Scale::new(points().map(|point| point.0), plot.x.log, ticks);
    let fits = |x: &Scale| x.widest_label(TICK_SIZE) + 14.0 < x.spacing() * width;
    let x = [TICKS, 6, 4].map(x_scale).into_iter().find(fits).unwrap_or_else(|| x_scale(2));

    let mut builder = ChartBuilder::on(area);
    builder.margin_top(fine(12.0)).margin_left(fine(8.0)).margin_right(fine(24.0 + room));
    builder.x_label_area_size(fine(54.0)).y_label_area_size(fine(left));
    if !plot.title.is_empty() {
        let mut style = font(TITLE_SIZE);
        style.font = style.font.style(FontStyle::Bold);
        // bold letters are wider
        builder.caption(shorten(&printable(&plot.title), 1.12 * TITLE_SIZE, SIZE.0 - 24.0), style);
    }
    let mut chart = builder.build_cartesian_2d(x.clone(), y.clone()).map_err(io::Error::other)?;
    let described = |axis: &Axis, scale: &Scale, room: f64| {
        let power = if scale.power == 0 { String::new() } else { format!(" (×10{})", superscript(scale.power)) };
        shorten(&printable(&axis.label), LABEL_SIZE, room) + &power
    };
    let mut mesh = chart.configure_mesh();
    mesh.x_desc(described(&plot.x, &x, 0.8 * width)).y_desc(described(&plot.y, &y, 0.8 * SIZE.1));
    mesh.label_style(font(TICK_SIZE)).axis_desc_style(font(LABEL_SIZE)).set_all_tick_mark_size(fine(5.0));
    let line = |color: RGBColor, width: f64| color.stroke_width(fine(width) as u32);
    mesh.axis_style(line(FRAME, 1.0)).bold_line_style(line(GRID, 0.9)).light_line_style(line(FINE_GRID, 0.8));
    mesh.draw().map_err(io::Error::other)?;

    let place = |&(u, v): &(f64, f64)| Some(chart.backend_coord(&(x.at(u)?, y.at(v)?)));
    let pieces = |series: &Series| {
        let places: Vec<Option<Place>> = series.points.iter().map(place).collect();
        let pieces = places.split(Option::is_none).map(|piece| piece.iter().flatten().copied());
        pieces.map(Iterator::collect).filter(|piece: &Vec<_>| !piece.is_empty()).map(thin).collect()
    };
    Ok((plot.series.iter().map(pieces).collect(), chart.plotting_area().get_pixel_range()))
}

/// Keeps first, lowest, highest and last point of every half pixel of a curve that runs to the right: the picture
/// stays the same, the file small.
fn thin(points: Vec<Place>) -> Vec<Place> {
    if points.len() < 2000 || points.windows(2).any(|pair| pair[1].0 < pair[0].0) {
        return points;
    }
    let column = |point: &Place| point.0 / fine(0.5);
    let mut thinned = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let extremes = [group.iter().min_by_key(|point| point.1), group.iter().max_by_key(|point| point.1)];
        let mut kept: Vec<Place> = group.first().into_iter().chain(group.last()).copied().collect();
        extremes.into_iter().flatten().for_each(|&point| kept.insert(1, point));
        kept.sort_by_key(|point| point.0);
        thinned.extend(kept);
    }
    thinned
}

/// The named series.
struct Legend(Vec<(String, Look)>);

impl Legend {
    fn new(plot: &Plot) -> Self {
        let named = plot.series.iter().zip(looks(&plot.series)).filter(|(series, _)| !series.label.is_empty());
        Self(named.map(|(series, look)| (shorten(&printable(&series.label), LEGEND_SIZE, WIDEST), look)).collect())
    }

    /// Width in pixels.
    fn width(&self) -> f64 {
        let widest = self.0.iter().map(|(label, _)| text_width(label, LEGEND_SIZE)).fold(0.0, f64::max);
        widest + SAMPLE + 3.0 * PADDING
    }

    fn height(&self, entries: usize) -> f64 {
        entries as f64 * LINE + PADDING
    }

    /// Top left of the legend in a corner of the axes where it covers no curve, if there is one.
    fn corner(&self, (across, down): &Frame, curves: &Curves) -> Option<Place> {
        let (width, height) = (fine(self.width()), fine(self.height(self.0.len())));
        let (left, right) = (across.start + fine(APART), across.end - fine(APART) - width);
        let (top, bottom) = (down.start + fine(APART), down.end - fine(APART) - height);
        let covers = |(x, y): Place, (u, v): Place| (x..x + width).contains(&u) && (y..y + height).contains(&v);
        // curves are looked at every few pixels
        let between = |(a, b): (Place, Place), k: i32| (a.0 + k * (b.0 - a.0) / 64, a.1 + k * (b.1 - a.1) / 64);
        let meets = |piece: &Vec<Place>, at: Place| {
            let lines = piece.windows(2).flat_map(|ends| (0..64).map(move |k| between((ends[0], ends[1]), k)));
            lines.chain(piece.last().copied()).any(|place| covers(at, place))
        };
        let free = |&at: &Place| !curves.iter().flatten().any(|piece| meets(piece, at));
        let corners = [(right, top), (left, top), (right, bottom), (left, bottom)];
        corners.into_iter().filter(|_| self.0.len() <= INSIDE).find(free)
    }

    /// Draws the legend with its top left at a place, down to `bottom`; entries without room are counted.
    fn draw(&self, area: &Area, (x, y): Place, bottom: i32) -> io::Result<()> {
        if self.0.is_empty() {
            return Ok(());
        }
        let room = (f64::from(bottom - y) / FINE / LINE) as usize;
        let shown = if self.0.len() > room { room.saturating_sub(1) } else { self.0.len() };
        let more = self.0.len() - shown;
        let height = self.height(shown + usize::from(more > 0));
        let corners = [(x, y), (x + fine(self.width()), y + fine(height))];
        area.draw(&Rectangle::new(corners, WHITE.filled())).map_err(io::Error::other)?;
        let style = font(LEGEND_SIZE).pos(Pos::new(HPos::Left, VPos::Center)).color(&BLACK);
        let middle = |line: usize| y + fine(PADDING / 2.0 + (line as f64 + 0.5) * LINE);
        let write = |text: &str, line: usize| {
            area.draw_text(text, &style, (x + fine(2.0 * PADDING + SAMPLE), middle(line))).map_err(io::Error::other)
        };
        for (line, (label, look)) in self.0.iter().take(shown).enumerate() {
            look.sample(area, (x + fine(PADDING), middle(line)))?;
            write(label, line)?;
        }
        if more > 0 { write(&format!("and {more} more"), shown) } else { Ok(()) }
    }
}

/// A sans-serif font; the SVG backend divides its size by 1.24.
fn font(size: f64) -> TextStyle<'static> {
    TextStyle::from((FontFamily::SansSerif, size * FINE * 1.24))
}

/// A text without control characters, which XML does not allow.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::plot::{Axis, ConvergenceSeries, Style};
    use super::*;

    fn plot(points: Vec<(f64, f64)>, log: bool) -> Plot {
        Plot {
            title: String::new(),
            x: Axis::default(),
            y: Axis { label: String::new(), log },
            series: vec![Series::new("", points, Style::Line)],
        }
    }

    fn axes(plot: &Plot) -> (Curves, Frame) {
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, (18000, 11200)).into_drawing_area();
        draw_axes(plot, &area, 0.0).unwrap()
    }

    #[test]
    fn values_that_cannot_be_shown_leave_gaps() {
        let heights = [1.0, f64::NAN, 0.1, 0.01, 0.0, -1.0, 0.1, f64::INFINITY];
        let points = heights.iter().enumerate().map(|(k, &v)| (k as f64, v)).collect();
        let lengths: Vec<_> = axes(&plot(points, true)).0[0].iter().map(Vec::len).collect();
        assert_eq!(lengths, [1, 2, 1]);
    }

    #[test]
    fn thinning_keeps_ends_and_spikes() {
        // waves within every column, so that its ends are not its extremes
        let wave = |k: i32| f64::from((k + 3) % 12 - 6).abs() / 3.0;
        let mut points: Vec<_> = (0..100_000).map(|k| (f64::from(k), wave(k))).collect();
        points[43_210].1 = 7.0;
        points[56_789].1 = -7.0;
        let few = vec![points[0], points[43_210], points[56_789], points[99_999]];
        let thinned = axes(&plot(points, false)).0.remove(0).remove(0);
        let few = axes(&plot(few, false)).0.remove(0).remove(0);
        assert!(thinned.len() < 8000, "{}", thinned.len());
        assert_eq!(thinned.iter().map(|p| p.1).min(), Some(few[1].1));
        assert_eq!(thinned.iter().map(|p| p.1).max(), Some(few[2].1));
        assert_eq!((thinned.first(), thinned.last()), (few.first(), few.last()));
    }

    #[test]
    fn the_legend_leaves_the_axes_when_curves_fill_them() {
        let inside = |curve: fn(i32) -> f64| {
            let mut plot = plot((0..400).map(|k| (f64::from(k), curve(k))).collect(), false);
            plot.series[0].label = "a curve".into();
            let text = draw(&plot).unwrap();
            assert!(text.contains("a curve"));
            picture(&plot, &Legend::new(&plot), false).unwrap().is_some()
        };
        assert!(inside(f64::from) && !inside(|k| f64::from(k % 2)));
    }

    #[test]
    fn the_picture_is_one_element_of_the_shown_size() {
        let mut plot = plot(vec![(0.0, 1.0), (2.1e6, 2.0)], false);
        plot.title = "a < b & \u{1}c".into();
        plot.x.label = "places".into();
        let text = draw(&plot).unwrap();
        assert!(text.starts_with("<svg xmlns=") && text.ends_with("</svg>\n"));
        assert_eq!(text.matches("<svg").count(), 1);
        assert!(text.contains("width=\"900\" height=\"560\" viewBox=\"0 0 18000 11200\""));
        assert!(text.contains("a &lt; b &amp; c") && text.contains("places (×10⁶)"), "{text}");
    }

    #[test]
    fn a_file_is_written_and_a_missing_folder_told() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("convergence.svg");
        let rows = vec![(0, 1.0, f64::NAN), (1, 0.1, 0.5), (2, 0.0, 0.05)];
        let plot = Plot::convergence("Two blocks", &[ConvergenceSeries { label: String::new(), rows }]);
        plot.save(&path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("Two blocks") && text.contains("10⁻¹"), "{text}");
        let error = plot.save(&base.path().join("no/x.svg")).unwrap_err();
        assert!(error.message().contains("x.svg"));
    }
}
