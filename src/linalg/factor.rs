//! Symmetric positive semidefinite matrices of small dense blocks, one row of blocks per body, and their factor, which
//! gives a solution of A x = b and a basis of the kernel.

use nalgebra::{DMatrix, DVector};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::rc::Rc;

/// Relative stiffness below which a motion counts as free: the one tolerance that decides which motions are
/// unconstrained.
///
/// Let A be the springs in terms of motions whose largest displacement is about one, scaled to ones on its diagonal. A
/// motion e is free if e'Ae <= TOLERANCE e'e. Here e'e is what the springs would store if every unknown of e moved
/// alone; compared with it, they store nothing. Both sides are quadratic: a free motion closes less than 3e-7 of what
/// its parts close.
///
/// - Why the tolerance is not less. An entry of A is a sum of products, each rounded by eps = 1.1e-16 of itself. The
///   elimination of k unknowns changes it by at most (k + 1) eps again (Higham, Accuracy and Stability of Numerical
///   Algorithms, theorem 10.3), where k counts the unknowns of the bodies around, some hundreds at most. So e'Ae/e'e of
///   a true kernel is rounded to 1e-14 at worst. Measured are 1e-16 on a wall of 64 x 64 blocks and 8e-17 on 1000
///   blocks in space. Coordinates in mesh files have 16 digits or, on curved surfaces, some ten. Closings have that
///   error, and A its square.
/// - Why it is not more. Everything above is real. A chain of n bodies that is held at one end has e'Ae/e'e = 1/n^2,
///   springs of 1 beside those of 1e8 have 1e-8, and both may occur together.
/// - Why it refers to e'e, not to the pivot alone. A pivot is e'Ae for the e that is one at its own unknown. If that is
///   the rotation of a single block, all others move by their distance, and their rounding errors grow with it: the
///   pivot is 2.5e-9 on that wall, and e'e is 2.4e7.
pub const TOLERANCE: f64 = 1e-13;

/// Share of the largest part of a free motion below which a part is rounding. A motion is known to the root of
/// [`TOLERANCE`], 3e-7, and less accurately where springs differ much. Other quantities that are rounded more than once
/// count as zero below this share, too.
pub const PART: f64 = 1e-6;

/// The factorisation LDL' of a symmetric positive semidefinite matrix. Unknowns are scaled to ones on the diagonal.
/// Bodies are in an order of minimum degree, and the unknowns of a body are eliminated by their pivots, largest first.
///
/// A pivot d belongs to a vector e that is one at its unknown and zero at the unknowns that are not eliminated yet; its
/// other entries make e'Ae = d least. If e'Ae <= tolerance e'e, then e is in the kernel, and the unknown is left out:
/// the matrix of the others is regular. An unknown is also left out if its diagonal entry is below tolerance^2 of the
/// largest in its block, the square of a rounded number.
#[derive(Debug, Clone)]
pub struct Factor {
    /// Number of unknowns.
    count: usize,
    /// 1/root of the diagonal; zero for unknowns that nothing resists.
    scale: Vec<f64>,
    /// Columns of L, in the order of elimination.
    columns: Vec<BlockColumn>,
    /// Kernel vectors as entries (unknown, value), largest value one.
    kernel: Vec<Vec<(usize, f64)>>,
    /// The unknown that was left out for each kernel vector.
    left_out: Vec<usize>,
}

/// The columns of L of one body.
#[derive(Debug, Clone)]
struct BlockColumn {
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

impl BlockColumn {
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
        let mut work = WorkArrays { x: vec![0.0; factor.count], row: vec![0; factor.columns.len()], runs: Vec::new() };
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
    fn assemble(&mut self, k: usize, entries: &[(usize, DMatrix<f64>)], work: &mut WorkArrays) {
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

    /// Subtract from column k the change by the elimination of column j < k, in which k is at `position` of the columns
    /// below.
    fn update(&mut self, k: usize, j: usize, position: usize, work: &mut WorkArrays) {
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
                _ => work.runs.push(RowBlock { from, to, length: range.len() }),
            }
            from += range.len();
        }
        for p in 0..target.own.len() {
            let amount = |q: usize| source.pivot[q] * source.column(q)[top + p];
            let panel = &mut target.panel[p * target.height..(p + 1) * target.height];
            // three unknowns at once, as bodies have three or six: each row is then read and written less often
            for some in source.order.chunks(3) {
                for &RowBlock { from, to, length } in &work.runs {
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
    fn eliminate(&mut self, k: usize, earlier: &[Vec<(usize, usize)>], tolerance: f64, work: &mut WorkArrays) {
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
            // a pivot of the kernel is about eps e'e, and e'e of a rotation is about the square of the number of
            // bodies: below this bound for up to 5e4 bodies
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

    /// Return the vector e of a pivot of the scaled matrix: one at unknown p of column k, zero at the unknowns that are
    /// not eliminated yet, and with the least e'Ae. Its entries are (unknown, value).
    fn candidate(
        &self,
        k: usize,
        p: usize,
        earlier: &[Vec<(usize, usize)>],
        work: &mut WorkArrays,
    ) -> Vec<(usize, f64)> {
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

    /// Return a basis of the kernel, with the largest entry one. The basis is reduced: each vector is zero at all
    /// unknowns left out but its own. So pure motions are found as such.
    pub fn kernel(&self) -> Vec<DVector<f64>> {
        let whole = |entries: &Vec<(usize, f64)>| {
            let mut vector = DVector::zeros(self.count);
            entries.iter().for_each(|&(u, value)| vector[u] = value);
            vector
        };
        self.kernel.iter().map(whole).collect()
    }

    /// Return the solution of A x = b that is zero at the unknowns left out. If b is not in the range of A, the
    /// equations of these unknowns are not satisfied.
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
    /// Factor the matrix and find its kernel: see [`Factor`]. The factor is kept for the next call with the same matrix:
    /// a step of Newton's method asks for the motions that its springs leave free, its coarse space for the factor of
    /// the same springs, and the look at its equilibrium for the motions again.
    pub fn factor(&self) -> Rc<Factor> {
        let new = || Rc::new(Factor::new(self, unit_diagonal(self), TOLERANCE));
        // a single body does not replace the matrix that is kept
        if self.rows() < 2 {
            return new();
        }
        LAST_FACTOR.with_borrow_mut(|last| match last {
            Some((matrix, factor)) if matrix == self => Rc::clone(factor),
            _ => Rc::clone(&last.insert((self.clone(), new())).1),
        })
    }

    /// Factor the matrix without scaling. The kernel has the combinations e of all unknowns with e'Ae <= `tolerance *
    /// e'e`. If the matrix is indefinite, they are as many as make the matrix of the unknowns that are not left out
    /// definite.
    pub fn factor_unscaled(&self, tolerance: f64) -> Factor {
        Factor::new(self, vec![1.0; self.unknowns()], tolerance)
    }

    /// Return a basis of the combinations e of a few motions with e'Ae <= `tolerance * full * e'e`. `full` is the entry
    /// of a motion that is fully constrained; small entries have no such scale of their own. Pure motions are found as
    /// such, with the largest part one.
    pub fn free(gram: &DMatrix<f64>, full: f64, tolerance: f64) -> Vec<DVector<f64>> {
        let scale = vec![full.sqrt().recip(); gram.nrows()];
        Factor::new(&Self::single(gram), scale, tolerance).kernel()
    }
}

/// Work arrays of the factorisation.
struct WorkArrays {
    /// A vector over all unknowns, zero between uses.
    x: Vec<f64>,
    /// First row of each column's unknowns in the panel of the present column.
    row: Vec<usize>,
    runs: Vec<RowBlock>,
}

/// Consecutive rows of one panel that are consecutive in another: the first row in each, and how many they are.
struct RowBlock {
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
fn structure(matrix: &Blocks) -> Vec<BlockColumn> {
    let bodies: Vec<usize> = (0..matrix.rows()).filter(|&i| !matrix.range(i).is_empty()).collect();
    let mut vertex = vec![0; matrix.rows()];
    bodies.iter().enumerate().for_each(|(v, &i)| vertex[i] = v);
    let mut graph = vec![Vec::new(); bodies.len()];
    for (i, j, _) in matrix.stored().filter(|(i, j, _)| i != j) {
        graph[vertex[i]].push(vertex[j]);
        graph[vertex[j]].push(vertex[i]);
    }
    graph.iter_mut().for_each(|near| near.sort_unstable());
    let order = order_again(graph);
    let mut step = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, (v, _))| step[*v] = k);
    let column = |(v, near): &(usize, Vec<usize>)| {
        let mut below: Vec<_> = near.iter().map(|&w| (step[w], matrix.range(bodies[w]))).collect();
        below.sort_unstable_by_key(|entry| entry.0);
        let own = matrix.range(bodies[*v]);
        let height = own.len() + below.iter().map(|(_, range)| range.len()).sum::<usize>();
        let pivot = vec![0.0; own.len()];
        BlockColumn { own, below, height, panel: Vec::new(), pivot, order: Vec::new() }
    };
    order.iter().map(column).collect()
}

/// Return the column of each row of blocks; for rows without unknowns the value has no meaning.
fn steps(matrix: &Blocks, columns: &[BlockColumn]) -> Vec<usize> {
    let mut of_first = vec![0; matrix.unknowns()];
    columns.iter().enumerate().for_each(|(k, column)| of_first[column.own.start] = k);
    (0..matrix.rows()).map(|i| of_first.get(matrix.range(i).start).copied().unwrap_or(0)).collect()
}

/// A symmetric matrix of dense blocks; only non-zero blocks are stored.
#[derive(Debug, Clone, PartialEq)]
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

    /// Return x'Ax.
    pub fn energy(&self, x: &DVector<f64>) -> f64 {
        self.multiply(x).dot(x)
    }
}

/// The vertices in the order of their elimination, each with its neighbours at that time.
pub type EliminationOrder = Rc<Vec<(usize, Vec<usize>)>>;

thread_local! {
    /// The last graph with its order.
    static LAST: RefCell<(Vec<Vec<usize>>, EliminationOrder)> = RefCell::default();
    /// The last matrix with its factor.
    static LAST_FACTOR: RefCell<Option<(Blocks, Rc<Factor>)>> = const { RefCell::new(None) };
}

/// Return [`order`] of a graph; it is kept for the next call with the same graph. A run factors the springs between its
/// bodies some ten times, and the order takes a third as long as the factor.
pub fn order_again(graph: Vec<Vec<usize>>) -> EliminationOrder {
    // a single vertex does not replace the graph that is kept
    if graph.len() < 2 {
        return order(graph).into();
    }
    LAST.with_borrow_mut(|(last, known)| {
        if *last != graph {
            *known = order(graph.clone()).into();
            *last = graph;
        }
        Rc::clone(known)
    })
}

/// Return the vertices in the order of their elimination, each with its neighbours at that time.
///
/// `graph` has the neighbours of each vertex, sorted, without the vertex itself. Every step eliminates the first vertex
/// of least degree, and connects its neighbours to each other (George, Liu: The evolution of the minimum degree
/// ordering algorithm, 1989). The graph is explicit, because it is small: one vertex per body.
pub fn order(mut graph: Vec<Vec<usize>>) -> Vec<(usize, Vec<usize>)> {
    let mut queue: BTreeSet<(usize, usize)> = graph.iter().enumerate().map(|(v, near)| (near.len(), v)).collect();
    let mut order = Vec::with_capacity(graph.len());
    while let Some((_, vertex)) = queue.pop_first() {
        let near = std::mem::take(&mut graph[vertex]);
        for &other in &near {
            let before = graph[other].len();
            let joined = union(&graph[other], &near, [vertex, other]);
            if joined.len() != before {
                queue.remove(&(before, other));
                queue.insert((joined.len(), other));
            }
            graph[other] = joined;
        }
        order.push((vertex, near));
    }
    order
}

/// Return the sorted union of two sorted lists without the members `without`.
fn union(a: &[usize], b: &[usize], without: [usize; 2]) -> Vec<usize> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut k) = (0, 0);
    while i < a.len() || k < b.len() {
        let next = a.get(i).copied().unwrap_or(usize::MAX).min(b.get(k).copied().unwrap_or(usize::MAX));
        i += usize::from(a.get(i) == Some(&next));
        k += usize::from(b.get(k) == Some(&next));
        if !without.contains(&next) {
            all.push(next);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, SymmetricEigen};

    /// Numbers in [-1, 1) that look random.
    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn dense(matrix: &Blocks) -> DMatrix<f64> {
        let n = matrix.unknowns();
        let column = |j: usize| matrix.multiply(&DVector::from_fn(n, |i, _| f64::from(u8::from(i == j))));
        DMatrix::from_columns(&(0..n).map(column).collect::<Vec<_>>())
    }

    /// Adds a spring of stiffness k that each unknown u of these bodies stretches by g(u).
    fn spring(matrix: &mut Blocks, k: f64, ends: &[(usize, Vec<f64>)]) {
        for (s, (i, g)) in ends.iter().enumerate() {
            for (j, h) in &ends[s..] {
                matrix.add(*i, *j, &(k * DVector::from_column_slice(g) * DVector::from_column_slice(h).transpose()));
            }
        }
    }

    /// Checks the rank, every kernel vector, that they are a reduced basis, and solutions.
    fn check(matrix: &Blocks, nullity: usize, tolerance: f64) -> Rc<Factor> {
        let factor = matrix.factor();
        let kernel = factor.kernel();
        assert_eq!((kernel.len(), factor.rank()), (nullity, matrix.unknowns() - nullity));
        let sizes = (0..matrix.rows()).flat_map(|i| matrix.diagonal(i).diagonal().data.as_vec().clone());
        let size = DVector::from_vec(sizes.collect());
        for (k, vector) in kernel.iter().enumerate() {
            assert_eq!(vector.amax(), 1.0);
            let stored = vector.dot(&matrix.multiply(vector));
            let most = size.dot(&vector.component_mul(vector)) + TOLERANCE * size.amax();
            assert!(stored <= TOLERANCE * most, "{stored} of {most}");
            for (l, &u) in factor.left_out().iter().enumerate() {
                assert_eq!(vector[u] != 0.0, k == l);
            }
        }
        let mut next = random(7);
        let b = matrix.multiply(&DVector::from_fn(matrix.unknowns(), |_, _| next()));
        let error = (matrix.multiply(&factor.solve(&b)) - &b).amax();
        assert!(error <= tolerance * b.amax().max(1e-300), "{error} of {}", b.amax());
        factor
    }

    #[test]
    fn a_matrix_is_factored_once() {
        let block = |value: f64| DMatrix::from_element(1, 1, value);
        let mut matrix = Blocks::new(&[1, 1]);
        [(0, 0, 2.0), (0, 1, -1.0), (1, 1, 2.0)].into_iter().for_each(|(i, j, value)| matrix.add(i, j, &block(value)));
        let first = matrix.factor();
        assert!(Rc::ptr_eq(&first, &matrix.clone().factor()));
        matrix.add(1, 1, &block(1.0));
        let other = matrix.factor();
        assert!(
            !Rc::ptr_eq(&first, &other)
                && (other.solve(&DVector::from_vec(vec![1.0, 2.0])) - DVector::from_vec(vec![1.0, 1.0])).amax() < 1e-15
        );
    }

    #[test]
    fn random_matrices_have_the_rank_of_their_eigenvalues() {
        for seed in 0..200 {
            let mut next = random(seed);
            let mut whole = |most: f64| (0.5 * (next() + 1.0) * most) as usize;
            let sizes: Vec<usize> = (0..3 + whole(8.0)).map(|_| whole(7.0)).collect();
            let springs = whole(1.2 * sizes.iter().sum::<usize>() as f64);
            let mut matrix = Blocks::new(&sizes);
            for _ in 0..springs {
                let [i, j] = [whole(sizes.len() as f64), whole(sizes.len() as f64)];
                // whole numbers make many combinations vanish
                let mut ends = vec![(i, (0..sizes[i]).map(|_| whole(5.0) as f64 - 2.0).collect())];
                if j != i {
                    ends.push((j, (0..sizes[j]).map(|_| whole(5.0) as f64 - 2.0).collect()));
                }
                spring(&mut matrix, 10f64.powi(whole(5.0) as i32), &ends);
            }
            let eigen = SymmetricEigen::new(dense(&matrix));
            let zero = 1e-12 * eigen.eigenvalues.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            check(&matrix, eigen.eigenvalues.iter().filter(|value| **value <= zero).count(), 1e-8);
        }
    }

    /// Chains of springs that differ by 1e8: one that floats, and one that the softest spring of all holds.
    #[test]
    fn chains_float_or_are_held() {
        for (count, held) in [(3, false), (3, true), (400, false), (400, true)] {
            let mut matrix = Blocks::new(&vec![1; count]);
            for i in 1..count {
                let k = if i % 7 < 3 { 1e8 } else { 1.0 };
                spring(&mut matrix, k, &[(i - 1, vec![1.0]), (i, vec![-1.0])]);
            }
            if held {
                spring(&mut matrix, 1.0, &[(count / 2, vec![1.0])]);
            }
            let factor = check(&matrix, usize::from(!held), 1e-10);
            // rounding of the stiff springs, as the soft ones feel it
            assert!(factor.kernel().iter().all(|vector| vector.iter().all(|u| (u - 1.0).abs() < 1e-5)));
        }
    }

    /// Two groups that float, a body that nothing touches, one without unknowns, one that is held by hardly anything.
    #[test]
    fn groups_float_each_alone() {
        let mut matrix = Blocks::new(&[2, 2, 0, 3, 1, 1, 2]);
        spring(&mut matrix, 5.0, &[(0, vec![1.0, 0.0]), (1, vec![-1.0, 0.0])]);
        spring(&mut matrix, 5.0, &[(0, vec![0.0, 1.0]), (1, vec![0.0, -1.0])]);
        spring(&mut matrix, 1e9, &[(4, vec![1.0]), (5, vec![-1.0])]);
        // slides along its plane but for a rounding error; and that much is held in earnest
        spring(&mut matrix, 1.0, &[(6, vec![1.0, 1e-16])]);
        let factor = check(&matrix, 2 + 3 + 1 + 1, 1e-12);
        let pure = factor.kernel.iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(pure.iter().filter(|count| **count == 1).count(), 4, "{pure:?}");
        assert_eq!(pure.iter().filter(|count| **count == 2).count(), 3, "{pure:?}");
        spring(&mut matrix, 1.0, &[(6, vec![0.0, 1e-12])]);
        check(&matrix, 2 + 3 + 1, 1e-12);
    }

    /// Springs between neighbours of a lattice at corners of the blocks, in the order (translations, rotations).
    fn lattice(counts: [usize; 3], held: f64) -> Blocks {
        let space = counts[2] > 1;
        let number = |at: [usize; 3]| (at[2] * counts[1] + at[1]) * counts[0] + at[0];
        let size = if space { 6 } else { 3 };
        let mut matrix = Blocks::new(&vec![size; counts.iter().product()]);
        let along = |direction: [f64; 3], arm: [f64; 3]| {
            let turn = |i: usize, j: usize| arm[i] * direction[j] - arm[j] * direction[i];
            let turns = [turn(1, 2), turn(2, 0), turn(0, 1)];
            if space {
                direction.into_iter().chain(turns).collect()
            } else {
                vec![direction[0], direction[1], turns[2]]
            }
        };
        for i in 0..counts.iter().product() {
            let at = [i % counts[0], i / counts[0] % counts[1], i / counts[0] / counts[1]];
            let steps = (0..27).map(|s| [s % 3, s / 3 % 3, s / 9].map(|step| step as i64 - 1));
            for step in steps.filter(|step| *step > [0, 0, 0]) {
                let other: [i64; 3] = std::array::from_fn(|c| at[c] as i64 + step[c]);
                let wall = !space && step[0] * step[1] < 0;
                if wall || (0..3).any(|c| other[c] < 0 || other[c] >= counts[c] as i64) {
                    continue;
                }
                let arm = step.map(|step| 0.5 * step as f64);
                for c in 0..if space { 3 } else { 2 } {
                    let direction: [f64; 3] = std::array::from_fn(|d| f64::from(u8::from(c == d)));
                    for corner in [-0.3, 0.4] {
                        let arm: [f64; 3] = std::array::from_fn(|d| arm[d] + if d == c { 0.0 } else { corner });
                        let mine = along(direction, arm);
                        let back: [f64; 3] = std::array::from_fn(|d| arm[d] - step[d] as f64);
                        let its = along(direction, back).into_iter().map(|g| -g).collect();
                        spring(&mut matrix, 1.0, &[(i, mine), (number(other.map(|x| x as usize)), its)]);
                    }
                }
            }
        }
        if held > 0.0 {
            (0..size).for_each(|c| {
                spring(&mut matrix, held, &[(0, (0..size).map(|d| f64::from(u8::from(c == d))).collect())])
            });
        }
        matrix
    }

    #[test]
    fn a_large_wall_floats_as_one_body() {
        let wall = lattice([64, 64, 1], 0.0);
        let factor = check(&wall, 3, 1e-9);
        // rows from the first entry on would have 7e6
        assert!(factor.entries() < 1_000_000, "{}", factor.entries());
        // held at one block by hardly anything
        check(&lattice([64, 64, 1], 1e-4), 0, 1e-6);
    }

    #[test]
    fn blocks_in_space_float_as_one_body() {
        let factor = lattice([8, 8, 8], 0.0).factor();
        assert_eq!(factor.kernel().len(), 6);
        assert!(factor.entries() < 1_200_000, "{}", factor.entries());
        check(&lattice([5, 4, 6], 0.0), 6, 1e-10);
    }

    #[test]
    fn an_order_is_that_of_its_graph() {
        let chain = |n: usize| -> Vec<Vec<usize>> {
            (0..n).map(|v| [v.checked_sub(1), (v + 1 < n).then_some(v + 1)].into_iter().flatten().collect()).collect()
        };
        for n in [4, 4, 1, 4, 7, 4] {
            assert_eq!(*order_again(chain(n)), order(chain(n)), "{n}");
        }
    }

    #[test]
    fn leaves_go_before_their_tree_and_a_ring_is_closed() {
        // a star with centre 0: no edge is added, and the centre is among the last two
        let star = vec![vec![1, 2, 3, 4], vec![0], vec![0], vec![0], vec![0]];
        let eliminated = order(star);
        assert!(eliminated.iter().all(|(_, near)| near.len() <= 1));
        assert!(eliminated[3..].iter().any(|(vertex, _)| *vertex == 0));
        // a ring of five: each has two neighbours until three are left
        let ring = (0..5).map(|v: usize| {
            let mut near = vec![(v + 1) % 5, (v + 4) % 5];
            near.sort_unstable();
            near
        });
        let degrees: Vec<usize> = order(ring.collect()).into_iter().map(|(_, near)| near.len()).collect();
        assert_eq!(degrees, [2, 2, 2, 1, 0]);
    }
}
