//! Displacements recovered by patches, and the error estimated from them: polynomial preserving recovery (Zhang and Naga 2005).
//!
//! Around each vertex a polynomial of one degree more than the elements is fitted to the nodal displacements. Its gradient is of
//! higher order than the discrete one on any mesh, at boundaries too. Between vertices the polynomials are blended by the linear
//! hats. Patches end at the boundary of their body, so nothing is smoothed across a contact. A vertex on the boundary uses two
//! rings of cells, since a single ring is one-sided.

mod blend;
mod patch;
mod rings;
mod soften;
mod strip;
#[cfg(test)]
mod tests;

use super::assemble::interpolate;
use super::space::Space;
use super::{Slope, element, quadrature};
use crate::problem::order::Order;
pub use blend::InterpolationError;
use patch::{Monomials, Patch};
use rings::Rings;

/// A function that returns the stress (xx yy zz xy yz xz) in a cell at a point. Its last argument is the strain there (xx yy zz,
/// and 2 eps of xy yz xz).
pub type Law<'a, const D: usize> = &'a dyn Fn(usize, [f64; D], &[f64; 6]) -> [f64; 6];

/// Largest number of additional rings of cells that a patch gets while its nodes do not determine the polynomial. Cells at a
/// corner of a body have few nodes, and with two more rings as many as others. No larger patch determines what is then still
/// undetermined, such as the second derivative through a plate one cell thick.
const MORE_RINGS: usize = 3;

/// A displacement with the polynomials recovered from it.
pub struct Recovery<'a, const D: usize> {
    space: &'a Space<D>,
    displacement: &'a [f64],
    /// Polynomial of each vertex; `None` at mid-edge nodes.
    patches: Vec<Option<Patch<D>>>,
    /// Nodal values of the blend of the polynomials, one entry per dof.
    blended: Vec<f64>,
    /// Monomials of the polynomials: of one degree more than the elements, and of each lower degree.
    monomials: Vec<Monomials>,
}

impl<'a, const D: usize> Recovery<'a, D> {
    /// Recover the polynomials of the displacement `u`, one entry per dof.
    pub fn new(space: &'a Space<D>, u: &'a [f64]) -> Self {
        let degree = if space.order == Order::P1 { 2 } else { 3 };
        let monomials = (0..=degree).rev().map(|degree| Monomials::new(D, degree)).collect();
        let mut recovery = Self { space, displacement: u, patches: Vec::new(), blended: Vec::new(), monomials };
        let (mut rings, outer) = (Rings::new(space), recovery.outer_vertices());
        let fit = |node| if rings.is_vertex(node) { recovery.fit(node, outer[node], &mut rings) } else { None };
        recovery.patches = (0..space.nodes.len()).map(fit).collect();
        recovery.blended = recovery.blend_nodes();
        recovery
    }

    /// Return whether each node is a vertex of the boundary. The axis of a body of revolution is not part of the boundary, since
    /// the body continues beyond it.
    fn outer_vertices(&self) -> Vec<bool> {
        let mut outer = vec![false; self.space.nodes.len()];
        for (index, opposite) in self.space.lone_facets() {
            let facet = || (0..=D).filter(|&k| k != opposite).map(|k| self.cell(index)[k]);
            if !facet().all(|node| self.space.on_axis(node)) {
                facet().for_each(|node| outer[node as usize] = true);
            }
        }
        outer
    }

    /// Return the polynomial of a vertex. It has a lower degree in a body or plate of so few cells that its nodes determine no
    /// more.
    fn fit(&self, node: usize, is_outer: bool, rings: &mut Rings<D>) -> Option<Patch<D>> {
        let (space, u) = (self.space, self.displacement);
        let fit = |nodes: &[u32], monomials| Patch::fit(space, u, space.nodes[node], nodes, monomials);
        rings.begin(node);
        if is_outer {
            rings.widen();
        }
        for _ in 0..MORE_RINGS {
            let fitted = fit(rings.nodes(), &self.monomials[0]);
            if fitted.is_some() {
                return fitted;
            }
            rings.widen();
        }
        let nodes = rings.nodes();
        self.monomials.iter().find_map(|monomials| fit(nodes, monomials))
    }

    fn cell(&self, index: usize) -> &'a [u32] {
        &self.space.cells[index * self.space.stride..(index + 1) * self.space.stride]
    }

    fn patch(&self, node: u32) -> &Patch<D> {
        match &self.patches[node as usize] {
            Some(patch) => patch,
            None => unreachable!("vertices of cells have patches"),
        }
    }

    /// Return the strain of the recovered minus the discrete displacement in a linear cell, as coefficients of the products l_k
    /// l_m with k <= m. The gradient of a parabola is linear, the blending weights are linear in linear elements, and all
    /// products sum to one.
    fn strain_errors(&self, cell: &[u32], gradient: &[[f64; D]]) -> Vec<[f64; 6]> {
        let discrete = self.space.slope(cell, &[0.0; D], &[], gradient, self.displacement);
        let recovered = |node: usize, at: usize| {
            let at = &self.space.nodes[cell[at] as usize];
            Slope { h: self.patch(cell[node]).jet(&self.monomials[0], at).1, hoop: 0.0 }
        };
        let mut errors = Vec::new();
        for k in 0..=D {
            for m in k..=D {
                let mut slope = recovered(k, m);
                slope.add(-1.0, &discrete);
                if m > k {
                    slope.add(1.0, &recovered(m, k));
                    slope.add(-1.0, &discrete);
                }
                errors.push(slope.strain());
            }
        }
        errors
    }

    /// Return the gradient of the polynomial of a vertex.
    fn recovered(&self, node: u32, at: &[f64; D]) -> Slope<D> {
        let (value, h) = self.patch(node).jet(&self.monomials[0], at);
        Slope { h, hoop: if self.space.axisymmetric { self.space.hoop(at, value[0]) } else { 0.0 } }
    }

    /// Return the squared energy norm of the recovered minus the discrete stress on each cell.
    pub fn energy_errors(&self, law: Law<D>) -> Vec<f64> {
        let rule = quadrature::simplex(D + 1, 5);
        let is_linear = self.space.order == Order::P1 && !self.space.axisymmetric;
        let density = |index: usize, at: [f64; D], strain: &[f64; 6]| -> f64 {
            law(index, at, strain).iter().zip(strain).map(|(s, e)| s * e).sum()
        };
        let of_cell = |index: usize| {
            let (cell, x) = (self.cell(index), self.space.cell_nodes(index));
            let mut sum = 0.0;
            if is_linear {
                let Some((gradient, measure)) = element::gradients(Order::P1, &x, &rule.points[0]) else { return 0.0 };
                let errors = self.strain_errors(cell, &gradient[..=D]);
                for (l, weight) in rule.iter() {
                    let products = (0..=D).flat_map(|k| (k..=D).map(move |m| l[k] * l[m]));
                    let mut strain = [0.0; 6];
                    for (product, error) in products.zip(&errors) {
                        (0..6).for_each(|i| strain[i] += product * error[i]);
                    }
                    sum += weight * measure * density(index, interpolate(&x, l), &strain);
                }
                return sum;
            }
            for (l, weight) in rule.iter() {
                let Some((gradient, measure)) = element::gradients(self.space.order, &x, l) else { continue };
                let phi = element::values(self.space.order, l);
                let at = interpolate(&x, &phi);
                let mut difference = Slope::ZERO;
                l.iter().zip(cell).for_each(|(l, &node)| difference.add(*l, &self.recovered(node, &at)));
                difference.add(-1.0, &self.space.slope(cell, &at, &phi, &gradient, self.displacement));
                sum += weight * measure * self.space.circle(&at) * density(index, at, &difference.strain());
            }
            sum
        };
        (0..self.space.cell_count()).map(of_cell).collect()
    }
}
