//! What `check` prints and draws of measured surfaces and of the layers made from them.

use crate::data::{Data, Detrend, Fill, Roughness, Trend};
use crate::discretize::{Resolution, resolution};
use crate::error::Result;
use crate::output::{Axis, Folder, LISTED, Plot, Series, Style, safe_name, sci};
use crate::problem::{AsperitySpec, ContactSpec, Depths, LayerSpec, label, name_of};
use crate::run::stages::Built;
use crate::run::words::numbered;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Arc;

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
pub fn data_lines(built: &Built) -> Vec<String> {
    in_contacts(built).values().flat_map(|data| lines_of_data(data)).collect()
}

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

/// Return how well the mesh follows the gap of a pair; none for a gap without data.
fn gap_resolution(built: &Built, pair: usize) -> Option<Resolution> {
    let info = &built.discrete.contacts[pair];
    let spacing = |data: &Arc<Data>| {
        let axes = data.grid().map_or(&[][..], |grid| &grid.axes);
        axes.iter().filter(|axis| axis.count > 1).map(|axis| axis.spacing).fold(f64::INFINITY, f64::min)
    };
    let detail = info.spec.gap.data().map(spacing).reduce(f64::min)?;
    Some(resolution(&info.surface, &info.spec.gap, detail))
}

/// Return the lines that describe what the mesh of a pair leaves out of a measured gap, and the pair's layer if that is made of asperities.
pub fn pair_lines(built: &Built, pair: usize) -> Vec<String> {
    let mut lines = Vec::new();
    lines.extend(gap_resolution(built, pair).map(|Resolution { height, variance, area, side }| {
        format!(
            "    the gap has an rms height of {}; facets with sides of {} leave out {:.1} % of its variance, and more than a tenth of \
             the rms height on {:.1} % of the surface",
            sci(height, 3),
            sci(side, 3),
            100.0 * variance,
            100.0 * area
        )
    }));
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
pub fn data_to_json(built: &Built) -> Value {
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

/// Return the resolution of a pair's gap and the table of its law, for `--json`.
pub fn pair_to_json(built: &Built, pair: usize) -> Value {
    let resolution = gap_resolution(built, pair).map(|Resolution { height, variance, area, side }| {
        json!({ "rms_height": height, "variance_left_out": variance, "area_left_out": area, "side": side })
    });
    let table = match &built.discrete.contacts[pair].spec.layer {
        LayerSpec::Asperities(spec) => Some(law(built, pair, spec, SHOWN)),
        _ => None,
    };
    json!({ "gap_followed": resolution, "law": table })
}

/// Draw the data of contacts and their laws into a folder.
///
/// # Errors
/// Files that cannot be written.
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
                x: Axis::linear(label("compression", units.map(|units| units.length))),
                y: Axis::linear(label("pressure", units.map(|units| units.stress))),
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
    Some(Plot { title: format!("Data {y}"), x: Axis::linear(x), y: Axis::linear(y), series })
}
