//! Where meshes come from.

use super::order::Order;
use crate::error::{Located, Place};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// What a Gmsh script may take and do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// Seconds after which Gmsh is ended.
    pub seconds: f64,
    /// Gigabytes that it may take; what is free when it starts if `None`.
    pub gigabytes: Option<f64>,
    /// Largest size of elements in a shape of another program.
    pub size: Option<f64>,
    /// Threads of Gmsh's parallel algorithm for free meshes in space (HXT); the algorithm of the script if `None`.
    pub threads: Option<usize>,
    /// Whether the user trusts the script as a program.
    pub trusted: bool,
}

impl Default for Guard {
    /// A script that nobody trusts, and ten times what Gmsh takes for a million tetrahedra.
    fn default() -> Self {
        Self { seconds: 1000.0, gigabytes: None, size: None, threads: None, trusted: false }
    }
}

/// Where the mesh comes from; paths are relative to the scene file's folder and already joined with it.
#[derive(Debug, Clone)]
pub enum MeshSource {
    /// A Gmsh geometry script and the numbers set in it (`gmsh -setnumber NAME VALUE`), sorted by name; or a shape of another program.
    Geo {
        /// The script, or the file of the shape.
        file: Located<PathBuf>,
        /// Names and numbers, sorted by name.
        set: Vec<(String, f64)>,
        /// Where each name stands.
        places: Vec<Place>,
        /// Sizes of elements for Gmsh to follow instead of the script's own, a view of Gmsh (`.pos`); no scene file has them.
        sizes: Option<Arc<str>>,
        /// What it may take and do.
        guard: Guard,
    },
    /// A mesh file: Gmsh's format 4.1, text or binary, or one that Gmsh converts.
    Msh {
        /// The mesh file.
        file: Located<PathBuf>,
    },
    /// Arrays of a Rust program.
    Arrays(Rc<MeshArrays>),
}

impl MeshSource {
    /// A Gmsh script, meshed once and kept in the cache, with numbers set in it. The script is refused if it can start programs or
    /// write files.
    #[track_caller]
    pub fn script(file: impl AsRef<Path>, set: &[(&str, f64)]) -> Self {
        let file = file.as_ref();
        let mut set: Vec<(String, f64)> = set.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
        set.sort_by(|a, b| a.0.cmp(&b.0));
        let place = Place::here(&file.display().to_string());
        let (places, file) = (vec![place.clone(); set.len()], Located::new(file.to_owned(), place));
        Self::Geo { file, set, places, sizes: None, guard: Guard::default() }
    }

    /// A mesh file with named groups: `.msh` of Gmsh, or one that Gmsh converts.
    #[track_caller]
    pub fn file(file: impl AsRef<Path>) -> Self {
        let place = Place::here(&file.as_ref().display().to_string());
        Self::Msh { file: Located::new(file.as_ref().to_owned(), place) }
    }
}

/// A mesh as arrays: points, and named groups of simplices. What is no mesh is refused when it is used.
#[derive(Debug, Clone)]
pub struct MeshArrays {
    /// Coordinates (x, y, z) of the points; z = 0 in plane problems. Points that no group uses do no harm.
    pub points: Vec<[f64; 3]>,
    /// Order of all simplices.
    pub order: Order,
    /// The groups.
    pub groups: Vec<GroupArrays>,
}

/// A named group of simplices: the cells of a body, a boundary, or points.
#[derive(Debug, Clone)]
pub struct GroupArrays {
    /// Its name.
    pub name: String,
    /// Dimension of its simplices: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    pub dimension: usize,
    /// Point numbers from 0, simplex by simplex: corners, then, for order 2, mid-edge points in VTK's order: 01 of a line, 01 12 02 of
    /// a triangle, 01 12 02 03 13 23 of a tetrahedron.
    pub connectivity: Vec<u32>,
}

impl MeshArrays {
    /// Points without groups, for linear simplices.
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        Self { points, order: Order::P1, groups: Vec::new() }
    }

    /// With one more group: see [`GroupArrays`].
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
