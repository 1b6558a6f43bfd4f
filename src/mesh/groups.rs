//! The groups of a mesh by name, and a compact numbering that drops the points of no group.

use crate::problem::body::plain;
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
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Groups {
    list: Vec<Group>,
    place: HashMap<String, usize>,
    /// Index of each group by its name in the form of [`plain`], or `None` if several groups have that form.
    plain: HashMap<String, Option<usize>>,
    /// Name of the group of which a group is a connected part.
    whole: HashMap<String, String>,
}

impl Groups {
    /// Return the group with this name; see [`place`](Self::place).
    pub fn named(&self, name: &str) -> Option<&Group> {
        self.place(name).map(|place| &self.list[place])
    }

    /// Return the index of the group with this name. If there is none, return that of the only group whose name has the same
    /// plain form: `.inp` files have no capitals, for instance.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.place.get(name).copied().or_else(|| self.plain.get(&plain(name)).copied().flatten())
    }

    /// Return the name of the group of which this group is a connected part, if it is one.
    pub fn whole(&self, part: &str) -> Option<&str> {
        self.whole.get(part).map(String::as_str)
    }

    /// Return whether the group of this name is split into connected parts.
    pub fn is_split(&self, name: &str) -> bool {
        self.whole.values().any(|whole| whole == name)
    }

    /// Return the groups without their simplices.
    pub fn without_simplices(&self) -> Self {
        let empty = |group: &Group| Group {
            name: group.name.clone(),
            dimension: group.dimension,
            stride: group.stride,
            connectivity: Vec::new(),
            tags: Vec::new(),
        };
        let Self { list, place, plain, whole } = self;
        let list = list.iter().map(empty).collect();
        Self { list, place: place.clone(), plain: plain.clone(), whole: whole.clone() }
    }

    /// Add the connected parts of the group `whole`, with names of their own.
    pub fn add_parts(&mut self, whole: &str, parts: Vec<Group>) {
        self.whole.extend(parts.iter().map(|part| (part.name.clone(), whole.to_owned())));
        let list = std::mem::take(&mut self.list).into_iter().chain(parts).collect::<Vec<_>>();
        *self = Self { whole: std::mem::take(&mut self.whole), ..list.into() };
    }
}

impl From<Vec<Group>> for Groups {
    fn from(list: Vec<Group>) -> Self {
        let place = list.iter().zip(0..).map(|(group, place)| (group.name.clone(), place)).collect();
        let mut plain: HashMap<String, Option<usize>> = HashMap::new();
        for (place, group) in list.iter().enumerate() {
            plain.entry(self::plain(&group.name)).and_modify(|only| *only = None).or_insert(Some(place));
        }
        Self { list, place, plain, whole: HashMap::new() }
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
