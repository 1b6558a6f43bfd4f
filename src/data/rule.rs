//! What is asked of data, and what comes back.

use crate::error::{Error, Place};
use std::fmt::Display;
use std::path::PathBuf;

/// How values between the points are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Continuous, with kinks at the points.
    Linear,
    /// Cubic convolution of R. Keys (IEEE Trans. Acoust. Speech Signal Process. 29, 1981): the gradient is continuous, the error of third
    /// order in the spacing.
    Cubic,
}

impl Interpolation {
    /// Every one, by its word in a scene.
    pub const ALL: [(&str, Self); 2] = [("linear", Self::Linear), ("cubic", Self::Cubic)];
}

/// What data are beyond their points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// Nothing: who asks for it is refused.
    Error,
    /// The value at the nearest place that has one.
    Clamp,
    /// The same again and again: the point after the last one of a grid is the first.
    Periodic,
}

impl Outside {
    /// Every one, by its word in a scene.
    pub const ALL: [(&str, Self); 3] = [("error", Self::Error), ("clamp", Self::Clamp), ("periodic", Self::Periodic)];
}

/// A value and its gradient; NaN where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// Its derivatives by both arguments; the second is zero for a profile.
    pub gradient: [f64; 2],
}

impl Sample {
    /// Where there is no value.
    pub const NONE: Self = Self { value: f64::NAN, gradient: [f64::NAN; 2] };
}

/// What a scene says of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSpec {
    /// Name of the function.
    pub name: String,
    /// The file.
    pub file: PathBuf,
    /// Where it is named.
    pub place: Place,
    /// Whether each row is a place and a height, not a line of heights.
    pub points: bool,
    /// Place of the first height, or of the coordinates' origin.
    pub origin: [f64; 2],
    /// Distance of heights along a row and down the rows, or the length of one unit of the coordinates.
    pub spacing: [f64; 2],
    /// What a height of 1 in the file is.
    pub unit: f64,
    /// What is between the points.
    pub interpolation: Interpolation,
    /// What is beyond them.
    pub outside: Outside,
}

impl DataSpec {
    /// The refusal of its file: `what` continues "data `name`: file", `help` is the way out.
    pub(super) fn refuse(&self, what: impl Display, help: &str) -> Error {
        let Self { name, file, place, .. } = self;
        Error::scene(place, format!("data `{name}`: {} {what}", file.display())).help(help)
    }
}
