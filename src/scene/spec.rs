//! What the user asked for, checked: the types of a scene.
//!
//! Everything that names a mesh group keeps its [`Located`] place, so that a refusal after the mesh was
//! read (missing group, surface of the wrong body) still points into the scene file.

use super::expression::{Differentiable, Field};
use super::layer::LayerSpec;
use super::{ElasticitySpec, RegionSpec, Sizing};
use crate::error::{Located, Place};
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
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// The bodies, in the order of the file.
    pub bodies: Vec<BodySpec>,
    /// The pairs of contact surfaces, in the order of the file.
    pub contacts: Vec<ContactSpec>,
    /// Pairs to be found on the mesh, if the scene asks for that.
    pub auto: Option<AutoContact>,
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

/// What the plane of a plane problem stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// No out-of-plane strain.
    Strain,
    /// No out-of-plane stress.
    Stress,
    /// A meridian of bodies of revolution: x is the radius, y runs along the axis.
    Axisymmetric,
}

impl Plane {
    /// The choices with their names in the scene.
    pub const ALL: [(&'static str, Plane); 3] =
        [("strain", Plane::Strain), ("stress", Plane::Stress), ("axisymmetric", Plane::Axisymmetric)];
}

/// Where the mesh comes from; paths are relative to the scene file's folder and already joined with it.
#[derive(Debug, Clone)]
pub enum MeshSource {
    /// A Gmsh geometry script and the numbers set in it (`gmsh -setnumber NAME VALUE`), sorted by name.
    Geo {
        /// The script.
        file: Located<PathBuf>,
        /// Names and numbers, sorted by name.
        set: Vec<(String, f64)>,
        /// Where each name stands.
        places: Vec<Place>,
        /// Sizes of elements instead of the script's own; no scene file has them.
        sizes: Option<Sizing>,
    },
    /// A mesh file, format 4.1, text or binary.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
}

/// Polynomial order of the displacements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// Linear simplices.
    P1,
    /// Quadratic simplices.
    P2,
}

impl Order {
    /// Polynomial degree: 1 or 2.
    pub fn degree(self) -> usize {
        match self {
            Order::P1 => 1,
            Order::P2 => 2,
        }
    }
}

/// A body: a named group of cells, its elasticity, supports and loads.
#[derive(Debug, Clone)]
pub struct BodySpec {
    /// Name of the physical group of cells; `[a-z][a-z0-9]*`, no PETSc family word (it is an option prefix).
    pub name: Located<String>,
    /// What it is made of.
    pub elasticity: ElasticitySpec,
    /// Parts of it that are made of something else.
    pub regions: Vec<RegionSpec>,
    /// Polynomial order.
    pub order: Order,
    /// Supports: prescribed displacement components on named groups.
    pub fix: Vec<Support>,
    /// Loads on named groups.
    pub load: Vec<Load>,
    /// Springs to the ground on named groups.
    pub spring: Vec<SpringSpec>,
    /// Body force density (x, y, z), if any.
    pub force: Option<[Field; 3]>,
    /// A known displacement to compare with, if any: as many components as the scene has dimensions, of x, y (z).
    pub exact: Option<Vec<Differentiable>>,
}

/// Prescribed displacement components on a named group (a boundary, or points).
#[derive(Debug, Clone)]
pub struct Support {
    /// The physical group.
    pub on: Located<String>,
    /// Prescribed value of each component; `None` leaves it free.
    pub value: [Option<Field>; 3],
    /// Prescribed displacement along the outer normal of a plane surface.
    pub normal: Option<Field>,
}

/// Springs to the ground on a named boundary (per area) or at points.
#[derive(Debug, Clone)]
pub struct SpringSpec {
    /// The physical group.
    pub on: Located<String>,
    /// How stiff they are.
    pub kind: SpringKind,
}

/// Kinds of springs; stiffnesses are >= 0.
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
    /// What acts there.
    pub kind: LoadKind,
}

/// Kinds of boundary load.
#[derive(Debug, Clone)]
pub enum LoadKind {
    /// Pressure against the outer normal, > 0 pushes.
    Pressure(Field),
    /// Traction vector (x, y, z).
    Traction([Field; 3]),
    /// Force on the whole boundary.
    Force {
        /// The force (x, y, z).
        total: [f64; 3],
        /// Whether the boundary moves as one, by a translation; else the force is spread evenly.
        rigid: bool,
    },
}

/// A pair of contact surfaces and the layer between them.
#[derive(Debug, Clone)]
pub struct ContactSpec {
    /// The two physical groups.
    pub between: [Located<String>; 2],
    /// The scene's own gap d(x), added to the geometric distance; zero if not given.
    pub gap: Field,
    /// Law of the layer.
    pub layer: LayerSpec,
    /// Whether the surfaces are taken to touch wherever they face each other: only [`ContactSpec::gap`] counts, not the
    /// distance of the meshes.
    pub touching: bool,
    /// What to do about surfaces that overlap before loading.
    pub overlap: Overlap,
    /// A known contact pressure to draw and compare with, if any.
    pub reference: Option<Field>,
}

/// What to do about surfaces that overlap before loading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlap {
    /// The layer takes it as compression, with a warning.
    Compress,
    /// The scene is refused.
    Refuse,
}

impl Overlap {
    /// The choices with their names in the scene.
    pub const ALL: [(&'static str, Overlap); 2] = [("compress", Overlap::Compress), ("error", Overlap::Refuse)];
}

/// Contact of all bodies that come near each other, where no [`ContactSpec`] names surfaces of the two.
#[derive(Debug, Clone)]
pub struct AutoContact {
    /// Largest distance of facets that form a pair, > 0.
    pub distance: f64,
    /// What holds for each pair; `between` is to be replaced by the names of the bodies.
    pub contact: ContactSpec,
}

/// The outer iteration.
#[derive(Debug, Clone)]
pub struct MethodSpec {
    /// How steps are made. Without a name it is [`MethodName::Robin`] where psi, gamma, robin or the increment rule are given,
    /// else [`MethodName::Auto`].
    pub name: MethodName,
    /// Robin zone psi.
    pub psi: Zone,
    /// Robin coefficient on the zone.
    pub robin: RobinSpec,
    /// Relaxation of the method `robin`.
    pub gamma: Gamma,
    /// Whether `robin` finds the interval (33) of gamma at the end.
    pub interval: bool,
    /// Earlier steps that the method `anderson` mixes.
    pub depth: usize,
    /// Start of the iteration.
    pub start: Start,
    /// Shares of the loads, one after another and 1 at last; none are no steps.
    pub steps: Vec<f64>,
    /// When to stop.
    pub stop: StopSpec,
}

/// Methods by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodName {
    /// The program's choice, and its change when progress stops.
    Auto,
    /// The paper's iteration (41)-(42).
    Robin,
    /// Nonlinear conjugate gradients over the sweep.
    Ncg,
    /// Anderson acceleration of the sweep.
    Anderson,
    /// Semismooth Newton (35), its systems by conjugate gradients over the sweep.
    NewtonRobin,
    /// Semismooth Newton (35), its systems by one factorisation of all bodies together.
    Newton,
}

impl MethodName {
    /// Every method with its name in the scene.
    pub const ALL: [(&'static str, MethodName); 6] = [
        ("auto", MethodName::Auto),
        ("robin", MethodName::Robin),
        ("ncg", MethodName::Ncg),
        ("anderson", MethodName::Anderson),
        ("newton-robin", MethodName::NewtonRobin),
        ("newton", MethodName::Newton),
    ];
}

/// Relaxation gamma^k.
#[derive(Debug, Clone, PartialEq)]
pub enum Gamma {
    /// The same number > 0 all the way.
    Stationary(f64),
    /// Numbers > 0 for k = 0, 1, ...; the last one stays.
    Schedule(Vec<f64>),
    /// Exact line search on F1.
    LineSearch,
    /// Aitken's rule.
    Aitken,
    /// The rule of Barzilai and Borwein.
    BarzilaiBorwein,
    /// Best stationary value for the estimated spectrum.
    Spectral,
}

impl Gamma {
    /// Rules with a name in the scene.
    pub const NAMED: [(&'static str, Gamma); 4] = [
        ("line-search", Gamma::LineSearch),
        ("aitken", Gamma::Aitken),
        ("barzilai-borwein", Gamma::BarzilaiBorwein),
        ("spectral", Gamma::Spectral),
    ];
}

/// Robin coefficient kappa on the zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobinSpec {
    /// The layer's tangent, as in the paper.
    Tangent,
    /// The tangent of the start, all the way.
    Frozen,
    /// The tangent, but at least this number > 0 on the whole contact surfaces.
    Floor(f64),
    /// The tangent, and more where a body would not be held safely.
    Auto,
}

/// Robin zone: where psi = 1 in (38).
#[derive(Debug, Clone)]
pub enum Zone {
    /// psi = 0: Neumann-Neumann.
    None,
    /// psi = 1: full Robin.
    Full,
    /// psi = chi = \[c > 0\] (36).
    Active,
    /// psi = \[expression is true, or a number > 0\], in x, y, z and the iteration k = 0, 1, ...
    Subset(Field),
}

/// Start of the iteration, given on the contact surfaces.
#[derive(Debug, Clone)]
pub enum Start {
    /// Rigid bodies on their own surfaces.
    Auto,
    /// Zero normal displacement.
    Zero,
    /// The solution on a mesh of elements twice as large.
    Nested,
    /// Outer normal displacement on every contact surface.
    Normal(Field),
}

/// When to stop. At least one of `residual` and `increment` is given; the first rule met stops.
#[derive(Debug, Clone, PartialEq)]
pub struct StopSpec {
    /// Relative residual (docs/theory.md); default 1e-8 when `increment` is not given.
    pub residual: Option<f64>,
    /// The paper's rule on the increment of normal displacements, for every body.
    pub increment: Option<f64>,
    /// Whether to stop where the error of the iteration is a tenth of that of the discretisation.
    pub balanced: bool,
    /// Most iterations; default 2000.
    pub iterations: usize,
}

/// Inner solver asked for in the scene; PETSc options override it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SolverSpec {
    /// A preset, or the program's choice.
    pub preset: Option<Preset>,
    /// PETSc options of the scene, as words, weaker than those of the command line.
    pub options: Vec<String>,
}

/// Presets of inner solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// Sparse Cholesky factorisation by MUMPS.
    Mumps,
    /// The interior eliminated once by MUMPS, a dense problem on the contact in each sweep.
    Condensed,
    /// Conjugate gradients preconditioned by hypre's BoomerAMG.
    Hypre,
    /// Conjugate gradients preconditioned by PETSc's GAMG.
    Gamg,
    /// Conjugate gradients preconditioned by an incomplete Cholesky factorisation.
    Icc,
}

impl Preset {
    /// Every preset with its name in the scene.
    pub const ALL: [(&'static str, Preset); 5] = [
        ("mumps", Preset::Mumps),
        ("condensed", Preset::Condensed),
        ("hypre", Preset::Hypre),
        ("gamg", Preset::Gamg),
        ("icc", Preset::Icc),
    ];

    /// Its name in the scene.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, preset)| *preset == self).map_or("", |(name, _)| name)
    }
}

impl Default for MethodSpec {
    fn default() -> Self {
        Self {
            name: MethodName::Auto,
            psi: Zone::Active,
            robin: RobinSpec::Auto,
            gamma: Gamma::Stationary(0.6),
            interval: false,
            depth: 5,
            start: Start::Auto,
            steps: Vec::new(),
            stop: StopSpec::default(),
        }
    }
}

impl Default for StopSpec {
    fn default() -> Self {
        Self { residual: Some(1e-8), increment: None, balanced: false, iterations: 2000 }
    }
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
    /// Whether to draw the SVG plots; default true.
    pub plots: bool,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self { dir: None, vtu: false, plots: true }
    }
}
