//! Elasticity of a body: Hooke's law sigma = C eps (2) at a point, the bounds on C (4), and constants of the scene that
//! are the same everywhere, differ by region, or depend on the point.

use super::space::{PAIRS, Slope, component};
use super::{cross, length};
use crate::error::Located;
use crate::expression::Field;
use crate::linalg::dot;
use crate::problem::Plane;
use crate::problem::elasticity::{AxesSpec, Constants, ElasticitySpec};
use crate::problem::{OneOrVector, Vector};
use nalgebra::{Matrix3, Matrix6, Rotation3, Unit, Vector3};

/// The elasticity of a body, cell by cell.
#[derive(Debug, Clone)]
pub struct Elasticity {
    dimension: usize,
    plane: Plane,
    regions: Vec<MaterialRegion>,
    /// Region of each cell; empty if all cells have the first one.
    of_cell: Vec<usize>,
    /// Temperature above that of the stress-free body, if there is one, and its factor in a load step.
    temperature: Option<(Field, f64)>,
}

/// The elastic constants of one region of a body.
#[derive(Debug, Clone)]
struct MaterialRegion {
    spec: ElasticitySpec,
    /// Hooke's law and moduli if they do not depend on the point.
    constant: Option<(Material, [f64; 3])>,
}

/// Elasticities are equal if the constants of all cells are. Expansion and temperature are loads.
impl PartialEq for Elasticity {
    fn eq(&self, other: &Self) -> bool {
        let both = self.regions.iter().map(|region| &region.spec).eq(other.regions.iter().map(|region| &region.spec));
        both && (self.dimension, self.plane, &self.of_cell) == (other.dimension, other.plane, &other.of_cell)
    }
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

impl MaterialRegion {
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
    /// Make the elasticity of a body from its own constants (`specs[0]`) and those of its regions. `of_cell` gives the
    /// index of the spec of each cell, or is empty.
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
            MaterialRegion::new(spec, dimension, plane).map_err(|flaw| (index, flaw))
        };
        let regions = specs.iter().enumerate().map(region).collect::<Result<_, _>>()?;
        Ok(Self { regions, of_cell, dimension, plane, temperature: None })
    }

    /// Return the elasticity at `factor` times this temperature above that of the stress-free body.
    #[must_use]
    pub fn heated(self, field: Field, factor: f64) -> Self {
        Self { temperature: Some((field, factor)), ..self }
    }

    /// Return whether the body has a temperature.
    pub fn is_heated(&self) -> bool {
        self.temperature.is_some()
    }

    /// Return the initial strain alpha T (xx yy zz, and 2 eps of xy yz xz) in a cell at a point; zero without heat.
    ///
    /// # Errors
    /// A temperature or an expansion that is not finite there.
    pub fn initial_strain(&self, cell: usize, x: [f64; 3]) -> Result<[f64; 6], Flaw> {
        let Some((field, factor)) = &self.temperature else { return Ok([0.0; 6]) };
        let temperature = factor * field.eval(x);
        if !temperature.is_finite() {
            return Err(Flaw::Constant("temperature", temperature, FINITE));
        }
        Ok(self.expansion(cell, x)?.map(|alpha| alpha * temperature))
    }

    /// Return the strain a degree (xx yy zz, and 2 eps of xy yz xz) in a cell at a point; zero without heat.
    ///
    /// # Errors
    /// As [`Elasticity::initial_strain`].
    pub fn expansion(&self, cell: usize, x: [f64; 3]) -> Result<[f64; 6], Flaw> {
        let spec = &self.regions[self.region(cell)].spec;
        let Some(given) = spec.expansion.as_ref().filter(|_| self.is_heated()) else { return Ok([0.0; 6]) };
        let alpha: [f64; 3] = std::array::from_fn(|axis| given[axis].eval(x));
        if let Some(value) = alpha.into_iter().find(|value| !value.is_finite()) {
            return Err(Flaw::Constant("expansion", value, FINITE));
        }
        let axes = match (given, &spec.axes) {
            (OneOrVector::Vector(_), Some(axes)) => directions(axes, x)?,
            _ => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
        let strain = std::array::from_fn(|component| {
            let (i, j) = PAIRS[component];
            let once: f64 = (0..3).map(|axis| alpha[axis] * axes[axis][i] * axes[axis][j]).sum();
            if i == j { once } else { 2.0 * once }
        });
        let largest = alpha.iter().fold(0.0, |most: f64, alpha| most.max(alpha.abs()));
        if self.plane == Plane::Axisymmetric && strain[4..].iter().any(|s: &f64| s.abs() > TWISTLESS * largest) {
            return Err(Flaw::Twists);
        }
        Ok(strain)
    }

    /// Return the stress (xx yy zz xy yz xz) of a strain (xx yy zz, and 2 eps of xy yz xz) in a cell at a point:
    /// C (eps - alpha T).
    ///
    /// # Errors
    /// As [`Elasticity::at`] and [`Elasticity::initial_strain`].
    pub fn stress(&self, cell: usize, x: [f64; 3], strain: &[f64; 6]) -> Result<[f64; 6], Flaw> {
        let initial = self.initial_strain(cell, x)?;
        Ok(self.at(cell, x)?.stress(&std::array::from_fn(|i| strain[i] - initial[i])))
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

    /// Return whether the elasticity is the same in a whole cell.
    pub fn is_constant_in(&self, cell: usize) -> bool {
        self.regions[self.region(cell)].constant.is_some()
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

    /// Return Young's modulus in a cell at a point, for an anisotropic material the mean of its moduli along x, y and
    /// z.
    ///
    /// # Errors
    /// As [`Elasticity::at`].
    pub fn young(&self, cell: usize, x: [f64; 3]) -> Result<f64, Flaw> {
        let spec = &self.regions[self.region(cell)].spec;
        match &spec.constants {
            Constants::Isotropic { young, .. } => Ok(young.eval(x)),
            _ => tensor(spec, x, self.plane).map(|tensor| tensor.young()),
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

/// Range of the moduli that a run computes with. The moduli of known materials are between 1e-30 and 1e30 in all units
/// in use.
///
/// Energies are products of at most a modulus, two displacements and lengths of [1e-40, 1e40](crate::mesh::LENGTHS).
/// Rounding takes a share of 1e-32 of them, and forces are squared.
const MODULI: [f64; 2] = [1e-50, 1e50];

/// Requirement on temperatures and expansions.
const FINITE: &str = "must be finite";

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
    let at = |direction: &Option<Located<Vector>>, usual: [f64; 3]| {
        direction.as_ref().map_or(usual, |vector| vector.each_ref().map(|field| field.eval(x)))
    };
    let along_z = [0.0, 0.0, 1.0];
    let (first, second) = if let Some(angle) = &axes.angle {
        let axis = unit(at(&axes.axis, along_z), "`axis` has no direction")?;
        let angle = angle.eval(x);
        if !angle.is_finite() {
            return Err(Flaw::Constant("angle", angle, "must be finite"));
        }
        let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis.into()), angle);
        ((turn * Vector3::x()).into(), (turn * Vector3::y()).into())
    } else {
        let first = unit(at(&axes.first, [0.0; 3]), "`first` has no direction")?;
        (first, at(&axes.second, cross(along_z, first)))
    };
    let along = dot(&first, &second);
    let across = std::array::from_fn(|c| second[c] - along * first[c]);
    if length(across) <= 1e-10 * length(second) {
        return Err(Flaw::Axes("`first` and `second` have one direction"));
    }
    let second = unit(across, "`second` has no direction")?;
    Ok([first, second, cross(first, second)])
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

/// Index in xx yy zz xy yz xz of each component in Voigt's order 11 22 33 23 13 12.
const VOIGT: [usize; 6] = [0, 1, 2, 4, 5, 3];

/// Least eigenvalue of a coercive matrix with ones on its diagonal; a smaller one is zero in double precision.
const SINGULAR: f64 = 1e-13;

/// Share of the largest entry of C below which an entry is the rounding of rotated axes.
const TWISTLESS: f64 = 1e-12;

/// The elasticity tensor C of space as a symmetric matrix with the unit of stress.
///
/// Stress (xx yy zz xy yz xz) is C times strain in the same order, where shear strains count twice (2 eps_xy).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tensor(pub [[f64; 6]; 6]);

impl Tensor {
    /// Make the isotropic tensor from Young's modulus > 0 and Poisson's ratio in (-1, 1/2).
    pub fn isotropic(young: f64, poisson: f64) -> Self {
        let (lambda, mu) = lame(young, poisson);
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            c[i][..3].fill(lambda);
            c[i][i] += 2.0 * mu;
            c[i + 3][i + 3] = mu;
        }
        Self(c)
    }

    /// Make the orthotropic tensor with axes 1, 2, 3 along x, y, z from E1 E2 E3, nu12 nu13 nu23 and G12 G13 G23. Here
    /// nu12 is the contraction along 2 under tension along 1. Return `None` if the stiffness for these moduli is not
    /// finite.
    pub fn orthotropic(constants: &[f64; 9]) -> Option<Self> {
        let [e1, e2, e3, nu12, nu13, nu23, g12, g13, g23] = *constants;
        let (s12, s13, s23) = (-nu12 / e1, -nu13 / e1, -nu23 / e2);
        let compliance = Matrix3::new(1.0 / e1, s12, s13, s12, 1.0 / e2, s23, s13, s23, 1.0 / e3);
        let normal = compliance.try_inverse()?;
        let mut c = [[0.0; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                c[i][j] = 0.5 * (normal[(i, j)] + normal[(j, i)]);
            }
        }
        (c[3][3], c[4][4], c[5][5]) = (g12, g23, g13);
        Some(Self(c))
    }

    /// Make the tensor from the 21 constants C11 C12 ... C16 C22 ... C66, the upper triangle by rows in Voigt's order
    /// 11 22 33 23 13 12.
    pub fn anisotropic(constants: &[f64; 21]) -> Self {
        let mut c = [[0.0; 6]; 6];
        let mut rest = constants.iter();
        for (k, &i) in VOIGT.iter().enumerate() {
            for (&j, &value) in VOIGT[k..].iter().zip(&mut rest) {
                (c[i][j], c[j][i]) = (value, value);
            }
        }
        Self(c)
    }

    /// Return the tensor in x, y, z of a material whose axes 1, 2, 3 have the directions `axes[0..3]` (orthonormal
    /// rows).
    pub fn rotated(&self, axes: &[[f64; 3]; 3]) -> Self {
        // The stress in x, y, z is `bond` times the stress in the material's axes. Since work does not depend on the
        // axes, strains are transformed by the transpose.
        let bond = Matrix6::from_fn(|row, column| {
            let ((i, j), (a, b)) = (PAIRS[row], PAIRS[column]);
            let once = axes[a][i] * axes[b][j];
            if a == b { once } else { once + axes[b][i] * axes[a][j] }
        });
        let turned = bond * self.matrix() * bond.transpose();
        Self(std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (turned[(i, j)] + turned[(j, i)]))))
    }

    /// Return whether the plane x, y is a plane of symmetry, whose strains cause no shear out of it beyond rounding.
    pub fn keeps_plane(&self) -> bool {
        let largest = self.0.as_flattened().iter().fold(0.0, |max: f64, c| max.max(c.abs()));
        (0..4).all(|i| [4, 5].iter().all(|&j| self.0[i][j].abs() <= TWISTLESS * largest))
    }

    fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.0[i][j])
    }

    /// Return whether C eps : eps > 0 for every strain eps (4), beyond rounding.
    pub fn is_coercive(&self) -> bool {
        // The matrix is scaled to ones on the diagonal. With NaN it has no Cholesky factor.
        let root: [f64; 6] = std::array::from_fn(|i| self.0[i][i].sqrt());
        let scaled = Matrix6::from_fn(|i, j| self.0[i][j] / root[i] / root[j]);
        (scaled - SINGULAR * Matrix6::identity()).cholesky().is_some()
    }

    /// Return the least C eps : eps over strains with eps : eps = 1, which does not depend on the axes; NaN if C is not
    /// finite.
    pub fn least_eigenvalue(&self) -> f64 {
        if self.0.as_flattened().iter().any(|c| !c.is_finite()) {
            return f64::NAN;
        }
        let unit = |i: usize| if i < 3 { 1.0 } else { f64::sqrt(2.0) };
        Matrix6::from_fn(|i, j| unit(i) * unit(j) * self.0[i][j]).symmetric_eigenvalues().min()
    }

    /// Return the mean of Young's moduli along x, y and z.
    fn young(&self) -> f64 {
        self.matrix().try_inverse().map_or(f64::NAN, |s| (0..3).map(|i| 1.0 / s[(i, i)]).sum::<f64>() / 3.0)
    }

    /// Return the stiffness against uniaxial stress along x, y and z of a body that is constrained in one direction
    /// across it, as the mean for both directions. It is E/(1 - nu^2) if the material is isotropic.
    ///
    /// In plane problems z is constrained (plane strain, bodies of revolution) or free (plane stress), and the z entry
    /// is zero.
    pub fn moduli(&self, dimension: usize, plane: Plane) -> [f64; 3] {
        let Some(s) = self.matrix().try_inverse() else { return [0.0; 3] };
        let constrained = |i: usize, j: usize| 1.0 / (s[(i, i)] - s[(i, j)].powi(2) / s[(j, j)]);
        std::array::from_fn(|i| match (dimension, plane) {
            (2, _) if i == 2 => 0.0,
            (2, Plane::Strain | Plane::Axisymmetric) => constrained(i, 2),
            (2, Plane::Stress) => 1.0 / s[(i, i)],
            _ => 0.5 * (constrained(i, (i + 1) % 3) + constrained(i, (i + 2) % 3)),
        })
    }

    /// Return the tensor for the strains xx, yy, xy if the stresses zz, yz, xz vanish. Their rows and columns are zero.
    fn plane_stress(&self) -> Self {
        const IN: [usize; 3] = [0, 1, 3];
        const OUT: [usize; 3] = [2, 4, 5];
        let block = |rows: [usize; 3], columns: [usize; 3]| Matrix3::from_fn(|i, j| self.0[rows[i]][columns[j]]);
        let mut c = [[0.0; 6]; 6];
        // Since (4) holds, the block can be inverted.
        if let Some(inverse) = block(OUT, OUT).try_inverse() {
            let reduced = block(IN, IN) - block(IN, OUT) * inverse * block(OUT, IN);
            for (i, &row) in IN.iter().enumerate() {
                for (j, &column) in IN.iter().enumerate() {
                    c[row][column] = 0.5 * (reduced[(i, j)] + reduced[(j, i)]);
                }
            }
        }
        Self(c)
    }
}

/// Return Lamé's lambda and mu from Young's modulus and Poisson's ratio.
fn lame(young: f64, poisson: f64) -> (f64, f64) {
    (young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson)))
}

/// Hooke's law of a body in its dimension. Its C is that of space, which also holds for plane strain, or that of plane
/// stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Stress (xx yy zz xy yz xz) per strain.
    stiffness: Tensor,
    /// Lamé's lambda (for plane stress the reduced one) and mu if the material is isotropic.
    lame: Option<(f64, f64)>,
}

impl Material {
    /// Make the isotropic law from Young's modulus and Poisson's ratio, in `dimension` 2 or 3 (`plane` matters in 2
    /// only).
    pub fn isotropic(young: f64, poisson: f64, dimension: usize, plane: Plane) -> Self {
        let (lambda, mu) = lame(young, poisson);
        let reduced = match (dimension, plane) {
            (2, Plane::Stress) => 2.0 * lambda * mu / (lambda + 2.0 * mu),
            _ => lambda,
        };
        Self { lame: Some((reduced, mu)), ..Self::new(Tensor::isotropic(young, poisson), dimension, plane) }
    }

    /// Make the law from a coercive tensor of space.
    pub fn new(tensor: Tensor, dimension: usize, plane: Plane) -> Self {
        let stiffness = if dimension == 2 && plane == Plane::Stress { tensor.plane_stress() } else { tensor };
        Self { stiffness, lame: None }
    }

    /// Add `weight` times the D x D blocks B_a' C B_b of the stiffness density for all nodes a <= b to `local[a n +
    /// b]`.
    ///
    /// B_a gives the strain for the displacement of node a, and n is the number of nodes. `gradient[a]` is the gradient
    /// of the shape function of node a. In a body of revolution `hoop[a]` is this function over the radius; in others
    /// `hoop` is empty.
    pub fn accumulate<const D: usize>(
        &self,
        gradient: &[[f64; D]],
        hoop: &[f64],
        weight: f64,
        local: &mut [[[f64; D]; D]],
    ) {
        match self.lame {
            Some((lambda, mu)) if hoop.is_empty() => isotropic_blocks(weight * lambda, weight * mu, gradient, local),
            _ => self.blocks(gradient, hoop, weight, local),
        }
    }

    /// Return the blocks of [`Material::accumulate`] for all ordered pairs of gradients.
    pub fn blocks_of<const D: usize>(&self, gradient: &[[f64; D]], weight: f64) -> Vec<[[f64; D]; D]> {
        let n = gradient.len();
        let mut local = vec![[[0.0; D]; D]; n * n];
        self.accumulate(gradient, &[], weight, &mut local);
        for a in 0..n {
            for b in 0..a {
                let upper = local[b * n + a];
                local[a * n + b] = std::array::from_fn(|i| std::array::from_fn(|j| upper[j][i]));
            }
        }
        local
    }

    /// Do the same as [`Material::accumulate`] for any tensor C.
    fn blocks<const D: usize>(&self, gradient: &[[f64; D]], hoop: &[f64], weight: f64, local: &mut [[[f64; D]; D]]) {
        let n = gradient.len();
        for b in 0..n {
            for j in 0..D {
                let mut slope = Slope::<D>::ZERO;
                slope.h[j] = gradient[b].map(|g| weight * g);
                slope.hoop = hoop.get(b).filter(|_| j == 0).map_or(0.0, |hoop| weight * hoop);
                let stress = self.stress(&slope.strain());
                for a in 0..=b {
                    let block = &mut local[a * n + b];
                    for i in 0..D {
                        let force: f64 = (0..D).map(|k| stress[component(i, k)] * gradient[a][k]).sum();
                        block[i][j] += force;
                    }
                    block[0][j] += hoop.get(a).map_or(0.0, |hoop| stress[2] * hoop);
                }
            }
        }
    }

    /// Return the stress (xx yy zz xy yz xz) of a strain (xx yy zz, and 2 eps of xy yz xz) (2).
    pub fn stress(&self, strain: &[f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| (0..6).map(|j| self.stiffness.0[i][j] * strain[j]).sum())
    }
}

/// Add the blocks lambda a_i b_j + mu a_j b_i + mu (a.b) delta_ij for all pairs a, b of gradients.
fn isotropic_blocks<const D: usize>(lambda: f64, mu: f64, gradient: &[[f64; D]], local: &mut [[[f64; D]; D]]) {
    let n = gradient.len();
    for (i_a, a) in gradient.iter().enumerate() {
        for (i_b, b) in gradient.iter().enumerate().skip(i_a) {
            let product: f64 = (0..D).map(|i| a[i] * b[i]).sum();
            let block = &mut local[i_a * n + i_b];
            for i in 0..D {
                for j in 0..D {
                    block[i][j] += lambda * a[i] * b[j] + mu * a[j] * b[i];
                }
                block[i][i] += mu * product;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::space::strain;

    /// A stable material without any symmetry, the constants C11 C12 ... C66 in Voigt's order.
    const TRICLINIC: [f64; 21] = [
        20.0, 7.0, 6.0, 1.1, -0.7, 0.9, 15.0, 5.0, -1.3, 0.4, 0.8, 12.0, 0.6, 1.2, -0.5, 4.0, 0.3, -0.2, 5.0, 0.7, 6.0,
    ];

    const ORTHOTROPIC: [f64; 9] = [150.0, 11.0, 9.0, 0.31, 0.27, 0.41, 5.0, 4.5, 3.5];

    fn material<const D: usize>(tensor: Tensor, plane: Plane) -> Material {
        Material::new(tensor, D, plane)
    }

    /// Return C_ijkl of the constants in Voigt's order, by the definition.
    fn full(constants: &[f64; 21], i: usize, j: usize, k: usize, l: usize) -> f64 {
        const NUMBER: [[usize; 3]; 3] = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];
        let (p, q) = (NUMBER[i][j].min(NUMBER[k][l]), NUMBER[i][j].max(NUMBER[k][l]));
        constants[p * 6 - p * (p + 1) / 2 + q]
    }

    /// Return orthonormal rows, rotated about two axes.
    fn some_axes() -> [[f64; 3]; 3] {
        let ((s, c), (t, d)) = (0.6f64.sin_cos(), 1.1f64.sin_cos());
        [[c, s, 0.0], [-s * d, c * d, t], [s * t, -c * t, d]]
    }

    /// The matrix of 36 constants gives the same stress in rotated axes as sigma_ij = C_ijkl h_kl with all 81
    /// constants.
    #[test]
    fn hookes_law_in_turned_axes() {
        let axes = some_axes();
        let h = [[0.3, -0.8, 0.5], [0.2, 0.7, -0.4], [1.1, 0.6, -0.9]];
        let ours = material::<3>(Tensor::anisotropic(&TRICLINIC).rotated(&axes), Plane::Strain).stress(&strain(&h));
        let own = |a: usize, b: usize| -> f64 {
            (0..3).flat_map(|k| (0..3).map(move |l| (k, l))).map(|(k, l)| axes[a][k] * h[k][l] * axes[b][l]).sum()
        };
        for (component, (i, j)) in PAIRS.into_iter().enumerate() {
            let mut exact = 0.0;
            for a in 0..3 {
                for b in 0..3 {
                    for c in 0..3 {
                        for d in 0..3 {
                            exact += axes[a][i] * axes[b][j] * full(&TRICLINIC, a, b, c, d) * own(c, d);
                        }
                    }
                }
            }
            assert!((ours[component] - exact).abs() < 1e-13 * 20.0, "{i}{j}: {} {exact}", ours[component]);
        }
    }

    /// The blocks of the stiffness density are the stress of one shape function times the gradient of the other.
    #[test]
    fn blocks_are_stresses_times_gradients() {
        let gradient = [[0.4, -1.2, 0.7], [-0.3, 0.9, 1.4]];
        let tensor = Tensor::anisotropic(&TRICLINIC).rotated(&some_axes());
        let isotropic = Material::isotropic(7.0, 0.2, 3, Plane::Strain);
        for material in [material::<3>(tensor, Plane::Strain), isotropic] {
            let mut local = [[[0.0; 3]; 3]; 4];
            material.accumulate(&gradient, &[], 2.0, &mut local);
            for (a, b) in [(0, 0), (0, 1), (1, 1)] {
                for j in 0..3 {
                    let mut h = [[0.0; 3]; 3];
                    h[j] = gradient[b];
                    let s = material.stress(&strain(&h));
                    let full = [[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]];
                    for i in 0..3 {
                        let exact: f64 = (0..3).map(|k| 2.0 * full[i][k] * gradient[a][k]).sum();
                        assert!((local[2 * a + b][i][j] - exact).abs() < 1e-12, "{a}{b} {i}{j}");
                    }
                }
            }
        }
        // The special formula of isotropic materials agrees with the general one.
        let general = material::<2>(Tensor::isotropic(7.0, 0.2), Plane::Stress);
        let short = Material::isotropic(7.0, 0.2, 2, Plane::Stress);
        let gradient = [[0.4, -1.2], [-0.3, 0.9], [1.0, 0.1]];
        let [mut one, mut other] = [[[[0.0; 2]; 2]; 9]; 2];
        general.accumulate(&gradient, &[], 1.0, &mut one);
        short.accumulate(&gradient, &[], 1.0, &mut other);
        let apart = one.as_flattened().as_flattened().iter().zip(other.as_flattened().as_flattened());
        assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-14);
    }

    /// In plane stress there is no stress out of the plane. The strains zz, yz, xz for this give the same stress by the
    /// law of space.
    #[test]
    fn plane_stress_of_a_triclinic_material() {
        let tensor = Tensor::anisotropic(&TRICLINIC).rotated(&some_axes());
        let h = [[0.3, -0.8], [0.2, 0.7]];
        let ours = material::<2>(tensor, Plane::Stress).stress(&strain(&h));
        // Strains out of the plane follow from the compliance, eps = S sigma.
        let compliance = tensor.matrix().try_inverse().expect("a material");
        let all: Vec<f64> = (0..6).map(|i| (0..6).map(|j| compliance[(i, j)] * ours[j]).sum()).collect();
        for (i, exact) in [(0, 0.3), (1, 0.7), (3, -0.6)] {
            assert!((all[i] - exact).abs() < 1e-13, "{i}: {all:?}");
        }
        assert_eq!([ours[2], ours[4], ours[5]], [0.0; 3]);
        // In plane strain the stress out of the plane follows from the law of space.
        let h3 = [[0.3, -0.8, 0.0], [0.2, 0.7, 0.0], [0.0; 3]];
        assert_eq!(
            material::<2>(tensor, Plane::Strain).stress(&strain(&h)),
            material::<3>(tensor, Plane::Strain).stress(&strain(&h3))
        );
    }

    #[test]
    fn coerciveness() {
        // The least eigenvalue of an isotropic tensor is 2 mu or 3 K, in any axes.
        for (nu, exact) in [(0.3, 2.0 * 10.0 / 2.6), (-0.5, 10.0 / 2.0)] {
            let tensor = Tensor::isotropic(10.0, nu);
            assert!(tensor.is_coercive() && tensor.rotated(&some_axes()).is_coercive());
            assert!((tensor.rotated(&some_axes()).least_eigenvalue() / exact - 1.0).abs() < 1e-13);
        }
        // With soft shear it is 2 G, and no axes change it.
        let mut soft = ORTHOTROPIC;
        soft[8] = 0.2;
        let tensor = Tensor::orthotropic(&soft).expect("a matrix");
        for tensor in [tensor, tensor.rotated(&some_axes())] {
            assert!((tensor.least_eigenvalue() / 0.4 - 1.0).abs() < 1e-12, "{}", tensor.least_eigenvalue());
        }
        assert!(Tensor::isotropic(1.0, 0.499_999_99).is_coercive());
        assert!(Tensor::anisotropic(&TRICLINIC).is_coercive());
        // Here 1 - nu23 nu32 < 0.
        let mut wrong = ORTHOTROPIC;
        wrong[5] = 1.2;
        let tensor = Tensor::orthotropic(&wrong).expect("a matrix");
        assert!(!tensor.is_coercive() && tensor.least_eigenvalue() < 0.0, "{}", tensor.least_eigenvalue());
        // A singular tensor has a strain without energy.
        let mut c = Tensor::isotropic(1.0, 0.0);
        c.0[1][1] = 0.0;
        assert!(!c.is_coercive() && c.least_eigenvalue() == 0.0);
        c.0[1][1] = f64::NAN;
        assert!(!c.is_coercive() && c.least_eigenvalue().is_nan());
    }

    #[test]
    fn moduli_against_pressure() {
        let near = |found: [f64; 3], exact: [f64; 3]| (0..3).all(|i| (found[i] / exact[i] - 1.0).abs() < 1e-12);
        let constrained = 2.1e5 / 0.91;
        assert!(near(Tensor::isotropic(2.1e5, 0.3).moduli(3, Plane::Strain), [constrained; 3]));
        let c = Tensor::orthotropic(&ORTHOTROPIC).expect("a material");
        let [e1, e2, e3, _, nu13, nu23, ..] = ORTHOTROPIC;
        // Since eps_z = 0, sigma_z = nu_zi sigma_i.
        let strain = c.moduli(2, Plane::Strain);
        assert!((strain[0] * (1.0 / e1 - nu13 * nu13 * e3 / e1 / e1) - 1.0).abs() < 1e-12);
        assert!((strain[1] * (1.0 / e2 - nu23 * nu23 * e3 / e2 / e2) - 1.0).abs() < 1e-12);
        assert!((c.young() / ((e1 + e2 + e3) / 3.0) - 1.0).abs() < 1e-12);
        let stress = c.moduli(2, Plane::Stress);
        assert!((stress[0] / e1 - 1.0).abs() < 1e-12 && (stress[1] / e2 - 1.0).abs() < 1e-12 && stress[2] == 0.0);
    }
}
