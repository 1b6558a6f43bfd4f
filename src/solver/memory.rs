//! Memory that factorisations take, and what the machine has.

/// Bytes that programs can still take without swapping, as Linux tells; no limit where it does not.
pub fn available() -> usize {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    available_in(&text).unwrap_or(usize::MAX)
}

fn available_in(meminfo: &str) -> Option<usize> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: usize = line.split_whitespace().next()?.parse().ok()?;
    Some(kilobytes * 1024)
}

/// Estimated bytes of a sparse Cholesky factor of a body in the plane by nested dissection: the growth n log n with factors
/// measured on blocks of 32 000 to 500 000 dofs.
pub fn in_plane(dofs: usize) -> usize {
    let n = dofs as f64;
    (60.0 * n * (n + 2.0).log2()) as usize
}

/// Bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
pub fn of_condensed(retained: usize) -> usize {
    36 * retained * retained
}

/// Estimated operations of a sparse Cholesky factorisation in the plane by nested dissection; factors as for [`in_plane`].
pub fn work_in_plane(dofs: usize) -> f64 {
    56.0 * (dofs as f64).powf(1.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_linux_is_read() {
        let text = "MemTotal:       24000000 kB\nMemFree:  5 kB\nMemAvailable:   20000 kB\n";
        assert_eq!(available_in(text), Some(20_480_000));
        assert_eq!(available_in("MemFree: 1 kB"), None);
        assert!(available() > 1_000_000);
    }

    /// Measured by MUMPS with METIS: 502 000 dofs took 538 MB and 2.0e10 operations.
    #[test]
    fn estimates_are_near_what_was_measured() {
        let near = |estimate: f64, measured: f64| (0.7..1.5).contains(&(estimate / measured));
        assert!(near(in_plane(502_000) as f64, 538e6) && near(work_in_plane(502_000), 2e10));
    }
}
