//! What one rank has of a mesh: all points and surfaces, and the cells that touch its own points.
//!
//! Every rank has a share of the points, by their places, so that all know whose each is. A cell is with the ranks of all its points: the rank of a
//! point has all that meets there, and that of any corner of a facet all cells of the facet. Keys put the cells of all ranks into the order in which
//! one rank has them.

use super::dealer::{self, Cells, Dealer, Head};
use super::{Mesh, bisect, groups};
use crate::error::Result;
use crate::exchange::{Exchange, tell};
use crate::problem::order::Order;

/// The place of a cell among those of its group: on Morton's curve, and of equal ones in the file.
pub type Key = (u64, u32);

/// What one rank has of a mesh.
#[derive(Debug)]
pub struct Portion<const D: usize> {
    /// The mesh; its groups of cells have those that touch own points, sorted by their keys.
    pub mesh: Mesh<D>,
    /// The rank of each point; empty where one rank has all.
    owner: Vec<u32>,
    /// Keys of the cells of each group; empty where one rank has all.
    keys: Vec<Vec<Key>>,
    rank: u32,
}

impl<const D: usize> Portion<D> {
    /// What this rank has of a mesh that the first rank reads: `read` is called there alone, and gives a mesh without the cells that it has dealt
    /// out. Collective.
    ///
    /// # Errors
    /// That of `read`, on the first rank; elsewhere one of the same kind without words.
    pub fn read(
        exchange: &dyn Exchange,
        order: Order,
        read: impl FnOnce(&mut Dealer) -> Result<Mesh<D>>,
    ) -> Result<Self> {
        let (rank, ranks) = (exchange.rank(), exchange.ranks());
        if rank > 0 {
            let (points, cells) = dealer::take(exchange)?;
            let head: Head = tell(exchange, || unreachable!("the first rank tells"))?;
            let owner = bisect::parts(points.len(), |point| points[point as usize], &|_| 1, ranks);
            return Ok(Self::of(head, cells, (points, owner), rank));
        }
        let mut dealer = Dealer::new(exchange, order);
        let read = read(&mut dealer);
        if ranks == 1 {
            return read.map(Self::whole);
        }
        let read = read.map(|Mesh { path, points, order, groups, split }| {
            let mut groups = groups.into_list();
            if groups.iter().any(|group| group.dimension == D && !group.is_empty()) {
                // it was read whole
                dealer.begin::<D, D>(&points);
                for (place, group) in groups.iter_mut().enumerate().filter(|(_, group)| group.dimension == D) {
                    for (index, cell) in group.simplices().enumerate() {
                        dealer.put(place, group.tags.get(index).copied(), cell);
                    }
                    (group.connectivity, group.tags) = (Vec::new(), Vec::new());
                }
            }
            (Head { path, order, groups, split, used: Vec::new() }, points)
        });
        let (cells, owner, of_cells) = dealer.finish();
        let mut points = Vec::new();
        let head = tell(exchange, || {
            let mut head;
            (head, points) = read?;
            let mut used = groups::used(&head.groups, points.len());
            used.iter_mut().zip(of_cells).for_each(|(used, of_cell)| *used |= of_cell);
            if used.contains(&false) {
                head.used = used;
            }
            Ok(head)
        })?;
        Ok(Self::of(head, cells, (points, owner), rank))
    }

    /// All of a mesh.
    pub fn whole(mut mesh: Mesh<D>) -> Self {
        if D == 3 {
            mesh.sort_cells(&[]);
        }
        Self { mesh, owner: Vec::new(), keys: Vec::new(), rank: 0 }
    }

    fn of(head: Head, cells: Vec<Cells>, (mut points, mut owner): (Vec<[f64; D]>, Vec<u32>), rank: usize) -> Self {
        let Head { path, order, mut groups, split, used } = head;
        let mut numbers = vec![Vec::new(); groups.len()];
        for ((group, numbers), Cells { index, tags, nodes }) in groups.iter_mut().zip(&mut numbers).zip(cells) {
            if group.dimension == D {
                (group.connectivity, group.tags, *numbers) = (nodes, tags, index);
            }
        }
        if !used.is_empty() {
            let kept: Vec<usize> = groups::compact(&mut groups, used).collect();
            (points, owner) = kept.into_iter().map(|old| (points[old], owner[old])).unzip();
        }
        let mut mesh = Mesh { path, points, order, groups: groups.into(), split };
        let keys = match D {
            3 => mesh.sort_cells(&numbers),
            _ => numbers.into_iter().map(|index| index.into_iter().map(|index| (0, index)).collect()).collect(),
        };
        Self { mesh, owner, keys, rank: rank as u32 }
    }

    /// Whether a point is one of this rank.
    pub fn is_own(&self, point: u32) -> bool {
        self.owner.is_empty() || self.owner[point as usize] == self.rank
    }

    /// The rank of a point; it speaks for the cells of which the point is the first.
    pub fn home(&self, point: u32) -> usize {
        self.owner.get(point as usize).map_or(0, |&rank| rank as usize)
    }

    /// Keys of the cells of a group, by its place; none where one rank has all, in the order of their numbers.
    pub fn keys(&self, group: usize) -> &[Key] {
        self.keys.get(group).map_or(&[], Vec::as_slice)
    }
}
