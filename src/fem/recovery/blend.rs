//! The polynomials of the vertices as one displacement, and what its nodal interpolant misses.
//!
//! With P_i the polynomial of vertex i and l_i its barycentric coordinate (the hat function of the vertex)
//!
//! ```text
//! u* = sum l_i P_i          the blend: continuous, since on a facet only the hats of its vertices are not zero
//! b  = u* - I u*            what the interpolant at the nodes misses
//! ```
//!
//! b vanishes at all nodes and is continuous. A displacement of one degree more than the elements has this b exactly.

use super::{Law, Recovery};
use crate::fem::{EDGES, Slope, assemble::interpolate, element, quadrature};
use crate::problem::order::Order;

impl<const D: usize> Recovery<'_, D> {
    /// Values of the blend at all nodes, one entry a dof: those of the polynomials at vertices, their mean at the middle of an edge.
    pub(super) fn blend_nodes(&self) -> Vec<f64> {
        let space = self.space;
        let value = |vertex: u32, node: u32| {
            let at = &space.nodes[node as usize];
            self.patches[vertex as usize].as_ref().map_or([0.0; D], |patch| patch.jet(&self.monomials[0], at).0)
        };
        let mut blended = vec![0.0; space.dofs()];
        let mut is_known = vec![false; space.nodes.len()];
        for index in 0..space.cell_count() {
            let cell = self.cell(index);
            for (k, &node) in cell.iter().enumerate() {
                if std::mem::replace(&mut is_known[node as usize], true) {
                    continue;
                }
                let (i, j) = k.checked_sub(D + 1).map_or((k, k), |edge| EDGES[edge]);
                let ends = [value(cell[i], node), value(cell[j], node)];
                (0..D).for_each(|c| blended[D * node as usize + c] = 0.5 * (ends[0][c] + ends[1][c]));
            }
        }
        blended
    }

    /// The error b of the nodal interpolant at barycentric point `l` of a simplex, a cell or a facet, with these nodes.
    pub fn missed(&self, nodes: &[u32], l: &[f64]) -> [f64; D] {
        let phi = element::values(self.space.order, l);
        let mut at = [0.0; D];
        let mut sum = [0.0; D];
        for (&node, phi) in nodes.iter().zip(phi) {
            let (x, first) = (&self.space.nodes[node as usize], D * node as usize);
            (0..D).for_each(|c| at[c] += phi * x[c]);
            (0..D).for_each(|c| sum[c] -= phi * self.blended[first + c]);
        }
        for (&vertex, l) in nodes.iter().zip(l).filter(|(_, l)| **l != 0.0) {
            let value = self.patch(vertex).jet(&self.monomials[0], &at).0;
            (0..D).for_each(|c| sum[c] += l * value[c]);
        }
        sum
    }

    /// Residual of the interpolation error: `-int sigma(b) : grad v` for every shape function v.
    ///
    /// With b the error of the nodal interpolant, a displacement w with this residual is what the nodal values lack.
    pub fn interpolation_residual(&self, law: Law<D>) -> Vec<f64> {
        let space = self.space;
        // the gradient of b has one degree more than the elements, that of v one less
        let rule = quadrature::simplex(D + 1, if space.order == Order::P1 { 2 } else { 5 });
        let mut residual = vec![0.0; space.dofs()];
        for index in 0..space.cell_count() {
            let x = space.cell_nodes(index);
            for (l, weight) in rule.iter() {
                let Some((gradient, measure)) = element::gradients(space.order, &x, l) else { continue };
                let phi = element::values(space.order, l);
                let at = interpolate(&x, &phi);
                let stress = law(index, at, &self.missed_slope(index, &at, l, &phi, &gradient).strain());
                let weight = weight * measure * space.circle(&at);
                self.add_stress(index, &at, -weight, &stress, &phi, &gradient, &mut residual);
            }
        }
        residual
    }

    /// Gradient of b at a point `at` of a cell with barycentric coordinates `l`, and there the values and gradients of the shape functions.
    pub(super) fn missed_slope(
        &self,
        index: usize,
        at: &[f64; D],
        l: &[f64],
        phi: &[f64],
        gradient: &[[f64; D]],
    ) -> Slope<D> {
        let cell = self.cell(index);
        let hats = hats(gradient, cell.len());
        let mut slope = Slope::ZERO;
        for (k, &vertex) in cell[..=D].iter().enumerate() {
            let (value, h) = self.patch(vertex).jet(&self.monomials[0], at);
            for c in 0..D {
                (0..D).for_each(|j| slope.h[c][j] += l[k] * h[c][j] + value[c] * hats[k][j]);
            }
            slope.hoop += l[k] * self.space.hoop(at, value[0]);
        }
        slope.add(-1.0, &self.space.slope(cell, at, phi, gradient, &self.blended));
        slope
    }

    /// Add `weight sigma : grad v` for the shape functions v of a cell to `sum`.
    fn add_stress(
        &self,
        index: usize,
        at: &[f64; D],
        weight: f64,
        stress: &[f64; 6],
        phi: &[f64],
        gradient: &[[f64; D]],
        sum: &mut [f64],
    ) {
        let place = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
        for (a, &node) in self.cell(index).iter().enumerate() {
            let first = D * node as usize;
            for c in 0..D {
                let work: f64 = (0..D).map(|j| stress[place[c][j]] * gradient[a][j]).sum();
                sum[first + c] += weight * work;
            }
            sum[first] += weight * stress[2] * self.space.hoop(at, phi[a]);
        }
    }
}

/// Gradients of the barycentric coordinates of a cell, which may be curved, from those of its shape functions: l_k is one at vertex k and a half in the middle of
/// each edge there.
fn hats<const D: usize>(gradient: &[[f64; D]], nodes: usize) -> [[f64; D]; 4] {
    let mut hats = [[0.0; D]; 4];
    hats[..=D].copy_from_slice(&gradient[..=D]);
    for (middle, &(i, j)) in gradient[D + 1..nodes].iter().zip(&EDGES) {
        for k in [i, j] {
            (0..D).for_each(|c| hats[k][c] += 0.5 * middle[c]);
        }
    }
    hats
}
