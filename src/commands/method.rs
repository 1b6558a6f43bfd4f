//! The scene's method -> the method that runs.

use crate::ddm::Model;
use crate::ddm::gamma::{Aitken, BarzilaiBorwein, GammaRule, LineSearch, Schedule, Spectral, Stationary};
use crate::ddm::method::{Anderson, Conjugate, Coupled, Inner, Method, Newton, Relaxed};
use crate::error::{Error, Kind, Result};
use crate::petsc::Session;
use crate::problem::method::{Gamma, MethodName};
use crate::problem::solver::Preset;
use crate::scene::Scene;
use crate::solver::{Dense, Krylov, Monolithic, Union, options, preset};

/// Prefix of the PETSc options of the Newton matrix of all bodies.
pub const WHOLE: &str = "newton";

/// Dofs of all condensed bodies up to which their dense Newton matrix is factored: 0.2 s and 250 MB.
pub const DENSE: usize = 3000;

/// The methods of a scene.
pub struct Made {
    /// The first one, and those that take over when progress stops.
    pub methods: Vec<Box<dyn Method>>,
    /// Prefix of the PETSc options of a solver that they have of their own.
    pub prefix: Option<&'static str>,
}

/// Makes the method of a scene; the bodies of `model` are set up, and `condensed` tells that each is condensed.
///
/// # Errors
/// `newton` on several ranks; failures of PETSc.
pub fn make(session: &Session, scene: &Scene, model: &Model, condensed: bool) -> Result<Made> {
    let over_sweeps = || Box::new(Newton::new(Inner::Sweep)) as Box<dyn Method>;
    let joined = |coupled: Box<dyn Coupled>| Box::new(Newton::new(Inner::Direct(coupled))) as Box<dyn Method>;
    let typed = options::asks_for_ksp(session, WHOLE)?;
    let small = || is_small(session, model, condensed).then(|| dense(model)).flatten();
    let mut prefix = None;
    let methods = match scene.method.name {
        MethodName::Auto => {
            let first = match small() {
                None if multigrid(session, model) => {
                    prefix = Some(WHOLE);
                    Some(sparse(session, scene, model)?)
                }
                dense => dense,
            };
            let last = [over_sweeps(), Box::new(Conjugate::default())];
            first.map(joined).into_iter().chain(last).collect()
        }
        MethodName::NewtonRobin => vec![over_sweeps()],
        MethodName::Robin => vec![Box::new(Relaxed::new(rule(&scene.method.gamma))) as _],
        MethodName::Ncg => vec![Box::new(Conjugate::default()) as _],
        MethodName::Anderson => vec![Box::new(Anderson::new(scene.method.depth)) as _],
        MethodName::Newton => match (!typed).then(small).flatten() {
            Some(coupled) => vec![joined(coupled)],
            None => {
                prefix = Some(WHOLE);
                vec![joined(sparse(session, scene, model)?)]
            }
        },
    };
    Ok(Made { methods, prefix })
}

/// Whether a scene's first method joins the bodies, which may not be set up yet.
pub fn begins_jointly(session: &Session, scene: &Scene, model: &Model, condensed: bool) -> bool {
    let joins = is_small(session, model, condensed) || multigrid(session, model);
    matches!(scene.method.name, MethodName::Newton) || (matches!(scene.method.name, MethodName::Auto) && joins)
}

/// Whether a scene's first method joins all bodies by multigrid.
pub fn joins_by_multigrid(session: &Session, scene: &Scene, model: &Model) -> bool {
    matches!(scene.method.name, MethodName::Auto | MethodName::Newton) && multigrid(session, model)
}

fn rule(gamma: &Gamma) -> Box<dyn GammaRule> {
    match gamma {
        Gamma::Stationary(gamma) => Box::new(Stationary(*gamma)),
        Gamma::Schedule(list) => Box::new(Schedule(list.clone())),
        Gamma::LineSearch => Box::new(LineSearch),
        Gamma::Aitken => Box::new(Aitken::default()),
        Gamma::BarzilaiBorwein => Box::new(BarzilaiBorwein::default()),
        Gamma::Spectral => Box::new(Spectral::default()),
    }
}

/// Whether the Newton matrix of all bodies is small and dense.
fn is_small(session: &Session, model: &Model, condensed: bool) -> bool {
    let dofs: usize = model.bodies.iter().filter_map(|slot| slot.local.as_ref()).map(|body| body.len()).sum();
    condensed && session.size() == 1 && dofs <= DENSE
}

/// All bodies as one dense matrix.
fn dense(model: &Model) -> Option<Box<dyn Coupled>> {
    let union = Union::of(model, true)?.without_zeros();
    let solver = Dense::new(union.stiffness.rows(), union.stiffness.values.clone());
    Some(Box::new(Monolithic::new(union, solver)))
}

/// Whether multigrid solves every body of this process, the only one.
fn multigrid(session: &Session, model: &Model) -> bool {
    let hypre = |name: &str| session.options().get(&format!("-{name}_pc_type")).is_some_and(|pc| pc == "hypre");
    session.size() == 1 && model.bodies.iter().all(|slot| hypre(&slot.name))
}

/// All bodies as one sparse matrix: with multigrid if that is what they have, else factored.
fn sparse(session: &Session, scene: &Scene, model: &Model) -> Result<Box<dyn Coupled>> {
    let multigrid = multigrid(session, model);
    // multigrid wants nodes, without numbers for rigid motions among them
    let Some(union) = Union::of(model, !multigrid).filter(|_| session.size() == 1) else {
        return Err(Error::new(Kind::Usage, "method `newton` factors all bodies together and runs on one rank")
            .help("choose newton-robin, or start without mpiexec"));
    };
    let (preset, block) = if multigrid {
        preset::made_often(session, WHOLE)?;
        (Preset::Hypre, scene.dimension.value)
    } else {
        (Preset::Mumps, 1)
    };
    preset::apply(session, WHOLE, preset)?;
    let solver = Krylov::new(session, WHOLE, block, &union.stiffness, &[])?;
    Ok(Box::new(Monolithic::new(union, solver)))
}
