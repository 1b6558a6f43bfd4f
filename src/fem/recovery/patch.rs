//! A polynomial fitted to nodal displacements.

use crate::fem::Space;
use nalgebra::DMatrix;

/// Most monomials: those of degree 3 in space.
const MOST: usize = 20;

/// The monomials up to a degree, lower ones first. Each but the first is an earlier one times a coordinate.
pub(super) struct Monomials {
    degree: usize,
    /// Number of the earlier one, and the coordinate.
    made: Vec<(usize, usize)>,
    /// The highest derivatives by as many coordinates, the first one running fastest: the monomial that has one, and its value.
    highest: Vec<(usize, f64)>,
}

impl Monomials {
    /// Those up to a degree.
    pub fn new(dimension: usize, degree: usize) -> Self {
        let (mut factors, mut made) = (vec![Vec::new()], vec![(0, 0)]);
        let mut first = 0;
        for _ in 0..degree {
            let last = factors.len();
            for k in first..last {
                let from = factors[k].last().copied().unwrap_or(0);
                for i in from..dimension {
                    factors.push([&factors[k][..], &[i]].concat());
                    made.push((k, i));
                }
            }
            first = last;
        }
        let of_coordinates = |number: usize| {
            let mut by: Vec<usize> = (0..degree).map(|k| number / dimension.pow(k as u32) % dimension).collect();
            by.sort_unstable();
            let times = |i| by.iter().filter(|&&j| j == i).count();
            let value = (0..dimension).flat_map(|i| 1..=times(i)).product::<usize>() as f64;
            (factors.iter().position(|factors| *factors == by).unwrap_or(0), value)
        };
        let highest = (0..dimension.pow(degree as u32)).map(of_coordinates).collect();
        Self { degree, made, highest }
    }

    /// Their values.
    fn at<const D: usize>(&self, x: &[f64; D]) -> [f64; MOST] {
        let mut values = [0.0; MOST];
        values[0] = 1.0;
        for (k, &(of, i)) in self.made.iter().enumerate().skip(1) {
            values[k] = values[of] * x[i];
        }
        values
    }
}

/// A polynomial displacement around a vertex.
pub(super) struct Patch<const D: usize> {
    centre: [f64; D],
    size: f64,
    degree: usize,
    /// Coefficients of the monomials in (x - centre)/size.
    terms: Vec<[f64; D]>,
    /// Its highest derivatives, in the order of [`Monomials::highest`].
    highest: Vec<[f64; D]>,
}

/// Least pivot of a fit whose monomials have norm one: the part of a monomial that the others do not make. Its square is what rounding of
/// sums is amplified by: a fit has six digits of sixteen at least.
const DETERMINED: f64 = 1e-5;

impl<const D: usize> Patch<D> {
    /// The least-squares fit to the values `u` at nodes; `None` where they do not determine it.
    ///
    /// What the polynomial misses is the next term of Taylor's series, which grows as the distance to the power of the degree and one.
    /// Squares of differences are weighed by one over the square of that, so that all nodes count by what they determine, and far ones do not
    /// spoil the derivatives at the centre. A node in the centre counts as the next one.
    pub fn fit(space: &Space<D>, u: &[f64], centre: [f64; D], nodes: &[u32], monomials: &Monomials) -> Option<Self> {
        let n = monomials.made.len();
        if nodes.len() < n {
            return None;
        }
        let at = |node: u32| space.nodes[node as usize];
        let distance = |node: u32| (0..D).map(|i| (at(node)[i] - centre[i]).powi(2)).sum::<f64>().sqrt();
        let size = nodes.iter().map(|&node| distance(node)).fold(f64::MIN_POSITIVE, f64::max);
        let near = nodes.iter().map(|&node| distance(node)).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        let (mut gram, mut right) = ([[0.0; MOST]; MOST], [[0.0; D]; MOST]);
        let mut add = |x: [f64; D], u: [f64; D], weight: f64| {
            let row = monomials.at(&std::array::from_fn::<f64, D, _>(|i| (x[i] - centre[i]) / size));
            for i in 0..n {
                let scaled = weight * row[i];
                (0..=i).for_each(|j| gram[i][j] += scaled * row[j]);
                (0..D).for_each(|c| right[i][c] += scaled * u[c]);
            }
        };
        for &node in nodes {
            let (mut x, mut u): ([f64; D], [f64; D]) = (at(node), std::array::from_fn(|c| u[D * node as usize + c]));
            let squared = near * near + distance(node).powi(2);
            let weight = (near * near / squared).powi(monomials.degree as i32 + 1);
            add(x, u, weight);
            // around the axis of a body of revolution u_r is odd in r, u_y even: no one-sided fit
            if space.axisymmetric && centre[0] == 0.0 {
                (x[0], u[0]) = (-x[0], -u[0]);
                add(x, u, weight);
            }
        }
        // scaled to a diagonal of ones
        let scale: Vec<f64> = (0..n).map(|i| gram[i][i].sqrt().recip()).collect();
        let factor = DMatrix::from_fn(n, n, |i, j| scale[i] * scale[j] * gram[i.max(j)][i.min(j)]).cholesky()?;
        let pivots = factor.l_dirty().diagonal();
        if pivots.min() <= DETERMINED {
            return None;
        }
        let solution = factor.solve(&DMatrix::from_fn(n, D, |i, c| scale[i] * right[i][c]));
        let terms: Vec<[f64; D]> = (0..n).map(|i| std::array::from_fn(|c| scale[i] * solution[(i, c)])).collect();
        let unit = size.powi(monomials.degree as i32);
        let highest = monomials.highest.iter().map(|&(k, value)| terms[k].map(|term| term * value / unit)).collect();
        Some(Self { centre, size, degree: monomials.degree, terms, highest })
    }

    /// Gradient u_c,j of a parabola at a point, in a third of the time of [`Patch::jet`]; of polynomials of another degree as there.
    pub fn slope_of_parabola(&self, monomials: &Monomials, x: &[f64; D]) -> [[f64; D]; D] {
        if self.degree != 2 {
            return self.jet(monomials, x).1;
        }
        std::array::from_fn(|c| {
            std::array::from_fn(|j| {
                let bend = |i: usize| self.highest[D * j + i][c] * (x[i] - self.centre[i]);
                self.terms[1 + j][c] / self.size + (0..D).map(bend).sum::<f64>()
            })
        })
    }

    /// Value and gradient u_c,j at a point.
    pub fn jet(&self, monomials: &Monomials, x: &[f64; D]) -> ([f64; D], [[f64; D]; D]) {
        let local: [f64; D] = std::array::from_fn(|i| (x[i] - self.centre[i]) / self.size);
        let (mut values, mut slopes) = ([0.0; MOST], [[0.0; D]; MOST]);
        values[0] = 1.0;
        let (mut value, mut gradient) = (self.terms[0], [[0.0; D]; D]);
        for (k, term) in self.terms.iter().enumerate().skip(1) {
            let (of, i) = monomials.made[k];
            values[k] = values[of] * local[i];
            slopes[k] = slopes[of].map(|slope| slope * local[i]);
            slopes[k][i] += values[of];
            for c in 0..D {
                value[c] += term[c] * values[k];
                (0..D).for_each(|j| gradient[c][j] += term[c] * slopes[k][j] / self.size);
            }
        }
        (value, gradient)
    }

    /// The highest derivatives applied to as many vectors: `u_c,ij a_i b_j` for linear elements, `u_c,ijk a_i b_j d_k` for
    /// quadratic ones; zero for a polynomial of a lower degree.
    pub fn derivative(&self, along: &[[f64; D]]) -> [f64; D] {
        let mut sum = [0.0; D];
        if self.degree < along.len() {
            return sum;
        }
        for (number, value) in self.highest.iter().enumerate() {
            let (mut factor, mut rest) = (1.0, number);
            for along in along {
                factor *= along[rest % D];
                rest /= D;
            }
            (0..D).for_each(|c| sum[c] += factor * value[c]);
        }
        sum
    }
}
