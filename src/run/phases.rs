//! The steps from a scene to a solved problem, by the [`stages`](super::stages): mesh, discretisation, inner solvers, options, method,
//! iteration. A problem takes over what the run of another scene before it has left.

use super::inner::SolverFactory;
use super::recorder::{self, Recorder};
use super::stages::{Begin, Built, Clock, Done, Legs, Prepared};
use super::{steps, warnings};
use crate::contact::pieces::{self, Cut};
use crate::ddm::gamma;
use crate::ddm::{InitialGuess, Method, Outcome, Status, first_springs};
use crate::discretize::{self, Verified};
use crate::error::Result;
use crate::estimate::{self, Estimate};
use crate::exchange::Plain;
use crate::interrupt::Interrupt;
use crate::mesh;
use crate::model::{BodySlot, JointStep, LinearStep};
use crate::output;
use crate::parallel::{Ranks, collectively};
use crate::petsc::Session;
use crate::problem::Order;
use crate::problem::method::{Linear, MethodName, MethodSpec};
use crate::robin::{Coefficient, SweepCg};
use crate::scene::Scene;
use crate::scene::remove;
use crate::solver::{Dense, Krylov, MakeSolver, options};
use serde_json::Value;
use std::path::PathBuf;
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
    build_after(session, scene.into(), None, interrupt, clock)
}

/// Build a scene with what the run of another scene before it has left, if only the method differs: the condensed bodies, and the whole
/// problem if linear steps are solved alike. Collective.
pub fn build_after(
    session: &Session,
    mut scene: Rc<Scene>,
    before: Option<Done>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    if scene.contacts.iter().any(|contact| contact.preload.is_some() || contact.factors().next().is_some()) {
        // the gaps of a model are those of one leg
        Rc::make_mut(&mut scene).method.steps.apart = true;
    }
    let mut kept = Vec::new();
    if let Some(Done { built: mut last, .. }) = before.filter(|done| settings(&done.built.scene) == settings(&scene)) {
        if serves(&last, &scene) {
            let discrete = &mut last.discrete;
            discrete.model.exchange = Rc::new(Ranks::new(session));
            discrete.scale_loads(1.0);
            let bodies = discrete.model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
            discrete.assemblies_avoided = bodies.map(|body| body.begin_anew()).count();
            discrete.assemblies = 0;
            return Ok(Built { scene, ..last });
        }
        kept = last.into_condensed();
    }
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
    let (mut verified, file) = verified::<D>(session, &scene, interrupt)?;
    clock.phase("mesh");
    drop(stage);
    verified.mesh.forget_tags();
    let source = MeshedScene { session: session.clone(), scene, verified, file, cut };
    let history = &source.scene.method.steps;
    let begun = history.begun;
    let mut built = source.build(begun, kept, clock)?;
    if begun < history.steps.len() && history.leg(begun) != (0..history.steps.len()) {
        built.legs = Some(Rc::new(source));
    }
    Ok(built)
}

/// A scene with its mesh, from which discrete problems are built.
struct MeshedScene<const D: usize> {
    session: Session,
    scene: Rc<Scene>,
    verified: Verified<D>,
    /// SHA-256 and path of the file of the mesh, on the rank that has read it.
    file: Option<(String, PathBuf)>,
    cut: Cut<D>,
}

impl<const D: usize> MeshedScene<D>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    /// Build the problem under the loads of a step of the scene's history, or under the full loads. Collective.
    fn build(&self, step: usize, kept: Vec<BodySlot>, clock: &mut Clock) -> Result<Built> {
        let Self { session, verified, file, cut, .. } = self;
        let stage = session.stage("discretize");
        let mut scene = Scene { bodies: verified.bodies.clone(), ..(*self.scene).clone() };
        self.scene.method.steps.apply(step, &mut scene.bodies, &mut scene.contacts);
        let scene = &scene;
        let mut inner = SolverFactory::new(session, scene, kept)?;
        let exchange = Rc::new(Ranks::new(session));
        let keep = scene.estimate || scene.adapt.is_some();
        let discrete = discretize::discretize(scene, verified, *cut, keep, exchange, &mut inner);
        let mut discrete = collectively(session, discrete)?;
        discrete.share();
        // BLAS threads slow down small fronts, several ranks, and the short vectors of a Krylov method. Large factorisations gain
        // from them.
        let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let gains = D == 3 && verified.points * D >= LARGE_FRONTS && inner.factors();
        session.set_blas_threads(if gains { cores / session.size() } else { 1 });
        clock.estimate = inner.plan.seconds;
        clock.phase("discretize");
        drop(stage);
        let mut warnings = warnings::of_problem(session, &discrete);
        warnings.extend(self.of_mesh());
        warnings.extend(inner.applied_once().into_iter().chain(inner.idle_options()));
        let has_page = scene.output.report && session.rank() == 0;
        let built = Built {
            scene: self.scene.clone(),
            marks: if has_page {
                discretize::marks(&verified.mesh, &scene.bodies, &discrete.model.pairs)
            } else {
                Vec::new()
            },
            discrete,
            splits: verified.splits(),
            mesh: file.as_ref().map(|(digest, _)| digest.clone()),
            mesh_file: file.as_ref().map(|(_, path)| path.clone()),
            linear: inner.plan.linear,
            interpolation: inner.interpolation.take(),
            near_null_space: std::mem::take(&mut inner.near_null_space),
            choice: inner.reason(),
            condensed: inner.condensed(),
            options: inner.into_options(),
            warnings,
            legs: None,
        };
        Ok(built)
    }

    /// Return the warnings about the mesh and its file.
    fn of_mesh(&self) -> Vec<String> {
        let Verified { mesh, notes, .. } = &self.verified;
        let changed = warnings::in_parts(mesh.split).into_iter().chain(warnings::made_straight(mesh.straightened));
        changed.chain(notes.iter().cloned()).collect()
    }
}

impl<const D: usize> Legs for MeshedScene<D>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    fn prepare(&self, step: usize, begin: Begin, condensed: Vec<BodySlot>, clock: &mut Clock) -> Result<Prepared> {
        let built = self.build(step, condensed, clock);
        set_up(
            &self.session,
            built.map_err(|error| error.because(format!("it is in load step {}", step + 1)))?,
            begin,
            clock,
        )
    }
}

/// Return the bodies of a scene and their mesh, with SHA-256 and path of its file. The first rank runs Gmsh, reads the mesh and checks it. Collective.
fn verified<const D: usize>(
    session: &Session,
    scene: &Scene,
    interrupt: &Interrupt,
) -> Result<(Verified<D>, Option<(String, PathBuf)>)> {
    let order = scene.bodies.iter().map(|body| body.order).max().unwrap_or(Order::P1);
    let (mut file, mut notes) = (None, Vec::new());
    let read = || {
        interrupt.release()?;
        let loaded = mesh::load::<D>(&scene.mesh, order, interrupt)?;
        (file, notes) = (Some((loaded.digest, loaded.file)), loaded.notes);
        Ok(loaded.mesh)
    };
    let verified = discretize::verify(scene, &Ranks::new(session), read);
    let verified = verified.and_then(|verified| interrupt.release().map(|()| verified));
    let mut verified = collectively(session, verified)?;
    verified.notes.splice(0..0, notes);
    Ok((verified, file))
}

/// Make the method and factor every body for the start. Then refuse options that no solver has read.
///
/// # Errors
/// PETSc does not know an option, the start is not finite, or PETSc fails.
pub fn set_up(session: &Session, mut built: Built, begin: Begin, clock: &mut Clock) -> Result<Prepared> {
    let _stage = session.stage("set-up");
    let scene = built.scene.clone();
    let Begin { start, steps } = begin;
    for (i, pair) in steps.last().iter().flat_map(|step| step.pairs.iter().enumerate()) {
        if scene.method.steps.locks(steps.len(), &built.discrete.specs[i]) {
            built.discrete.lock(i, pair.offset.unwrap_or(0.0));
        }
    }
    let mut start = match start {
        Some(start) => start,
        None if scene.method.steps.is_empty() => discretize::start(&scene, &built.discrete)?.into(),
        None => InitialGuess::Automatic,
    };
    let mut full = start.clone();
    // A condensed body lives on one rank. If its factorisation is refused, no other rank may wait for it in what follows.
    collectively(session, built.discrete.model.condense())?;
    let method = collectively(session, make(session, &mut built, &mut full))?;
    if scene.method.steps.is_empty() {
        // The start that the set-up found is that of the run. Load steps have other loads.
        start = full;
    }
    let names: Vec<&str> = built.discrete.bodies.iter().map(|body| body.name.as_str()).collect();
    let warnings = collectively(session, options::unread(session, &names))?;
    if built.options.is_empty() && session.options().has("-help") {
        options::show_help(session)?;
    }
    clock.phase("set-up");
    Ok(Prepared { built, method, start, steps, earlier: Vec::new(), warnings })
}

/// Iterate. From here on a signal ends the run after the current step, so that its results are written.
///
/// # Errors
/// PETSc fails. A run that does not converge is not an error but a status of the outcome.
pub fn iterate(ready: Prepared, interrupt: &Interrupt, keep: &mut dyn Recorder, clock: &mut Clock) -> Result<Done> {
    interrupt.hold();
    let mut done = match ready.built.scene.method.steps.is_empty() {
        true => recorder::solve(ready, true, keep).inspect(|done| {
            if matches!(done.outcome.status, Status::Interrupted { .. }) {
                keep.state(done);
            }
        }),
        false => steps::iterate(ready, keep, clock),
    }?;
    warnings::note_ends(&mut done);
    clock.phase("iterate");
    Ok(done)
}

/// Estimate the error of the solution, if the scene requests it.
pub fn estimate(done: &mut Done, clock: &mut Clock) -> Result<Option<Estimate>> {
    let Outcome { status, iterate, layer, .. } = &done.outcome;
    let good = status.is_solved() || *status == Status::IterationLimit;
    let discrete = &mut done.built.discrete;
    let Some(meshes) = discrete.meshes.clone().filter(|_| good) else { return Ok(None) };
    let model = &mut discrete.model;
    let estimate = estimate::estimate(&*meshes, model, done.method.linear(), iterate, layer)?;
    if let Some((body, place)) = estimate::lost_at(&*meshes, &discrete.model, &estimate) {
        let (name, place) = (&discrete.bodies[body].name, output::report::place(place));
        done.warnings.push(format!(
            "the estimated error of the mesh is a guess: it is as large as the solution; of all bodies `{name}` has most of it, at {place}: make \
             cells smaller there, or less flat"
        ));
    }
    let warnings = warnings::of_pressures(discrete, &estimate);
    done.warnings.extend(warnings);
    clock.phase("estimate");
    Ok(Some(estimate))
}

/// Return the stopping rules in words.
pub fn targets(scene: &Scene) -> String {
    let stop = &scene.method.stop;
    let rules = [("residual", stop.residual), ("increment", stop.increment)];
    let rules = rules.iter().filter_map(|(name, value)| value.map(|value| format!("{name} <= {value:e}")));
    rules.collect::<Vec<_>>().join(" or ")
}

/// Return whether the problem of the run before serves a scene that differs in the method alone: all bodies are condensed, and linear steps
/// are solved alike.
fn serves(last: &Built, scene: &Scene) -> bool {
    let both = [&*last.scene, scene];
    // an estimate of the error needs the meshes, which are kept only for it
    let [old_meshes, new_meshes] = both.map(|scene| scene.estimate);
    // how linear steps are solved was chosen for the method
    let [old_joint, new_joint] = both.map(|scene| {
        let MethodSpec { name, linear, .. } = &scene.method;
        matches!(name, MethodName::Auto | MethodName::Newton).then_some((*name, *linear))
    });
    last.condensed.len() == last.discrete.bodies.len()
        && old_meshes == new_meshes
        // tables of factors change the loads of bodies, and steps that are legs of their own change gaps
        && both.iter().all(|scene| !scene.method.steps.is_table() && !scene.method.steps.apart)
        && old_joint == new_joint
}

/// Return the settings of a scene on which its discrete problem can depend.
fn settings(scene: &Scene) -> Value {
    let mut settings = scene.settings();
    remove(&mut settings, "", &["title", "units", "method", "output"]);
    settings
}

/// Make the method of a scene and set up the solvers that it needs. Errors occur before the first sweep. If the set-up finds an
/// automatic start, it is stored in `start`.
fn make(session: &Session, built: &mut Built, start: &mut InitialGuess) -> Result<Method> {
    let scene = built.scene.clone();
    if scene.method.name != MethodName::Robin {
        return linear_step(session, built, start).map(Method::Newton);
    }
    let rule = gamma::rule(&scene.method.gamma, &scene.own_rules)?;
    crate::robin::prepare(&mut built.discrete.model)?;
    Ok(Method::Robin { rule, coefficient: coefficient_of(&scene), linear: Box::new(SweepCg::with_robin_term()) })
}

fn coefficient_of(scene: &Scene) -> Coefficient {
    Coefficient::new(scene.method.psi.clone(), scene.method.robin)
}

/// Return the solver of the linear steps of Newton's method.
fn linear_step(session: &Session, built: &mut Built, start: &mut InitialGuess) -> Result<Box<dyn LinearStep>> {
    let Built { scene, discrete, linear, options, interpolation, near_null_space, .. } = built;
    let (model, linear, interpolation) = (&mut discrete.model, *linear, interpolation.take());
    let modes = std::mem::take(near_null_space);
    if linear == Linear::Sweeps {
        crate::robin::prepare(model)?;
        return Ok(Box::new(SweepCg::new(coefficient_of(scene))));
    }
    // a factorisation alone can do without complete nodes, with unknowns for rigid motions among them, if its rows are
    // not distributed
    let is_dense = linear == Linear::Dense;
    let factors = is_dense || matches!(options[0].get("pc_type"), Some("cholesky" | "lu"));
    let of_nodes = !factors || model.is_distributed();
    let make: MakeSolver = if is_dense {
        Box::new(|stiffness| Ok(Box::new(Dense::new(stiffness))))
    } else {
        let (session, chosen) = (session.clone(), options[0].clone());
        let block = if of_nodes { scene.dimension.value } else { 1 };
        Box::new(move |stiffness| Ok(Box::new(Krylov::new(&session, chosen, block, stiffness, &modes, interpolation)?)))
    };
    let mut step: Box<dyn LinearStep> = Box::new(JointStep::new(model, of_nodes, is_dense, make)?);
    if let Some(springs) = first_springs(model, start) {
        step.set_up(&springs)?;
    }
    Ok(step)
}
