//! Quadratic displacements from linear ones: what multigrid for quadratic elements has as its coarse space.

use super::element::EDGES;
use super::frame::Frame;
use super::space::Space;
use crate::linalg::Csr;
use crate::problem::order::Order;

/// Displacements in a large space from those in a smaller one.
#[derive(Debug, Clone)]
pub struct Interpolation {
    /// One row a dof; columns: dofs of the smaller space.
    pub rows: Csr,
    /// Dofs of the smaller space that this rank has.
    pub own: usize,
}

impl Interpolation {
    /// Appends the rows of the next body, whose columns begin at `first`.
    pub fn append(&mut self, next: &Self, first: usize) {
        self.own += next.own;
        self.rows.columns = self.rows.columns.max(first + next.rows.columns);
        for i in 0..next.rows.rows() {
            self.rows.push_row(next.rows.row(i).map(|(j, weight)| (first + j, weight)));
        }
    }
}

/// The nodes of linear displacements, sorted: corners of the cells that are here, and nodes that stand for others.
pub fn coarse_nodes<const D: usize>(space: &Space<D>, frame: &Frame<D>) -> Vec<u32> {
    match space.order {
        Order::P1 => (0..space.nodes.len() as u32).collect(),
        Order::P2 => {
            let corners = space.cells.chunks_exact(space.stride).flat_map(|cell| &cell[..=D]);
            Space::<D>::among(corners.chain(frame.master.values()).copied())
        }
    }
}

/// Interpolation from the dofs at the nodes `coarse` ([`coarse_nodes`]) to all dofs of a body: a node in the middle of an edge moves as the
/// mean of the ends. Prescribed dofs have no part in it, but for a one where they are in both spaces, so that P'KP has their diagonal. Nodes
/// whose cells are not here have empty rows.
pub fn from_vertices<const D: usize>(
    space: &Space<D>,
    frame: &Frame<D>,
    is_prescribed: impl Fn(usize) -> bool,
    coarse: &[u32],
) -> Interpolation {
    let mut ends: Vec<[u32; 2]> = (0..space.nodes.len() as u32).map(|node| [node; 2]).collect();
    if space.order == Order::P2 {
        for cell in space.cells.chunks_exact(space.stride) {
            for (&middle, (a, b)) in cell[D + 1..].iter().zip(EDGES) {
                ends[middle as usize] = [cell[a], cell[b]];
            }
        }
    }
    let unit = |c: usize| std::array::from_fn::<f64, D, _>(|k| f64::from(u8::from(k == c)));
    let own = D * coarse.len();
    let mut rows = Csr::new(own);
    let mut next = 0;
    for (node, ends) in ends.iter().enumerate() {
        let is_coarse = coarse.get(next) == Some(&(node as u32));
        for c in 0..D {
            if is_coarse {
                rows.push_row([(D * next + c, 1.0)]);
                continue;
            }
            let mut row: Vec<(usize, f64)> = Vec::new();
            // v_c = axis_c . (u_a + u_b)/2, and u = sum_k axis_k v_k at the ends
            let axis = frame.axes.get(&(node as u32)).map_or(unit(c), |axes| axes[c]);
            let is_here = ends[0] as usize != node;
            for end in ends.iter().filter(|_| is_here && !is_prescribed(D * node + c)) {
                let (end, shares) = frame.force(*end, axis);
                let Ok(place) = coarse.binary_search(&end) else {
                    unreachable!("a vertex is coarse, and so is its master")
                };
                for (k, share) in shares.into_iter().enumerate() {
                    if is_prescribed(D * end as usize + k) {
                        continue;
                    }
                    match row.iter_mut().find(|entry| entry.0 == D * place + k) {
                        Some(entry) => entry.1 += 0.5 * share,
                        None => row.push((D * place + k, 0.5 * share)),
                    }
                }
            }
            rows.push_row(row);
        }
        next += usize::from(is_coarse);
    }
    Interpolation { rows, own }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::sample::block;

    /// Values at all dofs, and those of them at coarse nodes.
    fn both(space: &Space<3>, frame: &Frame<3>, u: impl Fn(&[f64; 3]) -> [f64; 3]) -> (Vec<f64>, Vec<f64>) {
        let all = frame.dofs(&space.nodes.iter().flat_map(u).collect::<Vec<_>>());
        let coarse = coarse_nodes(space, frame);
        let few = coarse.iter().flat_map(|&node| all[3 * node as usize..3 * node as usize + 3].to_vec()).collect();
        (all, few)
    }

    fn close(x: &[f64], y: &[f64]) {
        assert!(x.len() == y.len() && x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-14), "{x:?} {y:?}");
    }

    /// Linear displacements come out as they are, whatever the axes of single nodes.
    #[test]
    fn linear_displacements_are_interpolated_exactly() {
        let space = block::<3>(2, Order::P2);
        let coarse = coarse_nodes(&space, &Frame::default());
        assert_eq!((space.nodes.len(), coarse.len()), (125, 27));
        let turned = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
        let middle =
            (0..125).find(|node| coarse.binary_search(node).is_err()).expect("a node in the middle of an edge");
        let frame = Frame { axes: [(coarse[3], turned), (middle, turned)].into(), ..Frame::default() };
        let (all, few) = both(&space, &frame, |x| [1.0 + x[0] - 2.0 * x[1], 3.0 * x[2], x[0] + x[1] - 0.5]);
        let Interpolation { rows, own } = from_vertices(&space, &frame, |_| false, &coarse);
        assert_eq!((rows.rows(), own), (375, 81));
        let mut values = vec![0.0; 375];
        rows.multiply(&few, &mut values);
        close(&values, &all);
    }

    /// Nodes that are tied to one in the middle of an edge move with it, and prescribed dofs have no part but their own one.
    #[test]
    fn supports_have_no_part() {
        let space = block::<3>(1, Order::P2);
        let vertices = coarse_nodes(&space, &Frame::default());
        let master =
            (0..27).find(|node| vertices.binary_search(node).is_err()).expect("a node in the middle of an edge");
        let tied = [vertices[0], vertices[1]];
        let frame = Frame { master: tied.map(|node| (node, master)).into(), ..Frame::default() };
        let coarse = coarse_nodes(&space, &frame);
        assert_eq!(coarse.len(), 9);
        let is_tied = |dof: usize| tied.contains(&(dof as u32 / 3));
        let (all, few) = both(&space, &frame, |_| [1.0, -2.0, 3.0]);
        let rows = from_vertices(&space, &frame, is_tied, &coarse).rows;
        let mut values = vec![0.0; 81];
        rows.multiply(&few, &mut values);
        close(&values, &all);
        // the x of one vertex more
        let held = 3 * vertices[4] as usize;
        let place = 3 * coarse.binary_search(&vertices[4]).expect("a vertex is coarse");
        let rows = from_vertices(&space, &frame, |dof| is_tied(dof) || dof == held, &coarse).rows;
        let users: Vec<usize> = (0..81).filter(|&i| rows.row(i).any(|entry| entry.0 == place)).collect();
        assert_eq!(users, [held]);
    }
}
