//! Laws of layers p(c), pressure p over compression c, and their parameters.

use super::check::{Check, Fault, positive};
use super::compile::{Compile, Names, compile};
use super::geometry::Geometry;
use super::read::{Refusal, located, only_one, place};
use crate::error::{Error, Kind, Located, Result as Checked, shown};
use crate::expression::{Expression, Field};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The law of a Winkler layer. Parameters are numbers or expressions in the coordinates.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "LayerKeys", rename_all = "lowercase")]
pub enum LayerSpec {
    /// p = (c/B)^(1/a), the layer of the paper.
    Power(PowerSpec),
    /// p = stiffness c.
    Linear(LinearSpec),
    /// p = p0 (e^(c/c0) - 1).
    Exponential(ExponentialSpec),
    /// p = k1 c + k3 c^3.
    Cubic(CubicSpec),
    /// A monotone cubic curve through points (c, p). Both columns increase from (0, 0), which is not among the points.
    Table(Vec<[f64; 2]>),
    /// The law of this name from a Rust program ([`Scene::law`](crate::scene::Scene::law)).
    Own(String),
    /// An expression p(c), which may use the coordinates, too.
    #[serde(untagged)]
    Pressure {
        /// The expression; its first variable is c.
        #[serde(rename = "pressure")]
        law: Expression,
        /// The compression (a length) beyond which p goes on linearly, if given.
        up_to: Option<f64>,
    },
}

/// How a layer is unloaded from its largest compression so far.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(try_from = "LayerKeys", untagged)]
pub enum UnloadSpec {
    /// By this law of the way back and of how far the pressure has fallen.
    Law(LayerSpec),
    /// Along straight lines, by points (compression, pressure, slope) of the law: the slope depends on the largest
    /// pressure so far.
    Slopes(Vec<[f64; 3]>),
}

impl Compile for UnloadSpec {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        match self {
            Self::Law(law) => law.compile(names),
            Self::Slopes(_) => Ok(()),
        }
    }
}

impl Check for UnloadSpec {
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        match self {
            Self::Law(law) => law.check(geometry),
            Self::Slopes(rows) => {
                check_table(&rows.iter().map(|&[c, p, _]| [c, p]).collect::<Vec<_>>())?;
                rows.iter().try_for_each(|[_, _, slope]| positive("table", "a slope of unloading", *slope))
            }
        }
    }
}

impl TryFrom<LayerKeys> for UnloadSpec {
    type Error = Refusal;

    /// Tables have two columns, as those of a layer, or three.
    fn try_from(keys: LayerKeys) -> Result<Self, Refusal> {
        let rows = keys.table.iter().flat_map(|table| &table.value);
        let rows: Option<Vec<[f64; 3]>> = rows.map(|row| row.value[..].try_into().ok()).collect();
        match rows.filter(|rows| !rows.is_empty()) {
            Some(rows) => Ok(Self::Slopes(rows)),
            None => LayerSpec::try_from(keys).map(Self::Law),
        }
    }
}

/// The parameters of the power law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerSpec {
    /// compression at unit pressure, > 0
    #[serde(rename = "B")]
    pub b: Field,
    /// exponent of the pressure, > 0 and at most 1
    pub a: Field,
}

/// The parameter of the linear law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearSpec {
    /// pressure per compression, > 0
    pub stiffness: Field,
}

/// The parameters of the exponential law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExponentialSpec {
    /// a pressure, > 0
    pub p0: Field,
    /// a length, > 0
    pub c0: Field,
}

/// The parameters of the cubic law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CubicSpec {
    /// stiffness at first touch, > 0
    pub k1: Field,
    /// coefficient of the cube, >= 0
    pub k3: Field,
}

compile!(PowerSpec { b, a } else {});
compile!(LinearSpec { stiffness } else {});
compile!(ExponentialSpec { p0, c0 } else {});
compile!(CubicSpec { k1, k3 } else {});

impl Compile for LayerSpec {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        match self {
            Self::Power(law) => law.compile(names),
            Self::Linear(law) => law.compile(names),
            Self::Exponential(law) => law.compile(names),
            Self::Cubic(law) => law.compile(names),
            Self::Pressure { law, .. } => law.compile(&names.with(&[&["c"], names.variables].concat())),
            Self::Table(_) | Self::Own(_) => Ok(()),
        }
    }
}

impl LayerSpec {
    /// Return p = (c/B)^(1/a) with B > 0 and a in (0, 1], the layer of the paper.
    pub fn power(b: impl Into<Field>, a: impl Into<Field>) -> Self {
        Self::Power(PowerSpec { b: b.into(), a: a.into() })
    }

    /// Return p = `stiffness` c with a stiffness (stress per length) > 0.
    pub fn linear(stiffness: impl Into<Field>) -> Self {
        Self::Linear(LinearSpec { stiffness: stiffness.into() })
    }

    /// Return p = p0 (e^(c/c0) - 1) with a stress p0 > 0 and a length c0 > 0.
    pub fn exponential(p0: impl Into<Field>, c0: impl Into<Field>) -> Self {
        Self::Exponential(ExponentialSpec { p0: p0.into(), c0: c0.into() })
    }

    /// Return p = k1 c + k3 c^3 with k1 > 0 and k3 >= 0.
    pub fn cubic(k1: impl Into<Field>, k3: impl Into<Field>) -> Self {
        Self::Cubic(CubicSpec { k1: k1.into(), k3: k3.into() })
    }

    /// Return the name of the law and its parameters, for a law that has some.
    pub fn parameters(&self) -> (&'static str, Vec<Parameter<'_>>) {
        use Bounds::{NotNegative, Positive, UpToOne};
        let (law, list) = match self {
            Self::Power(law) => ("power", vec![("B", &law.b, Positive), ("a", &law.a, UpToOne)]),
            Self::Linear(law) => ("linear", vec![("stiffness", &law.stiffness, Positive)]),
            Self::Exponential(law) => ("exponential", vec![("p0", &law.p0, Positive), ("c0", &law.c0, Positive)]),
            Self::Cubic(law) => ("cubic", vec![("k1", &law.k1, Positive), ("k3", &law.k3, NotNegative)]),
            Self::Table(_) | Self::Own(_) | Self::Pressure { .. } => ("", Vec::new()),
        };
        (law, list.into_iter().map(|(key, value, bounds)| Parameter { key, value, bounds }).collect())
    }

    /// Return whether the law is known to be the same at all points.
    pub fn is_uniform(&self) -> bool {
        match self {
            Self::Own(_) => false,
            Self::Pressure { law, .. } => law.uses_only_first(),
            _ => self.parameters().1.iter().all(|parameter| parameter.value.is_constant()),
        }
    }
}

/// A parameter of a law.
#[derive(Debug, Clone, Copy)]
pub struct Parameter<'a> {
    /// Key in the scene, and name in messages.
    pub key: &'static str,
    /// The value.
    pub value: &'a Field,
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

/// The keys of a layer.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LayerKeys {
    /// write power = { B = ..., a = ... }
    #[serde(default, deserialize_with = "located")]
    power: Option<Located<PowerSpec>>,
    /// write linear = { stiffness = ... }
    #[serde(default, deserialize_with = "located")]
    linear: Option<Located<LinearSpec>>,
    /// write exponential = { p0 = ..., c0 = ... }
    #[serde(default, deserialize_with = "located")]
    exponential: Option<Located<ExponentialSpec>>,
    /// write cubic = { k1 = ..., k3 = ... }
    #[serde(default, deserialize_with = "located")]
    cubic: Option<Located<CubicSpec>>,
    /// write table = [[1e-5, 2], [2e-5, 10]]: compressions and pressures, both increasing from 0
    table: Option<Located<Vec<Located<Vec<f64>>>>>,
    /// p as an expression in c and the coordinates: pressure = "1e5*c + 1e9*c^2"
    pressure: Option<Located<String>>,
    /// compression beyond which the expression goes on linearly
    up_to: Option<Located<f64>>,
}

impl TryFrom<LayerKeys> for LayerSpec {
    type Error = Refusal;

    fn try_from(keys: LayerKeys) -> Result<Self, Refusal> {
        let LayerKeys { power, linear, exponential, cubic, table, pressure, up_to } = keys;
        if let (Some(end), None) = (&up_to, &pressure) {
            return Err(Error::scene(&end.place, "`up_to` without an expression")
                .help("it says how far `pressure = \"...\"` goes; other laws need no end")
                .into());
        }
        let up_to = up_to.map(|end| end.value);
        let of_text = |text: Located<String>| {
            let law = Expression::uncompiled(&text.value, text.place.clone());
            Located::new(Self::Pressure { law, up_to }, text.place)
        };
        let of_table = |table: Located<_>| Ok::<_, Error>(Located::new(of_points(table.value)?, table.place));
        let laws = [
            ("power", given(power, Self::Power)),
            ("linear", given(linear, Self::Linear)),
            ("exponential", given(exponential, Self::Exponential)),
            ("cubic", given(cubic, Self::Cubic)),
            ("table", table.map(of_table).transpose()?),
            ("pressure", pressure.map(of_text)),
        ];
        only_one("the layer", &laws.each_ref().map(|(key, law)| (*key, place(law))))?;
        laws.into_iter().find_map(|(_, law)| law).map(|law| law.value).ok_or_else(|| {
            let help = "give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }";
            Error::new(Kind::Scene, "the layer has no law").help(help).into()
        })
    }
}

/// Return the law of parameters that are given, at their place.
fn given<T>(parameters: Option<Located<T>>, law: impl FnOnce(T) -> LayerSpec) -> Option<Located<LayerSpec>> {
    parameters.map(|Located { value, place }| Located::new(law(value), place))
}

/// Return the law through points (c, p).
fn of_points(given: Vec<Located<Vec<f64>>>) -> Checked<LayerSpec> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for point in given {
        let &[c, p] = &point.value[..] else {
            return Err(Error::scene(&point.place, "a point of the table is a compression and a pressure")
                .help("write table = [[1e-5, 2], [2e-5, 10]]: compressions and pressures, both increasing from 0"));
        };
        points.push([c, p]);
    }
    if points.first() == Some(&[0.0, 0.0]) {
        points.remove(0); // every law begins at the origin
    }
    Ok(LayerSpec::Table(points))
}

impl Check for LayerSpec {
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        let (law, parameters) = self.parameters();
        for Parameter { key, value, bounds } in parameters {
            let Field::Constant(value) = *value else { continue };
            let Some(breach) = bounds.breach(value) else { continue };
            let steep = "p(c) = (c/B)^(1/a) with a > 1 is infinitely stiff at first touch, p'(0) = infinity";
            let help = if breach == "must not exceed 1" { steep } else { "" };
            return Err(Fault::new(format!("{law}.{key}"), format!("{key} is {}", shown(value)), breach, help));
        }
        match self {
            LayerSpec::Table(points) => check_table(points),
            LayerSpec::Pressure { up_to: Some(end), .. } => positive("up_to", "the end of the law", *end),
            _ => Ok(()),
        }
    }
}

/// Check that compressions and pressures (c, p) increase from (0, 0).
fn check_table(points: &[[f64; 2]]) -> Result<(), Fault> {
    if points.is_empty() {
        return Err(Fault::new("table", "the table has no point", "", "write table = [[1e-5, 2], [2e-5, 10]]"));
    }
    for (before, point) in std::iter::once(&[0.0; 2]).chain(points).zip(points) {
        for (k, what) in ["compression", "pressure"].into_iter().enumerate() {
            if point[k] <= before[k] || !point[k].is_finite() {
                let values = [point[k], before[k]].map(shown).join(" of the table does not exceed ");
                let help = "a layer's law increases from p(0) = 0";
                return Err(Fault::new("table", format!("the {what} {values}"), "", help));
            }
        }
    }
    Ok(())
}
