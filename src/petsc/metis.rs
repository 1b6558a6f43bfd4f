//! Nested dissection of graphs by METIS.
//!
//! The library is opened when it is first needed: the file that has METIS for PETSc, or else one of METIS' usual names. Its integers have 32 or 64
//! bits, which it shows itself. Libraries of SCOTCH have some functions of the same names, with other arguments in older versions.

use super::library::fit;
use crate::error::{Error, Kind, Result};
use libloading::Library;
use std::ffi::{c_int, c_void};
use std::ptr::null_mut;
use std::sync::OnceLock;

/// The file that has METIS in the PETSc of the build, and names of METIS 5.
const LIBRARIES: [Option<&str>; 3] = [option_env!("WINKLER_METIS_LIBRARY"), Some("libmetis.so.5"), Some("libmetis.so")];

/// The arguments of METIS_NodeND, with its integers.
type NodeNd<T> = unsafe extern "C" fn(*mut T, *mut T, *mut T, *mut T, *mut T, *mut T, *mut T) -> c_int;

/// METIS with the width of its integers.
struct Metis {
    library: Library,
    is_wide: bool,
}

/// Return METIS, which is opened at the first call, or `None` if it is not found.
fn metis() -> Option<&'static Metis> {
    static METIS: OnceLock<Option<Metis>> = OnceLock::new();
    METIS.get_or_init(|| LIBRARIES.iter().flatten().find_map(|name| Metis::open(name))).as_ref()
}

/// Return whether METIS is there. Without it, elimination takes MUMPS' own order.
pub fn has_metis() -> bool {
    metis().is_some()
}

impl Metis {
    /// Open a file and find out the width of METIS' integers. Return `None` without METIS 5.
    fn open(name: &str) -> Option<Self> {
        // SAFETY: its initialisers run as in any program that links it; it stays loaded.
        let library = unsafe { Library::new(name) }.ok()?;
        // SAFETY: METIS 5 has this function with 40 integers, which it sets to -1. SCOTCH has no METIS_Free.
        let options = unsafe {
            library.get::<*mut c_void>(b"METIS_Free\0").ok()?;
            let set = library.get::<unsafe extern "C" fn(*mut i64) -> c_int>(b"METIS_SetDefaultOptions\0").ok()?;
            let mut options = [0i64; 40];
            set(options.as_mut_ptr());
            options
        };
        Some(Self { library, is_wide: options[39] == -1 })
    }

    /// Return the result of METIS_NodeND and the position of each node in the order of elimination.
    fn node_nd<T: Integer>(&self, graph: Graph) -> Result<(c_int, Vec<i32>)> {
        // SAFETY: METIS 5 has this function with these arguments, and the caller chose the width.
        let found = unsafe { self.library.get::<NodeNd<T>>(b"METIS_NodeND\0") };
        let node_nd = found.map_err(|cause| missing().because(cause.to_string()))?;
        let nodes = graph.ptr.len() - 1;
        // arrays of integers with 32 bits are not copied
        let array = |values: Vec<i32>| values.into_iter().map(T::from).collect::<Vec<_>>();
        let mut count = T::from(fit("METIS", "nodes", nodes)?);
        let (mut ptr, mut col) = (array(graph.ptr), array(graph.col));
        let (mut order, mut position) = (vec![T::from(-1); nodes], vec![T::from(-1); nodes]);
        let (i, j, none) = (ptr.as_mut_ptr(), col.as_mut_ptr(), null_mut());
        // SAFETY: it reads the graph and writes one number for each node to each of the last two arrays.
        let code = unsafe { node_nd(&mut count, i, j, none, none, order.as_mut_ptr(), position.as_mut_ptr()) };
        // a number that is no node becomes -1
        Ok((code, position.into_iter().map(|at| at.try_into().unwrap_or(-1)).collect()))
    }
}

/// An integer of METIS (idx_t).
trait Integer: Copy + From<i32> + TryInto<i32> {}
impl Integer for i32 {}
impl Integer for i64 {}

/// A symmetric graph: the neighbours of node `i` are `col[ptr[i]..ptr[i + 1]]`, without `i` itself.
pub struct Graph {
    /// Starts of the neighbours of each node, one more than there are nodes.
    pub ptr: Vec<i32>,
    /// The neighbours.
    pub col: Vec<i32>,
}

/// Return the error of a missing METIS.
fn missing() -> Error {
    Error::new(Kind::Solver, "METIS 5 was not found").help("`apt-get install libmetis5`, or a PETSc with METIS")
}

/// Return the position of each node of a graph, from 0, in an elimination order by nested dissection.
///
/// # Errors
/// When METIS is not there ([`has_metis`]), or does not return an order.
pub fn nested_dissection(graph: Graph) -> Result<Vec<i32>> {
    let nodes = graph.ptr.len() - 1;
    if graph.col.is_empty() {
        // METIS refuses graphs without edges
        return Ok((0..nodes as i32).collect());
    }
    let metis = metis().ok_or_else(missing)?;
    let (code, position) = if metis.is_wide { metis.node_nd::<i64>(graph) } else { metis.node_nd::<i32>(graph) }?;
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
    use super::{Graph, nested_dissection};

    /// The separator in the middle of a chain of nodes comes last.
    #[test]
    fn a_chain_is_cut_in_its_middle() {
        let chain = || {
            let (mut ptr, mut col) = (vec![0], Vec::new());
            for i in 0..401i32 {
                col.extend([i - 1, i + 1].into_iter().filter(|j| (0..401).contains(j)));
                ptr.push(col.len() as i32);
            }
            Graph { ptr, col }
        };
        let without_edges = || Graph { ptr: vec![0; 3], col: Vec::new() };
        let position = nested_dissection(chain()).expect("METIS");
        let last = position.iter().position(|&at| at == 400).expect("a permutation");
        assert!((100..300).contains(&last), "{last}");
        assert_eq!(nested_dissection(without_edges()).expect("no edges"), [0, 1]);
    }
}
