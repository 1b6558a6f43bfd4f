//! The shape of a curved simplex: the map that the points of its edges determine.
//!
//! The points inside an edge ij of a simplex of order k divide it into k equal parts in the parameter s. A displacement
//! d(s) = s (1 - s) q(s) moves its chord to the curve through them, where q has the degree k - 2. The map is
//!
//! ```text
//! x(l) = sum_v l_v x_v + sum_ij l_i l_j q_ij((1 + l_j - l_i)/2)
//! ```
//! A power of s in d that is small of order h^m becomes a polynomial of degree m, so that all derivatives of the map
//! are as small as elements of order k need (Lenoir, 1986). Points of a file inside triangles are not used: they do not
//! change the boundary. Of order two this is the quadratic simplex.

use super::simplex::EDGES;
use crate::linalg::interpolation_weights;
use crate::problem::order::Order;
use smallvec::SmallVec;

/// Return the edges of a simplex, given by its points or a property of each: the local numbers of the ends, and the
/// points inside. Linear simplices have none.
pub fn edges<T>(simplex: &[T], dimension: usize) -> impl Iterator<Item = ([usize; 2], &[T])> + Clone {
    let inside = (simplex.len() - dimension - 1).checked_div(dimension * (dimension + 1) / 2).unwrap_or(0);
    EDGES.into_iter().zip(simplex[dimension + 1..].chunks_exact(inside.max(1)))
}

/// Return points in their order, or turned round.
pub fn turned(points: &[u32], is_turned: bool) -> SmallVec<[u32; 2]> {
    let count = points.len();
    (0..count).map(|k| points[if is_turned { count - 1 - k } else { k }]).collect()
}

/// Return the place of point `k` of so many inside a straight edge.
pub fn on_chord<const N: usize>([a, b]: [[f64; N]; 2], k: usize, inside: usize) -> [f64; N] {
    let s = (k + 1) as f64 / (inside + 1) as f64;
    std::array::from_fn(|c| (1.0 - s) * a[c] + s * b[c])
}

/// Return the weight of each point of a simplex of an order, vertices before those of the edges, in the point with
/// barycentric coordinates `l`.
pub fn weights(order: Order, l: &[f64]) -> Vec<f64> {
    let inside: Vec<f64> = (1..order.degree()).map(|k| k as f64 / order.degree() as f64).collect();
    let mut weights = l.to_vec();
    for [i, j] in &EDGES[..l.len() * (l.len() - 1) / 2] {
        let t = 0.5 * (1.0 + l[*j] - l[*i]);
        for (value, s) in interpolation_weights(&inside, t).zip(&inside) {
            let weight = l[*i] * l[*j] * value / (s * (1.0 - s));
            weights[*i] -= weight * (1.0 - s);
            weights[*j] -= weight * s;
            weights.push(weight);
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of straight edges leave a simplex straight, each point has its own weight, and edges of any order are
    /// curves of this order.
    #[test]
    fn maps_follow_their_edges() {
        for order in (1..=Order::HIGHEST).filter_map(Order::new) {
            let degree = order.degree();
            let mut places = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            for edge in &EDGES[..3] {
                let ends = edge.map(|end| places[end]);
                places.extend((1..degree).map(|k| on_chord(ends, k - 1, degree - 1)));
            }
            for (own, l) in places.iter().enumerate() {
                for (point, weight) in weights(order, l).into_iter().enumerate() {
                    assert!((weight - f64::from(u8::from(point == own))).abs() < 1e-12, "{order:?} {own} {point}");
                }
            }
            let l = [0.2, 0.5, 0.3];
            for c in 0..3 {
                let sum: f64 = weights(order, &l).iter().zip(&places).map(|(weight, place)| weight * place[c]).sum();
                assert!((sum - l[c]).abs() < 1e-13, "{order:?} {c}");
            }
            let s: f64 = 0.37;
            let curve = weights(order, &[1.0 - s, s, 0.0]);
            let power: f64 = curve.iter().zip(&places).map(|(w, l)| w * l[1].powi(degree as i32)).sum();
            assert!((power - s.powi(degree as i32)).abs() < 1e-13, "{order:?}");
        }
    }
}
