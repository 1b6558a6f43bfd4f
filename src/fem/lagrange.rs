//! Lagrange functions of any order on lines and triangles, with Gauss-Lobatto nodes on lines and on the edges of
//! triangles.
//!
//! The functions are combinations of the orthogonal polynomials of Dubiner: with the Legendre polynomials P_n and the
//! Jacobi polynomials P_m^(a,0),
//!
//! ```text
//! psi_nm(l) = (l_0 + l_1)^n P_n((l_1 - l_0)/(l_1 + l_0)) P_m^(2n + 1, 0)(2 l_2 - 1),      n + m <= k
//! ```
//! On a line l_2 is zero and m = 0 alone remains. If V has the values of psi_j at node i, then phi = V^-T psi.

use crate::problem::order::Order;
use nalgebra::DMatrix;
use smallvec::SmallVec;
use std::f64::consts::PI;
use std::sync::OnceLock;

/// Edges of the simplex with four vertices in the order of the mid-edge nodes. A triangle uses 01 12 02 and a line 01.
pub const EDGES: [(usize, usize); 6] = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)];

/// Values of the shape functions of an element, one entry a node. Those of the elements in space fit without an
/// allocation.
pub type Values = SmallVec<[f64; 10]>;

/// Derivatives of the shape functions of an element by its barycentric coordinates, one entry a node.
pub type Slopes = SmallVec<[[f64; 4]; 10]>;

/// The functions of one order on a line or a triangle.
pub struct Lagrange {
    degree: usize,
    vertices: usize,
    /// Barycentric coordinates of the nodes: the vertices, those inside each edge of [`EDGES`] from its first to its
    /// second end, those inside.
    pub nodes: Vec<[f64; 3]>,
    /// Row i has the coefficients of phi_i in the orthogonal polynomials.
    coefficients: DMatrix<f64>,
    /// Products of the derivatives, once they were requested.
    products: OnceLock<Vec<[[f64; 2]; 2]>>,
}

/// A function of the barycentric coordinates l_1 and l_2 at a point: its value and its derivatives by them, where l_0 =
/// 1 - l_1 - l_2.
#[derive(Clone, Copy)]
struct Jet([f64; 3]);

impl Jet {
    fn times(self, other: Self) -> Self {
        let ([u, p, q], [v, r, s]) = (self.0, other.0);
        Self([u * v, p * v + u * r, q * v + u * s])
    }

    fn plus(self, factor: f64, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + factor * other.0[i]))
    }

    fn scaled(self, factor: f64) -> Self {
        Self(self.0.map(|value| factor * value))
    }
}

/// Return the functions of an order on the line (two vertices) or the triangle (three), which are computed once.
pub fn of(order: Order, vertices: usize) -> &'static Lagrange {
    static TABLES: [[OnceLock<Lagrange>; 2]; Order::HIGHEST] =
        [const { [const { OnceLock::new() }; 2] }; Order::HIGHEST];
    TABLES[order.degree() - 1][vertices - 2].get_or_init(|| Lagrange::new(order.degree(), vertices))
}

impl Lagrange {
    fn new(degree: usize, vertices: usize) -> Self {
        let nodes = nodes(degree, vertices);
        let mut vandermonde = DMatrix::zeros(nodes.len(), nodes.len());
        for (i, l) in nodes.iter().enumerate() {
            orthogonal(degree, vertices, l).iter().enumerate().for_each(|(j, psi)| vandermonde[(j, i)] = psi.0[0]);
        }
        let Some(coefficients) = vandermonde.try_inverse() else {
            unreachable!("distinct nodes of this form determine a polynomial")
        };
        Self { degree, vertices, nodes, coefficients, products: OnceLock::new() }
    }

    /// Return the values at barycentric point `l`.
    pub fn values(&self, l: &[f64]) -> Values {
        let psi = orthogonal(self.degree, self.vertices, l);
        let value = |i: usize| psi.iter().enumerate().map(|(j, psi)| self.coefficients[(i, j)] * psi.0[0]).sum();
        (0..psi.len()).map(value).collect()
    }

    /// Return, for each degree up to that of the functions, the mean square over the triangle of the part of a function
    /// in the orthogonal polynomials of this degree. `at` gives the value of the function at a node.
    ///
    /// The mean square of psi_nm is 1/((2n + 1)(n + m + 1)).
    pub fn by_degree(&self, at: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut squares = vec![0.0; self.degree + 1];
        let (mut n, mut m) = (0, 0);
        for j in 0..self.nodes.len() {
            let part: f64 = (0..self.nodes.len()).map(|i| at(i) * self.coefficients[(i, j)]).sum();
            squares[n + m] += part * part / ((2 * n + 1) * (n + m + 1)) as f64;
            (n, m) = if n + m < self.degree { (n, m + 1) } else { (n + 1, 0) };
        }
        squares
    }

    /// Return the values at the nodes of the part of a function in the orthogonal polynomials of the highest degree.
    /// `at` gives the value of the function at a node.
    pub fn highest_part(&self, at: impl Fn(usize) -> f64) -> Vec<f64> {
        // the functions psi_nm with n + m = k are the last ones of their n
        let highest: Vec<usize> = (0..=self.degree).map(|n| (n + 1) * (2 * self.degree + 2 - n) / 2 - 1).collect();
        let part = |j: &usize| (0..self.nodes.len()).map(|i| at(i) * self.coefficients[(i, *j)]).sum::<f64>();
        let parts: Vec<f64> = highest.iter().map(part).collect();
        let value = |l: &[f64; 3]| {
            let psi = orthogonal(self.degree, self.vertices, l);
            highest.iter().zip(&parts).map(|(&j, part)| part * psi[j].0[0]).sum()
        };
        self.nodes.iter().map(value).collect()
    }

    /// Return the coefficient of the highest power in each function of a line, up to a common factor.
    pub fn highest(&self) -> Vec<f64> {
        (0..self.nodes.len()).map(|i| self.coefficients[(i, self.degree)]).collect()
    }

    /// Return the derivatives by the barycentric coordinates at `l`, as differences from that by l_0.
    pub fn slopes(&self, l: &[f64]) -> Slopes {
        let psi = orthogonal(self.degree, self.vertices, l);
        let along = |i: usize, d: usize| -> f64 {
            psi.iter().enumerate().map(|(j, psi)| self.coefficients[(i, j)] * psi.0[d]).sum()
        };
        (0..psi.len()).map(|i| [0.0, along(i, 1), along(i, 2), 0.0]).collect()
    }

    /// Return, for each pair of nodes a and b of the triangle, the means over the triangle of the products of the
    /// derivatives of phi_a by l_(c+1) and of phi_b by l_(d+1), where c and d are zero and one.
    pub fn products(&self) -> &[[[f64; 2]; 2]] {
        self.products.get_or_init(|| {
            let count = self.nodes.len();
            let mut sums = vec![[[0.0; 2]; 2]; count * count];
            collapsed(2 * self.degree - 2, &mut |l: &[f64], weight| {
                let slopes = self.slopes(l);
                for (a, p) in slopes.iter().enumerate() {
                    for (b, q) in slopes.iter().enumerate() {
                        let sum = &mut sums[a * count + b];
                        (0..4).for_each(|k| sum[k / 2][k % 2] += weight * p[1 + k / 2] * q[1 + k % 2]);
                    }
                }
            });
            sums
        })
    }
}

/// Return the orthogonal polynomials at barycentric point `l`.
fn orthogonal(degree: usize, vertices: usize, l: &[f64]) -> Vec<Jet> {
    let top = if vertices == 3 { l[2] } else { 0.0 };
    let across = Jet([2.0 * l[1] + top - 1.0, 2.0, 1.0]);
    let level = Jet([1.0 - top, 0.0, -1.0]);
    let height = Jet([2.0 * top - 1.0, 0.0, 2.0]);
    let one = Jet([1.0, 0.0, 0.0]);
    let mut all = Vec::with_capacity(45);
    let (mut before, mut scaled) = (Jet([0.0; 3]), one);
    for n in 0..=degree {
        let of = n as f64;
        let a = 2.0 * of + 1.0;
        let (mut last, mut jacobi) = (Jet([0.0; 3]), one);
        for m in 0..=if vertices == 3 { degree - n } else { 0 } {
            all.push(scaled.times(jacobi));
            let m = m as f64;
            let (first, sum) = (2.0 * (m + 1.0) * (m + a + 1.0) * (2.0 * m + a), 2.0 * m + a + 1.0);
            let slope = height.scaled(sum * (sum + 1.0) * (sum - 1.0)).plus(sum * a * a, one);
            let next = slope.times(jacobi).plus(-2.0 * (m + a) * m * (sum + 1.0), last).scaled(first.recip());
            (last, jacobi) = (jacobi, next);
        }
        let next =
            across.times(scaled).scaled(a).plus(-of, level.times(level).times(before)).scaled((of + 1.0).recip());
        (before, scaled) = (scaled, next);
    }
    all
}

/// Return the nodes on a line or a triangle. Those inside a triangle are means of the nodes on lines, by the recursion
/// of Isaac (2020): they need no table, and their Lebesgue constant is near the least known (5.3 at order 8).
fn nodes(degree: usize, vertices: usize) -> Vec<[f64; 3]> {
    let mut nodes: Vec<[f64; 3]> =
        (0..vertices).map(|k| std::array::from_fn(|i| f64::from(u8::from(i == k)))).collect();
    let lobatto = gauss_lobatto(degree);
    for (i, j) in &EDGES[..vertices * (vertices - 1) / 2] {
        for k in 1..degree {
            let mut l = [0.0; 3];
            (l[*i], l[*j]) = (lobatto[degree - k], lobatto[k]);
            nodes.push(l);
        }
    }
    let inside = if vertices == 3 { 1..degree.max(2) - 1 } else { 1..1 };
    for k in inside {
        for j in 1..degree - k {
            let index = [degree - k - j, j, k];
            let (mut sum, mut whole) = ([0.0; 3], 0.0);
            for i in 0..3 {
                let (on_line, weight) = (gauss_lobatto(degree - index[i]), lobatto[degree - index[i]]);
                [(i + 1) % 3, (i + 2) % 3].into_iter().for_each(|other| sum[other] += weight * on_line[index[other]]);
                whole += weight;
            }
            nodes.push(sum.map(|sum| sum / whole));
        }
    }
    nodes
}

/// Return the values of the Legendre polynomial of a degree at x and of that of one degree less.
fn legendre(degree: usize, x: f64) -> [f64; 2] {
    let (mut before, mut value) = (0.0, 1.0);
    for n in 0..degree {
        let n = n as f64;
        (before, value) = (value, ((2.0 * n + 1.0) * x * value - n * before) / (n + 1.0));
    }
    [value, before]
}

/// Newton steps for a zero of a Legendre polynomial or its derivative. From the starts below six are enough for a
/// double up to degree 20.
const STEPS: usize = 8;

/// Return the Gauss-Lobatto points of a degree on \[0, 1\], which are the ends and the zeros of the derivative of the
/// Legendre polynomial.
fn gauss_lobatto(degree: usize) -> Vec<f64> {
    let n = degree as f64;
    let zero = |k: usize| {
        let mut x = -(PI * k as f64 / n).cos();
        for _ in 0..STEPS {
            // with P' (1 - x^2) = n (P_(n-1) - x P_n), and P'' from Legendre's equation
            let [value, before] = legendre(degree, x);
            let slope = n * (before - x * value) / (1.0 - x * x);
            x -= slope * (1.0 - x * x) / (2.0 * x * slope - n * (n + 1.0) * value);
        }
        x
    };
    let at = |k: usize| match k {
        0 => 0.0,
        _ if k == degree => 1.0,
        _ if 2 * k == degree => 0.5,
        _ if 2 * k > degree => 1.0 - 0.5 * (1.0 + zero(degree - k)),
        _ => 0.5 * (1.0 + zero(k)),
    };
    (0..=degree).map(at).collect()
}

/// Return Gauss-Legendre points and weights on \[0, 1\], exact to degree `2 count - 1`.
pub fn gauss(count: usize) -> Vec<(f64, f64)> {
    // numbers of up to five points are known to all digits
    let mut half: Vec<(f64, f64)> = match count {
        1 => vec![(0.0, 2.0)],
        2 => vec![(0.577_350_269_189_625_8, 1.0)],
        3 => vec![(0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)],
        4 => vec![
            (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        ],
        5 => vec![
            (0.0, 128.0 / 225.0),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ],
        _ => (0..count.div_ceil(2)).map(|k| zero_of_legendre(count, k)).collect(),
    };
    half.sort_by(|a, b| a.0.total_cmp(&b.0));
    let above = half.iter().map(|&(x, w)| ((1.0 + x) / 2.0, w / 2.0));
    let below = half.iter().rev().filter(|(x, _)| *x != 0.0).map(|&(x, w)| ((1.0 - x) / 2.0, w / 2.0));
    below.chain(above).collect()
}

/// Add the points and weights of a rule on the triangle, exact for polynomials of `degree`: Gauss points on the square
/// that collapses into vertex 2.
pub fn collapsed(degree: usize, add: &mut impl FnMut(&[f64], f64)) {
    let across = gauss(degree / 2 + 1);
    // the area shrinks towards the vertex, which is one more degree
    for (height, weight) in gauss(degree.div_ceil(2) + 1) {
        let rest = 1.0 - height;
        across.iter().for_each(|(x, w)| add(&[rest * (1.0 - x), rest * x, height], 2.0 * rest * weight * w));
    }
}

/// Return the zero `k` of a Legendre polynomial, counted from the largest one, and its weight in the rule of Gauss.
fn zero_of_legendre(count: usize, k: usize) -> (f64, f64) {
    let n = count as f64;
    let mut x = if 2 * k + 1 == count { 0.0 } else { (PI * (k as f64 + 0.75) / (n + 0.5)).cos() };
    let mut slope = 1.0;
    for _ in 0..STEPS {
        let [value, before] = legendre(count, x);
        slope = n * (before - x * value) / (1.0 - x * x);
        x -= value / slope;
    }
    (x, 2.0 / ((1.0 - x * x) * slope * slope))
}

/// Return the places of equally spaced points of a line or triangle, as ParaView and Gmsh have them: vertices, inside
/// the edges as in [`Lagrange::nodes`], inside in triangles that lie in each other, each with its vertices, then its
/// edges 01 12 20.
pub fn equally_spaced(order: Order, vertices: usize) -> Vec<[f64; 3]> {
    let degree = order.degree();
    let mut places: Vec<[f64; 3]> =
        (0..vertices).map(|k| std::array::from_fn(|i| f64::from(u8::from(i == k)))).collect();
    let between = |[i, j]: [usize; 2], k: usize, degree: usize| {
        let mut l = [0.0; 3];
        l[i] += (degree - k) as f64 / degree as f64;
        l[j] += k as f64 / degree as f64;
        l
    };
    for &(i, j) in &EDGES[..vertices * (vertices - 1) / 2] {
        places.extend((1..degree).map(|k| between([i, j], k, degree)));
    }
    if vertices == 3 && degree > 2 {
        places.extend(nested(degree, degree - 3, 1));
    }
    places
}

/// Return the points of a triangle of a degree, and those of the triangles in it, whose corners are `margin` steps of
/// 1/`whole` from the sides.
fn nested(whole: usize, degree: usize, margin: usize) -> Vec<[f64; 3]> {
    let place = |index: [usize; 3]| index.map(|i| (i + margin) as f64 / whole as f64);
    if degree == 0 {
        return vec![place([0; 3])];
    }
    let at = |k: usize| std::array::from_fn(|i| if i == k { degree } else { 0 });
    let mut places: Vec<[f64; 3]> = (0..3).map(|k| place(at(k))).collect();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        for k in 1..degree {
            let mut index = [0; 3];
            (index[i], index[j]) = (degree - k, k);
            places.push(place(index));
        }
    }
    if degree > 2 {
        places.extend(nested(whole, degree - 3, margin + 1));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::super::element;
    use super::*;

    fn all() -> impl Iterator<Item = (Order, usize)> {
        (1..=Order::HIGHEST).filter_map(Order::new).flat_map(|order| [(order, 2), (order, 3)])
    }

    /// Return a polynomial of a degree with all monomials, and its derivatives by l_1 and l_2 with l_0 = 1 - l_1 - l_2.
    fn polynomial(degree: usize, l: &[f64]) -> [f64; 3] {
        let (x, y) = (l[1], l.get(2).copied().unwrap_or(0.0));
        let base = 0.7 + 1.3 * x - 0.4 * y;
        let slope = degree as f64 * base.powi(degree as i32 - 1);
        [base.powi(degree as i32), 1.3 * slope, -0.4 * slope]
    }

    /// Functions are one at their node and zero at the others, reproduce polynomials and their slopes, and have
    /// positive integrals on edges.
    #[test]
    fn functions_of_all_orders() {
        for (order, vertices) in all() {
            let table = of(order, vertices);
            for (i, l) in table.nodes.iter().enumerate() {
                let phi = table.values(&l[..vertices]);
                assert!(phi.iter().enumerate().all(|(j, phi)| (phi - f64::from(u8::from(i == j))).abs() < 1e-13));
            }
            let l = [0.5, 0.2, 0.3];
            let l = if vertices == 3 { l } else { [0.8, 0.2, 0.0] };
            let at_nodes: Vec<f64> =
                table.nodes.iter().map(|l| polynomial(order.degree(), &l[..vertices])[0]).collect();
            let sum = |of: &dyn Fn(usize) -> f64| at_nodes.iter().enumerate().map(|(i, u)| u * of(i)).sum::<f64>();
            let (phi, slopes) = (table.values(&l[..vertices]), table.slopes(&l[..vertices]));
            let exact = polynomial(order.degree(), &l[..vertices]);
            assert!((sum(&|i| phi[i]) - exact[0]).abs() < 1e-12, "{order:?} {vertices}");
            for k in 1..vertices {
                assert!((sum(&|i| slopes[i][k] - slopes[i][0]) - exact[k]).abs() < 1e-11, "{order:?} {vertices} {k}");
            }
            let mut integrals = vec![0.0; phi.len()];
            for (l, weight) in element::rule(vertices, order.degree()).iter() {
                table.values(l).iter().zip(&mut integrals).for_each(|(phi, sum)| *sum += weight * phi);
            }
            assert!((integrals.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            assert!(vertices == 3 || integrals.iter().all(|integral| *integral > 0.0));
        }
    }

    /// The formulas of orders one and two are those of this code.
    #[test]
    fn low_orders_are_the_same() {
        for order in [Order::P1, Order::P2] {
            for l in [&[0.3, 0.7][..], &[0.2, 0.7, 0.1]] {
                let (table, vertices) = (of(order, l.len()), l.len());
                let [ours, theirs] = [table.values(l), element::values(order, l)];
                assert!(ours.iter().zip(&theirs).all(|(a, b)| (a - b).abs() < 1e-14), "{order:?}");
                let [ours, theirs] = [table.slopes(l), element::derivatives(order, l)];
                let differ =
                    |(a, b): (&[f64; 4], &[f64; 4])| (1..vertices).all(|k| (a[k] - a[0] - b[k] + b[0]).abs() < 1e-13);
                assert!(ours.iter().zip(&theirs).all(differ), "{order:?}");
            }
        }
    }

    /// Gauss points integrate exactly what they should, on lines and on triangles.
    #[test]
    fn rules_of_high_degree_are_exact() {
        let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
        for degree in 6..=20 {
            let line: f64 = gauss(degree / 2 + 1).iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
            assert!((line * (degree + 1) as f64 - 1.0).abs() < 1e-13, "{degree}");
            for b in 0..=degree {
                let (p, q) = (degree / 3, b.min(degree - degree / 3));
                let sum: f64 =
                    element::rule(3, degree).iter().map(|(l, w)| w * l[1].powi(p as i32) * l[2].powi(q as i32)).sum();
                let exact = 2.0 * factorial(p) * factorial(q) / factorial(p + q + 2);
                assert!((sum / exact - 1.0).abs() < 1e-12, "{degree} {p} {q}");
            }
        }
    }

    /// Equally spaced points are as many as the nodes, and the edge nodes lie on the same edges.
    #[test]
    fn points_of_files_stand_for_nodes() {
        for (order, vertices) in all() {
            let (nodes, places) = (&of(order, vertices).nodes, equally_spaced(order, vertices));
            assert_eq!(nodes.len(), places.len(), "{order:?} {vertices}");
            for (node, place) in nodes.iter().zip(&places) {
                assert!((0..3).all(|k| (node[k] == 0.0) == (place[k] == 0.0)), "{order:?} {vertices}");
            }
            let mut distinct: Vec<_> = places.iter().map(|l| l.map(|l| (l * 840.0).round() as i64)).collect();
            distinct.sort_unstable();
            distinct.dedup();
            assert_eq!(distinct.len(), places.len());
        }
    }
}
