use super::*;
use crate::fem::slope::strain;

/// A stable material without any symmetry, the constants C11 C12 ... C66 in Voigt's order.
const TRICLINIC: [f64; 21] =
    [20.0, 7.0, 6.0, 1.1, -0.7, 0.9, 15.0, 5.0, -1.3, 0.4, 0.8, 12.0, 0.6, 1.2, -0.5, 4.0, 0.3, -0.2, 5.0, 0.7, 6.0];

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

/// The matrix of 36 constants gives the same stress in rotated axes as sigma_ij = C_ijkl h_kl with all 81 constants.
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

/// In plane stress there is no stress out of the plane. The strains zz, yz, xz for this give the same stress by the law of space.
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
    let stress = c.moduli(2, Plane::Stress);
    assert!((stress[0] / e1 - 1.0).abs() < 1e-12 && (stress[1] / e2 - 1.0).abs() < 1e-12 && stress[2] == 0.0);
}
