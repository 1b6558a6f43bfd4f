//! The page of a run: one HTML file that needs nothing from other places, written by `solve` from what it has in
//! memory.

mod surface;

pub use surface::Surface;

use crate::output::closing::orders;
use crate::output::{
    BodyReport, ForceReport, Mark, ObstacleReport, PairReport, Plot, Report, Role, RoundReport, RunStatus, UNSETTLED,
    escape, trimmed,
};
use crate::problem::{Units, label};
use serde_json::Value;

/// Name of the page in the folder of results.
pub const FILE: &str = "report.html";

/// Most rows of a table; the files of results have all.
const ROWS: usize = 200;

/// Most bodies with a box each that shows or hides them.
const NAMES: usize = 24;

/// What a page shows.
pub struct Page<'a> {
    /// The report of the run.
    pub report: &'a Report,
    /// Units of the scene, with a force by thickness in the plane.
    pub units: Option<Units>,
    /// Surfaces of all bodies.
    pub bodies: Vec<Surface>,
    /// Places that are marked on them.
    pub marks: &'a [Mark],
    /// Contact surfaces in space.
    pub contacts: Vec<Surface>,
    /// Pressures along contacts in the plane.
    pub pressures: Vec<&'a Plot>,
    /// Contact forces over approaches, if there are load steps.
    pub approach: Option<Plot>,
    /// Residuals and errors over the iterations, if there are any.
    pub convergence: Option<Plot>,
}

/// Return a table whose cells are HTML. Columns whose heading begins with `#` have numbers, and go to the right.
fn table<T: AsRef<str>>(headings: &[T], rows: impl Iterator<Item = Vec<String>>) -> String {
    let class = |heading: &T| if heading.as_ref().starts_with('#') { " class=\"n\"" } else { "" };
    let head = |heading: &T| format!("<th{}>{}</th>", class(heading), escape(heading.as_ref().trim_start_matches('#')));
    let line = |row: Vec<String>| {
        let cells = headings.iter().zip(row).map(|(heading, html)| format!("<td{}>{html}</td>", class(heading)));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let heads: String = headings.iter().map(head).collect();
    format!("<div class=\"wide\"><table>\n<tr>{heads}</tr>\n{}</table></div>", rows.map(line).collect::<String>())
}

/// Format a number with five digits; one that is unknown becomes a dash.
fn digits(value: impl Into<Option<f64>>) -> String {
    let Some(value) = value.into().filter(|value| value.is_finite()) else { return "–".to_owned() };
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-3..1e6).contains(&size) => {
            let text = format!("{value:.3e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{power}", trimmed(digits)).replace('-', "−")
        }
        size => {
            let digits = (4.0 - size.log10().floor()).clamp(0.0, 7.0) as usize;
            trimmed(&format!("{value:.digits$}")).replace('-', "−")
        }
    }
}

/// Format a vector.
fn vector(v: &[f64]) -> String {
    format!("({})", v.iter().map(|&x| digits(x)).collect::<Vec<_>>().join(", "))
}

/// Format a table of the settings as `key = value, ...` and a list as `(a, b)`, as text.
fn words(value: &Value) -> String {
    match value {
        Value::Object(entries) => {
            let entry = |(key, value): (&String, &Value)| {
                format!("{key}{}{}", if value.is_object() { ": " } else { " = " }, words(value))
            };
            entries.iter().map(entry).collect::<Vec<_>>().join(", ")
        }
        Value::Array(items) => format!("({})", items.iter().map(words).collect::<Vec<_>>().join(", ")),
        Value::Number(number) => digits(number.as_f64()),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Return the items of a list of the settings, a line each.
fn lines(list: &Value, prefix: &str) -> String {
    list.as_array().into_iter().flatten().map(|item| format!("{prefix}{}<br>", escape(&words(item)))).collect()
}

/// Return `1 body` or `2 bodies`.
fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

impl Page<'_> {
    /// Return the page.
    pub fn html(&self) -> String {
        let report = self.report;
        let is_space = report.settings["dimension"] == 3;
        let figure = |plot: &Plot| format!("<figure class=\"plot\">{}</figure>", plot.svg());
        let figures: String = self.pressures.iter().copied().map(figure).collect();
        let approach = self.approach.as_ref().map(figure);
        let convergence = self.convergence.as_ref().map(figure);
        let view = surface::view(&self.bodies, &self.contacts, is_space).to_string();
        format!(
            include_str!("page.html"),
            title = escape(&report.title),
            style = include_str!("style.css"),
            status = report.status,
            message = if report.status == RunStatus::Converged {
                String::new()
            } else {
                format!(": {}", escape(&report.message))
            },
            summary = self.summary(),
            warnings = warnings(&report.warnings),
            fields = self.fields(),
            section = if is_space { SECTION } else { "" },
            names = names(&self.bodies),
            marks = marks(self.marks),
            pressures = format_args!("<div class=\"figures\">{figures}</div>"),
            contacts = self.contact_table(),
            steps = approach.map_or(String::new(), |figure| format!("<h2>Load steps</h2>{figure}")),
            meshes = self.mesh_table(),
            convergence = convergence.unwrap_or_else(|| "<p>No iterations.</p>".to_owned()),
            scene = scene(&report.settings),
            bodies = self.body_table(),
            balance = self.balance_table(),
            times = times(report),
            command = escape(&command(report)),
            versions = versions(report),
            settings = escape(&serde_json::to_string_pretty(&report.settings).unwrap_or_default()),
            // a text of the scene must not end the script
            view = view.replace('<', "\\u003c"),
            library = include_str!("vendor/twgl.min.js"),
            viewer = include_str!("viewer.js"),
        )
    }

    /// Return a label with one of the units of the scene.
    fn label(&self, what: &str, unit: fn(&Units) -> &str) -> String {
        label(what, self.units.as_ref().map(unit))
    }

    /// Return the paragraph on what was solved.
    fn summary(&self) -> String {
        let (report, settings) = (self.report, &self.report.settings);
        let place = match (settings["dimension"] == 3, settings["plane"].as_str()) {
            (true, _) => "in space".to_owned(),
            (_, Some("axisymmetric")) => "of revolution".to_owned(),
            (_, plane) => format!("in the plane (plane {})", plane.unwrap_or_default()),
        };
        let mut text = format!(
            "{} {place}, {} of contact surfaces, {} degrees of freedom of order {}. Method <code>{}</code>, {}, {} sweeps.",
            counted(report.bodies.len(), "elastic body", "elastic bodies"),
            counted(report.pairs.len(), "pair", "pairs"),
            report.dofs,
            orders(&report.bodies),
            report.method,
            counted(report.iterations, "iteration", "iterations"),
            report.sweeps
        );
        let error = report.error_bound.map(|error| ("is at most", error));
        if let Some((what, error)) = error.or(report.error_estimate.map(|error| ("is estimated as", error))) {
            text += &format!(" The error of the iteration {what} {} in the energy norm.", digits(error));
        }
        if let Some(error) = &report.discretization_error {
            text += &format!(
                " Estimated error of the mesh: pressure {}, displacement {}, force {}, energy norm {}.",
                vector(&error.pressure),
                digits(error.displacement),
                vector(&error.force),
                digits(error.energy)
            );
        }
        let units = self.units.as_ref().map(|Units { length, stress, force }| {
            format!(" Units: {}.", escape(&[length.as_str(), stress, force].join(", ")))
        });
        text + &units.unwrap_or_default()
    }

    /// Return the choice of fields of the view.
    fn fields(&self) -> String {
        let mut options = vec![
            ("stress", self.label("von Mises stress", |units| &units.stress)),
            ("travel", self.label("displacement", |units| &units.length)),
        ];
        if !self.contacts.is_empty() {
            options.push(("pressure", self.label("contact pressure", |units| &units.stress)));
            options.push(("opening", self.label("gap of contacts", |units| &units.length)));
        }
        options.iter().map(|(value, text)| format!("<option value=\"{value}\">{}</option>", escape(text))).collect()
    }

    fn contact_table(&self) -> String {
        let pairs = &self.report.pairs;
        let is_area = pairs.first().is_some_and(|pair| pair.extent.is_area());
        let unit = self.units.as_ref().map(|units| format!("{}{}", units.length, if is_area { "²" } else { "" }));
        let columns = [
            "pair".to_owned(),
            "surfaces".to_owned(),
            "layer".to_owned(),
            "#points".to_owned(),
            self.label("force on the first", |units| &units.force),
            self.label("#normal force", |units| &units.force),
            self.label("#mean pressure", |units| &units.stress),
            self.label("#peak pressure", |units| &units.stress),
            self.label("at", |units| &units.length),
            label(if is_area { "#area in contact" } else { "#length in contact" }, unit.as_deref()),
            label("#open", unit.as_deref()),
        ];
        let moves = pairs.iter().any(|pair| pair.obstacle.is_some() || pair.offset.is_some());
        let pulls = pairs.iter().any(|pair| pair.tension.is_some());
        let tension = [self.label("#largest tension", |units| &units.stress), self.label("at", |units| &units.length)];
        let columns = columns.into_iter().chain(tension.into_iter().filter(|_| pulls));
        let columns: Vec<String> = columns.chain(moves.then(|| "obstacle or offset".to_owned())).collect();
        let row = |pair: &PairReport| {
            let obstacle = pair.obstacle.as_ref().map(|obstacle| {
                let ObstacleReport { approach, tilt, force, moment, .. } = obstacle;
                let [approach, force] = [approach, force].map(|value| digits(*value));
                format!("approach {approach}, tilt {}, force {force}, moment {}", vector(tilt), vector(moment))
            });
            let offset = pair.offset.map(|offset| format!("offset {}", digits(offset)));
            let moved = moves.then(|| obstacle.or(offset).unwrap_or_default());
            let cells = vec![
                escape(&pair.bodies.join(" – ")),
                escape(&pair.surfaces.join(" – ")),
                escape(&words(&self.report.settings["contact"][pair.contact]["layer"])),
                pair.points.to_string(),
                vector(&pair.force[0]),
                digits(pair.normal_force),
                digits(pair.mean_pressure),
                digits(pair.peak_pressure),
                if pair.peak_pressure > 0.0 { vector(&pair.peak_at) } else { String::new() },
                digits(pair.extent.contact()),
                digits(pair.extent.open()),
            ];
            let tension = pair.tension.filter(|tension| tension.peak_tension > 0.0);
            let tension = tension.map(|tension| [digits(tension.peak_tension), vector(&tension.peak_tension_at)]);
            let tension = tension.unwrap_or_default().into_iter().filter(|_| pulls);
            cells.into_iter().chain(tension).chain(moved).collect()
        };
        let rest = match pairs.len() {
            ..=ROWS => String::new(),
            all => format!("<p class=\"soft\">The first {ROWS} of {all} pairs; contacts.csv has all.</p>"),
        };
        table(&columns, pairs.iter().take(ROWS).map(row)) + &rest
    }

    /// Return the table of adapted meshes with their estimated errors, empty without any.
    fn mesh_table(&self) -> String {
        if self.report.rounds.is_empty() {
            return String::new();
        }
        let columns = [
            "#cells",
            "#dofs",
            "#error of pressures",
            "#of displacements",
            "#of forces",
            "#in energy",
            "#iterations",
            "#seconds",
        ];
        let row = |round: &RoundReport| {
            let errors = [round.pressure, round.displacement, round.force, round.energy].map(digits);
            let counts = [round.cells, round.dofs].map(|count| count.to_string());
            [&counts[..], &errors, &[round.iterations.to_string(), digits(round.seconds)]].concat()
        };
        format!("<h2>Meshes</h2>\n{}", table(&columns, self.report.rounds.iter().map(row)))
    }

    fn body_table(&self) -> String {
        let displacement = self.label("#largest displacement", |units| &units.length);
        let stress = self.label("#von Mises stress", |units| &units.stress);
        let columns =
            ["body", "#cells", "#dofs", "inner solver", &displacement, &stress, "#imbalance of forces", "#of moments"];
        let row = |body: &BodyReport| {
            let change = body.max_von_mises_change.filter(|change| *change > UNSETTLED);
            let doubt = change.map_or(String::new(), |change| {
                format!(", not to be trusted: it changes by {:.0} % within a cell", 100.0 * change)
            });
            vec![
                escape(&body.name),
                body.cells.to_string(),
                body.dofs.to_string(),
                escape(&body.solver),
                digits(body.max_displacement),
                digits(body.max_von_mises) + &doubt,
                digits(body.balance.force_imbalance),
                digits(body.balance.moment_imbalance),
            ]
        };
        table(&columns, self.report.bodies.iter().take(ROWS).map(row))
    }

    fn balance_table(&self) -> String {
        let force = self.label("force", |units| &units.force);
        let columns = ["body", "from", &force, "moment"];
        let rows = self.report.bodies.iter().take(ROWS).flat_map(|body| {
            let balance = &body.balance;
            let reactions = balance.supports.iter().chain(&balance.springs).chain(&balance.rigid);
            let row = |part: &ForceReport| {
                vec![escape(&body.name), escape(&part.on), vector(&part.force), vector(&part.moment)]
            };
            [&balance.loads, &balance.contacts].into_iter().chain(reactions).map(row).collect::<Vec<_>>()
        });
        table(&columns, rows)
    }
}

/// The choice of a section in space.
const SECTION: &str = "<label>Section <select><option value=\"\">none</option><option value=\"x\">across x</option>\
<option value=\"y\">across y</option><option value=\"z\">across z</option></select></label>\n\
<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"place of the section\" hidden>";

fn warnings(warnings: &[String]) -> String {
    let all: String = warnings.iter().map(|text| format!("<p class=\"warning\">{}</p>\n", escape(text))).collect();
    if all.is_empty() { all } else { format!("<h2>Warnings</h2>\n{all}") }
}

/// Return a box for each body that shows or hides it, where there are neither one nor too many.
fn names(bodies: &[Surface]) -> String {
    if !(2..=NAMES).contains(&bodies.len()) {
        return String::new();
    }
    let name = |(k, body): (usize, &Surface)| {
        format!("<label><input type=\"checkbox\" value=\"{k}\" checked> {}</label>", escape(&body.name))
    };
    format!("<div class=\"tools\">{}</div>", bodies.iter().enumerate().map(name).collect::<String>())
}

/// Return the legend of the marked places, with the names of their groups.
fn marks(marks: &[Mark]) -> String {
    let kinds = [
        (Role::Support, "<i class=\"support\"></i> supports"),
        (Role::Load, "<i class=\"load\"></i> loads"),
        (Role::Spring, "<i class=\"spring\"></i> springs"),
        (Role::Contact, "<i class=\"closed\"></i> closed and <i class=\"open\"></i> open contact"),
    ];
    let of_kind = |(role, words): (Role, &str)| {
        let mut on: Vec<&str> = marks.iter().filter(|mark| mark.role == role).map(|mark| mark.on.as_str()).collect();
        on.sort_unstable();
        on.dedup();
        let more = if on.len() > NAMES { ", ..." } else { "" };
        let names = escape(&on[..on.len().min(NAMES)].join(", "));
        if on.is_empty() { String::new() } else { format!("<span>{words}: {names}{more}</span>") }
    };
    let all: String = kinds.into_iter().map(of_kind).collect();
    if all.is_empty() {
        all
    } else {
        format!("<div class=\"tools marks\"><label><input type=\"checkbox\" checked> Marks</label>{all}</div>")
    }
}

/// Return the table of the bodies as the scene describes them.
fn scene(settings: &Value) -> String {
    let row = |body: &Value| {
        let mut material = body.as_object().cloned().unwrap_or_default();
        ["name", "fix", "load", "spring"].iter().for_each(|key| drop(material.remove(*key)));
        material.retain(|_, value| *value != false && value.as_array().is_none_or(|list| !list.is_empty()));
        vec![
            escape(body["name"].as_str().unwrap_or_default()),
            escape(&words(&Value::Object(material))),
            lines(&body["fix"], "") + &lines(&body["spring"], "spring "),
            lines(&body["load"], ""),
        ]
    };
    let columns = ["body", "material", "held by", "loads"];
    table(&columns, settings["body"].as_array().into_iter().flatten().take(ROWS).map(row))
}

/// Return the table of the phases with a bar each, and what the inner solvers took.
fn times(report: &Report) -> String {
    let total = report.times.get("total").copied().unwrap_or_default().max(1e-9);
    let phases = ["mesh", "discretize", "set-up", "iterate", "estimate", "output", "total"];
    let row = |phase: &str| {
        let seconds = *report.times.get(phase)?;
        let bar = format!("<span class=\"meter\" style=\"width:{:.2}rem\"></span>", 15.0 * seconds / total);
        Some(vec![phase.to_owned(), digits(seconds), digits(report.memory.get(phase).copied()), bar])
    };
    let columns = ["phase", "#seconds", "#peak memory so far, MB", ""];
    let inner = &report.inner_times;
    table(&columns, phases.into_iter().filter_map(row))
        + &format!(
            "<p class=\"soft\">Inner solvers: {} s in factorisations and set-ups, {} s in solves. {} factorisations, {} solves of a body, \
             {} Krylov iterations.</p>",
            digits(inner.factor),
            digits(inner.solve),
            report.factorizations,
            report.body_solves,
            report.inner_iterations
        )
}

/// Return the command of the run for a shell, after a change to its folder.
fn command(report: &Report) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let quoted = |word: &String| {
        if !word.is_empty() && word.chars().all(is_plain) {
            word.clone()
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    };
    let words: Vec<String> = report.command.iter().map(quoted).collect();
    format!("cd {}\n{}", quoted(&report.directory), words.join(" "))
}

fn versions(report: &Report) -> String {
    let options = if report.petsc_options.is_empty() {
        "No PETSc options were given.".to_owned()
    } else {
        format!("PETSc options: <code>{}</code>", escape(&report.petsc_options.join(" ")))
    };
    let ranks = counted(report.ranks, "MPI rank", "MPI ranks");
    format!("winkler {}, PETSc {}, BLAS: {}, {ranks}. {options}", report.winkler, report.petsc, escape(&report.blas))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits() {
        let numbers = [0.0, 12.345678, -1e-9, 1234567.0, 0.5].map(digits);
        assert_eq!(numbers, ["0", "12.346", "−1e−9", "1.235e6", "0.5"]);
        assert_eq!([digits(None), digits(f64::NAN)], ["–", "–"]);
    }

    #[test]
    fn settings_in_words() {
        assert_eq!(words(&serde_json::json!({ "power": { "B": 2.5 } })), "power: B = 2.5");
        assert_eq!(words(&serde_json::json!({ "on": ["a", true] })), "on = (a, true)");
    }
}
