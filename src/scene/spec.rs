//! The scene as data that declares its keys, and how it is built in Rust and compared between ranks and runs.

use crate::contact::law::{LayerLaw, OwnLaws};
use crate::data::Library;
use crate::ddm::gamma::{GammaRule, OwnRules};
use crate::error::{Located, Place, Result};
use crate::file::digest;
use crate::problem::contact::Carrier;
use crate::problem::{AutoContact, BodySpec, ContactSpec, MeshSource, MethodSpec, Plane, SolverSpec, Units};
use crate::setting::{Context, Node, Setting, ValueKind, choose, keys, remove, table, word, words};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::rc::Rc;

keys! {
    /// A checked scene.
    // the description of `body` has the name of a table in brackets, which is no link
    #[allow(rustdoc::broken_intra_doc_links)]
    #[derive(Debug, Clone)]
    pub struct Scene "the scene" {
        required {
            /// a file name, or a table: mesh = { geo = "a.geo", set = { n = 32 } }
            pub mesh: MeshSource,
            /// a body starts with the line [[body]]
            ///
            /// The tables of bodies, in the order of the file. The name of a body may be a pattern, and so may the names of groups.
            pub bodies as "body": Vec<BodySpec>,
        }
        optional {
            /// what a plane problem stands for
            pub plane: Plane = Plane::Strain,
            /// words for labels, such as "mm, MPa"; nothing is converted
            pub units: Option<Units> = None,
            /// the iteration; Newton's method without it
            pub method: MethodSpec = MethodSpec::default(),
            /// the inner solver; chosen by the program without it
            pub solver: SolverSpec = SolverSpec::default(),
            /// whether to estimate the error that the mesh leaves
            pub estimate: bool = false,
            /// adapts the mesh to an error: adapt = { error = 1e-2 }
            pub adapt: Option<AdaptSpec> = None,
            /// what is written, and where
            pub output: OutputSpec = OutputSpec::default(),
        }
        besides {
            /// Path of the scene file, as given.
            pub path: PathBuf,
            /// Title; by default the name of the file without its extension.
            pub title: String,
            /// Space dimension: 2 or 3.
            pub dimension: Located<usize>,
        }
        initially {
            /// Laws of layers from a Rust program, by name.
            pub laws: OwnLaws = OwnLaws::default(),
            /// Rules for gamma from a Rust program, by name.
            pub rules: OwnRules = OwnRules::default(),
            /// Functions from files, by name. A file that no expression and no layer uses is not read.
            pub data: Library = Library::new(),
            /// The pairs of contact surfaces, in the order of the file.
            pub contacts: Vec<ContactSpec> = Vec::new(),
            /// Rules that find pairs on the mesh, in the order of the file.
            pub auto: Vec<AutoContact> = Vec::new(),
            /// The surfaces that carry contact points on an earlier mesh of the scene, and on this one, too.
            pub carriers: Vec<Carrier> = Vec::new(),
        }
    }
}

table! {
    /// The accuracy to which meshes are adapted, and the limits of adaptation.
    #[derive(Debug, Clone, PartialEq)]
    pub struct AdaptSpec "`adapt`" {
        required {
            /// largest relative error of pressures and displacements: 0.01 is one per cent
            pub error: Located<f64>,
        }
        optional {
            /// most cells of a mesh
            pub cells: usize = 1_000_000,
            /// most meshes
            pub rounds: usize = 10,
        }
    }
}

table! {
    /// The files to write.
    #[derive(Debug, Clone, PartialEq)]
    pub struct OutputSpec "[output]" {
        optional {
            /// folder of the results; results/CASE without it
            ///
            /// The option `-o` wins.
            pub dir: Option<PathBuf> = None,
            /// whether to write fields for ParaView
            ///
            /// They are `<body>.vtu` and the `.pvd`.
            pub vtu: bool = false,
            /// whether to write fields as views for Gmsh
            pub msh: bool = false,
            /// whether to write the page report.html
            pub report: bool = false,
            /// of the numbers in VTU files
            pub precision: Precision = Precision::Double,
            /// whether to draw the SVG plots
            pub plots: bool = true,
            /// most pairs with files of their own; 24
            pub pairs: Option<Most> = None,
        }
    }
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self::with_defaults()
    }
}

words! {
    /// The precision of numbers in VTU files.
    pub enum Precision "precision" {
        /// Eight bytes.
        Double = "double",
        /// Four bytes.
        Single = "single",
    }
}

/// The most pairs with files of their own; the largest number stands for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Most(pub usize);

/// The word that stands for all pairs.
const ALL: [(&str, Most); 1] = [("all", Most(usize::MAX))];

impl Setting for Most {
    fn kind() -> ValueKind {
        ValueKind::Either(vec![ValueKind::Integer(0), word(&ALL)])
    }

    fn read(node: &Node, _: &Context) -> Result<Self> {
        match node.string() {
            Ok(_) => choose(node, "number of pairs", &ALL),
            Err(_) => node.count().map(Self),
        }
    }

    fn echo(&self, _: usize) -> Json {
        if self.0 == usize::MAX { json!("all") } else { json!(self.0) }
    }
}

impl Scene {
    /// Return a scene without bodies, in the plane (`dimension` 2, plane strain) or in space (3), solved by Newton's method. Settings
    /// without a method of their own are fields of the scene.
    #[track_caller]
    pub fn new(dimension: usize, mesh: impl Into<MeshSource>) -> Self {
        let place = Place::here(&dimension.to_string());
        let path = place.source.name.clone().into();
        Self::with_defaults(mesh.into(), Vec::new(), path, "scene".to_owned(), Located::new(dimension, place))
    }

    /// Add a body.
    pub fn body(mut self, body: BodySpec) -> Self {
        self.bodies.push(body);
        self
    }

    /// Add a pair of contact surfaces.
    pub fn contact(mut self, contact: ContactSpec) -> Self {
        self.contacts.push(ContactSpec { table: self.contacts.len(), ..contact });
        self
    }

    /// Set the outer iteration.
    pub fn method(self, method: MethodSpec) -> Self {
        Self { method, ..self }
    }

    /// Add a law of a layer, which [`LayerSpec::Own`](crate::problem::layer::LayerSpec::Own) uses by its name. `maker` gets the contact
    /// points (x, y, z) of a pair and returns the law for all of them. The law is checked at the first point: it must increase, and have
    /// its derivative and its integral.
    pub fn law<L: LayerLaw + 'static>(mut self, name: &str, maker: impl Fn(&[[f64; 3]]) -> L + 'static) -> Self {
        self.laws.insert(name, Rc::new(move |points: &[[f64; 3]]| Box::new(maker(points)) as _));
        self
    }

    /// Add a rule for gamma, which [`Gamma::Own`](crate::problem::method::Gamma::Own) uses by its name. `maker` returns a new rule for
    /// each run.
    pub fn rule<R: GammaRule + 'static>(mut self, name: &str, maker: impl Fn() -> R + 'static) -> Self {
        self.rules.insert(name, Rc::new(move || Box::new(maker()) as _));
        self
    }
}

impl Scene {
    /// Return the settings without the names of files and folders. The name of each data file is replaced by a digest of its numbers;
    /// the settings have the numbers of tables themselves. The contents of the mesh's files are not included.
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
