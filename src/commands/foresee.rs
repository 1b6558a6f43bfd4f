//! The automatic start of a large contact in space: pressures of a coarser mesh.
//!
//! Newton's steps from rigid motions grow the contact point by point, and each costs a multigrid set-up and a solve of all
//! bodies. A mesh of elements three times as large has 27 times fewer dofs, and tells the pressures to an element of its own.

use super::clock::Clock;
use super::prepared::Prepared;
use super::run;
use super::{carry, method, report};
use crate::ddm::{Layer, Silent, Status, automatic_start};
use crate::error::Result;
use crate::mesh;
use crate::output::{CoarserReport, ContactTable};
use crate::petsc::Session;
use crate::problem::mesh::{MeshSource, Sizing};
use crate::problem::method::Start;
use crate::problem::solver::Preset;
use crate::problem::stop::StopRule;
use crate::scene::Scene;
use crate::solver::{options, preset};
use std::time::Instant;

/// How many times larger the elements of the coarser mesh are.
const COARSER: f64 = 3.0;

/// Dofs from which it pays.
const LEAST: usize = 20_000;

/// Residual on the coarser mesh.
const ROUGH: f64 = 1e-3;

/// A start that closes this share of the points knows the contact well enough.
const KNOWN: f64 = 0.5;

/// Gives a large contact, most of which the start leaves open, the pressures of a coarser mesh to begin with.
///
/// # Errors
/// Failures of PETSc's options. A coarser mesh that cannot be made or solved is no error: the run begins without it.
pub fn foresee(session: &Session, scene: &Scene, prepared: &mut Prepared, clock: &mut Clock) -> Result<()> {
    if !pays(session, scene, prepared)? {
        return Ok(());
    }
    let mut coarse = scene.clone();
    if let MeshSource::Geo { sizes, .. } = &mut coarse.mesh {
        let before = if let Some(Sizing::Times(times)) = sizes { *times } else { 1.0 };
        *sizes = Some(Sizing::Times(COARSER * before));
    }
    coarse.method.stop = StopRule { residual: Some(ROUGH), increment: None, balanced: false, ..coarse.method.stop };
    coarse.solver.preset = None;
    coarse.estimate = false;
    options::withdraw(session)?;
    let began = Instant::now();
    let solved = solve(session, &coarse, clock);
    options::withdraw(session)?;
    let names: Vec<&str> = prepared.problem.bodies.iter().map(|body| body.name.as_str()).collect();
    options::distribute(session, &names)?;
    names.iter().try_for_each(|name| preset::apply(session, name, Preset::Hypre))?;
    match solved {
        Ok(Some((tables, coarser))) => {
            prepared.foreseen = Some(carry::pressure(&tables, prepared));
            prepared.coarser = Some(CoarserReport { seconds: began.elapsed().as_secs_f64(), ..coarser });
        }
        Ok(None) => {}
        Err(error) => {
            let message = error.message();
            prepared.warnings.push(format!("the start has no pressures of a coarser mesh: {message}"));
        }
    }
    Ok(())
}

fn pays(session: &Session, scene: &Scene, prepared: &Prepared) -> Result<bool> {
    let model = &prepared.problem.model;
    let dofs: usize = prepared.problem.bodies.iter().map(|body| body.dofs).sum();
    let asked = matches!(scene.method.start, Start::Auto) && scene.method.steps.is_empty() && scene.adapt.is_none();
    if !asked || scene.dimension.value != 3 || dofs < LEAST || !method::joins_by_multigrid(session, scene, model) {
        return Ok(false);
    }
    // options that were typed belong to the solvers that have read them
    let mut names = prepared.problem.bodies.iter().map(|body| body.name.as_str()).chain([method::WHOLE]);
    if names.try_fold(false, |typed, name| Ok(typed || options::asks_for_ksp(session, name)?))? {
        return Ok(false);
    }
    let layer = Layer::at(model, &automatic_start(model));
    Ok((layer.closed as f64) < KNOWN * model.points() as f64 && mesh::follows(&scene.mesh))
}

/// The contact tables of a scene on a coarser mesh, and what they cost; `None` where it has no solution.
fn solve(session: &Session, scene: &Scene, clock: &mut Clock) -> Result<Option<(Vec<ContactTable>, CoarserReport)>> {
    let mut prepared = run::prepare(session, scene, clock)?;
    foresee(session, scene, &mut prepared, clock)?;
    run::set_up(session, scene, &mut prepared, clock)?;
    let outcome = run::iterate(scene, &mut prepared, &mut Silent, clock)?;
    if !matches!(outcome.status, Status::Converged | Status::Attainable) {
        return Ok(None);
    }
    let model = &prepared.problem.model;
    let tables = (0..model.pairs.len()).map(|i| report::contact_table(&prepared, &outcome, None, i)).collect();
    let dofs = prepared.problem.bodies.iter().map(|body| body.dofs).sum();
    let (points, iterations) = (model.points(), outcome.iterations);
    Ok(Some((tables, CoarserReport { times: COARSER, dofs, points, iterations, seconds: 0.0 })))
}
