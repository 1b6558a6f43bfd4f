//! The scene's method -> the method that runs.

use crate::ddm::gamma::{Aitken, BarzilaiBorwein, GammaRule, LineSearch, Schedule, Spectral, Stationary};
use crate::ddm::method::{Anderson, Conjugate, Inner, Method, Newton, Relaxed};
use crate::discretize::{Matrices, Problem};
use crate::error::{Error, Kind, Result};
use crate::petsc::Session;
use crate::scene::{Gamma, MethodName, Preset, Scene};
use crate::solver::{Krylov, Monolithic, Part, Union, preset};

/// Prefix of the PETSc options of the Newton matrix of all bodies.
pub const WHOLE: &str = "newton";

/// Whether the scene's method needs the matrices of the bodies besides the bodies.
pub fn keeps_matrices(scene: &Scene) -> bool {
    scene.method.name == MethodName::Newton
}

/// The method of a scene, and those that take over when progress stops.
///
/// # Errors
/// `newton` on several ranks; failures of PETSc.
pub fn make(session: &Session, scene: &Scene, problem: &mut Problem) -> Result<Vec<Box<dyn Method>>> {
    let newton = || Box::new(Newton::new(Inner::Sweep)) as Box<dyn Method>;
    Ok(match scene.method.name {
        MethodName::Auto => vec![newton(), Box::new(Conjugate::default())],
        MethodName::NewtonRobin => vec![newton()],
        MethodName::Robin => vec![Box::new(Relaxed::new(rule(&scene.method.gamma)))],
        MethodName::Ncg => vec![Box::new(Conjugate::default())],
        MethodName::Anderson => vec![Box::new(Anderson::new(scene.method.depth))],
        MethodName::Newton => vec![Box::new(Newton::new(Inner::Direct(Box::new(whole(session, problem)?))))],
    })
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

/// All bodies as one matrix.
fn whole(session: &Session, problem: &mut Problem) -> Result<Monolithic> {
    if session.size() > 1 {
        return Err(Error::new(Kind::Usage, "method `newton` factors all bodies together and runs on one rank")
            .help("choose newton-robin, or start without mpiexec"));
    }
    let model = &problem.model;
    let mut points = vec![[(0, 0); 2]; model.points()];
    for body in 0..model.bodies.len() {
        for (row, place) in model.trace_ranges(body).flatten().enumerate() {
            points[place % model.points()][place / model.points()] = (body, row);
        }
    }
    let kept = std::mem::take(&mut problem.kept).into_iter();
    let union = Union::new(kept.map(|Matrices { body, rows, left }| Part::new(body, rows, &left)).collect(), &points);
    preset::apply(session, WHOLE, Preset::Mumps)?;
    Monolithic::new(union, |stiffness| Krylov::new(session, WHOLE, 1, stiffness, &[]))
}
