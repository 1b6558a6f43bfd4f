//! Physical groups: their names, and the entities of the geometry that belong to them.

use super::Group;
use super::cursor::Cursor;
use super::simplex::THINGS;
use crate::error::Result;
use crate::problem::body::plain;
use std::collections::{HashMap, HashSet};

/// The groups of a file, and the entities that belong to them.
#[derive(Default)]
pub struct Physical {
    /// The groups, which are empty until the elements are read.
    pub groups: Vec<Group>,
    /// Index in `groups` by dimension and physical tag.
    group_of: HashMap<(usize, i32), usize>,
    /// Indices in `groups` of the groups of each entity of the geometry, by its dimension and tag.
    entities: HashMap<(usize, i32), Vec<usize>>,
    /// Whether groups without a name get one from their kind and number. If a dimension has no group, each of its entities
    /// becomes one.
    named_by_number: bool,
}

impl Physical {
    /// Start without groups. `named_by_number` tells whether groups without a name get one from their kind and number.
    pub fn new(named_by_number: bool) -> Self {
        Self { named_by_number, ..Self::default() }
    }

    /// Return the first group without elements.
    pub fn empty(&self) -> Option<&Group> {
        // Empty groups of other programs are not reported, because they are dropped.
        self.groups.iter().filter(|_| !self.named_by_number).find(|group| group.is_empty())
    }

    /// Return the indices in `groups` of the groups of an entity, or `None` if the file does not list the entity.
    pub fn members(&self, dimension: usize, tag: i32) -> Option<&[usize]> {
        self.entities.get(&(dimension, tag)).map(Vec::as_slice)
    }

    /// Return the first entity of a dimension that belongs to a group and has no elements. `has` tells whether an entity, given by
    /// dimension and tag, has elements.
    pub fn without(&self, dimension: usize, has: impl Fn((usize, i32)) -> bool) -> Option<i32> {
        let of = self.entities.iter().filter(|(entity, groups)| entity.0 == dimension && !groups.is_empty());
        of.map(|(entity, _)| *entity).filter(|entity| !has(*entity)).map(|(_, tag)| tag).min()
    }

    /// Add simplices of `stride` points each, with their tags, to all groups of an entity.
    pub fn extend(&mut self, entity: (usize, i32), stride: usize, connectivity: &[u32], tags: &[u64]) {
        for member in self.entities.get(&entity).into_iter().flatten() {
            let group = &mut self.groups[*member];
            group.stride = stride;
            group.connectivity.extend_from_slice(connectivity);
            group.tags.extend_from_slice(tags);
        }
    }

    /// Read `$PhysicalNames`, which has lines of dimension, tag and quoted name, in binary files too. `space` is the dimension
    /// of the scene.
    pub fn read_names(&mut self, cursor: &mut Cursor, space: usize) -> Result<()> {
        let start = cursor.position();
        let count = cursor.line()?.parse::<usize>();
        let count = count.map_err(|_| cursor.error_at(start, "the number of names should stand here"))?;
        let mut names = HashSet::new();
        for _ in 0..count {
            let start = cursor.position();
            let line = cursor.line()?;
            let mut words = line.splitn(3, ' ');
            let dimension =
                words.next().and_then(|word| word.parse::<usize>().ok()).filter(|dimension| *dimension <= 3);
            let tag = words.next().and_then(|word| word.parse::<i32>().ok());
            let name = words.next().and_then(|word| word.trim().strip_prefix('"')?.strip_suffix('"'));
            let (Some(dimension), Some(tag), Some(name)) = (dimension, tag, name) else {
                return Err(cursor.error_at(start, "dimension, tag and \"name\" of a physical group should stand here"));
            };
            let thing = THINGS[dimension];
            if name.trim().is_empty() {
                let error =
                    cursor.error_at(start, format!("physical {} {tag} has an empty name", thing.to_lowercase()));
                return Err(error.help(format!("name it: Physical {thing}(\"name\", {tag}) = {{...}};")));
            }
            if dimension > space {
                let message = format!("group `{name}` is made of volumes, but the scene has dimension = {space}");
                return Err(cursor.error_at(start, message).help("set `dimension = 3`, or remove the group"));
            }
            if !names.insert(name.to_owned()) {
                let error = cursor.error_at(start, format!("two physical groups are named `{name}`"));
                return Err(error.help("rename one: a name alone must tell which group is meant"));
            }
            if self.group_of.insert((dimension, tag), self.groups.len()).is_some() {
                let message = format!("two names for physical {} {tag}", thing.to_lowercase());
                return Err(cursor.error_at(start, message));
            }
            self.groups.push(empty(name.to_owned(), dimension));
        }
        Ok(())
    }

    /// Add a group with a name of its kind and number, and return its index.
    fn call(&mut self, dimension: usize, number: i32) -> usize {
        self.groups.push(empty(format!("{}_{number}", THINGS[dimension].to_lowercase()), dimension));
        self.group_of.insert((dimension, number), self.groups.len() - 1);
        self.groups.len() - 1
    }

    /// Return the groups. Other programs leave groups empty; these are dropped. Groups of cells get names in the form of bodies.
    pub fn finished(self, space: usize) -> Vec<Group> {
        let mut groups = self.groups;
        if self.named_by_number {
            groups.retain(|group| !group.is_empty());
        }
        let cells = groups.iter_mut().filter(|group| group.dimension == space);
        cells.for_each(|group| group.name = plain(&group.name));
        groups
    }

    /// Read `$Entities`, which lists the physical groups of each point, curve, surface and volume of the geometry.
    pub fn read_entities(&mut self, cursor: &mut Cursor) -> Result<()> {
        cursor.begin();
        let mut counts = [0; 4];
        for (dimension, count) in counts.iter_mut().enumerate() {
            *count = if dimension == 0 { cursor.count(5, 36)? } else { cursor.count(9, 68)? };
        }
        cursor.end()?;
        for (dimension, count) in counts.into_iter().enumerate() {
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(self.read_entity(cursor, dimension)?);
            }
            if self.named_by_number && !self.groups.iter().any(|group| group.dimension == dimension) {
                for tag in tags {
                    let group = self.call(dimension, tag);
                    self.entities.insert((dimension, tag), vec![group]);
                }
            }
        }
        Ok(())
    }

    /// Read an entity and its groups, and return its tag.
    fn read_entity(&mut self, cursor: &mut Cursor, dimension: usize) -> Result<i32> {
        cursor.begin();
        let start = cursor.position();
        let tag = cursor.int()?;
        // These are the coordinates of a point, or the corners of the box around the entity.
        for _ in 0..if dimension == 0 { 3 } else { 6 } {
            cursor.bound()?;
        }
        let mut members: Vec<usize> = Vec::new();
        for _ in 0..cursor.count(1, 4)? {
            // The sign is an orientation.
            let physical = i32::try_from(cursor.int()?.unsigned_abs()).unwrap_or(i32::MAX);
            if self.named_by_number && !self.group_of.contains_key(&(dimension, physical)) {
                self.call(dimension, physical);
            }
            let Some(group) = self.group_of.get(&(dimension, physical)) else {
                let thing = THINGS[dimension];
                let message = format!("physical {} {physical} has no name", thing.to_lowercase());
                let help = format!("name it: Physical {thing}(\"name\", {physical}) = {{...}};");
                return Err(cursor.error_at(start, message).help(help));
            };
            if !members.contains(group) {
                members.push(*group);
            }
        }
        if dimension > 0 {
            for _ in 0..cursor.count(1, 4)? {
                cursor.int()?;
            }
        }
        cursor.end()?;
        match self.entities.insert((dimension, tag), members) {
            None => Ok(tag),
            Some(_) => {
                let message = format!("{} {tag} stands twice", THINGS[dimension].to_lowercase());
                Err(cursor.error_at(start, message))
            }
        }
    }
}

/// Return a group without elements. Its stride is final when the first elements are added.
fn empty(name: String, dimension: usize) -> Group {
    Group { name, dimension, stride: dimension + 1, connectivity: Vec::new(), tags: Vec::new() }
}
