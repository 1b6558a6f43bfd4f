//! The page and the pictures of a run, made from its files alone. The page is one HTML file that needs nothing from other places.
//!
//! Unless a function says otherwise, its errors are those of the files that it reads and of the templates.

mod files;
mod picture;

use crate::error::{Error, Kind, Result};
use crate::linalg::bounds;
use crate::output::{
    Color, ConvergenceSeries, Folder, LISTED, Plot, PlotAxis, Series, Style, UNSETTLED, safe_name, write_whole,
};
use crate::problem::units::{Units, force_labels, label};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use files::{ResultFolder, TriangleMesh, magnification, value};
use minijinja::{UndefinedBehavior, context};
use picture::{Levels, Picture, View, colors, hex, range};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Name of the page in the folder of results.
pub const FILE: &str = "report.html";

/// The name of a curve and its points.
type Curve = (String, Vec<(f64, f64)>);

/// Return a number of a report, NaN if the value is none.
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Return the size of the contact force of a pair in a load step.
fn force(pair: &Value) -> f64 {
    pair["force"].as_array().into_iter().flatten().map(|f| number(f).powi(2)).sum::<f64>().sqrt()
}

/// Write the page of the results in `folder` to `out`, or to [`FILE`] in the folder, and return its path.
///
/// # Errors
/// [`Kind::File`] when the folder has no readable `report.json`, or a file that it names is broken.
pub fn save(folder: &Path, out: Option<&Path>) -> Result<PathBuf> {
    let text = Results::read(folder)?.page()?;
    if out.is_none() {
        // a folder of another user is read, never written to
        Folder::create(folder)?;
    }
    let path = out.map_or_else(|| folder.join(FILE), Path::to_owned);
    write_whole(&path, |out| out.write_all(text.as_bytes()))?;
    Ok(path)
}

struct Results {
    files: ResultFolder,
    report: Value,
    /// Units of the scene, if it names them.
    units: Option<Units>,
}

impl Results {
    /// Read `report.json` of a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when it is missing or no report.
    fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("report.json");
        if !path.exists() {
            return Err(Error::new(Kind::File, format!("{} has no report.json", folder.display()))
                .help("name a folder of results of `winkler solve`"));
        }
        let refuse = |cause: String| {
            Error::new(Kind::File, format!("{} is no report of a run", path.display()))
                .because(cause)
                .help("solve the scene again")
        };
        let files = ResultFolder::open(folder)?;
        let report: Value =
            serde_json::from_slice(&files.read("report.json")?).map_err(|cause| refuse(cause.to_string()))?;
        for key in ["status", "bodies", "pairs", "settings", "files", "times", "inner_times"] {
            if report.get(key).is_none() {
                return Err(refuse(format!("it has no `{key}`")));
            }
        }
        let settings = &report["settings"];
        let units = settings["units"].as_str().and_then(|text| Units::parse(text).ok());
        let is_whole = settings["dimension"] == 3 || settings["plane"] == "axisymmetric";
        let units = if is_whole { units } else { units.map(Units::per_thickness) };
        Ok(Self { files, report, units })
    }

    fn is_space(&self) -> bool {
        self.report["settings"]["dimension"] == 3
    }

    /// Return the bodies, if the run wrote their fields.
    fn bodies(&self) -> Result<Vec<TriangleMesh>> {
        let names = self.names("bodies", |body| body["name"].as_str().map(str::to_owned));
        let parts = names.iter().filter_map(|name| Some((name, self.file(&[&safe_name(name), name])?)));
        parts.map(|(name, file)| TriangleMesh::read(&self.files, &file, name, "von_mises")).collect()
    }

    /// Return the contact surfaces in space, if the run wrote them. In the plane they are lines, which have plots.
    fn surfaces(&self) -> Result<Vec<TriangleMesh>> {
        if !self.is_space() {
            return Ok(Vec::new());
        }
        let files = self.names("files", |file| Some(file.as_str()?.strip_suffix(".vtu")?.to_owned()));
        let surfaces = files.iter().filter(|name| name.starts_with("contact-"));
        let parts = surfaces.filter_map(|name| Some((name, self.file(&[name])?)));
        parts.map(|(name, file)| TriangleMesh::read(&self.files, &file, name, "pressure")).collect()
    }

    /// Return the names in a list of the report.
    fn names(&self, key: &str, name: impl Fn(&Value) -> Option<String>) -> Vec<String> {
        self.report[key].as_array().into_iter().flatten().filter_map(name).collect()
    }

    /// Return the first VTU file with one of these stems that the run wrote.
    fn file(&self, stems: &[&str]) -> Option<String> {
        let files = self.report["files"].as_array()?;
        let written = |name: &String| files.iter().any(|file| file == name);
        // a name with a separator could lead out of the folder
        let stems = stems.iter().flat_map(|stem| ["pvtu", "vtu"].map(|ending| format!("{stem}.{ending}")));
        let name = stems.filter(|name| !name.contains('/')).find(written);
        name.filter(|name| self.files.path(name).exists())
    }

    /// Return a label with one of the units of the scene.
    fn label(&self, what: &str, unit: fn(&Units) -> &str) -> String {
        label(what, self.units.as_ref().map(unit))
    }

    /// Return the plot of residual, error and increment over the iteration, none without iterations.
    fn convergence(&self) -> Result<Option<Plot>> {
        let rows = self.files.rows("history.csv")?;
        // iterations count from zero in each load step, so rows are numbered through
        let steps = rows.first().is_some_and(|row| row.contains_key("step"));
        let number = |k: usize| if steps { k + 1 } else { value(&rows[k], "iteration") as usize };
        let column = |name: &str| -> Vec<f64> { rows.iter().map(|row| value(row, name)).collect() };
        let [residual, error, increment] = ["residual", "error", "increment"].map(column);
        let numbered = (0..rows.len()).map(|k| (number(k), residual[k], increment[k])).collect();
        let mut plot = Plot::convergence("", &[ConvergenceSeries { label: String::new(), rows: numbered }]);
        let known = if self.report["error_bound"].is_null() { "estimated error" } else { "bound of the error" };
        if error.iter().any(|&error| error > 0.0) {
            let points = (0..rows.len()).map(|k| (number(k) as f64, error[k])).collect();
            plot.series.push(Series::new(known, points, Style::LineMarkers).color(Color::Palette(1)));
        }
        Ok((!rows.is_empty()).then_some(plot))
    }

    /// Return a curve over the load steps for each pair, none without steps.
    fn curves(&self, point: impl Fn(&Value) -> (f64, f64)) -> Option<Vec<Curve>> {
        let steps = self.report["steps"].as_array().filter(|steps| !steps.is_empty())?;
        let curve = |(i, pair): (usize, &Value)| {
            let names: Vec<&str> = pair["bodies"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            (names.join(" - "), steps.iter().map(|step| point(&step["pairs"][i])).collect())
        };
        Some(self.report["pairs"].as_array()?.iter().enumerate().map(curve).collect())
    }

    /// Return the plot of the area or length in contact over the contact force, with a curve over the load steps for each pair;
    /// none without steps.
    fn area(&self) -> Option<Plot> {
        let curves =
            self.curves(|pair| (force(pair), number(pair.get("contact_area").unwrap_or(&pair["contact_length"]))))?;
        let series = curves.into_iter().map(|(name, points)| Series::new(name, points, Style::LineMarkers)).collect();
        let size = if self.is_area() { "area in contact" } else { "length in contact" };
        let size = label(size, self.size_unit().as_deref());
        let force = self.label("contact force", |units| &units.force);
        Some(Plot { title: String::new(), x: PlotAxis::linear(force), y: PlotAxis::linear(size), series })
    }

    /// Return the plot of the contact force over the approach in the same way.
    fn approach(&self) -> Option<Plot> {
        let curves = self.curves(|pair| (number(&pair["approach"]), force(pair)))?;
        let curves = curves.iter().map(|(name, points)| (name.as_str(), points.clone()));
        Some(Plot::approach("", force_labels(self.units.as_ref()), curves))
    }

    /// Whether the size of a contact is an area, as in space, and no length.
    fn is_area(&self) -> bool {
        self.report["pairs"][0].get("contact_area").is_some()
    }

    /// Return the unit of this area or length.
    fn size_unit(&self) -> Option<String> {
        self.units.as_ref().map(|units| format!("{}{}", units.length, if self.is_area() { "²" } else { "" }))
    }

    /// Return a picture of the pressure of each pair that touches and has a table, by the rows of `contacts.csv`.
    fn pressures(&self, alone: bool) -> Result<Vec<PressurePicture>> {
        let pairs = self.files.rows("contacts.csv")?;
        let mut pictures = Vec::new();
        for pair in pairs.iter().filter(|pair| value(pair, "peak_pressure") > 0.0) {
            let Some(table) = pair.get("table").filter(|table| !table.is_empty() && !table.contains('/')) else {
                continue;
            };
            let name = |column: &str| pair.get(column).map_or("", String::as_str);
            pictures.push(self.pressure(table, format!("{} – {}", name("a"), name("b")), alone)?);
        }
        Ok(pictures)
    }

    /// Return the picture of the pressure in the table of a pair: a curve in the plane, a map in space.
    fn pressure(&self, table: &str, title: String, alone: bool) -> Result<PressurePicture> {
        let rows = self.files.rows(table)?;
        let points: Vec<[f64; 3]> = rows.iter().map(|row| ["x", "y", "z"].map(|axis| value(row, axis))).collect();
        let pressures: Vec<f64> = rows.iter().map(|row| value(row, "pressure")).collect();
        let [low, high] = bounds(points.iter().copied());
        let mut axes = [0, 1, 2];
        axes.sort_by(|&i, &j| (high[j] - low[j]).total_cmp(&(high[i] - low[i])).then(i.cmp(&j)));
        let pressure = self.label("contact pressure", |units| units.stress);
        if !self.is_space() {
            let along = self.label(["x", "y", "z"][axes[0]], |units| units.length);
            let curve = points.iter().zip(&pressures).map(|(x, &p)| (x[axes[0]], p)).collect();
            let plot = Plot::pressure(&title, &along, &pressure, vec![Series::new("", curve, Style::Line)]);
            return Ok(PressurePicture { kind: "plot", svg: svg(&plot)?, note: None });
        }
        // the two longest directions, in alphabetical order
        let axes = [axes[0].min(axes[1]), axes[0].max(axes[1])];
        let title = format!("{title}: {pressure}");
        // the facets show more than the points, if the run wrote them
        let file = format!("{}.vtu", table.strip_suffix(".csv").unwrap_or(table));
        let has_facets = self.files.path(&file).is_file();
        let every = if has_facets { 1 } else { points.len().div_ceil(POINTS).max(1) };
        let surface = match has_facets {
            true => TriangleMesh::read(&self.files, &file, &title, "pressure")?,
            false => discs(&title, points.iter().zip(&pressures).step_by(every), axes),
        };
        let values: Vec<f64> = surface.value.iter().map(|p| p.max(0.0)).collect();
        let [_, most] = range(values.iter());
        let (levels, view) = (Levels { range: [0.0, most], squares: false, opens: true }, View::flat(axes));
        let drawing = Picture { title: &title, levels, view, magnification: None, outlines: has_facets, alone };
        let svg = drawing.svg(&[surface], &[values]).map_err(failed)?;
        let note = (every > 1).then(|| format!("One of {every} contact points; the table has all."));
        Ok(PressurePicture { kind: "map", svg, note })
    }

    /// Return the picture of the stress, or else the displacement, on deformed bodies. Bodies in space show their surfaces.
    fn field(&self, bodies: &[TriangleMesh], stress: bool) -> Result<String> {
        let values: Vec<Vec<f64>> =
            bodies.iter().map(|part| if stress { part.value.clone() } else { part.travel() }).collect();
        let range = picture::range(values.iter().flatten());
        let title = match stress {
            true => self.label("von Mises stress", |units| units.stress),
            false => self.label("displacement", |units| units.length),
        };
        let levels = Levels { range, squares: stress, opens: false };
        let (view, outlines) = if self.is_space() { (View::space(), false) } else { (View::flat([0, 1]), true) };
        let magnification = Some(magnification(bodies));
        let picture = Picture { title: &title, levels, view, magnification, outlines, alone: true };
        picture.svg(bodies, &values).map_err(failed)
    }

    /// Return the command of the run for a shell, after a change to its directory; empty if the report does not have it.
    fn command(&self) -> String {
        let quoted = |word| shlex::try_quote(word).unwrap_or(word.into());
        let words = self.report["command"].as_array().into_iter().flatten().filter_map(Value::as_str);
        let command = words.map(quoted).collect::<Vec<_>>().join(" ");
        match self.report["directory"].as_str().filter(|_| !command.is_empty()) {
            Some(folder) => format!("cd {}\n{command}", quoted(folder)),
            None => command,
        }
    }

    fn page(&self) -> Result<String> {
        let report = &self.report;
        let bodies = self.bodies()?;
        let view = match bodies.is_empty() {
            true => None,
            false => Some(data(&bodies, &self.surfaces()?, magnification(&bodies), self.is_space())),
        };
        let convergence = self.convergence()?.map(|plot| svg(&plot)).transpose()?;
        let unit = |unit: fn(&Units) -> &str| self.label("", unit);
        let phases = ["mesh", "discretize", "set-up", "iterate", "estimate", "output"];
        let timed = |phase: &&str| report["times"].get(*phase).is_some();
        let mut environment = picture::environment();
        // a report of another version may lack keys
        environment.set_undefined_behavior(UndefinedBehavior::Chainable);
        let values = context! {
            report,
            units => self.units.as_ref().map(|u| context! { length => u.length, stress => u.stress, force => u.force }),
            stress_unit => unit(|units| units.stress),
            length_unit => unit(|units| units.length),
            force_unit => unit(|units| &units.force),
            size_unit => label("", self.size_unit().as_deref()),
            is_area => self.is_area(),
            unsettled => UNSETTLED,
            view,
            pressures => self.pressures(false)?,
            convergence,
            // the page has no room for the legend of more curves
            approach => self.approach().filter(|plot| plot.series.len() <= LISTED).map(|plot| svg(&plot)).transpose()?,
            phases => phases.into_iter().filter(timed).chain(["total"]).collect::<Vec<_>>(),
            command => self.command(),
            settings => serde_json::to_string_pretty(&report["settings"]).unwrap_or_default(),
            style => include_str!("style.css"),
            library => include_str!("vendor/twgl.min.js"),
            viewer => include_str!("viewer.js"),
        };
        environment.render_named_str("page.html", include_str!("page.html"), values).map_err(failed)
    }
}

const WHAT: [&str; 6] = ["stress", "displacement", "pressure", "convergence", "area", "force"];

/// Draw one of the pictures `stress`, `displacement`, `pressure`, `convergence`, `area` and `force` from a folder of results, and return the
/// paths of the files.
///
/// The file is `out`, or an SVG file of the picture's name in the folder. Each pair has a picture of its own, numbered from the
/// second one on.
///
/// # Errors
/// [`Kind::Usage`] for another word or ending; [`Kind::File`] when the folder lacks what is to be drawn.
pub fn draw(folder: &Path, what: &str, out: Option<&Path>) -> Result<Vec<PathBuf>> {
    if !WHAT.contains(&what) {
        return Err(Error::new(Kind::Usage, format!("there is no picture called `{what}`")).suggest(
            what,
            WHAT,
            || format!("there are {}", WHAT.join(", ")),
        ));
    }
    let out_path = out.map_or_else(|| folder.join(format!("{what}.svg")), Path::to_owned);
    if out_path.extension().is_none_or(|ending| ending != "svg") {
        return Err(Error::new(Kind::Usage, format!("{} does not end in .svg", out_path.display()))
            .help("pictures are SVG; rsvg-convert or Inkscape make PDF or PNG of them"));
    }
    let results = Results::read(folder)?;
    if out.is_none() {
        // a folder of another user is read, never written to
        Folder::create(folder)?;
    }
    let mut paths = Vec::new();
    for (k, svg) in drawn(&results, folder, what)?.into_iter().enumerate() {
        let path = if k == 0 { out_path.clone() } else { numbered(&out_path, k + 1) };
        write_whole(&path, |out| out.write_all(svg.as_bytes()))?;
        paths.push(path);
    }
    Ok(paths)
}

/// Return a path with a number behind the stem of its file.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let [stem, ending] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    path.with_file_name(format!("{stem}-{number}.{ending}"))
}

/// Return the pictures called `what` as SVG, at least one.
fn drawn(results: &Results, folder: &Path, what: &str) -> Result<Vec<String>> {
    let lacks = |lacking: &str, advice: &str| {
        Error::new(Kind::File, format!("{} has {lacking}", folder.display())).help(advice)
    };
    let pictures: Vec<String> = match what {
        "pressure" => results.pressures(true)?.into_iter().map(|picture| picture.svg).collect(),
        "convergence" => results.convergence()?.map(|plot| svg(&plot)).transpose()?.into_iter().collect(),
        "area" | "force" => {
            let Some(plot) = (if what == "area" { results.area() } else { results.approach() }) else {
                return Err(lacks("no load steps", "give the scene `method.steps`, or a history of its loads"));
            };
            vec![svg(&plot)?]
        }
        _ => {
            let bodies = results.bodies()?;
            if bodies.is_empty() {
                return Err(lacks("no fields of bodies", "solve the scene again with --vtu"));
            }
            vec![results.field(&bodies, what == "stress")?]
        }
    };
    if pictures.is_empty() {
        return Err(lacks(
            &format!("nothing to draw as {what}"),
            "no pair touches or has a table, or nothing was iterated",
        ));
    }
    Ok(pictures)
}

/// A picture of the pressure of a pair.
#[derive(Serialize)]
struct PressurePicture {
    /// `plot` or `map`.
    kind: &'static str,
    svg: String,
    /// A note on points that the picture leaves out.
    note: Option<String>,
}

/// Most points in a map.
const POINTS: usize = 8000;

/// Return points with pressures as hexagons in the plane of two coordinates, which together cover about their box.
fn discs<'a>(title: &str, points: impl Iterator<Item = (&'a [f64; 3], &'a f64)>, axes: [usize; 2]) -> TriangleMesh {
    let (points, pressures): (Vec<[f64; 3]>, Vec<f64>) = points.unzip();
    let [low, high] = bounds(points.iter().copied());
    let size = axes.map(|k| high[k] - low[k]);
    let longest = size[0].max(size[1]);
    // on a line of points the box has no area, and a single point has no size
    let spacing = (size[0] * size[1] / points.len() as f64).sqrt().clamp(longest / 400.0, longest / 30.0);
    let radius = if longest > 0.0 { 0.62 * spacing } else { 1.0 };
    let (corners, displacement) = (6 * points.len(), [0.0; 3]);
    let mut disc = TriangleMesh {
        name: title.to_owned(),
        points: Vec::with_capacity(corners),
        triangles: Vec::new(),
        displacement: vec![displacement; corners],
        value: pressures.iter().flat_map(|&pressure| [pressure; 6]).collect(),
        is_solid: false,
    };
    for centre in points {
        let first = disc.points.len() as u32;
        disc.triangles.extend((1..5).map(|k| [first, first + k, first + k + 1]));
        disc.points.extend((0..6).map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::FRAC_PI_3).sin_cos();
            let mut corner = centre;
            corner[axes[0]] += radius * cosine;
            corner[axes[1]] += radius * sine;
            corner
        }));
    }
    disc
}

fn svg(plot: &Plot) -> Result<String> {
    plot.svg().map_err(failed)
}

/// Return the error for a picture that cannot be drawn.
fn failed(cause: impl std::fmt::Display) -> Error {
    Error::new(Kind::File, "a picture cannot be drawn").because(cause.to_string())
}

/// Marks points without a value.
const NONE: u16 = u16::MAX;

/// Return the numbers of the view, little endian in base64.
///
/// Each part has points relative to the least coordinates and displacements (float32), triangles (uint32), and a value at each
/// point (uint16). Values are scaled to the range of the parts, pressures to that from zero on; 65535 stands for none.
fn data(bodies: &[TriangleMesh], surfaces: &[TriangleMesh], scale: f64, is_space: bool) -> Value {
    let [low, high] = bounds(bodies.iter().chain(surfaces).flat_map(|part| &part.points).copied());
    let stress = range(bodies.iter().flat_map(|part| &part.value));
    let [_, most] = range(surfaces.iter().flat_map(|part| &part.value));
    json!({
        "bodies": parts(bodies, low, stress),
        "surfaces": parts(surfaces, low, [0.0, most]),
        "travel": range(bodies.iter().flat_map(TriangleMesh::travel).collect::<Vec<_>>().iter()),
        "stress": stress,
        "pressure": [0.0, most],
        "low": [0.0, 0.0, 0.0],
        "high": relative(low, &high),
        "scale": scale,
        "space": is_space,
        "colors": colors().map(hex).to_vec(),
    })
}

/// Return the coordinates of a point relative to another one.
fn relative(low: [f64; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| x[c] - low[c])
}

/// Return the data of parts, with points relative to `low` and values relative to `ends`.
fn parts(parts: &[TriangleMesh], low: [f64; 3], ends: [f64; 2]) -> Vec<Value> {
    parts.iter().map(|part| part_data(part, low, ends)).collect()
}

/// Return the data of a part; values are scaled to the range.
fn part_data(part: &TriangleMesh, low: [f64; 3], [least, most]: [f64; 2]) -> Value {
    // float32 has too few digits for a small body far from the origin
    let points: Vec<[f64; 3]> = part.points.iter().map(|x| relative(low, x)).collect();
    let short = |value: &f64| match value.is_finite() {
        // the least value is that of open contacts alone
        true => ((value - least) / (most - least) * f64::from(NONE - 1))
            .round()
            .max(f64::from(u8::from(*value > least))) as u16,
        false => NONE,
    };
    let floats = |points: &[[f64; 3]]| -> Vec<u8> {
        points.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()).collect()
    };
    json!({
        "name": part.name,
        "points": STANDARD.encode(floats(&points)),
        "displacement": STANDARD.encode(floats(&part.displacement)),
        "value": STANDARD.encode(part.value.iter().map(short).flat_map(u16::to_le_bytes).collect::<Vec<_>>()),
        "triangles": STANDARD.encode(part.triangles.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>()),
    })
}
