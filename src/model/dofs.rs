//! The dofs of a body: its contact rows, its prescribed values, the rigid motions that supports and springs leave free,
//! and how its dofs are distributed over the ranks.

use crate::exchange::{Exchange, Serial, all_gather};
use crate::fem::{Loads, Prolongation};
use crate::linalg::{Csr, axpy, dot};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// The dofs of a body.
///
/// K E = 0 holds for the rigid motions E that supports and springs leave free, but only in exact numbers. Entries of K
/// and u are rounded, and f - K u has an error of eps |K| |u| however it is summed. A body that falls far onto a soft
/// layer would lose its strains in that error. So the part E a of every step is taken out of the displacements and
/// moved into the gap ([`DisplacementField::advance`](super::DisplacementField::advance)), and a residual r gets the
/// work E'r that loads and contact forces do on the motions ([`Dofs::balance`]).
#[derive(Default)]
pub struct Dofs {
    /// Number of dofs, or of those that this rank owns.
    pub count: usize,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// B, one row for each contact point of each surface; columns: the dofs.
    pub rows: Csr,
    /// E, one vector over the dofs for each motion.
    pub unconstrained_modes: Vec<Vec<f64>>,
    /// (E'E)^-1 over all dofs of the body.
    inverse: DMatrix<f64>,
    /// How the dofs are distributed over the ranks, if they are. B and E then have the dofs that this rank owns.
    pub distribution: Option<Rc<Distribution>>,
}

impl Dofs {
    /// Make the dofs of a body.
    ///
    /// - `dofs` is their number.
    /// - `prescribed` lists the prescribed dofs with their values.
    /// - `rows` are the contact rows B of the body.
    /// - `unconstrained_modes` are the displacements of independent rigid motions that its supports and springs leave,
    ///   zero at prescribed dofs.
    ///
    /// If the body is distributed, the columns of `rows` and the displacements of `unconstrained_modes` belong to the
    /// owned and ghost nodes of this rank.
    pub fn new(
        dofs: usize,
        prescribed: Vec<(usize, f64)>,
        mut rows: Csr,
        mut unconstrained_modes: Vec<Vec<f64>>,
        distribution: Option<Rc<Distribution>>,
    ) -> Self {
        let motions = unconstrained_modes.len();
        let products = match &distribution {
            None => DMatrix::from_fn(motions, motions, |i, j| dot(&unconstrained_modes[i], &unconstrained_modes[j])),
            Some(distribution) => {
                rows = rows.of_columns(distribution.own.len(), |dof| distribution.owned_index(dof));
                unconstrained_modes.iter_mut().for_each(|motion| *motion = distribution.of_known(motion));
                distribution.products.clone()
            }
        };
        let Some(inverse) = products.try_inverse() else { unreachable!("rigid motions of a body are independent") };
        Self { count: dofs, prescribed, rows, unconstrained_modes, inverse, distribution }
    }

    /// Return the `interface` dofs of a condensed body. Its contact rows and motions are on all dofs.
    pub fn on_interface(interface: &[usize], rows: &Csr, unconstrained_modes: &[Vec<f64>]) -> Self {
        let rows = rows.of_columns(interface.len(), |dof| interface.binary_search(&dof).ok());
        let modes = unconstrained_modes.iter().map(|motion| interface.iter().map(|&dof| motion[dof]).collect());
        Self::new(interface.len(), Vec::new(), rows, modes.collect(), None)
    }

    /// Return whether this rank owns the body.
    pub fn leads(&self) -> bool {
        self.distribution.as_ref().is_none_or(|distribution| distribution.leads)
    }

    /// Return the undeformed state: zero on free dofs, prescribed values on supports.
    pub fn rest(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.count];
        self.prescribe(&mut u);
        u
    }

    /// Set the prescribed values in displacements.
    pub fn prescribe(&self, u: &mut [f64]) {
        self.prescribed.iter().for_each(|&(dof, value)| u[dof] = value);
    }

    /// Return the contact rows in the columns of the matrix that has the rows of K.
    pub fn matrix_rows(&self) -> &Csr {
        self.distribution.as_ref().map_or(&self.rows, |distribution| &distribution.rows)
    }

    /// Return the amounts a of the rigid motions in displacements u, for which u - E a is orthogonal to all of them.
    /// For a distributed body they are sums over ranks of what this returns.
    pub fn amounts(&self, u: &[f64]) -> Vec<f64> {
        let products = DVector::from_iterator(
            self.unconstrained_modes.len(),
            self.unconstrained_modes.iter().map(|motion| dot(motion, u)),
        );
        (&self.inverse * products).as_slice().to_vec()
    }

    /// Add s E a to displacements u.
    pub fn add_motions(&self, s: f64, amounts: &[f64], u: &mut [f64]) {
        self.unconstrained_modes.iter().zip(amounts).for_each(|(motion, a)| axpy(s * a, motion, u));
    }

    /// Return the displacements v + E a.
    pub fn join(&self, v: &[f64], amounts: &[f64]) -> Vec<f64> {
        let mut u = v.to_vec();
        self.add_motions(1.0, amounts, &mut u);
        u
    }

    /// Correct forces r such that their work on the rigid motions, E'r, is `work`. K and its product are rounded, and
    /// do some work on them. Collective for a distributed body.
    pub fn balance(&self, r: &mut [f64], work: &[f64]) {
        let mut lacking: Vec<f64> = self.unconstrained_modes.iter().map(|motion| -dot(motion, r)).collect();
        if let Some(distribution) = &self.distribution {
            distribution.exchange.sum(&mut lacking);
        }
        lacking.iter_mut().zip(work).for_each(|(lacking, work)| *lacking += work);
        let amounts = &self.inverse * DVector::from_vec(lacking);
        self.add_motions(1.0, amounts.as_slice(), r);
    }

    /// Return the displacements of the owned and ghost nodes of this rank. Collective for a distributed body.
    pub fn recover(&self, u: &[f64]) -> Vec<f64> {
        match &self.distribution {
            None => u.to_vec(),
            Some(distribution) => distribution.with_ghosts(u),
        }
    }

    /// Return a load on all dofs of the body as a force on the dofs of this rank. What acts on supports is left out.
    pub fn reduce(&self, load: &[f64]) -> Vec<f64> {
        let mut r = match &self.distribution {
            None => load.to_vec(),
            Some(distribution) => distribution.own.iter().map(|&dof| load[dof as usize]).collect(),
        };
        self.prescribed.iter().for_each(|&(dof, _)| r[dof] = 0.0);
        r
    }
}

/// The distribution of the dofs of a body over the ranks, as one of them sees it: the dofs that it owns, and their
/// places in the distributed matrix that has their rows of K. The matrix is that of all bodies, or one of the body's
/// own. A rank numbers the dofs of its owned and ghost nodes, its local dofs, for itself.
///
/// A vector has the dofs that this rank owns, so that products are sums over ranks.
#[derive(Clone, Serialize, Deserialize)]
pub struct Distribution {
    /// Number of dofs of the body.
    pub dofs: usize,
    /// The dofs that this rank owns, sorted.
    pub own: Vec<u32>,
    /// Their positions among the local dofs, sorted.
    pub owned_positions: Vec<u32>,
    /// For each other rank, the ghost dofs that it owns: their positions among the local dofs, and their rows in the
    /// matrix.
    pub ghosts: Vec<(Vec<u32>, Vec<u32>)>,
    /// Local indices of the nodes from which displacements are interpolated; empty if no interpolation is requested.
    pub coarse_nodes: Vec<u32>,
    /// Numbers of these nodes among the coarse nodes of all bodies in the matrix.
    pub coarse_number: Vec<u32>,
    /// Number of coarse nodes of these bodies on all ranks.
    pub coarse_count: usize,
    /// Number of coarse nodes of this body that this rank owns.
    pub own_coarse: usize,
    /// Products, over all dofs of the body, of the rigid motions that its supports leave free.
    pub products: DMatrix<f64>,
    /// Row of the first owned dof of the body in the matrix; the others follow.
    pub first: usize,
    /// First row of the matrix that this rank owns.
    pub start: usize,
    /// Number of rows of the matrix.
    pub total: usize,
    /// All contact rows of the body; columns: rows of the matrix.
    pub rows: Csr,
    /// Whether this rank owns the body. It is one of the ranks that own most of its dofs.
    pub leads: bool,
    /// Connection to the other ranks; whoever receives a distribution sets it.
    #[serde(skip, default = "alone")]
    pub exchange: Rc<dyn Exchange>,
}

fn alone() -> Rc<dyn Exchange> {
    Rc::new(Serial)
}

impl Distribution {
    /// Return the values at the local dofs from those at the owned dofs of every rank. Collective.
    pub fn with_ghosts(&self, own: &[f64]) -> Vec<f64> {
        let ghosts: usize = self.ghosts.iter().map(|(positions, _)| positions.len()).sum();
        let mut known = vec![0.0; self.owned_positions.len() + ghosts];
        self.owned_positions.iter().zip(own).for_each(|(&at, &value)| known[at as usize] = value);
        for ((positions, rows), (first, values)) in
            self.ghosts.iter().zip(all_gather(&*self.exchange, (self.first, own.to_vec())))
        {
            positions.iter().zip(rows).for_each(|(&at, &row)| known[at as usize] = values[row as usize - first]);
        }
        known
    }

    /// Return the index of a local dof among the owned ones; `None` for a ghost.
    pub fn owned_index(&self, dof: usize) -> Option<usize> {
        self.owned_positions.binary_search(&(dof as u32)).ok()
    }

    /// Restrict K, which was assembled for owned nodes, to the owned dofs. Its columns become those of the matrix.
    pub fn restrict_stiffness(&self, stiffness: Csr) -> Csr {
        let mut number = vec![0; stiffness.columns];
        self.owned_positions.iter().zip(self.first..).for_each(|(&dof, row)| number[dof as usize] = row as i32);
        let ghosts = self.ghosts.iter().flat_map(|(positions, rows)| positions.iter().zip(rows));
        ghosts.for_each(|(&dof, &row)| number[dof as usize] = row as i32);
        let Csr { ptr, mut col, mut values, .. } = stiffness;
        let mut starts = vec![0];
        let mut row = Vec::new();
        for &dof in &self.owned_positions {
            let range = ptr[dof as usize] as usize..ptr[dof as usize + 1] as usize;
            row.clear();
            row.extend(range.clone().map(|k| (number[col[k] as usize], values[k])));
            row.sort_unstable_by_key(|entry| entry.0);
            for (k, &(j, value)) in range.clone().zip(&row) {
                (col[k], values[k]) = (j, value);
            }
            starts.push(range.end as i32);
        }
        Csr { columns: self.total, ptr: starts, col, values }
    }

    /// Return the rows of owned dofs of an interpolation from the coarse nodes, each of which has `dimension` dofs.
    /// Columns are numbered through all bodies in the matrix.
    pub fn restrict_interpolation(&self, whole: &Prolongation, dimension: usize) -> Prolongation {
        let number = |j: usize| dimension * self.coarse_number[j / dimension] as usize + j % dimension;
        let mut rows = Csr::new(dimension * self.coarse_count);
        for &dof in &self.owned_positions {
            rows.push_row(whole.rows.row(dof as usize).map(|(j, weight)| (number(j), weight)));
        }
        Prolongation { rows, own: dimension * self.own_coarse }
    }

    /// Return the loads and prescribed values of a body on the owned dofs, from those on the local dofs.
    pub fn restrict(&self, loads: Loads) -> Loads {
        let place = |&(dof, u): &(usize, f64)| Some((self.owned_index(dof)?, u));
        Loads {
            load: self.of_known(&loads.load),
            prescribed: loads.prescribed.iter().filter_map(place).collect(),
            lifting: if loads.lifting.is_empty() { Vec::new() } else { self.of_known(&loads.lifting) },
            ..loads
        }
    }

    /// Return the values at owned dofs from those at the local dofs.
    pub fn of_known(&self, known: &[f64]) -> Vec<f64> {
        self.owned_positions.iter().map(|&at| known[at as usize]).collect()
    }
}

/// Return as many dofs as there are motions, such that no combination of the motions leaves all these dofs at rest.
/// They are the pivots of an elimination.
pub(super) fn pins(motions: &[Vec<f64>]) -> Vec<usize> {
    let mut remaining = motions.to_vec();
    let mut pins = Vec::new();
    while let Some(mut motion) = remaining.pop() {
        let Some(pin) = (0..motion.len()).max_by(|&i, &j| motion[i].abs().total_cmp(&motion[j].abs())) else { break };
        let pivot = motion[pin];
        motion.iter_mut().for_each(|u| *u /= pivot);
        remaining.iter_mut().for_each(|other| axpy(-other[pin], &motion, other));
        pins.push(pin);
    }
    pins
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three nodes on a line slide and turn. The rigid part of a displacement is taken out, and forces get the work
    /// that they should do.
    #[test]
    fn rigid_parts_are_taken_out() {
        let motions = vec![vec![1.0, 0.0, 1.0, 0.0, 1.0, 0.0], vec![0.5, 0.5, 0.5, 0.0, 0.5, -0.5]];
        let dofs = Dofs::new(6, Vec::new(), Csr::new(6), motions, None);
        let all = [0.3, 1.0, -0.2, 0.4, 0.7, -2.0];
        let (mut u, amounts) = (all, dofs.amounts(&all));
        dofs.add_motions(-1.0, &amounts, &mut u);
        assert!(dofs.unconstrained_modes.iter().all(|motion| dot(motion, &u).abs() < 1e-15), "{u:?}");
        dofs.add_motions(1.0, &amounts, &mut u);
        assert!(u.iter().zip(all).all(|(a, b)| (a - b).abs() < 1e-15));
        let mut force = all;
        dofs.balance(&mut force, &[0.25, -4.0]);
        let work: Vec<f64> = dofs.unconstrained_modes.iter().map(|motion| dot(motion, &force)).collect();
        assert!((work[0] - 0.25).abs() < 1e-14 && (work[1] + 4.0).abs() < 1e-14, "{work:?}");
    }
}
