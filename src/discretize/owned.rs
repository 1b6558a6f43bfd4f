//! The part of a body that one rank has: all of it, or the cells around its own nodes.

use crate::fem::Space;
use std::rc::Rc;

/// Cells of a body with their nodes, numbered anew; those around own nodes are complete, and so are those around the cells that touch these.
/// Nodes of contact rows and masters of tied ones are here, too.
pub struct OwnedPart<const D: usize> {
    /// The cells and nodes.
    pub space: Rc<Space<D>>,
    /// Whether each node is an own one.
    pub own: Vec<bool>,
}

impl<const D: usize> OwnedPart<D> {
    /// Numbers of the cells that this rank shows and measures: each cell of the body is one of the rank that has its first node.
    pub fn owned(&self) -> impl Iterator<Item = usize> {
        let is_own = |cell: &[u32]| cell.iter().min().is_some_and(|&first| self.own[first as usize]);
        let cells = self.space.cells.chunks_exact(self.space.stride).enumerate();
        cells.filter(move |(_, cell)| is_own(cell)).map(|(number, _)| number)
    }
}
