//! The groups of a mesh by name; and compact numbering: points that no group uses go.

use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::{Deref, DerefMut};

/// A named group of simplices of one dimension.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// Name of the physical group.
    pub name: String,
    /// Dimension of its simplices: 0 points, 1 lines, 2 triangles, 3 tetrahedra.
    pub dimension: usize,
    /// Points per simplex.
    pub stride: usize,
    /// Point numbers, `stride` per simplex. Only cells have an orientation that means something.
    pub connectivity: Vec<u32>,
    /// Numbers of the simplices in the file, for messages; empty if they have none.
    pub tags: Vec<u64>,
}

impl Group {
    /// Number of simplices.
    pub fn len(&self) -> usize {
        self.connectivity.len() / self.stride
    }

    /// Whether there is no simplex; never so in a mesh that was read.
    pub fn is_empty(&self) -> bool {
        self.connectivity.is_empty()
    }

    /// The simplices, each as its `stride` point numbers.
    pub fn simplices(&self) -> std::slice::ChunksExact<'_, u32> {
        self.connectivity.chunks_exact(self.stride)
    }
}

/// The groups of a mesh, in the order of the file, found by their names, which are unique.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Groups {
    list: Vec<Group>,
    place: HashMap<String, usize>,
}

impl Groups {
    /// The group of a name.
    pub fn named(&self, name: &str) -> Option<&Group> {
        self.place.get(name).map(|&place| &self.list[place])
    }
}

impl From<Vec<Group>> for Groups {
    fn from(list: Vec<Group>) -> Self {
        Self { place: list.iter().zip(0..).map(|(group, place)| (group.name.clone(), place)).collect(), list }
    }
}

impl Deref for Groups {
    type Target = [Group];

    fn deref(&self) -> &[Group] {
        &self.list
    }
}

/// For the simplices; names stay what they are.
impl DerefMut for Groups {
    fn deref_mut(&mut self) -> &mut [Group] {
        &mut self.list
    }
}

/// Renumbers the points that the groups use, in their old order, and gives the old number of each new one.
/// `count` is the number of points before; every number in the groups is below it.
pub fn compact(groups: &mut [Group], count: usize) -> impl Iterator<Item = usize> + use<> {
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; count];
    for point in groups.iter().flat_map(|group| &group.connectivity) {
        number[*point as usize] = 0;
    }
    for (new, slot) in number.iter_mut().filter(|slot| **slot != UNUSED).enumerate() {
        *slot = new as u32;
    }
    for point in groups.iter_mut().flat_map(|group| &mut group.connectivity) {
        *point = number[*point as usize];
    }
    (0..count).filter(move |old| number[*old] != UNUSED)
}
