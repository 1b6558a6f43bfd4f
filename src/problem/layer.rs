//! Laws of layers: their forms and parameters.

use crate::expression::{Expression, Field};
use std::sync::Arc;

/// Law of a Winkler layer.
#[derive(Debug, Clone)]
pub enum LayerSpec {
    /// A law of a known form; its parameters are numbers or expressions in the coordinates.
    Form {
        /// Which one.
        form: &'static LawForm,
        /// One value for each of its parameters.
        values: Vec<Field>,
    },
    /// Monotone cubic curve through points (c, p), both increasing from (0, 0), which is not among them.
    Table(Vec<[f64; 2]>),
    /// Summits of a rough surface.
    Asperities(AsperitySpec),
    /// The law of this name that a Rust program gives the scene ([`Scene::law`](crate::scene::Scene::law)).
    Own(String),
    /// An expression p(c), which may also use the coordinates.
    Pressure {
        /// The expression; its first variable is c.
        law: Expression,
        /// Compression beyond which p goes on linearly, if given.
        up_to: Option<f64>,
    },
}

impl LayerSpec {
    /// p = (c/B)^(1/a) with B > 0 and a in (0, 1], the layer of the paper.
    pub fn power(b: impl Into<Field>, a: impl Into<Field>) -> Self {
        Self::Form { form: &POWER, values: vec![b.into(), a.into()] }
    }

    /// p = `stiffness` c with a stiffness (stress per length) > 0.
    pub fn linear(stiffness: impl Into<Field>) -> Self {
        Self::Form { form: &LINEAR, values: vec![stiffness.into()] }
    }

    /// p = p0 (e^(c/c0) - 1) with a stress p0 > 0 and a length c0 > 0.
    pub fn exponential(p0: impl Into<Field>, c0: impl Into<Field>) -> Self {
        Self::Form { form: &EXPONENTIAL, values: vec![p0.into(), c0.into()] }
    }

    /// p = k1 c + k3 c^3 with k1 > 0 and k3 >= 0.
    pub fn cubic(k1: impl Into<Field>, k3: impl Into<Field>) -> Self {
        Self::Form { form: &CUBIC, values: vec![k1.into(), k3.into()] }
    }
}

/// Summits of one radius at different heights, after Greenwood and Williamson.
#[derive(Debug, Clone, PartialEq)]
pub struct AsperitySpec {
    /// Number per area.
    pub density: f64,
    /// Their radius.
    pub radius: f64,
    /// E* of both bodies: 1/E* is the sum of (1 - nu^2)/E.
    pub modulus: f64,
    /// How far they lie below the highest.
    pub depths: Depths,
    /// Name of the data that they are from, if they are measured.
    pub data: Option<String>,
}

/// How summits are distributed below the highest one.
#[derive(Debug, Clone, PartialEq)]
pub enum Depths {
    /// A normal distribution of heights.
    Normal {
        /// Its standard deviation.
        deviation: f64,
        /// Height of the highest summit above the mean; none lies above.
        highest: f64,
    },
    /// Each summit of a measured surface, from 0 on and increasing.
    Measured(Arc<[f64]>),
}

/// Forms of laws with a few parameters.
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

/// A form of law: how it is called and what it needs.
#[derive(Debug, PartialEq, Eq)]
pub struct LawForm {
    /// Which one.
    pub kind: LawKind,
    /// Key of the scene.
    pub name: &'static str,
    /// Its parameters, in the order in which values are kept.
    pub parameters: &'static [Parameter],
}

/// A parameter of a law.
#[derive(Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Key of the scene.
    pub key: &'static str,
    /// Name in messages.
    pub what: &'static str,
    /// Values that make a law.
    pub bounds: Bounds,
}

/// Ranges of parameters.
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
    /// What is wrong with a value; `None` if it lies in the range.
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

/// Every form.
pub static FORMS: [&LawForm; 4] = [&POWER, &LINEAR, &EXPONENTIAL, &CUBIC];
