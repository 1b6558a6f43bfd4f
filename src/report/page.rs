//! The page of a run: one HTML file with the contents of its folder. The file needs nothing from other places.

use super::bands::{self, Levels};
use super::body::{Part, magnification};
use super::contact::{self, failed, pictures};
use super::files::{Files, value};
use super::picture::{Picture, View};
use super::{view, words};
use crate::error::{Error, Kind, Result};
use crate::output::{Axis, Color, ConvergenceSeries, Folder, LISTED, Plot, Series, Style, safe_name, write_whole};
use crate::problem::units::{Units, force_labels, label};
use minijinja::{UndefinedBehavior, context};
use serde_json::Value;
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

/// The results in a folder.
pub struct Results {
    files: Files,
    report: Value,
    /// Units of the scene, if it names them.
    pub units: Option<Units>,
}

impl Results {
    /// Read `report.json` of a folder.
    ///
    /// # Errors
    /// [`Kind::File`] when it is missing or no report.
    pub fn read(folder: &Path) -> Result<Self> {
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
        let files = Files::open(folder)?;
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

    /// Whether the scene is in space.
    fn is_space(&self) -> bool {
        self.report["settings"]["dimension"] == 3
    }

    /// Return the bodies, if the run wrote their fields.
    pub fn bodies(&self) -> Result<Vec<Part>> {
        let names = self.names("bodies", |body| body["name"].as_str().map(str::to_owned));
        let parts = names.iter().filter_map(|name| Some((name, self.file(&[&safe_name(name), name])?)));
        parts.map(|(name, file)| Part::read(&self.files, &file, name, "von_mises")).collect()
    }

    /// Return the contact surfaces in space, if the run wrote them. In the plane they are lines, which have plots.
    fn surfaces(&self) -> Result<Vec<Part>> {
        if !self.is_space() {
            return Ok(Vec::new());
        }
        let files = self.names("files", |file| Some(file.as_str()?.strip_suffix(".vtu")?.to_owned()));
        let surfaces = files.iter().filter(|name| name.starts_with("contact-"));
        let parts = surfaces.filter_map(|name| Some((name, self.file(&[name])?)));
        parts.map(|(name, file)| Part::read(&self.files, &file, name, "pressure")).collect()
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
    pub fn label(&self, what: &str, unit: fn(&Units) -> &str) -> String {
        label(what, self.units.as_ref().map(unit))
    }

    /// Return the plot of residual, error and increment over the iteration, none without iterations.
    pub fn convergence(&self) -> Result<Option<Plot>> {
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
    pub fn area(&self) -> Option<Plot> {
        let curves =
            self.curves(|pair| (force(pair), number(pair.get("contact_area").unwrap_or(&pair["contact_length"]))))?;
        let series = curves.into_iter().map(|(name, points)| Series::new(name, points, Style::LineMarkers)).collect();
        let size = if self.is_area() { "area in contact" } else { "length in contact" };
        let size = label(size, self.size_unit().as_deref());
        let force = self.label("contact force", |units| &units.force);
        Some(Plot { title: String::new(), x: Axis::linear(force), y: Axis::linear(size), series })
    }

    /// Return the plot of the contact force over the approach in the same way; none for more than [`LISTED`] pairs.
    fn approach(&self) -> Option<Plot> {
        let curves =
            self.curves(|pair| (number(&pair["approach"]), force(pair))).filter(|curves| curves.len() <= LISTED)?;
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

    /// Return a picture of the pressure of each pair that touches and has a table.
    pub fn pressures(&self, alone: bool) -> Result<Vec<contact::Picture>> {
        pictures(&self.files, self.is_space(), self.units.as_ref(), alone)
    }

    /// Return the picture of the stress, or else the displacement, on deformed bodies. Bodies in space show their surfaces.
    pub fn field(&self, bodies: &[Part], stress: bool) -> Result<String> {
        let values: Vec<Vec<f64>> =
            bodies.iter().map(|part| if stress { part.value.clone() } else { part.travel() }).collect();
        let range = bands::range(values.iter().flatten());
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

    /// Return the text of the page.
    fn page(&self) -> Result<String> {
        let report = &self.report;
        let bodies = self.bodies()?;
        let view = match bodies.is_empty() {
            true => None,
            false => Some(view::data(&bodies, &self.surfaces()?, magnification(&bodies), self.is_space())),
        };
        let convergence = self.convergence()?.map(|plot| plot.svg().map_err(failed)).transpose()?;
        let unit = |unit: fn(&Units) -> &str| self.label("", unit);
        let phases = ["mesh", "discretize", "set-up", "iterate", "estimate", "output"];
        let timed = |phase: &&str| report["times"].get(*phase).is_some();
        let mut environment = words::environment();
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
            view,
            pressures => self.pressures(false)?,
            convergence,
            approach => self.approach().map(|plot| plot.svg().map_err(failed)).transpose()?,
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
