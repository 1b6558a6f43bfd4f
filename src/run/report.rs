//! Outcome -> report and contact tables.

use super::clock::Clock;
use super::ended::{All, Look};
use super::stages::{Built, Done};
use super::verdict::{self, forecast, message, status_name};
use super::{asking, balance, beyond, measure, preflight, results};
use crate::contact::{ContactPair, Left};
use crate::ddm::{Reached, Status, Whose};
use crate::discretize::Discrete;
use crate::error::{Kind, few};
use crate::estimate::Estimate;
use crate::exchange::share;
use crate::model::{BodyCounts, Model};
use crate::output::{
    BodyReport, ContactTable, EstimateReport, Extent, Grid, InnerTimes, IntervalReport, LISTED, LookReport, PairReport,
    PairRow, Report, sci,
};
use crate::petsc::Session;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Exit code of a run that ended like this.
pub fn exit_code(done: &Done) -> i32 {
    match done.outcome.status {
        Status::Converged | Status::RoundoffLimited if verdict::of_steps(&done.steps).is_empty() => 0,
        Status::Paused { asked } => asking::signal(asked).map_or(1, |signal| Kind::Stopped(signal).exit_code()),
        _ => 1,
    }
}

/// Fills the report of a run.
pub fn report(session: &Session, done: &Done, recovered: &All, clock: &Clock) -> Report {
    let (discrete, model, outcome) = (&done.built.discrete, done.model(), &done.outcome);
    let shared = Shared::gather(discrete);
    let counts = &shared.counts;
    let joint = &outcome.joint;
    let last = outcome.rows.last();
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    let mut report = Report {
        status: status_name(&outcome.status).to_owned(),
        message: message(outcome, model),
        iterations: outcome.iterations,
        sweeps: outcome.sweeps,
        method: outcome.method.to_owned(),
        spectrum: outcome.spectrum.map(|(low, high)| [low, high]),
        forecast: forecast(outcome),
        gamma_interval: outcome.interval.map(|interval| IntervalReport {
            theorem: Some(interval.theorem()).filter(|&end| end > 0.0),
            descent: interval.descent(),
            lower: interval.lower,
            upper: interval.upper,
        }),
        error_bound: finite(last.filter(|row| row.is_bound).map(|row| row.error)),
        rounding: finite(Some(outcome.rounding)),
        error_estimate: finite(last.filter(|row| !row.is_bound).map(|row| row.error)),
        factorizations: counts.factorizations + joint.factorizations,
        inner_times: InnerTimes {
            factor: counts.factor_seconds + joint.factor_seconds,
            first: counts.first_seconds + joint.first_seconds,
            solve: counts.solve_seconds + joint.solve_seconds,
        },
        linear_step: outcome.linear_step.clone(),
        patches: counts.patches + joint.patches,
        symbolic_factorizations: counts.symbolic + joint.symbolic,
        body_solves: counts.solves,
        inner_iterations: counts.inner_iterations + joint.inner_iterations,
        smoothed_steps: last.map_or(0, |row| row.smoothed),
        robin_updates: counts.robin_updates,
        robin_updates_skipped: counts.robin_skipped,
        dense_factorizations: counts.dense_factorizations + joint.dense_factorizations,
        assemblies: shared.assemblies,
        assemblies_avoided: shared.assemblies_avoided,
        
        factorizations_avoided: counts.factorizations_avoided,
        body_solves_skipped: outcome.solves_skipped,
        messages: model.exchange.messages(),
        memory_of_ranks: share(&*model.exchange, clock.memory.clone()),
        steps: done.steps.clone(),
        residual: finite(last.map(|row| row.residual)),
        increment: finite(last.map(|row| row.increment)),
        f1: finite(last.map(|row| row.energy)),
        ..headline(session, &done.built, &shared.solvers, clock)
    };
    if let Some(look) = &done.look {
        add_look(&mut report, look_report(look, discrete, model), &outcome.status);
    }
    report.warnings.extend(done.warnings.iter().cloned().chain(verdict::of_steps(&done.steps)));
    let too_large = results::fill(discrete, recovered, &mut report.bodies);
    report.warnings.extend(too_large.into_iter().chain(beyond::warnings(done)));
    let approaches = measure::approaches(done, recovered);
    report.pairs = approaches.into_iter().enumerate().map(|(i, approach)| pair_report(done, i, approach)).collect();
    let balances = balance::gather(done, recovered);
    report.bodies.iter_mut().zip(balances).for_each(|(body, balance)| body.balance = balance);
    if let Some(message) = lost(done) {
        tell_lost(&mut report, message, &outcome.status);
    }
    report
}

/// Adds the last look at a result. What the iteration did not see is no bound, and no less than what was found.
fn add_look(report: &mut Report, found: LookReport, status: &Status) {
    let error = [report.error_bound, report.error_estimate].into_iter().flatten().next();
    let is_more = |found: f64| error.map_or(matches!(status, Status::Inaccurate(_)), |error| found > error);
    if found.error.is_some_and(is_more) {
        (report.error_bound, report.error_estimate) = (None, found.error);
    }
    report.last_look = Some(found);
}

/// Tells that displacements leave few digits for the pressures.
fn tell_lost(report: &mut Report, message: String, status: &Status) {
    match status {
        Status::Converged | Status::RoundoffLimited => {
            (report.status, report.message) = (status_name(&Status::RoundoffLimited).to_owned(), message);
        }
        Status::IterationLimit | Status::Cycle { .. } => {
            report.message = format!("not converged in {} iterations: {message}", report.iterations);
        }
        _ => {}
    }
}

/// The last look for the report.
fn look_report(look: &Look, discrete: &Discrete, model: &Model) -> LookReport {
    let finite = |value: f64| value.is_finite().then_some(value);
    let at = match look.whose {
        Whose::Body(body) => vec![body],
        Whose::Pair(pair) => model.pairs[pair].bodies.to_vec(),
        Whose::Rounding => Vec::new(),
    };
    let Reached { error, pressure, imbalance, .. } = look.reached;
    LookReport {
        error: finite(error),
        pressure: finite(pressure),
        imbalance: finite(imbalance),
        at: at.into_iter().map(|body| model.bodies[body].name.clone()).collect(),
        cells: discrete.bodies.iter().map(|body| body.cells).sum(),
        seconds: look.seconds,
    }
}

/// What displacements that are far larger than the deformations have cost the pressures, in words: more than ten times what the run or its
/// inner solvers were asked for.
fn lost(done: &Done) -> Option<String> {
    let stop = &done.built.scene.method.stop;
    let reached = done.outcome.rows.last().map(|row| row.error).filter(|error| stop.balanced && error.is_finite());
    let asked = [stop.residual, stop.increment, reached].into_iter().flatten().fold(INNER, f64::max);
    let pressure = done.outcome.rounding;
    (pressure > 10.0 * asked).then(|| {
        format!(
            "the displacements are so large beside what compresses the layers that few digits are left for the pressures, which may be off \
             by {} of their peak: begin with a smaller gap, let supports move bodies less, or take softer layers",
            sci(pressure, 1)
        )
    })
}

/// Relative tolerance of an inner solver by default.
const INNER: f64 = 1e-6;

/// The part of the report that is known before the first sweep; `solvers` are the inner solvers in words.
pub fn headline(session: &Session, built: &Built, solvers: &[String], clock: &Clock) -> Report {
    let Built { scene, discrete: Discrete { bodies, .. }, .. } = built;
    Report {
        winkler: env!("CARGO_PKG_VERSION").to_owned(),
        petsc: session.petsc_version(),
        blas: session.blas_name(),
        ranks: session.size(),
        title: scene.title.clone(),
        dofs: bodies.iter().map(|body| body.dofs).sum(),
        bodies: bodies
            .iter()
            .zip(solvers)
            .map(|(info, solver)| BodyReport {
                name: info.name.clone(),
                nodes: info.nodes,
                cells: info.cells,
                inner_facets: info.facets.inner,
                boundary_facets: info.facets.outer,
                parts: info.facets.parts.count,
                dofs: info.dofs,
                solver: solver.clone(),
                rank: info.rank,
                ..BodyReport::default()
            })
            .collect(),
        times: clock.times.clone(),
        memory: clock.memory.clone(),
        command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
        directory: std::env::current_dir().map_or(String::new(), |path| path.display().to_string()),
        petsc_options: petsc_options(session),
        warnings: built.warnings.clone(),
        settings: scene.settings(),
        ..Report::default()
    }
}

/// PETSc options as they are typed, from wherever they come; those that PETSc cannot list are no reason to stop.
fn petsc_options(session: &Session) -> Vec<String> {
    let option = |(name, value): (String, Option<String>)| match value {
        Some(value) => format!("{name} {value}"),
        None => name,
    };
    session.options().all().unwrap_or_default().into_iter().map(option).collect()
}

/// What only the owner of a body knows: counts over all bodies and the inner solver of each in words.
#[derive(Default, Serialize, Deserialize)]
pub struct Shared {
    /// What the bodies did, all together.
    pub counts: BodyCounts,
    assemblies: usize,
    assemblies_avoided: usize,
    /// Inner solver of each body.
    pub solvers: Vec<String>,
}

/// Inner solvers in words: once if all bodies have the same, of many bodies each kind with the number of those that have it.
pub fn solvers_in_words(solvers: &[String]) -> String {
    match solvers {
        [first, rest @ ..] if rest.iter().all(|other| other == first) => first.clone(),
        all if all.len() <= LISTED => all.join(", "),
        all => {
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            all.iter().for_each(|solver| *counts.entry(solver).or_default() += 1);
            let mut kinds: Vec<(&str, usize)> = counts.into_iter().collect();
            kinds.sort_by_key(|kind| std::cmp::Reverse(kind.1));
            few(kinds.iter().map(|(solver, count)| format!("{count} bodies {solver}"))).join(", ")
        }
    }
}

impl Shared {
    /// Collects it on every rank; collective.
    pub fn gather(discrete: &Discrete) -> Self {
        let &Discrete { assemblies, assemblies_avoided, .. } = discrete;
        let mut mine = Self { assemblies, assemblies_avoided, ..Self::default() };
        for slot in &discrete.model.bodies {
            let leader = slot.local.as_ref().filter(|body| body.leads());
            mine.solvers.push(leader.map_or(String::new(), |body| body.describe()));
            mine.counts += leader.map_or(BodyCounts::default(), |body| body.counts());
        }
        share(&*discrete.model.exchange, mine).into_iter().reduce(Self::with).unwrap_or_default()
    }

    /// With what another rank knows.
    fn with(mut self, other: Self) -> Self {
        self.counts += other.counts;
        self.assemblies += other.assemblies;
        self.assemblies_avoided += other.assemblies_avoided;
        self.solvers.iter_mut().zip(other.solvers).for_each(|(mine, other)| mine.push_str(&other));
        self
    }
}

/// The estimate of the error for the report.
pub fn discretization_error(estimate: &Estimate) -> EstimateReport {
    let all: f64 = estimate.bodies.iter().chain(&estimate.layers).sum();
    let share = |error: &f64| if all > 0.0 { error / all } else { 0.0 };
    EstimateReport {
        energy: estimate.energy,
        nodal: estimate.nodal,
        displacement: estimate.displacement,
        pressure: estimate.pressure.clone(),
        bodies: estimate.bodies.iter().map(share).collect(),
    }
}

fn pair_report(done: &Done, i: usize, approach: Option<f64>) -> PairReport {
    let (discrete, model, layer) = (&done.built.discrete, done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let (c, p, force) = (&layer.compression[range.clone()], &layer.pressure[range.clone()], &layer.force[range]);
    let sides = discrete.sides(i);
    let coupling = preflight::coupling(&done.built, i);
    let peak = (0..pair.len()).max_by(|&q, &r| p[q].total_cmp(&p[r])).unwrap_or(0);
    PairReport {
        surfaces: discrete.contacts[i].spec.between.each_ref().map(|name| name.value.clone()),
        bodies: sides.map(|side| model.bodies[pair.bodies[side]].name.clone()),
        contact: discrete.contacts[i].spec.table,
        points: pair.len(),
        carrier: pair.surfaces[0].clone(),
        theta: sides.map(|side| coupling.theta[side]),
        facets_uncovered: pair.uncovered(),
        facets_steep: pair.left(Left::Steep),
        facets_far: pair.left(Left::Far),
        pieces_lost: pair.lost.map_or(0, |lost| lost.pieces),
        facets_averaged: pair.averaged(),
        layer_energy: layer.energy[i],
        force: sides.map(|side| measure::resultant(force, &pair.resultant[side])),
        moment: sides.map(|side| measure::resultant(force, &pair.moment[side])),
        approach,
        peak_pressure: p[peak],
        peak_at: pair.position[peak],
        peak_compression: measure::peak(c),
        extent: Extent::new(pair.measure, &pair.weight, c),
        contact_ends: if pair.along_curve { ends(pair, c) } else { Vec::new() },
    }
}

/// What `contacts.csv` says of pair `i` besides.
pub fn pair_row(done: &Done, i: usize) -> PairRow {
    let pair = &done.model().pairs[i];
    PairRow::new(&pair.weight, &pair.gap, &done.outcome.layer.compression[done.model().range(i)])
}

/// Where the compression changes sign between neighbouring points of a curve.
fn ends(pair: &ContactPair, c: &[f64]) -> Vec<[f64; 3]> {
    let mut ends = Vec::new();
    for q in 1..pair.len() {
        if c[q - 1] * c[q] < 0.0 {
            let s = c[q - 1] / (c[q - 1] - c[q]);
            ends.push(std::array::from_fn(|k| pair.position[q - 1][k] * (1.0 - s) + pair.position[q][k] * s));
        }
    }
    ends
}

/// The contact table of pair `i`, sides in the order of the scene.
pub fn contact_table(done: &Done, estimate: Option<&Estimate>, i: usize) -> ContactTable {
    let (model, outcome) = (done.model(), &done.outcome);
    let (pair, range, points) = (&model.pairs[i], model.range(i), model.points());
    let sides = done.built.discrete.sides(i);
    let displacement = |side: usize| -> Vec<f64> {
        let trace = &outcome.iterate.trace[side * points + range.start..side * points + range.end];
        trace.iter().zip(&pair.prescribed[side]).map(|(free, known)| free + done.share * known).collect()
    };
    ContactTable {
        side_names: sides.map(|side| model.bodies[pair.bodies[side]].name.clone()),
        points: pair.position.clone(),
        weight: pair.weight.clone(),
        gap: pair.gap.clone(),
        compression: outcome.layer.compression[range.clone()].to_vec(),
        pressure: outcome.layer.pressure[range.clone()].to_vec(),
        displacement: sides.map(displacement),
        pressure_error: estimate.map_or(Vec::new(), |estimate| estimate.pressure_error[range].to_vec()),
    }
}

/// Pair `i` on its surface: gap, compression, pressure, normal (from side a to side b) and area (length) of the points.
pub fn contact_surface(name: &str, done: &Done, i: usize) -> Grid {
    let (model, layer) = (done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    done.built.discrete.contacts[i].surface.grid(
        name.to_owned(),
        &[
            ("gap", 1, pair.gap.clone()),
            ("compression", 1, layer.compression[range.clone()].to_vec()),
            ("pressure", 1, layer.pressure[range].to_vec()),
            ("normal", 3, pair.normal.as_flattened().to_vec()),
            (pair.measure, 1, pair.weight.clone()),
        ],
    )
}
