//! The settings of data in a scene, the numbers of a file in rows, and the values that data give.

use crate::error::{Error, Place};
use std::fmt::Display;
use std::path::PathBuf;

/// The interpolation between points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Continuous, with kinks at the points.
    Linear,
    /// Cubic convolution of R. Keys (IEEE Trans. Acoust. Speech Signal Process. 29, 1981): the gradient is continuous, the error of third
    /// order in the spacing.
    Cubic,
}

impl Interpolation {
    /// All variants with their names in a scene.
    pub const ALL: [(&str, Self); 2] = [("linear", Self::Linear), ("cubic", Self::Cubic)];
}

/// The values of data beyond their points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// No value: an expression that needs one is refused.
    Error,
    /// The value at the nearest place that has one.
    Clamp,
    /// Periodic repetition: the point after the last one of a grid is the first.
    Periodic,
}

impl Outside {
    /// All variants with their names in a scene.
    pub const ALL: [(&str, Self); 3] = [("error", Self::Error), ("clamp", Self::Clamp), ("periodic", Self::Periodic)];
}

/// What to do about points without a height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// Refuse the file.
    Error,
    /// Take the height of the nearest point that has one.
    Nearest,
    /// Interpolate between the points around a gap, by planes over their Delaunay triangles.
    Linear,
}

impl Fill {
    /// All variants with their names in a scene.
    pub const ALL: [(&str, Self); 3] = [("error", Self::Error), ("nearest", Self::Nearest), ("linear", Self::Linear)];
}

/// The shape that is subtracted from the heights, fitted by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detrend {
    /// Nothing.
    None,
    /// A plane; a straight line for a profile.
    Plane,
    /// A polynomial of degree two.
    Parabola,
}

impl Detrend {
    /// All variants with their names in a scene.
    pub const ALL: [(&str, Self); 3] = [("none", Self::None), ("plane", Self::Plane), ("parabola", Self::Parabola)];
}

/// What stands in a file for points without a height. NaN always does.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoData {
    /// Numbers.
    pub numbers: Vec<f64>,
    /// Words in the place of a number; the empty word is a field without characters.
    pub words: Vec<String>,
}

/// Relative difference up to which a number of a file is the one that the scene names. People copy such numbers with six digits, which is
/// half a unit of the sixth digit of a number that begins with one.
const SAME: f64 = 5e-6;

impl NoData {
    /// Return whether a number stands for no height.
    pub fn has(&self, number: f64) -> bool {
        !number.is_finite() || self.numbers.iter().any(|&named| (number - named).abs() <= SAME * named.abs())
    }

    /// Return whether a word stands for no height.
    pub fn has_word(&self, word: &str) -> bool {
        self.words.iter().any(|named| named == word)
    }
}

/// A value and its gradient; NaN where there is no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub value: f64,
    /// The derivatives by both arguments; the second is zero for a profile.
    pub gradient: [f64; 2],
}

impl Sample {
    /// The sample of a place without a value.
    pub const NONE: Self = Self { value: f64::NAN, gradient: [f64::NAN; 2] };
}

/// The settings of a file of data in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSpec {
    /// Name of the function.
    pub name: String,
    /// The file.
    pub file: PathBuf,
    /// The place in the scene where the file is named.
    pub place: Place,
    /// Whether each row is a place and a height. Else it is a line of heights.
    pub points: bool,
    /// Place of the first height, or of the coordinates' origin.
    pub origin: [f64; 2],
    /// Distance of heights along a row and down the rows, or the length of one unit of the coordinates.
    pub spacing: [f64; 2],
    /// The height in the scene of a height of 1 in the file.
    pub unit: f64,
    /// What stands for points without a height; none if the scene does not say.
    pub missing: Option<NoData>,
    /// What to do about points without a height.
    pub fill: Fill,
    /// The shape that is subtracted before gaps are filled.
    pub detrend: Detrend,
    /// Interpolation between the points.
    pub interpolation: Interpolation,
    /// Values beyond the points.
    pub outside: Outside,
}

impl DataSpec {
    /// Return a refusal of the file. `what` continues the message "data `name`: file"; `help` is the advice.
    pub(super) fn refuse(&self, what: impl Display, help: &str) -> Error {
        let Self { name, file, place, .. } = self;
        Error::scene(place, format!("data `{name}`: {} {what}", file.display())).help(help)
    }
}

/// The place of heights, where the file says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridFrame {
    /// Place of the first height.
    pub origin: [f64; 2],
    /// Distance of heights along a row and from row to row.
    pub spacing: [f64; 2],
}

/// Numbers in rows of one length. Once [`read`](super::read) has checked them, coordinates are finite, and a height is finite or NaN.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NumberRows {
    /// Number of columns.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Vec<f64>,
    /// The line of each row if the file is a text; else empty.
    pub lines: Vec<u64>,
    /// The place of the heights, if the file says it.
    pub frame: Option<GridFrame>,
}

impl NumberRows {
    /// Return the number of rows.
    pub fn count(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Return the first column that has heights: the last one if each row is a point, else column 0.
    pub fn first_height(&self, points: bool) -> usize {
        if points { self.columns.saturating_sub(1) } else { 0 }
    }

    /// Return the line of a row as a text, or else its index.
    pub fn line(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }
}
