//! The scene as data that declares its keys, and how it is built in Rust, checked, and compared between ranks and runs.

use crate::contact::law::{LayerLaw, OwnLaws};
use crate::data::Library;
use crate::ddm::gamma::{GammaRule, OwnRules};
use crate::error::{Error, Located, Place, Result, Source, shown};
use crate::file::digest;
use crate::problem::check::{Check, Fault, Find, at_least_one, positive};
use crate::problem::compile::compile;
use crate::problem::contact::Carrier;
use crate::problem::data::{DataKeys, library};
use crate::problem::geometry::Geometry;
use crate::problem::read::{Either, Form, of_word, some_table, table, tables};
use crate::problem::{BodySpec, ContactSpec, MeshSource, MethodName, MethodSpec, Plane, SolverSpec, Units};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::de::{Error as _, IgnoredAny};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value as Json, json};
use std::collections::{BTreeMap, HashSet};
use std::path::PathBuf;
use std::rc::Rc;

/// A checked scene.
// the description of `body` has the name of a table in brackets, which is no link
#[allow(rustdoc::broken_intra_doc_links)]
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// title of plots and reports; the name of the file without one
    #[serde(default)]
    pub title: String,
    /// 2 in the plane, 3 in space
    #[schemars(extend("enum" = [2, 3]))]
    pub dimension: Located<usize>,
    /// what a plane problem stands for
    #[serde(default)]
    pub plane: Plane,
    /// words for labels, such as "mm, MPa"; nothing is converted
    pub units: Option<Units>,
    /// a file name, or a table: mesh = { geo = "a.geo", set = { n = 32 } }
    pub mesh: MeshSource,
    /// functions from files; each begins with a line [data.NAME]
    ///
    /// A file that no expression and no layer uses is not read.
    #[serde(default, deserialize_with = "library", serialize_with = "crate::problem::data::write")]
    #[schemars(with = "BTreeMap<String, DataKeys>")]
    pub data: Library,
    /// a body starts with the line [[body]]
    ///
    /// The tables of bodies, in the order of the file. The name of a body may be a pattern, and so may the names of
    /// groups.
    #[serde(rename = "body", deserialize_with = "tables")]
    pub bodies: Vec<BodySpec>,
    /// a contact starts with the line [[contact]]
    ///
    /// Pairs of contact surfaces, and rules that find pairs on the mesh, in the order of the file.
    #[serde(rename = "contact", default, deserialize_with = "tables")]
    pub contacts: Vec<ContactSpec>,
    /// the iteration; Newton's method without it
    #[serde(default, deserialize_with = "table")]
    pub method: MethodSpec,
    /// the inner solver; chosen by the program without it
    #[serde(default)]
    pub solver: SolverSpec,
    /// whether to estimate the error that the mesh leaves
    #[serde(default)]
    pub estimate: bool,
    /// adapts the mesh to an error: adapt = { error = 1e-2 }
    #[serde(default, deserialize_with = "some_table")]
    pub adapt: Option<AdaptSpec>,
    /// what is written, and where
    #[serde(default, deserialize_with = "table")]
    pub output: OutputSpec,
    /// Path of the scene file, as given.
    #[serde(skip)]
    pub path: PathBuf,
    /// Laws of layers from a Rust program, by name.
    #[serde(skip)]
    pub laws: OwnLaws,
    /// Rules for gamma from a Rust program, by name.
    #[serde(skip)]
    pub own_rules: OwnRules,
    /// The surfaces that carry contact points on an earlier mesh of the scene, and on this one, too.
    #[serde(skip)]
    pub carriers: Vec<Carrier>,
}

/// The settings that have an option of their own in several commands.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Flags {
    /// Method: auto, robin, newton-robin, newton or semismooth (short for --set method.name=NAME)
    #[arg(long, value_name = "NAME", hide_possible_values = true)]
    pub method: Option<MethodName>,
    /// Estimate the error of the discretisation (short for --set estimate=true)
    #[arg(long)]
    pub estimate: bool,
    /// Adapt the mesh until the estimated errors of pressures and displacements, or of what adapt.of says, are at most
    /// this (short for --set adapt.error=E)
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
}

impl Flags {
    /// Set them in a scene that was read, and return their places. A method that a sweep varies stays.
    pub(super) fn apply(&self, scene: &mut Scene, find: &Find<'_>) -> BTreeMap<&'static str, Place> {
        let typed = |name: &str, value: String| {
            let (text, start) = (format!("{name} {value}"), name.len() + 1);
            Place { span: start..text.len(), source: Source { name: name.to_owned(), text }.into() }
        };
        scene.estimate |= self.estimate;
        let mut places = BTreeMap::new();
        if let Some(error) = self.tolerance {
            let error = Located::new(error, typed("--tolerance", shown(error)));
            places.insert("adapt.error", error.place.clone());
            let usual = || AdaptSpec { error: no_error(), of: Quantity::default(), cells: cells(), rounds: rounds() };
            scene.adapt.get_or_insert_with(usual).error = error;
        }
        let is_varied = find("method.name").is_some_and(|place| place.source.name == "--over");
        if let Some(name) = self.method.filter(|_| !is_varied) {
            scene.method.name = name;
            places.insert("method.name", typed("--method", name.name()));
        }
        places
    }
}

/// The accuracy to which meshes are adapted, and the limits of adaptation.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("required" = ["error"]))]
pub struct AdaptSpec {
    /// largest relative error of what `of` says: 0.01 is one per cent
    #[serde(default = "no_error")]
    pub error: Located<f64>,
    /// which errors count: "all" (pressures and displacements), "pressures", "displacements" or "forces" of contacts
    #[serde(default)]
    pub of: Quantity,
    /// most cells of a mesh
    #[serde(default = "cells")]
    #[schemars(range(min = 1))]
    pub cells: usize,
    /// most meshes
    #[serde(default = "rounds")]
    #[schemars(range(min = 1))]
    pub rounds: usize,
}

compile!(AdaptSpec { error } else { of, cells, rounds });

/// The results whose errors adapt the mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Pressures and displacements at the contact points.
    #[default]
    All,
    /// Pressures at the contact points.
    Pressures,
    /// Normal displacements at the contact points.
    Displacements,
    /// The normal force of each pair, the sum of its pressures.
    Forces,
}

/// Return the error of a table without one, which `--tolerance` may give.
fn no_error() -> Located<f64> {
    f64::NAN.into()
}

fn cells() -> usize {
    1_000_000
}

fn rounds() -> usize {
    10
}

impl Check for AdaptSpec {
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        if self.error.is_nan() {
            let help = "error: largest relative error of what `of` says: 0.01 is one per cent";
            return Err(Fault::new("", "`adapt` has no `error`", "`error` is missing", help));
        }
        positive("error", "the error", self.error.value)?;
        if self.error.value >= 1.0 {
            let message = format!("the error is {}", shown(self.error.value));
            return Err(Fault::new("error", message, "must be less than 1", "it is a share: 0.01 is one per cent"));
        }
        at_least_one("cells", self.cells)?;
        at_least_one("rounds", self.rounds)
    }
}

/// The files to write.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSpec {
    /// folder of the results; results/CASE without it
    ///
    /// The option `-o` wins.
    pub dir: Option<PathBuf>,
    /// whether to write fields for ParaView
    ///
    /// They are `<body>.vtu` and the `.pvd`.
    pub vtu: bool,
    /// whether to write fields as views for Gmsh
    pub msh: bool,
    /// whether to write the page report.html
    pub report: bool,
    /// of the numbers in VTU files
    pub precision: Precision,
    /// whether to draw the SVG plots
    pub plots: bool,
    /// most pairs with files of their own; 24
    ///
    /// The largest number stands for all.
    #[serde(deserialize_with = "pairs", serialize_with = "write_pairs")]
    #[schemars(with = "Option<Either<usize, AllPairs>>")]
    pub pairs: Option<usize>,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            dir: None,
            vtu: false,
            msh: false,
            report: false,
            precision: Precision::Double,
            plots: true,
            pairs: None,
        }
    }
}

impl Check for OutputSpec {
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        match &self.dir {
            Some(dir) if dir.as_os_str().is_empty() => Err(Fault::new("dir", "the name is empty", "", "")),
            _ => Ok(()),
        }
    }
}

/// The precision of numbers in VTU files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Eight bytes.
    Double,
    /// Four bytes.
    Single,
}

/// The word that stands for all pairs.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum AllPairs {
    All,
}

/// Read a number of pairs, or the word for all.
fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<usize>, D::Error> {
    let Located { value, place } = Located::<Form<IgnoredAny>>::deserialize(deserializer)?;
    match value {
        Form::Text(word) => of_word(&word).map(|AllPairs::All| Some(usize::MAX)),
        Form::Integer(count) => usize::try_from(count).map(Some).map_err(|_| D::Error::custom("must be 0 or more")),
        other => Err(other.instead_of("a whole number or \"all\"", &place)),
    }
}

fn write_pairs<S: Serializer>(count: &Option<usize>, serializer: S) -> Result<S::Ok, S::Error> {
    if *count == Some(usize::MAX) { serializer.serialize_str("all") } else { count.serialize(serializer) }
}

impl Scene {
    /// Return a scene without bodies, in the plane (`dimension` 2, plane strain) or in space (3), solved by Newton's
    /// method. Settings without a method of their own are fields of the scene.
    #[track_caller]
    pub fn new(dimension: usize, mesh: impl Into<MeshSource>) -> Self {
        let place = Place::here(&dimension.to_string());
        Self {
            title: "scene".to_owned(),
            path: place.source.name.clone().into(),
            dimension: Located::new(dimension, place),
            plane: Plane::Strain,
            units: None,
            mesh: mesh.into(),
            data: Library::new(),
            bodies: Vec::new(),
            contacts: Vec::new(),
            method: MethodSpec::default(),
            solver: SolverSpec::default(),
            estimate: false,
            adapt: None,
            output: OutputSpec::default(),
            laws: OwnLaws::default(),
            own_rules: OwnRules::default(),
            carriers: Vec::new(),
        }
    }

    /// Add a body.
    pub fn body(mut self, body: BodySpec) -> Self {
        self.bodies.push(body);
        self
    }

    /// Iterate over the pairs of contact surfaces that the scene names.
    pub fn pairs(&self) -> impl Iterator<Item = &ContactSpec> {
        self.contacts.iter().filter(|contact| !contact.is_rule())
    }

    /// Iterate over the rules that find pairs.
    pub fn rules(&self) -> impl Iterator<Item = &ContactSpec> {
        self.contacts.iter().filter(|contact| contact.is_rule())
    }

    /// Add a pair of contact surfaces, or a rule that finds pairs.
    pub fn contact(mut self, contact: ContactSpec) -> Self {
        self.contacts.push(ContactSpec { table: self.contacts.len(), ..contact });
        self
    }

    /// Set the outer iteration.
    pub fn method(self, method: MethodSpec) -> Self {
        Self { method, ..self }
    }

    /// Add a law of a layer, which [`LayerSpec::Own`](crate::problem::layer::LayerSpec::Own) uses by its name. `maker`
    /// gets the contact points (x, y, z) of a pair and returns the law for all of them. The law is checked at the first
    /// point: it must increase, and its energy must be the integral of its pressure.
    pub fn law<L: LayerLaw + 'static>(mut self, name: &str, maker: impl Fn(&[[f64; 3]]) -> L + 'static) -> Self {
        self.laws.insert(name, Rc::new(move |points: &[[f64; 3]]| Box::new(maker(points)) as _));
        self
    }

    /// Add a rule for gamma, which [`Gamma::Own`](crate::problem::method::Gamma::Own) uses by its name. `maker` returns
    /// a new rule for each run.
    pub fn rule<R: GammaRule + 'static>(mut self, name: &str, maker: impl Fn() -> R + 'static) -> Self {
        self.own_rules.insert(name, Rc::new(move || Box::new(maker()) as _));
        self
    }
}

impl Scene {
    /// Check what no later stage checks: numbers that are not fields, names, and keys that contradict each other.
    ///
    /// # Errors
    /// The first refusal, with the line of the program where the body, surface or group was named.
    pub fn check(&self) -> Result<()> {
        if self.adapt.is_some() {
            let message = "several meshes for one scene: only the command line makes them";
            return Err(Error::scene(&self.dimension.place, message));
        }
        self.verify(&|_| None)
    }

    /// Check the whole scene: each table by itself, and what tables have to do with each other.
    pub(super) fn verify(&self, find: &Find<'_>) -> Result<()> {
        let place = &self.dimension.place;
        let geometry = self.geometry();
        if !(geometry.is_plane() || (geometry.dimension == 3 && self.plane == Plane::Strain)) {
            let message = "the dimension is 2 or 3, and only plane problems have a `plane`";
            return Err(Error::scene(place, message));
        }
        self.mesh.refuse(geometry, "mesh", find, place)?;
        if self.bodies.is_empty() {
            return Err(Error::scene(place, "the scene has no body").help("a body starts with the line [[body]]"));
        }
        for (number, body) in self.bodies.iter().enumerate() {
            check_body(body, geometry, &format!("body.{number}"), find)?;
        }
        for (number, contact) in self.contacts.iter().enumerate() {
            let (near, path) = (&contact.between[0].place, format!("contact.{number}"));
            contact.refuse(geometry, &path, find, near)?;
            contact.layer.refuse(geometry, &format!("{path}.layer"), find, near)?;
            contact.tension.refuse(geometry, &format!("{path}.tension"), find, near)?;
            contact.unload.refuse(geometry, &format!("{path}.unload"), find, near)?;
        }
        self.check_names()?;
        self.method.refuse(geometry, "method", find, place)?;
        self.method.steps.refuse(geometry, "method.steps", find, place)?;
        self.method.stop.refuse(geometry, "method.stop", find, place)?;
        self.adapt.refuse(geometry, "adapt", find, place)?;
        self.output.refuse(geometry, "output", find, place)
    }

    /// Refuse bodies with one name, and contacts of one pair or rule.
    fn check_names(&self) -> Result<()> {
        let mut names = HashSet::new();
        if let Some(twice) = self.bodies.iter().map(|body| &body.name).find(|name| !names.insert(&name.value)) {
            return Err(Error::scene(&twice.place, format!("two bodies are called `{}`", twice.value))
                .label("taken by an earlier body")
                .help("names of bodies are those of physical groups of cells, one for each"));
        }
        let mut pairs = HashSet::new();
        for contact in &self.contacts {
            let sorted = |names: &[Located<String>; 2]| {
                let [a, b] = names.each_ref().map(|name| name.value.clone());
                if a < b { [a, b] } else { [b, a] }
            };
            let (rule, of) = (contact.is_rule(), contact.of.as_ref());
            let names = if rule { of } else { Some(&contact.between) };
            if pairs.insert((rule, names.map(sorted))) {
                continue;
            }
            let message = match names.map(|names| names.each_ref().map(|name| &name.value)) {
                None => "a second contact between \"auto\" of all bodies".to_owned(),
                Some([a, b]) if rule => format!("a second contact between \"auto\" of `{a}` and `{b}`"),
                Some([a, b]) => format!("a second contact of `{a}` and `{b}`"),
            };
            let place = &names.unwrap_or(&contact.between)[0].place;
            let help = if names.is_some() {
                "remove one of the two"
            } else {
                "name the bodies of each: of = [\"one_*\", \"other_*\"]"
            };
            return Err(Error::scene(place, message).help(help));
        }
        Ok(())
    }

    fn geometry(&self) -> Geometry {
        Geometry { dimension: self.dimension.value, plane: self.plane }
    }

    /// Return the scene as JSON, keyed like the scene file, with every default written out. Keys that have no default
    /// and were not given are left out. Expressions are texts.
    ///
    /// A key that is missing here is also ignored where scenes are compared: by a restart, in a sweep, and between
    /// ranks.
    pub fn settings(&self) -> Json {
        let mut settings = serde_json::to_value(self).unwrap_or_default();
        without_null(&mut settings);
        if self.dimension.value == 3 {
            remove(&mut settings, "", &["plane"]);
        }
        settings["scene"] = json!(self.path.display().to_string());
        settings
    }

    /// Return the settings without the names of files and folders. The name of each data file is replaced by a digest
    /// of its numbers; the settings have the numbers of tables themselves. The contents of the mesh's files are not
    /// included.
    pub fn contents(&self) -> Json {
        let mut settings = self.settings();
        remove(&mut settings, "", &["scene"]);
        remove(&mut settings, "/mesh", &["geo", "msh"]);
        remove(&mut settings, "/method/steps", &["table"]);
        remove(&mut settings, "/output", &["dir"]);
        for data in self.data.values() {
            settings["data"][&data.spec.name]["file"] = json!(digest(&data.numbers().collect::<Vec<f64>>()));
        }
        settings
    }

    /// Return the contents without the keys that change neither problem nor method: title, units and output.
    pub fn problem(&self) -> Json {
        let mut contents = self.contents();
        remove(&mut contents, "", &["title", "units", "output"]);
        contents
    }
}

/// Check the body at a path of the scene, and its lines.
fn check_body(body: &BodySpec, geometry: Geometry, path: &str, find: &Find<'_>) -> Result<()> {
    body.refuse(geometry, path, find, &body.name.place)?;
    let line = |line: &dyn Check, key: &str, number: usize, on: &Located<String>| {
        line.refuse(geometry, &format!("{path}.{key}.{number}"), find, &on.place)
    };
    body.regions.iter().enumerate().try_for_each(|(number, region)| line(region, "region", number, &region.on))?;
    body.fix.iter().enumerate().try_for_each(|(number, support)| line(support, "fix", number, &support.on))?;
    body.spring.iter().enumerate().try_for_each(|(number, spring)| line(spring, "spring", number, &spring.on))?;
    body.load.iter().enumerate().try_for_each(|(number, load)| line(load, "load", number, &load.on))
}

/// Remove keys of the table at a place (a JSON pointer) of settings, if it is there.
pub fn remove(settings: &mut Json, place: &str, keys: &[&str]) {
    if let Some(table) = settings.pointer_mut(place).and_then(Json::as_object_mut) {
        keys.iter().for_each(|key| drop(table.remove(*key)));
    }
}

/// Remove keys without a value, which TOML does not have.
fn without_null(value: &mut Json) {
    match value {
        Json::Object(entries) => {
            entries.retain(|_, value| !value.is_null());
            entries.values_mut().for_each(without_null);
        }
        Json::Array(items) => items.iter_mut().for_each(without_null),
        _ => {}
    }
}

/// Return the JSON schema of scene files (draft 2020-12).
pub fn schema() -> Json {
    let mut settings = SchemaSettings::draft2020_12();
    settings.inline_subschemas = true;
    let mut schema = settings.into_generator().into_root_schema_for::<Scene>().to_value();
    schema["title"] = json!("Scene of winkler");
    tidy(&mut schema);
    schema
}

/// Remove null from a schema, which TOML does not have, and call forms of a value `anyOf`.
fn tidy(schema: &mut Json) {
    match schema {
        Json::Object(entries) => {
            if let Some(forms) = entries.remove("oneOf") {
                entries.insert("anyOf".to_owned(), forms);
            }
            for key in ["type", "enum", "anyOf"] {
                let Some(Json::Array(forms)) = entries.get_mut(key) else { continue };
                forms.retain(|form| !form.is_null() && form != "null" && *form != json!({ "type": "null" }));
            }
            if let Some(Json::Array(types)) = entries.get("type")
                && let [only] = &types[..]
            {
                entries["type"] = only.clone();
            }
            entries.retain(|key, value| {
                key != "default" || !(value.is_null() || value == "" || value.is_array() || value.is_object())
            });
            if let Some(whole) = entries.get("default").and_then(Json::as_f64).filter(|number| number.fract() == 0.0) {
                entries.insert("default".to_owned(), json!(whole as i64));
            }
            entries.values_mut().for_each(tidy);
        }
        Json::Array(items) => items.iter_mut().for_each(tidy),
        _ => {}
    }
}
