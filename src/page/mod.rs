//! The page of a run: one HTML file that needs nothing from other places, written by `solve` from what it has in
//! memory.

mod surface;

pub use surface::Surface;

use crate::output::closing::DIGITS;
use crate::output::folder::REPORT;
use crate::output::{
    BodyReport, ForceReport, LEGEND, Mark, ObstacleReport, PairReport, PairResult, Plot, ReactionReport, Report,
    RunStatus, SealReport, TensionReport, UNSETTLED, busiest, escape, trimmed,
};
use crate::problem::{Units, label};
use serde_json::Value;

/// Name of the page in the folder of results.
pub const FILE: &str = "report.html";

/// Most rows of a table, of 31 pixels each: seven windows of 900 pixels. The files of results have all.
const ROWS: usize = 200;

/// Most pairs whose numbers stand above the picture. With six it begins 450 pixels below the top of the page, in the
/// middle of a window of 900.
const FIRST: usize = 6;

/// What a page shows.
pub struct Page<'a> {
    /// The report of the run.
    pub report: &'a Report,
    /// Units of the scene, with a force by thickness in the plane.
    pub units: Option<Units>,
    /// Surfaces of all bodies.
    pub bodies: Vec<Surface>,
    /// Places on them where something acts.
    pub marks: &'a [Mark],
    /// Contact surfaces in space.
    pub contacts: Vec<Surface>,
    /// Pressures along contacts in the plane.
    pub pressures: Vec<&'a Plot>,
    /// Contact forces over load steps, by their files, if there are several.
    pub of_steps: Vec<(&'static str, Plot)>,
    /// Residuals and errors over the iterations, if there are any.
    pub convergence: Option<Plot>,
}

/// A table of items: the headings of its columns, and the cells of an item in HTML. Columns whose heading begins with
/// `#` have numbers, and go to the right.
struct Table<'a, T> {
    items: &'a [T],
    columns: Vec<(String, Cell<'a, T>)>,
}

type Cell<'a, T> = Box<dyn Fn(&T) -> String + 'a>;

impl<'a, T> Table<'a, T> {
    fn of(items: &'a [T]) -> Self {
        Self { items, columns: Vec::new() }
    }

    fn column(mut self, heading: impl Into<String>, cell: impl Fn(&T) -> String + 'a) -> Self {
        self.columns.push((heading.into(), Box::new(cell)));
        self
    }

    /// Add a column where some item has such a number.
    fn optional(self, heading: impl Into<String>, number: impl Fn(&T) -> Option<f64> + 'a) -> Self {
        if self.items.iter().all(|item| number(item).is_none()) {
            return self;
        }
        self.column(heading, move |item| number(item).map_or(String::new(), digits))
    }

    /// Return the table of the first [`ROWS`] items, with a remark that the file `others` has the rest.
    fn html(&self, others: &str) -> String {
        let class = |heading: &str| if heading.starts_with('#') { " class=\"n\"" } else { "" };
        let name = |heading: &str| escape(heading.trim_start_matches('#'));
        let head = |(heading, _): &(String, _)| format!("<th{}>{}</th>", class(heading), name(heading));
        let heads: String = self.columns.iter().map(head).collect();
        let line = |item: &T| {
            // on narrow screens each cell has its heading beside it
            let cells = self.columns.iter().map(|(heading, cell)| {
                format!("<td{} data-of=\"{}\">{}</td>", class(heading), name(heading), cell(item))
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let lines: String = self.items.iter().take(ROWS).map(line).collect();
        let rest = match self.items.len() {
            ..=ROWS => String::new(),
            all => format!("<p class=\"soft\">The first {ROWS} of {all}; {others} has all.</p>"),
        };
        format!("<div class=\"wide\"><table>\n<tr class=\"heads\">{heads}</tr>\n{lines}</table></div>{rest}")
    }
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

/// Format a vector. A component that is no more than roundoff beside the largest one is zero.
fn vector(v: &[f64]) -> String {
    let largest = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let shown = |&x: &f64| digits(if x.abs() < DIGITS * largest { 0.0 } else { x });
    format!("({})", v.iter().map(shown).collect::<Vec<_>>().join(", "))
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
        let figures = |plots: &mut dyn Iterator<Item = &Plot>| {
            format!("<div class=\"figures\">{}</div>", plots.map(figure).collect::<String>())
        };
        let convergence = self.convergence.as_ref().map(figure);
        let view = surface::view(&self.bodies, &self.contacts, self.marks, is_space).to_string();
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
            results = self.results(),
            summary = self.summary(),
            warnings = warnings(&report.warnings),
            fields = self.fields(),
            section = if is_space { SECTION } else { "" },
            names = names(&self.bodies),
            pressures = figures(&mut self.pressures.iter().copied()),
            contacts = self.contact_table(),
            steps = self.step_table(&figures(&mut self.of_steps.iter().map(|(_, plot)| plot))),
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

    /// Return a heading with the unit of lengths, stresses or forces.
    fn length(&self, what: &str) -> String {
        label(what, self.units.as_ref().map(|units| units.length.as_str()))
    }

    fn stress(&self, what: &str) -> String {
        label(what, self.units.as_ref().map(|units| units.stress.as_str()))
    }

    fn force(&self, what: &str) -> String {
        label(what, self.units.as_ref().map(|units| units.force.as_str()))
    }

    /// Return a heading `of` the length or area of contacts.
    fn extent(&self, of: &str) -> String {
        let is_area = self.report.pairs.first().is_some_and(|pair| pair.result.extent.is_area());
        let what = of.replace("extent", if is_area { "area" } else { "length" });
        let unit = self.units.as_ref().map(|units| format!("{}{}", units.length, if is_area { "²" } else { "" }));
        label(&what, unit.as_deref())
    }

    /// Return the paragraph on what was solved: the counts of the closing lines.
    fn summary(&self) -> String {
        let units = self
            .units
            .as_ref()
            .map(|Units { length, stress, force }| format!("Units: {}", [length.as_str(), stress, force].join(", ")));
        let lines = [Some(self.report.counts()), self.report.discretization_line(), units];
        let lines: Vec<String> = lines.into_iter().flatten().map(|line| escape(line.trim())).collect();
        lines.join("<br>\n")
    }

    /// Return the choice of what the picture shows.
    fn fields(&self) -> String {
        let mut options = vec![("stress", self.stress("von Mises stress")), ("travel", self.length("displacement"))];
        if !self.contacts.is_empty() {
            options.push(("pressure", self.stress("contact pressure")));
            options.push(("opening", self.length("gap of contacts")));
        }
        if !self.marks.is_empty() {
            options.push(("places", "supports, loads and contact".to_owned()));
        }
        options.iter().map(|(value, text)| format!("<option value=\"{value}\">{}</option>", escape(text))).collect()
    }

    /// Return the numbers of the pairs with the largest forces: force, pressure, size and, if known, error.
    fn results(&self) -> String {
        let pairs = &self.report.pairs;
        if pairs.is_empty() || self.report.has_no_state() {
            return String::new();
        }
        let shown: Vec<&PairReport> = busiest(self.report.results(), FIRST).into_iter().map(|i| &pairs[i]).collect();
        let table = Table::of(&shown)
            .column("contact", |pair| escape(&pair.surfaces.join(" – ")))
            .column(self.force("#normal force"), |pair| digits(pair.result.normal_force))
            .column(self.stress("#peak pressure"), |pair| digits(pair.result.peak_pressure))
            .optional(self.stress("#largest tension"), |pair| Some(pair.result.tension?.peak_tension))
            .column(self.extent("#extent in contact"), |pair| digits(pair.result.extent.contact()))
            .optional("#estimated error of pressures", |pair| Some(pair.estimate?.pressure_estimate));
        let rest = if pairs.len() > FIRST { "<p class=\"soft\">All pairs stand below.</p>" } else { "" };
        table.html("") + rest
    }

    fn contact_table(&self) -> String {
        let peak_at = |pair: &PairReport| {
            if pair.result.peak_pressure > 0.0 { vector(&pair.result.peak_at) } else { String::new() }
        };
        let mut table = Table::of(&self.report.pairs)
            .column("bodies and surfaces", |pair| {
                format!("{}<br>{}", escape(&pair.bodies.join(" – ")), escape(&pair.surfaces.join(" – ")))
            })
            .column("layer", |pair| escape(&words(&self.report.settings["contact"][pair.contact]["layer"])))
            .column("#points", |pair| pair.points.to_string())
            .column(self.force("force on the first"), |pair| vector(&pair.result.force[0]))
            .column(self.force("#normal force"), |pair| digits(pair.result.normal_force))
            .column(self.stress("#least pressure"), |pair| digits(pair.result.least_pressure))
            .column(self.stress("#mean pressure"), |pair| digits(pair.result.mean_pressure))
            .column(self.stress("#peak pressure"), |pair| digits(pair.result.peak_pressure))
            .column(self.length("at"), peak_at)
            .column(self.extent("#extent in contact"), |pair| digits(pair.result.extent.contact()))
            .column(self.extent("#open"), |pair| digits(pair.result.extent.open()));
        if self.report.pairs.iter().any(|pair| pair.result.tension.is_some()) {
            table = table.column(self.stress("#largest tension"), |pair| {
                let pulled = pair.result.tension.filter(|tension| tension.peak_tension > 0.0);
                let at = |t: TensionReport| format!("{} at {}", digits(t.peak_tension), vector(&t.peak_tension_at));
                pulled.map_or(String::new(), at)
            });
        }
        if self.report.results().any(|pair| pair.seal.is_some()) {
            table = table.column(self.stress("#sealing pressure"), |pair| {
                let held = |s: SealReport| format!("{} at {}", digits(s.sealing_pressure), vector(&s.sealing_at));
                pair.result.seal.map_or(String::new(), held)
            });
        }
        if self.report.pairs.iter().any(|pair| !moved(&pair.result).is_empty()) {
            table = table.column("obstacle or offset", |pair| moved(&pair.result));
        }
        let table = table
            .optional("#estimated error of pressures", |pair| Some(pair.estimate?.pressure_estimate))
            .optional("#of force", |pair| Some(pair.estimate?.force_estimate));
        table.html("contacts.csv")
    }

    /// Return the load steps: the `figures` of forces, and a table of each pair and reaction by step; empty without
    /// any.
    fn step_table(&self, figures: &str) -> String {
        let (pairs, steps) = (&self.report.pairs, &self.report.steps);
        let mut rows: Vec<StepRow> = Vec::new();
        for (i, pair) in pairs.iter().enumerate() {
            let of = || pair.surfaces.join(" – ");
            let results = steps.iter().map(|step| step.pairs.get(i));
            rows.extend(
                results
                    .enumerate()
                    .filter_map(|(k, result)| Some(StepRow { of: of(), step: k, force: result?.force[0], result })),
            );
        }
        for i in 0..steps.first().map_or(0, |step| step.reactions.len()) {
            let reactions = steps.iter().map(|step| step.reactions.get(i));
            rows.extend(reactions.enumerate().filter_map(|(k, reaction)| {
                let ReactionReport { body, on, force } = reaction?;
                Some(StepRow { of: format!("{body}: {on}"), step: k, force: *force, result: None })
            }));
        }
        let factors = |row: &StepRow| {
            let factors = steps[row.step].factors.iter().map(|(name, factor)| format!("{name} {}", digits(*factor)));
            escape(&factors.collect::<Vec<_>>().join(", "))
        };
        let table = Table::of(&rows)
            .column("of", |row| escape(&row.of))
            .column("#step", |row| (row.step + 1).to_string())
            .column("factors", factors)
            .column(self.force("force"), |row| vector(&row.force))
            .optional(self.force("#normal force"), |row| Some(row.result?.normal_force))
            .optional(self.stress("#least pressure"), |row| Some(row.result?.least_pressure))
            .optional(self.stress("#mean pressure"), |row| Some(row.result?.mean_pressure))
            .optional(self.stress("#peak pressure"), |row| Some(row.result?.peak_pressure))
            .optional(self.stress("#sealing pressure"), |row| Some(row.result?.seal?.sealing_pressure))
            .optional(self.extent("#extent in contact"), |row| Some(row.result?.extent.contact()));
        if steps.is_empty() {
            String::new()
        } else {
            format!("<h2>Load steps</h2>{figures}\n{}", table.html("steps.csv"))
        }
    }

    /// Return the table of adapted meshes with their estimated errors, empty without any.
    fn mesh_table(&self) -> String {
        if self.report.rounds.is_empty() {
            return String::new();
        }
        let table = Table::of(&self.report.rounds)
            .column("#cells", |round| round.cells.to_string())
            .column("#dofs", |round| round.dofs.to_string())
            .column("#error of pressures", |round| digits(round.pressure))
            .column("#of displacements", |round| digits(round.displacement))
            .column("#of forces", |round| digits(round.force))
            .column("#in energy", |round| digits(round.energy))
            .column("#iterations", |round| round.iterations.to_string())
            .column("#seconds", |round| digits(round.seconds));
        format!("<h2>Meshes</h2>\n{}", table.html(REPORT))
    }

    fn body_table(&self) -> String {
        let stress = |body: &BodyReport| {
            let change = body.max_von_mises_change.filter(|change| *change > UNSETTLED);
            let doubt = change.map_or(String::new(), |change| {
                format!(", not to be trusted: it changes by {:.0} % within a cell", 100.0 * change)
            });
            digits(body.max_von_mises) + &doubt
        };
        Table::of(&self.report.bodies)
            .column("body", |body| escape(&body.name))
            .column("#cells", |body| body.cells.to_string())
            .column("#dofs", |body| body.dofs.to_string())
            .column("inner solver", |body| escape(&body.solver))
            .column(self.length("#largest displacement"), |body| digits(body.max_displacement))
            .column(self.stress("#von Mises stress"), stress)
            .column("#imbalance of forces", |body| digits(body.balance.force_imbalance))
            .column("#of moments", |body| digits(body.balance.moment_imbalance))
            .html(REPORT)
    }

    fn balance_table(&self) -> String {
        let mut rows: Vec<(&str, &ForceReport)> = Vec::new();
        for BodyReport { name, balance, .. } in &self.report.bodies {
            let reactions = balance.supports.iter().chain(&balance.springs).chain(&balance.rigid);
            let all = [&balance.loads, &balance.contacts].into_iter().chain(reactions);
            rows.extend(all.map(|part| (name.as_str(), part)));
        }
        Table::of(&rows)
            .column("body", |(body, _)| escape(body))
            .column("from", |(_, part)| escape(&part.on))
            .column(self.force("force"), |(_, part)| vector(&part.force))
            .column("moment", |(_, part)| vector(&part.moment))
            .html(REPORT)
    }
}

/// The row of a pair or a reaction in a load step, which is counted from 0.
struct StepRow<'a> {
    of: String,
    step: usize,
    force: [f64; 3],
    result: Option<&'a PairResult>,
}

/// Return how an obstacle has moved, or the offset of a pair, in words; empty if it has neither.
fn moved(result: &PairResult) -> String {
    let obstacle = result.obstacle.as_ref().map(|ObstacleReport { approach, tilt, force, moment, .. }| {
        let [approach, force] = [approach, force].map(|value| digits(*value));
        format!("approach {approach}, tilt {}, force {force}, moment {}", vector(tilt), vector(moment))
    });
    obstacle.or(result.offset.map(|offset| format!("offset {}", digits(offset)))).unwrap_or_default()
}

/// The choice of a section in space.
const SECTION: &str = "<label>Section <select><option value=\"\">none</option><option value=\"x\">across x</option>\
<option value=\"y\">across y</option><option value=\"z\">across z</option></select></label>\n\
<input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"place of the section\" hidden>";

/// Return the warnings behind a line with their number.
fn warnings(warnings: &[String]) -> String {
    let all: String = warnings.iter().map(|text| format!("<p class=\"warning\">{}</p>\n", escape(text))).collect();
    let head = counted(warnings.len(), "warning", "warnings");
    if all.is_empty() { all } else { format!("<details><summary>{head}</summary>\n{all}</details>") }
}

/// Return a box for each body that shows or hides it, where there are neither one nor too many.
fn names(bodies: &[Surface]) -> String {
    if !(2..=LEGEND).contains(&bodies.len()) {
        return String::new();
    }
    let name = |(k, body): (usize, &Surface)| {
        format!("<label><input type=\"checkbox\" value=\"{k}\" checked> {}</label>", escape(&body.name))
    };
    format!("<div class=\"tools\">{}</div>", bodies.iter().enumerate().map(name).collect::<String>())
}

/// Return the table of the bodies as the scene describes them.
fn scene(settings: &Value) -> String {
    let material = |body: &Value| {
        let mut material = body.as_object().cloned().unwrap_or_default();
        ["name", "fix", "load", "spring"].iter().for_each(|key| drop(material.remove(*key)));
        material.retain(|_, value| *value != false && value.as_array().is_none_or(|list| !list.is_empty()));
        escape(&words(&Value::Object(material)))
    };
    Table::of(settings["body"].as_array().map_or(&[], Vec::as_slice))
        .column("body", |body| escape(body["name"].as_str().unwrap_or_default()))
        .column("material", material)
        .column("held by", |body| lines(&body["fix"], "") + &lines(&body["spring"], "spring "))
        .column("loads", |body| lines(&body["load"], ""))
        .html(REPORT)
}

/// Return the table of the phases with a bar each, and what the inner solvers took.
fn times(report: &Report) -> String {
    let total = report.times.get("total").copied().unwrap_or_default().max(1e-9);
    let phases = ["mesh", "discretize", "set-up", "iterate", "estimate", "output", "total"];
    let phases: Vec<(&str, f64)> =
        phases.into_iter().filter_map(|phase| Some((phase, *report.times.get(phase)?))).collect();
    let bar = |share: f64| format!("<span class=\"meter\" style=\"width:{:.2}rem\"></span>", 15.0 * share);
    let inner = &report.inner_times;
    let table = Table::of(&phases)
        .column("phase", |(phase, _)| (*phase).to_owned())
        .column("#seconds", |(_, seconds)| digits(*seconds))
        .column("#peak memory so far, MB", |(phase, _)| digits(report.memory.get(*phase).copied()))
        .column("", |(_, seconds)| bar(seconds / total));
    table.html(REPORT)
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
