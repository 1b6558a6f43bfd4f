//! `winkler check`: builds everything, solves nothing, says what is there.

use super::clock::Clock;
use super::run;
use super::stages::Built;
use super::{load, preflight, report};
use crate::contact::Left;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::output::{say, sci};
use crate::petsc::Session;
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
    let built = run::build(session, scene, interrupt, &mut clock)?;
    clock.total();
    let shared = report::Shared::gather(&built.discrete);
    if session.rank() != 0 {
        return Ok(0);
    }
    if as_json {
        let mut value = json!(report::headline(session, &built, &shared.solvers, &clock));
        value["status"] = json!("checked");
        value["message"] = json!(built.choice);
        for (info, body) in built.discrete.bodies.iter().zip(0..) {
            value["bodies"][body]["supported"] = json!(info.supported);
            value["bodies"][body]["rigid_motions"] = json!(info.left_by_supports);
            value["bodies"][body]["rigid_motions_unconstrained"] = json!(info.left_by_all);
        }
        value["pairs"] = pairs(&built);
        say(format_args!("{value:#}"))?;
    } else {
        print(&built, &report::solvers_in_words(&shared.solvers))?;
    }
    Ok(0)
}

fn pairs(built: &Built) -> serde_json::Value {
    let describe = |i: usize| {
        let pair = &built.discrete.model.pairs[i];
        let (low, high) = gap_range(&pair.gap);
        let coupling = preflight::coupling(built, i);
        json!({
            "surfaces": pair.surfaces,
            "contact": built.discrete.contacts[i].spec.table,
            "carrier": pair.surfaces[0],
            "points": pair.len(),
            "length": pair.weight.iter().sum::<f64>(),
            "gap": [low, high],
            "facets_uncovered": pair.uncovered(),
            "facets_steep": pair.left(Left::Steep),
            "facets_far": pair.left(Left::Far),
            "facets_averaged": pair.averaged(),
            "mean_pressure": Some(coupling.pressure).filter(|&pressure| pressure > 0.0),
            "theta": coupling.theta,
            "expected_sweeps": coupling.sweeps.iter().filter(|_| coupling.pressure > 0.0).map(|(method, count)| json!({ "method": method, "sweeps": count })).collect::<Vec<_>>(),
        })
    };
    (0..built.discrete.model.pairs.len()).map(describe).collect()
}

fn gap_range(gap: &[f64]) -> (f64, f64) {
    (gap.iter().copied().fold(f64::INFINITY, f64::min), gap.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn print(built: &Built, solvers: &str) -> Result<()> {
    say(&built.scene.title)?;
    for info in &built.discrete.bodies {
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
    for (i, pair) in built.discrete.model.pairs.iter().enumerate() {
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
        let coupling = preflight::coupling(built, i);
        if coupling.pressure == 0.0 {
            say("    the loads push no body as a whole: pressure and sweeps cannot be estimated from them")?;
            continue;
        }
        let sweeps = coupling.sweeps.iter().map(|(method, count)| match count.is_finite() {
            true => format!("{method} {count:.0}"),
            false => format!("{method} no end in sight"),
        });
        say(format_args!(
            "    mean pressure {}, theta {:.3} and {:.3}; sweeps to expect for a residual of 1e-8: {}",
            sci(coupling.pressure, 3),
            coupling.theta[0],
            coupling.theta[1],
            sweeps.collect::<Vec<_>>().join(", ")
        ))?;
    }
    say(format_args!("  inner solver: {} ({})", solvers, built.choice))?;
    for warning in &built.warnings {
        say(format_args!("  warning: {warning}"))?;
    }
    Ok(())
}
