//! Convex polygons in the parameters of a facet.

/// A convex polygon with counterclockwise corners.
pub type Polygon = Vec<[f64; 2]>;

/// Return twice the area of a triangle, which is positive if the corners are counterclockwise.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Return the area, which is positive if the corners are counterclockwise.
pub fn area(polygon: &[[f64; 2]]) -> f64 {
    fan(polygon).map(|[p, q, r]| 0.5 * turn(p, q, r)).sum()
}

/// Return the triangles of a polygon that meet in its first corner.
pub fn fan(polygon: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 3]> + '_ {
    (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]])
}

/// Return the mean of the corners.
pub fn middle(polygon: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|c| polygon.iter().map(|p| p[c]).sum::<f64>() / polygon.len() as f64)
}

/// Return the part of a polygon to the left of the line from `p` to `q`.
fn left_of(polygon: &[[f64; 2]], p: [f64; 2], q: [f64; 2]) -> Polygon {
    let mut part = Polygon::with_capacity(polygon.len() + 1);
    for (i, &to) in polygon.iter().enumerate() {
        let from = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (before, after) = (turn(p, q, from), turn(p, q, to));
        if before * after < 0.0 {
            let s = before / (before - after);
            part.push([0, 1].map(|c| from[c] + s * (to[c] - from[c])));
        }
        if after >= 0.0 {
            part.push(to);
        }
    }
    part
}

fn edges(polygon: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
    (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]))
}

/// Return the intersection of two convex polygons.
pub fn intersection(polygon: &[[f64; 2]], other: &[[f64; 2]]) -> Polygon {
    edges(other).fold(polygon.to_vec(), |part, (p, q)| left_of(&part, p, q))
}

/// Return the part of a convex polygon outside another, as convex polygons. Parts of an area up to `tiny` are dropped. If the
/// intersection is no larger than that, the result is the whole polygon.
pub fn difference(polygon: Polygon, other: &[[f64; 2]], tiny: f64) -> Vec<Polygon> {
    if area(&intersection(&polygon, other)) <= tiny {
        return vec![polygon];
    }
    let mut inside = polygon;
    let mut outside = Vec::new();
    for (p, q) in edges(other) {
        let part = left_of(&inside, q, p);
        if area(&part) > tiny {
            outside.push(part);
        }
        inside = left_of(&inside, p, q);
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn a_corner_is_cut_off_a_square() {
        let triangle = [[0.5, 0.5], [2.0, 0.5], [0.5, 2.0]];
        let common = intersection(&triangle, &SQUARE);
        assert!((area(&common) - 0.25).abs() < 1e-15, "{common:?}");
        let rest = difference(SQUARE.to_vec(), &triangle, 1e-12);
        assert!((rest.iter().map(|part| area(part)).sum::<f64>() - 0.75).abs() < 1e-15, "{rest:?}");
        assert!(rest.iter().all(|part| area(&intersection(part, &triangle)) < 1e-15));
    }

    #[test]
    fn polygons_that_only_touch_share_nothing() {
        let beside = SQUARE.map(|p| [p[0] + 1.0, p[1]]);
        assert!(area(&intersection(&beside, &SQUARE)) == 0.0);
        assert_eq!(difference(beside.to_vec(), &SQUARE, 1e-12), [beside.to_vec()]);
        assert!(difference(SQUARE.to_vec(), &SQUARE, 1e-12).is_empty());
        assert_eq!(middle(&SQUARE), [0.5, 0.5]);
    }
}
