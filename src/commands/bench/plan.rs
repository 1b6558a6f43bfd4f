//! Which runs a benchmark makes: all combinations of what was asked for.

use super::request::{Request, usage};
use crate::commands::case_of;
use crate::commands::sweep::{axis, combinations};
use crate::error::Result;
use crate::problem::{MethodName, Order, Preset, name_of};
use crate::scene::Scene;
use std::path::PathBuf;

/// All runs.
pub(super) struct Plan {
    /// The scenes with the overrides that hold for all runs.
    pub scenes: Vec<Scene>,
    /// Their names in the table.
    pub names: Vec<String>,
    /// Keys of `--over`.
    pub keys: Vec<String>,
    /// The combinations, solvers fastest but for ranks.
    pub cases: Vec<Case>,
}

/// One combination.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// Scene file.
    pub scene: PathBuf,
    /// Columns that tell it from the others: see [`Plan::columns`].
    pub key: Vec<String>,
    /// Short names of the parts that differ within the plan.
    parts: Vec<String>,
    /// Overrides of the scene.
    pub overrides: Vec<String>,
    /// Those of them that the mesh depends on.
    pub mesh_overrides: Vec<String>,
    /// PETSc options.
    pub words: Vec<String>,
    /// MPI ranks.
    pub ranks: usize,
}

/// The method's name for one linear factor-and-solve.
pub(super) const LINEAR: &str = "linear";

/// Columns of a key besides those of `--over`.
const COLUMNS: [&str; 4] = ["solver", ASKED, "order", "ranks"];

/// Column of the method that was asked for; what ran can be another.
pub(super) const ASKED: &str = "asked";

/// An inner solver: a name in the table with its overrides of the scene and its PETSc options.
#[derive(Clone)]
struct Solver {
    name: String,
    overrides: Vec<String>,
    words: Vec<String>,
    /// Whether it factors or preconditions all of G, so that one solve by it is a yardstick.
    whole: bool,
}

impl Plan {
    /// The plan of a request.
    ///
    /// # Errors
    /// Scenes that cannot be read, lists that make no sense.
    pub fn new(request: &Request) -> Result<Self> {
        let axes = request.over.iter().map(|text| axis(text)).collect::<Result<Vec<_>>>()?;
        if axes.iter().any(|(key, _)| key == "solver") {
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
        let keys = axes.iter().map(|(key, _)| key.clone()).collect();
        let mut plan = Plan { names: names(&scenes), scenes, keys, cases: Vec::new() };
        for index in 0..plan.scenes.len() {
            for values in combinations(&axes) {
                plan.add(index, request, &values, &solvers);
            }
        }
        plan.shorten();
        Ok(plan)
    }

    /// All cases of a scene for some values of the keys.
    fn add(&mut self, index: usize, request: &Request, values: &[String], solvers: &[Solver]) {
        let scene = &self.scenes[index];
        let (orders, mut methods) = (choices(&request.orders), choices(&request.methods));
        if request.linear {
            methods.insert(0, Some(LINEAR.to_owned()));
        }
        for order in orders {
            let mut mesh = request.all_overrides();
            mesh.extend(self.keys.iter().zip(values).map(|(key, value)| format!("{key}={value}")));
            if let Some(order) = order {
                mesh.extend((0..scene.bodies.len()).map(|body| format!("body.{body}.order={order}")));
            }
            for (method, solver) in
                methods.iter().flat_map(|method| solvers.iter().map(move |solver| (method.as_deref(), solver)))
            {
                if method == Some(LINEAR) && !solver.whole {
                    continue;
                }
                for &ranks in &request.ranks {
                    let mut key = vec![self.names[index].clone()];
                    key.extend(values.iter().cloned());
                    key.extend([
                        solver.name.clone(),
                        method.map_or_else(|| name_of(&MethodName::ALL, &scene.method.name).to_owned(), str::to_owned),
                        order.map_or_else(|| orders_of(scene), |order| order.to_string()),
                        ranks.to_string(),
                    ]);
                    let mut overrides = mesh.clone();
                    overrides.extend(["output.vtu=false", "output.plots=false", "output.pairs=all"].map(str::to_owned));
                    overrides.extend(solver.overrides.iter().cloned());
                    overrides.extend(method.map(|name| match name {
                        // a sweep that is not the last, whatever the tolerance
                        LINEAR => {
                            "method={name=\"robin\", robin=\"auto\", stop={residual=1e-300, iterations=1}}".to_owned()
                        }
                        name => format!("method.name={name}"),
                    }));
                    self.cases.push(Case {
                        scene: scene.path.clone(),
                        key,
                        parts: Vec::new(),
                        overrides,
                        mesh_overrides: mesh.clone(),
                        words: [&precise(method)[..], &request.petsc, &solver.words].concat(),
                        ranks,
                    });
                }
            }
        }
    }

    /// The scene of a name.
    pub fn scene(&self, name: &str) -> Option<&Scene> {
        self.names.iter().zip(&self.scenes).find(|(known, _)| *known == name).map(|(_, scene)| scene)
    }

    /// Names of the columns of a key.
    pub fn columns(&self) -> Vec<String> {
        let keys = self.keys.iter().map(String::as_str);
        std::iter::once("scene").chain(keys).chain(COLUMNS).map(str::to_owned).collect()
    }

    /// Gives every case the parts of its key that differ within the plan, for labels.
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

/// What was asked for, one by one; once what the scene says if nothing was.
fn choices<T: Clone>(asked: &[T]) -> Vec<Option<T>> {
    if asked.is_empty() { vec![None] } else { asked.iter().cloned().map(Some).collect() }
}

/// Words for the yardstick: a solve that ends at 1e-8, unless another tolerance is typed.
fn precise(method: Option<&str>) -> Vec<String> {
    let words = ["-ksp_rtol", "1e-8"].map(str::to_owned);
    if method == Some(LINEAR) { words.to_vec() } else { Vec::new() }
}

impl Case {
    /// What tells it from the other cases of the plan.
    pub fn label(&self) -> String {
        self.parts.join(", ")
    }

    /// The method asked for.
    pub fn asked(&self) -> &str {
        &self.key[self.key.len() - 3]
    }

    /// Whether it is one linear factor-and-solve.
    pub fn is_linear(&self) -> bool {
        self.asked() == LINEAR
    }
}

/// A part of a label: names of solvers and methods stand for themselves.
pub(super) fn part(column: &str, value: &str) -> String {
    let last = column.rsplit('.').next().unwrap_or(column);
    match column {
        "scene" | "solver" | ASKED => value.to_owned(),
        "order" => format!("P{value}"),
        "ranks" => format!("{value} ranks"),
        _ => format!("{last} = {value}"),
    }
}

/// Name of each scene's case, or its path where two have the same.
fn names(scenes: &[Scene]) -> Vec<String> {
    let case = |scene: &Scene| case_of(&scene.path).to_string_lossy().into_owned();
    let name = |scene: &Scene| match scenes.iter().filter(|other| case(other) == case(scene)).count() {
        1 => case(scene),
        _ => scene.path.display().to_string(),
    };
    scenes.iter().map(name).collect()
}

fn orders_of(scene: &Scene) -> String {
    let mut orders: Vec<Order> = scene.bodies.iter().map(|body| body.order).collect();
    orders.sort();
    orders.dedup();
    orders.iter().map(|order| order.degree().to_string()).collect::<Vec<_>>().join("+")
}

/// The solvers of `--solver`; all presets if there is none.
fn solvers(typed: &[String]) -> Result<Vec<Solver>> {
    let preset = |name: &str| Solver {
        name: name.to_owned(),
        overrides: vec![format!("solver={name}")],
        words: Vec::new(),
        whole: name != "condensed",
    };
    if typed.is_empty() {
        return Ok(Preset::ALL.iter().map(|(name, _)| preset(name)).collect());
    }
    let mut solvers = Vec::new();
    for text in typed {
        if text.trim_start().starts_with('-') {
            let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            solvers.push(Solver { name: words.join(" "), overrides: Vec::new(), words, whole: true });
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
        assert_eq!(list[2].words.len(), 4);
        assert!(solvers(&["mumps,,icc".to_owned()]).is_err());
    }
}
