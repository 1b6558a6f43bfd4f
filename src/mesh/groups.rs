//! The groups of a mesh by name, and compact numberings of their points.

use super::shape::{edges, on_chord, turned};
use super::simplex::EDGES;
use crate::problem::body::plain;
use crate::problem::order::Order;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
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

    /// Return the index of the group with this name. If there is none, return that of the only group whose name has the
    /// same plain form: `.inp` files have no capitals, for instance.
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
            plain
                .entry(crate::problem::body::plain(&group.name))
                .and_modify(|only| *only = None)
                .or_insert(Some(place));
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

/// Renumber the points that groups use in their old order, and return the old number of each new one.
pub fn renumber(groups: &mut [Group]) -> Vec<u32> {
    let number = Numbering::in_order(groups.iter().flat_map(|group| &group.connectivity).copied());
    for point in groups.iter_mut().flat_map(|group| &mut group.connectivity) {
        *point = number.get(*point).unwrap_or(ABSENT);
    }
    number.points().collect()
}

/// Give linear simplices points inside their edges: those of the cells of dimension `space` that have an order above
/// one, else new ones on straight edges.
pub fn raise<const N: usize>(groups: &mut [Group], points: &mut Vec<[f64; N]>, order: Order, space: usize) {
    let inside = order.degree() - 1;
    let is_linear = |group: &&mut Group| group.dimension > 0 && group.stride == group.dimension + 1;
    if !groups.iter_mut().any(|group| is_linear(&group)) {
        return;
    }
    // the points of each edge from its end with the smaller number
    let mut of_edge: HashMap<[u32; 2], SmallVec<[u32; 2]>> = HashMap::new();
    for cell in groups.iter().filter(|group| group.dimension == space).flat_map(Group::simplices) {
        for (ends, nodes) in edges(cell, space) {
            let [a, b] = ends.map(|end| cell[end]);
            of_edge.insert([a.min(b), a.max(b)], turned(nodes, a > b));
        }
    }
    for group in groups.iter_mut().filter(is_linear) {
        let edges = &EDGES[..group.dimension * (group.dimension + 1) / 2];
        let mut connectivity = Vec::with_capacity(group.len() * (group.stride + edges.len() * inside));
        for simplex in group.simplices() {
            connectivity.extend_from_slice(simplex);
            for [a, b] in edges.iter().map(|edge| edge.map(|corner| simplex[corner])) {
                let [low, high] = [a.min(b), a.max(b)];
                let nodes = of_edge.entry([low, high]).or_insert_with(|| {
                    let (first, ends) = (points.len() as u32, [low, high].map(|end| points[end as usize]));
                    points.extend((0..inside).map(|k| on_chord(ends, k, inside)));
                    (first..first + inside as u32).collect()
                });
                connectivity.extend(turned(nodes, a > b));
            }
        }
        (group.stride, group.connectivity) = (group.stride + edges.len() * inside, connectivity);
    }
}

/// The entry of a point that is not a node.
const ABSENT: u32 = u32::MAX;

/// The node of each point of a body, or our number of each tag of a file.
#[derive(Debug, Clone, Default)]
pub struct Numbering {
    /// Points of the body, sorted. The list is empty if `node` has an entry for every point from `first` on.
    points: Vec<u64>,
    first: u64,
    node: Vec<u32>,
}

/// Largest ratio of the entries of a table to the corners of cells, counted in every cell. The table has an entry for
/// every point between the first and the last one. About six cells meet at a node of triangles and 24 at one of
/// tetrahedra, so the table is no larger than the cells.
const SPARSE: usize = 2;

impl Numbering {
    /// Make a numbering for the points that cells name, with any repetitions. No point has a node yet.
    pub fn new(named: impl Iterator<Item = impl Into<u64>> + Clone) -> Self {
        let named = named.map(Into::into);
        let (count, first, last): (usize, u64, u64) =
            named.clone().fold((0, u64::MAX, 0), |(count, low, high), p| (count + 1, low.min(p), high.max(p)));
        if count == 0 {
            return Self::default();
        }
        if last - first < (SPARSE * count) as u64 {
            return Self { points: Vec::new(), first, node: vec![ABSENT; (last - first) as usize + 1] };
        }
        let mut points: Vec<u64> = named.collect();
        points.sort_unstable();
        points.dedup();
        Self { node: vec![ABSENT; points.len()], points, first }
    }

    /// Make a numbering of the points that are named, with any repetitions, in increasing order of the points.
    pub fn in_order(named: impl Iterator<Item = u32> + Clone) -> Self {
        let mut numbering = Self::new(named.clone());
        named.for_each(|point| {
            numbering.number(point, 0);
        });
        (0..).zip(numbering.node.iter_mut().filter(|node| **node != ABSENT)).for_each(|(next, node)| *node = next);
        numbering
    }

    fn place(&self, point: u64) -> Option<usize> {
        if self.points.is_empty() {
            return usize::try_from(point.checked_sub(self.first)?).ok().filter(|&place| place < self.node.len());
        }
        self.points.binary_search(&point).ok()
    }

    /// Return the node of a point, if it is one of the body.
    pub fn get(&self, point: impl Into<u64>) -> Option<u32> {
        self.place(point.into()).map(|place| self.node[place]).filter(|&node| node != ABSENT)
    }

    /// Return the node of a point that cells name, and whether it is new. A point without a node gets the node `next`.
    pub fn number(&mut self, point: impl Into<u64>, next: u32) -> (u32, bool) {
        let Some(place) = self.place(point.into()) else { return (ABSENT, false) };
        let node = &mut self.node[place];
        let is_new = *node == ABSENT;
        if is_new {
            *node = next;
        }
        (*node, is_new)
    }

    /// Return the points of the body, in the order of the mesh.
    pub fn points(&self) -> impl Iterator<Item = u32> {
        let at = |place: usize| self.points.get(place).copied().unwrap_or(self.first + place as u64);
        (0..self.node.len()).filter(|&place| self.node[place] != ABSENT).map(move |place| at(place) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_points_and_far_ones_have_nodes() {
        for named in [vec![7_u32, 9, 8, 7], vec![1_000_000, 9, 8, 1_000_000]] {
            let mut numbering = Numbering::new(named.iter().copied());
            assert_eq!(numbering.get(9_u32), None);
            let nodes: Vec<(u32, bool)> = (0..).zip(&named).map(|(k, &point)| numbering.number(point, k)).collect();
            assert_eq!(nodes, [(0, true), (1, true), (2, true), (0, false)]);
            assert_eq!(named.iter().map(|&point| numbering.get(point)).collect::<Vec<_>>(), [0, 1, 2, 0].map(Some));
            assert!([0, 6, 10, 999_999, u32::MAX].iter().all(|&point| numbering.get(point).is_none()));
            assert_eq!(
                numbering.points().collect::<Vec<_>>(),
                [8, 9, named[0]].into_iter().collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>()
            );
            let ordered = Numbering::in_order(named.iter().copied());
            assert!(ordered.points().zip(0..).all(|(point, number)| ordered.get(point) == Some(number)));
            assert_eq!(ordered.points().count(), 3);
        }
        assert!(Numbering::new(std::iter::empty::<u32>()).points().next().is_none());
    }
}
