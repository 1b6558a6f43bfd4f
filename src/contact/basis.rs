//! The pressure functions mu_q on one facet: which of its nodes carry a pressure, and how means around them are
//! weighted.

use super::pieces::IntegrationPoint;
use crate::fem::element::{self, EDGES, Values};
use crate::fem::{Facets, lagrange};
use crate::linalg::DisjointSets;
use crate::problem::order::Order;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The nodes of a facet that carry a pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Carriers {
    /// All nodes.
    Nodes,
    /// The vertices of a quadratic facet.
    Vertices,
    /// The mid-edges of a quadratic triangle.
    MidEdges,
    /// Nodes of an edge of order three or more, or of order two on an axis of revolution, moved to the covered part of
    /// it.
    Part(Part),
}

/// The covered part of an edge, with points at its Gauss-Lobatto points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its ends, of 0 to 1 along the edge.
    ends: [f64; 2],
    /// Local node on the axis of revolution, which carries no point.
    without: Option<usize>,
}

impl Carriers {
    /// Return the functions that interpolate values at the carriers, at barycentric point `l` of the facet, one entry a
    /// local node. Nodes that carry nothing have zero. Between mid-edges the interpolation is linear on each facet.
    pub fn interpolation<const D: usize>(self, order: Order, l: &[f64; D]) -> Values {
        match self {
            Self::Nodes => element::values(order, l),
            Self::Part(part) => {
                let mut shape = part.values(order, l);
                if let Some(without) = part.without {
                    // the polynomial of one degree less through the other nodes
                    let highest = lagrange::of(order, D).highest();
                    let on_axis = std::mem::take(&mut shape[without]);
                    let others = shape.iter_mut().zip(&highest).enumerate().filter(|(i, _)| *i != without);
                    others.for_each(|(_, (shape, c))| *shape -= on_axis * c / highest[without]);
                }
                shape
            }
            Self::Vertices => element::values(Order::P1, l),
            Self::MidEdges => (0..D).map(|_| 0.0).chain((0..D).map(|edge| 1.0 - 2.0 * l[opposite(edge)])).collect(),
        }
    }
}

impl Part {
    /// Return the part of an edge that these integration points cover: from the first to the last piece, which reach
    /// beyond their outer Gauss points.
    fn covered<const D: usize>(chunk: &[IntegrationPoint<D>]) -> Self {
        let mut ends = [1.0f64, 0.0f64];
        for piece in chunk.chunk_by(|p, q| p.facet_b == q.facet_b) {
            let (first, last) = (piece[0].at_a[1], piece[piece.len() - 1].at_a[1]);
            let margin = lagrange::gauss(piece.len())[0].0;
            let beyond = if piece.len() > 1 { margin / (1.0 - 2.0 * margin) * (last - first) } else { 0.0 };
            ends = [ends[0].min(first - beyond), ends[1].max(last + beyond)];
        }
        // an end at a vertex has the point of the vertex
        let ends = ends.map(|end| if (end - end.round()).abs() <= ROUNDING { end.round() } else { end });
        Self { ends, without: None }
    }

    /// Return the values of the shape functions of the part at a point of the edge.
    fn values<const D: usize>(&self, order: Order, l: &[f64; D]) -> Values {
        let along = (l[1] - self.ends[0]) / (self.ends[1] - self.ends[0]);
        element::values(order, &[1.0 - along, along])
    }
}

/// Return the vertex of a triangle that edge `edge` does not touch.
fn opposite(edge: usize) -> usize {
    3 - EDGES[edge].0 - EDGES[edge].1
}

/// The functions mu_i on the covered part of one facet of side a.
pub(super) enum PressureBasis {
    /// The dual basis mu = C phi of the covered part, with one function for each node and the shape functions phi.
    Dual(DMatrix<f64>),
    /// The same on an edge with the shape functions of the covered part. The function of a node on the axis of
    /// revolution is zero.
    Part(DMatrix<f64>, Part),
    /// Hat functions: the barycentric coordinate mu_i = l_i at vertex i, zero at mid-edges.
    Hats,
    /// The dual basis of the whole flat triangle at the mid-edges, zero at the vertices.
    MidEdges,
}

/// Largest ratio int |mu| / int mu of a steady mean.
///
/// On a partially covered facet a function may exceed this limit. Such a facet takes hat functions, whose ratio is one.
/// Chords of side b, whose facets are at least as long, miss a surface of curvature k by k h^2/8, where h is the length
/// of a facet. A mean may amplify this error up to the k h^2/2 by which the surface bends along a facet, which is four
/// times as much. Fully covered facets have ratios of 5/3 to 2.4, and up to four beside an axis. One more allows for
/// curved facets and for sums of |mu| over few points. The ratios of whole edges are 1.6 times the root of their order:
/// 4.6 at order 8.
const STEADY: f64 = 5.0;

/// Share of the area of a facet below which the integral of a function is zero. Places of pieces have errors of 1e-9 of
/// a facet ([`side::ROUNDING`](super::side::ROUNDING)), which a mean over a smaller integral would make more than 1e-3
/// of a gap.
const ROUNDING: f64 = 1e-6;

impl PressureBasis {
    /// Choose the basis on facet `chunk[0].facet_a`, a simplex of `order` with `count` nodes. `chunk` holds the
    /// integration points of the part that the facets `b` of side b cover, and `axis` is the local node on the axis of
    /// revolution.
    ///
    /// On an edge of order two or more this node carries no point. On a straight edge int r phi is zero there, and on a
    /// curved edge it has either sign: it is distributed over the other nodes, so that their weights integrate
    /// polynomials of one degree less than the elements as before.
    ///
    /// Where these facets are apart, the distance jumps, and a dual mean would be beyond the distances on both sides of
    /// the jump: an overlap where there is none.
    pub fn on<const D: usize>(
        order: Order,
        count: usize,
        chunk: &[IntegrationPoint<D>],
        b: &Facets<D>,
        axis: Option<usize>,
    ) -> Self {
        if are_apart(b, chunk) {
            return Self::Hats;
        }
        if order == Order::P2 && D == 3 {
            return Self::MidEdges.or_hats(order, &(D..2 * D).collect::<Vec<_>>(), chunk);
        }
        let of_parts = order > Order::P2 || order == Order::P2 && axis.is_some();
        let mut part = (D == 2 && of_parts).then(|| Part::covered(chunk));
        if part.is_some_and(|part| part.ends[1] - part.ends[0] <= ROUNDING) {
            return Self::Hats;
        }
        let mut mass = DMatrix::zeros(count, count);
        let mut integral = vec![0.0; count];
        for point in chunk {
            let phi = part.map_or_else(|| element::values(order, &point.at_a), |part| part.values(order, &point.at_a));
            for i in 0..count {
                integral[i] += point.weight * phi[i];
                for j in 0..count {
                    mass[(i, j)] += point.weight * phi[i] * phi[j];
                }
            }
        }
        let Some(factor) = mass.cholesky() else { return Self::Hats };
        let mut dual = factor.inverse();
        // a part that ends before the axis has all of its points
        let on_axis = axis.filter(|&i| part.is_some_and(|part| part.ends[i] == i as f64));
        if let Some(axis) = on_axis {
            let (highest, on_axis) = (lagrange::of(order, D).highest(), std::mem::take(&mut integral[axis]));
            let others = (0..count).filter(|&i| i != axis);
            others.for_each(|i| integral[i] -= on_axis * highest[i] / highest[axis]);
        }
        dual.row_iter_mut().zip(&integral).for_each(|(mut row, integral)| row *= *integral);
        let carriers: Vec<usize> = (0..count).filter(|i| on_axis != Some(*i)).collect();
        part.iter_mut().for_each(|part| part.without = on_axis);
        let basis = match part {
            Some(part) => Self::Part(dual, part),
            None => Self::Dual(dual),
        };
        basis.or_hats(order, &carriers, chunk)
    }

    /// Return this basis if the functions of these nodes have steady means on the covered part, otherwise the hat
    /// functions.
    fn or_hats<const D: usize>(self, order: Order, nodes: &[usize], chunk: &[IntegrationPoint<D>]) -> Self {
        let [mut integral, mut size] = [(); 2].map(|()| vec![0.0; element::node_count(D, order)]);
        for point in chunk {
            let phi = self.shapes(order, &point.at_a);
            for &i in nodes {
                let mu = point.weight * self.value(i, &phi, &point.at_a);
                integral[i] += mu;
                size[i] += mu.abs();
            }
        }
        let rounding = ROUNDING * chunk.iter().map(|point| point.weight).sum::<f64>();
        let limit = STEADY * (order.degree() as f64 / 2.0).sqrt().max(1.0);
        let steady = |i: &usize| integral[*i] > rounding && size[*i] <= limit * integral[*i];
        if nodes.iter().all(steady) { self } else { Self::Hats }
    }

    /// Return mu of local node `i` at barycentric point `l`, where `phi` are the values of the shape functions of
    /// [`PressureBasis::shapes`].
    pub fn value<const D: usize>(&self, i: usize, phi: &[f64], l: &[f64; D]) -> f64 {
        match self {
            Self::Dual(c) | Self::Part(c, _) => c.row(i).iter().zip(phi).map(|(c, phi)| c * phi).sum(),
            Self::Hats => l.get(i).copied().unwrap_or(0.0),
            Self::MidEdges => i.checked_sub(D).map_or(0.0, |edge| at_mid_edge(edge, phi)),
        }
    }

    /// Return the values at barycentric point `l` of the shape functions that the functions of this basis are made of.
    pub fn shapes<const D: usize>(&self, order: Order, l: &[f64; D]) -> Values {
        match self {
            Self::Part(_, part) => part.values(order, l),
            _ => element::values(order, l),
        }
    }

    /// Return the nodes whose functions this basis has.
    pub fn carriers(&self) -> Carriers {
        match self {
            Self::Dual(_) => Carriers::Nodes,
            Self::Part(_, part) => Carriers::Part(*part),
            Self::Hats => Carriers::Vertices,
            Self::MidEdges => Carriers::MidEdges,
        }
    }
}

/// Return whether the facets of side b at these points are of several parts that have no vertex in common.
fn are_apart<const D: usize>(b: &Facets<D>, chunk: &[IntegrationPoint<D>]) -> bool {
    let mut facets: Vec<usize> = chunk.iter().map(|point| point.facet_b).collect();
    facets.sort_unstable();
    facets.dedup();
    let vertices = |i: usize| &b.facet(facets[i])[..D];
    let mut joined = DisjointSets::new(facets.len());
    for i in 1..facets.len() {
        for j in (0..i).filter(|&j| vertices(i).iter().any(|node| vertices(j).contains(node))) {
            joined.join(i as u32, j as u32);
        }
    }
    joined.classes().0 > 1
}

/// Return the function diag(int phi) M^-1 phi of a flat quadratic triangle for mid-edge `edge`, from the values `phi`
/// of the shape functions with mass matrix M. The functions of the vertices vanish, since int phi is zero there. Those
/// of the three mid-edges therefore sum to one.
fn at_mid_edge(edge: usize, phi: &[f64]) -> f64 {
    let vertices = -0.5 * (phi[0] + phi[1] + phi[2]) + 2.5 * phi[opposite(edge)];
    let edges = -1.125 * (phi[3] + phi[4] + phi[5]) + 4.375 * phi[3 + edge];
    vertices + edges
}

#[cfg(test)]
mod tests {
    use super::*;

    /// int mu_e phi_j = A/3 if j is the mid-edge e, and zero for the five other nodes; the three functions sum to one.
    #[test]
    fn functions_of_mid_edges_are_dual_and_sum_to_one() {
        let rule = element::rule(3, 5);
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

    /// All carriers interpolate linear functions exactly, and all nodes together quadratic ones.
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
