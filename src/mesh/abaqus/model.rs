//! The contents of an input file: nodes, elements, and named sets of them.

use super::kinds::Kind;
use super::lines::At;
use crate::mesh::frame::Frame;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::rc::Rc;

/// A node.
#[derive(Clone, Copy)]
pub struct Node {
    /// Coordinates (x, y, z).
    pub x: [f64; 3],
    /// Its line.
    pub at: At,
}

/// An element.
#[derive(Clone)]
pub struct Element {
    /// Its type, as the file spells it.
    pub name: Rc<str>,
    /// Its kind; none for elements that have no place in a mesh.
    pub kind: Option<Kind>,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
    /// Its line.
    pub at: At,
}

/// A face of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Face {
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
    pub at: At,
}

/// A set of nodes or elements.
#[derive(Clone, Default)]
pub struct Set {
    pub label: Label,
    members: BTreeSet<u64>,
    /// First and last number, and step. Numbers between them that do not exist are no members.
    ranges: BTreeSet<[u64; 3]>,
    /// Names of sets whose members belong to this one.
    sets: BTreeSet<String>,
}

impl Set {
    /// Make an empty set.
    pub fn new(label: Label) -> Self {
        Self { label, ..Self::default() }
    }

    /// Add a member, which must exist.
    pub fn add(&mut self, tag: u64) {
        self.members.insert(tag);
    }

    /// Add all members that exist from `first` to `last`.
    pub fn add_range(&mut self, first: u64, last: u64, step: u64) {
        self.ranges.insert([first, last, step]);
    }

    /// Add the members of another set.
    pub fn add_set(&mut self, name: String) {
        self.sets.insert(name);
    }
}

/// A surface: faces of elements, and of the elements of sets.
#[derive(Clone, Default)]
pub struct Surface {
    pub label: Label,
    /// Faces of single elements.
    pub faces: BTreeSet<(u64, Face)>,
    /// Faces of all elements of sets.
    pub of_sets: BTreeSet<(String, Face)>,
}

/// The contents of a file, or of a part.
#[derive(Clone, Default)]
pub struct Model {
    pub nodes: BTreeMap<u64, Node>,
    pub elements: BTreeMap<u64, Element>,
    pub element_sets: BTreeMap<String, Set>,
    pub node_sets: BTreeMap<String, Set>,
    pub surfaces: BTreeMap<String, Surface>,
    /// Names of the element sets of `*SOLID SECTION`.
    pub sections: BTreeSet<String>,
}

/// A member of a set that does not exist.
pub struct Missing<'a> {
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
) -> Result<BTreeSet<u64>, Missing<'a>> {
    let (mut found, mut seen, mut rest) = (BTreeSet::new(), BTreeSet::new(), vec![name]);
    while let Some(name) = rest.pop() {
        let Some(set) = sets.get(name).filter(|_| seen.insert(name)) else { continue };
        if let Some(&tag) = set.members.iter().find(|tag| !known.contains_key(tag)) {
            return Err(Missing { set, tag });
        }
        found.extend(&set.members);
        for &[first, last, step] in &set.ranges {
            found.extend(range(known, first..=last).filter(|tag| (tag - first).is_multiple_of(step)));
        }
        rest.extend(set.sets.iter().map(String::as_str));
    }
    Ok(found)
}

/// Return the keys of a map in a range, which is empty if it ends before it begins.
fn range<T>(known: &BTreeMap<u64, T>, range: RangeInclusive<u64>) -> impl Iterator<Item = u64> + '_ {
    let is_empty = range.is_empty();
    let range = if is_empty { 0..=0 } else { range };
    known.range(range).map(|(tag, _)| *tag).filter(move |_| !is_empty)
}

impl Model {
    /// Return the largest number of a node or element.
    pub fn largest(&self) -> u64 {
        let last = [self.nodes.keys().next_back(), self.elements.keys().next_back()];
        last.into_iter().flatten().copied().max().unwrap_or(0)
    }

    /// Add a copy of a part. Its numbers become larger by `shift`, and its names begin with `prefix`.
    pub fn add(&mut self, part: &Model, prefix: &str, shift: u64) {
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
            (moved(tag), Element { nodes: element.nodes.iter().map(moved).collect(), ..element.clone() })
        }));
        self.element_sets.extend(part.element_sets.iter().map(|(key, own)| (name(key), set(own))));
        self.node_sets.extend(part.node_sets.iter().map(|(key, own)| (name(key), set(own))));
        self.surfaces.extend(part.surfaces.iter().map(|(key, own)| {
            let faces = own.faces.iter().map(|(tag, face)| (moved(tag), *face)).collect();
            let of_sets = own.of_sets.iter().map(|(set, face)| (name(set), *face)).collect();
            (name(key), Surface { label: label(&own.label), faces, of_sets })
        }));
        self.sections.extend(part.sections.iter().map(name));
    }

    /// Move the nodes with numbers above `shift` by a translation, and then by a rotation about the axis from point `a` to
    /// point `b`, whose angle is in degrees.
    pub fn place(&mut self, shift: u64, translation: [f64; 3], rotation: Option<Rotation>) {
        let frame = Frame::at(translation);
        for node in self.nodes.iter_mut().filter(|(tag, _)| **tag > shift).map(|(_, node)| node) {
            node.x = frame.place(node.x);
            if let Some(rotation) = &rotation {
                node.x = rotation.turned(node.x);
            }
        }
    }
}

/// Return a name in the form that groups have.
pub fn normal(spelling: &str) -> String {
    spelling.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// A rotation about an axis.
pub struct Rotation {
    a: nalgebra::Point3<f64>,
    rotation: nalgebra::Rotation3<f64>,
}

impl Rotation {
    /// Return the rotation about the axis from `a` to `b`, or none if they are one point.
    pub fn new(a: [f64; 3], b: [f64; 3], degrees: f64) -> Option<Self> {
        let axis = nalgebra::Vector3::from(b) - nalgebra::Vector3::from(a);
        let axis = nalgebra::Unit::try_new(axis, 1e-300)?;
        Some(Self { a: a.into(), rotation: nalgebra::Rotation3::from_axis_angle(&axis, degrees.to_radians()) })
    }

    fn turned(&self, x: [f64; 3]) -> [f64; 3] {
        let x = self.a + self.rotation * (nalgebra::Point3::from(x) - self.a);
        [x.x, x.y, x.z]
    }
}
