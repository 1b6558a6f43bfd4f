//! What one rank has of a body that is ready for assembly, and what all ranks have of it.

use super::distribute::{Partition, Share};
use super::post::Post;
use super::supports::{Constraints, axis_vector};
use super::unassembled::{NO_WORK, Unassembled};
use crate::contact::{self, ContactPair};
use crate::exchange::Plain;
use crate::fem::{self, NodalBlock, NodalForces, NodeGraph, PointExtent, RigidMotion, Space, place};
use crate::linalg::{Csr, dot};
use crate::mesh::BodyCheck;
use crate::model::{BodySlot, Local};
use crate::problem::Plane;
use serde::{Deserialize, Serialize};

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
    /// Number of degrees of freedom, constrained ones included.
    pub dofs: usize,
    /// Number of constrained degrees of freedom.
    pub supported: usize,
    /// Names of the rigid motions that the supports leave.
    pub left_by_supports: Vec<String>,
    /// Names of the rigid motions that no contact row can resist either.
    pub left_by_all: Vec<String>,
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

/// What one rank has of a body: all of it, or the part on the nodes that this rank needs, with local numbers.
#[derive(Serialize, Deserialize)]
#[serde(bound = "[f64; D]: Plain, [[f64; D]; D]: Plain")]
pub struct LocalBody<const D: usize> {
    /// Nodes and cells.
    pub space: Space<D>,
    /// Index of the elastic constants of each cell; empty if the body has no regions.
    pub regions: Vec<usize>,
    /// Supports and rigid surfaces.
    pub held: Constraints<D>,
    pub springs: Vec<Vec<NodalBlock<D>>>,
    /// Point of the mesh of each node.
    pub points: Vec<u32>,
    /// Number of nodes of the whole body and their extent.
    pub extent: PointExtent,
    /// Contact rows with dofs as columns.
    pub rows: Csr,
    /// Contact rows with displacements of nodes as columns.
    pub nodal_rows: Csr,
    /// The displacement towards each contact surface, with displacements of nodes as columns.
    pub approach: Csr,
    /// Nodal forces of the loads at owned nodes, and at nodes tied to these.
    pub load: NodalForces<D>,
    /// Rigid motion by which the supports move the body as one.
    pub imposed: Option<RigidMotion<D>>,
    /// Prescribed (dof, value) relative to this motion, sorted by dof.
    pub prescribed: Vec<(usize, f64)>,
    /// Rigid motions that supports and springs leave.
    pub left: Vec<RigidMotion<D>>,
    /// Rigid motions that supports alone leave.
    pub unsupported: Vec<RigidMotion<D>>,
    /// Work of all loads on each rigid motion that supports and springs leave; `None` if this rank has all loads.
    pub works: Option<Vec<f64>>,
    /// Dofs of this rank, if the body is distributed.
    pub share: Option<Share>,
    /// Whether this rank owns the body or nodes of it. Other ranks have it for estimates of the error.
    pub is_owned: bool,
    /// Coupling of nodes by K, if it was computed on this rank.
    #[serde(skip)]
    pub graph: Option<NodeGraph>,
}

impl<const D: usize> LocalBody<D> {
    /// Take the whole body.
    pub fn whole(body: Unassembled<D>, is_owned: bool) -> Self {
        let Unassembled {
            part, rows, nodal_rows, approach, nodal_load, imposed, prescribed, left, unsupported, ..
        } = body;
        let cells = if part.spec.regions.is_empty() { 0 } else { part.space.cell_count() };
        Self {
            regions: (0..cells).map(|cell| part.elasticity.region(cell)).collect(),
            space: part.space,
            held: part.held,
            springs: part.springs,
            points: part.points,
            extent: part.extent,
            rows,
            nodal_rows,
            approach,
            load: nodal_load,
            imposed,
            prescribed,
            left,
            unsupported,
            works: None,
            share: None,
            is_owned,
            graph: body.graph.into_inner(),
        }
    }

    /// Restrict a body to the nodes that a rank needs, or keep all nodes if `wants_all`. `number` is the index of the body in its
    /// matrix.
    pub fn restrict(body: &Unassembled<D>, partition: &Partition, number: usize, rank: usize, wants_all: bool) -> Self {
        let part = &body.part;
        let cells = match wants_all {
            true => (0..part.space.cell_count()).collect(),
            false => partition.cells(number, part, rank),
        };
        let nodes = partition.nodes(number, body, &cells, rank);
        let here = |node: u32| place(&nodes, node);
        let dof_here = |dof: usize| Some(D * here((dof / D) as u32)? as usize + dof % D);
        let prescribed_here = |&(dof, u): &(usize, f64)| Some((dof_here(dof)?, u));
        let rows_here = |rows: &Csr| rows.of_columns(D * nodes.len(), dof_here);
        let spring_here = |&NodalBlock { nodes: [a, b], block }: &NodalBlock<D>| {
            Some(NodalBlock { nodes: [here(a)?, here(b)?], block })
        };
        let springs = part.springs.iter().map(|blocks| blocks.iter().filter_map(spring_here).collect());
        let regions = cells.iter().filter(|_| !part.spec.regions.is_empty()).map(|&cell| part.elasticity.region(cell));
        let is_assembled = |node: u32| partition.owner(number, part.held.frame.node(node)) == rank;
        Self {
            space: part.space.on(&part.space.corners(&cells), &nodes),
            regions: regions.collect(),
            held: part.held.on(&nodes),
            springs: springs.collect(),
            points: nodes.iter().map(|&node| part.points[node as usize]).collect(),
            extent: part.extent.clone(),
            rows: rows_here(&body.rows),
            nodal_rows: rows_here(&body.nodal_rows),
            approach: rows_here(&body.approach),
            load: body.nodal_load.only(is_assembled).on(&nodes),
            imposed: body.imposed.clone(),
            prescribed: body.prescribed.iter().filter_map(prescribed_here).collect(),
            left: body.left.clone(),
            unsupported: body.unsupported.clone(),
            works: Some(partition.works[number].clone()),
            is_owned: true,
            graph: None,
            share: Some(partition.share::<D>(number, nodes, &body.rows, rank)),
        }
    }
}

impl<const D: usize> Unassembled<'_, D> {
    /// Return what all ranks have of the body: the arrays of the model and the facts for reports. `checked` is the result of the check of its
    /// mesh.
    pub fn shared(&self, pairs: &[ContactPair], checked: &BodyCheck, plane: Plane) -> (BodySlot, BodyInfo) {
        let of_body = || self.segments.iter().map(|segment| &pairs[segment.pair]);
        let surface: f64 = of_body().map(|pair| pair.weight.iter().sum::<f64>()).sum();
        let (volume, moduli) = self.part.volume_and_moduli();
        let (modulus, depth) = (dot(&moduli, &along_axes(of_body())), volume / surface);
        let slot = BodySlot {
            name: self.part.spec.name.value.clone(),
            local: Local::default(),
            imposed: Vec::new(),
            segments: self.segments.clone(),
            motions: self.motions.clone(),
            sprung: self.sprung.clone(),
            scale: 0.0,
            modulus,
            depth,
            row_stiffness: Vec::new(),
        };
        (slot, self.info(checked, plane, modulus, depth))
    }

    /// Return the trace on the contact rows of the rigid motion that supports impose.
    pub fn imposed_trace(&self) -> Vec<f64> {
        self.imposed.as_ref().map_or_else(|| vec![0.0; self.rows.rows()], |motion| self.trace(motion))
    }

    fn info(&self, checked: &BodyCheck, plane: Plane, modulus: f64, depth: f64) -> BodyInfo {
        let (part, unresisted) = (&self.part, self.unresisted());
        let spec = part.spec;
        let is_held = self.motions.len() == unresisted.len() && depth.is_finite();
        // Loads that balance, as a pressure in a closed ring does, leave rounding, which counts as zero.
        let mut load = self.nodal_load.sum();
        for (c, sum) in load.iter_mut().enumerate().take(D) {
            let [work, largest] = self.nodal_load.works(|_| axis_vector(c));
            *sum = if work.abs() <= NO_WORK * largest { 0.0 } else { *sum };
        }
        part.rigid_forces().for_each(|(_, force)| contact::add(&mut load, fem::pad(force)));
        BodyInfo {
            name: spec.name.value.clone(),
            datum: fem::pad(part.space.datum),
            nodes: part.space.nodes.len(),
            points: Vec::new(),
            cells: part.space.cell_count(),
            facets: BodyCheck { points: Vec::new(), ..checked.clone() },
            dofs: part.space.dofs(),
            supported: part.held.supported(),
            left_by_supports: self.left.iter().map(|motion| motion.name.clone()).collect(),
            left_by_all: unresisted,
            warning: part.locking(plane),
            stiffness: if is_held { modulus / depth } else { 0.0 },
            load,
            rank: self.owner,
            ranks: self.ranks.clone(),
            supports: spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: part.held.rigid.iter().map(|surface| spec.load[surface.load].on.value.clone()).collect(),
            post: None,
        }
    }
}

/// Return the mean squared components of the normals on the contact surfaces of a body.
fn along_axes<'p>(pairs: impl Iterator<Item = &'p ContactPair>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in pairs {
        for (weight, normal) in pair.weight.iter().zip(&pair.normal) {
            (0..3).for_each(|c| sum[c] += weight * normal[c] * normal[c]);
        }
    }
    let total: f64 = sum.iter().sum();
    if total > 0.0 { sum.map(|sum| sum / total) } else { sum }
}
