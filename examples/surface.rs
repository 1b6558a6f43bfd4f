//! Makes a self-affine rough surface as a file for `[data.NAME]`: `cargo run --release --example surface -- --help`.
//!
//! A Gaussian field whose power spectrum is flat up to a roll-off and falls as q^(-2-2H) from there to the shortest
//! wave: sum over waves of a_q sigma(q) with normal a_q, in both directions a product of matrices.

use clap::Parser;
use nalgebra::DMatrix;
use std::f64::consts::PI;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Makes a self-affine rough surface as a file for `[data.NAME]`.
#[derive(Parser)]
struct Asked {
    /// File to write: .npy, or rows of numbers parted by commas
    file: PathBuf,
    /// Points along each side
    #[arg(long, default_value = "1024", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..))]
    points: usize,
    /// Length of a side
    #[arg(long, default_value = "1")]
    length: f64,
    /// Hurst exponent
    #[arg(long, default_value = "0.8")]
    hurst: f64,
    /// Waves in a side at the roll-off: longer ones have one height
    #[arg(long, default_value = "4")]
    rolloff: f64,
    /// Waves in a side at the upper cut: there are no shorter ones
    #[arg(long, default_value = "128")]
    cut: f64,
    /// Root mean square of the heights
    #[arg(long, default_value = "1e-4")]
    rms: f64,
    /// Which surface
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Mirror planes at all sides instead of a period: cosines alone, the last point on the far side
    #[arg(long)]
    even: bool,
}

fn main() -> std::io::Result<()> {
    let asked = Asked::parse();
    let heights = surface(&asked);
    let mut out = BufWriter::new(File::create(&asked.file)?);
    let n = asked.points;
    if asked.file.extension().is_some_and(|extension| extension == "npy") {
        // a header of 128 bytes, then the rows of the matrix one behind the other
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({n}, {n}), }}");
        out.write_all(b"\x93NUMPY\x01\x00\x76\x00")?;
        writeln!(out, "{header:<117}")?;
        heights.transpose().iter().try_for_each(|height| out.write_all(&height.to_le_bytes()))?;
    } else {
        for row in heights.row_iter() {
            let numbers: Vec<String> = row.iter().map(|height| format!("{height:.6e}")).collect();
            writeln!(out, "{}", numbers.join(","))?;
        }
    }
    out.flush()
}

/// Heights: rows along the second direction, columns along the first.
fn surface(asked: &Asked) -> DMatrix<f64> {
    let Asked { points: n, length, even, .. } = *asked;
    let waves = (asked.cut.floor() as usize).min((n - 1) / 2);
    // waves in a side: 0, 1, 1, 2, 2, ... as cosine and sine, or halves of them as cosines
    let modes: Vec<(f64, bool)> = if even {
        (0..=2 * waves).map(|k| (k as f64 / 2.0, true)).collect()
    } else {
        (0..=2 * waves).map(|k| (k.div_ceil(2) as f64, k % 2 == 0)).collect()
    };
    let spacing = length / if even { n - 1 } else { n } as f64;
    let basis = DMatrix::from_fn(n, modes.len(), |i, k| {
        let (waves, is_cosine) = modes[k];
        let phase = 2.0 * PI * waves * spacing * i as f64 / length;
        if is_cosine { phase.cos() } else { phase.sin() }
    });
    let mut draw = normal(asked.seed);
    let size = |q: f64| match () {
        _ if q == 0.0 || q > asked.cut => 0.0,
        _ => (q.max(asked.rolloff) / asked.rolloff).powf(-1.0 - asked.hurst),
    };
    let amplitudes = DMatrix::from_fn(modes.len(), modes.len(), |k, l| draw() * size(modes[k].0.hypot(modes[l].0)));
    let heights = &basis * amplitudes * basis.transpose();
    let mean = heights.mean();
    let rms = (heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / (n * n) as f64).sqrt();
    heights.map(|h| (h - mean) * asked.rms / rms)
}

/// Normally distributed numbers (Box and Muller) from SplitMix64.
fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    let mut uniform = move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    move || (-2.0 * (1.0 - uniform()).ln()).sqrt() * (2.0 * PI * uniform()).cos()
}
