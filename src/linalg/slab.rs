//! The rows of a square matrix that one of several ranks owns.

use super::Csr;

/// Rows `first..first + rows` of a square matrix, entries in the columns of the same numbers apart from the others.
#[derive(Debug, Clone, Default)]
pub struct Slab {
    /// Number of the first row among all.
    pub first: usize,
    /// Number of all rows.
    pub total: usize,
    /// Whether other ranks have the other rows; else this one has all.
    pub is_shared: bool,
    /// Starts of the rows in own columns.
    pub ptr: Vec<i32>,
    /// Own columns, counted from `first`, sorted in each row.
    pub col: Vec<i32>,
    /// Starts of the rows in the columns of others.
    pub other_ptr: Vec<i32>,
    /// Columns of others, counted through all, sorted in each row.
    pub other_col: Vec<i32>,
    /// Values: all in own columns, row by row, then all others, row by row.
    pub values: Vec<f64>,
}

impl From<Csr> for Slab {
    /// A whole matrix.
    fn from(matrix: Csr) -> Self {
        let Csr { columns, ptr, col, values } = matrix;
        Self { total: columns, other_ptr: vec![0; ptr.len()], ptr, col, values, ..Self::default() }
    }
}

impl Slab {
    /// Rows of a matrix from `first` on, from rows whose columns are counted through all, without a second copy.
    pub fn of_rows(rows: Csr, first: usize) -> Self {
        let Csr { columns: total, mut ptr, mut col, mut values } = rows;
        let own = first..first + ptr.len() - 1;
        let (mut other_ptr, mut other_col, mut others) = (vec![0], Vec::new(), Vec::new());
        let (mut next, mut begin) = (0, 0);
        for row in 1..ptr.len() {
            let end = ptr[row] as usize;
            for k in begin..end {
                let (column, value) = (col[k], values[k]);
                if own.contains(&(column as usize)) {
                    (col[next], values[next]) = (column - first as i32, value);
                    next += 1;
                } else {
                    other_col.push(column);
                    others.push(value);
                }
            }
            begin = end;
            ptr[row] = next as i32;
            other_ptr.push(other_col.len() as i32);
        }
        col.truncate(next);
        col.shrink_to_fit();
        values.truncate(next);
        values.append(&mut others);
        Self { first, total, is_shared: true, ptr, col, other_ptr, other_col, values }
    }

    /// Number of rows here.
    pub fn rows(&self) -> usize {
        self.ptr.len() - 1
    }

    /// Position in `values` of the entry in row `i`, counted from the first here, and column `j`, counted through all.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let find = |ptr: &[i32], col: &[i32], j: usize| {
            let (from, to) = (ptr[i] as usize, ptr[i + 1] as usize);
            col[from..to].binary_search(&(j as i32)).ok().map(|at| from + at)
        };
        if (self.first..self.first + self.rows()).contains(&j) {
            find(&self.ptr, &self.col, j - self.first)
        } else {
            find(&self.other_ptr, &self.other_col, j).map(|at| self.col.len() + at)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_where_they_belong() {
        let mut rows = Csr::new(5);
        rows.push_row([(0, 1.0), (2, 2.0), (3, 3.0)]);
        rows.push_row([(2, 4.0), (3, 5.0), (4, 6.0)]);
        let slab = Slab::of_rows(rows.clone(), 2);
        assert_eq!((&slab.ptr[..], &slab.col[..]), (&[0, 2, 4][..], &[0, 1, 0, 1][..]));
        assert_eq!((&slab.other_ptr[..], &slab.other_col[..]), (&[0, 1, 2][..], &[0, 4][..]));
        for i in 0..2 {
            for j in 0..5 {
                let value = slab.position(i, j).map(|at| slab.values[at]);
                assert_eq!(value, rows.position(i, j).map(|at| rows.values[at]), "{i} {j}");
            }
        }
        assert!(slab.is_shared && slab.total == 5 && slab.rows() == 2);
        let whole = Slab::from(Csr::full(2, vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(whole.position(1, 0), Some(2));
        assert!(!whole.is_shared && whole.position(0, 2).is_none());
    }
}
