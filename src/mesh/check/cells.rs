//! The cells of one body, their nodes numbered within it.

use super::nodes::Nodes;
use crate::error::Error;
use crate::linalg::pad;
use crate::mesh::{Key, Portion};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Mid-edge nodes of a simplex stand behind its corners in the order of these edges.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// No node of the body.
pub const NONE: u32 = u32::MAX;

/// What a rank has found; an error with its place among those that one rank would meet: number of the check, then what it looks at.
pub type Found<T = ()> = Result<T, ((u8, u64, u32, u32), Error)>;

/// The cells of one body that a rank has.
#[derive(Clone)]
pub struct Cells<'a, const D: usize> {
    portion: &'a Portion<D>,
    /// Name of the body.
    name: &'a str,
    /// Nodes per cell: corners, then mid-edge nodes if its elements are quadratic.
    pub stride: usize,
    /// The nodes that are known here.
    pub known: Arc<Nodes>,
    /// Their places, if they are those of other ranks.
    far: Vec<[f64; 3]>,
    /// Nodes of all cells.
    nodes: Vec<u32>,
    /// Numbers of the cells in the file; none if they have none.
    tags: Cow<'a, [u64]>,
    /// Keys of the cells; none where one rank has all.
    keys: Cow<'a, [Key]>,
}

/// Cells of a body for another rank.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Sent {
    /// Numbers of their nodes among those of all ranks, and their places.
    nodes: Vec<(u32, [f64; 3])>,
    /// Numbers of the nodes of each.
    cells: Vec<u32>,
    /// Numbers in the file.
    tags: Vec<u64>,
    /// Their keys.
    pub keys: Vec<Key>,
}

impl<'a, const D: usize> Cells<'a, D> {
    /// Of the body of this group with elements of an order, and these nodes. `node` has the node of each point after.
    pub fn new(portion: &'a Portion<D>, group: usize, stride: usize, known: Arc<Nodes>, node: &mut [u32]) -> Self {
        let (keys, group) = (portion.keys(group), &portion.mesh.groups[group]);
        known.points.iter().zip(0..).for_each(|(&point, number)| node[point as usize] = number);
        let nodes = group.simplices().flat_map(|cell| &cell[..stride]).map(|&point| node[point as usize]).collect();
        let (tags, keys) = (Cow::Borrowed(&group.tags[..]), Cow::Borrowed(keys));
        Self { portion, name: &group.name, stride, known, far: Vec::new(), nodes, tags, keys }
    }

    /// Some cells for another rank.
    pub fn some(&self, cells: impl Iterator<Item = usize> + Clone) -> Sent {
        let mut nodes: Vec<u32> = cells.clone().flat_map(|cell| self.cell(cell)).copied().collect();
        let cells_of = nodes.iter().map(|&node| self.number(node)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Sent {
            nodes: nodes.iter().map(|&node| (self.number(node), self.at(node))).collect(),
            cells: cells_of,
            tags: cells.clone().filter_map(|cell| self.tags.get(cell)).copied().collect(),
            keys: cells.map(|cell| self.key(cell)).collect(),
        }
    }

    /// Cells of other ranks, with their nodes, in place of own ones.
    pub fn of(&self, sent: impl Iterator<Item = Sent>) -> Self {
        let (mut places, mut cells, mut tags, mut keys) = (BTreeMap::new(), Vec::new(), Vec::new(), Vec::new());
        for mut sent in sent {
            places.extend(sent.nodes);
            cells.append(&mut sent.cells);
            tags.append(&mut sent.tags);
            keys.append(&mut sent.keys);
        }
        let (numbers, far): (Vec<u32>, Vec<_>) = places.into_iter().unzip();
        let place = |number: u32| numbers.binary_search(&number).map_or(NONE, |place| place as u32);
        let nodes = cells.into_iter().map(place).collect();
        let known = Arc::new(Nodes { count: self.known.count, numbers, points: Vec::new() });
        Self { known, far, nodes, tags: tags.into(), keys: keys.into(), ..*self }
    }

    /// Number of nodes that this rank has.
    pub fn node_count(&self) -> usize {
        self.known.numbers.len()
    }

    /// The number of a node among those of all ranks.
    pub fn number(&self, node: u32) -> u32 {
        self.known.numbers[node as usize]
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Whether a node is one of this rank, which has all cells around it.
    pub fn is_own(&self, node: u32) -> bool {
        self.portion.is_own(self.known.points[node as usize])
    }

    /// The one rank of those with this cell that speaks for it.
    pub fn home(&self, cell: usize) -> usize {
        self.portion.home(self.known.points[self.cell(cell)[0] as usize])
    }

    /// What puts cells of all ranks into an order.
    pub fn key(&self, cell: usize) -> Key {
        self.keys.get(cell).copied().unwrap_or((0, cell as u32))
    }

    /// The cell with a key, on a rank that does not have all.
    pub fn find(&self, key: Key) -> Option<usize> {
        self.keys.binary_search(&key).ok()
    }

    /// Whether edges have nodes between their ends.
    pub fn is_quadratic(&self) -> bool {
        self.stride > D + 1
    }

    /// Nodes of a cell.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.stride..][..self.stride]
    }

    /// Coordinates of a node, z = 0 in the plane.
    pub fn at(&self, node: u32) -> [f64; 3] {
        match self.far.get(node as usize) {
            Some(&x) => x,
            None => pad(self.portion.mesh.points[self.known.points[node as usize] as usize]),
        }
    }

    /// The mid-edge node of a cell between two of its corners.
    pub fn middle(&self, cell: usize, ends: [usize; 2]) -> u32 {
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
    }

    /// The refusal of the body for what is the matter with some of its cells, at a point.
    pub fn refuse(&self, what: &str, cells: &[usize], at: [f64; 3]) -> Error {
        let mesh = &self.portion.mesh;
        let at = mesh.in_scene(std::array::from_fn(|c| at[c]));
        let place = at[..D].iter().map(|x| x.to_string()).collect::<Vec<_>>().join(", ");
        let error = Error::mesh(&mesh.path, None, format!("body `{}`: {what} at ({place})", self.name));
        let tags: Vec<String> = cells.iter().filter_map(|&cell| self.tags.get(cell)).map(u64::to_string).collect();
        match &tags[..] {
            [] => error,
            [one] => error.because(format!("it is element {one} of the mesh file")),
            _ => error.because(format!("they are elements {} of the mesh file", tags.join(" and "))),
        }
    }
}
