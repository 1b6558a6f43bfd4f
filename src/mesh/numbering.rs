//! A map from point numbers to the numbers of a body or of a rank. Its size is that of the body or of the rank's part, since a
//! mesh may have thousands of bodies.

/// The entry of a point that is not a node.
const ABSENT: u32 = u32::MAX;

/// The node of each point of a body.
#[derive(Debug, Clone, Default)]
pub struct Numbering {
    /// Points of the body, sorted. The list is empty if `node` has an entry for every point from `first` on.
    points: Vec<u32>,
    first: u32,
    node: Vec<u32>,
}

/// Largest ratio of the entries of a table to the corners of cells, counted in every cell. The table has an entry for every
/// point between the first and the last one. About six cells meet at a node of triangles and 24 at one of tetrahedra, so the
/// table is no larger than the cells.
const SPARSE: usize = 2;

impl Numbering {
    /// Make a numbering for the points that cells name, with any repetitions. No point has a node yet.
    pub fn new(named: impl Iterator<Item = u32> + Clone) -> Self {
        let (count, first, last) =
            named.clone().fold((0, u32::MAX, 0), |(count, low, high), p| (count + 1, low.min(p), high.max(p)));
        if count == 0 {
            return Self::default();
        }
        let wide = (last - first) as usize + 1;
        if wide <= SPARSE * count {
            return Self { points: Vec::new(), first, node: vec![ABSENT; wide] };
        }
        let mut points: Vec<u32> = named.collect();
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

    fn place(&self, point: u32) -> Option<usize> {
        if self.points.is_empty() {
            return Some(point.checked_sub(self.first)? as usize).filter(|&place| place < self.node.len());
        }
        self.points.binary_search(&point).ok()
    }

    /// Return the node of a point, if it is one of the body.
    pub fn get(&self, point: u32) -> Option<u32> {
        self.place(point).map(|place| self.node[place]).filter(|&node| node != ABSENT)
    }

    /// Return the node of a point that cells name, and whether it is new. A point without a node gets the node `next`.
    pub fn number(&mut self, point: u32, next: u32) -> (u32, bool) {
        let Some(place) = self.place(point) else { return (ABSENT, false) };
        let node = &mut self.node[place];
        let is_new = *node == ABSENT;
        if is_new {
            *node = next;
        }
        (*node, is_new)
    }

    /// Return the points of the body, in the order of the mesh.
    pub fn points(&self) -> impl Iterator<Item = u32> {
        let at = |place: usize| self.points.get(place).copied().unwrap_or(self.first + place as u32);
        (0..self.node.len()).filter(|&place| self.node[place] != ABSENT).map(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_points_and_far_ones_have_nodes() {
        for named in [vec![7, 9, 8, 7], vec![1_000_000, 9, 8, 1_000_000]] {
            let mut numbering = Numbering::new(named.iter().copied());
            assert_eq!(numbering.get(9), None);
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
        assert!(Numbering::new([].into_iter()).points().next().is_none());
    }
}
