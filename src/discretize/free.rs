//! Rigid motions of a free body at its dofs, of which a rank knows some places.

use super::draft::Draft;
use super::part::Part;
use crate::exchange::Exchange;
use std::cell::RefCell;
use std::collections::HashMap;

/// Rigid motions of the free body.
pub struct Free<'a, const D: usize> {
    part: &'a Part<'a, D>,
    draft: &'a Draft<D>,
    exchange: &'a dyn Exchange,
    /// Places of nodes that were found since.
    found: RefCell<HashMap<u32, [f64; D]>>,
}

impl<'a, const D: usize> Free<'a, D> {
    /// Those of a body.
    pub fn new(part: &'a Part<'a, D>, draft: &'a Draft<D>, exchange: &'a dyn Exchange) -> Self {
        Self { part, draft, exchange, found: RefCell::default() }
    }

    /// What one of them does at a dof whose place is known.
    pub fn at(&self, k: usize, dof: usize) -> f64 {
        let found = self.found.borrow();
        let place = |node: u32| found.get(&node).copied().unwrap_or_else(|| self.part.space.nodes[node as usize]);
        self.part.held.frame.dof(dof, |node| self.draft.free[k].at(&place(node)))
    }

    /// The dof at which a value is largest, whose place all ranks know then. Collective.
    pub fn largest(&self, size: &dyn Fn(usize) -> Option<f64>) -> Option<(usize, f64)> {
        let found = self.part.largest(size, self.exchange)?;
        self.found.borrow_mut().insert((found.dof / D) as u32, found.at);
        Some((found.dof, found.size))
    }
}
