//! `layer` of a contact: a form with parameters, a table, or an expression.

use super::Decoder;
use crate::data::{Grid, Summits};
use crate::error::{Error, Result, nearest, shown};
use crate::expression::{Differentiable, Field, Scope};
use crate::problem::layer::{AsperitySpec, Depths, FORMS, LawForm, LayerSpec};
use crate::scene::read::{Keys, Node};

impl Decoder<'_> {
    pub(super) fn layer(&self, node: &Node) -> Result<LayerSpec> {
        const EXAMPLE: &str = "give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }";
        let laws: Vec<&str> = FORMS.iter().map(|form| form.name).chain(["table", "pressure", "asperities"]).collect();
        let known: Vec<&str> = laws.iter().copied().chain(["up_to"]).collect();
        let keys = Keys::open(node, "the layer", &known).map_err(|error| match error.advice() {
            Some(advice) if advice.starts_with("did") => error,
            _ => error.help(format!("{EXAMPLE}; the laws are {}", laws.join(", "))),
        })?;
        for (i, one) in laws.iter().enumerate() {
            laws[i + 1..].iter().try_for_each(|other| keys.exclude(one, other))?;
        }
        if let (Some(entry), None) = (keys.entry("up_to"), keys.get("pressure")) {
            return Err(Error::scene(&entry.key_place, "`up_to` without an expression")
                .help("it says how far `pressure = \"...\"` goes; other laws need no end"));
        }
        if let Some(points) = keys.get("table") {
            return table(points);
        }
        if let Some(summits) = keys.get("asperities") {
            return self.asperities(summits);
        }
        if let Some(law) = keys.get("pressure") {
            let names: &[&'static str] = if self.dimension == 3 { &["c", "x", "y", "z"] } else { &["c", "x", "y"] };
            let scope = Scope { variables: names, data: &self.data };
            let law = Differentiable::parse(law.string()?, &law.place, scope)?;
            let up_to = keys.get("up_to").map(|end| end.positive("the end of the law")).transpose()?;
            return Ok(LayerSpec::Pressure { law, up_to });
        }
        match FORMS.iter().find_map(|form| Some((form, keys.get(form.name)?))) {
            Some((form, node)) => self.form(form, node),
            None => Err(keys.node().refuse("the layer has no law").help(EXAMPLE)),
        }
    }

    /// The parameters of a form; numbers are checked here, expressions at the contact points.
    fn form(&self, form: &'static LawForm, node: &Node) -> Result<LayerSpec> {
        let what = format!("the {} layer", form.name);
        let known: Vec<&str> = form.parameters.iter().map(|parameter| parameter.key).collect();
        let keys = Keys::open(node, &what, &known)?;
        let mut values = Vec::new();
        for parameter in form.parameters {
            let node = keys.require(parameter.key)?;
            let field = self.field(node)?;
            if let Field::Constant(value) = field
                && let Some(breach) = parameter.bounds.breach(value)
            {
                let error = node.refuse(format!("{} is {}", parameter.what, shown(value))).label(breach);
                return Err(match breach {
                    "must not exceed 1" => {
                        error.help("p(c) = (c/B)^(1/a) with a > 1 is infinitely stiff at first touch, p'(0) = infinity")
                    }
                    _ => error,
                });
            }
            values.push(field);
        }
        Ok(LayerSpec::Form { form, values })
    }
}

/// Standard deviations from the mean to the highest summit, if nobody says it: a share of 3e-5 of a normal distribution lies above.
const HIGHEST: f64 = 4.0;

impl Decoder<'_> {
    /// Summits, by numbers or of data.
    fn asperities(&self, node: &Node) -> Result<LayerSpec> {
        let keys = Keys::open(
            node,
            "the layer of asperities",
            &["modulus", "data", "density", "radius", "deviation", "highest"],
        )?;
        let positive = |key: &str| {
            let missing = |error: Error| {
                error.help(
                    "give modulus = E* and data = \"NAME\", or modulus, density, radius and deviation of the summits",
                )
            };
            keys.require(key).map_err(missing)?.positive(&format!("the {key}"))
        };
        let modulus = positive("modulus")?;
        let Some(named) = keys.get("data") else {
            let deviation = positive("deviation")?;
            let highest =
                keys.get("highest").map_or(Ok(HIGHEST * deviation), |node| node.positive("the highest summit"))?;
            let depths = Depths::Normal { deviation, highest };
            let (density, radius) = (positive("density")?, positive("radius")?);
            return Ok(LayerSpec::Asperities(AsperitySpec { density, radius, modulus, depths, data: None }));
        };
        for own in ["density", "radius", "deviation", "highest"] {
            keys.exclude("data", own)?;
        }
        let name = named.string()?;
        let Some(data) = self.data.get(name) else {
            let error = named.refuse(format!("there are no data `{name}`"));
            return Err(match nearest(name, self.data.keys().map(String::as_str)) {
                Some(near) => error.help(format!("did you mean `{near}`?")),
                None => error.help(format!("write [data.{name}] and below it file = \"surface.csv\"")),
            });
        };
        data.load()?;
        let Some(summits) = data.grid().and_then(Grid::summits) else {
            return Err(named
                .refuse(format!("data `{name}` have no summits"))
                .help("summits are points of a regular grid that are higher than the eight around them"));
        };
        let Summits { density, radius, heights } = summits;
        let depths = Depths::Measured(heights.iter().map(|height| heights[0] - height).collect());
        Ok(LayerSpec::Asperities(AsperitySpec { density, radius, modulus, depths, data: Some(name.to_owned()) }))
    }
}

/// Points (c, p), both increasing from zero.
fn table(node: &Node) -> Result<LayerSpec> {
    const EXAMPLE: &str = "write table = [[1e-5, 2], [2e-5, 10]]: compressions and pressures, both increasing from 0";
    let mut points: Vec<[f64; 2]> = Vec::new();
    for item in node.list().map_err(|error| error.help(EXAMPLE))? {
        let [c, p] = item.list().map_err(|error| error.help(EXAMPLE))? else {
            return Err(item.refuse("a point of the table is a compression and a pressure").help(EXAMPLE));
        };
        let point = [c.number()?, p.number()?];
        if points.is_empty() && point == [0.0, 0.0] {
            continue; // every law begins there
        }
        let last = points.last().copied().unwrap_or([0.0, 0.0]);
        for (i, (what, node)) in [("compression", c), ("pressure", p)].into_iter().enumerate() {
            if point[i] <= last[i] {
                return Err(node
                    .refuse(format!("the {what} {} of the table does not exceed {}", shown(point[i]), shown(last[i])))
                    .label("must be greater than the one before it")
                    .help("a layer's law increases from p(0) = 0"));
            }
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err(node.refuse("the table has no point").help(EXAMPLE));
    }
    Ok(LayerSpec::Table(points))
}
