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
mod free;
mod gauge;
mod here;
mod info;
mod known;
mod local;
mod mechanism;
pub mod meshes;
mod missed;
mod moving;
mod pairs;
mod part;
mod parts;
mod post;
mod ready;
pub mod resolution;
mod roster;
mod round;
mod springs;
mod supports;
mod surface;
mod totals;
mod unbalanced;
mod verify;

use crate::contact::{self, ContactPair};

use crate::error::Result;
use crate::exchange::{Exchange, share};
use crate::fem::rigid::AtDofs;
use crate::linalg::{Total, axpy, dot};
use crate::mesh::Checked;
use crate::model::{Mechanism, Model, Segment};
use crate::problem::{BodySpec, Plane, Start};
use crate::scene::Scene;
pub use balance::{Balance, Resultant};
use carried::{Supported, supported};
use cells::Needs;
use couplings::Coupled;
use distribute::Deal;
use draft::Draft;
pub use factory::{Assembled, Factory, Outline};
pub use find::point;
use free::Free;
use here::Here;
pub use info::{Balanced, BodyInfo, ContactInfo, Gauged};
use mechanism::Fixed;
use meshes::{Kept, Meshes};
use part::Part;
use parts::parts;
pub use post::Post;
use ready::{Counts, Ready};
use std::rc::Rc;
use std::sync::Arc;
pub use surface::ContactSurface;
use totals::totals;
pub use unbalanced::Unbalanced;
pub use verify::{Verified, verify};

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
    /// Loads that were balanced.
    pub balanced: Vec<Balanced>,
    /// Trace of the rigid motions that supports give bodies: states, and so the traces of iterates, are relative to them.
    pub carried: Vec<f64>,
    /// The meshes, kept only when an estimate of the error was asked for.
    pub meshes: Option<Rc<dyn Meshes>>,
    /// Stiffness matrices assembled on this rank.
    pub assemblies: usize,
    /// Those that an earlier scene has left.
    pub assemblies_avoided: usize,
    /// Nodes of all bodies whose places this rank knew when dofs were dealt out.
    pub known_nodes: usize,
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
    let mut fine = Vec::new();
    for found in pairs::all(scene, mesh, cut, &parts, keep, &*verified.exchange)? {
        let pairs::Contact { spec, pair, fine: points, swapped, surface } = found;
        pairs.push(pair);
        fine.extend(points);
        contacts.push(ContactInfo { spec, swapped, surface });
    }
    let others = &*verified.exchange;
    let drafts = parts.iter().zip(draft::segments(parts.len(), &pairs));
    let drafts = drafts.map(|(part, segments)| Draft::new(part, segments, &pairs, mesh, others));
    let mut drafts = drafts.collect::<Result<Vec<_>>>()?;
    let Fixed { gauged, mechanisms, loose, balanced } = mechanism::fix(&mut parts, &mut drafts, &pairs, mesh, others);
    let supported: Vec<Supported<D>> =
        parts.iter().zip(&drafts).map(|(part, draft)| supported(part, &draft.free)).collect();
    let lazy = Coupled::new((&parts, &stocks, &drafts), others);
    let coupled = &lazy;
    let asked: Vec<_> = (0..parts.len()).map(|i| (move || coupled.graph(i), move || coupled.count(i))).collect();
    let motions: Vec<_> = parts.iter().zip(&drafts).map(|(part, draft)| Free::new(part, draft, others)).collect();
    let at: Vec<_> = motions.iter().map(|free| |k: usize, dof: usize| free.at(k, dof)).collect();
    let largest: Vec<_> = motions.iter().map(|free| |size: &dyn Fn(usize) -> Option<f64>| free.largest(size)).collect();
    let outlines = parts.iter().zip(&drafts).zip(&supported).zip(asked.iter().zip(at.iter().zip(&largest)));
    let outlines = outlines.map(|(((part, draft), supported), ((graph, couplings), (at, largest)))| Outline {
        name: &part.spec.name.value,
        dimension: D,
        order: part.space.order,
        rows: &draft.rows,
        prescribed: &supported.prescribed,
        motions: AtDofs { count: draft.free.len(), at, largest },
        couplings,
        graph,
    });
    factory.plan(&outlines.collect::<Vec<_>>())?;
    let deal = |bodies: Vec<usize>| {
        let couplings = coupled.of(&bodies, &pairs);
        Deal::new(bodies, &parts, &couplings, others)
    };
    let deals: Vec<Deal> = factory.dealt_out().into_iter().map(deal).collect();
    let graphs = lazy.into_graphs();
    let is_dealt = |body: usize| deals.iter().any(|deal| deal.bodies.contains(&body));
    let loads = parts.iter().enumerate().map(|(body, part)| if is_dealt(body) { 0 } else { part.space.dofs() });
    let mut owner = crate::parallel::owners(&loads.collect::<Vec<_>>(), exchange.ranks());
    let known_nodes = parts.iter().map(|part| part.space.nodes.known().count()).sum();
    let needs = if keep { vec![Needs::Everywhere; parts.len()] } else { Needs::of(&owner, &deals) };
    let (totals, warnings) = together(&parts, &drafts, scene.plane, others);
    let mut loads: Vec<_> = drafts.iter_mut().map(|draft| &mut draft.nodal_load).collect();
    let elasticities = cells::deal(&mut parts, stocks, &mut loads, &needs, scene.plane, others)?;
    drop(needs);
    let wants_coarse = |body: usize| factory.wants_interpolation(&parts[body].spec.name.value);
    let dealt = distribute::distribute(&parts, &drafts, &wants_coarse, &deals, others, &exchange);
    drop(deals);
    dealt
        .iter()
        .zip(&mut owner)
        .for_each(|(dealt, owner)| *owner = dealt.as_ref().map_or(*owner, |dealt| dealt.leader));
    let drafts = drafts.into_iter().zip(supported).zip(graphs).zip(dealt).zip(totals.into_iter().zip(warnings));
    let known = gauged.into_iter().zip(loose).zip(elasticities);
    let (mut infos, mut offsets, mut ready) = (Vec::new(), Vec::new(), Vec::new());
    for (index, ((part, ((((draft, supported), graph), mut dealt), of_all)), ((gauged, loose), elasticity))) in
        parts.into_iter().zip(drafts).zip(known).enumerate()
    {
        let Draft { segments, rows, nodal_rows, nodal_load, .. } = draft;
        let carried = |q: usize| {
            let at = |motion| rows.row(q).map(|(dof, b)| b * part.dof_of(motion, dof)).sum();
            supported.carried.as_ref().map_or(0.0, at)
        };
        offsets.push((0..rows.rows()).map(carried).collect::<Vec<f64>>());
        let surface: f64 = segments.iter().map(|segment| pairs[segment.pair].weight.iter().sum::<f64>()).sum();
        let modulus = dot(&part.known.moduli, &along_axes(&segments, &pairs));
        let held = loose.motions.len() == loose.unfelt.len();
        let depth = part.known.volume / surface;
        let (mut resultant, warning) = of_all;
        part.rigid_forces().for_each(|(_, total)| contact::add(&mut resultant, total));
        infos.push(BodyInfo {
            name: part.spec.name.value.clone(),
            datum: contact::pad(part.space.datum),
            nodes: part.space.nodes.len(),
            points: Vec::new(),
            cells: part.known.cells,
            facets: Checked { nodes: Arc::default(), ..checked[index].clone() },
            dofs: part.space.dofs(),
            supported: part.held.supported(),
            left_by_supports: loose.left.iter().map(|motion| motion.name.clone()).collect(),
            left_by_all: loose.unfelt.iter().map(|(name, _)| name.clone()).collect(),
            gauged,
            warning,
            stiffness: if held && surface > 0.0 { modulus / depth } else { 0.0 },
            load: resultant,
            rank: owner[index],
            ranks: dealt.as_ref().map_or_else(|| vec![owner[index]], |dealt| dealt.ranks.clone()),
            supports: part.spec.fix.iter().map(|support| support.on.value.clone()).collect(),
            springs: part.spec.spring.iter().map(|spring| spring.on.value.clone()).collect(),
            rigid: part.held.rigid.iter().map(|(load, _)| part.spec.load[*load].on.value.clone()).collect(),
            post: None,
        });
        let unloaded = if keep { part.unloaded(mesh)? } else { Vec::new() };
        let (mut here, mut works, mut smooth, mut elsewhere) = (None, None, Vec::new(), None);
        if owner[index] == rank || dealt.is_some() {
            smooth = part.smooth();
            let mut all = Here { part, rows: [rows, nodal_rows], load: nodal_load, supported };
            if let Some(dealt) = &mut dealt {
                let work;
                (all, work) = all.of(dealt, &loose.left, others);
                works = Some(work);
            }
            here = Some(all);
        } else if keep {
            elsewhere = Some((part.space, part.held));
        }
        let scales = [modulus, depth];
        ready.push(Ready {
            segments,
            loose,
            scales,
            elasticity,
            graph: graph.filter(|_| alone),
            dealt,
            here,
            works,
            smooth,
            elsewhere,
            unloaded,
        });
    }
    let (mut slots, mut shapes, mut counts) = (Vec::new(), Vec::new(), Counts::default());
    for ((ready, info), &owner) in ready.into_iter().zip(&mut infos).zip(&owner) {
        let (slot, shape) = ready.make(info, mesh, owner == rank, factory, &mut counts)?;
        slots.push(slot);
        shapes.extend(shape.filter(|_| keep));
    }
    let meshes = keep.then(|| Rc::new(Kept { shapes, fine }) as Rc<dyn Meshes>);
    let mut model = Model::new(slots, pairs, exchange);
    model.mechanism = mechanisms.iter().find(|mechanism| mechanism.work != 0.0).cloned();
    let mut carried = vec![0.0; 2 * model.points()];
    offsets.iter().enumerate().for_each(|(body, offset)| model.put(body, offset, &mut carried));
    model.carry(&carried);
    let Counts { assemblies, avoided: assemblies_avoided } = counts;
    let bodies = infos;
    Ok(Discrete {
        model,
        bodies,
        contacts,
        mechanisms,
        balanced,
        meshes,
        carried,
        assemblies,
        assemblies_avoided,
        known_nodes,
    })
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

/// What all nodes of each body come to: the sum of its loads, but for those on rigid surfaces, and what the user should know of its elasticity.
/// Collective.
fn together<const D: usize>(
    parts: &[Part<D>],
    drafts: &[Draft<D>],
    plane: Plane,
    exchange: &dyn Exchange,
) -> (Vec<[f64; 3]>, Vec<Option<String>>) {
    let sums: Vec<Total> = drafts.iter().flat_map(|draft| draft.nodal_load.sum()).collect();
    let sums = totals(exchange, &sums);
    let sums = sums.chunks_exact(3).map(|sum| [sum[0], sum[1], sum[2]]).collect();
    let poisson =
        share(exchange, parts.iter().map(|part| elastic::poisson(part.spec, D, part.own(), plane)).collect::<Vec<_>>());
    let warning = |(body, part): (usize, &Part<D>)| {
        elastic::warning(part.spec, poisson.iter().map(|of_rank| of_rank[body]).fold(0.0, f64::max))
    };
    (sums, parts.iter().enumerate().map(warning).collect())
}

/// Mean squared components of the normals on the contact surfaces of a body.
fn along_axes(segments: &[Segment], pairs: &[ContactPair]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pair in segments.iter().map(|segment| &pairs[segment.pair]) {
        for (weight, normal) in pair.weight.iter().zip(&pair.normal) {
            (0..3).for_each(|c| sum[c] += weight * normal[c] * normal[c]);
        }
    }
    let total: f64 = sum.iter().sum();
    if total > 0.0 { sum.map(|sum| sum / total) } else { sum }
}
