//! The rounds of a run on several meshes, which are adapted to an error: solve, estimate, stop or follow the sizes of
//! the next mesh.

use super::checkpoint::{Checkpoint, CheckpointHeader};
use super::shortfall::Shortfall;
use crate::ddm::{InitialGuess, Solution, Status};
use crate::discretize::meshes::Meshes;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::estimate::sizes::{self, Aim, Sizes};
use crate::estimate::transfer::{self, EstimatedSolution};
use crate::interrupt::Interrupt;
use crate::mesh;
use crate::output::{ContactTable, RoundReport, UnmetReport};
use crate::parallel::collectively;
use crate::petsc::Session;
use crate::problem::history::History;
use crate::problem::mesh::AdaptedMesh;
use crate::problem::{MeshSource, MethodName, Order};
use crate::run::{self, Begin, Built, Clock, Done, report};
use crate::scene::{AdaptSpec, Quantity, Scene};
use std::rc::Rc;
use std::sync::Arc;

/// Cells of a body's first mesh. A cube with three cells along each edge, six tetrahedra each, has 162; with two it has
/// a single inner node.
const FIRST_CELLS: usize = 150;

/// Ratio of the error that the next mesh aims at to the error asked for. An estimate a little too good then costs no
/// further mesh.
const AIM: f64 = 0.7;

/// Least ratio of the error of the next mesh to the present error. What a coarse mesh shows of a kink does not hold for
/// a very fine one.
const LEAST: f64 = 0.1;

/// Least ratio of the cells of a mesh to those of the mesh before. All meshes before the last one then cost no more
/// than that one together. Gmsh makes about 0.6 of the predicted cells in space, so that the prediction is corrected by
/// what it made of the last one, which saves half of the meshes.
///
/// Meshes with fewer cells do not have the predicted errors where these fall more slowly than h^p, at edges of
/// supports, loads and contact.
const GROWTH: f64 = 2.0;

/// Number of times as many cells from which the cost of a sharp end is not worth it: two further meshes.
const COSTLY: f64 = GROWTH * GROWTH;

/// How meshes follow each other.
struct Pace {
    /// Number of cells of a body's first mesh.
    first_cells: usize,
    /// Least ratio of the error of the next mesh to the present error.
    least: f64,
    /// Least ratio of its cells to the present ones; zero without a limit.
    growth: f64,
    /// Power of the error of nodal values that the squared energy error follows.
    power: f64,
}

/// Power of the energy error with which pressures converge where elements have an order above two and meshes are graded
/// to singular places. With 1.2 or 1.6 `groove-held` of orders 4 and 6 takes a quarter more dofs to 1e-6.
const NODAL: f64 = 1.4;

/// The same as [`LEAST`] for orders above two. With 0.01 or 0.05 the same runs take a tenth or a quarter more dofs.
const STEEPEST: f64 = 0.02;

impl Pace {
    /// Return the pace for elements of a degree. Above two, most cells lie at singular places, and a mesh that is
    /// graded to them may have fewer cells than the one before, with a small part of its error. Up to two the error of
    /// nodal values is taken to be one order better than that in energy, with elements of degree p as h^(p+1) and h^p.
    fn of(degree: usize) -> Self {
        let p = degree as f64;
        match degree {
            1 | 2 => Self { first_cells: FIRST_CELLS, least: LEAST, growth: GROWTH, power: 2.0 * p / (p + 1.0) },
            _ => Self { first_cells: FIRST_CELLS / degree, least: STEEPEST, growth: 0.0, power: 2.0 / NODAL },
        }
    }
}

/// The state of a run on several meshes. A round is one mesh, with the solution on it.
pub struct AdaptiveRun {
    pub scene: Rc<Scene>,
    /// The rounds that have ended.
    rounds: Vec<Round>,
    /// Why the run ends before the error is reached.
    pub shortfall: Option<Shortfall>,
    /// The errors of pairs on the last mesh that are above the one asked for.
    pub unmet: Vec<UnmetReport>,
    /// The error to which meshes are adapted; none without adaptation.
    goal: Option<AdaptSpec>,
    /// The checkpoint from which the first round goes on.
    resumed: Option<Checkpoint>,
    /// The scene as it was requested.
    pub requested: Rc<Scene>,
    /// Number of cells that was predicted for this round from its sizes.
    predicted_cells: Option<f64>,
    /// The load steps that follow on the last mesh, while meshes are adapted under the largest of them.
    later_steps: Option<History>,
}

/// A round that has ended.
struct Round {
    report: RoundReport,
    /// What was asked of its mesh; none without adaptation, or before a checkpoint.
    mesh: Option<Arc<AdaptedMesh>>,
    /// Its solution on the contact surfaces with the estimated errors, if there is one.
    solution: Option<EstimatedSolution>,
    /// The error at sharp ends of contacts.
    end: Option<f64>,
    /// Seconds from the begin of the run to its end.
    ended: f64,
}

impl Round {
    /// Return the round of a report from a checkpoint.
    fn before(report: RoundReport) -> Self {
        Self { report, mesh: None, solution: None, end: None, ended: 0.0 }
    }
}

impl AdaptiveRun {
    /// Return the plan whose first round is on the scene's own mesh, on a coarse one if meshes are adapted, or on that
    /// of a checkpoint.
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
        let head = plan.resumed.as_ref().map(|checkpoint| checkpoint.head.clone());
        if plan.adapts() {
            collectively(session, plan.refuse_finished_mesh())?;
            Rc::make_mut(&mut plan.scene).estimate = true;
            let mut linear = plan.scene.clone();
            // sizes and carriers are those of any order
            Rc::make_mut(&mut linear).bodies.iter_mut().for_each(|body| body.order = Some(Order::P1));
            let own = run::build(session, linear, interrupt, clock)?;
            let pace = plan.pace();
            let scene = Rc::make_mut(&mut plan.scene);
            // the surfaces that carry contact points on the scene's own mesh carry them on all meshes
            scene.carriers = own.discrete.carriers();
            if head.is_none() {
                let bodies = own.discrete.bodies.len();
                let cells = bodies * pace.first_cells;
                let coarse = |meshes: &Meshes| mesh_of(&sizes::coarse(meshes, bodies, cells));
                follow(scene, own.discrete.meshes.as_ref().map(coarse).map(Into::into));
                plan.defer_steps();
            }
        }
        head.iter().for_each(|head| plan.resume(head));
        Ok(plan)
    }

    /// Return the plan of a scene that has made no mesh yet, or none since the checkpoint.
    fn of(scene: Rc<Scene>, resumed: Option<Checkpoint>) -> Self {
        let head = resumed.as_ref().map(|checkpoint| checkpoint.head.clone()).unwrap_or_default();
        Self {
            goal: scene.adapt.clone(),
            requested: scene.clone(),
            scene,
            rounds: head.rounds.into_iter().map(Round::before).collect(),
            resumed,
            shortfall: head.shortfall,
            unmet: head.unmet,
            predicted_cells: None,
            later_steps: None,
        }
    }

    /// Go on where the checkpoint with this head ended: on its mesh, and in its load steps.
    fn resume(&mut self, head: &CheckpointHeader) {
        let scene = Rc::make_mut(&mut self.scene);
        follow(scene, head.adapted.clone().map(Into::into));
        if self.goal.is_none() || head.on_last_mesh {
            scene.method.steps.begun = head.steps.len();
        } else {
            self.defer_steps();
        }
    }

    /// Return how the meshes of this run follow each other: as those of the least order, which has most of the error.
    fn pace(&self) -> Pace {
        Pace::of(self.scene.bodies.iter().map(|body| body.order.unwrap_or_default().degree()).min().unwrap_or(1))
    }

    /// Return whether meshes are adapted to an error.
    pub fn adapts(&self) -> bool {
        self.goal.is_some()
    }

    /// Adapt meshes under the largest load step alone, and leave all steps to the last mesh.
    ///
    /// A mesh for the largest load serves smaller loads, too, and all steps on every mesh would cost as many times as
    /// much.
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

    /// End the adaptation on the mesh that the scene follows. Return whether another round makes all load steps on it.
    fn end_meshes(&mut self) -> bool {
        let Some(steps) = self.later_steps.take() else { return false };
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

    /// Build the scene of this round. Where Gmsh makes no mesh of its sizes, or one that is refused, the run ends with
    /// the last mesh, which is built once more. Collective.
    ///
    /// # Errors
    /// What [`run::build`] refuses, but not the mesh of a later round.
    pub fn build(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<Built> {
        match run::build(session, self.scene.clone(), interrupt, clock) {
            Err(error) if error.kind() == Kind::Mesh && self.last_mesh().is_some() && self.shortfall.is_none() => {
                let (round, last) = (self.rounds.len(), self.last_mesh());
                let reason = format!("no mesh comes of the sizes after mesh {round}: {}", error.message());
                self.shortfall = Some(Shortfall::Limit(reason));
                follow(Rc::make_mut(&mut self.scene), last);
                self.end_meshes();
                run::build(session, self.scene.clone(), interrupt, clock)
            }
            built => built,
        }
    }

    /// Return what was asked of the mesh of the round before.
    fn last_mesh(&self) -> Option<Arc<AdaptedMesh>> {
        self.rounds.last()?.mesh.clone()
    }

    /// Return the reports of the rounds so far.
    pub fn reports(&self) -> Vec<RoundReport> {
        self.rounds.iter().map(|round| round.report.clone()).collect()
    }

    /// Return where this round begins: where a checkpoint or an earlier round ended.
    pub fn begin(&mut self, built: &Built) -> Result<Begin> {
        match self.resumed.take() {
            Some(checkpoint) => checkpoint.resume(&self.requested, built),
            None => Ok(Begin { start: self.start(built), ..Begin::default() }),
        }
    }

    /// Return the head of a checkpoint of this round.
    pub fn head(&self) -> CheckpointHeader {
        CheckpointHeader {
            rounds: self.reports(),
            adapted: self.adapted().map(|adapted| (*adapted).clone()),
            on_last_mesh: self.is_stepping(),
            shortfall: self.shortfall.clone(),
            unmet: self.unmet.clone(),
            ..CheckpointHeader::default()
        }
    }

    /// Return the start of this round, if the round before gives it. It takes about half of the steps of an automatic
    /// start. The first load step has another load than the mesh before, so that it finds its own start.
    fn start(&self, built: &Built) -> Option<InitialGuess> {
        let tables = self.rounds.last()?.solution.as_ref().filter(|_| !self.is_stepping())?.tables();
        let Built { scene, discrete, .. } = built;
        if matches!(scene.method.name, MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin) {
            let compression = discrete.model.compressions_of(&transfer::pressure(tables, discrete));
            Some(InitialGuess::Known(Box::new(Solution { compression, ..Solution::default() })))
        } else {
            Some(InitialGuess::Trace(transfer::trace(tables, discrete)))
        }
    }

    /// End this round, and let the scene follow the mesh of the next one. Return whether there is a next round.
    pub fn advance(&mut self, done: &Done, estimate: Option<&Estimate>, clock: &mut Clock) -> bool {
        if matches!(done.outcome.status, Status::Interrupted { .. }) || self.is_stepping() {
            return false;
        }
        let (Some(goal), Some(estimate)) = (self.goal.clone(), estimate) else { return false };
        self.rounds.push(self.round(done, estimate, clock));
        if !done.outcome.status.is_solved() || self.shortfall.is_some() {
            return false;
        }
        self.unmet = unmet(done, estimate, &goal);
        match self.next_mesh(done, estimate, &goal) {
            Ok(Some(next)) => {
                self.predicted_cells = Some(next.cells);
                follow(Rc::make_mut(&mut self.scene), Some(mesh_of(&next).into()));
                true
            }
            Ok(None) => self.end_meshes(),
            Err(shortfall) => {
                self.shortfall = Some(shortfall);
                self.end_meshes()
            }
        }
    }

    /// Return the sizes of the next mesh, or none if the error is reached on the mesh of the last round.
    ///
    /// # Errors
    /// Why no mesh reaches the error.
    fn next_mesh(
        &self,
        done: &Done,
        estimate: &Estimate,
        goal: &AdaptSpec,
    ) -> std::result::Result<Option<Sizes>, Shortfall> {
        // a second mesh checks a guess
        let is_checked = self.rounds.len() > 1 || !estimate.is_guess();
        if estimate.largest(goal.of) <= goal.error.value && is_checked {
            return Ok(None);
        }
        if let Some(ends) = self.costly_ends(estimate, goal) {
            return Err(Shortfall::SharpEnds(ends));
        }
        let limit = |reason: String| Err(Shortfall::Limit(reason));
        if self.rounds.len() >= goal.rounds {
            return limit(format!("{} meshes were made: allow more (adapt.rounds)", goal.rounds));
        }
        let sizes = self.next_sizes(done, estimate, goal);
        if sizes.is_none() {
            let needed =
                format!("a mesh has {} cells, and the next one needs more than {}", self.last_cells(), goal.cells);
            return limit(needed + ": allow more (adapt.cells)");
        }
        Ok(sizes)
    }

    /// Return the number of cells of the last round.
    fn last_cells(&self) -> usize {
        self.rounds.last().map_or(0, |round| round.report.cells)
    }

    /// Return the sizes of the next mesh; none if it would have more cells than allowed.
    fn next_sizes(&self, done: &Done, estimate: &Estimate, goal: &AdaptSpec) -> Option<Sizes> {
        let (meshes, model) = (done.built.discrete.meshes.as_ref()?, done.model());
        let pace = self.pace();
        let share = (AIM * goal.error.value / estimate.largest(goal.of)).max(pace.least).powf(pace.power);
        let cells = self.last_cells() as f64;
        // a mesher does not make as many cells as its sizes predict: the mesh of this round gives the ratio
        let excess = self.predicted_cells.map_or(1.0, |predicted| predicted / cells);
        let most = goal.cells as f64 * excess;
        let aim = Aim { share, more: pace.growth, most };
        let mut next = sizes::wanted(meshes, model, &done.outcome.layer, estimate, aim);
        // where the script bounds the sizes, no smaller ones give the missing cells: GROWTH bounds what is tried
        next.refine(excess.clamp(1.0, pace.growth.max(1.0)).min(most / next.cells));
        let is_full = next.cells >= 0.9 * most && cells >= 0.7 * goal.cells as f64;
        (!is_full).then_some(next)
    }

    /// Return the number of cells of a mesh whose error is `asked`, if this goes on falling with the number of cells as
    /// it did over the last `meshes`. It is infinite if the error does not fall, and none if an error is not known.
    fn cells_for(&self, asked: f64, meshes: usize, error: impl Fn(&Round) -> Option<f64>) -> Option<f64> {
        let at = |back: usize| {
            let round = &self.rounds[self.rounds.len().checked_sub(back + 1)?];
            Some((round.report.cells as f64, error(round).filter(|error| *error > 0.0)?))
        };
        let ((cells, error), (cells_before, error_before)) = (at(0)?, at(meshes)?);
        let rate = (error_before / error).ln() / (cells / cells_before).ln();
        Some(if rate > 0.0 { cells * (error / asked).powf(1.0 / rate) } else { f64::INFINITY })
    }

    /// Return why sharp ends of contacts, which alone are left of an error, do not reach it on meshes of a few times as
    /// many cells; none if they may.
    ///
    /// Without a layer the pressure is K r^(lambda - 1) at the distance r from the end, and facets of size h miss the
    /// order h^(lambda - 1/2) of it. A punch with right angles has lambda = 0.774: a half of the error takes facets of
    /// a thirteenth.
    fn costly_ends(&self, estimate: &Estimate, goal: &AdaptSpec) -> Option<String> {
        let (asked, beside) = (goal.error.value, estimate.largest_beside_ends(goal.of));
        let needed = self.cells_for(asked, 1, |round| round.end)?;
        let counts = matches!(goal.of, Quantity::All | Quantity::Pressures);
        if !counts || beside > asked || needed <= COSTLY * self.last_cells() as f64 {
            return None;
        }
        let meshes = if needed < 1e9 {
            format!("takes a mesh of about {needed:.0e} cells")
        } else {
            "takes more cells than a mesh can have".to_owned()
        };
        let ends: Vec<String> = self.unmet.iter().map(UnmetReport::in_words).collect();
        Some(format!(
            "not to {asked:.1e} at sharp ends of contacts: {}; all other errors are {beside:.1e} at most, and {asked:.1e} there {meshes}; a rounded \
             edge or a softer layer bounds these pressures",
            ends.join(", ")
        ))
    }

    /// Return what the error asked for will take, as a line for the terminal, once three meshes show how the error
    /// falls with the cells; none if it does not fall. The seconds are those of the last mesh in proportion to its
    /// cells.
    pub fn forecast(&self) -> Option<String> {
        let goal = self.goal.as_ref()?;
        let (asked, last) = (goal.error.value, &self.rounds.last()?.report);
        let error = |Round { report: RoundReport { pressure, displacement, force, .. }, .. }: &Round| match goal.of {
            Quantity::All => pressure.max(*displacement),
            Quantity::Pressures => *pressure,
            Quantity::Displacements => *displacement,
            Quantity::Forces => *force,
        };
        let needed = self.cells_for(asked, 2, |round| Some(error(round))).filter(|cells| cells.is_finite())?;
        let cells = needed.max(GROWTH * last.cells as f64);
        let limit = if cells > goal.cells as f64 {
            format!(", more than adapt.cells = {} allows", goal.cells)
        } else {
            format!(" and {:.0} s", last.seconds * cells / last.cells as f64)
        };
        Some(format!("  an error of {asked:e} takes about {cells:.0e} cells{limit}"))
    }

    /// Return this round at its end.
    fn round(&self, done: &Done, estimate: &Estimate, clock: &mut Clock) -> Round {
        let (discrete, ended) = (&done.built.discrete, clock.total());
        let report = RoundReport {
            cells: discrete.bodies.iter().map(|body| body.cells).sum(),
            dofs: discrete.bodies.iter().map(|body| body.dofs).sum(),
            pressure: estimate.largest(Quantity::Pressures),
            displacement: estimate.displacement,
            force: estimate.largest(Quantity::Forces),
            energy: estimate.energy,
            iterations: done.outcome.iterations,
            seconds: ended - self.rounds.last().map_or(0.0, |round| round.ended),
        };
        let solution = done.outcome.status.is_solved().then(|| EstimatedSolution::new(estimate, contact_tables(done)));
        let end = estimate.ends.iter().copied().fold(0.0, f64::max);
        Round { report, mesh: self.adapted(), solution, end: Some(end), ended }
    }

    /// Return what was asked of the mesh of this round.
    fn adapted(&self) -> Option<Arc<AdaptedMesh>> {
        match &self.scene.mesh {
            MeshSource::Geo(source) => source.adapted.clone(),
            _ => None,
        }
    }

    /// Increase the estimate of a mesh if the difference to the solution on the mesh before shows that it is too small.
    pub fn correct(&self, done: &Done, estimate: &mut Estimate) {
        let previous = self.rounds.last().and_then(|round| round.solution.as_ref());
        let is_adapting = self.adapts() && !self.is_stepping() && done.outcome.status.is_solved();
        let (Some(previous), Some(meshes), true) = (previous, &done.built.discrete.meshes, is_adapting) else { return };
        let edges: Vec<_> = (0..done.model().pairs.len()).map(|pair| meshes.points(pair).edges()).collect();
        previous.correct(&contact_tables(done), &edges, estimate);
    }
}

/// Return the errors of pairs that count for a goal and are above it.
fn unmet(done: &Done, estimate: &Estimate, goal: &AdaptSpec) -> Vec<UnmetReport> {
    let (of, errors) = match goal.of {
        Quantity::All | Quantity::Pressures => ("pressure", &estimate.pressure),
        Quantity::Forces => ("force", &estimate.force),
        Quantity::Displacements => return Vec::new(),
    };
    let above = errors.iter().enumerate().filter(|(_, error)| **error > goal.error.value);
    let report = |(pair, &error): (usize, &f64)| UnmetReport {
        surfaces: done.built.discrete.surfaces(pair).map(str::to_owned),
        of: of.to_owned(),
        error,
        place: estimate.worst[pair],
    };
    above.map(report).collect()
}

/// Return the solution on the contact surfaces, one table for each pair.
fn contact_tables(done: &Done) -> Vec<ContactTable> {
    (0..done.model().pairs.len()).map(|i| report::contact_table(done, None, i)).collect()
}

fn mesh_of(sizes: &Sizes) -> AdaptedMesh {
    AdaptedMesh { sizes: mesh::view(sizes.stride, &sizes.corners, &sizes.sizes), vertices: sizes.vertices.clone() }
}

/// Let the mesh of a scene be an adapted one.
fn follow(scene: &mut Scene, mesh: Option<Arc<AdaptedMesh>>) {
    if let MeshSource::Geo(source) = &mut scene.mesh {
        source.adapted = mesh;
    }
}
