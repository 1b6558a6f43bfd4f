//! How many nodes each node of some bodies is coupled with in their matrix: the work and the memory that it takes.

use super::part::Part;
use super::parts::Stock;
use crate::contact::ContactPair;
use crate::exchange::Exchange;
use crate::fem::NodeGraph;
use crate::linalg::Csr;
use std::collections::HashMap;

/// The numbers of the nodes of these `bodies`, one body after the other, in a matrix of all of them: those `inside` each, and those across
/// contact rows.
pub fn of<'a, const D: usize>(
    bodies: &[usize],
    inside: &dyn Fn(usize) -> &'a [u32],
    pairs: &[ContactPair],
) -> Vec<u32> {
    let (mut first, mut all) = (HashMap::new(), Vec::new());
    for &body in bodies {
        first.insert(body, all.len());
        all.extend_from_slice(inside(body));
    }
    for pair in pairs {
        let [Some(a), Some(b)] = pair.bodies.map(|body| first.get(&body).copied()) else { continue };
        let nodes = |side: usize, q: usize| pair.rows[side].row(q).map(|(dof, _)| dof / D);
        let both = |q: usize| nodes(0, q).flat_map(move |i| nodes(1, q).map(move |j| ((a + i) as u32, (b + j) as u32)));
        let mut across: Vec<(u32, u32)> = (0..pair.len()).flat_map(both).collect();
        across.sort_unstable();
        across.dedup();
        across.into_iter().flat_map(|(i, j)| [i, j]).for_each(|node| all[node as usize] += 1);
    }
    all
}

/// The numbers of the nodes of a body within it: of nodes in cells around each, which the ranks have that have these, and of nodes in contact
/// rows. Collective.
pub fn inside<const D: usize>(part: &Part<D>, stock: &Stock<D>, rows: &Csr, exchange: &dyn Exchange) -> Vec<u32> {
    let (space, _) = part.space.clone().of_cells(stock.nodes.clone(), 0.0);
    let NodeGraph { ptr, .. } = part.graph(&space, rows);
    let own = ptr.windows(2).zip(part.known.points.iter()).map(|(row, &point)| match stock.is_own(point) {
        true => f64::from(row[1] - row[0]),
        false => 0.0,
    });
    let mut couplings: Vec<f64> = own.collect();
    exchange.sum(&mut couplings);
    couplings.into_iter().map(|count| count as u32).collect()
}
