//! Elasticity of a body from the constants of the scene, which are the same everywhere, differ by region, or depend on the point.

use super::material::{Material, Tensor};
use super::{cross, length};
use crate::linalg::dot;
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, Plane};

/// The elasticity of a body, cell by cell.
#[derive(Debug, Clone)]
pub struct Elasticity {
    dimension: usize,
    plane: Plane,
    regions: Vec<Region>,
    /// Region of each cell; empty if all cells have the first one.
    of_cell: Vec<usize>,
}

/// The elastic constants of one region of a body.
#[derive(Debug, Clone)]
struct Region {
    spec: ElasticitySpec,
    /// Hooke's law and moduli if they do not depend on the point.
    constant: Option<(Material, [f64; 3])>,
}

/// The reason why there is no elasticity at a point.
#[derive(Debug, Clone, PartialEq)]
pub enum Flaw {
    /// A constant is invalid: its name, its value, and the requirement in words.
    Constant(&'static str, f64, &'static str),
    /// The directions of the material's axes are invalid, in words.
    Axes(&'static str),
    /// C is not positive definite (4): its least eigenvalue, or NaN if C is not finite.
    NotCoercive(f64),
    /// The meridian plane of a body of revolution is not a plane of symmetry, so that the body would twist.
    Twists,
}

impl Region {
    fn new(spec: &ElasticitySpec, dimension: usize, plane: Plane) -> Result<Self, Flaw> {
        let mut region = Self { spec: spec.clone(), constant: None };
        if spec.is_constant() {
            let tensor = tensor(spec, [0.0; 3], plane)?;
            let material = material(spec, tensor, [0.0; 3], dimension, plane);
            region.constant = Some((material, tensor.moduli(dimension, plane)));
        }
        Ok(region)
    }
}

impl Elasticity {
    /// Make the elasticity of a body from its own constants (`specs[0]`) and those of its regions. `of_cell` gives the index of
    /// the spec of each cell, or is empty.
    ///
    /// # Errors
    /// Constants without expressions that are not a valid material, with the index of their spec.
    pub fn new(
        specs: &[&ElasticitySpec],
        of_cell: Vec<usize>,
        dimension: usize,
        plane: Plane,
    ) -> Result<Self, (usize, Flaw)> {
        let region = |(index, spec): (usize, &&ElasticitySpec)| {
            Region::new(spec, dimension, plane).map_err(|flaw| (index, flaw))
        };
        Ok(Self { regions: specs.iter().enumerate().map(region).collect::<Result<_, _>>()?, of_cell, dimension, plane })
    }

    /// Return whether the elasticity is the same in the whole body.
    pub fn is_constant(&self) -> bool {
        self.of_cell.is_empty() && self.regions[0].constant.is_some()
    }

    /// Return the elasticity of some of the cells, which are renumbered in the given order.
    pub fn of_cells(&self, cells: &[usize]) -> Self {
        Self { of_cell: cells.iter().map(|&cell| self.region(cell)).collect(), ..self.clone() }
    }

    /// Return the index of the spec of a cell.
    pub fn region(&self, cell: usize) -> usize {
        self.of_cell.get(cell).copied().unwrap_or(0)
    }

    /// Return Hooke's law of a cell if it is the same in the whole cell.
    pub fn constant_in(&self, cell: usize) -> Option<&Material> {
        self.regions[self.region(cell)].constant.as_ref().map(|(material, _)| material)
    }

    /// Return Hooke's law, which is coercive, in a cell at a point of the scene (z = 0 in the plane).
    ///
    /// # Errors
    /// Expressions whose values at this point are not a valid material.
    pub fn at(&self, cell: usize, x: [f64; 3]) -> Result<Material, Flaw> {
        let region = &self.regions[self.region(cell)];
        match &region.constant {
            Some((material, _)) => Ok(*material),
            None => {
                let tensor = tensor(&region.spec, x, self.plane)?;
                Ok(material(&region.spec, tensor, x, self.dimension, self.plane))
            }
        }
    }

    /// Return the moduli along x, y, z ([`Tensor::moduli`]) in a cell at a point.
    ///
    /// # Errors
    /// As [`Elasticity::at`].
    pub fn moduli(&self, cell: usize, x: [f64; 3]) -> Result<[f64; 3], Flaw> {
        let region = &self.regions[self.region(cell)];
        match &region.constant {
            Some((_, moduli)) => Ok(*moduli),
            None => tensor(&region.spec, x, self.plane).map(|tensor| tensor.moduli(self.dimension, self.plane)),
        }
    }
}

/// Return Hooke's law of a spec at a point, where C is `tensor`.
fn material(spec: &ElasticitySpec, tensor: Tensor, x: [f64; 3], dimension: usize, plane: Plane) -> Material {
    match &spec.constants {
        Constants::Isotropic { young, poisson } => {
            Material::isotropic(young.eval(x), poisson.eval(x), dimension, plane)
        }
        _ => Material::new(tensor, dimension, plane),
    }
}

/// Range of the moduli that a run computes with. The moduli of known materials are between 1e-30 and 1e30 in all units in use.
///
/// Energies are products of at most a modulus, two displacements and lengths of [1e-40, 1e40](crate::mesh::LENGTHS). Rounding takes a
/// share of 1e-32 of them, and forces are squared.
const MODULI: [f64; 2] = [1e-50, 1e50];

/// Return whether a modulus is in this range.
fn is_modulus(value: f64) -> bool {
    (MODULI[0]..=MODULI[1]).contains(&value)
}

/// Return the coercive tensor C (4) in x, y, z at a point.
fn tensor(spec: &ElasticitySpec, x: [f64; 3], plane: Plane) -> Result<Tensor, Flaw> {
    const POSITIVE: &str = "must be greater than 0";
    const RANGE: &str = "must lie between 1e-50 and 1e50: choose another unit of stress";
    let positive = |name, value: f64| match value > 0.0 && value < f64::INFINITY {
        true if is_modulus(value) => Ok(()),
        true => Err(Flaw::Constant(name, value, RANGE)),
        false => Err(Flaw::Constant(name, value, POSITIVE)),
    };
    let in_axes = match &spec.constants {
        Constants::Isotropic { young, poisson } => {
            let (young, poisson) = (young.eval(x), poisson.eval(x));
            positive("young", young)?;
            if !(poisson > -1.0 && poisson < 0.5) {
                return Err(Flaw::Constant("poisson", poisson, "must lie between -1 and 0.5"));
            }
            Tensor::isotropic(young, poisson)
        }
        Constants::Orthotropic(fields) => {
            let values = fields.each_ref().map(|field| field.eval(x));
            for (name, value) in Constants::ORTHOTROPIC.into_iter().zip(values) {
                if name.starts_with("nu") {
                    if !value.is_finite() {
                        return Err(Flaw::Constant(name, value, "must be finite"));
                    }
                } else {
                    positive(name, value)?;
                }
            }
            Tensor::orthotropic(&values).ok_or(Flaw::NotCoercive(f64::NAN))?
        }
        Constants::Anisotropic(fields) => Tensor::anisotropic(&fields.each_ref().map(|field| field.eval(x))),
    };
    if !in_axes.is_coercive() {
        return Err(Flaw::NotCoercive(in_axes.least_eigenvalue()));
    }
    if let Constants::Anisotropic(_) = &spec.constants
        && let Some(value) = (0..6).map(|i| in_axes.0[i][i]).find(|value| !is_modulus(*value))
    {
        return Err(Flaw::Constant("an elastic constant", value, RANGE));
    }
    let tensor = match &spec.axes {
        Some(axes) => in_axes.rotated(&directions(axes, x)?),
        None => in_axes,
    };
    if plane == Plane::Axisymmetric && !tensor.keeps_plane() {
        return Err(Flaw::Twists);
    }
    Ok(tensor)
}

/// Return the directions 1, 2, 3 of the material at a point, as right-handed orthonormal rows.
fn directions(axes: &AxesSpec, x: [f64; 3]) -> Result<[[f64; 3]; 3], Flaw> {
    let (first, second) = match axes {
        AxesSpec::Directions { first, second } => {
            let first = unit(first.each_ref().map(|field| field.eval(x)), "`first` has no direction")?;
            let second = match second {
                Some(second) => second.each_ref().map(|field| field.eval(x)),
                None => cross([0.0, 0.0, 1.0], first),
            };
            (first, second)
        }
        AxesSpec::Angle { angle, axis } => {
            let axis = unit(axis.each_ref().map(|field| field.eval(x)), "`axis` has no direction")?;
            let angle = angle.eval(x);
            if !angle.is_finite() {
                return Err(Flaw::Constant("angle", angle, "must be finite"));
            }
            (rotated([1.0, 0.0, 0.0], axis, angle), rotated([0.0, 1.0, 0.0], axis, angle))
        }
    };
    let along = dot(&first, &second);
    let across = std::array::from_fn(|c| second[c] - along * first[c]);
    if length(across) <= 1e-10 * length(second) {
        return Err(Flaw::Axes("`first` and `second` have one direction"));
    }
    let second = unit(across, "`second` has no direction")?;
    Ok([first, second, cross(first, second)])
}

/// Return a vector rotated by an angle about a unit axis (Rodrigues).
fn rotated(v: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let (sine, cosine) = angle.sin_cos();
    let along = dot(&axis, &v);
    let across = cross(axis, v);
    std::array::from_fn(|c| cosine * v[c] + sine * across[c] + (1.0 - cosine) * along * axis[c])
}

/// Return the vector scaled to length one.
///
/// # Errors
/// `otherwise` if its length is zero or not finite.
fn unit(v: [f64; 3], otherwise: &'static str) -> Result<[f64; 3], Flaw> {
    match length(v) {
        size if size > 0.0 && size.is_finite() => Ok(v.map(|v| v / size)),
        _ => Err(Flaw::Axes(otherwise)),
    }
}
