//! Linear elastic material at a point: Hooke's law sigma = C eps (2) and the bounds on C (4).

use super::slope::{PAIRS, Slope};
use crate::problem::elasticity::Plane;
use nalgebra::{Matrix3, Matrix6};

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

    /// Make the orthotropic tensor with axes 1, 2, 3 along x, y, z from E1 E2 E3, nu12 nu13 nu23 and G12 G13 G23. Here nu12 is
    /// the contraction along 2 under tension along 1. Return `None` if the stiffness for these moduli is not finite.
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

    /// Return the tensor in x, y, z of a material whose axes 1, 2, 3 have the directions `axes[0..3]` (orthonormal rows).
    pub fn rotated(&self, axes: &[[f64; 3]; 3]) -> Self {
        // The stress in x, y, z is `bond` times the stress in the material's axes. Since work does not depend on the axes, strains
        // are transformed by the transpose.
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

    /// Return the least C eps : eps over strains with eps : eps = 1, which does not depend on the axes; NaN if C is not finite.
    pub fn least_eigenvalue(&self) -> f64 {
        if self.0.as_flattened().iter().any(|c| !c.is_finite()) {
            return f64::NAN;
        }
        let unit = |i: usize| if i < 3 { 1.0 } else { f64::sqrt(2.0) };
        Matrix6::from_fn(|i, j| unit(i) * unit(j) * self.0[i][j]).symmetric_eigenvalues().min()
    }

    /// Return the stiffness against uniaxial stress along x, y and z of a body that is constrained in one direction across it, as
    /// the mean for both directions. It is E/(1 - nu^2) if the material is isotropic.
    ///
    /// In plane problems z is constrained (plane strain, bodies of revolution) or free (plane stress), and the z entry is zero.
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

/// Hooke's law of a body in its dimension. Its C is that of space, which also holds for plane strain, or that of plane stress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Stress (xx yy zz xy yz xz) per strain.
    stiffness: Tensor,
    /// Lamé's lambda (for plane stress the reduced one) and mu if the material is isotropic.
    lame: Option<(f64, f64)>,
}

impl Material {
    /// Make the isotropic law from Young's modulus and Poisson's ratio, in `dimension` 2 or 3 (`plane` matters in 2 only).
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

    /// Add `weight` times the D x D blocks B_a' C B_b of the stiffness density for all nodes a <= b to `local[a n + b]`.
    ///
    /// B_a gives the strain for the displacement of node a, and n is the number of nodes. `gradient[a]` is the gradient of the
    /// shape function of node a. In a body of revolution `hoop[a]` is this function over the radius; in others `hoop` is empty.
    pub fn accumulate<const D: usize>(
        &self,
        gradient: &[[f64; D]],
        hoop: &[f64],
        weight: f64,
        local: &mut [[[f64; D]; D]],
    ) {
        match self.lame {
            Some((lambda, mu)) => {
                isotropic_blocks(weight * lambda, weight * mu, gradient, local);
                isotropic_hoops(weight * lambda, weight * mu, gradient, hoop, local);
            }
            None => self.blocks(gradient, hoop, weight, local),
        }
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

    /// Return the largest row sum of the absolute entries of C, which is no less than its largest eigenvalue.
    pub fn norm(&self) -> f64 {
        self.stiffness.0.iter().map(|row| row.iter().map(|c| c.abs()).sum()).fold(0.0, f64::max)
    }

    /// Return the stress (xx yy zz xy yz xz) of a strain (xx yy zz, and 2 eps of xy yz xz) (2).
    pub fn stress(&self, strain: &[f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| (0..6).map(|j| self.stiffness.0[i][j] * strain[j]).sum())
    }
}

/// Return the index of the component (i, j) of a symmetric tensor in [`PAIRS`].
fn component(i: usize, j: usize) -> usize {
    match (i.min(j), i.max(j)) {
        (i, j) if i == j => i,
        (0, 1) => 3,
        (1, _) => 4,
        _ => 5,
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

/// Add what the strains u_r/r of the circles in a body of revolution contribute to lambda e e' + 2 mu (u_r/r) (u_r'/r). Here
/// e = div u + u_r/r, and primes mark the second displacement.
fn isotropic_hoops<const D: usize>(
    lambda: f64,
    mu: f64,
    gradient: &[[f64; D]],
    hoop: &[f64],
    local: &mut [[[f64; D]; D]],
) {
    let n = hoop.len();
    for a in 0..n {
        for b in a..n {
            let block = &mut local[a * n + b];
            for i in 0..D {
                block[0][i] += lambda * hoop[a] * gradient[b][i];
                block[i][0] += lambda * gradient[a][i] * hoop[b];
            }
            block[0][0] += (lambda + 2.0 * mu) * hoop[a] * hoop[b];
        }
    }
}

#[cfg(test)]
mod tests;
