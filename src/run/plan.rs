//! The choice of an inner solver for each body, and the choices that bodies have to share.

use crate::problem::{Order, Preset};
use crate::solver::Retained;
use crate::solver::options::Chosen;
use serde::{Deserialize, Serialize};

/// Largest number of dofs of all condensed bodies together for which their dense matrix is factored. It takes 0.2 s and 250 MB.
pub const DENSE: usize = 3000;

/// The choice of a solver for a body, made by the first rank. Other ranks do not get what is skipped here.
#[derive(Clone, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the body.
    pub name: String,
    /// PETSc options of the body, which each rank reads.
    #[serde(skip)]
    pub chosen: Chosen,
    /// Preset of its solver.
    pub preset: Preset,
    /// Reason for the preset, in words.
    #[serde(skip)]
    pub reason: String,
    /// Number of dofs of a node.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// Number of dofs of the body.
    pub dofs: usize,
    /// Whether the body could be condensed.
    #[serde(skip)]
    pub condensable: bool,
    /// Interface dofs of a condensed body, until it is made.
    pub retained: Option<Retained>,
}

impl Plan {
    /// Return the number of dofs that a condensed body would keep.
    pub fn on_contact(&self) -> usize {
        self.retained.as_ref().map_or(0, |retained| retained.dofs.len())
    }
}

/// Give all bodies presets that Newton's method can join. They get multigrid if one of them needs it. In the plane they get one
/// factorisation if together they have too many dofs on the contact for one dense matrix.
pub fn agree(plans: &mut [Plan]) {
    let dense: usize = plans.iter().filter(|plan| plan.preset == Preset::Condensed).map(Plan::on_contact).sum();
    let needs = plans.iter().find(|plan| plan.preset == Preset::Hypre).map(|plan| plan.name.clone());
    let (preset, why) = match needs {
        Some(first) => (Preset::Hypre, format!("`{first}` has it, and Newton's method joins the bodies")),
        None if dense > DENSE && plans.iter().any(|plan| plan.dimension == 2) => {
            (Preset::Mumps, format!("{dense} of all bodies are on the contact: too many to join by dense algebra"))
        }
        None => return,
    };
    for plan in plans.iter_mut().filter(|plan| plan.preset != preset) {
        plan.preset = preset;
        plan.reason = format!("{} dofs; {why}", plan.dofs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::rigid::AtDofs;
    use crate::linalg::Csr;
    use crate::solver::options::Typed;

    /// Return the plan of a body in space whose contact rows have `contact` dofs.
    fn plan(name: &str, preset: Preset, contact: usize) -> Plan {
        let mut rows = Csr::new(30_000);
        (0..contact).for_each(|i| rows.push_row([(3 * i, 1.0)]));
        let prescribed: Vec<(usize, f64)> = (29_000..30_000).map(|dof| (dof, 0.0)).collect();
        let retained = Some(Retained::new(3, &rows, &prescribed, AtDofs::NONE));
        let chosen = Typed::default().of(name);
        Plan {
            name: name.to_owned(),
            chosen,
            preset,
            reason: "its own".to_owned(),
            dimension: 3,
            order: Order::P1,
            dofs: 30_000,
            condensable: true,
            retained,
        }
    }

    fn presets(plans: &[Plan]) -> Vec<Preset> {
        plans.iter().map(|plan| plan.preset).collect()
    }

    #[test]
    fn bodies_agree_on_multigrid_alone() {
        let mut direct = [plan("a", Preset::Condensed, 10), plan("b", Preset::Mumps, 10)];
        agree(&mut direct);
        assert_eq!(presets(&direct), [Preset::Condensed, Preset::Mumps]);
        let mut mixed = [plan("a", Preset::Condensed, 10), plan("b", Preset::Hypre, 10), plan("c", Preset::Mumps, 10)];
        agree(&mut mixed);
        assert_eq!(presets(&mixed), [Preset::Hypre; 3]);
        assert_eq!(mixed[1].reason, "its own");
        assert!(mixed[2].reason.contains("30000 dofs; `b` has it"), "{}", mixed[2].reason);
    }

    /// In the plane, two contacts of 1500 dofs are joined by dense algebra. With one dof more they are joined by one
    /// factorisation.
    #[test]
    fn wide_contacts_in_the_plane_are_joined_by_a_factorisation() {
        let pair = |more: usize| {
            let mut pair = [plan("a", Preset::Condensed, 1500), plan("b", Preset::Condensed, 1500 + more)];
            pair.iter_mut().for_each(|plan| plan.dimension = 2);
            pair
        };
        let mut narrow = pair(0);
        agree(&mut narrow);
        assert_eq!(presets(&narrow), [Preset::Condensed; 2]);
        let mut flat = pair(1);
        agree(&mut flat);
        assert_eq!(presets(&flat), [Preset::Mumps; 2]);
    }
}
