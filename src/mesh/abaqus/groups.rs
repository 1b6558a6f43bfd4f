//! From the sets and surfaces of an input file to groups of cells, facets, edges and points.

use super::faces::{Faces, Piece};
use super::kinds::Kind;
use super::lines::Lines;
use super::model::{Element, Face, Missing, Model, members};
use crate::error::Result;
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// A group.
pub struct Group {
    pub dimension: usize,
    pub name: String,
    /// Cells, facets and edges, each with the number of its element.
    pub elements: Vec<(u64, Piece)>,
    /// Nodes, if it is a group of points.
    pub points: Vec<u64>,
}

/// What was left out, or has another name.
#[derive(Default)]
pub struct LeftOut {
    /// Number of elements by their type.
    pub elements: BTreeMap<String, usize>,
    /// Faces in surfaces that belong to elements that were left out.
    pub faces: usize,
    /// Nodes in sets that belong to no cell.
    pub nodes: usize,
    /// New names of surfaces.
    pub renamed: Vec<String>,
}

/// The groups of a file.
pub struct Groups<'a> {
    model: &'a Model,
    lines: &'a Lines,
    dimension: usize,
    faces: Faces<'a>,
    pub list: Vec<Group>,
    pub left_out: LeftOut,
}

/// Families of elements without stiffness of their own, which Gmsh and others write for surfaces and curves.
const MARKERS: [&str; 5] = ["T3D", "T2D", "CPS", "CPE", "SFM3D"];

impl<'a> Groups<'a> {
    /// Make the groups for a scene of this dimension.
    ///
    /// # Errors
    /// A set or surface has a member that does not exist.
    pub fn new(model: &'a Model, lines: &'a Lines, dimension: usize) -> Result<Self> {
        let lower = || {
            model.elements.values().filter_map(|element| element.kind).filter(|kind| kind.shape.dimension < dimension)
        };
        let is_free = |surface: &super::model::Surface| {
            surface.faces.iter().any(|(_, face)| *face == Face::Free)
                || surface.of_sets.iter().any(|(_, face)| *face == Face::Free)
        };
        let faces = match lower().next().is_some() || model.surfaces.values().any(is_free) {
            true => Faces::new(model, dimension, lower().any(|kind| kind.shape.dimension == 1)),
            false => Faces::new(model, 0, false),
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

    /// Return the kind of an element if it is a cell. In a plane scene solids are, too: the reader of the mesh refuses them.
    fn cell(&self, element: &Element) -> Option<Kind> {
        element.kind.filter(|kind| kind.shape.dimension >= self.dimension)
    }

    /// Return the face or edge of a cell that an element of lower dimension lies on.
    fn under(&self, element: &Element) -> Option<Piece> {
        let kind = element.kind.filter(|kind| kind.shape.dimension < self.dimension)?;
        self.faces.under(kind, &element.nodes)
    }

    fn members(&self, name: &'a str) -> Result<BTreeSet<u64>> {
        members(&self.model.element_sets, name, &self.model.elements)
            .map_err(|missing| self.missing(missing, "an element"))
    }

    fn missing(&self, Missing { set, tag }: Missing, what: &str) -> crate::error::Error {
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
    fn cells<'t>(&self, name: &str, tags: impl Iterator<Item = &'t u64>) -> Option<Group> {
        let mut of_dimension: BTreeMap<usize, Vec<(u64, Piece)>> = BTreeMap::new();
        for &tag in tags {
            let element = &self.model.elements[&tag];
            if let Some(kind) = self.cell(element) {
                let nodes = kind.in_gmsh_order(&element.nodes);
                of_dimension.entry(kind.shape.dimension).or_default().push((tag, (kind, nodes)));
            }
        }
        let (dimension, elements) = of_dimension.pop_last()?;
        Some(Group { dimension, name: name.to_owned(), elements, points: Vec::new() })
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
            let mut group =
                Group { dimension: self.dimension - 1, name: name.clone(), elements: Vec::new(), points: Vec::new() };
            for (tag, face) in faces {
                let spelling = &surface.label.spelling;
                let refuse = |message: String| self.lines.refuse(surface.label.at, message);
                let element = self.model.elements.get(&tag);
                let element = element
                    .ok_or_else(|| refuse(format!("`{spelling}` has a face of element {tag}, which is not there")))?;
                let pieces = match (self.cell(element), face) {
                    (Some(_), Face::Free) => self.faces.free(tag),
                    (Some(kind), Face::Number(number)) => {
                        let piece = kind.face(&element.nodes, number);
                        vec![piece.ok_or_else(|| {
                            refuse(format!("element {tag} in `{spelling}` has no face S{}", number + 1))
                        })?]
                    }
                    (Some(_), Face::Itself) => {
                        return Err(refuse(format!(
                            "element {tag} in `{spelling}` is no shell with sides SPOS and SNEG"
                        )));
                    }
                    (None, _) => self.under(element).into_iter().collect(),
                };
                self.left_out.faces += usize::from(pieces.is_empty() && face != Face::Free);
                group.elements.extend(pieces.into_iter().map(|piece| (tag, piece)));
            }
            self.add(group, "surface");
        }
        Ok(())
    }

    /// Make a group of the facets, or else of the edges, that the elements of each set lie on, where the set has no cells.
    fn facets_of_sets(&mut self) -> Result<()> {
        for name in self.model.element_sets.keys() {
            let mut of_dimension: BTreeMap<usize, Vec<(u64, Piece)>> = BTreeMap::new();
            for tag in self.members(name)? {
                let element = &self.model.elements[&tag];
                if self.cell(element).is_some() {
                    of_dimension.clear();
                    break;
                }
                if let Some(piece) = self.under(element) {
                    of_dimension.entry(piece.0.shape.dimension).or_default().push((tag, piece));
                }
            }
            if let Some((dimension, elements)) = of_dimension.pop_last() {
                self.add(Group { dimension, name: name.clone(), elements, points: Vec::new() }, "elements");
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
            self.add(Group { dimension: 0, name: name.clone(), elements: Vec::new(), points }, "nodes");
        }
        Ok(())
    }

    /// Add a group without repeated elements. If another group has its name, it gets a suffix.
    fn add(&mut self, mut group: Group, suffix: &str) {
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
    pub fn check_nodes(&self) -> Result<()> {
        for (tag, element) in self.model.elements.iter().filter(|(_, element)| self.cell(element).is_some()) {
            if let Some(node) = element.nodes.iter().find(|node| !self.model.nodes.contains_key(node)) {
                let message = format!("element {tag} has the node {node}, which is not there");
                return Err(self.lines.refuse(element.at, message));
            }
        }
        Ok(())
    }
}

/// Return the corners of a piece in ascending order.
fn sorted((kind, nodes): &Piece) -> Vec<u64> {
    let mut corners = nodes[..kind.shape.corners].to_vec();
    corners.sort_unstable();
    corners
}
