//! Tables of `[[body]]` whose keys exclude each other: supports, springs and loads.

use super::elasticity;
use crate::error::{Error, Result};
use crate::expression::Field;
use crate::problem::pattern::pattern;
use crate::problem::{BodySpec, ElasticitySpec, Load, LoadKind, SpringKind, SpringSpec, Support};
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, entries};
use serde_json::{Value as Json, json};

/// Names of components, for supports.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Return the kind of value that is a number or an expression, or a list with one for each component.
fn one_or_components() -> ValueKind {
    ValueKind::Either(vec![ValueKind::Field, ValueKind::Field.list()])
}

impl Setting for BodySpec {
    fn kind() -> ValueKind {
        elasticity::with_constants(Self::shape()).into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &elasticity::with_constants(Self::shape()))?;
        Self::decode(&keys, context, ElasticitySpec::among(&keys, context)?)
    }

    fn echo(&self, dimension: usize) -> Json {
        let mut entries = self.entries(dimension);
        entries.extend(self.elasticity.entries(dimension));
        if !self.split {
            entries.remove("split");
        }
        if self.regions.is_empty() {
            entries.remove("region");
        }
        entries.into()
    }
}

impl Setting for Support {
    fn kind() -> ValueKind {
        support_shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &support_shape())?;
        let on = pattern(keys.require("on")?, context)?;
        let mut value = [const { None }; 3];
        for (value, axis) in value.iter_mut().zip(AXES) {
            *value = keys.read(axis, |node| context.field(node))?;
        }
        let normal = match keys.get("symmetry") {
            Some(node) if node.boolean()? => Some(Field::Constant(0.0)),
            Some(node) => return Err(node.refuse("`symmetry = false` holds nothing").help("remove this support")),
            None => keys.read("normal", |node| context.field(node))?,
        };
        Ok(Support { on, value, normal, path: keys.read("path", Node::name)?, factor: 1.0 })
    }

    fn echo(&self, dimension: usize) -> Json {
        let Self { on, value: [x, y, z], normal, path, factor: _ } = self;
        let [x, y, z, normal] = [x, y, z, normal].map(|value| value.echo(dimension));
        let (on, path) = (on.echo(dimension), path.echo(dimension));
        entries([("on", on), ("x", x), ("y", y), ("z", z), ("normal", normal), ("path", path)]).into()
    }
}

fn support_shape() -> TableShape {
    use ValueKind::{Field, Flag, Text};
    TableShape::new("a support")
        .required("on", Text, "boundary or points, or a pattern of such")
        .optional("x", Field, "displacement along x")
        .optional("y", Field, "displacement along y")
        .optional("z", Field, "displacement along z, in space")
        .optional("normal", Field, "displacement along the outer normal of a plane surface")
        .optional("symmetry", Flag, "whether a plane surface slides in its plane: normal = 0")
        .optional("path", Text, "column of the table of load steps with its factor")
        .not_both(&["x", "y", "z"], &["normal", "symmetry"])
        .at_most_one(&["normal", "symmetry"])
}

impl Setting for SpringSpec {
    fn kind() -> ValueKind {
        spring_shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &spring_shape())?;
        let on = pattern(keys.require("on")?, context)?;
        let kind = match (keys.get("stiffness"), keys.get("normal")) {
            (Some(node), _) if matches!(node.value, Value::List(_)) => SpringKind::Vector(context.vector(node)?),
            (Some(node), _) => {
                let field = context.field(node)?;
                SpringKind::Vector([field.clone(), field.clone(), field])
            }
            (None, Some(node)) => SpringKind::Normal(context.field(node)?),
            (None, None) => {
                return Err(node
                    .refuse(format!("the spring on `{}` has no stiffness", on.value))
                    .help("give stiffness = k, one for each component, or normal = k along the normal alone"));
            }
        };
        Ok(SpringSpec { on, kind })
    }

    fn echo(&self, dimension: usize) -> Json {
        match &self.kind {
            SpringKind::Vector(fields) => json!({ "on": self.on.value, "stiffness": fields.echo(dimension) }),
            SpringKind::Normal(k) => json!({ "on": self.on.value, "normal": k.echo(dimension) }),
        }
    }
}

fn spring_shape() -> TableShape {
    use ValueKind::{Field, Text};
    TableShape::new("a spring")
        .required("on", Text, "boundary (stiffness per area) or points")
        .optional("stiffness", one_or_components(), "stiffness, one for all or one for each component")
        .optional("normal", Field, "stiffness along the normal alone")
        .at_most_one(&["stiffness", "normal"])
}

impl Setting for Load {
    fn kind() -> ValueKind {
        load_shape().into()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let keys = Keys::open(node, &load_shape())?;
        let on = pattern(keys.require("on")?, context)?;
        let rigid = keys.flag("rigid", false)?;
        let [force, moment] = ["force", "moment"].map(|key| keys.get(key));
        if let (Some(entry), None) = (keys.entry("rigid"), force.or(moment)) {
            return Err(Error::scene(&entry.key_place, "`rigid` without a force or a moment")
                .help("a rigid surface moves as one under a total force: force = [0, -10], rigid = true"));
        }
        let kind = match [keys.get("pressure"), keys.get("traction"), force, moment] {
            [Some(pressure), ..] => LoadKind::Pressure(context.field(pressure)?),
            [_, Some(traction), ..] => LoadKind::Traction(context.vector(traction)?),
            [.., force, Some(moment)] if rigid => {
                let force = force.map_or(Ok([0.0; 3]), |force| numbers(force, context))?;
                LoadKind::Turning { force, moment: moment_of(moment, context)? }
            }
            [.., Some(_), Some(moment)] => {
                return Err(moment
                    .refuse("a load has both `force` and `moment`")
                    .help("give two loads, or rigid = true for a surface that moves and turns as a rigid body"));
            }
            [.., Some(force), None] => LoadKind::Force { total: numbers(force, context)?, rigid },
            [.., Some(moment)] => LoadKind::Moment(moment_of(moment, context)?),
            [None, None, None, None] => {
                let components = &["tx", "ty", "tz"][..context.dimension];
                let advice = format!(
                    "give pressure = p, traction = [{}], or a total force = [...] or moment",
                    components.join(", ")
                );
                return Err(node.refuse(format!("the load on `{}` has no component", on.value)).help(advice));
            }
        };
        Ok(Load { on, kind, path: keys.read("path", Node::name)?, factor: 1.0 })
    }

    fn echo(&self, dimension: usize) -> Json {
        let Self { on, kind, path, factor: _ } = self;
        let mut map = match kind {
            LoadKind::Pressure(pressure) => json!({ "pressure": pressure.echo(dimension) }),
            LoadKind::Traction(traction) => json!({ "traction": traction.echo(dimension) }),
            LoadKind::Moment(moment) => json!({ "moment": echo_of_moment(moment, dimension) }),
            LoadKind::Turning { force, moment } => {
                json!({ "force": force[..dimension], "moment": echo_of_moment(moment, dimension), "rigid": true })
            }
            LoadKind::Force { total, rigid } => json!({ "force": total[..dimension], "rigid": rigid }),
        };
        map["on"] = on.echo(dimension);
        if let Some(path) = path {
            map["path"] = path.echo(dimension);
        }
        map
    }
}

fn load_shape() -> TableShape {
    use ValueKind::{Field, Flag, Text};
    TableShape::new("a load")
        .required("on", Text, "boundary, or a pattern of such")
        .optional("pressure", Field, "pressure against the outer normal")
        .optional("traction", Field.list(), "force per area, one for each component")
        .optional("force", Field.list(), "total force on the whole boundary, numbers: [FX, FY], in space [FX, FY, FZ]")
        .optional(
            "moment",
            one_or_components(),
            "moment about the centre of the boundary, a number: M, in space [MX, MY, MZ]",
        )
        .optional(
            "rigid",
            Flag,
            "whether the boundary moves as a rigid body under the force, without a turn, or with a turn under a moment; false",
        )
        .optional("path", Text, "column of the table of load steps with its factor")
        .at_most_one(&["pressure", "traction", "force"])
        .not_both(&["moment"], &["pressure", "traction"])
}

/// Return a moment (x, y, z): a number in the plane, a vector in space.
fn moment_of(node: &Node, context: &Context) -> Result<[f64; 3]> {
    if context.dimension == 2 { Ok([0.0, 0.0, node.number()?]) } else { numbers(node, context) }
}

/// Return a moment as [`moment_of`] reads it.
fn echo_of_moment(moment: &[f64; 3], dimension: usize) -> Json {
    if dimension == 2 { json!(moment[2]) } else { json!(moment) }
}

/// Return a vector of numbers; expressions in the coordinates are refused.
fn numbers(node: &Node, context: &Context) -> Result<[f64; 3]> {
    let mut numbers = [0.0; 3];
    for (number, field) in numbers.iter_mut().zip(context.vector(node)?) {
        match field {
            Field::Constant(value) => *number = value,
            field => {
                let place = field.place().unwrap_or(&node.place);
                return Err(Error::scene(place, "a total force or moment does not depend on the place")
                    .help("give numbers, or a traction with expressions"));
            }
        }
    }
    Ok(numbers)
}
