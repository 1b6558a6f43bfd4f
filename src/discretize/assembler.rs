//! The step from what one rank has of a body to its matrix and its solver.

use super::balance::Forces;
use super::carried::Supported;
use super::distribute::Share;
use super::elastic;
use super::factory::{Assembled, Factory};
use super::info::BodyInfo;
use super::interface::Unconstrained;
use super::meshes::Shape;
use super::owned::OwnedPart;
use super::part::Part;
use super::post::{OnPart, Post};
use super::supports::Constraints;
use super::unassembled::{LocalBody, SharedBody};
use crate::error::Result;
use crate::fem::{FreeMotion, NodalForces, NodeGraph, RigidMotion, Space, rigid};
use crate::linalg::{Csr, dot};
use crate::mesh::Mesh;
use crate::model::{Body, BodySlot, Loads};
use crate::problem::{BodySpec, Plane};
use std::rc::Rc;

/// A body on one rank before its matrix is assembled.
pub struct Assembler<'a, const D: usize> {
    /// Description in the scene.
    pub spec: &'a BodySpec,
    /// Kind of a plane problem.
    pub plane: Plane,
    /// What all ranks have of the body.
    pub shared: SharedBody<D>,
    /// What this rank has of the body, if anything.
    pub local: Option<LocalBody<D>>,
    /// Coupling of nodes by K, if it was computed on this rank.
    pub graph: Option<NodeGraph>,
}

/// Counters of matrices that were assembled on a rank, and of those reused from an earlier scene.
#[derive(Default)]
pub struct Counts {
    /// Number of assembled matrices.
    pub assemblies: usize,
    /// Number of reused matrices.
    pub avoided: usize,
}

/// What only the ranks with a part of a body have of it, until [`Discrete::share`](super::Discrete::share).
#[derive(Default)]
struct Made {
    local: Option<Box<dyn Body>>,
    scale: f64,
    row_stiffness: Vec<f64>,
}

impl<const D: usize> Assembler<'_, D> {
    /// Assemble the body and give it a solver, with its mesh if this rank has it. Its report receives the evaluation of
    /// displacements.
    ///
    /// # Errors
    /// The scene contradicts its mesh in a way that shows when K is assembled, or `factory` fails.
    pub fn make(
        self,
        mesh: &Mesh<D>,
        rank: usize,
        factory: &mut impl Factory,
        counts: &mut Counts,
    ) -> Result<Finished<D>> {
        let Self { spec, plane, shared, local, graph } = self;
        let SharedBody { mut info, segments, unconstrained, modulus, depth, .. } = shared;
        let Unconstrained { left, motions, sprung, unsupported, .. } = unconstrained;
        let (mut made, mut shape) = (Made::default(), None);
        if let Some(local) = local {
            let elasticity = Rc::new(elastic::of_regions(spec, local.regions, D, plane)?);
            let LocalBody { space, held, springs, facts, .. } = local;
            let part = Part { spec, space, held, springs, elasticity: elasticity.clone(), facts };
            let (unloaded, motions) = (local.unloaded, unsupported);
            let (space, held) = match local.is_owned {
                false => (Rc::new(part.space), Rc::new(part.held)),
                true => {
                    let own = own_nodes(&part, local.share.as_ref());
                    let (loads, free) = loads(&part, &local.load, local.supported, left, local.works);
                    let kept = factory.kept(&info.name).filter(|_| local.share.is_none());
                    made = match reload(kept, &loads)? {
                        Some(before) => {
                            counts.avoided += 1;
                            before
                        }
                        None => {
                            let is_first = info.rank == rank;
                            counts.assemblies += usize::from(is_first);
                            let (part, rows, share) = (&part, local.rows, local.share);
                            Assembly { name: &info.name, part, rows, graph, share, left: free, is_first }
                                .make(mesh, loads, factory)?
                        }
                    };
                    tell_displacements(&mut info, part, local.nodal_rows, &local.load, own)?
                }
            };
            shape = Some(Shape { space, held, elasticity, unloaded, motions });
        }
        let Made { local, scale, row_stiffness } = made;
        let name = info.name.clone();
        let slot = BodySlot { name, local, segments, motions, sprung, scale, modulus, depth, row_stiffness };
        Ok(Finished { slot, info, shape })
    }
}

/// A body with its solver.
pub struct Finished<const D: usize> {
    /// The body as the method uses it.
    pub slot: BodySlot,
    /// Facts for reports.
    pub info: BodyInfo,
    /// Mesh of the body, if this rank has it.
    pub shape: Option<Shape<D>>,
}

/// Return the loads of a body on the dofs of this rank, and the motions that supports leave. If this rank has only some of the
/// loads, `works` holds the work of all loads on these motions.
fn loads<const D: usize>(
    part: &Part<D>,
    load: &NodalForces<D>,
    Supported { carried, prescribed }: Supported<D>,
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
    let carried = carried.map_or_else(Vec::new, |motion| part.dofs_of(&motion));
    (Loads { work, force, prescribed, carried }, free)
}

/// Give `info` the evaluation of displacements and forces of a body at the nodes that this rank has. `own` marks the nodes that
/// belong to this rank. Return the space and the supports of the body.
fn tell_displacements<const D: usize>(
    info: &mut BodyInfo,
    part: Part<D>,
    rows: Csr,
    load: &NodalForces<D>,
    own: Vec<bool>,
) -> Result<(Rc<Space<D>>, Rc<Constraints<D>>)> {
    let rigid = part.rigid_forces().collect();
    let (space, held) = (Rc::new(part.space), Rc::new(part.held));
    let is_whole = info.ranks.len() == 1 && !own.contains(&false);
    let here = OwnedPart { space: space.clone(), own };
    info.points = match is_whole {
        true => part.facts.points,
        false => space.part(here.owned()).1.iter().map(|&node| part.facts.points[node as usize]).collect(),
    };
    let forces = Forces {
        rows,
        springs: part.springs,
        supports: part.spec.fix.len(),
        load: load.all(space.nodes.len()),
        rigid,
        extent: part.facts.extent,
        nodes: info.nodes,
        held: held.clone(),
        elasticity: part.elasticity,
        part: here,
    };
    info.post = Some(Box::new(OnPart::new(part.spec, part.facts.outer, forces)?) as Box<dyn Post>);
    Ok((space, held))
}

/// Return, for each node of a body on this rank, whether the rank owns it.
fn own_nodes<const D: usize>(part: &Part<D>, share: Option<&Share>) -> Vec<bool> {
    let is_own = |node| share.is_none_or(|share| share.is_own::<D>(part.held.frame.node(node) as usize));
    (0..part.space.nodes.len() as u32).map(is_own).collect()
}

/// Return the body of an earlier scene under other loads, or `None` if it cannot be reused.
fn reload(kept: Option<BodySlot>, loads: &Loads) -> Result<Option<Made>> {
    let Some(mut before) = kept else { return Ok(None) };
    let serves = match &mut before.local {
        Some(body) => body.reload(loads)?,
        None => false,
    };
    let made = Made { local: before.local, scale: before.scale, row_stiffness: before.row_stiffness };
    Ok(serves.then_some(made))
}

/// A body whose matrix is to be assembled.
struct Assembly<'p, 'a, const D: usize> {
    name: &'p str,
    part: &'p Part<'a, D>,
    rows: Csr,
    graph: Option<NodeGraph>,
    share: Option<Share>,
    left: Vec<FreeMotion>,
    /// Whether this rank owns most of the body.
    is_first: bool,
}

impl<const D: usize> Assembly<'_, '_, D> {
    fn make(self, mesh: &Mesh<D>, loads: Loads, factory: &mut impl Factory) -> Result<Made> {
        let Self { name, part, rows, share, left, is_first, .. } = self;
        let mut graph = self.graph.unwrap_or_else(|| NodeGraph::with_rows(&part.space, &rows, &part.held.frame));
        if let Some(share) = &share {
            graph = graph.of(|node| share.is_own::<D>(node));
        }
        let Loads { force, prescribed, carried, .. } = loads;
        let mut body = part.assemble(mesh, &graph, force, prescribed, carried)?;
        drop(graph);
        let diagonal = (0..body.load.len()).map(|i| body.stiffness.diagonal(i));
        let scale = if is_first { diagonal.fold(0.0, f64::max) } else { 0.0 };
        let row_stiffness = rows.quadratic_diagonal(&body.stiffness);
        if let Some(share) = &share {
            body = share.own::<D>(body);
        }
        let interpolation = factory.wants_interpolation(name).then(|| match &share {
            Some(share) => share.interpolation::<D>(|coarse| part.interpolation(coarse)),
            None => part.interpolation(&part.coarse_nodes()),
        });
        // Multigrid must represent motions with hardly any strain. Far from the axis, a ring is nearly as soft against radial
        // displacements and rotations of its section as a plane body.
        let smooth = || rigid::modes(&part.facts.extent).iter().map(|motion| part.dofs_of(motion)).collect();
        let local = factory.make(Assembled {
            name: name.to_owned(),
            dimension: D,
            body,
            distribution: share.map(|share| share.distribution),
            rows,
            motions: &smooth,
            left,
            interpolation,
        })?;
        Ok(Made { local: Some(local), scale, row_stiffness })
    }
}
