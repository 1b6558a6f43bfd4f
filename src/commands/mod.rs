//! The commands, one file each: `solve`, `check`, `sweep`, `bench`, `mesh`, `new`. This file has what
//! several of them take from the command line and print. What they share with the library is in [`crate::run`].

mod adapt;
pub(crate) mod bench;
mod cases;
pub(crate) mod check;
pub mod checkpoint;
pub(crate) mod mesh;
pub(crate) mod new;
mod plots;
mod rows;
mod shapes;
mod shortfall;
pub(crate) mod solve;
pub(crate) mod sweep;
mod write;

use crate::error::Result;
use crate::exchange::broadcast;
use crate::output::LISTED;
use crate::output::terminal::ProgressLine;
use crate::parallel::{Ranks, collectively};
use crate::petsc::Session;
use crate::problem::MethodName;
use crate::run::report::{GatheredCounters, solvers_in_words};
use crate::run::{self, Clock, Prepared};
use crate::scene::{Flags, Scene};
use clap::Args;
use std::cell::RefCell;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The options that say how much a command prints.
#[derive(Args)]
pub struct VerbosityArgs {
    /// Print errors, warnings and the folder of the results only
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,
    /// Print what is decided and why, with the PETSc options of each body, on standard error
    #[arg(short, long)]
    verbose: bool,
}

/// What a command prints on this rank.
#[derive(Debug, Clone, Copy)]
pub struct Terminal {
    /// Whether this rank is the first one, which prints and writes.
    pub is_first: bool,
    /// Whether the report is printed as JSON, and nothing else.
    pub json: bool,
    /// Whether only errors, warnings and the folder of the results are printed.
    pub is_quiet: bool,
    is_verbose: bool,
}

impl Terminal {
    /// Return what the options of a command ask for.
    fn new(session: &Session, scene: &SceneArgs, verbosity: &VerbosityArgs) -> Self {
        let &VerbosityArgs { quiet: is_quiet, verbose: is_verbose } = verbosity;
        Self { is_first: session.rank() == 0, json: scene.json, is_quiet, is_verbose }
    }

    /// Return whether progress is printed.
    pub fn is_loud(&self) -> bool {
        self.is_first && !self.json && !self.is_quiet
    }

    /// Return the lines of `--verbose` to be printed on this rank: what was decided and why, and the PETSc options of
    /// each body. Collective.
    fn decisions(&self, session: &Session, ready: &Prepared) -> Result<Vec<String>> {
        if !self.is_verbose {
            return Ok(Vec::new());
        }
        let built = &ready.built;
        let (scene, discrete) = (&built.scene, &built.discrete);
        let solvers = GatheredCounters::gather(discrete).solvers;
        let mut lines = vec![format!("{}: decided", scene.title)];
        let name = scene.method.name.name();
        let has_steps = scene.method.name != MethodName::Robin;
        let linear = built.solvers.plan.linear.name();
        let linear = if has_steps { format!("; linear steps: {linear}") } else { String::new() };
        lines.push(format!("  method: {name}{linear}; until {}", run::targets(scene)));
        lines.push(format!("  inner solver: {} ({})", solvers_in_words(&solvers), built.choice));
        lines.push(format!("  {} ranks, {}", session.size(), session.blas_name()));
        for (body, solver) in discrete.bodies.iter().zip(&solvers).take(LISTED) {
            lines.push(format!("  body {}: {} dofs on rank {}: {solver}", body.name, body.dofs, body.rank));
        }
        for (i, pair) in discrete.model.pairs.iter().enumerate().take(LISTED) {
            let [a, b] = discrete.surfaces(i);
            lines.push(format!(
                "  {a} - {b}: {} points on `{}`, of the softer body or the finer mesh",
                pair.len(),
                pair.surfaces[0]
            ));
        }
        for chosen in built.options.iter().take(LISTED) {
            lines.push(format!("  PETSc options of {}: {}", chosen.name(), chosen.in_words()));
        }
        Ok(if self.is_first { lines } else { Vec::new() })
    }
}

/// A scene file with the options that replace some of its keys.
#[derive(Args)]
pub struct SceneArgs {
    /// Scene file (TOML)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Replace a key of the scene, for example method.gamma=0.3 or contact.0.layer.power.a=0.3; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    flags: Flags,
    /// Print the report as JSON
    #[arg(long)]
    pub json: bool,
}

impl SceneArgs {
    /// Read the scene, whose text the first rank sends to all. A refusal is printed once.
    ///
    /// # Errors
    /// Refusals of the scene.
    fn load(&self, session: &Session) -> Result<Scene> {
        let text = text_of(session, &self.scene)?;
        collectively(session, crate::scene::parse(&self.scene, text, &self.overrides, &self.flags))
    }
}

/// Return the folder of results: that of `-o`, else that of the scene, else `results/<case>`.
pub fn folder_of(scene: &Scene, typed: Option<&PathBuf>) -> PathBuf {
    typed
        .cloned()
        .or_else(|| scene.output.dir.clone())
        .unwrap_or_else(|| PathBuf::from("results").join(case_of(&scene.path)))
}

/// Return the files that a scene is read from.
pub fn inputs(scene: &Scene) -> Vec<PathBuf> {
    let data = scene.data.values().map(|data| data.spec.file.value.clone());
    let table = scene.method.steps.table.iter().map(|table| table.value.clone());
    data.chain(table).chain([scene.path.clone()]).chain(crate::mesh::files(&scene.mesh)).collect()
}

/// Return the name of a scene's case: the folder of a file called `scene.toml`, else the file's name.
fn case_of(path: &Path) -> &OsStr {
    let stem = path.file_stem().unwrap_or_default();
    match path.parent().and_then(|parent| parent.file_name()) {
        Some(folder) if stem == "scene" => folder,
        _ => stem,
    }
}

/// Return the text of a scene file as the first rank reads it.
fn text_of(session: &Session, path: &Path) -> Result<String> {
    broadcast(&Ranks::new(session), || crate::scene::text(path))
}

/// Return a clock. If `is_shown`, a line on the terminal names the phase under way, up to the first iteration.
fn clock_with_phases(is_shown: bool) -> Clock {
    let line = RefCell::new(None);
    let next = move |ended: &str, estimate: Option<f64>| {
        // the old line is removed before the next one begins
        drop(line.borrow_mut().take());
        *line.borrow_mut() = line_after(ended, estimate);
    };
    let mut clock = Clock::default();
    clock.watch = is_shown.then(|| Rc::new(next) as _);
    clock
}

/// Return the line for the phase that follows the one that has ended. `estimate` is its expected time in seconds, if
/// that is known.
fn line_after(ended: &str, estimate: Option<f64>) -> Option<ProgressLine> {
    match ended {
        "" => Some(ProgressLine::new("mesh", None)),
        "mesh" => Some(ProgressLine::new("bodies and contact points", None)),
        "discretize" => Some(ProgressLine::new("factorisations and start", estimate)),
        _ => None,
    }
}
