//! Pairs of contact surfaces: two that the scene names, or rules that find pairs.

use super::body::{check_name, plain_pattern};
use super::check::{Check, Fault, positive};
use super::compile::{Compile, Names, compile};
use super::geometry::{Geometry, Plane};
use super::layer::{LayerSpec, UnloadSpec};
use super::pattern;
use super::read::{Either, Form, OneOrVector, Vector, check_numbers, refused, some_table, table};
use crate::error::{Error, Located, Result as Checked, shown};
use crate::expression::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A pair of contact surfaces and the layer between them, or a rule that finds such pairs: contact of all bodies that
/// lie near each other. A pair of named surfaces of two bodies, and a later rule, take precedence.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactSpec {
    /// write between = ["one", "other"], or between = "auto" with a distance
    ///
    /// The two physical groups. In a rule that finds pairs both are the word "auto"; before an obstacle the second is
    /// "obstacle".
    #[serde(default = "nothing", serialize_with = "write_between", deserialize_with = "between")]
    #[serde(skip_serializing_if = "is_with_obstacle")]
    #[schemars(with = "Option<Either<String, [String; 2]>>")]
    pub between: [Located<String>; 2],
    /// the surface before an obstacle, with obstacle = true
    pub on: Option<Located<String>>,
    /// bodies of pairs found by "auto", or patterns: of = ["one_*", "other_*"]
    ///
    /// A body that matches the first name and one that matches the second form a pair. All bodies if `None`.
    #[serde(default, deserialize_with = "of")]
    #[schemars(with = "Option<Vec<String>>")]
    pub of: Option<[Located<String>; 2]>,
    /// give power = { B = 2.5e-5, a = 0.5 } or linear = { stiffness = 1e5 }
    ///
    /// Law of the layer.
    #[serde(deserialize_with = "table")]
    pub layer: LayerSpec,
    /// how far apart facets of a pair may be; required with "auto"
    ///
    /// Largest distance (a length, > 0) of facets that face each other; any distance if `None`.
    pub distance: Option<f64>,
    /// gap besides the distance of the meshes; it may use factors of load steps
    ///
    /// Gap (a length) that is added to the distance of the meshes.
    #[serde(default = "no_gap")]
    pub gap: Field,
    /// largest angle in degrees between normals that face each other
    ///
    /// Largest angle between the normal of one facet and minus that of the other, > 0 and at most 90.
    ///
    /// With the default a normal meets the other surface at most at twice its distance, and a facet covers at most
    /// twice its own area there. Both tend to infinity as the angle grows to a right one.
    #[serde(default = "angle")]
    pub angle: f64,
    /// angle in degrees beyond which facets meet at an edge, with a normal for each side
    ///
    /// It is > 0 and at most 180.
    ///
    /// Twelve chords of a circle, the coarsest mesh of a round part, turn by 30 degrees each. A chamfer turns by 45
    /// degrees. The default is in between.
    #[serde(default = "edge")]
    pub edge: f64,
    /// whether the distance of the meshes counts as zero
    ///
    /// Then the surfaces are assumed to touch wherever they face each other, and only [`ContactSpec::gap`] counts.
    #[serde(default)]
    pub touching: bool,
    /// whether the layer also pulls where it is stretched, by the same law unless `tension` gives another
    ///
    /// A bond fills the gap of the meshes, so that only [`ContactSpec::gap`] counts.
    #[serde(default)]
    pub bond: bool,
    /// law of a bonded layer where it is stretched: tension over stretch
    #[serde(default, deserialize_with = "some_table")]
    pub tension: Option<LayerSpec>,
    /// law by which the pressure falls where a load step takes load off the layer, over the way back from its largest
    /// compression
    ///
    /// The law of the layer itself without this key. A table has rows of a compression, a pressure and the slope of
    /// unloading from there.
    #[serde(default, deserialize_with = "some_table")]
    pub unload: Option<UnloadSpec>,
    /// stiffness of a bonded layer against slip: traction along the surface over slip
    pub shear: Option<Field>,
    /// groups inside and outside of a seal, at ends of the contact surface of one body: seal = ["bore", "outside"]
    ///
    /// They share edges with the surface, in the plane points. This surface carries the contact points, so that ways
    /// from one end to the other go along its mesh.
    #[serde(default, deserialize_with = "seal")]
    #[schemars(with = "Option<Vec<String>>")]
    pub seal: Option<[Located<String>; 2]>,
    /// whether the surface `on` is before a rigid obstacle, which is given by the gap
    #[serde(default)]
    pub obstacle: bool,
    /// how far an obstacle moves towards the surface, along its mean normal; 0 without `force`
    pub approach: Option<Field>,
    /// how far an obstacle turns, in radians: about z in the plane, in space a vector; 0 without `moment`
    pub tilt: Option<OneOrVector>,
    /// total of the normal forces, for which the gap changes by an offset; force on an obstacle along the mean normal
    pub force: Option<Field>,
    /// moment on an obstacle about `at`, under which it turns: a number in the plane, in space a vector
    pub moment: Option<OneOrVector>,
    /// point about which an obstacle turns; the middle of its surface without this key
    #[schemars(with = "Option<Vec<f64>>")]
    pub at: Option<Vector>,
    /// force for which the first load step finds the offset of the gap, which later steps keep; a tension where the
    /// pair is bonded
    ///
    /// Its two surfaces may be of one body, and may look away from each other, as head and nut of a bolt without a
    /// mesh.
    pub preload: Option<f64>,
    /// column of the table of load steps with the factor of these forces and motions
    pub path: Option<Located<String>>,
    /// what to do where bodies overlap before loading
    #[serde(default)]
    pub overlap: Overlap,
    /// known contact pressure to draw and to compare with
    pub reference: Option<Field>,
    /// Number of the table in the scene, from 0; those of [`ContactSpec::slips`] follow.
    #[serde(skip)]
    pub table: usize,
    /// Direction of the slip, for a pair that is the shear of a bond.
    #[serde(skip)]
    pub slip: Option<Slip>,
}

/// What the first surface of a contact faces. Many keys mean something only with some of them
/// ([`ContactSpec::check_keys`]).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Partner {
    /// A second surface, which the scene names.
    Surface,
    /// The surfaces of all bodies nearby: the contact is a rule that finds pairs.
    Nearby,
    /// A rigid obstacle, which the gap alone describes.
    Obstacle,
}

fn no_gap() -> Field {
    Field::Constant(0.0)
}

fn angle() -> f64 {
    60.0
}

fn edge() -> f64 {
    40.0
}

impl ContactSpec {
    /// Return a pair of named surfaces of different bodies, with a layer between them. The gap is the distance of the
    /// meshes.
    #[track_caller]
    pub fn new(first: &str, second: &str, layer: LayerSpec) -> Self {
        Self {
            between: [Located::here(first), Located::here(second)],
            on: None,
            of: None,
            layer,
            distance: None,
            gap: Field::Constant(0.0),
            angle: angle(),
            edge: edge(),
            touching: false,
            bond: false,
            tension: None,
            unload: None,
            shear: None,
            seal: None,
            obstacle: false,
            approach: None,
            tilt: None,
            force: None,
            moment: None,
            at: None,
            preload: None,
            path: None,
            overlap: Overlap::default(),
            reference: None,
            table: 0,
            slip: None,
        }
    }

    /// Set the gap (a length) that is added to the distance of the meshes, a number or a function of the coordinates.
    pub fn gap(self, gap: impl Into<Field>) -> Self {
        Self { gap: gap.into(), ..self }
    }

    /// Return a surface before a rigid obstacle, whose distance is the `gap`.
    #[track_caller]
    pub fn obstacle(on: &str, gap: impl Into<Field>, layer: LayerSpec) -> Self {
        Self { obstacle: true, gap: gap.into(), on: Some(Located::here(on)), ..Self::new(on, OBSTACLE, layer) }
    }

    /// Bond the surfaces: the layer also pulls where it is stretched, by its own law.
    pub fn bonded(self) -> Self {
        Self { bond: true, ..self }
    }

    /// Return the contacts that are the shear of this bond, in a scene of this dimension: one for each direction along
    /// the surface, whose layer resists slip as a bond resists compression and stretch.
    pub fn slips(&self, dimension: usize) -> impl Iterator<Item = Self> {
        let along = move |(shear, direction): (&Field, usize)| Self {
            slip: Some(Slip { table: self.table, direction }),
            layer: LayerSpec::linear(shear.clone()),
            gap: no_gap(),
            tension: None,
            unload: None,
            shear: None,
            force: None,
            preload: None,
            path: None,
            reference: None,
            ..self.clone()
        };
        self.shear.iter().flat_map(move |shear| (1..dimension).map(move |axis| (shear, axis - 1))).map(along)
    }

    /// Return the number of the table in the scene file.
    pub fn in_file(&self) -> usize {
        self.slip.map_or(self.table, |slip| slip.table)
    }

    /// Return whether another contact has the same points, where meshes and bodies are the same.
    pub fn has_points_of(&self, other: &Self) -> bool {
        let of = |spec: &Self| {
            let kinds = [spec.obstacle, spec.is_touching(), spec.preload.is_some()];
            let names = (spec.between.clone(), spec.of.clone(), spec.seal.clone());
            (spec.table, names, spec.distance, [spec.angle, spec.edge], kinds)
        };
        of(self) == of(other)
    }

    /// Return whether the distance of the meshes counts as zero.
    pub fn is_touching(&self) -> bool {
        self.touching || self.bond || self.obstacle
    }

    /// Return whether forces or prescribed motions of the pair act without a path.
    pub fn acts(&self) -> bool {
        self.path.is_none() && self.given().any(|field| !field.is_zero())
    }

    /// Iterate over the forces and motions that are given.
    fn given(&self) -> impl Iterator<Item = &Field> {
        let turns = [&self.tilt, &self.moment].into_iter().flatten().flat_map(OneOrVector::fields);
        [&self.approach, &self.force].into_iter().flatten().chain(turns)
    }

    /// Iterate over the indices of the factors of load steps in its expressions.
    pub fn factors(&self) -> impl Iterator<Item = usize> {
        self.given().chain([&self.gap]).flat_map(Field::factors)
    }

    /// Give forces and motions their values in a load step, and the gap its factors. Numbers are multiplied by the
    /// factor of the contact's `own` path. An expression has the factors that it names, and no other.
    pub fn set_step(&mut self, factors: &[f64], own: f64) {
        let turns = [&mut self.tilt, &mut self.moment].into_iter().flatten().flat_map(OneOrVector::fields_mut);
        let given = [&mut self.approach, &mut self.force].into_iter().flatten().chain(turns);
        given.for_each(|field| match field {
            Field::Constant(number) => *number *= own,
            expression => *expression = expression.in_step(factors),
        });
        self.preload.iter_mut().for_each(|preload| *preload *= own);
        self.gap = self.gap.in_step(factors);
    }

    /// Check that forces and motions are numbers in a load step.
    ///
    /// # Errors
    /// One that is not finite.
    pub fn check_step(&self) -> Checked<()> {
        self.given().try_for_each(|field| field.eval_finite("the force or motion", [0.0; 3]).map(drop))
    }

    /// Return the approach that is given in the present load step.
    pub fn approach(&self) -> Option<f64> {
        self.approach.as_ref().map(number)
    }

    /// Return the force that is given in the present load step.
    pub fn force(&self) -> Option<f64> {
        self.force.as_ref().map(number)
    }

    /// Return the turn that is given in the present load step.
    pub fn tilt(&self) -> Option<[f64; 3]> {
        self.tilt.as_ref().map(|axial| axial.axial(number))
    }

    /// Return the moment that is given in the present load step.
    pub fn moment(&self) -> Option<[f64; 3]> {
        self.moment.as_ref().map(|axial| axial.axial(number))
    }

    /// Return what the first surface faces.
    fn partner(&self) -> Partner {
        if self.obstacle || self.on.is_some() {
            Partner::Obstacle
        } else if self.between.iter().all(|name| name.value == AUTO) {
            Partner::Nearby
        } else {
            Partner::Surface
        }
    }

    /// Return whether it is a rule that finds pairs, and names no surfaces: `between = "auto"`.
    pub fn is_rule(&self) -> bool {
        self.partner() == Partner::Nearby
    }
}

/// The direction of slip of a pair that is the shear of a bond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slip {
    /// Number of the table of the bond in the scene.
    pub table: usize,
    /// First or second direction along the surface, counted from 0.
    pub direction: usize,
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

/// What to do about surfaces that overlap before loading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum Overlap {
    /// The overlap compresses the layer, and the run warns.
    #[default]
    #[serde(rename = "compress")]
    Compress,
    /// The scene is refused.
    #[serde(rename = "error")]
    Refuse,
}

compile!(ContactSpec { between, on, of, layer, tension, unload, shear, seal, at, path, reference } else {
    gap, approach, force, tilt, moment, distance, angle, edge, touching, bond, obstacle, preload, overlap, table, slip
} then compile_steps);

impl ContactSpec {
    /// Compile what changes in load steps: forces and motions have their factors as variables, the gap these and the
    /// coordinates. An obstacle becomes the second surface.
    fn compile_steps(&mut self, names: &Names<'_>) -> Checked<()> {
        let Self { gap, approach, force, tilt, moment, .. } = self;
        let in_steps = names.in_steps();
        gap.compile(&in_steps)?;
        [approach, force].into_iter().try_for_each(|field| field.compile(&in_steps.with(&[])))?;
        [tilt, moment].into_iter().try_for_each(|axial| axial.compile(&in_steps.with(&[])))?;
        if let (Some(on), true) = (&self.on, self.between.iter().all(|name| name.is_empty())) {
            self.between = [on.clone(), Located::new(OBSTACLE.to_owned(), on.place.clone())];
        }
        Ok(())
    }
}

impl Check for ContactSpec {
    /// Check all but the layer, which is checked by itself.
    fn check(&self, geometry: Geometry) -> Result<(), Fault> {
        match self.partner() {
            Partner::Surface => self.check_pair()?,
            Partner::Nearby => self.check_rule()?,
            Partner::Obstacle => self.check_obstacle()?,
        }
        self.check_keys()?;
        self.check_forces(geometry)?;
        positive("angle", "the angle", self.angle)?;
        if self.angle > 90.0 {
            let message = format!("the angle is {} degrees", shown(self.angle));
            return Err(Fault::new("angle", message, "must be at most 90", ""));
        }
        positive("edge", "the angle of edges", self.edge)?;
        if self.edge > 180.0 {
            let message = format!("the angle of edges is {} degrees", shown(self.edge));
            return Err(Fault::new("edge", message, "must be at most 180", "at 180 no surface is split"));
        }
        if self.tension.is_some() && !self.bond {
            let help = "write bond = true, or leave `tension` away";
            return Err(Fault::new("tension", "only a bonded layer has a law in tension", "", help));
        }
        if let Some(shear) = &self.shear {
            if !self.bond {
                let help = "only a bond carries shear: bond = true; a layer that lets go slides without friction";
                return Err(Fault::new("shear", "`shear` of a layer that is no bond", "", help));
            }
            positive("shear", "the stiffness", if shear.is_constant() { shear.number() } else { 1.0 })?;
        }
        if let Some([first, second]) = self.seal.as_ref().filter(|[first, second]| first == second) {
            let error = Error::scene(&second.place, format!("a seal between `{}` and itself", first.value));
            return Err(error.help(SEAL).into());
        }
        self.distance.map_or(Ok(()), |distance| positive("distance", "the distance", distance))
    }
}

impl ContactSpec {
    /// Check a rule that finds pairs.
    fn check_rule(&self) -> Result<(), Fault> {
        if self.distance.is_none() {
            let help = "facets of different bodies that face each other at most that far apart form pairs";
            return Err(Fault::new("", "[[contact]] has no `distance`", "`distance` is missing", help));
        }
        Ok(self.of.iter().flatten().try_for_each(check_name)?)
    }

    /// Check a surface before an obstacle.
    fn check_obstacle(&self) -> Result<(), Fault> {
        let Some(on) = &self.on else {
            let help = "an obstacle is before one surface: on = \"top\"";
            return Err(Fault::new("obstacle", "[[contact]] has no `on`", "`on` is missing", help));
        };
        if !self.between[1].is_empty() && self.between[1].value != OBSTACLE {
            let (message, help) = ("[[contact]] has both `between` and `on`", "remove `between` or `on`");
            return Err(Fault::new("on", message, "only one of them can hold", help));
        }
        if !self.obstacle {
            let help = "one surface before a rigid obstacle has obstacle = true, two surfaces have between = [\"one\", \"other\"]";
            return Err(Fault::new("on", "`on` without an obstacle", "", help));
        }
        Ok(pattern::check(on)?)
    }

    /// Refuse keys that mean nothing before the partner of the surface.
    fn check_keys(&self) -> Result<(), Fault> {
        use Partner::{Nearby, Obstacle, Surface};
        let partner = self.partner();
        let keys: [(_, _, &[Partner]); 12] = [
            ("preload", self.preload.is_some(), &[Surface]),
            ("shear", self.shear.is_some(), &[Surface]),
            ("seal", self.seal.is_some(), &[Surface, Obstacle]),
            ("of", self.of.is_some(), &[Nearby]),
            ("distance", self.distance.is_some(), &[Surface, Nearby]),
            ("angle", self.angle != angle(), &[Surface, Nearby]),
            ("touching", self.touching, &[Surface, Nearby]),
            ("force", self.force.is_some(), &[Surface, Obstacle]),
            ("approach", self.approach.is_some(), &[Obstacle]),
            ("tilt", self.tilt.is_some(), &[Obstacle]),
            ("moment", self.moment.is_some(), &[Obstacle]),
            ("at", self.at.is_some(), &[Obstacle]),
        ];
        let means_nothing = |(_, is_given, before): &&(_, bool, &[Partner])| *is_given && !before.contains(&partner);
        let Some((key, _, before)) = keys.iter().find(means_nothing) else { return Ok(()) };
        let (whose, help) = match partner {
            _ if before == &[Obstacle] => ("of a contact without an obstacle", "on = \"top\", obstacle = true"),
            Surface => ("for surfaces with names", "it says which bodies form pairs with between = \"auto\""),
            Nearby => ("for pairs that are found", "name the two surfaces: between = [\"one\", \"other\"]"),
            Obstacle if *key == "preload" => ("of an obstacle", "it has a force in each load step: force = F"),
            Obstacle => (
                "of an obstacle",
                "it is for the meshes of two bodies: the `gap` alone says where an obstacle is; remove it",
            ),
        };
        Err(Fault::new(*key, format!("`{key}` {whose}"), "", help))
    }

    /// Check the forces and motions of obstacles and offsets.
    fn check_forces(&self, geometry: Geometry) -> Result<(), Fault> {
        self.tilt.as_ref().map_or(Ok(()), |tilt| tilt.check_axial("tilt", geometry))?;
        self.moment.as_ref().map_or(Ok(()), |moment| moment.check_axial("moment", geometry))?;
        if let Some(at) = &self.at {
            at.check("at", geometry)?;
            check_numbers(&at[..])?;
        }
        let turn = |axial: &Option<OneOrVector>| axial.as_ref().map(|axial| axial.fields().to_vec());
        let number = |field: &Option<Field>| field.clone().map(|field| vec![field]);
        let mut given = vec![
            ("approach", number(&self.approach)),
            ("force", number(&self.force)),
            ("preload", self.preload.map(|preload| vec![Field::Constant(preload)])),
            ("tilt", turn(&self.tilt)),
            ("moment", turn(&self.moment)),
            ("at", self.at.as_ref().map(|at| at.to_vec())),
        ];
        given.retain(|(_, values)| values.is_some());
        let of = |keys: &[&str]| given.iter().map(|(key, _)| *key).filter(|key| keys.contains(key)).collect::<Vec<_>>();
        for keys in [of(&["approach", "force", "preload"]), of(&["tilt", "moment"])] {
            if let [first, second, ..] = keys[..] {
                let message = format!("[[contact]] has both `{first}` and `{second}`");
                let help = format!("remove `{first}` or `{second}`");
                return Err(Fault::new(second, message, "only one of them can hold", &help));
            }
        }
        if let (Plane::Axisymmetric, [key, ..]) = (geometry.plane, &of(&["tilt", "moment"])[..]) {
            let message = "an obstacle that turns in an axisymmetric scene";
            return Err(Fault::new(*key, message, "it moves along the axis alone", ""));
        }
        given.iter().try_for_each(|(key, fields)| self.check_sign(key, fields.iter().flatten()))?;
        let is_scaled = |field: &Field| field.is_constant() && !field.is_zero();
        if self.path.is_some() && of(&["approach", "force", "preload", "tilt", "moment"]).is_empty() {
            return Err(Fault::new("path", "`path` without a force or motion of this contact", "", ""));
        }
        if self.path.is_some() && self.given().any(|field| !field.is_constant()) && !self.given().any(is_scaled) {
            let help = "remove it: an expression has the columns of the table as variables, force = \"100*press\"";
            return Err(Fault::new("path", "`path` of an expression", "", help));
        }
        Ok(())
    }

    /// Check that the numbers of a key are finite, and that a force which can only press is not negative. Expressions
    /// are known in each load step.
    fn check_sign<'f>(&self, key: &'static str, fields: impl Iterator<Item = &'f Field>) -> Result<(), Fault> {
        let values: Vec<f64> = fields.filter(|field| field.is_constant()).map(self::number).collect();
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Fault::new(key, format!("`{key}` is {value}"), "", ""));
        }
        let is_pull = key == "preload" || key == "force" && !self.bond;
        let Some(value) = values.first().filter(|value| is_pull && **value < 0.0) else { return Ok(()) };
        let help = match key {
            "preload" if self.bond => format!("a preload of a bonded pair is a tension already: write {}", -value),
            "preload" => "a preload > 0 presses".to_owned(),
            _ => "a force > 0 presses; only a bonded pair can be pulled".to_owned(),
        };
        Err(Fault::new(key, format!("a negative `{key}`"), "", &help))
    }

    /// Check a pair of surfaces: two plain names.
    fn check_pair(&self) -> Result<(), Fault> {
        let [a, b] = &self.between;
        if self.between.iter().all(|name| name.is_empty()) {
            return Err(Fault::new("", "[[contact]] has no `between`", "`between` is missing", EXAMPLE));
        }
        if a == b {
            let error = Error::scene(&b.place, format!("a contact between `{}` and itself", b.value));
            return Err(error.help("name one surface of each of two bodies").into());
        }
        if let Some(name) = self.between.iter().find(|name| name.value == OBSTACLE) {
            let error = Error::scene(&name.place, format!("a surface called `{OBSTACLE}`"));
            return Err(error.label("rigid obstacles have this name").help("give the surface another name").into());
        }
        if let Some(name) = self.between.iter().find(|name| name.contains(['*', '?'])) {
            let help =
                "many pairs are found between bodies: between = \"auto\", of = [\"one_*\", \"other_*\"], distance = D";
            let error = Error::scene(&name.place, format!("the pattern `{}` for one surface", name.value));
            return Err(error.label("one name belongs here").help(help).into());
        }
        Ok(())
    }
}

/// The name of an obstacle, where a pair has that of the second surface.
pub const OBSTACLE: &str = "obstacle";

/// Return the surfaces of a contact that names none.
fn nothing() -> [Located<String>; 2] {
    [String::new().into(), String::new().into()]
}

fn is_with_obstacle(between: &[Located<String>; 2]) -> bool {
    between[1].value == OBSTACLE
}

/// Return the number that a field without coordinates has in a load step.
fn number(field: &Field) -> f64 {
    field.eval([0.0; 3])
}

/// The value of `between` in rules that find pairs, and the name of both surfaces there.
const AUTO: &str = "auto";

const EXAMPLE: &str = "write between = [\"one\", \"other\"], or between = \"auto\" with a distance";

/// Read the two surfaces of a contact. With `between = "auto"` both are the word "auto".
fn between<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Located<String>; 2], D::Error> {
    let Located { value, place } = Located::<Form<Located<String>>>::deserialize(deserializer)?;
    match value {
        Form::Text(word) if word == AUTO => Ok([(); 2].map(|()| Located::new(word.clone(), place.clone()))),
        Form::Text(word) => {
            Err(refused(Error::scene(&place, format!("a contact between `{word}` alone")).help(EXAMPLE)))
        }
        Form::List(names) => {
            names.iter().try_for_each(pattern::check).map_err(refused)?;
            let count = |_| refused(Error::scene(&place, "a contact is between two surfaces").help(EXAMPLE));
            names.try_into().map_err(count)
        }
        other => Err(other.instead_of("\"auto\" or a list of two names", &place)),
    }
}

fn write_between<S: Serializer>(between: &[Located<String>; 2], serializer: S) -> Result<S::Ok, S::Error> {
    match between.each_ref().map(|name| name.value.as_str()) {
        [AUTO, AUTO] => AUTO.serialize(serializer),
        names => names.serialize(serializer),
    }
}

/// Read two names of bodies, or patterns of names.
fn of<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[Located<String>; 2]>, D::Error> {
    let names = two_names(deserializer, "pairs are of two bodies", "write of = [\"one_*\", \"other_*\"]")?;
    Ok(Some(names.map(|name| Located { value: plain_pattern(&name.value), ..name })))
}

/// What to write for a seal.
const SEAL: &str = "name what is on either side of it: seal = [\"bore\", \"outside\"]";

/// Read the groups at both ends of a seal.
fn seal<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[Located<String>; 2]>, D::Error> {
    two_names(deserializer, "a seal is between two groups", SEAL).map(Some)
}

/// Read two names. `message` and `help` are the error of any other number of them.
fn two_names<'de, D: Deserializer<'de>>(
    deserializer: D,
    message: &str,
    help: &str,
) -> Result<[Located<String>; 2], D::Error> {
    let Located { value: names, place } = Located::<Vec<Located<String>>>::deserialize(deserializer)?;
    names.iter().try_for_each(pattern::check).map_err(refused)?;
    names.try_into().map_err(|_| refused(Error::scene(&place, message).help(help)))
}
