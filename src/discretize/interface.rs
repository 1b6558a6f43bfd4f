//! A body before it is assembled: its contact rows, its loads, and the rigid motions that supports leave it.

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
    /// Its contact rows, pair by pair.
    pub segments: Vec<Segment>,
    /// These rows; columns: its dofs.
    pub rows: Csr,
    /// The same for displacements of its nodes.
    pub nodal_rows: Csr,
    /// Rigid motions of the free body.
    pub free: Vec<RigidMotion<D>>,
    /// Loads at own nodes.
    pub nodal_load: NodalForces<D>,
    /// What they add to forces at dofs.
    pub load: NodalForces<D>,
}

/// The rigid motions that supports and springs leave to a body.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain")]
pub struct Unconstrained<const D: usize> {
    /// Combinations of those of the free body.
    pub left: Vec<RigidMotion<D>>,
    /// As contact and loads see them.
    pub motions: Vec<Motion>,
    /// Those that supports alone leave, if springs resist some of them.
    pub sprung: Option<Sprung>,
    /// Combinations of those of the free body that supports alone leave.
    pub unsupported: Vec<RigidMotion<D>>,
    /// Combinations of the motions that no contact row feels: name and weights.
    pub unresisted: Vec<(String, DVector<f64>)>,
}

/// Which contact rows each body has, pair by pair.
pub fn segments(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<Segment>> {
    let mut segments = vec![Vec::new(); bodies];
    for (pair, sides) in pairs.iter().enumerate() {
        (0..2).for_each(|side| segments[sides.bodies[side]].push(Segment { pair, side }));
    }
    segments
}

impl<const D: usize> Interface<D> {
    /// A body with its contact rows and loads.
    ///
    /// # Errors
    /// Those of [`Part::load`].
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

    /// Motions as contact and loads see them: at the dofs of contact rows and at loaded ones.
    pub fn motions(&self, part: &Part<D>, all: &[RigidMotion<D>]) -> Vec<Motion> {
        let of = |(motion, work): (&RigidMotion<D>, f64)| {
            let row = |q: usize| self.rows.row(q).map(|(dof, b)| b * part.dof_of(motion, dof)).sum();
            Motion { name: motion.name.clone(), trace: (0..self.rows.rows()).map(row).collect(), work }
        };
        all.iter().zip(self.works(part, all)).map(of).collect()
    }

    /// The work of the loads on motions; exactly zero if it is rounding.
    pub fn works(&self, part: &Part<D>, all: &[RigidMotion<D>]) -> Vec<f64> {
        let of = |motion: &RigidMotion<D>| self.load.works(|node| part.at_dofs(motion, node));
        let work = |[work, largest]: [f64; 2]| if work.abs() <= NO_WORK * largest { 0.0 } else { work };
        all.iter().map(of).map(work).collect()
    }

    /// Change each nodal force f by -|f| u, with the vector u of its place.
    pub fn change_loads(&mut self, part: &Part<D>, u: impl Fn(&[f64; D]) -> [f64; D]) {
        let change = |(node, force): (u32, [f64; D])| {
            let (size, u) = (dot(&force, &force).sqrt(), u(&part.space.nodes[node as usize]));
            (node, std::array::from_fn(|c| force[c] - size * u[c]))
        };
        self.nodal_load = self.nodal_load.iter().map(change).collect();
        self.load = part.load_on_dofs(&self.nodal_load);
    }

    /// What supports and springs leave to the body now.
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

    /// The dof outside the contact rows, so that these stay as they are, that a motion moves most, unless that is little.
    pub fn candidate(&self, part: &Part<D>, motion: &RigidMotion<D>) -> Option<Candidate> {
        let in_rows: HashSet<usize> = self.rows.col.iter().map(|&dof| dof as usize).collect();
        let size = |dof: usize| {
            let is_free = !in_rows.contains(&dof) && !part.held.prescribed.contains_key(&dof);
            is_free.then(|| part.dof_of(motion, dof).abs())
        };
        part.largest(size).filter(|found| found.size > 1e-3)
    }
}

/// Combinations of motions that no contact row feels: name and weights.
fn unresisted(motions: &[Motion]) -> Vec<(String, DVector<f64>)> {
    let resisted = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    let names = || motions.iter().map(|motion| motion.name.as_str());
    let named = |weights: DVector<f64>| (joint::combined(names(), weights.iter().copied()), weights);
    Blocks::free(&resisted, rows as f64, TOLERANCE).into_iter().map(named).collect()
}
