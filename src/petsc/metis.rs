//! Nested dissection and partitions by METIS: Debian's MUMPS is built without it.
//!
//! The library is loaded when it is first needed: its header belongs to another package, and libraries of SCOTCH, which
//! PETSc loads, have functions of the same names with other arguments.

use crate::error::{Error, Kind, Result};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr::null_mut;

unsafe extern "C" {
    fn dlopen(file: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// The library whose version has the arguments of [`NodeNd`].
const LIBRARY: &CStr = c"libmetis.so.5";
/// Symbols are found at once; other libraries do not see them.
const RTLD_NOW: c_int = 2;

type NodeNd = unsafe extern "C" fn(*mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32, *mut i32) -> c_int;

/// Nodes, constraints, graph (2), weights of nodes, sizes, weights of edges, parts, their shares, imbalance, options, cut, part.
type Kway = unsafe extern "C" fn(
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

/// A function of METIS by its name.
fn function(name: &CStr) -> Result<*mut c_void> {
    // SAFETY: the names end with a zero byte; a library stays loaded.
    let function = unsafe {
        let library = dlopen(LIBRARY.as_ptr(), RTLD_NOW);
        if library.is_null() { null_mut() } else { dlsym(library, name.as_ptr()) }
    };
    match function.is_null() {
        false => Ok(function),
        true => Err(Error::new(Kind::Solver, format!("METIS ({}) was not found", LIBRARY.to_string_lossy()))),
    }
}

/// Deals the nodes of a graph out to `parts` of about the same sum of `weight` (one a node, from 1), with few edges between them: the
/// part of each node. A part may be empty.
///
/// The neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`, without `i` itself; the graph is symmetric.
///
/// # Errors
/// When METIS is not installed, or does not return parts.
pub fn partition(ptr: &mut [i32], col: &mut [i32], weight: &mut [i32], parts: usize) -> Result<Vec<u32>> {
    let nodes = ptr.len() - 1;
    if parts < 2 || nodes == 0 {
        return Ok(vec![0; nodes]);
    }
    let function = function(c"METIS_PartGraphKway").map_err(|error| {
        error
            .because("it deals the bodies out to several ranks")
            .help("`apt-get install libmetis5`, or run on one rank")
    })?;
    let (mut count, mut constraints, mut wanted, mut cut) = (nodes as i32, 1, parts as i32, 0);
    let mut part = vec![-1; nodes];
    // SAFETY: METIS 5 has these arguments, null for what is left to it; it reads the graph and the weights, and writes one number a
    // node to the last.
    let code = unsafe {
        let kway: Kway = std::mem::transmute(function);
        kway(
            &mut count,
            &mut constraints,
            ptr.as_mut_ptr(),
            col.as_mut_ptr(),
            weight.as_mut_ptr(),
            null_mut(),
            null_mut(),
            &mut wanted,
            null_mut(),
            null_mut(),
            null_mut(),
            &mut cut,
            part.as_mut_ptr(),
        )
    };
    // a METIS with 64-bit numbers would not return this
    let part: Vec<u32> = part.into_iter().map(|part: i32| part as u32).collect();
    if code != 1 || part.iter().any(|&part| part as usize >= parts) {
        return Err(Error::new(Kind::Solver, "METIS returned no partition")
            .because(format!("METIS_PartGraphKway returned {code}"))
            .help("run on one rank"));
    }
    Ok(part)
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
    let function = function(c"METIS_NodeND").map_err(|error| {
        error
            .because("the condensed solver takes the elimination order of large bodies from it")
            .help("`apt-get install libmetis5`, or take MUMPS' own order: -mat_mumps_icntl_7 0")
    })?;
    let (mut count, mut order, mut position) = (nodes as i32, vec![-1; nodes], vec![-1; nodes]);
    // SAFETY: METIS 5 has these arguments; it reads the graph and writes one number a node to each of the last two.
    let code = unsafe {
        let node_nd: NodeNd = std::mem::transmute(function);
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
    use super::{nested_dissection, partition};

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

    /// A chain whose first nodes are heavy is cut where the weights are equal, once.
    #[test]
    fn parts_have_equal_weights() {
        let (mut ptr, mut col) = (vec![0], Vec::new());
        for i in 0..400i32 {
            col.extend([i - 1, i + 1].into_iter().filter(|j| (0..400).contains(j)));
            ptr.push(col.len() as i32);
        }
        let mut weight: Vec<i32> = (0..400).map(|i| if i < 100 { 3 } else { 1 }).collect();
        let part = partition(&mut ptr, &mut col, &mut weight, 2).expect("METIS");
        let sum: i32 = (0..400).filter(|&i| part[i] == 0).map(|i| weight[i]).sum();
        assert!((280..=320).contains(&sum), "{sum}");
        assert_eq!(part.windows(2).filter(|pair| pair[0] != pair[1]).count(), 1);
        assert_eq!(partition(&mut [0, 0], &mut [], &mut [1], 1).expect("one part"), [0]);
    }
}
