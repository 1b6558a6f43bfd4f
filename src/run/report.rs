//! The report and the contact tables of a run, from its outcome.

use super::stages::{All, Built, Clock, Done};
use super::verdict::{self, message};
use super::{extent, results, warnings};
use crate::ddm::{Outcome, Row, Status};
use crate::discretize::{BodyInfo, Discrete};
use crate::error::Result;
use crate::error::few;
use crate::estimate::Estimate;
use crate::exchange::{all_gather, gather};
use crate::linalg::axpy;
use crate::model::{Body, BodyCounts, Model};
use crate::output::{
    BodyReport, ContactTable, EstimateReport, FieldArray, InnerTimes, IntervalReport, PairEstimate, PairReport, Report,
    RunStatus, UnstructuredGrid,
};
use crate::petsc::Session;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Return the report of a run. Collective.
pub fn report(session: &Session, done: &Done, recovered: &All, estimate: Option<&Estimate>, clock: &Clock) -> Report {
    let (discrete, model, outcome) = (&done.built.discrete, done.model(), &done.outcome);
    let shared = GatheredCounters::gather(discrete);
    let mut report = headline(session, &done.built, &shared.solvers, clock);
    add_outcome(&mut report, outcome, model);
    if let Some((status, message)) = verdict::worst_step(&done.steps) {
        (report.status, report.message) = (status, message);
    }
    add_counters(&mut report, &shared, outcome);
    report.messages = model.exchange.messages();
    report.memory_of_ranks = all_gather(&*model.exchange, clock.memory.clone());
    report.steps = done.steps.clone();
    report.warnings.extend(done.warnings.iter().cloned().chain(verdict::step_warnings(done)));
    let too_large = results::fill(discrete, recovered, &mut report.bodies);
    report.warnings.extend(too_large);
    for i in 0..model.pairs.len() {
        report.warnings.extend(warnings::beyond_law(done, i).into_iter().chain(warnings::by_chords(done, i)));
        report.warnings.extend(warnings::tilted(done, i).into_iter().chain(warnings::cut_short(done, i)));
        report.warnings.extend(warnings::steep_gap(done, i));
    }
    report.warnings.extend(warnings::nothing_touches(done));
    let approaches = results::approaches(done, recovered);
    let of_pair = |(i, approach)| pair_report(done, i, approach, estimate);
    report.pairs = approaches.into_iter().enumerate().map(of_pair).collect();
    report.discretization_error = estimate.map(discretization_error);
    let balances = results::balances(done, recovered);
    let digits = report.error_bound.or(report.error_estimate).unwrap_or(f64::INFINITY);
    for (body, (info, balance)) in discrete.bodies.iter().zip(&balances).enumerate() {
        if discrete.mechanisms.iter().any(|mechanism| mechanism.fixed == Some(body)) {
            report.warnings.extend(warnings::of_fixed(&info.name, balance, digits));
        }
    }
    report.bodies.iter_mut().zip(balances).for_each(|(body, balance)| body.balance = balance);
    report
}

/// Add the status and the results of the iteration.
fn add_outcome(report: &mut Report, outcome: &Outcome, model: &Model) {
    let last = outcome.rows.last();
    report.status = RunStatus::from(&outcome.status);
    report.message = message(outcome, model);
    report.method = outcome.method.to_owned();
    report.linear_step = outcome.linear_step.clone();
    report.gamma_interval = outcome.interval.map(|interval| IntervalReport {
        theorem: Some(interval.theorem()).filter(|&end| end > 0.0),
        descent: interval.descent(),
        lower: interval.lower,
        upper: interval.upper,
    });
    // the iterates of other runs are no approximations of a solution
    let is_inaccurate = outcome.status.is_inaccurate();
    let is_measured = matches!(outcome.status, Status::IterationLimit | Status::Stagnated | Status::Interrupted { .. })
        || is_inaccurate
        || outcome.status.is_solved();
    let measured = last.filter(|_| is_measured);
    // a relative error of one or more leaves no digit, and then the bound has none either
    let is_bound = |row: &&Row| row.is_bound && row.residual < 1.0 && !is_inaccurate;
    report.error_bound = measured.filter(is_bound).and_then(|row| finite(row.error));
    report.error_estimate = measured
        .filter(|row| !is_bound(row))
        .and_then(|row| finite(if row.is_bound { row.residual } else { row.error }))
        .map(|error| error.max(outcome.unbalanced));
    report.rounding = finite(outcome.rounding);
    report.unbalanced = finite(outcome.unbalanced);
    report.residual = last.and_then(|row| finite(row.residual));
    report.increment = last.and_then(|row| finite(row.increment));
    report.f1 = last.and_then(|row| finite(row.energy));
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

/// Add the counters of the iteration, of the bodies, and of the joint solver of all bodies.
fn add_counters(report: &mut Report, shared: &GatheredCounters, outcome: &Outcome) {
    let (counts, joint) = (&shared.counts, &outcome.joint);
    report.iterations = outcome.iterations;
    report.sweeps = outcome.sweeps;
    report.smoothed_steps = outcome.rows.last().map_or(0, |row| row.smoothed);
    report.body_solves = counts.solves;
    report.inner_iterations = counts.inner_iterations + joint.inner_iterations;
    report.factorizations = counts.factorizations + joint.factorizations;
    report.dense_factorizations = counts.dense_factorizations + joint.dense_factorizations;
    report.symbolic_factorizations = counts.symbolic + joint.symbolic;
    report.patches = counts.patches + joint.patches;
    report.robin_updates = counts.robin_updates;
    report.robin_updates_skipped = counts.robin_skipped;
    report.assemblies = shared.assemblies;
    report.condensations = counts.condensations;
    report.pairings = shared.pairings;
    report.inner_times = InnerTimes {
        factor: counts.factor_seconds + joint.factor_seconds,
        first: counts.first_seconds + joint.first_seconds,
        solve: counts.solve_seconds + joint.solve_seconds,
    };
}

/// Return the part of the report that is known before the first sweep. `solvers` are the inner solvers of the bodies in
/// words.
pub fn headline(session: &Session, built: &Built, solvers: &[String], clock: &Clock) -> Report {
    let Built { scene, discrete: Discrete { bodies, .. }, .. } = built;
    Report {
        winkler: env!("CARGO_PKG_VERSION").to_owned(),
        petsc: session.petsc_version(),
        blas: session.blas_name(),
        ranks: session.size(),
        title: scene.title.clone(),
        dofs: bodies.iter().map(|body| body.dofs).sum(),
        meshes_without_hxt: built.file.as_ref().map_or(0, |mesh| mesh.without_hxt.into()),
        bodies: bodies.iter().zip(solvers).map(|(info, solver)| body_report(info, solver)).collect(),
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

/// Return the report of a body without results.
fn body_report(info: &BodyInfo, solver: &str) -> BodyReport {
    BodyReport {
        name: info.name.clone(),
        nodes: info.nodes,
        cells: info.cells,
        inner_facets: info.facets.inner,
        boundary_facets: info.facets.outer,
        order: info.order.degree(),
        dofs: info.dofs,
        solver: solver.to_owned(),
        rank: info.rank,
        ..BodyReport::default()
    }
}

/// Return the options of solvers as they were typed, whatever their source.
fn petsc_options(session: &Session) -> Vec<String> {
    let option = |(name, value): (String, Option<String>)| match value {
        Some(value) => format!("{name} {value}"),
        None => name,
    };
    session.options().typed().into_iter().map(option).collect()
}

/// Data that only the owners of the bodies have, gathered on every rank: counters over all bodies, and their inner
/// solvers.
#[derive(Default, Serialize, Deserialize)]
pub struct GatheredCounters {
    /// Counters, summed over all bodies.
    pub counts: BodyCounts,
    assemblies: usize,
    pairings: usize,
    /// Inner solver of each body in words.
    pub solvers: Vec<String>,
}

/// Return the inner solvers of the bodies in words: each solver once, with the number of its bodies if it has several
/// but not all.
pub fn solvers_in_words(solvers: &[String]) -> String {
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for solver in solvers {
        match kinds.iter_mut().find(|(kind, _)| kind == solver) {
            Some((_, count)) => *count += 1,
            None => kinds.push((solver, 1)),
        }
    }
    let in_words = |&(solver, count): &(&str, usize)| match count {
        count if count == 1 || count == solvers.len() => solver.to_owned(),
        count => format!("{count} bodies {solver}"),
    };
    few(kinds.iter().map(in_words)).join(", ")
}

impl GatheredCounters {
    /// Gather the data on every rank. Collective.
    pub fn gather(discrete: &Discrete) -> Self {
        let &Discrete { assemblies, pairings, .. } = discrete;
        let mut mine = Self { assemblies, pairings, ..Self::default() };
        for slot in discrete.model.bodies.iter().filter(|slot| !slot.is_rigid) {
            let owned = slot.local.as_ref().filter(|body| body.dofs().leads());
            mine.solvers.push(owned.map_or_else(String::new, Body::describe));
            mine.counts += owned.map_or(BodyCounts::default(), |body| body.counts());
        }
        all_gather(&*discrete.model.exchange, mine).into_iter().reduce(Self::merged).unwrap_or_default()
    }

    fn merged(mut self, other: Self) -> Self {
        self.counts += other.counts;
        self.assemblies += other.assemblies;
        self.pairings += other.pairings;
        self.solvers.iter_mut().zip(other.solvers).for_each(|(mine, other)| mine.push_str(&other));
        self
    }
}

/// Return the estimate of the discretisation error for the report.
fn discretization_error(estimate: &Estimate) -> EstimateReport {
    let total: f64 = estimate.bodies.iter().chain(&estimate.layers).sum();
    let fraction = |error: &f64| if total > 0.0 { error / total } else { 0.0 };
    EstimateReport {
        energy: estimate.energy,
        nodal: estimate.nodal,
        displacement: estimate.displacement,
        pressure: estimate.pressure.clone(),
        force: estimate.force.clone(),
        bodies: estimate.bodies.iter().map(fraction).collect(),
    }
}

fn pair_report(done: &Done, i: usize, approach: Option<f64>, estimate: Option<&Estimate>) -> PairReport {
    let (discrete, model) = (&done.built.discrete, done.model());
    let pair = &model.pairs[i];
    PairReport {
        surfaces: discrete.specs[i].between.each_ref().map(|name| name.value.clone()),
        bodies: discrete.sides(i).map(|side| model.bodies[pair.bodies[side]].name.clone()),
        contact: discrete.specs[i].in_file(),
        points: pair.len(),
        carrier: pair.surfaces[0].clone(),
        facets_uncovered: pair.uncovered(),
        pieces_lost: pair.pieces_lost(),
        facets_averaged: pair.averaged(),
        result: results::pair(done, i, approach),
        estimate: estimate.map(|estimate| PairEstimate {
            pressure_estimate: estimate.pressure[i],
            force_estimate: estimate.force[i],
        }),
        table: None,
        plot: None,
    }
}

/// Return the contact table of pair `i`, with sides in the order of the scene.
pub fn contact_table(done: &Done, estimate: Option<&Estimate>, i: usize) -> ContactTable {
    let (model, outcome) = (done.model(), &done.outcome);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let sides = done.built.discrete.sides(i);
    let displacement = |side: usize| {
        let mut u = model.displacement(&outcome.iterate.trace, i, side);
        if side == 1 && !done.built.discrete.specs[i].obstacle {
            // the offset of a gap is no displacement
            axpy(-1.0, &model.rigid_closing(i, &outcome.iterate.rigid), &mut u);
        }
        u
    };
    ContactTable {
        side_names: sides.map(|side| model.bodies[pair.bodies[side]].name.clone()),
        points: pair.position.clone(),
        weight: pair.area.clone(),
        gap: pair.gap.clone(),
        is_slip: done.built.discrete.specs[i].slip.is_some(),
        compression: outcome.layer.compression[range.clone()].to_vec(),
        compression_max: if pair.law.has_memory() && !done.largest.is_empty() {
            done.largest[range.clone()].to_vec()
        } else {
            Vec::new()
        },
        pressure: outcome.layer.pressure[range.clone()].to_vec(),
        displacement: sides.map(displacement),
        pressure_error: estimate.map_or(Vec::new(), |estimate| estimate.pressure_error[range].to_vec()),
        face: if pair.face.iter().any(|&face| face > 1) {
            pair.face.iter().map(|&face| face as f64).collect()
        } else {
            Vec::new()
        },
    }
}

/// Return the displacement at the points of the surface of each pair, on the first rank, and none on the others. The
/// points of a distributed body are known by their coordinates; NaN where the displacement of the body is not known.
/// Collective.
///
/// # Errors
/// A message that cannot be read.
pub fn surface_displacements(done: &Done, recovered: &All) -> Result<Vec<Vec<[f64; 3]>>> {
    let (discrete, model) = (&done.built.discrete, done.model());
    let surface = |i: usize| discrete.contacts[i].surface.points();
    let mut known: Vec<(usize, usize, [f64; 3])> = Vec::new();
    for (body, (info, recovered)) in discrete.bodies.iter().zip(recovered).enumerate() {
        let Some(Ok(recovered)) = recovered else { continue };
        let mut wanted: HashMap<[u64; 3], Vec<(usize, usize)>> = HashMap::new();
        for i in (0..model.pairs.len()).filter(|&i| model.pairs[i].bodies[0] == body) {
            let places = surface(i).iter().map(|x| x.map(f64::to_bits)).enumerate();
            places.for_each(|(point, place)| wanted.entry(place).or_default().push((i, point)));
        }
        let field = recovered.field(info);
        for (x, u) in field.points.iter().zip(&field.displacement) {
            let points = wanted.get(&x.map(f64::to_bits));
            known.extend(points.into_iter().flatten().map(|&(i, point)| (i, point, *u)));
        }
    }
    let all = gather(&*model.exchange, known)?;
    if all.is_empty() {
        return Ok(Vec::new());
    }
    let mut displacement: Vec<Vec<[f64; 3]>> =
        (0..model.pairs.len()).map(|i| vec![[f64::NAN; 3]; surface(i).len()]).collect();
    all.into_iter().flatten().for_each(|(i, point, u)| displacement[i][point] = u);
    Ok(displacement)
}

/// Return the surface of pair `i` with gap, compression, pressure, opening, normal (from side a to side b) and area
/// (length) of the points, for the shear of a bond slip, traction and its direction, and with the `displacement` of
/// side a.
pub fn contact_surface(name: &str, done: &Done, i: usize, displacement: &[[f64; 3]]) -> UnstructuredGrid {
    let (model, layer) = (done.model(), &done.outcome.layer);
    let (pair, range) = (&model.pairs[i], model.range(i));
    let [closing, force, along] = match done.built.discrete.specs[i].slip {
        Some(_) => ["slip", "traction", "tangent"],
        None => ["compression", "pressure", "normal"],
    };
    let mut grid = done.built.discrete.contacts[i].surface.grid(
        name.to_owned(),
        vec![
            FieldArray::new("gap", 1, pair.gap.clone()),
            FieldArray::new(closing, 1, layer.compression[range.clone()].to_vec()),
            FieldArray::new(force, 1, layer.pressure[range].to_vec()),
            FieldArray::new("opening", 1, extent::opening(done, i)),
            FieldArray::new(along, 3, pair.normal.as_flattened().to_vec()),
            FieldArray::new(pair.measure.name(), 1, pair.area.clone()),
        ],
    );
    grid.at_points.push(FieldArray::new("displacement", 3, displacement.as_flattened().to_vec()));
    grid
}
