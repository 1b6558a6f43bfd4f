//! The products of the errors of two displacements of one body, cell by cell: of the solution, and of its influence on
//! a force.

use super::{Recovery, lagrange};
use crate::fem::element::{self, Rule};
use crate::fem::space::CellPoint;
use crate::linalg::dot;
use crate::problem::order::Order;

/// Least power of a displacement at a singular place, that of a crack and of the end of a support.
const SINGULAR: f64 = 0.5;

impl<const D: usize> Recovery<'_, D> {
    /// Return the product a(e, e') of the errors of this displacement and of another one in each cell.
    ///
    /// Up to order two an error is the distance of the recovered from the discrete displacement, with quadratic
    /// elements that from the interpolant where the product is smaller, as in [`Recovery::errors`].
    ///
    /// Above order two, recovered polynomials miss nearly all of the error at singular places. There the highest parts
    /// u_k of the discrete displacements, in orthogonal polynomials, tell the missing ones. A displacement r^mu has an
    /// energy error of k^-2mu (Babuska and Suri 1994), so that the products of the parts n fall as n^-s with s = 2 mu +
    /// 2 mu' + 1, and those of all n > k are
    ///
    /// ```text
    /// sum a(u_n, u'_n) = a(u_k, u'_k) (k + 1/2)/(s - 1) (1 + 1/(2k))^-s
    /// ```
    pub fn products(&self, other: &Self) -> Vec<f64> {
        let order = self.space.order;
        let rule = element::rule(D + 1, 2 * order.degree()).with_shapes(order);
        if order > Order::P2 {
            return self.products_of_parts(other, &rule);
        }
        let product = |index: usize| {
            let distance = self.product(index, &rule, |point| [self, other].map(|each| each.strain_beyond(point)));
            if order == Order::P1 {
                return distance;
            }
            let missed = |point: &CellPoint<D>| [self, other].map(|each| each.missed_slope(point).strain());
            let of_interpolants = self.product(index, &rule, missed);
            if of_interpolants.abs() < distance.abs() { of_interpolants } else { distance }
        };
        (0..self.space.cell_count()).map(product).collect()
    }

    /// Return these products from the highest parts of both displacements.
    fn products_of_parts(&self, other: &Self, rule: &Rule) -> Vec<f64> {
        let (both, order, k) = ([self, other], self.space.order, self.space.order.degree() as f64);
        let powers = both.map(Recovery::powers);
        let mut parts = [(); 2].map(|()| vec![0.0; self.space.dofs()]);
        let product = |index: usize| {
            let cell = self.space.cell(index);
            for (part, each) in parts.iter_mut().zip(both) {
                for c in 0..D {
                    let dof = |i: usize| D * cell[i] as usize + c;
                    let highest = lagrange::of(order, D + 1).highest_part(|i| each.displacement[dof(i)]);
                    highest.into_iter().enumerate().for_each(|(i, value)| part[dof(i)] = value);
                }
            }
            let s = 1.0 + 2.0 * powers.iter().map(|mu| mu[index].clamp(SINGULAR, k)).sum::<f64>();
            let product = self.product(index, rule, |point| parts.each_ref().map(|part| point.slope(part).strain()));
            product * (k + 0.5) / (s - 1.0) * (1.0 + 0.5 / k).powf(-s)
        };
        (0..self.space.cell_count()).map(product).collect()
    }

    /// Return `int eps : C eps'` over a cell for the strains at its points.
    pub(super) fn product(&self, index: usize, rule: &Rule, strains: impl Fn(&CellPoint<D>) -> [[f64; 6]; 2]) -> f64 {
        let of_point = |point: CellPoint<D>| {
            let [strain, other] = strains(&point);
            point.weight * dot(&self.stress(index, point.at, &strain), &other)
        };
        self.space.points(index, rule).flatten().map(of_point).sum()
    }

    /// Return the strain of the recovered minus the discrete displacement at a point of a cell.
    pub(super) fn strain_beyond(&self, point: &CellPoint<D>) -> [f64; 6] {
        let mut slope = self.recovered_slope(point.cell, point.l, &point.at);
        slope.add(-1.0, &point.slope(&self.displacement));
        slope.strain()
    }
}
