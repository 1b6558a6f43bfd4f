//! Lagrange simplices, of order one and two in space and of any order in the plane, and quadrature on them, in
//! barycentric coordinates.
//!
//! ```text
//! line       triangle          tetrahedron (VTK)
//!                2               3
//! 0-(2)-1       5 4              edges 4: 01, 5: 12, 6: 02, 7: 03, 8: 13, 9: 23
//!              0 3 1
//! ```
//! In barycentric coordinates l the shape functions of lines, triangles and tetrahedra are the same: phi_i = l_i for
//! order one, and l_i (2 l_i - 1) at vertices and 4 l_i l_j on edges for order two. Those of higher orders are in
//! [`lagrange`].

use super::lagrange;
pub use super::lagrange::{EDGES, Slopes, Values, gauss};
use crate::problem::order::Order;
use smallvec::SmallVec;
use std::borrow::Cow;

/// Return the number of nodes of the simplex with `vertices` vertices.
pub fn node_count(vertices: usize, order: Order) -> usize {
    let degree = order.degree();
    match vertices {
        1 => 1,
        2 => degree + 1,
        3 => (degree + 1) * (degree + 2) / 2,
        _ => (degree + 1) * (degree + 2) * (degree + 3) / 6,
    }
}

/// Return the values of the shape functions at barycentric point `l`.
pub fn values(order: Order, l: &[f64]) -> Values {
    let vertices = l.len();
    match order {
        Order::P1 => l.into(),
        Order::P2 => {
            let mut phi: Values = l.iter().map(|l| l * (2.0 * l - 1.0)).collect();
            phi.extend(EDGES[..vertices * (vertices - 1) / 2].iter().map(|&(i, j)| 4.0 * l[i] * l[j]));
            phi
        }
        _ => lagrange::of(order, vertices).values(l),
    }
}

/// Return the derivatives of the shape functions by the barycentric coordinates at `l`. Only their differences have a
/// meaning, since the coordinates sum to one. Entry `[node][coordinate]` is zero beyond the coordinates of `l`.
pub fn derivatives(order: Order, l: &[f64]) -> Slopes {
    let vertices = l.len();
    let mut d: Slopes = SmallVec::from_elem([0.0; 4], node_count(vertices, order));
    match order {
        Order::P1 => (0..vertices).for_each(|i| d[i][i] = 1.0),
        Order::P2 => {
            for i in 0..vertices {
                d[i][i] = 4.0 * l[i] - 1.0;
            }
            for (k, &(i, j)) in EDGES[..vertices * (vertices - 1) / 2].iter().enumerate() {
                d[vertices + k][i] = 4.0 * l[j];
                d[vertices + k][j] = 4.0 * l[i];
            }
        }
        _ => return lagrange::of(order, vertices).slopes(l),
    }
    d
}

/// Return the barycentric coordinates of a node of an element with so many vertices.
pub fn place(order: Order, vertices: usize, node: usize) -> [f64; 4] {
    match order {
        Order::P1 | Order::P2 => middle(node.checked_sub(vertices).map_or((node, node), |edge| EDGES[edge])),
        _ => {
            let [a, b, c] = lagrange::of(order, vertices).nodes[node];
            [a, b, c, 0.0]
        }
    }
}

/// Return the local numbers of the nodes of an element inside the edge between two of its `vertices` vertices, from the
/// first to the second.
pub fn inside_edge(order: Order, vertices: usize, [i, j]: [usize; 2]) -> impl Iterator<Item = usize> {
    let (count, is_forward) = (order.degree() - 1, i < j);
    let edge = EDGES.iter().position(|&edge| edge == (i.min(j), i.max(j))).unwrap_or(0);
    (0..count).map(move |k| vertices + edge * count + if is_forward { k } else { count - 1 - k })
}

/// Return the barycentric coordinates of the middle between two vertices.
fn middle((i, j): (usize, usize)) -> [f64; 4] {
    std::array::from_fn(|k| 0.5 * f64::from(u8::from(k == i) + u8::from(k == j)))
}

/// Return the barycentric coordinates of the nodes of an element with `N` vertices.
pub fn nodes<const N: usize>(order: Order) -> Vec<[f64; N]> {
    (0..node_count(N, order)).map(|node| std::array::from_fn(|k| place(order, N, node)[k])).collect()
}

/// The gradients in space of the shape functions of a cell, one entry a node.
pub type Gradients<const D: usize> = SmallVec<[[f64; D]; 10]>;

/// Return the gradients in space of the shape functions of a cell at a point, and the measure there. The measure is the
/// area or volume of the affine simplex with the same Jacobian. The result is `None` if the map is singular or inverted
/// there.
///
/// `d` are the [`derivatives`] there, and `x` are the coordinates of the element's nodes (isoparametric).
pub fn gradients<const D: usize>(x: &[[f64; D]], d: &Slopes) -> Option<(Gradients<D>, f64)> {
    let (inverse, det) = invert(&jacobian(x, d))?;
    let gradient = |slope: &[f64; 4]| -> [f64; D] {
        std::array::from_fn(|i| (0..D).map(|c| inverse[c][i] * (slope[c + 1] - slope[0])).sum())
    };
    let measure = det / if D == 2 { 2.0 } else { 6.0 };
    (measure > 0.0).then(|| (d.iter().map(gradient).collect(), measure))
}

/// Return the Jacobian of the map to an element with nodes `x` where the shape functions have the derivatives `d`.
fn jacobian<const D: usize>(x: &[[f64; D]], d: &Slopes) -> [[f64; D]; D] {
    // Column c of the Jacobian is the derivative along l_{c+1} - l_0.
    let mut jacobian = [[0.0; D]; D];
    for (node, x) in x.iter().enumerate() {
        for c in 0..D {
            let slope = d[node][c + 1] - d[node][0];
            for i in 0..D {
                jacobian[i][c] += x[i] * slope;
            }
        }
    }
    jacobian
}

/// Return the inverse and the determinant of a matrix; `None` if it is singular or the determinant overflows.
pub fn invert<const D: usize>(a: &[[f64; D]; D]) -> Option<([[f64; D]; D], f64)> {
    let mut inverse = [[0.0; D]; D];
    let det;
    if D == 2 {
        det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        inverse[0][0] = a[1][1];
        inverse[0][1] = -a[0][1];
        inverse[1][0] = -a[1][0];
        inverse[1][1] = a[0][0];
    } else {
        for i in 0..3 {
            for j in 0..3 {
                let (p, q, r, s) = ((j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3);
                inverse[i][j] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
            }
        }
        det = (0..3).map(|j| a[0][j] * inverse[j][0]).sum();
    }
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    for row in &mut inverse {
        for entry in row {
            *entry /= det;
        }
    }
    Some((inverse, det))
}

/// Return whether the nodes of a simplex with `vertices` vertices lie where straight edges would have them, up to
/// rounding of the coordinates `x`.
pub fn is_straight<const D: usize>(order: Order, x: &[[f64; D]], vertices: usize) -> bool {
    (vertices..x.len()).all(|node| {
        let l = place(order, vertices, node);
        let sum = |of: &dyn Fn(usize) -> f64| (0..vertices).map(|k| l[k] * of(k)).sum::<f64>();
        let length: f64 = (0..D).map(|c| sum(&|k| (x[k][c] - x[node][c]).abs())).sum();
        (0..D).all(|c| sum(&|k| x[k][c] - x[node][c]).abs() <= 1e-9 * length)
    })
}

/// Return the point of an element with node coordinates `x` and shape function values `phi`.
pub fn interpolate<const D: usize>(x: &[[f64; D]], phi: &[f64]) -> [f64; D] {
    std::array::from_fn(|i| x.iter().zip(phi).map(|(x, phi)| phi * x[i]).sum())
}

/// Return the derivative of the map to an element with nodes `x` by the barycentric coordinate l[k + 1]. When that
/// coordinate grows, l[0] becomes smaller by as much.
pub fn tangent<const D: usize>(order: Order, x: &[[f64; D]], l: &[f64], k: usize) -> [f64; D] {
    if order == Order::P1 {
        // Most facets are straight, and this is needed several times for each two facets that may touch.
        return std::array::from_fn(|i| x[k + 1][i] - x[0][i]);
    }
    let d = derivatives(order, l);
    std::array::from_fn(|i| x.iter().zip(&d).map(|(x, d)| (d[k + 1] - d[0]) * x[i]).sum())
}

/// A quadrature rule on a simplex: barycentric points and weights that sum to one (multiply by length, area or volume).
#[derive(Debug, Clone, Default)]
pub struct Rule {
    /// Barycentric coordinates of each point, one a vertex.
    pub points: Vec<Vec<f64>>,
    /// Weight of each point.
    pub weights: Vec<f64>,
    /// Values and derivatives of the shape functions at each point, once they were tabulated.
    shapes: Vec<(Values, Slopes)>,
}

impl Rule {
    /// Return the nodes of an element with so many vertices as points of weight one.
    pub fn at_nodes(order: Order, vertices: usize) -> Self {
        let mut nodes = Self::default();
        (0..node_count(vertices, order)).for_each(|k| nodes.add(&place(order, vertices, k)[..vertices], 1.0));
        nodes.with_shapes(order)
    }

    /// Return the rule with a table of the shape functions of this order, which saves the evaluation of orders above
    /// two in each cell.
    pub fn with_shapes(mut self, order: Order) -> Self {
        let shape = |l: &Vec<f64>| (values(order, l), derivatives(order, l));
        self.shapes = self.points.iter().filter(|_| order > Order::P2).map(shape).collect();
        self
    }

    /// Return the values and derivatives of the shape functions of an order at a point, which are those of the table,
    /// if there is one.
    pub fn shape(&self, point: usize, order: Order) -> Cow<'_, (Values, Slopes)> {
        let compute = || Cow::Owned((values(order, &self.points[point]), derivatives(order, &self.points[point])));
        self.shapes.get(point).map_or_else(compute, Cow::Borrowed)
    }

    fn add(&mut self, point: &[f64], weight: f64) {
        self.points.push(point.to_vec());
        self.weights.push(weight);
    }

    /// Return the points and their weights.
    pub fn iter(&self) -> impl Iterator<Item = (&[f64], f64)> {
        self.points.iter().map(Vec::as_slice).zip(self.weights.iter().copied())
    }
}

/// Return the rule for products of two functions of an order where the measure or a factor varies, as on curved
/// simplices: of degree 2k + 1, and of degree 2 for linear functions, whose simplices are straight. Other functions
/// than polynomials take at least the rule for order 2.
pub fn rule_of_products(vertices: usize, order: Order) -> Rule {
    rule(vertices, if order == Order::P1 { 2 } else { 2 * order.degree() + 1 })
}

/// Return the rule on the simplex with so many vertices that is exact for polynomials of `degree`, at most 5 on
/// tetrahedra, whose elements have an order of at most two.
///
/// # Panics
/// If the number of vertices is not from 1 to 4.
pub fn rule(vertices: usize, degree: usize) -> Rule {
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
        6.. => lagrange::collapsed(degree, add),
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

    fn nodal<const N: usize>(order: Order) {
        for (i, l) in nodes::<N>(order).iter().enumerate() {
            let phi = values(order, l);
            for (j, phi) in phi.iter().enumerate() {
                assert_eq!(*phi, if i == j { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others() {
        for order in [Order::P1, Order::P2] {
            nodal::<2>(order);
            nodal::<3>(order);
            nodal::<4>(order);
        }
    }

    #[test]
    fn gradients_reproduce_a_quadratic_field_on_a_skewed_tetrahedron() {
        let corner = [[0.1, 0.0, 0.2], [1.3, 0.1, 0.0], [0.0, 0.9, 0.3], [0.2, 0.4, 1.1]];
        let x: Vec<[f64; 3]> = nodes::<4>(Order::P2)
            .iter()
            .map(|l| std::array::from_fn(|i| (0..4).map(|v| l[v] * corner[v][i]).sum()))
            .collect();
        let field = |x: &[f64; 3]| x[0] * x[1] - 2.0 * x[2] * x[2] + x[0];
        let l = [0.2, 0.3, 0.1, 0.4];
        let (gradient, measure) = gradients(&x, &derivatives(Order::P2, &l)).expect("positive volume");
        let at: [f64; 3] = std::array::from_fn(|i| (0..4).map(|v| l[v] * corner[v][i]).sum());
        let exact = [at[1] + 1.0, at[0], -4.0 * at[2]];
        for i in 0..3 {
            let sum: f64 = (0..10).map(|n| gradient[n][i] * field(&x[n])).sum();
            assert!((sum - exact[i]).abs() < 1e-13, "{i}: {sum} {}", exact[i]);
        }
        let mut swapped = x.clone();
        swapped.swap(0, 1);
        swapped.swap(5, 6);
        swapped.swap(7, 8);
        assert!(gradients(&swapped, &derivatives(Order::P2, &l)).is_none(), "inverted: {measure}");
        let flat = x.iter().map(|x| [x[0], x[1], 0.0]).collect::<Vec<_>>();
        assert!(gradients(&flat, &derivatives(Order::P2, &l)).is_none(), "flat");
        let far = x.iter().map(|x| x.map(|x| 1e150 * x)).collect::<Vec<_>>();
        assert!(gradients(&far, &derivatives(Order::P2, &l)).is_none(), "beyond the range of numbers");
    }

    #[test]
    fn a_cell_is_straight_if_each_edge_is() {
        let straight = [[0.0, 0.0], [2.0, 0.0], [0.0, 4.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        assert!(is_straight(Order::P2, &straight, 3) && is_straight(Order::P1, &straight[..3], 3));
        for (node, c) in [(3, 1), (4, 0), (5, 1)] {
            let mut bent = straight;
            bent[node][c] += 1e-6;
            assert!(!is_straight(Order::P2, &bent, 3), "{node}");
            bent[node][c] = straight[node][c] + 1e-10;
            assert!(is_straight(Order::P2, &bent, 3), "{node}");
        }
    }

    fn factorial(n: usize) -> f64 {
        (1..=n).map(|k| k as f64).product()
    }

    /// The mean of a monomial in barycentric coordinates over a simplex is n! prod(a_i!) / (n + sum a)!.
    fn check(n: usize, degree: usize) {
        let rule = rule(n, degree);
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
}
