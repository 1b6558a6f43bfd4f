//! Values at scattered points: straight lines between the points of a profile, and planes over the triangles of a Delaunay triangulation.

use super::rule::Sample;
use spade::handles::{DirectedEdgeHandle, FaceHandle, InnerTag};
use spade::{
    DelaunayTriangulation, HasPosition, HierarchyHintGenerator, Point2, PositionInTriangulation as Found, Triangulation,
};
use std::fmt;

/// A point and its value.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    place: Point2<f64>,
    value: f64,
}

impl HasPosition for Height {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.place
    }
}

/// A triangulation with a hierarchy of coarser ones, by which a triangle is found in logarithmic time.
type Triangles = DelaunayTriangulation<Height, (), (), (), HierarchyHintGenerator<f64>>;
type Edge<'a> = DirectedEdgeHandle<'a, Height, (), (), ()>;
type Triangle<'a> = FaceHandle<'a, InnerTag, Height, (), (), ()>;

/// A function that is linear on each triangle.
#[derive(Clone)]
pub struct Scattered(Triangles);

impl Scattered {
    /// Triangulate points (x, y, value) at different places; none if all lie on one line.
    pub fn new(points: &[[f64; 3]]) -> Option<Self> {
        let heights = points.iter().map(|&[x, y, value]| Height { place: Point2::new(x, y), value }).collect();
        // numbers are refused that are not finite, or too large or too small to be distinguished
        let triangles = Triangles::bulk_load(heights).ok()?;
        (triangles.num_inner_faces() > 0).then_some(Self(triangles))
    }

    /// Return places and values of all points.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.vertices().flat_map(|vertex| [vertex.data().place.x, vertex.data().place.y, vertex.data().value])
    }

    /// Return the value at a place. Beyond all triangles it is that of the nearest place on their border if `holds`, else there is none.
    pub fn sample(&self, place: [f64; 2], holds: bool) -> Sample {
        if place.iter().any(|x| !x.is_finite()) {
            return Sample::NONE;
        }
        let point = Point2::new(place[0], place[1]);
        match self.0.locate(point) {
            Found::OnFace(face) => plane(self.0.face(face), place),
            Found::OnEdge(edge) => {
                let edge = self.0.directed_edge(edge);
                // one of the triangles beside the edge
                let inner = [edge, edge.rev()].into_iter().find_map(|edge| edge.face().as_inner());
                inner.map_or(Sample::NONE, |face| plane(face, place))
            }
            Found::OnVertex(vertex) => {
                let vertex = self.0.vertex(vertex);
                let face = vertex.out_edges().find_map(|edge| edge.face().as_inner());
                let gradient = face.map_or([f64::NAN; 2], |face| plane(face, place).gradient);
                Sample { value: vertex.data().value, gradient }
            }
            Found::OutsideOfConvexHull(edge) if holds => border(self.0.directed_edge(edge), place),
            Found::OutsideOfConvexHull(_) | Found::NoTriangulation => Sample::NONE,
        }
    }
}

impl fmt::Debug for Scattered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Scattered({} points)", self.0.num_vertices())
    }
}

/// Return value and gradient at a place of the plane through the corners of a triangle.
fn plane(triangle: Triangle, [x, y]: [f64; 2]) -> Sample {
    let [a, b, c] = triangle.vertices().map(|vertex| *vertex.data());
    let ([bx, by], [cx, cy]) = (from(a, b), from(a, c));
    let (rise, other) = (b.value - a.value, c.value - a.value);
    let area = bx * cy - by * cx;
    let gradient = [(rise * cy - other * by) / area, (other * bx - rise * cx) / area];
    Sample { value: a.value + gradient[0] * (x - a.place.x) + gradient[1] * (y - a.place.y), gradient }
}

/// Return the value at the place of the border that is nearest to a place outside. `edge` is an edge of the border that is visible from there.
///
/// Along the visible edges the distance first decreases and then increases, so that the search goes from edge to edge in one direction.
fn border(mut edge: Edge, place: [f64; 2]) -> Sample {
    // where the foot of the perpendicular from the place lies: 0 at the start of an edge, 1 at its end
    let foot_on = |edge: Edge| {
        let [a, b] = edge.vertices().map(|vertex| *vertex.data());
        let ([x, y], [u, v]) = (from(a, b), [place[0] - a.place.x, place[1] - a.place.y]);
        (u * x + v * y) / (x * x + y * y)
    };
    let mut t = foot_on(edge);
    let is_forward = t > 1.0;
    while !(0.0..=1.0).contains(&t) {
        let next = if is_forward { edge.next() } else { edge.prev() };
        let next_t = foot_on(next);
        // a corner is the nearest place if the foot is beyond the end of one edge and before the start of the next
        let is_corner = if is_forward { next_t < 0.0 } else { next_t > 1.0 };
        if is_corner {
            let vertex = if is_forward { edge.to() } else { edge.from() };
            return Sample { value: vertex.data().value, gradient: [0.0; 2] };
        }
        (edge, t) = (next, next_t);
    }
    let [a, b] = edge.vertices().map(|vertex| *vertex.data());
    let [x, y] = from(a, b);
    let slope = (b.value - a.value) / (x * x + y * y);
    Sample { value: a.value + t * (b.value - a.value), gradient: [slope * x, slope * y] }
}

fn from(a: Height, b: Height) -> [f64; 2] {
    [b.place.x - a.place.x, b.place.y - a.place.y]
}

/// The points (x, value) of a profile, at least two, with increasing x.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots(pub Vec<[f64; 2]>);

impl Knots {
    /// Return the first and the last place.
    pub fn range(&self) -> [f64; 2] {
        [self.0[0][0], self.0[self.0.len() - 1][0]]
    }

    /// Return the value at a place. Beyond an end it is the value there if `holds`, else there is none.
    pub fn sample(&self, x: f64, holds: bool) -> Sample {
        let [first, last] = self.range();
        let is_within = (first..=last).contains(&x);
        if x.is_nan() || !(is_within || holds) {
            return Sample::NONE;
        }
        let above = self.0.partition_point(|point| point[0] <= x).clamp(1, self.0.len() - 1);
        let ([a, low], [b, high]) = (self.0[above - 1], self.0[above]);
        let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
        let slope = if is_within { (high - low) / (b - a) } else { 0.0 };
        Sample { value: low + t * (high - low), gradient: [slope, 0.0] }
    }
}
