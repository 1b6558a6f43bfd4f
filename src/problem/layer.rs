//! Laws of layers p(c), pressure p over compression c: their forms and parameters.

use crate::expression::{Expression, Field};
use std::sync::Arc;

/// The law of a Winkler layer.
#[derive(Debug, Clone)]
pub enum LayerSpec {
    /// A law of a known form, whose parameters are numbers or expressions in the coordinates.
    Form {
        /// The form.
        form: &'static LawForm,
        /// One value for each parameter of the form.
        values: Vec<Field>,
    },
    /// A monotone cubic curve through points (c, p). Both columns increase from (0, 0), which is not among the points.
    Table(Vec<[f64; 2]>),
    /// A law from the summits of a rough surface.
    Asperities(AsperitySpec),
    /// The law of this name from a Rust program ([`Scene::law`](crate::scene::Scene::law)).
    Own(String),
    /// An expression p(c), which may use the coordinates, too.
    Pressure {
        /// The expression; its first variable is c.
        law: Expression,
        /// The compression (a length) beyond which p goes on linearly, if given.
        up_to: Option<f64>,
    },
}

impl LayerSpec {
    /// Return p = (c/B)^(1/a) with B > 0 and a in (0, 1], the layer of the paper.
    pub fn power(b: impl Into<Field>, a: impl Into<Field>) -> Self {
        Self::Form { form: &POWER, values: vec![b.into(), a.into()] }
    }

    /// Return p = `stiffness` c with a stiffness (stress per length) > 0.
    pub fn linear(stiffness: impl Into<Field>) -> Self {
        Self::Form { form: &LINEAR, values: vec![stiffness.into()] }
    }

    /// Return p = p0 (e^(c/c0) - 1) with a stress p0 > 0 and a length c0 > 0.
    pub fn exponential(p0: impl Into<Field>, c0: impl Into<Field>) -> Self {
        Self::Form { form: &EXPONENTIAL, values: vec![p0.into(), c0.into()] }
    }

    /// Return p = k1 c + k3 c^3 with k1 > 0 and k3 >= 0.
    pub fn cubic(k1: impl Into<Field>, k3: impl Into<Field>) -> Self {
        Self::Form { form: &CUBIC, values: vec![k1.into(), k3.into()] }
    }
}

/// Summits of one radius at different heights, after Greenwood and Williamson.
#[derive(Debug, Clone, PartialEq)]
pub struct AsperitySpec {
    /// Number of summits per area.
    pub density: f64,
    /// Radius of the summits (a length).
    pub radius: f64,
    /// E* of both bodies (a stress): 1/E* is the sum of (1 - nu^2)/E.
    pub modulus: f64,
    /// Depths of the summits below the highest one.
    pub depths: Depths,
    /// Name of the data with the surface, if the summits are measured.
    pub data: Option<String>,
}

/// How the summits are distributed below the highest one (lengths).
#[derive(Debug, Clone, PartialEq)]
pub enum Depths {
    /// A normal distribution of heights.
    Normal {
        /// Standard deviation of the heights.
        deviation: f64,
        /// Height of the highest summit above the mean. No summit lies above it.
        highest: f64,
    },
    /// The depth of each summit of a measured surface, increasing from 0.
    Measured(Arc<[f64]>),
}

/// The laws that have a form with a few parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawKind {
    /// p = stiffness c.
    Linear,
    /// p = (c/B)^(1/a).
    Power,
    /// p = p0 (e^(c/c0) - 1).
    Exponential,
    /// p = k1 c + k3 c^3.
    Cubic,
}

/// A form of law: its name and its parameters. The decoder, the JSON schema and the checks of a scene are made of this table.
#[derive(Debug, PartialEq, Eq)]
pub struct LawForm {
    /// The law.
    pub kind: LawKind,
    /// Key in the scene.
    pub name: &'static str,
    /// The parameters, in the order of the values of [`LayerSpec::Form`].
    pub parameters: &'static [Parameter],
}

/// A parameter of a law.
#[derive(Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Key in the scene.
    pub key: &'static str,
    /// Name in messages.
    pub what: &'static str,
    /// The range of values that make a law.
    pub bounds: Bounds,
}

/// The range of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bounds {
    /// Greater than 0.
    Positive,
    /// 0 or more.
    NotNegative,
    /// Greater than 0 and at most 1.
    UpToOne,
}

impl Bounds {
    /// Return what a value must be instead; `None` if it lies in the range.
    pub fn breach(self, value: f64) -> Option<&'static str> {
        match self {
            Bounds::Positive | Bounds::UpToOne if value <= 0.0 => Some("must be greater than 0"),
            Bounds::UpToOne if value > 1.0 => Some("must not exceed 1"),
            Bounds::NotNegative if value < 0.0 => Some("must not be negative"),
            _ => None,
        }
    }
}

const fn parameter(key: &'static str, what: &'static str, bounds: Bounds) -> Parameter {
    Parameter { key, what, bounds }
}

static POWER: LawForm = LawForm {
    kind: LawKind::Power,
    name: "power",
    parameters: &[parameter("B", "B", Bounds::Positive), parameter("a", "a", Bounds::UpToOne)],
};
static LINEAR: LawForm = LawForm {
    kind: LawKind::Linear,
    name: "linear",
    parameters: &[parameter("stiffness", "the stiffness", Bounds::Positive)],
};
static EXPONENTIAL: LawForm = LawForm {
    kind: LawKind::Exponential,
    name: "exponential",
    parameters: &[parameter("p0", "p0", Bounds::Positive), parameter("c0", "c0", Bounds::Positive)],
};
static CUBIC: LawForm = LawForm {
    kind: LawKind::Cubic,
    name: "cubic",
    parameters: &[parameter("k1", "k1", Bounds::Positive), parameter("k3", "k3", Bounds::NotNegative)],
};

/// All forms.
pub static FORMS: [&LawForm; 4] = [&POWER, &LINEAR, &EXPONENTIAL, &CUBIC];
