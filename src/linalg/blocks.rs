//! Symmetric positive semidefinite matrices of small dense blocks, one row of blocks per body.

use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;

/// A symmetric matrix of dense blocks; only non-zero blocks are stored.
#[derive(Debug, Clone)]
pub struct Blocks {
    /// First unknown of each row of blocks, and the number of all unknowns.
    first: Vec<usize>,
    /// The blocks (i, j) of row i with j >= i, by j.
    rows: Vec<BTreeMap<usize, DMatrix<f64>>>,
}

impl Blocks {
    /// Return a zero matrix with this number of unknowns in each row of blocks; a row may have none.
    pub fn new(sizes: &[usize]) -> Self {
        let mut first = vec![0];
        sizes.iter().for_each(|size| first.push(first[first.len() - 1] + size));
        Self { first, rows: vec![BTreeMap::new(); sizes.len()] }
    }

    /// Return a matrix of a single block.
    pub fn single(block: &DMatrix<f64>) -> Self {
        let mut blocks = Self::new(&[block.nrows()]);
        blocks.add(0, 0, block);
        blocks
    }

    /// Return the number of rows of blocks.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Return the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.first[self.rows.len()]
    }

    /// Return the unknowns of a row of blocks.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.first[i]..self.first[i + 1]
    }

    /// Add a block at (i, j), and its transpose at (j, i) if i and j differ.
    pub fn add(&mut self, i: usize, j: usize, block: &DMatrix<f64>) {
        debug_assert_eq!(block.shape(), (self.range(i).len(), self.range(j).len()));
        if i > j {
            return self.add(j, i, &block.transpose());
        }
        if !block.is_empty() {
            self.rows[i].entry(j).and_modify(|sum| *sum += block).or_insert_with(|| block.clone());
        }
    }

    /// Return the block (i, i).
    pub fn diagonal(&self, i: usize) -> DMatrix<f64> {
        let size = self.range(i).len();
        self.rows[i].get(&i).cloned().unwrap_or_else(|| DMatrix::zeros(size, size))
    }

    /// Iterate over the stored blocks (i, j, block) with i <= j, row by row.
    pub fn stored(&self) -> impl Iterator<Item = (usize, usize, &DMatrix<f64>)> {
        self.rows.iter().enumerate().flat_map(|(i, row)| row.iter().map(move |(&j, block)| (i, j, block)))
    }

    /// Return A x.
    pub fn multiply(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut y = DVector::zeros(self.unknowns());
        for (i, j, block) in self.stored() {
            let (own, other) = (self.range(i), self.range(j));
            y.rows_mut(own.start, own.len()).gemv(1.0, block, &x.rows(other.start, other.len()), 1.0);
            if i != j {
                y.rows_mut(other.start, other.len()).gemv_tr(1.0, block, &x.rows(own.start, own.len()), 1.0);
            }
        }
        y
    }
}
