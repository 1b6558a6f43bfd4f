//! The load by which a discrete body is too stiff.
//!
//! Loads f do the work f'e = a(u, e) = a(e, e) = eta^2 on the error e = u - u_h, since a(u_h, e) = 0. So the discrete body is too stiff, and each cell
//! K contributes eta_K^2 to what its compliance lacks. The load
//!
//! ```text
//! s(v) = sum_K theta_K a_K(u_h, v),     theta_K = eta_K^2 / (eta_K^2 + a_K(u_h, u_h))
//! ```
//!
//! is that of a body whose stiffness is lower by theta_K in each cell. Its work s(u_h) is the sum of the eta_K^2 where these are small. The
//! interpolation error of a recovered displacement does the same work where the solution is smooth, but none where it is singular: recovered
//! polynomials miss the singular part, whose error reaches all nodes.

use super::blend::At;
use super::{Law, Recovery};
use crate::fem::quadrature;
use crate::linalg::dot;
use crate::problem::order::Order;

impl<const D: usize> Recovery<'_, D> {
    /// Return the load s(v) for every shape function v, one entry per dof, with the squared energy error `errors` of each cell.
    pub fn softening(&self, law: Law<D>, errors: &[f64]) -> Vec<f64> {
        let space = self.space;
        // Strains are of one degree less than the elements.
        let rule = quadrature::simplex(D + 1, if space.order == Order::P1 { 1 } else { 2 });
        let mut load = vec![0.0; space.dofs()];
        for (index, error) in errors.iter().enumerate() {
            let (x, mut energy, mut stresses) = (space.cell_nodes(index), 0.0, Vec::with_capacity(rule.points.len()));
            for (l, weight) in rule.iter() {
                let Some((at, measure)) = At::new(space.order, self.cell(index), &x, l) else { continue };
                let strain = self.discrete_slope(&at).strain();
                let stress = law(index, at.x, &strain).map(|s| s * weight * measure * space.circle(&at.x));
                energy += dot(&stress, &strain);
                stresses.push((at, stress));
            }
            let theta = error / (error + energy).max(f64::MIN_POSITIVE);
            stresses.iter().for_each(|(at, stress)| self.add_stress(at, theta, stress, &mut load));
        }
        load
    }
}
