//! The pressure beside an end of contact, on edges of order three or more.
//!
//! There the pressure is no polynomial. Without a layer it is A sqrt(d) at the distance d inside the end. Under a layer
//! of the stiffness kappa between bodies of the softness 1/E* it is that from far, and a line close to the end:
//!
//! ```text
//! g(d) = d / sqrt(d + l),    l = 2 E*/(pi kappa)
//! ```
//!
//! Both limits and l are those of the half-plane under a layer that begins at d = 0, whose pressure has the Laplace
//! transform 1/(s^2 G(s)) with G(s) G(-s) = (|s| + k)/|s| on the imaginary axis, k = 2 kappa/E* (Wiener and Hopf). With
//! G = 1 at large s and sqrt(k/s) at small ones it is d, or sqrt(4 d/(pi k)). Between them g is up to 6 % larger.
//!
//! A contact point q carries the force of its shape function, so under a stiff layer its discrete pressure is near the
//! mean M_q p = int p N_q / int N_q and not to the value p(x_q). For polynomials of a degree below the order both are
//! the same. For g they differ by most of what the pressures beside an end are wrong by.
//!
//! The pressure (A + B d + ...) g(d) with as many terms as the elements' order is fitted to the discrete pressures of the
//! closed points around each end. The difference of its values and means is a load on the discrete problem, whose
//! response w is an error: if the displacements of the discrete problem are right under the forces omega M_q p of the
//! exact solution, then
//!
//! ```text
//! K w + B' omega kappa B w = B' omega (p(x_q) - M_q p),    p(x_q) - p_q = kappa B w
//! ```
//!
//! The discrete pressures differ from the fitted ones with this response by a misfit, which is an error, too. But g is
//! that of a linear layer: the misfit counts in proportion to the least stiffness of the layer at the closed points over
//! the largest one.

use super::interpolate::ends;
use crate::contact::{FinePoint, FinePoints};
use crate::fem::lagrange::gauss;
use crate::fem::{length, minus};
use crate::linalg::{axpy, dot, fit, interpolation_weights, range};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// The discrete solution in the layer of a pair. Values are at the contact points.
pub(super) struct LayerValues<'a> {
    /// Positions in the scene, n.
    pub position: &'a [[f64; 3]],
    /// Pressures, n.
    pub pressure: &'a [f64],
    /// Tangent stiffness of the layer per area, n.
    pub tangent: &'a [f64],
    /// 1/E*, the sum of the compliances of both bodies.
    pub softness: f64,
}

/// The loads beside the ends of contact of a pair.
pub(super) struct EndLoads {
    /// Force per area p(x_q) - M_q p of each contact point, n.
    pub force: Vec<f64>,
    /// Fitted pressure with its response less the discrete one, n.
    pub misfit: Vec<f64>,
    /// Facets of side a on which these loads take the place of all others between their points.
    pub facets: BTreeSet<usize>,
}

/// Closed edges beside the one on which contact ends, whose pressures are fitted together. For elements of order k these
/// are 2 k pressures at least, about twice as many as the k + 1 unknowns. In a trial on the 48 runs of docs/theory.md
/// ("How good it is"), with the response of half-planes alone, estimates were 0.13 to 9.0 times the errors with one edge
/// and three terms, 0.48 to 3.7 with two edges and four terms, and 0.64 to 4.3 with three edges and five terms.
const BESIDE: usize = 2;

/// Places of the end that are tried. They are equally spaced in the root of the distance from the last closed point, to
/// which the pressure of that point is nearly proportional. So the nearest place has it to 1/128 of its largest value,
/// which is small beside the 6 % that g is known to.
const PLACES: usize = 64;

impl EndLoads {
    /// Return the loads of `count` contact points without an end.
    pub fn none(count: usize) -> Self {
        Self { force: vec![0.0; count], misfit: vec![0.0; count], facets: BTreeSet::new() }
    }

    /// Return the loads beside the ends of contact; none in space and for orders below three.
    pub fn new(points: &FinePoints, values: &LayerValues) -> Self {
        let edges = edges(points, values.position);
        let mut sizes = vec![0.0; values.pressure.len()];
        for edge in &edges {
            edge.points.iter().zip(sizes_of_points(&edge.at)).for_each(|(&q, size)| sizes[q] += size);
        }
        let mut loads = Self::none(sizes.len());
        for mixed in &edges {
            let Some(end) = End::on(mixed, &edges, values) else { continue };
            loads.facets.extend(&end.facets);
            let fitted = end.fitted(values);
            for (i, &q) in end.points.iter().enumerate() {
                loads.force[q] += fitted.load[i] * end.sizes[i] / sizes[q];
            }
            end.points[1..].iter().zip(fitted.misfit).for_each(|(&q, misfit)| loads.misfit[q] += misfit);
        }
        loads
    }
}

/// An edge of side a with its contact points in their order along its chord.
#[derive(Clone)]
struct Edge {
    facet: usize,
    at_rim: bool,
    points: Vec<usize>,
    /// Distances of the points from the first one.
    at: Vec<f64>,
}

/// Return the edges of a pair that have all points of their order.
fn edges(points: &FinePoints, position: &[[f64; 3]]) -> Vec<Edge> {
    let chunks = points.each.chunk_by(|p, q| p.facet == q.facet);
    let all = points.edges().into_iter().zip(chunks).filter(|(on_edge, _)| on_edge.len() == points.order.degree() + 1);
    all.map(|(on_edge, chunk)| Edge::new(on_edge, &chunk[0], position)).collect()
}

/// Return the integrals of the polynomials that interpolate values at points of an edge, one for each.
fn sizes_of_points(at: &[f64]) -> Vec<f64> {
    let (from, size) = (at[0], at[at.len() - 1] - at[0]);
    let mut sizes = vec![0.0; at.len()];
    for (along, weight) in gauss(at.len()) {
        let shapes = interpolation_weights(at, from + size * along);
        sizes.iter_mut().zip(shapes).for_each(|(sum, shape)| *sum += size * weight * shape);
    }
    sizes
}

impl Edge {
    fn new(mut points: Vec<usize>, fine: &FinePoint, position: &[[f64; 3]]) -> Self {
        let [first, last] = ends(position, &points);
        let chord = minus(position[last], position[first]);
        let place = |q: usize| dot(&minus(position[q], position[first]), &chord) / length(chord);
        points.sort_by(|&p, &q| place(p).total_cmp(&place(q)));
        let at = points.iter().map(|&q| place(q)).collect();
        Self { facet: fine.facet, at_rim: fine.at_rim, points, at }
    }

    /// Return the edge in the opposite direction.
    fn reversed(self) -> Self {
        let size = self.at[self.at.len() - 1];
        let at = self.at.iter().rev().map(|at| size - at).collect();
        Self { points: self.points.into_iter().rev().collect(), at, ..self }
    }
}

/// The edges around an end of contact, in their order from the closed points to the open ones.
struct End {
    /// Number of intervals of each edge.
    degree: usize,
    facets: Vec<usize>,
    /// The contact points, n: the last `degree + 1` are those of the edge on which contact ends.
    points: Vec<usize>,
    /// Number of closed points, which come first.
    closed: usize,
    /// Place of each point along the edges, n.
    at: Vec<f64>,
    /// Integral of the shape function of each point over these edges, n.
    sizes: Vec<f64>,
}

/// A pressure that is fitted to the discrete one.
struct Fitted {
    /// Integral of the squared misfit.
    squared: f64,
    /// Fitted pressures with their response less the discrete ones, as far as this counts, from the second point to the
    /// last closed one.
    misfit: Vec<f64>,
    /// Difference of value and mean at each point, n.
    load: Vec<f64>,
}

impl End {
    /// Return the end of contact on an edge, if one part of its points is closed and the other one open; `None` at a
    /// rim, and where there are too few closed points.
    fn on(mixed: &Edge, edges: &[Edge], values: &LayerValues) -> Option<Self> {
        let is_closed = |q: &usize| values.pressure[*q] > 0.0;
        let last = mixed.points.len() - 1;
        let mixed = mixed.clone();
        let mixed = if is_closed(&mixed.points[0]) { mixed } else { mixed.reversed() };
        let closed = mixed.points.iter().take_while(|q| is_closed(q)).count();
        if mixed.at_rim || closed == 0 || closed > last || mixed.points[closed..].iter().any(is_closed) {
            return None;
        }
        let (degree, sizes) = (last, sizes_of_points(&mixed.at));
        let mut end = Self { degree, facets: vec![mixed.facet], points: mixed.points, closed, at: mixed.at, sizes };
        for _ in 0..BESIDE {
            let is_next = |edge: &&Edge| !end.facets.contains(&edge.facet) && edge.points.contains(&end.points[0]);
            let Some(next) = edges.iter().find(is_next) else { break };
            if next.at_rim || !next.points.iter().all(is_closed) {
                break;
            }
            let next = next.clone();
            end.prepend(if next.points[last] == end.points[0] { next } else { next.reversed() });
        }
        let [least, most] = end.stiffness(values);
        (end.closed > 3 && least > 0.0 && most.is_finite()).then_some(end)
    }

    /// Put an edge before the others, whose first point is its last one.
    fn prepend(&mut self, edge: Edge) {
        let (last, start) = (self.degree, self.at[0] - edge.at[self.degree]);
        let sizes = sizes_of_points(&edge.at);
        self.sizes[0] += sizes[last];
        self.facets.push(edge.facet);
        self.closed += last;
        self.points.splice(0..0, edge.points.into_iter().take(last));
        self.at.splice(0..0, edge.at.iter().take(last).map(|at| start + at));
        self.sizes.splice(0..0, sizes.into_iter().take(last));
    }

    /// Return the least and the largest stiffness of the layer at the closed points.
    fn stiffness(&self, values: &LayerValues) -> [f64; 2] {
        range(self.points[..self.closed].iter().map(|&q| values.tangent[q]))
    }

    /// Return the pressure that is nearest to the discrete one.
    fn fitted(&self, values: &LayerValues) -> Fitted {
        let response = self.response(values);
        let [from, to] = [self.at[self.closed - 1], self.at[self.closed]];
        let mut best = Fitted { squared: f64::INFINITY, misfit: Vec::new(), load: vec![0.0; self.points.len()] };
        let [least, most] = self.stiffness(values);
        for stiffness in [most].into_iter().chain((least < most).then_some(least)) {
            for k in 1..=PLACES {
                let share = (k as f64 / PLACES as f64).powi(2);
                let fitted = self.fit(from + share * (to - from), stiffness, values, &response);
                if fitted.squared < best.squared {
                    best = fitted;
                }
            }
        }
        best
    }

    /// Fit a pressure that ends at `place`.
    fn fit(&self, place: f64, stiffness: f64, values: &LayerValues, response: &DMatrix<f64>) -> Fitted {
        let (functions, loads) = self.functions(place, 2.0 / (PI * values.softness * stiffness));
        // the first point carries forces of the edge beyond it
        let fitted = 1..self.closed;
        let weighted = |q: usize, value: f64| self.sizes[q].sqrt() * value;
        let row = |k: usize| -> Vec<f64> {
            let error = response * DVector::from_column_slice(&loads[k]);
            fitted.clone().map(|q| weighted(q, functions[k][q] - error[q])).collect()
        };
        let rows: Vec<Vec<f64>> = (0..functions.len()).map(row).collect();
        let discrete: Vec<f64> = fitted.clone().map(|q| weighted(q, values.pressure[self.points[q]])).collect();
        let mut misfit = discrete.iter().map(|p| -p).collect::<Vec<f64>>();
        let mut load = vec![0.0; self.points.len()];
        for (k, amount) in fit(&rows, &discrete).into_iter().enumerate() {
            axpy(amount, &rows[k], &mut misfit);
            axpy(amount, &loads[k], &mut load);
        }
        let squared = dot(&misfit, &misfit);
        // under a layer whose stiffness varies here the misfit is mostly that of g
        let [least, most] = self.stiffness(values);
        misfit.iter_mut().zip(&self.sizes[1..]).for_each(|(misfit, size)| *misfit *= least / most / size.sqrt());
        Fitted { squared, misfit, load }
    }

    /// Return the matrix, closed points by n, from loads per area to the errors of pressures that are their response.
    ///
    /// The bodies are half-planes here, on which the pressure of each point is that of a strip of its size, and the
    /// points beyond the edges do not move.
    fn response(&self, values: &LayerValues) -> DMatrix<f64> {
        let count = self.points.len();
        let extent = self.at[count - 1] - self.at[0];
        let compliance = DMatrix::from_fn(self.closed, count, |q, r| {
            let (apart, size) = ((self.at[q] - self.at[r]).abs(), self.sizes[r]);
            let log = if q == r { (2.0 * extent / size).ln() + 1.0 } else { (extent / apart).ln() };
            2.0 / PI * values.softness * size * log * values.tangent[self.points[q]]
        });
        let system = DMatrix::identity(self.closed, self.closed) + compliance.columns(0, self.closed);
        system.lu().solve(&compliance).unwrap_or_else(|| DMatrix::zeros(self.closed, count))
    }

    /// Return the values of g(d), d g(d), d^2 g(d) ... at all points for an end at `place`, with factors d relative to
    /// the extent of the contact on these edges, and their differences from the means.
    fn functions(&self, place: f64, layer: f64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        // two closed points at least are left for the place of the end and for the misfit
        let terms = self.degree.min(self.closed - 2);
        let extent = place - self.at[0];
        let term = |d: f64, k: usize| if d > 0.0 { d / (d + layer).sqrt() * (d / extent).powi(k as i32) } else { 0.0 };
        let function = |k: usize| self.at.iter().map(|at| term(place - at, k)).collect();
        let functions: Vec<Vec<f64>> = (0..terms).map(function).collect();
        let mut loads = functions.clone();
        // in the root of the distance from the end, the integrands are polynomials of degree 4 k, but for the layer
        let rule = gauss(2 * self.degree + 2);
        for first in (0..self.points.len() - 1).step_by(self.degree) {
            let at = &self.at[first..=first + self.degree];
            let [near, far] = [at[self.degree], at[0]].map(|side| (place - side).max(0.0).sqrt());
            for (along, weight) in &rule {
                let root = near + along * (far - near);
                let d = root * root;
                for (q, shape) in interpolation_weights(at, place - d).enumerate() {
                    let share = 2.0 * root * weight * (far - near) * shape / self.sizes[first + q];
                    loads.iter_mut().enumerate().for_each(|(k, load)| load[first + q] -= share * term(d, k));
                }
            }
        }
        (functions, loads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discrete pressures that a pressure with the root of the distance from its end makes give its loads, without a
    /// misfit: on edges of order four, contact ends in the last one.
    #[test]
    fn a_pressure_and_its_end_are_found() {
        let at: Vec<f64> =
            (0..3).flat_map(|k| [0.0, 0.1727, 0.5, 0.8273].map(|x| 0.1 * (f64::from(k) + x))).chain([0.3]).collect();
        let mut sizes = vec![0.0; 13];
        for first in [0, 4, 8] {
            let of_edge = sizes_of_points(&at[first..first + 5]);
            of_edge.iter().enumerate().for_each(|(q, size)| sizes[first + q] += size);
        }
        let end = End { degree: 4, facets: vec![2, 1, 0], points: (0..13).collect(), closed: 11, at, sizes };
        let [from, to] = [end.at[10], end.at[11]];
        for (place, tangent) in [(0.25, 1e8), (0.5, 1e8), (0.875, 1e6)] {
            let place = from + f64::powi(place, 2) * (to - from);
            let mut values = LayerValues { position: &[], pressure: &[], tangent: &[tangent; 13], softness: 1e-5 };
            let (functions, loads) = end.functions(place, 2.0 / (PI * 1e-5 * tangent));
            let amounts = [20.0, -3.0, 4.0, 1.0];
            let sum =
                |rows: &[Vec<f64>], q: usize| -> f64 { amounts.iter().zip(rows).map(|(a, row)| a * row[q]).sum() };
            let load: Vec<f64> = (0..13).map(|q| sum(&loads, q)).collect();
            let response = end.response(&values) * DVector::from_column_slice(&load);
            let pressure: Vec<f64> =
                (0..13).map(|q| if q < 11 { sum(&functions, q) - response[q] } else { 0.0 }).collect();
            values.pressure = &pressure;
            let fitted = end.fitted(&values);
            let largest = load.iter().fold(0.0f64, |most, load| most.max(load.abs()));
            assert!(largest > 1e-3 * pressure[1] && fitted.misfit.iter().all(|misfit| misfit.abs() < 1e-3 * largest));
            assert!(fitted.load.iter().zip(&load).all(|(own, load)| (own - load).abs() < 1e-3 * largest));
        }
    }
}
