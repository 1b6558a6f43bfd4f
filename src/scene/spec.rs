//! The checked scene: a problem, how to solve it, and what to write.

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
    /// Path of the scene file, as given.
    pub path: PathBuf,
    /// Title; by default the name of the file without its extension.
    pub title: String,
    /// Space dimension: 2 or 3.
    pub dimension: Located<usize>,
    /// What a plane problem stands for: plane strain (default), plane stress, or bodies of revolution.
    pub plane: Plane,
    /// Names of the units for labels, if they are given.
    pub units: Option<Units>,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// Laws of layers from a Rust program, by name.
    pub laws: OwnLaws,
    /// Rules for gamma from a Rust program, by name.
    pub rules: OwnRules,
    /// Functions from files, by name. A file that no expression and no layer uses is not read.
    pub data: Library,
    /// The tables of bodies, in the order of the file. The name of a body may be a pattern, and so may the names of groups.
    pub bodies: Vec<BodySpec>,
    /// The pairs of contact surfaces, in the order of the file.
    pub contacts: Vec<ContactSpec>,
    /// Rules that find pairs on the mesh, in the order of the file.
    pub auto: Vec<AutoContact>,
    /// The outer iteration.
    pub method: MethodSpec,
    /// The inner solver.
    pub solver: SolverSpec,
    /// Whether to estimate the error of the discretisation.
    pub estimate: bool,
    /// How meshes are adapted, if the scene requests it.
    pub adapt: Option<AdaptSpec>,
    /// What to write.
    pub output: OutputSpec,
}

/// The accuracy to which meshes are adapted, and the limits of adaptation.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptSpec {
    /// The requested relative error of pressures and displacements.
    pub error: f64,
    /// The most cells of a mesh.
    pub cells: usize,
    /// The most meshes.
    pub rounds: usize,
    /// Place of the requested error.
    pub place: Place,
}

/// The files to write.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSpec {
    /// Folder for the results, if the scene names one (`-o` wins).
    pub dir: Option<PathBuf>,
    /// Whether to write `<body>.vtu` and the `.pvd`; default false.
    pub vtu: bool,
    /// Whether to write `<body>.msh` with views for Gmsh; default false.
    pub msh: bool,
    /// How the numbers of `.vtu` files are written.
    pub encoding: Encoding,
    /// Whether to write the page of the run, `report.html`; default false.
    pub report: bool,
    /// Whether to draw the SVG plots; default true.
    pub plots: bool,
    /// The most pairs with tables and plots of their own; by default as many as a person looks through.
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
