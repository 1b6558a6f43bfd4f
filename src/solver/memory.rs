//! Memory that factorisations take, and what the machine has.

use crate::linalg::portable::{log2, pow};

/// Bytes that programs can still take without swapping, as Linux tells; no limit where it does not.
pub fn available() -> usize {
    crate::file::bytes_in_proc("/proc/meminfo", "MemAvailable").map_or(usize::MAX, |bytes| bytes as usize)
}

/// Estimated bytes of a sparse Cholesky factor of a body in the plane by nested dissection: the growth n log n with factors
/// measured on blocks of 32 000 to 500 000 dofs.
pub fn in_plane(dofs: usize) -> usize {
    let n = dofs as f64;
    (60.0 * n * log2(n + 2.0)) as usize
}

/// Bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
pub fn of_condensed(retained: usize) -> usize {
    36 * retained * retained
}

/// Estimated operations of a sparse Cholesky factorisation in the plane by nested dissection; factors as for [`in_plane`].
pub fn work_in_plane(dofs: usize) -> f64 {
    56.0 * pow(dofs as f64, 1.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measured by MUMPS with METIS: 502 000 dofs took 538 MB and 2.0e10 operations.
    #[test]
    fn estimates_are_near_what_was_measured() {
        let near = |estimate: f64, measured: f64| (0.7..1.5).contains(&(estimate / measured));
        assert!(near(in_plane(502_000) as f64, 538e6) && near(work_in_plane(502_000), 2e10));
    }
}
