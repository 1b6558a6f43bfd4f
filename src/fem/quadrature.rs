//! Quadrature on reference simplices, in barycentric coordinates.

/// A quadrature rule on the simplex with `N` vertices: barycentric points and weights that sum to one
/// (multiply by length, area or volume).
#[derive(Debug, Clone)]
pub struct Rule<const N: usize> {
    /// Barycentric coordinates of each point.
    pub points: Vec<[f64; N]>,
    /// Weight of each point.
    pub weights: Vec<f64>,
}

impl<const N: usize> Rule<N> {
    /// The same rule on each of the equal parts, half as wide, of which a simplex of two to four vertices is made.
    pub fn on_parts(&self) -> Self {
        let middle = |i: usize, j: usize| -> [f64; N] {
            std::array::from_fn(|k| 0.5 * (f64::from(u8::from(k == i)) + f64::from(u8::from(k == j))))
        };
        // at each vertex one; in a triangle one more, in a tetrahedron four around a diagonal of the octahedron that is left
        let mut parts: Vec<[[f64; N]; N]> = (0..N).map(|i| std::array::from_fn(|j| middle(i, j))).collect();
        let mut add = |vertices: &[(usize, usize)]| {
            parts.push(std::array::from_fn(|k| vertices.get(k).map_or([0.0; N], |&(i, j)| middle(i, j))));
        };
        match N {
            3 => add(&[(0, 1), (1, 2), (2, 0)]),
            4 => [(0, 1), (1, 2), (2, 3), (3, 0), (0, 1)]
                .windows(2)
                .for_each(|ring| add(&[(0, 2), (1, 3), ring[0], ring[1]])),
            _ => {}
        }
        let share = 1.0 / parts.len() as f64;
        let mut rule = Self { points: Vec::new(), weights: Vec::new() };
        for part in parts {
            for (l, weight) in self.points.iter().zip(&self.weights) {
                rule.points.push(std::array::from_fn(|k| (0..N).map(|vertex| l[vertex] * part[vertex][k]).sum()));
                rule.weights.push(share * weight);
            }
        }
        rule
    }
}

/// How finely loads are integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    /// By one rule on each element.
    Whole,
    /// By that rule on each part of an element: what this differs is nearly the whole error of the other.
    Halves,
}

/// Gauss-Legendre points and weights on \[0, 1\], exact to degree `2 count - 1`; `count` from 1 to 5.
pub fn gauss(count: usize) -> Vec<(f64, f64)> {
    let half: &[(f64, f64)] = match count {
        1 => &[(0.0, 2.0)],
        2 => &[(0.577_350_269_189_625_8, 1.0)],
        3 => &[(0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)],
        4 => &[(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_85)],
        _ => &[
            (0.0, 128.0 / 225.0),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ],
    };
    let mut rule: Vec<_> = half
        .iter()
        .flat_map(|&(x, w)| if x == 0.0 { vec![(x, w)] } else { vec![(-x, w), (x, w)] })
        .map(|(x, w)| ((1.0 + x) / 2.0, w / 2.0))
        .collect();
    rule.sort_by(|a, b| a.0.total_cmp(&b.0));
    rule
}

/// Rule on the `N`-vertex simplex, exact for polynomials of `degree` up to 5 (lines: 9, triangles: 5,
/// tetrahedra: 5).
///
/// # Panics
/// For other `N` than 1 to 4; the degree is limited by the callers, which are elements of order two.
pub fn simplex<const N: usize>(degree: usize) -> Rule<N> {
    let mut rule = Rule { points: Vec::new(), weights: Vec::new() };
    let mut add = |bary: &[f64], weight: f64| {
        let mut point = [0.0; N];
        point.copy_from_slice(bary);
        rule.points.push(point);
        rule.weights.push(weight);
    };
    match N {
        1 => add(&[1.0], 1.0),
        2 => {
            for (x, w) in gauss(degree / 2 + 1) {
                add(&[1.0 - x, x], w);
            }
        }
        3 => triangle(degree, &mut add),
        4 => tetrahedron(degree, &mut add),
        _ => unreachable!("simplices have one to four vertices"),
    }
    rule
}

fn triangle(degree: usize, add: &mut impl FnMut(&[f64], f64)) {
    let mut orbit = |a: f64, w: f64| {
        let b = 1.0 - 2.0 * a;
        for point in [[b, a, a], [a, b, a], [a, a, b]] {
            add(&point, w);
        }
    };
    match degree {
        0 | 1 => add(&[1.0 / 3.0; 3], 1.0),
        2 => orbit(1.0 / 6.0, 1.0 / 3.0),
        _ => {
            // Radon's seven points, degree 5
            let root = 15f64.sqrt();
            orbit((6.0 - root) / 21.0, (155.0 - root) / 1200.0);
            orbit((6.0 + root) / 21.0, (155.0 + root) / 1200.0);
            add(&[1.0 / 3.0; 3], 9.0 / 40.0);
        }
    }
}

fn tetrahedron(degree: usize, add: &mut impl FnMut(&[f64], f64)) {
    let mut vertex_orbit = |a: f64, w: f64| {
        let b = 1.0 - 3.0 * a;
        for i in 0..4 {
            let mut point = [a; 4];
            point[i] = b;
            add(&point, w);
        }
    };
    match degree {
        0 | 1 => add(&[0.25; 4], 1.0),
        2 => vertex_orbit((1.0 - 5f64.sqrt().recip()) / 4.0, 0.25),
        _ => {
            // Walkington's fourteen points, degree 5
            vertex_orbit(0.310_885_919_263_300_6, 0.112_687_925_718_016);
            vertex_orbit(0.092_735_250_310_891_2, 0.073_493_043_116_361_95);
            let (a, w) = (0.045_503_704_125_649_65, 0.042_546_020_777_081_47);
            let b = 0.5 - a;
            for (i, j) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let mut point = [a; 4];
                point[i] = b;
                point[j] = b;
                add(&point, w);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// The mean of a monomial in barycentric coordinates over a simplex is n! prod(a_i!) / (n + sum a)!.
    fn check<const N: usize>(degree: usize) {
        check_rule(degree, &simplex::<N>(degree));
        check_rule(degree, &simplex::<N>(degree).on_parts());
    }

    fn check_rule<const N: usize>(degree: usize, rule: &Rule<N>) {
        let mut powers = [0usize; N];
        loop {
            if powers.iter().sum::<usize>() <= degree {
                let exact = factorial(N - 1) * powers.iter().map(|&a| factorial(a)).product::<f64>()
                    / factorial(N - 1 + powers.iter().sum::<usize>());
                let sum: f64 = rule
                    .points
                    .iter()
                    .zip(&rule.weights)
                    .map(|(x, w)| w * (0..N).map(|i| x[i].powi(powers[i] as i32)).product::<f64>())
                    .sum();
                assert!((sum - exact).abs() < 1e-14, "{N} {degree} {powers:?}: {sum} {exact}");
            }
            let Some(i) = (0..N).find(|&i| powers[i] < degree) else { break };
            powers[..i].fill(0);
            powers[i] += 1;
        }
    }

    #[test]
    fn rules_are_exact_to_their_degree() {
        for degree in [1, 2, 3, 4, 5] {
            check::<2>(degree);
            check::<3>(degree);
            check::<4>(degree);
        }
        check::<2>(9);
    }

    /// Of the degree 4 a rule for 2 or 3 on parts half as wide misses a sixteenth.
    #[test]
    fn parts_cover_the_simplex() {
        fn missed<const N: usize>(rule: &Rule<N>) -> f64 {
            let exact = 24.0 * factorial(N - 1) / factorial(N + 3);
            let sum: f64 = rule.points.iter().zip(&rule.weights).map(|(x, w)| w * x[0].powi(4)).sum();
            sum - exact
        }
        let ratio = missed(&simplex::<2>(2)) / missed(&simplex::<2>(2).on_parts());
        assert!((ratio - 16.0).abs() < 1e-9, "{ratio}");
        for (whole, parts) in [
            (missed(&simplex::<3>(2)), missed(&simplex::<3>(2).on_parts())),
            (missed(&simplex::<4>(2)), missed(&simplex::<4>(2).on_parts())),
        ] {
            assert!(parts.abs() < 0.25 * whole.abs(), "{whole} {parts}");
        }
    }
}
