//! Supports: elimination of prescribed dofs from K and f, and other loads on the remaining system.

use crate::linalg::{Csr, dot};

/// A discretised elastic body: stiffness K, load f, and the terms that were eliminated with the prescribed dofs.
///
/// A prescribed dof c with the value u_c stays as a row of K with one entry, `K[c][c]` = a typical diagonal, and
/// `f[c] = K[c][c] u_c`. Its residual then vanishes at the prescribed value. Its column is moved to the right-hand side.
#[derive(Debug, Clone, Default)]
pub struct ElasticBody {
    /// Stiffness matrix K, symmetric positive semidefinite.
    pub stiffness: Csr,
    /// Load vector f, one entry a dof.
    pub load: Vec<f64>,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// K_fc u_c on the free dofs f if some prescribed value is not zero, else empty. The strain energy needs it.
    pub lifting: Vec<f64>,
    /// Constant to be added to u'Ku/2 - f'u to give the potential energy of the body.
    pub energy_constant: f64,
    /// Correction of u'Ku: u_c'K_cc u_c with the original K_cc less the value with the scaled diagonal.
    pub strain_constant: f64,
    /// Rigid displacement of all dofs that supports impose on the body, to be added to u; empty if there is none. All other
    /// displacements are relative to it.
    pub carried: Vec<f64>,
    /// Entries of K that [`ElasticBody::reload`] needs; empty where it is not used.
    pub held: Couplings,
}

/// The entries of K that were eliminated with the prescribed dofs. Other loads and prescribed values with the same K need them.
#[derive(Debug, Clone, Default)]
pub struct Couplings {
    /// Entries (row, column, value) of K in the columns of the prescribed dofs, row by row.
    columns: Vec<(u32, u32, f64)>,
    /// Present value of `K[c][c]` of prescribed dofs c.
    diagonal: f64,
}

impl ElasticBody {
    /// Replace the loads f, one entry a dof, the values at the same prescribed dofs (dof, value), and the rigid displacement `carried`
    /// that these values are relative to.
    pub fn reload(&mut self, load: Vec<f64>, mut prescribed: Vec<(usize, f64)>, carried: Vec<f64>) {
        let n = load.len();
        let (mut value, mut has_row, scale) = (vec![None; n], vec![false; n], self.held.diagonal);
        prescribed.iter().for_each(|&(dof, u)| value[dof] = Some(u));
        let is_moved = prescribed.iter().any(|&(_, u)| u != 0.0);
        self.lifting = if is_moved { vec![0.0; n] } else { Vec::new() };
        self.energy_constant = if carried.is_empty() { 0.0 } else { -dot(&load, &carried) };
        self.strain_constant = 0.0;
        for &(i, j, k) in &self.held.columns {
            let (i, j) = (i as usize, j as usize);
            has_row[i] |= i == j;
            let of_column = k * value[j].unwrap_or(0.0);
            match value[i] {
                None if is_moved => self.lifting[i] += of_column,
                None => {}
                Some(u) => self.strain_constant += u * of_column,
            }
        }
        prescribed.retain(|entry| has_row[entry.0]);
        self.load = load;
        self.load.iter_mut().zip(&self.lifting).for_each(|(load, lifting)| *load -= lifting);
        self.energy_constant += 0.5 * self.strain_constant;
        for &(dof, u) in &prescribed {
            self.energy_constant += 0.5 * scale * u * u - self.load[dof] * u;
            self.strain_constant -= scale * u * u;
            self.load[dof] = scale * u;
        }
        (self.prescribed, self.carried) = (prescribed, carried);
    }
}

/// Eliminate prescribed dofs from K and f, symmetrically, and keep the terms that energies need.
///
/// `prescribed` holds (dof, value), sorted, without repetition. `carried` is the rigid displacement that all displacements are relative
/// to, empty for none. Empty rows of K belong to other ranks, which also account for their energies.
pub fn support(mut stiffness: Csr, load: Vec<f64>, prescribed: Vec<(usize, f64)>, carried: Vec<f64>) -> ElasticBody {
    let n = load.len();
    let mut is_free = vec![true; n];
    prescribed.iter().for_each(|entry| is_free[entry.0] = false);
    let free: Vec<f64> =
        (0..n).filter(|&i| is_free[i]).filter_map(|i| stiffness.position(i, i).map(|k| stiffness.values[k])).collect();
    let diagonal = if free.is_empty() { 1.0 } else { free.iter().sum::<f64>() / free.len() as f64 };
    let mut columns = Vec::new();
    for i in 0..n {
        for k in stiffness.range(i) {
            let j = stiffness.col[k] as usize;
            if !is_free[j] {
                columns.push((i as u32, j as u32, stiffness.values[k]));
            }
            if !(is_free[i] && is_free[j]) {
                stiffness.values[k] = if i == j { diagonal } else { 0.0 };
            }
        }
    }
    let mut body = ElasticBody { stiffness, held: Couplings { columns, diagonal }, ..ElasticBody::default() };
    body.reload(load, prescribed, carried);
    body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::dot;

    /// Return the matrix K = [[3, -1], [-1, 2]] of two dofs with springs between them and to the ground.
    fn springs() -> Csr {
        let mut k = Csr::new(2);
        k.push_row([(0, 3.0), (1, -1.0)]);
        k.push_row([(0, -1.0), (1, 2.0)]);
        k
    }

    #[test]
    fn a_prescribed_value_keeps_energies_and_equilibrium() {
        let body = support(springs(), vec![5.0, 0.7], vec![(1, 0.4)], Vec::new());
        let u = [(5.0 + 0.4) / 3.0, 0.4];
        let mut ku = [0.0; 2];
        body.stiffness.multiply(&u, &mut ku);
        let residual: f64 = (0..2).map(|i| (body.load[i] - ku[i]).abs()).sum();
        assert!(residual < 1e-15, "{residual}");
        let mut full = [0.0; 2];
        springs().multiply(&u, &mut full);
        let strain = dot(&u, &ku) + 2.0 * dot(&body.lifting, &u) + body.strain_constant;
        assert!((strain - dot(&u, &full)).abs() < 1e-14);
        let energy = 0.5 * dot(&u, &ku) - dot(&body.load, &u) + body.energy_constant;
        let exact = 0.5 * dot(&u, &full) - 5.0 * u[0] - 0.7 * u[1];
        assert!((energy - exact).abs() < 1e-14, "{energy} {exact}");
    }

    /// A reloaded body equals a body that is made with the other loads and prescribed values.
    #[test]
    fn a_body_takes_other_loads() {
        for (u, carried) in [(0.4, vec![]), (0.0, vec![0.5, 0.5])] {
            let mut body = support(springs(), vec![1.0, 2.0], vec![(1, -0.3)], Vec::new());
            body.reload(vec![5.0, 0.7], vec![(1, u)], carried.clone());
            let new = support(springs(), vec![5.0, 0.7], vec![(1, u)], carried);
            assert_eq!((&body.load, &body.prescribed, &body.lifting), (&new.load, &new.prescribed, &new.lifting));
            assert_eq!([body.energy_constant, body.strain_constant], [new.energy_constant, new.strain_constant]);
            assert_eq!(new.carried.is_empty(), u != 0.0);
        }
    }
}
