//! Factor of a semidefinite matrix of blocks: some solution of A x = b, and a basis of the kernel.

use super::blocks::Blocks;
use super::degree;
use nalgebra::DVector;
use std::collections::BTreeSet;
use std::ops::Range;

/// Share of stiffness below which a motion counts as free: the one tolerance of the question which motions nothing holds.
///
/// Let A be springs in terms of motions whose largest displacement is about one, scaled to ones on its diagonal. A motion e is
/// free if e'Ae <= TOLERANCE e'e: against e'e, what the springs would store if every unknown of e moved alone, they store
/// nothing. Both sides are quadratic: what a free motion closes is below 3e-7 of what its parts close.
///
/// - Why no less: an entry of A is a sum of products, each rounded by eps = 1.1e-16 of itself, and the elimination of k unknowns
///   changes it by no more than (k + 1) eps again (Higham, Accuracy and Stability of Numerical Algorithms, theorem 10.3), k being
///   the unknowns of bodies around: some hundreds at most. So e'Ae/e'e of a true kernel is rounded to 1e-14 at worst; measured
///   are 1e-16 on a wall of 64 x 64 blocks and 8e-17 on 1000 blocks in space. Coordinates in files of meshes have 16 digits or,
///   on curved surfaces, some ten; closings have that error, and A its square.
/// - Why no more: everything above is real. A chain of n bodies that is held at one end has e'Ae/e'e = 1/n^2, springs of 1
///   beside those of 1e8 have 1e-8, and both may come together.
/// - Why e'e and not the pivot alone: a pivot is e'Ae for the e that is one at its own unknown. If that is the turn of a single
///   block, all others move by their distance, and so do their rounding errors: the pivot is 2.5e-9 on that wall, e'e 2.4e7.
pub const TOLERANCE: f64 = 1e-13;

/// LDL' of a symmetric positive semidefinite matrix, unknowns scaled to ones on the diagonal, bodies in an order of minimum
/// degree, unknowns of a body by their pivots, largest first.
///
/// A pivot d belongs to the vector e that is one at its unknown, zero at those not yet eliminated, and e'Ae = d is least. If
/// e'Ae <= tolerance e'e, then e is in the kernel and the unknown is left out: the matrix of the others is regular. So is an
/// unknown with a diagonal entry below tolerance^2 of the largest in its block, the square of a rounded number.
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
    /// Its unknowns.
    own: Range<usize>,
    /// Bodies eliminated later that it touches: number of their column, their unknowns.
    below: Vec<(usize, Range<usize>)>,
    /// All rows: own ones and those below.
    height: usize,
    /// L column by column of the own unknowns, `height` entries each; one on its diagonal is implied.
    panel: Vec<f64>,
    /// D; zero for unknowns left out.
    pivot: Vec<f64>,
    /// Own unknowns, counted from `own.start`, in the order of their pivots; without those left out.
    order: Vec<usize>,
}

impl Column {
    fn column(&self, p: usize) -> &[f64] {
        &self.panel[p * self.height..(p + 1) * self.height]
    }

    /// Sum of L's entries below the own rows, times x, in the column of an own unknown.
    fn along_below(&self, p: usize, x: &[f64]) -> f64 {
        let (mut sum, mut row) = (0.0, self.own.len());
        let column = self.column(p);
        for (_, range) in &self.below {
            sum += super::dot(&column[row..row + range.len()], &x[range.clone()]);
            row += range.len();
        }
        sum
    }

    /// x at the own unknowns that L'x = 0 asks for; x below is given, and added to on the own ones.
    fn back(&self, x: &mut [f64]) {
        for &p in self.order.iter().rev() {
            let own = super::dot(&self.column(p)[..self.own.len()], &x[self.own.clone()]);
            x[self.own.start + p] -= self.along_below(p, x) + own;
        }
    }
}

impl Factor {
    /// Factors a matrix.
    pub(super) fn new(matrix: &Blocks, tolerance: f64) -> Self {
        let mut factor = Self {
            count: matrix.unknowns(),
            scale: scale(matrix, tolerance),
            columns: structure(matrix),
            kernel: Vec::new(),
            left_out: Vec::new(),
        };
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
        let mut work = Work { x: vec![0.0; factor.count], row: vec![0; factor.columns.len()], sum: Vec::new() };
        for (k, entries) in entries.iter().enumerate() {
            factor.assemble(k, entries, &mut work);
            for &(j, position) in &earlier[k] {
                factor.update(k, j, position, &mut work);
            }
            factor.eliminate(k, &earlier, tolerance, &mut work);
        }
        factor
    }

    /// Writes the scaled matrix into column k, from its blocks (column, transpose of the block above).
    fn assemble(&mut self, k: usize, entries: &[(usize, nalgebra::DMatrix<f64>)], work: &mut Work) {
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

    /// Subtracts from column k what the elimination of column j < k changes, which touches k at `position`.
    fn update(&mut self, k: usize, j: usize, position: usize, work: &mut Work) {
        let (before, rest) = self.columns.split_at_mut(k);
        let (source, target) = (&before[j], &mut rest[0]);
        let touched = &source.below[position..];
        let count: usize = touched.iter().map(|(_, range)| range.len()).sum();
        let top = source.height - count;
        for p in 0..target.own.len() {
            work.sum.clear();
            work.sum.resize(count, 0.0);
            let amount = |q: usize| source.pivot[q] * source.column(q)[top + p];
            let of = |q: usize| &source.column(q)[top..];
            // three unknowns at once: bodies have three or six, and a sum is then read and written less often
            for three in source.order.chunks(3) {
                match *three {
                    [a, b, c] => {
                        let (x, y, z) = (amount(a), amount(b), amount(c));
                        let all = of(a).iter().zip(of(b)).zip(of(c));
                        work.sum.iter_mut().zip(all).for_each(|(sum, ((a, b), c))| *sum += x * a + y * b + z * c);
                    }
                    _ => three.iter().for_each(|&q| super::axpy(amount(q), of(q), &mut work.sum)),
                }
            }
            let start = p * target.height;
            let mut from = 0;
            for (column, range) in touched {
                let to = start + work.row[*column];
                super::axpy(-1.0, &work.sum[from..from + range.len()], &mut target.panel[to..to + range.len()]);
                from += range.len();
            }
        }
    }

    /// Eliminates the unknowns of column k.
    fn eliminate(&mut self, k: usize, earlier: &[Vec<(usize, usize)>], tolerance: f64, work: &mut Work) {
        let size = self.columns[k].own.len();
        let height = self.columns[k].height;
        let mut open: Vec<usize> = (0..size).collect();
        // of equal pivots the first: rotations come last, and are left out first
        while let Some(at) = (0..open.len()).rev().max_by(|&a, &b| {
            let pivot = |i: usize| self.columns[k].panel[open[i] * (height + 1)];
            pivot(a).total_cmp(&pivot(b))
        }) {
            let p = open.remove(at);
            let pivot = self.columns[k].panel[p * (height + 1)];
            // rounding is eps e'e, and e'e of a turn about the square of the number of bodies: up to 5e4 of them it is below
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

    /// Notes a kernel vector of the scaled matrix, and makes the row and column of its unknown zero.
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

    /// The vector of the scaled matrix that is one at own unknown p of column k, zero at what is not eliminated yet, and that
    /// earlier unknowns follow: its entries (unknown, value).
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

    /// Number of unknowns that are not left out.
    pub fn rank(&self) -> usize {
        self.count - self.left_out.len()
    }

    /// The unknowns left out, one for each kernel vector.
    pub fn left_out(&self) -> &[usize] {
        &self.left_out
    }

    /// A basis of the kernel: entries (unknown, value) of each vector, the largest one. It is reduced: of the unknowns left
    /// out, each vector has its own alone. So motions that are pure come out pure.
    pub fn kernel_entries(&self) -> &[Vec<(usize, f64)>] {
        &self.kernel
    }

    /// The same basis as whole vectors.
    pub fn kernel(&self) -> Vec<DVector<f64>> {
        let whole = |entries: &Vec<(usize, f64)>| {
            let mut vector = DVector::zeros(self.count);
            entries.iter().for_each(|&(u, value)| vector[u] = value);
            vector
        };
        self.kernel.iter().map(whole).collect()
    }

    /// A solution of A x = b that is zero at the unknowns left out, for b in the range of A; else the equations of these
    /// unknowns are not satisfied.
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

/// What the columns share while they are made.
struct Work {
    /// A vector over all unknowns, zero between uses.
    x: Vec<f64>,
    /// First row of each column's unknowns in the panel at hand.
    row: Vec<usize>,
    sum: Vec<f64>,
}

/// 1/root of each diagonal entry, zero where it is rounding.
fn scale(matrix: &Blocks, tolerance: f64) -> Vec<f64> {
    let of = |i: usize| {
        let diagonal = matrix.diagonal(i).diagonal();
        let least = tolerance * tolerance * diagonal.iter().copied().fold(0.0, f64::max);
        let scale = |value: &f64| if *value > least { value.sqrt().recip() } else { 0.0 };
        diagonal.iter().map(scale).collect::<Vec<f64>>()
    };
    (0..matrix.rows()).flat_map(of).collect()
}

/// The columns of the factor in the order of their elimination, without numbers.
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
    let order = degree::order(graph);
    let mut step = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, (v, _))| step[*v] = k);
    let column = |(v, near): (usize, Vec<usize>)| {
        let mut below: Vec<_> = near.into_iter().map(|w| (step[w], matrix.range(bodies[w]))).collect();
        below.sort_unstable_by_key(|entry| entry.0);
        let own = matrix.range(bodies[v]);
        let height = own.len() + below.iter().map(|(_, range)| range.len()).sum::<usize>();
        let pivot = vec![0.0; own.len()];
        Column { own, below, height, panel: Vec::new(), pivot, order: Vec::new() }
    };
    order.into_iter().map(column).collect()
}

/// The column of each row of blocks; any for those without unknowns.
fn steps(matrix: &Blocks, columns: &[Column]) -> Vec<usize> {
    let mut of_first = vec![0; matrix.unknowns()];
    columns.iter().enumerate().for_each(|(k, column)| of_first[column.own.start] = k);
    (0..matrix.rows()).map(|i| of_first.get(matrix.range(i).start).copied().unwrap_or(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, SymmetricEigen};

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
    fn check(matrix: &Blocks, nullity: usize, tolerance: f64) -> Factor {
        let factor = matrix.factor(TOLERANCE);
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
        let pure = factor.kernel_entries().iter().map(Vec::len).collect::<Vec<_>>();
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

    fn entries(factor: &Factor) -> usize {
        factor.columns.iter().map(|column| column.panel.len()).sum()
    }

    #[test]
    fn a_large_wall_floats_as_one_body() {
        let wall = lattice([64, 64, 1], 0.0);
        let factor = check(&wall, 3, 1e-9);
        // rows from the first entry on would have 7e6
        assert!(entries(&factor) < 1_000_000, "{}", entries(&factor));
        // held at one block by hardly anything
        check(&lattice([64, 64, 1], 1e-4), 0, 1e-6);
    }

    #[test]
    fn blocks_in_space_float_as_one_body() {
        let factor = lattice([8, 8, 8], 0.0).factor(TOLERANCE);
        assert_eq!(factor.kernel().len(), 6);
        assert!(entries(&factor) < 1_200_000, "{}", entries(&factor));
        check(&lattice([5, 4, 6], 0.0), 6, 1e-10);
    }
}
