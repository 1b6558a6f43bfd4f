//! Facts of bodies and pairs besides their matrices.

use super::post::Post;
use super::surface::ContactSurface;
use crate::contact::{Chords, End};
use crate::mesh::Checked;
use crate::problem::ContactSpec;
use serde::{Deserialize, Serialize};

/// Names of the rigid motions of a body that neither supports nor smooth surfaces resist.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Gauged {
    /// Motions without work of the loads, which are fixed at one node each.
    pub fixed: Vec<String>,
    /// Motions on which loads work. Only the facets of the mesh resist them.
    pub spinning: Vec<String>,
}

/// Loads that were balanced on motions, since their imbalance was no larger than what the mesh may miss of the loads.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Balanced {
    /// Indices of the bodies that the motions move.
    pub bodies: Vec<usize>,
    /// Names of the motions.
    pub motion: String,
    /// Largest work of the loads on these motions, as a share of the work that forces of their magnitudes could do.
    pub share: f64,
}

/// Facts of a body besides its matrices.
#[derive(Serialize, Deserialize)]
pub struct BodyInfo {
    /// Name in the scene.
    pub name: String,
    /// Point of the scene about which the [`Balance`](super::Balance) of the body has moments.
    pub datum: [f64; 3],
    /// Number of nodes.
    pub nodes: usize,
    /// Point of the mesh for each node of the cells that this rank writes.
    pub points: Vec<u32>,
    /// Number of cells.
    pub cells: usize,
    /// Counts from the check of the mesh.
    pub facets: Checked,
    /// Number of degrees of freedom, constrained ones included.
    pub dofs: usize,
    /// Number of constrained degrees of freedom.
    pub supported: usize,
    /// Names of the rigid motions that the supports leave.
    pub left_by_supports: Vec<String>,
    /// Names of the rigid motions that no contact row can resist either.
    pub left_by_all: Vec<String>,
    /// Rigid motions that only the mesh resists.
    pub gauged: Gauged,
    /// Warning for the user about the elasticity.
    pub warning: Option<String>,
    /// Stiffness of the body against a uniform contact pressure, per area. It is the modulus over the depth, which is the area
    /// (volume) over the length (area) of its contact surfaces. It is zero if supports leave the body a motion that contact
    /// resists.
    pub stiffness: f64,
    /// Sum of the loads, zero where it is rounding. In a body of revolution radial forces are added as if they had one direction.
    pub load: [f64; 3],
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
    pub(super) post: Option<Box<dyn Post>>,
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

/// Facts of a pair besides its arrays.
pub struct ContactInfo {
    /// Description in the scene. `between` names the bodies if the pair was found.
    pub spec: ContactSpec,
    /// Whether the pair is one of several into which edges split two surfaces.
    pub is_split: bool,
    /// Number of facets of side a that belong to no pair, on faces beyond edges. One pair of two surfaces counts them.
    pub idle: usize,
    /// The overlap of the meshes, if facets make most of it.
    pub chords: Option<Chords>,
    /// Contact points where the pair ends because the surfaces are too far apart.
    pub ends: Vec<End>,
    /// Whether side a, which carries the points, is the second of `spec.between`.
    pub swapped: bool,
    /// Mesh of side a, for output.
    pub surface: ContactSurface,
}
