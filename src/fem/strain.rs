//! The largest strains of a body, which must be small in linear theory.

use super::space::Space;
use super::stress::principal;
use super::{assemble, element};
use serde::{Deserialize, Serialize};

/// Largest strain that counts as small. The strain e of linear theory differs there by 1.5 per cent from Green's strain e + e^2/2 and
/// from the logarithmic strain e - e^2/2. This is no more than the uncertainty of moduli.
pub const SMALL: f64 = 0.03;

/// The largest strain in some cells of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Strained {
    /// Largest principal strain in absolute value, at the centres of cells.
    pub most: f64,
    /// Centre of the cell with this strain (x, y, z) in the scene.
    pub at: [f64; 3],
    /// Measure (area or volume) of the cells with more than [`SMALL`], and of all cells.
    pub measure: [f64; 2],
}

impl Strained {
    /// The value for no cells.
    pub const NONE: Self = Self { most: 0.0, at: [0.0; 3], measure: [0.0; 2] };

    /// Return the largest strain in the cells of both values.
    pub fn with(self, other: Self) -> Self {
        let larger = if other.most > self.most { other } else { self };
        Self { measure: std::array::from_fn(|k| self.measure[k] + other.measure[k]), ..larger }
    }
}

/// Return the largest strain at the centres of some cells of a space for the displacement `u`, one entry a dof.
///
/// At its centre a linear element has its mean strain. The value at a singular corner is therefore that of a cell and is not
/// extrapolated to the corner. The norm of a strain is no less than its largest principal strain, so that few cells need the latter.
pub fn largest<const D: usize>(space: &Space<D>, cells: impl Iterator<Item = usize>, u: &[f64]) -> Strained {
    let centre = [1.0 / (D + 1) as f64; 4];
    let l = &centre[..=D];
    let phi = element::values(space.order, l);
    let mut found = Strained::NONE;
    for index in cells {
        let x = space.cell_nodes(index);
        let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
        let cell = space.cell(index);
        let at = assemble::interpolate(&x, &phi);
        let strain = space.slope(cell, &at, &phi, &gradient, u).strain();
        let measure = measure * space.circle(&at);
        found.measure[1] += measure;
        if norm(&strain) <= found.most.min(SMALL) {
            continue;
        }
        let principal = largest_principal(&strain);
        found.measure[0] += if principal > SMALL { measure } else { 0.0 };
        if principal > found.most {
            (found.most, found.at) = (principal, space.in_scene(at));
        }
    }
    found
}

/// Return the root of the sum of the squares of the tensor's nine components. `strain` holds twice each shear strain, which occurs two
/// times in the tensor.
fn norm(strain: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *strain;
    (xx * xx + yy * yy + zz * zz + 0.5 * (xy * xy + yz * yz + xz * xz)).sqrt()
}

/// Return the largest principal strain in absolute value.
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

    /// A shear of 0.08 in the upper half of a cube has principal strains of 0.04 and -0.04, whatever the elements.
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
