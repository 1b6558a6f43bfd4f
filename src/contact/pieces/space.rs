//! Common pieces of two triangulated surfaces: convex polygons in the parameters of the facets of side a.
//!
//! The corners of a facet of side b are projected to the parameters of a facet of side a along the normals of a. The
//! projection of a corner x solves x = x_a(u, v) + t n(u, v), where x_a is the facet of side a, n its normal, (u, v)
//! are its parameters and t is the distance. The image of the facet of b is clipped by the facet of a. Its edges are
//! taken as straight although they may be slightly curved. Each facet of a is still covered once, since neighbours in b
//! share their edges. A curved facet of b is split into four at the middle of its edges. All facets of b are split
//! further where corners of some have no image.

use super::facet::{Facet, Lost, Rays, SNAP, plus};
use super::{BoxTree, Coverage, IntegrationPoint, Intersection, Reach, WHOLE};
use crate::contact::side::Side;
use crate::fem::{area_vector, element, length, minus};
use crate::linalg::dot;
use crate::problem::order::Order;

/// Area of a piece, as a share of its facet, up to which it is rounding.
const TINY: f64 = 1e-11;

/// Largest distance outside of its parameters at which a ray may meet a facet. The edge of a piece is a chord of the
/// image of b's edge, which bows by an eighth of the angle that the normals turn along it: a tenth if they turn by a
/// radian a facet.
const ON_FACET: f64 = 0.1;

/// Numbers of parts into which the edges of facets of side b are split. They are tried one after the other, until a
/// facet of side a is covered or each corner of the parts lies on one of its normals.
///
/// Beyond a curved facet its parabolas turn back, so that points farther away than about its size lie on none of its
/// normals. The parts that cover the facet must be smaller than that. An eighth was enough on twelve parts of machines,
/// five of which had lost pieces.
const PARTS: [usize; 4] = [1, 2, 4, 8];

/// Return the common pieces of two surfaces in space.
pub fn in_space(a: &Side<3>, b: &Side<3>, reach: &Reach) -> Intersection<3> {
    let search = BoxTree::new(b);
    let facets_b: Vec<Facet<3>> = (0..b.facets.count()).map(|i| Facet::of(b, i)).collect();
    let rule = element::rule_of_products(3, a.facets.order.max(b.facets.order));
    let mut common = Intersection { points: Vec::new(), cover: vec![Coverage::default(); a.facets.count()] };
    for i in 0..a.facets.count() {
        let facet = Facet::of(a, i);
        let cover = &mut common.cover[i];
        let pieces = search.pieces(&facet, reach, cover, |near, cover| facing(&facet, &facets_b, near, reach, cover));
        for FacetPolygon { polygon, index, .. } in pieces {
            let other = &facets_b[index];
            let offset = minus(facet.from, other.from);
            for triangle in fan(&polygon) {
                let share = 2.0 * area(&triangle);
                for (l, weight) in rule.iter() {
                    let at_a = place([0, 1].map(|c| (0..3).map(|k| l[k] * triangle[k][c]).sum()));
                    let normal = facet.normal(&at_a);
                    let Ok(Some((at_b, t))) = other.hit(plus(facet.at(&at_a), offset), normal, ON_FACET) else {
                        // The point lies under the image of this very facet, so it is lost.
                        cover.lost += 1;
                        continue;
                    };
                    let weight = weight * share * length(area_vector(facet.order, &facet.x, &at_a));
                    let gap = t * length(normal);
                    if !reach.holds(gap) {
                        cover.far.insert(index);
                        continue;
                    }
                    common.points.push(IntegrationPoint { facet_a: i, at_a, facet_b: index, at_b, weight, gap });
                }
            }
        }
    }
    common
}

/// Remove from each piece what nearer pieces cover. `pieces` are sorted by distance, the nearest first.
fn without_overlaps(pieces: Vec<FacetPolygon>) -> Vec<FacetPolygon> {
    let mut free: Vec<FacetPolygon> = Vec::new();
    for FacetPolygon { polygon, index, gap } in pieces {
        let parts = free.iter().fold(vec![polygon], |parts, nearer| {
            parts.into_iter().flat_map(|part| difference(part, &nearer.polygon, 0.5 * TINY)).collect()
        });
        free.extend(parts.into_iter().map(|polygon| FacetPolygon { polygon, index, gap }));
    }
    free
}

/// Return the pieces of a facet of side a that face these facets of side b, without what nearer ones cover. Note in
/// `cover` why others are none.
fn facing(facet: &Facet<3>, b: &[Facet<3>], near: &[usize], reach: &Reach, cover: &mut Coverage) -> Vec<FacetPolygon> {
    let mut pieces = Vec::new();
    for parts in PARTS {
        let before = cover.clone();
        let mut found = Vec::new();
        let mut without_image = 0;
        for &index in near {
            let other = &b[index];
            let clipped = Clipped::between(facet, other, index, parts);
            if reach.faces(facet.direction, other.direction) {
                without_image += clipped.without_image;
                cover.lost += clipped.lost;
            }
            let admitted = |p: &FacetPolygon| cover.admits(reach, p.index, p.gap, [facet.direction, other.direction]);
            found.extend(clipped.pieces.into_iter().filter(admitted));
        }
        found.sort_by(|p, q| p.gap.abs().total_cmp(&q.gap.abs()).then(p.index.cmp(&q.index)));
        pieces = without_overlaps(found);
        let covered: f64 = pieces.iter().map(|piece| area(&piece.polygon)).sum();
        if without_image == 0 || covered >= 0.5 * WHOLE || parts == PARTS[PARTS.len() - 1] {
            break;
        }
        *cover = before;
    }
    pieces
}

/// Return the barycentric coordinates of the parameters u, v >= 0, u + v <= 1, of a facet.
fn place([u, v]: [f64; 2]) -> [f64; 3] {
    [1.0 - u - v, u, v]
}

/// A part of a facet of side a that faces (a part of) one facet of side b.
struct FacetPolygon {
    /// Outline in the parameters on side a.
    polygon: Polygon,
    /// Index of the facet of side b.
    index: usize,
    /// Signed distance in the middle of the piece.
    gap: f64,
}

/// A facet of side b, clipped by a facet of side a.
#[derive(Default)]
struct Clipped {
    pieces: Vec<FacetPolygon>,
    /// Number of triangles with a corner that has no image on the facet of side a.
    without_image: usize,
    /// Number of triangles for which the search for an image did not converge.
    lost: usize,
}

impl Clipped {
    /// Clip one facet of b, whose edges are split into so many `parts`, or twice as many where it is curved.
    fn between(a: &Facet<3>, b: &Facet<3>, index: usize, parts: usize) -> Self {
        let mut clipped = Self::default();
        if dot(&a.direction, &b.direction) >= 0.0 {
            return clipped;
        }
        let is_same_normal = |n: &[f64; 3]| length(minus(*n, a.normals[0])) < SNAP;
        let is_flat = b.order == Order::P1
            || ([a, b].iter().all(|facet| element::is_straight(facet.order, &facet.x, 3))
                && a.normals.iter().all(is_same_normal));
        let parts = if is_flat { parts } else { 2 * parts };
        let offset = minus(b.from, a.from);
        let foot = |[i, j]: [usize; 2]| {
            let at = place([i, j].map(|k| k as f64 / parts as f64));
            a.foot(plus(b.at(&at), offset)).map(|foot| foot.map(|[_, u, v]| snap([u, v])))
        };
        let rows = (0..=parts).map(|j| (0..=parts - j).map(|i| foot([i, j])).collect::<Vec<_>>());
        let feet: Vec<Vec<Foot>> = rows.collect();
        for corners in triangles(parts) {
            let image = corners.map(|[i, j]| feet[j][i]);
            let piece = match image {
                [Ok(Some(p)), Ok(Some(q)), Ok(Some(r))] => FacetPolygon::under(a, b, index, [p, q, r]),
                _ => {
                    clipped.without_image += 1;
                    if image.iter().any(Result::is_err) { Err(Lost) } else { Ok(None) }
                }
            };
            match piece {
                Ok(piece) => clipped.pieces.extend(piece),
                Err(Lost) => {
                    let at = |[i, j]: [usize; 2]| plus(b.at(&place([i, j].map(|k| k as f64 / parts as f64))), b.from);
                    clipped.lost += usize::from(Rays::of(a, [f64::INFINITY; 2]).may_meet(&corners.map(at)));
                }
            }
        }
        clipped
    }
}

impl FacetPolygon {
    /// Return the piece under the image of one triangle of b, if there is one.
    ///
    /// # Errors
    /// [`Lost`] if the search for the distance does not converge.
    fn under(a: &Facet<3>, b: &Facet<3>, index: usize, [p, q, r]: [[f64; 2]; 3]) -> Result<Option<Self>, Lost> {
        // Side b looks the other way, so its corners are counterclockwise in reverse.
        let image = [p, r, q];
        if area(&image) <= 0.0 {
            return Ok(None);
        }
        let polygon = intersection(&image, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        if area(&polygon) <= 0.5 * TINY {
            return Ok(None);
        }
        let middle = place(middle(&polygon));
        let normal = a.normal(&middle);
        let hit = b.hit(plus(a.at(&middle), minus(a.from, b.from)), normal, ON_FACET)?;
        Ok(hit.map(|(_, t)| Self { polygon, index, gap: t * length(normal) }))
    }
}

/// The parameters of the result of [`Facet::foot`].
type Foot = Result<Option<[f64; 2]>, Lost>;

/// Return the triangles between the points (i, j), i + j <= parts, of a triangle whose edges are split into so many
/// parts.
fn triangles(parts: usize) -> Vec<[[usize; 2]; 3]> {
    let mut all = Vec::new();
    for j in 0..parts {
        for i in 0..parts - j {
            all.push([[i, j], [i + 1, j], [i, j + 1]]);
            if i + j + 2 <= parts {
                all.push([[i + 1, j], [i + 1, j + 1], [i, j + 1]]);
            }
        }
    }
    all
}

/// Move a point that almost lies on an edge of the parameter triangle onto that edge.
fn snap([u, v]: [f64; 2]) -> [f64; 2] {
    let near = |x: f64| if x.abs() < SNAP { 0.0 } else { x };
    let (u, v) = (near(u), near(v));
    if (1.0 - u - v).abs() >= SNAP {
        [u, v]
    } else if u == 0.0 || v == 0.0 {
        [u.round(), v.round()]
    } else {
        [u, 1.0 - u]
    }
}

/// A convex polygon with counterclockwise corners.
type Polygon = Vec<[f64; 2]>;

/// Return twice the area of a triangle, which is positive if the corners are counterclockwise.
fn turn(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Return the area, which is positive if the corners are counterclockwise.
fn area(polygon: &[[f64; 2]]) -> f64 {
    fan(polygon).map(|[p, q, r]| 0.5 * turn(p, q, r)).sum()
}

/// Return the triangles of a polygon that meet in its first corner.
fn fan(polygon: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 3]> + '_ {
    (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]])
}

/// Return the mean of the corners.
fn middle(polygon: &[[f64; 2]]) -> [f64; 2] {
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
fn intersection(polygon: &[[f64; 2]], other: &[[f64; 2]]) -> Polygon {
    edges(other).fold(polygon.to_vec(), |part, (p, q)| left_of(&part, p, q))
}

/// Return the part of a convex polygon outside another, as convex polygons. Parts of an area up to `tiny` are dropped.
/// If the intersection is no larger than that, the result is the whole polygon.
fn difference(polygon: Polygon, other: &[[f64; 2]], tiny: f64) -> Vec<Polygon> {
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
