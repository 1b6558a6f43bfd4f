//! `winkler bench`: run a scene with every mesh, order, inner solver, method and number of ranks that was asked for, each in a process of its
//! own. Times, memory, counters and errors are written as a table and plots.

mod compare;
mod plots;
mod process;

use super::cases::{Axis, AxisValue, Case, Plan};
use super::rows::{Row, aligned};
use super::{case_of, folder_of};
use crate::error::{Error, Kind, Result};
use crate::interrupt::Interrupt;
use crate::output::{Folder, RowFile, say, sci, seconds, terminal};
use crate::petsc::Session;
use crate::problem::{Order, Preset};
use crate::scene::Scene;
use compare::{PairPoints, difference};
use process::Runner;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The command line of `winkler bench`.
#[derive(clap::Args)]
pub struct BenchArgs {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,
    /// Folder for the results [default: bench in that of solve]
    #[arg(short = 'o', value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Key and its values, for example mesh.set.n=16,32,64; may be repeated
    #[arg(long, value_name = "KEY=V1,V2,...")]
    over: Vec<String>,
    /// Inner solvers: mumps,hypre,... or one string of PETSc options; may be repeated [default: all presets]
    #[arg(long = "solver", value_name = "LIST|OPTIONS", allow_hyphen_values = true)]
    solvers: Vec<String>,
    /// Methods [default: the scene's]
    #[arg(long = "method", value_name = "LIST", value_delimiter = ',')]
    methods: Vec<String>,
    /// Element orders of all bodies [default: the scene's]
    #[arg(long = "order", value_name = "LIST", value_delimiter = ',')]
    orders: Vec<usize>,
    /// Numbers of MPI ranks
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1")]
    ranks: Vec<usize>,
    /// Runs of each combination; times are their medians
    #[arg(long, value_name = "N", default_value = "1")]
    repeat: usize,
    /// Folder of results of the same scene, on a finer mesh, that errors are measured against
    #[arg(long, value_name = "DIR")]
    against: Option<PathBuf>,
    /// Seconds after which a run is ended
    #[arg(long, value_name = "S", default_value = "3600", allow_negative_numbers = true)]
    timeout: f64,
    /// Replace a key of the scene in all runs; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Print errors, warnings and the folder of the results only
    #[arg(short, long)]
    quiet: bool,
    /// PETSc options for every run.
    #[arg(skip)]
    pub petsc: Vec<String>,
}

/// Overrides of all runs: only tables are needed.
const OUTPUT: [&str; 3] = ["output.vtu=false", "output.plots=false", "output.pairs=all"];

/// Axes after those of `--over`.
const COLUMNS: [&str; 4] = ["order", "asked", "solver", "ranks"];

/// The row of a case.
struct Measured {
    case: Case,
    row: Row,
}

/// The scenes of a benchmark and its cases.
struct Benchmark {
    /// The scenes with the overrides of all runs.
    scenes: Vec<Scene>,
    /// Their names in the table.
    names: Vec<String>,
    plan: Plan,
}

/// Run all combinations, and write `bench.csv` row by row and the plots at the end.
///
/// Return the exit code: 1 if a run did not converge, was refused or did not end in time.
///
/// # Errors
/// Command lines that make no sense, scenes that cannot be read, a folder that cannot be written, a signal. A failure of a run is no error,
/// but a row.
pub fn bench(interrupt: &Interrupt, request: &BenchArgs) -> Result<i32> {
    interrupt.hold();
    if Session::is_one_of_several() {
        return Err(usage("`bench` starts the ranks of its runs itself").help("`--ranks 1,2` instead of mpiexec"));
    }
    let bench = Benchmark::new(request)?;
    let reference = bench.reference(request)?;
    let folder = Folder::claim(bench.folder(request))?;
    let runner = Runner::new(interrupt, request.timeout, request.repeat, folder.path())?;
    let header = [bench.plan.columns.clone(), Row::columns()].concat();
    let mut file = RowFile::create(&folder, "bench.csv", &header)?;
    let bar = terminal::runs(bench.plan.cases.len(), !request.quiet);
    let (mut rows, mut meshed) = (Vec::new(), BTreeSet::new());
    for case in &bench.plan.cases {
        bar.set_message(case.label.clone());
        let row = match bench.is_beyond(case, &rows) {
            true => Row::unsolved("skipped", "an earlier mesh took too long"),
            false => bench.measure(case, &runner, reference.as_deref(), &mut meshed)?,
        };
        if !(request.quiet && row.is_good()) {
            bar.suspend(|| say(row.line(&case.label)))?;
        }
        // written at once, so that it is kept whatever comes next
        file.push(&[case.key.clone(), row.fields()].concat());
        rows.push(Measured { case: case.clone(), row });
        bar.inc(1);
    }
    bar.finish_and_clear();
    file.finish()?;
    bench.compare_with_finest(&mut rows, &runner);
    let mut file = RowFile::create(&folder, "bench.csv", &header)?;
    rows.iter().for_each(|Measured { case, row }| file.push(&[case.key.clone(), row.fields()].concat()));
    file.finish()?;
    for (name, plot) in plots::plots(&rows, &bench) {
        folder.write(&name, |out| plot.write(out))?;
    }
    if !request.quiet {
        say(bench.summary(&rows))?;
    }
    say(format_args!("results in {}", folder.path().display()))?;
    Ok(i32::from(!rows.iter().all(|measured| measured.row.is_good())))
}

impl Benchmark {
    /// Return the cases of a request.
    ///
    /// # Errors
    /// Scenes that cannot be read, lists that make no sense.
    fn new(request: &BenchArgs) -> Result<Self> {
        let over = request.over.iter().map(|text| Axis::over(text)).collect::<Result<Vec<_>>>()?;
        if over.iter().any(|axis| axis.name == "solver") {
            return Err(usage("`--over solver=...` would hide the solvers of the table").help("--solver mumps,hypre"));
        }
        let solvers = solvers(&request.solvers)?;
        if request.ranks.contains(&0) || request.repeat == 0 {
            return Err(usage("`--ranks` and `--repeat` begin at 1"));
        }
        if let Some(order) = request.orders.iter().find(|order| !matches!(order, 1 | 2)) {
            return Err(usage(format!("there are no elements of order {order}")).help("--order 1,2"));
        }
        let common = &request.overrides;
        let scenes = request.scenes.iter().map(|path| crate::scene::load(path, common)).collect::<Result<Vec<_>>>()?;
        let names = names(&scenes);
        let keys = over.iter().map(|axis| axis.name.as_str());
        let mut plan = Plan::new(["scene"].into_iter().chain(keys).chain(COLUMNS).map(str::to_owned).collect());
        let output = OUTPUT.map(str::to_owned);
        for (scene, name) in scenes.iter().zip(&names) {
            let mut axes = vec![Axis::new("scene", vec![AxisValue::new(name, Vec::new())])];
            axes.extend(over.iter().map(|axis| Axis::new(&axis.name, axis.values.clone())));
            axes.extend(own_axes(scene, request, &solvers));
            plan.add(scene.path.clone(), &axes, &[&common[..], &output].concat(), &request.petsc);
        }
        plan.label_cases(plan.columns.len() - 2);
        Ok(Self { scenes, names, plan })
    }

    /// Return the folder of the results: that of `-o`, else `bench` in that of the only scene, else `results/bench`.
    fn folder(&self, request: &BenchArgs) -> PathBuf {
        match (&request.folder, &self.scenes[..]) {
            (Some(folder), _) => folder.clone(),
            (None, [scene]) => folder_of(scene, None).join("bench"),
            (None, _) => PathBuf::from("results/bench"),
        }
    }

    /// Return the contact tables of `--against`.
    fn reference(&self, request: &BenchArgs) -> Result<Option<Vec<PairPoints>>> {
        let Some(folder) = &request.against else { return Ok(None) };
        let [scene] = &self.scenes[..] else { return Err(usage("`--against` goes with one scene")) };
        let found = compare::tables(folder)?;
        let (tables, pairs) = (found.len(), scene.contacts.len());
        if found.is_empty() || (scene.auto.is_empty() && tables != pairs) {
            let message = format!("{} has {tables} contact tables, the scene {pairs} pairs", folder.display());
            return Err(usage(message).help("give the folder of results of the same scene"));
        }
        Ok(Some(found))
    }

    /// Return the scene of a case.
    fn scene(&self, case: &Case) -> &Scene {
        let place = self.names.iter().position(|name| *name == case.key[0]);
        &self.scenes[place.unwrap_or(0)]
    }

    /// Return whether a case differs only by its mesh from a row that did not end in time. Lists of meshes go from coarse to fine.
    fn is_beyond(&self, case: &Case, rows: &[Measured]) -> bool {
        let columns = &self.plan.columns;
        let is_like = |key: &[String]| (0..columns.len()).all(|k| is_of_mesh(&columns[k]) || key[k] == case.key[k]);
        rows.iter().any(|measured| measured.row.status == "timeout" && is_like(&measured.case.key))
    }

    /// Run a case as often as asked for, and return its row. `meshed` has the overrides of meshes that are in the cache.
    fn measure(
        &self,
        case: &Case,
        runner: &Runner,
        reference: Option<&[PairPoints]>,
        meshed: &mut BTreeSet<Vec<String>>,
    ) -> Result<Row> {
        let scene = match crate::scene::load(&case.scene, &case.overrides) {
            Ok(scene) => scene,
            Err(error) => {
                let help = error.advice().map_or(String::new(), |help| format!("; help: {help}"));
                return Ok(Row::unsolved("refused", &format!("error: {}{help}", error.message())));
            }
        };
        // the mesh is made before times are measured
        let solving = |text: &&String| ["method", "solver", "output"].iter().any(|key| text.starts_with(key));
        let mesh: Vec<String> = case.overrides.iter().filter(|text| !solving(text)).cloned().collect();
        if meshed.insert([vec![case.scene.display().to_string()], mesh.clone()].concat()) {
            runner.mesh(case, &mesh)?;
        }
        let ranks = self.plan.value(case, "ranks").parse().unwrap_or(1);
        let mut row = runner.repeat(case, ranks)?;
        let tables = compare::tables(&runner.folder(case)).unwrap_or_default();
        if row.is_good() {
            let against = reference.and_then(|reference| difference(scene.dimension.value, &tables, reference));
            if let Some(error) = against {
                row.set_error(error, "pressure, --against");
            } else if row.error.is_none()
                && let Some(error) = compare::closed_form(&scene, &tables)
            {
                row.set_error(error, "pressure, reference");
            }
        }
        Ok(row)
    }

    /// Set the error of every row that has none, against the row of the finest mesh with the same values of all keys that are not of the mesh.
    ///
    /// Rows of the finest mesh have no error. Of several rows with as many dofs and the same order, the one with the smallest residual is the
    /// reference.
    fn compare_with_finest(&self, rows: &mut [Measured], runner: &Runner) {
        let keys = self.plan.columns.len() - COLUMNS.len();
        let is_alike =
            |a: &Case, b: &Case| (0..keys).all(|k| is_of_mesh(&self.plan.columns[k]) || a.key[k] == b.key[k]);
        let fineness = |measured: &Measured| (measured.row.dofs, self.plan.value(&measured.case, "order").to_owned());
        let residual = |measured: &Measured| measured.row.residual.unwrap_or(f64::INFINITY);
        let mut found = Vec::new();
        for (index, own) in rows.iter().enumerate().filter(|(_, own)| own.row.is_good() && own.row.error.is_none()) {
            let group = rows.iter().filter(|other| other.row.is_good() && is_alike(&own.case, &other.case));
            let finest = group.max_by(|a, b| fineness(a).cmp(&fineness(b)).then(residual(b).total_cmp(&residual(a))));
            let Some(finest) = finest.filter(|finest| fineness(finest) != fineness(own)) else { continue };
            let [run, reference] =
                [own, finest].map(|measured| compare::tables(&runner.folder(&measured.case)).unwrap_or_default());
            let error = difference(self.scene(&own.case).dimension.value, &run, &reference);
            let of = format!("pressure, mesh of {} dofs", finest.row.dofs.unwrap_or_default());
            found.extend(error.map(|error| (index, error, of)));
        }
        found.into_iter().for_each(|(index, error, of)| rows[index].row.set_error(error, of));
    }

    /// Return the table with one line for each row: the values that distinguish it, the method that ran, and the numbers that some row has.
    fn summary(&self, rows: &[Measured]) -> String {
        let mut named = self.plan.varied(rows.iter().map(|measured| &measured.case.key));
        named.retain(|&column| self.plan.columns[column] != "asked");
        let numbers: Vec<_> =
            SHOWN.iter().filter(|shown| rows.iter().any(|row| (shown.text)(&row.row).is_some())).collect();
        let heads = named.iter().map(|&column| self.plan.columns[column].as_str()).chain(["method", "status"]);
        let mut lines: Vec<Vec<String>> =
            vec![heads.chain(numbers.iter().map(|shown| shown.heading)).map(str::to_owned).collect()];
        for Measured { case, row } in rows {
            let words = named.iter().map(|&column| case.key[column].clone());
            let words = words.chain([row.method.clone(), row.status.clone()]);
            lines.push(words.chain(numbers.iter().map(|shown| (shown.text)(row).unwrap_or_default())).collect());
        }
        aligned(&lines, named.len() + 2)
    }
}

/// A column of the table on the terminal.
struct Shown {
    heading: &'static str,
    text: fn(&Row) -> Option<String>,
}

const SHOWN: [Shown; 8] = [
    Shown { heading: "dofs", text: |row| row.dofs.map(|count| count.to_string()) },
    Shown { heading: "iterations", text: |row| row.iterations.map(|count| count.to_string()) },
    Shown { heading: "sweeps", text: |row| row.sweeps.map(|count| count.to_string()) },
    Shown { heading: "inner iterations", text: |row| row.inner_iterations.map(|count| count.to_string()) },
    Shown { heading: "s", text: |row| row.seconds.map(seconds) },
    Shown { heading: "CPU s", text: |row| row.cpu_seconds.map(seconds) },
    Shown { heading: "MB", text: |row| row.memory_mb.map(|memory| format!("{memory:.0}")) },
    Shown { heading: "error", text: |row| row.error.map(|error| sci(error, 2)) },
];

/// Return the axes of a scene behind those of `--over`, from the slowest to the fastest, in the order of [`COLUMNS`].
fn own_axes(scene: &Scene, request: &BenchArgs, solvers: &[AxisValue]) -> [Axis; 4] {
    let of_order = |order: &usize| {
        let bodies = 0..scene.bodies.len();
        AxisValue::new(order.to_string(), bodies.map(|body| format!("body.{body}.order={order}")).collect())
    };
    let of_method = |name: &String| AxisValue::new(name, vec![format!("method.name={name}")]);
    let mut orders: Vec<AxisValue> = request.orders.iter().map(of_order).collect();
    let mut methods: Vec<AxisValue> = request.methods.iter().map(of_method).collect();
    // without a list the scene's own
    if orders.is_empty() {
        orders.push(AxisValue::new(orders_of(scene), Vec::new()));
    }
    if methods.is_empty() {
        methods.push(AxisValue::new(scene.method.name.name(), Vec::new()));
    }
    let ranks = request.ranks.iter().map(|ranks| AxisValue::new(ranks.to_string(), Vec::new())).collect();
    let values = [orders, methods, solvers.to_vec(), ranks];
    let mut axes = COLUMNS.iter().zip(values).map(|(name, values)| Axis::new(name, values));
    std::array::from_fn(|_| axes.next().unwrap_or_else(|| unreachable!("four of each")))
}

/// Return whether a column is a key of the mesh.
fn is_of_mesh(column: &str) -> bool {
    column.starts_with("mesh.")
}

/// Return the name of each scene's case, or its path where two scenes have the same name.
fn names(scenes: &[Scene]) -> Vec<String> {
    let case = |scene: &Scene| case_of(&scene.path).to_string_lossy().into_owned();
    let name = |scene: &Scene| match scenes.iter().filter(|other| case(other) == case(scene)).count() {
        1 => case(scene),
        _ => scene.path.display().to_string(),
    };
    scenes.iter().map(name).collect()
}

/// Return the element orders of a scene, joined by `+`.
fn orders_of(scene: &Scene) -> String {
    let orders: BTreeSet<Order> = scene.bodies.iter().map(|body| body.order).collect();
    orders.iter().map(|order| order.degree().to_string()).collect::<Vec<_>>().join("+")
}

/// Return the solvers of `--solver`, or all presets if there is none.
fn solvers(typed: &[String]) -> Result<Vec<AxisValue>> {
    let preset = |name: &str| AxisValue::new(name, vec![format!("solver={name}")]);
    if typed.is_empty() {
        return Ok(Preset::ALL.iter().map(|(name, _)| preset(name)).collect());
    }
    let mut solvers = Vec::new();
    for text in typed {
        if text.trim_start().starts_with('-') {
            let petsc: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            solvers.push(AxisValue { text: petsc.join(" "), overrides: Vec::new(), petsc });
            continue;
        }
        for name in text.split(',').map(str::trim) {
            if name.is_empty() {
                return Err(usage(format!("`--solver {text}` has an empty name")).help("--solver mumps,hypre"));
            }
            solvers.push(preset(name));
        }
    }
    Ok(solvers)
}

/// Return a refusal of the command line.
fn usage(message: impl Into<String>) -> Error {
    Error::new(Kind::Usage, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn option_strings_stay_whole_and_names_are_split() {
        let list = solvers(&["mumps, hypre".to_owned(), "-pc_type icc -ksp_rtol 1e-9,5".to_owned()]).expect("solvers");
        let names: Vec<&str> = list.iter().map(|solver| solver.text.as_str()).collect();
        assert_eq!(names, ["mumps", "hypre", "-pc_type icc -ksp_rtol 1e-9,5"]);
        assert_eq!(list[2].petsc.len(), 4);
        assert!(solvers(&["mumps,,icc".to_owned()]).is_err());
    }
}
