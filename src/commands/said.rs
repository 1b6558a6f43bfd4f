//! What a run says besides its table: the phase under way, what was decided and why, and the little that is left with `-q`.

use crate::error::Result;
use crate::output::progress::Line;
use crate::output::{LISTED, Report, warning_lines};
use crate::petsc::Session;
use crate::problem::{MethodName, name_of};
use crate::run::report::{Shared, solvers_in_words};
use crate::run::{self, Clock, Ready};
use std::cell::RefCell;
use std::rc::Rc;

/// A clock; if it is `loud` a line on the terminal says which phase is under way up to the first iteration.
pub fn watched(loud: bool) -> Clock {
    let line = RefCell::new(None);
    let next = move |ended: &str, estimate: Option<f64>| {
        // one line goes before the next one begins
        drop(line.borrow_mut().take());
        *line.borrow_mut() = match ended {
            "" => Some(Line::new("mesh", None)),
            "mesh" => Some(Line::new("bodies and contact points", None)),
            "discretize" => Some(Line::new("factorisations and start", estimate)),
            _ => None,
        };
    };
    let mut clock = Clock::default();
    clock.watch = loud.then(|| Rc::new(next) as _);
    clock
}

/// What was decided and why, and the PETSc options of each body. Collective.
///
/// # Errors
/// When PETSc is out of memory.
pub fn decisions(session: &Session, ready: &Ready) -> Result<Vec<String>> {
    let built = &ready.built;
    let (scene, discrete) = (&built.scene, &built.discrete);
    let solvers = Shared::gather(discrete).solvers;
    let mut lines = vec![format!("{}: decided", scene.title)];
    let name = name_of(&MethodName::ALL, &scene.method.name);
    let newton = matches!(scene.method.name, MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin);
    let linear = if newton { format!("; Newton's linear steps: {}", built.linear.name()) } else { String::new() };
    lines.push(format!("  method: {name}{linear}; until {}", run::targets(scene)));
    lines.push(format!("  inner solver: {} ({})", solvers_in_words(&solvers), built.choice));
    lines.push(format!("  {} ranks, {}", session.size(), session.blas_name()));
    for (body, solver) in discrete.bodies.iter().zip(&solvers).take(LISTED) {
        lines.push(format!("  body {}: {} dofs on rank {}: {solver}", body.name, body.dofs, body.rank));
    }
    for pair in discrete.model.pairs.iter().take(LISTED) {
        let [carrier, other] = &pair.surfaces;
        lines
            .push(format!("  {carrier} - {other}: {} points on `{carrier}`, whose mesh is finer or alike", pair.len()));
    }
    for chosen in built.options.iter().take(LISTED) {
        // PETSc's table has all of them while they are lent to it
        let all = chosen.lend(session, || session.options().all())?;
        let prefix = format!("-{}_", chosen.prefix());
        let own = all.into_iter().filter(|(name, _)| name.starts_with(&prefix));
        let own: Vec<String> =
            own.map(|(name, value)| value.map_or(name.clone(), |value| format!("{name} {value}"))).collect();
        lines.push(format!("  PETSc options of {}: {}", chosen.prefix(), own.join(" ")));
    }
    Ok(lines)
}

/// What is said of a run with `-q`: how it ended if it is not solved, its warnings, and where the results are.
pub fn briefly(report: &Report, code: i32, results: &str) -> String {
    let ended = (code != 0).then(|| format!("{}: {}", report.title, report.message));
    let warnings = warning_lines(&report.warnings, "report.json");
    ended.into_iter().chain(warnings).chain([results.to_owned()]).collect::<Vec<_>>().join("\n")
}
