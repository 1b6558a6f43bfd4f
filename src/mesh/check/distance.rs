//! Whether segments and triangles in space come nearer to each other than a distance.

/// A point.
pub type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Distance of two points.
pub fn apart(a: Point, b: Point) -> f64 {
    dot(minus(a, b), minus(a, b)).sqrt()
}

/// The point `a + t (b - a)`.
fn between(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

/// Distance of a point from a segment.
pub fn from_segment(x: Point, [a, b]: [Point; 2]) -> f64 {
    let edge = minus(b, a);
    let t = (dot(minus(x, a), edge) / dot(edge, edge)).clamp(0.0, 1.0);
    apart(x, between(a, b, t))
}

/// Whether two segments come within a distance.
pub fn segments([a, b]: [Point; 2], [c, d]: [Point; 2], within: f64) -> bool {
    let ends =
        from_segment(a, [c, d]).min(from_segment(b, [c, d])).min(from_segment(c, [a, b])).min(from_segment(d, [a, b]));
    if ends <= within {
        return true;
    }
    // the least distance is that of an end, or that of the lines where both feet lie inside
    let (u, v, w) = (minus(b, a), minus(d, c), minus(a, c));
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((uv * dot(v, w) - vv * dot(u, w)) / det, (uu * dot(v, w) - uv * dot(u, w)) / det);
    let inside = |t: f64| (0.0..=1.0).contains(&t);
    inside(s) && inside(t) && apart(between(a, b, s), between(c, d, t)) <= within
}

/// Distance of a point from a triangle.
pub fn from_triangle(x: Point, [a, b, c]: [Point; 3]) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    let inner = |p: Point, q: Point| dot(cross(minus(q, p), minus(x, p)), normal) >= 0.0;
    if inner(a, b) && inner(b, c) && inner(c, a) {
        return dot(minus(x, a), normal).abs() / dot(normal, normal).sqrt();
    }
    from_segment(x, [a, b]).min(from_segment(x, [b, c])).min(from_segment(x, [c, a]))
}

/// Whether a segment and a triangle come within a distance.
pub fn segment_triangle([p, q]: [Point; 2], [a, b, c]: [Point; 3], within: f64) -> bool {
    let normal = cross(minus(b, a), minus(c, a));
    let size = dot(normal, normal).sqrt();
    let [from, to] = [p, q].map(|x| dot(minus(x, a), normal));
    if from.min(to) > within * size || from.max(to) < -within * size {
        return false;
    }
    let pierces = from * to < 0.0 && {
        let direction = minus(q, p);
        let side = |u: Point, v: Point| dot(cross(minus(u, p), minus(v, p)), direction);
        let sides = [side(a, b), side(b, c), side(c, a)];
        sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
    };
    pierces
        || from_triangle(p, [a, b, c]) <= within
        || from_triangle(q, [a, b, c]) <= within
        || [[a, b], [b, c], [c, a]].into_iter().any(|edge| segments([p, q], edge, within))
}

/// Whether the half-planes from the line ab through c and through d are the same, to a small angle.
pub fn same_side([a, b]: [Point; 2], c: Point, d: Point, angle: f64) -> bool {
    let edge = minus(b, a);
    let across = |x: Point| {
        let t = dot(minus(x, a), edge) / dot(edge, edge);
        minus(x, between(a, b, t))
    };
    let (c, d) = (across(c), across(d));
    let sine = cross(c, d);
    dot(c, d) > 0.0 && dot(sine, sine) <= angle * angle * dot(c, c) * dot(d, d)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Point; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn segments_meet_at_ends_and_inside() {
        let a = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert!(segments(a, [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0]], 1e-9));
        assert!(segments(a, [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], 1e-9));
        assert!(segments(a, [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], 1e-9));
        assert!(!segments(a, [[1.0, -1.0, 1e-3], [1.0, 1.0, 1e-3]], 1e-9));
        assert!(segments(a, [[1.0, -1.0, 1e-3], [1.0, 1.0, 1e-3]], 2e-3));
        assert!(!segments(a, [[3.0, -1.0, 0.0], [3.0, 1.0, 0.0]], 0.5));
        assert!(!segments(a, [[0.0, 1e-3, 0.0], [2.0, 1e-3, 0.0]], 1e-9));
    }

    #[test]
    fn segments_meet_triangles() {
        let meets = |p: Point, q: Point| segment_triangle([p, q], TRIANGLE, 1e-9);
        assert!(meets([0.2, 0.2, -1.0], [0.2, 0.2, 1.0]));
        assert!(meets([0.2, 0.2, 0.0], [0.2, 0.2, 1.0]));
        assert!(meets([-1.0, 0.5, 0.0], [2.0, 0.5, 0.0]));
        assert!(meets([0.5, -1.0, -1.0], [0.5, 1.0, 1.0]));
        assert!(!meets([0.2, 0.2, 1e-3], [0.2, 0.2, 1.0]));
        assert!(!meets([0.8, 0.8, -1.0], [0.8, 0.8, 1.0]));
        assert!(!meets([-1.0, 1.5, 0.0], [2.0, 1.5, 0.0]));
    }

    #[test]
    fn half_planes_are_told_by_their_angle() {
        let edge = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert!(same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-11], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-6], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], 1e-9));
    }
}
