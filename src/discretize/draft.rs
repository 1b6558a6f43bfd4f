//! A body before it is assembled: its contact rows, its loads, and the rigid motions that supports leave it.

use super::part::Part;
use crate::contact::{ContactPair, add, pad};
use crate::error::Result;
use crate::fem::{Parts, RigidMotion, place, rigid};
use crate::linalg::{Blocks, Csr, TOLERANCE, dot};
use crate::mesh::Mesh;
use crate::model::{Motion, Segment, Sprung, rigid as joint};
use nalgebra::{DMatrix, DVector};

/// Share of the largest possible work below which the work of the loads is rounding.
pub const NO_WORK: f64 = 1e-9;

/// A body before it is assembled.
pub struct Draft<const D: usize> {
    /// Its contact rows, pair by pair.
    pub segments: Vec<Segment>,
    /// These rows; columns: its dofs.
    pub rows: Csr,
    /// Rigid motions of the free body.
    pub free: Vec<RigidMotion<D>>,
    /// Loads on its nodes.
    pub nodal_load: NodalForces<D>,
    /// Loads on its dofs.
    pub load: NodalForces<D>,
}

/// Forces at the nodes of a body, without those that are zero: most loads are on surfaces.
pub struct NodalForces<const D: usize> {
    /// Number of nodes of the body.
    count: usize,
    nodes: Vec<u32>,
    forces: Vec<[f64; D]>,
}

impl<const D: usize> NodalForces<D> {
    /// From forces at all nodes.
    pub fn of(all: &[f64]) -> Self {
        let at = all.chunks_exact(D).map(|force| std::array::from_fn(|c| force[c]));
        let (nodes, forces) =
            (0..).zip(at).filter(|(_, force): &(u32, [f64; D])| force.iter().any(|f| *f != 0.0)).unzip();
        Self { count: all.len() / D, nodes, forces }
    }

    /// Their sum.
    pub fn sum(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        self.forces.iter().for_each(|&force| add(&mut sum, pad(force)));
        sum
    }

    /// Their work on a displacement; exactly zero if it is rounding.
    pub fn work(&self, at: impl Fn(u32) -> [f64; D]) -> f64 {
        let [work, largest] = self.works(at);
        if work.abs() <= NO_WORK * largest { 0.0 } else { work }
    }

    /// Their work on a displacement, and the largest that forces and displacements of these sizes can do, node by node.
    pub fn works(&self, at: impl Fn(u32) -> [f64; D]) -> [f64; 2] {
        let size = |v: &[f64]| dot(v, v).sqrt();
        self.nodes.iter().zip(&self.forces).fold([0.0; 2], |[work, largest], (&node, force)| {
            let u = at(node);
            [u.iter().zip(force).fold(work, |work, (u, f)| work + u * f), largest + size(&u) * size(force)]
        })
    }

    /// Forces at all nodes.
    pub fn all(&self) -> Vec<f64> {
        let mut all = vec![0.0; D * self.count];
        for (node, force) in self.nodes.iter().zip(&self.forces) {
            all[D * *node as usize..][..D].copy_from_slice(force);
        }
        all
    }

    /// Those at some nodes, which are sorted, of a body that has these alone.
    pub fn on(&self, nodes: &[u32]) -> Self {
        let forces = self.nodes.iter().zip(&self.forces);
        let (at, forces) = forces.filter_map(|(&node, force)| Some((place(nodes, node)?, *force))).unzip();
        Self { count: nodes.len(), nodes: at, forces }
    }
}

/// The rigid motions that supports and springs leave to a body.
pub struct Loose<const D: usize> {
    /// Combinations of those of the free body.
    pub left: Vec<RigidMotion<D>>,
    /// As contact and loads see them.
    pub motions: Vec<Motion>,
    /// Those that supports alone leave, if springs resist some of them.
    pub sprung: Option<Sprung>,
    /// Combinations of the motions that no contact row feels: name and weights.
    pub unfelt: Vec<(String, DVector<f64>)>,
}

/// Which contact rows each body has, pair by pair.
pub fn segments(bodies: usize, pairs: &[ContactPair]) -> Vec<Vec<Segment>> {
    let mut segments = vec![Vec::new(); bodies];
    for (pair, sides) in pairs.iter().enumerate() {
        (0..2).for_each(|side| segments[sides.bodies[side]].push(Segment { pair, side }));
    }
    segments
}

impl<const D: usize> Draft<D> {
    /// A body with its contact rows and loads.
    pub fn new(part: &Part<D>, segments: Vec<Segment>, pairs: &[ContactPair], mesh: &Mesh<D>) -> Result<Self> {
        let mut rows = Csr::new(part.space.dofs());
        for &Segment { pair, side } in &segments {
            (0..pairs[pair].len()).for_each(|q| rows.push_row(pairs[pair].rows[side].row(q)));
        }
        let nodal_load = part.load(mesh, Parts::Whole)?;
        let load = NodalForces::of(&part.load_on_dofs(nodal_load.clone()));
        Ok(Self { segments, rows, free: rigid::of(&part.space), nodal_load: NodalForces::of(&nodal_load), load })
    }

    /// Motions as contact and loads see them: at the dofs of contact rows and at loaded ones.
    pub fn motions(&self, part: &Part<D>, all: &[RigidMotion<D>]) -> Vec<Motion> {
        let of = |motion: &RigidMotion<D>| {
            let row = |q: usize| self.rows.row(q).map(|(dof, b)| b * part.dof_of(motion, dof)).sum();
            let work = self.load.work(|node| part.at_dofs(motion, node));
            Motion { name: motion.name.clone(), trace: (0..self.rows.rows()).map(row).collect(), work }
        };
        all.iter().map(of).collect()
    }

    /// What supports and springs leave to the body now.
    pub fn loose(&self, part: &Part<D>) -> Loose<D> {
        let at = |k: usize, node: u32| self.free[k].at(&part.space.nodes[node as usize]);
        let left = part.left(self.free.len(), &at);
        let left: Vec<_> = left.iter().map(|weights| rigid::combine(&self.free, weights)).collect();
        let motions = self.motions(part, &left);
        let unfelt = felt_by_none(&motions);
        let sprung = part.sprung(&self.free).filter(|(all, _)| all.len() > left.len());
        let sprung = sprung.map(|(all, stiffness)| Sprung { motions: self.motions(part, &all), stiffness });
        Loose { left, motions, sprung, unfelt }
    }

    /// The dof outside the contact rows, so that these stay as they are, that a motion moves most, unless that is little.
    pub fn candidate(&self, part: &Part<D>, displacement: &[f64]) -> Option<usize> {
        let mut in_rows = vec![false; displacement.len()];
        self.rows.col.iter().for_each(|&dof| in_rows[dof as usize] = true);
        let candidates = (0..in_rows.len()).filter(|dof| !in_rows[*dof] && !part.held.prescribed.contains_key(dof));
        let size = |dof: &usize| displacement[*dof].abs();
        candidates.max_by(|a, b| size(a).total_cmp(&size(b))).filter(|dof| size(dof) > 1e-3)
    }
}

/// Combinations of motions that no contact row feels: name and weights.
fn felt_by_none(motions: &[Motion]) -> Vec<(String, DVector<f64>)> {
    let felt = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    let names = || motions.iter().map(|motion| motion.name.as_str());
    let named = |weights: DVector<f64>| (joint::combined(names(), weights.iter().copied()), weights);
    Blocks::free(&felt, rows as f64, TOLERANCE).into_iter().map(named).collect()
}
