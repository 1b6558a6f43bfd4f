//! What all ranks have of a body: the arrays of the model, and the facts that reports need.

use super::post::Post;
use super::whole_body::WholeBody;
use crate::contact::ContactPair;
use crate::fem;
use crate::linalg::dot;
use crate::mesh::BodyCheck;
use crate::model::BodySlot;
use crate::problem::{Order, Plane};
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

impl<const D: usize> WholeBody<'_, D> {
    /// Return what all ranks have of the body: the arrays of the model and the facts for reports. `checked` is the
    /// result of the check of its mesh.
    pub fn shared(&self, pairs: &[ContactPair], checked: &BodyCheck, plane: Plane) -> (BodySlot, BodyInfo) {
        let of_body = || self.segments.iter().map(|segment| &pairs[segment.pair]);
        let surface: f64 = of_body().map(|pair| pair.area.iter().sum::<f64>()).sum();
        let (volume, moduli) = self.part.volume_and_moduli();
        let (modulus, depth) = (dot(&moduli, &along_axes(of_body())), volume / surface);
        let slot = BodySlot {
            name: self.part.spec.name.value.clone(),
            local: None,
            is_rigid: false,
            segments: self.segments.clone(),
            motions: self.motions.clone(),
            sprung: self.sprung.clone(),
            scale: 0.0,
            modulus,
            depth,
            row_stiffness: Vec::new(),
            heat: 0.0,
            imposed: self.trace(&self.part.mesh.imposed_motion(&self.rigid_modes)),
        };
        (slot, self.info(checked, plane))
    }

    fn info(&self, checked: &BodyCheck, plane: Plane) -> BodyInfo {
        let (part, unresisted) = (&self.part, self.unresisted());
        let spec = part.spec;
        BodyInfo {
            name: spec.name.value.clone(),
            datum: fem::pad(part.mesh.space.datum),
            nodes: part.mesh.space.nodes.len(),
            points: Vec::new(),
            cells: part.mesh.space.cell_count(),
            facets: BodyCheck { points: Vec::new(), ..checked.clone() },
            order: part.mesh.space.order,
            dofs: part.mesh.space.dofs(),
            supported: part.mesh.held.supported(),
            unconstrained: part.mesh.unconstrained_modes.iter().map(|motion| motion.name.clone()).collect(),
            unresisted,
            warning: part.locking(plane),
            rank: self.owner,
            ranks: self.ranks.clone(),
            supports: spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: part.mesh.held.rigid.iter().map(|surface| spec.load[surface.load].on.value.clone()).collect(),
            post: None,
        }
    }
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
