//! Bisection of some nodes of a matrix into two halves without coupling, and a separator between them.

use super::indices::row;
use super::integers::fit;
use super::metis::{self, Graph};
use super::{Matrix, Session};
use crate::error::Result;
use mpi::Count;
use mpi::datatype::PartitionMut;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

/// The label of a node of the separator. The nodes of the halves have the labels 0 and 1.
pub(super) const SEPARATOR: i32 = -1;

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

#[cfg(test)]
mod tests {
    use super::{Graph, SEPARATOR, of_graph, separate};

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
