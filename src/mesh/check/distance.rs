//! Predicates that tell whether segments and triangles in space come nearer to each other than a distance.

use robust::Coord3D;

/// A point (x, y, z).
pub type Point = [f64; 3];

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|c| a[c] - b[c])
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Return the cross product.
pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Return the distance of two points.
pub fn apart(a: Point, b: Point) -> f64 {
    dot(minus(a, b), minus(a, b)).sqrt()
}

/// Return the point `a + t (b - a)`.
fn between(a: Point, b: Point, t: f64) -> Point {
    std::array::from_fn(|c| a[c] + t * (b[c] - a[c]))
}

/// Return the distance of a point from a segment.
pub fn from_segment(x: Point, [a, b]: [Point; 2]) -> f64 {
    let edge = minus(b, a);
    let t = (dot(minus(x, a), edge) / dot(edge, edge)).clamp(0.0, 1.0);
    apart(x, between(a, b, t))
}

/// Return whether the distance of two segments is at most `within`.
pub fn segments([a, b]: [Point; 2], [c, d]: [Point; 2], within: f64) -> bool {
    let ends =
        from_segment(a, [c, d]).min(from_segment(b, [c, d])).min(from_segment(c, [a, b])).min(from_segment(d, [a, b]));
    if ends <= within {
        return true;
    }
    // The least distance is that of an end, or that of the lines if both feet lie inside the segments.
    let (u, v, w) = (minus(b, a), minus(d, c), minus(a, c));
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((uv * dot(v, w) - vv * dot(u, w)) / det, (uu * dot(v, w) - uv * dot(u, w)) / det);
    let inside = |t: f64| (0.0..=1.0).contains(&t);
    inside(s) && inside(t) && apart(between(a, b, s), between(c, d, t)) <= within
}

/// Return the distance of a point from a triangle.
pub fn from_triangle(x: Point, [a, b, c]: [Point; 3]) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    let inner = |p: Point, q: Point| dot(cross(minus(q, p), minus(x, p)), normal) >= 0.0;
    if inner(a, b) && inner(b, c) && inner(c, a) {
        return dot(minus(x, a), normal).abs() / dot(normal, normal).sqrt();
    }
    from_segment(x, [a, b]).min(from_segment(x, [b, c])).min(from_segment(x, [c, a]))
}

/// Return the side of the plane through three points on which a fourth one lies. The sign is free of rounding errors, and zero
/// in the plane.
fn side([a, b, c]: [Point; 3], x: Point) -> f64 {
    let [a, b, c, x] = [a, b, c, x].map(|[x, y, z]| Coord3D { x, y, z });
    robust::orient3d(a, b, c, x)
}

/// Return whether a segment has a point of a triangle between its ends. In a flat boundary all determinants vanish except for
/// rounding. The sign of a rounded one tells nothing, so exact signs are needed.
fn pierces([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let ends = [p, q].map(|x| side([a, b, c], x));
    if !(ends[0] < 0.0 && ends[1] > 0.0 || ends[0] > 0.0 && ends[1] < 0.0) {
        return false;
    }
    let sides = [[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u], v));
    sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
}

/// Return whether the distance of a segment and a triangle is at most `within`.
pub fn segment_triangle([p, q]: [Point; 2], [a, b, c]: [Point; 3], within: f64) -> bool {
    let normal = cross(minus(b, a), minus(c, a));
    let size = dot(normal, normal).sqrt();
    let [from, to] = [p, q].map(|x| dot(minus(x, a), normal));
    if from.min(to) > within * size || from.max(to) < -within * size {
        return false;
    }
    pierces([p, q], [a, b, c])
        || from_triangle(p, [a, b, c]) <= within
        || from_triangle(q, [a, b, c]) <= within
        || [[a, b], [b, c], [c, a]].into_iter().any(|edge| segments([p, q], edge, within))
}

/// Return whether the half-planes from the line ab through c and through d coincide to within a small angle.
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

    /// The plane is turned so that no coordinate is exact. Its triangles meet where their corners say so and nowhere else.
    #[test]
    fn triangles_of_a_turned_plane() {
        let (u, v) = ([0.6, 0.37, -0.709_295_425_052_062_4], [0.1, 0.83, 0.517_559_123_1]);
        let point = |s: f64, t: f64| -> Point { std::array::from_fn(|c| 0.123 + s * u[c] + t * v[c]) };
        let mut meeting = [0; 2];
        for k in 0..40_000 {
            // The segment lies at s + t > 1; in every second case it enters the triangle.
            let [i, j, m] = [k % 37, k / 37 % 37, k / 1369].map(|i| f64::from(i) / 37.0);
            let enters = k % 2 == 0;
            let ends =
                [point(1.0 + i, 0.1 + j), if enters { point(0.3 * m, 0.3 * j) } else { point(0.1 + m, 1.0 + i) }];
            let found = segment_triangle(ends, [point(0.0, 0.0), point(1.0, 0.0), point(0.0, 1.0)], 1e-9);
            assert_eq!(found, enters, "{k}");
            meeting[usize::from(found)] += 1;
        }
        assert!(meeting.iter().all(|&count| count > 1000), "{meeting:?}");
    }

    #[test]
    fn half_planes_are_told_by_their_angle() {
        let edge = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert!(same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-11], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [5.0, 0.1, 1e-6], 1e-9));
        assert!(!same_side(edge, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], 1e-9));
    }
}
