//! A polynomial fitted to the nodal displacements around a vertex, and the rings of cells there.

use crate::fem::{Space, length, minus};
use crate::problem::order::Order;
use nalgebra::DMatrix;

/// A list of one entry a monomial: there are 55 of degree 9 in the plane, and 20 of degree 3 in space.
type Terms<T> = [T; 55];

/// The monomials up to a degree, lower ones first. Each but the first is an earlier one times a coordinate.
pub(super) struct Monomials {
    degree: usize,
    /// Index of the earlier monomial, and index of the coordinate.
    made: Vec<(usize, usize)>,
}

impl Monomials {
    /// Make the monomials up to a degree.
    pub fn new(dimension: usize, degree: usize) -> Self {
        let mut made = vec![(0, 0)];
        // These are the last coordinates of all monomials.
        let mut last = vec![0];
        let mut first = 0;
        for _ in 0..degree {
            let end = last.len();
            for k in first..end {
                for i in last[k]..dimension {
                    last.push(i);
                    made.push((k, i));
                }
            }
            first = end;
        }
        Self { degree, made }
    }

    /// Return the values of the monomials at a point. Entries behind them are one.
    fn at<const D: usize>(&self, x: &[f64; D]) -> Terms<f64> {
        let mut values = [1.0; 55];
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
    /// Coefficients of the monomials in (x - centre)/size.
    terms: Vec<[f64; D]>,
}

/// Smallest pivot of a fit whose monomials have norm one. A pivot is the part of a monomial that the others do not
/// represent. One over its square amplifies the rounding of sums, so that a fit has at least six digits of sixteen.
const DETERMINED: f64 = 1e-5;

impl<const D: usize> Patch<D> {
    /// Return the least-squares fit to the values `u` at nodes, or `None` if they do not determine it.
    ///
    /// The error of the polynomial is the next term of Taylor's series. It grows with the distance to the power of the
    /// degree plus one, and squared differences are divided by its square. So all nodes are weighted by what they
    /// determine, and distant ones do not spoil the derivatives at the centre. A node in the centre is weighted like
    /// the nearest other one. Polynomials of a degree above three are to be good on all of the cells that they are
    /// blended over, some of which may be much larger than others: there the farthest node counts as near.
    pub fn fit(space: &Space<D>, u: &[f64], centre: [f64; D], nodes: &[u32], monomials: &Monomials) -> Option<Self> {
        let n = monomials.made.len();
        if nodes.len() < n {
            return None;
        }
        let at = |node: u32| space.nodes[node as usize];
        let distance = |node: u32| length(minus(at(node), centre));
        let size = nodes.iter().map(|&node| distance(node)).fold(f64::MIN_POSITIVE, f64::max);
        let near = match space.order {
            Order::P1 | Order::P2 => {
                nodes.iter().map(|&node| distance(node)).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min)
            }
            _ => size,
        };
        // row by row, and only up to the diagonal
        let (mut gram, mut right) = (vec![0.0; n * n], vec![[0.0; D]; n]);
        let mut add = |x: [f64; D], u: [f64; D], weight: f64| {
            let row = monomials.at(&std::array::from_fn::<f64, D, _>(|i| (x[i] - centre[i]) / size));
            for (i, (sums, right)) in gram.chunks_exact_mut(n).zip(&mut right).enumerate() {
                let scaled = weight * row[i];
                sums[..=i].iter_mut().zip(&row).for_each(|(sum, value)| *sum += scaled * value);
                (0..D).for_each(|c| right[c] += scaled * u[c]);
            }
        };
        for &node in nodes {
            let (mut x, mut u): ([f64; D], [f64; D]) = (at(node), std::array::from_fn(|c| u[D * node as usize + c]));
            let squared = near * near + distance(node).powi(2);
            let weight = (near * near / squared).powi(monomials.degree as i32 + 1);
            add(x, u, weight);
            // Around the axis of a body of revolution u_r is odd in r and u_y is even, so the fit is not one-sided.
            if space.axisymmetric && centre[0] == 0.0 {
                (x[0], u[0]) = (-x[0], -u[0]);
                add(x, u, weight);
            }
        }
        // The matrix is scaled to a diagonal of ones.
        let scale: Vec<f64> = (0..n).map(|i| gram[i * n + i].sqrt().recip()).collect();
        let factor = DMatrix::from_fn(n, n, |i, j| scale[i] * scale[j] * gram[i.max(j) * n + i.min(j)]).cholesky()?;
        let pivots = factor.l_dirty().diagonal();
        if pivots.min() <= DETERMINED {
            return None;
        }
        let solution = factor.solve(&DMatrix::from_fn(n, D, |i, c| scale[i] * right[i][c]));
        let terms = (0..n).map(|i| std::array::from_fn(|c| scale[i] * solution[(i, c)])).collect();
        Some(Self { centre, size, terms })
    }

    /// Return the value and the gradient u_c,j at a point.
    #[inline]
    pub fn jet(&self, monomials: &Monomials, x: &[f64; D]) -> ([f64; D], [[f64; D]; D]) {
        let local: [f64; D] = std::array::from_fn(|i| (x[i] - self.centre[i]) / self.size);
        let (mut values, mut slopes): (Terms<f64>, Terms<[f64; D]>) = ([1.0; 55], [[0.0; D]; 55]);
        let (mut value, mut gradient) = (self.terms[0], [[0.0; D]; D]);
        for (k, term) in self.terms.iter().enumerate().skip(1) {
            let (of, i) = monomials.made[k];
            let (value_of, mut slope) = (values[of], slopes[of]);
            (0..D).for_each(|j| slope[j] *= local[i]);
            slope[i] += value_of;
            (values[k], slopes[k]) = (value_of * local[i], slope);
            for c in 0..D {
                value[c] += term[c] * values[k];
                (0..D).for_each(|j| gradient[c][j] += term[c] * slope[j]);
            }
        }
        gradient.as_flattened_mut().iter_mut().for_each(|slope| *slope /= self.size);
        (value, gradient)
    }
}

/// Rings of cells around the vertices of a mesh, with the current selection around one of them.
pub(super) struct Rings<'a, const D: usize> {
    space: &'a Space<D>,
    /// Cells at each vertex; empty at other nodes.
    around: Vec<Vec<u32>>,
    cells: Marked,
    nodes: Marked,
}

impl<'a, const D: usize> Rings<'a, D> {
    /// Collect the cells at each vertex of a mesh.
    pub fn new(space: &'a Space<D>) -> Self {
        let mut around = vec![Vec::new(); space.nodes.len()];
        for (index, cell) in space.cells.chunks_exact(space.stride).enumerate() {
            cell[..=D].iter().for_each(|&node| around[node as usize].push(index as u32));
        }
        Self { space, around, cells: Marked::new(space.cell_count()), nodes: Marked::new(space.nodes.len()) }
    }

    /// Return whether a node is a vertex.
    pub fn is_vertex(&self, node: usize) -> bool {
        !self.around[node].is_empty()
    }

    /// Select the cells at a vertex.
    pub fn begin(&mut self, vertex: usize) {
        self.cells.clear();
        self.cells.extend(&self.around[vertex]);
    }

    /// Add the cells that touch the selected ones.
    pub fn widen(&mut self) {
        self.nodes.clear();
        for &cell in &self.cells.list {
            self.nodes.extend(&self.space.cell(cell as usize)[..=D]);
        }
        self.nodes.list.iter().for_each(|&vertex| self.cells.extend(&self.around[vertex as usize]));
    }

    /// Return the nodes of the selected cells.
    pub fn nodes(&mut self) -> &[u32] {
        self.nodes.clear();
        for &cell in &self.cells.list {
            self.nodes.extend(self.space.cell(cell as usize));
        }
        &self.nodes.list
    }
}

/// Numbers without repetition, in the order in which they were added.
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
