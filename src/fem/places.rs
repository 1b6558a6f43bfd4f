//! Coordinates of the nodes of a body on a rank.

use std::ops::Index;

/// The coordinates of all nodes of a body, or of some. Nodes whose coordinates this rank has are called known.
#[derive(Debug, Clone, Default)]
pub struct Places<const D: usize> {
    /// Number of nodes of the body.
    count: usize,
    /// Known nodes, sorted; empty if all nodes are known.
    nodes: Vec<u32>,
    /// Coordinates of the known nodes.
    at: Vec<[f64; D]>,
}

impl<const D: usize> Places<D> {
    /// Store the coordinates of the `known` nodes of a body with `count` nodes. The nodes are sorted, each once.
    pub fn some(count: usize, known: impl Iterator<Item = (u32, [f64; D])>) -> Self {
        let (nodes, at): (Vec<u32>, Vec<[f64; D]>) = known.unzip();
        let nodes = if at.len() == count { Vec::new() } else { nodes };
        Self { count, nodes, at }
    }

    /// Return the number of nodes of the body.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Return whether the body has no nodes.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Return the coordinates of the known nodes, in the order of the nodes.
    pub fn iter(&self) -> std::slice::Iter<'_, [f64; D]> {
        self.at.iter()
    }

    /// Return the same coordinates, to move the nodes.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, [f64; D]> {
        self.at.iter_mut()
    }

    /// Return the known nodes in increasing order.
    pub fn known(&self) -> impl Iterator<Item = u32> + Clone {
        (0..self.at.len() as u32).map(|place| self.nodes.get(place as usize).copied().unwrap_or(place))
    }

    /// Add the coordinates of nodes, some of which may be known already.
    pub fn learn(&mut self, places: impl Iterator<Item = (u32, [f64; D])>) {
        let is_new = |&(node, _): &(u32, [f64; D])| self.position(node).is_none();
        let mut new: Vec<(u32, [f64; D])> = places.filter(is_new).collect();
        if new.is_empty() {
            return;
        }
        new.extend(self.known().zip(self.at.iter().copied()));
        new.sort_unstable_by_key(|entry| entry.0);
        new.dedup_by_key(|entry| entry.0);
        *self = Self::some(self.count, new.into_iter());
    }

    /// Return the position of a node among the known ones.
    fn position(&self, node: u32) -> Option<usize> {
        if self.at.len() == self.count { Some(node as usize) } else { self.nodes.binary_search(&node).ok() }
    }
}

impl<const D: usize> From<Vec<[f64; D]>> for Places<D> {
    /// Store the coordinates of all nodes.
    fn from(at: Vec<[f64; D]>) -> Self {
        Self { count: at.len(), nodes: Vec::new(), at }
    }
}

/// Access to the coordinates of a known node.
impl<const D: usize> Index<usize> for Places<D> {
    type Output = [f64; D];
    fn index(&self, node: usize) -> &[f64; D] {
        match self.position(node as u32) {
            Some(position) => &self.at[position],
            None => unreachable!("only the coordinates of known nodes are used"),
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
