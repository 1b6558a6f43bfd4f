//! `winkler check`: build the problem of a scene and print what it has, without solving it, measured surfaces and the layers made from them included.

use super::{SceneArgs, clock_with_phases, load};
use crate::contact::{ContactPair, Left};
use crate::data::{Data, Detrend, Fill, Roughness, Trend};
use crate::discretize::BodyInfo;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::linalg::range;
use crate::output::{Folder, LISTED, Plot, PlotAxis, Series, Style, safe_name, say, sci, warning_lines};
use crate::petsc::Session;
use crate::problem::{AsperitySpec, ContactSpec, Depths, LayerSpec, label, name_of};
use crate::run::results::{self, CouplingEstimate};
use crate::run::{self, Built, in_words, numbered, report};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

/// The command line of `winkler check`.
#[derive(clap::Args)]
pub struct CheckArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for pictures of measured surfaces and layers of asperities [default: none are drawn]
    #[arg(short, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Build a scene's problem, print it and return the exit code.
///
/// Bodies, dofs, surfaces, gaps and the unconstrained rigid motions of each body are printed. With a folder, measured surfaces and layers of
/// asperities are drawn into it.
///
/// # Errors
/// Refusals of scene and mesh; pictures that cannot be written.
pub fn check(session: &Session, interrupt: &Interrupt, request: &CheckArgs) -> Result<i32> {
    let mut clock = clock_with_phases(session.rank() == 0 && !request.scene.json);
    let mut scene = load(session, &request.scene.scene, &request.scene.overrides())?;
    let settings = scene.settings();
    if scene.method.steps.is_table() {
        Rc::make_mut(&mut scene).method.steps = scene.method.steps.heaviest();
    }
    let built = run::build(session, scene, interrupt, &mut clock)?;
    // nothing is solved, so that no line may name a next phase
    clock.watch = None;
    clock.total();
    let shared = report::GatheredCounters::gather(&built.discrete);
    if session.rank() != 0 {
        return Ok(0);
    }
    if let Some(folder) = &request.output {
        draw(&built, &Folder::claim(folder)?)?;
    }
    if request.scene.json {
        let headline = json!(report::headline(session, &built, &shared.solvers, &clock));
        say(format_args!("{:#}", to_json(&built, settings, headline)))?;
    } else {
        print(&built, &report::solvers_in_words(&shared.solvers))?;
    }
    Ok(0)
}

/// Return all of `--json`: the headline of a report, with what is known before a solution.
fn to_json(built: &Built, settings: Value, headline: Value) -> Value {
    let mut value = headline;
    value["settings"] = settings;
    value["status"] = json!("checked");
    value["message"] = json!(built.choice);
    for (info, body) in built.discrete.bodies.iter().zip(0..) {
        value["bodies"][body]["supported"] = json!(info.supported);
        value["bodies"][body]["rigid_motions"] = json!(info.left_by_supports);
        value["bodies"][body]["rigid_motions_unconstrained"] = json!(info.left_by_all);
    }
    value["pairs"] = (0..built.discrete.model.pairs.len()).map(|i| pair_to_json(built, i)).collect();
    value["data"] = data_to_json(built);
    value
}

fn pair_to_json(built: &Built, i: usize) -> Value {
    let pair = &built.discrete.model.pairs[i];
    let [low, high] = range(pair.gap.iter().copied());
    let coupling = results::coupling(built, i);
    let sweeps = coupling.sweeps.iter().filter(|_| coupling.pressure > 0.0);
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
        "pieces_lost": pair.lost.map_or(0, |lost| lost.pieces),
        "facets_averaged": pair.averaged(),
        "mean_pressure": Some(coupling.pressure).filter(|&pressure| pressure > 0.0),
        "theta": coupling.theta,
        "expected_sweeps": sweeps.map(|(method, count)| json!({ "method": method, "sweeps": count })).collect::<Vec<_>>(),
        "surface": surface_to_json(built, i),
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
    let data = in_contacts(built);
    let data = data.values().flat_map(|data| lines_of_data(data));
    let lines = splits.chain(lines).chain(data).chain(match built.discrete.model.pairs.len() {
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
            "  body {}: {} cells, {} nodes, {} dofs, {} of them supported",
            info.name, info.cells, info.nodes, info.dofs, info.supported
        ));
        if !info.left_by_supports.is_empty() {
            lines.push(format!("    rigid motions left to contact: {}", info.left_by_supports.join("; ")));
        }
        if !info.left_by_all.is_empty() {
            lines.push(format!("    rigid motions that nothing can hold: {}", info.left_by_all.join("; ")));
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
        "  {} bodies: {} cells, {} nodes, {} dofs, {} of them supported; in each {} cells, {} dofs; --json has every one",
        bodies.len(),
        sum(|info| info.cells),
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
    lines.extend(named("left to contact", |info| &info.left_by_supports));
    lines.extend(named("that nothing can hold", |info| &info.left_by_all));
    lines
}

/// Return two lines for each pair, and those of its measured surfaces and its layer of asperities.
fn each_pair(built: &Built) -> Vec<String> {
    let mut lines = Vec::new();
    for (i, pair) in built.discrete.model.pairs.iter().enumerate() {
        let [low, high] = range(pair.gap.iter().copied());
        lines.push(format!(
            "  contact {} - {}: {} points on {}, {} {:.6}, gap {} to {}",
            pair.surfaces[0],
            pair.surfaces[1],
            pair.len(),
            pair.surfaces[0],
            pair.measure,
            pair.weight.iter().sum::<f64>(),
            sci(low, 3),
            sci(high, 3)
        ));
        let coupling = results::coupling(built, i);
        lines.push(match coupling.pressure == 0.0 {
            true => "    no load of its bodies presses it: pressure and sweeps cannot be estimated".to_owned(),
            false => format!(
                "    mean pressure {} if it carries the load alone, {}",
                sci(coupling.pressure, 3),
                expected(&coupling)
            ),
        });
        lines.extend(pair_lines(built, i));
    }
    lines
}

/// Number of sweeps beyond which a method is of no use, so that the order of the number does not matter. A sweep of the smallest problems
/// takes some tens of microseconds, so that this many take a minute.
const MOST_SWEEPS: f64 = 1e6;

/// Return theta and the expected number of sweeps of a pair as a text.
///
/// Each side has theta = kappa/(k + kappa), with the stiffness k of its body and the tangent kappa of the layer.
fn expected(coupling: &CouplingEstimate) -> String {
    let sweeps = coupling.sweeps.iter().map(|(method, count)| match *count {
        ..=MOST_SWEEPS => format!("{method} {count:.0}"),
        count if count.is_finite() => format!("{method} more than {MOST_SWEEPS}"),
        _ => format!("{method} does not converge"),
    });
    let [a, b] = coupling.theta;
    let sweeps = sweeps.collect::<Vec<_>>().join(", ");
    format!("theta {a:.3} and {b:.3}; sweeps to expect for a residual of 1e-8: {sweeps}")
}

/// Return sums over the pairs, and the number of sweeps to expect from the pair with the largest theta.
fn all_pairs(built: &Built) -> Vec<String> {
    let pairs = &built.discrete.model.pairs;
    let [low, high] = range(pairs.iter().flat_map(|pair| pair.gap.iter().copied()));
    let mut lines = vec![format!(
        "  {} contacts: {} points, {} {:.6}, gap {} to {}; --json has every one",
        pairs.len(),
        pairs.iter().map(ContactPair::len).sum::<usize>(),
        pairs[0].measure,
        pairs.iter().flat_map(|pair| &pair.weight).sum::<f64>(),
        sci(low, 3),
        sci(high, 3)
    )];
    let all = (0..pairs.len()).map(|i| (&pairs[i], results::coupling(built, i)));
    let pressed: Vec<(&ContactPair, CouplingEstimate)> = all.filter(|(_, coupling)| coupling.pressure > 0.0).collect();
    if pressed.len() < pairs.len() {
        let rest = pairs.len() - pressed.len();
        lines.push(format!(
            "    {rest} of them have no load of a body as a whole across: their pressure cannot be estimated"
        ));
    }
    let product = |coupling: &CouplingEstimate| coupling.theta[0] * coupling.theta[1];
    if let Some((pair, coupling)) = pressed.iter().max_by(|(_, a), (_, b)| product(a).total_cmp(&product(b))) {
        let pressures = || pressed.iter().map(|(_, coupling)| coupling.pressure);
        let [least, most] = [f64::min, f64::max].map(|pick| pressures().reduce(pick));
        let [least, most] = [least, most].map(|pressure| sci(pressure.unwrap_or(f64::NAN), 3));
        let [a, b] = &pair.surfaces;
        lines.push(format!(
            "    mean pressure {least} to {most}; the largest theta, of {a} - {b}: {}",
            expected(coupling)
        ));
    }
    lines
}

/// Return the data in the gap of a contact and in its layer.
fn of_contact(built: &Built, spec: &ContactSpec) -> Vec<Arc<Data>> {
    let mut data: Vec<Arc<Data>> = spec.gap.data().cloned().collect();
    match &spec.layer {
        LayerSpec::Form { values, .. } => data.extend(values.iter().flat_map(|field| field.data().cloned())),
        LayerSpec::Pressure { law, .. } => data.extend(law.data().cloned()),
        LayerSpec::Asperities(spec) => {
            data.extend(spec.data.iter().filter_map(|name| built.scene.data.get(name).cloned()));
        }
        LayerSpec::Table(_) | LayerSpec::Own(_) => {}
    }
    data
}

/// Return the data of all contacts, each once, by name.
fn in_contacts(built: &Built) -> BTreeMap<String, Arc<Data>> {
    let contacts = built.discrete.contacts.iter();
    let data = contacts.flat_map(|info| of_contact(built, &info.spec));
    data.map(|data| (data.spec.name.clone(), data)).collect()
}

/// Return the lines that describe the data of contacts.
fn lines_of_data(data: &Data) -> Vec<String> {
    let (name, file) = (&data.spec.name, data.spec.file.display());
    let Some(grid) = data.grid() else {
        let first = format!("  data {name}: {file}, points on no regular grid");
        return [first].into_iter().chain(changes(data)).collect();
    };
    let counts: Vec<String> =
        grid.axes.iter().filter(|axis| axis.count > 1).map(|axis| axis.count.to_string()).collect();
    let ranges: Vec<String> = grid.axes[..counts.len()]
        .iter()
        .map(|axis| {
            let [from, to] = axis.range();
            format!("{} to {}", sci(from, 4), sci(to, 4))
        })
        .collect();
    let Roughness { range: [low, high], height, slope, curvature } = grid.roughness();
    let mut lines = vec![
        format!("  data {name}: {file}, {} points for {}", counts.join(" x "), ranges.join(" and ")),
        format!(
            "    heights {} to {}, rms height {}, rms slope {}, rms curvature {}",
            sci(low, 3),
            sci(high, 3),
            sci(height, 3),
            sci(slope, 3),
            sci(curvature, 3)
        ),
    ];
    lines.extend(changes(data));
    lines.extend(grid.summits().map(|summits| {
        format!(
            "    {} summits, {} in a unit of area, mean radius {}",
            summits.heights.len(),
            sci(summits.density, 3),
            sci(summits.radius, 3)
        )
    }));
    lines
}

/// Return the lines that describe what was done to the heights of a file.
fn changes(data: &Data) -> Vec<String> {
    let filled = match data.grid() {
        Some(_) => format!("filled ({})", name_of(&Fill::ALL, &data.spec.fill)),
        None => "left out".to_owned(),
    };
    let gaps = (data.missing() > 0).then(|| format!("    {} points without a height are {filled}", data.missing()));
    let trend = data.trend().map(|Trend { slope: [a, b], second: [xx, xy, yy] }| {
        let slopes = format!("slopes {} and {}", sci(a, 3), sci(b, 3));
        match data.spec.detrend {
            Detrend::Parabola => format!(
                "    subtracted: a parabola with {slopes} in the middle, second derivatives {} (xx), {} (xy), {} (yy)",
                sci(xx, 3),
                sci(xy, 3),
                sci(yy, 3)
            ),
            _ => format!("    subtracted: a plane with {slopes}"),
        }
    });
    gaps.into_iter().chain(trend).collect()
}

/// Return the lines that describe the layer of a pair if that is made of asperities.
fn pair_lines(built: &Built, pair: usize) -> Vec<String> {
    let mut lines = Vec::new();
    if let LayerSpec::Asperities(spec) = &built.discrete.contacts[pair].spec.layer {
        lines.push(format!("    layer of asperities: {}; law:", described(spec)));
        lines.push("      compression  pressure     tangent".to_owned());
        lines.extend(
            law(built, pair, spec, SHOWN)
                .into_iter()
                .map(|[c, p, tangent]| format!("      {:<11}  {:<11}  {}", sci(c, 3), sci(p, 3), sci(tangent, 3))),
        );
    }
    lines
}

/// Rows of a law that are printed, few beside the other lines of a pair.
const SHOWN: usize = 8;
/// Points of a law that are drawn. Straight lines of four pixels look like a curve.
const DRAWN: usize = 200;

/// Return the text that describes a layer of asperities.
fn described(spec: &AsperitySpec) -> String {
    let heights = match &spec.depths {
        Depths::Normal { deviation, highest } => {
            format!("standard deviation {}, the highest {} above the mean", sci(*deviation, 3), sci(*highest, 3))
        }
        Depths::Measured(depths) => format!("{} measured summits", depths.len()),
    };
    format!(
        "{} in a unit of area, radius {}, E* {}, {heights}",
        sci(spec.density, 3),
        sci(spec.radius, 3),
        sci(spec.modulus, 3)
    )
}

/// Return `count` compressions of a pair's law, each with its pressure and tangent. The last compression is that at which the mean plane of
/// the summits is in contact.
fn law(built: &Built, pair: usize, spec: &AsperitySpec, count: usize) -> Vec<[f64; 3]> {
    let law = &built.discrete.model.pairs[pair].law;
    let end = match &spec.depths {
        Depths::Normal { highest, .. } => *highest,
        Depths::Measured(depths) => depths.iter().sum::<f64>() / depths.len() as f64,
    };
    let end = if end > 0.0 { end } else { spec.radius };
    let at = |k: usize| {
        let c = end * k as f64 / count as f64;
        let response = law.response(0, c);
        [c, response.pressure, response.tangent]
    };
    (1..=count).map(at).collect()
}

/// Return the roughness of the data of contacts by name, for `--json`. Only data on regular grids have it.
fn data_to_json(built: &Built) -> Value {
    let data = in_contacts(built).into_iter();
    data.filter_map(|(name, data)| {
        let Roughness { range, height, slope, curvature } = data.grid()?.roughness();
        let missing = data.missing();
        let found = json!({
            "range": range, "rms_height": height, "rms_slope": slope, "rms_curvature": curvature, "missing": missing
        });
        Some((name, found))
    })
    .collect()
}

/// Return the table of a pair's law, for `--json`.
fn surface_to_json(built: &Built, pair: usize) -> Value {
    let table = match &built.discrete.contacts[pair].spec.layer {
        LayerSpec::Asperities(spec) => Some(law(built, pair, spec, SHOWN)),
        _ => None,
    };
    json!({ "law": table })
}

/// Draw the data of contacts and their laws into a folder.
pub fn draw(built: &Built, folder: &Folder) -> Result<()> {
    for (name, data) in in_contacts(built) {
        if let Some(plot) = profiles(&data, built) {
            folder.write(&format!("data-{}.svg", safe_name(&name)), |out| plot.write(out))?;
        }
    }
    let pairs = &built.discrete.model.pairs;
    let stems: Vec<String> = numbered(pairs.iter().map(|pair| {
        let [a, b] = &pair.surfaces;
        format!("layer-{}-{}", safe_name(a), safe_name(b))
    }));
    for (pair, stem) in stems.iter().enumerate().take(LISTED) {
        if let LayerSpec::Asperities(spec) = &built.discrete.contacts[pair].spec.layer {
            let points = law(built, pair, spec, DRAWN).into_iter().map(|[c, p, _]| (c, p)).collect();
            let units = built.scene.units.as_ref();
            let plot = Plot {
                title: format!("Layer of asperities of {}", pairs[pair].surfaces.join(" - ")),
                x: PlotAxis::linear(label("compression", units.map(|units| units.length))),
                y: PlotAxis::linear(label("pressure", units.map(|units| units.stress))),
                series: vec![Series::new("", points, Style::Line)],
            };
            folder.write(&format!("{stem}.svg"), |out| plot.write(out))?;
        }
    }
    Ok(())
}

/// Return the plot of the heights along the lines through the middle of a grid; none for data on no grid.
fn profiles(data: &Data, built: &Built) -> Option<Plot> {
    let grid = data.grid()?;
    let [columns, rows] = grid.axes.map(|axis| axis.count);
    let place = |axis: usize, k: usize| grid.axes[axis].origin + grid.axes[axis].spacing * k as f64;
    let along = (0..columns).map(|i| (place(0, i), grid.values[i + columns * (rows / 2)])).collect();
    let name = if rows > 1 { "middle row" } else { "" };
    let mut series = vec![Series::new(name, along, Style::Line)];
    if rows > 1 {
        let down = (0..rows).map(|j| (place(1, j), grid.values[columns / 2 + columns * j])).collect();
        series.push(Series::new("middle column", down, Style::Line));
    }
    // data can be heights, moduli or loads
    let (x, y) = (label("place", built.scene.units.as_ref().map(|units| units.length)), data.spec.name.clone());
    Some(Plot { title: format!("Data {y}"), x: PlotAxis::linear(x), y: PlotAxis::linear(y), series })
}
