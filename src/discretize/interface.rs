//! A body before it is assembled: its contact rows, its loads, and the rigid motions that supports leave.

use super::part::{Candidate, Part};
use crate::contact::ContactPair;
use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::{NodalForces, RigidMotion, rigid};
use crate::linalg::{Blocks, Csr, TOLERANCE, dot};
use crate::mesh::Mesh;
use crate::model::{Motion, Segment, Sprung, rigid as joint};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Share of the largest possible work below which the work of the loads is rounding.
pub const NO_WORK: f64 = 1e-9;

/// A body before it is assembled.
#[derive(Clone)]
pub struct Interface<const D: usize> {
    /// Contact rows of the body, pair by pair.
    pub segments: Vec<Segment>,
    /// These rows with dofs as columns.
    pub rows: Csr,
    /// The same rows with displacements of nodes as columns.
    pub nodal_rows: Csr,
    /// Rigid motions of the free body.
    pub free: Vec<RigidMotion<D>>,
    /// Nodal forces of the loads, without those on rigid surfaces.
    pub nodal_load: NodalForces<D>,
    /// Forces of all loads at dofs.
    pub load: NodalForces<D>,
}

/// The rigid motions that supports and springs leave to a body.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Unconstrained<const D: usize> {
    /// Combinations of the motions of the free body.
    pub left: Vec<RigidMotion<D>>,
    /// The same motions as traces on the contact rows and works of the loads.
    pub motions: Vec<Motion>,
    /// Motions that supports alone leave, if springs resist some of them.
    pub sprung: Option<Sprung>,
    /// Combinations of the motions of the free body that supports alone leave.
    pub unsupported: Vec<RigidMotion<D>>,
    /// Combinations of `left` that no contact row resists: name and weights.
    pub unresisted: Vec<(String, DVector<f64>)>,
}

/// Return the contact rows of each body, pair by pair.
pub fn segments(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<Segment>> {
    let mut segments = vec![Vec::new(); bodies];
    for (pair, sides) in pairs.iter().enumerate() {
        (0..2).for_each(|side| segments[sides.bodies[side]].push(Segment { pair, side }));
    }
    segments
}

impl<const D: usize> Interface<D> {
    /// Collect the contact rows and loads of a body.
    ///
    /// # Errors
    /// See [`Part::load`].
    pub fn new(part: &Part<D>, segments: Vec<Segment>, pairs: &[ContactPair], mesh: &Mesh<D>) -> Result<Self> {
        let all = |rows: fn(&ContactPair) -> &[Csr; 2]| {
            let mut all = Csr::new(part.space.dofs());
            for &Segment { pair, side } in &segments {
                (0..pairs[pair].len()).for_each(|q| all.push_row(rows(&pairs[pair])[side].row(q)));
            }
            all
        };
        let (rows, nodal_rows) = (all(|pair| &pair.rows), all(|pair| &pair.nodal));
        let nodal_load = part.load(mesh)?;
        let load = part.load_on_dofs(&nodal_load);
        Ok(Self { segments, rows, nodal_rows, free: part.free(), nodal_load, load })
    }

    /// Return the traces of motions on the contact rows, with the work of the loads on each.
    pub fn motions(&self, part: &Part<D>, all: &[RigidMotion<D>]) -> Vec<Motion> {
        let of = |(motion, work): (&RigidMotion<D>, f64)| {
            let row = |q: usize| self.rows.row(q).map(|(dof, b)| b * part.dof_of(motion, dof)).sum();
            Motion { name: motion.name.clone(), trace: (0..self.rows.rows()).map(row).collect(), work }
        };
        all.iter().zip(self.works(part, all)).map(of).collect()
    }

    /// Return the work of the loads on motions. It is exactly zero where it is rounding.
    pub fn works(&self, part: &Part<D>, all: &[RigidMotion<D>]) -> Vec<f64> {
        let of = |motion: &RigidMotion<D>| self.load.works(|node| part.at_dofs(motion, node));
        let work = |[work, largest]: [f64; 2]| if work.abs() <= NO_WORK * largest { 0.0 } else { work };
        all.iter().map(of).map(work).collect()
    }

    /// Change each nodal force f by -|f| u, where u is the vector at the position of its node.
    pub fn change_loads(&mut self, part: &Part<D>, u: impl Fn(&[f64; D]) -> [f64; D]) {
        let change = |(node, force): (u32, [f64; D])| {
            let (size, u) = (dot(&force, &force).sqrt(), u(&part.space.nodes[node as usize]));
            (node, std::array::from_fn(|c| force[c] - size * u[c]))
        };
        self.nodal_load = self.nodal_load.iter().map(change).collect();
        self.load = part.load_on_dofs(&self.nodal_load);
    }

    /// Return the motions that supports and springs leave to the body at present.
    pub fn unconstrained(&self, part: &Part<D>) -> Unconstrained<D> {
        let at = |k: usize, node: u32| self.free[k].at(&part.space.nodes[node as usize]);
        let left = part.left(self.free.len(), &at);
        let left: Vec<_> = left.iter().map(|weights| rigid::combine(&self.free, weights)).collect();
        let motions = self.motions(part, &left);
        let unresisted = unresisted(&motions);
        let sprung = part.sprung(&self.free).filter(|(all, _)| all.len() > left.len());
        let unsupported = sprung.as_ref().map_or_else(|| left.clone(), |(all, _)| all.clone());
        let sprung = sprung.map(|(all, stiffness)| Sprung { motions: self.motions(part, &all), stiffness });
        Unconstrained { left, motions, sprung, unsupported, unresisted }
    }

    /// Return the dof at which a motion can be fixed. It is the one that the motion moves most, outside the contact rows so that
    /// these do not change. The result is `None` if that displacement is small.
    pub fn candidate(&self, part: &Part<D>, motion: &RigidMotion<D>) -> Option<Candidate> {
        let in_rows: HashSet<usize> = self.rows.col.iter().map(|&dof| dof as usize).collect();
        let size = |dof: usize| {
            let is_free = !in_rows.contains(&dof) && !part.held.prescribed.contains_key(&dof);
            is_free.then(|| part.dof_of(motion, dof).abs())
        };
        part.largest(size).filter(|found| found.size > 1e-3)
    }
}

/// Return the combinations of motions that no contact row resists: name and weights.
fn unresisted(motions: &[Motion]) -> Vec<(String, DVector<f64>)> {
    let resisted = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    let names = || motions.iter().map(|motion| motion.name.as_str());
    let named = |weights: DVector<f64>| (joint::combined(names(), weights.iter().copied()), weights);
    Blocks::free(&resisted, rows as f64, TOLERANCE).into_iter().map(named).collect()
}
