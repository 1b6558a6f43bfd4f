//! The step from the error of each cell to the sizes of the next mesh.

use super::Estimate;
use super::field;
use crate::discretize::meshes::Meshes;
use crate::model::Model;

/// Sizes of elements at the corners of the cells of all bodies.
pub struct Sizes {
    /// Number of corners of a cell.
    pub stride: usize,
    /// Coordinates of the corners of all cells.
    pub corners: Vec<[f64; 3]>,
    /// Requested size at each corner.
    pub sizes: Vec<f64>,
    /// Approximate number of cells of a mesh with these sizes.
    pub cells: f64,
}

/// Smallest and largest ratio of a new size to the old one. Errors of a mesh predict those of cells a few times smaller, but not
/// of cells an order of magnitude smaller. With 0.08 instead of 0.25, `groove-held` to 1e-3 and `hertz-sphere` to 2e-2 took the
/// same number of meshes, the last ones of the same size within 7 %.
const RANGE: (f64, f64) = (0.25, 2.0);

/// The requirements on the next mesh.
#[derive(Debug, Clone, Copy)]
pub struct Aim {
    /// Share of the squared energy error that may remain.
    pub share: f64,
    /// Smallest number of cells, as a multiple of that of the present mesh.
    pub more: f64,
    /// Largest number of cells. It has priority over the other two.
    pub most: f64,
}

/// Return the sizes of the mesh with the fewest cells that meets an aim. Collective.
///
/// Let p be the degree of the elements and D the dimension. With h -> s h the squared error eta^2 of a cell becomes s^(2p) eta^2,
/// and s^-D cells take its place. The number of cells is least where s^(2p + D) eta^2 is the same everywhere. Every cell of the
/// new mesh then has nearly the same error.
pub fn wanted(meshes: &dyn Meshes, model: &Model, estimate: &Estimate, aim: Aim) -> Sizes {
    let Aim { share, more, most } = aim;
    let bodies = model.bodies.len();
    let counts = counts(meshes, bodies);
    // Every rank has the meshes, and only the owner rank of a body has its errors.
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
    // Remaining error and cell sizes increase with the level, so its logarithm is bisected.
    let largest = errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (largest.ln() - 100.0, largest.ln() + 10.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        let is_enough = left(middle.exp()) <= goal && cells(middle.exp()) >= more * all.len() as f64;
        if is_enough || cells(middle.exp()) > most {
            low = middle;
        } else {
            high = middle;
        }
    }
    let level = low.exp();
    let size = |cell: usize, size: f64| size * ratio(level, all[cell]);
    gather(meshes, &counts, size).within(most)
}

/// Return sizes that are `factor` times those of the meshes.
pub fn scaled(meshes: &dyn Meshes, bodies: usize, factor: f64) -> Sizes {
    gather(meshes, &counts(meshes, bodies), |_, size| factor * size)
}

/// Return the sizes of the meshes, but none below a smallest size. With this size everywhere the bodies together would have about
/// this number of `cells`.
pub fn coarse(meshes: &dyn Meshes, bodies: usize, cells: usize) -> Sizes {
    let power = meshes.cells(0).stride as f64 - 1.0;
    let volume: f64 = (0..bodies).flat_map(|body| meshes.cells(body).sizes).map(|size| size.powf(power)).sum::<f64>();
    let least = (volume / cells as f64).powf(1.0 / power);
    gather(meshes, &counts(meshes, bodies), |_, size| size.max(least))
}

/// Return the number of cells of each body.
fn counts(meshes: &dyn Meshes, bodies: usize) -> Vec<usize> {
    (0..bodies).map(|body| meshes.cells(body).sizes.len()).collect()
}

/// Return the field of the sizes that `wanted` returns for each cell. Its arguments are the index of the cell, counted over all
/// bodies, and the present size of the cell.
fn gather(meshes: &dyn Meshes, counts: &[usize], wanted: impl Fn(usize, f64) -> f64) -> Sizes {
    let mut field = Sizes { stride: 0, corners: Vec::new(), sizes: Vec::new(), cells: 0.0 };
    let mut first = 0;
    for (body, &count) in counts.iter().enumerate() {
        let of_body = meshes.cells(body);
        field.stride = of_body.stride;
        // This is the geometric mean over the cells around each corner.
        let mut logs = vec![(0.0, 0.0); of_body.nodes.len()];
        for (index, corners) in of_body.corners.chunks_exact(of_body.stride).enumerate() {
            for &node in corners {
                let (sum, count) = &mut logs[node as usize];
                *sum += wanted(first + index, of_body.sizes[index]).ln();
                *count += 1.0;
            }
        }
        let mut sizes: Vec<f64> = logs.into_iter().map(|(sum, count): (f64, f64)| (sum / count).exp()).collect();
        field::smooth(&of_body, &mut sizes);
        for (corners, old) in of_body.corners.chunks_exact(of_body.stride).zip(&of_body.sizes) {
            let power = of_body.stride as f64 - 1.0;
            let share = |&node: &u32| (old / sizes[node as usize]).powf(power) / of_body.stride as f64;
            field.cells += corners.iter().map(share).sum::<f64>();
        }
        let (corners, sizes) = field::simplices(&of_body, &sizes);
        field.corners.extend(corners);
        field.sizes.extend(sizes);
        first += count;
    }
    field
}

impl Sizes {
    /// Reduce all sizes, so that a mesh has `more` times as many cells.
    pub fn refine(&mut self, more: f64) {
        let factor = more.powf(-1.0 / (self.stride as f64 - 1.0));
        self.sizes.iter_mut().for_each(|size| *size *= factor);
        self.cells *= more;
    }

    /// Return the same field, or one with larger sizes if a mesh would have more than `most` cells.
    fn within(mut self, most: f64) -> Self {
        if self.cells > most {
            self.refine(most / self.cells);
        }
        self
    }
}
