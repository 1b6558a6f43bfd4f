//! The faces of the cells of one body, which can be found by their corners.

use super::EDGES;

/// The cells of a body of simplices, with nodes numbered within the body.
#[derive(Debug, Clone, Copy)]
pub struct Simplices<'a, const D: usize> {
    /// Nodes of all cells, `stride` per cell: corners, then those inside edges in the local numbering of
    /// [`Mesh`](super::Mesh).
    pub nodes: &'a [u32],
    /// Nodes per cell.
    pub stride: usize,
}

impl<'a, const D: usize> Simplices<'a, D> {
    /// Return the number of cells.
    pub fn count(self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Return whether edges have nodes between their ends.
    pub fn is_curved(self) -> bool {
        self.stride > D + 1
    }

    /// Return the nodes of a cell.
    pub fn cell(self, cell: usize) -> &'a [u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Return the nodes of a cell inside the edge from one of its corners to another one.
    pub fn inside(self, cell: usize, [i, j]: [usize; 2]) -> impl DoubleEndedIterator<Item = u32> + use<'a, D> {
        let count = 2 * (self.stride - D - 1) / (D * (D + 1));
        let edge = EDGES.iter().position(|edge| *edge == [i.min(j), i.max(j)]).unwrap_or(0);
        let nodes = &self.cell(cell)[D + 1 + edge * count..][..count];
        (0..count).map(move |k| nodes[if i < j { k } else { count - 1 - k }])
    }
}

/// Corners of a cell of positive volume on the face opposite each of its corners, in the order in which the normal
/// points outwards.
const OUTWARD: [&[[usize; 3]]; 2] = [&[[1, 2, 0], [2, 0, 0], [0, 1, 0]], &[[1, 2, 3], [2, 0, 3], [0, 1, 3], [1, 0, 2]]];

/// A face of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Face<const D: usize> {
    /// Four times the index of the cell, plus the local number of the corner that is not on the face.
    place: u32,
}

impl<const D: usize> Face<D> {
    /// Return the face of a cell opposite to one of its corners.
    pub fn at(cell: usize, opposite: usize) -> Self {
        Self { place: (4 * cell + opposite) as u32 }
    }

    /// Return the cell.
    pub fn cell(self) -> usize {
        (self.place / 4) as usize
    }

    /// Return the local number of the corner that is not on the face.
    pub fn opposite(self) -> usize {
        self.place as usize % 4
    }

    /// Return the corners, sorted. Return also whether the permutation to the order in which the normal points out of
    /// the cell is odd.
    pub fn sorted(self, cells: Simplices<D>) -> ([u32; D], bool) {
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
    pub fn corners(self) -> [usize; D] {
        std::array::from_fn(|i| OUTWARD[D - 2][self.opposite()][i])
    }

    /// Return the nodes, in the order in which the normal points outwards. The corners come first, then the nodes
    /// inside the edges 01, 12, 02.
    pub fn nodes(self, cells: Simplices<D>) -> impl Iterator<Item = u32> {
        let (cell, corners) = (self.cell(), self.corners());
        let ends = EDGES[..D * (D - 1) / 2].iter().map(move |edge| edge.map(|i| corners[i]));
        corners.into_iter().map(move |i| cells.cell(cell)[i]).chain(ends.flat_map(move |ends| cells.inside(cell, ends)))
    }
}

/// All faces of the cells of a body, each with its sorted corners, ordered by these. The list has D + 1 faces per cell,
/// which is most of the memory of a check.
pub struct Faces<const D: usize>(Vec<([u32; D], Face<D>)>);

impl<const D: usize> Faces<D> {
    /// Sort the faces of a body by their corners.
    pub fn new(cells: Simplices<D>) -> Self {
        let all = (0..cells.count()).flat_map(|cell| (0..=D).map(move |opposite| Face::at(cell, opposite)));
        let mut list: Vec<_> = all.map(|face| (face.sorted(cells).0, face)).collect();
        list.sort_unstable();
        Self(list)
    }

    /// Return the faces in groups with the same corners.
    pub fn alike(&self) -> impl Iterator<Item = &[([u32; D], Face<D>)]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }

    /// Return the number of faces between two cells.
    pub fn inner(&self) -> usize {
        self.alike().filter(|alike| alike.len() == 2).count()
    }

    /// Return the faces of one cell alone.
    pub fn outer(&self) -> impl Iterator<Item = Face<D>> {
        self.alike().filter_map(|alike| if let [(_, one)] = alike { Some(*one) } else { None })
    }

    /// Return the faces with these corners, in any order.
    pub fn at(&self, corners: &[u32]) -> impl Iterator<Item = Face<D>> {
        let mut key: [u32; D] = std::array::from_fn(|i| corners[i]);
        key.sort_unstable();
        let alike = &self.0[self.0.partition_point(|(corners, _)| *corners < key)..];
        alike.iter().take_while(move |(corners, _)| *corners == key).map(|(_, face)| *face)
    }
}
