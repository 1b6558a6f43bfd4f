//! The rounds of a run on several meshes: meshes adapted to an error, or one coarse mesh whose solution is the start on the scene's own. The sizes of
//! the mesh that an adaptation ended with are saved: the next run begins with them, and `winkler mesh --adapted` makes the mesh of them.

use super::checkpoint::{Checkpoint, CheckpointHeader, settings_digest};
use super::transfer::{self, EstimatedSolution};
use crate::ddm::{InitialGuess, Status};
use crate::discretize::meshes::Meshes;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::estimate::sizes::{self, Aim, Sizes};
use crate::exchange::broadcast;
use crate::interrupt::Interrupt;
use crate::mesh;
use crate::output::{ContactTable, RoundReport};
use crate::parallel::{Ranks, collectively};
use crate::petsc::Session;
use crate::problem::history::History;
use crate::problem::{MeshSource, MethodName, method};
use crate::run::{self, Begin, Built, Clock, Done, report};
use crate::scene::{AdaptSpec, Scene};
use serde_json::Value;
use std::rc::Rc;
use std::sync::Arc;

/// Cells of a body's first mesh. A cube with three cells along each edge, six tetrahedra each, has 162; with two it has a single inner node.
const FIRST_CELLS: usize = 150;

/// Ratio of the error that the next mesh aims at to the error asked for. An estimate a little too good then costs no further mesh.
const AIM: f64 = 0.7;

/// Least ratio of the error of the next mesh to the present error. What a coarse mesh shows of a kink does not hold for a very fine one.
const LEAST: f64 = 0.1;

/// Least ratio of the cells of a mesh to those of the mesh before. All meshes before the last one then cost no more than that one together.
/// Gmsh makes about 0.6 of the predicted cells in space, so that the prediction is corrected by what it made of the last one: a T-slot nut of
/// linear elements takes four meshes to 2e-2, and nine without the correction.
///
/// Meshes with fewer cells do not have the predicted errors where these fall more slowly than h^p, at edges of supports, loads and contact.
const GROWTH: f64 = 2.0;

/// Number of meshes in a row that are worse than the best one, after which the run ends. One may be worse by chance of the mesher; the
/// second has twice its cells.
const MOST_WORSE: usize = 2;

/// Number of times as many cells from which the cost of a sharp end is not worth it: two further meshes.
const COSTLY: f64 = GROWTH * GROWTH;

/// The state of a run on several meshes. A round is one mesh, with the solution on it.
pub struct AdaptiveRun {
    pub scene: Rc<Scene>,
    /// Reports of the rounds so far.
    pub rounds: Vec<RoundReport>,
    /// Why the run ends before the error is reached, as a text.
    pub limit: Option<String>,
    /// What the error at a sharp end of a contact would cost, as a text, if it alone is left.
    pub costly_end: Option<String>,
    /// The error to which meshes are adapted; none without adaptation.
    goal: Option<AdaptSpec>,
    /// The scene that follows a coarse one.
    finer: Option<Rc<Scene>>,
    /// The checkpoint from which the first round goes on.
    resumed: Option<Checkpoint>,
    /// The scene as it was requested.
    requested: Rc<Scene>,
    /// The key under which sizes are kept for later runs: see [`purpose`].
    purpose: String,
    /// The solution that the next round starts from; empty without one.
    start_from: Vec<ContactTable>,
    /// Seconds from the begin of the run to the end of the round before.
    seconds: f64,
    /// The solution of the round before with its estimated errors.
    previous: Option<EstimatedSolution>,
    /// The error at sharp ends on the mesh before.
    last_end: Option<EndError>,
    /// The best mesh so far.
    best: Option<Best>,
    /// Whether this round is the best mesh once more, with which the run ends.
    repeats_best: bool,
    /// Number of cells that was predicted for this round from its sizes.
    predicted_cells: Option<f64>,
    /// The load steps that follow on the last mesh, while meshes are adapted under the largest of them.
    later_steps: Option<History>,
}

/// The largest error of pressures at a sharp end of a contact, on a mesh with this number of cells.
#[derive(Clone, Copy)]
struct EndError {
    cells: f64,
    error: f64,
}

impl EndError {
    /// Return the number of cells of a mesh whose error is `asked`, if it goes on falling with the number of cells as it did since the mesh `before`.
    fn cells_for(&self, before: EndError, asked: f64) -> f64 {
        let rate = (before.error / self.error).ln() / (self.cells / before.cells).ln();
        if rate > 0.0 { self.cells * (self.error / asked).powf(1.0 / rate) } else { f64::INFINITY }
    }
}

/// The last mesh that was better than the best one before it: with a smaller error, or with a smaller energy error.
struct Best {
    /// Its error: the largest of those of pressures and displacements, relative.
    error: f64,
    /// Its relative error in the energy norm.
    energy: f64,
    /// Whether its error is a guess. A larger error of a finer mesh is then no sign that this one is better.
    is_guess: bool,
    /// Its number, from 1 on.
    round: usize,
    /// The view of the sizes that it follows.
    view: Option<Arc<str>>,
    /// The sizes that its errors lead to.
    next: Sizes,
    tables: Vec<ContactTable>,
    /// Number of meshes since then, all worse.
    worse: usize,
}

impl AdaptiveRun {
    /// Return the plan whose first round is on the scene's own mesh, a coarse one, the one that an earlier run ended with, or that of a
    /// checkpoint.
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
        let mut plan = Self::of(scene, resumed);
        let is_nested = matches!(plan.scene.method.start, method::Start::Nested);
        if plan.adapts() || is_nested {
            collectively(session, plan.refuse_finished_mesh())?;
        }
        if plan.adapts() {
            Rc::make_mut(&mut plan.scene).estimate = true;
        }
        let own = if plan.adapts() { Some(plan.keep_carriers(session, interrupt, clock)?) } else { None };
        if let Some(head) = plan.resumed.as_ref().map(|checkpoint| checkpoint.head.clone()) {
            plan.resume(&head);
        } else if let Some(own) = own {
            plan.defer_steps();
            plan.begin_coarse(session, &own)?;
        } else if is_nested {
            plan.begin_nested(session, interrupt, clock)?;
        }
        Ok(plan)
    }

    /// Return the plan of a scene that has made no mesh yet, or none since the checkpoint.
    fn of(scene: Rc<Scene>, resumed: Option<Checkpoint>) -> Self {
        Self {
            purpose: purpose(&scene),
            goal: scene.adapt.clone(),
            requested: scene.clone(),
            scene,
            rounds: resumed.as_ref().map_or(Vec::new(), |checkpoint| checkpoint.head.rounds.clone()),
            resumed,
            limit: None,
            costly_end: None,
            last_end: None,
            finer: None,
            start_from: Vec::new(),
            seconds: 0.0,
            previous: None,
            best: None,
            repeats_best: false,
            predicted_cells: None,
            later_steps: None,
        }
    }

    /// Go on where the checkpoint with this head ended: on its mesh, and after its load steps or as the best mesh once more.
    fn resume(&mut self, head: &CheckpointHeader) {
        let scene = Rc::make_mut(&mut self.scene);
        follow(scene, head.sizes.clone());
        if self.goal.is_none() || head.on_last_mesh {
            scene.method.steps.begun = head.steps.len();
            self.limit.clone_from(&head.limit);
            self.repeats_best = self.goal.is_some() && scene.method.steps.is_empty();
        } else {
            self.defer_steps();
        }
    }

    /// Build the scene on its own mesh, and let the surfaces that carry contact points there carry them on all meshes.
    fn keep_carriers(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<Built> {
        let built = run::build(session, self.scene.clone(), interrupt, clock)?;
        Rc::make_mut(&mut self.scene).carriers = built.discrete.carriers();
        Ok(built)
    }

    /// Begin an adaptation with the mesh that an earlier adaptation ended with, or with a coarse one. `own` is the scene on its own mesh.
    fn begin_coarse(&mut self, session: &Session, own: &Built) -> Result<()> {
        // the cache of another rank may have other sizes
        let earlier = broadcast(&Ranks::new(session), || Ok(recall(&self.purpose, true)))?;
        let coarse = |meshes: &dyn Meshes, bodies| sizes::coarse(meshes, bodies, FIRST_CELLS * bodies);
        follow(Rc::make_mut(&mut self.scene), earlier.or_else(|| sized(own, coarse)));
        Ok(())
    }

    /// Begin with a mesh of twice the sizes, whose solution is the start on the scene's own mesh.
    fn begin_nested(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<()> {
        let mut coarse = Scene::clone(&self.scene);
        coarse.estimate = true;
        let own = run::build(session, coarse.clone(), interrupt, clock)?;
        let view = sized(&own, |meshes, bodies| sizes::scaled(meshes, bodies, 2.0));
        coarse.method.stop.balanced = true;
        follow(&mut coarse, view);
        self.finer = Some(std::mem::replace(&mut self.scene, Rc::new(coarse)));
        Ok(())
    }

    /// Return whether meshes are adapted to an error.
    pub fn adapts(&self) -> bool {
        self.goal.is_some()
    }

    /// Adapt meshes under the largest load step alone, and leave all steps to the last mesh.
    ///
    /// A mesh for the largest load serves smaller loads, too, and all steps on every mesh would cost as many times as much.
    fn defer_steps(&mut self) {
        let history = &self.scene.method.steps;
        if self.adapts() && !history.is_empty() {
            let largest = history.heaviest();
            self.later_steps = Some(std::mem::replace(&mut Rc::make_mut(&mut self.scene).method.steps, largest));
        }
    }

    /// Return whether this round makes all load steps on the last mesh of an adaptation.
    pub fn is_stepping(&self) -> bool {
        self.adapts() && self.later_steps.is_none() && !self.scene.method.steps.is_empty()
    }

    /// End the adaptation on the mesh of this round. Return whether another round makes all load steps on it.
    fn end_meshes(&mut self) -> bool {
        let Some(steps) = self.later_steps.take() else { return false };
        // the first step has another load than the largest one, so that it finds its own start
        self.start_from.clear();
        Rc::make_mut(&mut self.scene).method.steps = steps;
        true
    }

    /// Refuse a mesh that is a file, since it cannot follow sizes.
    fn refuse_finished_mesh(&self) -> Result<()> {
        let MeshSource::Msh { file } = &self.scene.mesh else { return Ok(()) };
        let place = self.goal.as_ref().map_or(&file.place, |goal| &goal.error.place);
        Err(Error::scene(place, "a finished mesh cannot be made anew with other sizes")
            .help("let the scene name a Gmsh script: mesh = \"file.geo\""))
    }

    /// Build the scene of this round. Collective.
    ///
    /// Gmsh may make no mesh of the sizes that the best mesh leads to, or one that is refused. Coarser sizes are then tried, down to those
    /// that would give no more cells than the best mesh has. If there is still no mesh, the run ends with the best one.
    ///
    /// # Errors
    /// What [`run::build`] refuses, but not the mesh of a later round.
    pub fn build(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<Built> {
        loop {
            match run::build(session, self.scene.clone(), interrupt, clock) {
                Err(error) if error.kind() == Kind::Mesh && self.best.is_some() => self.coarsen(&error),
                built => return built,
            }
        }
    }

    /// Follow coarser sizes, or the best mesh once more, after sizes that gave no mesh.
    fn coarsen(&mut self, error: &Error) {
        let Some(best) = &mut self.best else { return };
        best.next.refine(1.0 / GROWTH);
        if best.next.cells > self.rounds[best.round - 1].cells as f64 {
            self.go_from_best();
            return;
        }
        self.limit = Some(format!("no mesh comes of the sizes after mesh {}: {}", best.round, error.message()));
        self.end_with_best(f64::INFINITY);
    }

    /// Return where this round begins: where a checkpoint or an earlier round ended.
    pub fn begin(&mut self, built: &Built) -> Result<Begin> {
        match self.resumed.take() {
            Some(checkpoint) => checkpoint.resume(built),
            None => Ok(Begin { start: self.start(built), ..Begin::default() }),
        }
    }

    /// Return the head of a checkpoint of this round; none for a coarse mesh that only gives the start.
    pub fn head(&self) -> Option<CheckpointHeader> {
        self.finer.is_none().then(|| CheckpointHeader {
            settings: settings_digest(&self.requested),
            rounds: self.rounds.clone(),
            sizes: self.sizes().map(|view| view.to_string()),
            on_last_mesh: self.is_stepping() || self.repeats_best,
            limit: self.limit.clone(),
            ..CheckpointHeader::default()
        })
    }

    /// Return the start of this round, if an earlier round gives it.
    fn start(&self, built: &Built) -> Option<InitialGuess> {
        let Built { scene, discrete, .. } = built;
        let newton = matches!(scene.method.name, MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin);
        (!self.start_from.is_empty()).then(|| match newton {
            true => InitialGuess::Pressure(transfer::pressure(&self.start_from, discrete)),
            false => InitialGuess::Trace(transfer::trace(&self.start_from, discrete)),
        })
    }

    /// Make the plan of the next round. Return whether there is one.
    pub fn advance(&mut self, done: &Done, estimate: Option<&Estimate>, clock: &mut Clock) -> bool {
        if matches!(done.outcome.status, Status::Paused { .. }) || self.is_stepping() {
            return false;
        }
        let is_solved = done.outcome.status.is_solved();
        let (discrete, model) = (&done.built.discrete, done.model());
        if let Some(finer) = self.finer.take() {
            if is_solved {
                self.start_from = contact_tables(done);
            }
            self.scene = finer;
            return true;
        }
        let (Some(goal), Some(estimate), Some(meshes)) = (self.goal.clone(), estimate, &discrete.meshes) else {
            return false;
        };
        self.record(done, estimate, clock);
        if !is_solved {
            return false;
        }
        let error = estimate.largest();
        if error <= goal.error.value || self.has_costly_end(done, estimate, goal.error.value) {
            // the best mesh once more may have the error, because its estimate is held against another mesh than the first time
            self.limit = None;
            return self.end_meshes();
        }
        if self.repeats_best {
            return false;
        }
        if self.rounds.len() >= goal.rounds {
            self.limit = Some(format!("{} meshes were made: allow more (adapt.rounds)", goal.rounds));
            return self.end_with_best(error);
        }
        // coarse meshes may miss a singularity of the pressure: on the first mesh that resolves it the estimated error of pressures grows,
        // while that in energy falls
        if self
            .best
            .as_ref()
            .is_some_and(|best| !best.is_guess && best.error <= error && best.energy <= estimate.energy)
        {
            return self.follow_best();
        }
        // the error of nodal values is taken to be one order better than that in energy, with elements of degree p as h^(p+1) and h^p
        let degree = (0..model.bodies.len()).map(|body| meshes.degree(body)).min().unwrap_or(1) as f64;
        let share = (AIM * goal.error.value / error).max(LEAST).powf(2.0 * degree / (degree + 1.0));
        let cells = self.rounds[self.rounds.len() - 1].cells as f64;
        // a mesher does not make as many cells as its sizes predict: the mesh of this round gives the ratio
        let excess = self.predicted_cells.map_or(1.0, |predicted| predicted / cells);
        let most = goal.cells as f64 * excess;
        let layer = &done.outcome.layer;
        let mut next = sizes::wanted(&**meshes, model, layer, estimate, Aim { share, more: GROWTH, most });
        // where the script bounds the sizes, no smaller ones give the missing cells: GROWTH bounds what is tried
        next.refine(excess.clamp(1.0, GROWTH).min(most / next.cells));
        if next.cells >= 0.9 * most && cells >= 0.7 * goal.cells as f64 {
            return self.end_at_cells(cells, goal.cells, error);
        }
        let (round, view, tables) = (self.rounds.len(), self.sizes(), contact_tables(done));
        let (energy, is_guess) = (estimate.energy, estimate.is_guess());
        self.best = Some(Best { error, energy, is_guess, round, view, next, tables, worse: 0 });
        self.go_from_best()
    }

    /// Return whether only a sharp end of a contact is left of an error, which meshes of a few times as many cells do not reach there.
    ///
    /// Without a layer the pressure is K r^(lambda - 1) at the distance r from the end, and facets of size h miss the order h^(lambda - 1/2) of it. A
    /// punch with right angles has lambda = 0.774: a half of the error takes facets of a thirteenth.
    fn has_costly_end(&mut self, done: &Done, estimate: &Estimate, asked: f64) -> bool {
        let Some((pair, error)) = estimate.largest_end() else { return false };
        let cells = self.rounds[self.rounds.len() - 1].cells as f64;
        let own = EndError { cells, error };
        let beside = estimate.largest_beside_ends();
        let Some(before) = self.last_end.replace(own).filter(|_| beside <= asked && error > 0.0) else { return false };
        let needed = own.cells_for(before, asked);
        if needed <= COSTLY * cells {
            return false;
        }
        let [a, b] = &done.model().pairs[pair].surfaces;
        let meshes = match needed < 1e9 {
            true => format!("takes a mesh of about {needed:.0e} cells"),
            false => "takes more cells than a mesh can have".to_owned(),
        };
        self.costly_end = Some(format!(
            "the pressures between `{a}` and `{b}` have an error of {error:.1e} at a sharp end of the contact, and all others of {beside:.1e} at most: \
             {asked:.1e} there {meshes}; a rounded edge or a softer layer bounds these pressures"
        ));
        true
    }

    /// End the adaptation because the next mesh would have more cells than allowed.
    fn end_at_cells(&mut self, cells: f64, allowed: usize, error: f64) -> bool {
        let needed = format!("a mesh has {cells} cells, and the next one needs more than {allowed}");
        self.limit = Some(needed + ": allow more (adapt.cells)");
        self.end_with_best(error)
    }

    /// After a mesh that is worse than the best one, let another mesh with more cells follow the best one, or end the run.
    fn follow_best(&mut self) -> bool {
        let Some(best) = &mut self.best else { return false };
        best.worse += 1;
        if best.worse == MOST_WORSE {
            let Best { round, error, .. } = best;
            self.limit =
                Some(format!("mesh {round} has an error of {error:.1e}, and {MOST_WORSE} more meshes are no better"));
            return self.end_with_best(f64::INFINITY);
        }
        best.next.refine(GROWTH);
        self.go_from_best()
    }

    /// Let the next mesh follow the sizes that the errors of the best one lead to, and start from the solution on the best one.
    fn go_from_best(&mut self) -> bool {
        let Some(best) = &self.best else { return false };
        self.start_from = best.tables.clone();
        self.predicted_cells = Some(best.next.cells);
        follow(Rc::make_mut(&mut self.scene), Some(view(&best.next)));
        true
    }

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

    /// End the run with the best mesh. Return whether there is one more round on it: not if this round, with this `error`, is no worse.
    fn end_with_best(&mut self, error: f64) -> bool {
        let Some(best) = self.best.take().filter(|best| best.error < error) else { return self.end_meshes() };
        self.repeats_best = true;
        self.start_from = best.tables;
        follow(Rc::make_mut(&mut self.scene), best.view.as_deref().map(str::to_owned));
        if self.later_steps.is_some() {
            return self.end_meshes();
        }
        true
    }

    /// Save the sizes of the mesh with which the run has ended, on the rank that writes. The next run begins with them only if the mesh has the
    /// error that was asked for.
    pub fn save_mesh(&self, done: &Done) -> Result<()> {
        let sizes = self.sizes().filter(|_| self.adapts() && done.outcome.status.is_solved());
        sizes.map_or(Ok(()), |sizes| mesh::keep_final(&key(&self.purpose, self.limit.is_none()), &sizes))
    }

    /// Return the view of the sizes that the mesh of this round follows.
    fn sizes(&self) -> Option<Arc<str>> {
        match &self.scene.mesh {
            MeshSource::Geo { sizes, .. } => sizes.clone(),
            _ => None,
        }
    }

    /// Increase the estimate of a mesh if the difference to the solution on the mesh before shows that it is too small.
    pub fn correct(&mut self, done: &Done, estimate: &mut Estimate) {
        if !self.adapts() || self.is_stepping() || !done.outcome.status.is_solved() {
            return;
        }
        let tables = contact_tables(done);
        self.previous.iter().for_each(|previous| previous.correct(&tables, estimate));
        self.previous = Some(EstimatedSolution::new(estimate, tables));
    }
}

/// Return the solution on the contact surfaces, one table for each pair.
fn contact_tables(done: &Done) -> Vec<ContactTable> {
    (0..done.model().pairs.len()).map(|i| report::contact_table(done, None, i)).collect()
}

/// Return the view of the sizes that `sizing` makes of the meshes of a problem and the number of its bodies.
fn sized(built: &Built, sizing: impl Fn(&dyn Meshes, usize) -> Sizes) -> Option<String> {
    let bodies = built.discrete.bodies.len();
    built.discrete.meshes.as_ref().map(|meshes| view(&sizing(&**meshes, bodies)))
}

fn view(sizes: &Sizes) -> String {
    mesh::view(sizes.stride, &sizes.corners, &sizes.sizes)
}

/// Let the mesh of a scene follow a view of sizes.
fn follow(scene: &mut Scene, view: Option<String>) {
    if let MeshSource::Geo { sizes, .. } = &mut scene.mesh {
        *sizes = view.map(Into::into);
    }
}

/// Return the settings that an adapted mesh depends on, as a text: the key under which its sizes are saved.
///
/// Load steps are among them, since they choose the load under which meshes are adapted.
pub fn purpose(scene: &Scene) -> String {
    let mut settings = scene.settings();
    let steps = settings["method"]["steps"].take();
    ["output", "solver", "estimate"].iter().for_each(|key| settings[*key] = Value::Null);
    settings["method"] = steps;
    settings.to_string()
}

/// Return the saved sizes of the mesh of an earlier run: one with the error that was asked for, or (not `is_reached`) of the best mesh of a run that did not reach it.
pub fn recall(purpose: &str, is_reached: bool) -> Option<String> {
    mesh::recall_final(&key(purpose, is_reached))
}

fn key(purpose: &str, is_reached: bool) -> String {
    if is_reached { purpose.to_owned() } else { format!("best of {purpose}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load;
    use std::path::Path;

    /// Return the plan of a scene that is adapted, without load steps.
    fn plan() -> AdaptiveRun {
        let scene =
            load(Path::new("meshes/groove-held/scene.toml"), &["adapt.error=1e-3".to_owned()]).expect("a scene");
        AdaptiveRun::of(Rc::new(scene), None)
    }

    /// A run that was interrupted on its best mesh once more ends there after a restart, with its reason. On any other mesh it goes on with the adaptation.
    #[test]
    fn a_restart_on_the_best_mesh_ends_there() {
        for repeats_best in [true, false] {
            let mut interrupted = plan();
            (interrupted.repeats_best, interrupted.limit) = (repeats_best, repeats_best.then(|| "no mesh".to_owned()));
            let head = interrupted.head().expect("a head");
            let mut restarted = plan();
            restarted.resume(&head);
            assert_eq!((restarted.repeats_best, restarted.limit), (repeats_best, interrupted.limit));
        }
    }
}
