//! Elasticity of a body: constants of the scene, the same everywhere, by region, or functions of the place.

use super::cross;
use super::material::{Material, Tensor};
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec, Plane};

/// Elasticity of a body, cell by cell.
#[derive(Debug, Clone)]
pub struct Elasticity {
    dimension: usize,
    plane: Plane,
    laws: Vec<Law>,
    /// Law of each cell; empty if all cells have the first one.
    of_cell: Vec<usize>,
}

/// The constants of one region of a body.
#[derive(Debug, Clone)]
struct Law {
    spec: ElasticitySpec,
    /// Hooke's law and moduli if nothing depends on the place.
    constant: Option<(Material, [f64; 3])>,
}

/// Why there is no elasticity at a point.
#[derive(Debug, Clone, PartialEq)]
pub enum Flaw {
    /// A constant (its name, its value) outside what it must be (in words).
    Constant(&'static str, f64, &'static str),
    /// The directions of the material's axes, in words.
    Axes(&'static str),
    /// C is not positive definite (4): its least eigenvalue, or NaN if C is not finite.
    NotCoercive(f64),
    /// The meridian plane of a body of revolution is no plane of symmetry: the body would twist.
    Twists,
}

impl Elasticity {
    /// The elasticity of a body from its own constants (`specs[0]`) and those of its regions; `of_cell` gives the number of
    /// the spec of each cell, or is empty.
    ///
    /// # Errors
    /// Constants without expressions that make no material, with the number of their spec.
    pub fn new(
        specs: &[&ElasticitySpec],
        of_cell: Vec<usize>,
        dimension: usize,
        plane: Plane,
    ) -> Result<Self, (usize, Flaw)> {
        let law = |(index, spec): (usize, &&ElasticitySpec)| {
            let mut law = Law { spec: (*spec).clone(), constant: None };
            if spec.is_constant() {
                let tensor = tensor(spec, [0.0; 3], plane).map_err(|flaw| (index, flaw))?;
                let material = material(spec, tensor, [0.0; 3], dimension, plane);
                law.constant = Some((material, tensor.moduli(dimension, plane)));
            }
            Ok(law)
        };
        Ok(Self { laws: specs.iter().enumerate().map(law).collect::<Result<_, _>>()?, of_cell, dimension, plane })
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.of_cell.is_empty() && self.laws[0].constant.is_some()
    }

    /// The elasticity of some of the cells, numbered as they come.
    pub fn of_cells(&self, cells: &[usize]) -> Self {
        Self { of_cell: cells.iter().map(|&cell| self.region(cell)).collect(), ..self.clone() }
    }

    /// Number of the spec of a cell.
    pub fn region(&self, cell: usize) -> usize {
        self.of_cell.get(cell).copied().unwrap_or(0)
    }

    /// Hooke's law of a cell if it is the same in the whole cell.
    pub fn constant_in(&self, cell: usize) -> Option<&Material> {
        self.laws[self.region(cell)].constant.as_ref().map(|(material, _)| material)
    }

    /// Hooke's law in a cell at a point (z = 0 in the plane), coercive.
    ///
    /// # Errors
    /// Expressions whose values at this point make no material.
    pub fn at(&self, cell: usize, x: [f64; 3]) -> Result<Material, Flaw> {
        let law = &self.laws[self.region(cell)];
        match &law.constant {
            Some((material, _)) => Ok(*material),
            None => {
                let tensor = tensor(&law.spec, x, self.plane)?;
                Ok(material(&law.spec, tensor, x, self.dimension, self.plane))
            }
        }
    }

    /// Moduli along x, y, z ([`Tensor::moduli`]) in a cell at a point.
    ///
    /// # Errors
    /// As [`Elasticity::at`].
    pub fn moduli(&self, cell: usize, x: [f64; 3]) -> Result<[f64; 3], Flaw> {
        let law = &self.laws[self.region(cell)];
        match &law.constant {
            Some((_, moduli)) => Ok(*moduli),
            None => tensor(&law.spec, x, self.plane).map(|tensor| tensor.moduli(self.dimension, self.plane)),
        }
    }
}

fn material(spec: &ElasticitySpec, tensor: Tensor, x: [f64; 3], dimension: usize, plane: Plane) -> Material {
    match &spec.constants {
        Constants::Isotropic { young, poisson } => {
            Material::isotropic(young.eval(x), poisson.eval(x), dimension, plane)
        }
        _ => Material::new(tensor, dimension, plane),
    }
}

/// Moduli that a run computes with: those of known materials are between 1e-30 and 1e30 in all units in use. Energies are products of up to a modulus,
/// two displacements and lengths of [1e-40, 1e40](crate::mesh::LENGTHS), and rounding takes a share of 1e-32 of them; forces are squared.
const MODULI: [f64; 2] = [1e-50, 1e50];

/// Whether a modulus is one that a run computes with.
fn is_modulus(value: f64) -> bool {
    (MODULI[0]..=MODULI[1]).contains(&value)
}

/// C in x, y, z at a point, coercive (4).
fn tensor(spec: &ElasticitySpec, x: [f64; 3], plane: Plane) -> Result<Tensor, Flaw> {
    const POSITIVE: &str = "must be greater than 0";
    const RANGE: &str = "must lie between 1e-50 and 1e50: choose another unit of stress";
    let positive = |name, value: f64| match value > 0.0 && value < f64::INFINITY {
        true if is_modulus(value) => Ok(()),
        true => Err(Flaw::Constant(name, value, RANGE)),
        false => Err(Flaw::Constant(name, value, POSITIVE)),
    };
    let own = match &spec.constants {
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
    if !own.is_coercive() {
        return Err(Flaw::NotCoercive(own.least_eigenvalue()));
    }
    if let Constants::Anisotropic(_) = &spec.constants
        && let Some(value) = (0..6).map(|i| own.0[i][i]).find(|value| !is_modulus(*value))
    {
        return Err(Flaw::Constant("an elastic constant", value, RANGE));
    }
    let tensor = match &spec.axes {
        Some(axes) => own.rotated(&directions(axes, x)?),
        None => own,
    };
    if plane == Plane::Axisymmetric && !tensor.keeps_plane() {
        return Err(Flaw::Twists);
    }
    Ok(tensor)
}

/// Directions 1, 2, 3 of the material at a point: orthonormal rows, right-handed.
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
            (turned([1.0, 0.0, 0.0], axis, angle), turned([0.0, 1.0, 0.0], axis, angle))
        }
    };
    let along: f64 = (0..3).map(|c| first[c] * second[c]).sum();
    let across = std::array::from_fn(|c| second[c] - along * first[c]);
    if norm(across) <= 1e-10 * norm(second) {
        return Err(Flaw::Axes("`first` and `second` have one direction"));
    }
    let second = unit(across, "`second` has no direction")?;
    Ok([first, second, cross(first, second)])
}

/// A vector turned by an angle about a unit axis (Rodrigues).
fn turned(v: [f64; 3], axis: [f64; 3], angle: f64) -> [f64; 3] {
    let (sine, cosine) = angle.sin_cos();
    let along: f64 = (0..3).map(|c| axis[c] * v[c]).sum();
    let across = cross(axis, v);
    std::array::from_fn(|c| cosine * v[c] + sine * across[c] + (1.0 - cosine) * along * axis[c])
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn unit(v: [f64; 3], otherwise: &'static str) -> Result<[f64; 3], Flaw> {
    match norm(v) {
        length if length > 0.0 && length.is_finite() => Ok(v.map(|v| v / length)),
        _ => Err(Flaw::Axes(otherwise)),
    }
}
