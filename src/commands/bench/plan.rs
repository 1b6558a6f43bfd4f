//! The plan of a benchmark: all combinations of scenes, keys, orders, methods, solvers and ranks.

use super::request::{Request, usage};
use crate::commands::{Variation, case_of, combinations};
use crate::error::Result;
use crate::problem::{Order, Preset};
use crate::scene::Scene;
use std::path::PathBuf;

/// The runs of a benchmark.
pub(super) struct Plan {
    /// The scenes with the overrides of all runs.
    pub scenes: Vec<Scene>,
    /// Their names in the table.
    pub names: Vec<String>,
    /// Keys of `--over`.
    pub keys: Vec<String>,
    /// The combinations, ordered by scene, values of the keys, order, method, solver and ranks; the last changes first.
    pub cases: Vec<Case>,
}

/// One combination.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// Scene file.
    pub scene: PathBuf,
    /// Values of the columns that distinguish it from other cases: see [`Plan::columns`].
    pub key: Vec<String>,
    /// Short texts of those values that differ within the plan.
    parts: Vec<String>,
    /// Overrides of the scene.
    pub overrides: Vec<String>,
    /// Those overrides that the mesh depends on.
    pub mesh_overrides: Vec<String>,
    /// PETSc options.
    pub petsc: Vec<String>,
    /// Number of MPI ranks.
    pub ranks: usize,
}

/// The method's name for one linear factor-and-solve.
pub(super) const LINEAR: &str = "linear";

/// Columns of a key after the scene and those of `--over`.
const COLUMNS: [&str; 4] = ["solver", ASKED, "order", "ranks"];

/// Column of the method that was asked for. The method that ran can be another.
pub(super) const ASKED: &str = "asked";

/// An inner solver: a name in the table with its overrides of the scene and its PETSc options.
#[derive(Clone)]
struct Solver {
    name: String,
    overrides: Vec<String>,
    petsc: Vec<String>,
    /// Whether it factors or preconditions whole stiffness matrices, so that one solve by it is a reference cost.
    is_whole: bool,
}

/// The choices that make a case of a scene and a mesh.
struct Choice<'a> {
    /// Values of the keys.
    values: &'a [String],
    /// Element order of all bodies, if it is not the scene's.
    order: Option<usize>,
    /// Method, if it is not the scene's.
    method: Option<&'a str>,
    solver: &'a Solver,
    ranks: usize,
}

impl Plan {
    /// Return the plan of a request.
    ///
    /// # Errors
    /// Scenes that cannot be read, lists that make no sense.
    pub fn new(request: &Request) -> Result<Self> {
        let variations = request.over.iter().map(|text| Variation::parse(text)).collect::<Result<Vec<_>>>()?;
        if variations.iter().any(|variation| variation.key == "solver") {
            return Err(usage("`--over solver=...` would hide the solvers of the table").help("--solver mumps,hypre"));
        }
        let solvers = solvers(&request.solvers)?;
        if request.ranks.contains(&0) || request.repeat == 0 {
            return Err(usage("`--ranks` and `--repeat` begin at 1"));
        }
        if let Some(order) = request.orders.iter().find(|order| !matches!(order, 1 | 2)) {
            return Err(usage(format!("there are no elements of order {order}")).help("--order 1,2"));
        }
        let overrides = request.all_overrides();
        let scenes =
            request.scenes.iter().map(|path| crate::scene::load(path, &overrides)).collect::<Result<Vec<_>>>()?;
        let keys = variations.iter().map(|variation| variation.key.clone()).collect();
        let mut plan = Plan { names: names(&scenes), scenes, keys, cases: Vec::new() };
        for index in 0..plan.scenes.len() {
            for values in combinations(&variations) {
                plan.add(index, request, &values, &solvers);
            }
        }
        plan.shorten();
        Ok(plan)
    }

    /// Add all cases of a scene for some values of the keys.
    fn add(&mut self, index: usize, request: &Request, values: &[String], solvers: &[Solver]) {
        let (orders, mut methods) = (choices(&request.orders), choices(&request.methods));
        if request.linear {
            methods.insert(0, Some(LINEAR.to_owned()));
        }
        for order in orders {
            let mut mesh = request.all_overrides();
            mesh.extend(self.keys.iter().zip(values).map(|(key, value)| format!("{key}={value}")));
            if let Some(order) = order {
                mesh.extend((0..self.scenes[index].bodies.len()).map(|body| format!("body.{body}.order={order}")));
            }
            for method in methods.iter().map(Option::as_deref) {
                for solver in solvers.iter().filter(|solver| method != Some(LINEAR) || solver.is_whole) {
                    for &ranks in &request.ranks {
                        let choice = Choice { values, order, method, solver, ranks };
                        let case = self.case(index, &mesh, &request.petsc, &choice);
                        self.cases.push(case);
                    }
                }
            }
        }
    }

    /// Return a case of a scene.
    fn case(&self, index: usize, mesh_overrides: &[String], petsc: &[String], choice: &Choice) -> Case {
        let scene = &self.scenes[index];
        let &Choice { values, order, method, solver, ranks } = choice;
        let mut key = vec![self.names[index].clone()];
        key.extend(values.iter().cloned());
        key.extend([
            solver.name.clone(),
            method.map_or_else(|| scene.method.name.name().to_owned(), str::to_owned),
            order.map_or_else(|| orders_of(scene), |order| order.to_string()),
            ranks.to_string(),
        ]);
        let mut overrides = mesh_overrides.to_vec();
        overrides.extend(["output.vtu=false", "output.plots=false", "output.pairs=all"].map(str::to_owned));
        overrides.extend(solver.overrides.iter().cloned());
        overrides.extend(method.map(|name| match name {
            // one sweep after the start, whatever the tolerance
            LINEAR => "method={name=\"robin\", robin=\"auto\", stop={residual=1e-300, iterations=1}}".to_owned(),
            name => format!("method.name={name}"),
        }));
        // a reference cost is that of a solve to 1e-8, unless another tolerance is typed
        let precise: &[&str] = if method == Some(LINEAR) { &["-ksp_rtol", "1e-8"] } else { &[] };
        let precise = precise.iter().map(|&word| word.to_owned());
        Case {
            scene: scene.path.clone(),
            key,
            parts: Vec::new(),
            overrides,
            mesh_overrides: mesh_overrides.to_vec(),
            petsc: precise.chain(petsc.iter().chain(&solver.petsc).cloned()).collect(),
            ranks,
        }
    }

    /// Return the scene of a name.
    pub fn scene(&self, name: &str) -> Option<&Scene> {
        self.names.iter().position(|known| known == name).map(|index| &self.scenes[index])
    }

    /// Return the names of the columns of a key.
    pub fn columns(&self) -> Vec<String> {
        let keys = self.keys.iter().map(String::as_str);
        std::iter::once("scene").chain(keys).chain(COLUMNS).map(str::to_owned).collect()
    }

    /// Give every case the parts of its label: the values of its key that differ within the plan.
    fn shorten(&mut self) {
        let columns = self.columns();
        let differs: Vec<bool> = (0..columns.len())
            .map(|column| self.cases.iter().any(|case| case.key[column] != self.cases[0].key[column]))
            .collect();
        for case in &mut self.cases {
            let parts = columns.iter().zip(&case.key).zip(&differs);
            case.parts = parts.filter(|(_, differs)| **differs).map(|((name, value), _)| part(name, value)).collect();
            if case.parts.is_empty() {
                case.parts.push(case.key[columns.len() - 4].clone());
            }
        }
    }
}

/// Return the requested choices, or one `None`, the scene's own choice, if there are none.
fn choices<T: Clone>(requested: &[T]) -> Vec<Option<T>> {
    if requested.is_empty() { vec![None] } else { requested.iter().cloned().map(Some).collect() }
}

impl Case {
    /// Return a text that distinguishes it from the other cases of the plan.
    pub fn label(&self) -> String {
        self.parts.join(", ")
    }

    /// Return the method that was asked for.
    pub fn requested_method(&self) -> &str {
        &self.key[self.key.len() - 3]
    }

    /// Return whether it is one linear factor-and-solve.
    pub fn is_linear(&self) -> bool {
        self.requested_method() == LINEAR
    }
}

/// Return a part of a label. Scenes, solvers and methods need no name of their column.
pub(super) fn part(column: &str, value: &str) -> String {
    let last = column.rsplit('.').next().unwrap_or(column);
    match column {
        "scene" | "solver" | ASKED => value.to_owned(),
        "order" => format!("P{value}"),
        "ranks" => format!("{value} ranks"),
        _ => format!("{last} = {value}"),
    }
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
fn solvers(typed: &[String]) -> Result<Vec<Solver>> {
    let preset = |name: &str| Solver {
        name: name.to_owned(),
        overrides: vec![format!("solver={name}")],
        petsc: Vec::new(),
        is_whole: name != "condensed",
    };
    if typed.is_empty() {
        return Ok(Preset::ALL.iter().map(|(name, _)| preset(name)).collect());
    }
    let mut solvers = Vec::new();
    for text in typed {
        if text.trim_start().starts_with('-') {
            let petsc: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            solvers.push(Solver { name: petsc.join(" "), overrides: Vec::new(), petsc, is_whole: true });
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn option_strings_stay_whole_and_names_are_split() {
        let list = solvers(&["mumps, hypre".to_owned(), "-pc_type icc -ksp_rtol 1e-9,5".to_owned()]).expect("solvers");
        let names: Vec<&str> = list.iter().map(|solver| solver.name.as_str()).collect();
        assert_eq!(names, ["mumps", "hypre", "-pc_type icc -ksp_rtol 1e-9,5"]);
        assert_eq!(list[2].petsc.len(), 4);
        assert!(solvers(&["mumps,,icc".to_owned()]).is_err());
    }
}
