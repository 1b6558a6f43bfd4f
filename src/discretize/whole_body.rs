//! A whole body on the first rank, before its matrix is assembled: its contact rows, its loads, the rigid motions that
//! supports leave, and that by which they move it.

use super::approach;
use super::scene_body::SceneBody;
use crate::contact::ContactPair;
use crate::error::Result;
use crate::fem::{Frame, NodalForces, RigidMotion, rigid};
use crate::linalg::{Blocks, Csr, PART, TOLERANCE, dot};
use crate::mesh::Mesh;
use crate::model::{Motion, Segment, Sprung, motions::combined};
use nalgebra::{DMatrix, DVector};
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
    /// Rigid motions of the free body.
    pub rigid_modes: Vec<RigidMotion<D>>,
    /// Forces of all loads at dofs.
    pub load: NodalForces<D>,
    /// The motions that supports and springs leave at present, as traces on the contact rows and works of the loads.
    pub motions: Vec<Motion>,
    /// The motions that supports alone leave, with the stiffness of the springs, if springs resist some of them.
    pub sprung: Option<Sprung>,
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
        let (rigid_modes, load) = (part.mesh.rigid_modes(), part.mesh.load_on_dofs());
        let mut body =
            Self { part, segments, rigid_modes, load, motions: Vec::new(), sprung: None, owner: 0, ranks: Vec::new() };
        body.collect_rows(pairs);
        body.find_motions();
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

    /// Put the contact rows and loads of the body into the dofs of a frame.
    pub fn set_frame(&mut self, frame: Frame<D>, pairs: &mut [ContactPair]) {
        if frame == self.part.mesh.held.frame {
            return;
        }
        self.part.mesh.held.frame = frame;
        let held = &self.part.mesh.held;
        self.segments.iter().for_each(|segment| pairs[segment.pair].hold(segment.side, &held.frame, &held.prescribed));
        self.collect_rows(pairs);
        self.load = self.part.mesh.load_on_dofs();
    }

    /// Return the names of the motions that neither supports nor springs nor any contact row of the body resist.
    pub fn unresisted(&self) -> Vec<String> {
        let motions = &self.motions;
        let resisted = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
        let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
        let names = || motions.iter().map(|motion| motion.name.as_str());
        let named = |weights: DVector<f64>| combined(names(), weights.iter().copied());
        Blocks::free(&resisted, rows as f64, TOLERANCE).into_iter().map(named).collect()
    }

    /// Return the traces of motions on the contact rows, with the work of the loads on each.
    fn with_works(&self, all: &[RigidMotion<D>]) -> Vec<Motion> {
        let of = |(motion, work): (&RigidMotion<D>, f64)| Motion {
            name: motion.name.clone(),
            trace: self.trace(motion),
            work,
        };
        all.iter().zip(self.works(all)).map(of).collect()
    }

    /// Return the trace of a motion on the contact rows.
    pub fn trace(&self, motion: &RigidMotion<D>) -> Vec<f64> {
        let row = |q: usize| self.part.mesh.rows.row(q).map(|(dof, b)| b * self.part.mesh.dof_of(motion, dof)).sum();
        (0..self.part.mesh.rows.rows()).map(row).collect()
    }

    /// Return the work of the loads on motions. It is exactly zero where it is rounding.
    fn works(&self, all: &[RigidMotion<D>]) -> Vec<f64> {
        let of = |motion: &RigidMotion<D>| self.load.works(|node| self.part.mesh.at_dofs(motion, node));
        let work = |[work, largest]: [f64; 2]| if work.abs() <= NO_WORK * largest { 0.0 } else { work };
        all.iter().map(of).map(work).collect()
    }

    /// Change each nodal force f by -|f| u, where u is the vector at the position of its node.
    pub fn change_loads(&mut self, u: impl Fn(&[f64; D]) -> [f64; D]) {
        let change = |(node, force): (u32, [f64; D])| {
            let (size, u) = (dot(&force, &force).sqrt(), u(&self.part.mesh.space.nodes[node as usize]));
            (node, std::array::from_fn(|c| force[c] - size * u[c]))
        };
        self.part.mesh.load = self.part.mesh.load.iter().map(change).collect();
        self.load = self.part.mesh.load_on_dofs();
    }

    /// Find the motions that supports and springs leave to the body at present.
    pub fn find_motions(&mut self) {
        let mesh = &self.part.mesh;
        let unsupported = mesh.unsupported(&self.rigid_modes);
        let (springs, scale) =
            (mesh.ground_stiffness(&unsupported), mesh.ground_stiffness(&self.rigid_modes).diagonal().max());
        let left = if scale > 0.0 && !unsupported.is_empty() {
            Blocks::free(&springs, scale, TOLERANCE).iter().map(|w| rigid::combine(&unsupported, w)).collect()
        } else {
            unsupported.clone()
        };
        let is_sprung = left.len() < unsupported.len();
        self.sprung = is_sprung.then(|| Sprung { motions: self.with_works(&unsupported), stiffness: springs });
        self.motions = self.with_works(&left);
        (self.part.mesh.unconstrained_modes, self.part.mesh.unsupported_modes) = (left, unsupported);
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
