//! Elasticity of the bodies of a scene: constants, regions, and errors that name body and place.

use super::find::{find_group, not_on_body, of_body, point};
use crate::error::{Error, Result, shown};
use crate::fem::Space;
use crate::fem::elasticity::{Elasticity, Flaw};
use crate::mesh::Mesh;
use crate::problem::{BodySpec, Constants, ElasticitySpec, Order, Plane};

/// Return the elasticity of the cells of a body.
///
/// # Errors
/// A region is missing, lies on another body or overlaps another one, or constants make no material.
pub fn of<const D: usize>(spec: &BodySpec, space: &Space<D>, mesh: &Mesh<D>, plane: Plane) -> Result<Elasticity> {
    let mut of_cell = vec![0; if spec.regions.is_empty() { 0 } else { space.cell_count() }];
    for (number, region) in spec.regions.iter().enumerate() {
        let cells = space.cells_in(find_group(mesh, &region.on, &[D], "region")?);
        if cells.is_empty() {
            return Err(not_on_body(&region.on, &spec.name.value));
        }
        for cell in cells {
            if of_cell[cell] != 0 {
                let (first, second) = (&spec.regions[of_cell[cell] - 1].on.value, &region.on.value);
                let at = point(space.in_scene(space.centroid(cell)));
                let message = format!("the regions `{first}` and `{second}` share the cell at {at}");
                return Err(Error::scene(&region.on.place, message).help("let each cell be in one region at most"));
            }
            of_cell[cell] = number + 1;
        }
    }
    of_regions(spec, of_cell, D, plane)
}

/// Return the elasticity of some cells of a body. `of_cell` is the index of the constants of each cell; it is empty if the body
/// has no regions.
///
/// # Errors
/// Constants make no material.
pub fn of_regions(spec: &BodySpec, of_cell: Vec<usize>, dimension: usize, plane: Plane) -> Result<Elasticity> {
    let specs: Vec<&ElasticitySpec> = specs(spec).collect();
    Elasticity::new(&specs, of_cell, dimension, plane).map_err(|(number, flaw)| refusal(spec, number, None, &flaw))
}

fn specs(spec: &BodySpec) -> impl Iterator<Item = &ElasticitySpec> {
    std::iter::once(&spec.elasticity).chain(spec.regions.iter().map(|region| &region.elasticity))
}

/// Return the error of the constants of a body (`number` 0) or of one of its regions. The point is given if the constants depend
/// on it.
pub fn refusal(spec: &BodySpec, number: usize, x: Option<[f64; 3]>, flaw: &Flaw) -> Error {
    let elasticity = specs(spec).nth(number).unwrap_or(&spec.elasticity);
    let place = &elasticity.place;
    let fields = elasticity.fields();
    // A value that does not exist causes every other flaw, so it is reported first.
    if let Some(error) = x.and_then(|x| fields.iter().find_map(|(name, field)| field.eval_finite(name, x).err())) {
        return error.because(of_body(&spec.name.value));
    }
    let at = x.map(|x| format!(" at {}", point(x))).unwrap_or_default();
    let name = &spec.name.value;
    match flaw {
        Flaw::Constant(constant, value, rule) => {
            let own = fields.iter().find(|(name, _)| name == constant).and_then(|(_, field)| field.place());
            Error::scene(own.unwrap_or(place), format!("body `{name}`: {constant} is {}{at}", shown(*value)))
                .label(*rule)
        }
        Flaw::Axes(what) => Error::scene(place, format!("body `{name}`: axes{at}: {what}")),
        Flaw::NotCoercive(eigenvalue) => {
            let value = if eigenvalue.is_finite() {
                format!("the least eigenvalue of C is {eigenvalue:.6e}")
            } else {
                "C is not finite".to_owned()
            };
            Error::scene(place, format!("body `{name}`: the elasticity tensor is not positive definite{at}"))
                .label(value)
                .help("a strain must cost energy, whatever its direction: look for a slip among the constants")
        }
        Flaw::Twists => Error::scene(place, format!("body `{name}`: a body of revolution would twist{at}"))
            .label("strains of the meridian cause shear stresses along the circles")
            .help("in axisymmetric scenes one axis of the material runs along the circles: turn axes 1 and 2 alone"),
    }
}

/// Return the moduli against pressure along x, y, z, integrated over some cells. A cell whose constants make no material at its
/// middle contributes zero; assembly refuses it.
pub fn moduli<const D: usize>(
    space: &Space<D>,
    elasticity: &Elasticity,
    cells: impl Iterator<Item = usize>,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for cell in cells {
        let moduli = elasticity.moduli(cell, space.in_scene(space.centroid(cell))).unwrap_or_default();
        crate::contact::add(&mut sum, moduli.map(|modulus| space.share(cell) * modulus));
    }
    sum
}

/// Return the largest Poisson's ratio of a body with linear elements at these points of the scene. It is zero for elements that
/// do not lock, which are those in plane stress and those of second order.
pub fn poisson(spec: &BodySpec, dimension: usize, own: impl Iterator<Item = [f64; 3]> + Clone, plane: Plane) -> f64 {
    if spec.order == Order::P2 || (dimension == 2 && plane == Plane::Stress) {
        return 0.0;
    }
    let largest = |spec: &ElasticitySpec| match &spec.constants {
        Constants::Isotropic { poisson, .. } => own.clone().map(|x| poisson.eval(x)).fold(0.0, f64::max),
        _ => 0.0,
    };
    specs(spec).map(largest).fold(0.0, f64::max)
}

/// Return a warning if the largest Poisson's ratio is so large that linear elements are too stiff. There the volume can hardly
/// change.
pub fn warning(spec: &BodySpec, poisson: f64) -> Option<String> {
    (poisson > LOCKING).then(|| {
        let name = &spec.name.value;
        format!("body {name}: Poisson's ratio is {poisson}: linear elements are far too stiff there; set order = 2")
    })
}

/// Poisson's ratio above which linear elements lock.
const LOCKING: f64 = 0.49;
