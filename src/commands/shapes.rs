//! What `winkler mesh` says about the surfaces of a mesh, so that a user finds them: the body that each one bounds, and
//! its shape, as far as it is plane, a cylinder, a sphere or a cone.

use crate::fem::{cross, length, minus, pad, unit};
use crate::linalg::TOLERANCE;
use crate::mesh::faces::{Face, Faces, Simplices};
use crate::mesh::{Group, Mesh};
use crate::output::closing::readable;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::BTreeSet;

/// A facet with its outer normal.
struct OrientedFacet<const D: usize> {
    /// Mean of its corners.
    centre: [f64; D],
    normal: [f64; D],
    area: f64,
}

/// The bodies beside a surface, and its shape in words.
#[derive(Default)]
pub struct SurfaceFacts {
    /// Groups of cells that it bounds.
    pub bodies: Vec<String>,
    /// The shape; empty if it is not a known one.
    pub shape: String,
}

/// Return the facts of each group of a mesh; none for groups that are no surfaces.
pub fn of_groups<const D: usize>(mesh: &Mesh<D>) -> Vec<SurfaceFacts> {
    let bodies: Vec<&Group> = mesh.groups.iter().filter(|group| group.dimension == D).collect();
    let nodes: Vec<u32> = bodies.iter().flat_map(|group| &group.connectivity).copied().collect();
    let cells = Simplices { nodes: &nodes, stride: bodies.first().map_or(1, |group| group.stride) };
    let body_of_cell: Vec<usize> = bodies.iter().enumerate().flat_map(|(i, group)| vec![i; group.len()]).collect();
    let faces = Faces::new(cells);
    let of_surface = |group: &Group| {
        let beside: Vec<Vec<Face<D>>> = group.simplices().map(|facet| faces.at(&facet[..D]).collect()).collect();
        let facets: Vec<_> =
            beside.iter().filter_map(|faces| Some(OrientedFacet::new(mesh, *faces.first()?, cells))).collect();
        // a cell may be in a body and in a region of it; where two cells meet, no side is the outer one
        let opposite = |face: &Face<D>| cells.cell(face.cell())[face.opposite()];
        let is_inner = beside.iter().any(|faces| faces.iter().any(|face| opposite(face) != opposite(&faces[0])));
        let found: BTreeSet<usize> = beside.iter().flatten().map(|face| body_of_cell[face.cell()]).collect();
        SurfaceFacts {
            bodies: found.into_iter().map(|body| bodies[body].name.clone()).collect(),
            shape: if is_inner || facets.is_empty() { String::new() } else { shape(mesh, group, &facets) },
        }
    };
    let of_group = |group: &Group| {
        if group.dimension + 1 == D { of_surface(group) } else { SurfaceFacts::default() }
    };
    mesh.groups.iter().map(of_group).collect()
}

impl<const D: usize> OrientedFacet<D> {
    fn new(mesh: &Mesh<D>, face: Face<D>, cells: Simplices<D>) -> Self {
        let corners = face.corners().map(|corner| mesh.points[cells.cell(face.cell())[corner] as usize]);
        let edge = |k: usize| minus(corners[(k + 1) % D], corners[k]);
        let (along, next) = (edge(0), edge(1));
        let normal: [f64; D] = if D == 2 {
            std::array::from_fn(|c| if c == 0 { along[1] } else { -along[0] })
        } else {
            let doubled = cross(pad(along), pad(next));
            std::array::from_fn(|c| 0.5 * doubled[c])
        };
        Self {
            centre: std::array::from_fn(|c| corners.iter().map(|x| x[c]).sum::<f64>() / D as f64),
            normal: unit(normal),
            area: length(normal),
        }
    }
}

/// Share of the size of a surface up to which its points may be beside a shape: coordinates of six digits are rounded
/// by 5e-7 of the largest one, which is up to 5e-6 of a surface that is ten times as far away as it is large.
const ON_SHAPE: f64 = 1e-5;

/// Return the shape of a surface in words, from its points and its facets with outer normals; empty if it is none of
/// those that are looked for.
fn shape<const D: usize>(mesh: &Mesh<D>, group: &Group, facets: &[OrientedFacet<D>]) -> String {
    let numbers: BTreeSet<u32> = group.connectivity.iter().copied().collect();
    let points: &[[f64; D]] = &numbers.into_iter().map(|point| mesh.points[point as usize]).collect::<Vec<_>>();
    let [low, high] = crate::linalg::bounds(points.iter().map(|&x| pad(x)));
    let limit = ON_SHAPE * length(minus(high, low));
    let in_scene = |x: &DVector<f64>| place(&(0..D).map(|c| x[c] + mesh.datum[c]).collect::<Vec<_>>(), limit);
    // a hole has its normals towards the centre or the axis
    let side = |from: &dyn Fn(&DVector<f64>) -> DVector<f64>| {
        let outward = |facet: &OrientedFacet<D>| facet.area * from(&column(facet.centre)).dot(&column(facet.normal));
        if facets.iter().map(outward).sum::<f64>() < 0.0 { "hollow " } else { "" }
    };
    let total: f64 = facets.iter().map(|facet| facet.area).sum();
    let normal: DVector<f64> = facets.iter().map(|facet| facet.area / total * column(facet.normal)).sum();
    let across = |x: &[f64; D]| (column(*x) - column(points[0])).dot(&normal).abs();
    if normal.norm() > 0.5 && points.iter().all(|x| across(x) <= limit) {
        let kind = if D == 2 { "straight" } else { "plane" };
        return format!("{kind}, normal {}", vector(normal.normalize().as_slice()));
    }
    let lean = |facet: &OrientedFacet<D>| {
        let lean = column(facet.normal) - &normal;
        facet.area / total * &lean * lean.transpose()
    };
    let spread: DMatrix<f64> = facets.iter().map(lean).sum();
    // the points of a coarse cylinder may be on two circles, which are on a sphere, too
    if D == 3
        && let Some(found) = Turned::through(points, spread, limit)
    {
        let Turned { centre, axis, radius, slope } = &found;
        let side = side(&|x| found.off_axis(x));
        let about = vector((axis * axis[axis.iamax()].signum()).as_slice());
        let through = in_scene(centre);
        return if slope.abs() <= ON_SHAPE {
            format!("{side}cylinder of radius {} about {about} through {through}", readable(*radius, 4))
        } else {
            let angle = readable(slope.abs().atan().to_degrees(), 4);
            format!("{side}cone of {angle} degrees to its axis {about} through {through}")
        };
    }
    if let Some(Ball { centre, radius }) = Ball::through(points, limit) {
        let kind = if D == 2 { "circle" } else { "sphere" };
        let side = side(&|x| x - &centre);
        return format!("{side}{kind} of radius {}, centre {}", readable(radius, 4), in_scene(&centre));
    }
    String::new()
}

fn column<const D: usize>(x: [f64; D]) -> DVector<f64> {
    DVector::from_row_slice(&x)
}

fn middle(points: &[DVector<f64>]) -> DVector<f64> {
    points.iter().sum::<DVector<f64>>() / points.len() as f64
}

/// A circle or a sphere.
struct Ball {
    centre: DVector<f64>,
    radius: f64,
}

impl Ball {
    /// Return the one through these points; `None` if a point is beside it.
    fn through<const D: usize>(points: &[[f64; D]], limit: f64) -> Option<Self> {
        let points: Vec<_> = points.iter().map(|&x| column(x)).collect();
        let found = Self::nearest(&points)?;
        let is_on = points.iter().all(|x| ((x - &found.centre).norm() - found.radius).abs() <= limit);
        (points.len() > D + 1 && is_on).then_some(found)
    }

    /// Return the one that is nearest to these points, from the equations x.x = 2 c.x + r^2 - c.c by least squares.
    fn nearest(points: &[DVector<f64>]) -> Option<Self> {
        let (dimension, middle) = (points[0].len(), middle(points));
        let apart: Vec<DVector<f64>> = points.iter().map(|x| x - &middle).collect();
        let size = apart.iter().map(|x| x.amax()).fold(0.0, f64::max);
        let rows =
            DMatrix::from_fn(points.len(), dimension + 1, |i, c| if c < dimension { apart[i][c] / size } else { 1.0 });
        let squares = DVector::from_iterator(points.len(), apart.iter().map(|x| x.norm_squared() / size));
        let parts = rows.try_svd(true, true, f64::EPSILON, SWEEPS)?;
        // points in a plane leave the place across it free
        let found = parts.solve(&squares, TOLERANCE * parts.singular_values.max()).ok()?;
        let centre = 0.5 * found.rows(0, dimension);
        let radius = (found[dimension] * size + centre.norm_squared()).sqrt();
        Some(Self { centre: centre + middle, radius })
    }
}

/// A cylinder or a cone: the distance from the axis is `radius + slope t` at the place t along the axis from the
/// centre.
#[derive(Clone)]
struct Turned {
    centre: DVector<f64>,
    axis: DVector<f64>,
    radius: f64,
    slope: f64,
}

impl Turned {
    /// Return the one through these points; `None` if a point is beside it. Its axis is near one of the principal
    /// axes of the `spread` of its normals: near that of the least spread, unless facets are few.
    fn through<const D: usize>(points: &[[f64; D]], spread: DMatrix<f64>, limit: f64) -> Option<Self> {
        let axes = SymmetricEigen::try_new(spread, f64::EPSILON, SWEEPS)?.eigenvectors;
        let points: Vec<_> = points.iter().map(|&x| column(x)).collect();
        let (size, middle) = (limit / ON_SHAPE, middle(&points));
        // lengths are shares of the size, so that all parameters count alike
        let points: Vec<_> = points.iter().map(|x| (x - &middle) / size).collect();
        let about = |axis: DVector<f64>| {
            // seen along its axis a cylinder is a circle, and a cone a ring about one
            let seen: Vec<_> = points.iter().map(|x| x - x.dot(&axis) * &axis).collect();
            let Ball { centre, radius } = Ball::nearest(&seen)?;
            let start = Self { centre, axis, radius, slope: 0.0 };
            start.clone().fit(&points, false).or_else(|| start.fit(&points, true))
        };
        let found = axes.column_iter().find_map(|axis| about(axis.into_owned()))?;
        Some(Self { centre: size * &found.centre + middle, radius: size * found.radius, ..found })
    }

    /// Move it nearer to the points by Gauss-Newton steps, as a cylinder or as a cone; `None` if a point stays beside
    /// it.
    fn fit(mut self, points: &[DVector<f64>], is_cone: bool) -> Option<Self> {
        let d = self.axis.len();
        for _ in 0..STEPS {
            let step = self.step(points, is_cone)?;
            self.centre -= step.rows(0, d);
            self.axis = (self.axis - step.rows(d, d)).normalize();
            self.radius -= step[2 * d];
            self.slope -= step[2 * d + 1];
            // the centre stays beside the middle of the points
            let along = self.centre.dot(&self.axis);
            self.centre -= along * &self.axis;
            self.radius -= self.slope * along;
        }
        points.iter().all(|x| self.error(x).abs() <= ON_SHAPE).then_some(self)
    }

    /// Return the Gauss-Newton step of centre, axis, radius and, of a cone, slope. On a narrow strip a slope and a
    /// turn of the axis are nearly the same.
    fn step(&self, points: &[DVector<f64>], is_cone: bool) -> Option<DVector<f64>> {
        let count = 2 * self.axis.len() + 2;
        let (mut products, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for x in points {
            let mut row = self.derivatives(x);
            if !is_cone {
                row[count - 1] = 0.0;
            }
            products.ger(1.0, &row, &row, 1.0);
            right.axpy(self.error(x), &row, 1.0);
        }
        // a motion of the centre along the axis, and a longer axis, change nothing
        let largest = products.diagonal().max();
        products.try_svd(true, true, f64::EPSILON, SWEEPS)?.solve(&right, TOLERANCE * largest).ok()
    }

    /// Return the vector from the axis to a point, across the axis.
    fn off_axis(&self, x: &DVector<f64>) -> DVector<f64> {
        let apart = x - &self.centre;
        &apart - apart.dot(&self.axis) * &self.axis
    }

    /// Return by how much a point is beside the surface.
    fn error(&self, x: &DVector<f64>) -> f64 {
        self.off_axis(x).norm() - self.radius - self.slope * (x - &self.centre).dot(&self.axis)
    }

    /// Return the derivatives of the error by centre, axis, radius and slope.
    fn derivatives(&self, x: &DVector<f64>) -> DVector<f64> {
        let (apart, across) = (x - &self.centre, self.off_axis(x).normalize());
        let along = apart.dot(&self.axis);
        let by_centre = -&across + self.slope * &self.axis;
        // a unit vector changes across itself
        let by_axis = -along * &across - self.slope * (&apart - along * &self.axis);
        let parts = by_centre.iter().chain(&by_axis).copied().chain([-1.0, -along]);
        DVector::from_iterator(2 * x.len() + 2, parts)
    }
}

/// Gauss-Newton steps: more than twice the four that reach the last digit on the cylinders and cones of the test, from
/// the axis that their facets give. What needs more is no such shape, and costs all steps of each start in vain.
const STEPS: usize = 10;

/// Most sweeps of a decomposition of eight unknowns, which takes some dozens, and would not end where a point on the
/// axis makes its entries no numbers.
const SWEEPS: usize = 1000;

/// Return a unit vector in words, without its roundoff.
fn vector(v: &[f64]) -> String {
    place(v, ON_SHAPE)
}

/// Return a place in words; coordinates up to `roundoff` are zero.
pub fn place(x: &[f64], roundoff: f64) -> String {
    let words = |&x: &f64| readable(if x.abs() <= roundoff { 0.0 } else { x }, 4);
    format!("({})", x.iter().map(words).collect::<Vec<_>>().join(", "))
}
