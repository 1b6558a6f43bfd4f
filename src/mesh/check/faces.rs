//! The faces of all cells of a body, which can be found by their corners.

use super::cells::Cells;
use crate::error::Result;

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

    /// Return the faces between two cells, one for each cell.
    pub fn inner(&self) -> impl Iterator<Item = [&Face<D>; 2]> {
        self.alike().filter_map(|alike| if let [a, b] = alike { Some([a, b]) } else { None })
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
