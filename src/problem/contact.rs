//! Pairs of contact surfaces: two that the scene names, or rules that find pairs.

use super::body::{body_name, echo_of_moment, moment_of, one_or_components};
use super::layer::LayerSpec;
use crate::error::{Error, Located, Result};
use crate::expression::Field;
use crate::setting::{Context, Keys, Node, Setting, TableShape, Value, ValueKind, keys, words};
use serde_json::{Value as Json, json};

keys! {
    /// A pair of contact surfaces and the layer between them.
    #[derive(Debug, Clone)]
    pub struct ContactSpec "[[contact]]" {
        required {
            /// give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }
            ///
            /// Law of the layer.
            pub layer: LayerSpec,
        }
        optional {
            /// how far apart facets of a pair may be; required with "auto"
            ///
            /// Largest distance (a length, > 0) of facets that face each other; any distance if `None`.
            pub distance: Option<f64> = None,
            /// gap besides the distance of the meshes
            ///
            /// Gap (a length) that is added to the distance of the meshes.
            pub gap: Field = Field::Constant(0.0),
            /// largest angle in degrees between normals that face each other
            ///
            /// Largest angle between the normal of one facet and minus that of the other, > 0 and at most 90.
            ///
            /// With the default a normal meets the other surface at most at twice its distance, and a facet covers at most twice its own
            /// area there. Both tend to infinity as the angle grows to a right one.
            pub angle: f64 = 60.0,
            /// angle in degrees beyond which facets meet at an edge, with a normal for each side
            ///
            /// It is > 0 and at most 180.
            ///
            /// Twelve chords of a circle, the coarsest mesh of a round part, turn by 30 degrees each. A chamfer turns by 45 degrees. The
            /// default is in between.
            pub edge: f64 = 40.0,
            /// whether the distance of the meshes counts as zero
            ///
            /// Then the surfaces are assumed to touch wherever they face each other, and only [`ContactSpec::gap`] counts.
            pub touching: bool = false,
            /// whether the layer also pulls where it is stretched, by the same law unless `tension` gives another
            ///
            /// A bond fills the gap of the meshes, so that only [`ContactSpec::gap`] counts.
            pub bond: bool = false,
            /// law of a bonded layer where it is stretched: tension over stretch
            pub tension: Option<LayerSpec> = None,
            /// whether the surface `on` is before a rigid obstacle, which is given by the gap
            pub obstacle: bool = false,
            /// how far an obstacle moves towards the surface, along its mean normal; 0 without `force`
            pub approach: Option<f64> = None,
            /// how far an obstacle turns, in radians: about z in the plane, in space a vector; 0 without `moment`
            pub tilt: Option<Axial> = None,
            /// total of the normal forces, for which the gap changes by an offset; force on an obstacle along the mean normal
            pub force: Option<f64> = None,
            /// moment on an obstacle about `at`, under which it turns: a number in the plane, in space a vector
            pub moment: Option<Axial> = None,
            /// point about which an obstacle turns; the middle of its surface without this key
            pub at: Option<Point> = None,
            /// force for which the first load step finds the offset of the gap, which later steps keep; a tension where the pair is bonded
            pub preload: Option<f64> = None,
            /// column of the table of load steps with the factor of these forces and motions
            pub path: Option<Located<String>> = None,
            /// what to do where bodies overlap before loading
            pub overlap: Overlap = Overlap::Compress,
            /// known contact pressure to draw and to compare with
            pub reference: Option<Field> = None,
        }
        besides {
            /// The two physical groups. In a rule that finds pairs both are the word "auto"; before an obstacle the second is "obstacle".
            pub between: [Located<String>; 2],
        }
        initially {
            /// Number of the table in the scene, from 0.
            pub table: usize = 0,
            /// Factor of forces and motions at the present load step; 1 without load steps.
            pub factor: f64 = 1.0,
        }
    }
}

impl ContactSpec {
    /// Return a pair of named surfaces of different bodies, with a layer between them. The gap is the distance of the meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self::with_defaults(layer, [Located::here(first), Located::here(second)])
    }

    /// Return a surface before a rigid obstacle, whose distance is the `gap`.
    #[track_caller]
    pub fn obstacle(on: &str, gap: impl Into<Field>, layer: LayerSpec) -> Self {
        let spec = Self::with_defaults(layer, [Located::here(on), Located::here(OBSTACLE)]);
        Self { obstacle: true, gap: gap.into(), ..spec }
    }

    /// Bond the surfaces: the layer also pulls where it is stretched, by its own law.
    pub fn bonded(self) -> Self {
        Self { bond: true, ..self }
    }

    /// Return whether the distance of the meshes counts as zero.
    pub fn is_touching(&self) -> bool {
        self.touching || self.bond || self.obstacle
    }

    /// Return whether forces or prescribed motions of the pair act without a path.
    pub fn acts(&self) -> bool {
        let turns = [&self.tilt, &self.moment].into_iter().flatten().flat_map(|axial| axial.0);
        self.path.is_none() && [self.approach, self.force].into_iter().flatten().chain(turns).any(|value| value != 0.0)
    }

    /// Set the gap (a length) that is added to the distance of the meshes, a number or a function of the coordinates.
    pub fn gap(self, gap: impl Into<Field>) -> Self {
        Self { gap: gap.into(), ..self }
    }
}

/// A rotation or a moment: about z in the plane, a vector in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axial(pub [f64; 3]);

impl Setting for Axial {
    fn kind() -> ValueKind {
        one_or_components()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        moment_of(node, context).map(Self)
    }

    fn echo(&self, dimension: usize) -> Json {
        echo_of_moment(&self.0, dimension)
    }
}

/// A point of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point(pub [f64; 3]);

impl Setting for Point {
    fn kind() -> ValueKind {
        ValueKind::Number.list()
    }

    fn read(node: &Node, context: &Context) -> Result<Self> {
        let mut point = [0.0; 3];
        for (x, item) in point.iter_mut().zip(context.components(node)?) {
            *x = item.number()?;
        }
        Ok(Self(point))
    }

    fn echo(&self, dimension: usize) -> Json {
        json!(self.0[..dimension])
    }
}

/// A rule that finds pairs: contact of all bodies that lie near each other. A [`ContactSpec`] that names surfaces of two bodies, and a
/// later rule, take precedence.
#[derive(Debug, Clone)]
pub struct AutoContact {
    /// Names or patterns of bodies. A body that matches the first and one that matches the second form a pair. All bodies if `None`.
    pub of: Option<[Located<String>; 2]>,
    /// The settings of each pair. Its `between` is a stand-in for the names of the two bodies.
    pub contact: ContactSpec,
}

/// Which of two surfaces carries the contact points of their pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Carrier {
    /// Number of the table of the contact in the scene.
    pub table: usize,
    /// Indices of the two bodies, in the order of the scene.
    pub bodies: [usize; 2],
    /// Whether it is the surface of the second body.
    pub is_second: bool,
}

words! {
    /// What to do about surfaces that overlap before loading.
    pub enum Overlap "overlap" {
        /// The overlap compresses the layer, and the run warns.
        Compress = "compress",
        /// The scene is refused.
        Refuse = "error",
    }
}

/// Return the shape of `[[contact]]`.
pub fn shape() -> TableShape {
    let about = "bodies of pairs found by \"auto\", or patterns: of = [\"one_*\", \"other_*\"]";
    ContactSpec::shape()
        .optional("between", <[Located<String>; 2]>::kind(), EXAMPLE)
        .optional("on", ValueKind::Text, "the surface before an obstacle, with obstacle = true")
        .optional("of", ValueKind::Text.list(), about)
        .at_most_one(&["between", "on"])
        .at_most_one(&["approach", "force", "preload"])
        .at_most_one(&["tilt", "moment"])
}

/// Read the pairs of contact surfaces that a scene names, and the rules that find further pairs.
///
/// # Errors
/// Tables and values that are no contact.
pub fn read(items: &[Node], context: &Context) -> Result<(Vec<ContactSpec>, Vec<AutoContact>)> {
    let (mut contacts, mut auto) = (Vec::new(), Vec::new());
    for (table, item) in items.iter().enumerate() {
        let keys = Keys::open(item, &shape())?;
        let on = on(&keys)?;
        let is_rule = on.is_none() && is_rule(&keys)?;
        let of = keys.read("of", |node| of(node, context))?;
        let between = match on {
            Some(on) => [on.clone(), Located { value: OBSTACLE.to_owned(), ..on }],
            None => <[Located<String>; 2]>::read(keys.require("between")?, context)?,
        };
        let contact = ContactSpec { table, ..ContactSpec::decode(&keys, context, between)? };
        match is_rule {
            true => auto.push(AutoContact { of, contact }),
            false => contacts.push(contact),
        }
    }
    Ok((contacts, auto))
}

/// Return the echo of named pairs and of rules, in the order of the file.
pub fn echo(contacts: &[ContactSpec], rules: &[AutoContact], dimension: usize) -> Json {
    let entries = |contact: &ContactSpec| {
        let mut entries = contact.entries(dimension);
        match contact.obstacle {
            true => entries.insert("on".to_owned(), json!(contact.between[0].value)),
            false => entries.insert("between".to_owned(), contact.between.echo(dimension)),
        };
        entries
    };
    let named = contacts.iter().map(|contact| (contact.table, entries(contact)));
    let found = rules.iter().map(|AutoContact { of, contact }| {
        let mut entries = entries(contact);
        if let Some(of) = of {
            entries.insert("of".to_owned(), of.each_ref().map(|name| name.value.as_str()).into_iter().collect());
        }
        (contact.table, entries)
    });
    let mut tables: Vec<_> = named.chain(found).collect();
    tables.sort_by_key(|(table, _)| *table);
    tables.into_iter().map(|(_, entries)| Json::from(entries)).collect()
}

/// Return the surface before an obstacle, if an open table has one.
fn on(keys: &Keys) -> Result<Option<Located<String>>> {
    match (keys.entry("on"), keys.flag("obstacle", false)?) {
        (Some(entry), true) => entry.node.name().map(Some),
        (Some(entry), false) => Err(Error::scene(&entry.key_place, "`on` without an obstacle").help(
            "one surface before a rigid obstacle has obstacle = true, two surfaces have between = [\"one\", \"other\"]",
        )),
        (None, true) => keys
            .require("on")
            .map(|_| None)
            .map_err(|error| error.help("an obstacle is before one surface: on = \"top\"")),
        (None, false) => Ok(None),
    }
}

/// Return whether an open table is a rule that finds pairs: `between = "auto"`.
fn is_rule(keys: &Keys) -> Result<bool> {
    let is_rule = matches!(keys.require("between")?.value, Value::String(_));
    if let (Some(entry), false) = (keys.entry("of"), is_rule) {
        return Err(Error::scene(&entry.key_place, "`of` for surfaces with names")
            .help("it says which bodies form pairs with between = \"auto\""));
    }
    if is_rule && keys.require("between")?.string()? == AUTO {
        keys.require("distance").map_err(|error| {
            error.help("facets of different bodies that face each other at most that far apart form pairs")
        })?;
    }
    Ok(is_rule)
}

/// The name of an obstacle, where a pair has that of the second surface.
pub const OBSTACLE: &str = "obstacle";

/// The value of `between` in rules that find pairs, and the name of both surfaces there.
const AUTO: &str = "auto";

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

/// The two surfaces of a contact. With `between = "auto"` both are the word "auto".
impl Setting for [Located<String>; 2] {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Text, ValueKind::Text.list()])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        match &node.value {
            Value::String(word) if word == AUTO => Ok([node.name()?, node.name()?]),
            Value::String(word) => Err(node.refuse(format!("a contact between `{word}` alone")).help(EXAMPLE)),
            _ => match node.list()? {
                [a, b] => Ok([a.name()?, b.name()?]),
                _ => Err(node.refuse("a contact is between two surfaces").help(EXAMPLE)),
            },
        }
    }

    fn echo(&self, _: usize) -> Json {
        match self.each_ref().map(|name| name.value.as_str()) {
            [AUTO, AUTO] => json!(AUTO),
            names => json!(names),
        }
    }
}

/// Return two names of bodies, or patterns of names.
fn of(node: &Node, context: &Context) -> Result<[Located<String>; 2]> {
    let [a, b] = node.list()? else {
        return Err(node.refuse("pairs are of two bodies").help("write of = [\"one_*\", \"other_*\"]"));
    };
    Ok([body_name(a, context)?, body_name(b, context)?])
}
