//! Outcome -> report, contact tables and plots.

use super::asking;
use super::balance;
use super::clock::Clock;
use super::preflight;
use super::prepared::{Prepared, sides};
use super::results;
use super::steps;
use super::verdict::{forecast, message, status_name};
use crate::contact::ContactPair;
use crate::ddm::{Outcome, Status};
use crate::discretize::Problem;
use crate::error::Kind;
use crate::estimate::Estimate;
use crate::model::BodyCounts;
use crate::output::plot::{ConvergenceSeries, PressureSeries};
use crate::output::vtu::Grid;
use crate::output::{BodyReport, ContactTable, EstimateReport, InnerTimes, IntervalReport, PairReport, Report};
use crate::petsc::Session;
use crate::scene::Scene;

/// Exit code of a run that ended like this.
pub fn exit_code(prepared: &Prepared, outcome: &Outcome) -> i32 {
    match outcome.status {
        Status::Converged | Status::RoundoffLimited if steps::warnings(&prepared.steps).is_empty() => 0,
        Status::Paused { asked } => asking::signal(asked).map_or(1, |signal| Kind::Stopped(signal).exit_code()),
        _ => 1,
    }
}

/// Fills the report of a run.
pub fn report(
    session: &Session,
    scene: &Scene,
    prepared: &Prepared,
    outcome: &Outcome,
    recovered: &results::All,
    clock: &Clock,
) -> Report {
    let model = &prepared.problem.model;
    let shared = Shared::gather(prepared);
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
        error_estimate: finite(last.filter(|row| !row.is_bound).map(|row| row.error)),
        factorizations: counts.factorizations + joint.factorizations,
        inner_times: InnerTimes {
            factor: counts.factor_seconds + joint.factor_seconds,
            first: counts.first_seconds,
            solve: counts.solve_seconds + joint.solve_seconds,
        },
        symbolic_factorizations: counts.symbolic + joint.symbolic,
        body_solves: counts.solves,
        inner_iterations: counts.inner_iterations + joint.inner_iterations,
        robin_updates: counts.robin_updates,
        robin_updates_skipped: counts.robin_skipped,
        dense_factorizations: counts.dense_factorizations + joint.dense_factorizations,
        assemblies: shared.assemblies,
        assemblies_avoided: shared.assemblies_avoided,
        factorizations_avoided: counts.factorizations_avoided,
        body_solves_skipped: outcome.solves_skipped,
        messages: model.exchange.messages(),
        steps: prepared.steps.clone(),
        residual: finite(last.map(|row| row.residual)),
        increment: finite(last.map(|row| row.increment)),
        f1: finite(last.map(|row| row.energy)),
        pairs: (0..model.pairs.len()).map(|i| pair_report(scene, prepared, outcome, i)).collect(),
        ..headline(session, scene, prepared, &shared.solvers, clock)
    };
    report.warnings.extend(steps::warnings(&prepared.steps));
    results::fill(prepared, recovered, &mut report.bodies);
    let balances = balance::gather(scene, prepared, outcome, recovered);
    report.bodies.iter_mut().zip(balances).for_each(|(body, balance)| body.balance = balance);
    report
}

/// The part of the report that is known before the first sweep; `solvers` are the inner solvers in words.
pub fn headline(session: &Session, scene: &Scene, prepared: &Prepared, solvers: &[String], clock: &Clock) -> Report {
    let bodies = &prepared.problem.bodies;
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
                dofs: info.dofs,
                solver: solver.clone(),
                rank: info.rank,
                ..BodyReport::default()
            })
            .collect(),
        times: clock.times.clone(),
        warnings: prepared.warnings.clone(),
        settings: scene.settings(),
        ..Report::default()
    }
}

/// What only the owner of a body knows: counts over all bodies and the inner solver of each in words. One message.
pub struct Shared {
    counts: BodyCounts,
    assemblies: usize,
    assemblies_avoided: usize,
    /// Inner solver of each body.
    pub solvers: Vec<String>,
}

/// Inner solvers in words: once if all bodies have the same.
pub fn solvers_in_words(solvers: &[String]) -> String {
    match solvers {
        [first, rest @ ..] if rest.iter().all(|other| other == first) => first.clone(),
        all => all.join(", "),
    }
}

/// Numbers before the words about the solvers.
const HEAD: usize = 13;

/// Most bytes of the words about a solver.
const WORDS: usize = 64;

impl Shared {
    /// Collects it on every rank; collective.
    pub fn gather(prepared: &Prepared) -> Self {
        let model = &prepared.problem.model;
        let mut message = vec![0.0; HEAD + WORDS * model.bodies.len()];
        message[6] = prepared.problem.assemblies as f64;
        message[10] = prepared.problem.assemblies_avoided as f64;
        for (index, slot) in model.bodies.iter().enumerate() {
            let Some(body) = &slot.local else { continue };
            let counts = body.counts();
            let mine = [
                counts.factorizations,
                counts.symbolic,
                counts.solves,
                counts.inner_iterations,
                counts.robin_updates,
                counts.robin_skipped,
            ];
            message.iter_mut().zip(mine).for_each(|(sum, count)| *sum += count as f64);
            message[7] += counts.factor_seconds;
            message[8] += counts.solve_seconds;
            message[9] += counts.dense_factorizations as f64;
            message[11] += counts.factorizations_avoided as f64;
            message[12] += counts.first_seconds;
            let place = &mut message[HEAD + WORDS * index..];
            place
                .iter_mut()
                .zip(body.describe().bytes().take(WORDS))
                .for_each(|(place, byte)| *place = f64::from(byte));
        }
        model.exchange.sum(&mut message);
        let count = |i: usize| message[i] as usize;
        let words =
            |bytes: &[f64]| bytes.iter().take_while(|&&byte| byte != 0.0).map(|&byte| char::from(byte as u8)).collect();
        Self {
            counts: BodyCounts {
                factorizations: count(0),
                symbolic: count(1),
                solves: count(2),
                inner_iterations: count(3),
                robin_updates: count(4),
                robin_skipped: count(5),
                factor_seconds: message[7],
                solve_seconds: message[8],
                dense_factorizations: count(9),
                factorizations_avoided: count(11),
                first_seconds: message[12],
            },
            assemblies: count(6),
            assemblies_avoided: count(10),
            solvers: message[HEAD..].chunks_exact(WORDS).map(words).collect(),
        }
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

fn pair_report(scene: &Scene, prepared: &Prepared, outcome: &Outcome, i: usize) -> PairReport {
    let model = &prepared.problem.model;
    let (pair, layer, range) = (&model.pairs[i], &outcome.layer, model.range(i));
    let (c, p, force) = (&layer.compression[range.clone()], &layer.pressure[range.clone()], &layer.force[range]);
    let length = |is: fn(f64) -> bool| (0..pair.len()).filter(|&q| is(c[q])).fold(0.0, |sum, q| sum + pair.weight[q]);
    let sum = |rows: &[[f64; 3]]| -> [f64; 3] {
        std::array::from_fn(|k| (0..pair.len()).fold(0.0, |sum, q| sum - force[q] * rows[q][k]))
    };
    let sides = sides(prepared, i);
    let coupling = preflight::coupling(scene, prepared, i);
    let peak = (0..pair.len()).max_by(|&q, &r| p[q].total_cmp(&p[r])).unwrap_or(0);
    PairReport {
        surfaces: prepared.problem.contacts[i].spec.between.each_ref().map(|name| name.value.clone()),
        bodies: sides.map(|side| model.bodies[pair.bodies[side]].name.clone()),
        points: pair.len(),
        carrier: pair.surfaces[0].clone(),
        theta: sides.map(|side| coupling.theta[side]),
        facets_uncovered: pair.uncovered(),
        layer_energy: layer.energy[i],
        force: sides.map(|side| sum(&pair.resultant[side])),
        moment: sides.map(|side| sum(&pair.moment[side])),
        peak_pressure: p[peak],
        peak_at: pair.position[peak],
        contact_length: length(|c| c > 0.0),
        open_length: length(|c| c < 0.0),
        contact_ends: if pair.along_curve { ends(pair, c) } else { Vec::new() },
    }
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
pub fn contact_table(prepared: &Prepared, outcome: &Outcome, estimate: Option<&Estimate>, i: usize) -> ContactTable {
    let model = &prepared.problem.model;
    let (pair, range, points) = (&model.pairs[i], model.range(i), model.points());
    let sides = sides(prepared, i);
    let displacement = |side: usize| -> Vec<f64> {
        let trace = &outcome.iterate.trace[side * points + range.start..side * points + range.end];
        trace.iter().zip(&pair.prescribed[side]).map(|(free, known)| free + known).collect()
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
pub fn contact_surface(name: &str, prepared: &Prepared, outcome: &Outcome, i: usize) -> Grid {
    let model = &prepared.problem.model;
    let (pair, range) = (&model.pairs[i], model.range(i));
    prepared.problem.contacts[i].surface.grid(
        name.to_owned(),
        &[
            ("gap", 1, pair.gap.clone()),
            ("compression", 1, outcome.layer.compression[range.clone()].to_vec()),
            ("pressure", 1, outcome.layer.pressure[range].to_vec()),
            ("normal", 3, pair.normal.as_flattened().to_vec()),
            (pair.measure, 1, pair.weight.clone()),
        ],
    )
}

/// Residual and increment of a run against the iteration.
pub fn convergence(label: &str, outcome: &Outcome) -> ConvergenceSeries {
    let rows = outcome.rows.iter().map(|row| (row.iteration, row.residual, row.increment)).collect();
    ConvergenceSeries { label: label.to_owned(), rows }
}

/// Pressure of pair `i` along its surface (the coordinate that varies most), and the scene's reference for it.
pub fn pressure(label: &str, prepared: &Prepared, outcome: &Outcome, i: usize) -> PressureSeries {
    let model = &prepared.problem.model;
    let (axis, _) = main_axis(&model.pairs[i]);
    PressureSeries {
        label: label.to_owned(),
        s: model.pairs[i].position.iter().map(|x| x[axis]).collect(),
        p: outcome.layer.pressure[model.range(i)].to_vec(),
        dashed: false,
    }
}

/// The scene's reference pressure of pair `i`, drawn dashed.
pub fn reference(problem: &Problem, i: usize) -> Option<PressureSeries> {
    let field = problem.contacts[i].spec.reference.as_ref()?;
    let (axis, _) = main_axis(&problem.model.pairs[i]);
    let position = &problem.model.pairs[i].position;
    Some(PressureSeries {
        label: "reference".to_owned(),
        s: position.iter().map(|x| x[axis]).collect(),
        p: position.iter().map(|&x| field.eval(x)).collect(),
        dashed: true,
    })
}

/// The coordinate along which a pair's points spread most, and its name.
pub fn main_axis(pair: &ContactPair) -> (usize, &'static str) {
    let spread = |k: usize| {
        let values = pair.position.iter().map(|x| x[k]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    let axis = (0..3).max_by(|&i, &j| spread(i).total_cmp(&spread(j)).then(j.cmp(&i))).unwrap_or(0);
    (axis, ["x", "y", "z"][axis])
}
