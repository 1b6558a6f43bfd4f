//! Where a body is strained most, and whether strains are small there, as the theory takes them to be.

use super::space::Space;
use super::stress::principal;
use super::{assemble, element};
use serde::{Deserialize, Serialize};

/// Strain up to which strains count as small. The strain e of the linear theory, Green's e + e^2/2 and the logarithmic e - e^2/2 are then 1.5 per cent
/// apart from one to the next: no more than what moduli are known to.
pub const SMALL: f64 = 0.03;

/// The largest strain in some cells of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Strained {
    /// Largest principal strain in absolute value, at the centres of cells.
    pub most: f64,
    /// The centre of that cell (x, y, z) in the scene.
    pub at: [f64; 3],
    /// Measure of the cells with more than [`SMALL`], and of all of them.
    pub measure: [f64; 2],
}

impl Strained {
    /// That of no cells.
    pub const NONE: Self = Self { most: 0.0, at: [0.0; 3], measure: [0.0; 2] };

    /// Return the largest strain in the cells of both.
    pub fn with(self, other: Self) -> Self {
        let larger = if other.most > self.most { other } else { self };
        Self { measure: std::array::from_fn(|k| self.measure[k] + other.measure[k]), ..larger }
    }
}

/// Return the largest strain at the centres of some cells of a space; `u` has one entry a dof.
///
/// The centre of a cell has the mean strain of linear elements, so that the value at a singular corner is one of its cells, not one
/// extrapolated to the corner. The root of the sum of the squares of all strains is no less than the largest principal one: few
/// cells need the latter.
pub fn largest<const D: usize>(space: &Space<D>, cells: impl Iterator<Item = usize>, u: &[f64]) -> Strained {
    let centre = [1.0 / (D + 1) as f64; 4];
    let l = &centre[..=D];
    let phi = element::values(space.order, l);
    let mut found = Strained::NONE;
    for index in cells {
        let x = space.cell_nodes(index);
        let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
        let cell = &space.cells[index * space.stride..(index + 1) * space.stride];
        let at = assemble::interpolate(&x, &phi);
        let strain = space.slope(cell, &at, &phi, &gradient, u).strain();
        let measure = measure * space.circle(&at);
        found.measure[1] += measure;
        if norm(&strain) <= found.most.min(SMALL) {
            continue;
        }
        let most = largest_principal(&strain);
        found.measure[0] += if most > SMALL { measure } else { 0.0 };
        if most > found.most {
            (found.most, found.at) = (most, space.in_scene(at));
        }
    }
    found
}

/// Root of the sum of the squares of the tensor's components; shear strains come doubled and stand there twice.
fn norm(strain: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *strain;
    (xx * xx + yy * yy + zz * zz + 0.5 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

/// The largest principal strain in absolute value.
fn largest_principal(strain: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *strain;
    let [first, _, last] = principal(&[xx, yy, zz, 0.5 * xy, 0.5 * yz, 0.5 * xz]);
    first.abs().max(last.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::sample::block;
    use crate::problem::order::Order;

    /// A shear of 0.08 in the upper half of a cube: principal strains of 0.04 and -0.04, whatever the elements.
    #[test]
    fn half_a_cube_is_sheared() {
        for order in [Order::P1, Order::P2] {
            let space = block::<3>(2, order);
            let u: Vec<f64> = space.nodes.iter().flat_map(|x| [0.08 * (x[2] - 0.5).max(0.0), 0.0, 0.0]).collect();
            let found = largest(&space, 0..space.cell_count(), &u);
            assert!((found.most - 0.04).abs() < 1e-12 && found.at[2] > 0.5, "{found:?}");
            assert!((found.measure[0] / found.measure[1] - 0.5).abs() < 1e-12, "{found:?}");
            let lower = |cell: &usize| space.cell_nodes(*cell)[..4].iter().all(|x| x[2] < 0.6);
            let still = largest(&space, (0..space.cell_count()).filter(lower), &u);
            assert_eq!((still.most, still.measure[0]), (0.0, 0.0));
            let both = still.with(found);
            assert_eq!((both.most, both.measure[0]), (found.most, found.measure[0]));
        }
    }
}
