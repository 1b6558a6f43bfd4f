//! The command line of `winkler bench`, and the plan that it asks for: all combinations of scenes, keys, orders, methods, solvers and ranks.

use crate::commands::axes::{AxisValue, SweepAxis, combinations, named};
use crate::commands::case_of;
use crate::error::{Error, Kind, Result};
use crate::problem::{Order, Preset};
use crate::scene::Scene;
use std::path::PathBuf;

/// The runs of a benchmark.
pub(super) struct BenchPlan {
    /// The scenes with the overrides of all runs.
    pub scenes: Vec<Scene>,
    /// Their names in the table.
    pub names: Vec<String>,
    /// Names of the columns of a key: the scene, the keys of `--over`, and [`COLUMNS`].
    pub columns: Vec<String>,
    /// The combinations, ordered by scene, values of the keys, order, method, solver and ranks; the last changes first.
    pub cases: Vec<BenchCase>,
}

/// One combination.
#[derive(Debug, Clone)]
pub(super) struct BenchCase {
    pub scene: PathBuf,
    /// Values of the columns that distinguish it from other cases: those of [`BenchPlan::columns`].
    pub key: Vec<String>,
    /// A text that distinguishes it from the other cases of the plan.
    pub label: String,
    pub overrides: Vec<String>,
    /// Those overrides that the mesh depends on.
    pub mesh_overrides: Vec<String>,
    pub petsc: Vec<String>,
    /// The method that was asked for.
    pub method: String,
    pub ranks: usize,
}

/// The method's name for one linear factor-and-solve.
pub(super) const LINEAR: &str = "linear";

/// Overrides of a run with one sweep after the start, whatever the tolerance, which has a linear factor-and-solve.
const ONE_SWEEP: &str = "method={name=\"robin\", robin=\"auto\", stop={residual=1e-300, iterations=1}}";

/// The solver that has no factorisation of whole stiffness matrices, so that one solve by it is no reference cost.
const CONDENSED: &str = "condensed";

/// Columns of a key after the scene and those of `--over`.
const COLUMNS: [&str; 4] = ["solver", ASKED, "order", "ranks"];

/// Column of the method that was asked for. The method that ran can be another.
pub(super) const ASKED: &str = "asked";

/// Overrides of all runs: only tables are needed.
const OUTPUT: [&str; 3] = ["output.vtu=false", "output.plots=false", "output.pairs=all"];

impl BenchPlan {
    /// Return the plan of a request.
    ///
    /// # Errors
    /// Scenes that cannot be read, lists that make no sense.
    pub fn new(request: &BenchArgs) -> Result<Self> {
        let over = SweepAxis::all_over(&request.over)?;
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
        let overrides = request.overrides.clone();
        let scenes =
            request.scenes.iter().map(|path| crate::scene::load(path, &overrides)).collect::<Result<Vec<_>>>()?;
        let keys = over.iter().map(|axis| axis.name.as_str());
        let columns = std::iter::once("scene").chain(keys).chain(COLUMNS).map(str::to_owned).collect();
        let mut plan = BenchPlan { names: names(&scenes), scenes, columns, cases: Vec::new() };
        let (mut axes, keys) = (over, plan.keys().len());
        for index in 0..plan.scenes.len() {
            axes.truncate(keys);
            axes.extend(plan.own_axes(index, request, &solvers));
            let cases = combinations(&axes).into_iter().filter_map(|choices| plan.case(index, request, &choices));
            let cases: Vec<BenchCase> = cases.collect();
            plan.cases.extend(cases);
        }
        plan.label_cases();
        Ok(plan)
    }

    /// Return the axes of a scene behind those of `--over`, from the slowest to the fastest.
    fn own_axes(&self, index: usize, request: &BenchArgs, solvers: &[AxisValue]) -> [SweepAxis; 4] {
        let scene = &self.scenes[index];
        let of_order = |order: &usize| {
            let bodies = 0..scene.bodies.len();
            AxisValue::of_scene(order.to_string(), bodies.map(|body| format!("body.{body}.order={order}")).collect())
        };
        let of_method = |name: &String| AxisValue::of_scene(name, vec![format!("method.name={name}")]);
        let orders = choices(&request.orders, of_order, || orders_of(scene));
        let mut methods = choices(&request.methods, of_method, || scene.method.name.name().to_owned());
        if request.linear {
            // a reference cost is that of a solve to 1e-8, unless another tolerance is typed
            let petsc = ["-ksp_rtol", "1e-8"].map(str::to_owned).to_vec();
            methods.insert(0, AxisValue { petsc, ..AxisValue::of_scene(LINEAR, vec![ONE_SWEEP.to_owned()]) });
        }
        let ranks = request.ranks.iter().map(|ranks| AxisValue::of_scene(ranks.to_string(), Vec::new())).collect();
        [
            SweepAxis::new("order", orders),
            SweepAxis::new(ASKED, methods),
            SweepAxis::new("solver", solvers.to_vec()),
            SweepAxis::new("ranks", ranks),
        ]
    }

    /// Return the case of a scene with these choices of the axes; none for a reference cost of a solver that has none.
    fn case(&self, index: usize, request: &BenchArgs, choices: &[&AxisValue]) -> Option<BenchCase> {
        let (values, [order, method, solver, ranks]) = choices.split_last_chunk::<4>()?;
        if method.text == LINEAR && solver.text == CONDENSED {
            return None;
        }
        let texts = |choices: &[&AxisValue]| choices.iter().map(|choice| choice.text.clone()).collect::<Vec<_>>();
        let overrides = |choices: &[&AxisValue]| choices.iter().flat_map(|choice| choice.overrides.clone()).collect();
        let mesh_overrides: Vec<String> = [request.overrides.clone(), overrides(values), overrides(&[order])].concat();
        Some(BenchCase {
            scene: self.scenes[index].path.clone(),
            key: [vec![self.names[index].clone()], texts(values), texts(&[solver, method, order, ranks])].concat(),
            label: String::new(),
            overrides: [mesh_overrides.clone(), OUTPUT.map(str::to_owned).to_vec(), overrides(&[solver, method])]
                .concat(),
            mesh_overrides,
            // what is typed for all runs wins over the precision of a reference cost, and a solver over both
            petsc: [&method.petsc[..], &request.petsc, &solver.petsc].concat(),
            method: method.text.clone(),
            ranks: ranks.text.parse().ok()?,
        })
    }

    /// Return the scene of a name.
    pub fn scene(&self, name: &str) -> Option<&Scene> {
        self.names.iter().position(|known| known == name).map(|index| &self.scenes[index])
    }

    /// Return the keys of `--over`.
    pub fn keys(&self) -> &[String] {
        &self.columns[1..self.columns.len() - COLUMNS.len()]
    }

    /// Return the place of a column in a key.
    pub fn column(&self, name: &str) -> usize {
        self.columns.iter().position(|column| column == name).unwrap_or(0)
    }

    /// Return the columns of a key that differ between some keys.
    pub fn varied<'a>(&self, keys: impl Iterator<Item = &'a Vec<String>> + Clone) -> Vec<usize> {
        let differs = |&column: &usize| {
            let mut values = keys.clone().map(|key| &key[column]);
            let first = values.next();
            values.any(|value| Some(value) != first)
        };
        (0..self.columns.len()).filter(differs).collect()
    }

    /// Give every case its label: the values of its key that differ within the plan, or else the solver.
    fn label_cases(&mut self) {
        let mut shown = self.varied(self.cases.iter().map(|case| &case.key));
        if shown.is_empty() {
            shown.push(self.column("solver"));
        }
        let columns = &self.columns;
        for case in &mut self.cases {
            let parts: Vec<String> =
                shown.iter().map(|&column| part(&columns[column], &case.key[column], columns)).collect();
            case.label = parts.join(", ");
        }
    }
}

/// Return a choice for each of the `requested` values, or the scene's own one, which changes nothing, if there are none.
fn choices<T>(requested: &[T], choice: impl Fn(&T) -> AxisValue, own: impl Fn() -> String) -> Vec<AxisValue> {
    match requested {
        [] => vec![AxisValue::of_scene(own(), Vec::new())],
        _ => requested.iter().map(choice).collect(),
    }
}

impl BenchCase {
    /// Return whether it is one linear factor-and-solve.
    pub fn is_linear(&self) -> bool {
        self.method == LINEAR
    }
}

/// Return the value of one of the columns as a part of a label. Scenes, solvers and methods need no name.
pub(super) fn part(column: &str, value: &str, columns: &[String]) -> String {
    match column {
        "scene" | "solver" | ASKED => value.to_owned(),
        "order" => format!("P{value}"),
        "ranks" => format!("{value} ranks"),
        _ => named(column, value, columns),
    }
}

/// Return whether a column is a key of the mesh.
pub(super) fn is_of_mesh(column: &str) -> bool {
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
    let mut orders: Vec<Order> = scene.bodies.iter().map(|body| body.order).collect();
    orders.sort();
    orders.dedup();
    orders.iter().map(|order| order.degree().to_string()).collect::<Vec<_>>().join("+")
}

/// Return the solvers of `--solver`, or all presets if there is none.
fn solvers(typed: &[String]) -> Result<Vec<AxisValue>> {
    let preset = |name: &str| AxisValue::of_scene(name, vec![format!("solver={name}")]);
    if typed.is_empty() {
        return Ok(Preset::ALL.iter().map(|(name, _)| preset(name)).collect());
    }
    let mut solvers = Vec::new();
    for text in typed {
        if text.trim_start().starts_with('-') {
            let petsc: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            solvers.push(AxisValue { petsc: petsc.clone(), ..AxisValue::of_scene(petsc.join(" "), Vec::new()) });
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

/// The command line of `winkler bench`.
#[derive(clap::Args)]
pub struct BenchArgs {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<PathBuf>,
    /// Folder for the results [default: bench in that of solve]
    #[arg(short = 'o', value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// Key and its values, for example mesh.set.n=16,32,64; may be repeated
    #[arg(long, value_name = "KEY=V1,V2,...")]
    pub over: Vec<String>,
    /// Inner solvers: mumps,hypre,... or one string of PETSc options; may be repeated [default: all presets]
    #[arg(long = "solver", value_name = "LIST|OPTIONS", allow_hyphen_values = true)]
    pub solvers: Vec<String>,
    /// Methods [default: the scene's]
    #[arg(long = "method", value_name = "LIST", value_delimiter = ',')]
    pub methods: Vec<String>,
    /// Element orders of all bodies [default: the scene's]
    #[arg(long = "order", value_name = "LIST", value_delimiter = ',')]
    pub orders: Vec<usize>,
    /// Numbers of MPI ranks
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1")]
    pub ranks: Vec<usize>,
    /// Runs of each combination; times are their medians
    #[arg(long, value_name = "N", default_value = "1")]
    pub repeat: usize,
    /// Contact table, or folder of results, that errors are measured against
    #[arg(long, value_name = "PATH")]
    pub against: Option<PathBuf>,
    /// Seconds after which a run is ended
    #[arg(long, value_name = "S", default_value = "3600", allow_negative_numbers = true)]
    pub timeout: f64,
    /// Seconds after which no further run begins
    #[arg(long, value_name = "S", default_value = "inf", allow_negative_numbers = true)]
    pub budget: f64,
    /// Also measure one linear factor-and-solve of the same bodies
    #[arg(long)]
    pub linear: bool,
    /// Keep the rows that the folder has already
    #[arg(long)]
    pub resume: bool,
    /// Replace a key of the scene in all runs; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Print errors, warnings and the folder of the results only
    #[arg(short, long)]
    pub quiet: bool,
    /// PETSc options for every run.
    #[arg(skip)]
    pub petsc: Vec<String>,
}

/// Return a refusal of the command line.
pub(super) fn usage(message: impl Into<String>) -> Error {
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
