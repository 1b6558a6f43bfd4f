//! A mesh from the rank that reads it to all: cells in slices to the ranks of their points, then surfaces and points.

use super::{Cuts, Group};
use crate::error::Result;
use crate::exchange::{Exchange, Serial, pack, unpack};
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A mesh without points and cells, as plain data.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Head {
    /// The file that the user named.
    pub path: PathBuf,
    /// Order of all elements.
    pub order: Order,
    /// Groups, those of cells empty.
    pub groups: Vec<Group>,
    /// Elements that were split.
    pub split: usize,
    /// Quadratic cells that were made straight.
    pub straightened: usize,
    /// Corners of the box around all points that are used, z = 0 in the plane.
    pub bounds: [[f64; 3]; 2],
    /// How many there are.
    pub points: usize,
}

/// Cells of a group on one rank.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Cells {
    /// Their places in the group as it was read.
    pub index: Vec<u32>,
    /// Their numbers in the file.
    pub tags: Vec<u64>,
    /// Their points.
    pub nodes: Vec<u32>,
}

/// Cells of one message, and elements that are read before they go on: of 24 to 52 bytes each. Two cubes of 48^3 are read by one rank in
/// 1.41 to 1.45 s with slices from 2^4 to 2^24; four ranks on two cores check them in 2.8 s with messages of 2^10 to 2^22 cells, in 3.0 s with 2^6.
pub const SLICE: usize = 1 << 10;

/// What the first rank sends each of the others.
#[derive(Serialize, Deserialize)]
enum Message {
    /// A mesh is read from its start, whose points are cut into parts like this.
    Begin(Cuts),
    /// Cells of a group.
    Cells(u32, Cells),
    /// There are no more.
    End,
}

/// Sends the cells of a mesh, while the first rank reads it, to the ranks that have their points, in messages for many.
pub struct Dealer<'a> {
    exchange: &'a dyn Exchange,
    /// The order that a mesh must have to be dealt out while it is read.
    order: Order,
    cuts: Cuts,
    /// The rank of each point; empty before there are points.
    owner: Vec<u32>,
    /// Whether each point is one of a cell.
    used: Vec<bool>,
    /// What each rank gets next: group and cells.
    next: Vec<(u32, Cells)>,
    /// Own cells of each group.
    own: Vec<Cells>,
    /// Number of cells of each group on all ranks.
    counts: Vec<u32>,
}

impl<'a> Dealer<'a> {
    /// On the first rank.
    pub fn new(exchange: &'a dyn Exchange, order: Order) -> Self {
        let next = vec![(0, Cells::default()); exchange.ranks()];
        Self {
            exchange,
            order,
            cuts: Cuts::default(),
            owner: Vec::new(),
            used: Vec::new(),
            next,
            own: Vec::new(),
            counts: Vec::new(),
        }
    }

    /// Whether cells of an order go to several ranks while they are read.
    pub fn wants(&self, order: Order) -> bool {
        self.order == order && self.exchange.ranks() > 1
    }

    /// Forgets a mesh that could not be read.
    pub fn reset(&mut self) {
        self.owner.clear();
        self.used.clear();
        self.own.clear();
        self.counts.clear();
        self.next.fill((0, Cells::default()));
    }

    /// Whether there are points.
    pub fn has_begun(&self) -> bool {
        !self.owner.is_empty()
    }

    /// Cuts the points, of whose coordinates `D` count, into parts for the ranks.
    pub fn begin<const D: usize, const K: usize>(&mut self, points: &[[f64; K]]) {
        self.reset();
        let at = |point: u32| first::<D, K>(&points[point as usize]);
        self.cuts = Cuts::new(points.len(), &|point| (at(point), point), &|_| 1, self.next.len(), &Serial);
        self.all(&Message::Begin(self.cuts.clone()));
        self.owner = (0..points.len() as u32).map(|point| self.cuts.part(&at(point), point) as u32).collect();
        self.used = vec![false; points.len()];
    }

    /// Sends a cell of a group with its number in the file and its points.
    pub fn put(&mut self, group: usize, tag: Option<u64>, nodes: &[u32]) {
        self.counts.resize(self.counts.len().max(group + 1), 0);
        for (place, &node) in nodes.iter().enumerate() {
            self.used[node as usize] = true;
            let rank = self.owner[node as usize];
            if nodes[..place].iter().any(|&before| self.owner[before as usize] == rank) {
                continue;
            }
            let rank = rank as usize;
            if self.next[rank].0 != group as u32 || self.next[rank].1.index.len() == SLICE {
                self.send(rank);
            }
            let (of, cells) = &mut self.next[rank];
            *of = group as u32;
            cells.index.push(self.counts[group]);
            cells.tags.extend(tag);
            cells.nodes.extend_from_slice(nodes);
        }
        self.counts[group] += 1;
    }

    /// Number of cells of a group that were sent.
    pub fn count(&self, group: usize) -> usize {
        self.counts.get(group).map_or(0, |&count| count as usize)
    }

    fn send(&mut self, rank: usize) {
        let (group, cells) = std::mem::take(&mut self.next[rank]);
        match rank {
            _ if cells.index.is_empty() => {}
            0 => append(&mut self.own, group, cells),
            _ => self.exchange.send(rank, &pack(&Message::Cells(group, cells))),
        }
    }

    fn all(&self, message: &Message) {
        (1..self.next.len()).for_each(|rank| self.exchange.send(rank, &pack(message)));
    }

    /// Sends what is left; gives the cuts between the points of ranks, the own cells of each group, and whether each point is one of a cell.
    pub fn finish(mut self) -> (Cuts, Vec<Cells>, Vec<bool>) {
        (0..self.next.len()).for_each(|rank| self.send(rank));
        self.all(&Message::End);
        (self.cuts, self.own, self.used)
    }
}

/// The coordinates that count.
fn first<const D: usize, const K: usize>(x: &[f64; K]) -> [f64; D] {
    std::array::from_fn(|c| x[c])
}

fn append(own: &mut Vec<Cells>, group: u32, mut cells: Cells) {
    own.resize_with(own.len().max(group as usize + 1), Cells::default);
    let own = &mut own[group as usize];
    own.index.append(&mut cells.index);
    own.tags.append(&mut cells.tags);
    own.nodes.append(&mut cells.nodes);
}

/// Takes the cuts and the cells of each group that the first rank sends.
///
/// # Errors
/// A message that cannot be read.
pub fn take(exchange: &dyn Exchange) -> Result<(Cuts, Vec<Cells>)> {
    let (mut cuts, mut own) = (Cuts::default(), Vec::new());
    loop {
        match unpack(&exchange.receive(0))? {
            Message::Begin(begun) => (cuts, own) = (begun, Vec::new()),
            Message::Cells(group, cells) => append(&mut own, group, cells),
            Message::End => return Ok((cuts, own)),
        }
    }
}
