//! Nested dissection of graphs by METIS.

use super::call::fit;
use super::error::{Error, Result};
use super::ffi::{METIS_NodeND, idx_t};
use std::ptr::null_mut;

/// A symmetric graph: the neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`, without `i` itself.
pub struct Graph {
    /// Starts of the neighbours of each node, one more than there are nodes.
    pub ptr: Vec<i32>,
    /// The neighbours.
    pub col: Vec<i32>,
}

/// Return the position of each node of a graph, from 0, in an elimination order by nested dissection.
///
/// # Errors
/// When METIS does not return an order.
#[allow(clippy::useless_conversion, clippy::unnecessary_fallible_conversions)]
pub fn nested_dissection(graph: Graph) -> Result<Vec<i32>> {
    let nodes = graph.ptr.len() - 1;
    if graph.col.is_empty() {
        // METIS refuses graphs without edges
        return Ok((0..nodes as i32).collect());
    }
    // arrays of integers with 32 bits are not copied
    let array = |values: Vec<i32>| values.into_iter().map(idx_t::from).collect::<Vec<_>>();
    let mut count: idx_t = fit("METIS", "nodes", nodes)?;
    let (mut ptr, mut col) = (array(graph.ptr), array(graph.col));
    let (mut order, mut position): (Vec<idx_t>, Vec<idx_t>) = (vec![-1; nodes], vec![-1; nodes]);
    let (i, j, none) = (ptr.as_mut_ptr(), col.as_mut_ptr(), null_mut());
    // SAFETY: it reads the graph and writes one number for each node to each of the last two arrays.
    let code = unsafe { METIS_NodeND(&mut count, i, j, none, none, order.as_mut_ptr(), position.as_mut_ptr()) };
    let mut seen = vec![false; nodes];
    let is_new = |at: &idx_t| {
        let slot = usize::try_from(*at).ok().and_then(|at| seen.get_mut(at));
        slot.is_some_and(|seen| !std::mem::replace(seen, true))
    };
    if code != 1 || !position.iter().all(is_new) {
        return Err(Error::new("METIS returned no elimination order")
            .because(format!("METIS_NodeND returned {code}"))
            .help("take another solver: --set solver=mumps"));
    }
    Ok(position.into_iter().map(|at| at.try_into().unwrap_or(-1)).collect())
}

#[cfg(test)]
mod tests {
    use super::{Graph, nested_dissection};

    /// The separator in the middle of a chain of nodes comes last.
    #[test]
    fn a_chain_is_cut_in_its_middle() {
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..401i32 {
            col.extend([i - 1, i + 1].into_iter().filter(|j| (0..401).contains(j)));
            ptr.push(col.len() as i32);
        }
        let position = nested_dissection(Graph { ptr, col }).expect("METIS");
        let last = position.iter().position(|&at| at == 400).expect("a permutation");
        assert!((100..300).contains(&last), "{last}");
        let without_edges = Graph { ptr: vec![0; 3], col: Vec::new() };
        assert_eq!(nested_dissection(without_edges).expect("no edges"), [0, 1]);
    }
}
