//! Where the nodes of a body are, as far as a rank knows it.

use std::ops::Index;

/// Places of the nodes of a body: of all, or of some.
#[derive(Debug, Clone, Default)]
pub struct Places<const D: usize> {
    /// Number of nodes of the body.
    count: usize,
    /// The nodes whose places are known, sorted; empty if these are all.
    nodes: Vec<u32>,
    /// Where they are.
    at: Vec<[f64; D]>,
}

impl<const D: usize> Places<D> {
    /// Of some of so many nodes, which are sorted, each once.
    pub fn some(count: usize, known: impl Iterator<Item = (u32, [f64; D])>) -> Self {
        let (nodes, at): (Vec<u32>, Vec<[f64; D]>) = known.unzip();
        let nodes = if at.len() == count { Vec::new() } else { nodes };
        Self { count, nodes, at }
    }

    /// Number of nodes of the body.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether the body has no nodes.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Places that are known, in the order of the nodes.
    pub fn iter(&self) -> std::slice::Iter<'_, [f64; D]> {
        self.at.iter()
    }

    /// The same, to move the nodes.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, [f64; D]> {
        self.at.iter_mut()
    }

    /// Nodes whose places are known, in increasing order.
    pub fn known(&self) -> impl Iterator<Item = u32> + Clone {
        (0..self.at.len() as u32).map(|place| self.nodes.get(place as usize).copied().unwrap_or(place))
    }

    /// Adds the places of nodes, some of which may be known.
    pub fn learn(&mut self, places: impl Iterator<Item = (u32, [f64; D])>) {
        let is_new = |&(node, _): &(u32, [f64; D])| self.place(node).is_none();
        let mut new: Vec<(u32, [f64; D])> = places.filter(is_new).collect();
        if new.is_empty() {
            return;
        }
        new.extend(self.known().zip(self.at.iter().copied()));
        new.sort_unstable_by_key(|entry| entry.0);
        new.dedup_by_key(|entry| entry.0);
        *self = Self::some(self.count, new.into_iter());
    }

    fn place(&self, node: u32) -> Option<usize> {
        if self.at.len() == self.count { Some(node as usize) } else { self.nodes.binary_search(&node).ok() }
    }
}

impl<const D: usize> From<Vec<[f64; D]>> for Places<D> {
    /// Of all nodes.
    fn from(at: Vec<[f64; D]>) -> Self {
        Self { count: at.len(), nodes: Vec::new(), at }
    }
}

/// The place of a node that is known.
impl<const D: usize> Index<usize> for Places<D> {
    type Output = [f64; D];
    fn index(&self, node: usize) -> &[f64; D] {
        match self.place(node as u32) {
            Some(place) => &self.at[place],
            None => unreachable!("who asks for the place of a node has been told it"),
        }
    }
}

impl<'a, const D: usize> IntoIterator for &'a Places<D> {
    type Item = &'a [f64; D];
    type IntoIter = std::slice::Iter<'a, [f64; D]>;
    fn into_iter(self) -> Self::IntoIter {
        self.at.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_become_known_one_by_one() {
        let mut places = Places::<1>::some(4, [(1, [1.0]), (3, [3.0])].into_iter());
        assert_eq!((places.len(), places[3], places.known().collect::<Vec<_>>()), (4, [3.0], vec![1, 3]));
        places.learn([(2, [2.0]), (1, [1.0]), (2, [2.0])].into_iter());
        assert_eq!((places[2], places.known().collect::<Vec<_>>()), ([2.0], vec![1, 2, 3]));
        places.learn([(0, [0.0])].into_iter());
        assert!(places.iter().zip(0..).all(|(x, node)| *x == places[node] && x[0] == node as f64));
        assert_eq!(places.known().collect::<Vec<_>>(), [0, 1, 2, 3]);
    }
}
