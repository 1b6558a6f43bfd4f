//! The polynomials of the vertices blended to one displacement, and the error of its nodal interpolant.
//!
//! With P_i the polynomial of vertex i and l_i its barycentric coordinate (the hat function of the vertex)
//!
//! ```text
//! u* = sum l_i P_i          the blend: continuous, since on a facet only the hats of its vertices are not zero
//! b  = u* - I u*            the error of the interpolant I u* at the nodes
//! ```
//!
//! b vanishes at all nodes and is continuous. For a displacement of one degree more than the elements, b is exact.

use super::{Law, Recovery};
use crate::fem::{EDGES, Slope, assemble::interpolate, element, quadrature};
use crate::linalg::dot;
use crate::problem::order::Order;

impl<const D: usize> Recovery<'_, D> {
    /// Return the values of the blend at all nodes, one entry per dof. At a vertex it is the value of the polynomial, at the
    /// middle of an edge the mean of those of both ends.
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

    /// Return the error b of the nodal interpolant at barycentric point `l` of a simplex with these nodes, which is a cell or a
    /// facet.
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

    /// Compute the residual `-int sigma(b) : grad v` of the interpolation error b for every shape function v, and for quadratic elements the squared
    /// energy norm of b on each cell. The quadrature of linear elements is too coarse for the latter.
    ///
    /// With b the error of the nodal interpolant, a displacement w with this residual is the error of the nodal values.
    pub fn interpolation_error(&self, law: Law<D>) -> InterpolationError {
        let space = self.space;
        // The gradient of b has one degree more than the elements, and that of v has one less.
        let rule = quadrature::simplex(D + 1, if space.order == Order::P1 { 2 } else { 5 });
        let mut error = InterpolationError { residual: vec![0.0; space.dofs()], cells: Vec::new() };
        for index in 0..space.cell_count() {
            let (x, mut energy) = (space.cell_nodes(index), 0.0);
            for (l, weight) in rule.iter() {
                let Some((at, measure)) = At::new(space.order, self.cell(index), &x, l) else { continue };
                let weight = weight * measure * space.circle(&at.x);
                let strain = self.missed_slope(&at).strain();
                let stress = law(index, at.x, &strain);
                energy += weight * dot(&stress, &strain);
                self.add_stress(&at, -weight, &stress, &mut error.residual);
            }
            if space.order == Order::P2 {
                error.cells.push(energy);
            }
        }
        error
    }

    /// Return the gradient of b at a point of a cell.
    pub(super) fn missed_slope(&self, at: &At<D>) -> Slope<D> {
        let hats = at.hats();
        let mut slope = Slope::ZERO;
        for (k, &vertex) in at.cell[..=D].iter().enumerate() {
            let (value, h) = self.patch(vertex).jet(&self.monomials[0], &at.x);
            for c in 0..D {
                (0..D).for_each(|j| slope.h[c][j] += at.l[k] * h[c][j] + value[c] * hats[k][j]);
            }
            slope.hoop += at.l[k] * self.space.hoop(&at.x, value[0]);
        }
        slope.add(-1.0, &self.space.slope(at.cell, &at.x, &at.phi, &at.gradient, &self.blended));
        slope
    }

    /// Return the gradient of the discrete displacement at a point of a cell.
    pub(super) fn discrete_slope(&self, at: &At<D>) -> Slope<D> {
        self.space.slope(at.cell, &at.x, &at.phi, &at.gradient, self.displacement)
    }

    /// Add `weight sigma : grad v` for the shape functions v of a cell to `sum`.
    pub(super) fn add_stress(&self, at: &At<D>, weight: f64, stress: &[f64; 6], sum: &mut [f64]) {
        let place = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
        for (a, &node) in at.cell.iter().enumerate() {
            let first = D * node as usize;
            for c in 0..D {
                let work: f64 = (0..D).map(|j| stress[place[c][j]] * at.gradient[a][j]).sum();
                sum[first + c] += weight * work;
            }
            sum[first] += weight * stress[2] * self.space.hoop(&at.x, at.phi[a]);
        }
    }
}

/// The error b of the nodal interpolant of a recovered displacement.
pub struct InterpolationError {
    /// Residual `-int sigma(b) : grad v` for every shape function v, one entry per dof.
    pub residual: Vec<f64>,
    /// Squared energy norm of b on each cell; empty for linear elements.
    pub cells: Vec<f64>,
}

/// A point of a cell, with the shape functions there.
pub(super) struct At<'a, const D: usize> {
    /// Nodes of the cell.
    cell: &'a [u32],
    /// Barycentric coordinates of the point.
    l: &'a [f64],
    /// Coordinates of the point.
    pub x: [f64; D],
    phi: [f64; element::MOST],
    gradient: [[f64; D]; element::MOST],
}

impl<'a, const D: usize> At<'a, D> {
    /// Return the point with these barycentric coordinates in a cell with nodes at `x`, and the measure there. The result is
    /// `None` if the cell is folded.
    pub fn new(order: Order, cell: &'a [u32], x: &[[f64; D]], l: &'a [f64]) -> Option<(Self, f64)> {
        let (gradient, measure) = element::gradients(order, x, l)?;
        let phi = element::values(order, l);
        Some((Self { cell, l, x: interpolate(x, &phi), phi, gradient }, measure))
    }

    /// Return the gradients of the barycentric coordinates, also in curved cells. The coordinate l_k is one at vertex k, and a
    /// half in the middle of each edge at this vertex.
    fn hats(&self) -> [[f64; D]; 4] {
        let mut hats = [[0.0; D]; 4];
        hats[..=D].copy_from_slice(&self.gradient[..=D]);
        for (middle, &(i, j)) in self.gradient[D + 1..self.cell.len()].iter().zip(&EDGES) {
            for k in [i, j] {
                (0..D).for_each(|c| hats[k][c] += 0.5 * middle[c]);
            }
        }
        hats
    }
}
