//! Simplicial meshes with named groups, from Gmsh.
//!
//! [`load`] is the entry point. Gmsh meshes a `.geo` script or a file of another program's geometry once, and the cache
//! keeps the result. A `.msh` file (text or binary) and an `.inp` file are read directly. A mesh of another format is
//! converted by Gmsh and cached, too. Arrays of a Rust program are checked. All later code sees a [`Mesh`] only.

mod abaqus;
mod arrays;
mod axis;
mod builder;
mod cache;
mod check;
pub mod datum;
mod digits;
pub mod faces;
mod foreign;
mod gmsh;
mod groups;
mod load;
mod locality;
mod msh;
mod msh2;
mod scan;
mod script;
mod shape;
mod simplex;
mod split;
#[cfg(test)]
mod tests;
mod vertices;

pub use builder::MeshProducer;
pub use check::{Asked, BodyCheck, Components, Duty};
pub use groups::{Group, Groups, Numbering};
pub use load::{Loaded, MeshOrigin, as_msh, files, load};
pub use locality::bisect;
pub use msh::parse;
pub use script::unstructured;
pub use script::view;
pub use shape::{edges, weights};
pub use simplex::EDGES;

use crate::linalg::{bounds, pad};
use crate::problem::order::Order;
use std::path::PathBuf;

/// Lengths of a mesh that a run computes with. The lengths of atoms and of galaxies lie between 1e-40 and 1e40 in all
/// units in use. Areas and volumes of cells lead to sixth powers of lengths, which are still finite and nonzero in this
/// range.
pub const LENGTHS: [f64; 2] = [1e-40, 1e40];

/// A mesh: points and named groups of simplices.
///
/// Groups are Gmsh's physical groups. Cells are groups of dimension `D`; surfaces, edges and points have lower
/// dimension. The local numbering is VTK's: vertices come first. The points inside edges follow in the order `01`
/// (line), `01 12 02` (triangle), `01 12 02 03 13 23` (tetrahedron), those of one edge from its first to its second
/// end. There are no points inside simplices.
///
/// No simplex is degenerate: its measure is above 1e-12 times its longest edge to the power of its dimension. Cells
/// have positive volume, group names are unique, no group is empty, and coordinates are finite.
#[derive(Debug, Clone)]
pub struct Mesh<const D: usize> {
    /// The file that the user named (`.geo` or `.msh`), for messages.
    pub path: PathBuf,
    /// Coordinates of the points relative to `datum`, in the order of the file. A mesh from a file keeps only points
    /// that some group uses, a mesh from arrays keeps all.
    pub points: Vec<[f64; D]>,
    /// The point of the scene from which coordinates are measured. It is the origin of the scene unless the mesh is far
    /// from it ([`Mesh::measure_nearby`]).
    pub datum: [f64; D],
    /// Uncertainty of the coordinates beyond the rounding of doubles ([`digits`]).
    pub uncertainty: f64,
    /// Order of all elements; points have none.
    pub order: Order,
    /// Order of bodies that name none: that of a mesh file or of arrays, else the default of made meshes.
    pub default_order: Order,
    /// Named groups, in the order of the file.
    pub groups: Groups,
    /// Number of quadrangles, hexahedra, prisms and pyramids that were split into simplices.
    pub split: usize,
    /// Number of curved cells whose edges were made straight because the curved boundary folded them.
    pub straightened: usize,
}

impl<const D: usize> Mesh<D> {
    /// Return the mesh of these points and groups of simplices of one order, measured from the origin of the scene.
    pub fn new(path: PathBuf, points: Vec<[f64; D]>, order: Order, groups: Groups) -> Self {
        let (datum, default_order) = ([0.0; D], order);
        Self { path, points, datum, uncertainty: 0.0, order, default_order, groups, split: 0, straightened: 0 }
    }

    /// Return the group with this name, of any dimension.
    pub fn group(&self, name: &str) -> Option<&Group> {
        self.groups.named(name)
    }

    /// Return the names of the groups of a dimension, in the order of the file.
    pub fn group_names(&self, dimension: usize) -> impl Iterator<Item = &str> {
        self.groups.iter().filter(move |group| group.dimension == dimension).map(|group| group.name.as_str())
    }

    /// Return the coordinates (x, y, z) of a point in the scene.
    pub fn in_scene(&self, x: [f64; D]) -> [f64; 3] {
        pad(datum::in_scene(&self.datum, x))
    }

    /// Measure the coordinates from a datum near the mesh if the origin is far away; see [`datum`]. `along` tells along
    /// which axes the origin may move.
    pub fn measure_nearby(&mut self, along: [bool; D]) {
        self.datum = datum::of(bounds(self.points.iter().copied().map(pad)), along);
        for x in &mut self.points {
            (0..D).for_each(|c| x[c] -= self.datum[c]);
        }
    }

    /// Drop the numbers of the elements in the file, which only messages of the checks need.
    pub fn forget_tags(&mut self) {
        self.groups.iter_mut().for_each(|group| group.tags = Vec::new());
    }

    /// Return the mesh of the same simplices without mid-edge points, also in groups of points. Without such points the
    /// result is a copy.
    pub fn lower_order(&self) -> Mesh<D> {
        let mut groups = self.groups.to_vec();
        for group in groups.iter_mut() {
            let vertices = group.dimension + 1;
            group.connectivity = group.simplices().flat_map(|simplex| &simplex[..vertices]).copied().collect();
            group.stride = vertices;
        }
        let [before, after] = [&self.groups[..], &groups[..]].map(|groups| {
            let mut used = vec![false; self.points.len()];
            let simplices = groups.iter().filter(|group| group.dimension > 0);
            simplices.flat_map(|group| &group.connectivity).for_each(|&point| used[point as usize] = true);
            used
        });
        for group in groups.iter_mut().filter(|group| group.dimension == 0) {
            let count = group.len();
            group.connectivity.retain(|&point| after[point as usize] || !before[point as usize]);
            if group.len() < count {
                group.tags = Vec::new();
            }
        }
        groups.retain(|group| !group.is_empty());
        let mut groups: Groups = groups.into();
        let points = groups::renumber(&mut groups).into_iter().map(|old| self.points[old as usize]).collect();
        Mesh { points, order: Order::P1, groups, path: self.path.clone(), ..*self }
    }

    /// Return the mesh of the same simplices with points inside their edges, which stay straight. The mesh has the
    /// order 1.
    pub fn higher_order(&self, order: Order) -> Mesh<D> {
        let (mut points, mut groups) = (self.points.clone(), self.groups.to_vec());
        groups::raise(&mut groups, &mut points, order, D);
        Mesh { points, order, groups: groups.into(), path: self.path.clone(), ..*self }
    }
}
