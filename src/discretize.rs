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
mod plan;
mod post;
mod ready;
pub mod resolution;
mod roster;
mod round;
mod springs;
mod supports;
mod surface;
mod totals;
mod unassembled;
mod unbalanced;
mod verify;

use crate::contact::{self, ContactPair};

use crate::error::Result;
use crate::exchange::{Exchange, share};
use crate::linalg::{Total, axpy};
use crate::mesh::Mesh;
use crate::model::{BodySlot, Mechanism, Model};
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
pub use info::{Balanced, BodyInfo, ContactInfo, Gauged};
use mechanism::Fixed;
use meshes::{Kept, Meshes, Shape};
use part::Part;
use parts::parts;
use plan::plan;
pub use post::Post;
use ready::{Counts, Ready};
use std::rc::Rc;
pub use surface::ContactSurface;
use totals::totals;
use unassembled::Unassembled;
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
    let (mesh, others) = (&verified.portion.mesh, &*verified.exchange);
    let (mut parts, stocks) = parts(scene, verified, bodies)?;
    let Paired { pairs, contacts, fine } = pair_surfaces(scene, verified, cut, &parts, keep)?;
    let mut drafts = draft_bodies(&parts, &pairs, mesh, others)?;
    let fixed = mechanism::fix(&mut parts, &mut drafts, &pairs, mesh, others);
    let supported = parts.iter().zip(&drafts).map(|(part, draft)| supported(part, &draft.free));
    let supported: Vec<Supported<D>> = supported.collect();
    let coupled = Coupled::new((&parts, &stocks, &drafts), others);
    let deals = plan((&parts, &drafts, &supported), &coupled, &pairs, factory, others)?;
    let graphs = coupled.into_graphs();
    let known_nodes = parts.iter().map(|part| part.space.nodes.known().count()).sum();
    let owners = owners(&parts, &deals, exchange.ranks());
    let totals = totals_of(&parts, &drafts, scene.plane, others);
    let needs = if keep { vec![Needs::Everywhere; parts.len()] } else { Needs::of(&owners, &deals) };
    let mut loads: Vec<_> = drafts.iter_mut().map(|draft| &mut draft.nodal_load).collect();
    let elasticities = cells::deal(&mut parts, stocks, &mut loads, &needs, scene.plane, others)?;
    drop(needs);
    let wants_coarse = |body: usize| factory.wants_interpolation(&parts[body].spec.name.value);
    let dealt = distribute::distribute(&parts, &drafts, &wants_coarse, &deals, others, &exchange);

    let Fixed { gauged, mechanisms, loose, balanced } = fixed;
    let mut drafts = drafts.into_iter();
    let mut supported = supported.into_iter();
    let mut graphs = graphs.into_iter();
    let mut dealt = dealt.into_iter();
    let mut totals = totals.into_iter();
    let mut gauged = gauged.into_iter();
    let mut loose = loose.into_iter();
    let mut elasticities = elasticities.into_iter();
    let mut unassembled = Vec::new();
    for (body, part) in parts.into_iter().enumerate() {
        let (OfAllRanks { load, warning }, dealt) = (next(&mut totals), next(&mut dealt));
        unassembled.push(Unassembled {
            owner: dealt.as_ref().map_or(owners[body], |dealt| dealt.leader),
            part,
            draft: next(&mut drafts),
            supported: next(&mut supported),
            graph: next(&mut graphs),
            dealt,
            load,
            warning,
            gauged: next(&mut gauged),
            loose: next(&mut loose),
            elasticity: next(&mut elasticities),
        });
    }
    let checked = unassembled.iter().zip(&*verified.checked);
    let mut infos: Vec<BodyInfo> = checked.map(|(body, checked)| body.info(&pairs, checked)).collect();
    let carried: Vec<Vec<f64>> = unassembled.iter().map(Unassembled::carried).collect();
    let ready = unassembled.into_iter().map(|body| body.ready(&pairs, mesh, keep, others));
    let ready = ready.collect::<Result<Vec<_>>>()?;
    let (slots, shapes, counts) = assemble(ready, &mut infos, mesh, exchange.rank(), factory)?;
    let meshes = keep.then(|| Rc::new(Kept { shapes, fine }) as Rc<dyn Meshes>);
    let mut model = Model::new(slots, pairs, exchange);
    model.mechanism = mechanisms.iter().find(|mechanism| mechanism.work != 0.0).cloned();
    let carried = carry(&mut model, &carried);
    Ok(Discrete {
        model,
        bodies: infos,
        contacts,
        mechanisms,
        balanced,
        carried,
        meshes,
        assemblies: counts.assemblies,
        assemblies_avoided: counts.avoided,
        known_nodes,
    })
}

/// What pairs of surfaces come to.
struct Paired<const D: usize> {
    /// The arrays of the method.
    pairs: Vec<ContactPair>,
    /// Origin of each pair.
    contacts: Vec<ContactInfo>,
    /// Integration points of each, if meshes are kept.
    fine: Vec<contact::Fine<D>>,
}

fn pair_surfaces<const D: usize>(
    scene: &Scene,
    verified: &Verified<D>,
    cut: contact::pieces::Cut<D>,
    parts: &[Part<D>],
    keep: bool,
) -> Result<Paired<D>> {
    let mut paired = Paired { pairs: Vec::new(), contacts: Vec::new(), fine: Vec::new() };
    for found in pairs::all(scene, &verified.portion.mesh, cut, parts, keep, &*verified.exchange)? {
        paired.pairs.push(found.pair);
        paired.fine.extend(found.fine);
        paired.contacts.push(ContactInfo { spec: found.spec, swapped: found.swapped, surface: found.surface });
    }
    Ok(paired)
}

fn draft_bodies<const D: usize>(
    parts: &[Part<D>],
    pairs: &[ContactPair],
    mesh: &Mesh<D>,
    exchange: &dyn Exchange,
) -> Result<Vec<Draft<D>>> {
    let segments = draft::segments(parts.len(), pairs);
    let drafts = parts.iter().zip(segments);
    drafts.map(|(part, segments)| Draft::new(part, segments, pairs, mesh, exchange)).collect()
}

/// Return the rank that owns each body. Bodies that are not dealt out stay whole, and each rank gets about as many of their dofs as the others.
fn owners<const D: usize>(parts: &[Part<D>], deals: &[Deal], ranks: usize) -> Vec<usize> {
    let is_dealt = |body: usize| deals.iter().any(|deal| deal.bodies.contains(&body));
    let dofs = |body: usize| if is_dealt(body) { 0 } else { parts[body].space.dofs() };
    crate::parallel::owners(&(0..parts.len()).map(dofs).collect::<Vec<_>>(), ranks)
}

/// The next of a list that has one entry for each body.
fn next<T>(each: &mut std::vec::IntoIter<T>) -> T {
    each.next().unwrap_or_else(|| unreachable!("there is one for each body"))
}

/// Assembles the bodies on this rank: what the model has of each, their shapes, and how many matrices were assembled.
fn assemble<const D: usize>(
    ready: Vec<Ready<D>>,
    infos: &mut [BodyInfo],
    mesh: &Mesh<D>,
    rank: usize,
    factory: &mut dyn Factory,
) -> Result<(Vec<BodySlot>, Vec<Shape<D>>, Counts)> {
    let (mut slots, mut shapes, mut counts) = (Vec::new(), Vec::new(), Counts::default());
    for (ready, info) in ready.into_iter().zip(infos) {
        let is_owner = info.rank == rank;
        let (slot, shape) = ready.make(info, mesh, is_owner, factory, &mut counts)?;
        slots.push(slot);
        shapes.extend(shape);
    }
    Ok((slots, shapes, counts))
}

/// Gives the bodies of a model the rigid motions of their supports, with these traces on the contact rows of each; all of them, 2n.
fn carry(model: &mut Model, each: &[Vec<f64>]) -> Vec<f64> {
    let mut carried = vec![0.0; 2 * model.points()];
    each.iter().enumerate().for_each(|(body, trace)| model.put(body, trace, &mut carried));
    model.carry(&carried);
    carried
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

/// What all ranks together know of the loads and the cells of a body.
struct OfAllRanks {
    /// Sum of its loads, but for those on rigid surfaces.
    load: [f64; 3],
    /// What the user should know of its elasticity.
    warning: Option<String>,
}

/// What all nodes and cells of each body come to. Collective.
fn totals_of<const D: usize>(
    parts: &[Part<D>],
    drafts: &[Draft<D>],
    plane: Plane,
    exchange: &dyn Exchange,
) -> Vec<OfAllRanks> {
    let sums: Vec<Total> = drafts.iter().flat_map(|draft| draft.nodal_load.sum()).collect();
    let sums = totals(exchange, &sums);
    let poisson: Vec<f64> = parts.iter().map(|part| elastic::poisson(part.spec, D, part.own(), plane)).collect();
    let poisson = share(exchange, poisson);
    let of_body = |(body, part): (usize, &Part<D>)| {
        let largest = poisson.iter().map(|of_rank| of_rank[body]).fold(0.0, f64::max);
        let load = std::array::from_fn(|c| sums[3 * body + c]);
        OfAllRanks { load, warning: elastic::warning(part.spec, largest) }
    };
    parts.iter().enumerate().map(of_body).collect()
}
