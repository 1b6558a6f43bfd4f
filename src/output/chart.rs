//! Drawing of a [`Plot`] as SVG: frame, grid, curves, legend.

use super::canvas::{Canvas, Font, Frame, HEIGHT, Hold, Pixel, WIDTH, shorten, svg, text_width};
use super::folder::write_whole;
use super::format::superscript;
use super::legend::{Entry, Legend};
use super::look::{GREY, looks};
use super::plot::{Plot, Series};
use super::ticks::{Scale, drawable};
use crate::error::Result;
use plotters::style::{BLACK, Color, RGBColor, WHITE};
use std::io::{self, Write};
use std::path::Path;

const FRAME: RGBColor = RGBColor(60, 60, 60);
const GRID: RGBColor = RGBColor(222, 222, 222);
const FINE_GRID: RGBColor = RGBColor(241, 241, 241);

const TITLE_SIZE: f64 = 17.0;
const LABEL_SIZE: f64 = 14.0;
const TICK_SIZE: f64 = 12.5;
/// Labels that an axis has at most, about.
const TICKS: usize = 8;

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
    let points = || plot.series.iter().flat_map(|series| series.points.iter().copied());
    // A point that one axis cannot show must not stretch the other.
    let shown = |(x, y): &(f64, f64)| drawable(*x, plot.x.log) && drawable(*y, plot.y.log);
    let x_scale = |ticks| {
        let values = points().filter(shown).map(|point| point.0);
        Scale::new(values, plot.x.log, ticks)
    };
    let x = x_scale(TICKS);
    let y = Scale::new(points().filter(shown).map(|point| point.1), plot.y.log, TICKS);
    let looks = looks(&plot.series);
    let entries: Vec<Entry> = plot
        .series
        .iter()
        .zip(&looks)
        .filter(|(series, _)| !series.label.is_empty())
        .map(|(series, &look)| Entry { label: series.label.clone(), look })
        .collect();

    let above = y.power != 0;
    let mut frame = Frame {
        left: 48.0 + y.widest_label(TICK_SIZE),
        right: WIDTH - 24.0,
        top: if plot.title.is_empty() { 22.0 } else { 50.0 } + if above { 12.0 } else { 0.0 },
        bottom: HEIGHT - 60.0,
    };
    let legend = Legend::new(entries);
    let outside = legend.needs_room_outside() || {
        let curves = curves(plot, &x, &y, frame);
        legend.corner(frame, &curves).is_none()
    };
    if outside {
        frame.right -= legend.width() + 14.0;
    }
    let curves = curves(plot, &x, &y, frame);
    let corner = if outside {
        (frame.right + 14.0, frame.top)
    } else {
        legend.corner(frame, &curves).unwrap_or((frame.left, frame.top))
    };

    // Long numbers get fewer ticks.
    let x = [TICKS, 6, 4]
        .map(x_scale)
        .into_iter()
        .find(|x| x.widest_label(TICK_SIZE) + 14.0 < x.spacing() * (frame.right - frame.left))
        .unwrap_or_else(|| x_scale(2));

    svg(|canvas| {
        draw_axes(canvas, frame, plot, &x, &y)?;
        for (pieces, &look) in curves.iter().zip(&looks) {
            for piece in pieces {
                look.draw(canvas, piece)?;
            }
        }
        if curves.iter().all(Vec::is_empty) {
            let middle = ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0);
            let (size, hold) = (LABEL_SIZE, Hold::Middle);
            let font = Font { size, bold: false, color: GREY, hold, upward: false };
            canvas.text("nothing to show", middle, font)?;
        }
        legend.draw(canvas, corner, frame)
    })
}

/// The curves in pixels: for each series its pieces between gaps, thinned to what can be seen.
fn curves(plot: &Plot, x: &Scale, y: &Scale, frame: Frame) -> Vec<Vec<Vec<Pixel>>> {
    let pixel = |&(u, v): &(f64, f64)| {
        let (u, v) = (x.fraction(x.at(u)?), y.fraction(y.at(v)?));
        Some((frame.left + u * (frame.right - frame.left), frame.bottom - v * (frame.bottom - frame.top)))
    };
    let pieces = |series: &Series| {
        let pixels: Vec<Option<Pixel>> = series.points.iter().map(pixel).collect();
        let pieces = pixels.split(Option::is_none).map(|piece| piece.iter().flatten().copied());
        pieces.map(Iterator::collect).filter(|p: &Vec<_>| !p.is_empty()).map(thin).collect()
    };
    plot.series.iter().map(pieces).collect()
}

/// Keeps first, lowest, highest and last point of every half pixel of a curve that runs to the right: the picture
/// stays the same, the file small.
fn thin(points: Vec<Pixel>) -> Vec<Pixel> {
    if points.len() < 2000 || points.windows(2).any(|pair| pair[1].0 < pair[0].0) {
        return points;
    }
    let column = |point: &Pixel| (point.0 * 2.0).floor();
    let mut thinned = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| group[*a].1.total_cmp(&group[*b].1);
        let extremes = [(0..group.len()).min_by(by_height), (0..group.len()).max_by(by_height)];
        let mut kept: Vec<usize> = extremes.into_iter().flatten().collect();
        kept.extend([0, group.len() - 1]);
        kept.sort_unstable();
        kept.dedup();
        thinned.extend(kept.into_iter().map(|index| group[index]));
    }
    thinned
}

/// Grid, frame, ticks, labels and title.
fn draw_axes(canvas: &Canvas, frame: Frame, plot: &Plot, x: &Scale, y: &Scale) -> io::Result<()> {
    let Frame { left, right, top, bottom } = frame;
    let (width, height) = (right - left, bottom - top);
    let across = |at: f64| left + x.fraction(at) * width;
    let up = |at: f64| bottom - y.fraction(at) * height;
    let (grid, fine) = (GRID.to_rgba(), FINE_GRID.to_rgba());
    let frame_color = FRAME.to_rgba();
    canvas.fill((left, top), (right, bottom), WHITE.to_rgba())?;

    for &at in &x.minor {
        canvas.line(&[(across(at), top), (across(at), bottom)], 0.8, fine)?;
    }
    for &at in &y.minor {
        canvas.line(&[(left, up(at)), (right, up(at))], 0.8, fine)?;
    }
    for (at, _) in &x.major {
        canvas.line(&[(across(*at), top), (across(*at), bottom)], 0.9, grid)?;
    }
    for (at, _) in &y.major {
        canvas.line(&[(left, up(*at)), (right, up(*at))], 0.9, grid)?;
    }
    let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
    canvas.line(&corners, 1.0, frame_color)?;

    let font = |size, hold| Font { size, bold: false, color: BLACK, hold, upward: false };
    for (at, label) in &x.major {
        let at = across(*at);
        canvas.line(&[(at, bottom), (at, bottom + 5.0)], 1.0, frame_color)?;
        canvas.text(label, (at, bottom + 16.0), font(TICK_SIZE, Hold::Middle))?;
    }
    for (at, label) in &y.major {
        let at = up(*at);
        canvas.line(&[(left - 5.0, at), (left, at)], 1.0, frame_color)?;
        canvas.text(label, (left - 9.0, at), font(TICK_SIZE, Hold::Right))?;
    }
    for &at in &x.minor {
        canvas.line(&[(across(at), bottom), (across(at), bottom + 3.0)], 0.8, frame_color)?;
    }
    for &at in &y.minor {
        canvas.line(&[(left - 3.0, up(at)), (left, up(at))], 0.8, frame_color)?;
    }
    if y.power != 0 {
        let text = format!("×10{}", superscript(y.power));
        canvas.text(&text, (left, top - 11.0), font(TICK_SIZE, Hold::Left))?;
    }
    if x.power != 0 {
        let text = format!("×10{}", superscript(x.power));
        canvas.text(&text, (right, bottom + 34.0), font(TICK_SIZE, Hold::Right))?;
    }

    let label = font(LABEL_SIZE, Hold::Middle);
    let text = shorten(&plot.x.label, LABEL_SIZE, 0.8 * width);
    canvas.text(&text, (left + width / 2.0, bottom + 40.0), label)?;
    let text = shorten(&plot.y.label, LABEL_SIZE, height);
    canvas.text(&text, (18.0, top + height / 2.0), Font { upward: true, ..label })?;
    // Bold letters are wider.
    let size = 1.12 * TITLE_SIZE;
    let text = shorten(&plot.title, size, WIDTH - 24.0);
    let heading = Font { bold: true, ..font(TITLE_SIZE, Hold::Middle) };
    // Over the axes, unless the title is too long for that.
    let half = text_width(&text, size) / 2.0;
    let middle = (left + width / 2.0).min(WIDTH - 12.0 - half).max(12.0 + half);
    canvas.text(&text, (middle, 25.0), heading)
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

    fn pieces(plot: &Plot) -> Vec<Vec<Pixel>> {
        let values = || plot.series[0].points.iter();
        let x = Scale::new(values().map(|p| p.0), false, TICKS);
        let y = Scale::new(values().map(|p| p.1), plot.y.log, TICKS);
        let frame = Frame { left: 100.0, right: 800.0, top: 50.0, bottom: 500.0 };
        curves(plot, &x, &y, frame).remove(0)
    }

    #[test]
    fn values_that_cannot_be_shown_leave_gaps() {
        let heights = [1.0, f64::NAN, 0.1, 0.01, 0.0, -1.0, 0.1, f64::INFINITY];
        let points = heights.iter().enumerate().map(|(k, &v)| (k as f64, v)).collect();
        let lengths: Vec<_> = pieces(&plot(points, true)).iter().map(Vec::len).collect();
        assert_eq!(lengths, [1, 2, 1]);
    }

    #[test]
    fn thinning_keeps_ends_and_spikes() {
        // Waves within every column, so that its ends are not its extremes.
        let wave = |k: i32| f64::from((k + 3) % 12 - 6).abs() / 3.0;
        let mut points: Vec<_> = (0..100_000).map(|k| (f64::from(k), wave(k))).collect();
        points[43_210].1 = 7.0;
        points[56_789].1 = -7.0;
        let whole = pieces(&plot(points.clone(), false));
        let [thinned] = &whole[..] else { panic!("one piece") };
        assert!(thinned.len() < 6000, "{}", thinned.len());
        let bound = |f: fn(f64, f64) -> f64, y: fn(&Pixel) -> f64| thinned.iter().map(y).reduce(f);
        let (top, bottom) = (bound(f64::min, |p| p.1), bound(f64::max, |p| p.1));
        let few = vec![points[0], points[43_210], points[56_789], points[99_999]];
        let few = &pieces(&plot(few, false))[0];
        assert_eq!(top, Some(few[1].1));
        assert_eq!(bottom, Some(few[2].1));
        assert_eq!(thinned.first(), few.first());
        assert_eq!(thinned.last(), few.last());
    }

    #[test]
    fn the_legend_leaves_the_axes_when_curves_fill_them() {
        let right_end = |curve: fn(i32) -> f64| {
            let mut plot = plot((0..400).map(|k| (f64::from(k), curve(k))).collect(), false);
            plot.series[0].label = "a curve".into();
            let text = draw(&plot).unwrap();
            // The frame is the only closed line with five corners in its colour.
            let frame = text.lines().find(|l| l.contains("#3C3C3C") && l.contains("polyline"));
            let corners = frame.unwrap().split("points=\"").nth(1).unwrap().to_owned();
            corners.split([' ', ',']).nth(2).unwrap().parse::<f64>().unwrap()
        };
        let inside = right_end(f64::from);
        let outside = right_end(|k| f64::from(k % 2));
        assert!(outside < inside - 1000.0, "{outside} {inside}");
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
