//! The command line of `winkler bench`, and the cases that it asks for.

use crate::commands::cases::{AxisValue, Case, CaseAxis, CasePlan};
use crate::commands::rows::CaseRow;
use crate::commands::{case_of, folder_of};
use crate::error::{Error, Kind, Result};
use crate::problem::{MeshSource, Order, Preset};
use crate::scene::Scene;
use std::collections::BTreeSet;
use std::path::PathBuf;

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
    /// Folder of results of the same scene, on a finer mesh, that errors are measured against
    #[arg(long, value_name = "DIR")]
    pub against: Option<PathBuf>,
    /// Seconds after which a run is ended
    #[arg(long, value_name = "S", default_value = "3600", allow_negative_numbers = true)]
    pub timeout: f64,
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

/// Overrides of all runs: only tables are needed.
const OUTPUT: [&str; 3] = ["output.vtu=false", "output.plots=false", "output.pairs=all"];

/// Axes after those of `--over`.
pub(super) const COLUMNS: [&str; 4] = ["order", "asked", "solver", "ranks"];

/// The row of a case.
pub(super) struct Measured {
    pub case: Case,
    pub row: CaseRow,
}

/// The scenes of a benchmark and its cases.
pub(super) struct Benchmark {
    /// The scenes with the overrides of all runs.
    pub scenes: Vec<Scene>,
    /// Their names in the table.
    pub names: Vec<String>,
    pub plan: CasePlan,
}

impl Benchmark {
    /// Return the cases of a request.
    ///
    /// # Errors
    /// Scenes that cannot be read, lists that make no sense.
    pub fn new(request: &BenchArgs) -> Result<Self> {
        let over = request.over.iter().map(|text| CaseAxis::over(text)).collect::<Result<Vec<_>>>()?;
        if over.iter().any(|axis| axis.name == "solver") {
            return Err(usage("`--over solver=...` would hide the solvers of the table").help("--solver mumps,hypre"));
        }
        let solvers = solvers(&request.solvers)?;
        if request.ranks.contains(&0) || request.repeat == 0 {
            return Err(usage("`--ranks` and `--repeat` begin at 1"));
        }
        if let Some(order) = request.orders.iter().find(|order| Order::new(**order).is_none()) {
            let most = format!("--order 1,2 in space, up to {} in the plane", Order::HIGHEST);
            return Err(usage(format!("there are no elements of order {order}")).help(most));
        }
        let common = &request.overrides;
        let scenes = request.scenes.iter().map(|path| crate::scene::load(path, common)).collect::<Result<Vec<_>>>()?;
        let names = names(&scenes);
        let keys = over.iter().map(|axis| axis.name.as_str());
        let mut plan = CasePlan::new(["scene"].into_iter().chain(keys).chain(COLUMNS).map(str::to_owned).collect());
        let output = OUTPUT.map(str::to_owned);
        for (scene, name) in scenes.iter().zip(&names) {
            let mut axes = vec![CaseAxis::new("scene", vec![AxisValue::new(name, Vec::new())])];
            axes.extend(over.iter().map(|axis| CaseAxis::new(&axis.name, axis.values.clone())));
            axes.extend(own_axes(scene, request, &solvers));
            plan.add(scene.path.clone(), &axes, &[&common[..], &output].concat(), &request.petsc);
        }
        plan.label_cases(plan.columns.len() - 2);
        Ok(Self { scenes, names, plan })
    }

    /// Return the folder of the results: that of `-o`, else `bench` in that of the only scene, else `results/bench`.
    pub fn folder(&self, request: &BenchArgs) -> PathBuf {
        match (&request.folder, &self.scenes[..]) {
            (Some(folder), _) => folder.clone(),
            (None, [scene]) => folder_of(scene, None).join("bench"),
            (None, _) => PathBuf::from("results/bench"),
        }
    }
}

/// Return the axes of a scene behind those of `--over`, from the slowest to the fastest, in the order of [`COLUMNS`].
fn own_axes(scene: &Scene, request: &BenchArgs, solvers: &[AxisValue]) -> impl Iterator<Item = CaseAxis> {
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
    COLUMNS.into_iter().zip(values).map(|(name, values)| CaseAxis::new(name, values))
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

/// Return the element orders of a scene, joined by `+`; the order of a mesh file is not known.
fn orders_of(scene: &Scene) -> String {
    let default = matches!(scene.mesh, MeshSource::Geo(_)).then(Order::default);
    let orders: BTreeSet<_> = scene.bodies.iter().map(|body| body.order.or(default)).collect();
    let word = |order: Option<Order>| order.map_or("file".to_owned(), |order| order.degree().to_string());
    orders.into_iter().map(word).collect::<Vec<_>>().join("+")
}

/// Return the solvers of `--solver`, or all presets if there is none.
fn solvers(typed: &[String]) -> Result<Vec<AxisValue>> {
    let preset = |name: &str| AxisValue::new(name, vec![format!("solver={name}")]);
    if typed.is_empty() {
        return Ok(Preset::ALL.iter().map(|known| preset(&known.name())).collect());
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
