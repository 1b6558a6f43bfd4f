//! The part of a body that one rank has: all of it, or the cells around its own nodes.

use crate::fem::Space;
use std::rc::Rc;

/// Cells of a body with their nodes, numbered anew; those around own nodes are complete, and so are those around the cells that touch these.
pub struct Local<const D: usize> {
    /// The cells and nodes.
    pub space: Rc<Space<D>>,
    /// The number of each node in the body, sorted.
    pub nodes: Vec<u32>,
    /// Whether each node is an own one.
    pub own: Vec<bool>,
}

impl<const D: usize> Local<D> {
    /// The part of a body that has so many `cells`; `own` tells the own nodes of the body.
    pub fn new(space: Rc<Space<D>>, cells: usize, own: impl Fn(u32) -> bool) -> Self {
        let (space, nodes) = match space.cell_count() == cells {
            true => (space.clone(), (0..space.nodes.len() as u32).collect()),
            false => {
                let (space, nodes) = space.part(0..space.cell_count());
                (Rc::new(space), nodes)
            }
        };
        let own = nodes.iter().map(|&node| own(node)).collect();
        Self { space, nodes, own }
    }

    /// The number here of a node of the body.
    pub fn node(&self, of_body: u32) -> Option<u32> {
        self.nodes.binary_search(&of_body).ok().map(|node| node as u32)
    }

    /// Numbers of the cells that this rank shows and measures: each cell of the body is one of the rank that has its first node.
    pub fn told(&self) -> impl Iterator<Item = usize> {
        let is_own = |cell: &[u32]| cell.iter().min().is_some_and(|&first| self.own[first as usize]);
        let cells = self.space.cells.chunks_exact(self.space.stride).enumerate();
        cells.filter(move |(_, cell)| is_own(cell)).map(|(number, _)| number)
    }

    /// Values at the dofs of all nodes of the body as those of the nodes here.
    pub fn values(&self, of_body: &[f64]) -> Vec<f64> {
        self.nodes.iter().flat_map(|&node| &of_body[D * node as usize..D * (node as usize + 1)]).copied().collect()
    }
}
