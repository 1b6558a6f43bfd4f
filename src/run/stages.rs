//! The stages of a run, each made from the previous one: [`Scene`], [`Built`], [`Prepared`], [`Done`]; and the clock
//! that measures its phases.

use super::inner::{JointParts, Solvers};
use super::meshed::{MeshFile, SceneMesh};
use crate::ddm::{InitialGuess, Method, Outcome, Row};
use crate::discretize::{BodyInfo, Discrete};
use crate::error::Result;
use crate::file::bytes_in_proc;
use crate::model::{BodyCounts, LinearStep, Model};
use crate::output::{BodyField, Mark, StepReport};
use crate::scene::Scene;
use crate::solver::options::Chosen;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Instant;

/// A scene with its discrete problem. Bodies have their inner solvers, but nothing is factorised yet.
pub struct Built {
    /// The scene.
    pub scene: Rc<Scene>,
    /// The discrete problem.
    pub discrete: Discrete,
    /// A line for each group of the mesh that is split into bodies.
    pub splits: Vec<String>,
    /// The file of its mesh, on the rank that has read it; none on other ranks.
    pub file: Option<MeshFile>,
    /// Places that the page of the run marks, on the first rank; none without a page.
    pub marks: Vec<Mark>,
    /// The solvers that were asked for and planned.
    pub solvers: Solvers,
    /// The solver of the linear steps of the problem before, which may serve again.
    pub step: Option<Box<dyn LinearStep>>,
    /// Counters of that solver.
    pub counts: BodyCounts,
    /// What the matrix of all bodies is made of, until it takes that.
    pub joint: JointParts,
    /// Reason for the choice of the inner solver, if no PETSc option was typed.
    pub choice: String,
    /// Options of all PETSc solvers of the problem: of bodies, or of the joint matrix of all bodies.
    pub options: Vec<Chosen>,
    /// Warnings on the problem.
    pub warnings: Vec<String>,
    /// The mesh, for problems of other load steps or scenes; none where no other problem follows.
    pub mesh: Option<Box<dyn SceneMesh>>,
}

/// What a problem leaves for the one that follows on its mesh.
pub struct Before {
    /// The discrete problem.
    pub discrete: Discrete,
    /// The solvers that were asked for and planned.
    pub solvers: Solvers,
    /// The solver of its linear steps.
    pub step: Box<dyn LinearStep>,
    /// Places that the page marks.
    pub marks: Vec<Mark>,
}

impl Before {
    /// Return the same for another run, whose counters start at zero.
    pub fn begin_anew(mut self) -> Self {
        self.discrete.begin_anew();
        self.step.begin_anew();
        self
    }
}

/// The start of a run that continues one on another mesh or in another process.
#[derive(Default)]
pub struct Begin {
    /// The start; none for the start of the scene.
    pub start: Option<InitialGuess>,
    /// Earlier load steps.
    pub steps: Vec<StepReport>,
    /// Largest compressions of the contact points in them, n; empty if no layer remembers.
    pub largest: Vec<f64>,
}

/// A problem that is prepared for its first iteration, with the method set up and a start.
pub struct Prepared {
    /// The problem.
    pub built: Built,
    /// The method with its solvers, all set up.
    pub method: Method,
    /// The start. Each load step determines its own, unless it goes on from another solution.
    pub start: InitialGuess,
    /// Earlier load steps.
    pub steps: Vec<StepReport>,
    /// Largest compressions of the contact points in them, n; empty if no layer remembers.
    pub largest: Vec<f64>,
    /// Iteration rows of the earlier load steps.
    pub earlier: Vec<Row>,
    /// Warnings on the set-up.
    pub warnings: Vec<String>,
}

/// A run that has ended, with or without a solution.
pub struct Done {
    /// The problem.
    pub built: Built,
    /// The method in its last state.
    pub method: Method,
    /// The outcome.
    pub outcome: Outcome,
    /// Load steps so far.
    pub steps: Vec<StepReport>,
    /// Largest compressions of the contact points in them, n; empty if no layer remembers.
    pub largest: Vec<f64>,
    /// Iteration rows of the load steps before.
    pub earlier: Vec<Row>,
    /// Warnings on the set-up.
    pub warnings: Vec<String>,
    /// Displacements of its bodies, once the run has ended.
    pub recovered: Option<Rc<All>>,
}

impl Done {
    /// Return the mesh, and what was made on it, for the problem that follows.
    pub fn into_mesh(self) -> (Option<Box<dyn SceneMesh>>, Before) {
        let Built { discrete, solvers, marks, mesh, .. } = self.built;
        (mesh, Before { discrete, solvers, step: self.method.into_linear(), marks })
    }

    /// Note the largest compressions after a load step, if it has a solution and a layer remembers them.
    pub fn remember(&mut self) {
        let Outcome { status, layer, .. } = &self.outcome;
        if status.is_usable() && self.model().pairs.iter().any(|pair| pair.law.has_memory()) {
            let before = std::mem::take(&mut self.largest).into_iter().chain(std::iter::repeat(0.0));
            self.largest = before.zip(&layer.compression).map(|(before, c)| c.max(before)).collect();
        }
    }

    /// Return the model of the discrete problem.
    pub fn model(&self) -> &Model {
        &self.built.discrete.model
    }
}

/// The displacements of a body at the end of a run, on a rank that has nodes of it.
pub struct Recovered {
    /// Displacements of the owned and ghost nodes, one entry per dof.
    pub state: Vec<f64>,
    /// Displacements without the rigid motions that supports leave or impose, which cause no strain.
    pub bent: Vec<f64>,
    field: OnceCell<BodyField>,
}

impl Recovered {
    /// Store displacements of the nodes, and those without rigid motion.
    pub fn new(state: Vec<f64>, bent: Vec<f64>) -> Self {
        Self { state, bent, field: OnceCell::new() }
    }

    /// Return displacements and stresses on the cells that this rank writes. They are computed at the first call.
    pub fn field(&self, info: &BodyInfo) -> &BodyField {
        self.field.get_or_init(|| info.post().field(&self.state, &self.bent))
    }
}

/// The displacements of every body: none for bodies of other ranks, or the failure of the solver that recovers the
/// interior.
pub type All = Vec<Option<Result<Recovered>>>;

/// The clock of a run, which measures its phases.
#[derive(Clone)]
pub struct Clock {
    began: Instant,
    last: Instant,
    /// Wall seconds by phase.
    pub times: BTreeMap<String, f64>,
    /// Peak resident memory of this process at the end of each phase, 10^6 bytes; empty where the system does not
    /// report it.
    pub memory: BTreeMap<String, f64>,
    /// Estimated seconds of set-up and iteration, if the choice of the solvers made an estimate.
    pub estimate: Option<f64>,
    /// Function that is called at the end of each phase with its name, and at the beginning of the first with an empty
    /// name.
    pub watch: Option<Rc<Watch>>,
}

/// A function of the name of a phase that has ended, and of the estimate.
type Watch = dyn Fn(&str, Option<f64>);

impl Default for Clock {
    fn default() -> Self {
        let now = Instant::now();
        let (times, memory) = (BTreeMap::new(), BTreeMap::new());
        Self { began: now, last: now, times, memory, estimate: None, watch: None }
    }
}

impl Clock {
    /// Report the beginning of the first phase of a mesh.
    pub fn begin(&self) {
        self.watch.iter().for_each(|watch| watch("", None));
    }

    /// End a phase, which began when the one before ended.
    pub fn phase(&mut self, name: &str) {
        let now = Instant::now();
        *self.times.entry(name.to_owned()).or_default() += (now - self.last).as_secs_f64();
        self.last = now;
        let peak = bytes_in_proc("/proc/self/status", "VmHWM");
        self.memory.extend(peak.map(|bytes| (name.to_owned(), bytes as f64 / 1e6)));
        self.watch.iter().for_each(|watch| watch(name, self.estimate));
    }

    /// Return the seconds since the run began, and store them as `total`.
    pub fn total(&mut self) -> f64 {
        let total = self.began.elapsed().as_secs_f64();
        self.times.insert("total".to_owned(), total);
        total
    }
}
