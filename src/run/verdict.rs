//! The end of a run: the name of its status, its exit code, and a message with the cause and with advice.

use super::in_words;
use super::recorder;
use super::stages::Done;
use crate::contact::ContactPair;
use crate::ddm::{Outcome, Status};
use crate::error::Kind;
use crate::model::{Mechanism, Model, NamedMotion};
use crate::output::closing::readable;
use crate::output::{RunStatus, StepReport, sci};
use crate::problem::ContactSpec;

impl From<&Status> for RunStatus {
    fn from(status: &Status) -> Self {
        match status {
            Status::Converged => Self::Converged,
            Status::RoundoffLimited => Self::RoundoffLimited,
            Status::Stagnated => Self::Stagnated,
            Status::IterationLimit => Self::IterationLimit,
            Status::NotFinite { .. } => Self::NotFinite,
            Status::OutOfRange { .. } => Self::OutOfRange,
            Status::Underconstrained(_) | Status::Mechanism(_) => Self::Underconstrained,
            Status::Unbounded { .. } => Self::Unbounded,
            Status::InnerSolver { .. } => Self::InnerSolver,
            Status::Unbalanced(_) | Status::NoDigits(_) => Self::Inaccurate,
            Status::Interrupted { .. } => Self::Interrupted,
        }
    }
}

/// Return the exit code of a run.
pub fn exit_code(done: &Done) -> i32 {
    match done.outcome.status {
        Status::Converged | Status::RoundoffLimited if done.steps.iter().all(|step| step.status.is_solved()) => 0,
        Status::Interrupted { asked } => recorder::signal(asked).map_or(1, |signal| Kind::Stopped(signal).exit_code()),
        _ => 1,
    }
}

/// Return the status in words: what happened in which body and iteration, and what to try.
pub fn message(outcome: &Outcome, model: &Model) -> String {
    let k = outcome.iterations;
    let name = |body: &usize| &model.bodies[*body].name;
    let other = alternative(outcome);
    match &outcome.status {
        Status::Converged => format!("converged in {k} iteration{}", if k == 1 { "" } else { "s" }),
        Status::RoundoffLimited if outcome.rounding > 10.0 * residual(outcome) => few_digits(outcome.rounding),
        Status::RoundoffLimited => {
            format!("{} after {k} iterations: rounding allows no less", measure(outcome))
        }
        Status::Stagnated => format!(
            "not converged: {} after {k} iterations, the last three of which made no progress: try {other}",
            measure(outcome)
        ),
        Status::IterationLimit => format!(
            "not converged in {k} iterations, {}: allow more (method.stop.iterations) or try {other}",
            measure(outcome)
        ),
        Status::NotFinite { body } => not_finite(name(body), k, other),
        Status::OutOfRange { energy } => format!(
            "the energy of bodies and layers, {}, is beyond what double precision can carry: choose units in which loads, moduli \
             and lengths are nearer to 1",
            sci(*energy, 1)
        ),
        Status::Underconstrained(NamedMotion { body, name: motion }) => format!(
            "body `{}`: neither a support nor a spring nor a closed contact holds its {motion} in iteration {k}: add a support, \
             or a start that closes the contact (method.start), or try {other}",
            name(body)
        ),
        Status::Mechanism(mechanism) => unbalanced_mechanism(mechanism, model),
        Status::Unbounded { moving } => unbounded(moving, model),
        Status::InnerSolver(failure) => {
            let reason = if failure.reason.is_empty() { "its rank knows more" } else { &failure.reason };
            let whose = failure.body.map_or("all bodies".to_owned(), |body| format!("body `{}`", name(&body)));
            format!("{whose}: the inner solver failed in iteration {k}: {reason}")
        }
        Status::NoDigits(found) => few_digits(*found),
        Status::Unbalanced(found) => inaccurate(*found, residual(outcome)),
        Status::Interrupted { asked } => {
            format!("interrupted by {} after {k} iterations, {}", recorder::signal_name(*asked), measure(outcome))
        }
    }
}

/// Return what to try instead. Only `robin` and `semismooth` have a step length that a user can make shorter; other
/// methods choose it themselves.
fn alternative(outcome: &Outcome) -> &'static str {
    match outcome.method {
        "robin" | "semismooth" => "a smaller method.gamma, or --method auto",
        _ => "another --method",
    }
}

/// Return the message on a number that is not finite in iteration `k`.
fn not_finite(body: &str, k: usize, other: &str) -> String {
    if k == 0 {
        return format!(
            "body `{body}`: a number is not finite before the first iteration: look for a far too large one among its constants, \
             its loads, the layers, and in method.start"
        );
    }
    format!("body `{body}`: a number is not finite in iteration {k}: try a smaller start (method.start) or {other}")
}

/// Return the message on a motion that nothing resists, and on which loads work.
fn unbalanced_mechanism(found: &Mechanism, model: &Model) -> String {
    let Mechanism { bodies, motion, work, support, by_facets, .. } = found;
    let names = in_words(bodies.iter().map(|body| &model.bodies[*body].name));
    let (who, whose) = if bodies.len() == 1 { ("body", "its") } else { ("bodies", "them together in their") };
    format!(
        "{who} {names}: neither a support nor a spring nor contact holds {whose} {motion}, and loads work on it ({} % of what \
         forces of their sizes could do): add a support {support} or a weak spring, or balance the loads{}{}",
        readable(100.0 * work, 1),
        without_shear(bodies, model),
        if *by_facets { CANNOT_TELL } else { "" }
    )
}

/// The advice where facets resist a motion by no more than their errors.
const CANNOT_TELL: &str = ". Facets of this order and size cannot tell whether contact holds this motion: if it does, as in a slender taper, \
     take a higher order or a finer mesh";

/// Return the advice on bodies that a bond could hold by shear alone; empty where no bond joins them to others.
pub fn without_shear(bodies: &[usize], model: &Model) -> &'static str {
    let joins = |pair: &ContactPair| bodies.contains(&pair.bodies[0]) != bodies.contains(&pair.bodies[1]);
    let is_bonded = model.pairs.iter().any(|pair| pair.law.is_bonded() && joins(pair));
    if is_bonded { "; a bond acts along the normal only and carries no shear" } else { "" }
}

/// Return the message on unresisted motions of bodies.
fn unbounded(moving: &[NamedMotion], model: &Model) -> String {
    let motion = |moved: &NamedMotion| format!("{} of `{}`", moved.name, model.bodies[moved.body].name);
    let what = match moving {
        [] => "a motion of a body".to_owned(),
        all => all.iter().map(motion).collect::<Vec<_>>().join(" and "),
    };
    format!(
        "unbounded: no support or contact resists {what}, and the loads push that way; add a support, or turn the load"
    )
}

/// Relative error up to which the message on an inaccurate result tells how to accept it: that of a result with three
/// digits.
const ACCEPTABLE: f64 = 1e-3;

/// Return the message on a result whose forces lack balance by the relative error `found`, where the run saw the error
/// `reported`.
fn inaccurate(found: f64, reported: f64) -> String {
    // a body with few digits, such as a slender one under a force that is tiny beside the others, has such an error
    // with any solver
    let accept = if found < ACCEPTABLE {
        format!(", or accept it (--set method.stop.residual={})", sci(found, 0))
    } else {
        String::new()
    };
    format!(
        "the forces of the result, computed with the stiffness of the bodies itself, lack balance: the relative error is about {}, where the run \
         saw {}: leave options of the inner solver (-ksp_..., -pc_..., -mat_...) and method.robin at their defaults, take another solver \
         (--set solver=mumps){accept}",
        sci(found, 1),
        sci(reported, 1)
    )
}

/// Return the message on pressures that roundoff of gaps and displacements may change by this share of their peak.
fn few_digits(share: f64) -> String {
    format!(
        "the displacements are so large beside what compresses the layers that few digits are left for the pressures, which may be off by {} of \
         their peak: begin with a smaller gap, let supports move bodies less, or take softer layers",
        sci(share, 1)
    )
}

/// Return the last value of the stopping test.
fn residual(outcome: &Outcome) -> f64 {
    outcome.rows.last().map_or(f64::NAN, |row| row.residual)
}

/// Return the last value of the stopping test with its name.
fn measure(outcome: &Outcome) -> String {
    let name = if outcome.method.starts_with("newton") { "largest relative error" } else { "residual" };
    format!("{name} {}", sci(residual(outcome), 1))
}

/// Return status and message of the worst load step before the last one, if it found no solution and is worse than the
/// last one.
pub fn worst_step(steps: &[StepReport]) -> Option<(RunStatus, String)> {
    // without a finite or held iterate, all are alike
    let badness = |step: &StepReport| Some(step.status.min(RunStatus::NotFinite)).filter(|status| !status.is_solved());
    let (last, before) = steps.split_last()?;
    let worst = before.iter().map(badness).max().filter(|worst| *worst > badness(last))?;
    let number = before.iter().position(|step| badness(step) == worst)?;
    let unsolved = steps.iter().filter(|step| !step.status.is_solved()).count();
    let message = format!(
        "{unsolved} of {} load steps found no solution; load step {}: {}",
        steps.len(),
        number + 1,
        before[number].message
    );
    Some((before[number].status, message))
}

/// Return warnings of the load steps before the last one that found no solution, and of later ones that keep what they
/// have found.
pub fn step_warnings(done: &Done) -> Vec<String> {
    let (steps, history) = (&done.steps, &done.built.scene.method.steps);
    let before = steps.iter().take(steps.len().saturating_sub(1)).enumerate();
    let unsolved = before.filter(|(_, step)| !step.status.is_solved());
    let warning = |(i, step): (usize, &StepReport)| {
        let factors: Vec<String> = step.factors.iter().map(|(name, factor)| format!("{name} {factor}")).collect();
        // a step that keeps an offset itself has not found it
        let found = |spec: &&ContactSpec| history.locks(i + 1, spec) && !history.locks(i, spec);
        let kept = match done.built.discrete.specs.iter().find(found) {
            Some(spec) => format!(
                "; the steps after it keep the offset of `{}` and `{}` that it has found, so that their results are no solutions, either",
                spec.between[0].value, spec.between[1].value
            ),
            None => String::new(),
        };
        format!("load step {} ({}): {}{kept}", i + 1, factors.join(", "), step.message)
    };
    unsolved.map(warning).collect()
}
