//! From the nodes and elements of a file, in its numbers, to a [`Mesh`].
//!
//! Some programs write the boundary of curved cells as linear lines and facets. These get the nodes inside the edges of
//! the cells.

use super::Mesh;
use super::groups::{self, Group, Numbering};
use super::scan::{DAMAGED, ScanError};
use super::simplex::{self, ElementType, THINGS};
use super::split::Middles;
use crate::error::{Error, Result};
use crate::problem::body::plain;
use crate::problem::order::Order;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The maker of the bytes of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshProducer {
    /// The user. Line numbers are meaningful in messages, and groups have names.
    User,
    /// Gmsh, from a script.
    Script,
    /// Gmsh or this program, from a file of another program, whose groups may have no names.
    Other,
}

/// The parts of a mesh as they are read: names of groups, then nodes, then elements.
#[derive(Default)]
pub struct MeshBuilder<const D: usize> {
    /// The groups, which are empty until the elements are read.
    groups: Vec<Group>,
    /// Index in `groups` by dimension and physical tag.
    group_of: HashMap<(usize, i32), usize>,
    names: HashSet<String>,
    /// Whether groups without a name get one from their kind and number, and empty groups are dropped.
    named_by_number: bool,
    /// Coordinates (x, y, z), in the order of the file.
    points: Vec<[f64; 3]>,
    tags: Vec<u64>,
    /// Number of each tag, once all nodes are read. Gmsh's tags are nearly contiguous; other programs may write any.
    numbers: Numbering,
    /// Largest |z| of a point that counts as in the plane z = 0: 1e-12 times the size of the mesh.
    flat: f64,
    /// Order of the first elements of each dimension, and the index of a group with them.
    orders: [Option<(Order, usize)>; 4],
    /// Nodes in the middle of divided faces and hexahedra.
    middles: HashMap<[u32; 4], u32>,
    /// Number of divided elements.
    split: usize,
    /// The nodes of the element being added.
    nodes: Vec<u32>,
}

/// The advice about elements of higher orders.
const ORDERS: &str = "use elements of order 1 or 2, in the plane up to 8: `gmsh -order 2`";

/// Return an element type of Gmsh.
pub fn kind_of(number: i32) -> std::result::Result<ElementType, ScanError> {
    ElementType::of(number)
        .ok_or_else(|| ScanError::new(format!("elements of Gmsh's type {number} cannot be used"), ORDERS))
}

impl<const D: usize> MeshBuilder<D> {
    /// Start a mesh by its maker. Groups of other programs, and of old formats, may have no names.
    pub fn new(maker: MeshProducer) -> Self {
        Self { named_by_number: maker == MeshProducer::Other, ..Self::default() }
    }

    /// Add a physical group with its name.
    pub fn name(&mut self, dimension: usize, tag: i32, name: &str) -> std::result::Result<(), ScanError> {
        let (thing, lower) = (THINGS[dimension], THINGS[dimension].to_lowercase());
        if name.trim().is_empty() {
            let help = format!("name it: Physical {thing}(\"name\", {tag}) = {{...}};");
            return Err(ScanError::new(format!("physical {lower} {tag} has an empty name"), help));
        }
        if dimension > D {
            let what = format!("group `{name}` is made of volumes, but the scene has dimension = {D}");
            return Err(ScanError::new(what, "set `dimension = 3`, or remove the group"));
        }
        if !self.names.insert(name.to_owned()) {
            let help = "rename one: a name alone must tell which group is meant";
            return Err(ScanError::new(format!("two physical groups are named `{name}`"), help));
        }
        if self.group_of.contains_key(&(dimension, tag)) {
            Err(ScanError::new(format!("two names for physical {lower} {tag}"), DAMAGED))
        } else {
            self.add_group(dimension, tag, name.to_owned());
            Ok(())
        }
    }

    fn add_group(&mut self, dimension: usize, tag: i32, name: String) -> usize {
        let stride = dimension + 1;
        self.groups.push(Group { name, dimension, stride, connectivity: Vec::new(), tags: Vec::new() });
        self.group_of.insert((dimension, tag), self.groups.len() - 1);
        self.groups.len() - 1
    }

    /// Return the index of a physical group. The sign of its tag is an orientation.
    pub fn group(&mut self, dimension: usize, tag: i32) -> std::result::Result<usize, ScanError> {
        let tag = i32::try_from(tag.unsigned_abs()).unwrap_or(i32::MAX);
        let (thing, lower) = (THINGS[dimension], THINGS[dimension].to_lowercase());
        match self.group_of.get(&(dimension, tag)) {
            Some(&group) => Ok(group),
            None if self.named_by_number => Ok(self.add_group(dimension, tag, format!("{lower}_{tag}"))),
            None => Err(ScanError::new(
                format!("physical {lower} {tag} has no name"),
                format!("name it: Physical {thing}(\"name\", {tag}) = {{...}};"),
            )),
        }
    }

    /// Return whether the entities of a dimension become groups, since there are no others.
    pub fn groups_by_entity(&self, dimension: usize) -> bool {
        self.named_by_number && !self.groups.iter().any(|group| group.dimension == dimension)
    }

    /// Add a node.
    pub fn node(&mut self, tag: u64, x: [f64; 3]) -> std::result::Result<(), ScanError> {
        if let Some(bad) = x.iter().find(|x| !x.is_finite()) {
            return Err(ScanError::new(format!("a coordinate is {bad}"), DAMAGED));
        }
        if self.points.len() >= u32::MAX as usize {
            return Err(ScanError::new(
                "there are too many nodes: 32-bit numbers count them",
                "solve a part of the model",
            ));
        }
        self.tags.push(tag);
        self.points.push(x);
        Ok(())
    }

    /// Number the nodes, all of which are there.
    pub fn number_nodes(&mut self) -> std::result::Result<(), ScanError> {
        let tags = std::mem::take(&mut self.tags);
        self.numbers = Numbering::new(tags.iter().copied());
        if let Some(tag) = tags.iter().zip(0..).find(|&(tag, number)| !self.numbers.number(*tag, number).1) {
            return Err(ScanError::new(format!("node tag {} stands twice", tag.0), DAMAGED));
        }
        let [low, high] = crate::linalg::bounds(self.points.iter().copied());
        self.flat = 1e-12 * (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        Ok(())
    }

    /// Check elements of a type before they are added to groups.
    pub fn check_type(&mut self, kind: ElementType, groups: &[usize]) -> std::result::Result<(), ScanError> {
        let Some(&group) = groups.first() else { return Ok(()) };
        let name = &self.groups[group].name;
        if kind.order > Some(Order::highest(D)) {
            let ElementType { shape, nodes, number, .. } = kind;
            let what = format!("group `{name}` has {} elements of {nodes} nodes (Gmsh's type {number})", shape.name);
            return Err(ScanError::new(what, ORDERS));
        }
        let Some(order) = kind.order else { return Ok(()) };
        if self.orders[kind.shape.dimension].get_or_insert((order, group)).0 == order {
            Ok(())
        } else {
            Err(other_order(name))
        }
    }

    /// Add an element to groups, divided into simplices.
    pub fn element(
        &mut self,
        kind: ElementType,
        tag: u64,
        nodes: &[u64],
        groups: &[usize],
    ) -> std::result::Result<(), ScanError> {
        let Some(&first) = groups.first() else { return Ok(()) };
        let mut own = std::mem::take(&mut self.nodes);
        own.clear();
        for &node in nodes {
            let Some(number) = self.numbers.get(node) else {
                let name = &self.groups[first].name;
                let what = format!("element {tag} of group `{name}` uses node {node}, which does not exist");
                return Err(ScanError::new(what, DAMAGED));
            };
            own.push(number);
        }
        if D == 2 {
            self.check_plane(&own, nodes, first)?;
        }
        self.split += usize::from(kind.is_divided());
        let mut simplices = if kind.is_divided() {
            Middles { points: &mut self.points, known: &mut self.middles }.simplices(kind, &own)
        } else {
            kind.reorder(&mut own);
            own
        };
        let (dimension, stride) = (kind.shape.dimension, simplex::stride(kind.shape.dimension, kind.order));
        for simplex in simplices.chunks_exact_mut(stride) {
            if !simplex::turn(simplex, &self.points, dimension, D) {
                let size = ["", "length", "area", "volume"][dimension];
                let part = if kind.is_divided() { "a part of " } else { "" };
                let what = format!("{part}element {tag} of group `{}` has zero {size}", self.groups[first].name);
                return Err(ScanError::new(what, "correct the geometry there, or mesh it again"));
            }
        }
        for &group in groups {
            let group = &mut self.groups[group];
            group.stride = stride;
            group.connectivity.extend_from_slice(&simplices);
            group.tags.extend(std::iter::repeat_n(tag, simplices.len() / stride));
        }
        self.nodes = simplices;
        Ok(())
    }

    fn check_plane(&self, own: &[u32], tags: &[u64], group: usize) -> std::result::Result<(), ScanError> {
        let z = |number: u32| self.points[number as usize][2];
        match own.iter().zip(tags).find(|(number, _)| z(**number).abs() > self.flat) {
            Some((&number, tag)) => {
                let name = &self.groups[group].name;
                let what =
                    format!("node {tag} of group `{name}` has z = {}, but the scene has dimension = 2", z(number));
                Err(ScanError::new(what, "draw plane bodies in the plane z = 0, or set `dimension = 3`"))
            }
            None => Ok(()),
        }
    }

    /// Return the mesh after all elements are there.
    ///
    /// # Errors
    /// The elements are not a mesh of named simplices of one order in `D` dimensions.
    pub fn finish(mut self, path: &Path) -> Result<Mesh<D>> {
        let fail = |message: String| Error::mesh(path, None, message);
        let (thing, cells) = (THINGS[D], THINGS[D].to_lowercase());
        let example = format!("name the bodies and their boundaries: Physical {thing}(\"lower\") = {{1}};");
        let order = self.orders[D].map(|(order, _)| order);
        let lower = self.orders[..D].iter().flatten().find(|first| Some(first.0) > order);
        if let (Some(_), Some((_, group))) = (order, lower) {
            let ScanError { what, help } = other_order(&self.groups[*group].name);
            return Err(fail(what).help(help));
        }
        if let Some(order) = order.filter(|order| *order > Order::P1) {
            groups::raise(&mut self.groups, &mut self.points, order, D);
        }
        // Empty groups of other programs are dropped.
        let mut groups = self.groups;
        if self.named_by_number {
            groups.retain(|group| !group.is_empty());
        }
        if groups.is_empty() {
            return Err(fail("the mesh has no physical groups".into()).help(example));
        }
        if let Some(Group { dimension, name, .. }) = groups.iter().find(|group| group.is_empty()) {
            let thing = THINGS[*dimension];
            let message = format!("the physical {} `{name}` has no elements", thing.to_lowercase());
            return Err(fail(message).help(format!("check what its `Physical {thing}` names, or remove it")));
        }
        groups.iter_mut().filter(|group| group.dimension == D).for_each(|group| group.name = plain(&group.name));
        if let Some(name) = groups::twice(&groups) {
            let help = "names of bodies have small letters, digits and _, and other characters become these: rename one of the groups";
            return Err(fail(format!("two groups of the mesh have the name `{name}` here")).help(help));
        }
        let Some(order) = order else {
            return Err(fail(format!("no physical group holds {cells}s, and dimension = {D}")).help(example));
        };
        let point = |x: [f64; 3]| std::array::from_fn(|k| x[k]);
        let points = groups::renumber(&mut groups).into_iter().map(|old| point(self.points[old as usize])).collect();
        Ok(Mesh { split: self.split, ..Mesh::new(path.to_owned(), points, order, groups.into()) })
    }
}

fn other_order(group: &str) -> ScanError {
    let what = format!("group `{group}` is of another order than other elements");
    ScanError::new(what, "save all elements with one order: gmsh -order 1 or 2")
}
