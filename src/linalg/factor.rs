//! The factor of a semidefinite matrix of blocks: it gives a solution of A x = b and a basis of the kernel.

use super::blocks::Blocks;
use super::degree;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeSet;
use std::ops::Range;

/// Relative stiffness below which a motion counts as free: the one tolerance that decides which motions are unconstrained.
///
/// Let A be the springs in terms of motions whose largest displacement is about one, scaled to ones on its diagonal. A motion e is free if
/// e'Ae <= TOLERANCE e'e. Here e'e is what the springs would store if every unknown of e moved alone; compared with it, they store nothing. Both sides
/// are quadratic: a free motion closes less than 3e-7 of what its parts close.
///
/// - Why the tolerance is not less. An entry of A is a sum of products, each rounded by eps = 1.1e-16 of itself. The elimination of k unknowns changes
///   it by at most (k + 1) eps again (Higham, Accuracy and Stability of Numerical Algorithms, theorem 10.3), where k counts the unknowns of the bodies
///   around, some hundreds at most. So e'Ae/e'e of a true kernel is rounded to 1e-14 at worst. Measured are 1e-16 on a wall of 64 x 64 blocks and 8e-17
///   on 1000 blocks in space. Coordinates in mesh files have 16 digits or, on curved surfaces, some ten. Closings have that error, and A its square.
/// - Why it is not more. Everything above is real. A chain of n bodies that is held at one end has e'Ae/e'e = 1/n^2, springs of 1 beside those of 1e8
///   have 1e-8, and both may occur together.
/// - Why it refers to e'e, not to the pivot alone. A pivot is e'Ae for the e that is one at its own unknown. If that is the rotation of a single block,
///   all others move by their distance, and their rounding errors grow with it: the pivot is 2.5e-9 on that wall, and e'e is 2.4e7.
pub const TOLERANCE: f64 = 1e-13;

/// Share of the largest part of a free motion below which a part is rounding. A motion is known to the root of [`TOLERANCE`], 3e-7, and less accurately
/// where springs differ much. Other quantities that are rounded more than once count as zero below this share, too.
pub const PART: f64 = 1e-6;

/// The factorisation LDL' of a symmetric positive semidefinite matrix. Unknowns are scaled to ones on the diagonal. Bodies are in an order of minimum
/// degree, and the unknowns of a body are eliminated by their pivots, largest first.
///
/// A pivot d belongs to a vector e that is one at its unknown and zero at the unknowns that are not eliminated yet; its other entries make e'Ae = d
/// least. If e'Ae <= tolerance e'e, then e is in the kernel, and the unknown is left out: the matrix of the others is regular. An unknown is also left
/// out if its diagonal entry is below tolerance^2 of the largest in its block, the square of a rounded number.
#[derive(Debug, Clone)]
pub struct Factor {
    /// Number of unknowns.
    count: usize,
    /// 1/root of the diagonal; zero for unknowns that nothing resists.
    scale: Vec<f64>,
    /// Columns of L, in the order of elimination.
    columns: Vec<Column>,
    /// Kernel vectors as entries (unknown, value), largest value one.
    kernel: Vec<Vec<(usize, f64)>>,
    /// The unknown that was left out for each kernel vector.
    left_out: Vec<usize>,
}

/// The columns of L of one body.
#[derive(Debug, Clone)]
struct Column {
    /// Unknowns of the body.
    own: Range<usize>,
    /// Bodies connected to it that are eliminated later: number of their column, their unknowns.
    below: Vec<(usize, Range<usize>)>,
    /// Number of rows: those of the body and those below.
    height: usize,
    /// L column by column, `height` entries for each unknown of the body; the ones on the diagonal are implied.
    panel: Vec<f64>,
    /// D; zero for unknowns left out.
    pivot: Vec<f64>,
    /// Unknowns of the body, counted from `own.start`, in the order of their pivots; without those left out.
    order: Vec<usize>,
}

impl Column {
    /// Return the column of L of unknown p of the body.
    fn column(&self, p: usize) -> &[f64] {
        &self.panel[p * self.height..(p + 1) * self.height]
    }

    /// Return the sum of the entries below the body's rows, times x, in the column of unknown p.
    fn along_below(&self, p: usize, x: &[f64]) -> f64 {
        let (mut sum, mut row) = (0.0, self.own.len());
        let column = self.column(p);
        for (_, range) in &self.below {
            sum += super::dot(&column[row..row + range.len()], &x[range.clone()]);
            row += range.len();
        }
        sum
    }

    /// Backward substitution with L' at the unknowns of the body; x at the rows below is final.
    fn back(&self, x: &mut [f64]) {
        for &p in self.order.iter().rev() {
            let own = super::dot(&self.column(p)[..self.own.len()], &x[self.own.clone()]);
            x[self.own.start + p] -= self.along_below(p, x) + own;
        }
    }
}

impl Factor {
    /// Factor a matrix whose unknowns are scaled with `scale`, one entry each.
    fn new(matrix: &Blocks, scale: Vec<f64>, tolerance: f64) -> Self {
        let mut factor = Self {
            count: matrix.unknowns(),
            scale,
            columns: structure(matrix),
            kernel: Vec::new(),
            left_out: Vec::new(),
        };
        // for each column, the earlier ones that it is below: their number, and its position there
        let mut earlier: Vec<Vec<(usize, usize)>> = vec![Vec::new(); factor.columns.len()];
        for (j, column) in factor.columns.iter().enumerate() {
            column.below.iter().enumerate().for_each(|(position, (k, _))| earlier[*k].push((j, position)));
        }
        let mut entries = vec![Vec::new(); factor.columns.len()];
        let step = steps(matrix, &factor.columns);
        for (i, j, block) in matrix.stored() {
            let (k, l) = (step[i], step[j]);
            entries[k.min(l)].push((k.max(l), if k <= l { block.transpose() } else { block.clone() }));
        }
        let mut work = Work { x: vec![0.0; factor.count], row: vec![0; factor.columns.len()], runs: Vec::new() };
        for (k, entries) in entries.iter().enumerate() {
            factor.assemble(k, entries, &mut work);
            for &(j, position) in &earlier[k] {
                factor.update(k, j, position, &mut work);
            }
            factor.eliminate(k, &earlier, tolerance, &mut work);
        }
        factor
    }

    /// Write the scaled matrix into column k, from its blocks (column, transpose of the block above).
    fn assemble(&mut self, k: usize, entries: &[(usize, DMatrix<f64>)], work: &mut Work) {
        let mut height = self.columns[k].own.len();
        for (column, range) in &self.columns[k].below {
            work.row[*column] = height;
            height += range.len();
        }
        work.row[k] = 0;
        let own = self.columns[k].own.clone();
        let mut panel = vec![0.0; height * own.len()];
        for (column, block) in entries {
            let rows = self.columns[*column].own.clone();
            for (p, u) in own.clone().enumerate() {
                for (r, v) in rows.clone().enumerate() {
                    panel[p * height + work.row[*column] + r] = self.scale[u] * block[(r, p)] * self.scale[v];
                }
            }
        }
        self.columns[k].panel = panel;
    }

    /// Subtract from column k the change by the elimination of column j < k, in which k is at `position` of the columns below.
    fn update(&mut self, k: usize, j: usize, position: usize, work: &mut Work) {
        let (before, rest) = self.columns.split_at_mut(k);
        let (source, target) = (&before[j], &mut rest[0]);
        let touched = &source.below[position..];
        let count: usize = touched.iter().map(|(_, range)| range.len()).sum();
        let top = source.height - count;
        // join rows that are consecutive in both columns; in the last columns, which are full, most are
        work.runs.clear();
        let mut from = top;
        for (column, range) in touched {
            let to = work.row[*column];
            match work.runs.last_mut() {
                Some(run) if run.from + run.length == from && run.to + run.length == to => run.length += range.len(),
                _ => work.runs.push(Run { from, to, length: range.len() }),
            }
            from += range.len();
        }
        for p in 0..target.own.len() {
            let amount = |q: usize| source.pivot[q] * source.column(q)[top + p];
            let panel = &mut target.panel[p * target.height..(p + 1) * target.height];
            // three unknowns at once, as bodies have three or six: each row is then read and written less often
            for some in source.order.chunks(3) {
                for &Run { from, to, length } in &work.runs {
                    let rows = &mut panel[to..to + length];
                    let of = |q: usize| &source.column(q)[from..from + length];
                    match *some {
                        [a, b, c] => {
                            let (x, y, z) = (amount(a), amount(b), amount(c));
                            let all = of(a).iter().zip(of(b)).zip(of(c));
                            rows.iter_mut().zip(all).for_each(|(row, ((a, b), c))| *row -= x * a + y * b + z * c);
                        }
                        _ => some.iter().for_each(|&q| super::axpy(-amount(q), of(q), rows)),
                    }
                }
            }
        }
    }

    /// Eliminate the unknowns of column k.
    fn eliminate(&mut self, k: usize, earlier: &[Vec<(usize, usize)>], tolerance: f64, work: &mut Work) {
        let size = self.columns[k].own.len();
        let height = self.columns[k].height;
        let mut open: Vec<usize> = (0..size).collect();
        // take the first of equal pivots: rotations come last, so that they are left out first
        while let Some(at) = (0..open.len()).rev().max_by(|&a, &b| {
            let pivot = |i: usize| self.columns[k].panel[open[i] * (height + 1)];
            pivot(a).total_cmp(&pivot(b))
        }) {
            let p = open.remove(at);
            let pivot = self.columns[k].panel[p * (height + 1)];
            // a pivot of the kernel is about eps e'e, and e'e of a rotation is about the square of the number of bodies: below this bound for up to
            // 5e4 bodies
            if pivot <= tolerance.sqrt() {
                let vector = self.candidate(k, p, earlier, work);
                let size: f64 = vector.iter().map(|(_, value)| value * value).sum();
                if pivot <= tolerance * size {
                    self.leave_out(k, p, vector, &open);
                    continue;
                }
            }
            let column = &mut self.columns[k];
            let (done, mine) = (column.order.clone(), column.panel[p * height..(p + 1) * height].to_vec());
            for &q in &open {
                let amount = mine[q] / pivot;
                super::axpy(-amount, &mine, &mut column.panel[q * height..(q + 1) * height]);
            }
            let own = &mut column.panel[p * height..(p + 1) * height];
            own.iter_mut().for_each(|value| *value /= pivot);
            done.into_iter().chain([p]).for_each(|q| own[q] = 0.0);
            column.pivot[p] = pivot;
            column.order.push(p);
        }
    }

    /// Keep a kernel vector of the scaled matrix, and set the row and the column of its unknown to zero.
    fn leave_out(&mut self, k: usize, p: usize, vector: Vec<(usize, f64)>, open: &[usize]) {
        let column = &mut self.columns[k];
        column.panel[p * column.height..(p + 1) * column.height].fill(0.0);
        open.iter().for_each(|q| column.panel[q * column.height + p] = 0.0);
        let unknown = column.own.start + p;
        let at = |u: usize| if self.scale[u] > 0.0 { self.scale[u] } else { f64::from(u8::from(u == unknown)) };
        let mut vector: Vec<(usize, f64)> = vector.into_iter().map(|(u, value)| (u, at(u) * value)).collect();
        let largest = vector.iter().map(|entry| entry.1).max_by(|a, b| a.abs().total_cmp(&b.abs()));
        vector.iter_mut().for_each(|entry| entry.1 /= largest.unwrap_or(1.0));
        vector.sort_unstable_by_key(|entry| entry.0);
        self.kernel.push(vector);
        self.left_out.push(unknown);
    }

    /// Return the vector e of a pivot of the scaled matrix: one at unknown p of column k, zero at the unknowns that are not eliminated yet, and with
    /// the least e'Ae. Its entries are (unknown, value).
    fn candidate(&self, k: usize, p: usize, earlier: &[Vec<(usize, usize)>], work: &mut Work) -> Vec<(usize, f64)> {
        let x = &mut work.x;
        x[self.columns[k].own.start + p] = 1.0;
        let mut open = BTreeSet::from([k]);
        let mut touched = Vec::new();
        while let Some(j) = open.pop_last() {
            let column = &self.columns[j];
            column.back(x);
            if column.own.clone().any(|u| x[u] != 0.0) {
                open.extend(earlier[j].iter().map(|entry| entry.0));
                touched.extend(column.own.clone());
            }
        }
        let entries = touched.into_iter().map(|u| (u, std::mem::take(&mut x[u])));
        entries.filter(|entry| entry.1 != 0.0).collect()
    }

    /// Return the number of stored entries of the factor.
    #[cfg(test)]
    pub fn entries(&self) -> usize {
        self.columns.iter().map(|column| column.panel.len()).sum()
    }

    /// Return the number of unknowns that are not left out.
    pub fn rank(&self) -> usize {
        self.count - self.left_out.len()
    }

    /// Return the unknowns left out, one for each kernel vector.
    #[cfg(test)]
    pub fn left_out(&self) -> &[usize] {
        &self.left_out
    }

    /// Return a basis of the kernel: entries (unknown, value) of each vector, the largest value one. The basis is reduced: each vector is zero at all
    /// unknowns left out but its own. So pure motions are found as such.
    pub fn kernel_entries(&self) -> &[Vec<(usize, f64)>] {
        &self.kernel
    }

    /// Return the same basis as full vectors.
    pub fn kernel(&self) -> Vec<DVector<f64>> {
        let whole = |entries: &Vec<(usize, f64)>| {
            let mut vector = DVector::zeros(self.count);
            entries.iter().for_each(|&(u, value)| vector[u] = value);
            vector
        };
        self.kernel.iter().map(whole).collect()
    }

    /// Return the solution of A x = b that is zero at the unknowns left out. If b is not in the range of A, the equations of these unknowns are not
    /// satisfied.
    pub fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut x: Vec<f64> = b.iter().zip(&self.scale).map(|(b, scale)| b * scale).collect();
        for column in &self.columns {
            for &p in &column.order {
                let (entries, amount) = (column.column(p), -x[column.own.start + p]);
                super::axpy(amount, &entries[..column.own.len()], &mut x[column.own.clone()]);
                let mut row = column.own.len();
                for (_, range) in &column.below {
                    super::axpy(amount, &entries[row..row + range.len()], &mut x[range.clone()]);
                    row += range.len();
                }
            }
        }
        for column in self.columns.iter().rev() {
            for (p, u) in column.own.clone().enumerate() {
                x[u] = if column.pivot[p] > 0.0 { x[u] / column.pivot[p] } else { 0.0 };
            }
            column.back(&mut x);
        }
        DVector::from_iterator(self.count, x.iter().zip(&self.scale).map(|(x, scale)| x * scale))
    }
}

impl Blocks {
    /// Factor the matrix and find its kernel: see [`Factor`].
    pub fn factor(&self) -> Factor {
        Factor::new(self, unit_diagonal(self), TOLERANCE)
    }

    /// Return a basis of the combinations e of a few motions with e'Ae <= `tolerance * full * e'e`. `full` is the entry of a motion that is fully
    /// constrained; small entries have no such scale of their own. Pure motions are found as such, with the largest part one.
    pub fn free(gram: &DMatrix<f64>, full: f64, tolerance: f64) -> Vec<DVector<f64>> {
        let scale = vec![full.sqrt().recip(); gram.nrows()];
        Factor::new(&Self::single(gram), scale, tolerance).kernel()
    }
}

/// Work arrays of the factorisation.
struct Work {
    /// A vector over all unknowns, zero between uses.
    x: Vec<f64>,
    /// First row of each column's unknowns in the panel of the present column.
    row: Vec<usize>,
    runs: Vec<Run>,
}

/// Consecutive rows of one panel that are consecutive in another: the first row in each, and how many they are.
struct Run {
    from: usize,
    to: usize,
    length: usize,
}

/// Return 1/root of each diagonal entry, zero where the entry is rounding.
fn unit_diagonal(matrix: &Blocks) -> Vec<f64> {
    let of = |i: usize| {
        let diagonal = matrix.diagonal(i).diagonal();
        let least = TOLERANCE * TOLERANCE * diagonal.iter().copied().fold(0.0, f64::max);
        let scale = |value: &f64| if *value > least { value.sqrt().recip() } else { 0.0 };
        diagonal.iter().map(scale).collect::<Vec<f64>>()
    };
    (0..matrix.rows()).flat_map(of).collect()
}

/// Return the columns of the factor in the order of their elimination, without values.
fn structure(matrix: &Blocks) -> Vec<Column> {
    let bodies: Vec<usize> = (0..matrix.rows()).filter(|&i| !matrix.range(i).is_empty()).collect();
    let mut vertex = vec![0; matrix.rows()];
    bodies.iter().enumerate().for_each(|(v, &i)| vertex[i] = v);
    let mut graph = vec![Vec::new(); bodies.len()];
    for (i, j, _) in matrix.stored().filter(|(i, j, _)| i != j) {
        graph[vertex[i]].push(vertex[j]);
        graph[vertex[j]].push(vertex[i]);
    }
    graph.iter_mut().for_each(|near| near.sort_unstable());
    let order = degree::order_again(graph);
    let mut step = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, (v, _))| step[*v] = k);
    let column = |(v, near): &(usize, Vec<usize>)| {
        let mut below: Vec<_> = near.iter().map(|&w| (step[w], matrix.range(bodies[w]))).collect();
        below.sort_unstable_by_key(|entry| entry.0);
        let own = matrix.range(bodies[*v]);
        let height = own.len() + below.iter().map(|(_, range)| range.len()).sum::<usize>();
        let pivot = vec![0.0; own.len()];
        Column { own, below, height, panel: Vec::new(), pivot, order: Vec::new() }
    };
    order.iter().map(column).collect()
}

/// Return the column of each row of blocks; for rows without unknowns the value has no meaning.
fn steps(matrix: &Blocks, columns: &[Column]) -> Vec<usize> {
    let mut of_first = vec![0; matrix.unknowns()];
    columns.iter().enumerate().for_each(|(k, column)| of_first[column.own.start] = k);
    (0..matrix.rows()).map(|i| of_first.get(matrix.range(i).start).copied().unwrap_or(0)).collect()
}
