//! The factor of matrices of blocks against eigenvalues, chains, groups, a wall and blocks in space.

use super::{Blocks, Factor, TOLERANCE};
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
fn check(matrix: &Blocks, nullity: usize, tolerance: f64) -> Factor {
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
        if space { direction.into_iter().chain(turns).collect() } else { vec![direction[0], direction[1], turns[2]] }
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
        (0..size)
            .for_each(|c| spring(&mut matrix, held, &[(0, (0..size).map(|d| f64::from(u8::from(c == d))).collect())]));
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
