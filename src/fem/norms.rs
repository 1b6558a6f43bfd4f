//! Norms of the error of a finite element displacement against a known one.

use super::elasticity::Elasticity;
use super::space::Space;
use super::{Slope, assemble, element, quadrature};

/// The norms of a displacement of one body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Norms {
    /// L2 norm: root of the integral of u.u.
    pub l2: f64,
    /// H1 seminorm: root of the integral of grad u : grad u, plus (u_r/r)^2 in bodies of revolution.
    pub h1: f64,
    /// Energy norm: root of the integral of eps(u) : C eps(u), which is twice the strain energy.
    pub energy: f64,
}

/// A known displacement u at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exact<const D: usize> {
    /// Components u_i.
    pub value: [f64; D],
    /// Derivatives du_i/dx_j.
    pub gradient: [[f64; D]; D],
}

/// Return the norms of u_h - u and of u, in this order, over some cells of a space, by a rule exact to degree five.
///
/// The argument `u` is the finite element displacement u_h, one entry a dof, and `exact` is the known displacement u. Points without
/// elasticity, which assembly refuses, count without energy. The norms are NaN where `exact` is not finite.
pub fn error<const D: usize>(
    space: &Space<D>,
    cells: impl Iterator<Item = usize>,
    elasticity: &Elasticity,
    u: &[f64],
    exact: &dyn Fn([f64; D]) -> Exact<D>,
) -> [Norms; 2] {
    let rule = quadrature::simplex(D + 1, 5);
    let mut squares = [Norms::default(); 2];
    for index in cells {
        let x = space.cell_nodes(index);
        let cell = space.cell(index);
        let nodal: Vec<[f64; D]> = cell.iter().map(|&node| std::array::from_fn(|c| u[D * node as usize + c])).collect();
        for (l, weight) in rule.iter() {
            let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
            let phi = element::values(space.order, l);
            let at = assemble::interpolate(&x, &phi);
            let known = exact(at);
            let value = assemble::interpolate(&nodal, &phi);
            let exact_slope = Slope { h: known.gradient, hoop: space.hoop(&at, known.value[0]) };
            let mut difference = space.slope(cell, &at, &phi, &gradient, u);
            difference.add(-1.0, &exact_slope);
            let error = std::array::from_fn(|i| value[i] - known.value[i]);
            let material = elasticity.at(index, space.in_scene(at)).ok();
            let weight = weight * measure * space.circle(&at);
            for (sum, (value, slope)) in squares.iter_mut().zip([(error, difference), (known.value, exact_slope)]) {
                let strain = slope.strain();
                let stress = material.map_or([0.0; 6], |material| material.stress(&strain));
                sum.l2 += weight * value.iter().map(|v| v * v).sum::<f64>();
                sum.h1 += weight * slope.square();
                sum.energy += weight * stress.iter().zip(strain).map(|(s, e)| s * e).sum::<f64>();
            }
        }
    }
    squares.map(|sum| Norms { l2: sum.l2.sqrt(), h1: sum.h1.sqrt(), energy: sum.energy.sqrt() })
}
