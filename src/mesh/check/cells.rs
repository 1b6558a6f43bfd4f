//! The cells of one body, their nodes numbered within it.

use crate::error::Error;
use crate::exchange::{Exchange, gather};
use crate::mesh::{Key, Portion};
use crate::problem::order::Order;
use std::borrow::Cow;
use std::sync::Arc;

/// Mid-edge nodes of a simplex stand behind its corners in the order of these edges.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

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
    /// Point of the mesh of each node of the body, as the cells of all ranks meet them.
    pub points: Arc<Vec<u32>>,
    /// Nodes of all cells.
    nodes: Vec<u32>,
    /// Numbers of the cells in the file; none if they have none.
    tags: Cow<'a, [u64]>,
    /// Keys of the cells; none where one rank has all.
    keys: Cow<'a, [Key]>,
}

/// Cells of a body for another rank: nodes, numbers in the file, keys.
pub type Sent = (Vec<u32>, Vec<u64>, Vec<Key>);

impl<'a, const D: usize> Cells<'a, D> {
    /// Numbers the nodes of the body of this group with elements of an order, the same on all ranks. `node` is [`NONE`] for every point of the mesh
    /// before, and has the nodes of the body after. Collective.
    pub fn new(portion: &'a Portion<D>, group: usize, order: Order, node: &mut [u32], exchange: &dyn Exchange) -> Self {
        let (keys, group) = (portion.keys(group), &portion.mesh.groups[group]);
        let stride = if order == Order::P1 { D + 1 } else { group.stride };
        let mut points = Vec::new();
        let mut met = Vec::new();
        for (cell, corners) in group.simplices().enumerate() {
            for (corner, &point) in (0_u8..).zip(&corners[..stride]).filter(|(_, point)| portion.is_own(**point)) {
                let node = &mut node[point as usize];
                if *node == NONE {
                    *node = points.len() as u32;
                    points.push(point);
                    // its first cell is here, as all are in which it is
                    met.extend(keys.get(cell).map(|&key| (key, corner, point)));
                }
            }
        }
        if exchange.ranks() > 1 {
            points = gather::<(Key, u8, u32)>(exchange, &met).into_iter().map(|(.., point)| point).collect();
            points.iter().zip(0..).for_each(|(&point, number)| node[point as usize] = number);
        }
        let nodes = group.simplices().flat_map(|cell| &cell[..stride]).map(|&point| node[point as usize]).collect();
        let (tags, keys) = (Cow::Borrowed(&group.tags[..]), Cow::Borrowed(keys));
        Self { portion, name: &group.name, stride, points: Arc::new(points), nodes, tags, keys }
    }

    /// Some cells for another rank.
    pub fn some(&self, cells: impl Iterator<Item = usize> + Clone) -> Sent {
        let tags = cells.clone().filter_map(|cell| self.tags.get(cell)).copied().collect();
        let keys = cells.clone().map(|cell| self.key(cell)).collect();
        (cells.flat_map(|cell| self.cell(cell)).copied().collect(), tags, keys)
    }

    /// Cells of other ranks in place of own ones.
    pub fn of(&self, sent: impl Iterator<Item = Sent>) -> Self {
        let (mut nodes, mut tags, mut keys) = Sent::default();
        for mut sent in sent {
            nodes.append(&mut sent.0);
            tags.append(&mut sent.1);
            keys.append(&mut sent.2);
        }
        Self { nodes, tags: tags.into(), keys: keys.into(), ..self.clone() }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.nodes.len() / self.stride
    }

    /// Whether a node is one of this rank, which has all cells around it.
    pub fn is_own(&self, node: u32) -> bool {
        self.portion.is_own(self.points[node as usize])
    }

    /// The one rank of those with this cell that speaks for it.
    pub fn home(&self, cell: usize) -> usize {
        self.portion.home(self.points[self.cell(cell)[0] as usize])
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
        let x = &self.portion.mesh.points[self.points[node as usize] as usize];
        std::array::from_fn(|c| x.get(c).copied().unwrap_or(0.0))
    }

    /// The mid-edge node of a cell between two of its corners.
    pub fn middle(&self, cell: usize, ends: [usize; 2]) -> u32 {
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.cell(cell)[D + 1 + EDGES.iter().position(|edge| *edge == ends).unwrap_or(0)]
    }

    /// The refusal of the body for what is the matter with some of its cells, at a point.
    pub fn refuse(&self, what: &str, cells: &[usize], at: [f64; 3]) -> Error {
        let place = &at[..D].iter().map(|x| x.to_string()).collect::<Vec<_>>().join(", ");
        let error = Error::mesh(&self.portion.mesh.path, None, format!("body `{}`: {what} at ({place})", self.name));
        let tags: Vec<String> = cells.iter().filter_map(|&cell| self.tags.get(cell)).map(u64::to_string).collect();
        match &tags[..] {
            [] => error,
            [one] => error.because(format!("it is element {one} of the mesh file")),
            _ => error.because(format!("they are elements {} of the mesh file", tags.join(" and "))),
        }
    }
}
