//! Recovery on meshes of blocks.

use super::*;
use crate::fem::assemble::interpolate;
use crate::mesh::{Group, Mesh};

/// A cube of `n` cells each way, cut into simplices that share one diagonal, in a skewed frame.
fn block<const D: usize>(n: usize, order: Order) -> Space<D> {
    let count = 2 * n + 1;
    let number = |at: [usize; D]| at.iter().rev().fold(0, |sum, &k| sum * count + k) as u32;
    let place = |mut index: usize| -> [f64; D] {
        let at: [f64; D] = std::array::from_fn(|_| {
            let k = index % count;
            index /= count;
            k as f64 / (2 * n) as f64
        });
        std::array::from_fn(|c| at[c] + 0.2 * at[(c + 1) % D] * usize::from(c + 1 < D) as f64)
    };
    let mut connectivity = Vec::new();
    let permutations: &[&[usize]] = if D == 2 {
        &[&[0, 1], &[1, 0]]
    } else {
        &[&[0, 1, 2], &[1, 2, 0], &[2, 0, 1], &[0, 2, 1], &[2, 1, 0], &[1, 0, 2]]
    };
    for cell in 0..n.pow(D as u32) {
        let corner: [usize; D] = std::array::from_fn(|c| 2 * (cell / n.pow(c as u32) % n));
        for permutation in permutations {
            let mut path = vec![corner];
            for &axis in *permutation {
                let mut next = path[path.len() - 1];
                next[axis] += 2;
                path.push(next);
            }
            let even = permutation.iter().enumerate().map(|(i, p)| permutation[i..].iter().filter(|q| *q < p).count());
            if even.sum::<usize>() % 2 == 1 {
                path.swap(0, 1);
            }
            connectivity.extend(path.iter().map(|&at| number(at)));
            for &(i, j) in &element::EDGES[..D * (D + 1) / 2] {
                connectivity.push(number(std::array::from_fn(|c| (path[i][c] + path[j][c]) / 2)));
            }
        }
    }
    let stride = element::node_count(D + 1, Order::P2);
    let group = Group { name: "block".into(), dimension: D, stride, connectivity, tags: Vec::new() };
    let points = (0..count.pow(D as u32)).map(place).collect();
    let mesh = Mesh { path: "block".into(), points, order: Order::P2, groups: vec![group].into(), split: 0 };
    Space::new(&mesh, &mesh.groups[0], order)
}

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
        let bubble = recovery.bubble(&cell[..N], &l);
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
