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
use super::post::{OnPart, Post};
use super::supports::Held;
use crate::error::Result;
use crate::fem::{Elasticity, FreeMotion, NodeGraph, RigidMotion, Space};
use crate::linalg::dot;
use crate::mesh::Mesh;
use crate::model::{BodySlot, Loads, Segment};
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
    /// How its nodes are dealt out, if they are.
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
        // what only the owner knows, until all ranks share it
        let (mut local, mut scale, mut row_stiffness) = (None, 0.0, Vec::new());
        let elasticity = Rc::new(self.elasticity);
        let Some(here) = self.here else {
            let of = |(space, held)| Shape {
                space: Rc::new(space),
                held: Rc::new(held),
                elasticity,
                modulus,
                unloaded,
                motions: unsupported,
            };
            let shape = self.elsewhere.map(of);
            return Ok((
                BodySlot { name, local, segments, motions, sprung, scale, modulus, depth, row_stiffness },
                shape,
            ));
        };
        let Here { part, rows: [rows, nodal_rows], load, supported: Supported { carried, prescribed } } = here;
        let (dealt, works, smooth) = (self.dealt, self.works, self.smooth);
        let force = part.load_vector(&load);
        let carried = carried.map_or_else(Vec::new, |motion| part.dofs_of(&motion));
        let free = left.iter().enumerate().map(|(k, motion)| {
            let work = |u: &[f64]| works.as_ref().map_or_else(|| dot(u, &force), |works| works[k]);
            FreeMotion::new(part.dofs_of(motion), &prescribed, work)
        });
        let free: Vec<_> = free.collect();
        let is_own = |node| dealt.as_ref().is_none_or(|dealt| dealt.is_own::<D>(part.held.frame.node(node) as usize));
        let own: Vec<bool> = (0..part.space.nodes.len() as u32).map(is_own).collect();
        let mut kept = factory.kept(&name).filter(|_| dealt.is_none());
        let mut serves = false;
        if let Some(body) = kept.as_mut().and_then(|slot| slot.local.as_mut()) {
            let work = free.iter().map(|motion| motion.work).collect();
            let (force, prescribed, carried) = (force.clone(), prescribed.clone(), carried.clone());
            serves = body.reload(&Loads { work, force, prescribed, carried })?;
        }
        if let Some(before) = kept.filter(|_| serves) {
            (local, scale, row_stiffness) = (before.local, before.scale, before.row_stiffness);
            counts.avoided += 1;
        } else {
            let whole = || NodeGraph::with_rows(&part.space, &rows, &part.held.frame);
            let mut graph = self.graph.unwrap_or_else(whole);
            if let Some(dealt) = &dealt {
                graph = graph.of(|node| dealt.is_own::<D>(node));
            }
            let mut body = part.assemble(mesh, &graph, &elasticity, force, prescribed, carried)?;
            drop(graph);
            if is_owner {
                counts.assemblies += 1;
                scale = (0..body.load.len()).map(|i| body.stiffness.diagonal(i)).fold(0.0, f64::max);
            }
            row_stiffness = rows.quadratic_diagonal(&body.stiffness);
            if let Some(dealt) = &dealt {
                body = dealt.own::<D>(body);
            }
            let interpolation = factory.wants_interpolation(&name).then(|| match &dealt {
                Some(dealt) => dealt.interpolation::<D>(|coarse| part.interpolation(coarse)),
                None => part.interpolation(&part.coarse_nodes()),
            });
            local = Some(factory.make(Assembled {
                name: name.clone(),
                dimension: D,
                body,
                distribution: dealt.map(|dealt| dealt.distribution),
                rows,
                motions: &|| smooth.iter().map(|motion| part.dofs_of(motion)).collect(),
                left: free,
                interpolation,
            })?);
        }
        let rigid = part.rigid_forces().map(|(node, total)| (node, std::array::from_fn(|c| total[c]))).collect();
        let (space, held) = (Rc::new(part.space), Rc::new(part.held));
        let is_whole = info.ranks.len() == 1 && !own.contains(&false);
        let here = Local { space: space.clone(), own };
        info.points = match is_whole {
            true => part.known.points.iter().map(|&(_, point)| point).collect(),
            false => space.part(here.told()).1.iter().filter_map(|&node| part.known.point(node)).collect(),
        };
        let forces = Forces {
            rows: nodal_rows,
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
        let slot = BodySlot { name, local, segments, motions, sprung, scale, modulus, depth, row_stiffness };
        Ok((slot, Some(Shape { space, elasticity, modulus, held, unloaded, motions: unsupported })))
    }
}
