//! What is known of bodies and pairs besides their matrices.

use super::post::Post;
use super::surface::ContactSurface;
use crate::mesh::Checked;
use crate::problem::ContactSpec;
use serde::{Deserialize, Serialize};

/// Names of the rigid motions of a body that neither supports nor smooth surfaces resist.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Gauged {
    /// Those without work of the loads, fixed at one node each.
    pub fixed: Vec<String>,
    /// Those on which loads work: only the facets of the mesh resist them.
    pub spinning: Vec<String>,
}

/// Loads that lacked balance on motions by no more than the mesh may miss of them, and were balanced.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Balanced {
    /// The bodies that the motions move.
    pub bodies: Vec<usize>,
    /// Names of the motions.
    pub motion: String,
    /// Work of the loads on them, as a share of what forces of their sizes could do: the largest.
    pub share: f64,
}

/// What is known of a body besides its matrices.
#[derive(Serialize, Deserialize)]
pub struct BodyInfo {
    /// Name in the scene.
    pub name: String,
    /// The point of the scene about which its [`Balance`](super::Balance) has moments.
    pub datum: [f64; 3],
    /// Nodes.
    pub nodes: usize,
    /// Number among the points of the mesh of each node of the cells that this rank shows.
    pub points: Vec<u32>,
    /// Cells.
    pub cells: usize,
    /// What the check of its mesh counted.
    pub facets: Checked,
    /// Degrees of freedom, supported ones included.
    pub dofs: usize,
    /// Supported degrees of freedom.
    pub supported: usize,
    /// Names of the rigid motions that the supports leave.
    pub left_by_supports: Vec<String>,
    /// Names of those that no contact row can hold either.
    pub left_by_all: Vec<String>,
    /// Rigid motions that nothing but its mesh resists.
    pub gauged: Gauged,
    /// What the user should know of its elasticity.
    pub warning: Option<String>,
    /// Stiffness of the body against a uniform contact pressure, per area: modulus over depth (area or volume over the length
    /// or area of its contact surfaces); zero if supports leave it a motion that contact feels.
    pub stiffness: f64,
    /// Sum of its loads; in a body of revolution radial ones add up as if they had one direction.
    pub load: [f64; 3],
    /// Rank that owns the body, or most of it.
    pub rank: usize,
    /// Ranks that have a part of it.
    pub ranks: Vec<usize>,
    /// Names of the groups of its supports.
    pub supports: Vec<String>,
    /// Names of the groups of its springs.
    pub springs: Vec<String>,
    /// Names of its rigid surfaces.
    pub rigid: Vec<String>,
    /// What it says of its displacements.
    #[serde(skip)]
    pub(super) post: Option<Box<dyn Post>>,
}

impl BodyInfo {
    /// What the body says of its displacements.
    ///
    /// # Panics
    /// On ranks that have no part of the body.
    pub fn post(&self) -> &dyn Post {
        self.post.as_deref().unwrap_or_else(|| unreachable!("only ranks that have a part of a body recover it"))
    }
}

/// What is known of a pair besides its arrays.
pub struct ContactInfo {
    /// What the scene says; `between` names the bodies if the pair was found.
    pub spec: ContactSpec,
    /// Whether side a (which carries the points) is the second of `spec.between`.
    pub swapped: bool,
    /// Mesh of side a, for output.
    pub surface: ContactSurface,
}
