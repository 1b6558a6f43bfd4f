//! The sections `$Nodes` and `$Elements` of a `.msh` file: coordinates, the map from Gmsh's node tags to our numbers, and the simplices
//! of all physical groups.
//!
//! Some programs write the boundary of quadratic cells as linear lines and facets. These get the mid-edge nodes of the cells.

use super::cursor::Cursor;
use super::groups::{Group, Numbering};
use super::physical::Physical;
use super::simplex::{self, EDGES, ElementType, THINGS};
use super::split::Middles;
use crate::error::{Error, Result};
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
        let BlockHeader { position, dimension, tag, kind, count } = BlockHeader::read(cursor)?;
        seen = seen.saturating_add(count);
        let Some(members) = physical.members(dimension, tag) else {
            let message = format!("elements of {} {tag}, which $Entities does not list", thing(dimension));
            return Err(cursor.error_at(position, message).help("save the mesh again with Gmsh"));
        };
        if !heads.insert((dimension, tag, kind.number)) {
            again = Some((position, dimension, tag));
        }
        let Some(first) = members.first() else {
            cursor.skip_records(count, 8 * (1 + kind.nodes))?;
            continue;
        };
        let name = physical.groups[*first].name.clone();
        if !kind.is_known() {
            let ElementType { shape, nodes, number } = kind;
            let message = format!("group `{name}` has {} elements of {nodes} nodes (Gmsh's type {number})", shape.name);
            return Err(cursor.error_at(position, message).help(ORDERS));
        }
        if let Some(order) = kind.order() {
            orders.add(cursor, dimension, order, position, &name)?;
        }
        let mut rest = count;
        while rest > 0 {
            let slice = Slice { kind, count: rest.min(SLICE), name: &name };
            let (connectivity, tags) = slice.read::<D>(cursor, nodes, &mut known)?;
            physical.extend((dimension, tag), kind.stride(), &connectivity, &tags);
            rest -= slice.count;
        }
        in_parts += if kind.is_divided() { count } else { 0 };
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
        raise(&mut physical.groups, &mut nodes.points, D);
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
struct BlockHeader {
    position: usize,
    dimension: usize,
    /// Number of the entity.
    tag: i32,
    /// Type of the elements.
    kind: ElementType,
    count: usize,
}

impl BlockHeader {
    fn read(cursor: &mut Cursor) -> Result<Self> {
        cursor.begin();
        let position = cursor.position();
        let (dimension, tag, number) = (cursor.int()?, cursor.int()?, cursor.int()?);
        let Some(dimension) = usize::try_from(dimension).ok().filter(|dimension| *dimension <= 3) else {
            return Err(cursor.error_at(position, format!("a block of elements of dimension {dimension}")));
        };
        let Some(kind) = ElementType::of(number) else {
            let message = format!("elements of Gmsh's type {number} cannot be used");
            return Err(cursor.error_at(position, message).help(ORDERS));
        };
        // This is checked even in blocks that nobody needs. The block may be one of another dimension whose head is damaged.
        if kind.shape.dimension != dimension {
            let message = format!("{} elements cannot be those of {} {tag}", kind.shape.name, thing(dimension));
            let help = "the file is damaged: save the mesh again with Gmsh";
            return Err(cursor.error_at(position, message).help(help));
        }
        let count = cursor.count(1 + kind.nodes, 8 * (1 + kind.nodes))?;
        cursor.end()?;
        Ok(Self { position, dimension, tag, kind, count })
    }
}

/// Return Gmsh's word for an entity of this dimension.
fn thing(dimension: usize) -> String {
    THINGS[dimension].to_lowercase()
}

/// The advice about elements of higher orders.
const ORDERS: &str = "use elements of order 1 or 2: `gmsh -order 2`";

/// Elements of one entity, all of one type.
struct Slice<'a> {
    kind: ElementType,
    count: usize,
    /// Name of a group with the block, for messages.
    name: &'a str,
}

impl Slice<'_> {
    /// Read the elements. Return the connectivity, `stride` point numbers per simplex in our local order, and the tag of each
    /// simplex. Cells are turned to positive volume. `known` has the nodes in the middle of divided faces and hexahedra.
    fn read<const D: usize>(
        &self,
        cursor: &mut Cursor,
        nodes: &mut Nodes,
        known: &mut HashMap<[u32; 4], u32>,
    ) -> Result<(Vec<u32>, Vec<u64>)> {
        let (dimension, stride) = (self.kind.shape.dimension, self.kind.stride());
        let mut connectivity = Vec::with_capacity(self.count * stride);
        let mut tags = Vec::with_capacity(self.count);
        let mut points = vec![0; self.kind.nodes];
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
            let simplices = match self.kind.is_divided() {
                true => {
                    parts = Middles { points: &mut nodes.points, known }.simplices(self.kind, &points);
                    &mut parts[..]
                }
                false => {
                    simplex::from_gmsh_order(&mut points);
                    &mut points[..]
                }
            };
            for points in simplices.chunks_exact_mut(stride) {
                if !simplex::turn(points, &nodes.points, dimension, D) {
                    let size = ["", "length", "area", "volume"][dimension];
                    let part = if self.kind.is_divided() { "a part of " } else { "" };
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

/// The first elements of each dimension.
#[derive(Default)]
struct Orders([Option<First>; 4]);

/// The order of some elements, with their position in the file and the name of a group with them.
struct First {
    order: Order,
    position: usize,
    name: String,
}

impl Orders {
    /// Record elements of a dimension and an order that stand at `position` and belong to the group `name`.
    ///
    /// # Errors
    /// The elements of this dimension before them are of another order.
    fn add(&mut self, cursor: &Cursor, dimension: usize, order: Order, position: usize, name: &str) -> Result<()> {
        let new = First { order, position, name: name.to_owned() };
        match self.0[dimension].get_or_insert(First { name: name.to_owned(), ..new }).order == order {
            true => Ok(()),
            false => new.refuse(cursor),
        }
    }

    /// Return the order of the cells, which have the dimension `space`, or `None` if there are none.
    ///
    /// # Errors
    /// Elements of a lower dimension are of a higher order.
    fn of_cells(&self, cursor: &Cursor, space: usize) -> Result<Option<Order>> {
        let Some(order) = self.0[space].as_ref().map(|first| first.order) else { return Ok(None) };
        match self.0[..space].iter().flatten().find(|first| first.order > order) {
            Some(first) => first.refuse(cursor),
            None => Ok(Some(order)),
        }
    }
}

impl First {
    fn refuse<T>(&self, cursor: &Cursor) -> Result<T> {
        let message = format!("group `{}` is of another order than other elements", self.name);
        let help = "save all elements with one order: gmsh -order 1 or 2";
        Err(cursor.error_at(self.position, message).help(help))
    }
}

/// Give linear elements below the dimension `space` of quadratic cells the mid-edge nodes of the cells. Elements that are no
/// edges or facets of cells get new nodes, with straight edges.
fn raise(groups: &mut [Group], points: &mut Vec<[f64; 3]>, space: usize) {
    let is_linear = |group: &&mut Group| group.dimension > 0 && group.stride == group.dimension + 1;
    let mut of_edge: HashMap<[u32; 2], u32> = HashMap::new();
    if !groups.iter_mut().any(|group| is_linear(&group)) {
        return;
    }
    for cell in groups.iter().filter(|group| group.dimension == space).flat_map(Group::simplices) {
        let middles = EDGES.iter().zip(&cell[space + 1..]);
        of_edge.extend(middles.map(|([a, b], middle)| (sorted([cell[*a], cell[*b]]), *middle)));
    }
    for group in groups.iter_mut().filter(is_linear) {
        let (vertices, edges) = (group.stride, group.dimension * (group.dimension + 1) / 2);
        let mut connectivity = Vec::with_capacity(group.len() * (vertices + edges));
        for simplex in group.simplices() {
            connectivity.extend_from_slice(simplex);
            for [a, b] in &EDGES[..edges] {
                let ends = sorted([simplex[*a], simplex[*b]]);
                connectivity.push(*of_edge.entry(ends).or_insert_with(|| straight(points, ends)));
            }
        }
        (group.stride, group.connectivity) = (vertices + edges, connectivity);
    }
}

fn sorted(mut ends: [u32; 2]) -> [u32; 2] {
    ends.sort_unstable();
    ends
}

/// Append the point in the middle between two others, and return its number.
fn straight(points: &mut Vec<[f64; 3]>, ends: [u32; 2]) -> u32 {
    let [a, b] = ends.map(|end| points[end as usize]);
    points.push(std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
    (points.len() - 1) as u32
}

/// The nodes of a file, numbered 0, 1, ... in its order.
pub struct Nodes {
    /// Coordinates (x, y, z).
    pub points: Vec<[f64; 3]>,
    /// Largest |z| of a point that counts as in the plane z = 0: 1e-12 times the size of the mesh.
    pub flat: f64,
    /// Our number of each tag. Gmsh's tags are nearly contiguous; other programs may write any.
    numbers: Numbering,
    blocks: Vec<Block>,
}

/// A block of consecutive nodes, with the position of their coordinates in the file.
struct Block {
    first: usize,
    position: usize,
    bytes: usize,
}

/// Most nodes that 32-bit numbers count.
const MOST: usize = u32::MAX as usize;

impl Nodes {
    /// Read the contents of the section.
    ///
    /// # Errors
    /// The text is malformed, a coordinate is not a number, or a tag occurs twice.
    pub fn read(cursor: &mut Cursor) -> Result<Nodes> {
        cursor.begin();
        let start = cursor.position();
        let block_count = cursor.count(4, 20)?;
        let total = cursor.count(4, 32)?;
        cursor.size()?;
        cursor.size()?;
        cursor.end()?;
        if total >= MOST {
            return Err(cursor.error_at(start, format!("{total} nodes are too many: 32-bit numbers count them")));
        }

        let mut tags = Vec::with_capacity(total);
        let mut points = Vec::with_capacity(total);
        let mut blocks = Vec::with_capacity(block_count);
        for _ in 0..block_count {
            cursor.begin();
            let dimension = cursor.int()?;
            cursor.int()?;
            let parameters = match (cursor.int()?, dimension) {
                (0, _) => 0,
                (1, 0..=3) => dimension as usize,
                _ => return Err(cursor.error("this is not the head of a block of nodes")),
            };
            let bytes = 8 * (3 + parameters);
            let count = cursor.count(4 + parameters, 8 + bytes)?;
            cursor.end()?;
            for _ in 0..count {
                cursor.begin();
                tags.push(cursor.size()?);
                cursor.end()?;
            }
            blocks.push(Block { first: points.len(), position: cursor.position(), bytes });
            for _ in 0..count {
                cursor.begin();
                points.push([cursor.real()?, cursor.real()?, cursor.real()?]);
                for _ in 0..parameters {
                    cursor.real()?;
                }
                cursor.end()?;
            }
        }
        if points.len() != total {
            let message = format!("$Nodes announces {total} nodes and holds {}", points.len());
            return Err(cursor.error_at(start, message));
        }
        let mut nodes =
            Nodes { flat: 1e-12 * size(&points), points, numbers: Numbering::new(tags.iter().copied()), blocks };
        for (number, tag) in tags.iter().enumerate() {
            if !nodes.numbers.number(*tag, number as u32).1 {
                return Err(nodes.error_at(cursor, number, format!("node tag {tag} stands twice")));
            }
        }
        Ok(nodes)
    }

    /// Return our number of the node with this tag.
    fn number(&self, tag: u64) -> Option<u32> {
        self.numbers.get(tag)
    }

    /// Return an error that names the position of a node's coordinates in the file.
    pub fn error_at(&self, cursor: &mut Cursor, number: usize, message: String) -> Error {
        let block = &self.blocks[self.blocks.partition_point(|block| block.first <= number) - 1];
        cursor.enter("Nodes");
        cursor.rewind(block.position);
        if let Err(error) = cursor.skip_records(number - block.first, block.bytes) {
            return error;
        }
        cursor.begin();
        cursor.error(message)
    }
}

/// Return the longest side of the box around the points.
fn size(points: &[[f64; 3]]) -> f64 {
    let [low, high] = crate::linalg::bounds(points.iter().copied());
    (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn nodes(text: &str) -> Result<Nodes> {
        Nodes::read(&mut Cursor::new(Path::new("a.msh"), Box::new(std::io::Cursor::new(text)), false))
    }

    #[test]
    fn tags_may_be_far_apart_and_as_large_as_they_like() {
        let found = nodes("1 2 1 2\n2 1 0 2\n18446744073709551615\n3\n0 0 0\n1 0 0\n").unwrap();
        assert_eq!([found.number(u64::MAX), found.number(3), found.number(4)], [Some(0), Some(1), None]);
        let found = nodes("1 2 1 2\n2 1 0 2\n9\n7\n0 0 0\n1 0 0\n").unwrap();
        assert_eq!(
            [found.number(9), found.number(7), found.number(8), found.number(0)],
            [Some(0), Some(1), None, None]
        );
    }

    #[test]
    fn parameters_on_a_curve_are_not_coordinates() {
        let found = nodes("1 1 1 1\n1 1 1 1\n1\n4 5 6 0.25\n").unwrap();
        assert_eq!(found.points, [[4.0, 5.0, 6.0]]);
    }
}
