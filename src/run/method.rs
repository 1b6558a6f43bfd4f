//! The step from the method that a scene names to the method that runs.

use super::stages::Built;
use crate::ddm::gamma::{Aitken, BarzilaiBorwein, GammaRule, LineSearch, Relaxed, Schedule, Spectral, Stationary};
use crate::ddm::robin::{Acceleration, Anderson, Conjugate};
use crate::ddm::{Method, Start, first_springs};
use crate::error::{Error, Kind, Result};
use crate::fem::Interpolation;
use crate::model::{LinearStep, Model};
use crate::petsc::Session;
use crate::problem::method::{Gamma, Linear, MethodName};
use crate::robin::{Coefficient, Sweeps};
use crate::scene::Scene;
use crate::solver::options::Chosen;
use crate::solver::{Dense, Krylov, Monolithic, Union};

/// Make the method of a scene and set up the solvers that it needs. Errors occur before the first sweep. If the set-up finds an
/// automatic start, it is stored in `start`.
pub fn make(session: &Session, built: &mut Built, start: &mut Start) -> Result<Method> {
    let Built { scene, discrete, linear, options, interpolation, .. } = built;
    let model = &mut discrete.model;
    let coefficient = || Coefficient::new(scene.method.psi.clone(), scene.method.robin);
    let acceleration: Box<dyn Acceleration> = match scene.method.name {
        MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin => {
            return Ok(Method::Newton(linear_step(
                session,
                scene,
                model,
                (*linear, options, interpolation.take()),
                coefficient(),
                start,
            )?));
        }
        MethodName::Robin => Box::new(Relaxed::new(rule(scene)?)),
        MethodName::Ncg => Box::new(Conjugate::default()),
        MethodName::Anderson => Box::new(Anderson::new(scene.method.depth)),
    };
    crate::robin::prepare(model)?;
    Ok(Method::Sweeps { acceleration, coefficient: coefficient(), linear: Box::new(Sweeps::carried()) })
}

/// Return the solver of the linear steps of Newton's method. The tuple has its kind, the options of all solvers of PETSc, and the
/// interpolation of the matrix of all bodies.
fn linear_step(
    session: &Session,
    scene: &Scene,
    model: &mut Model,
    (linear, options, interpolation): (Linear, &[Chosen], Option<Interpolation>),
    coefficient: Coefficient,
    start: &mut Start,
) -> Result<Box<dyn LinearStep>> {
    if linear == Linear::Sweeps {
        crate::robin::prepare(model)?;
        return Ok(Box::new(Sweeps::new(coefficient)));
    }
    model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut()).try_for_each(|body| body.reveal())?;
    // Multigrid needs complete nodes, without unknowns for rigid motions among them, and so do distributed rows.
    let nodes = linear == Linear::Multigrid || model.is_distributed();
    let union = if nodes { Union::of_nodes(model)? } else { Union::of(model)? };
    let Some(union) = union else {
        return Err(Error::new(Kind::Solver, "a body has no matrices to be joined").help("choose newton-robin"));
    };
    let block = if nodes { scene.dimension.value } else { 1 };
    let mut step: Box<dyn LinearStep> = match linear {
        Linear::Dense => Box::new(Monolithic::new(union.without_zeros(), |stiffness| Ok(Dense::new(stiffness)))?),
        _ => {
            let krylov = |stiffness| Krylov::new(session, options[0].clone(), block, stiffness, &[], interpolation);
            let monolithic = Monolithic::new(union, krylov)?;
            model.joint = nodes.then(|| monolithic.joint());
            Box::new(monolithic)
        }
    };
    if let Some(springs) = first_springs(model, start) {
        step.set_up(&springs)?;
    }
    Ok(step)
}

fn rule(scene: &Scene) -> Result<Box<dyn GammaRule>> {
    Ok(match &scene.method.gamma {
        Gamma::Stationary(gamma) => Box::new(Stationary(*gamma)),
        Gamma::Schedule(list) => Box::new(Schedule(list.clone())),
        Gamma::LineSearch => Box::new(LineSearch),
        Gamma::Aitken => Box::new(Aitken::default()),
        Gamma::BarzilaiBorwein => Box::new(BarzilaiBorwein::default()),
        Gamma::Spectral => Box::new(Spectral::default()),
        Gamma::Own(name) => scene.rules.get("rule for gamma", name)?(),
    })
}
