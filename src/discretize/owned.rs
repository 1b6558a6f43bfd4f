//! The part of a body that one rank has: the whole body, or the cells around its owned nodes.

use crate::fem::Space;
use std::rc::Rc;

/// Cells of a body with their nodes, in local numbers. The cells around owned nodes are complete, and so are those around the
/// cells that touch owned nodes. Nodes of contact rows and masters of tied nodes are included.
pub struct OwnedPart<const D: usize> {
    /// Cells and nodes.
    pub space: Rc<Space<D>>,
    /// Whether this rank owns each node.
    pub own: Vec<bool>,
}

impl<const D: usize> OwnedPart<D> {
    /// Return the indices of the cells that this rank writes and measures. Each cell of the body belongs to the rank that owns
    /// its first node.
    pub fn owned(&self) -> impl Iterator<Item = usize> {
        let is_own = |cell: &[u32]| cell.iter().min().is_some_and(|&first| self.own[first as usize]);
        let cells = self.space.cells.chunks_exact(self.space.stride).enumerate();
        cells.filter(move |(_, cell)| is_own(cell)).map(|(number, _)| number)
    }
}
