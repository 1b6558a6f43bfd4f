//! Supports: prescribed dofs taken out of K and f, and other loads on what is left.

use crate::linalg::{Csr, dot};

/// One elastic body, discretised: stiffness K, load f, and what the supports took out.
///
/// Supported dofs stay as rows of K with one entry, `K[c][c]` = a typical diagonal, and `f[c] = K[c][c] u_c`, so that
/// their residual vanishes at the prescribed value; their columns went to the right-hand side.
#[derive(Debug, Clone, Default)]
pub struct ElasticBody {
    /// Stiffness matrix K, symmetric positive semidefinite.
    pub stiffness: Csr,
    /// Load vector f, one entry a dof.
    pub load: Vec<f64>,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// K_fc u_c on the free dofs if some prescribed value is not zero, else empty. Strain energy needs it.
    pub lifting: Vec<f64>,
    /// What must be added to u'Ku/2 - f'u to give the potential energy of the body.
    pub energy_constant: f64,
    /// u_c'K_cc u_c minus the u_c'K_cc u_c that the scaled diagonal gives: correction of u'Ku.
    pub strain_constant: f64,
    /// Rigid displacement of all dofs that supports give the body, to be added to u; empty if there is none. All else here
    /// is relative to it.
    pub carried: Vec<f64>,
    /// What [`ElasticBody::reload`] needs of K; empty where nobody asks for it.
    pub held: Couplings,
}

/// What supports took out of K: other loads and prescribed values on the same K need it.
#[derive(Debug, Clone, Default)]
pub struct Couplings {
    /// Entries (row, column, value) of K in the columns of the prescribed dofs, row by row.
    columns: Vec<(u32, u32, f64)>,
    /// `K[c][c]` of prescribed dofs now.
    diagonal: f64,
}

impl ElasticBody {
    /// Takes other loads f, one entry a dof, other values at the same prescribed dofs (dof, value), and another rigid displacement
    /// `carried`, which these values are relative to.
    pub fn reload(&mut self, load: Vec<f64>, mut prescribed: Vec<(usize, f64)>, carried: Vec<f64>) {
        let n = load.len();
        let (mut value, mut is_here, scale) = (vec![None; n], vec![false; n], self.held.diagonal);
        prescribed.iter().for_each(|&(dof, u)| value[dof] = Some(u));
        let is_moved = prescribed.iter().any(|&(_, u)| u != 0.0);
        self.lifting = if is_moved { vec![0.0; n] } else { Vec::new() };
        self.energy_constant = if carried.is_empty() { 0.0 } else { -dot(&load, &carried) };
        self.strain_constant = 0.0;
        for &(i, j, k) in &self.held.columns {
            let (i, j) = (i as usize, j as usize);
            is_here[i] |= i == j;
            let of_column = k * value[j].unwrap_or(0.0);
            match value[i] {
                None if is_moved => self.lifting[i] += of_column,
                None => {}
                Some(u) => self.strain_constant += u * of_column,
            }
        }
        prescribed.retain(|entry| is_here[entry.0]);
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

/// Takes prescribed dofs out of K and f, symmetrically, and keeps what energies need. `carried` is the rigid displacement that all is
/// relative to, empty for none.
///
/// `prescribed` holds (dof, value), sorted, without repetition. Rows of K that are empty live elsewhere, with their energies.
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

    /// Two dofs joined by springs to each other and to ground: K = [[3, -1], [-1, 2]].
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

    /// Other loads and prescribed values are those of a body made with them.
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
