//! The interface dofs of a body that is condensed to its contact.
//!
//! Let R be the interface dofs and I the interior ones. The stiffness S = K_RR - K_RI K_II^-1 K_IR and the load
//! g = f_R - K_RI K_II^-1 f_I are those of a body with the same contact rows. Its matrix G = S + B_R' diag(weight) B_R
//! is dense and small.
//!
//! The method sees a body only through its contact rows, so the dofs in these rows are interface dofs. Some more dofs
//! are added where supports and contact do not constrain the interior well.

use crate::linalg::{Blocks, Csr, PART};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeSet, HashSet};

/// One more interface dof is added for a rigid motion that is constrained by less than this share of what all
/// constrained dofs could do. This is about accuracy, not only about whether the motion is constrained at all: the
/// condition of the interior is about 1/SAFE times that of a clamped body, which leaves ten of sixteen digits.
const SAFE: f64 = 1e-6;

/// Return the interface dofs, sorted, of a body with these contact `rows` (columns: all dofs) and `prescribed` (dof,
/// value). `motion(k, dof)` is the displacement of a dof in motion k of the `motions` rigid ones of the free body.
pub fn interface_dofs(
    rows: &Csr,
    prescribed: &[(usize, f64)],
    motions: usize,
    motion: impl Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let prescribed: HashSet<usize> = prescribed.iter().map(|entry| entry.0).collect();
    let mut interface: BTreeSet<usize> = rows.col.iter().map(|&dof| dof as usize).collect();
    // dofs are added until they constrain every rigid motion together with the prescribed ones
    loop {
        let mut gram = DMatrix::zeros(motions, motions);
        let constrained: BTreeSet<usize> = interface.iter().chain(&prescribed).copied().collect();
        for &dof in &constrained {
            let at = DVector::from_fn(motions, |k, _| motion(k, dof));
            gram.syger(1.0, &at, &at, 1.0);
        }
        gram.fill_upper_triangle_with_lower_triangle();
        let free = Blocks::free(&gram, constrained.len().max(1) as f64, SAFE);
        let Some(amounts) = free.first() else { break };
        // displacement of a dof in the free motion, unless the dof is constrained
        let size = |dof: usize| {
            let sum: f64 = (0..motions).map(|k| amounts[k] * motion(k, dof)).sum();
            (!constrained.contains(&dof)).then(|| sum.abs() / amounts.amax())
        };
        let sizes = (0..rows.columns).filter_map(|dof| Some((dof, size(dof)?)));
        match sizes.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((dof, size)) if size > PART => interface.insert(dof),
            _ => break,
        };
    }
    interface.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::{PointExtent, rigid};

    /// Nodes of a square with side 2. The dofs of node i are 2 i and 2 i + 1.
    const NODES: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    fn of(rows: &Csr, prescribed: &[(usize, f64)]) -> Vec<usize> {
        let motions = rigid::modes(&PointExtent::of(NODES.into_iter()));
        interface_dofs(rows, prescribed, 3, |k, dof| motions[k].at(&NODES[dof / 2])[dof % 2])
    }

    fn rows(list: &[&[(usize, f64)]]) -> Csr {
        let mut rows = Csr::new(8);
        list.iter().for_each(|row| rows.push_row(row.iter().copied()));
        rows
    }

    /// Contact constrains one translation and the rotation. The other translation takes one more dof, and none if a
    /// support constrains it.
    #[test]
    fn what_contact_does_not_constrain_gets_a_dof() {
        let flat = rows(&[&[(5, 1.0)], &[(7, 1.0)]]);
        let interface = of(&flat, &[]);
        assert_eq!(interface.len(), 3);
        assert!(interface.iter().any(|dof| dof % 2 == 0), "{interface:?}");
        assert_eq!(of(&flat, &[(0, 0.0)]), [5, 7]);
        assert_eq!(of(&rows(&[]), &[]).len(), 3);
    }
}
