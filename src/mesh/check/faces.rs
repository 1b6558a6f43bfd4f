//! The cells of one body, with nodes numbered within the body, and the faces of all cells, which can be found by their corners.

use crate::error::{Error, Result};
use crate::linalg::pad;
use crate::mesh::simplex::EDGES;
use crate::mesh::{Group, Mesh};

/// The entry of a point that is not a node of the body.
pub const NONE: u32 = u32::MAX;

/// The cells of one body.
#[derive(Clone)]
pub struct Cells<'a, const D: usize> {
    mesh: &'a Mesh<D>,
    group: &'a Group,
    /// Nodes per cell: corners, then mid-edge nodes if its elements are quadratic.
    pub stride: usize,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Nodes of all cells, `stride` per cell.
    nodes: Vec<u32>,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Number the nodes of the body of this group, `stride` per cell, in order of first appearance in the cells. `node` holds
    /// [`NONE`] for every point before, and the nodes of the body's points afterwards.
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

    /// Return the number of cells.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Return whether edges have nodes between their ends.
    pub fn is_quadratic(&self) -> bool {
        self.stride > D + 1
    }

    /// Return the nodes of a cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Return the coordinates (x, y, z) of a node, z = 0 in the plane.
    pub fn at(&self, node: u32) -> [f64; 3] {
        pad(self.mesh.points[self.points[node as usize] as usize])
    }

    /// Return the mid-edge node of a cell between two of its corners.
    pub fn middle(&self, cell: usize, ends: [usize; 2]) -> u32 {
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
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

/// Corners of a cell on the face opposite each of its corners, in the order in which the normal points outwards.
const OUTWARD: [&[[usize; 3]]; 2] = [&[[1, 2, 0], [2, 0, 0], [0, 1, 0]], &[[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]];

/// A face of a cell in twelve bytes. The list has D + 1 faces per cell, which is most of the memory of a check.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Face<const D: usize> {
    /// Corners except the least one, sorted; in the plane there is one.
    rest: [u32; 2],
    /// Four times the index of the cell, plus the local number of the corner that is not on the face.
    place: u32,
}

impl<const D: usize> Face<D> {
    /// Return the cell.
    pub fn cell(&self) -> usize {
        (self.place / 4) as usize
    }

    /// Return the corners, sorted. Return also whether the permutation to the order in which the normal points out of the cell
    /// is odd.
    fn sorted(&self, cells: &Cells<D>) -> ([u32; D], bool) {
        let (mut key, mut odd) = (self.corners().map(|i| cells.cell(self.cell())[i]), false);
        for end in (1..D).rev() {
            for i in 0..end {
                if key[i] > key[i + 1] {
                    key.swap(i, i + 1);
                    odd = !odd;
                }
            }
        }
        (key, odd)
    }

    /// Return the local numbers of the corners in the cell, in the order in which the normal points outwards.
    pub fn corners(&self) -> [usize; D] {
        std::array::from_fn(|i| OUTWARD[D - 2][self.place as usize % 4][i])
    }

    /// Return the nodes, in the order in which the normal points outwards. The corners come first, then in a quadratic cell the
    /// mid-edge nodes between 01, 12, 02.
    pub fn nodes(&self, cells: &Cells<D>) -> impl Iterator<Item = u32> {
        let (cell, corners) = (self.cell(), self.corners());
        let ends = [[0, 1], [1, 2], [0, 2]].map(|[i, j]: [usize; 2]| [corners[i % D], corners[j % D]]);
        let edges = if cells.is_quadratic() { D * (D - 1) / 2 } else { 0 };
        let ends = ends.into_iter().take(edges);
        corners.into_iter().map(move |i| cells.cell(cell)[i]).chain(ends.map(move |ends| cells.middle(cell, ends)))
    }

    /// Return the mean of the corners.
    fn centre(&self, cells: &Cells<D>) -> [f64; 3] {
        let corners = self.sorted(cells).0.map(|node| cells.at(node));
        std::array::from_fn(|c| corners.iter().map(|x| x[c]).sum::<f64>() / D as f64)
    }
}

/// All faces of the cells of a body. Faces with the same corners follow each other.
pub struct Faces<const D: usize> {
    /// The faces, ordered by their least corners. Those with the same least corner are sorted.
    list: Vec<Face<D>>,
    /// Index of the first face of each least corner; the last entry is the number of faces.
    first: Vec<u32>,
}

impl<const D: usize> Faces<D> {
    /// Sort the faces of a body by their corners. The time is linear, since few faces have the same least corner.
    pub fn new(cells: &Cells<D>) -> Self {
        // This returns the least corner of a face, and the face.
        let face = |cell: usize, opposite: usize| {
            let mut face = Face { rest: [0; 2], place: (4 * cell + opposite) as u32 };
            let (key, _) = face.sorted(cells);
            face.rest[..D - 1].copy_from_slice(&key[1..]);
            (key[0] as usize, face)
        };
        let of_cell = |cell| (0..=D).map(move |opposite| face(cell, opposite));
        let all = || (0..cells.count()).flat_map(of_cell);
        let mut first = vec![0; cells.node_count() + 1];
        all().for_each(|(least, _)| first[least + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let (mut list, mut next) = (vec![Face::default(); first[cells.node_count()] as usize], first.clone());
        for (least, face) in all() {
            let next = &mut next[least];
            list[*next as usize] = face;
            *next += 1;
        }
        first.windows(2).for_each(|ends| list[ends[0] as usize..ends[1] as usize].sort_unstable());
        Self { list, first }
    }

    /// Return the faces in groups with the same corners.
    pub fn alike(&self) -> impl Iterator<Item = &[Face<D>]> {
        let of_least = self.first.windows(2).map(|ends| ends[0] as usize..ends[1] as usize);
        of_least.flat_map(|ends| self.list[ends].chunk_by(|a, b| a.rest == b.rest))
    }

    /// Return the number of faces between two cells.
    pub fn inner(&self) -> usize {
        self.alike().filter(|alike| alike.len() == 2).count()
    }

    /// Return the faces of one cell alone.
    pub fn outer(&self) -> impl Iterator<Item = Face<D>> {
        self.alike().filter_map(|alike| if let [one] = alike { Some(*one) } else { None })
    }

    /// Return the number of cells that have a facet with these nodes: corners, then mid-edge nodes if there are any.
    pub fn cells_at(&self, cells: &Cells<D>, facet: &[u32]) -> usize {
        let mut key: [u32; D] = std::array::from_fn(|i| facet[i]);
        key.sort_unstable();
        let [from, to] = [0, 1].map(|next| self.first[key[0] as usize + next] as usize);
        let same = |face: &&Face<D>| {
            face.rest[..D - 1] == key[1..] && face.nodes(cells).skip(D).all(|node| facet.contains(&node))
        };
        self.list[from..to].iter().filter(same).count()
    }

    /// Check that at most two cells share a face, that they lie on its two sides, and that they have the same nodes between its
    /// corners.
    ///
    /// # Errors
    /// A face violates this. The error gives the place and the cells.
    pub fn check(&self, cells: &Cells<D>) -> Result<()> {
        for alike in self.alike() {
            let refuse = |what: &str| {
                let cells_of = alike.iter().map(Face::cell).collect::<Vec<_>>();
                cells.refuse(what, &cells_of, alike[0].centre(cells)).help(AGAIN)
            };
            let [a, b] = alike else {
                if alike.len() > 2 {
                    return Err(refuse(&format!("{} cells share the facet", alike.len())));
                }
                continue;
            };
            if a.sorted(cells).1 == b.sorted(cells).1 {
                let what = "two cells overlap: both lie on the same side of the facet that they share";
                return Err(refuse(what));
            }
            if cells.is_quadratic() {
                let [mut first, mut second] = [a, b].map(|face| face.nodes(cells).skip(D).collect::<Vec<_>>());
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
}

/// The advice about cells that are wrong in themselves.
const AGAIN: &str =
    "cells of a body lie beside each other: remove those that lie there twice, or mesh the geometry again";
