//! A factor by substructures: two processes eliminate one half each, and all processes factor the interface.
//!
//! Let I be the interior dofs of each half, and B the interface dofs between the halves. The sums run over the halves:
//!
//! ```text
//! S = A_BB - sum A_BI A_II^-1 A_IB,   x_B = S^-1 (b_B - sum A_BI A_II^-1 b_I),   x_I = A_II^-1 (b_I - A_IB x_B)
//! ```
//!
//! S is dense and the same on all processes. A solve needs one sum over the processes, with a number for each interface dof. It also exchanges
//! the entries of b and x that are not owned where their half is. One process has one half and no interface.
//!
//! More than two parts do not pay. Elimination of n dofs in space takes c n^2 operations. The interface of p parts has about p^(1/3) n^(2/3)
//! dofs and takes c' p n^2, so that the best p does not depend on n. The size of S grows as p^(2/3). For two spheres with 99 900 dofs and
//! n = 8166, two, three and four parts on four processes take the same time, and 152, 158, and 176 MB.

use super::library::{fit, petsc};
use super::matrix::{Indices, row};
use super::metis::{self, Graph};
use super::vector::Vector;
use super::{Int, Matrix, Schur, Scope, Session, cholesky, cholesky_solve, ffi};
use crate::error::Result;
use mpi::Count;
use mpi::datatype::PartitionMut;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};
use std::cell::RefCell;
use std::ops::Range;
use std::ptr::null_mut;

/// The factor of P'AP, where P are some dofs of a matrix A.
pub(super) struct Substructures {
    session: Session,
    scope: Scope,
    /// The exchange between the dofs P that processes own and the interior dofs of this process.
    interior: Scatter,
    /// The factored interior with the interface dofs `near` retained, if this process has an interior.
    schur: Option<RefCell<Schur>>,
    /// The indices in the interface of the dofs that are coupled with the interior of this process.
    near: Vec<usize>,
    /// The interface dofs that this process owns.
    owned: Vec<InterfaceDof>,
    /// The Cholesky factor of S, `border` rows.
    interface: Vec<f64>,
    /// The number of interface dofs.
    border: usize,
}

/// An interface dof that this process owns.
struct InterfaceDof {
    /// Its index among the dofs P that this process owns.
    local: usize,
    /// Its index in the interface.
    index: usize,
}

impl Substructures {
    /// Factor P'AP. Collective. Return `None` if it is not positive definite to rounding.
    ///
    /// `dofs` are all dofs P, the same on all processes: whole nodes in increasing order.
    pub fn new(matrix: &Matrix, dofs: &[usize]) -> Result<Option<Self>> {
        let (session, scope) = (matrix.session().clone(), matrix.scope());
        let layout = Layout::new(matrix, dofs)?;
        let Interior { near, mut schur } = layout.eliminate_interior()?;
        let mut failed = [0.0];
        if let Some(schur) = &mut schur {
            match schur.factor() {
                Err(_) if schur.is_singular() => failed[0] = 1.0,
                done => done?,
            }
        }
        let complement = schur.as_mut().map_or_else(Vec::new, Schur::take_complement);
        let owned = layout.owned_interface();
        let mut interface = layout.interface_part(&owned, &near, &complement)?;
        drop(complement);
        scope.sum(&session, &mut failed);
        scope.sum(&session, &mut interface);
        let border = layout.border;
        if failed[0] > 0.0 || border > 0 && !cholesky(&mut interface, border)? {
            return Ok(None);
        }
        let interior = Scatter::new(&session, scope, layout.owned().len(), &layout.interior)?;
        Ok(Some(Self { session, scope, interior, schur: schur.map(RefCell::new), near, owned, interface, border }))
    }

    /// Compute x = (P'AP)^-1 b; the slices have one entry for each dof P that this process owns. Collective.
    pub fn solve(&self, b: &[f64], x: &mut [f64]) -> Result<()> {
        let interior = self.interior.len();
        let mut inside = vec![0.0; interior + self.near.len()];
        self.interior.gather(b, &mut inside[..interior])?;
        let mut schur = self.schur.as_ref().map(RefCell::borrow_mut);
        let mut interface = vec![0.0; self.border];
        if let Some(schur) = &mut schur {
            let condensed = schur.condense(&inside)?;
            self.near.iter().zip(condensed).for_each(|(&index, value)| interface[index] = value);
        }
        if self.border > 0 {
            self.owned.iter().for_each(|dof| interface[dof.index] += b[dof.local]);
            self.scope.sum(&self.session, &mut interface);
            cholesky_solve(&self.interface, self.border, &mut interface)?;
        }
        if let Some(schur) = &mut schur {
            let near: Vec<f64> = self.near.iter().map(|&index| interface[index]).collect();
            inside = schur.expand_condensed(&inside, &near)?;
        }
        x.fill(0.0);
        self.interior.scatter_add(&inside[..interior], x)?;
        self.owned.iter().for_each(|dof| x[dof.local] = interface[dof.index]);
        Ok(())
    }
}

/// The interior of this process, planned for elimination.
struct Interior {
    /// The indices in the interface of the dofs that are coupled with it, whole nodes in increasing order.
    near: Vec<usize>,
    /// The elimination with the dofs `near` retained, if there is an interior.
    schur: Option<Schur>,
}

/// A coupling of an interface dof with an interior dof.
struct Coupling {
    /// The index of the one in the interface.
    index: usize,
    /// The index of the other in the interior.
    inside: usize,
    value: f64,
}

/// The distribution of the dofs P over halves, interface and processes. Positions are those in `dofs`.
struct Layout<'a> {
    matrix: &'a Matrix,
    dofs: &'a [usize],
    /// The half of each node of P.
    half: Vec<i32>,
    /// The positions of the interior dofs of this process.
    interior: Vec<usize>,
    /// The number of interface dofs.
    border: usize,
    /// The index of each dof in the interior of this process or in the interface.
    index: Vec<usize>,
}

impl<'a> Layout<'a> {
    fn new(matrix: &'a Matrix, dofs: &'a [usize]) -> Result<Self> {
        let half = halves(matrix, dofs)?;
        let this_half = if matrix.scope() == Scope::World { matrix.session().rank() as i32 } else { 0 };
        let (mut interior, mut border, mut index) = (Vec::new(), 0, vec![0; dofs.len()]);
        for (position, index) in index.iter_mut().enumerate() {
            let half = half[position / matrix.block_size()];
            if half == SEPARATOR {
                *index = border;
                border += 1;
            } else if half == this_half {
                *index = interior.len();
                interior.push(position);
            }
        }
        Ok(Self { matrix, dofs, half, interior, border, index })
    }

    /// Return the index in the interface of the dof at a position, if it is an interface dof.
    fn interface_index(&self, position: usize) -> Option<usize> {
        (self.half[position / self.matrix.block_size()] == SEPARATOR).then(|| self.index[position])
    }

    /// Return the positions of the dofs that this process owns.
    fn owned(&self) -> Range<usize> {
        let owned = self.matrix.own();
        let first = |end: usize| self.dofs.partition_point(|&dof| dof < end);
        first(owned.start)..first(owned.end)
    }

    /// Plan the elimination of the interior of this process. The interface nodes that are coupled with it follow its own dofs.
    fn eliminate_interior(&self) -> Result<Interior> {
        let (size, inside) = (self.matrix.block_size(), self.interior.len());
        let (mut lower, mut couplings) = (Vec::new(), Vec::new());
        let rows: Vec<usize> = self.interior.iter().map(|&position| self.dofs[position]).collect();
        let read = |submatrix| {
            (0..inside).try_for_each(|i| {
                row(submatrix, i, |columns, values| self.read_row(i, columns, values, &mut lower, &mut couplings))
            })
        };
        Indices::alone(&rows)?.fetch(self.matrix, &Indices::alone(self.dofs)?, read)?;
        couplings.sort_unstable_by_key(|coupling| (coupling.index, coupling.inside));
        let mut nodes: Vec<usize> = couplings.iter().map(|coupling| coupling.index / size).collect();
        nodes.dedup();
        let near: Vec<usize> = nodes.into_iter().flat_map(|node| node * size..(node + 1) * size).collect();
        if inside == 0 {
            return Ok(Interior { near, schur: None });
        }
        let row_of = |index| inside + near.partition_point(|&near| near < index);
        lower.extend(couplings.into_iter().map(|coupling| (row_of(coupling.index), coupling.inside, coupling.value)));
        let retained: Vec<usize> = (inside..inside + near.len()).collect();
        let schur = Schur::analyse(self.matrix.session(), "", size, inside + near.len(), &lower, &retained)?;
        Ok(Interior { near, schur: Some(schur) })
    }

    /// Sort the entries of the interior row `i` into the lower triangle (row, column, value) of the interior and couplings with the interface.
    fn read_row(
        &self,
        i: usize,
        columns: &[Int],
        values: &[f64],
        lower: &mut Vec<(usize, usize, f64)>,
        couplings: &mut Vec<Coupling>,
    ) {
        // open contact leaves zeros in the pattern of the matrix
        for (&column, &value) in columns.iter().zip(values).filter(|entry| *entry.1 != 0.0) {
            let position = column as usize;
            match self.interface_index(position) {
                Some(index) => couplings.push(Coupling { index, inside: i, value }),
                None if self.index[position] <= i => lower.push((i, self.index[position], value)),
                None => {}
            }
        }
    }

    /// Return the interface dofs that this process owns.
    fn owned_interface(&self) -> Vec<InterfaceDof> {
        let dof = |(local, position)| Some(InterfaceDof { local, index: self.interface_index(position)? });
        self.owned().enumerate().filter_map(dof).collect()
    }

    /// Return what this process adds to S, `border` x `border` numbers: the rows of A_BB that it owns, and the `complement` of its
    /// interior on the interface dofs `near` it.
    fn interface_part(&self, owned: &[InterfaceDof], near: &[usize], complement: &[f64]) -> Result<Vec<f64>> {
        let (first, mut part) = (self.owned().start, vec![0.0; self.border * self.border]);
        for (&i, of_row) in near.iter().zip(complement.chunks_exact(near.len().max(1))) {
            near.iter().zip(of_row).for_each(|(j, value)| part[i * self.border + j] = *value);
        }
        for dof in owned {
            row(self.matrix.raw(), self.dofs[first + dof.local], |columns, values| {
                for (&column, &value) in columns.iter().zip(values) {
                    let position = self.dofs.binary_search(&(column as usize)).ok();
                    if let Some(j) = position.and_then(|position| self.interface_index(position)) {
                        part[dof.index * self.border + j] += value;
                    }
                }
            })?;
        }
        Ok(part)
    }
}

/// The label of a node of the separator. The nodes of the halves have the labels 0 and 1.
const SEPARATOR: i32 = -1;

/// Return the label of each node of the `dofs`: 0 or 1 for its half, or [`SEPARATOR`]. Collective, with the same result on all processes.
///
/// `dofs` are whole nodes in increasing order, the same on all processes. The halves have about the same size, and the separator has few
/// nodes. One process puts all nodes into half 0, and so do several without METIS.
///
/// # Errors
/// Those of METIS.
pub(super) fn halves(matrix: &Matrix, dofs: &[usize]) -> Result<Vec<i32>> {
    let (session, size) = (matrix.session(), matrix.block_size());
    let nodes: Vec<usize> = dofs.iter().step_by(size).map(|dof| dof / size).collect();
    let mut half = vec![0; nodes.len()];
    fit::<i32>("METIS", "nodes", nodes.len())?;
    if matrix.scope().processes(session) == 1 {
        return Ok(half);
    }
    let graph = collect(session, &owned_graph(matrix, &nodes)?)?;
    if session.rank() == 0 && metis::has_metis() {
        half = of_graph(&compressed(&graph))?;
    }
    session.world().process_at_rank(0).broadcast_into(&mut half[..]);
    Ok(half)
}

/// Return the neighbours of those `nodes` that this process owns, among `nodes`: for each node their number, then their positions.
fn owned_graph(matrix: &Matrix, nodes: &[usize]) -> Result<Vec<i32>> {
    let (owned, size) = (matrix.own(), matrix.block_size());
    let (mut graph, mut around) = (Vec::<i32>::new(), Vec::new());
    for (number, node) in nodes.iter().enumerate().filter(|(_, node)| owned.contains(&(*node * size))) {
        around.clear();
        for dof in node * size..(node + 1) * size {
            row(matrix.raw(), dof, |columns, _| around.extend(columns.iter().map(|column| *column as usize / size)))?;
        }
        around.sort_unstable();
        around.dedup();
        let at = graph.len();
        graph.push(0);
        let others = around.iter().filter_map(|other| nodes.binary_search(other).ok());
        graph.extend(others.filter(|other| *other != number).map(|other| other as i32));
        graph[at] = (graph.len() - at - 1) as i32;
    }
    Ok(graph)
}

/// Return a graph of [`owned_graph`] in compressed rows.
fn compressed(graph: &[i32]) -> Graph {
    let (mut ptr, mut col, mut rest) = (vec![0], Vec::with_capacity(graph.len()), graph);
    while let [count, others @ ..] = rest {
        let (neighbours, next) = others.split_at(*count as usize);
        col.extend_from_slice(neighbours);
        ptr.push(col.len() as i32);
        rest = next;
    }
    Graph { ptr, col }
}

/// Return the concatenated slices of all processes on rank 0, and an empty vector on other ranks. Collective.
fn collect(session: &Session, mine: &[i32]) -> Result<Vec<i32>> {
    let mut lengths: Vec<Count> = vec![0; session.size()];
    let length: Count = fit("MPI", "neighbours", mine.len())?;
    session.world().all_gather_into(&length, &mut lengths[..]);
    let first = session.world().process_at_rank(0);
    if session.rank() > 0 {
        first.gather_varcount_into(mine);
        return Ok(Vec::new());
    }
    let total = lengths.iter().map(|length| *length as usize).sum();
    fit::<Count>("MPI", "neighbours", total)?;
    let starts: Vec<Count> =
        lengths.iter().scan(0, |next, length| Some(std::mem::replace(next, *next + length))).collect();
    let mut all = vec![0; total];
    first.gather_varcount_into_root(mine, &mut PartitionMut::new(&mut all[..], lengths, starts));
    Ok(all)
}

/// Return the labels of the nodes of a graph.
fn of_graph(graph: &Graph) -> Result<Vec<i32>> {
    let Graph { ptr, col } = graph;
    let mut half = metis::partition(Graph { ptr: ptr.clone(), col: col.clone() }, 2)?;
    separate(ptr, col, &mut half);
    Ok(half)
}

/// Move nodes into the separator until no edge joins the halves.
///
/// Nodes with the most such edges come first, so that the separator is small and taken from both halves.
fn separate(ptr: &[i32], col: &[i32], half: &mut [i32]) {
    let around = |node: usize| col[ptr[node] as usize..ptr[node + 1] as usize].iter().map(|other| *other as usize);
    let edges = |node: usize, half: &[i32]| around(node).filter(|&other| half[other] == 1 - half[node]).count();
    let mut cut: Vec<(usize, usize)> = (0..half.len()).map(|node| (edges(node, half), node)).collect();
    cut.retain(|entry| entry.0 > 0);
    cut.sort_unstable_by(|a, b| b.cmp(a));
    for (_, node) in cut {
        if edges(node, half) > 0 {
            half[node] = SEPARATOR;
        }
    }
}

/// A map from a distributed vector to the entries that this process needs, and back.
struct Scatter {
    scatter: ffi::VecScatter,
    /// PETSc's header of the distributed vector.
    distributed: Vector,
    /// PETSc's header of the entries on this process.
    entries: Vector,
}

impl Scatter {
    /// Prepare the exchange of the entries with the global indices `indices`. Collective. The vector has `owned` entries on this process.
    pub fn new(session: &Session, scope: Scope, owned: usize, indices: &[usize]) -> Result<Self> {
        let distributed = Vector::new(session, scope, owned, 1)?;
        let entries = Vector::new(session, Scope::Process, indices.len(), 1)?;
        let from = Indices::alone(indices)?;
        let mut scatter = null_mut();
        // SAFETY: as many entries of the one as the other has.
        unsafe { petsc!(VecScatterCreate(distributed.vec, from.0, entries.vec, null_mut(), &mut scatter)) }?;
        Ok(Self { scatter, distributed, entries })
    }

    /// Return the number of entries on this process.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Copy the entries of a distributed vector to this process. Collective.
    pub fn gather(&self, vector: &[f64], entries: &mut [f64]) -> Result<()> {
        self.distributed.map(("a vector", vector), &self.entries, ("its entries", entries), |from, to| {
            self.scatter(from, to, ffi::InsertMode_INSERT_VALUES, ffi::ScatterMode_SCATTER_FORWARD)
        })
    }

    /// Add the entries of all processes to a distributed vector. Collective.
    pub fn scatter_add(&self, entries: &[f64], vector: &mut [f64]) -> Result<()> {
        self.entries.map(("entries", entries), &self.distributed, ("their vector", vector), |from, to| {
            self.scatter(from, to, ffi::InsertMode_ADD_VALUES, ffi::ScatterMode_SCATTER_REVERSE)
        })
    }

    fn scatter(&self, from: ffi::Vec, to: ffi::Vec, insert: ffi::InsertMode, mode: ffi::ScatterMode) -> Result<()> {
        // SAFETY: reads the one and writes to the other, both of the sizes that it was made for.
        unsafe {
            petsc!(VecScatterBegin(self.scatter, from, to, insert, mode))?;
            petsc!(VecScatterEnd(self.scatter, from, to, insert, mode))
        }
    }
}

impl Drop for Scatter {
    fn drop(&mut self) {
        // SAFETY: the one reference of this type.
        let _ = unsafe { petsc!(VecScatterDestroy(&mut self.scatter)) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of 60 by 10 nodes is cut by about one row of ten into halves of the same size, which are not coupled.
    #[test]
    fn a_strip_is_cut_across() {
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..600i32 {
            let beside = [i - 1, i + 1].into_iter().filter(|j| j.div_euclid(10) == i / 10);
            col.extend(beside.chain([i - 10, i + 10].into_iter().filter(|j| (0..600).contains(j))));
            ptr.push(col.len() as i32);
        }
        let graph = Graph { ptr, col };
        let half = of_graph(&graph).expect("METIS");
        let Graph { ptr, col } = graph;
        let count = |of| half.iter().filter(|half| **half == of).count();
        assert!(count(SEPARATOR) <= 12 && count(0).abs_diff(count(1)) <= 24, "{} {}", count(0), count(1));
        let apart = |i: usize, j: i32| half[i] == SEPARATOR || half[j as usize] != 1 - half[i];
        assert!((0..600).all(|i| col[ptr[i] as usize..ptr[i + 1] as usize].iter().all(|&j| apart(i, j))));
    }

    /// Two stars have coupled centres. One centre separates them; if a leaf is in the other half, its own centre does.
    #[test]
    fn a_separator_is_small() {
        // 0 with 1, 2, 3, and 1 with 4, 5
        let (ptr, col) = ([0, 3, 6, 7, 8, 9, 10], [1, 2, 3, 0, 4, 5, 0, 0, 1, 1]);
        let mut half = [0, 1, 0, 0, 1, 1];
        separate(&ptr, &col, &mut half);
        assert_eq!(half, [0, SEPARATOR, 0, 0, 1, 1]);
        let mut half = [0, 1, 0, 1, 1, 1];
        separate(&ptr, &col, &mut half);
        assert_eq!(half, [SEPARATOR, 1, 0, 1, 1, 1]);
    }
}
