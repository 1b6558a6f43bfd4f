//! The pressure functions mu_q on one facet: which of its nodes carry a pressure, and how means around them are
//! weighted.

use super::point::IntegrationPoint;
use super::side::Side;
use crate::fem::element::{self, EDGES, Values};
use crate::fem::{Facets, lagrange};
use crate::linalg::DisjointSets;
use crate::problem::order::Order;
use nalgebra::{DMatrix, DVector};

/// The functions mu_i of the nodes of one facet of side a, and the functions that interpolate values at these nodes.
/// Both are combinations of the shape functions phi, mu = C phi and E phi. A node that carries no pressure has a zero
/// row in both.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureBasis {
    order: Order,
    /// Ends of a part of an edge, from 0 to 1 along it, if the functions phi are those of the part. Without it they are
    /// those of the whole facet.
    part: Option<[f64; 2]>,
    /// C.
    functions: DMatrix<f64>,
    /// E.
    interpolation: DMatrix<f64>,
    /// Whether the functions are the hat functions of the vertices.
    pub is_averaged: bool,
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
    /// Choose the basis for functions of `order` on facet `chunk[0].facet_a` of side a. `chunk` holds the integration
    /// points of the part that the facets of side b cover, and `ends` are the ends of this part on an edge.
    ///
    /// On an edge of order two or more a node on the axis of revolution carries no point. On a straight edge int r phi
    /// is zero there, and on a curved edge it has either sign: it is distributed over the other nodes, so that their
    /// weights integrate polynomials of one degree less than the elements as before.
    ///
    /// Where the facets of side b are apart, the distance jumps, and a dual mean would be beyond the distances on both
    /// sides of the jump: an overlap where there is none.
    pub fn on<const D: usize>(
        order: Order,
        a: &Side<D>,
        b: &Facets<D>,
        ends: [f64; 2],
        chunk: &[IntegrationPoint<D>],
    ) -> Self {
        let dual = if are_apart(b, chunk) {
            None
        } else if order == Order::P2 && D == 3 {
            Some(Self::mid_edges())
        } else {
            Self::dual(order, a.axis_of(chunk[0].facet_a), ends, chunk)
        };
        dual.filter(|basis| basis.is_steady(chunk)).unwrap_or_else(|| Self::hats::<D>(order))
    }

    /// Return the hat functions: the barycentric coordinate mu_i = l_i at vertex i.
    fn hats<const D: usize>(order: Order) -> Self {
        let nodes = element::nodes::<D>(order);
        let hats = DMatrix::from_fn(nodes.len(), nodes.len(), |i, j| if i < D { nodes[j][i] } else { 0.0 });
        Self { order, part: None, functions: hats.clone(), interpolation: hats, is_averaged: true }
    }

    /// Return the functions diag(int phi) M^-1 phi of a flat quadratic triangle with mass matrix M, and the
    /// interpolation between its mid-edges, which is linear. The functions of the vertices vanish, since int phi is
    /// zero there. Those of the three mid-edges therefore sum to one.
    fn mid_edges() -> Self {
        let nodes = element::nodes::<3>(Order::P2);
        let of_edges = |at: &dyn Fn(usize, usize) -> f64| {
            DMatrix::from_fn(6, 6, |i, j| if i < 3 { 0.0 } else { at(3 - EDGES[i - 3].0 - EDGES[i - 3].1, j) })
        };
        // `opposite` is the vertex that the edge does not touch
        let functions = of_edges(&|opposite, j| match nodes[j][opposite] {
            1.0 => 2.0,
            0.0 if j >= 3 => 3.25,
            0.0 => -0.5,
            _ => -1.125,
        });
        let interpolation = of_edges(&|opposite, j| 1.0 - 2.0 * nodes[j][opposite]);
        Self { order: Order::P2, part: None, functions, interpolation, is_averaged: false }
    }

    /// Return the dual basis of the covered part: C = diag(int phi) M^-1 with the mass matrix M, for the shape
    /// functions of this part on edges of order three or more, or of order two with a node on the axis; `None` where M
    /// is singular.
    fn dual<const D: usize>(
        order: Order,
        axis: Option<usize>,
        ends: [f64; 2],
        chunk: &[IntegrationPoint<D>],
    ) -> Option<Self> {
        let count = element::node_count(D, order);
        let of_parts = D == 2 && (order > Order::P2 || order == Order::P2 && axis.is_some());
        // an end at a vertex has the point of the vertex
        let ends = ends.map(|end| if (end - end.round()).abs() <= ROUNDING { end.round() } else { end });
        if of_parts && ends[1] - ends[0] <= ROUNDING {
            return None;
        }
        let identity = DMatrix::identity(count, count);
        let part = of_parts.then_some(ends);
        let mut basis = Self { order, part, functions: identity.clone(), interpolation: identity, is_averaged: false };
        let (mut mass, mut integral) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for point in chunk {
            let phi = DVector::from_column_slice(&basis.shapes(&point.at_a));
            integral.axpy(point.weight, &phi, 1.0);
            mass.ger(point.weight, &phi, &phi, 1.0);
        }
        basis.functions = mass.cholesky()?.inverse();
        // a part that ends before the axis has all of its points
        if let Some(axis) = axis.filter(|&i| of_parts && ends[i] == i as f64) {
            // the polynomial of one degree less through the other nodes
            let highest = lagrange::of(order, D).highest();
            let shares = DVector::from_fn(count, |i, _| highest[i] / highest[axis]);
            integral.axpy(-integral[axis], &shares, 1.0);
            basis.interpolation.column_mut(axis).axpy(-1.0, &shares, 1.0);
        }
        basis.functions.row_iter_mut().zip(&integral).for_each(|(mut row, integral)| row *= *integral);
        Some(basis)
    }

    /// Return whether the functions of all nodes that carry a pressure have steady means on the covered part.
    fn is_steady<const D: usize>(&self, chunk: &[IntegrationPoint<D>]) -> bool {
        let count = self.functions.nrows();
        let [mut integral, mut size] = [(); 2].map(|()| DVector::zeros(count));
        for point in chunk {
            let mu = point.weight * self.functions(&point.at_a);
            size += mu.abs();
            integral += mu;
        }
        let rounding = ROUNDING * chunk.iter().map(|point| point.weight).sum::<f64>();
        let limit = STEADY * (self.order.degree() as f64 / 2.0).sqrt().max(1.0);
        let steady = |i: usize| integral[i] > rounding && size[i] <= limit * integral[i];
        (0..count).filter(|&i| self.carries(i)).all(steady)
    }

    /// Return the values of all functions mu_i at barycentric point `l`.
    pub fn functions<const D: usize>(&self, l: &[f64; D]) -> DVector<f64> {
        &self.functions * DVector::from_column_slice(&self.shapes(l))
    }

    /// Return the functions that interpolate values at the nodes, at barycentric point `l`.
    pub fn interpolation<const D: usize>(&self, l: &[f64; D]) -> DVector<f64> {
        &self.interpolation * DVector::from_column_slice(&self.shapes(l))
    }

    /// Return whether a local node carries a pressure.
    pub fn carries(&self, node: usize) -> bool {
        self.interpolation[(node, node)] != 0.0
    }

    /// Return whether the functions are those of the covered part of an edge, whose degree is that of the elements.
    pub fn is_of_part(&self) -> bool {
        self.part.is_some()
    }

    /// Return the values of phi at barycentric point `l`.
    fn shapes<const D: usize>(&self, l: &[f64; D]) -> Values {
        let Some([from, to]) = self.part else { return element::values(self.order, l) };
        let along = (l[1] - from) / (to - from);
        element::values(self.order, &[1.0 - along, along])
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

#[cfg(test)]
mod tests {
    use super::*;

    /// int mu_e phi_j = A/3 if j is the mid-edge e, and zero for the five other nodes; the three functions sum to one.
    #[test]
    fn functions_of_mid_edges_are_dual_and_sum_to_one() {
        let basis = PressureBasis::mid_edges();
        let mut pairing = DMatrix::zeros(6, 6);
        for (l, weight) in element::rule(3, 5).iter() {
            let l = [l[0], l[1], l[2]];
            let mu = basis.functions(&l);
            assert!((mu.sum() - 1.0).abs() < 1e-13, "{mu:?}");
            pairing.ger(weight, &mu, &DVector::from_column_slice(&element::values(Order::P2, &l)), 1.0);
        }
        let exact = DMatrix::from_fn(6, 6, |i, j| if i == j && i >= 3 { 1.0 / 3.0 } else { 0.0 });
        assert!((&pairing - exact).abs().max() < 1e-14, "{pairing}");
    }

    /// All nodes interpolate linear functions exactly, and all nodes of a dual basis quadratic ones. On an edge with a
    /// node on the axis, which carries nothing, it is linear functions.
    #[test]
    fn interpolation_between_nodes() {
        const L: [f64; 3] = [0.2, 0.7, 0.1];
        let linear = |l: &[f64; 3]| 3.0 * l[0] - 2.0 * l[1] + 0.5 * l[2];
        for (basis, carried) in [(PressureBasis::hats::<3>(Order::P2), 0..3), (PressureBasis::mid_edges(), 3..6)] {
            let nodes = element::nodes::<3>(Order::P2);
            let sum: f64 = basis.interpolation(&L).iter().zip(&nodes).map(|(shape, l)| shape * linear(l)).sum();
            assert!((sum - linear(&L)).abs() < 1e-14, "{basis:?}");
            assert!((0..6).all(|i| basis.carries(i) == carried.contains(&i)), "{basis:?}");
        }
        // the weight of a ring about the axis at node 0
        let point = |(l, weight): (&[f64], f64)| {
            let at = [l[0], l[1]];
            IntegrationPoint { facet_a: 0, at_a: at, facet_b: 0, at_b: at, weight: weight * l[1], gap: 0.0 }
        };
        let chunk: Vec<IntegrationPoint<2>> = element::rule(2, 5).iter().map(point).collect();
        let quadratic = |s: f64| s * (1.0 - 3.0 * s);
        for (axis, f) in [(None, &quadratic as &dyn Fn(f64) -> f64), (Some(0), &|s| 2.0 - 3.0 * s)] {
            let basis = PressureBasis::dual(Order::P2, axis, [0.0, 1.0], &chunk).expect("a basis");
            let values: Vec<f64> = element::nodes::<2>(Order::P2).iter().map(|l| f(l[1])).collect();
            assert_eq!(basis.carries(0), axis.is_none());
            let sum: f64 = basis.interpolation(&[0.7, 0.3]).iter().zip(&values).map(|(e, value)| e * value).sum();
            assert!((sum - f(0.3)).abs() < 1e-14, "{basis:?}");
        }
    }
}
