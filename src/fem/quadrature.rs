//! Quadrature on reference simplices, in barycentric coordinates.

/// A quadrature rule on a simplex: barycentric points and weights that sum to one (multiply by length, area or volume).
#[derive(Debug, Clone, Default)]
pub struct Rule {
    /// Barycentric coordinates of each point, one a vertex.
    pub points: Vec<Vec<f64>>,
    /// Weight of each point.
    pub weights: Vec<f64>,
}

impl Rule {
    fn add(&mut self, point: &[f64], weight: f64) {
        self.points.push(point.to_vec());
        self.weights.push(weight);
    }

    /// Return the points and their weights.
    pub fn iter(&self) -> impl Iterator<Item = (&[f64], f64)> {
        self.points.iter().map(Vec::as_slice).zip(self.weights.iter().copied())
    }

    /// Return the same rule on each of the equal parts, half as wide, into which a simplex of two to four vertices is divided.
    pub fn on_parts(&self) -> Self {
        let n = self.points[0].len();
        let middle = |&(i, j): &(usize, usize)| -> Vec<f64> {
            (0..n).map(|k| 0.5 * (f64::from(u8::from(k == i)) + f64::from(u8::from(k == j)))).collect()
        };
        // There is a part at each vertex. In a triangle one more remains, and in a tetrahedron an octahedron, which is divided into
        // four parts around a diagonal.
        let mut parts: Vec<Vec<(usize, usize)>> = (0..n).map(|i| (0..n).map(|j| (i, j)).collect()).collect();
        match n {
            3 => parts.push(vec![(0, 1), (1, 2), (2, 0)]),
            4 => {
                let rings = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 1)];
                parts.extend(rings.windows(2).map(|ring| vec![(0, 2), (1, 3), ring[0], ring[1]]));
            }
            _ => {}
        }
        let share = 1.0 / parts.len() as f64;
        let mut rule = Self::default();
        for part in parts {
            let part: Vec<Vec<f64>> = part.iter().map(middle).collect();
            for (l, weight) in self.iter() {
                let point = |k: usize| (0..n).map(|vertex| l[vertex] * part[vertex][k]).sum();
                rule.add(&(0..n).map(point).collect::<Vec<f64>>(), share * weight);
            }
        }
        rule
    }
}

/// The fineness of the integration of loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    /// One rule on each element.
    Whole,
    /// The same rule on each part of an element. The difference of both results is nearly the whole error of the first.
    Halves,
}

/// Return Gauss-Legendre points and weights on \[0, 1\], exact to degree `2 count - 1`, for a `count` from 1 to 5.
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

/// Return the rule on the simplex with so many vertices that is exact for polynomials of `degree`, at most 9 on lines and 5 on
/// triangles and tetrahedra. The callers need no more, since elements have an order of at most two.
///
/// # Panics
/// If the number of vertices is not from 1 to 4.
pub fn simplex(vertices: usize, degree: usize) -> Rule {
    let mut rule = Rule::default();
    let mut add = |point: &[f64], weight: f64| rule.add(point, weight);
    match vertices {
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
            // These are Radon's seven points of degree 5.
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
            // These are Walkington's fourteen points of degree 5.
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
    fn check(vertices: usize, degree: usize) {
        check_rule(vertices, degree, &simplex(vertices, degree));
        check_rule(vertices, degree, &simplex(vertices, degree).on_parts());
    }

    fn check_rule(n: usize, degree: usize, rule: &Rule) {
        let mut powers = vec![0usize; n];
        loop {
            if powers.iter().sum::<usize>() <= degree {
                let exact = factorial(n - 1) * powers.iter().map(|&a| factorial(a)).product::<f64>()
                    / factorial(n - 1 + powers.iter().sum::<usize>());
                let sum: f64 =
                    rule.iter().map(|(x, w)| w * (0..n).map(|i| x[i].powi(powers[i] as i32)).product::<f64>()).sum();
                assert!((sum - exact).abs() < 1e-14, "{n} {degree} {powers:?}: {sum} {exact}");
            }
            let Some(i) = (0..n).find(|&i| powers[i] < degree) else { break };
            powers[..i].fill(0);
            powers[i] += 1;
        }
    }

    #[test]
    fn rules_are_exact_to_their_degree() {
        for degree in [1, 2, 3, 4, 5] {
            (2..=4).for_each(|vertices| check(vertices, degree));
        }
        check(2, 9);
    }

    /// On parts half as wide, the error of a rule of degree 2 or 3 for a polynomial of degree 4 is a sixteenth.
    #[test]
    fn parts_cover_the_simplex() {
        let error = |rule: Rule| -> f64 {
            let n = rule.points[0].len();
            let exact = 24.0 * factorial(n - 1) / factorial(n + 3);
            let sum: f64 = rule.iter().map(|(x, w)| w * x[0].powi(4)).sum();
            sum - exact
        };
        let ratio = error(simplex(2, 2)) / error(simplex(2, 2).on_parts());
        assert!((ratio - 16.0).abs() < 1e-9, "{ratio}");
        for vertices in [3, 4] {
            let (whole, parts) = (error(simplex(vertices, 2)), error(simplex(vertices, 2).on_parts()));
            assert!(parts.abs() < 0.25 * whole.abs(), "{whole} {parts}");
        }
    }
}
