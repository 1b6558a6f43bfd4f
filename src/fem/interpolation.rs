//! Interpolation from linear displacements to those of higher orders. The linear ones are the coarse space of multigrid
//! for elements of higher orders.

use super::element;
use super::frame::Frame;
use super::space::Space;
use crate::linalg::Csr;
use crate::problem::order::Order;

/// An interpolation from a coarse space to a fine one.
#[derive(Debug, Clone)]
pub struct Prolongation {
    /// Matrix with one row a dof of the fine space and one column a dof of the coarse space.
    pub rows: Csr,
    /// Number of dofs of the coarse space on this rank.
    pub own: usize,
}

impl Prolongation {
    /// Append the rows of the next body, whose columns begin at `first`.
    pub fn append(&mut self, next: &Self, first: usize) {
        self.own += next.own;
        self.rows.columns = self.rows.columns.max(first + next.rows.columns);
        for i in 0..next.rows.rows() {
            self.rows.push_row(next.rows.row(i).map(|(j, weight)| (first + j, weight)));
        }
    }
}

/// Return the nodes of linear displacements, sorted: the corners of the cells of this rank, and the nodes that move
/// tied ones.
pub fn coarse_nodes<const D: usize>(space: &Space<D>, frame: &Frame<D>) -> Vec<u32> {
    match space.order {
        Order::P1 => (0..space.nodes.len() as u32).collect(),
        _ => {
            let corners = space.cells.chunks_exact(space.stride).flat_map(|cell| &cell[..=D]);
            Space::<D>::among(corners.copied().chain(frame.leaders()))
        }
    }
}

/// Return the interpolation from the dofs at the nodes `coarse` ([`coarse_nodes`]) to all dofs of a body.
///
/// A node between vertices moves as their mean, weighted by its barycentric coordinates. Rows and columns of prescribed
/// dofs are empty, except for a one where the dof is in both spaces, so that P'KP keeps its diagonal. The rows of nodes
/// without cells on this rank are empty.
pub fn from_vertices<const D: usize>(
    space: &Space<D>,
    frame: &Frame<D>,
    is_prescribed: impl Fn(usize) -> bool,
    coarse: &[u32],
) -> Prolongation {
    let own = D * coarse.len();
    let mut rows = Csr::new(own);
    for (node, vertices) in vertices_around(space).into_iter().enumerate() {
        let place = coarse.binary_search(&(node as u32));
        for c in 0..D {
            rows.push_row(match place {
                Ok(place) => vec![(D * place + c, 1.0)],
                Err(_) if !is_prescribed(D * node + c) => {
                    // v_c = axis_c . sum l_k u_k, where u_k are the displacements of the vertices
                    mean_of_vertices(frame, &vertices, frame.direction(node as u32, c), &is_prescribed, coarse)
                }
                Err(_) => Vec::new(),
            });
        }
    }
    Prolongation { rows, own }
}

/// Return the vertices between which each node lies that is none itself, with its barycentric coordinates.
fn vertices_around<const D: usize>(space: &Space<D>) -> Vec<Vec<(u32, f64)>> {
    let mut around = vec![Vec::new(); space.nodes.len()];
    let places: Vec<[f64; 4]> = (D + 1..space.stride).map(|k| element::place(space.order, D + 1, k)).collect();
    for cell in space.cells.chunks_exact(space.stride) {
        for (&node, place) in cell[D + 1..].iter().zip(&places) {
            around[node as usize] = cell.iter().copied().zip(*place).filter(|(_, l)| *l != 0.0).collect();
        }
    }
    around
}

/// Return the row of the weighted mean displacement of vertices along an axis, without prescribed dofs. The columns are
/// the dofs at the nodes `coarse`.
fn mean_of_vertices<const D: usize>(
    frame: &Frame<D>,
    vertices: &[(u32, f64)],
    axis: [f64; D],
    is_prescribed: &impl Fn(usize) -> bool,
    coarse: &[u32],
) -> Vec<(usize, f64)> {
    let mut row: Vec<(usize, f64)> = Vec::new();
    let parts = vertices.iter().flat_map(|&(vertex, l)| frame.force(vertex, axis.map(|axis| l * axis)));
    for (end, shares) in parts {
        let Ok(place) = coarse.binary_search(&end) else {
            unreachable!("a vertex is coarse, and so are the nodes that move it")
        };
        for (k, share) in shares.into_iter().enumerate().filter(|(k, _)| !is_prescribed(D * end as usize + k)) {
            match row.iter_mut().find(|entry| entry.0 == D * place + k) {
                Some(entry) => entry.1 += share,
                None => row.push((D * place + k, share)),
            }
        }
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;
    use nalgebra::Vector3;

    /// Return the values at all dofs, and those at the dofs of coarse nodes.
    fn both(space: &Space<3>, frame: &Frame<3>, u: impl Fn(&[f64; 3]) -> [f64; 3]) -> (Vec<f64>, Vec<f64>) {
        let at = |(node, x): (u32, &[f64; 3])| match frame.row(node) {
            [] => u(x),
            [(own, turned)] if *own == node => turned.tr_mul(&Vector3::from(u(x))).into(),
            _ => [0.0; 3],
        };
        let all: Vec<f64> = (0u32..).zip(&space.nodes).flat_map(at).collect();
        let coarse = coarse_nodes(space, frame);
        let few = coarse.iter().flat_map(|&node| all[3 * node as usize..3 * node as usize + 3].to_vec()).collect();
        (all, few)
    }

    fn close(x: &[f64], y: &[f64]) {
        assert!(x.len() == y.len() && x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-14), "{x:?} {y:?}");
    }

    /// Linear displacements are interpolated exactly, whatever the axes of single nodes.
    #[test]
    fn linear_displacements_are_interpolated_exactly() {
        let space = block::<3>(2, Order::P2);
        let coarse = coarse_nodes(&space, &Frame::default());
        assert_eq!((space.nodes.len(), coarse.len()), (125, 27));
        let turned = [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
        let middle =
            (0..125).find(|node| coarse.binary_search(node).is_err()).expect("a node in the middle of an edge");
        let mut frame = Frame::default();
        [coarse[3], middle].into_iter().for_each(|node| frame.turn(node, turned, &[]));
        let (all, few) = both(&space, &frame, |x| [1.0 + x[0] - 2.0 * x[1], 3.0 * x[2], x[0] + x[1] - 0.5]);
        let Prolongation { rows, own } = from_vertices(&space, &frame, |_| false, &coarse);
        assert_eq!((rows.rows(), own), (375, 81));
        let mut values = vec![0.0; 375];
        rows.multiply(&few, &mut values);
        close(&values, &all);
    }

    /// Nodes that are tied to one in the middle of an edge move with it. Prescribed dofs have a one on the diagonal and
    /// no other entry.
    #[test]
    fn supports_have_no_part() {
        let space = block::<3>(1, Order::P2);
        let vertices = coarse_nodes(&space, &Frame::default());
        let master =
            (0..27).find(|node| vertices.binary_search(node).is_err()).expect("a node in the middle of an edge");
        let tied = [vertices[0], vertices[1]];
        let mut frame = Frame::default();
        frame.tie(&[master, tied[0], tied[1]]);
        let coarse = coarse_nodes(&space, &frame);
        assert_eq!(coarse.len(), 9);
        let is_tied = |dof: usize| tied.contains(&(dof as u32 / 3));
        let (all, few) = both(&space, &frame, |_| [1.0, -2.0, 3.0]);
        let rows = from_vertices(&space, &frame, is_tied, &coarse).rows;
        let mut values = vec![0.0; 81];
        rows.multiply(&few, &mut values);
        close(&values, &all);
        // One more dof is prescribed: x at a vertex.
        let prescribed = 3 * vertices[4] as usize;
        let place = 3 * coarse.binary_search(&vertices[4]).expect("a vertex is coarse");
        let rows = from_vertices(&space, &frame, |dof| is_tied(dof) || dof == prescribed, &coarse).rows;
        let users: Vec<usize> = (0..81).filter(|&i| rows.row(i).any(|entry| entry.0 == place)).collect();
        assert_eq!(users, [prescribed]);
    }
}
