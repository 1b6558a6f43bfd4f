//! The functions mu_q of one facet: which of its nodes carry a pressure, and what the mean around them is.

use super::pieces::Shared;
use crate::fem::element::{self, EDGES};
use crate::problem::order::Order;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The nodes of a facet that carry a pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Carriers {
    /// All of them.
    Nodes,
    /// The vertices, of a quadratic facet.
    Vertices,
    /// The mid-edges, of a quadratic triangle.
    MidEdges,
}

impl Carriers {
    /// Values of the functions that interpolate what the carriers have, at barycentric point `l` of the facet, by local node;
    /// zero for nodes that are none. In between carriers at the mid-edges the interpolation is linear on each facet.
    pub fn interpolation<const D: usize>(self, order: Order, l: &[f64; D]) -> [f64; element::MOST] {
        match self {
            Self::Nodes => element::values(order, l),
            Self::Vertices => element::values(Order::P1, l),
            Self::MidEdges => {
                let mut shape = [0.0; element::MOST];
                (0..D).for_each(|edge| shape[D + edge] = 1.0 - 2.0 * l[opposite(edge)]);
                shape
            }
        }
    }
}

/// Vertex of a triangle that edge `edge` does not touch.
fn opposite(edge: usize) -> usize {
    3 - EDGES[edge].0 - EDGES[edge].1
}

/// The functions mu_i on the covered part of one facet of side a.
pub(super) enum PressureBasis {
    /// mu = C phi, one for each node.
    Dual(DMatrix<f64>),
    /// mu_i = L_i at vertices, zero at mid-edges.
    Hats,
    /// The dual basis of the whole flat triangle, at mid-edges; zero at vertices.
    MidEdges,
}

/// Largest int |mu| / int mu. A facet on which a function has more, since only a part of it is covered, takes hats, which have
/// one. Chords of side b, whose facets are at least as long, miss a surface of curvature k by k h^2/8; a mean may make of that no
/// more than the k h^2/2 by which the surface bends along a facet, four times as much. Whole facets have 5/3 to 2.4, beside an axis
/// up to four as well; one more is for curved ones and for sums of |mu| over few points.
pub const STEADY: f64 = 5.0;

impl PressureBasis {
    /// The basis on facet `chunk[0].facet_a`, a simplex of `order` with `count` nodes, of which `chunk` covers what side b faces.
    pub fn on<const D: usize>(order: Order, count: usize, chunk: &[Shared<D>]) -> Self {
        if order == Order::P2 && D == 3 {
            return Self::MidEdges.or_hats(order, D..2 * D, chunk);
        }
        let mut mass = DMatrix::zeros(count, count);
        let mut integral = vec![0.0; count];
        for point in chunk {
            let phi = element::values(order, &point.at_a);
            for i in 0..count {
                integral[i] += point.weight * phi[i];
                for j in 0..count {
                    mass[(i, j)] += point.weight * phi[i] * phi[j];
                }
            }
        }
        let Some(factor) = mass.cholesky() else { return Self::Hats };
        let mut dual = factor.inverse();
        for (i, mut row) in dual.row_iter_mut().enumerate() {
            row *= integral[i];
        }
        Self::Dual(dual).or_hats(order, 0..count, chunk)
    }

    /// This basis, if the means of the functions of these nodes are steady on the covered part; else the hats.
    fn or_hats<const D: usize>(self, order: Order, nodes: Range<usize>, chunk: &[Shared<D>]) -> Self {
        let (mut integral, mut size) = ([0.0; element::MOST], [0.0; element::MOST]);
        for point in chunk {
            let phi = element::values(order, &point.at_a);
            for i in nodes.clone() {
                let mu = point.weight * self.value(i, &phi, &point.at_a);
                integral[i] += mu;
                size[i] += mu.abs();
            }
        }
        let rounding = 1e-6 * chunk.iter().map(|point| point.weight).sum::<f64>();
        let steady = |i: usize| integral[i] > rounding && size[i] <= STEADY * integral[i];
        if nodes.into_iter().all(steady) { self } else { Self::Hats }
    }

    /// mu of local node `i` at barycentric point `l` with shape functions `phi`.
    pub fn value<const D: usize>(&self, i: usize, phi: &[f64], l: &[f64; D]) -> f64 {
        match self {
            Self::Dual(c) => c.row(i).iter().zip(phi).map(|(c, phi)| c * phi).sum(),
            Self::Hats => l.get(i).copied().unwrap_or(0.0),
            Self::MidEdges => i.checked_sub(D).map_or(0.0, |edge| at_mid_edge(edge, phi)),
        }
    }

    /// The nodes that it belongs to.
    pub fn carriers(&self) -> Carriers {
        match self {
            Self::Dual(_) => Carriers::Nodes,
            Self::Hats => Carriers::Vertices,
            Self::MidEdges => Carriers::MidEdges,
        }
    }
}

/// diag(int phi) M^-1 phi of a flat quadratic triangle at mid-edge `edge`, of the shape functions `phi`. At the vertices, where
/// int phi is zero, it vanishes, so the three at the mid-edges sum to one.
fn at_mid_edge(edge: usize, phi: &[f64]) -> f64 {
    let vertices = -0.5 * (phi[0] + phi[1] + phi[2]) + 2.5 * phi[opposite(edge)];
    let edges = -1.125 * (phi[3] + phi[4] + phi[5]) + 4.375 * phi[3 + edge];
    vertices + edges
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::quadrature;

    /// int mu_e phi_j = A/3 if j is the mid-edge e, and zero for the five other nodes; the three functions sum to one.
    #[test]
    fn functions_of_mid_edges_are_dual_and_sum_to_one() {
        let rule = quadrature::simplex(3, 5);
        let mut pairing = [[0.0; 6]; 3];
        for (l, weight) in rule.iter() {
            let phi = element::values(Order::P2, l);
            let mu: [f64; 3] = std::array::from_fn(|edge| at_mid_edge(edge, &phi));
            assert!((mu.iter().sum::<f64>() - 1.0).abs() < 1e-13, "{mu:?}");
            for edge in 0..3 {
                (0..6).for_each(|j| pairing[edge][j] += weight * mu[edge] * phi[j]);
            }
        }
        for edge in 0..3 {
            for j in 0..6 {
                let exact = if j == 3 + edge { 1.0 / 3.0 } else { 0.0 };
                assert!((pairing[edge][j] - exact).abs() < 1e-14, "{edge} {j}: {}", pairing[edge][j]);
            }
        }
    }

    /// Linear functions are met by the interpolation, whatever carries them, and quadratic ones by all nodes.
    #[test]
    fn interpolation_between_carriers() {
        let l = [0.2, 0.7, 0.1];
        let of_places = |f: &dyn Fn(&[f64; 3]) -> f64| element::nodes::<3>(Order::P2).iter().map(f).collect::<Vec<_>>();
        let at = |carriers: Carriers, values: &[f64]| -> f64 {
            carriers.interpolation(Order::P2, &l).iter().zip(values).map(|(shape, value)| shape * value).sum()
        };
        let linear = |l: &[f64; 3]| 3.0 * l[0] - 2.0 * l[1] + 0.5 * l[2];
        for carriers in [Carriers::Nodes, Carriers::Vertices, Carriers::MidEdges] {
            assert!((at(carriers, &of_places(&linear)) - linear(&l)).abs() < 1e-14, "{carriers:?}");
        }
        let quadratic = |l: &[f64; 3]| l[0] * l[1] - 2.0 * l[2] * l[2];
        assert!((at(Carriers::Nodes, &of_places(&quadratic)) - quadratic(&l)).abs() < 1e-14);
    }
}
