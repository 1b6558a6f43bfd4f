//! Where meshes come from.

use super::check::{Check, Fault, at_least_one, positive};
use super::compile::{Compile, Names, find};
use super::geometry::Geometry;
use super::order::Order;
use super::read::{Either, Form, only_one, place, refused, unplaced};
use crate::error::{Error, Kind, Located, Place, Result as Checked, Source};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use toml::Spanned;

/// Limits and settings of Gmsh for a script or a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// Largest size of elements in a shape.
    pub size: Option<f64>,
    /// Threads of Gmsh for free meshes in space, by HXT even where it makes another mesh in each run.
    pub threads: Option<usize>,
    /// Seconds after which Gmsh is ended.
    pub seconds: f64,
}

impl Default for Guard {
    /// Return the settings of a scene that gives none: ten times what Gmsh takes for a million tetrahedra.
    fn default() -> Self {
        Self { size: None, threads: None, seconds: 1000.0 }
    }
}

/// The keys of `mesh`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MeshKeys {
    /// a Gmsh script, or a shape (.step, .iges, .brep, .stl), relative to the scene's folder
    #[schemars(with = "Option<String>")]
    geo: Option<Located<PathBuf>>,
    /// a mesh: Gmsh's .msh, or a format that Gmsh converts
    #[schemars(with = "Option<String>")]
    msh: Option<Located<PathBuf>>,
    /// numbers for the script: set = { n = 32 }
    #[schemars(with = "Option<BTreeMap<String, f64>>")]
    set: Option<Located<BTreeMap<Spanned<String>, f64>>>,
    /// largest size of elements in a shape
    size: Option<Located<f64>>,
    /// threads of Gmsh for free meshes in space, by HXT
    #[schemars(range(min = 1))]
    threads: Option<Located<usize>>,
    /// seconds after which Gmsh is ended; 1000
    timeout: Option<Located<f64>>,
}

/// Where the mesh comes from. Paths are joined with the folder of the scene file.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(with = "Either<String, MeshKeys>")]
pub enum MeshSource {
    /// What Gmsh meshes.
    Geo(GmshSource),
    /// A mesh file: Gmsh's format 4.1 or 2.2, text or binary, a deck (`.inp`), or a format that Gmsh converts.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
    /// Arrays from a Rust program.
    Arrays(Rc<MeshArrays>),
}

/// A Gmsh script with numbers set in it (`gmsh -setnumber NAME VALUE`), or a shape of another program.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshSource {
    /// The script, or the file of the shape.
    pub file: Located<PathBuf>,
    /// Names and numbers, sorted by name.
    pub set: Vec<(Located<String>, f64)>,
    /// What an adaptation asks of the mesh. No scene file has it.
    pub adapted: Option<Arc<AdaptedMesh>>,
    /// Limits and settings of Gmsh.
    pub guard: Guard,
}

/// What an adaptation asks of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdaptedMesh {
    /// Sizes of elements that Gmsh follows instead of those of the script, as the text of a view (`.pos`).
    pub sizes: String,
    /// Places of the scene where the boundaries in the plane get vertices.
    pub vertices: Vec<[f64; 3]>,
}

impl MeshSource {
    /// Return a Gmsh script with the numbers `set` in it. Its mesh is made once and kept in the cache. A script is a
    /// program: it can start others and write files.
    #[track_caller]
    pub fn script(file: impl AsRef<Path>, set: &[(&str, f64)]) -> Self {
        let file = file.as_ref();
        let place = Place::here(&file.display().to_string());
        let named = |&(name, value): &(&str, f64)| (Located::new(name.to_owned(), place.clone()), value);
        let mut set: Vec<_> = set.iter().map(named).collect();
        set.sort_by(|(a, _), (b, _)| a.value.cmp(&b.value));
        let file = Located::new(file.to_owned(), place);
        Self::Geo(GmshSource { file, set, adapted: None, guard: Guard::default() })
    }

    /// Return the mesh of a file that was typed as an argument: a script or shape for Gmsh, or a mesh.
    ///
    /// # Errors
    /// There is no such file.
    pub fn of_argument(path: &Path) -> Checked<Self> {
        let text = path.display().to_string();
        let place = Place { span: 0..text.len(), source: Arc::new(Source { name: "argument".to_owned(), text }) };
        let mut file = Located::new(path.to_owned(), place);
        find(&mut file, Path::new(""))?;
        MeshKeys::of_name(file).source()
    }

    /// Return a mesh file with named groups: `.msh` of Gmsh, or a format that Gmsh converts.
    #[track_caller]
    pub fn file(file: impl AsRef<Path>) -> Self {
        let place = Place::here(&file.as_ref().display().to_string());
        Self::Msh { file: Located::new(file.as_ref().to_owned(), place) }
    }
}

/// Kinds of file with the shape of bodies.
const SHAPES: [&str; 6] = ["step", "stp", "iges", "igs", "brep", "stl"];

/// Return whether a file has the shape of bodies, by its name.
pub fn is_shape(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    SHAPES.iter().any(|kind| ending == *kind || ending == kind.to_ascii_uppercase().as_str())
}

impl MeshKeys {
    /// Return the keys that the name of a file stands for.
    fn of_name(name: Located<PathBuf>) -> Self {
        if is_shape(&name) || name.extension().is_some_and(|ending| ending == "geo") {
            Self { geo: Some(name), ..Self::default() }
        } else {
            Self { msh: Some(name), ..Self::default() }
        }
    }

    /// Return the mesh.
    fn source(self) -> Checked<MeshSource> {
        only_one("the mesh", &[("geo", place(&self.geo)), ("msh", place(&self.msh))])?;
        let of_gmsh = [
            ("set", place(&self.set)),
            ("size", place(&self.size)),
            ("threads", place(&self.threads)),
            ("timeout", place(&self.timeout)),
        ];
        if let Some(file) = self.msh {
            if is_shape(&file) {
                return Err(Error::scene(&file.place, "this is the shape of bodies, and no mesh")
                    .help("mesh = { geo = \"...\", size = 0.1 }"));
            }
            return match of_gmsh.into_iter().find_map(|(key, place)| Some((key, place?))) {
                None => Ok(MeshSource::Msh { file }),
                Some((key, place)) => Err(Error::scene(place, format!("`{key}` for a finished mesh"))
                    .help("it is for Gmsh, which makes meshes from scripts: mesh = { geo = \"...\" }")),
            };
        }
        let Some(file) = self.geo else {
            return Err(Error::new(Kind::Scene, "the mesh has no `geo`")
                .label("`geo` is missing")
                .help("write the name of a file, or mesh = { geo = \"a.geo\", set = { n = 32 } }"));
        };
        if let (Some(size), false) = (&self.size, is_shape(&file)) {
            return Err(Error::scene(&size.place, "`size` for a script, which has sizes of its own")
                .help("it is for shapes (.step, .iges, .brep, .stl): give scripts numbers by set = { n = 32 }"));
        }
        let numbers = self.set.map(|set| set.value).unwrap_or_default();
        let mut set = Vec::new();
        for (name, number) in numbers {
            let place = unplaced(name.span());
            check_number(name.get_ref(), number, &place)?;
            set.push((Located::new(name.into_inner(), place), number));
        }
        let [size, seconds] = [self.size, self.timeout].map(|number| number.map(|number| number.value));
        let guard = Guard {
            size,
            threads: self.threads.map(|threads| threads.value),
            seconds: seconds.unwrap_or(Guard::default().seconds),
        };
        Ok(MeshSource::Geo(GmshSource { file, set, adapted: None, guard }))
    }
}

/// Refuse what cannot be a number of Gmsh, or its name.
fn check_number(name: &str, number: f64, place: &Place) -> Checked<()> {
    if !number.is_finite() {
        return Err(Error::scene(place, format!("`{name}` is not a finite number")));
    }
    // a slash parts the menus of Gmsh, as in `Sizes/h`
    let is_word = |c: char| c.is_ascii_alphanumeric() || "_/".contains(c);
    if name.chars().all(is_word) && !name.starts_with(|c: char| c.is_ascii_digit()) && !name.is_empty() {
        Ok(())
    } else {
        Err(Error::scene(place, format!("`{name}` is no name of a Gmsh number")))
    }
}

impl Check for MeshSource {
    fn check(&self, _: Geometry) -> Result<(), Fault> {
        let Self::Geo(GmshSource { guard, .. }) = self else { return Ok(()) };
        positive("timeout", "the timeout", guard.seconds)?;
        guard.threads.map_or(Ok(()), |threads| at_least_one("threads", threads))?;
        guard.size.map_or(Ok(()), |size| positive("size", "the size", size))
    }
}

/// The file must be there; it is not read.
impl Compile for MeshSource {
    fn compile(&mut self, names: &Names<'_>) -> Checked<()> {
        match self {
            Self::Geo(GmshSource { file, set, .. }) => {
                set.iter_mut().try_for_each(|(name, _)| name.compile(names))?;
                file.compile(names)
            }
            Self::Msh { file } => file.compile(names),
            Self::Arrays(_) => Ok(()),
        }
    }
}

/// The name of a file, or a table.
impl<'de> Deserialize<'de> for MeshSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Located { value, place } = Located::<Form<IgnoredAny, MeshKeys>>::deserialize(deserializer)?;
        let keys = match value {
            Form::Text(name) => MeshKeys::of_name(Located::new(name.into(), place)),
            Form::Table(keys) => keys,
            other => return Err(other.instead_of("a string or a table", &place)),
        };
        keys.source().map_err(refused)
    }
}

impl Serialize for MeshSource {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let echo = match self {
            Self::Arrays(arrays) => json!({ "points": arrays.points.len(), "groups": arrays.groups.len() }),
            Self::Msh { file } => json!({ "msh": file.display().to_string() }),
            Self::Geo(GmshSource { file, set, guard: Guard { size, threads, seconds }, .. }) => {
                let set: BTreeMap<_, _> = set.iter().map(|(name, number)| (&name.value, number)).collect();
                let geo = file.display().to_string();
                json!({ "geo": geo, "set": set, "size": size, "threads": threads, "timeout": seconds })
            }
        };
        echo.serialize(serializer)
    }
}

/// A mesh as arrays: points, and named groups of simplices. Arrays that are no mesh are refused when they are used.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshArrays {
    /// Coordinates (x, y, z) of the points; z = 0 in plane problems. Some points may belong to no group.
    pub points: Vec<[f64; 3]>,
    /// Order of all simplices.
    pub order: Order,
    /// The groups.
    pub groups: Vec<GroupArrays>,
}

/// A named group of simplices: the cells of a body, a boundary, or points.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupArrays {
    /// Name of the group.
    pub name: String,
    /// Dimension of the simplices: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    pub dimension: usize,
    /// Point numbers from 0, simplex by simplex. Corners come first. The points inside edges follow in VTK's order of
    /// edges: 01 for a line, 01 12 02 for a triangle, 01 12 02 03 13 23 for a tetrahedron. Those of one edge divide it
    /// into k parts from its first to its second end. The order k is at most 2 in space.
    pub connectivity: Vec<u32>,
}

impl MeshArrays {
    /// Return a mesh of linear simplices that has points and no groups yet.
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        Self { points, order: Order::P1, groups: Vec::new() }
    }

    /// Add a group; see [`GroupArrays`] for the arguments.
    pub fn group(mut self, name: &str, dimension: usize, connectivity: Vec<u32>) -> Self {
        self.groups.push(GroupArrays { name: name.to_owned(), dimension, connectivity });
        self
    }
}

impl From<MeshArrays> for MeshSource {
    fn from(arrays: MeshArrays) -> Self {
        Self::Arrays(Rc::new(arrays))
    }
}
