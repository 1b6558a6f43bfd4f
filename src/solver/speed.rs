//! How fast this machine multiplies with sparse matrices in memory.
//!
//! A factorisation is mostly dense algebra on numbers in the cache. Multigrid reads sparse matrices from memory. Processors differ by a factor of five
//! in the speed of memory and much less in dense algebra, so a choice between the two that was measured on one machine is wrong on another.

use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Entries a second on the machine of the table in docs/solvers.md.
pub const REFERENCE: f64 = 5.3e8;

/// Rows of the matrix that is multiplied. With [`PER_ROW`] entries in each it takes 39 MB, more than the caches of a core hold.
const ROWS: usize = 120_000;

/// Entries in a row of the matrix.
const PER_ROW: usize = 27;

/// Number of measurements. The fastest counts, because other work of the machine only makes a product slower.
const TIMES: usize = 3;

/// Return how many entries of a sparse matrix one core multiplies in a second. The first call measures it, which takes 40 to 70 ms.
pub fn products() -> f64 {
    static SPEED: OnceLock<f64> = OnceLock::new();
    *SPEED.get_or_init(measured)
}

fn measured() -> f64 {
    // columns are neighbours on a lattice, as in the matrix of a mesh
    let neighbour = |row: usize, k: usize| ((row + 3000 * (k / 9) + 55 * (k / 3 % 3) + k % 3) % ROWS) as u32;
    let columns: Vec<u32> = (0..ROWS).flat_map(|row| (0..PER_ROW).map(move |k| neighbour(row, k))).collect();
    let values = vec![1.0; ROWS * PER_ROW];
    let (x, mut y) = (vec![1.0; ROWS], vec![0.0; ROWS]);
    let mut least = f64::INFINITY;
    for _ in 0..TIMES {
        let began = Instant::now();
        for (row, y) in y.iter_mut().enumerate() {
            let row = PER_ROW * row..PER_ROW * (row + 1);
            *y = columns[row.clone()].iter().zip(&values[row]).map(|(column, value)| value * x[*column as usize]).sum();
        }
        black_box(&mut y);
        least = least.min(began.elapsed().as_secs_f64());
    }
    (ROWS * PER_ROW) as f64 / least
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The speed lies between that of a machine of twenty years ago and one that does not exist yet.
    #[test]
    fn a_speed_is_measured() {
        let speed = products();
        assert!((1e6..1e12).contains(&speed), "{speed:e}");
    }
}
