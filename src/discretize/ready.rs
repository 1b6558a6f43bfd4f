//! A body of which all is known but its matrix: on the nodes that this rank needs, once no rank knows all nodes any more.

use super::balance::Forces;
use super::carried::Supported;
use super::distribute::Dealt;
use super::draft::Loose;
use super::factory::{Assembled, Factory};
use super::here::Here;
use super::info::BodyInfo;
use super::local::Local;
use super::meshes::Shape;
use super::part::Part;
use super::post::{OnPart, Post};
use super::supports::Held;
use crate::error::Result;
use crate::fem::{Elasticity, FreeMotion, NodalForces, NodeGraph, RigidMotion, Space};
use crate::linalg::{Csr, dot};
use crate::mesh::Mesh;
use crate::model::{Body, BodySlot, Loads, Segment};
use std::rc::Rc;

/// A body before its matrix is assembled, as one rank sees it.
pub struct Ready<'a, const D: usize> {
    /// Its contact rows, pair by pair.
    pub segments: Vec<Segment>,
    /// The rigid motions that supports and springs leave it.
    pub loose: Loose<D>,
    /// Modulus, and depth behind its contact surfaces.
    pub scales: [f64; 2],
    /// Elasticity of the cells that are here.
    pub elasticity: Elasticity,
    /// Which nodes K couples, if that is known here.
    pub graph: Option<NodeGraph>,
    /// The part of this rank, if the body is split over the ranks.
    pub dealt: Option<Dealt>,
    /// What this rank has of it; none of a body of another rank.
    pub here: Option<Here<'a, D>>,
    /// The work of all loads on each motion that is left, where only some of the loads are here.
    pub works: Option<Vec<f64>>,
    /// Motions with hardly any strain.
    pub smooth: Vec<RigidMotion<D>>,
    /// All of the body, of which this rank has nothing, and its supports, if estimates ask for them.
    pub elsewhere: Option<(Space<D>, Held<D>)>,
    /// Nodal forces that the quadrature of its loads misses.
    pub unloaded: Vec<f64>,
}

/// How many matrices were assembled on a rank, and how many of an earlier scene served again.
#[derive(Default)]
pub struct Counts {
    /// Those assembled.
    pub assemblies: usize,
    /// Those that served again.
    pub avoided: usize,
}

/// What only the ranks that have a part of a body know of it, until all ranks share it.
#[derive(Default)]
struct Made {
    local: Option<Box<dyn Body>>,
    scale: f64,
    row_stiffness: Vec<f64>,
}

impl<const D: usize> Ready<'_, D> {
    /// Assembles the body and makes it one that solves, with what is known of its mesh; `info` learns what the body says of its displacements.
    ///
    /// # Errors
    /// Refusals of the scene against its mesh that show when K is assembled, and failures of `factory`.
    pub fn make(
        self,
        info: &mut BodyInfo,
        mesh: &Mesh<D>,
        is_owner: bool,
        factory: &mut dyn Factory,
        counts: &mut Counts,
    ) -> Result<(BodySlot, Option<Shape<D>>)> {
        let Self { segments, loose, scales: [modulus, depth], unloaded, .. } = self;
        let Loose { left, motions, sprung, unsupported, .. } = loose;
        let name = info.name.clone();
        let elasticity = Rc::new(self.elasticity);
        let shape = |space: Rc<Space<D>>, held: Rc<Held<D>>, elasticity: Rc<Elasticity>| Shape {
            space,
            held,
            elasticity,
            modulus,
            unloaded,
            motions: unsupported,
        };
        let slot = |Made { local, scale, row_stiffness }: Made| BodySlot {
            name: name.clone(),
            local,
            segments,
            motions,
            sprung,
            scale,
            modulus,
            depth,
            row_stiffness,
        };
        let Some(here) = self.here else {
            let shape = self.elsewhere.map(|(space, held)| shape(Rc::new(space), Rc::new(held), elasticity));
            return Ok((slot(Made::default()), shape));
        };
        let Here { part, rows: [rows, nodal_rows], load, supported: Supported { carried, prescribed } } = here;
        let force = part.load_vector(&load);
        let free = left.iter().enumerate().map(|(k, motion)| {
            let work = |u: &[f64]| self.works.as_ref().map_or_else(|| dot(u, &force), |works| works[k]);
            FreeMotion::new(part.dofs_of(motion), &prescribed, work)
        });
        let left: Vec<FreeMotion> = free.collect();
        let work = left.iter().map(|motion| motion.work).collect();
        let carried = carried.map_or_else(Vec::new, |motion| part.dofs_of(&motion));
        let loads = Loads { work, force, prescribed, carried };
        let own = own_nodes(&part, self.dealt.as_ref());
        let kept = factory.kept(&name).filter(|_| self.dealt.is_none());
        let made = match reload(kept, &loads)? {
            Some(before) => {
                counts.avoided += 1;
                before
            }
            None => {
                counts.assemblies += usize::from(is_owner);
                let (graph, dealt, smooth) = (self.graph, self.dealt, self.smooth);
                let assembly = Assembly { name: &name, part: &part, rows, graph, dealt, smooth, left };
                assembly.make(mesh, &elasticity, loads, is_owner, factory)?
            }
        };
        let (space, held) = tell_displacements(info, part, nodal_rows, &load, own, &elasticity)?;
        Ok((slot(made), Some(shape(space, held, elasticity))))
    }
}

/// Give `info` the means to evaluate displacements and forces of a body at the nodes that this rank knows. `own` marks the nodes that belong to this
/// rank. Return the space and the supports of the body.
fn tell_displacements<const D: usize>(
    info: &mut BodyInfo,
    part: Part<D>,
    rows: Csr,
    load: &NodalForces<D>,
    own: Vec<bool>,
    elasticity: &Rc<Elasticity>,
) -> Result<(Rc<Space<D>>, Rc<Held<D>>)> {
    let rigid = part.rigid_forces().map(|(node, total)| (node, std::array::from_fn(|c| total[c]))).collect();
    let (space, held) = (Rc::new(part.space), Rc::new(part.held));
    let is_whole = info.ranks.len() == 1 && !own.contains(&false);
    let here = Local { space: space.clone(), own };
    info.points = match is_whole {
        true => part.known.points.iter().map(|&(_, point)| point).collect(),
        false => space.part(here.told()).1.iter().filter_map(|&node| part.known.point(node)).collect(),
    };
    let forces = Forces {
        rows,
        springs: part.springs,
        supports: part.spec.fix.len(),
        load: load.all(space.nodes.len()),
        rigid,
        extent: part.known.extent,
        nodes: info.nodes,
        held: held.clone(),
        elasticity: elasticity.clone(),
        part: here,
    };
    let mut outer = part.known.outer;
    outer.weigh(&space);
    info.post = Some(Box::new(OnPart::new(part.spec, outer, forces)?) as Box<dyn Post>);
    Ok((space, held))
}

/// Which of the nodes that a rank knows of a body are its own.
fn own_nodes<const D: usize>(part: &Part<D>, dealt: Option<&Dealt>) -> Vec<bool> {
    let is_own = |node| dealt.is_none_or(|dealt| dealt.is_own::<D>(part.held.frame.node(node) as usize));
    (0..part.space.nodes.len() as u32).map(is_own).collect()
}

/// The body of an earlier scene under other loads; none if it cannot serve again.
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
    dealt: Option<Dealt>,
    smooth: Vec<RigidMotion<D>>,
    left: Vec<FreeMotion>,
}

impl<const D: usize> Assembly<'_, '_, D> {
    fn make(
        self,
        mesh: &Mesh<D>,
        elasticity: &Elasticity,
        loads: Loads,
        is_owner: bool,
        factory: &mut dyn Factory,
    ) -> Result<Made> {
        let Self { name, part, rows, dealt, smooth, left, .. } = self;
        let mut graph = self.graph.unwrap_or_else(|| NodeGraph::with_rows(&part.space, &rows, &part.held.frame));
        if let Some(dealt) = &dealt {
            graph = graph.of(|node| dealt.is_own::<D>(node));
        }
        let Loads { force, prescribed, carried, .. } = loads;
        let mut body = part.assemble(mesh, &graph, elasticity, force, prescribed, carried)?;
        drop(graph);
        let diagonal = (0..body.load.len()).map(|i| body.stiffness.diagonal(i));
        let scale = if is_owner { diagonal.fold(0.0, f64::max) } else { 0.0 };
        let row_stiffness = rows.quadratic_diagonal(&body.stiffness);
        if let Some(dealt) = &dealt {
            body = dealt.own::<D>(body);
        }
        let interpolation = factory.wants_interpolation(name).then(|| match &dealt {
            Some(dealt) => dealt.interpolation::<D>(|coarse| part.interpolation(coarse)),
            None => part.interpolation(&part.coarse_nodes()),
        });
        let local = factory.make(Assembled {
            name: name.to_owned(),
            dimension: D,
            body,
            distribution: dealt.map(|dealt| dealt.distribution),
            rows,
            motions: &|| smooth.iter().map(|motion| part.dofs_of(motion)).collect(),
            left,
            interpolation,
        })?;
        Ok(Made { local: Some(local), scale, row_stiffness })
    }
}
