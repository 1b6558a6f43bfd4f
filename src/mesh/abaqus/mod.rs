//! A reader of input files of Abaqus and CalculiX (`.inp`): nodes, elements, and named sets.
//!
//! Element sets become groups of cells. Sets of shells, membranes and trusses become the groups of facets or edges of
//! cells that these lie on. Surfaces are groups of facets, and node sets groups of points. Instances of parts are
//! placed. Names are written in lower case. Characters that no name can have become `_`. Other keywords are skipped.

mod frame;
mod lines;
mod model;
mod read;

use super::builder::{MeshBuilder, MeshProducer, kind_of};
use super::scan::ScanError;
use super::{Mesh, simplex};
use crate::error::{Error, Result};
use lines::LineReader;
use model::{AbaqusElement, AbaqusModel, AbaqusType, ElementFace, MissingMember, members};
use read::Reader;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::Path;

/// Read a file for a scene in `D` dimensions. Return the mesh, and what the user should know of it, in sentences
/// without a full stop.
///
/// # Errors
/// A line is not one of Abaqus or CalculiX. The file has no cells, or solids of other kinds. A set has members that do
/// not exist. Errors name the line.
pub fn read<const D: usize>(path: &Path, bytes: &[u8]) -> Result<(Mesh<D>, Vec<String>)> {
    let reader = Reader::read(path, bytes)?;
    let help = "an input file of Abaqus or CalculiX has them under *NODE and *ELEMENT";
    if reader.model.nodes.is_empty() || reader.model.elements.is_empty() {
        return Err(Error::mesh(path, None, "this file has no nodes or no elements").help(help));
    }
    let groups = GroupBuilder::new(&reader.model, &reader.lines, D)?;
    groups.check_nodes()?;
    if !groups.list.iter().any(|group| group.dimension >= D) {
        let types: Vec<&str> = groups.left_out.elements.keys().map(String::as_str).collect();
        let message = format!("this file has no cells of bodies in dimension {D}, only {}", types.join(", "));
        let help = if D == 3 { "for plane elements set `dimension = 2`" } else { help };
        return Err(Error::mesh(path, None, message).help(help));
    }
    let mesh = build(&reader.model, &groups.list);
    let mesh = mesh.map_err(|ScanError { what, help }| Error::mesh(path, None, what).help(help))?;
    Ok((mesh.finish(path)?, notes(path, &reader, &groups.left_out)))
}

/// Give a mesh the nodes, groups and elements. An element of several groups is added to each of them.
fn build<const D: usize>(
    model: &AbaqusModel,
    groups: &[ElementGroup],
) -> std::result::Result<MeshBuilder<D>, ScanError> {
    let mut mesh = MeshBuilder::new(MeshProducer::Other);
    let tagged = || (1..).zip(groups);
    tagged().try_for_each(|(tag, group)| mesh.name(group.dimension, tag, &group.name))?;
    model.nodes.iter().try_for_each(|(tag, node)| mesh.node(*tag, node.x))?;
    mesh.number_nodes()?;
    for (tag, ElementGroup { dimension, elements, points, .. }) in tagged() {
        let own = [mesh.group(*dimension, tag)?];
        let mut add = |number: u64, kind: i32, nodes: &[u64]| {
            let kind = kind_of(kind)?;
            mesh.check_type(kind, &own)?;
            mesh.element(kind, number, nodes, &own)
        };
        for (number, (kind, nodes)) in elements {
            add(*number, simplex::ElementType::number(kind.shape, kind.nodes()), nodes)?;
        }
        points.iter().try_for_each(|node| add(*node, simplex::POINTS, &[*node]))?;
    }
    Ok(mesh)
}

/// Return what was left out, or is not as the user may think.
fn notes(path: &Path, reader: &Reader, left_out: &LeftOut) -> Vec<String> {
    let Reader { twice, longer, transforms, lines, .. } = reader;
    let LeftOut { elements, faces, nodes, renamed } = left_out;
    let types: Vec<String> = elements.iter().map(|(name, count)| format!("{count} {name}")).collect();
    let first = twice.first().map_or(String::new(), |first| {
        let [old, new] = first.lines.map(|at| lines.show(at));
        format!("node {} in {old} and {new}", first.tag)
    });
    let (types, renamed, double) = (types.join(", "), renamed.join(", "), twice.len());
    [
        (!types.is_empty(), format!("elements that are no solids are left out: {types}")),
        (*faces > 0, format!("surfaces lose {faces} faces of elements that are left out")),
        (*nodes > 0, format!("node sets lose {nodes} nodes that belong to no solid")),
        (double > 0, format!("{double} nodes stand twice with different coordinates, and the later ones count, as in CalculiX: {first}")),
        (*longer > 0, format!("{longer} elements have more nodes than their type, and the first ones count, as in CalculiX")),
        (!renamed.is_empty(), format!("names of element sets are taken: {renamed}")),
        (*transforms > 0, format!("{transforms} *TRANSFORM are skipped: supports and loads of the scene are along x, y and z")),
    ]
    .into_iter()
    .filter_map(|(is_so, note)| is_so.then(|| format!("{}: {note}", path.display())))
    .collect()
}

struct ElementGroup {
    dimension: usize,
    name: String,
    /// Cells, facets and edges, each with the number of its element.
    elements: Vec<(u64, TypedNodes)>,
    /// Nodes, if it is a group of points.
    points: Vec<u64>,
}

/// What was left out, or has another name.
#[derive(Default)]
struct LeftOut {
    /// Number of elements by their type.
    elements: BTreeMap<String, usize>,
    /// Faces in surfaces that belong to elements that were left out.
    faces: usize,
    /// Nodes in sets that belong to no cell.
    nodes: usize,
    /// New names of surfaces.
    renamed: Vec<String>,
}

struct GroupBuilder<'a> {
    model: &'a AbaqusModel,
    lines: &'a LineReader,
    dimension: usize,
    faces: CellFaces<'a>,
    list: Vec<ElementGroup>,
    left_out: LeftOut,
}

/// Families of elements without stiffness of their own, which Gmsh and others write for surfaces and curves.
const MARKERS: [&str; 5] = ["T3D", "T2D", "CPS", "CPE", "SFM3D"];

impl<'a> GroupBuilder<'a> {
    /// Make the groups for a scene of this dimension.
    ///
    /// # Errors
    /// A set or surface has a member that does not exist.
    fn new(model: &'a AbaqusModel, lines: &'a LineReader, dimension: usize) -> Result<Self> {
        let lower = || {
            model.elements.values().filter_map(|element| element.kind).filter(|kind| kind.shape.dimension < dimension)
        };
        let is_free = |surface: &model::AbaqusSurface| {
            surface.faces.iter().any(|(_, face)| *face == ElementFace::Free)
                || surface.of_sets.iter().any(|(_, face)| *face == ElementFace::Free)
        };
        let faces = if lower().next().is_some() || model.surfaces.values().any(is_free) {
            CellFaces::new(model, dimension, lower().any(|kind| kind.shape.dimension == 1))
        } else {
            CellFaces::new(model, 0, false)
        };
        let mut groups = Self { model, lines, dimension, faces, list: Vec::new(), left_out: LeftOut::default() };
        groups.element_sets()?;
        groups.unnamed();
        groups.surfaces()?;
        groups.facets_of_sets()?;
        groups.node_sets()?;
        groups.count_left_out();
        Ok(groups)
    }

    /// Return the kind of an element if it is a cell. In a plane scene solids are, too: the reader of the mesh refuses
    /// them.
    fn cell(&self, element: &AbaqusElement) -> Option<AbaqusType> {
        element.kind.filter(|kind| kind.shape.dimension >= self.dimension)
    }

    /// Return the face or edge of a cell that an element of lower dimension lies on.
    fn under(&self, element: &AbaqusElement) -> Option<TypedNodes> {
        let kind = element.kind.filter(|kind| kind.shape.dimension < self.dimension)?;
        self.faces.under(kind, &element.nodes)
    }

    fn members(&self, name: &'a str) -> Result<BTreeSet<u64>> {
        members(&self.model.element_sets, name, &self.model.elements)
            .map_err(|missing| self.missing(missing, "an element"))
    }

    fn missing(&self, MissingMember { set, tag }: MissingMember, what: &str) -> crate::error::Error {
        let message = format!("`{}` has {what} {tag}, which is not there", set.label.spelling);
        self.lines.refuse(set.label.at, message)
    }

    /// Make a group of the cells of each element set.
    fn element_sets(&mut self) -> Result<()> {
        for name in self.model.element_sets.keys() {
            let tags = self.members(name)?;
            self.list.extend(self.cells(name, tags.iter()));
        }
        Ok(())
    }

    /// Return the group of the cells with these numbers, if there are any.
    fn cells<'t>(&self, name: &str, tags: impl Iterator<Item = &'t u64>) -> Option<ElementGroup> {
        let cell = |&tag: &u64| {
            let element = &self.model.elements[&tag];
            self.cell(element).map(|kind| (tag, (kind, kind.in_gmsh_order(&element.nodes))))
        };
        of_highest(name, tags.filter_map(cell))
    }

    /// Make a group of the cells in no element set. It has the name of a section without a set, or else `solids`.
    fn unnamed(&mut self) {
        let named: HashSet<u64> = self.list.iter().flat_map(|group| &group.elements).map(|(tag, _)| *tag).collect();
        let rest: Vec<u64> = self.model.elements.keys().copied().filter(|tag| !named.contains(tag)).collect();
        let section = self.model.sections.iter().find(|name| !self.model.element_sets.contains_key(*name));
        let group = self.cells(section.map_or("solids", String::as_str), rest.iter());
        group.into_iter().for_each(|group| self.add(group, "elements"));
    }

    /// Make a group of the faces of each surface.
    fn surfaces(&mut self) -> Result<()> {
        for (name, surface) in &self.model.surfaces {
            let mut faces = surface.faces.clone();
            for (set, face) in &surface.of_sets {
                faces.extend(self.members(set)?.into_iter().map(|tag| (tag, *face)));
            }
            let mut group = ElementGroup {
                dimension: self.dimension - 1,
                name: name.clone(),
                elements: Vec::new(),
                points: Vec::new(),
            };
            for (tag, face) in faces {
                let spelling = &surface.label.spelling;
                let refuse = |message: String| self.lines.refuse(surface.label.at, message);
                let element = self.model.elements.get(&tag);
                let element = element
                    .ok_or_else(|| refuse(format!("`{spelling}` has a face of element {tag}, which is not there")))?;
                let pieces = match (self.cell(element), face) {
                    (Some(_), ElementFace::Free) => self.faces.free(tag),
                    (Some(kind), ElementFace::Number(number)) => {
                        let piece = kind.face(&element.nodes, number);
                        vec![piece.ok_or_else(|| {
                            refuse(format!("element {tag} in `{spelling}` has no face S{}", number + 1))
                        })?]
                    }
                    (Some(_), ElementFace::Itself) => {
                        return Err(refuse(format!(
                            "element {tag} in `{spelling}` is no shell with sides SPOS and SNEG"
                        )));
                    }
                    (None, _) => self.under(element).into_iter().collect(),
                };
                self.left_out.faces += usize::from(pieces.is_empty() && face != ElementFace::Free);
                group.elements.extend(pieces.into_iter().map(|piece| (tag, piece)));
            }
            self.add(group, "surface");
        }
        Ok(())
    }

    /// Make a group of the facets, or else of the edges, that the elements of each set lie on, where the set has no
    /// cells.
    fn facets_of_sets(&mut self) -> Result<()> {
        for name in self.model.element_sets.keys() {
            let tags = self.members(name)?;
            let elements = || tags.iter().map(|tag| (*tag, &self.model.elements[tag]));
            if !elements().any(|(_, element)| self.cell(element).is_some()) {
                let group = of_highest(name, elements().filter_map(|(tag, element)| Some((tag, self.under(element)?))));
                group.into_iter().for_each(|group| self.add(group, "elements"));
            }
        }
        Ok(())
    }

    /// Make a group of the nodes of each node set that belong to cells.
    fn node_sets(&mut self) -> Result<()> {
        let cells = self.model.elements.values().filter(|element| self.cell(element).is_some());
        let used: HashSet<u64> = cells.flat_map(|element| &element.nodes).copied().collect();
        for name in self.model.node_sets.keys() {
            let all = members(&self.model.node_sets, name, &self.model.nodes);
            let all = all.map_err(|missing| self.missing(missing, "a node"))?;
            let points: Vec<u64> = all.iter().copied().filter(|node| used.contains(node)).collect();
            self.left_out.nodes += all.len() - points.len();
            self.add(ElementGroup { dimension: 0, name: name.clone(), elements: Vec::new(), points }, "nodes");
        }
        Ok(())
    }

    /// Add a group without repeated elements. If another group has its name, it gets a suffix.
    fn add(&mut self, mut group: ElementGroup, suffix: &str) {
        let mut seen = HashSet::new();
        group.elements.retain(|(_, piece)| seen.insert(sorted(piece)));
        if group.elements.is_empty() && group.points.is_empty() {
            return;
        }
        let namesake = self.list.iter().find(|other| other.name == group.name);
        if let Some(other) = namesake {
            let is_same = other.elements.len() == seen.len()
                && other.elements.iter().all(|(_, piece)| seen.contains(&sorted(piece)));
            if is_same && other.dimension == group.dimension {
                return;
            }
            let name = format!("{}_{suffix}", group.name);
            if suffix != "nodes" {
                self.left_out.renamed.push(format!("the surface `{}` is `{name}` here", group.name));
            }
            group.name = name;
        }
        self.list.push(group);
    }

    /// Count the elements that are neither cells nor mark surfaces.
    fn count_left_out(&mut self) {
        let mut counts: BTreeMap<String, usize> = BTreeMap::new();
        for element in self.model.elements.values().filter(|element| self.cell(element).is_none()) {
            let is_marker = MARKERS.iter().any(|family| element.name.starts_with(family));
            if !is_marker || self.under(element).is_none() {
                *counts.entry(element.name.to_string()).or_default() += 1;
            }
        }
        self.left_out.elements = counts;
    }

    /// Refuse cells with nodes that do not exist.
    ///
    /// # Errors
    /// There is one. The error names its line.
    fn check_nodes(&self) -> Result<()> {
        for (tag, element) in self.model.elements.iter().filter(|(_, element)| self.cell(element).is_some()) {
            if let Some(node) = element.nodes.iter().find(|node| !self.model.nodes.contains_key(node)) {
                let message = format!("element {tag} has the node {node}, which is not there");
                return Err(self.lines.refuse(element.at, message));
            }
        }
        Ok(())
    }
}

/// Return the group of the pieces of the highest dimension, if there are any.
fn of_highest(name: &str, pieces: impl Iterator<Item = (u64, TypedNodes)>) -> Option<ElementGroup> {
    let mut of_dimension: BTreeMap<usize, Vec<(u64, TypedNodes)>> = BTreeMap::new();
    pieces.for_each(|piece| of_dimension.entry(piece.1.0.shape.dimension).or_default().push(piece));
    let (dimension, elements) = of_dimension.pop_last()?;
    Some(ElementGroup { dimension, name: name.to_owned(), elements, points: Vec::new() })
}

/// Return the corners of a piece in ascending order.
fn sorted((kind, nodes): &TypedNodes) -> Vec<u64> {
    let mut corners = nodes[..kind.shape.corners].to_vec();
    corners.sort_unstable();
    corners
}

/// A facet or edge in the form of a mesh: its kind and nodes, in the order of Gmsh.
type TypedNodes = (AbaqusType, Vec<u64>);

/// Corners in ascending order, with zeros before them.
type Corners = [u64; 4];

/// A face of a cell.
struct CellFace {
    cell: u64,
    face: usize,
    /// Number of cells that have the face.
    cells: usize,
}

/// The faces of all cells, and in space their edges where these are asked for.
struct CellFaces<'a> {
    model: &'a AbaqusModel,
    places: HashMap<Corners, CellFace>,
    edges: HashMap<Corners, Vec<u64>>,
}

impl<'a> CellFaces<'a> {
    /// Collect the faces of the cells of a dimension. Edges are collected in space if `with_edges`.
    fn new(model: &'a AbaqusModel, dimension: usize, with_edges: bool) -> Self {
        let mut faces = Self { model, places: HashMap::new(), edges: HashMap::new() };
        for (&cell, element) in &model.elements {
            let Some(kind) = element.kind.filter(|kind| kind.shape.dimension == dimension) else { continue };
            for face in 0..kind.own.faces.len() {
                let Some((piece, nodes)) = kind.face(&element.nodes, face) else { continue };
                let key = corners(&nodes[..piece.shape.corners]);
                faces.places.entry(key).or_insert(CellFace { cell, face, cells: 0 }).cells += 1;
            }
            if with_edges && dimension == 3 {
                let edges = kind.edges(&element.nodes);
                faces.edges.extend(edges.into_iter().map(|nodes| (corners(&nodes[..2]), nodes)));
            }
        }
        faces
    }

    /// Return the faces of a cell that no other cell has.
    fn free(&self, cell: u64) -> Vec<TypedNodes> {
        let Some((kind, element)) = self.model.elements.get(&cell).and_then(|element| Some((element.kind?, element)))
        else {
            return Vec::new();
        };
        let faces = (0..kind.own.faces.len()).filter_map(|face| kind.face(&element.nodes, face));
        let is_free = |(piece, nodes): &TypedNodes| {
            self.places.get(&corners(&nodes[..piece.shape.corners])).is_some_and(|place| place.cells == 1)
        };
        faces.filter(is_free).collect()
    }

    /// Return the face or edge of a cell that an element of lower dimension lies on, if there is one. Its nodes are
    /// those of the cell, which may have middle nodes that the element does not have.
    fn under(&self, kind: AbaqusType, nodes: &[u64]) -> Option<TypedNodes> {
        match nodes {
            // Programs do not agree on the place of the middle node of a line.
            [a, b, c, ..] if kind.shape.dimension == 1 && kind.is_quadratic => {
                let ends = [([a, b], c), ([a, c], b), ([b, c], a)];
                ends.into_iter().find_map(|([a, b], middle)| {
                    self.piece(corners(&[*a, *b])).filter(|(_, nodes)| nodes.get(2) == Some(middle))
                })
            }
            _ => self.piece(corners(&nodes[..kind.shape.corners])),
        }
    }

    fn piece(&self, key: Corners) -> Option<TypedNodes> {
        if let Some(nodes) = self.edges.get(&key) {
            return AbaqusType::of(1, 2, nodes.len() == 3).map(|kind| (kind, nodes.clone()));
        }
        let place = self.places.get(&key)?;
        let element = &self.model.elements[&place.cell];
        element.kind?.face(&element.nodes, place.face)
    }
}

fn corners(nodes: &[u64]) -> Corners {
    let mut key = [0; 4];
    key.iter_mut().zip(nodes).for_each(|(key, node)| *key = *node);
    key.sort_unstable();
    key
}
