//! Recovery on meshes of blocks.

use super::*;
use crate::fem::assemble::interpolate;
use crate::fem::sample::block;

/// A polynomial displacement of a degree, with a gradient.
fn field<const D: usize>(degree: i32, x: &[f64; D]) -> [f64; D] {
    let s: f64 = (0..D).map(|i| (1.0 + 0.3 * i as f64) * x[i]).sum();
    std::array::from_fn(|c| (1.0 + c as f64) * s.powi(degree) + x[c] * x[(c + 1) % D].powi(degree - 1))
}

/// A displacement of one degree more than the elements is recovered exactly, at the boundary too, so that the error of its
/// interpolant is known exactly.
fn next_degree_is_exact<const D: usize, const N: usize>(order: Order) {
    let degree = if order == Order::P1 { 2 } else { 3 };
    let space = block::<D>(3, order);
    let u: Vec<f64> = space.nodes.iter().flat_map(|x| field::<D>(degree, x)).collect();
    let recovery = Recovery::new(&space, &u);
    let l: [f64; N] = std::array::from_fn(|k| (k + 1) as f64 / (N * (N + 1) / 2) as f64);
    let mut largest = 0.0f64;
    for index in 0..space.cell_count() {
        let x = space.cell_nodes(index);
        let phi = element::values(order, &l);
        let at = interpolate(&x, &phi);
        let cell = recovery.cell(index);
        let bubble = recovery.missed(cell, &l);
        for c in 0..D {
            let interpolated: f64 = cell.iter().zip(phi).map(|(&n, phi)| phi * u[D * n as usize + c]).sum();
            let error = field::<D>(degree, &at)[c] - interpolated;
            largest = largest.max(error.abs());
            assert!((bubble[c] - error).abs() < 1e-10, "{D} {order:?} cell {index}: {} {error}", bubble[c]);
        }
    }
    assert!(largest > 1e-4);
}

#[test]
fn a_polynomial_of_the_next_degree_is_recovered() {
    next_degree_is_exact::<2, 3>(Order::P1);
    next_degree_is_exact::<3, 4>(Order::P1);
    next_degree_is_exact::<2, 3>(Order::P2);
    next_degree_is_exact::<3, 4>(Order::P2);
}
