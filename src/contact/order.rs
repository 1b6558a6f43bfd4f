//! Order of contact points along a surface, for curves that can be plotted.

use super::side::Side;
use std::collections::{HashMap, HashSet};

/// Sort surface nodes for plots. In the plane they follow the curve, and each chain begins at the end with the smaller
/// coordinates. In space they are sorted by coordinates.
pub fn along<const D: usize>(side: &Side<D>, nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    let at = |node: u32| side.space.nodes[node as usize];
    nodes.sort_by(|&m, &n| {
        let (x, y) = (at(m), at(n));
        (0..D).map(|c| x[c].total_cmp(&y[c])).find(|o| o.is_ne()).unwrap_or(m.cmp(&n))
    });
    if D != 2 {
        return nodes;
    }
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    for i in 0..side.facets.count() {
        let facet = side.facets.facet(i);
        let chain = if facet.len() == 3 { vec![facet[0], facet[2], facet[1]] } else { facet.to_vec() };
        for link in chain.windows(2) {
            neighbours.entry(link[0]).or_default().push(link[1]);
            neighbours.entry(link[1]).or_default().push(link[0]);
        }
    }
    let wanted: HashSet<u32> = nodes.iter().copied().collect();
    let mut visited = HashSet::new();
    let mut order = Vec::with_capacity(nodes.len());
    // The ends of open chains come first, then the nodes of closed curves.
    let is_end = |node: &u32| neighbours.get(node).is_none_or(|n| n.len() != 2);
    let starts: Vec<u32> = nodes.iter().filter(|n| is_end(n)).chain(&nodes).copied().collect();
    for start in starts {
        let mut current = Some(start);
        while let Some(node) = current {
            if !visited.insert(node) {
                break;
            }
            if wanted.contains(&node) {
                order.push(node);
            }
            current = neighbours.get(&node).and_then(|n| n.iter().find(|n| !visited.contains(n)).copied());
        }
    }
    order
}
