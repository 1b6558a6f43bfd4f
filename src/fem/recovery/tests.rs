//! Recovery on meshes of blocks.

use super::*;
use crate::fem::assemble::interpolate;
use crate::fem::sample::block;

/// Return a polynomial displacement of this degree.
fn field<const D: usize>(degree: i32, x: &[f64; D]) -> [f64; D] {
    let s: f64 = (0..D).map(|i| (1.0 + 0.3 * i as f64) * x[i]).sum();
    std::array::from_fn(|c| (1.0 + c as f64) * s.powi(degree) + x[c] * x[(c + 1) % D].powi(degree - 1))
}

/// Check that a displacement of one degree more than the elements is recovered exactly, at the boundary too. Then the error of
/// its interpolant is exact.
fn next_degree_is_exact<const D: usize, const N: usize>(order: Order) {
    let degree = if order == Order::P1 { 2 } else { 3 };
    let space = block::<D>(3, order);
    let u: Vec<f64> = space.nodes.iter().flat_map(|x| field::<D>(degree, x)).collect();
    let recovery = Recovery::new(&space, &u);
    let l: [f64; N] = std::array::from_fn(|k| (k + 1) as f64 / (N * (N + 1) / 2) as f64);
    let mut largest = 0.0f64;
    for index in 0..space.cell_count() {
        let x = space.cell_nodes(index);
        let phi = element::values(order, &l);
        let at = interpolate(&x, &phi);
        let cell = recovery.cell(index);
        let bubble = recovery.missed(cell, &l);
        for c in 0..D {
            let interpolated: f64 = cell.iter().zip(phi).map(|(&n, phi)| phi * u[D * n as usize + c]).sum();
            let error = field::<D>(degree, &at)[c] - interpolated;
            largest = largest.max(error.abs());
            assert!((bubble[c] - error).abs() < 1e-10, "{D} {order:?} cell {index}: {} {error}", bubble[c]);
        }
    }
    assert!(largest > 1e-4);
}

#[test]
fn a_polynomial_of_the_next_degree_is_recovered() {
    next_degree_is_exact::<2, 3>(Order::P1);
    next_degree_is_exact::<3, 4>(Order::P1);
    next_degree_is_exact::<2, 3>(Order::P2);
    next_degree_is_exact::<3, 4>(Order::P2);
}

/// Return a wave of wavenumber k that decays from the face z = 1, with k h = 0.8.
fn wave(x: &[f64; 3]) -> [f64; 3] {
    let k = 0.8 * 6.0;
    let falling = (k * (x[2] - 1.0)).exp();
    [(k * x[0]).sin() * falling, 0.3 * (k * x[1]).cos() * falling, (k * x[0]).cos() * falling]
}

/// Return the share of the error of the interpolant of a wave that is recovered in the cells at its face. It is the least-squares
/// factor from the exact error to the recovered one.
fn seen_of_wave(order: Order) -> f64 {
    let space = block::<3>(6, order);
    let u: Vec<f64> = space.nodes.iter().flat_map(wave).collect();
    let recovery = Recovery::new(&space, &u);
    let (mut product, mut square) = (0.0, 0.0);
    for index in 0..space.cell_count() {
        let (x, cell) = (space.cell_nodes(index), recovery.cell(index));
        if x[..4].iter().all(|x| x[2] < 0.99) {
            continue;
        }
        for (l, weight) in quadrature::simplex(4, 5).iter() {
            let phi = element::values(order, l);
            let (exact, seen) = (wave(&interpolate(&x, &phi)), recovery.missed(cell, l));
            for c in 0..3 {
                let interpolated: f64 = cell.iter().zip(phi).map(|(&n, phi)| phi * u[3 * n as usize + c]).sum();
                product += weight * seen[c] * (exact[c] - interpolated);
                square += weight * (exact[c] - interpolated).powi(2);
            }
        }
    }
    product / square
}

#[test]
fn a_wave_is_seen_at_the_boundary() {
    for order in [Order::P1, Order::P2] {
        let seen = seen_of_wave(order);
        assert!((0.75..1.25).contains(&seen), "{order:?}: {seen}");
    }
}

/// In curved cells, the gradient of the interpolation error is consistent with its values.
#[test]
fn the_gradient_is_that_of_the_values_in_curved_cells() {
    let mut space = block::<3>(3, Order::P2);
    space.nodes.iter_mut().for_each(|x| x[2] += 0.3 * x[0] * x[0] - 0.2 * x[0] * x[1]);
    let u: Vec<f64> = space.nodes.iter().flat_map(wave).collect();
    let recovery = Recovery::new(&space, &u);
    let (l, step) = ([0.1, 0.2, 0.3, 0.4], 1e-5);
    for index in 0..space.cell_count() {
        let (x, cell) = (space.cell_nodes(index), recovery.cell(index));
        let (at, _) = blend::At::new(Order::P2, cell, &x, &l).expect("a cell");
        let slope = recovery.missed_slope(&at);
        let moved = |sign: f64| [l[0] - sign * step, l[1] + sign * step, l[2], l[3]];
        let ends = [1.0, -1.0].map(|sign| (interpolate(&x, &element::values(Order::P2, &moved(sign))), moved(sign)));
        let values = ends.map(|(_, l)| recovery.missed(cell, &l));
        for c in 0..3 {
            let along: f64 = (0..3).map(|j| slope.h[c][j] * (ends[0].0[j] - ends[1].0[j])).sum();
            let apart = values[0][c] - values[1][c];
            assert!((apart - along).abs() < 1e-9 + 1e-5 * apart.abs(), "cell {index}: {apart} {along}");
        }
    }
}

/// The load of a body that is softer by a quarter does a quarter of the energy as work, and none on a rigid motion.
#[test]
fn softening_does_the_work_that_stiffness_lacks() {
    for order in [Order::P1, Order::P2] {
        let space = block::<3>(3, order);
        let u: Vec<f64> = space.nodes.iter().flat_map(|x| field::<3>(2, x)).collect();
        let recovery = Recovery::new(&space, &u);
        let law = |_, _, strain: &[f64; 6]| strain.map(|e| 2.0 * e);
        let rule = quadrature::simplex(4, 2);
        let energy = |index: usize| -> f64 {
            let (x, cell) = (space.cell_nodes(index), recovery.cell(index));
            let of_point = |(l, weight): (&[f64], f64)| {
                let (at, measure) = blend::At::new(order, cell, &x, l).expect("a cell");
                let strain = recovery.discrete_slope(&at).strain();
                2.0 * weight * measure * crate::linalg::dot(&strain, &strain)
            };
            rule.iter().map(|(l, weight)| of_point((l, weight))).sum()
        };
        let energies: Vec<f64> = (0..space.cell_count()).map(energy).collect();
        let errors: Vec<f64> = energies.iter().map(|energy| energy / 3.0).collect();
        let load = recovery.softening(&law, &errors);
        let (work, quarter) = (crate::linalg::dot(&load, &u), 0.25 * energies.iter().sum::<f64>());
        assert!((work / quarter - 1.0).abs() < 1e-10, "{order:?}: {work} {quarter}");
        let turned: f64 = space.nodes.iter().zip(load.chunks(3)).map(|(x, f)| x[0] * f[1] - x[1] * f[0]).sum();
        assert!(turned.abs() < 1e-10 * quarter, "{order:?}: {turned}");
    }
}
