//! The contents of an input file: nodes, elements with the types of Abaqus and CalculiX, and named sets of them.

use super::lines::SourceLine;
use crate::mesh::simplex::{HEXAHEDRON, LINE, PRISM, PYRAMID, QUADRANGLE, Shape, TETRAHEDRON, TRIANGLE};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// A node.
#[derive(Clone, Copy)]
pub struct AbaqusNode {
    /// Coordinates (x, y, z).
    pub x: [f64; 3],
    /// Its line.
    pub at: SourceLine,
}

/// An element.
#[derive(Clone)]
pub struct AbaqusElement {
    /// Its type, as the file spells it.
    pub name: Rc<str>,
    /// Its kind; none for elements that have no place in a mesh.
    pub kind: Option<AbaqusType>,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
    /// Its line.
    pub at: SourceLine,
}

/// A face of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ElementFace {
    /// The face with this number, counted from 0.
    Number(usize),
    /// The element itself, if it is a shell or membrane.
    Itself,
    /// All faces that belong to no other element.
    Free,
}

/// A name and its first line.
#[derive(Clone, Default)]
pub struct Label {
    /// The name in small letters, before characters that no name can have are replaced.
    pub spelling: String,
    /// The line.
    pub at: SourceLine,
}

/// A set of nodes or elements.
#[derive(Clone, Default)]
pub struct Set {
    pub label: Label,
    /// Members, which must exist.
    pub members: BTreeSet<u64>,
    /// First and last number, and step. Numbers between them that do not exist are no members.
    pub ranges: BTreeSet<[u64; 3]>,
    /// Names of sets whose members belong to this one.
    pub sets: BTreeSet<String>,
}

/// A surface: faces of elements, and of the elements of sets.
#[derive(Clone, Default)]
pub struct AbaqusSurface {
    pub label: Label,
    /// Faces of single elements.
    pub faces: BTreeSet<(u64, ElementFace)>,
    /// Faces of all elements of sets.
    pub of_sets: BTreeSet<(String, ElementFace)>,
}

/// The contents of a file, or of a part.
#[derive(Clone, Default)]
pub struct AbaqusModel {
    pub nodes: BTreeMap<u64, AbaqusNode>,
    pub elements: BTreeMap<u64, AbaqusElement>,
    pub element_sets: BTreeMap<String, Set>,
    pub node_sets: BTreeMap<String, Set>,
    pub surfaces: BTreeMap<String, AbaqusSurface>,
    /// Names of the element sets of `*SOLID SECTION`.
    pub sections: BTreeSet<String>,
}

/// A member of a set that does not exist.
pub struct MissingMember<'a> {
    pub set: &'a Set,
    pub tag: u64,
}

/// Return the members of a set and of all sets within it.
///
/// # Errors
/// A member that the file names by its number does not exist.
pub fn members<'a, T>(
    sets: &'a BTreeMap<String, Set>,
    name: &'a str,
    known: &BTreeMap<u64, T>,
) -> Result<BTreeSet<u64>, MissingMember<'a>> {
    let (mut found, mut seen, mut rest) = (BTreeSet::new(), BTreeSet::new(), vec![name]);
    while let Some(name) = rest.pop() {
        let Some(set) = sets.get(name).filter(|_| seen.insert(name)) else { continue };
        if let Some(&tag) = set.members.iter().find(|tag| !known.contains_key(tag)) {
            return Err(MissingMember { set, tag });
        }
        found.extend(&set.members);
        for &[first, last, step] in &set.ranges {
            let tags = known.range(first..).map(|(tag, _)| *tag).take_while(|tag| *tag <= last);
            found.extend(tags.filter(|tag| (tag - first).is_multiple_of(step)));
        }
        rest.extend(set.sets.iter().map(String::as_str));
    }
    Ok(found)
}

impl AbaqusModel {
    /// Return the largest number of a node or element.
    pub fn largest(&self) -> u64 {
        let last = [self.nodes.keys().next_back(), self.elements.keys().next_back()];
        last.into_iter().flatten().copied().max().unwrap_or(0)
    }

    /// Add a copy of a part. Its numbers become larger by `shift`, and its names begin with `prefix`.
    pub fn add(&mut self, part: &AbaqusModel, prefix: &str, shift: u64) {
        let moved = |tag: &u64| tag.saturating_add(shift);
        let name = |name: &String| format!("{}{name}", normal(prefix));
        let label = |label: &Label| Label { spelling: format!("{prefix}{}", label.spelling), at: label.at };
        let set = |set: &Set| Set {
            label: label(&set.label),
            members: set.members.iter().map(moved).collect(),
            ranges: set.ranges.iter().map(|[first, last, step]| [moved(first), moved(last), *step]).collect(),
            sets: set.sets.iter().map(name).collect(),
        };
        self.nodes.extend(part.nodes.iter().map(|(tag, node)| (moved(tag), *node)));
        self.elements.extend(part.elements.iter().map(|(tag, element)| {
            (moved(tag), AbaqusElement { nodes: element.nodes.iter().map(moved).collect(), ..element.clone() })
        }));
        self.element_sets.extend(part.element_sets.iter().map(|(key, own)| (name(key), set(own))));
        self.node_sets.extend(part.node_sets.iter().map(|(key, own)| (name(key), set(own))));
        self.surfaces.extend(part.surfaces.iter().map(|(key, own)| {
            let faces = own.faces.iter().map(|(tag, face)| (moved(tag), *face)).collect();
            let of_sets = own.of_sets.iter().map(|(set, face)| (name(set), *face)).collect();
            (name(key), AbaqusSurface { label: label(&own.label), faces, of_sets })
        }));
        self.sections.extend(part.sections.iter().map(name));
    }

    /// Move the nodes with numbers above `shift`.
    pub fn place(&mut self, shift: u64, moved: impl Fn([f64; 3]) -> [f64; 3]) {
        for (_, node) in self.nodes.iter_mut().filter(|(tag, _)| **tag > shift) {
            node.x = moved(node.x);
        }
    }
}

/// Return a name in the form that groups have.
pub fn normal(spelling: &str) -> String {
    spelling.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// The numbering of a shape by Abaqus. Corners are those of Gmsh.
#[derive(Debug, PartialEq, Eq)]
pub struct AbaqusNumbering {
    shape: &'static Shape,
    /// Corners of the faces S1, S2, ... In the plane these are edges.
    pub faces: &'static [&'static [usize]],
    /// Ends of the edges in the order of their middle nodes.
    edges: &'static [[usize; 2]],
}

static NUMBERINGS: [AbaqusNumbering; 7] = [
    AbaqusNumbering { shape: &LINE, faces: &[], edges: &[[0, 1]] },
    AbaqusNumbering { shape: &TRIANGLE, faces: &[&[0, 1], &[1, 2], &[2, 0]], edges: &[[0, 1], [1, 2], [2, 0]] },
    AbaqusNumbering {
        shape: &QUADRANGLE,
        faces: &[&[0, 1], &[1, 2], &[2, 3], &[3, 0]],
        edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
    },
    AbaqusNumbering {
        shape: &TETRAHEDRON,
        faces: &[&[0, 1, 2], &[0, 3, 1], &[1, 3, 2], &[2, 3, 0]],
        edges: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
    },
    AbaqusNumbering {
        shape: &PYRAMID,
        faces: &[&[0, 1, 2, 3], &[0, 4, 1], &[1, 4, 2], &[2, 4, 3], &[3, 4, 0]],
        edges: &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
    },
    AbaqusNumbering {
        shape: &PRISM,
        faces: &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]],
        edges: &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
    },
    AbaqusNumbering {
        shape: &HEXAHEDRON,
        faces: &[&[0, 1, 2, 3], &[4, 7, 6, 5], &[0, 4, 5, 1], &[1, 5, 6, 2], &[2, 6, 7, 3], &[3, 7, 4, 0]],
        edges: &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]],
    },
];

/// A shape with or without middle nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AbaqusType {
    /// The shape.
    pub shape: &'static Shape,
    /// How Abaqus numbers it.
    pub own: &'static AbaqusNumbering,
    /// Whether there is a node in the middle of each edge.
    pub is_quadratic: bool,
}

/// What the program makes of a type of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementUse {
    /// Elements of this kind are cells in their own dimension, and facets or edges in a higher one.
    Mesh(AbaqusType),
    /// Elements without a place in the mesh, such as springs.
    LeftOut,
    /// Solids that cannot be read. Without them the body would have holes.
    Refused,
}

impl AbaqusType {
    /// Return the kind with this dimension and number of corners.
    pub fn of(dimension: usize, corners: usize, is_quadratic: bool) -> Option<AbaqusType> {
        let own = NUMBERINGS.iter().find(|own| own.shape.dimension == dimension && own.shape.corners == corners)?;
        Some(AbaqusType { shape: own.shape, own, is_quadratic })
    }

    /// Return the number of nodes.
    pub fn nodes(self) -> usize {
        self.shape.corners + if self.is_quadratic { self.shape.edges.len() } else { 0 }
    }

    /// Return the index of the middle node of an edge in an element of Abaqus.
    fn middle(self, a: usize, b: usize) -> Option<usize> {
        let at = self.own.edges.iter().position(|&edge| edge == [a, b] || edge == [b, a])?;
        Some(self.shape.corners + at)
    }

    /// Return the nodes of an element in the order of Gmsh.
    pub fn in_gmsh_order(self, nodes: &[u64]) -> Vec<u64> {
        let mut ordered = nodes[..self.shape.corners].to_vec();
        if self.is_quadratic {
            let middle = |edge: &[usize; 2]| self.middle(edge[0], edge[1]).map(|at| nodes[at]);
            ordered.extend(self.shape.edges.iter().filter_map(middle));
        }
        ordered
    }

    /// Return a face of an element, numbered from 0: its kind, and its nodes in the order of Gmsh, corners first.
    pub fn face(self, nodes: &[u64], number: usize) -> Option<(AbaqusType, Vec<u64>)> {
        let corners = *self.own.faces.get(number)?;
        let kind = AbaqusType::of(self.shape.dimension - 1, corners.len(), self.is_quadratic)?;
        let mut face: Vec<u64> = corners.iter().map(|&at| nodes[at]).collect();
        if self.is_quadratic {
            let ends = kind.shape.edges.iter().map(|edge| edge.map(|at| corners[at]));
            face.extend(ends.filter_map(|[a, b]| self.middle(a, b)).map(|at| nodes[at]));
        }
        Some((kind, face))
    }

    /// Return the edges of an element: two ends, and the middle node if there is one.
    pub fn edges(self, nodes: &[u64]) -> Vec<Vec<u64>> {
        let edge = |(at, [a, b]): (usize, &[usize; 2])| {
            let middle = self.is_quadratic.then(|| nodes[self.shape.corners + at]);
            [nodes[*a], nodes[*b]].into_iter().chain(middle).collect()
        };
        self.own.edges.iter().enumerate().map(edge).collect()
    }
}

/// Families of elements of dimension 1 to 3 by the beginning of their names. The number of nodes follows.
const FAMILIES: [&str; 3] =
    ["T2D T3D R2D RAX B2 B3 SAX MAX", "CPS CPE CPEG CAX CGAX DC2D DCAX S DS STRI M3D SFM3D R3D", "C3D DC3D SC"];

impl ElementUse {
    /// Return what the elements of a type are.
    pub fn of(name: &str) -> ElementUse {
        let name = name.to_ascii_uppercase();
        let begins =
            |family: &str| name.strip_prefix(family).filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        let families =
            (1..).zip(FAMILIES).flat_map(|(dimension, all)| all.split(' ').map(move |family| (family, dimension)));
        let matching = families.filter_map(|(family, dimension)| Some((family, dimension, begins(family)?)));
        let Some((family, dimension, rest)) = matching.max_by_key(|(family, ..)| family.len()) else {
            return ElementUse::LeftOut;
        };
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        let nodes = match (family, digits.as_str()) {
            // Beams are named by the order of their interpolation, STRI65 by nodes and dofs.
            ("B2" | "B3" | "SAX" | "MAX", "2") => 3,
            ("B2" | "B3" | "SAX" | "MAX", _) => 2,
            ("STRI", "65") => 6,
            (_, digits) => digits.parse().unwrap_or(0),
        };
        let kinds = |is_quadratic| (2..=8).filter_map(move |corners| AbaqusType::of(dimension, corners, is_quadratic));
        match kinds(false).chain(kinds(true)).find(|kind| kind.nodes() == nodes) {
            Some(kind) => ElementUse::Mesh(kind),
            None if dimension == 3 || name.starts_with('C') => ElementUse::Refused,
            None => ElementUse::LeftOut,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::simplex;

    #[test]
    fn names_give_shapes() {
        let of = |name: &str| match ElementUse::of(name) {
            ElementUse::Mesh(kind) => (kind.shape.dimension, simplex::ElementType::number(kind.shape, kind.nodes())),
            ElementUse::LeftOut => (0, 0),
            ElementUse::Refused => (0, -1),
        };
        for (names, expected) in [
            ("C3D4 c3d4h DC3D4", (3, 4)),
            ("C3D10 C3D10M C3D10I", (3, 11)),
            ("C3D8 C3D8R C3D8I SC8R DC3D8", (3, 5)),
            ("C3D20 C3D20R C3D20RH", (3, 17)),
            ("C3D6 SC6R", (3, 6)),
            ("C3D15", (3, 18)),
            ("C3D5", (3, 7)),
            ("CPS3 CAX3 CPEG3 S3R STRI3 M3D3 R3D3 SFM3D3", (2, 2)),
            ("CPS6M CAX6 S6 STRI65 M3D6", (2, 9)),
            ("CPS4R CPE4H S4R5 R3D4 DS4", (2, 3)),
            ("CPS8R CAX8 S8R", (2, 16)),
            ("T3D2 T2D2 B31 B31H B21 B23 SAX1 R2D2", (1, 1)),
            ("T3D3 B32R B22 SAX2", (1, 8)),
            ("SPRINGA MASS ROTARYI GAPUNI CONN3D2 DASHPOTA D DCOUP3D F3D8R COH3D8 U1 S9R5", (0, 0)),
            ("C3D27 CPS5", (0, -1)),
        ] {
            names.split(' ').for_each(|name| assert_eq!(of(name), expected, "{name}"));
        }
    }

    /// The middle node of an edge has the number 10 a + b for its ends a < b, wherever it stands.
    #[test]
    fn middle_nodes_stay_between_their_ends() {
        for name in ["T3D3", "CPS6", "CPS8", "C3D10", "C3D15", "C3D20"] {
            let ElementUse::Mesh(kind) = ElementUse::of(name) else { panic!("{name}") };
            let shape = kind.shape;
            let number = |a: usize, b: usize| 10 * (a.min(b) as u64 + 1) + a.max(b) as u64 + 1;
            let mut nodes: Vec<u64> = (1..=shape.corners as u64).collect();
            nodes.extend(kind.own.edges.iter().map(|&[a, b]| number(a, b)));
            let ordered = kind.in_gmsh_order(&nodes);
            assert_eq!(ordered.len(), kind.nodes(), "{name}");
            for (middle, &[a, b]) in ordered[shape.corners..].iter().zip(shape.edges) {
                assert_eq!(*middle, number(a, b), "{name}");
            }
            for face in 0..kind.own.faces.len() {
                let (kind, face) = kind.face(&nodes, face).unwrap();
                let corner = |at: usize| face[at] as usize - 1;
                for (middle, &[a, b]) in face[kind.shape.corners..].iter().zip(kind.shape.edges) {
                    assert_eq!(*middle, number(corner(a), corner(b)), "{name}");
                }
            }
        }
    }
}
