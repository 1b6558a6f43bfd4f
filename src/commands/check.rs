//! `winkler check`: builds everything, solves nothing, says what is there.

use super::clock::Clock;
use super::prepared::Prepared;
use super::run;
use super::{load, preflight, report};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::output::{say, sci};
use crate::petsc::Session;
use crate::scene::Scene;
use serde_json::json;
use std::path::PathBuf;

/// Builds a scene's problem and prints bodies, dofs, surfaces, gaps and the rigid motions left to each body; returns the
/// exit code.
///
/// # Errors
/// Refusals of scene and mesh.
pub fn check(
    session: &Session,
    interrupt: &Interrupt,
    path: PathBuf,
    overrides: Vec<String>,
    as_json: bool,
) -> Result<i32> {
    let mut clock = Clock::default();
    let scene = load(session, &path, &overrides)?;
    let prepared = run::prepare(session, &scene, interrupt, &mut clock)?;
    clock.total();
    let shared = report::Shared::gather(&prepared);
    if session.rank() != 0 {
        return Ok(0);
    }
    if as_json {
        let mut value = json!(report::headline(session, &scene, &prepared, &shared.solvers, &clock));
        value["status"] = json!("checked");
        value["message"] = json!(prepared.choice);
        for (info, body) in prepared.problem.bodies.iter().zip(0..) {
            value["bodies"][body]["supported"] = json!(info.supported);
            value["bodies"][body]["rigid_motions"] = json!(info.left_by_supports);
            value["bodies"][body]["rigid_motions_unheld"] = json!(info.left_by_all);
        }
        value["pairs"] = pairs(&scene, &prepared);
        say(format_args!("{value:#}"))?;
    } else {
        print(&scene, &prepared, &report::solvers_in_words(&shared.solvers))?;
    }
    Ok(0)
}

fn pairs(scene: &Scene, prepared: &Prepared) -> serde_json::Value {
    let describe = |i: usize| {
        let pair = &prepared.problem.model.pairs[i];
        let (low, high) = gap_range(&pair.gap);
        let coupling = preflight::coupling(scene, prepared, i);
        json!({
            "surfaces": pair.surfaces,
            "carrier": pair.surfaces[0],
            "points": pair.len(),
            "length": pair.weight.iter().sum::<f64>(),
            "gap": [low, high],
            "facets_uncovered": pair.uncovered(),
            "mean_pressure": coupling.pressure,
            "theta": coupling.theta,
            "expected_sweeps": coupling.sweeps.iter().map(|(method, count)| json!({ "method": method, "sweeps": count })).collect::<Vec<_>>(),
        })
    };
    (0..prepared.problem.model.pairs.len()).map(describe).collect()
}

fn gap_range(gap: &[f64]) -> (f64, f64) {
    (gap.iter().copied().fold(f64::INFINITY, f64::min), gap.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn print(scene: &Scene, prepared: &Prepared, solvers: &str) -> Result<()> {
    say(&scene.title)?;
    for info in &prepared.problem.bodies {
        say(format_args!(
            "  body {}: {} cells, {} nodes, {} dofs, {} of them supported",
            info.name, info.cells, info.nodes, info.dofs, info.supported
        ))?;
        if !info.left_by_supports.is_empty() {
            say(format_args!("    rigid motions left to contact: {}", info.left_by_supports.join("; ")))?;
        }
        if !info.left_by_all.is_empty() {
            say(format_args!("    rigid motions that nothing can hold: {}", info.left_by_all.join("; ")))?;
        }
    }
    for (i, pair) in prepared.problem.model.pairs.iter().enumerate() {
        let (low, high) = gap_range(&pair.gap);
        say(format_args!(
            "  contact {} - {}: {} points on {}, {} {:.6}, gap {} to {}",
            pair.surfaces[0],
            pair.surfaces[1],
            pair.len(),
            pair.surfaces[0],
            pair.measure,
            pair.weight.iter().sum::<f64>(),
            sci(low, 3),
            sci(high, 3)
        ))?;
        let coupling = preflight::coupling(scene, prepared, i);
        say(format_args!(
            "    mean pressure {}, theta {:.3} and {:.3}; sweeps to expect for a residual of 1e-8: {}",
            sci(coupling.pressure, 3),
            coupling.theta[0],
            coupling.theta[1],
            coupling.sweeps.iter().map(|(method, count)| format!("{method} {count:.0}")).collect::<Vec<_>>().join(", ")
        ))?;
    }
    say(format_args!("  inner solver: {} ({})", solvers, prepared.choice))?;
    for warning in &prepared.warnings {
        say(format_args!("  warning: {warning}"))?;
    }
    Ok(())
}
