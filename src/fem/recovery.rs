//! Displacements recovered by patches, and what they tell of the error: polynomial preserving recovery (Zhang and Naga 2005).
//!
//! Around each vertex a polynomial of one degree more than the elements is fitted to the nodal displacements. Its gradient
//! is of higher order than the discrete one on any mesh, at boundaries too; between vertices the polynomials are blended by
//! the linear hats. Patches end with their body, so nothing is smoothed across a contact. A vertex on the boundary takes two
//! rings of cells, since one is one-sided.

mod bubble;
mod patch;
mod strip;
#[cfg(test)]
mod tests;

use super::assemble::interpolate;
use super::space::Space;
use super::{Slope, element, quadrature};
use crate::problem::order::Order;
use bubble::Bubble;
use patch::{Monomials, Patch};

/// Stress (xx yy zz xy yz xz) in a cell at a point of a strain (xx yy zz, and 2 eps of xy yz xz).
pub type Law<'a, const D: usize> = &'a dyn Fn(usize, [f64; D], &[f64; 6]) -> [f64; 6];

/// A displacement with the polynomials recovered from it.
pub struct Recovery<'a, const D: usize> {
    space: &'a Space<D>,
    displacement: &'a [f64],
    /// Polynomial of each vertex; `None` at mid-edge nodes.
    patches: Vec<Option<Patch<D>>>,
    /// Those of the polynomials.
    monomials: Monomials,
}

impl<'a, const D: usize> Recovery<'a, D> {
    /// Recovers the gradient of the displacement `u`, one entry a dof.
    pub fn new(space: &'a Space<D>, u: &'a [f64]) -> Self {
        let degree = if space.order == Order::P1 { 2 } else { 3 };
        let mut recovery = Self { space, displacement: u, patches: Vec::new(), monomials: Monomials::new(D, degree) };
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); space.nodes.len()];
        for index in 0..space.cell_count() {
            recovery.vertices(index).iter().for_each(|&node| around[node as usize].push(index as u32));
        }
        let mut outer = vec![false; space.nodes.len()];
        for (index, opposite) in space.lone_facets() {
            let facet = || (0..=D).filter(|&k| k != opposite).map(|k| recovery.cell(index)[k]);
            // beyond the axis a body of revolution goes on
            if !facet().all(|node| space.on_axis(node)) {
                facet().for_each(|node| outer[node as usize] = true);
            }
        }
        let lower: Vec<Monomials> = (0..degree).rev().map(|degree| Monomials::new(D, degree)).collect();
        let (mut cells, mut nodes) = (Marked::new(space.cell_count()), Marked::new(space.nodes.len()));
        let mut patch = |node: usize| {
            cells.clear();
            cells.extend(&around[node]);
            let mut rings = if outer[node] { 2 } else { 1 };
            loop {
                while rings > 1 {
                    nodes.clear();
                    cells.list.iter().for_each(|&cell| nodes.extend(recovery.vertices(cell as usize)));
                    nodes.list.iter().for_each(|&other| cells.extend(&around[other as usize]));
                    rings -= 1;
                }
                nodes.clear();
                cells.list.iter().for_each(|&cell| nodes.extend(recovery.cell(cell as usize)));
                let fit = |monomials| Patch::fit(space, u, space.nodes[node], &nodes.list, monomials);
                let fitted = fit(&recovery.monomials);
                // a body of few cells: what its nodes determine
                if fitted.is_some() || cells.list.len() == space.cell_count() {
                    return fitted.or_else(|| lower.iter().find_map(fit));
                }
                rings = 2;
            }
        };
        let patches = (0..space.nodes.len()).map(|node| if around[node].is_empty() { None } else { patch(node) });
        let patches = patches.collect();
        recovery.patches = patches;
        recovery
    }

    fn cell(&self, index: usize) -> &'a [u32] {
        &self.space.cells[index * self.space.stride..(index + 1) * self.space.stride]
    }

    fn vertices(&self, index: usize) -> &'a [u32] {
        &self.cell(index)[..=D]
    }

    fn patch(&self, node: u32) -> &Patch<D> {
        match &self.patches[node as usize] {
            Some(patch) => patch,
            None => unreachable!("vertices of cells have patches"),
        }
    }

    /// Strain of the recovered displacement less the discrete one in a cell, as products l_k l_m have it, k <= m: the gradient of a parabola is linear,
    /// coordinates are so in linear elements, and all products sum to one.
    fn strain_errors(&self, cell: &[u32], gradient: &[[f64; D]]) -> Vec<[f64; 6]> {
        let discrete = self.space.slope(cell, &[0.0; D], &[], gradient, self.displacement);
        let recovered = |node: usize, at: usize| {
            let at = &self.space.nodes[cell[at] as usize];
            Slope { h: self.patch(cell[node]).slope_of_parabola(&self.monomials, at), hoop: 0.0 }
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

    /// Gradient of the polynomial of a vertex.
    fn recovered(&self, node: u32, at: &[f64; D]) -> Slope<D> {
        let (value, h) = self.patch(node).jet(&self.monomials, at);
        Slope { h, hoop: if self.space.axisymmetric { self.space.hoop(at, value[0]) } else { 0.0 } }
    }

    /// Squared energy norm of the difference of recovered and discrete stress on each cell.
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

    /// Residual of the interpolation error: `-int sigma(b) : grad v` for every shape function v, with the b of
    /// [`Recovery::bubble`].
    ///
    /// With b the error of the nodal interpolant, a displacement w with this residual is what the nodal values lack.
    pub fn interpolation_residual(&self, law: Law<D>) -> Vec<f64> {
        // a bubble has one degree more than the elements, and both factors are gradients
        let rule = quadrature::simplex(D + 1, if self.space.order == Order::P1 { 2 } else { 5 });
        let mut residual = vec![0.0; self.space.dofs()];
        let place = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
        for index in 0..self.space.cell_count() {
            let (cell, x) = (self.cell(index), self.space.cell_nodes(index));
            let bubbles = self.bubbles(&cell[..=D], |_| true);
            for (l, weight) in rule.iter() {
                let Some((gradient, measure)) = element::gradients(self.space.order, &x, l) else { continue };
                let Some((hats, _)) = element::gradients(Order::P1, &x[..=D], l) else { continue };
                let phi = element::values(self.space.order, l);
                let at = interpolate(&x, &phi);
                let mut slope = Slope::<D>::ZERO;
                for (bubble, coefficient) in &bubbles {
                    let d = bubble.slopes(l);
                    for j in 0..D {
                        let along: f64 = (0..=D).map(|k| d[k] * hats[k][j]).sum();
                        (0..D).for_each(|c| slope.h[c][j] += coefficient[c] * along);
                    }
                    slope.hoop += self.space.hoop(&at, bubble.value(l) * coefficient[0]);
                }
                let stress = law(index, at, &slope.strain());
                let weight = weight * measure * self.space.circle(&at);
                for (a, &node) in cell.iter().enumerate() {
                    for c in 0..D {
                        let work: f64 = (0..D).map(|j| stress[place[c][j]] * gradient[a][j]).sum();
                        residual[D * node as usize + c] -= weight * work;
                    }
                    residual[D * node as usize] -= weight * stress[2] * self.space.hoop(&at, phi[a]);
                }
            }
        }
        residual
    }

    /// Error of the nodal interpolant at barycentric point `l` of a simplex with these vertices, by the recovered
    /// derivatives: b with u = I u + b. It has the polynomial degree of the elements and one more, vanishes at all nodes, and is
    /// continuous.
    pub fn bubble(&self, vertices: &[u32], l: &[f64]) -> [f64; D] {
        let mut sum = [0.0; D];
        // most vanish on a facet
        for (bubble, coefficient) in self.bubbles(vertices, |bubble| bubble.value(l) != 0.0) {
            let value = bubble.value(l);
            (0..D).for_each(|c| sum[c] += value * coefficient[c]);
        }
        sum
    }

    /// Those of the functions that vanish at the nodes that are `wanted`, with their coefficients, on a simplex with these
    /// vertices.
    fn bubbles(&self, vertices: &[u32], wanted: impl Fn(&Bubble) -> bool) -> Vec<(Bubble, [f64; D])> {
        let n = vertices.len();
        let arm = |from: usize, to: usize| -> [f64; D] {
            let [x, y] = [from, to].map(|k| self.space.nodes[vertices[k] as usize]);
            std::array::from_fn(|c| y[c] - x[c])
        };
        let mean = |of: &[usize], along: &[[f64; D]]| -> [f64; D] {
            let mut sum = [0.0; D];
            for &k in of {
                let derivative = self.patch(vertices[k]).derivative(along);
                (0..D).for_each(|c| sum[c] += derivative[c] / of.len() as f64);
            }
            sum
        };
        let mut all = Vec::new();
        for i in 0..n {
            for j in i + 1..n {
                if self.space.order == Order::P1 {
                    all.push(Bubble::Edge(i, j));
                    continue;
                }
                all.push(Bubble::OddEdge(i, j));
                all.extend((j + 1..n).map(|k| Bubble::Face(i, j, k)));
            }
        }
        let coefficient = |bubble: &Bubble| match *bubble {
            // u(s) - linear = -s (1 - s) u''/2 on an edge
            Bubble::Edge(i, j) => mean(&[i, j], &[arm(i, j); 2]).map(|d| -0.5 * d),
            // u(s) - quadratic = s (s - 1/2) (s - 1) u'''/6 on an edge
            Bubble::OddEdge(i, j) => mean(&[i, j], &[arm(i, j); 3]).map(|d| d / 12.0),
            Bubble::Face(i, j, k) => {
                let (a, b, of) = (arm(k, i), arm(k, j), [i, j, k]);
                let third = |x, y, z| mean(&of, &[x, y, z]);
                let (aaa, bbb, aab, abb) = (third(a, a, a), third(b, b, b), third(a, a, b), third(a, b, b));
                std::array::from_fn(|c: usize| (aaa[c] + bbb[c]) / 6.0 - (aab[c] + abb[c]) / 4.0)
            }
        };
        all.retain(wanted);
        all.into_iter()
            .map(|bubble| {
                let c = coefficient(&bubble);
                (bubble, c)
            })
            .collect()
    }
}

/// Numbers without repetition, in the order in which they came.
struct Marked {
    list: Vec<u32>,
    is_in: Vec<bool>,
}

impl Marked {
    fn new(count: usize) -> Self {
        Self { list: Vec::new(), is_in: vec![false; count] }
    }

    fn extend(&mut self, numbers: &[u32]) {
        for &number in numbers {
            if !std::mem::replace(&mut self.is_in[number as usize], true) {
                self.list.push(number);
            }
        }
    }

    fn clear(&mut self) {
        self.list.drain(..).for_each(|number| self.is_in[number as usize] = false);
    }
}
