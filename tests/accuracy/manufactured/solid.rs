//! Elasticity by the definition: C_ijkl from the moduli, turned with four rotations, times a factor of the place.

use super::symbolic::{Expr, number};
use nalgebra::Matrix3;

/// C_ijkl.
pub type Tensor = [[[[f64; 3]; 3]; 3]; 3];

/// An elastic material.
pub struct Solid {
    /// Constant part of the tensor, in x, y, z.
    pub c: Tensor,
    /// Factor of the place.
    pub scale: Expr,
    kind: Kind,
}

enum Kind {
    Isotropic(f64, f64),
    /// E1 E2 E3 nu12 nu13 nu23 G12 G13 G23, turned about z.
    Orthotropic([f64; 9], f64),
}

fn tensor(entry: impl Fn(usize, usize, usize, usize) -> f64) -> Tensor {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| std::array::from_fn(|k| std::array::from_fn(|l| entry(i, j, k, l))))
    })
}

impl Solid {
    pub fn isotropic(young: f64, poisson: f64) -> Self {
        let delta = |i: usize, j: usize| f64::from(i == j);
        let mu = young / 2.0 / (1.0 + poisson);
        let lambda = young * poisson / (1.0 + poisson) / (1.0 - 2.0 * poisson);
        let c = tensor(|i, j, k, l| {
            lambda * delta(i, j) * delta(k, l) + mu * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k))
        });
        Self { c, scale: number(1.0), kind: Kind::Isotropic(young, poisson) }
    }

    pub fn orthotropic(moduli: [f64; 9], angle: f64) -> Self {
        let [e1, e2, e3, nu12, nu13, nu23, g12, g13, g23] = moduli;
        let (s12, s13, s23) = (-nu12 / e1, -nu13 / e1, -nu23 / e2);
        let compliance = Matrix3::new(1.0 / e1, s12, s13, s12, 1.0 / e2, s23, s13, s23, 1.0 / e3);
        let normal = compliance.try_inverse().expect("a material");
        let shear = [[0.0, g12, g13], [g12, 0.0, g23], [g13, g23, 0.0]];
        let own = tensor(|i, j, k, l| match (i == j, k == l) {
            (true, true) => normal[(i, k)],
            (false, false) if (i, j) == (k, l) || (i, j) == (l, k) => shear[i][j],
            _ => 0.0,
        });
        let (s, c) = angle.sin_cos();
        // columns: axes 1, 2, 3
        let r = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]];
        let mut turned = own;
        for _ in 0..4 {
            // turns the first index and brings the next one to the front
            let before = turned;
            turned = tensor(|j, k, l, i| (0..3).map(|a| r[i][a] * before[a][j][k][l]).sum());
        }
        Self { c: turned, scale: number(1.0), kind: Kind::Orthotropic(moduli, angle) }
    }

    /// The material times a factor of the place.
    pub fn times(self, scale: Expr) -> Self {
        Self { scale, ..self }
    }

    /// Its keys in a scene.
    pub fn scene(&self) -> String {
        let scaled = |value: &f64| format!("\"{value} * {}\"", self.scale);
        match &self.kind {
            Kind::Isotropic(young, poisson) => format!("young = {}\npoisson = {poisson}", scaled(young)),
            Kind::Orthotropic(moduli, angle) => {
                let names = ["E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"];
                let constants: Vec<String> = names
                    .iter()
                    .zip(moduli)
                    .map(|(name, value)| {
                        if name.starts_with("nu") {
                            format!("{name} = {value}")
                        } else {
                            format!("{name} = {}", scaled(value))
                        }
                    })
                    .collect();
                format!("orthotropic = {{ {} }}\naxes = {{ angle = {angle}, axis = [0, 0, 1] }}", constants.join(", "))
            }
        }
    }
}
