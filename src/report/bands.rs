//! Bands of equal value: the colours of pictures and of the interactive view, and the levels between them.

use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

/// Number of colours in a picture.
pub const BANDS: usize = 12;

/// Fraction of the largest pressure below which a contact is shown as open. Open points have no pressure, and sums of ten facets leave a rounding of
/// 1e-15. The pressures of an iteration are known to 1e-8 of the largest by default, so that no smaller one means contact.
const OPEN: f64 = 1e-9;

/// Return the colours from the smallest to the largest value: viridis, which colour-blind readers can follow.
pub fn colors() -> [[u8; 3]; BANDS] {
    std::array::from_fn(|band| {
        let color = ViridisRGB.get_color_normalized(band as f32, 0.0, (BANDS - 1) as f32);
        [color.0, color.1, color.2]
    })
}

/// Return a colour as `#rrggbb`.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Return the smallest and the largest finite value. They are never equal.
pub fn range<'a>(values: impl Iterator<Item = &'a f64>) -> [f64; 2] {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)]);
    if low < high {
        [low, high]
    } else if low == high {
        [low, low + low.abs().max(1e-300)]
    } else {
        [0.0, 1.0]
    }
}

/// The values of a band: from the first on, below the second.
pub type Band = [f64; 2];

/// The levels between the bands of a picture.
pub struct Levels {
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Whether the levels grow as squares. A stress peaks at contacts, and with equal steps most of a body would have the first colour.
    pub squares: bool,
    /// Whether values that are not positive have no band: contacts are open there.
    pub opens: bool,
}

impl Levels {
    /// Return the smallest value of each band, and the largest of all.
    pub fn levels(&self) -> Vec<f64> {
        let [least, most] = self.range;
        let fractions = (0..=BANDS).map(|band| band as f64 / BANDS as f64);
        fractions.map(|part| least + (most - least) * if self.squares { part * part } else { part }).collect()
    }

    /// Return whether a value is that of an open contact.
    pub fn is_open(&self, value: f64) -> bool {
        self.opens && value < OPEN * self.range[1]
    }

    /// Return the bands with their numbers; an open contact is a band without a number, before the others. Together they have all values.
    pub fn bands(&self) -> Vec<(Option<usize>, Band)> {
        let levels = self.levels();
        let first = if self.opens { OPEN * self.range[1] } else { f64::NEG_INFINITY };
        let open = self.opens.then_some((None, [f64::NEG_INFINITY, first]));
        let band = |band: usize| {
            let from = if band == 0 { first } else { levels[band] };
            (Some(band), [from, if band + 1 < BANDS { levels[band + 1] } else { f64::INFINITY }])
        };
        open.into_iter().chain((0..BANDS).map(band)).collect()
    }
}
