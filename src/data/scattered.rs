//! Values at scattered points: planes over the triangles of Delaunay.

use super::rule::Sample;
use spade::handles::{DirectedEdgeHandle, FixedVertexHandle};
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

/// Finds a triangle in the logarithm of the number of points, wherever it is.
type Triangles = DelaunayTriangulation<Height, (), (), (), HierarchyHintGenerator<f64>>;
type Edge<'a> = DirectedEdgeHandle<'a, Height, (), (), ()>;

/// A function on triangles.
#[derive(Clone)]
pub struct Scattered(Triangles);

impl Scattered {
    /// Triangulates points (x, y, value) at different places; none where all lie on one line.
    pub fn new(points: &[[f64; 3]]) -> Option<Self> {
        let heights = points.iter().map(|&[x, y, value]| Height { place: Point2::new(x, y), value }).collect();
        // refused are numbers that are not finite, or too large or small to be told apart
        let triangles = Triangles::bulk_load(heights).ok()?;
        (triangles.num_inner_faces() > 0).then_some(Self(triangles))
    }

    /// Places and values of all points.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.vertices().flat_map(|vertex| [vertex.data().place.x, vertex.data().place.y, vertex.data().value])
    }

    /// The value at a place; beyond all triangles that of the nearest place on their border, or nothing.
    pub fn sample(&self, place: [f64; 2], holds: bool) -> Sample {
        if place.iter().any(|x| !x.is_finite()) {
            return Sample::NONE;
        }
        let corners = |vertices: [FixedVertexHandle; 3]| vertices.map(|vertex| *self.0.vertex(vertex).data());
        let point = Point2::new(place[0], place[1]);
        match self.0.locate(point) {
            Found::OnFace(face) => plane(self.0.face(face).vertices().map(|vertex| *vertex.data()), place),
            Found::OnEdge(edge) => {
                let edge = self.0.directed_edge(edge);
                // one of the triangles beside it
                let inner = [edge, edge.rev()].into_iter().find_map(|edge| edge.face().as_inner());
                inner.map_or(Sample::NONE, |face| plane(face.vertices().map(|vertex| *vertex.data()), place))
            }
            Found::OnVertex(vertex) => {
                let edges = self.0.vertex(vertex).out_edges();
                let face = edges.filter_map(|edge| edge.face().as_inner()).next();
                let vertices = face.map(|face| corners(face.vertices().map(|vertex| vertex.fix())));
                let gradient = vertices.map_or([f64::NAN; 2], |corners| plane(corners, place).gradient);
                Sample { value: self.0.vertex(vertex).data().value, gradient }
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

/// The plane through three points, at a place.
fn plane(corners: [Height; 3], [x, y]: [f64; 2]) -> Sample {
    let [a, b, c] = corners;
    let ([bx, by], [cx, cy]) = (from(a, b), from(a, c));
    let (rise, other) = (b.value - a.value, c.value - a.value);
    let area = bx * cy - by * cx;
    let gradient = [(rise * cy - other * by) / area, (other * bx - rise * cx) / area];
    Sample { value: a.value + gradient[0] * (x - a.place.x) + gradient[1] * (y - a.place.y), gradient }
}

/// The value at the place of the border that is nearest to one outside; `edge` is a part of the border that is seen from there. Along
/// the seen part the distance falls, and then grows.
fn border(mut edge: Edge, place: [f64; 2]) -> Sample {
    let share = |edge: Edge| {
        let [a, b] = edge.vertices().map(|vertex| *vertex.data());
        let ([x, y], [u, v]) = (from(a, b), [place[0] - a.place.x, place[1] - a.place.y]);
        (u * x + v * y) / (x * x + y * y)
    };
    let mut t = share(edge);
    let is_behind = t > 1.0;
    // at a corner the nearest place is beyond the end of one edge and before the start of the next
    while !(0.0..=1.0).contains(&t) {
        let next = if is_behind { edge.next() } else { edge.prev() };
        let beyond = share(next);
        let is_corner = if is_behind { beyond < 0.0 } else { beyond > 1.0 };
        if is_corner {
            let vertex = if is_behind { edge.to() } else { edge.from() };
            return Sample { value: vertex.data().value, gradient: [0.0; 2] };
        }
        (edge, t) = (next, beyond);
    }
    let [a, b] = edge.vertices().map(|vertex| *vertex.data());
    let [x, y] = from(a, b);
    let slope = (b.value - a.value) / (x * x + y * y);
    Sample { value: a.value + t * (b.value - a.value), gradient: [slope * x, slope * y] }
}

fn from(a: Height, b: Height) -> [f64; 2] {
    [b.place.x - a.place.x, b.place.y - a.place.y]
}
