//! The groups of a mesh by name, and a compact numbering that drops the points of no group.

use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};
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
    /// Point numbers, `stride` per simplex. The orientation is meaningful for cells only.
    pub connectivity: Vec<u32>,
    /// Numbers of the simplices in the file, for messages; empty if they have none.
    pub tags: Vec<u64>,
}

impl Group {
    /// Return the number of simplices.
    pub fn len(&self) -> usize {
        self.connectivity.len() / self.stride
    }

    /// Return whether there is no simplex, which is never so in a mesh that was read.
    pub fn is_empty(&self) -> bool {
        self.connectivity.is_empty()
    }

    /// Return the simplices, each as a slice of `stride` point numbers.
    pub fn simplices(&self) -> std::slice::ChunksExact<'_, u32> {
        self.connectivity.chunks_exact(self.stride)
    }
}

/// The groups of a mesh, in the order of the file, with an index by their unique names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Groups {
    list: Vec<Group>,
    place: HashMap<String, usize>,
}

impl Groups {
    /// Return the group with this name.
    pub fn named(&self, name: &str) -> Option<&Group> {
        self.place(name).map(|place| &self.list[place])
    }

    /// Return the index of the group with this name.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.place.get(name).copied()
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

/// This gives access to the simplices. Names must not change, since the index holds them.
impl DerefMut for Groups {
    fn deref_mut(&mut self) -> &mut [Group] {
        &mut self.list
    }
}

/// Return a name that two groups have.
pub fn twice(groups: &[Group]) -> Option<&str> {
    let mut names = HashSet::new();
    groups.iter().map(|group| group.name.as_str()).find(|name| !names.insert(*name))
}

/// Return for each of `count` points whether a group uses it. Every point number in the groups is below `count`.
pub fn used(groups: &[Group], count: usize) -> Vec<bool> {
    let mut used = vec![false; count];
    groups.iter().flat_map(|group| &group.connectivity).for_each(|&point| used[point as usize] = true);
    used
}

/// Return the number of each used point among all used points. The entries of other points are meaningless.
fn compact(used: &[bool]) -> Vec<u32> {
    let mut next = 0;
    let number = |used: &bool| {
        next += u32::from(*used);
        next.wrapping_sub(1)
    };
    used.iter().map(number).collect()
}

/// Renumber the used points in their old order, and return the old number of each new one.
pub fn renumber(groups: &mut [Group], used: Vec<bool>) -> impl Iterator<Item = usize> + use<> {
    let number = compact(&used);
    for point in groups.iter_mut().flat_map(|group| &mut group.connectivity) {
        *point = number[*point as usize];
    }
    (0..used.len()).filter(move |old| used[*old])
}
