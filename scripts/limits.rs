//! What one core of this machine can do at most, for `scripts/benchmark`: prints the bandwidth of its memory and its rate in a
//! dense Cholesky factorisation as two numbers, GB/s and GF/s.

use std::hint::black_box;
use std::time::Instant;
use winkler::error::Result;
use winkler::petsc::{Session, cholesky};

/// Numbers of each of the three arrays of the triad: far more than any cache holds.
const LENGTH: usize = 20_000_000;

/// Rows of the dense matrix.
const ROWS: usize = 3000;

/// Repetitions, of which the best counts.
const TIMES: usize = 5;

fn main() -> Result<()> {
    let session = Session::start(&[])?;
    session.set_blas_threads(1);
    println!("{:.1} {:.1}", triad(), factorization()?);
    Ok(())
}

/// a = b + s c, counted as 24 bytes a number as in STREAM.
fn triad() -> f64 {
    let (b, c) = (vec![1.0f64; LENGTH], vec![2.0f64; LENGTH]);
    let mut a = vec![0.0f64; LENGTH];
    let seconds = best(|| {
        let s = black_box(3.0);
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = b + s * c;
        }
        black_box(&mut a);
    });
    24e-9 * LENGTH as f64 / seconds
}

/// n^3/3 operations of LAPACK's dpotrf.
fn factorization() -> Result<f64> {
    let mut seconds = f64::INFINITY;
    for _ in 0..TIMES {
        let mut matrix = vec![0.5; ROWS * ROWS];
        (0..ROWS).for_each(|i| matrix[i * (ROWS + 1)] = ROWS as f64);
        let began = Instant::now();
        cholesky(&mut matrix, ROWS)?;
        seconds = seconds.min(began.elapsed().as_secs_f64());
        black_box(&matrix);
    }
    Ok(1e-9 / 3.0 * (ROWS as f64).powi(3) / seconds)
}

/// Seconds of the fastest repetition.
fn best(mut work: impl FnMut()) -> f64 {
    let once = |_| {
        let began = Instant::now();
        work();
        began.elapsed().as_secs_f64()
    };
    (0..TIMES).map(once).fold(f64::INFINITY, f64::min)
}
