//! Nodal stresses recovered from displacements.

use super::element;
use super::material::Material;
use super::space::Space;

/// Stress at every node: the volume-weighted mean over its cells of the cell's stress at the node.
///
/// `u` has one entry a dof; the result one (xx yy zz xy yz xz) a node.
pub fn nodal<const D: usize>(space: &Space<D>, material: &Material, u: &[f64]) -> Vec<[f64; 6]> {
    match D {
        2 => nodal_on::<D, 3>(space, material, u),
        _ => nodal_on::<D, 4>(space, material, u),
    }
}

fn nodal_on<const D: usize, const N: usize>(space: &Space<D>, material: &Material, u: &[f64]) -> Vec<[f64; 6]> {
    let mut sum = vec![[0.0; 6]; space.nodes.len()];
    let mut volume = vec![0.0; space.nodes.len()];
    let places = element::nodes::<N>(space.order);
    for index in 0..space.cell_count() {
        let x = space.cell_nodes(index);
        let cell = &space.cells[index * space.stride..(index + 1) * space.stride];
        for (l, &node) in places.iter().zip(cell) {
            let Some((gradient, measure)) = element::gradients::<D, N>(space.order, &x, l) else { continue };
            let mut h = [[0.0; D]; D];
            for (a, &other) in cell.iter().enumerate() {
                for i in 0..D {
                    for j in 0..D {
                        h[i][j] += u[D * other as usize + i] * gradient[a][j];
                    }
                }
            }
            let stress = material.stress(&h);
            volume[node as usize] += measure;
            for (sum, stress) in sum[node as usize].iter_mut().zip(stress) {
                *sum += measure * stress;
            }
        }
    }
    for (sum, volume) in sum.iter_mut().zip(volume) {
        sum.iter_mut().for_each(|s| *s /= volume);
    }
    sum
}

/// Von Mises stress of (xx yy zz xy yz xz).
pub fn von_mises(s: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *s;
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
}
