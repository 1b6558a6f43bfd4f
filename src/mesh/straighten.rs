//! Straight edges for quadratic cells that a curved boundary folds.
//!
//! A mesher moves mid-edge nodes to the curved boundary after it has made the straight cells. If a cell is flat, or large in
//! comparison with the radius of the boundary, its map may no longer be one to one. With straight edges it is a good cell. The
//! boundary there is then that of linear elements.

use super::Mesh;
use super::check::{EDGES, is_folded};
use crate::linalg::pad;
use crate::problem::order::Order;

impl<const D: usize> Mesh<D> {
    /// Make the edges of all folded cells straight until no cell is folded, and count the cells in [`Mesh::straightened`].
    /// Neighbours share the edges, so a straight edge may fold another cell, which becomes straight in the next pass.
    pub fn straighten(&mut self) {
        if self.order == Order::P1 {
            return;
        }
        loop {
            let folded: Vec<Vec<u32>> = self.folded_cells();
            if folded.is_empty() {
                return;
            }
            let mut has_moved = false;
            for cell in &folded {
                for (&[i, j], &middle) in EDGES.iter().zip(&cell[D + 1..]) {
                    let [x, y] = [cell[i], cell[j]].map(|node| self.points[node as usize]);
                    let straight = std::array::from_fn(|c| 0.5 * (x[c] + y[c]));
                    has_moved |= std::mem::replace(&mut self.points[middle as usize], straight) != straight;
                }
            }
            if !has_moved {
                // The cells are inverted even with straight edges. The checks report them.
                return;
            }
            self.straightened += folded.len();
        }
    }

    /// Return the nodes of the folded cells, one list per cell.
    fn folded_cells(&self) -> Vec<Vec<u32>> {
        let of_cells = self.groups.iter().filter(|group| group.dimension == D);
        let cells = of_cells.flat_map(|group| group.connectivity.chunks_exact(group.stride));
        let place = |&node: &u32| pad(self.points[node as usize]);
        let folded = |cell: &&[u32]| is_folded(&cell.iter().map(place).collect::<Vec<_>>(), D);
        let mut found: Vec<Vec<u32>> =
            cells.filter(|cell| self.is_curved(cell)).filter(folded).map(<[u32]>::to_vec).collect();
        // A cell may be in several groups.
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Return whether a quadratic cell has an edge whose middle is off its chord by more than rounding. Most cells have none.
    fn is_curved(&self, cell: &[u32]) -> bool {
        EDGES.iter().zip(&cell[D + 1..]).any(|(&[i, j], &middle)| {
            let [x, y, m] = [cell[i], cell[j], middle].map(|node| self.points[node as usize]);
            (0..D).any(|c| (2.0 * m[c] - x[c] - y[c]).abs() > 1e-9 * (0..D).map(|c| (x[c] - y[c]).abs()).sum::<f64>())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Group;

    /// Return two quadratic triangles on the square of four corners. The mid-edge node of the bottom is at the height `bottom`.
    /// The one of the diagonal is moved by `bent` towards the lower corner.
    fn square(bottom: f64, bent: f64) -> Mesh<2> {
        let points = vec![
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            [0.5, bottom],
            [1.0, 0.5],
            [0.5 + bent, 0.5 - bent],
            [0.5, 1.0],
            [0.0, 0.5],
        ];
        let connectivity = vec![0, 1, 2, 4, 5, 6, 0, 2, 3, 6, 7, 8];
        let group = Group { name: "body".into(), dimension: 2, stride: 6, connectivity, tags: Vec::new() };
        Mesh::new("a.msh".into(), points, Order::P2, vec![group].into())
    }

    #[test]
    fn folded_cells_become_straight_and_others_stay_as_they_are() {
        let mut good = square(0.1, 0.1);
        good.straighten();
        assert_eq!((good.straightened, good.points[4], good.points[6]), (0, [0.5, 0.1], [0.6, 0.4]));
        let mut folded = square(0.6, 0.0);
        folded.straighten();
        assert_eq!((folded.straightened, folded.points[4]), (1, [0.5, 0.0]));
        // The diagonal folds the lower cell, and it is an edge of the upper cell, too.
        let mut both = square(0.0, 0.4);
        both.straighten();
        assert_eq!((both.straightened, both.points[6]), (1, [0.5, 0.5]));
        let mut linear = square(0.6, 0.0).lower_order();
        linear.straighten();
        assert_eq!(linear.straightened, 0);
    }
}
