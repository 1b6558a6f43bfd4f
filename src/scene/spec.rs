//! What the user asked for, checked: a problem, and what to do with it.

use crate::contact::law::OwnLaws;
use crate::data::Library;
use crate::ddm::gamma::OwnRules;
use crate::error::{Located, Place};
use crate::output::vtu::Encoding;
use crate::problem::{AutoContact, BodySpec, ContactSpec, MeshSource, MethodSpec, Plane, SolverSpec, Units};
use std::path::PathBuf;

/// A checked scene.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Path of the scene file as given.
    pub path: PathBuf,
    /// Title, or the file's stem.
    pub title: String,
    /// Space dimension: 2 or 3.
    pub dimension: Located<usize>,
    /// Plane strain (default), plane stress or bodies of revolution; plane problems only.
    pub plane: Plane,
    /// Units of its numbers, if it names them: words for labels.
    pub units: Option<Units>,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// Laws of layers that a Rust program brings, by name.
    pub laws: OwnLaws,
    /// Rules for gamma that a Rust program brings, by name.
    pub rules: OwnRules,
    /// Functions from files, by name; those that no expression uses are not read.
    pub data: Library,
    /// The tables of bodies, in the order of the file; the name of one may be a pattern, and so may those of groups.
    pub bodies: Vec<BodySpec>,
    /// The pairs of contact surfaces, in the order of the file.
    pub contacts: Vec<ContactSpec>,
    /// Rules for pairs to be found on the mesh, in the order of the file.
    pub auto: Vec<AutoContact>,
    /// The outer iteration.
    pub method: MethodSpec,
    /// The inner solver.
    pub solver: SolverSpec,
    /// Whether to estimate the error of the discretisation.
    pub estimate: bool,
    /// Meshes adapted to an error, if asked for.
    pub adapt: Option<AdaptSpec>,
    /// What to write.
    pub output: OutputSpec,
}

/// Meshes adapted until an estimated error is small enough.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptSpec {
    /// Relative error of pressures and displacements asked for.
    pub error: f64,
    /// Most cells of a mesh.
    pub cells: usize,
    /// Most meshes.
    pub rounds: usize,
    /// Where the error was asked for.
    pub place: Place,
}

/// What to write.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSpec {
    /// Folder for the results, if the scene names one (`-o` wins).
    pub dir: Option<PathBuf>,
    /// Whether to write `<body>.vtu` and the `.pvd`; default false.
    pub vtu: bool,
    /// Whether to write `<body>.msh` with views for Gmsh; default false.
    pub msh: bool,
    /// How the `.vtu` are written.
    pub encoding: Encoding,
    /// Whether to write the page of the run, `report.html`; default false.
    pub report: bool,
    /// Whether to draw the SVG plots; default true.
    pub plots: bool,
    /// Most pairs with tables and plots of their own; by default as many as a person looks through.
    pub pairs: Option<usize>,
    /// Minutes between checkpoints; none by default.
    pub checkpoint: Option<f64>,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            dir: None,
            vtu: false,
            msh: false,
            encoding: Encoding::default(),
            report: false,
            plots: true,
            pairs: None,
            checkpoint: None,
        }
    }
}
