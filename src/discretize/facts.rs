//! What all ranks have of a body: the arrays of the model, and the facts that reports need.

use super::partition::BodyRanks;
use super::post::Post;
use super::scene_body::SceneBody;
use crate::contact::ContactPair;
use crate::fem;
use crate::linalg::{Blocks, TOLERANCE, dot};
use crate::mesh::BodyCheck;
use crate::model::motions::combined;
use crate::model::{BodySlot, Motion};
use crate::problem::{Order, Plane};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// Facts of a body besides its matrices.
#[derive(Serialize, Deserialize)]
pub struct BodyInfo {
    /// Name in the scene.
    pub name: String,
    /// Point of the scene about which the [`ForceBalance`](super::ForceBalance) of the body has moments.
    pub datum: [f64; 3],
    pub nodes: usize,
    /// Point of the mesh for each node of the cells that this rank writes.
    pub points: Vec<u32>,
    pub cells: usize,
    /// Counts from the check of the mesh.
    pub facets: BodyCheck,
    /// Order of its elements.
    pub order: Order,
    /// Number of degrees of freedom, constrained ones included.
    pub dofs: usize,
    /// Number of constrained degrees of freedom.
    pub supported: usize,
    /// Names of the rigid motions that supports and springs leave.
    pub unconstrained: Vec<String>,
    /// Names of the rigid motions that no contact row can resist either.
    pub unresisted: Vec<String>,
    /// Warning for the user about the elasticity.
    pub warning: Option<String>,
    /// Rank that owns the body or, if it is distributed, most of it.
    pub rank: usize,
    /// Ranks that have a part of the body.
    pub ranks: Vec<usize>,
    /// Names of the groups of the supports.
    pub supports: Vec<String>,
    /// Names of the groups of the springs.
    pub springs: Vec<String>,
    /// Names of the rigid surfaces.
    pub rigid: Vec<String>,
    /// Evaluation of the displacements on this rank.
    #[serde(skip)]
    pub(super) post: Option<Rc<dyn Post>>,
}

impl BodyInfo {
    /// Return the evaluation of the displacements.
    ///
    /// # Panics
    /// This rank has no part of the body.
    pub fn post(&self) -> &dyn Post {
        self.post.as_deref().unwrap_or_else(|| unreachable!("only ranks that have a part of a body recover it"))
    }
}

impl<const D: usize> SceneBody<'_, D> {
    /// Return what all ranks have of the body: the arrays of the model and the facts for reports. `checked` is the
    /// result of the check of its mesh.
    pub fn shared(
        &self,
        pairs: &[ContactPair],
        checked: &BodyCheck,
        plane: Plane,
        ranks: &BodyRanks,
    ) -> (BodySlot, BodyInfo) {
        let of_body = || self.segments.iter().map(|segment| &pairs[segment.pair]);
        let surface: f64 = of_body().map(|pair| pair.area.iter().sum::<f64>()).sum();
        let (volume, moduli) = self.volume_and_moduli();
        let (modulus, depth) = (dot(&moduli, &along_axes(of_body())), volume / surface);
        let slot = BodySlot {
            name: self.spec.name.value.clone(),
            local: None,
            is_rigid: false,
            segments: self.segments.clone(),
            motions: self.motions(),
            ground: self.mesh.ground_stiffness(&self.mesh.motions),
            free: self.mesh.free,
            scale: 0.0,
            modulus,
            depth,
            row_stiffness: Vec::new(),
            heat: 0.0,
            imposed: self.trace(&self.mesh.imposed_motion()),
        };
        let info = BodyInfo {
            unresisted: unresisted(slot.free_motions()),
            warning: self.locking(plane),
            rank: ranks.leader,
            ranks: ranks.all.clone(),
            ..self.info(checked)
        };
        (slot, info)
    }

    fn info(&self, checked: &BodyCheck) -> BodyInfo {
        let Self { spec, mesh, .. } = self;
        BodyInfo {
            name: spec.name.value.clone(),
            datum: fem::pad(mesh.space.datum),
            nodes: mesh.space.nodes.len(),
            points: Vec::new(),
            cells: mesh.space.cell_count(),
            facets: BodyCheck { points: Vec::new(), ..checked.clone() },
            order: mesh.space.order,
            dofs: mesh.space.dofs(),
            supported: mesh.held.supported(),
            unconstrained: mesh.free_motions().iter().map(|motion| motion.name.clone()).collect(),
            unresisted: Vec::new(),
            warning: None,
            rank: 0,
            ranks: Vec::new(),
            supports: spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: mesh.held.rigid.iter().map(|surface| spec.load[surface.load].on.value.clone()).collect(),
            post: None,
        }
    }
}

/// Return the names of the combinations of the free motions of a body that none of its contact rows resists.
fn unresisted(motions: &[Motion]) -> Vec<String> {
    let resisted = DMatrix::from_fn(motions.len(), motions.len(), |i, j| dot(&motions[i].trace, &motions[j].trace));
    let rows = motions.first().map_or(1, |motion| motion.trace.len().max(1));
    let names = || motions.iter().map(|motion| motion.name.as_str());
    let named = |weights: DVector<f64>| combined(names(), weights.iter().copied());
    Blocks::free(&resisted, rows as f64, TOLERANCE).into_iter().map(named).collect()
}

/// Return the mean squared components of the normals on the contact surfaces of a body.
fn along_axes<'p>(pairs: impl Iterator<Item = &'p ContactPair>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in pairs {
        for (area, normal) in pair.area.iter().zip(&pair.normal) {
            (0..3).for_each(|c| sum[c] += area * normal[c] * normal[c]);
        }
    }
    let total: f64 = sum.iter().sum();
    if total > 0.0 { sum.map(|sum| sum / total) } else { sum }
}
