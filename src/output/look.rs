//! Colours, lines and marks of the series of a plot.

use super::plot::{Color, Series, Style};
use plotters::coord::Shift;
use plotters::element::{DashedPathElement, PathElement, Polygon};
use plotters::prelude::{DrawingArea, SVGBackend};
use plotters::style::{Color as _, RGBColor, WHITE};
use std::io;

/// A picture in the making.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A place on it, in plotters' units.
pub(super) type Place = (i32, i32);

/// plotters rounds to whole units: drawn 20 times larger and shown smaller, curves stay smooth.
pub(super) const FINE: f64 = 20.0;

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
/// Colour of references and remarks.
pub(super) const GREY: RGBColor = RGBColor(90, 90, 90);

/// Length of a line in the legend, in pixels.
pub(super) const SAMPLE: f64 = 30.0;

/// Corners of the marks, a radius from their middle about.
const MARKS: [&[(f64, f64)]; 4] = [
    &[(-0.4, -0.92), (0.4, -0.92), (0.92, -0.4), (0.92, 0.4), (0.4, 0.92), (-0.4, 0.92), (-0.92, 0.4), (-0.92, -0.4)],
    &[(-0.88, -0.88), (0.88, -0.88), (0.88, 0.88), (-0.88, 0.88)],
    &[(0.0, -1.25), (1.15, 0.85), (-1.15, 0.85)],
    &[(0.0, -1.3), (1.1, 0.0), (0.0, 1.3), (-1.1, 0.0)],
];

/// How a series is drawn, with its colour and mark chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    style: Style,
    color: RGBColor,
    mark: &'static [(f64, f64)],
}

/// Colours and marks of all series.
pub(super) fn looks(series: &[Series]) -> Vec<Look> {
    let mut next = 0;
    let look = |(place, series): (usize, &Series)| {
        let (color, number) = match series.color {
            Color::Grey => (GREY, place),
            Color::Palette(number) => (palette(number), number),
            Color::Next => {
                next += 1;
                (palette(next - 1), next - 1)
            }
        };
        Look { style: series.style, color, mark: MARKS[number % MARKS.len()] }
    };
    series.iter().enumerate().map(look).collect()
}

impl Look {
    /// Draws one unbroken piece of a series; a point on its own becomes a mark.
    pub fn draw(&self, area: &Area, points: &[Place]) -> io::Result<()> {
        match self.style {
            Style::Line | Style::LineMarkers => {
                let line = PathElement::new(points, self.color.stroke_width(fine(1.9) as u32));
                area.draw(&line).map_err(io::Error::other)?;
            }
            Style::Dashed => {
                let style = self.color.stroke_width(fine(1.6) as u32);
                let line = DashedPathElement::new(points.iter().copied(), fine(6.4), fine(4.2), style);
                area.draw(&line).map_err(io::Error::other)?;
            }
            Style::Markers => {}
        }
        let marked = matches!(self.style, Style::Markers | Style::LineMarkers);
        let (radius, mark) = if marked { (4.0, self.mark) } else { (2.2, MARKS[0]) };
        for &at in points.iter().filter(|_| marked || points.len() == 1) {
            draw_mark(area, at, radius, mark, self.color)?;
        }
        Ok(())
    }

    /// Draws a sample for the legend: a line to the right, its mark in the middle.
    pub fn sample(&self, area: &Area, (x, y): Place) -> io::Result<()> {
        let line = if self.style == Style::LineMarkers { Style::Line } else { self.style };
        if line != Style::Markers {
            Look { style: line, ..*self }.draw(area, &[(x, y), (x + fine(SAMPLE), y)])?;
        }
        if matches!(self.style, Style::Markers | Style::LineMarkers) {
            draw_mark(area, (x + fine(SAMPLE / 2.0), y), 4.0, self.mark, self.color)?;
        }
        Ok(())
    }
}

/// A mark with a white rim, so that overlapping marks stay apart; `radius` in pixels.
fn draw_mark(area: &Area, (x, y): Place, radius: f64, mark: &[(f64, f64)], color: RGBColor) -> io::Result<()> {
    for (radius, color) in [(radius + 0.8, WHITE), (radius, color)] {
        let corners: Vec<Place> = mark.iter().map(|(u, v)| (x + fine(u * radius), y + fine(v * radius))).collect();
        area.draw(&Polygon::new(corners, color.filled())).map_err(io::Error::other)?;
    }
    Ok(())
}

/// A length in pixels in plotters' units.
pub(super) fn fine(length: f64) -> i32 {
    (length * FINE).round() as i32
}

/// Entry of the palette; every second round of it is darker.
fn palette(number: usize) -> RGBColor {
    let RGBColor(r, g, b) = PALETTE[number % PALETTE.len()];
    match (number / PALETTE.len()) % 2 {
        0 => RGBColor(r, g, b),
        _ if (r, g, b) == (0, 0, 0) => RGBColor(140, 140, 140),
        _ => RGBColor(r / 5 * 3, g / 5 * 3, b / 5 * 3),
    }
}
