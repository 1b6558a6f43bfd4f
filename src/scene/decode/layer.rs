//! `layer` of a contact: a form with parameters, a table, or an expression.

use super::{Decoder, Form, Keys, Node, Table};
use crate::data::{Grid, Summits};
use crate::error::{Error, Result};
use crate::expression::{Expression, Scope};
use crate::problem::layer::{AsperitySpec, Depths, FORMS, LawForm, LayerSpec, Parameter};

/// What a layer may be.
pub(super) const EXAMPLE: &str = "give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }";
const POINTS: &str = "write table = [[1e-5, 2], [2e-5, 10]]: compressions and pressures, both increasing from 0";

/// The shape of `layer`.
pub(super) fn table() -> Table {
    let laws: Vec<&str> = FORMS.iter().map(|form| form.name).chain(["table", "pressure", "asperities"]).collect();
    let add = |table: Table, form: &'static LawForm| {
        let values: Vec<String> = form.parameters.iter().map(|known| format!("{} = ...", known.key)).collect();
        table.key(form.name, self::form(form).form(), format!("write {} = {{ {} }}", form.name, values.join(", ")))
    };
    let forms = FORMS.into_iter().fold(Table::new("the layer"), add);
    forms
        .key("table", Form::Number.list().list(), POINTS)
        .key("pressure", Form::Text, "p as an expression in c and the coordinates: pressure = \"1e5*c + 1e9*c^2\"")
        .key("asperities", asperities().form(), "a law of summits: asperities = { modulus = E*, data = \"NAME\" }")
        .key("up_to", Form::Number, "compression beyond which the expression goes on linearly")
        .apart(&laws)
}

/// The shape of a law with parameters.
fn form(form: &'static LawForm) -> Table {
    let table = Table::new(format!("the {} layer", form.name));
    form.parameters.iter().fold(table, |table, known| table.must(known.key, Form::Field, known.what))
}

fn asperities() -> Table {
    use Form::{Number, Text};
    Table::new("the layer of asperities")
        .must("modulus", Number, "E* of both bodies: 1/E* is the sum of (1 - nu^2)/E")
        .key("data", Text, "data whose summits these are")
        .key("density", Number, "summits per area")
        .key("radius", Number, "their radius")
        .key("deviation", Number, "standard deviation of their heights")
        .key("highest", Number, "height of the highest above the mean; 4 deviations")
        .against(&["data"], &["density", "radius", "deviation", "highest"])
}

impl Decoder<'_> {
    pub(super) fn layer(&self, node: &Node) -> Result<LayerSpec> {
        let keys = Keys::open(node, &table())?;
        if let (Some(entry), None) = (keys.entry("up_to"), keys.get("pressure")) {
            return Err(Error::scene(&entry.key_place, "`up_to` without an expression")
                .help("it says how far `pressure = \"...\"` goes; other laws need no end"));
        }
        if let Some(points) = keys.get("table") {
            return points_of(points);
        }
        if let Some(summits) = keys.get("asperities") {
            return self.asperities(summits);
        }
        if let Some(law) = keys.get("pressure") {
            let names: &[&'static str] = if self.dimension == 3 { &["c", "x", "y", "z"] } else { &["c", "x", "y"] };
            let scope = Scope { variables: names, data: &self.data };
            let law = Expression::parse(law.string()?, &law.place, scope)?;
            let up_to = keys.get("up_to").map(Node::number).transpose()?;
            return Ok(LayerSpec::Pressure { law, up_to });
        }
        match FORMS.into_iter().find_map(|form| Some((form, keys.get(form.name)?))) {
            Some((form, node)) => self.form(form, node),
            None => Err(keys.node.refuse("the layer has no law").help(EXAMPLE)),
        }
    }

    /// The parameters of a form.
    fn form(&self, form: &'static LawForm, node: &Node) -> Result<LayerSpec> {
        let keys = Keys::open(node, &self::form(form))?;
        let value = |parameter: &Parameter| self.field(keys.require(parameter.key)?);
        let values = form.parameters.iter().map(value).collect::<Result<_>>()?;
        Ok(LayerSpec::Form { form, values })
    }
}

/// Standard deviations from the mean to the highest summit, if nobody says it: a share of 3e-5 of a normal distribution lies above.
const HIGHEST: f64 = 4.0;

impl Decoder<'_> {
    /// Summits, by numbers or of data.
    fn asperities(&self, node: &Node) -> Result<LayerSpec> {
        let keys = Keys::open(node, &asperities())?;
        let missing = "give modulus = E* and data = \"NAME\", or modulus, density, radius and deviation of the summits";
        let number = |key: &str| keys.require(key).map_err(|error| error.help(missing))?.number();
        let modulus = number("modulus")?;
        let Some(named) = keys.get("data") else {
            let deviation = number("deviation")?;
            let highest = keys.get("highest").map_or(Ok(HIGHEST * deviation), Node::number)?;
            let depths = Depths::Normal { deviation, highest };
            let (density, radius) = (number("density")?, number("radius")?);
            return Ok(LayerSpec::Asperities(AsperitySpec { density, radius, modulus, depths, data: None }));
        };
        let name = named.string()?;
        let Some(data) = self.data.get(name) else {
            let otherwise = || format!("write [data.{name}] and below it file = \"surface.csv\"");
            let error = named.refuse(format!("there are no data `{name}`"));
            return Err(error.suggest(name, self.data.keys().map(String::as_str), otherwise));
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

/// Points (c, p) of a law.
fn points_of(node: &Node) -> Result<LayerSpec> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for item in node.list()? {
        let [c, p] = item.list().map_err(|error| error.help(POINTS))? else {
            return Err(item.refuse("a point of the table is a compression and a pressure").help(POINTS));
        };
        points.push([c.number()?, p.number()?]);
    }
    if points.first() == Some(&[0.0, 0.0]) {
        points.remove(0); // every law begins there
    }
    Ok(LayerSpec::Table(points))
}
