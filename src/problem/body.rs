//! Bodies: their names, elements, supports, springs and loads.

use super::ElasticitySpec;
use super::elasticity::{self, Constants, RegionSpec};
use super::order::Order;
use super::pattern::{is_pattern, pattern};
use crate::error::{Error, Located, Place, Result};
use crate::expression::{Expression, Field};
use crate::petsc::{begins_options, is_family};
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, entries, keys};
use serde_json::{Value as Json, json};

keys! {
    /// A body: a named group of cells with its elasticity, supports and loads. In a scene file the name may be a
    /// pattern; the table then stands for all bodies whose names match.
    #[derive(Debug, Clone)]
    pub struct BodySpec "[[body]]" {
        required {
            /// group of cells, or a pattern such as "brick_*" for many bodies
            ///
            /// It has the form of `plain`. It is a prefix of PETSc options, without words of PETSc's own.
            pub name: Located<String> => body_name,
        }
        optional {
            /// whether each connected part of the group is a body, NAME_1, NAME_2, ...
            pub split: bool = false,
            /// linear or quadratic elements
            pub order: Order = Order::P1,
            /// supports: fix = [{ on = "base", x = 0, y = 0 }]
            ///
            /// They prescribe displacement components on named groups.
            pub fix: Vec<Support> = Vec::new(),
            /// loads: load = [{ on = "top", pressure = 10 }]
            pub load: Vec<Load> = Vec::new(),
            /// springs to the ground: spring = [{ on = "base", stiffness = 100 }]
            pub spring: Vec<SpringSpec> = Vec::new(),
            /// force density, one number or expression for each component
            pub force: Option<[Field; 3]> = None,
            /// known displacement to compare with
            ///
            /// Functions of x, y (z), one for each dimension of the scene.
            pub exact: Option<Vec<Expression>> = None,
            /// a region starts with the line [[body.region]]
            ///
            /// Parts of the body with other elastic constants.
            pub regions as "region": Vec<RegionSpec> = Vec::new(),
        }
        besides {
            /// Elastic constants.
            pub elasticity: ElasticitySpec,
        }
        initially {
            /// Factor of the body force at the present load step; 1 without load steps.
            pub force_factor: f64 = 1.0,
        }
    }
}

impl BodySpec {
    /// Return an isotropic body of linear elements on the group of cells `name`. Young's modulus (a stress, > 0) and Poisson's ratio (in
    /// (-1, 0.5)) are numbers or functions of the coordinates.
    #[track_caller]
    pub fn new(name: &str, young: impl Into<Field>, poisson: impl Into<Field>) -> Self {
        let constants = Constants::Isotropic { young: young.into(), poisson: poisson.into() };
        let elasticity = ElasticitySpec { constants, axes: None, place: Place::here("young, poisson") };
        Self::with_defaults(Located::here(&plain_pattern(name)), elasticity)
    }

    /// Let each connected part of the group be a body of its own: `NAME_1`, `NAME_2`, ...
    pub fn split(self) -> Self {
        Self { split: true, ..self }
    }

    /// Set the order of the elements, which must not exceed that of the mesh.
    pub fn order(self, order: Order) -> Self {
        Self { order, ..self }
    }

    /// Prescribe displacements (x, y in the plane, x, y, z in space; lengths) on a boundary or at points. `None` leaves a component free.
    #[track_caller]
    pub fn fix<const N: usize>(mut self, on: &str, value: [Option<f64>; N]) -> Self {
        const { assert!(N <= 3, "displacements have three components at most") };
        let value = std::array::from_fn(|c| value.get(c).copied().flatten().map(Field::Constant));
        self.fix.push(Support { on: Located::here(on), value, normal: None, path: None, factor: 1.0 });
        self
    }

    /// Let a plane surface slide in its plane, without displacement along its normal.
    #[track_caller]
    pub fn symmetry(mut self, on: &str) -> Self {
        let (on, value, normal) = (Located::here(on), [const { None }; 3], Some(Field::Constant(0.0)));
        self.fix.push(Support { on, value, normal, path: None, factor: 1.0 });
        self
    }

    /// Add a load on a boundary: pressure or traction (stresses), or a total force.
    #[track_caller]
    pub fn load(mut self, on: &str, kind: LoadKind) -> Self {
        self.load.push(Load { on: Located::here(on), kind, path: None, factor: 1.0 });
        self
    }

    /// Add a traction (x, y in the plane, x, y, z in space; stresses); its components are numbers or functions of the coordinates.
    #[track_caller]
    pub fn traction<const N: usize>(self, on: &str, traction: [impl Into<Field>; N]) -> Self {
        const { assert!(N <= 3, "tractions have three components at most") };
        let mut given = traction.into_iter().map(Into::into);
        self.load(on, LoadKind::Traction(std::array::from_fn(|_| given.next().unwrap_or(Field::Constant(0.0)))))
    }

    /// Add a pressure against the outer normal (a stress, > 0 pushes), a number or a function of the coordinates.
    #[track_caller]
    pub fn pressure(self, on: &str, pressure: impl Into<Field>) -> Self {
        self.load(on, LoadKind::Pressure(pressure.into()))
    }
}

/// Prescribed displacement components on a named group (a boundary, or points).
#[derive(Debug, Clone)]
pub struct Support {
    /// The physical group.
    pub on: Located<String>,
    /// Prescribed displacement of each component (lengths); `None` leaves the component free.
    pub value: [Option<Field>; 3],
    /// Prescribed displacement along the outer normal of a plane surface (a length).
    pub normal: Option<Field>,
    /// Name of the factor of these displacements in a history.
    pub path: Option<Located<String>>,
    /// Factor of the displacements at the present load step; 1 without load steps.
    pub factor: f64,
}

/// Springs to the ground on a named boundary (per area) or at points.
#[derive(Debug, Clone)]
pub struct SpringSpec {
    /// The physical group.
    pub on: Located<String>,
    /// The stiffness: stress per length on a boundary, force per length at a point.
    pub kind: SpringKind,
}

/// The stiffness of springs, >= 0.
#[derive(Debug, Clone)]
pub enum SpringKind {
    /// Stiffness along x, y, z.
    Vector([Field; 3]),
    /// Stiffness along the normal of the surface.
    Normal(Field),
}

/// A load on a named boundary.
#[derive(Debug, Clone)]
pub struct Load {
    /// The physical group.
    pub on: Located<String>,
    /// The pressure, traction or force.
    pub kind: LoadKind,
    /// Name of the factor of this load in a history.
    pub path: Option<Located<String>>,
    /// Factor of the load at the present load step; 1 without load steps.
    pub factor: f64,
}

/// The kinds of load on a boundary.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Pressure against the outer normal (a stress); > 0 pushes.
    Pressure(Field),
    /// Traction vector (x, y, z; stresses).
    Traction([Field; 3]),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z).
        total: [f64; 3],
        /// Whether all nodes of the boundary have one displacement. Otherwise the force is spread evenly.
        rigid: bool,
    },
    /// Moment about the centre of the boundary (x, y, z; force times length), by tractions that are linear in the place. In the plane the
    /// first two components are zero.
    Moment([f64; 3]),
    /// Force and moment on a boundary that moves and turns as a rigid body.
    Turning {
        /// Force that acts at the centre of the boundary (x, y, z).
        force: [f64; 3],
        /// Moment about the centre (x, y, z; force times length). In the plane the first two components are zero.
        moment: [f64; 3],
    },
}

/// Label and help for a name that is not spelt like the name of a body.
pub const SPELLING: [&str; 2] =
    ["", "it is a prefix of PETSc options: a small letter, then small letters, digits and _"];

/// The most numbers in the name of a body. With four, PETSc takes 24 times as long to look up the options of a solver; with eight it takes
/// 40 320 times as long, which is 14 s.
const MOST_NUMBERS: usize = 4;

/// Return the name of a body as the program writes it: small letters, digits and `_`, beginning with a letter. This is the one rule
/// for names in scenes and for names of groups of cells in mesh files of any format. Capitals become small, other characters `_`, and
/// `body_` stands before a name that begins with something else.
pub fn plain(name: &str) -> String {
    let word: String = name.trim().chars().map(plain_character).collect();
    if word.starts_with(|c: char| c.is_ascii_lowercase()) { word } else { format!("body_{word}") }
}

/// Return a pattern of names of bodies by the rule of `plain`. Signs of patterns stay.
pub fn plain_pattern(text: &str) -> String {
    let mut in_class = false;
    let mut write = |c: char| {
        let is_sign = matches!(c, '*' | '?' | '[' | ']') || in_class && matches!(c, '!' | '-');
        in_class = c == '[' || in_class && c != ']';
        if is_sign { c } else { plain_character(c) }
    };
    if is_pattern(text) { text.trim().chars().map(&mut write).collect() } else { plain(text) }
}

/// Read the name of a body, or a pattern of names, in the form of bodies.
///
/// # Errors
/// An empty text, and a pattern that is none.
pub(crate) fn body_name(node: &Node, context: &Context) -> Result<Located<String>> {
    pattern(node, context).map(|name| Located { value: plain_pattern(&name.value), ..name })
}

fn plain_character(c: char) -> char {
    let small = c.to_ascii_lowercase();
    if is_in_name(small) { small } else { '_' }
}

/// Return whether names of bodies may have this character.
pub fn is_in_name(c: char) -> bool {
    c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'
}

/// Return why a body cannot have this name and what to do about it, as label and help; `None` for a good name.
///
/// A body called like one of PETSc's own options could not have options of its own. A name in which such a word follows another, as in
/// `brick_sub`, would give the body the options of a solver inside the solver of `brick` (`-brick_sub_ksp_type`).
pub fn fault(name: &str) -> Option<[&'static str; 2]> {
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(is_in_name) {
        return Some(SPELLING);
    }
    // PETSc repeats the look-up of an option without each number between two `_`, and each of these again with the numbers that are
    // left: k! look-ups for k numbers
    let is_number = |word: &&str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    if name.split('_').filter(is_number).count() > MOST_NUMBERS {
        return Some(["a name of more than four numbers", "join numbers by a letter: brick_1x2x3"]);
    }
    // `newton` is the prefix of the solver of all bodies together
    (begins_options(name) || name.split('_').any(is_family) || name == "newton")
        .then_some(["a word of PETSc's own options", "choose another name, also for the physical group in the mesh"])
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Return the kind of value that is a number or an expression, or a list with one for each component.
pub(super) fn one_or_components() -> ValueKind {
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
            *value = keys.read(axis, |node| Field::read(node, context))?;
        }
        let normal = match keys.get("symmetry") {
            Some(node) if node.boolean()? => Some(Field::Constant(0.0)),
            Some(node) => return Err(node.refuse("`symmetry = false` holds nothing").help("remove this support")),
            None => keys.read("normal", |node| Field::read(node, context))?,
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
            (Some(node), _) if matches!(node.value, Value::List(_)) => {
                SpringKind::Vector(<[Field; 3]>::read(node, context)?)
            }
            (Some(node), _) => {
                let field = Field::read(node, context)?;
                SpringKind::Vector([field.clone(), field.clone(), field])
            }
            (None, Some(node)) => SpringKind::Normal(Field::read(node, context)?),
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
            [Some(pressure), ..] => LoadKind::Pressure(Field::read(pressure, context)?),
            [_, Some(traction), ..] => LoadKind::Traction(<[Field; 3]>::read(traction, context)?),
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
pub(super) fn moment_of(node: &Node, context: &Context) -> Result<[f64; 3]> {
    if context.dimension == 2 { Ok([0.0, 0.0, node.number()?]) } else { numbers(node, context) }
}

/// Return a moment as [`moment_of`] reads it.
pub(super) fn echo_of_moment(moment: &[f64; 3], dimension: usize) -> Json {
    if dimension == 2 { json!(moment[2]) } else { json!(moment) }
}

/// Return a vector of numbers; expressions in the coordinates are refused.
fn numbers(node: &Node, context: &Context) -> Result<[f64; 3]> {
    let mut numbers = [0.0; 3];
    for (number, field) in numbers.iter_mut().zip(<[Field; 3]>::read(node, context)?) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_one_form() {
        for (given, name) in [
            ("lower", "lower"),
            ("Upper Part", "upper_part"),
            (" Part-2.1 ", "part_2_1"),
            ("2nd", "body_2nd"),
            ("Träger", "tr_ger"),
        ] {
            assert_eq!([plain(given), plain(&plain(given)), plain_pattern(given)], [name; 3]);
        }
        assert_eq!(plain_pattern("Part-*"), "part_*");
        assert_eq!(plain_pattern("*B?[!A-C]-[0-9]"), "*b?[!a-c]_[0-9]");
    }

    #[test]
    fn faults_of_names() {
        for name in
            ["ksp", "mg", "snes", "is", "log", "options", "help", "viewer", "mumps", "newton", "brick_sub", "a_pc_b"]
        {
            assert!(fault(name).is_some_and(|[label, _]| label.contains("PETSc")), "{name}");
        }
        for name in ["", "2up", "up-per", "üb", "a b", "Upper"] {
            assert_eq!(fault(name), Some(SPELLING), "{name}");
        }
        assert_eq!(["punch", "upper2", "brick_17", "subway_log", "b_1_22_3_4"].map(fault), [None; 5]);
        assert!(fault("b_1_2_3_4_5").is_some_and(|[label, _]| label.contains("four numbers")));
    }
}
