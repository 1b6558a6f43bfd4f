//! Gmsh's formats 1 and 2, text and binary, rewritten as 4.1.
//!
//! The old formats give each element its physical group, and the number of an entity of the geometry besides. Format 4.1 gives
//! groups to entities. Here the elements of the same groups become one entity, since other programs write one number for all
//! entities. An element of several groups stands in an old file once for each of them. Elements of one type on the same nodes
//! are therefore one element, which belongs to all of their groups.
//!
//! Files of other programs are handed to the reader in the same form: [`Contents`] writes the binary form of format 4.1.

use super::cursor::{Cursor, ReadSeek};
use super::simplex::ElementType;
use crate::error::{Error, Result};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

/// Return whether bytes begin like a file of format 1 or 2.
pub fn is_old(start: &[u8]) -> bool {
    let version = start.strip_prefix(b"$MeshFormat").map(|rest| rest.trim_ascii_start());
    start.starts_with(b"$NOD") || version.is_some_and(|version| version.starts_with(b"2"))
}

/// Return a file of format 1 or 2 as bytes of format 4.1. `made` tells whether the bytes were made from the file at `path`.
///
/// # Errors
/// The file is not one of these formats, or it is cut short. The error names the line or the byte.
pub fn convert(path: &Path, source: Box<dyn ReadSeek + '_>, made: bool) -> Result<Vec<u8>> {
    let cursor = &mut Cursor::new(path, source, made);
    let mut file = File::default();
    let needed = ["MeshFormat", "PhysicalNames", "Nodes", "NOD", "ParametricNodes", "Elements", "ELM"];
    while let Some((start, section)) = cursor.next_section(&needed)? {
        match section.as_str() {
            "MeshFormat" => read_format(cursor)?,
            "PhysicalNames" => file.read_names(cursor)?,
            "Nodes" | "NOD" => file.read_nodes(cursor)?,
            "Elements" => file.read_elements(cursor)?,
            "ELM" => file.read_first_elements(cursor)?,
            _ => {
                let error = cursor.error_at(start, "nodes with parameters on their surfaces are not read");
                return Err(error.help("save the mesh without them, or in format 4.1"));
            }
        }
        leave(cursor, &section)?;
    }
    if file.contents.elements.is_empty() {
        return Err(
            Error::mesh(path, None, "there are no elements").help("the file was cut short, or nothing was meshed")
        );
    }
    Ok(file.contents.written())
}

/// Leave a section by its closing line. Format 1 has it in capitals.
fn leave(cursor: &mut Cursor, section: &str) -> Result<()> {
    if !matches!(section, "NOD" | "ELM") {
        return cursor.leave();
    }
    let start = cursor.position();
    match !cursor.at_end() && cursor.line()? == format!("$END{section}") {
        true => Ok(()),
        false => Err(cursor.error_at(start, format!("`$END{section}` should stand here"))),
    }
}

/// Read the version and the form of the numbers.
fn read_format(cursor: &mut Cursor) -> Result<()> {
    let start = cursor.position();
    let line = cursor.line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    match words[..] {
        [version, "0", _] if version.starts_with('2') => Ok(()),
        [version, "1", "8"] if version.starts_with('2') => cursor.begin_binary(),
        _ => Err(cursor.error_at(start, "a format such as `2.2 0 8` should stand here")),
    }
}

/// Read the line with the number of entries of a section.
fn count(cursor: &mut Cursor) -> Result<usize> {
    let start = cursor.position();
    cursor.line()?.parse().map_err(|_| cursor.error_at(start, "the number of entries should stand here"))
}

/// Read the number of a node or an element.
fn number(cursor: &mut Cursor) -> Result<u64> {
    let start = cursor.position();
    if !cursor.binary {
        return cursor.size();
    }
    let number = cursor.int()?;
    u64::try_from(number).map_err(|_| cursor.error_at(start, format!("{number} is no number of a node or an element")))
}

/// What has been read of a file.
#[derive(Default)]
struct File {
    contents: Contents,
    /// Index of the element of a type on these nodes, which are sorted.
    known: HashMap<(i32, Vec<u64>), usize>,
}

impl File {
    fn read_names(&mut self, cursor: &mut Cursor) -> Result<()> {
        for _ in 0..count(cursor)? {
            let start = cursor.position();
            let line = cursor.line()?;
            let Some((numbers, name)) = line.split_once('"') else {
                return Err(cursor.error_at(start, "dimension, tag and \"name\" of a physical group should stand here"));
            };
            let numbers: Vec<&str> = numbers.split_whitespace().collect();
            self.contents.names.push(format!("{} \"{name}", numbers.join(" ")));
        }
        Ok(())
    }

    fn read_nodes(&mut self, cursor: &mut Cursor) -> Result<()> {
        for _ in 0..count(cursor)? {
            cursor.begin();
            let tag = number(cursor)?;
            self.contents.nodes.push((tag, [cursor.real()?, cursor.real()?, cursor.real()?]));
            cursor.end()?;
        }
        Ok(())
    }

    /// Read the elements of format 2. In binary files several elements of a type follow one head.
    fn read_elements(&mut self, cursor: &mut Cursor) -> Result<()> {
        let mut left = count(cursor)?;
        while left > 0 {
            cursor.begin();
            let start = cursor.position();
            if !cursor.binary {
                let element = number(cursor)?;
                let (kind, tags) = (cursor.int()?, cursor.int()?);
                self.read_element(cursor, start, element, kind, tags)?;
                cursor.end()?;
                left -= 1;
                continue;
            }
            let (kind, followers, tags) = (cursor.int()?, cursor.int()?, cursor.int()?);
            let Some(followers) = usize::try_from(followers).ok().filter(|count| (1..=left).contains(count)) else {
                return Err(cursor.error_at(start, format!("{followers} elements follow here, and {left} are left")));
            };
            for _ in 0..followers {
                let element = number(cursor)?;
                self.read_element(cursor, start, element, kind, tags)?;
            }
            left -= followers;
        }
        Ok(())
    }

    /// Read the tags and nodes of an element whose record begins at `start`. The first tag is that of the physical group, the
    /// second one is that of the entity. Partitions follow.
    fn read_element(&mut self, cursor: &mut Cursor, start: usize, element: u64, kind: i32, tags: i32) -> Result<()> {
        let stride = stride(cursor, start, kind)?;
        let mut own = [0; 2];
        for tag in 0..tags {
            let value = cursor.int()?;
            own.iter_mut().skip(tag as usize).take(1).for_each(|own| *own = value);
        }
        let nodes = (0..stride).map(|_| number(cursor)).collect::<Result<_>>()?;
        self.add(element, kind, own, nodes);
        Ok(())
    }

    /// Read the elements of format 1.
    fn read_first_elements(&mut self, cursor: &mut Cursor) -> Result<()> {
        for _ in 0..count(cursor)? {
            cursor.begin();
            let start = cursor.position();
            let element = number(cursor)?;
            let (kind, own, nodes) = (cursor.int()?, [cursor.int()?, cursor.int()?], cursor.size()?);
            let stride = stride(cursor, start, kind)?;
            if nodes != stride as u64 {
                let message = format!("element {element} has {nodes} nodes, and its type {stride}");
                return Err(cursor.error_at(start, message));
            }
            let nodes = (0..stride).map(|_| number(cursor)).collect::<Result<_>>()?;
            cursor.end()?;
            self.add(element, kind, own, nodes);
        }
        Ok(())
    }

    /// Add an element with its physical and elementary tag, or the group to the element that has the same nodes.
    fn add(&mut self, number: u64, kind: i32, [physical, entity]: [i32; 2], nodes: Vec<u64>) {
        let mut key = nodes.clone();
        key.sort_unstable();
        let place = *self.known.entry((kind, key)).or_insert(self.contents.elements.len());
        if place == self.contents.elements.len() {
            self.contents.elements.push(Element { number, kind, entity, groups: Vec::new(), nodes });
        }
        // The sign of a physical tag is an orientation.
        let group = i32::try_from(physical.unsigned_abs()).unwrap_or(i32::MAX);
        let groups = &mut self.contents.elements[place].groups;
        if let (true, Err(at)) = (group != 0, groups.binary_search(&group)) {
            groups.insert(at, group);
        }
    }
}

/// Return the number of nodes of an element type of Gmsh.
fn stride(cursor: &Cursor, start: usize, kind: i32) -> Result<usize> {
    let known = ElementType::of(kind).map(|kind| kind.nodes);
    known.ok_or_else(|| cursor.error_at(start, format!("elements of Gmsh's type {kind} cannot be used")))
}

/// An element.
pub struct Element {
    /// Its number.
    pub number: u64,
    /// Gmsh's number of the type.
    pub kind: i32,
    /// Number of the entity of the geometry.
    pub entity: i32,
    /// Tags of the physical groups, sorted.
    pub groups: Vec<i32>,
    /// Its nodes, by their numbers.
    pub nodes: Vec<u64>,
}

#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Entity {
    dimension: usize,
    /// Tags of its physical groups, sorted.
    groups: Vec<i32>,
    /// Number in the file if it belongs to no group, otherwise 0.
    number: i32,
}

/// A mesh.
#[derive(Default)]
pub struct Contents {
    /// Lines of the names of groups: dimension, tag, quoted name.
    pub names: Vec<String>,
    /// Number and place of each node.
    pub nodes: Vec<(u64, [f64; 3])>,
    pub elements: Vec<Element>,
}

impl Contents {
    /// Return the bytes of the file.
    pub fn written(&self) -> Vec<u8> {
        let mut entities: BTreeMap<Entity, BTreeMap<i32, Vec<&Element>>> = BTreeMap::new();
        for element in &self.elements {
            let number = if element.groups.is_empty() { element.entity } else { 0 };
            let dimension = ElementType::of(element.kind).map_or(0, |kind| kind.shape.dimension);
            let entity = Entity { dimension, groups: element.groups.clone(), number };
            entities.entry(entity).or_default().entry(element.kind).or_default().push(element);
        }
        let tags = tags(entities.keys());
        let blocks = entities.values().map(BTreeMap::len).sum();
        let mut to = Bytes(b"$MeshFormat\n4.1 1 8\n".to_vec());
        to.int(1);
        to.text("\n$EndMeshFormat\n");
        if !self.names.is_empty() {
            to.text(&format!("$PhysicalNames\n{}\n{}\n$EndPhysicalNames\n", self.names.len(), self.names.join("\n")));
        }
        write_entities(&mut to, entities.keys().zip(&tags));
        to.text("$Nodes\n");
        [1, self.nodes.len(), 0, 0].iter().for_each(|&size| to.size(size as u64));
        [0, 1, 0].iter().for_each(|&head| to.int(head));
        to.size(self.nodes.len() as u64);
        self.nodes.iter().for_each(|(tag, _)| to.size(*tag));
        self.nodes.iter().flat_map(|(_, x)| x).for_each(|x| to.0.extend(x.to_le_bytes()));
        to.text("\n$EndNodes\n$Elements\n");
        [blocks, self.elements.len(), 0, 0].iter().for_each(|&size| to.size(size as u64));
        for ((entity, kinds), tag) in entities.iter().zip(&tags) {
            for (kind, elements) in kinds {
                [entity.dimension as i32, *tag, *kind].iter().for_each(|&head| to.int(head));
                to.size(elements.len() as u64);
                for element in elements {
                    to.size(element.number);
                    element.nodes.iter().for_each(|&node| to.size(node));
                }
            }
        }
        to.text("\n$EndElements\n");
        to.0
    }
}

/// Return the tag of each entity: its number in the file if it has no group, otherwise the next free one of its dimension.
fn tags<'a>(entities: impl Iterator<Item = &'a Entity> + Clone) -> Vec<i32> {
    let own = |entity: &Entity| (entity.dimension, entity.number);
    let taken: BTreeSet<(usize, i32)> = entities.clone().filter(|entity| entity.groups.is_empty()).map(own).collect();
    let mut next = [0; 4];
    let mut free = |dimension: usize| {
        next[dimension] += 1;
        while taken.contains(&(dimension, next[dimension])) {
            next[dimension] += 1;
        }
        next[dimension]
    };
    entities.map(|e| if e.groups.is_empty() { e.number } else { free(e.dimension) }).collect()
}

fn write_entities<'a>(to: &mut Bytes, entities: impl Iterator<Item = (&'a Entity, &'a i32)> + Clone) {
    to.text("$Entities\n");
    for dimension in 0..4 {
        to.size(entities.clone().filter(|(entity, _)| entity.dimension == dimension).count() as u64);
    }
    for (entity, tag) in entities {
        to.int(*tag);
        // These are the place of a point, or the box around another entity, which nobody reads.
        let numbers = if entity.dimension == 0 { 3 } else { 6 };
        to.0.extend(std::iter::repeat_n(0, 8 * numbers));
        to.size(entity.groups.len() as u64);
        entity.groups.iter().for_each(|&group| to.int(group));
        if entity.dimension > 0 {
            to.size(0);
        }
    }
    to.text("\n$EndEntities\n");
}

/// Bytes to which numbers are appended.
struct Bytes(Vec<u8>);

impl Bytes {
    fn int(&mut self, value: i32) {
        self.0.extend(value.to_le_bytes());
    }

    fn size(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.0.extend(text.as_bytes());
    }
}
