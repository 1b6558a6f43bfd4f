//! The cells of one body, with nodes numbered within the body, and the check of their faces.

use crate::error::{Error, Result};
use crate::linalg::{cross, length, minus, pad};
use crate::mesh::faces::{Face, Faces, Simplices};
use crate::mesh::{Group, Mesh};

/// The entry of a point that is not a node of the body.
pub const NONE: u32 = u32::MAX;

/// The cells of one body.
#[derive(Clone)]
pub struct Cells<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    group: &'a Group,
    /// Nodes per cell: corners, then those inside edges unless its elements are linear.
    stride: usize,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Nodes of all cells, `stride` per cell.
    nodes: Vec<u32>,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Number the nodes of the body of this group, `stride` per cell, in order of first appearance in the cells. `node`
    /// holds [`NONE`] for every point before, and the nodes of the body's points afterwards.
    pub fn new(mesh: &'a Mesh<D>, group: &'a Group, stride: usize, node: &mut [u32]) -> Self {
        let (mut points, mut nodes) = (Vec::new(), Vec::with_capacity(group.len() * stride));
        for &point in group.simplices().flat_map(|cell| &cell[..stride]) {
            let node = &mut node[point as usize];
            if *node == NONE {
                *node = points.len() as u32;
                points.push(point);
            }
            nodes.push(*node);
        }
        Self { mesh, group, stride, points, nodes }
    }

    /// Return the number of nodes.
    pub fn node_count(&self) -> usize {
        self.points.len()
    }

    /// Return the cells without their body.
    pub fn simplices(&self) -> Simplices<'_, D> {
        Simplices { nodes: &self.nodes, stride: self.stride }
    }

    /// Return all faces.
    pub fn faces(&self) -> Faces<D> {
        Faces::new(self.simplices())
    }

    /// Return the number of cells.
    pub fn count(&self) -> usize {
        self.simplices().count()
    }

    /// Return whether edges have nodes between their ends.
    pub fn is_curved(&self) -> bool {
        self.simplices().is_curved()
    }

    /// Return the nodes of a cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        self.simplices().cell(cell)
    }

    /// Return the coordinates (x, y, z) of a node, z = 0 in the plane.
    pub fn at(&self, node: u32) -> [f64; 3] {
        pad(self.mesh.points[self.points[node as usize] as usize])
    }

    /// Return the area (length in the plane) of a face, from its corners.
    pub fn area(&self, face: Face<D>) -> f64 {
        let corners = face.corners().map(|i| self.at(self.cell(face.cell())[i]));
        let edge = |k: usize| minus(corners[k], corners[0]);
        if D == 2 { length(edge(1)) } else { length(cross(edge(1), edge(2))) / 2.0 }
    }

    /// Return the refusal of the body because of `what` is wrong with some of its cells, at the point `at`.
    pub fn refuse(&self, what: &str, cells: &[usize], at: [f64; 3]) -> Error {
        refuse(self.mesh, self.group, format!("body `{}`: {what}", self.group.name), cells, at)
    }
}

/// Return the refusal of some elements of a group at a point.
pub fn refuse<const D: usize>(mesh: &Mesh<D>, group: &Group, what: String, elements: &[usize], at: [f64; 3]) -> Error {
    let at = mesh.in_scene(std::array::from_fn(|c| at[c]));
    let place = at[..D].iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let error = Error::mesh(&mesh.path, None, format!("{what} at ({place})"));
    let tags: Vec<String> = elements.iter().filter_map(|&at| group.tags.get(at)).map(u64::to_string).collect();
    match &tags[..] {
        [] => error,
        [one] => error.because(format!("it is element {one} of the mesh file")),
        _ => error.because(format!("they are elements {} of the mesh file", tags.join(" and "))),
    }
}

/// Check that at most two cells share a face, that they lie on its two sides, and that they have the same nodes between
/// its corners.
///
/// # Errors
/// A face violates this. The error gives the place and the cells.
pub fn check<const D: usize>(faces: &Faces<D>, cells: &Cells<D>) -> Result<()> {
    let simplices = cells.simplices();
    for alike in faces.alike() {
        let refuse = |what: &str| {
            let cells_of = alike.iter().map(|(_, face)| face.cell()).collect::<Vec<_>>();
            cells.refuse(what, &cells_of, centre(cells, alike[0].1)).help(AGAIN)
        };
        let [(_, a), (_, b)] = alike else {
            if alike.len() > 2 {
                return Err(refuse(&format!("{} cells share the facet", alike.len())));
            }
            continue;
        };
        if a.sorted(simplices).1 == b.sorted(simplices).1 {
            let what = "two cells overlap: both lie on the same side of the facet that they share";
            return Err(refuse(what));
        }
        if cells.is_curved() {
            let [mut first, mut second] = [a, b].map(|face| face.nodes(simplices).skip(D).collect::<Vec<_>>());
            first.sort_unstable();
            second.sort_unstable();
            if first != second {
                let what = "two cells have different mid-edge nodes on the facet that they share";
                return Err(refuse(what));
            }
        }
    }
    Ok(())
}

/// Return the mean of the corners of a face.
fn centre<const D: usize>(cells: &Cells<D>, face: Face<D>) -> [f64; 3] {
    let corners = face.sorted(cells.simplices()).0.map(|node| cells.at(node));
    std::array::from_fn(|c| corners.iter().map(|x| x[c]).sum::<f64>() / D as f64)
}

/// The advice about cells that are wrong in themselves.
const AGAIN: &str =
    "cells of a body lie beside each other: remove those that lie there twice, or mesh the geometry again";
