//! Colours, lines and marks of the series of a plot.

use super::canvas::{Canvas, Mark, Pixel};
use super::plot::{Color, Series, Style};
use plotters::style::{Color as _, RGBAColor, RGBColor};
use std::io;

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
const MARKS: [Mark; 4] = [Mark::Circle, Mark::Square, Mark::Triangle, Mark::Diamond];
/// Colour of references and remarks.
pub(super) const GREY: RGBColor = RGBColor(90, 90, 90);

/// How a series is drawn, with its colour and mark chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    style: Style,
    color: RGBColor,
    mark: Mark,
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
    pub fn draw(&self, canvas: &Canvas, points: &[Pixel]) -> io::Result<()> {
        let color: RGBAColor = self.color.to_rgba();
        match self.style {
            Style::Line | Style::LineMarkers => canvas.line(points, 1.9, color)?,
            Style::Dashed => canvas.dashes(points, 1.6, color)?,
            Style::Markers => {}
        }
        let marked = matches!(self.style, Style::Markers | Style::LineMarkers);
        let (radius, mark) = if marked { (4.0, self.mark) } else { (2.2, Mark::Circle) };
        if marked || points.len() == 1 {
            for &point in points {
                canvas.mark(point, radius, mark, self.color)?;
            }
        }
        Ok(())
    }

    /// Draws a sample for the legend: a line of some length, its mark in the middle.
    pub fn sample(&self, canvas: &Canvas, (x, y): Pixel, length: f64) -> io::Result<()> {
        let line = match self.style {
            Style::LineMarkers => Style::Line,
            other => other,
        };
        if line != Style::Markers {
            Look { style: line, ..*self }.draw(canvas, &[(x, y), (x + length, y)])?;
        }
        if matches!(self.style, Style::Markers | Style::LineMarkers) {
            Look { style: Style::Markers, ..*self }.draw(canvas, &[(x + length / 2.0, y)])?;
        }
        Ok(())
    }
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
