//! Some nodes of a matrix, cut into two halves that are not coupled.

use super::indices::row;
use super::{Int, Matrix, Session, metis};
use crate::error::Result;
use mpi::Count;
use mpi::datatype::PartitionMut;
use mpi::traits::{Communicator, CommunicatorCollectives, Root};

/// A node between the halves.
pub(super) const BETWEEN: Int = -1;

/// The half, 0 or 1, of each node of the `dofs`, whole nodes in increasing order, or [`BETWEEN`]: halves are of about the same size and are
/// coupled by the nodes between them alone, of which there are few. One process has no use for a second half. Collective; the same on all
/// processes.
///
/// # Errors
/// Those of METIS.
pub(super) fn halves(matrix: &Matrix, dofs: &[usize]) -> Result<Vec<Int>> {
    let (session, scope, own, size) = (matrix.session(), matrix.scope(), matrix.own(), matrix.block_size());
    let nodes: Vec<usize> = dofs.iter().step_by(size).map(|dof| dof / size).collect();
    let mut half = vec![0; nodes.len()];
    if scope.processes(session) == 1 {
        return Ok(half);
    }
    // of each node here: how many neighbours, and which
    let (mut graph, mut around) = (Vec::<Int>::new(), Vec::new());
    for (number, node) in nodes.iter().enumerate().filter(|(_, node)| own.contains(&(*node * size))) {
        around.clear();
        for dof in node * size..(node + 1) * size {
            row(matrix.raw(), dof, |columns, _| around.extend(columns.iter().map(|column| *column as usize / size)))?;
        }
        around.sort_unstable();
        around.dedup();
        let at = graph.len();
        graph.push(0);
        let others = around.iter().filter_map(|other| nodes.binary_search(other).ok());
        graph.extend(others.filter(|other| *other != number).map(|other| other as Int));
        graph[at] = (graph.len() - at - 1) as Int;
    }
    let graph = collect(session, &graph);
    if session.rank() == 0 {
        let (mut ptr, mut col, mut rest) = (vec![0], Vec::with_capacity(graph.len()), &graph[..]);
        while let [count, others @ ..] = rest {
            let (these, next) = others.split_at(*count as usize);
            col.extend_from_slice(these);
            ptr.push(col.len() as Int);
            rest = next;
        }
        half = of_graph(&mut ptr, &mut col)?;
    }
    session.world().process_at_rank(0).broadcast_into(&mut half[..]);
    Ok(half)
}

/// What all processes have, one after the other, on the first; nothing on others.
fn collect(session: &Session, mine: &[Int]) -> Vec<Int> {
    let mut lengths: Vec<Count> = vec![0; session.size()];
    session.world().all_gather_into(&(mine.len() as Count), &mut lengths[..]);
    let first = session.world().process_at_rank(0);
    if session.rank() > 0 {
        first.gather_varcount_into(mine);
        return Vec::new();
    }
    let starts: Vec<Count> =
        lengths.iter().scan(0, |next, length| Some(std::mem::replace(next, *next + length))).collect();
    let mut all = vec![0; lengths.iter().sum::<Count>() as usize];
    first.gather_varcount_into_root(mine, &mut PartitionMut::new(&mut all[..], lengths, starts));
    all
}

/// The halves of a graph: the neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`.
fn of_graph(ptr: &mut [Int], col: &mut [Int]) -> Result<Vec<Int>> {
    let mut half = metis::partition(ptr, col, 2)?;
    separate(ptr, col, &mut half);
    Ok(half)
}

/// Takes nodes out of the halves until no edge joins these: nodes with the most such edges first, so that they are few and of both halves.
fn separate(ptr: &[Int], col: &[Int], half: &mut [Int]) {
    let around = |node: usize| col[ptr[node] as usize..ptr[node + 1] as usize].iter().map(|other| *other as usize);
    let edges = |node: usize, half: &[Int]| around(node).filter(|&other| half[other] == 1 - half[node]).count();
    let mut cut: Vec<(usize, usize)> = (0..half.len()).map(|node| (edges(node, half), node)).collect();
    cut.retain(|entry| entry.0 > 0);
    cut.sort_unstable_by(|a, b| b.cmp(a));
    for (_, node) in cut {
        if edges(node, half) > 0 {
            half[node] = BETWEEN;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{BETWEEN, of_graph, separate};

    /// A strip of 60 by 10 nodes: about one row of ten lies between halves of the same size, none of whose nodes is next to one of the other.
    #[test]
    fn a_strip_is_cut_across() {
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..600i32 {
            let beside = [i - 1, i + 1].into_iter().filter(|j| j.div_euclid(10) == i / 10);
            col.extend(beside.chain([i - 10, i + 10].into_iter().filter(|j| (0..600).contains(j))));
            ptr.push(col.len() as i32);
        }
        let half = of_graph(&mut ptr, &mut col).expect("METIS");
        let count = |of| half.iter().filter(|half| **half == of).count();
        assert!(count(BETWEEN) <= 12 && count(0).abs_diff(count(1)) <= 24, "{} {}", count(0), count(1));
        let apart = |i: usize, j: i32| half[i] == BETWEEN || half[j as usize] != 1 - half[i];
        assert!((0..600).all(|i| col[ptr[i] as usize..ptr[i + 1] as usize].iter().all(|&j| apart(i, j))));
    }

    /// Two stars whose centres are coupled: one centre is enough between them. A leaf in the half of the other star needs its own centre.
    #[test]
    fn few_nodes_lie_between_halves() {
        // 0 with 1, 2, 3, and 1 with 4, 5
        let (ptr, col) = ([0, 3, 6, 7, 8, 9, 10], [1, 2, 3, 0, 4, 5, 0, 0, 1, 1]);
        let mut half = [0, 1, 0, 0, 1, 1];
        separate(&ptr, &col, &mut half);
        assert_eq!(half, [0, BETWEEN, 0, 0, 1, 1]);
        let mut half = [0, 1, 0, 1, 1, 1];
        separate(&ptr, &col, &mut half);
        assert_eq!(half, [BETWEEN, 1, 0, 1, 1, 1]);
    }
}
