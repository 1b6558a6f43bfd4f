//! Laws of layers p(c), pressure p over compression c: their forms and parameters.

use crate::error::{Error, Result};
use crate::expression::{Expression, Field, KnownNames};
use crate::setting::{Context, Entries, Keys, Node, Setting, TableShape, ValueKind};
use serde_json::{Value as Json, json};

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

/// Advice for a layer without a law.
const EXAMPLE: &str = "give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }";
/// What a table of points is, and the advice for wrong points.
const POINTS: &str = "write table = [[1e-5, 2], [2e-5, 10]]: compressions and pressures, both increasing from 0";

fn shape() -> TableShape {
    use ValueKind::{Number, Text};
    let laws: Vec<&str> = FORMS.iter().map(|form| form.name).chain(["table", "pressure"]).collect();
    FORMS
        .into_iter()
        .fold(TableShape::new("the layer"), with_form)
        .optional("table", Number.list().list(), POINTS)
        .optional("pressure", Text, "p as an expression in c and the coordinates: pressure = \"1e5*c + 1e9*c^2\"")
        .optional("up_to", Number, "compression beyond which the expression goes on linearly")
        .at_most_one(&laws)
}

/// Add the key of a law with parameters.
fn with_form(table: TableShape, form: &'static LawForm) -> TableShape {
    let values: Vec<String> = form.parameters.iter().map(|known| format!("{} = ...", known.key)).collect();
    let advice = format!("write {} = {{ {} }}", form.name, values.join(", "));
    table.optional(form.name, form_shape(form), advice)
}

/// Return the shape of a law with parameters.
fn form_shape(form: &'static LawForm) -> TableShape {
    use ValueKind::Field;
    let table = TableShape::new(format!("the {} layer", form.name));
    form.parameters.iter().fold(table, |table, known| table.required(known.key, Field, known.what))
}

impl Setting for LayerSpec {
    fn kind() -> ValueKind {
        shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &shape())?;
        if let (Some(entry), None) = (keys.entry("up_to"), keys.get("pressure")) {
            return Err(Error::scene(&entry.key_place, "`up_to` without an expression")
                .help("it says how far `pressure = \"...\"` goes; other laws need no end"));
        }
        if let Some(points) = keys.get("table") {
            return table(points);
        }
        if let Some(law) = keys.get("pressure") {
            let scope = KnownNames { variables: &["c", "x", "y", "z"][..=context.dimension], data: &context.data };
            let law = Expression::parse(law.string()?, &law.place, scope)?;
            return Ok(LayerSpec::Pressure { law, up_to: keys.read("up_to", Node::number)? });
        }
        match FORMS.into_iter().find_map(|form| Some((form, keys.get(form.name)?))) {
            Some((form, node)) => read_form(form, node, context),
            None => Err(keys.node.refuse("the layer has no law").help(EXAMPLE)),
        }
    }

    fn echo(&self, dimension: usize) -> Json {
        match self {
            Self::Form { form, values } => {
                let named = form.parameters.iter().zip(values);
                let values = named.map(|(known, value)| (known.key.to_owned(), value.echo(dimension)));
                json!({ form.name: values.collect::<Entries>() })
            }
            Self::Table(points) => json!({ "table": points }),
            Self::Own(name) => json!({ "own": name }),
            Self::Pressure { law, up_to: None } => json!({ "pressure": law.text() }),
            Self::Pressure { law, up_to } => json!({ "pressure": law.text(), "up_to": up_to }),
        }
    }
}

/// Return a law with the values of its parameters.
fn read_form(form: &'static LawForm, node: &Node, context: &Context) -> Result<LayerSpec> {
    let keys = Keys::open(node, &form_shape(form))?;
    let value = |parameter: &Parameter| Field::read(keys.require(parameter.key)?, context);
    let values = form.parameters.iter().map(value).collect::<Result<_>>()?;
    Ok(LayerSpec::Form { form, values })
}

/// Return the law through points (c, p).
fn table(node: &Node) -> Result<LayerSpec> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for item in node.list()? {
        let [c, p] = item.list().map_err(|error| error.help(POINTS))? else {
            return Err(item.refuse("a point of the table is a compression and a pressure").help(POINTS));
        };
        points.push([c.number()?, p.number()?]);
    }
    if points.first() == Some(&[0.0, 0.0]) {
        points.remove(0); // every law begins at the origin
    }
    Ok(LayerSpec::Table(points))
}
