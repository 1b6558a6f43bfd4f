//! Spaces for tests.

use super::element;
use super::space::Space;
use crate::mesh::{Group, Mesh};
use crate::problem::order::Order;

/// Make the space of a cube with `n` cells in each direction, which are divided into simplices that share one diagonal. The
/// coordinates are skewed.
pub fn block<const D: usize>(n: usize, order: Order) -> Space<D> {
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
    let mesh = Mesh::new("block".into(), points, Order::P2, vec![group].into());
    Space::new(&mesh, &mesh.groups[0], order)
}
