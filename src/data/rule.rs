//! The settings of data in a scene, and the values that data give.

use crate::error::{Error, Located};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::path::PathBuf;

/// The interpolation between points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// Continuous, with kinks at the points.
    #[default]
    Linear,
    /// Cubic convolution of R. Keys (IEEE Trans. Acoust. Speech Signal Process. 29, 1981): the gradient is continuous,
    /// the error of third order in the spacing.
    Cubic,
}

/// The values of data beyond their points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Outside {
    /// No value: an expression that needs one is refused.
    #[default]
    Error,
    /// The value at the nearest place that has one.
    Clamp,
    /// Periodic repetition: the point after the last one of a grid is the first.
    Periodic,
}

/// The shape that is subtracted from the heights, fitted by least squares.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Detrend {
    /// Nothing.
    #[default]
    None,
    /// A plane; a straight line for a profile.
    Plane,
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DataSpec {
    /// Name of the function.
    #[serde(skip)]
    pub name: String,
    /// The file.
    pub file: Located<PathBuf>,
    /// Place of the first height.
    pub origin: [f64; 2],
    /// Distance of heights along a row and from row to row.
    pub spacing: [f64; 2],
    /// The height in the scene of a height of 1 in the file.
    pub unit: f64,
    /// The shape that is subtracted.
    pub detrend: Detrend,
    /// Interpolation between the points.
    #[serde(rename = "interpolate")]
    pub interpolation: Interpolation,
    /// Values beyond the points.
    pub outside: Outside,
}

impl DataSpec {
    /// Return a refusal of the file. `what` continues the message "data `name`: file"; `help` is the advice.
    pub(super) fn refuse(&self, what: impl Display, help: &str) -> Error {
        let Self { name, file, .. } = self;
        Error::scene(&file.place, format!("data `{name}`: {} {what}", file.display())).help(help)
    }
}
