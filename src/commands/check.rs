//! `winkler check`: build the problem of a scene and print what it has, without solving it.

use super::{SceneArgs, clock_with_phases};
use crate::contact::ContactPair;
use crate::discretize::BodyInfo;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::linalg::range;
use crate::output::{LISTED, say, sci, warning_lines};
use crate::petsc::Session;
use crate::run::{self, Built, in_words, report};
use serde_json::{Value, json};
use std::rc::Rc;

/// The command line of `winkler check`.
#[derive(clap::Args)]
pub struct CheckArgs {
    #[command(flatten)]
    scene: SceneArgs,
}

/// Build a scene's problem, print it and return the exit code: that of `solve` if loads work on a motion that nothing
/// can hold.
///
/// Bodies, dofs, surfaces, gaps and the unconstrained rigid motions of each body are printed.
///
/// # Errors
/// Refusals of scene and mesh.
pub fn check(session: &Session, interrupt: &Interrupt, request: &CheckArgs) -> Result<i32> {
    let mut clock = clock_with_phases(session.rank() == 0 && !request.scene.json);
    let mut scene = request.scene.load(session)?;
    let settings = scene.settings();
    if scene.method.steps.is_table() {
        scene.method.steps = scene.method.steps.heaviest();
    }
    let built = run::build(session, Rc::new(scene), interrupt, &mut clock)?;
    // nothing is solved, so that no line may name a next phase
    clock.watch = None;
    clock.total();
    let shared = report::GatheredCounters::gather(&built.discrete);
    let exit = i32::from(built.discrete.model.mechanism.is_some());
    if session.rank() != 0 {
        return Ok(exit);
    }
    if request.scene.json {
        let headline = json!(report::headline(session, &built, &shared.solvers, &clock));
        say(format_args!("{:#}", to_json(&built, settings, headline)))?;
    } else {
        print(&built, &report::solvers_in_words(&shared.solvers))?;
    }
    Ok(exit)
}

/// Return all of `--json`: the headline of a report, with what is known before a solution.
fn to_json(built: &Built, settings: Value, headline: Value) -> Value {
    let mut value = headline;
    value["settings"] = settings;
    value["status"] = json!("checked");
    value["message"] = json!(built.choice);
    for (info, body) in built.discrete.bodies.iter().zip(0..) {
        value["bodies"][body]["supported"] = json!(info.supported);
        value["bodies"][body]["rigid_motions"] = json!(info.unconstrained);
        value["bodies"][body]["rigid_motions_unconstrained"] = json!(info.unresisted);
    }
    value["pairs"] = (0..built.discrete.model.pairs.len()).map(|i| pair_to_json(built, i)).collect();
    value
}

fn pair_to_json(built: &Built, i: usize) -> Value {
    let pair = &built.discrete.model.pairs[i];
    let [low, high] = range(pair.gap.iter().copied());
    json!({
        "surfaces": built.discrete.surfaces(i),
        "contact": built.discrete.specs[i].in_file(),
        "carrier": pair.surfaces[0],
        "points": pair.len(),
        "length": pair.area.iter().sum::<f64>(),
        "gap": [low, high],
        "facets_uncovered": pair.uncovered(),
        "pieces_lost": pair.pieces_lost(),
        "facets_averaged": pair.averaged(),
    })
}

/// Print the problem: every body and every pair, or sums where there are too many of them.
fn print(built: &Built, solvers: &str) -> Result<()> {
    say(&built.scene.title)?;
    let lines = match built.discrete.bodies.len() {
        ..=LISTED => each_body(built),
        _ => all_bodies(built),
    };
    let splits = built.splits.iter().map(|line| format!("  {line}"));
    let lines = splits.chain(lines).chain(match built.discrete.model.pairs.len() {
        ..=LISTED => each_pair(built),
        _ => all_pairs(built),
    });
    let solver = format!("  inner solver: {} ({})", solvers, built.choice);
    lines.chain([solver]).chain(warning_lines(&built.warnings, "--json")).try_for_each(say)
}

/// Return two or three lines for each body.
fn each_body(built: &Built) -> Vec<String> {
    let mut lines = Vec::new();
    for info in &built.discrete.bodies {
        lines.push(format!(
            "  body {}: {} cells of order {}, {} nodes, {} dofs, {} of them supported",
            info.name,
            info.cells,
            info.order.degree(),
            info.nodes,
            info.dofs,
            info.supported
        ));
        if !info.unconstrained.is_empty() {
            lines.push(format!("    rigid motions left to contact: {}", info.unconstrained.join("; ")));
        }
        if !info.unresisted.is_empty() {
            lines.push(format!("    rigid motions that nothing can hold: {}", info.unresisted.join("; ")));
        }
    }
    lines
}

/// Return sums over the bodies, and the names of the bodies that have unconstrained rigid motions.
fn all_bodies(built: &Built) -> Vec<String> {
    let bodies = &built.discrete.bodies;
    let sum = |count: fn(&BodyInfo) -> usize| bodies.iter().map(count).sum::<usize>();
    let range = |count: fn(&BodyInfo) -> usize| {
        let (least, most) = bodies.iter().map(count).fold((usize::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
        if least == most { least.to_string() } else { format!("{least} to {most}") }
    };
    let mut lines = vec![format!(
        "  {} bodies: {} cells of order {}, {} nodes, {} dofs, {} of them supported; in each {} cells, {} dofs; --json has every one",
        bodies.len(),
        sum(|info| info.cells),
        range(|info| info.order.degree()),
        sum(|info| info.nodes),
        sum(|info| info.dofs),
        sum(|info| info.supported),
        range(|info| info.cells),
        range(|info| info.dofs)
    )];
    let named = |what: &str, motions: fn(&BodyInfo) -> &Vec<String>| {
        let names: Vec<&String> =
            bodies.iter().filter(|info| !motions(info).is_empty()).map(|info| &info.name).collect();
        let line =
            || format!("    rigid motions {what}: of {} bodies, {}", names.len(), in_words(names.iter().copied()));
        (!names.is_empty()).then(line)
    };
    lines.extend(named("left to contact", |info| &info.unconstrained));
    lines.extend(named("that nothing can hold", |info| &info.unresisted));
    lines
}

/// Return two lines for each pair.
fn each_pair(built: &Built) -> Vec<String> {
    let mut lines = Vec::new();
    for (i, pair) in built.discrete.model.pairs.iter().enumerate() {
        let [low, high] = range(pair.gap.iter().copied());
        let [a, b] = built.discrete.surfaces(i);
        let shear = if built.discrete.specs[i].slip.is_some() { ", shear" } else { "" };
        let without = match pair.uncovered() {
            0 => String::new(),
            count => format!(", {count} of {} facets without a partner", pair.cover.len()),
        };
        lines.push(format!(
            "  contact {a} - {b}{shear}: {} points on {}, {} {:.6}, gap {} to {}{without}",
            pair.len(),
            pair.surfaces[0],
            pair.measure.name(),
            pair.area.iter().sum::<f64>(),
            sci(low, 3),
            sci(high, 3)
        ));
    }
    lines
}

/// Return sums over the pairs.
fn all_pairs(built: &Built) -> Vec<String> {
    let pairs = &built.discrete.model.pairs;
    let [low, high] = range(pairs.iter().flat_map(|pair| pair.gap.iter().copied()));
    vec![format!(
        "  {} contacts: {} points, {} {:.6}, gap {} to {}; --json has every one",
        pairs.len(),
        pairs.iter().map(ContactPair::len).sum::<usize>(),
        pairs[0].measure.name(),
        pairs.iter().flat_map(|pair| &pair.area).sum::<f64>(),
        sci(low, 3),
        sci(high, 3)
    )]
}
