//! Meshes in the binary form of Gmsh's format 4.1, in which files of other formats are handed to the reader.

use super::simplex;
use std::collections::{BTreeMap, BTreeSet};

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

/// Elements of the same groups and type: the index of their entity, the type, and indices of the elements.
struct Block {
    entity: usize,
    kind: i32,
    elements: Vec<usize>,
}

/// An entity of format 4.1.
#[derive(PartialEq, Eq, PartialOrd, Ord, Clone)]
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
    /// The elements.
    pub elements: Vec<Element>,
}

impl Contents {
    /// Return the entities, sorted, and the blocks of elements.
    fn blocks(&self) -> (Vec<Entity>, Vec<Block>) {
        let mut of_entity: BTreeMap<Entity, BTreeMap<i32, Vec<usize>>> = BTreeMap::new();
        for (index, element) in self.elements.iter().enumerate() {
            let number = if element.groups.is_empty() { element.entity } else { 0 };
            let dimension = simplex::type_name(element.kind).map_or(0, |(shape, _)| simplex::dimension(shape));
            let entity = Entity { dimension, groups: element.groups.clone(), number };
            of_entity.entry(entity).or_default().entry(element.kind).or_default().push(index);
        }
        let entities = of_entity.keys().cloned().collect();
        let with_entity = of_entity.into_values().enumerate();
        let blocks = with_entity.flat_map(|(entity, kinds)| {
            kinds.into_iter().map(move |(kind, elements)| Block { entity, kind, elements })
        });
        (entities, blocks.collect())
    }

    /// Return the bytes of the file.
    pub fn written(&self) -> Vec<u8> {
        let (entities, blocks) = self.blocks();
        let tags = tags(&entities);
        let mut to = Bytes(b"$MeshFormat\n4.1 1 8\n".to_vec());
        to.int(1);
        to.text("\n$EndMeshFormat\n");
        if !self.names.is_empty() {
            to.text(&format!("$PhysicalNames\n{}\n{}\n$EndPhysicalNames\n", self.names.len(), self.names.join("\n")));
        }
        write_entities(&mut to, &entities, &tags);
        to.text("$Nodes\n");
        [1, self.nodes.len(), 0, 0].iter().for_each(|&size| to.size(size as u64));
        [0, 1, 0].iter().for_each(|&head| to.int(head));
        to.size(self.nodes.len() as u64);
        self.nodes.iter().for_each(|(tag, _)| to.size(*tag));
        self.nodes.iter().flat_map(|(_, x)| x).for_each(|x| to.0.extend(x.to_le_bytes()));
        to.text("\n$EndNodes\n$Elements\n");
        [blocks.len(), self.elements.len(), 0, 0].iter().for_each(|&size| to.size(size as u64));
        for Block { entity, kind, elements } in &blocks {
            [entities[*entity].dimension as i32, tags[*entity], *kind].iter().for_each(|&head| to.int(head));
            to.size(elements.len() as u64);
            for element in elements.iter().map(|&index| &self.elements[index]) {
                to.size(element.number);
                element.nodes.iter().for_each(|&node| to.size(node));
            }
        }
        to.text("\n$EndElements\n");
        to.0
    }
}

/// Return the tag of each entity: its number in the file if it has no group, otherwise the next free one of its dimension.
fn tags(entities: &[Entity]) -> Vec<i32> {
    let own = |entity: &Entity| (entity.dimension, entity.number);
    let taken: BTreeSet<(usize, i32)> = entities.iter().filter(|entity| entity.groups.is_empty()).map(own).collect();
    let mut next = [0; 4];
    let mut free = |dimension: usize| {
        next[dimension] += 1;
        while taken.contains(&(dimension, next[dimension])) {
            next[dimension] += 1;
        }
        next[dimension]
    };
    entities.iter().map(|e| if e.groups.is_empty() { e.number } else { free(e.dimension) }).collect()
}

fn write_entities(to: &mut Bytes, entities: &[Entity], tags: &[i32]) {
    to.text("$Entities\n");
    for dimension in 0..4 {
        to.size(entities.iter().filter(|entity| entity.dimension == dimension).count() as u64);
    }
    for (entity, tag) in entities.iter().zip(tags) {
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
