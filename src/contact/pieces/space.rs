//! Common pieces of two triangulated surfaces: convex polygons in the parameters of the facets of side a.
//!
//! The corners of a facet of side b are projected to the parameters of a facet of side a along the normals of a. The
//! projection of a corner x solves x = x_a(u, v) + t n(u, v), where x_a is the facet of side a, n its normal, (u, v) are its
//! parameters and t is the distance. The image of the facet of b is clipped by the facet of a. Its edges are taken as straight
//! although they may be slightly curved. Each facet of a is still covered once, since neighbours in b share their edges. A
//! curved facet of b is split into four at the middle of its edges. All facets of b are split further where corners of some
//! have no image.

use super::polygon::{self, Polygon};
use super::{AWAY, Common, Lost, MOST_STEPS, ROUNDING, Reach, Refused, SNAP, Search, Shared, plus};
use crate::contact::cover::WHOLE;
use crate::contact::side::{Side, length, unit};
use crate::fem::{area_vector, cross, element, minus};
use crate::linalg::dot;
use crate::problem::order::Order;

/// Area of a piece, as a share of its facet, up to which it is rounding.
const TINY: f64 = 1e-11;

/// Largest distance outside of its parameters at which a ray may meet a facet. The edge of a piece is a chord of the image of
/// b's edge, which bows by an eighth of the angle that the normals turn along it: a tenth if they turn by a radian a facet.
const ON_FACET: f64 = 0.1;

/// Numbers of parts into which the edges of facets of side b are split. They are tried one after the other, until a facet of side a is
/// covered or each corner of the parts lies on one of its normals.
///
/// Beyond a curved facet its parabolas turn back, so that points farther away than about its size lie on none of its normals. The
/// parts that cover the facet must be smaller than that. An eighth was enough on twelve parts of machines, five of which had lost pieces.
const PARTS: [usize; 4] = [1, 2, 4, 8];

/// Return the common pieces of two surfaces in space.
pub fn space(a: &Side<3>, b: &Side<3>, reach: &Reach) -> Common<3> {
    let search = Search::new(b);
    let facets_b: Vec<Facet> = (0..b.facets.count()).map(|i| Facet::of(b, i)).collect();
    let quadratic = a.facets.order == Order::P2 || b.facets.order == Order::P2;
    let rule = element::rule(3, if quadratic { 5 } else { 2 });
    let mut common = Common { points: Vec::new(), refused: vec![Refused::default(); a.facets.count()] };
    for i in 0..a.facets.count() {
        let facet = Facet::of(a, i);
        let refused = &mut common.refused[i];
        let pieces =
            search.pieces(a, i, reach, refused, |near, refused| facing(&facet, &facets_b, near, reach, refused));
        for Piece { polygon, index, .. } in pieces {
            let other = &facets_b[index];
            let offset = minus(facet.from, other.from);
            for triangle in polygon::fan(&polygon) {
                let share = 2.0 * polygon::area(&triangle);
                for (l, weight) in rule.iter() {
                    let [u, v] = [0, 1].map(|c| (0..3).map(|k| l[k] * triangle[k][c]).sum());
                    let normal = facet.normal(u, v);
                    let Ok(Some((at_b, t))) = other.hit(plus(facet.at(u, v), offset), normal) else {
                        // The point lies under the image of this very facet, so it is lost.
                        refused.lost += 1;
                        continue;
                    };
                    let weight = weight * share * length(facet.area(u, v));
                    let gap = t * length(normal);
                    if !reach.holds(gap) {
                        refused.far.insert(index);
                        continue;
                    }
                    let at_a = [1.0 - u - v, u, v];
                    common.points.push(Shared { facet_a: i, at_a, facet_b: index, at_b, weight, gap });
                }
            }
        }
    }
    common
}

/// Remove from each piece what nearer pieces cover. `pieces` are sorted by distance, the nearest first.
fn without_overlaps(pieces: Vec<Piece>) -> Vec<Piece> {
    let mut free: Vec<Piece> = Vec::new();
    for Piece { polygon, index, gap } in pieces {
        let parts = free.iter().fold(vec![polygon], |parts, nearer| {
            parts.into_iter().flat_map(|part| polygon::difference(part, &nearer.polygon, 0.5 * TINY)).collect()
        });
        free.extend(parts.into_iter().map(|polygon| Piece { polygon, index, gap }));
    }
    free
}

/// Return the pieces of a facet of side a that face these facets of side b, without what nearer ones cover. Note in `refused` why others are none.
fn facing(facet: &Facet, b: &[Facet], near: &[usize], reach: &Reach, refused: &mut Refused) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for parts in PARTS {
        let before = refused.clone();
        let mut found = Vec::new();
        let mut without_image = 0;
        for &index in near {
            let other = &b[index];
            let clipped = Clipped::between(facet, other, index, parts);
            if reach.faces(facet.direction, other.direction) {
                without_image += clipped.without_image;
                refused.lost += clipped.lost;
            }
            let admitted = |p: &Piece| refused.admits(reach, p.index, p.gap, [facet.direction, other.direction]);
            found.extend(clipped.pieces.into_iter().filter(admitted));
        }
        found.sort_by(|p, q| p.gap.abs().total_cmp(&q.gap.abs()).then(p.index.cmp(&q.index)));
        pieces = without_overlaps(found);
        let covered: f64 = pieces.iter().map(|piece| polygon::area(&piece.polygon)).sum();
        if without_image == 0 || covered >= 0.5 * WHOLE || parts == PARTS[PARTS.len() - 1] {
            break;
        }
        *refused = before;
    }
    pieces
}

/// A facet as a parametrised surface x(u, v), u, v >= 0, u + v <= 1, with the barycentric coordinates 1 - u - v, u, v.
///
/// Coordinates are measured from its first corner, so that interpolation and subtraction round relative to the size of the facet.
/// This holds also if the two bodies of a pair lie far from the others of the scene.
struct Facet {
    order: Order,
    /// First corner.
    from: [f64; 3],
    /// Nodes, measured from the first corner.
    x: Vec<[f64; 3]>,
    /// Largest distance of a node from the first corner.
    size: f64,
    normals: [[f64; 3]; 3],
    /// Outer unit normal in the middle.
    direction: [f64; 3],
    straight: bool,
}

impl Facet {
    fn of(side: &Side<3>, i: usize) -> Self {
        let nodes = side.facets.facet(i);
        let mut x = side.facets.coordinates(i, side.space);
        let from = x[0];
        x.iter_mut().for_each(|x| *x = minus(*x, from));
        Self {
            order: side.facets.order,
            from,
            straight: element::is_straight(&x, 3),
            size: x.iter().map(|&x| length(x)).fold(0.0, f64::max),
            direction: unit(area_vector(side.facets.order, &x, &[1.0 / 3.0; 3])),
            normals: [0, 1, 2].map(|k| side.normals[&nodes[k]]),
            x,
        }
    }

    fn at(&self, u: f64, v: f64) -> [f64; 3] {
        element::interpolate(&self.x, &element::values(self.order, &[1.0 - u - v, u, v]))
    }

    /// Return a bound of the sum of the sizes of the terms that [`Facet::at`] adds.
    fn terms(&self, u: f64, v: f64) -> f64 {
        let reach = 1.0 + 2.0 * (u.abs() + v.abs());
        // The six quadratic functions, l (2l - 1) and 4 l m for barycentric coordinates l and m, sum to less than 3 reach^2 in size.
        self.size * if self.order == Order::P1 { reach } else { 3.0 * reach * reach }
    }

    /// Return the outer normal times the area per area of the parameters.
    fn area(&self, u: f64, v: f64) -> [f64; 3] {
        area_vector(self.order, &self.x, &[1.0 - u - v, u, v])
    }

    fn normal(&self, u: f64, v: f64) -> [f64; 3] {
        let [n, m, o] = self.normals;
        std::array::from_fn(|c| (1.0 - u - v) * n[c] + u * m[c] + v * o[c])
    }

    /// Return dx/du and dx/dv.
    fn tangents(&self, u: f64, v: f64) -> [[f64; 3]; 2] {
        let d = element::derivatives(self.order, &[1.0 - u - v, u, v]);
        [1, 2].map(|k| std::array::from_fn(|c| (0..self.x.len()).map(|n| (d[n][k] - d[n][0]) * self.x[n][c]).sum()))
    }

    /// Return where the line x + t n meets the surface, as barycentric coordinates and t; `None` if it does not meet it.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    fn hit(&self, x: [f64; 3], n: [f64; 3]) -> Result<Option<([f64; 3], f64)>, Lost> {
        let middle = self.at(1.0 / 3.0, 1.0 / 3.0);
        let found = newton(dot(&minus(middle, x), &n) / dot(&n, &n), |[u, v, t]| {
            let on_facet = self.at(u, v);
            let [along_u, along_v] = self.tangents(u, v);
            System {
                value: std::array::from_fn(|c| on_facet[c] - x[c] - t * n[c]),
                columns: [along_u, along_v, n.map(|n| -n)],
                terms: self.terms(u, v) + length(x) + t.abs() * length(n),
            }
        })?;
        let Some([u, v, t]) = found else { return Ok(None) };
        let at = [1.0 - u - v, u, v];
        Ok(at.iter().all(|l| (-ON_FACET..=1.0 + ON_FACET).contains(l)).then_some((at, t)))
    }

    /// Return the parameters (u, v) whose normal passes through `x`, `None` if there are none.
    ///
    /// # Errors
    /// [`Lost`] if the search does not converge.
    fn foot(&self, x: [f64; 3]) -> Result<Option<[f64; 2]>, Lost> {
        let [n, m, o] = self.normals;
        let turns = [minus(m, n), minus(o, n)];
        let third = 1.0 / 3.0;
        let (middle, normal) = (self.at(third, third), self.normal(third, third));
        let found = newton(dot(&minus(x, middle), &normal) / dot(&normal, &normal), |[u, v, t]| {
            let (on_facet, n, tangents) = (self.at(u, v), self.normal(u, v), self.tangents(u, v));
            let column = |k: usize| std::array::from_fn(|c| tangents[k][c] + t * turns[k][c]);
            System {
                value: std::array::from_fn(|c| on_facet[c] + t * n[c] - x[c]),
                columns: [column(0), column(1), n],
                terms: self.terms(u, v) + length(x) + t.abs() * (1.0 + 2.0 * (u.abs() + v.abs())),
            }
        })?;
        Ok(found.map(|[u, v, _]| [u, v]))
    }
}

/// The values and derivatives of three equations in (u, v, t).
struct System {
    value: [f64; 3],
    /// Derivatives by u, v and t.
    columns: [[f64; 3]; 3],
    /// Bound of the sum of the sizes of the terms that a value adds.
    terms: f64,
}

/// Return a zero (u, v, t) of the system by Newton's method from the middle of a facet; `None` if the iterates run away.
///
/// A value counts as zero once it is within the rounding of its own evaluation, since double precision cannot tell whether another
/// step improves it. That step is made all the same, since the value may have come from far above by a quadratic step.
///
/// # Errors
/// [`Lost`] if the values stay larger.
fn newton(t: f64, system: impl Fn([f64; 3]) -> System) -> Result<Option<[f64; 3]>, Lost> {
    let mut at = [1.0 / 3.0, 1.0 / 3.0, t];
    for _ in 0..MOST_STEPS {
        let System { value, columns: [p, q, r], terms } = system(at);
        let det = dot(&cross(p, q), &r);
        let step = [cross(q, r), cross(r, p), cross(p, q)].map(|column| dot(&column, &value) / det);
        let next = minus(at, step);
        let is_away = next.iter().any(|x| !x.is_finite()) || next[0].abs().max(next[1].abs()) > AWAY;
        if value.iter().all(|value| value.abs() <= ROUNDING * terms) {
            return Ok(Some(if is_away { at } else { next }));
        }
        if is_away {
            return Ok(None);
        }
        at = next;
    }
    Err(Lost)
}

/// A part of a facet of side a that faces (a part of) one facet of side b.
struct Piece {
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
    pieces: Vec<Piece>,
    /// Number of triangles with a corner that has no image on the facet of side a.
    without_image: usize,
    /// Number of triangles for which the search for an image did not converge.
    lost: usize,
}

impl Clipped {
    /// Clip one facet of b, whose edges are split into so many `parts`, or twice as many where it is curved.
    fn between(a: &Facet, b: &Facet, index: usize, parts: usize) -> Self {
        let mut clipped = Self::default();
        if dot(&a.direction, &b.direction) >= 0.0 {
            return clipped;
        }
        let is_same_normal = |n: &[f64; 3]| length(minus(*n, a.normals[0])) < SNAP;
        let is_flat = b.order == Order::P1 || (a.straight && b.straight && a.normals.iter().all(is_same_normal));
        let parts = if is_flat { parts } else { 2 * parts };
        let offset = minus(b.from, a.from);
        let foot = |[i, j]: [usize; 2]| {
            let [u, v] = [i, j].map(|k| k as f64 / parts as f64);
            a.foot(plus(b.at(u, v), offset)).map(|foot| foot.map(snap))
        };
        let rows = (0..=parts).map(|j| (0..=parts - j).map(|i| foot([i, j])).collect::<Vec<_>>());
        let feet: Vec<Vec<Foot>> = rows.collect();
        for corners in triangles(parts) {
            let image = corners.map(|[i, j]| feet[j][i]);
            let piece = match image {
                [Ok(Some(p)), Ok(Some(q)), Ok(Some(r))] => Piece::under(a, b, index, [p, q, r]),
                _ => {
                    clipped.without_image += 1;
                    if image.iter().any(Result::is_err) { Err(Lost) } else { Ok(None) }
                }
            };
            match piece {
                Ok(piece) => clipped.pieces.extend(piece),
                Err(Lost) => clipped.lost += 1,
            }
        }
        clipped
    }
}

impl Piece {
    /// Return the piece under the image of one triangle of b, if there is one.
    ///
    /// # Errors
    /// [`Lost`] if the search for the distance does not converge.
    fn under(a: &Facet, b: &Facet, index: usize, [p, q, r]: [[f64; 2]; 3]) -> Result<Option<Self>, Lost> {
        // Side b looks the other way, so its corners are counterclockwise in reverse.
        let image = [p, r, q];
        if polygon::area(&image) <= 0.0 {
            return Ok(None);
        }
        let polygon = polygon::intersection(&image, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        if polygon::area(&polygon) <= 0.5 * TINY {
            return Ok(None);
        }
        let [u, v] = polygon::middle(&polygon);
        let normal = a.normal(u, v);
        let hit = b.hit(plus(a.at(u, v), minus(a.from, b.from)), normal)?;
        Ok(hit.map(|(_, t)| Self { polygon, index, gap: t * length(normal) }))
    }
}

/// The result of [`Facet::foot`].
type Foot = Result<Option<[f64; 2]>, Lost>;

/// Return the triangles between the points (i, j), i + j <= parts, of a triangle whose edges are split into so many parts.
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
