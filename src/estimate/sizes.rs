//! From the error of each cell to the sizes of the next mesh.

use super::Estimate;
use crate::discretize::meshes::Meshes;
use crate::model::Model;

/// Sizes of elements at the corners of the cells of all bodies.
pub struct Sizes {
    /// Corners of a cell.
    pub stride: usize,
    /// Corners of all cells.
    pub corners: Vec<[f64; 3]>,
    /// Size wanted at each.
    pub sizes: Vec<f64>,
    /// Cells that a mesh of these sizes has, roughly.
    pub cells: f64,
}

/// Largest and least ratio of a new size to the old one: an estimate does not see farther.
const RANGE: (f64, f64) = (0.08, 2.0);

/// Sizes that cut the squared energy error to `share` of what it is, with as few cells as possible, or as far as `most` cells
/// go. Collective.
///
/// With h -> s h the squared error of a cell becomes s^(2p) eta^2, and s^-D cells take its place. The number of cells is least
/// where s^(2p + D) eta^2 is the same everywhere: every cell of the new mesh then has nearly the same error.
pub fn wanted(meshes: &dyn Meshes, model: &Model, estimate: &Estimate, share: f64, most: usize) -> Sizes {
    let bodies = model.bodies.len();
    let counts: Vec<usize> = (0..bodies).map(|body| meshes.cells(body).sizes.len()).collect();
    // every rank knows the meshes, the owner of a body its errors
    let mut errors = vec![0.0; counts.iter().sum()];
    let mut first = 0;
    for (of_body, count) in estimate.cells.iter().zip(&counts) {
        errors[first..first + of_body.len()].copy_from_slice(of_body);
        first += count;
    }
    model.exchange.sum(&mut errors);
    let dimension = meshes.cells(0).stride as f64 - 1.0;
    let degrees = (0..bodies).flat_map(|body| std::iter::repeat_n(meshes.degree(body) as f64, counts[body]));
    let all: Vec<(f64, f64)> = errors.iter().copied().zip(degrees).collect();
    let goal = share * errors.iter().sum::<f64>();
    let ratio = |level: f64, (error, p): (f64, f64)| {
        let free = (level / error.max(f64::MIN_POSITIVE)).powf(1.0 / (2.0 * p + dimension));
        free.clamp(RANGE.0, RANGE.1)
    };
    let left = |level: f64| -> f64 { all.iter().map(|&cell| cell.0 * ratio(level, cell).powf(2.0 * cell.1)).sum() };
    let cells = |level: f64| -> f64 { all.iter().map(|&cell| ratio(level, cell).powf(-dimension)).sum() };
    // both grow or fall with the level: bisect its logarithm
    let largest = errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (largest.ln() - 100.0, largest.ln() + 10.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        if left(middle.exp()) <= goal || cells(middle.exp()) > most as f64 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let level = low.exp();
    gather(meshes, &counts, |index| ratio(level, all[index]), cells(level))
}

/// Sizes `factor` times those of the meshes.
pub fn scaled(meshes: &dyn Meshes, bodies: usize, factor: f64) -> Sizes {
    let counts: Vec<usize> = (0..bodies).map(|body| meshes.cells(body).sizes.len()).collect();
    let total: usize = counts.iter().sum();
    gather(meshes, &counts, |_| factor, total as f64)
}

/// One size everywhere, so that the bodies together have about so many `cells`.
pub fn uniform(meshes: &dyn Meshes, bodies: usize, cells: usize) -> Sizes {
    let mut sizes = scaled(meshes, bodies, 1.0);
    let power = sizes.stride as f64 - 1.0;
    let volume: f64 = (0..bodies).flat_map(|body| meshes.cells(body).sizes).map(|size| size.powf(power)).sum::<f64>();
    sizes.sizes.fill((volume / cells as f64).powf(1.0 / power));
    sizes.cells = cells as f64;
    sizes
}

fn gather(meshes: &dyn Meshes, counts: &[usize], ratio: impl Fn(usize) -> f64, cells: f64) -> Sizes {
    let mut wanted = Sizes { stride: 0, corners: Vec::new(), sizes: Vec::new(), cells };
    let mut first = 0;
    for (body, &count) in counts.iter().enumerate() {
        let of_body = meshes.cells(body);
        wanted.stride = of_body.stride;
        // geometric mean over the cells around each corner
        let mut logs = vec![(0.0, 0.0); of_body.nodes.len()];
        for (index, corners) in of_body.corners.chunks_exact(of_body.stride).enumerate() {
            for &node in corners {
                let (sum, count) = &mut logs[node as usize];
                *sum += (of_body.sizes[index] * ratio(first + index)).ln();
                *count += 1.0;
            }
        }
        for &node in &of_body.corners {
            let (sum, count) = logs[node as usize];
            wanted.corners.push(of_body.nodes[node as usize]);
            wanted.sizes.push((sum / count).exp());
        }
        first += count;
    }
    wanted
}
