//! Nested dissection by METIS: Debian's MUMPS is built without it.
//!
//! The library is loaded when it is first needed: its header belongs to another package, and libraries of SCOTCH, which
//! PETSc loads, have functions of the same names with other arguments.

use crate::error::{Error, Kind, Result};
use libloading::Library;
use std::ffi::c_int;
use std::ptr::null_mut;
use std::sync::OnceLock;

/// The library whose version has the arguments of [`NodeNd`]; other libraries do not see its symbols.
const LIBRARY: &str = "libmetis.so.5";

type NodeNd = unsafe extern "C" fn(*mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32) -> c_int;

/// The function of METIS.
fn node_nd() -> Result<NodeNd> {
    static METIS: OnceLock<Option<Library>> = OnceLock::new();
    // SAFETY: the initialisers are those of any program that links it; it stays loaded.
    let library = METIS.get_or_init(|| unsafe { Library::new(LIBRARY) }.ok());
    // SAFETY: METIS 5 has these arguments.
    let function = library.as_ref().and_then(|library| unsafe { library.get::<NodeNd>(b"METIS_NodeND") }.ok());
    function
        .map(|function| *function)
        .ok_or_else(|| Error::new(Kind::Solver, format!("METIS ({LIBRARY}) was not found")))
}

/// Elimination order of a graph's nodes by nested dissection: position of each node, from 0.
///
/// The neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`, without `i` itself; the graph is symmetric.
///
/// # Errors
/// When METIS is not installed, or does not return an order.
pub fn nested_dissection(ptr: &mut [i32], col: &mut [i32]) -> Result<Vec<i32>> {
    let nodes = ptr.len() - 1;
    if col.is_empty() {
        // METIS refuses graphs without edges
        return Ok((0..nodes as i32).collect());
    }
    let node_nd = node_nd().map_err(|error| {
        error
            .because("the condensed solver takes the elimination order of large bodies from it")
            .help("`apt-get install libmetis5`, or take MUMPS' own order: -mat_mumps_icntl_7 0")
    })?;
    let (mut count, mut order, mut position) = (nodes as i32, vec![-1; nodes], vec![-1; nodes]);
    // SAFETY: it reads the graph and writes one number a node to each of the last two.
    let code = unsafe {
        node_nd(
            &mut count,
            ptr.as_mut_ptr(),
            col.as_mut_ptr(),
            null_mut(),
            null_mut(),
            order.as_mut_ptr(),
            position.as_mut_ptr(),
        )
    };
    // a METIS with 64-bit numbers would not return this
    let mut seen = vec![false; nodes];
    let valid = position.iter().all(|&at| {
        let slot = usize::try_from(at).ok().and_then(|at| seen.get_mut(at));
        slot.is_some_and(|seen| !std::mem::replace(seen, true))
    });
    if code != 1 || !valid {
        return Err(Error::new(Kind::Solver, "METIS returned no elimination order")
            .because(format!("METIS_NodeND returned {code}"))
            .help("take another solver: --set solver=mumps"));
    }
    Ok(position)
}

#[cfg(test)]
mod tests {
    use super::nested_dissection;

    /// A chain of nodes: the separator in its middle comes last.
    #[test]
    fn a_chain_is_cut_in_its_middle() {
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..401i32 {
            col.extend([i - 1, i + 1].into_iter().filter(|j| (0..401).contains(j)));
            ptr.push(col.len() as i32);
        }
        let position = nested_dissection(&mut ptr, &mut col).expect("METIS");
        let last = position.iter().position(|&at| at == 400).expect("a permutation");
        assert!((100..300).contains(&last), "{last}");
        assert_eq!(nested_dissection(&mut [0, 0, 0], &mut []).expect("no edges"), [0, 1]);
    }
}
