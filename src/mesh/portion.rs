//! What one rank has of a mesh: the cells that touch its own points, all surfaces, and the points of these.
//!
//! Every rank has a share of the points, by their places, so that who has a point knows whose it is. A cell is with the ranks of all its points: the rank
//! of a point has all that meets there, and that of any corner of a facet all cells of the facet. Points are numbered on each rank, in the order that
//! they have among all, so that ranks compare them alike; keys put the cells of all ranks into the order in which one rank has them.

use super::dealer::{self, Cells, Dealer, Head};
use super::{Cuts, Group, Mesh, Numbering, datum, groups};
use crate::error::Result;
use crate::exchange::{Exchange, pack, tell, unpack};
use crate::linalg::{bounds, pad};
use crate::problem::order::Order;

/// The place of a cell among those of its group: on Morton's curve, and of equal ones in the file.
pub type Key = (u64, u32);

/// What one rank has of a mesh.
#[derive(Debug)]
pub struct Portion<const D: usize> {
    /// The mesh; its groups of cells have those that touch own points, sorted by their keys.
    pub mesh: Mesh<D>,
    /// Number of points of the mesh on all ranks.
    pub points: usize,
    /// Corners of the box around the points of all ranks, in coordinates of the scene.
    bounds: [[f64; 3]; 2],
    /// The rank of each point; empty where one rank has all.
    owner: Vec<u32>,
    /// Numbers of the points among all, sorted; empty where one rank has all.
    numbers: Vec<u32>,
    /// Keys of the cells of each group; empty where one rank has all.
    keys: Vec<Vec<Key>>,
    rank: u32,
}

/// Coordinates of points, and their numbers among all.
type Points<const D: usize> = (Vec<[f64; D]>, Vec<u32>);

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
            let (cuts, cells) = dealer::take(exchange)?;
            let head: Head = tell(exchange, || unreachable!("the first rank tells"))?;
            let wanted = Wanted::new(&cells, &head.groups);
            exchange.send(0, &pack(&wanted.points));
            let (places, numbers): (Vec<f64>, Vec<u32>) = unpack(&exchange.receive(0))?;
            let points = places.chunks_exact(D).map(|x| std::array::from_fn(|c| x[c])).collect();
            return Ok(Self::of((head, cuts, cells), wanted, (points, numbers), rank));
        }
        let mut dealer = Dealer::new(exchange, order);
        let read = read(&mut dealer);
        if ranks == 1 {
            return read.map(Self::whole);
        }
        let is_dealt = dealer.has_begun();
        let read = read.map(|Mesh { path, points, order, groups, split, straightened, .. }| {
            let mut groups = groups.into_list();
            if !is_dealt {
                // it was read whole
                dealer.begin::<D, D>(&points);
                for (place, group) in groups.iter_mut().enumerate().filter(|(_, group)| group.dimension == D) {
                    for (index, cell) in group.simplices().enumerate() {
                        dealer.put(place, group.tags.get(index).copied(), cell);
                    }
                    (group.connectivity, group.tags) = (Vec::new(), Vec::new());
                }
            }
            (Head { path, order, groups, split, straightened, bounds: [[0.0; 3]; 2], points: 0 }, points)
        });
        let (cuts, cells, of_cells) = dealer.finish();
        let (mut points, mut number) = (Vec::new(), Vec::new());
        let head = tell(exchange, || {
            let mut head;
            (head, points) = read?;
            let mut used = groups::used(&head.groups, points.len());
            used.iter_mut().zip(of_cells).for_each(|(used, of_cell)| *used |= of_cell || !is_dealt);
            head.bounds = bounds(points.iter().zip(&used).filter(|(_, used)| **used).map(|(x, _)| pad(*x)));
            number = groups::compact(&used);
            head.points = number.last().map_or(0, |last| *last as usize + 1);
            Ok(head)
        })?;
        let some = |these: &[u32]| -> Points<D> {
            let of = |&point: &u32| (points[point as usize], number[point as usize]);
            these.iter().map(of).unzip()
        };
        for other in 1..ranks {
            let (points, numbers) = some(&unpack::<Vec<u32>>(&exchange.receive(other))?);
            exchange.send(other, &pack(&(points.as_flattened(), numbers)));
        }
        let wanted = Wanted::new(&cells, &head.groups);
        let own = some(&wanted.points);
        drop((points, number));
        Ok(Self::of((head, cuts, cells), wanted, own, rank))
    }

    /// All of a mesh.
    pub fn whole(mut mesh: Mesh<D>) -> Self {
        let bounds = bounds(mesh.points.iter().copied().map(pad));
        if D == 3 {
            mesh.sort_cells(bounds, &[]);
        }
        let points = mesh.points.len();
        Self { mesh, points, bounds, owner: Vec::new(), numbers: Vec::new(), keys: Vec::new(), rank: 0 }
    }

    /// Measure the coordinates from a datum near the mesh, the same on all ranks, if the origin is far away; see the module `datum`. `along` says
    /// along which axes the origin may move.
    #[must_use]
    pub fn near(mut self, along: [bool; D]) -> Self {
        let datum = datum::of(self.bounds, along);
        for x in &mut self.mesh.points {
            (0..D).for_each(|c| x[c] -= datum[c]);
        }
        self.mesh.datum = datum;
        self
    }

    fn of(
        (head, cuts, cells): (Head, Cuts, Vec<Cells>),
        Wanted { points: before, place }: Wanted,
        (points, numbers): Points<D>,
        rank: usize,
    ) -> Self {
        let Head { path, order, mut groups, split, straightened, bounds, points: count } = head;
        let owner = points.iter().zip(before).map(|(x, number)| cuts.part(x, number) as u32).collect();
        let mut index = vec![Vec::new(); groups.len()];
        for ((group, index), cells) in groups.iter_mut().zip(&mut index).zip(cells) {
            if group.dimension == D {
                (group.connectivity, group.tags, *index) = (cells.nodes, cells.tags, cells.index);
            }
        }
        for point in groups.iter_mut().flat_map(|group| &mut group.connectivity) {
            *point = place.get(*point).unwrap_or_default();
        }
        let mut mesh = Mesh { path, points, datum: [0.0; D], order, groups: groups.into(), split, straightened };
        let keys = match D {
            3 => mesh.sort_cells(bounds, &index),
            _ => index.into_iter().map(|index| index.into_iter().map(|index| (0, index)).collect()).collect(),
        };
        Self { mesh, points: count, bounds, owner, numbers, keys, rank: rank as u32 }
    }

    /// Whether a point is one of this rank.
    pub fn is_own(&self, point: u32) -> bool {
        self.owner.is_empty() || self.owner[point as usize] == self.rank
    }

    /// The rank of a point; it speaks for the cells of which the point is the first.
    pub fn home(&self, point: u32) -> usize {
        self.owner.get(point as usize).map_or(0, |&rank| rank as usize)
    }

    /// The number among the points of all ranks of one that this rank has.
    pub fn number(&self, point: u32) -> u32 {
        self.numbers.get(point as usize).copied().unwrap_or(point)
    }

    /// The point with this number among those of all ranks, if this rank has it.
    pub fn find(&self, number: u32) -> Option<u32> {
        match self.numbers.is_empty() {
            true => Some(number),
            false => self.numbers.binary_search(&number).ok().map(|point| point as u32),
        }
    }

    /// Keys of the cells of a group, by its place; none where one rank has all, in the order of their numbers.
    pub fn keys(&self, group: usize) -> &[Key] {
        self.keys.get(group).map_or(&[], Vec::as_slice)
    }
}

/// The points that a rank is to have: those of its cells and of all surfaces, edges and points.
struct Wanted {
    /// Their numbers, sorted.
    points: Vec<u32>,
    /// The place of each number among these.
    place: Numbering,
}

impl Wanted {
    fn new(cells: &[Cells], groups: &[Group]) -> Self {
        let of_groups = groups.iter().flat_map(|group| &group.connectivity);
        let place = Numbering::in_order(cells.iter().flat_map(|cells| &cells.nodes).chain(of_groups).copied());
        Self { points: place.points().collect(), place }
    }
}
