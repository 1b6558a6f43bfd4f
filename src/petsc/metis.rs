//! Nested dissection and partition of graphs by METIS, without which Debian's MUMPS is built.
//!
//! The library is loaded when it is first needed and not linked. Its header belongs to another package, and the libraries of SCOTCH that
//! PETSc loads have functions of the same names with other arguments.

use crate::error::{Error, Kind, Result};
use libloading::Library;
use std::ffi::{CStr, c_int};
use std::ptr::null_mut;
use std::sync::OnceLock;

/// The library whose functions have the arguments below. Other libraries do not see its symbols.
const LIBRARY: &str = "libmetis.so.5";

type NodeNd = unsafe extern "C" fn(*mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32) -> c_int;

type PartGraph = unsafe extern "C" fn(
    *mut i32,
    *mut i32,
    *mut i32,
    *mut i32,
    *mut i32,
    *mut i32,
    *mut i32,
    *mut i32,
    *mut f32,
    *mut f32,
    *mut i32,
    *mut i32,
    *mut i32,
) -> c_int;

/// Return a function of METIS by its name.
///
/// # Safety
/// `T` is the type of the function of this name.
unsafe fn function<T: Copy>(name: &CStr) -> Result<T> {
    static METIS: OnceLock<Option<Library>> = OnceLock::new();
    // SAFETY: its initialisers run as in any program that links it; it stays loaded.
    let library = METIS.get_or_init(|| unsafe { Library::new(LIBRARY) }.ok());
    // SAFETY: the caller's promise.
    let function = library.as_ref().and_then(|library| unsafe { library.get::<T>(name.to_bytes_with_nul()) }.ok());
    function.map(|function| *function).ok_or_else(|| {
        Error::new(Kind::Solver, format!("METIS ({LIBRARY}) was not found"))
            .because("large bodies, and dofs near stiff contact, are eliminated in its order")
            .help("`apt-get install libmetis5`, or for a condensed body MUMPS' own order: -mat_mumps_icntl_7 0")
    })
}

/// Return the position of each node of a graph, from 0, in an elimination order by nested dissection.
///
/// The neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`, without `i` itself. The graph is symmetric.
///
/// # Errors
/// When METIS is not installed, or does not return an order.
pub fn nested_dissection(ptr: &mut [i32], col: &mut [i32]) -> Result<Vec<i32>> {
    let nodes = ptr.len() - 1;
    if col.is_empty() {
        // METIS refuses graphs without edges
        return Ok((0..nodes as i32).collect());
    }
    // SAFETY: METIS 5 has these arguments.
    let node_nd = unsafe { function::<NodeNd>(c"METIS_NodeND") }?;
    let (mut count, mut order, mut position) = (nodes as i32, vec![-1; nodes], vec![-1; nodes]);
    // SAFETY: it reads the graph and writes one number for each node to each of the last two arrays.
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
    // a METIS with 64-bit numbers would not return a permutation
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

/// Return the part of each node of a graph. The `parts` parts have about the same size and few edges between them.
///
/// The arrays are those of [`nested_dissection`].
///
/// # Errors
/// When METIS is not installed, or does not return parts.
pub fn partition(ptr: &mut [i32], col: &mut [i32], parts: usize) -> Result<Vec<i32>> {
    let nodes = ptr.len() - 1;
    if col.is_empty() {
        return Ok((0..nodes).map(|node| (node * parts / nodes) as i32).collect());
    }
    // SAFETY: METIS 5 has these arguments.
    let part_graph = unsafe { function::<PartGraph>(c"METIS_PartGraphRecursive") }?;
    let (mut count, mut constraints, mut asked, mut cut) = (nodes as i32, 1, parts as i32, 0);
    let mut part = vec![-1; nodes];
    // SAFETY: it reads the graph, writes one number for each node to the last array and one number to the last but one; null means a default.
    let code = unsafe {
        part_graph(
            &mut count,
            &mut constraints,
            ptr.as_mut_ptr(),
            col.as_mut_ptr(),
            null_mut(),
            null_mut(),
            null_mut(),
            &mut asked,
            null_mut(),
            null_mut(),
            null_mut(),
            &mut cut,
            part.as_mut_ptr(),
        )
    };
    if code != 1 || part.iter().any(|part| !(0..asked).contains(part)) {
        return Err(Error::new(Kind::Solver, "METIS returned no parts")
            .because(format!("METIS_PartGraphRecursive returned {code}"))
            .help("take another solver: --set solver=mumps"));
    }
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::{nested_dissection, partition};

    /// The separator in the middle of a chain of nodes comes last.
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
        // two ends and a middle of the same length
        let thirds = partition(&mut ptr, &mut col, 3).expect("METIS");
        let changes = thirds.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let most = (0..3).map(|part| thirds.iter().filter(|of| **of == part).count()).max();
        assert!(changes == 2 && most < Some(140), "{changes} {most:?}");
        assert_eq!(partition(&mut [0, 0, 0], &mut [], 2).expect("no edges"), [0, 1]);
    }
}
