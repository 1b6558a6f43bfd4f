//! The cells around a vertex, ring by ring, and their nodes.

use crate::fem::Space;

/// Rings of cells around the vertices of a mesh, with the current selection around one of them.
pub(super) struct Rings<'a, const D: usize> {
    space: &'a Space<D>,
    /// Cells at each vertex; empty at other nodes.
    around: Vec<Vec<u32>>,
    cells: Marked,
    nodes: Marked,
}

impl<'a, const D: usize> Rings<'a, D> {
    /// Collect the cells at each vertex of a mesh.
    pub fn new(space: &'a Space<D>) -> Self {
        let mut around = vec![Vec::new(); space.nodes.len()];
        for (index, cell) in space.cells.chunks_exact(space.stride).enumerate() {
            cell[..=D].iter().for_each(|&node| around[node as usize].push(index as u32));
        }
        Self { space, around, cells: Marked::new(space.cell_count()), nodes: Marked::new(space.nodes.len()) }
    }

    /// Return whether a node is a vertex.
    pub fn is_vertex(&self, node: usize) -> bool {
        !self.around[node].is_empty()
    }

    /// Select the cells at a vertex.
    pub fn begin(&mut self, vertex: usize) {
        self.cells.clear();
        self.cells.extend(&self.around[vertex]);
    }

    /// Add the cells that touch the selected ones.
    pub fn widen(&mut self) {
        self.nodes.clear();
        for &cell in &self.cells.list {
            self.nodes.extend(&nodes_of(self.space, cell)[..=D]);
        }
        self.nodes.list.iter().for_each(|&vertex| self.cells.extend(&self.around[vertex as usize]));
    }

    /// Return the nodes of the selected cells.
    pub fn nodes(&mut self) -> &[u32] {
        self.nodes.clear();
        for &cell in &self.cells.list {
            self.nodes.extend(nodes_of(self.space, cell));
        }
        &self.nodes.list
    }
}

fn nodes_of<const D: usize>(space: &Space<D>, cell: u32) -> &[u32] {
    &space.cells[cell as usize * space.stride..][..space.stride]
}

/// Numbers without repetition, in the order in which they were added.
struct Marked {
    list: Vec<u32>,
    is_in: Vec<bool>,
}

impl Marked {
    fn new(count: usize) -> Self {
        Self { list: Vec::new(), is_in: vec![false; count] }
    }

    fn extend(&mut self, numbers: &[u32]) {
        for &number in numbers {
            if !std::mem::replace(&mut self.is_in[number as usize], true) {
                self.list.push(number);
            }
        }
    }

    fn clear(&mut self) {
        self.list.drain(..).for_each(|number| self.is_in[number as usize] = false);
    }
}
