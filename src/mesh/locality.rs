//! An order of cells that keeps neighbours together in memory.
//!
//! Gmsh lists tetrahedra in the order in which its Delaunay kernel found them, and nodes are numbered in the order of the
//! cells. A product with the stiffness matrix then jumps through memory. With cells in the order of Morton's curve through
//! their centres it does not.

use super::{Group, Mesh};
use crate::linalg::{bounds, pad};

/// Bits of a coordinate in a position on the curve. Three coordinates fit 64 bits.
const BITS: u32 = 21;

impl<const D: usize> Mesh<D> {
    /// Sort the cells of each group along Morton's curve. Structured meshes in the plane already have a good order, so only
    /// cells in space are sorted.
    pub fn sort_cells(&mut self) {
        if D < 3 {
            return;
        }
        let [low, high] = bounds(self.points.iter().copied().map(pad));
        let size = (0..D).map(|c| high[c] - low[c]).fold(f64::MIN_POSITIVE, f64::max);
        let scale = f64::from((1u32 << BITS) - 1) / size;
        let points = &self.points;
        for group in self.groups.iter_mut().filter(|group| group.dimension == D) {
            sort(group, |cell| {
                let centre = |c: usize| cell[..=D].iter().map(|&p| points[p as usize][c]).sum::<f64>() / (D + 1) as f64;
                (0..D).fold(0, |place, c| place | spread(((centre(c) - low[c]) * scale) as u64) << c)
            });
        }
    }
}

/// Sort the simplices of a group by a key. Simplices with equal keys keep their order.
fn sort(group: &mut Group, key: impl Fn(&[u32]) -> u64) {
    let mut order: Vec<(u64, u32)> = group.simplices().zip(0..).map(|(simplex, i)| (key(simplex), i)).collect();
    order.sort_unstable();
    let old = std::mem::take(&mut group.connectivity);
    group.connectivity =
        order.iter().flat_map(|&(_, i)| &old[i as usize * group.stride..][..group.stride]).copied().collect();
    if !group.tags.is_empty() {
        group.tags = order.iter().map(|&(_, i)| group.tags[i as usize]).collect();
    }
}

/// Return a number with two zeros inserted before each of its bits.
fn spread(x: u64) -> u64 {
    (0..BITS).fold(0, |spread, bit| spread | (x >> bit & 1) << (3 * bit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::order::Order;

    #[test]
    fn bits_interleave() {
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        assert_eq!(spread((1 << BITS) - 1).count_ones(), BITS);
    }

    #[test]
    fn neighbours_come_one_after_the_other() {
        // The cells lie on a line, in an order that jumps.
        let at = [3, 0, 2, 1];
        let cell = |i: usize| {
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|x| [x[0] + i as f64, x[1], x[2]])
        };
        let mut mesh = Mesh {
            path: "line.msh".into(),
            points: at.iter().flat_map(|&i| cell(i)).collect(),
            datum: [0.0; 3],
            order: Order::P1,
            groups: vec![Group {
                name: "body".into(),
                dimension: 3,
                stride: 4,
                connectivity: (0..16).collect(),
                tags: vec![7, 8, 9, 10],
            }]
            .into(),
            split: 0,
            straightened: 0,
        };
        mesh.sort_cells();
        let first: Vec<f64> = mesh.groups[0].simplices().map(|cell| mesh.points[cell[0] as usize][0]).collect();
        assert_eq!(first, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(mesh.groups[0].tags, [8, 10, 9, 7]);
        assert!(mesh.groups[0].simplices().all(|cell| cell[1] == cell[0] + 1 && cell[3] == cell[0] + 3));
    }
}
