//! Linear algebra: sparse matrices in compressed rows, matrices of blocks with their factor, and functions that are the
//! same on all processors.
//!
//! Dense algebra comes from `nalgebra`. The sparse type is our own because its index type must be PETSc's 32-bit
//! integer, so that a pattern can be passed to PETSc without a copy.

use crate::error::{Error, Kind, Result};
pub use factor::{Blocks, Factor, PART, TOLERANCE};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

mod factor;

/// Powers, exponentials and the like with the same last digit on all processors.
///
/// The C library has several versions of each function and chooses one for the processor. Every rank evaluates the laws
/// of all contact points. On processors of two kinds, ranks would decide differently near a tolerance, and wait for
/// each other for ever.
pub mod portable {
    pub use libm::{acos, asin, atan, atan2, cos, cosh, exp, hypot, log, log2, log10, pow, sin, sinh, tan, tanh};
}

/// Return the least and the largest coordinates of points: the corners of their bounding box. Without points the least
/// ones are infinite.
pub fn bounds<const K: usize>(points: impl IntoIterator<Item = [f64; K]>) -> [[f64; K]; 2] {
    points.into_iter().fold([[f64::INFINITY; K], [f64::NEG_INFINITY; K]], |all, x| around(all, [x; 2]))
}

/// Return the diagonal of the box around points.
pub fn diagonal(points: &[[f64; 3]]) -> f64 {
    let [low, high] = bounds(points.iter().copied());
    (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt()
}

/// Return the bounding box of two boxes; either may be that of no points.
pub fn around<const K: usize>(a: [[f64; K]; 2], b: [[f64; K]; 2]) -> [[f64; K]; 2] {
    [std::array::from_fn(|c| a[0][c].min(b[0][c])), std::array::from_fn(|c| a[1][c].max(b[1][c]))]
}

/// Return the least and the largest of some numbers; without any the least one is infinite.
pub fn range(numbers: impl IntoIterator<Item = f64>) -> [f64; 2] {
    numbers
        .into_iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], number| [low.min(number), high.max(number)])
}

/// Return a vector of 2 or 3 components as one of 3.
pub fn pad<const K: usize>(v: [f64; K]) -> [f64; 3] {
    std::array::from_fn(|c| if c < K { v[c] } else { 0.0 })
}

/// Return the Euclidean length of a vector.
pub fn length<const K: usize>(v: [f64; K]) -> f64 {
    dot(&v, &v).sqrt()
}

/// Return the vector scaled to length one.
pub fn unit<const K: usize>(v: [f64; K]) -> [f64; K] {
    let norm = length(v);
    v.map(|v| v / norm)
}

/// Return the difference of two vectors.
pub fn minus<const K: usize>(a: [f64; K], b: [f64; K]) -> [f64; K] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// Return the vector product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

/// A sparse matrix in compressed rows: row `i` has the columns `col[ptr[i]..ptr[i+1]]`, sorted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Csr {
    pub columns: usize,
    /// Row starts, one more than there are rows.
    pub ptr: Vec<i32>,
    /// Column of each entry.
    pub col: Vec<i32>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl Csr {
    /// Return a matrix without rows, to be filled with [`Csr::push_row`].
    pub fn new(columns: usize) -> Self {
        Self { columns, ptr: vec![0], col: Vec::new(), values: Vec::new() }
    }

    /// Return a matrix with so many rows and no columns.
    pub fn without_columns(rows: usize) -> Self {
        Self { ptr: vec![0; rows + 1], ..Self::new(0) }
    }

    /// Return a square matrix with all entries stored, from its values row by row.
    pub fn full(rows: usize, values: Vec<f64>) -> Self {
        let ptr = (0..=rows).map(|i| (i * rows) as i32).collect();
        Self { columns: rows, ptr, col: (0..rows).flat_map(|_| 0..rows as i32).collect(), values }
    }

    /// Return the number of rows.
    pub fn rows(&self) -> usize {
        self.ptr.len() - 1
    }

    /// Append a row; `entries` are (column, value), in any order, with distinct columns. Zeros are not stored.
    pub fn push_row(&mut self, entries: impl IntoIterator<Item = (usize, f64)>) {
        let mut row: Vec<_> = entries.into_iter().filter(|entry| entry.1 != 0.0).collect();
        row.sort_unstable_by_key(|entry| entry.0);
        for (column, value) in row {
            debug_assert!(column < self.columns);
            self.col.push(column as i32);
            self.values.push(value);
        }
        self.ptr.push(self.col.len() as i32);
    }

    /// Return the range of the entries of row `i`.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.ptr[i] as usize..self.ptr[i + 1] as usize
    }

    /// Iterate over the entries (column, value) of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        self.range(i).map(|k| (self.col[k] as usize, self.values[k]))
    }

    /// Return the lower triangle of a square matrix as (row, column, value). Zeros are left out, except on the
    /// diagonal.
    pub fn lower_triangle(&self) -> Vec<(usize, usize, f64)> {
        let mut lower = Vec::with_capacity(self.values.len() / 2 + self.rows());
        for i in 0..self.rows() {
            let row = self.row(i).take_while(|&(j, _)| j <= i).filter(|&(j, value)| value != 0.0 || i == j);
            lower.extend(row.map(|(j, value)| (i, j, value)));
        }
        lower
    }

    /// Compute y = A x.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!(x.len(), self.columns);
        for (i, y) in y.iter_mut().enumerate() {
            let range = self.range(i);
            *y = self.col[range.clone()].iter().zip(&self.values[range]).map(|(&j, a)| a * x[j as usize]).sum();
        }
    }

    /// Add s A' x to y.
    pub fn add_transpose(&self, s: f64, x: &[f64], y: &mut [f64]) {
        debug_assert_eq!(y.len(), self.columns);
        for (i, &x) in x.iter().enumerate() {
            if x != 0.0 {
                for k in self.range(i) {
                    y[self.col[k] as usize] += s * self.values[k] * x;
                }
            }
        }
    }

    /// Return the position of entry (i, j) in `values`, if the pattern has it.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let range = self.range(i);
        let offset = self.col[range.clone()].binary_search(&(j as i32)).ok()?;
        Some(range.start + offset)
    }

    /// Return the same rows over other `columns`; `number` maps a column to its new number, none if it is left out.
    pub fn of_columns(&self, columns: usize, number: impl Fn(usize) -> Option<usize>) -> Self {
        let mut rows = Self::new(columns);
        for i in 0..self.rows() {
            rows.push_row(self.row(i).filter_map(|(j, value)| Some((number(j)?, value))));
        }
        rows
    }

    /// Return b K b' of each row b, with those entries of a square K alone that couple `dimension` dofs of one node.
    pub fn stiffness_of_nodes(&self, k: &Csr, dimension: usize) -> Vec<f64> {
        let at = |i: usize, j: usize| k.position(i, j).map_or(0.0, |at| k.values[at]);
        let of_node = |entries: &[(usize, f64)]| -> f64 {
            entries.iter().flat_map(|&(i, b)| entries.iter().map(move |&(j, c)| b * c * at(i, j))).sum()
        };
        let of_row = |q: usize| {
            let row: Vec<(usize, f64)> = self.row(q).collect();
            row.chunk_by(|a, b| a.0 / dimension == b.0 / dimension).map(of_node).sum()
        };
        (0..self.rows()).map(of_row).collect()
    }

    /// Return the diagonal, which row i has in the column `first` + i, with zeros where the pattern does not have it.
    pub fn diagonal(&self, first: usize) -> Vec<f64> {
        (0..self.rows()).map(|i| self.position(i, first + i).map_or(0.0, |at| self.values[at])).collect()
    }
}

/// Check that 32-bit row starts can count this number of entries; `what` names the matrix.
///
/// # Errors
/// [`Kind::Solver`] with the number, if they cannot.
pub fn countable(what: &str, entries: usize) -> Result<()> {
    if entries <= i32::MAX as usize {
        return Ok(());
    }
    let message = format!("{what} has {entries} entries, and 32 bits count no more than {}", i32::MAX);
    Err(Error::new(Kind::Solver, message).help("take a coarser mesh, or order = 1"))
}

/// Compute y = A x for a square matrix with all entries, row by row.
pub fn full_product(a: &[f64], x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(a.chunks_exact(x.len().max(1))).for_each(|(y, row)| *y = long_dot(row, x));
}

/// Return x'y of long vectors. Its partial sums allow vector instructions.
fn long_dot(a: &[f64], b: &[f64]) -> f64 {
    const WIDE: usize = 8;
    let (a, b) = (a.chunks_exact(WIDE), b.chunks_exact(WIDE));
    let rest = dot(a.remainder(), b.remainder());
    let mut sums = [0.0; WIDE];
    for (a, b) in a.zip(b) {
        (0..WIDE).for_each(|i| sums[i] += a[i] * b[i]);
    }
    sums.iter().sum::<f64>() + rest
}

/// Return x'y.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// Return the weights of the values at some points of a line in the value at `x` of the polynomial through them
/// (Lagrange). The points are distinct.
pub fn interpolation_weights(at: &[f64], x: f64) -> impl Iterator<Item = f64> + '_ {
    let weight = move |(i, own): (usize, &f64)| {
        at.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| (x - other) / (own - other)).product()
    };
    at.iter().enumerate().map(weight)
}

/// Add a x to y.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// A decimal digit: a number with a larger relative error has none, and what has fallen to this share has lost one.
pub const DIGIT: f64 = 0.1;

/// Return the amounts of some vectors whose combination is nearest to the vector `to` (least squares).
pub fn fit<V: AsRef<[f64]>>(vectors: &[V], to: &[f64]) -> Vec<f64> {
    let count = vectors.len();
    let normal = DMatrix::from_fn(count, count, |i, j| dot(vectors[i].as_ref(), vectors[j].as_ref()));
    let right = DVector::from_fn(count, |i, _| dot(vectors[i].as_ref(), to));
    let largest = (0..count).map(|i| normal[(i, i)]).fold(0.0, f64::max);
    if largest == 0.0 {
        return vec![0.0; count];
    }
    // leave out combinations of the vectors that vanish
    match normal.svd(true, true).solve(&right, TOLERANCE * largest) {
        Ok(amounts) => amounts.as_slice().to_vec(),
        Err(_) => vec![0.0; count],
    }
}

/// A sum with the rounding errors of its additions. The rounded total of both is the same in any order of the terms,
/// but for rare last digits.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Total {
    sum: f64,
    lost: f64,
}

impl Total {
    /// Add a term.
    pub fn add(&mut self, term: f64) {
        let next = self.sum + term;
        let added = next - self.sum;
        self.lost += (self.sum - (next - added)) + (term - added);
        self.sum = next;
    }

    /// Add all terms of another sum.
    pub fn join(&mut self, other: &Self) {
        self.add(other.sum);
        self.add(other.lost);
    }

    /// Return the sum.
    pub fn value(&self) -> f64 {
        self.sum + self.lost
    }
}

impl FromIterator<f64> for Total {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut total = Self::default();
        terms.into_iter().for_each(|term| total.add(term));
        total
    }
}

/// Disjoint sets of things that are joined directly or through others.
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Start with `count` things, each in a set of its own.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut thing: u32) -> u32 {
        while self.0[thing as usize] != thing {
            // The thing now points to the one two steps above, which halves the way up for the next search.
            let above = self.0[self.0[thing as usize] as usize];
            self.0[thing as usize] = above;
            thing = above;
        }
        thing
    }

    /// Join two things.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Return whether two things are in one set.
    pub fn are_joined(&mut self, a: u32, b: u32) -> bool {
        self.root(a) == self.root(b)
    }

    /// Return the number of sets, and the index of the set of each thing. Sets are numbered in the order of their first
    /// things.
    pub fn classes(mut self) -> (usize, Vec<u32>) {
        let mut of_thing: Vec<u32> = vec![0; self.0.len()];
        let mut count = 0;
        for thing in 0..self.0.len() {
            // The root is the least of all things in the set.
            let root = self.root(thing as u32) as usize;
            if root == thing {
                of_thing[thing] = count;
                count += 1;
            }
            of_thing[thing] = of_thing[root];
        }
        (count as usize, of_thing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_entries_than_32_bits_are_refused() {
        assert!(countable("K", i32::MAX as usize).is_ok());
        let error = countable("the stiffness matrix of body `lower`", i32::MAX as usize + 1).unwrap_err();
        assert!(error.message().contains("`lower` has 2147483648 entries"), "{error}");
    }

    #[test]
    fn products_agree_with_their_transposes() {
        let mut a = Csr::new(3);
        a.push_row([(2, 4.0), (0, 1.0)]);
        a.push_row([]);
        a.push_row([(1, -2.0), (2, 0.0)]);
        assert_eq!(a.rows(), 3);
        assert_eq!(a.col, [0, 2, 1]);
        let (x, y) = ([1.0, 2.0, 3.0], [5.0, 7.0, 11.0]);
        let mut ax = [0.0; 3];
        a.multiply(&x, &mut ax);
        assert_eq!(ax, [13.0, 0.0, -4.0]);
        let mut aty = [0.0; 3];
        a.add_transpose(1.0, &y, &mut aty);
        assert_eq!(dot(&y, &ax), dot(&x, &aty));
        assert_eq!(a.position(0, 2), Some(1));
        assert_eq!(a.position(0, 1), None);
    }

    /// Rows longer than the partial sums of a product.
    #[test]
    fn products_of_full_matrices() {
        let entry = |i: usize, j: usize| (3 * i + j) as f64;
        let x: Vec<f64> = (0..19).map(|j| 1.0 - f64::from(j)).collect();
        let expected: Vec<f64> = (0..19).map(|i| (0..19).map(|j| entry(i, j) * x[j]).sum()).collect();
        let mut y = vec![f64::NAN; 19];
        full_product(&(0..19 * 19).map(|at| entry(at / 19, at % 19)).collect::<Vec<f64>>(), &x, &mut y);
        assert_eq!(y, expected);
    }

    /// Terms of very different sizes, shared in two ways: a plain sum would lose the small ones, and differ.
    #[test]
    fn parts_of_a_sum_are_its_parts_in_any_order() {
        let terms: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k % 17)).collect();
        let whole: Total = terms.iter().copied().collect();
        let mut joined = Total::default();
        terms.rchunks(37).for_each(|part| joined.join(&part.iter().copied().collect()));
        assert_eq!(whole.value(), joined.value());
        let plain: f64 = terms.iter().sum();
        let back: f64 = terms.iter().rev().sum();
        assert!(plain != back && (plain - whole.value()).abs() > 0.0);
    }
}
