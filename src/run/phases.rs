//! The steps from a scene to a solved problem, by the [`stages`](super::stages): mesh, discretisation, inner solvers,
//! options, method, iteration. A problem takes over what the run of another scene before it has left.

use super::inner::{JointParts, SolverFactory};
use super::meshed::{self, MeshFacts, SceneMesh};
use super::stages::{Before, Begin, Built, Clock, Done, Prepared};
use super::warnings;
use crate::ddm::gamma;
use crate::ddm::{InitialGuess, Method, Outcome, first_springs};
use crate::discretize::{self, Discrete};
use crate::error::Result;
use crate::estimate::{self, Estimate};
use crate::interrupt::Interrupt;
use crate::model::{ComplianceStep, DisplacementField, INNER_TOLERANCE, JointStep, LinearStep};
use crate::output;
use crate::parallel::collectively;
use crate::petsc::Session;
use crate::problem::ContactSpec;
use crate::problem::method::{Linear, MethodName, MethodSpec};
use crate::robin::{Coefficient, SweepCg, stiff_joint_springs};
use crate::scene::Scene;
use crate::solver::{Dense, Krylov, MakeSolver, options};
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
    let mut built = build_after(session, scene.into(), None, interrupt, clock)?;
    let history = &built.scene.method.steps;
    if history.begun + 1 >= history.steps.len() {
        built.mesh = None;
    }
    Ok(built)
}

/// Build a scene from what the run of another one before it has left: all of it that the settings which differ do not
/// touch. Collective.
///
/// # Errors
/// Those of [`build`].
pub fn build_after(
    session: &Session,
    scene: Rc<Scene>,
    before: Option<Done>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    clock.begin();
    let stage = session.stage("mesh");
    let mut kept = before.map(Done::into_mesh).and_then(|(mesh, before)| Some((mesh?, before)));
    let serves = kept.as_mut().map_or(Ok(false), |(mesh, _)| mesh.follow(&scene));
    let serves = collectively(session, serves)?;
    let (mesh, before) = match kept.filter(|_| serves) {
        Some((mesh, before)) => (mesh, Some(before.begin_anew())),
        None => (meshed::read(session, &scene, interrupt)?, None),
    };
    clock.phase("mesh");
    drop(stage);
    let step = scene.method.steps.begun;
    build_on(session, scene, mesh, step, before, clock)
}

/// Prepare the problem of the load step that follows those of `done`, from a solution or automatically. Collective.
///
/// # Errors
/// Loads that a body cannot have, and failures of the solver library.
pub fn next_step(done: Done, mut start: Option<InitialGuess>, clock: &mut Clock) -> Result<Prepared> {
    let step = done.steps.len();
    let (scene, steps, earlier) = (done.built.scene.clone(), done.steps.clone(), done.earlier.clone());
    let largest = done.largest.clone();
    let (mut known, mut warnings) = (done.built.warnings.clone(), done.warnings.clone());
    let (Some(mesh), before) = done.into_mesh() else { unreachable!("a history keeps its mesh up to the last step") };
    let session = mesh.session().clone();
    let built = build_on(&session, scene, mesh, step, Some(before), clock);
    let ready = built.and_then(|built| {
        if let Some(InitialGuess::Known(solution)) = &mut start {
            let Discrete { model, specs, is_renewed, .. } = &built.discrete;
            let (history, counts) = (&built.scene.method.steps, model.bodies.iter().map(|slot| slot.free));
            let has_dofs = *is_renewed && counts.eq(solution.field.rigid.iter().map(Vec::len));
            // with other dofs the pressures alone are known, and moved supports would strain the cells beside them
            if !has_dofs
                || specs.iter().any(|spec| history.locks(step, spec))
                || history.moves(step, &built.scene.bodies)
            {
                solution.field = DisplacementField::default();
            }
        }
        set_up(&session, built, Begin { start, steps, largest }, clock)
    });
    let mut ready = ready.map_err(|error| error.because(format!("it is in load step {}", step + 1)))?;
    ready.earlier = earlier;
    for (all, new) in [(&mut known, &mut ready.built.warnings), (&mut warnings, &mut ready.warnings)] {
        new.retain(|warning| !all.contains(warning));
        all.append(new);
    }
    (ready.built.warnings, ready.warnings) = (known, warnings);
    Ok(ready)
}

/// Build the problem of a scene on its mesh under the loads of a step of its history, or under the full loads.
/// Collective.
fn build_on(
    session: &Session,
    scene: Rc<Scene>,
    mut mesh: Box<dyn SceneMesh>,
    step: usize,
    before: Option<Before>,
    clock: &mut Clock,
) -> Result<Built> {
    let stage = session.stage("discretize");
    let mut stepped = Scene { bodies: mesh.bodies().to_vec(), ..(*scene).clone() };
    scene.method.steps.apply(step, &mut stepped.bodies, &mut stepped.contacts);
    let slips: Vec<_> = scene.contacts.iter().flat_map(|contact| contact.slips(scene.dimension.value)).collect();
    slips.into_iter().for_each(|slip| stepped.contacts.push(ContactSpec { table: stepped.contacts.len(), ..slip }));
    let (discrete, solvers, marks) = match before {
        Some(Before { discrete, solvers, step, marks }) => (Some(discrete), Some((solvers, step)), marks),
        None => (None, None, Vec::new()),
    };
    let mut inner = SolverFactory::new(session, &stepped, solvers)?;
    let discrete = mesh.discretize(&stepped, discrete, &mut inner)?;
    let (linear_step, counts) = inner.linear_step();
    // BLAS threads slow down small fronts, several ranks, and the short vectors of a Krylov method. Large
    // factorisations gain from them.
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let gains = mesh.facts().dofs_in_space >= LARGE_FRONTS && inner.factors();
    session.set_blas_threads(if gains { cores / session.size() } else { 1 });
    clock.estimate = inner.plan.seconds;
    clock.phase("discretize");
    drop(stage);
    let mut warnings = warnings::of_problem(session, &discrete);
    let MeshFacts { split, straightened, notes, .. } = mesh.facts();
    warnings.extend(warnings::in_parts(*split).into_iter().chain(warnings::made_straight(*straightened)));
    warnings.extend(notes.iter().cloned());
    warnings.extend(warnings::without_history(&scene).into_iter().chain(warnings::stiffer_than_diamond(&scene)));
    warnings.extend(inner.applied_once().into_iter().chain(inner.idle_options()));
    let has_page = scene.output.report && session.rank() == 0;
    let marks = if has_page && marks.is_empty() { mesh.marks(&stepped.bodies, &discrete.model.pairs) } else { marks };
    Ok(Built {
        scene,
        marks,
        splits: mesh.facts().splits.clone(),
        file: mesh.facts().file.clone(),
        joint: std::mem::take(&mut inner.joint),
        choice: inner.reason(),
        options: inner.options(),
        solvers: inner.into_solvers(),
        step: linear_step,
        counts,
        discrete,
        warnings,
        mesh: Some(mesh),
    })
}

/// Make the method and factor every body for the start. Then refuse options that no solver has read.
///
/// # Errors
/// PETSc does not know an option, the start is not finite, or PETSc fails.
pub fn set_up(session: &Session, mut built: Built, begin: Begin, clock: &mut Clock) -> Result<Prepared> {
    let _stage = session.stage("set-up");
    let scene = built.scene.clone();
    let Begin { start, steps, largest } = begin;
    built.discrete.remember(&largest)?;
    for (i, pair) in steps.last().iter().flat_map(|step| step.pairs.iter().enumerate()) {
        if scene.method.steps.locks(steps.len(), &built.discrete.specs[i]) {
            built.discrete.lock(i, pair.offset.unwrap_or(0.0));
        }
    }
    let mut start = match start {
        Some(start) => start,
        None => discretize::start(&scene, &built.discrete)?.into(),
    };
    // A condensed body lives on one rank. If its factorisation is refused, no other rank may wait for it in what
    // follows.
    collectively(session, built.discrete.model.condense())?;
    let method = collectively(session, make(session, &mut built, &mut start))?;
    let names: Vec<&str> = built.discrete.bodies.iter().map(|body| body.name.as_str()).collect();
    let warnings = collectively(session, options::unread(session, &names, &built.options))?;
    if built.options.is_empty() && session.options().has("-help") {
        options::show_help(session)?;
    }
    clock.phase("set-up");
    Ok(Prepared { built, method, start, steps, largest, earlier: Vec::new(), warnings })
}

/// Estimate the error of the solution, if the scene requests it.
pub fn estimate(done: &mut Done, clock: &mut Clock) -> Result<Option<Estimate>> {
    let Outcome { status, iterate, layer, .. } = &done.outcome;
    let discrete = &mut done.built.discrete;
    let Some(meshes) = discrete.meshes.clone().filter(|_| status.is_usable()) else { return Ok(None) };
    let model = &mut discrete.model;
    let estimate = estimate::estimate(&meshes, model, done.method.linear(), iterate, layer)?;
    if let Some((body, place)) = estimate::lost_at(&meshes, &discrete.model, &estimate) {
        let (name, place) = (&discrete.bodies[body].name, output::closing::place(place));
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

/// Make the method of a scene and set up the solvers that it needs. Errors occur before the first sweep. If the set-up
/// finds an automatic start, it is stored in `start`.
fn make(session: &Session, built: &mut Built, start: &mut InitialGuess) -> Result<Method> {
    let scene = built.scene.clone();
    let rule = || gamma::rule(&scene.method.gamma, &scene.own_rules);
    match scene.method.name {
        MethodName::Robin => {
            let (rule, coefficient) = (rule()?, Some(coefficient_of(&scene, &built.discrete)));
            prepare_sweeps(built)?;
            Ok(Method::Robin { rule, coefficient, linear: Box::new(SweepCg::with_robin_term()) })
        }
        MethodName::Semismooth => {
            Ok(Method::Robin { rule: rule()?, coefficient: None, linear: linear_step(session, built, start)? })
        }
        _ => linear_step(session, built, start).map(Method::Newton),
    }
}

/// Set up the solvers of the bodies for sweeps, unless the problem before had the same.
fn prepare_sweeps(built: &mut Built) -> Result<()> {
    let model = &mut built.discrete.model;
    // its linear steps may have left a rough tolerance
    if built.step.take().is_some() { model.set_tolerance(INNER_TOLERANCE) } else { crate::robin::prepare(model) }
}

/// Return the Robin term of a scene.
fn coefficient_of(scene: &Scene, discrete: &Discrete) -> Coefficient {
    let MethodSpec { psi, robin, .. } = &scene.method;
    let sides = (0..discrete.model.pairs.len()).map(|i| discrete.sides(i)).collect();
    Coefficient::new(psi.clone(), sides, *robin)
}

/// Return the solver of linear steps of all bodies.
fn linear_step(session: &Session, built: &mut Built, start: &mut InitialGuess) -> Result<Box<dyn LinearStep>> {
    let linear = built.solvers.plan.linear;
    if linear == Linear::Sweeps {
        prepare_sweeps(built)?;
        return Ok(Box::new(SweepCg::new(coefficient_of(&built.scene, &built.discrete))));
    }
    let Built { scene, discrete, step, counts, options, joint, .. } = built;
    let model = &mut discrete.model;
    if let Some(mut step) = step.take() {
        step.renew(model);
        return Ok(step);
    }
    let compliance = if linear == Linear::Dense { ComplianceStep::new(model)? } else { None };
    let JointParts { stiffness, interpolation, near_null_space: modes } = std::mem::take(joint);
    // a factorisation alone can do without complete nodes, with unknowns for rigid motions among them, if its rows are
    // not distributed
    let is_dense = linear == Linear::Dense;
    let factors = is_dense || matches!(options[0].get("pc_type"), Some("cholesky" | "lu"));
    let of_nodes = !factors || model.is_distributed();
    let make: MakeSolver = if is_dense {
        Box::new(Dense::make)
    } else {
        let (session, chosen) = (session.clone(), options[0].clone());
        let block = if of_nodes { scene.dimension.value } else { 1 };
        Box::new(move |stiffness| Ok(Box::new(Krylov::new(&session, chosen, block, stiffness, &modes, interpolation)?)))
    };
    let mut step: Box<dyn LinearStep> = match compliance {
        Some(step) => Box::new(step),
        None => Box::new(JointStep::new(model, stiffness, of_nodes, is_dense, make)?),
    };
    step.count_on(*counts);
    // the first system of the paper's iteration is the extension of its start
    let extends = scene.method.name == MethodName::Semismooth;
    let springs = if extends { Some(stiff_joint_springs(model)) } else { first_springs(model, start) };
    springs.map_or(Ok(()), |springs| step.set_up(&springs))?;
    Ok(step)
}
