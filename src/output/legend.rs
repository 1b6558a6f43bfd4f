//! The legend: inside the axes where it covers no curve, else beside them.

use super::canvas::{Canvas, Font, Frame, Hold, Pixel, shorten, text_width};
use super::look::Look;
use plotters::style::{BLACK, Color, RGBColor, WHITE};
use std::io;

const SIZE: f64 = 13.0;
const LINE: f64 = 20.0;
const SAMPLE: f64 = 30.0;
const PADDING: f64 = 9.0;
/// Widest label.
const LABEL: f64 = 230.0;
/// Most entries that stand inside.
const INSIDE: usize = 4;
/// Distance from the frame.
const MARGIN: f64 = 10.0;

/// One line of the legend.
pub(super) struct Entry {
    pub label: String,
    pub look: Look,
}

/// All lines of the legend.
pub(super) struct Legend(Vec<Entry>);

impl Legend {
    /// A legend of these entries, long labels cut.
    pub fn new(mut entries: Vec<Entry>) -> Self {
        for entry in &mut entries {
            entry.label = shorten(&entry.label, SIZE, LABEL);
        }
        Self(entries)
    }

    /// Whether there are too many entries to stand inside.
    pub fn needs_room_outside(&self) -> bool {
        self.0.len() > INSIDE
    }

    /// Width in pixels.
    pub fn width(&self) -> f64 {
        let widest = self.0.iter().map(|entry| text_width(&entry.label, SIZE)).fold(0.0, f64::max);
        widest + SAMPLE + 3.0 * PADDING
    }

    fn height(&self) -> f64 {
        self.0.len() as f64 * LINE + PADDING
    }

    /// Top left of the legend at the place within the frame where it covers no curve; `None` if there is none.
    pub fn corner(&self, frame: Frame, curves: &[Vec<Vec<Pixel>>]) -> Option<Pixel> {
        let (width, height) = (self.width(), self.height());
        let near = (frame.left + MARGIN, frame.top + MARGIN);
        let far = (frame.right - MARGIN - width, frame.bottom - MARGIN - height);
        let middle = ((near.0 + far.0) / 2.0, (near.1 + far.1) / 2.0);
        let places = [
            (far.0, near.1),
            near,
            (far.0, far.1),
            (near.0, far.1),
            (middle.0, near.1),
            (far.0, middle.1),
            (middle.0, far.1),
            (near.0, middle.1),
        ];
        let free = |&(x, y): &Pixel| {
            let (low, high) = ((x - 6.0, y - 6.0), (x + width + 6.0, y + height + 6.0));
            !curves.iter().flatten().any(|piece| meets(piece, low, high))
        };
        places.into_iter().find(free)
    }

    /// Draws the legend with its top left at a place; entries that the picture has no room for are counted.
    pub fn draw(&self, canvas: &Canvas, (x, y): Pixel, frame: Frame) -> io::Result<()> {
        if self.0.is_empty() {
            return Ok(());
        }
        let room = ((frame.bottom - y - PADDING) / LINE) as usize;
        let shown = if self.0.len() > room { room.saturating_sub(1) } else { self.0.len() };
        let lines = shown + usize::from(shown < self.0.len());
        let (right, bottom) = (x + self.width(), y + lines as f64 * LINE + PADDING);
        canvas.fill((x, y), (right, bottom), WHITE.to_rgba())?;
        let corners = [(x, y), (right, y), (right, bottom), (x, bottom), (x, y)];
        canvas.line(&corners, 0.8, RGBColor(190, 190, 190).to_rgba())?;
        let font = Font { size: SIZE, bold: false, color: BLACK, hold: Hold::Left, upward: false };
        let text_x = x + 2.0 * PADDING + SAMPLE;
        for (index, entry) in self.0.iter().take(shown).enumerate() {
            let middle = y + PADDING / 2.0 + (index as f64 + 0.5) * LINE;
            entry.draw(canvas, (x + PADDING, middle))?;
            canvas.text(&entry.label, (text_x, middle), font)?;
        }
        if shown < self.0.len() {
            let middle = y + PADDING / 2.0 + (shown as f64 + 0.5) * LINE;
            canvas.text(&format!("and {} more", self.0.len() - shown), (text_x, middle), font)?;
        }
        Ok(())
    }
}

impl Entry {
    fn draw(&self, canvas: &Canvas, (x, y): Pixel) -> io::Result<()> {
        self.look.sample(canvas, (x, y), SAMPLE)
    }
}

/// Whether a line, or a point alone, meets a rectangle.
fn meets(points: &[Pixel], low: Pixel, high: Pixel) -> bool {
    let [first, ..] = points else { return false };
    let pairs = points.windows(2).map(|pair| (pair[0], pair[1]));
    pairs.chain([(*first, *first)]).any(|(a, b)| segment_meets(a, b, low, high))
}

/// Clips the segment at the four sides: it meets the rectangle if something is left.
fn segment_meets(a: Pixel, b: Pixel, low: Pixel, high: Pixel) -> bool {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, step, low, high) in [(a.0, b.0 - a.0, low.0, high.0), (a.1, b.1 - a.1, low.1, high.1)] {
        if step == 0.0 {
            if start < low || start > high {
                return false;
            }
            continue;
        }
        let (one, other) = ((low - start) / step, (high - start) / step);
        from = from.max(one.min(other));
        to = to.min(one.max(other));
    }
    from <= to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_that_cross_without_an_end_inside_are_seen() {
        let meets = |a, b| segment_meets(a, b, (0.0, 0.0), (2.0, 1.0));
        assert!(meets((-1.0, 0.5), (3.0, 0.5)));
        assert!(meets((-1.0, -1.0), (3.0, 2.0)));
        assert!(!meets((-1.0, 0.5), (-0.1, 0.5)));
        assert!(!meets((-1.0, 0.9), (0.5, 2.0)));
        assert!(meets((3.0, 2.0), (-1.0, -1.0)));
        assert!(!meets((0.5, 2.0), (-1.0, 0.9)));
        assert!(meets((1.0, 0.5), (1.0, 0.5)));
        assert!(!meets((3.0, 0.5), (3.0, 0.5)));
    }

    #[test]
    fn an_empty_legend_takes_no_room() {
        let legend = Legend::new(Vec::new());
        let frame = Frame { left: 0.0, right: 800.0, top: 0.0, bottom: 500.0 };
        assert!(!legend.needs_room_outside());
        assert!(legend.corner(frame, &[]).is_some());
    }
}
