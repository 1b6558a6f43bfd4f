//! The cost of a sparse Cholesky factorisation, counted in advance.

/// The size of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Entries of the factor, without those among rows that stay.
    pub entries: f64,
    /// Multiplications and additions: the sum of the squared lengths of the columns.
    pub operations: f64,
}

/// Return the work of the elimination of the nodes of a graph in a given order, where some unknowns stay (a Schur complement).
///
/// The neighbours of node i are `col[ptr[i]..ptr[i + 1]]`, with or without i itself. Node i is the `position[i]`-th to be eliminated, with
/// `weight[i]` unknowns; `stays` are (node, number of its unknowns that stay). The entries of a row of the factor are on its paths through the
/// elimination tree (Liu, SIAM J. Matrix Anal. Appl. 11, 1990, 134). So the count takes as many steps as the factor of the graph has entries.
pub fn factorisation(ptr: &[u32], col: &[u32], position: &[i32], weight: &[usize], stays: &[(usize, usize)]) -> Work {
    const NONE: u32 = u32::MAX;
    let nodes = ptr.len() - 1;
    let mut node_at = vec![0; nodes];
    position.iter().enumerate().for_each(|(node, &at)| node_at[at as usize] = node);
    // unknowns below the diagonal in the columns of each node, by its position
    let mut below = vec![0.0; nodes];
    let (mut parent, mut seen) = (vec![NONE; nodes], vec![NONE; nodes]);
    let rows = node_at.iter().map(|&node| (node, weight[node])).chain(stays.iter().copied());
    for (row, (node, unknowns)) in rows.enumerate() {
        let row = row as u32;
        if (row as usize) < nodes {
            seen[row as usize] = row;
        }
        for &other in &col[ptr[node] as usize..ptr[node + 1] as usize] {
            let mut at = position[other as usize] as u32;
            // a node that stays is below all nodes that are eliminated
            while at < row && seen[at as usize] != row {
                seen[at as usize] = row;
                below[at as usize] += unknowns as f64;
                if parent[at as usize] == NONE && (row as usize) < nodes {
                    parent[at as usize] = row;
                }
                at = parent[at as usize];
            }
        }
    }
    let mut work = Work::default();
    for (&node, below) in node_at.iter().zip(below) {
        for unknown in 0..weight[node] {
            let length = below + (weight[node] - unknown) as f64;
            work.entries += length;
            work.operations += length * length;
        }
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Count the work by elimination in a dense pattern, unknown by unknown.
    fn dense(pattern: &mut [Vec<bool>], order: &[usize]) -> Work {
        let mut work = Work::default();
        let mut gone = vec![false; pattern.len()];
        for &pivot in order {
            gone[pivot] = true;
            let below: Vec<usize> = (0..pattern.len()).filter(|&i| !gone[i] && pattern[pivot][i]).collect();
            let length = below.len() as f64 + 1.0;
            work.entries += length;
            work.operations += length * length;
            below.iter().for_each(|&i| below.iter().for_each(|&j| pattern[i][j] = true));
        }
        work
    }

    /// A grid of 4 x 3 nodes with 2 unknowns each, in an order without sense; one unknown of two nodes stays.
    #[test]
    fn it_is_that_of_an_elimination() {
        let (columns, nodes) = (4usize, 12usize);
        let near =
            |i: usize, j: usize| (i % columns).abs_diff(j % columns) <= 1 && (i / columns).abs_diff(j / columns) <= 1;
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..nodes {
            col.extend((0..nodes).filter(|&j| near(i, j)).map(|j| j as u32));
            ptr.push(col.len() as u32);
        }
        let position: Vec<i32> = (0..nodes as i32).map(|i| (5 * i + 3) % nodes as i32).collect();
        for stays in [vec![], vec![(2, 1), (7, 1)]] {
            let weight: Vec<usize> = (0..nodes).map(|i| if stays.contains(&(i, 1)) { 1 } else { 2 }).collect();
            let mut pattern: Vec<Vec<bool>> =
                (0..2 * nodes).map(|i| (0..2 * nodes).map(|j| near(i / 2, j / 2)).collect()).collect();
            let mut order: Vec<usize> = (0..nodes).collect();
            order.sort_by_key(|&i| position[i]);
            let order: Vec<usize> = order.iter().flat_map(|&i| (0..weight[i]).map(move |k| 2 * i + k)).collect();
            let work = factorisation(&ptr, &col, &position, &weight, &stays);
            assert_eq!(work, dense(&mut pattern, &order), "{stays:?}");
        }
    }
}
