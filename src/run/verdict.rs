//! How a run ended: the name of its status, and in words what happened and what to try.

use super::asking;
use super::words::in_words;
use crate::ddm::forecast::{best_factor, best_gamma};
use crate::ddm::{Inaccuracy, Outcome, Status, Whose};
use crate::model::{Mechanism, Model, Moved};
use crate::output::{ForecastReport, StepReport, sci};

/// Name of a status in `report.json`.
pub fn status_name(status: &Status) -> &'static str {
    match status {
        Status::Converged => "converged",
        Status::RoundoffLimited => "roundoff-limited",
        Status::IterationLimit => "iteration-limit",
        Status::NotFinite { .. } => "not-finite",
        Status::OutOfRange { .. } => "out-of-range",
        Status::Cycle { .. } => "cycle",
        Status::Underconstrained(_) | Status::Mechanism(_) => "underconstrained",
        Status::Unbounded { .. } => "unbounded",
        Status::InnerSolver { .. } => "inner-solver",
        Status::Inaccurate(_) => "inaccurate",
        Status::Paused { asked } => {
            if asking::signal(*asked).is_some() {
                "interrupted"
            } else {
                "running"
            }
        }
    }
}

/// The status in words: what happened, to which body, in which iteration, and what to try.
pub fn message(outcome: &Outcome, model: &Model) -> String {
    let k = outcome.iterations;
    let name = |body: &usize| &model.bodies[*body].name;
    let residual = outcome.rows.last().map_or(f64::NAN, |row| row.residual);
    // what turns the step shorter in the paper's iteration; other methods choose it themselves
    let other = if outcome.method == "robin" { "a smaller method.gamma, or --method auto" } else { "another --method" };
    match &outcome.status {
        Status::Converged => format!("converged in {k} iteration{}", if k == 1 { "" } else { "s" }),
        Status::RoundoffLimited => {
            format!("{} {} after {k} iterations: rounding allows no less", measure(outcome), sci(residual, 1))
        }
        Status::IterationLimit => format!(
            "not converged in {k} iterations, {} {}: allow more (method.stop.iterations{}) or try {}",
            measure(outcome),
            sci(residual, 1),
            outlook(outcome),
            advice(outcome).unwrap_or_else(|| other.to_owned())
        ),
        Status::NotFinite { body } if k == 0 => format!(
            "body `{}`: a number is not finite before the first iteration: look for a far too large one among its constants, \
             its loads, the layers, and in method.start",
            name(body)
        ),
        Status::NotFinite { body } => format!(
            "body `{}`: a number is not finite in iteration {k}: try a smaller start (method.start) or {other}",
            name(body)
        ),
        Status::OutOfRange { energy } => format!(
            "the energy of bodies and layers, {}, is beyond what double precision can carry: choose units in which loads, moduli \
             and lengths are nearer to 1",
            sci(*energy, 1)
        ),
        Status::Cycle { period: 1 } => {
            format!(
                "the contact stays as it is, and neither residual nor F1 falls (seen in iteration {k}): try {other}"
            )
        }
        Status::Cycle { period } => {
            format!("the iterates repeat every {period} iterations (seen in iteration {k}): try {other}")
        }
        Status::Underconstrained(Moved { body, name: motion }) => format!(
            "body `{}`: nothing holds its {motion} in iteration {k}: neither a support nor the Robin zone; add a support, \
             or a start that closes the contact (method.start), or try {other}",
            name(body)
        ),
        Status::Mechanism(Mechanism { bodies, motion, work, .. }) => format!(
            "bodies {}: nothing holds them together in their {motion}, which changes no gap, and loads work on it ({} of what \
             forces of their sizes could): add a support, or balance the loads",
            in_words(bodies.iter().map(name)),
            sci(*work, 1)
        ),
        Status::Unbounded { moving } => {
            let part = |free: &Moved| format!("{} of `{}`", free.name, name(&free.body));
            let what = match &moving[..] {
                [] => "a motion of a body".to_owned(),
                all => all.iter().map(part).collect::<Vec<_>>().join(" and "),
            };
            format!(
                "unbounded: no support or contact resists {what}, and the loads push that way; add a support, or turn the load"
            )
        }
        Status::InnerSolver(failure) => {
            let reason = if failure.reason.is_empty() { "its rank knows more" } else { &failure.reason };
            let whose = failure.body.map_or("all bodies".to_owned(), |body| format!("body `{}`", name(&body)));
            format!("{whose}: the inner solver failed in iteration {k}: {reason}")
        }
        Status::Inaccurate(found) => inaccurate(found, model),
        Status::Paused { asked } => {
            let what = match asking::signal_name(*asked) {
                "" => "snapshot".to_owned(),
                name => format!("interrupted by {name}"),
            };
            format!("{what} after {k} iterations, {} {}", measure(outcome), sci(residual, 1))
        }
    }
}

/// What the last look found, in words.
fn inaccurate(Inaccuracy { told, found, whose }: &Inaccuracy, model: &Model) -> String {
    let what = match whose {
        Whose::Body(body) => format!("body `{}`: its forces, summed anew, lack balance", model.bodies[*body].name),
        Whose::Pair(pair) => {
            let [a, b] = model.pairs[*pair].bodies.map(|body| &model.bodies[body].name);
            format!("`{a}` - `{b}`: pressures are not those of the layer at the compressions of the bodies")
        }
        Whose::Rounding => {
            return format!(
                "few digits are left for the pressures, which rounding may change by {} of their peak: take softer layers, begin with a smaller \
                 gap, or let supports move bodies less",
                sci(*found, 1)
            );
        }
    };
    format!(
        "{what}: the relative error is {} at least, where the run saw {}: leave options of the inner solver (-ksp_..., -pc_..., -mat_...) and \
         method.robin at their defaults, or take another solver (--set solver=mumps)",
        sci(*found, 1),
        sci(*told, 1)
    )
}

/// What the number is by which a run ends.
fn measure(outcome: &Outcome) -> &'static str {
    if outcome.method.starts_with("newton") { "largest relative error" } else { "residual" }
}

/// What more iterations would bring, for the report.
pub fn forecast(outcome: &Outcome) -> Option<ForecastReport> {
    let goes_on = matches!(
        outcome.status,
        Status::Converged | Status::RoundoffLimited | Status::IterationLimit | Status::Cycle { .. }
    );
    let forecast = outcome.forecast.as_ref().filter(|_| goes_on)?;
    Some(ForecastReport {
        factor: forecast.factor,
        iterations: Some(forecast.iterations).filter(|iterations| iterations.is_finite()),
        best_gamma: outcome.spectrum.map(best_gamma),
        best_factor: outcome.spectrum.map(best_factor),
    })
}

/// The iterations left in words, to follow the advice to allow more.
fn outlook(outcome: &Outcome) -> String {
    match forecast(outcome).map(|forecast| forecast.iterations) {
        None => String::new(),
        Some(Some(0.0)) => "; that is enough, but pressures still move or a body lacks balance".to_owned(),
        Some(None) => "; at this rate no number is enough".to_owned(),
        Some(Some(more)) => format!("; about {more} more at this rate"),
    }
}

/// What helps the paper's iteration where the spectrum is known.
fn advice(outcome: &Outcome) -> Option<String> {
    let spectrum = outcome.spectrum.filter(|_| outcome.method == "robin")?;
    let (gamma, factor) = (best_gamma(spectrum), best_factor(spectrum));
    // near one the digits that matter are those of the difference
    let factor = if factor > 0.99 { format!("1 - {}", sci(1.0 - factor, 1)) } else { format!("{factor:.3}") };
    Some(format!("--method auto; the best number for method.gamma is {gamma:.2}, a factor of {factor} an iteration"))
}

/// Whether a load step has found its solution.
pub fn is_solved(step: &StepReport) -> bool {
    [Status::Converged, Status::RoundoffLimited].iter().any(|status| step.status == status_name(status))
}

/// Warnings of the steps before the last one that were not solved.
pub fn of_steps(steps: &[StepReport]) -> Vec<String> {
    let before = steps.iter().take(steps.len().saturating_sub(1)).enumerate();
    let bad = before.filter(|(_, step)| !is_solved(step));
    let told = |(i, step): (usize, &StepReport)| {
        let factors: Vec<String> = step.factors.iter().map(|(name, factor)| format!("{name} {factor}")).collect();
        format!("load step {} ({}): {}", i + 1, factors.join(", "), step.message)
    };
    bad.map(told).collect()
}
