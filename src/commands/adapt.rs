//! Meshes one after another: adapted to an error, or one coarse mesh that gives the start.

use super::adapted;
use super::carry;
use super::checkpoint::{Checkpoint, Head, settings_digest};
use super::told::Told;
use crate::ddm::{Start, Status};
use crate::discretize::meshes::Meshes;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::estimate::sizes::{self, Aim, Sizes};
use crate::exchange::tell;
use crate::interrupt::Interrupt;
use crate::mesh;
use crate::output::{ContactTable, RoundReport};
use crate::parallel::{Ranks, agree};
use crate::petsc::Session;
use crate::problem::history::History;
use crate::problem::{MeshSource, MethodName, method};
use crate::run::{self, Begin, Built, Clock, Done, report};
use crate::scene::{AdaptSpec, Scene};
use crate::solver::options;
use std::rc::Rc;
use std::sync::Arc;

/// Cells of a body's first mesh.
const FIRST: usize = 150;

/// Part of the error asked for that the next mesh aims at, so that an estimate a little too good costs no further mesh.
const AIM: f64 = 0.7;

/// Part of an error that the next mesh may leave at least: what a coarse mesh tells of a kink does not hold for a very fine one.
const LEAST: f64 = 0.1;

/// A mesh has so many times the cells of the one before at least: all before the last one then cost no more than that one together. What the errors promise of fewer
/// cells does not come where they fall more slowly than h^p, at edges of supports, loads and contact.
const MORE: f64 = 2.0;

/// So many meshes in a row that are worse than the best one end the run. One may be worse by chance of the mesher; the second has twice its cells.
const WORSE: usize = 2;

/// What remains to be done of a run of several meshes.
pub struct Plan {
    /// The scene of this round.
    pub scene: Rc<Scene>,
    /// Meshes so far.
    pub rounds: Vec<RoundReport>,
    /// Why the meshes end before the error is reached, in words.
    pub limit: Option<String>,
    goal: Option<AdaptSpec>,
    /// The scene that follows a coarse one.
    finer: Option<Rc<Scene>>,
    /// Where the first round goes on.
    resumed: Option<Checkpoint>,
    /// The scene as it was asked for.
    asked: Rc<Scene>,
    purpose: String,
    /// The solution that the next mesh starts from.
    carried: Vec<ContactTable>,
    seconds: f64,
    /// The errors told of the mesh before.
    told: Option<Told>,
    /// The best mesh so far.
    best: Option<Best>,
    /// Whether this round is the best mesh once more, with which the run ends.
    ends: bool,
    /// Cells that the sizes of this round foretold.
    foretold: Option<f64>,
    /// The load steps that follow on the last mesh, while meshes are adapted under the largest of them.
    steps: Option<History>,
}

/// The last mesh that was better than the best one before it: with a smaller error, or with a smaller energy error.
struct Best {
    error: f64,
    /// Its relative error in the energy norm.
    energy: f64,
    /// Its number, from 1 on.
    round: usize,
    /// Its sizes.
    view: Option<Arc<str>>,
    /// Sizes that its errors ask for.
    next: Sizes,
    /// The solution on it.
    tables: Vec<ContactTable>,
    /// Meshes since then, all worse.
    worse: usize,
}

impl Plan {
    /// The first round of a scene: its own mesh, a coarse one, the one that an earlier run ended with, or that of a checkpoint.
    ///
    /// # Errors
    /// A scene whose mesh cannot follow sizes; what [`run::build`] refuses.
    pub fn new(
        session: &Session,
        scene: Rc<Scene>,
        resumed: Option<Checkpoint>,
        interrupt: &Interrupt,
        clock: &mut Clock,
    ) -> Result<Self> {
        let mut plan = Self {
            purpose: adapted::purpose(&scene),
            goal: scene.adapt.clone(),
            asked: scene.clone(),
            scene,
            rounds: resumed.as_ref().map_or(Vec::new(), |checkpoint| checkpoint.head.rounds.clone()),
            resumed,
            limit: None,
            finer: None,
            carried: Vec::new(),
            seconds: 0.0,
            told: None,
            best: None,
            ends: false,
            foretold: None,
            steps: None,
        };
        let is_nested = matches!(plan.scene.method.start, method::Start::Nested);
        if plan.adapts() || is_nested {
            agree(session, plan.refuse_finished_mesh())?;
        }
        if plan.adapts() {
            Rc::make_mut(&mut plan.scene).estimate = true;
        }
        if plan.resumed.is_some() {
            plan.resume();
        } else if plan.adapts() {
            plan.keep_steps_for_the_end();
            plan.begin_coarse(session, interrupt, clock)?;
        } else if is_nested {
            plan.begin_nested(session, interrupt, clock)?;
        }
        Ok(plan)
    }

    /// Go on where the checkpoint ended: with its mesh, and behind its load steps.
    fn resume(&mut self) {
        let Some(Checkpoint { head, .. }) = &self.resumed else { return };
        let scene = Rc::make_mut(&mut self.scene);
        follow(scene, head.sizes.clone());
        if self.goal.is_none() || head.on_last_mesh {
            scene.method.steps.begun = head.steps.len();
            self.limit.clone_from(&head.limit);
        } else {
            self.keep_steps_for_the_end();
        }
    }

    /// Begin an adaptation with the mesh that the last one ended with, or with a coarse one.
    fn begin_coarse(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<()> {
        // the cache of another rank may know of other sizes
        let mut view = tell(&Ranks::new(session), || Ok(adapted::recall(&self.purpose, true)))?;
        if view.is_none() {
            let coarse: Sizing = |meshes, bodies| sizes::coarse(meshes, bodies, FIRST * bodies);
            view = sized(session, &self.scene, coarse, interrupt, clock)?;
        }
        follow(Rc::make_mut(&mut self.scene), view);
        Ok(())
    }

    /// Begin with a mesh of twice the sizes, whose solution is the start of the scene's own.
    fn begin_nested(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<()> {
        let mut coarse = Scene::clone(&self.scene);
        coarse.estimate = true;
        let view = sized(session, &coarse, |meshes, bodies| sizes::scaled(meshes, bodies, 2.0), interrupt, clock)?;
        coarse.method.stop.balanced = true;
        follow(&mut coarse, view);
        self.finer = Some(std::mem::replace(&mut self.scene, Rc::new(coarse)));
        Ok(())
    }

    /// Whether meshes are adapted to an error.
    pub fn adapts(&self) -> bool {
        self.goal.is_some()
    }

    /// Adapt meshes under the largest load step alone: its mesh serves smaller loads, too, and steps would cost as often as there are meshes.
    fn keep_steps_for_the_end(&mut self) {
        let history = &self.scene.method.steps;
        if self.adapts() && !history.is_empty() {
            let largest = history.heaviest();
            self.steps = Some(std::mem::replace(&mut Rc::make_mut(&mut self.scene).method.steps, largest));
        }
    }

    /// Whether this round makes all load steps on the last mesh of an adaptation.
    pub fn is_stepping(&self) -> bool {
        self.adapts() && self.steps.is_none() && !self.scene.method.steps.is_empty()
    }

    /// End the adaptation on the mesh of this round. Return whether another round makes all load steps on it.
    fn end_meshes(&mut self, session: &Session) -> Result<bool> {
        let Some(steps) = self.steps.take() else { return Ok(false) };
        // the first step is another load than the largest one: it finds its own start
        self.carried.clear();
        Rc::make_mut(&mut self.scene).method.steps = steps;
        options::withdraw(session)?;
        Ok(true)
    }

    /// A mesh that is a file cannot follow sizes.
    fn refuse_finished_mesh(&self) -> Result<()> {
        let MeshSource::Msh { file } = &self.scene.mesh else { return Ok(()) };
        let place = self.goal.as_ref().map_or(&file.place, |goal| &goal.place);
        Err(Error::scene(place, "a finished mesh cannot be made anew with other sizes")
            .help("let the scene name a Gmsh script: mesh = \"file.geo\""))
    }

    /// Build the scene of this round. If Gmsh makes no mesh of the sizes that the best mesh leads to, or one that is refused, coarser sizes are tried, down to those that promise no more
    /// cells than the best mesh has; the run then ends with that one. Collective.
    ///
    /// # Errors
    /// What [`run::build`] refuses, but a later mesh.
    pub fn build(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<Built> {
        loop {
            match run::build(session, self.scene.clone(), interrupt, clock) {
                Err(error) if error.kind() == Kind::Mesh && self.best.is_some() => self.coarsen(session, &error)?,
                built => return built,
            }
        }
    }

    /// After sizes of which no mesh came: follow coarser ones, or the best mesh once more.
    fn coarsen(&mut self, session: &Session, error: &Error) -> Result<()> {
        let Some(best) = &mut self.best else { return Ok(()) };
        best.next.refine(1.0 / MORE);
        if best.next.cells > self.rounds[best.round - 1].cells as f64 {
            return self.go_from_best(session).map(drop);
        }
        self.limit = Some(format!("no mesh comes of the sizes after mesh {}: {}", best.round, error.message()));
        self.end_with_best(session, f64::INFINITY).map(drop)
    }

    /// Where this round begins: where a checkpoint or an earlier round ended.
    ///
    /// # Errors
    /// The checkpoint is of another mesh.
    pub fn begin(&mut self, built: &Built) -> Result<Begin> {
        match self.resumed.take() {
            Some(checkpoint) => checkpoint.resume(built),
            None => Ok(Begin { start: self.start(built), ..Begin::default() }),
        }
    }

    /// What a checkpoint of this round says of it; none of a coarse mesh that only gives the start.
    pub fn head(&self) -> Option<Head> {
        self.finer.is_none().then(|| Head {
            settings: settings_digest(&self.asked),
            rounds: self.rounds.clone(),
            sizes: self.sizes().map(|view| view.to_string()),
            on_last_mesh: self.is_stepping(),
            limit: self.limit.clone(),
            ..Head::default()
        })
    }

    /// The start of this round, if an earlier one gives it.
    fn start(&self, built: &Built) -> Option<Start> {
        let Built { scene, discrete, .. } = built;
        let newton = matches!(scene.method.name, MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin);
        (!self.carried.is_empty()).then(|| match newton {
            true => Start::Pressure(carry::pressure(&self.carried, discrete)),
            false => Start::Trace(carry::trace(&self.carried, discrete)),
        })
    }

    /// Whether another round follows this one. Collective.
    ///
    /// # Errors
    /// Failures of PETSc.
    pub fn goes_on(
        &mut self,
        session: &Session,
        done: &Done,
        estimate: Option<&Estimate>,
        clock: &mut Clock,
    ) -> Result<bool> {
        if matches!(done.outcome.status, Status::Paused { .. }) || self.is_stepping() {
            return Ok(false);
        }
        let good = done.outcome.status.is_solved();
        let (discrete, model) = (&done.built.discrete, done.model());
        let tables = || (0..model.pairs.len()).map(|i| report::contact_table(done, None, i)).collect();
        if let Some(finer) = self.finer.take() {
            if good {
                self.carried = tables();
            }
            self.scene = finer;
            options::withdraw(session)?;
            return Ok(true);
        }
        let (Some(goal), Some(estimate), Some(meshes)) = (self.goal.clone(), estimate, &discrete.meshes) else {
            return Ok(false);
        };
        self.record(done, estimate, clock);
        if !good || self.ends {
            return Ok(false);
        }
        let error = estimate.pressure.iter().copied().fold(estimate.displacement, f64::max);
        if error <= goal.error {
            return self.end_meshes(session);
        }
        if self.rounds.len() >= goal.rounds {
            self.limit = Some(format!("{} meshes were made: allow more (adapt.rounds)", goal.rounds));
            return self.end_with_best(session, error);
        }
        // coarse meshes may miss a singularity of the pressure; on the first mesh that resolves it the estimated error of pressures grows while that in energy falls
        if self.best.as_ref().is_some_and(|best| best.error <= error && best.energy <= estimate.energy) {
            return self.follow_best(session);
        }
        let degree = (0..model.bodies.len()).map(|body| meshes.degree(body)).min().unwrap_or(1) as f64;
        let share = (AIM * goal.error / error).max(LEAST).powf(2.0 * degree / (degree + 1.0));
        let now = self.rounds[self.rounds.len() - 1].cells as f64;
        // a mesher does not make as many cells as its sizes foretell: the mesh before tells how many of them
        let most = goal.cells as f64 * self.foretold.map_or(1.0, |foretold| foretold / now);
        let next = sizes::wanted(&**meshes, model, estimate, Aim { share, more: MORE, most });
        if next.cells >= 0.9 * most && now >= 0.7 * goal.cells as f64 {
            self.limit = Some(format!("a mesh has {now} cells: allow more (adapt.cells)"));
            return self.end_with_best(session, error);
        }
        let (round, sizes, tables) = (self.rounds.len(), self.sizes(), tables());
        self.best = Some(Best { error, energy: estimate.energy, round, view: sizes, next, tables, worse: 0 });
        self.go_from_best(session)
    }

    /// After a mesh that is worse than the best one: let another follow the best one, with more cells, or end the run.
    fn follow_best(&mut self, session: &Session) -> Result<bool> {
        let Some(best) = &mut self.best else { return Ok(false) };
        best.worse += 1;
        if best.worse == WORSE {
            let Best { round, error, .. } = best;
            self.limit =
                Some(format!("mesh {round} has an error of {error:.1e}, and {WORSE} more meshes are no better"));
            return self.end_with_best(session, f64::INFINITY);
        }
        best.next.refine(MORE);
        self.go_from_best(session)
    }

    /// Let the next mesh follow the sizes that the errors of the best one ask for, and start from the solution there.
    fn go_from_best(&mut self, session: &Session) -> Result<bool> {
        let Some(best) = &self.best else { return Ok(false) };
        self.carried = best.tables.clone();
        self.foretold = Some(best.next.cells);
        follow(Rc::make_mut(&mut self.scene), Some(view(&best.next)));
        options::withdraw(session)?;
        Ok(true)
    }

    /// Note the mesh of this round.
    fn record(&mut self, done: &Done, estimate: &Estimate, clock: &mut Clock) {
        let (discrete, total) = (&done.built.discrete, clock.total());
        self.rounds.push(RoundReport {
            cells: discrete.bodies.iter().map(|body| body.cells).sum(),
            dofs: discrete.bodies.iter().map(|body| body.dofs).sum(),
            pressure: estimate.pressure.iter().copied().fold(0.0, f64::max),
            displacement: estimate.displacement,
            energy: estimate.energy,
            iterations: done.outcome.iterations,
            seconds: total - self.seconds,
        });
        self.seconds = total;
    }

    /// End the run with the best mesh: with one more round on it, unless the last one, with this `error`, is no worse.
    fn end_with_best(&mut self, session: &Session, error: f64) -> Result<bool> {
        let Some(best) = self.best.take().filter(|best| best.error < error) else { return self.end_meshes(session) };
        self.ends = true;
        self.carried = best.tables;
        follow(Rc::make_mut(&mut self.scene), best.view.as_deref().map(str::to_owned));
        if self.steps.is_some() {
            return self.end_meshes(session);
        }
        options::withdraw(session)?;
        Ok(true)
    }

    /// Keep the sizes of the mesh with which the run has ended, on the rank that writes.
    ///
    /// # Errors
    /// The cache of meshes cannot be written.
    pub fn keep_mesh(&self, done: &Done) -> Result<()> {
        let sizes = self.sizes().filter(|_| self.adapts() && done.outcome.status.is_solved());
        sizes.map_or(Ok(()), |sizes| adapted::keep(&self.purpose, self.limit.is_none(), &sizes))
    }

    /// The field of sizes that the mesh of this round follows.
    fn sizes(&self) -> Option<Arc<str>> {
        match &self.scene.mesh {
            MeshSource::Geo { sizes, .. } => sizes.clone(),
            _ => None,
        }
    }

    /// Hold the estimate of a mesh against what the solution differs from that on the mesh before.
    pub fn hold(&mut self, done: &Done, estimate: &mut Estimate) {
        if self.goal.is_none() || self.is_stepping() || !done.outcome.status.is_solved() {
            return;
        }
        let tables: Vec<_> = (0..done.model().pairs.len()).map(|i| report::contact_table(done, None, i)).collect();
        self.told.iter().for_each(|told| told.hold(&tables, estimate));
        self.told = Some(Told::new(estimate, tables));
    }
}

/// Sizes of the next mesh from the meshes of a number of bodies.
type Sizing = fn(&dyn Meshes, usize) -> Sizes;

/// The view of sizes that follow from the own mesh of a scene.
fn sized(
    session: &Session,
    scene: &Scene,
    sizing: Sizing,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Option<String>> {
    let built = run::build(session, scene.clone(), interrupt, clock)?;
    let bodies = built.discrete.bodies.len();
    let sizes = built.discrete.meshes.as_ref().map(|meshes| view(&sizing(&**meshes, bodies)));
    options::withdraw(session).map(|()| sizes)
}

fn view(sizes: &Sizes) -> String {
    mesh::view(sizes.stride, &sizes.corners, &sizes.sizes)
}

/// Lets the mesh of a scene follow sizes.
fn follow(scene: &mut Scene, view: Option<String>) {
    if let MeshSource::Geo { sizes, .. } = &mut scene.mesh {
        *sizes = view.map(Into::into);
    }
}
