//! The memory and operations that factorisations take, and the memory that the machine has.

use crate::linalg::portable::{log2, pow};

/// Return the bytes that programs can still take without swapping, as Linux reports them. On other systems there is no limit.
pub fn available() -> usize {
    crate::file::bytes_in_proc("/proc/meminfo", "MemAvailable").map_or(usize::MAX, |bytes| bytes as usize)
}

/// Return the estimated bytes of the sparse Cholesky factor of a plane body by nested dissection. They grow as n log n; the constant was
/// measured on blocks of 32 000 to 500 000 dofs.
pub fn in_plane(dofs: usize) -> usize {
    let n = dofs as f64;
    (60.0 * n * log2(n + 2.0)) as usize
}

/// Return the bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
pub fn of_condensed(retained: usize) -> usize {
    36 * retained * retained
}

/// Return the estimated operations of a sparse Cholesky factorisation of a plane body by nested dissection, measured on the same blocks as [`in_plane`].
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
