//! A polynomial fitted to nodal displacements.

use crate::fem::Space;
use nalgebra::DMatrix;
use std::collections::BTreeSet;

/// A polynomial displacement around a vertex.
pub(super) struct Patch<const D: usize> {
    centre: [f64; D],
    size: f64,
    /// Coefficients of each monomial in (x - centre)/size; a monomial is the list of the coordinates that it multiplies.
    terms: Vec<(Vec<usize>, [f64; D])>,
}

/// The monomials up to a degree, lower ones first.
fn monomials(dimension: usize, degree: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    let mut first = 0;
    for _ in 0..degree {
        let last = all.len();
        for k in first..last {
            let from = all[k].last().copied().unwrap_or(0);
            for i in from..dimension {
                all.push([&all[k][..], &[i]].concat());
            }
        }
        first = last;
    }
    all
}

/// Least pivot of a fit beside the largest one: below it, samples do not determine the polynomial.
const DETERMINED: f64 = 1e-3;

impl<const D: usize> Patch<D> {
    /// The least-squares fit of a degree to the values `u` at nodes; `None` where they do not determine it.
    pub fn fit(space: &Space<D>, u: &[f64], centre: [f64; D], nodes: &BTreeSet<u32>, degree: usize) -> Option<Self> {
        let at = |node: u32| space.nodes[node as usize];
        let distance = |x: [f64; D]| (0..D).map(|i| (x[i] - centre[i]).powi(2)).sum::<f64>().sqrt();
        let size = nodes.iter().map(|&node| distance(at(node))).fold(f64::MIN_POSITIVE, f64::max);
        let monomials = monomials(D, degree);
        let n = monomials.len();
        if nodes.len() < n {
            return None;
        }
        let (mut gram, mut right) = (DMatrix::zeros(n, n), DMatrix::zeros(n, D));
        let mut add = |x: [f64; D], u: [f64; D]| {
            let value = |monomial: &Vec<usize>| monomial.iter().map(|&i| (x[i] - centre[i]) / size).product();
            let row: Vec<f64> = monomials.iter().map(value).collect();
            for i in 0..n {
                (0..n).for_each(|j| gram[(i, j)] += row[i] * row[j]);
                (0..D).for_each(|c| right[(i, c)] += row[i] * u[c]);
            }
        };
        for &node in nodes {
            let (mut x, mut u): ([f64; D], [f64; D]) = (at(node), std::array::from_fn(|c| u[D * node as usize + c]));
            add(x, u);
            // around the axis of a body of revolution u_r is odd in r, u_y even: no one-sided fit
            if space.axisymmetric && centre[0] == 0.0 {
                (x[0], u[0]) = (-x[0], -u[0]);
                add(x, u);
            }
        }
        let factor = gram.cholesky()?;
        let pivots = factor.l_dirty().diagonal();
        if pivots.min() <= DETERMINED * pivots.max() {
            return None;
        }
        let solution = factor.solve(&right);
        let term = |(i, monomial)| (monomial, std::array::from_fn(|c| solution[(i, c)]));
        Some(Self { centre, size, terms: monomials.into_iter().enumerate().map(term).collect() })
    }

    /// Value at a point.
    pub fn value(&self, x: &[f64; D]) -> [f64; D] {
        let local: [f64; D] = std::array::from_fn(|i| (x[i] - self.centre[i]) / self.size);
        let mut value = [0.0; D];
        for (monomial, coefficient) in &self.terms {
            let product: f64 = monomial.iter().map(|&i| local[i]).product();
            (0..D).for_each(|c| value[c] += product * coefficient[c]);
        }
        value
    }

    /// Gradient u_c,j at a point.
    pub fn gradient(&self, x: &[f64; D]) -> [[f64; D]; D] {
        let local: [f64; D] = std::array::from_fn(|i| (x[i] - self.centre[i]) / self.size);
        let mut gradient = [[0.0; D]; D];
        for (monomial, coefficient) in &self.terms {
            for (k, &j) in monomial.iter().enumerate() {
                let rest: f64 = (0..monomial.len()).filter(|&m| m != k).map(|m| local[monomial[m]]).product();
                (0..D).for_each(|c| gradient[c][j] += coefficient[c] * rest / self.size);
            }
        }
        gradient
    }

    /// The highest derivatives applied to as many vectors: `u_c,ij a_i b_j` for linear elements, `u_c,ijk a_i b_j d_k` for
    /// quadratic ones.
    pub fn derivative(&self, along: &[[f64; D]]) -> [f64; D] {
        let mut sum = [0.0; D];
        for (monomial, coefficient) in self.terms.iter().filter(|(monomial, _)| monomial.len() == along.len()) {
            let factor = permanent(monomial, along, 0) / self.size.powi(along.len() as i32);
            (0..D).for_each(|c| sum[c] += factor * coefficient[c]);
        }
        sum
    }
}

/// Sum over all orders of the vectors of the products of their components: the derivative of a monomial along them. Bits of
/// `taken` tell vectors that other coordinates have.
fn permanent<const D: usize>(monomial: &[usize], along: &[[f64; D]], taken: u32) -> f64 {
    let Some((&i, rest)) = monomial.split_first() else { return 1.0 };
    let free = (0..along.len()).filter(|k| taken >> k & 1 == 0);
    free.map(|k| along[k][i] * permanent(rest, along, taken | 1 << k)).sum()
}
