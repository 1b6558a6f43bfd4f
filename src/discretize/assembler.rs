//! The step from what one rank has of a body to its matrix and its solver, which a factory makes.

use super::distribute::Share;
use super::local::{BodyInfo, LocalBody};
use super::meshes::FemBody;
use super::part::{SceneBody, elasticity_of};
use super::post::{OnPart, Post};
use super::supports::Constraints;
use crate::error::Result;
use crate::exchange::Plain;
use crate::fem::rigid::{self, AtDofs};
use crate::fem::{ElasticBody, NodalForces, NodeGraph, Prolongation, RigidMotion, Space, Split};
use crate::linalg::{Csr, dot};
use crate::mesh::Mesh;
use crate::model::{BodySlot, Distribution, FreeMotion, Loads, Local};
use crate::problem::order::Order;
use crate::problem::{BodySpec, Plane};
use std::cell::OnceCell;
use std::rc::Rc;

/// The assembly of all bodies on one rank.
pub struct Assembler<'a, const D: usize, F> {
    pub mesh: &'a Mesh<D>,
    /// Kind of a plane problem.
    pub plane: Plane,
    pub rank: usize,
    /// The maker of solvers.
    pub factory: &'a mut F,
    /// Number of assembled matrices.
    pub assemblies: usize,
    /// Number of matrices reused from an earlier scene.
    pub avoided: usize,
    /// Meshes of the bodies that this rank has.
    pub shapes: Vec<FemBody<D>>,
}

impl<const D: usize, F: Factory> Assembler<'_, D, F> {
    /// Assemble a body and give it a solver, from what this rank has of it. `slot` receives the body, and `info` the evaluation of its
    /// displacements. On ranks other than the owner the scale stays zero until [`Discrete::share`](super::Discrete::share).
    ///
    /// # Errors
    /// The scene contradicts its mesh in a way that shows when K is assembled, or the factory fails.
    pub fn make(
        &mut self,
        spec: &BodySpec,
        local: LocalBody<D>,
        slot: &mut BodySlot,
        info: &mut BodyInfo,
    ) -> Result<()> {
        let elasticity = Rc::new(elasticity_of(spec, local.regions, D, self.plane)?);
        let LocalBody { space, held, springs, points, extent, share, load, .. } = local;
        let part = SceneBody { spec, space, held, springs, elasticity: elasticity.clone(), points, extent };
        let (space, held) = match local.is_owned {
            false => (Rc::new(part.space), Rc::new(part.held)),
            true => {
                let is_own = |node| share.as_ref().is_none_or(|s| s.is_own::<D>(part.held.frame.node(node) as usize));
                let own = (0..part.space.nodes.len() as u32).map(is_own).collect();
                let (loads, free) = loads(&part, &load, local.imposed, local.prescribed, local.left, local.works);
                slot.imposed = loads.imposed.clone();
                let kept = self.factory.kept(&info.name).filter(|_| share.is_none());
                match reload(kept, &loads)? {
                    Some(before) => {
                        self.avoided += 1;
                        (slot.local, slot.scale, slot.row_stiffness) =
                            (before.local, before.scale, before.row_stiffness);
                    }
                    None => {
                        self.assemblies += usize::from(info.rank == self.rank);
                        self.assemble(&part, local.rows, local.graph, share, free, loads, slot)?;
                    }
                }
                if info.rank != self.rank {
                    slot.scale = 0.0;
                }
                evaluate(info, part, [local.nodal_rows, local.approach], &load, own)?
            }
        };
        let motions = local.unsupported;
        self.shapes.push(FemBody { space, split: OnceCell::new(), held, elasticity, motions });
        Ok(())
    }

    /// Assemble the matrix of a body on its rows, or on those of this rank, and make its solver.
    fn assemble(
        &mut self,
        part: &SceneBody<D>,
        rows: Csr,
        graph: Option<NodeGraph>,
        share: Option<Share>,
        left: Vec<FreeMotion>,
        loads: Loads,
        slot: &mut BodySlot,
    ) -> Result<()> {
        let name = &part.spec.name.value;
        let mut graph = graph.unwrap_or_else(|| NodeGraph::with_rows(&part.space, &rows, &part.held.frame));
        if let Some(share) = &share {
            graph = graph.of(|node| share.is_own::<D>(node));
        }
        let Loads { force, prescribed, imposed, .. } = loads;
        let mut body = part.assemble(self.mesh, &graph, force, prescribed, &imposed)?;
        drop(graph);
        slot.scale = (0..body.load.len()).map(|i| body.stiffness.diagonal(i)).fold(0.0, f64::max);
        slot.row_stiffness = rows.quadratic_diagonal(&body.stiffness);
        if let Some(share) = &share {
            body = share.own::<D>(body);
        }
        let interpolation = self.factory.wants_interpolation(name).then(|| match &share {
            Some(share) => share.interpolation::<D>(|coarse| part.interpolation(coarse)),
            None => part.interpolation(&part.coarse_nodes()),
        });
        // Multigrid must represent motions with hardly any strain. Far from the axis, a ring is nearly as soft against radial
        // displacements and rotations of its section as a plane body.
        let smooth = || rigid::modes(&part.extent).iter().map(|motion| part.dofs_of(motion)).collect();
        slot.local = self.factory.make(Assembled {
            name: name.clone(),
            dimension: D,
            body,
            distribution: share.map(|share| share.distribution),
            rows,
            motions: &smooth,
            left,
            interpolation,
        })?;
        Ok(())
    }
}

/// Return the loads of a body on the dofs of this rank, and the motions that supports leave. If this rank has only some of the
/// loads, `works` holds the work of all loads on these motions.
fn loads<const D: usize>(
    part: &SceneBody<D>,
    load: &NodalForces<D>,
    imposed: Option<RigidMotion<D>>,
    prescribed: Vec<(usize, f64)>,
    left: Vec<RigidMotion<D>>,
    works: Option<Vec<f64>>,
) -> (Loads, Vec<FreeMotion>) {
    let force = part.load_vector(load);
    let free = left.iter().enumerate().map(|(k, motion)| {
        let work = |u: &[f64]| works.as_ref().map_or_else(|| dot(u, &force), |works| works[k]);
        FreeMotion::new(part.dofs_of(motion), &prescribed, work)
    });
    let free: Vec<FreeMotion> = free.collect();
    let work = free.iter().map(|motion| motion.work).collect();
    let imposed = imposed.map_or_else(Vec::new, |motion| part.dofs_of(&motion));
    (Loads { work, force, prescribed, imposed }, free)
}

/// Give `info` the evaluation of displacements and forces of a body at the nodes that this rank has. `own` marks the nodes that
/// belong to this rank, `rows` and `approach` are rows with displacements of nodes as columns. Return the space and the supports of the
/// body.
fn evaluate<const D: usize>(
    info: &mut BodyInfo,
    part: SceneBody<D>,
    [rows, approach]: [Csr; 2],
    load: &NodalForces<D>,
    own: Vec<bool>,
) -> Result<(Rc<Space<D>>, Rc<Constraints<D>>)> {
    let rigid = part.rigid_forces().collect();
    let (space, held) = (Rc::new(part.space), Rc::new(part.held));
    let post = OnPart {
        name: info.name.clone(),
        exact: part.spec.exact.clone(),
        rows,
        approach,
        springs: part.springs,
        supports: part.spec.fix.len(),
        load: load.all(space.nodes.len()),
        rigid,
        extent: part.extent,
        nodes: info.nodes,
        held: held.clone(),
        split: Split::new(&space, &part.elasticity),
        elasticity: part.elasticity,
        space: space.clone(),
        own,
    };
    post.check_exact()?;
    let shown = post.split.space.part(post.owned()).1;
    info.points = shown.into_iter().map(|node| part.points[post.split.origin(node) as usize]).collect();
    info.post = Some(Box::new(post) as Box<dyn Post>);
    Ok((space, held))
}

/// Return the body of an earlier scene under other loads, or `None` if it cannot be reused.
fn reload(kept: Option<BodySlot>, loads: &Loads) -> Result<Option<BodySlot>> {
    let Some(mut slot) = kept else { return Ok(None) };
    let serves = match slot.local.as_mut() {
        Some(body) => body.reload(loads)?,
        None => false,
    };
    Ok(serves.then_some(slot))
}

/// What the first rank has of a body before it is assembled.
pub struct Outline<'a> {
    /// Name in the scene.
    pub name: &'a str,
    /// Space dimension, which is the number of dofs of a node.
    pub dimension: usize,
    /// Order of the elements.
    pub order: Order,
    /// All contact rows of the body, pair by pair, with its dofs as columns.
    pub rows: &'a Csr,
    /// Prescribed (dof, value), sorted by dof.
    pub prescribed: &'a [(usize, f64)],
    /// Rigid motions of the free body.
    pub motions: AtDofs<'a>,
    /// Coupling of nodes by K. It is computed when it is first requested.
    pub graph: &'a dyn Fn() -> &'a NodeGraph,
}

/// A maker of the inner solvers of bodies.
pub trait Factory {
    /// The choice of solvers of all bodies.
    type SolverPlan: Plain;

    /// Choose the solvers of all bodies, in the order of the scene, on the first rank.
    ///
    /// # Errors
    /// PETSc refuses an option.
    fn plan(&mut self, outlines: &[Outline]) -> Result<Self::SolverPlan>;

    /// Follow the plan of the first rank on another rank.
    ///
    /// # Errors
    /// PETSc refuses an option.
    fn adopt(&mut self, plan: Self::SolverPlan) -> Result<()>;

    /// Return the sets of bodies whose nodes the plan distributes over the ranks. Bodies of one set share a matrix; their indices
    /// are in increasing order. Bodies that stay whole are in no set.
    fn distributed(&self) -> Vec<Vec<usize>>;

    /// Return whether the plan needs the interpolation of a body from linear displacements.
    fn wants_interpolation(&self, name: &str) -> bool;

    /// Make the solver of a body by its plan, on each rank that owns the body or a part of it.
    ///
    /// # Errors
    /// PETSc refuses a matrix or the value of an option.
    fn make(&mut self, assembled: Assembled) -> Result<Local>;

    /// Return a body of this name with the same K and contact rows that an earlier scene or leg has left. It is on the rank that
    /// owns the body.
    fn kept(&mut self, name: &str) -> Option<BodySlot>;
}

/// A body that is ready for its inner solver.
pub struct Assembled<'a> {
    /// Name in the scene.
    pub name: String,
    /// Space dimension, which is the block size of the matrix.
    pub dimension: usize,
    /// K, f and supports on all dofs, or on those of this rank.
    pub body: ElasticBody,
    /// Distribution of the dofs, if the body is distributed.
    pub distribution: Option<Distribution>,
    /// All contact rows of the body, pair by pair. The columns are its dofs, or those of the nodes that this rank has.
    pub rows: Csr,
    /// Motions with hardly any strain in a few cells, for the near-null space of multigrid. They are the rigid motions of the
    /// free body, in a body of revolution those of its meridian. Each is one vector over these dofs.
    pub motions: &'a dyn Fn() -> Vec<Vec<f64>>,
    /// Rigid motions that the supports leave, on these dofs.
    pub left: Vec<FreeMotion>,
    /// Interpolation of displacements from linear ones, if it was requested. The rows are the dofs of `body`. The columns belong
    /// to this body alone, or to all bodies of the matrix if the dofs are distributed.
    pub interpolation: Option<Prolongation>,
}
