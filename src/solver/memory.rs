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

/// Estimated bytes of a sparse Cholesky factor of a body by nested dissection: the growth n log n (plane) and n^(4/3) (space)
/// with factors measured on blocks of 32 000 to 500 000 dofs.
pub fn of_factor(dimension: usize, dofs: usize) -> usize {
    let n = dofs as f64;
    let bytes = if dimension == 2 { 60.0 * n * (n + 2.0).log2() } else { 220.0 * n.powf(4.0 / 3.0) };
    bytes as usize
}

/// Bytes of a condensed body besides its sparse factor: S with its pattern, G, and the factor of G.
pub fn of_condensed(retained: usize) -> usize {
    36 * retained * retained
}

/// Estimated operations of a sparse Cholesky factorisation by nested dissection; factors as for [`of_factor`].
pub fn work_of_factor(dimension: usize, dofs: usize) -> f64 {
    let n = dofs as f64;
    if dimension == 2 { 56.0 * n.powf(1.5) } else { 19.0 * n * n }
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

    /// Measured by MUMPS with METIS: 207 000 dofs in space took 2413 MB and 8.0e11 operations, 502 000 in the plane 538 MB and
    /// 2.0e10.
    #[test]
    fn estimates_are_near_what_was_measured() {
        let near = |estimate: f64, measured: f64| (0.7..1.5).contains(&(estimate / measured));
        assert!(near(of_factor(3, 207_000) as f64, 2413e6) && near(of_factor(2, 502_000) as f64, 538e6));
        assert!(near(work_of_factor(3, 207_000), 8e11) && near(work_of_factor(2, 502_000), 2e10));
    }
}
