//! Where meshes come from.

use super::order::Order;
use crate::error::{Located, Place};
use crate::setting::keys;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

keys! {
    /// Limits and settings of Gmsh for a script or a shape.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Guard "the mesh" {
        optional {
            /// largest size of elements in a shape
            pub size: Option<f64> = None,
            /// threads of Gmsh for free meshes in space
            ///
            /// Gmsh then uses its parallel algorithm (HXT), and that of the script otherwise.
            pub threads: Option<usize> = None,
            /// seconds after which Gmsh is ended
            ///
            /// The default is ten times what Gmsh takes for a million tetrahedra.
            pub seconds as "timeout": f64 = 1000.0,
        }
    }
}

impl Default for Guard {
    /// Return the settings of a scene that gives none.
    fn default() -> Self {
        Self::with_defaults()
    }
}

/// Where the mesh comes from. Paths are joined with the folder of the scene file.
#[derive(Debug, Clone)]
pub enum MeshSource {
    /// A Gmsh script with numbers set in it (`gmsh -setnumber NAME VALUE`), or a shape of another program.
    Geo {
        /// The script, or the file of the shape.
        file: Located<PathBuf>,
        /// Names and numbers, sorted by name.
        set: Vec<(String, f64)>,
        /// Place of each name in `set`.
        places: Vec<Place>,
        /// Sizes of elements that Gmsh follows instead of those of the script, as the text of a view (`.pos`). No scene file has them.
        sizes: Option<Arc<str>>,
        /// Limits and settings of Gmsh.
        guard: Guard,
    },
    /// A mesh file: Gmsh's format 4.1 or 2.2, text or binary, a deck (`.inp`), or a format that Gmsh converts.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
    /// Arrays from a Rust program.
    Arrays(Rc<MeshArrays>),
}

impl MeshSource {
    /// Return a Gmsh script with the numbers `set` in it. Its mesh is made once and kept in the cache. A script is a program: it
    /// can start others and write files.
    #[track_caller]
    pub fn script(file: impl AsRef<Path>, set: &[(&str, f64)]) -> Self {
        let file = file.as_ref();
        let mut set: Vec<(String, f64)> = set.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        set.sort_by(|a, b| a.0.cmp(&b.0));
        let place = Place::here(&file.display().to_string());
        let (places, file) = (vec![place.clone(); set.len()], Located::new(file.to_owned(), place));
        Self::Geo { file, set, places, sizes: None, guard: Guard::default() }
    }

    /// Return a mesh file with named groups: `.msh` of Gmsh, or a format that Gmsh converts.
    #[track_caller]
    pub fn file(file: impl AsRef<Path>) -> Self {
        let place = Place::here(&file.as_ref().display().to_string());
        Self::Msh { file: Located::new(file.as_ref().to_owned(), place) }
    }
}

/// A mesh as arrays: points, and named groups of simplices. Arrays that are no mesh are refused when they are used.
#[derive(Debug, Clone)]
pub struct MeshArrays {
    /// Coordinates (x, y, z) of the points; z = 0 in plane problems. Some points may belong to no group.
    pub points: Vec<[f64; 3]>,
    /// Order of all simplices.
    pub order: Order,
    /// The groups.
    pub groups: Vec<GroupArrays>,
}

/// A named group of simplices: the cells of a body, a boundary, or points.
#[derive(Debug, Clone)]
pub struct GroupArrays {
    /// Name of the group.
    pub name: String,
    /// Dimension of the simplices: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    pub dimension: usize,
    /// Point numbers from 0, simplex by simplex. Corners come first. For order 2, mid-edge points follow in VTK's order: 01 for a line,
    /// 01 12 02 for a triangle, 01 12 02 03 13 23 for a tetrahedron.
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
