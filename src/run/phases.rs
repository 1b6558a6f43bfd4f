//! The steps from a scene to a solved problem, by the [`stages`](super::stages): mesh, discretisation, inner solvers, options,
//! iteration.

use super::clock::Clock;
use super::inner::Inner;
use super::recorder::{self, Recorder};
use super::stages::{Begin, Built, Done, Legs, Prepared};
use super::words::in_words;
use super::{method, pairs, steps};
use crate::contact::pieces::{self, Cut};
use crate::ddm::{self, Outcome, Start, Status};
use crate::discretize::{self, Balanced, Discrete, Verified, point};
use crate::error::Result;
use crate::estimate::{self, Cause, Estimate};
use crate::exchange::Plain;
use crate::interrupt::Interrupt;
use crate::mesh::{self, Loaded};
use crate::model::{BodySlot, Mechanism, Model};
use crate::output::sci;
use crate::parallel::{Ranks, collectively};
use crate::petsc::{Schur, Session, has_metis, keep_apart, keep_at_hand};
use crate::problem::Order;
use crate::scene::Scene;
use crate::solver::options;
use std::rc::Rc;

/// Dofs from which the fronts of a factorisation in space are large enough for BLAS threads.
const LARGE_FRONTS: usize = 30_000;

/// Build the discrete problem of a scene. Bodies get their inner solvers, but nothing is factored.
///
/// # Errors
/// Scene or mesh are refused, with a message on one rank, or PETSc fails.
pub fn build(
    session: &Session,
    scene: impl Into<Rc<Scene>>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    build_with(session, scene.into(), Vec::new(), interrupt, clock)
}

/// Build the discrete problem as [`build`] does, with the bodies `kept` from an earlier scene.
pub fn build_with(
    session: &Session,
    scene: Rc<Scene>,
    kept: Vec<BodySlot>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    collectively(session, options::refuse_log(session))?;
    match scene.dimension.value {
        2 => build_in::<2>(session, scene, pieces::in_plane, kept, interrupt, clock),
        _ => build_in::<3>(session, scene, pieces::in_space, kept, interrupt, clock),
    }
}

/// Do the work of [`build`] in `D` dimensions.
fn build_in<const D: usize>(
    session: &Session,
    scene: Rc<Scene>,
    cut: Cut<D>,
    kept: Vec<BodySlot>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    let stage = session.stage("mesh");
    clock.begin();
    let (mut verified, read) = verified::<D>(session, &scene, interrupt)?;
    clock.phase("mesh");
    drop(stage);
    verified.mesh.forget_tags();
    let source = Source { session: session.clone(), scene, verified, read, cut };
    let history = &source.scene.method.steps;
    let begun = history.begun;
    let mut built = source.build(begun, kept, clock)?;
    if begun < history.steps.len() && history.leg(begun) != (0..history.steps.len()) {
        built.legs = Some(Rc::new(source));
    }
    Ok(built)
}

/// The facts of the file of a mesh, on the rank that has read it.
struct FileRead {
    digest: String,
    /// What is to be said about the file, and why the mesh is made anew in each run, if it is.
    warnings: Vec<String>,
}

/// A scene with its mesh, from which discrete problems are built.
struct Source<const D: usize> {
    session: Session,
    scene: Rc<Scene>,
    verified: Verified<D>,
    /// Facts of the file, on the rank that has read the mesh.
    read: Option<FileRead>,
    cut: Cut<D>,
}

impl<const D: usize> Source<D>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    /// Build the problem under the loads of a step of the scene's history, or under the full loads. Collective.
    fn build(&self, step: usize, kept: Vec<BodySlot>, clock: &mut Clock) -> Result<Built> {
        let Self { session, scene, verified, read, cut } = self;
        let stage = session.stage("discretize");
        let mut bodies = verified.bodies.clone();
        scene.method.steps.apply(step, &mut bodies);
        let names: Vec<String> = bodies.iter().map(|body| body.name.value.clone()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        collectively(session, options::set_of_scene(session, &names, &scene.solver.options))?;
        let mut inner = Inner::new(session, scene, kept)?;
        let exchange = Rc::new(Ranks::new(session));
        let keep = scene.estimate || scene.method.stop.balanced || scene.adapt.is_some();
        let discrete = discretize::discretize(scene, verified, &bodies, *cut, keep, exchange, &mut inner);
        let mut discrete = collectively(session, discrete)?;
        discrete.share();
        // BLAS threads slow down small fronts, several ranks, and the short vectors of a Krylov method. Large factorisations gain
        // from them.
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let gains = D == 3 && verified.points * D >= LARGE_FRONTS && inner.factors();
        session.set_blas_threads(if gains { cores / session.size() } else { 1 });
        clock.estimate = inner.seconds;
        clock.phase("discretize");
        drop(stage);
        let mut warnings = warnings(session, &discrete, D);
        warnings.extend(self.of_mesh());
        warnings.extend(inner.applied_once());
        let mut built = Built {
            scene: scene.clone(),
            discrete,
            splits: verified.splits(),
            mesh: read.as_ref().map(|read| read.digest.clone()),
            linear: inner.linear,
            interpolation: inner.interpolation.take(),
            choice: inner.reason(),
            condensed: inner.condensed(),
            options: inner.into_options(),
            warnings,
            legs: None,
        };
        built.warnings.extend(pairs::swapped_tables(&built));
        Ok(built)
    }

    /// Return the warnings about the mesh and its file.
    fn of_mesh(&self) -> Vec<String> {
        let Self { verified, read, .. } = self;
        let changed = in_parts(verified.mesh.split).into_iter().chain(made_straight(verified.mesh.straightened));
        let of_file = read.iter().flat_map(|read| &read.warnings).chain(&verified.notes);
        changed.chain(of_file.cloned()).collect()
    }
}

impl<const D: usize> Legs for Source<D>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    fn prepare(&self, step: usize, begin: Begin, condensed: Vec<BodySlot>, clock: &mut Clock) -> Result<Prepared> {
        set_up(&self.session, self.build(step, condensed, clock)?, begin, clock)
    }
}

/// Return the bodies of a scene and their mesh. The first rank runs Gmsh, reads the mesh and checks it. Collective.
fn verified<const D: usize>(
    session: &Session,
    scene: &Scene,
    interrupt: &Interrupt,
) -> Result<(Verified<D>, Option<FileRead>)> {
    let order = scene.bodies.iter().map(|body| body.order).max().unwrap_or(Order::P1);
    interrupt.hold();
    let mut file = None;
    let read = || {
        let Loaded { mesh, digest, unkept, notes, .. } = mesh::load::<D>(&scene.mesh, order, interrupt)?;
        file = Some(FileRead { digest, warnings: notes.into_iter().chain(unkept).collect() });
        interrupt.release()?;
        Ok(mesh)
    };
    let verified = discretize::verify(scene, &Ranks::new(session), read);
    let verified = verified.and_then(|verified| interrupt.release().map(|()| verified));
    Ok((collectively(session, verified)?, file))
}

fn warnings(session: &Session, discrete: &Discrete, dimension: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    if session.blas_name() == "reference BLAS" {
        warnings.push(
            "the reference BLAS is in use: factorisations are up to ten times slower; run scripts/setup for OpenBLAS"
                .to_owned(),
        );
    }
    if let Some(kernels) = session.faster_blas_kernels() {
        warnings.push(format!(
            "{} does not use the vector instructions of this processor: factorisations take up to three times as long; set \
             OPENBLAS_CORETYPE={kernels}",
            session.blas_name()
        ));
    }
    if discrete.bodies.iter().any(|body| Schur::is_large(dimension, body.dofs)) && !has_metis() {
        warnings.push(
            "METIS was not found: large bodies are factored in the order of minimum degree, with a fifth more memory or more; \
             `apt-get install libmetis5`, or a PETSc with METIS"
                .to_owned(),
        );
    }
    warnings.extend(session.left_out().iter().map(|file| {
        format!(
            "{file} of this folder is not read, since PETSc options can run programs; -options_file {file} reads it"
        )
    }));
    if session.size() > discrete.bodies.len() && !discrete.model.is_distributed() {
        warnings.push(format!(
            "{} of {} ranks have no body to solve",
            session.size() - discrete.bodies.len(),
            session.size()
        ));
    }
    for body in discrete.bodies.iter().filter(|body| !body.gauged.fixed.is_empty()) {
        let motions = body.gauged.fixed.join("; ");
        warnings.push(format!(
            "body {}: nothing holds its {motions}, and no load works on it: it is fixed at one node",
            body.name
        ));
    }
    for body in discrete.bodies.iter().filter(|body| !body.gauged.spinning.is_empty()) {
        let motions = body.gauged.spinning.join("; ");
        warnings.push(format!(
            "body {}: only the facets of the mesh resist its {motions}, and loads work on it: its displacements mean nothing; hold it, or load it through its centre",
            body.name
        ));
    }
    warnings.extend(discrete.balanced.iter().map(|balanced| balanced_in_words(discrete, balanced)));
    warnings.extend(discrete.mechanisms.iter().map(|mechanism| mechanism_in_words(discrete, mechanism)));
    warnings.extend(discrete.bodies.iter().filter_map(|body| body.warning.clone()));
    warnings.extend(pairs::of_surfaces(&discrete.model.pairs, &discrete.contacts));
    warnings
}

/// Return the warning of elements that were split, if any.
pub fn in_parts(split: usize) -> Option<String> {
    let what = "quadrangles, hexahedra, prisms or pyramids of the mesh were split into triangles or tetrahedra";
    (split > 0).then(|| format!("{split} {what}"))
}

/// Return the warning of quadratic cells that were made straight, if any.
pub fn made_straight(cells: usize) -> Option<String> {
    let why = "were folded by the curved boundary and have straight edges now, so that gaps there are those of chords: a finer mesh follows the boundary";
    (cells > 0).then(|| format!("{cells} quadratic cells {why}"))
}

/// Return the warning of loads that were balanced.
fn balanced_in_words(discrete: &Discrete, Balanced { bodies, motion, share }: &Balanced) -> String {
    let names = in_words(bodies.iter().map(|&body| &discrete.bodies[body].name));
    format!(
        "{} {names}: nothing holds {} in {motion}, and loads lack balance there by {} of what forces of their sizes could do: no more than facets \
         and quadrature may miss of them, so that the loads were changed by that share to balance",
        if bodies.len() == 1 { "body" } else { "bodies" },
        if bodies.len() == 1 { "it" } else { "them" },
        sci(*share, 1)
    )
}

/// Return the warning of a free motion of several bodies.
fn mechanism_in_words(discrete: &Discrete, mechanism: &Mechanism) -> String {
    let name = |&body: &usize| &discrete.bodies[body].name;
    let bodies = in_words(mechanism.bodies.iter().map(name));
    let end = match mechanism.fixed.as_ref().map(name) {
        Some(body) => format!("and no load works on it: they are fixed at nodes of `{body}`"),
        None if mechanism.work == 0.0 => "and no load works on it: displacements are free up to it".to_owned(),
        None => "and loads work on it: there is no solution".to_owned(),
    };
    format!("bodies {bodies}: nothing holds them together in their {}, {end}", mechanism.motion)
}

/// Make the method and factor every body for the start. Then refuse options that no solver has read.
///
/// # Errors
/// PETSc does not know an option, the start is not finite, or PETSc fails.
pub fn set_up(session: &Session, mut built: Built, begin: Begin, clock: &mut Clock) -> Result<Prepared> {
    let _stage = session.stage("set-up");
    let scene = built.scene.clone();
    let Begin { start, steps, earlier } = begin;
    let mut start = match start {
        Some(start) => start,
        None if scene.method.steps.is_empty() => discretize::start(&scene, &built.discrete, 1.0)?.into(),
        None => Start::Automatic,
    };
    let mut full = start.clone();
    let method = collectively(session, method::make(session, &mut built, &mut full))?;
    if scene.method.steps.is_empty() {
        // The start that the set-up found is that of the run. Load steps have other loads.
        start = full;
    }
    let names: Vec<&str> = built.discrete.bodies.iter().map(|body| body.name.as_str()).collect();
    let warnings = collectively(session, options::unread(session, &names, &built.options))?;
    if built.options.is_empty() && session.options().has("-help") {
        options::show_help(session)?;
    }
    clock.phase("set-up");
    Ok(Prepared { built, method, start, steps, earlier, warnings })
}

/// Iterate. From here on a signal ends the run after the current step, so that its results are written.
///
/// # Errors
/// PETSc fails. A run that does not converge is not an error but a status of the outcome.
pub fn iterate(ready: Prepared, interrupt: &Interrupt, keep: &mut dyn Recorder, clock: &mut Clock) -> Result<Done> {
    interrupt.hold();
    keep_at_hand();
    let done = match ready.built.scene.method.steps.is_empty() {
        true => recorder::solve(ready, true, keep),
        false => steps::iterate(ready, keep, clock),
    };
    keep_apart();
    let mut done = done?;
    pairs::note_ends(&mut done);
    clock.phase("iterate");
    Ok(done)
}

/// Estimate the error of the solution, if the scene requests it.
pub fn estimate(done: &mut Done, clock: &mut Clock) -> Result<Option<Estimate>> {
    let Outcome { status, iterate, layer, .. } = &done.outcome;
    let good = status.is_solved() || *status == Status::IterationLimit;
    let discrete = &mut done.built.discrete;
    let Some(meshes) = discrete.meshes.clone().filter(|_| good) else { return Ok(None) };
    let estimate = estimate::estimate(&*meshes, &mut discrete.model, done.method.linear(), iterate, layer)?;
    if let Some((body, place)) = estimate::lost_at(&*meshes, &discrete.model, &estimate) {
        let (name, place) = (&discrete.bodies[body].name, point(place));
        done.warnings.push(format!(
            "the estimated error of the mesh is a guess: it is as large as the solution; of all bodies `{name}` has most of it, at {place}: make \
             cells smaller there, or less flat"
        ));
    }
    let warnings = of_pressures(&discrete.model, &estimate);
    done.warnings.extend(warnings);
    clock.phase("estimate");
    Ok(Some(estimate))
}

/// Least change of the pressures with the side of the normals that is worth a warning: one per cent.
const ONE_SIDED: f64 = 0.01;

/// Return warnings of pressures whose estimated error is a guess, or that depend on the side that gives the normals by more than that error.
fn of_pressures(model: &Model, estimate: &Estimate) -> Vec<String> {
    let mut warnings = Vec::new();
    for (i, pair) in model.pairs.iter().enumerate() {
        let [a, b] = &pair.surfaces;
        if let Some(guess) = estimate.guesses[i] {
            let place = point(guess.place);
            let reason = match guess.cause {
                Cause::Rim => {
                    format!("most of it is at the edge of the contact, at {place}, where pressures may be singular")
                }
                Cause::FewFacets => {
                    format!(
                        "contact ends within the facets that carry most of the pressure, around {place}: make them smaller"
                    )
                }
            };
            warnings.push(format!("the estimated error of the pressures between `{a}` and `{b}` is a guess: {reason}"));
        }
        let change = estimate.sides[i];
        if change > estimate.pressure[i].max(ONE_SIDED) {
            warnings.push(format!(
                "the pressures between `{a}` and `{b}` would change by about {:.0} % with the normals of `{b}` instead of those of `{a}`, more \
                 than by their estimated error: the surfaces slide or tilt too far for small displacements",
                100.0 * change
            ));
        }
    }
    warnings
}

/// Return the stopping rules in words.
pub fn targets(scene: &Scene) -> String {
    let stop = &scene.method.stop;
    let rules = [("residual", stop.residual), ("increment", stop.increment)];
    let rules = rules.iter().filter_map(|(name, value)| value.map(|value| format!("{name} <= {value:e}")));
    let balanced = stop.balanced.then(|| format!("error <= {} of the discretisation's", ddm::SHARE));
    rules.chain(balanced).collect::<Vec<_>>().join(" or ")
}
