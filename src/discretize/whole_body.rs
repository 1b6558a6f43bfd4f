//! A whole body on the first rank, before its matrix is assembled: its contact rows, its loads, the rigid motions that
//! supports leave, and that by which they move it.

use super::approach;
use super::body_mesh::BodyMesh;
use super::scene_body::SceneBody;
use crate::contact::ContactPair;
use crate::error::Result;
use crate::fem::{NodalForces, RigidMotion};
use crate::linalg::{Csr, PART};
use crate::mesh::Mesh;
use crate::model::{Motion, Segment};
use std::collections::HashSet;

/// Share of the largest possible work below which the work of the loads is rounding: the sum of a million works, each
/// rounded by 1e-16 of it, is rounded by 1e-10 at most.
pub const NO_WORK: f64 = 1e-9;

/// A whole body before its matrix is assembled.
#[derive(Clone)]
pub struct WholeBody<'a, const D: usize> {
    /// Space, supports and springs.
    pub part: SceneBody<'a, D>,
    /// Contact rows of the body, pair by pair.
    pub segments: Vec<Segment>,
    /// Forces of all loads at dofs.
    pub load: NodalForces<D>,
    /// Rank that owns the body or, if it is distributed, most of it.
    pub owner: usize,
    /// Ranks that own nodes of the body.
    pub ranks: Vec<usize>,
}

impl<'a, const D: usize> WholeBody<'a, D> {
    /// Collect the contact rows and loads of all bodies.
    ///
    /// # Errors
    /// See [`SceneBody::load`].
    pub fn all(parts: Vec<SceneBody<'a, D>>, pairs: &[ContactPair], mesh: &Mesh<D>) -> Result<Vec<Self>> {
        let mut segments = vec![Vec::new(); parts.len()];
        for (pair, sides) in pairs.iter().enumerate() {
            for (side, &body) in sides.bodies.iter().enumerate().filter(|(_, body)| **body < parts.len()) {
                segments[body].push(Segment { pair, side });
            }
        }
        parts.into_iter().zip(segments).map(|(part, segments)| Self::new(part, segments, pairs, mesh)).collect()
    }

    fn new(mut part: SceneBody<'a, D>, segments: Vec<Segment>, pairs: &[ContactPair], mesh: &Mesh<D>) -> Result<Self> {
        part.mesh.approach = approach::rows(&part, &segments, pairs, mesh)?;
        part.mesh.load = part.load(mesh)?;
        part.mesh.find_motions();
        let load = part.mesh.load_on_dofs();
        let mut body = Self { part, segments, load, owner: 0, ranks: Vec::new() };
        body.collect_rows(pairs);
        Ok(body)
    }

    /// Collect the contact rows of the body.
    pub fn collect_rows(&mut self, pairs: &[ContactPair]) {
        let rows = |of: fn(&ContactPair) -> &[Csr; 2]| {
            let mut all = Csr::new(self.part.mesh.space.dofs());
            for &Segment { pair, side } in &self.segments {
                (0..pairs[pair].len()).for_each(|q| all.push_row(of(&pairs[pair])[side].row(q)));
            }
            all
        };
        (self.part.mesh.rows, self.part.mesh.nodal_rows) = (rows(|pair| &pair.rows), rows(|pair| &pair.nodal));
    }

    /// Return the motions that supports leave, as traces on the contact rows and works of the loads.
    pub fn motions(&self) -> Vec<Motion> {
        let of = |motion: &RigidMotion<D>| Motion {
            name: motion.name.clone(),
            trace: self.trace(motion),
            work: self.work(motion),
        };
        self.part.mesh.motions.iter().map(of).collect()
    }

    /// Return the trace of a motion on the contact rows.
    pub fn trace(&self, motion: &RigidMotion<D>) -> Vec<f64> {
        let row = |q: usize| self.part.mesh.rows.row(q).map(|(dof, b)| b * self.part.mesh.dof_of(motion, dof)).sum();
        (0..self.part.mesh.rows.rows()).map(row).collect()
    }

    /// Return the work of the loads on a motion. It is exactly zero where it is rounding.
    pub fn work(&self, motion: &RigidMotion<D>) -> f64 {
        let [work, largest] = self.load.works(|node| self.part.mesh.at_dofs(motion, node));
        if work.abs() <= NO_WORK * largest { 0.0 } else { work }
    }

    /// Change each nodal force to what `changed` returns for its node.
    pub fn change_loads(&mut self, changed: impl Fn(&BodyMesh<D>, u32, [f64; D]) -> [f64; D]) {
        let mesh = &self.part.mesh;
        let load = mesh.load.iter().map(|(node, force)| (node, changed(mesh, node, force))).collect();
        self.part.mesh.load = load;
        self.load = self.part.mesh.load_on_dofs();
    }

    /// Return the dof at which a motion can be fixed, and its displacement there. It is the one that the motion moves
    /// most, the last one of equal ones, outside the contact rows so that these do not change. The result is `None` if
    /// that displacement is rounding.
    pub fn candidate(&self, motion: &RigidMotion<D>) -> Option<(usize, f64)> {
        let in_rows: HashSet<usize> = self.part.mesh.rows.col.iter().map(|&dof| dof as usize).collect();
        let is_free = |dof: &usize| !in_rows.contains(dof) && !self.part.mesh.held.prescribed.contains_key(dof);
        let all = (0..self.part.mesh.space.dofs()).filter(is_free);
        let sizes = all.map(|dof| (dof, self.part.mesh.dof_of(motion, dof)));
        sizes.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).filter(|found| found.1.abs() > PART)
    }

    /// Fix a dof. The motions of the body are not found anew.
    pub fn fix(&mut self, dof: usize) {
        self.part.mesh.held.prescribed.insert(dof, 0.0);
    }
}
