//! The `$Elements` section: the simplices of all physical groups.

use super::cursor::Cursor;
use super::middles::Middles;
use super::nodes::Nodes;
use super::orders::{self, Orders};
use super::physical::Physical;
use super::simplex::{self, Kind, THINGS};
use super::split::Split;
use crate::error::Result;
use crate::problem::order::Order;
use std::collections::{HashMap, HashSet};

/// Number of elements that are read before they go to their groups, so that a large block is not in memory twice.
const SLICE: usize = 1 << 10;

/// Read the contents of the section into the groups. Return the order of the cells, which is `None` if there are none, and the
/// number of elements that were split. Points in the middle of diagonals are appended to those of `nodes`.
///
/// # Errors
/// The text is malformed. Elements in a group are not of order 1 or 2, or cells or facets mix both orders. A node does not exist, or
/// it lies off the plane if `D` is 2. A simplex is degenerate.
pub fn read<const D: usize>(
    cursor: &mut Cursor,
    nodes: &mut Nodes,
    physical: &mut Physical,
) -> Result<(Option<Order>, usize)> {
    cursor.begin();
    let start = cursor.position();
    let blocks = cursor.count(4, 20)?;
    let total = cursor.count(1, 8)?;
    cursor.size()?;
    cursor.size()?;
    cursor.end()?;
    let mut seen: usize = 0;
    let (mut orders, mut in_parts, mut known) = (Orders::default(), 0, HashMap::new());
    let (mut heads, mut again) = (HashSet::new(), None);
    for _ in 0..blocks {
        let head = Head::read(cursor)?;
        let Head { position, dimension, tag, number, stride, count, .. } = head;
        seen = seen.saturating_add(count);
        let Some(members) = physical.members(dimension, tag) else {
            let message = format!("elements of {} {tag}, which $Entities does not list", thing(dimension));
            return Err(cursor.error_at(position, message).help("save the mesh again with Gmsh"));
        };
        if !heads.insert((dimension, tag, number)) {
            again = Some((position, dimension, tag));
        }
        let Some(first) = members.first() else {
            cursor.skip_records(count, 8 * (1 + stride))?;
            continue;
        };
        let name = physical.groups[*first].name.clone();
        let (kind, split) = head.kind(cursor, &name)?;
        if let Some(order) = kind.order {
            orders.add(cursor, dimension, order, position, &name)?;
        }
        let mut rest = count;
        while rest > 0 {
            let slice = Block { kind, split, count: rest.min(SLICE), name: &name };
            let (connectivity, tags) = slice.read::<D>(cursor, nodes, &mut known)?;
            physical.extend((dimension, tag), kind.stride, &connectivity, &tags);
            rest -= slice.count;
        }
        in_parts += if split.is_some() { count } else { 0 };
    }
    if seen != total {
        let message = format!("$Elements announces {total} elements and holds {seen}");
        return Err(cursor.error_at(start, message));
    }
    if let Some((head, dimension, tag)) = again {
        refuse_another_number(cursor, physical, heads, head, (dimension, tag))?;
    }
    let order = orders.of_cells(cursor, D)?;
    if order == Some(Order::P2) {
        orders::raise(&mut physical.groups, &mut nodes.points, D);
    }
    Ok((order, in_parts))
}

/// Refuse two blocks of one entity, the second at `position`, if another entity has no block: then one block has the number of
/// the other. Either alone is allowed.
fn refuse_another_number(
    cursor: &Cursor,
    physical: &Physical,
    heads: HashSet<(usize, i32, i32)>,
    position: usize,
    (dimension, tag): (usize, i32),
) -> Result<()> {
    let with: HashSet<_> = heads.into_iter().map(|(dimension, tag, _)| (dimension, tag)).collect();
    let Some(without) = physical.without(dimension, |entity| with.contains(&entity)) else { return Ok(()) };
    let thing = thing(dimension);
    let message = format!("elements of {thing} {tag} stand in two blocks, and those of {thing} {without} in none");
    Err(cursor.error_at(position, message).help("the file is damaged: save the mesh again with Gmsh"))
}

/// The head of a block of elements.
struct Head {
    position: usize,
    dimension: usize,
    /// Number of the entity.
    tag: i32,
    /// Gmsh's number of the element type.
    number: i32,
    shape: &'static str,
    /// Number of nodes of an element.
    stride: usize,
    /// Number of elements.
    count: usize,
}

impl Head {
    fn read(cursor: &mut Cursor) -> Result<Self> {
        cursor.begin();
        let position = cursor.position();
        let (dimension, tag, number) = (cursor.int()?, cursor.int()?, cursor.int()?);
        let Some(dimension) = usize::try_from(dimension).ok().filter(|dimension| *dimension <= 3) else {
            return Err(cursor.error_at(position, format!("a block of elements of dimension {dimension}")));
        };
        let Some((shape, stride)) = simplex::type_name(number) else {
            let message = format!("elements of Gmsh's type {number} cannot be used");
            return Err(cursor.error_at(position, message).help(ORDERS));
        };
        // This is checked even in blocks that nobody needs. The block may be one of another dimension whose head is damaged.
        if simplex::dimension(shape) != dimension {
            let message = format!("{shape} elements cannot be those of {} {tag}", thing(dimension));
            let help = "the file is damaged: save the mesh again with Gmsh";
            return Err(cursor.error_at(position, message).help(help));
        }
        let count = cursor.count(1 + stride, 8 * (1 + stride))?;
        cursor.end()?;
        Ok(Self { position, dimension, tag, number, shape, stride, count })
    }

    /// Return the kind of simplex as which the elements are read, and how they are split, if they are. `name` is that of a
    /// group with them.
    fn kind(&self, cursor: &Cursor, name: &str) -> Result<(Kind, Option<Split>)> {
        let split = Split::of_type(self.number).filter(|split| split.dimension == self.dimension);
        let whole = Kind::of_type(self.number).filter(|kind| kind.dimension == self.dimension);
        let Some(kind) = whole.or(split.map(|split| Kind::simplex(split.dimension, split.order()))) else {
            let Self { shape, stride, number, .. } = self;
            let message = format!("group `{name}` has {shape} elements of {stride} nodes (Gmsh's type {number})");
            return Err(cursor.error_at(self.position, message).help(ORDERS));
        };
        Ok((kind, split))
    }
}

/// Return Gmsh's word for an entity of this dimension.
fn thing(dimension: usize) -> String {
    THINGS[dimension].to_lowercase()
}

/// The advice about elements of higher orders.
const ORDERS: &str = "use elements of order 1 or 2: `gmsh -order 2`";

/// Elements of one entity, all of one kind.
struct Block<'a> {
    /// Kind of the simplices.
    kind: Kind,
    /// How the elements are split into simplices, if they are none themselves.
    split: Option<Split>,
    count: usize,
    /// Name of a group with the block, for messages.
    name: &'a str,
}

impl Block<'_> {
    /// Read the elements. Return the connectivity, `stride` point numbers per simplex in our local order, and the tag of each
    /// simplex. Cells are turned to positive volume. `known` has the nodes in the middle of divided faces and hexahedra.
    fn read<const D: usize>(
        &self,
        cursor: &mut Cursor,
        nodes: &mut Nodes,
        known: &mut HashMap<[u32; 4], u32>,
    ) -> Result<(Vec<u32>, Vec<u64>)> {
        let Kind { dimension, stride, .. } = self.kind;
        let mut connectivity = Vec::with_capacity(self.count * stride);
        let mut tags = Vec::with_capacity(self.count);
        let mut points = vec![0; self.split.map_or(stride, |split| split.stride)];
        for _ in 0..self.count {
            cursor.begin();
            let start = cursor.position();
            let tag = cursor.size()?;
            for point in &mut points {
                let node = cursor.size()?;
                *point = nodes.number(node).ok_or_else(|| {
                    let message =
                        format!("element {tag} of group `{}` uses node {node}, which does not exist", self.name);
                    cursor.error_at(start, message).help("the file is damaged: save the mesh again with Gmsh")
                })?;
            }
            cursor.end()?;
            if D == 2 {
                self.check_plane(cursor, nodes, &points)?;
            }
            let mut parts;
            let simplices = match self.split {
                Some(split) => {
                    parts = Middles { points: &mut nodes.points, known }.simplices(&split, &points);
                    &mut parts[..]
                }
                None => {
                    simplex::from_gmsh_order(&mut points);
                    &mut points[..]
                }
            };
            for points in simplices.chunks_exact_mut(stride) {
                if !simplex::turn(points, &nodes.points, dimension, D) {
                    let size = ["", "length", "area", "volume"][dimension];
                    let part = if self.split.is_some() { "a part of " } else { "" };
                    let message = format!("{part}element {tag} of group `{}` has zero {size}", self.name);
                    return Err(cursor.error_at(start, message).help("correct the geometry there, or mesh it again"));
                }
                connectivity.extend_from_slice(points);
                tags.push(tag);
            }
        }
        Ok((connectivity, tags))
    }

    fn check_plane(&self, cursor: &mut Cursor, nodes: &Nodes, points: &[u32]) -> Result<()> {
        let outside =
            points.iter().map(|point| *point as usize).find(|point| nodes.points[*point][2].abs() > nodes.flat);
        let Some(point) = outside else { return Ok(()) };
        let message = format!(
            "a node of group `{}` has z = {}, but the scene has dimension = 2",
            self.name, nodes.points[point][2]
        );
        Err(nodes.error_at(cursor, point, message).help("draw plane bodies in the plane z = 0, or set `dimension = 3`"))
    }
}
