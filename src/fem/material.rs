//! Linear elastic material.

use crate::scene::Plane;

/// Isotropic linear elasticity: sigma = lambda tr(eps) I + 2 mu eps, with the lambda of the plane state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// First Lamé constant; in plane stress the reduced 2 lambda mu / (lambda + 2 mu).
    pub lambda: f64,
    /// Shear modulus.
    pub mu: f64,
    /// sigma_zz = this times (sigma_xx + sigma_yy) in plane problems.
    pub out_of_plane: f64,
}

impl Material {
    /// From Young's modulus and Poisson's ratio, in `dimension` 2 or 3 (`plane` matters in 2 only).
    pub fn isotropic(young: f64, poisson: f64, dimension: usize, plane: Plane) -> Self {
        let mu = young / (2.0 * (1.0 + poisson));
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        if dimension == 2 && plane == Plane::Stress {
            let reduced = 2.0 * lambda * mu / (lambda + 2.0 * mu);
            Self { lambda: reduced, mu, out_of_plane: 0.0 }
        } else {
            Self { lambda, mu, out_of_plane: poisson }
        }
    }

    /// The D x D block of the stiffness density for gradients `a` (row) and `b` (column):
    /// lambda a_i b_j + mu a_j b_i + mu (a.b) delta_ij.
    pub fn block<const D: usize>(&self, a: &[f64; D], b: &[f64; D]) -> [[f64; D]; D] {
        let product: f64 = (0..D).map(|i| a[i] * b[i]).sum();
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let shear = if i == j { self.mu * product } else { 0.0 };
                self.lambda * a[i] * b[j] + self.mu * a[j] * b[i] + shear
            })
        })
    }

    /// Stress (xx yy zz xy yz xz) of a displacement gradient `h[i][j]` = du_i/dx_j.
    pub fn stress<const D: usize>(&self, h: &[[f64; D]; D]) -> [f64; 6] {
        let trace: f64 = (0..D).map(|i| h[i][i]).sum();
        let s = |i: usize, j: usize| {
            let diagonal = if i == j { self.lambda * trace } else { 0.0 };
            diagonal + self.mu * (h[i][j] + h[j][i])
        };
        if D == 2 {
            let (xx, yy) = (s(0, 0), s(1, 1));
            [xx, yy, self.out_of_plane * (xx + yy), s(0, 1), 0.0, 0.0]
        } else {
            [s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(0, 2)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniaxial_plane_states_have_their_moduli() {
        let (e, nu) = (2.1e5, 0.3);
        // plane strain, sigma_yy = 0: eps_xx = sigma (1 - nu^2) / E, eps_yy = -sigma nu (1 + nu) / E
        let h = [[(1.0 - nu * nu) / e, 0.0], [0.0, -nu * (1.0 + nu) / e]];
        let s = Material::isotropic(e, nu, 2, Plane::Strain).stress(&h);
        assert!((s[0] - 1.0).abs() < 1e-14 && s[1].abs() < 1e-14 && (s[2] - nu).abs() < 1e-14);
        // plane stress, sigma_yy = 0: eps_xx = sigma / E, eps_yy = -nu sigma / E
        let h = [[1.0 / e, 0.0], [0.0, -nu / e]];
        let s = Material::isotropic(e, nu, 2, Plane::Stress).stress(&h);
        assert!((s[0] - 1.0).abs() < 1e-14 && s[1].abs() < 1e-14 && s[2] == 0.0);
    }
}
