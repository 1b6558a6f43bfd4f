//! Scene and mesh -> [`Model`]: the one place where geometry ends. Nothing below it knows the dimension.

mod approach;
mod auto;
mod balance;
mod carried;
mod cells;
mod couplings;
mod distribute;
mod draft;
mod elastic;
mod factory;
mod find;
mod gauge;
mod here;
mod known;
mod local;
mod mechanism;
pub mod meshes;
mod pairs;
mod part;
mod parts;
mod post;
pub mod resolution;
mod roster;
mod springs;
mod supports;
mod surface;
mod verify;

use crate::contact::{self, ContactPair};

use crate::error::Result;
use crate::exchange::Exchange;
use crate::fem::FreeMotion;
use crate::linalg::{Csr, axpy, dot};
use crate::mesh::Checked;
use crate::model::{BodySlot, Loads, Mechanism, Model, Segment};
use crate::problem::{BodySpec, ContactSpec, Start};
use crate::scene::Scene;
use balance::Forces;
pub use balance::{Balance, Resultant};
use carried::{Supported, supported};
use cells::Needs;
use couplings::Coupled;
use distribute::Deal;
use draft::{Draft, Loose};
pub use factory::{Assembled, Factory, Outline};
use here::Here;
use local::Local;
use mechanism::Fixed;
use meshes::{Kept, Meshes, Shape};
use parts::parts;
use post::OnPart;
pub use post::Post;
use std::rc::Rc;
pub use surface::ContactSurface;
pub use verify::{Verified, verify};

/// What is known of a body besides its matrices.
pub struct BodyInfo {
    /// Name in the scene.
    pub name: String,
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
    /// Names of the rigid motions without work that a gauge fixes at one node each.
    pub gauged: Vec<String>,
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
    post: Option<Box<dyn Post>>,
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

/// The discrete problem and what reports need to know of its origin.
pub struct Discrete {
    /// What the method works on.
    pub model: Model,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyInfo>,
    /// Origin of each pair.
    pub contacts: Vec<ContactInfo>,
    /// Free motions of several bodies together.
    pub mechanisms: Vec<Mechanism>,
    /// Trace of the rigid motions that supports give bodies: states, and so the traces of iterates, are relative to them.
    pub carried: Vec<f64>,
    /// The meshes, kept only when an estimate of the error was asked for.
    pub meshes: Option<Rc<dyn Meshes>>,
    /// Stiffness matrices assembled on this rank.
    pub assemblies: usize,
    /// Those that an earlier scene has left.
    pub assemblies_avoided: usize,
}

/// Turns a scene and its mesh into a model.
///
/// `bodies` are those of `verified` under the loads of a step; `cut` finds the common pieces of surfaces in this dimension. `factory` turns
/// each body of this rank into one that solves. `keep` tells to keep the meshes, for an estimate of the error. Collective.
///
/// # Errors
/// Refusals of the scene against its mesh: missing groups, surfaces of the wrong body, supports that contradict each
/// other, surfaces that do not face each other; and failures of `factory`.
pub fn discretize<const D: usize>(
    scene: &Scene,
    verified: &Verified<D>,
    bodies: &[BodySpec],
    cut: contact::pieces::Cut<D>,
    keep: bool,
    exchange: Rc<dyn Exchange>,
    factory: &mut dyn Factory,
) -> Result<Discrete> {
    let Verified { portion, checked, .. } = verified;
    let (mesh, rank, alone) = (&portion.mesh, exchange.rank(), exchange.ranks() == 1);
    let (mut parts, stocks) = parts(scene, verified, bodies)?;
    let (mut pairs, mut contacts) = (Vec::new(), Vec::new());
    let (mut fine, mut shapes) = (Vec::new(), Vec::new());
    for found in pairs::all(scene, mesh, cut, &parts, keep, &*verified.exchange)? {
        let pairs::Contact { spec, pair, fine: points, swapped, surface } = found;
        pairs.push(pair);
        fine.extend(points);
        contacts.push(ContactInfo { spec, swapped, surface });
    }
    let (mut slots, mut infos, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
    let (mut assemblies, mut assemblies_avoided) = (0, 0);
    let drafts = parts.iter().zip(draft::segments(parts.len(), &pairs));
    let drafts = drafts.map(|(part, segments)| Draft::new(part, segments, &pairs, mesh));
    let drafts = drafts.collect::<Result<Vec<_>>>()?;
    let Fixed { gauged, mechanisms, loose } = mechanism::fix(&mut parts, &drafts, &pairs);
    let supported: Vec<Supported> =
        parts.iter().zip(&drafts).map(|(part, draft)| supported(part, &draft.free)).collect();
    let others = &*verified.exchange;
    let lazy = Coupled::new((&parts, &stocks, &drafts), others);
    let coupled = &lazy;
    let asked: Vec<_> = (0..parts.len()).map(|i| (move || coupled.graph(i), move || coupled.count(i))).collect();
    let motions = parts.iter().zip(&drafts);
    let motions: Vec<_> =
        motions.map(|(part, draft)| move |k: usize, dof: usize| part.dof_of(&draft.free[k], dof)).collect();
    let outlines = parts.iter().zip(&drafts).zip(&supported).zip(asked.iter().zip(&motions));
    let outlines = outlines.map(|(((part, draft), supported), ((graph, couplings), motion))| Outline {
        name: &part.spec.name.value,
        dimension: D,
        order: part.space.order,
        rows: &draft.rows,
        prescribed: &supported.prescribed,
        motions: draft.free.len(),
        motion,
        couplings,
        graph,
    });
    factory.plan(&outlines.collect::<Vec<_>>())?;
    let deal = |bodies: Vec<usize>| {
        let couplings = coupled.of(&bodies, &pairs);
        let places: Vec<&[[f64; D]]> = bodies.iter().map(|&body| &parts[body].space.nodes[..]).collect();
        Deal::new(bodies, &places, &couplings, exchange.ranks())
    };
    let deals: Vec<Deal> = factory.dealt_out().into_iter().map(deal).collect();
    let graphs = lazy.into_graphs();
    let coarse = |body: usize| match factory.wants_interpolation(&parts[body].spec.name.value) {
        true => parts[body].coarse_nodes(),
        false => Vec::new(),
    };
    let dealt = distribute::distribute::<D>(&drafts, &coarse, &deals, &exchange);
    let loads = parts.iter().zip(&dealt).map(|(part, dealt)| if dealt.is_some() { 0 } else { part.space.dofs() });
    let mut owner = crate::parallel::owners(&loads.collect::<Vec<_>>(), exchange.ranks());
    dealt
        .iter()
        .zip(&mut owner)
        .for_each(|(dealt, owner)| *owner = dealt.as_ref().map_or(*owner, |dealt| dealt.leader));
    let needs = if keep { Needs::everywhere(parts.len()) } else { Needs::of(&owner, &drafts, &deals) };
    let elasticities = cells::deal(&mut parts, stocks, &needs, scene.plane, &*verified.exchange)?;
    drop(needs);
    drop(deals);
    let drafts = drafts.into_iter().zip(supported).zip(graphs).zip(dealt);
    let known = gauged.into_iter().zip(loose).zip(elasticities);
    for (index, ((part, (((draft, supported), graph), mut dealt)), ((gauged, loose), elasticity))) in
        parts.into_iter().zip(drafts).zip(known).enumerate()
    {
        let is_owner = owner[index] == rank;
        let Draft { segments, rows, nodal_load, load, .. } = draft;
        let mut offset = vec![0.0; rows.rows()];
        if !supported.carried.is_empty() {
            rows.multiply(&supported.carried, &mut offset);
        }
        offsets.push(offset);
        let Loose { left, motions, sprung, unfelt } = loose;
        let name = part.spec.name.value.clone();
        let mut resultant = nodal_load.sum();
        part.rigid_forces().for_each(|(_, total)| contact::add(&mut resultant, total));
        let surface: f64 = segments.iter().map(|segment| pairs[segment.pair].weight.iter().sum::<f64>()).sum();
        let modulus = dot(&part.known.moduli, &share(&segments, &pairs));
        let held = motions.len() == unfelt.len();
        let depth = part.known.volume / surface;
        let mut info = BodyInfo {
            name: name.clone(),
            nodes: part.space.nodes.len(),
            points: Vec::new(),
            cells: part.known.cells,
            facets: checked[index].clone(),
            dofs: part.space.dofs(),
            supported: part.held.supported(),
            left_by_supports: left.iter().map(|motion| motion.name.clone()).collect(),
            left_by_all: unfelt.into_iter().map(|(name, _)| name).collect(),
            gauged,
            warning: elastic::warning(part.spec, &part.space, scene.plane),
            stiffness: if held && surface > 0.0 { modulus / depth } else { 0.0 },
            load: resultant,
            rank: owner[index],
            ranks: dealt.as_ref().map_or_else(|| vec![owner[index]], |dealt| dealt.ranks.clone()),
            supports: part.spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: part.spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: part.held.rigid.iter().map(|(load, _)| part.spec.load[*load].on.value.clone()).collect(),
            post: None,
        };
        let unloaded = if keep { part.unloaded(mesh, &nodal_load.all())? } else { Vec::new() };
        // what only the owner knows, until all ranks share it
        let (mut local, mut scale, mut row_stiffness) = (None, 0.0, Vec::new());
        let elasticity = Rc::new(elasticity);
        let (space, held) = if is_owner || dealt.is_some() {
            let rows = [rows, nodal_rows(&segments, &pairs, part.space.dofs())];
            let (smooth, loads) = (part.smooth(), [load, nodal_load]);
            let (mut here, mut works) = (Here { part, rows, loads, supported }, None);
            if let Some(dealt) = &mut dealt {
                let work;
                (here, work) = here.of(dealt, &left);
                works = Some(work);
            }
            let Here { part, rows: [rows, nodal_rows], loads, supported: Supported { carried, prescribed } } = here;
            let [force, nodal_force] = loads.map(|loads| loads.all());
            let free = left.iter().enumerate().map(|(k, motion)| {
                let work = |u: &[f64]| works.as_ref().map_or_else(|| dot(u, &force), |works| works[k]);
                FreeMotion::new(part.dofs_of(motion), &prescribed, work)
            });
            let free: Vec<_> = free.collect();
            let is_own =
                |node| dealt.as_ref().is_none_or(|dealt| dealt.is_own::<D>(part.held.frame.node(node) as usize));
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
                assemblies_avoided += 1;
            } else {
                let mut graph = graph.filter(|_| alone).unwrap_or_else(|| part.graph(&part.space, &rows));
                if let Some(dealt) = &dealt {
                    graph = graph.of(|node| dealt.is_own::<D>(node));
                }
                let mut body = part.assemble(mesh, &graph, &elasticity, force, prescribed, carried)?;
                drop(graph);
                if is_owner {
                    assemblies += 1;
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
            let (space, held) = (Rc::new(part.space), Rc::new(part.held));
            let is_whole = info.ranks.len() == 1 && !own.contains(&false);
            let local = Local { space: space.clone(), own };
            info.points = match is_whole {
                true => part.known.points.iter().map(|&(_, point)| point).collect(),
                false => space.part(local.told()).1.iter().filter_map(|&node| part.known.point(node)).collect(),
            };
            let forces = Forces {
                rows: nodal_rows,
                springs: part.springs,
                supports: part.spec.fix.len(),
                load: nodal_force,
                held: held.clone(),
                elasticity: elasticity.clone(),
                part: local,
            };
            info.post = Some(Box::new(OnPart::new(part.spec, part.known.outer, forces)?) as Box<dyn Post>);
            (space, held)
        } else {
            (Rc::new(part.space), Rc::new(part.held))
        };
        infos.push(info);
        if keep {
            shapes.push(Shape { space, elasticity, modulus, held, unloaded });
        }
        slots.push(BodySlot { name, local, segments, motions, sprung, scale, modulus, depth, row_stiffness });
    }
    let meshes = keep.then(|| Rc::new(Kept { shapes, fine }) as Rc<dyn Meshes>);
    let mut model = Model::new(slots, pairs, exchange);
    model.mechanism = mechanisms.iter().find(|mechanism| mechanism.work != 0.0).cloned();
    let mut carried = vec![0.0; 2 * model.points()];
    offsets.iter().enumerate().for_each(|(body, offset)| model.put(body, offset, &mut carried));
    model.carry(&carried);
    Ok(Discrete { model, bodies: infos, contacts, mechanisms, meshes, carried, assemblies, assemblies_avoided })
}

impl Discrete {
    /// Sides of pair `i` in the order of the scene.
    pub fn sides(&self, i: usize) -> [usize; 2] {
        if self.contacts[i].swapped { [1, 0] } else { [0, 1] }
    }

    /// Tells every rank what only the owner of a body knows of it: largest stiffness, and stiffness at the contact rows. Collective,
    /// after all ranks have made their problem.
    pub fn share(&mut self) {
        let count = self.model.bodies.len();
        let mut message = vec![0.0; count + 2 * self.model.points()];
        for (body, slot) in self.model.bodies.iter().enumerate() {
            message[body] = slot.scale;
            if slot.local.is_some() {
                self.model.put(body, &slot.row_stiffness, &mut message[count..]);
            }
        }
        self.model.exchange.sum(&mut message);
        for body in 0..count {
            let rows = self.model.of_body(body, &message[count..]);
            let slot = &mut self.model.bodies[body];
            (slot.scale, slot.row_stiffness) = (message[body], rows);
        }
    }
}

/// The trace (2n) with which the scene begins, at a share `factor` of the loads; none if it is for the program to find.
///
/// # Errors
/// A start that is not finite at a contact point.
pub fn start(scene: &Scene, discrete: &Discrete, factor: f64) -> Result<Option<Vec<f64>>> {
    let model = &discrete.model;
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    match &scene.method.start {
        Start::Auto | Start::Nested => return Ok(None),
        Start::Zero => {}
        Start::Normal(field) => {
            let positions = model.pairs.iter().flat_map(|pair| &pair.position);
            for (q, &x) in positions.enumerate() {
                let value = field.eval_finite("the start", x)? / factor;
                trace[q] = value;
                trace[points + q] = value;
            }
        }
    }
    axpy(-1.0, &discrete.carried, &mut trace);
    Ok(Some(trace))
}

/// The rows of these segments for displacements of the nodes of a body, of so many dofs.
fn nodal_rows(segments: &[Segment], pairs: &[ContactPair], dofs: usize) -> Csr {
    let mut rows = Csr::new(dofs);
    for &Segment { pair, side } in segments {
        (0..pairs[pair].len()).for_each(|q| rows.push_row(pairs[pair].nodal[side].row(q)));
    }
    rows
}

/// Mean squared components of the normals on the contact surfaces of a body.
fn share(segments: &[Segment], pairs: &[ContactPair]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in segments.iter().map(|segment| &pairs[segment.pair]) {
        for (weight, normal) in pair.weight.iter().zip(&pair.normal) {
            (0..3).for_each(|c| sum[c] += weight * normal[c] * normal[c]);
        }
    }
    let total: f64 = sum.iter().sum();
    if total > 0.0 { sum.map(|sum| sum / total) } else { sum }
}
