//! One scene by one method, and what to think of the answer.

#![allow(dead_code)] // the example and the test each use their own part

use super::scenes::{Case, Expect};
use std::path::Path;
use winkler::api::Silent;
use winkler::api::load as load_scene;
use winkler::error::Result;
use winkler::internals::Interrupt;
use winkler::internals::run;
use winkler::internals::run::stages::{Begin, Clock};
use winkler::internals::run::{report, results};
use winkler::petsc::Session;

/// Relative residual that methods are asked for.
pub const RESIDUAL: f64 = 1e-8;
/// Relative residual of the reference.
const REFERENCE: f64 = 1e-11;
/// Pressures that differ by more, relative to the largest, are wrong, unless the reports say that rounding may change them by as much.
const TOLERANCE: f64 = 1e-7;

/// A method with the words that choose it in a scene.
#[derive(Debug, Clone)]
pub struct Recipe {
    /// Name in the table.
    pub name: String,
    /// `[method]` as a value of TOML; without braces, and without the stop rule.
    pub words: String,
    /// Most iterations; the program's own limit if none.
    pub limit: Option<usize>,
    /// The keys `start` and `steps`, if they are given.
    pub start: Option<String>,
    pub steps: Option<String>,
}

/// Every method, by the name in the table. `any` is robin with the scene's own gamma.
pub const NAMES: [&str; 7] = ["auto", "newton-robin", "newton", "line-search", "aitken", "0.6", "any"];

impl Recipe {
    /// The method of a name, for a scene.
    pub fn new(name: &str, case: &Case) -> Self {
        let robin = |gamma: String| (format!("name = \"robin\", robin = \"auto\", gamma = {gamma}"), Some(300));
        let (words, limit) = match name {
            "auto" => (String::new(), None),
            "newton-robin" | "newton" => (format!("name = \"{name}\""), Some(500)),
            "line-search" | "aitken" => robin(format!("\"{name}\"")),
            "any" => robin(format!("{}", case.gamma)),
            number => robin(number.to_owned()),
        };
        Self { name: name.to_owned(), words, limit, start: case.start.clone(), steps: case.steps.clone() }
    }

    /// The key `method` of the scene.
    pub fn value(&self, residual: f64) -> String {
        let mut parts = Vec::new();
        if !self.words.is_empty() {
            parts.push(self.words.clone());
        }
        let given = [("start", &self.start), ("steps", &self.steps)];
        parts.extend(given.iter().filter_map(|(key, value)| Some(format!("{key} = {}", value.as_ref()?))));
        let limit = self.limit.map_or(String::new(), |limit| format!(", iterations = {limit}"));
        parts.push(format!("stop = {{ residual = {residual:e}{limit} }}"));
        format!("{{ {} }}", parts.join(", "))
    }
}

/// What a run gave.
#[derive(Debug, Clone, Default)]
pub struct Answer {
    /// Name of the status; `refused` if the program refused the scene.
    pub status: String,
    /// The status in words.
    pub message: String,
    /// Relative residual at the end.
    pub residual: f64,
    /// What rounding may change in a pressure, relative to the largest, as the report says.
    pub rounding: f64,
    /// Updates.
    pub iterations: usize,
    /// Sweeps.
    pub sweeps: usize,
    /// Numeric factorisations.
    pub factorizations: usize,
    /// Seconds.
    pub seconds: f64,
    /// Contact pressure at all points.
    pub pressure: Vec<f64>,
    /// Force of every contact.
    pub force: Vec<f64>,
    /// Whether the run says that this is the solution.
    pub claims: bool,
    /// The iterates, one a line: error, closed points, energy.
    pub history: Vec<String>,
}

/// Runs a scene file by a method.
///
/// # Errors
/// Failures of the session that make further runs pointless; a refusal of the scene is an answer.
pub fn solve(session: &Session, path: &Path, recipe: &Recipe, residual: f64) -> Result<Answer> {
    let answer = attempt(session, path, recipe, residual);
    Ok(answer.unwrap_or_else(|error| Answer {
        status: "refused".to_owned(),
        message: error.message().to_owned(),
        residual: f64::NAN,
        ..Answer::default()
    }))
}

fn attempt(session: &Session, path: &Path, recipe: &Recipe, residual: f64) -> Result<Answer> {
    let (mut clock, interrupt) = (Clock::default(), Interrupt::default());
    let scene = load_scene(path, &[format!("method={}", recipe.value(residual))])?;
    let built = run::build(session, scene, &interrupt, &mut clock)?;
    let ready = run::set_up(session, built, Begin::default(), &mut clock)?;
    let done = run::iterate(ready, &interrupt, &mut Silent, &mut clock)?;
    let seconds = clock.total();
    let recovered = results::recover(&done);
    let report = report::report(session, &done, &recovered, None, &clock);
    let (model, outcome) = (&done.built.discrete.model, done.outcome);
    Ok(Answer {
        status: report.status.to_string(),
        message: report.message,
        residual: report.residual.unwrap_or(f64::NAN),
        rounding: report.rounding.unwrap_or(0.0),
        iterations: report.iterations,
        sweeps: report.sweeps,
        factorizations: report.factorizations,
        seconds,
        force: (0..model.pairs.len()).map(|i| model.range(i).map(|q| outcome.layer.force[q]).sum()).collect(),
        pressure: outcome.layer.pressure,
        claims: outcome.status.is_solved() && done.steps.iter().all(|step| step.status.is_solved()),
        history: outcome.rows.iter().map(|row| format!("{:.1e}/{}", row.residual, row.closed)).collect(),
    })
}

/// The reference of a scene: Newton with one factorisation of all bodies, to a small residual.
///
/// # Errors
/// As [`solve`].
pub fn reference(session: &Session, path: &Path, case: &Case) -> Result<Answer> {
    solve(session, path, &Recipe::new("newton", case), REFERENCE)
}

/// A scene by a method at the usual accuracy.
///
/// # Errors
/// As [`solve`].
pub fn by_method(session: &Session, path: &Path, recipe: &Recipe) -> Result<Answer> {
    solve(session, path, recipe, RESIDUAL)
}

/// What to think of an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The solution, and said so.
    Right,
    /// No solution, and the status names why.
    Named,
    /// The run ended without the solution, or as near as rounding lets it, which is not near.
    Failed,
    /// The run says that it has the solution, and it has not; the words say why.
    Wrong(String),
}

/// Judges an answer by the reference.
pub fn judge(case: &Case, reference: &Answer, answer: &Answer) -> Verdict {
    let named = ["underconstrained", "unbounded"].contains(&answer.status.as_str());
    if !answer.claims {
        let may = match case.expect {
            Expect::Solution => floats(case, reference),
            Expect::Gauge | Expect::Nothing => true,
        };
        return if named && may { Verdict::Named } else { Verdict::Failed };
    }
    if case.expect == Expect::Nothing {
        return Verdict::Wrong("there is no solution".to_owned());
    }
    // a run that says that rounding stops it makes no promise of accuracy
    let off_is = |why: String| if answer.status == "roundoff-limited" { Verdict::Failed } else { Verdict::Wrong(why) };
    if let Some(carried) = case.carried {
        let off = answer.force.iter().map(|force| (force - carried).abs() / carried).fold(0.0, f64::max);
        if carried > 0.0 && off > TOLERANCE {
            return off_is(format!("a contact carries a force that is {off:.1e} off"));
        }
    }
    let off = difference(case, reference, answer);
    let allowed = TOLERANCE.max(answer.rounding + reference.rounding);
    if reference.claims && (off.is_nan() || off > allowed) {
        return off_is(format!("pressure {off:.1e} off"));
    }
    Verdict::Right
}

/// Largest difference of pressures relative to the largest of the reference; if that has none, to what the loads could make.
pub fn difference(case: &Case, reference: &Answer, answer: &Answer) -> f64 {
    if reference.pressure.len() != answer.pressure.len() {
        return f64::NAN;
    }
    let pairs = reference.pressure.iter().zip(&answer.pressure);
    let apart = pairs.map(|(p, q)| (p - q).abs()).fold(0.0, |max, d| if d > max || d.is_nan() { d } else { max });
    let peak = peak(reference);
    apart / if peak > 0.0 { peak.max(1e-6 * case.pressure) } else { case.pressure }
}

/// Whether a body that contact alone holds touches nothing in the solution.
fn floats(case: &Case, reference: &Answer) -> bool {
    case.hanging && peak(reference) == 0.0
}

/// Largest pressure or tension.
pub fn peak(answer: &Answer) -> f64 {
    answer.pressure.iter().map(|p| p.abs()).fold(0.0, f64::max)
}
