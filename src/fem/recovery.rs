//! Displacements recovered by patches, and the error estimated from them: polynomial preserving recovery (Zhang and
//! Naga 2005).
//!
//! Around each vertex a polynomial of one degree more than the elements is fitted to the nodal displacements. Its
//! gradient is of higher order than the discrete one on any mesh, at boundaries too. Patches end at the boundary of
//! their body and where its material jumps ([`Split`](super::Split)), so nothing is smoothed across a contact or an
//! interface. With P_i the polynomial of vertex i and l_i its barycentric coordinate (the hat function of the vertex)
//!
//! ```text
//! u* = sum l_i P_i          the blend: continuous, since on a facet only the hats of its vertices are not zero
//! b  = u* - I u*            the error of the interpolant I u* at the nodes
//! ```
//!
//! b vanishes at all nodes and is continuous. For a displacement of one degree more than the elements, b is exact.

mod patch;
mod products;
mod strip;

use super::elasticity::Elasticity;
use super::element;
use super::lagrange;
use super::space::{CellPoint, Slope, Space};
use crate::linalg::{axpy, dot};
use crate::problem::order::Order;
use patch::{Monomials, Patch, Rings};
use std::borrow::Cow;

/// Largest number of additional rings of cells that a patch gets while its nodes do not determine the polynomial. Cells
/// at a corner of a body have few nodes, and with two more rings as many as others. No larger patch determines what is
/// then still undetermined, such as the second derivative through a plate one cell thick.
const MORE_RINGS: usize = 3;

/// A displacement with the polynomials recovered from it.
pub struct Recovery<'a, const D: usize> {
    space: &'a Space<D>,
    elasticity: &'a Elasticity,
    displacement: Cow<'a, [f64]>,
    /// Polynomial of each vertex; `None` at mid-edge nodes.
    patches: Vec<Option<Patch<D>>>,
    /// Nodal values of the blend of the polynomials, one entry per dof.
    blended: Vec<f64>,
    /// Monomials of the polynomials: of one degree more than the elements, and of each lower degree.
    monomials: Vec<Monomials>,
}

/// The error of a displacement as its recovery shows it.
pub struct Errors {
    /// Squared energy error of each cell.
    pub cells: Vec<f64>,
    /// Power of its size with which the energy error of each cell falls.
    pub rates: Vec<f64>,
    /// Energy of the strip between straight facets and a curved boundary at each cell.
    pub strips: Vec<f64>,
    /// The load on the discrete problem whose response is the error of nodal displacements, one entry per dof.
    pub load: Vec<f64>,
}

impl<'a, const D: usize> Recovery<'a, D> {
    /// Recover the polynomials of the displacement `u`, one entry per dof. The nodes of the space are cut apart where
    /// the material jumps.
    pub fn new(space: &'a Space<D>, elasticity: &'a Elasticity, u: impl Into<Cow<'a, [f64]>>) -> Self {
        let degree = space.order.degree() + 1;
        let monomials = (0..=degree).rev().map(|degree| Monomials::new(D, degree)).collect();
        let (patches, blended) = (Vec::new(), Vec::new());
        let mut recovery = Self { space, elasticity, displacement: u.into(), patches, blended, monomials };
        let (mut rings, outer) = (Rings::new(space), recovery.outer_vertices());
        let fit = |node| if rings.is_vertex(node) { recovery.fit(node, outer[node], &mut rings) } else { None };
        recovery.patches = (0..space.nodes.len()).map(fit).collect();
        recovery.blended = recovery.blend_nodes();
        recovery
    }

    /// Return whether each node is a vertex of the boundary. The axis of a body of revolution is not part of the
    /// boundary, since the body continues beyond it.
    fn outer_vertices(&self) -> Vec<bool> {
        let mut outer = vec![false; self.space.nodes.len()];
        for (index, opposite) in self.space.lone_facets() {
            let facet = || (0..=D).filter(|&k| k != opposite).map(|k| self.space.cell(index)[k]);
            if !facet().all(|node| self.space.on_axis(node)) {
                facet().for_each(|node| outer[node as usize] = true);
            }
        }
        outer
    }

    /// Return the polynomial of a vertex. A vertex on the boundary uses two rings of cells, since a single ring is
    /// one-sided. The polynomial has a lower degree in a body or plate of so few cells that its nodes determine no
    /// more.
    fn fit(&self, node: usize, is_outer: bool, rings: &mut Rings<D>) -> Option<Patch<D>> {
        let (space, u) = (self.space, &*self.displacement);
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

    /// Return the values of the blend at all nodes, one entry per dof. At a vertex it is the value of the polynomial,
    /// elsewhere the mean of those of the vertices of the cell, weighted by the barycentric coordinates.
    fn blend_nodes(&self) -> Vec<f64> {
        let space = self.space;
        let mut blended = vec![0.0; space.dofs()];
        let mut is_known = vec![false; space.nodes.len()];
        let places: Vec<[f64; 4]> = (0..space.stride).map(|k| element::place(space.order, D + 1, k)).collect();
        for cell in space.cells.chunks_exact(space.stride) {
            for (k, &node) in cell.iter().enumerate() {
                if std::mem::replace(&mut is_known[node as usize], true) {
                    continue;
                }
                for (&vertex, l) in cell.iter().zip(places[k]).filter(|(_, l)| *l != 0.0) {
                    let value = self.jet(vertex, &space.nodes[node as usize]).0;
                    (0..D).for_each(|c| blended[D * node as usize + c] += l * value[c]);
                }
            }
        }
        blended
    }

    /// Return the value and the gradient of the polynomial of a vertex at a point.
    #[inline]
    fn jet(&self, vertex: u32, at: &[f64; D]) -> ([f64; D], [[f64; D]; D]) {
        match &self.patches[vertex as usize] {
            Some(patch) => patch.jet(&self.monomials[0], at),
            None => unreachable!("vertices of cells have patches"),
        }
    }

    /// Return the stress (xx yy zz xy yz xz) of a difference of strains in a cell at a point. Assembly evaluated the
    /// law there, so it has a value.
    fn stress(&self, cell: usize, at: [f64; D], strain: &[f64; 6]) -> [f64; 6] {
        let material = self.elasticity.at(cell, self.space.in_scene(at));
        material.map_or([0.0; 6], |material| material.stress(strain))
    }

    /// Return the strain of a displacement in a cell at a point without the initial strain there.
    fn elastic(&self, cell: usize, at: [f64; D], strain: &[f64; 6]) -> [f64; 6] {
        let initial = self.elasticity.initial_strain(cell, self.space.in_scene(at)).unwrap_or_default();
        std::array::from_fn(|i| strain[i] - initial[i])
    }

    /// Return the errors of the displacement.
    ///
    /// If the recovered displacement u* is exact, its distance from any one discrete displacement bounds the error,
    /// since the discrete solution u_h is the best approximation. Where the solution is singular, u* misses the
    /// singular part: it is too far from u_h in some cells, and from its nodal interpolant in others. In a nearly
    /// incompressible body the bulk modulus amplifies the dilatation that u* has and the solution has not; the mean
    /// dilatations of u_h around the vertices are without it. With quadratic elements the smallest of these three
    /// distances counts in each cell. That is no bound; on parts with known energies it is 0.9 to 1.8 times the squared
    /// error. The quadrature of linear elements is too coarse for the energy of their interpolant. With higher orders
    /// the distance from the interpolant is the smallest one in nearly all cells, and it alone counts.
    ///
    /// The load L of the interpolation error b does the work L(u_h) = eta^2 - f'b on the discrete displacement, except
    /// where the solution is singular. The missing work is done by a multiple, at most one, of `Recovery::softening`.
    /// The argument `work_on_missed` is the work of the pressures of contacts on b. It is a fifth of eta^2 with linear
    /// elements under a contact of a few cells, and small with quadratic ones. Initial strains act in all cells, and
    /// their work is added. Other loads act where b is small.
    pub fn errors(&self, work_on_missed: f64) -> Errors {
        let (of_interpolant, mut load, work_of_heat) = self.interpolation_error();
        let mut cells = of_interpolant;
        match self.space.order {
            Order::P1 => cells = self.energy_errors(),
            Order::P2 => {
                cells.iter_mut().zip(self.energy_errors()).for_each(|(nearer, error)| *nearer = nearer.min(error))
            }
            _ => {}
        }
        let softening = self.softening(&cells);
        let work = dot(&softening, &self.displacement);
        if work > 0.0 {
            let lacking =
                (cells.iter().sum::<f64>() - work_on_missed - work_of_heat - dot(&load, &self.displacement)) / work;
            axpy(lacking.clamp(0.0, 1.0), &softening, &mut load);
        }
        let strips = self.add_strip(&mut load);
        Errors { cells, rates: self.rates(), strips, load }
    }

    /// Return the power of its size with which the energy error of each cell falls: at most the degree k of the
    /// elements, from order three on.
    fn rates(&self) -> Vec<f64> {
        let degree = self.space.order.degree() as f64;
        match self.space.order {
            Order::P1 | Order::P2 => vec![degree; self.space.cell_count()],
            _ => self.powers().into_iter().map(|mu| mu.clamp(1.0, degree)).collect(),
        }
    }

    /// Return the power mu of the displacement in each cell of order three or more, from the decay of its polynomials.
    ///
    /// A displacement r^mu around a point has an energy error of h^mu. The part A_n of its polynomials of degree n in a
    /// cell at the point, in the mean square, falls as n^-(2 mu + 2), so that the last parts tell mu. Where the
    /// displacement is smooth, parts fall geometrically, which is a large power. Two degrees are taken together, since
    /// functions may be nearly even or odd.
    fn powers(&self) -> Vec<f64> {
        let (order, degree) = (self.space.order, self.space.order.degree());
        let of_cell = |cell: &[u32]| {
            let mut squares = vec![0.0; degree + 1];
            for c in 0..D {
                let parts = lagrange::of(order, D + 1).by_degree(|i| self.displacement[D * cell[i] as usize + c]);
                squares.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
            }
            let part = |n: usize| if degree > 3 { squares[n] + squares[n - 1] } else { squares[n] };
            let ratio = degree as f64 / (degree as f64 - 1.0);
            let power = 0.5 * (part(degree - 1) / part(degree)).ln() / ratio.ln();
            // a cell that does not move has no parts
            if power.is_nan() { degree as f64 } else { 0.5 * power - 1.0 }
        };
        self.space.cells.chunks_exact(self.space.stride).map(of_cell).collect()
    }

    /// Return the squared energy norm of the recovered minus the discrete strain on each cell. With quadratic elements
    /// the mean dilatation takes the place of the recovered one in cells where that is smaller. Linear elements of a
    /// nearly incompressible body lock, and their small displacements have small means.
    fn energy_errors(&self) -> Vec<f64> {
        let order = self.space.order;
        let rule = element::rule_of_products(D + 1, order.max(Order::P2)).with_shapes(order);
        let means = (order == Order::P2).then(|| self.mean_dilatations(&rule));
        let of_cell = |index: usize| {
            let (mut energy, mut with_mean) = (0.0, 0.0);
            for point in self.space.points(index, &rule).flatten() {
                let mut strain = self.strain_beyond(&point);
                energy += point.weight * dot(&self.stress(index, point.at, &strain), &strain);
                if let Some(means) = &means {
                    let mean: f64 = point.l.iter().zip(point.cell).map(|(l, &vertex)| l * means[vertex as usize]).sum();
                    let lack = mean - dilatation(&point.slope(&self.displacement).strain()) - dilatation(&strain);
                    strain[..3].iter_mut().for_each(|part| *part += lack / 3.0);
                    with_mean += point.weight * dot(&self.stress(index, point.at, &strain), &strain);
                }
            }
            if means.is_some() { energy.min(with_mean) } else { energy }
        };
        (0..self.space.cell_count()).map(of_cell).collect()
    }

    /// Return the mean dilatation of the discrete displacement in the cells at each vertex; zero at other nodes.
    fn mean_dilatations(&self, rule: &element::Rule) -> Vec<f64> {
        let space = self.space;
        let (mut means, mut volumes) = (vec![0.0; space.nodes.len()], vec![0.0; space.nodes.len()]);
        for point in (0..space.cell_count()).flat_map(|index| space.points(index, rule)).flatten() {
            let change = point.weight * dilatation(&point.slope(&self.displacement).strain());
            for &vertex in &point.cell[..=D] {
                means[vertex as usize] += change;
                volumes[vertex as usize] += point.weight;
            }
        }
        means.iter_mut().zip(volumes).filter(|(_, volume)| *volume > 0.0).for_each(|(mean, volume)| *mean /= volume);
        means
    }

    /// Return the gradient of the recovered displacement at a point with barycentric coordinates `l` of a cell or facet
    /// with these nodes.
    fn recovered_slope(&self, nodes: &[u32], l: &[f64], at: &[f64; D]) -> Slope<D> {
        let mut sum = Slope::ZERO;
        for (l, &node) in l.iter().zip(nodes) {
            let (value, h) = self.jet(node, at);
            sum.add(*l, &Slope { h, hoop: self.space.hoop(at, value[0]) });
        }
        sum
    }

    /// Return the error b of the nodal interpolant at barycentric point `l` of a simplex with these nodes, which is a
    /// cell or a facet.
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
            let value = self.jet(vertex, &at).0;
            (0..D).for_each(|c| sum[c] += l * value[c]);
        }
        sum
    }

    /// Return the squared energy norm of the interpolation error b on each cell, and the residual `-int sigma(b) : grad
    /// v` for every shape function v, one entry per dof. A displacement with this residual is the error of the nodal
    /// values. The last number is the work of initial strains on b.
    fn interpolation_error(&self) -> (Vec<f64>, Vec<f64>, f64) {
        let space = self.space;
        // The gradient of b has one degree more than the elements, and that of v has one less.
        let rule = element::rule_of_products(D + 1, space.order).with_shapes(space.order);
        let (mut residual, mut work) = (vec![0.0; space.dofs()], 0.0);
        let of_cell = |index: usize| {
            let mut energy = 0.0;
            for point in space.points(index, &rule).flatten() {
                let strain = self.missed_slope(&point).strain();
                let stress = self.stress(index, point.at, &strain);
                energy += point.weight * dot(&stress, &strain);
                work -= point.weight * dot(&stress, &self.elastic(index, point.at, &[0.0; 6]));
                point.add_stress(-point.weight, &stress, &mut residual);
            }
            energy
        };
        let energies = (0..space.cell_count()).map(of_cell).collect();
        (energies, residual, work)
    }

    /// Return the gradient of b at a point of a cell.
    fn missed_slope(&self, point: &CellPoint<D>) -> Slope<D> {
        let hats = hats(point);
        let mut slope = Slope::ZERO;
        for (k, &vertex) in point.cell[..=D].iter().enumerate() {
            let (value, h) = self.jet(vertex, &point.at);
            for c in 0..D {
                (0..D).for_each(|j| slope.h[c][j] += point.l[k] * h[c][j] + value[c] * hats[k][j]);
            }
            slope.hoop += point.l[k] * self.space.hoop(&point.at, value[0]);
        }
        slope.add(-1.0, &point.slope(&self.blended));
        slope
    }

    /// Return the load by which the discrete body is too stiff, one entry per dof, with the squared energy error
    /// eta_K^2 of each cell K:
    ///
    /// ```text
    /// s(v) = sum_K theta_K a_K(u_h, v),     theta_K = eta_K^2 / (eta_K^2 + a_K(u_h, u_h))
    /// ```
    ///
    /// Loads f do the work f'e = a(u, e) = a(e, e) = eta^2 on the error e = u - u_h, since a(u_h, e) = 0. So the
    /// discrete body is too stiff, and each cell contributes eta_K^2 to what its compliance lacks. The load is that of
    /// a body whose stiffness is lower by theta_K in each cell. Its work s(u_h) is the sum of the eta_K^2 where these
    /// are small. The interpolation error of a recovered displacement does the same work where the solution is smooth,
    /// but none where it is singular: recovered polynomials miss the singular part, whose error reaches all nodes.
    fn softening(&self, errors: &[f64]) -> Vec<f64> {
        // Strains are of one degree less than the elements.
        let order = self.space.order;
        let rule = element::rule(D + 1, 2 * order.degree() - 2).with_shapes(order);
        let mut load = vec![0.0; self.space.dofs()];
        for (index, error) in errors.iter().enumerate() {
            let (mut energy, mut stresses) = (0.0, Vec::with_capacity(rule.points.len()));
            for point in self.space.points(index, &rule).flatten() {
                let strain = self.elastic(index, point.at, &point.slope(&self.displacement).strain());
                let stress = self.stress(index, point.at, &strain);
                energy += point.weight * dot(&stress, &strain);
                stresses.push((point, stress));
            }
            let theta = error / (error + energy).max(f64::MIN_POSITIVE);
            stresses.iter().for_each(|(point, stress)| point.add_stress(theta * point.weight, stress, &mut load));
        }
        load
    }
}

/// Return the relative change of volume of a strain (xx yy zz, and 2 eps of xy yz xz).
fn dilatation(strain: &[f64; 6]) -> f64 {
    strain[..3].iter().sum()
}

/// Return the gradients of the barycentric coordinates at a point, also in curved cells, from the values of the
/// coordinates at the nodes.
fn hats<const D: usize>(point: &CellPoint<D>) -> [[f64; D]; 4] {
    let mut hats = [[0.0; D]; 4];
    for (node, gradient) in point.gradient.iter().enumerate() {
        for (hat, l) in hats.iter_mut().zip(element::place(point.order(), D + 1, node)).filter(|(_, l)| *l != 0.0) {
            (0..D).for_each(|c| hat[c] += l * gradient[c]);
        }
    }
    hats
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::sample::block;
    use crate::problem::{BodySpec, Plane};

    fn steel() -> Elasticity {
        let spec = BodySpec::new("block", 2.0, 0.3).elasticity();
        Elasticity::new(&[&spec], Vec::new(), 3, Plane::Strain).expect("a material")
    }

    /// Return a polynomial displacement of this degree.
    fn field<const D: usize>(degree: i32, x: &[f64; D]) -> [f64; D] {
        let s: f64 = (0..D).map(|i| (1.0 + 0.3 * i as f64) * x[i]).sum();
        std::array::from_fn(|c| (1.0 + c as f64) * s.powi(degree) + x[c] * x[(c + 1) % D].powi(degree - 1))
    }

    /// Check that a displacement of one degree more than the elements is recovered exactly, at the boundary too. Then
    /// the error of its interpolant is exact.
    fn next_degree_is_exact<const D: usize, const N: usize>(order: Order) {
        let degree = if order == Order::P1 { 2 } else { 3 };
        let space = block::<D>(3, order);
        let u: Vec<f64> = space.nodes.iter().flat_map(|x| field::<D>(degree, x)).collect();
        let steel = steel();
        let recovery = Recovery::new(&space, &steel, &u);
        let l: [f64; N] = std::array::from_fn(|k| (k + 1) as f64 / (N * (N + 1) / 2) as f64);
        let mut largest = 0.0f64;
        for index in 0..space.cell_count() {
            let x = space.cell_nodes(index);
            let phi = element::values(order, &l);
            let at = element::interpolate(&x, &phi);
            let cell = space.cell(index);
            let bubble = recovery.missed(cell, &l);
            for c in 0..D {
                let interpolated: f64 = cell.iter().zip(&phi).map(|(&n, phi)| phi * u[D * n as usize + c]).sum();
                let error = field::<D>(degree, &at)[c] - interpolated;
                largest = largest.max(error.abs());
                assert!((bubble[c] - error).abs() < 1e-10, "{D} {order:?} cell {index}: {} {error}", bubble[c]);
            }
        }
        assert!(largest > 1e-4);
    }

    #[test]
    fn a_polynomial_of_the_next_degree_is_recovered() {
        next_degree_is_exact::<2, 3>(Order::P1);
        next_degree_is_exact::<3, 4>(Order::P1);
        next_degree_is_exact::<2, 3>(Order::P2);
        next_degree_is_exact::<3, 4>(Order::P2);
    }

    /// The rate of cells at a corner is about the power of a displacement there; that of the others grows to the degree
    /// of the elements.
    #[test]
    fn rates_tell_singular_cells() {
        let (order, steel) = (Order::new(6).expect("an order"), steel());
        let space = block::<2>(4, order);
        for power in [1.5, 2.5] {
            let radius = |x: &[f64; 2]| dot(x, x).sqrt();
            let u: Vec<f64> = space.nodes.iter().flat_map(|x| [radius(x).powf(power), 0.0]).collect();
            let rates = Recovery::new(&space, &steel, &u).rates();
            for (index, rate) in rates.iter().enumerate() {
                let least = space.cell_nodes(index)[..3].iter().map(radius).fold(f64::INFINITY, f64::min);
                let is_right =
                    if least == 0.0 { (1.0..1.6).contains(&(rate / power)) } else { least < 0.4 || *rate > 4.5 };
                assert!(is_right, "{power}: rate {rate} at a distance of {least}");
            }
        }
        assert_eq!(Recovery::new(&space, &steel, vec![0.0; space.dofs()]).rates(), vec![6.0; space.cell_count()]);
    }

    /// Return a wave of wavenumber k that decays from the face z = 1, with k h = 0.8.
    fn wave(x: &[f64; 3]) -> [f64; 3] {
        let k = 0.8 * 6.0;
        let falling = (k * (x[2] - 1.0)).exp();
        [(k * x[0]).sin() * falling, 0.3 * (k * x[1]).cos() * falling, (k * x[0]).cos() * falling]
    }

    /// Return the share of the error of the interpolant of a wave that is recovered in the cells at its face. It is the
    /// least-squares factor from the exact error to the recovered one.
    fn seen_of_wave(order: Order) -> f64 {
        let space = block::<3>(6, order);
        let u: Vec<f64> = space.nodes.iter().flat_map(wave).collect();
        let steel = steel();
        let recovery = Recovery::new(&space, &steel, &u);
        let (mut product, mut square) = (0.0, 0.0);
        for index in 0..space.cell_count() {
            let (x, cell) = (space.cell_nodes(index), space.cell(index));
            if x[..4].iter().all(|x| x[2] < 0.99) {
                continue;
            }
            for (l, weight) in element::rule(4, 5).iter() {
                let phi = element::values(order, l);
                let (exact, seen) = (wave(&element::interpolate(&x, &phi)), recovery.missed(cell, l));
                for c in 0..3 {
                    let interpolated: f64 = cell.iter().zip(&phi).map(|(&n, phi)| phi * u[3 * n as usize + c]).sum();
                    product += weight * seen[c] * (exact[c] - interpolated);
                    square += weight * (exact[c] - interpolated).powi(2);
                }
            }
        }
        product / square
    }

    #[test]
    fn a_wave_is_seen_at_the_boundary() {
        for order in [Order::P1, Order::P2] {
            let seen = seen_of_wave(order);
            assert!((0.75..1.25).contains(&seen), "{order:?}: {seen}");
        }
    }

    /// In curved cells, the gradient of the interpolation error is consistent with its values.
    #[test]
    fn the_gradient_is_that_of_the_values_in_curved_cells() {
        let mut space = block::<3>(3, Order::P2);
        space.nodes.iter_mut().for_each(|x| x[2] += 0.3 * x[0] * x[0] - 0.2 * x[0] * x[1]);
        let u: Vec<f64> = space.nodes.iter().flat_map(wave).collect();
        let steel = steel();
        let recovery = Recovery::new(&space, &steel, &u);
        let (l, step) = ([0.1, 0.2, 0.3, 0.4], 1e-5);
        for index in 0..space.cell_count() {
            let (x, cell) = (space.cell_nodes(index), space.cell(index));
            let slope = recovery.missed_slope(&space.point(index, &x, &l, 1.0).expect("a cell"));
            let moved = |sign: f64| [l[0] - sign * step, l[1] + sign * step, l[2], l[3]];
            let ends = [1.0, -1.0]
                .map(|sign| (element::interpolate(&x, &element::values(Order::P2, &moved(sign))), moved(sign)));
            let values = ends.map(|(_, l)| recovery.missed(cell, &l));
            for c in 0..3 {
                let along: f64 = (0..3).map(|j| slope.h[c][j] * (ends[0].0[j] - ends[1].0[j])).sum();
                let apart = values[0][c] - values[1][c];
                assert!((apart - along).abs() < 1e-9 + 1e-5 * apart.abs(), "cell {index}: {apart} {along}");
            }
        }
    }

    /// The load of a body that is softer by a quarter does a quarter of the energy as work, and none on a rigid motion.
    #[test]
    fn softening_does_the_work_that_stiffness_lacks() {
        for order in [Order::P1, Order::P2] {
            let space = block::<3>(3, order);
            let u: Vec<f64> = space.nodes.iter().flat_map(|x| field::<3>(2, x)).collect();
            let steel = steel();
            let recovery = Recovery::new(&space, &steel, &u);
            let rule = element::rule(4, 2);
            let energy = |index: usize| -> f64 {
                let of_point = |point: CellPoint<3>| {
                    let strain = point.slope(&u).strain();
                    point.weight * dot(&recovery.stress(index, point.at, &strain), &strain)
                };
                space.points(index, &rule).flatten().map(of_point).sum()
            };
            let energies: Vec<f64> = (0..space.cell_count()).map(energy).collect();
            let errors: Vec<f64> = energies.iter().map(|energy| energy / 3.0).collect();
            let load = recovery.softening(&errors);
            let (work, quarter) = (dot(&load, &u), 0.25 * energies.iter().sum::<f64>());
            assert!((work / quarter - 1.0).abs() < 1e-10, "{order:?}: {work} {quarter}");
            let turned: f64 = space.nodes.iter().zip(load.chunks(3)).map(|(x, f)| x[0] * f[1] - x[1] * f[0]).sum();
            assert!(turned.abs() < 1e-10 * quarter, "{order:?}: {turned}");
        }
    }

    /// The work that contact pressures do on the interpolation error is not done by the load of a softer body. In the
    /// wave, that load does half of the squared energy error.
    #[test]
    fn work_on_the_interpolation_error_does_not_soften() {
        let space = block::<3>(3, Order::P1);
        let u: Vec<f64> = space.nodes.iter().flat_map(wave).collect();
        let steel = steel();
        let recovery = Recovery::new(&space, &steel, &u);
        let squared_error: f64 = recovery.errors(0.0).cells.iter().sum();
        let work = 0.1 * squared_error;
        let lost = dot(&recovery.errors(0.0).load, &u) - dot(&recovery.errors(work).load, &u);
        assert!((lost / work - 1.0).abs() < 1e-10, "{lost} {work}");
    }
}
