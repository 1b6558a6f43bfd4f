//! The faces of the cells of one body, which can be found by their corners.

use super::EDGES;

/// The cells of a body of simplices, with nodes numbered within the body.
#[derive(Debug, Clone, Copy)]
pub struct Simplices<'a, const D: usize> {
    /// Nodes of all cells, `stride` per cell: corners, then mid-edge nodes in the local numbering of [`Mesh`](super::Mesh).
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
    pub fn is_quadratic(self) -> bool {
        self.stride > D + 1
    }

    /// Return the nodes of a cell.
    pub fn cell(self, cell: usize) -> &'a [u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Return the mid-edge node of a cell between two of its corners.
    pub fn middle(self, cell: usize, [i, j]: [usize; 2]) -> u32 {
        let ends = [i.min(j), i.max(j)];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
    }
}

/// Corners of a cell of positive volume on the face opposite each of its corners, in the order in which the normal points outwards.
const OUTWARD: [&[[usize; 3]]; 2] = [&[[1, 2, 0], [2, 0, 0], [0, 1, 0]], &[[1, 2, 3], [2, 0, 3], [0, 1, 3], [1, 0, 2]]];

/// A face of a cell in twelve bytes. The list has D + 1 faces per cell, which is most of the memory of a check.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Face<const D: usize> {
    /// Corners except the least one, sorted; in the plane there is one.
    rest: [u32; 2],
    /// Four times the index of the cell, plus the local number of the corner that is not on the face.
    place: u32,
}

impl<const D: usize> Face<D> {
    /// Return the face of a cell opposite to one of its corners.
    pub fn at(cell: usize, opposite: usize) -> Self {
        Self { rest: [0; 2], place: (4 * cell + opposite) as u32 }
    }

    /// Return the cell.
    pub fn cell(self) -> usize {
        (self.place / 4) as usize
    }

    /// Return the local number of the corner that is not on the face.
    pub fn opposite(self) -> usize {
        self.place as usize % 4
    }

    /// Return the corners, sorted. Return also whether the permutation to the order in which the normal points out of the cell
    /// is odd.
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

    /// Return the nodes, in the order in which the normal points outwards. The corners come first, then in a quadratic cell the
    /// mid-edge nodes between 01, 12, 02.
    pub fn nodes(self, cells: Simplices<D>) -> impl Iterator<Item = u32> {
        let (cell, corners) = (self.cell(), self.corners());
        let edges = if cells.is_quadratic() { D * (D - 1) / 2 } else { 0 };
        let ends = EDGES[..edges].iter().map(move |edge| edge.map(|i| corners[i]));
        corners.into_iter().map(move |i| cells.cell(cell)[i]).chain(ends.map(move |ends| cells.middle(cell, ends)))
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
    /// Sort the faces of a body with so many nodes by their corners. The time is linear, since few faces have the same least corner.
    pub fn new(cells: Simplices<D>, nodes: usize) -> Self {
        // This returns the least corner of a face, and the face.
        let face = |cell: usize, opposite: usize| {
            let mut face = Face::at(cell, opposite);
            let (key, _) = face.sorted(cells);
            face.rest[..D - 1].copy_from_slice(&key[1..]);
            (key[0] as usize, face)
        };
        let all = || (0..cells.count()).flat_map(|cell| (0..=D).map(move |opposite| face(cell, opposite)));
        let mut first = vec![0; nodes + 1];
        all().for_each(|(least, _)| first[least + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);
        let (mut list, mut next) = (vec![Face::default(); first[nodes] as usize], first.clone());
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

    /// Return the faces with these corners, in any order.
    pub fn at(&self, corners: &[u32]) -> &[Face<D>] {
        let mut key: [u32; D] = std::array::from_fn(|i| corners[i]);
        key.sort_unstable();
        let [from, to] = [0, 1].map(|next| self.first[key[0] as usize + next] as usize);
        let alike = &self.list[from..to];
        let start = alike.partition_point(|face| face.rest[..D - 1] < key[1..]);
        let count = alike[start..].iter().take_while(|face| face.rest[..D - 1] == key[1..]).count();
        &alike[start..start + count]
    }
}
