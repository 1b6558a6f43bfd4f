//! Moments on surfaces, as tractions that are linear in the place.

use crate::fem::{Facets, NodalForces, Parts, Space, cross, surface};
use crate::linalg::pad;
use nalgebra::{Matrix3, Vector3};

/// Return the centre of a surface: the mean place over its area.
pub fn centre<const D: usize>(space: &Space<D>, facets: &Facets<D>, parts: Parts) -> [f64; 3] {
    let sum =
        |density: &dyn Fn([f64; D]) -> [f64; D]| surface::surface_load(space, facets, parts, &|x, _| density(x)).sum();
    let area = sum(&|_| std::array::from_fn(|c| if c == 0 { 1.0 } else { 0.0 }))[0];
    sum(&|x| x).map(|sum| sum / area)
}

/// Return nodal forces with a moment (x, y, z; force times length) and without a resultant. In the plane the moment has a z component
/// alone.
///
/// The traction is theta x r with r = x - c, where c is the centre of the surface: stresses of a beam in bending. Its moment is
/// J theta with J = int |r|^2 I - r r^T over the surface. All integrals are those of the quadrature of loads, so that the nodal forces
/// have the moment to rounding on curved facets, too.
pub fn load<const D: usize>(space: &Space<D>, facets: &Facets<D>, parts: Parts, moment: [f64; 3]) -> NodalForces<D> {
    let of = |traction: &dyn Fn([f64; D]) -> [f64; D]| surface::surface_load(space, facets, parts, &|x, _| traction(x));
    let centre = centre(space, facets, parts);
    let from_centre = |x: [f64; D]| {
        let x = pad(x);
        std::array::from_fn(|c| x[c] - centre[c])
    };
    let turn = |theta: [f64; 3]| {
        of(&|x| {
            let traction = cross(theta, from_centre(x));
            std::array::from_fn(|c| traction[c])
        })
    };
    let moment_of = |load: &NodalForces<D>| {
        let of_node = |(node, force)| Vector3::from(cross(from_centre(space.nodes[node as usize]), pad(force)));
        load.iter().map(of_node).sum::<Vector3<f64>>()
    };
    // In the plane bodies turn about z alone. The other axes keep a one on the diagonal.
    let mut inertia = Matrix3::identity();
    for axis in if D == 2 { 2..3 } else { 0..3 } {
        let unit = std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 });
        inertia.set_column(axis, &moment_of(&turn(unit)));
    }
    let theta = inertia.lu().solve(&Vector3::from(moment)).unwrap_or(Vector3::repeat(f64::NAN));
    turn(theta.into())
}
