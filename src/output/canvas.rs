//! Lines, text and marks on an SVG picture, in pixels from the top left.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::FontFamily;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::io;

/// Width of a picture in pixels.
pub(super) const WIDTH: f64 = 900.0;
/// Height of a picture in pixels.
pub(super) const HEIGHT: f64 = 560.0;

/// plotters rounds to whole units: drawn 20 times larger and shown smaller, curves stay smooth.
const FINE: f64 = 20.0;

/// A place in pixels: x to the right, y down.
pub(super) type Pixel = (f64, f64);

/// The rectangle of the axes, in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// Where a text is held, horizontally.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hold {
    Left,
    Middle,
    Right,
}

/// How a text looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Font {
    pub size: f64,
    pub bold: bool,
    pub color: RGBColor,
    pub hold: Hold,
    /// Turned to read upwards.
    pub upward: bool,
}

/// Shape of a mark at a data point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Triangle,
    Diamond,
}

/// A picture in the making.
pub(super) struct Canvas<'a>(DrawingArea<SVGBackend<'a>, Shift>);

/// Draws a picture and returns the SVG text.
///
/// # Errors
/// Those of plotters; drawing to memory has none that are known.
pub(super) fn svg(draw: impl FnOnce(&Canvas) -> io::Result<()>) -> io::Result<String> {
    let mut text = String::new();
    {
        let size = (scaled(WIDTH) as u32, scaled(HEIGHT) as u32);
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let canvas = Canvas(area);
        canvas.0.fill(&WHITE).map_err(io::Error::other)?;
        draw(&canvas)?;
        canvas.0.present().map_err(io::Error::other)?;
    }
    // plotters' outer element takes the fine size for the shown one: put ours around the content.
    let content = text
        .find('>')
        .zip(text.rfind("</svg>"))
        .and_then(|(head, tail)| text.get(head + 1..tail))
        .ok_or_else(|| io::Error::other("plotters wrote no SVG element"))?;
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         viewBox=\"0 0 {} {}\" stroke-linejoin=\"round\">{content}</svg>\n",
        scaled(WIDTH),
        scaled(HEIGHT)
    ))
}

impl Canvas<'_> {
    /// A line through points; nothing for fewer than two.
    pub fn line(&self, points: &[Pixel], width: f64, color: RGBAColor) -> io::Result<()> {
        if points.len() < 2 {
            return Ok(());
        }
        let path: Vec<_> = points.iter().map(|&point| fine(point)).collect();
        self.0.draw(&PathElement::new(path, color.stroke_width(scaled(width) as u32))).map_err(io::Error::other)
    }

    /// A dashed line through points.
    pub fn dashes(&self, points: &[Pixel], width: f64, color: RGBAColor) -> io::Result<()> {
        for dash in cut_into_dashes(points, 4.0 * width, 2.6 * width) {
            self.line(&dash, width, color)?;
        }
        Ok(())
    }

    /// A filled rectangle between two corners.
    pub fn fill(&self, from: Pixel, to: Pixel, color: RGBAColor) -> io::Result<()> {
        self.0.draw(&Rectangle::new([fine(from), fine(to)], color.filled())).map_err(io::Error::other)
    }

    /// A mark with a white rim, so that overlapping marks stay apart; `radius` in pixels.
    pub fn mark(&self, (x, y): Pixel, radius: f64, mark: Mark, color: RGBColor) -> io::Result<()> {
        for (radius, color) in [(radius + 0.8, WHITE), (radius, color)] {
            let polygon = |corners: &[Pixel]| {
                let corners = corners.iter().map(|&(u, v)| fine((x + u * radius, y + v * radius)));
                self.0.draw(&Polygon::new(corners.collect::<Vec<_>>(), color.filled())).map_err(io::Error::other)
            };
            match mark {
                Mark::Circle => {
                    self.0.draw(&Circle::new(fine((x, y)), scaled(radius), color.filled())).map_err(io::Error::other)?
                }
                Mark::Square => {
                    polygon(&[(-0.88, -0.88), (0.88, -0.88), (0.88, 0.88), (-0.88, 0.88)])?;
                }
                Mark::Triangle => polygon(&[(0.0, -1.25), (1.15, 0.85), (-1.15, 0.85)])?,
                Mark::Diamond => polygon(&[(0.0, -1.3), (1.1, 0.0), (0.0, 1.3), (-1.1, 0.0)])?,
            }
        }
        Ok(())
    }

    /// A line of text, vertically centred at the place.
    pub fn text(&self, text: &str, at: Pixel, font: Font) -> io::Result<()> {
        // Control characters are not allowed in XML.
        let text: String = text.chars().filter(|c| !c.is_control()).collect();
        let horizontal = match font.hold {
            Hold::Left => HPos::Left,
            Hold::Middle => HPos::Center,
            Hold::Right => HPos::Right,
        };
        // The SVG backend divides the size of a font by 1.24.
        let mut style = TextStyle::from((FontFamily::SansSerif, font.size * FINE * 1.24));
        if font.bold {
            style.font = style.font.style(FontStyle::Bold);
        }
        if font.upward {
            style = style.transform(FontTransform::Rotate270);
        }
        let style = style.pos(Pos::new(horizontal, VPos::Center)).color(&font.color);
        self.0.draw_text(&text, &style, fine(at)).map_err(io::Error::other)
    }
}

/// Width of a text in a usual sans-serif font, in pixels, on the safe side: no font is at hand to measure with.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let em: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '|' | '\'' | '!' | ' ' | '·' => 0.33,
            'f' | 't' | 'r' | 'I' | '(' | ')' | '[' | ']' | '/' | '-' => 0.41,
            '⁻' | '⁰' | '¹' | '²' | '³' | '⁴'..='⁹' => 0.42,
            'm' | 'w' | 'M' | 'W' | '@' | '%' | '−' => 0.92,
            c if c.is_uppercase() => 0.72,
            _ => 0.62,
        })
        .sum();
    em * size
}

/// A text cut to a width, with an ellipsis where something is missing.
pub(super) fn shorten(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.into();
    }
    let mut short = String::new();
    for c in text.chars() {
        if text_width(&short, size) + text_width("m…", size) > width {
            break;
        }
        short.push(c);
    }
    short.trim_end().to_owned() + "…"
}

fn scaled(length: f64) -> i32 {
    (length * FINE).round() as i32
}

fn fine((x, y): Pixel) -> (i32, i32) {
    (scaled(x), scaled(y))
}

/// Cuts a line into dashes of equal length along it, round corners included.
fn cut_into_dashes(points: &[Pixel], dash: f64, gap: f64) -> Vec<Vec<Pixel>> {
    let mut dashes = Vec::new();
    let Some(&first) = points.first() else {
        return dashes;
    };
    let mut current = vec![first];
    let mut drawing = true;
    let mut left = dash;
    for pair in points.windows(2) {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let length = (x1 - x0).hypot(y1 - y0);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let t = done / length;
            let here = (x0 + t * (x1 - x0), y0 + t * (y1 - y0));
            if drawing {
                current.push(here);
                dashes.push(std::mem::take(&mut current));
            } else {
                current = vec![here];
            }
            drawing = !drawing;
            left = if drawing { dash } else { gap };
        }
        left -= length - done;
        if drawing {
            current.push((x1, y1));
        }
    }
    if drawing && current.len() > 1 {
        dashes.push(current);
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_have_equal_length_round_a_corner() {
        let dashes = cut_into_dashes(&[(0.0, 0.0), (10.0, 0.0), (10.0, 11.0)], 4.0, 2.0);
        let length =
            |dash: &Vec<Pixel>| -> f64 { dash.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum() };
        let lengths: Vec<_> = dashes.iter().map(length).collect();
        assert_eq!(lengths, [4.0, 4.0, 4.0, 3.0]);
        assert_eq!(dashes[1][..2], [(6.0, 0.0), (10.0, 0.0)]);
        assert_eq!(dashes[2][0], (10.0, 2.0));
    }

    #[test]
    fn long_texts_are_cut() {
        assert_eq!(shorten("short", 10.0, 100.0), "short");
        let short = shorten(&"long text ".repeat(20), 10.0, 100.0);
        assert!(short.ends_with('…') && text_width(&short, 10.0) <= 100.0, "{short}");
    }

    #[test]
    fn the_picture_is_one_element_of_the_shown_size() {
        let text = svg(|canvas| {
            let font = Font { size: 12.0, bold: false, color: BLACK, hold: Hold::Left, upward: false };
            canvas.text("a < b & \u{1}c", (450.0, 280.0), font)
        })
        .unwrap();
        assert!(text.starts_with("<svg xmlns=") && text.ends_with("</svg>\n"));
        assert_eq!(text.matches("<svg").count(), 1);
        assert!(text.contains("width=\"900\" height=\"560\" viewBox=\"0 0 18000 11200\""));
        assert!(text.contains("a &lt; b &amp; c"));
    }
}
