//! The step from a scene and its mesh to a [`Model`]. Geometry ends here: a model has no space dimension.

mod approach;
mod assembly;
mod auto;
mod body_mesh;
mod carrier;
mod chords;
mod contact_surface;
mod facts;
mod groups;
mod kept;
mod marks;
mod mechanism;
pub mod meshes;
mod obstacle;
mod pairs;
mod partition;
mod patterns;
mod post;
mod prepare;
mod scene_body;
mod seal;
mod supports;
mod verify;

pub use approach::mean_normal;
pub use assembly::{Assembled, Factory};
pub use contact_surface::{Neighbours, corners};
pub use facts::BodyInfo;
pub use groups::find_group;
use kept::EarlierPair;
pub use kept::Kept;
pub use marks::marks;
pub use obstacle::Obstacle;
pub use pairs::ContactFacts;
pub use post::ForceBalance;
pub use prepare::Request;
pub use verify::{Verified, verify};

use crate::contact::law;
use crate::error::Result;
use crate::exchange::{Exchange, Plain, broadcast, scatter};
use crate::model::{Body, BodySlot, Mechanism, Model};
use crate::problem::Start;
use crate::problem::contact::{Carrier, ContactSpec};
use crate::scene::Scene;
use assembly::{Assembler, EarlierBody};
use body_mesh::BodyMesh;
use meshes::{KeptMeshes, Meshes};
use prepare::{ReplicatedProblem, WholeProblem, prepare};
use std::rc::Rc;

/// The discrete problem, with the facts of its origin that reports need.
pub struct Discrete {
    /// The model on which the method works.
    pub model: Model,
    /// Bodies in the order of the scene.
    pub bodies: Vec<BodyInfo>,
    /// Facts of each pair besides its arrays.
    pub contacts: Vec<ContactFacts>,
    /// Description of each pair in the scene. `between` names the bodies if the pair was found.
    pub specs: Vec<ContactSpec>,
    /// Motions that nothing resists.
    pub mechanisms: Vec<Mechanism>,
    /// The meshes, kept only if an estimate of the error was requested.
    pub meshes: Option<Meshes>,
    /// Whether all bodies have the matrices and solvers of the problem before.
    pub is_renewed: bool,
    /// Number of stiffness matrices that this rank has assembled in the run.
    pub assemblies: usize,
    /// Number of pairs whose surfaces it has searched for common pieces.
    pub pairings: usize,
}

/// What a problem leaves for the next one.
#[derive(Default)]
struct Earlier {
    assemblies: usize,
    pairings: usize,
    /// Bodies with a mesh.
    bodies: Vec<BodySlot>,
    pairs: Vec<EarlierPair>,
}

impl Earlier {
    fn of(discrete: Discrete) -> Self {
        let Discrete { model: Model { mut bodies, pairs, .. }, contacts, assemblies, pairings, .. } = discrete;
        bodies.retain(|slot| !slot.is_rigid);
        let pairs = pairs.into_iter().zip(contacts).map(|(pair, facts)| EarlierPair { pair, facts });
        Self { assemblies, pairings, bodies, pairs: pairs.collect() }
    }
}

/// Turn a scene and its mesh into a model. Collective.
///
/// The first rank prepares everything but matrices, as in a serial run. Then every rank receives what it needs of each
/// body, and assembles it. `factory` turns each body of this rank into one with a solver.
///
/// The problem `before` on the same mesh, which left `kept`, gives all pairs and bodies that would be the same but for
/// loads, prescribed displacements, gaps and laws.
///
/// # Errors
/// The scene may contradict its mesh: missing groups, surfaces of the wrong body, supports that contradict each other,
/// surfaces that do not face each other. Failures of `factory` are returned, too.
pub fn discretize<const D: usize>(
    request: &Request<D>,
    kept: &mut Kept<D>,
    before: Option<Discrete>,
    exchange: Rc<dyn Exchange>,
    factory: &mut impl Factory,
) -> Result<Discrete>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    let Earlier { assemblies, pairings, bodies: earlier, pairs: mut earlier_pairs } =
        before.map(Earlier::of).unwrap_or_default();
    let Request { scene, verified, keep, .. } = *request;
    let mut prepared = None;
    let shared = broadcast(&*exchange, || {
        let (shared, whole) = prepare(request, exchange.ranks(), factory, kept, std::mem::take(&mut earlier_pairs))?;
        prepared = Some(whole);
        Ok(shared)
    })?;
    let ReplicatedProblem { bodies: shared, mut pairs, rigid, contacts, mechanisms, fine, plan, is_kept, searched } =
        shared;
    let of_pairs: Vec<ContactSpec> = contacts.iter().map(|contact| contact.spec(&scene.contacts)).collect();
    let locals = give(prepared, &exchange)?;
    if exchange.rank() > 0 {
        factory.adopt(plan);
        for (pair, spec) in pairs.iter_mut().zip(&of_pairs) {
            pair.law = law::of_pair(spec, &scene.laws, &pair.position)?;
        }
    }
    // solvers that do not serve go before others are made, on all ranks in the same order
    let is_renewed = is_kept.iter().all(|is_kept| *is_kept);
    factory.settle(is_renewed);
    let serving = |(slot, serves): (BodySlot, &bool)| EarlierBody::new(slot, *serves);
    let mut earlier = earlier.into_iter().zip(&is_kept).map(serving).collect::<Vec<_>>().into_iter();
    let (mesh, plane, rank) = (&verified.mesh, scene.plane, exchange.rank());
    let mut assembler = Assembler { mesh, plane, rank, factory, assemblies, shapes: Vec::new() };
    let (mut slots, mut infos): (Vec<_>, Vec<_>) = shared.into_iter().unzip();
    for (body, local) in locals.into_iter().enumerate() {
        let before = earlier.next().unwrap_or_default();
        if let Some(local) = local {
            assembler.make(&scene.bodies[body], local, before, &mut slots[body], &mut infos[body])?;
        }
    }
    let Assembler { assemblies, shapes, .. } = assembler;
    let pairings = pairings + if rank == 0 { searched } else { 0 };
    let meshes = keep.map(|keep| keep(Rc::new(KeptMeshes { shapes, fine })));
    let of_rank = |slot: BodySlot| {
        if rank == 0 && !slot.motions.is_empty() {
            BodySlot { local: Some(Body::rigid(&slot.motions)), ..slot }
        } else {
            slot
        }
    };
    slots.extend(rigid.into_iter().map(of_rank));
    let mut model = Model::new(slots, pairs, exchange);
    model.mechanism = mechanisms.iter().find(|mechanism| mechanism.work != 0.0).cloned();
    let (bodies, specs) = (infos, of_pairs);
    Ok(Discrete { model, bodies, contacts, specs, mechanisms, meshes, is_renewed, assemblies, pairings })
}

/// Send every rank what it needs of each body. The first rank has everything in `prepared`. Collective.
fn give<const D: usize>(
    prepared: Option<WholeProblem<D>>,
    exchange: &Rc<dyn Exchange>,
) -> Result<Vec<Option<BodyMesh<D>>>>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    let prepared = match prepared {
        Some(whole) if exchange.ranks() == 1 => return Ok(whole.into_locals()),
        prepared => prepared,
    };
    let part = |rank| prepared.as_ref().map_or_else(Vec::new, |whole| whole.on(rank));
    let mut locals: Vec<Option<BodyMesh<D>>> = scatter(&**exchange, part)?;
    for distribution in locals.iter_mut().flatten().filter_map(|local| local.distribution.as_mut()) {
        distribution.exchange = exchange.clone();
    }
    Ok(locals)
}

impl Discrete {
    /// Keep the gap of pair `i` as an earlier load step has left it, with this offset (a length), which is no unknown
    /// any more.
    pub fn lock(&mut self, i: usize, offset: f64) {
        let model = &mut self.model;
        model.pairs[i].offset = offset;
        for slot in model.bodies.iter_mut().filter(|slot| slot.is_rigid && slot.segments[0].pair == i) {
            (slot.local, slot.motions, slot.free) = (None, Vec::new(), 0);
        }
        model.set_gaps();
    }

    /// Let the layers that remember have had compressions up to `largest`, n; empty for none.
    ///
    /// # Errors
    /// A law of unloading is too soft.
    pub fn remember(&mut self, largest: &[f64]) -> Result<()> {
        let model = &mut self.model;
        for i in (0..model.pairs.len()).filter(|_| !largest.is_empty()) {
            let (range, spec) = (model.range(i), &self.specs[i]);
            model.pairs[i].law.remember(&largest[range]).map_err(|error| error.because(pairs::of_pair(spec)))?;
        }
        Ok(())
    }

    /// Begin another run with the bodies of this problem: its counters start at zero.
    pub fn begin_anew(&mut self) {
        (self.assemblies, self.pairings) = (0, 0);
        self.model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut()).for_each(Body::begin_anew);
    }

    /// Return which surface carries the contact points of each pair.
    pub fn carriers(&self) -> Vec<Carrier> {
        self.model.pairs.iter().zip(&self.contacts).map(|(pair, contact)| contact.carrier(pair.bodies)).collect()
    }

    /// Return the sides of pair `i` in the order of the scene.
    pub fn sides(&self, i: usize) -> [usize; 2] {
        if self.contacts[i].swapped { [1, 0] } else { [0, 1] }
    }

    /// Return the names of the surfaces of pair `i` in the order of the scene.
    pub fn surfaces(&self, i: usize) -> [&str; 2] {
        self.sides(i).map(|side| self.model.pairs[i].surfaces[side].as_str())
    }

    /// Send every rank what only the owner ranks of a body have: its largest stiffness, the energy of its initial
    /// strains, and the stiffness at its contact rows. Collective, after all ranks have made their problem.
    pub fn share(&mut self) {
        let count = self.model.bodies.len();
        let mut message = vec![0.0; 2 * count + 2 * self.model.points()];
        for (body, slot) in self.model.bodies.iter().enumerate() {
            (message[body], message[count + body]) = (slot.scale, slot.heat);
            if slot.local.is_some() && !slot.is_rigid {
                self.model.put(body, &slot.row_stiffness, &mut message[2 * count..]);
            }
        }
        self.model.exchange.sum(&mut message);
        for body in 0..self.model.meshed() {
            let rows = self.model.of_body(body, &message[2 * count..]);
            let slot = &mut self.model.bodies[body];
            (slot.scale, slot.heat, slot.row_stiffness) = (message[body], message[count + body], rows);
        }
    }
}

/// Return the trace (2n) with which the scene starts. It is relative to the rigid motions that
/// supports impose. The result is `None` if the program is to find the start.
///
/// # Errors
/// The start is not finite at a contact point.
pub fn start(scene: &Scene, discrete: &Discrete) -> Result<Option<Vec<f64>>> {
    let model = &discrete.model;
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    match &scene.method.start {
        Start::Auto => return Ok(None),
        Start::Zero => {}
        Start::Normal(field) => {
            let positions = model.pairs.iter().flat_map(|pair| &pair.position);
            for (q, &x) in positions.enumerate() {
                let value = field.eval_finite("the start", x)?;
                trace[q] = value;
                trace[points + q] = value;
            }
        }
    }
    Ok(Some(trace))
}
