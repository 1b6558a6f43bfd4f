//! The rounds of a run on several meshes, which are adapted to an error: solve, estimate, stop or follow the sizes of
//! the next mesh.

use super::checkpoint::{Checkpoint, CheckpointHeader};
use super::shortfall::Shortfall;
use super::transfer::{self, EstimatedSolution};
use crate::ddm::{InitialGuess, Solution, Status};
use crate::discretize::meshes::Meshes;
use crate::error::{Error, Kind, Result};
use crate::estimate::Estimate;
use crate::estimate::sizes::{self, Aim, Sizes};
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
/// what it made of the last one: a T-slot nut of linear elements takes four meshes to 2e-2, and nine without the
/// correction.
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
/// to singular places. `groove-held` of orders 4 and 6 under layers with a = 1, 0.5 and 0.3 takes 165 000 dofs to 1e-6,
/// all meshes of the six runs together. With powers of 1.2, 1.6 and 2 it takes 1.30, 1.26 and 1.55 times as many.
const NODAL: f64 = 1.4;

/// The same as [`LEAST`] for orders above two. With 0.01, 0.05 and 0.1 the same runs take 1.11, 1.23 and 1.38 times the
/// dofs.
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
    /// Reports of the rounds so far.
    pub rounds: Vec<RoundReport>,
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
    /// The solution that the next round starts from; empty without one.
    start_from: Vec<ContactTable>,
    /// Seconds from the begin of the run to the end of the round before.
    seconds: f64,
    /// The solution of the round before with its estimated errors.
    previous: Option<EstimatedSolution>,
    /// The error at sharp ends on the mesh before.
    last_end: Option<MeshError>,
    /// What was asked of the mesh of the round before.
    last_mesh: Option<Arc<AdaptedMesh>>,
    /// Number of cells that was predicted for this round from its sizes.
    predicted_cells: Option<f64>,
    /// The load steps that follow on the last mesh, while meshes are adapted under the largest of them.
    later_steps: Option<History>,
}

/// An error on a mesh with this number of cells.
#[derive(Clone, Copy)]
struct MeshError {
    cells: f64,
    error: f64,
}

impl MeshError {
    /// Return the number of cells of a mesh whose error is `asked`, if it goes on falling with the number of cells as
    /// it did since the mesh `before`.
    fn cells_for(&self, before: MeshError, asked: f64) -> f64 {
        let rate = (before.error / self.error).ln() / (self.cells / before.cells).ln();
        if rate > 0.0 { self.cells * (self.error / asked).powf(1.0 / rate) } else { f64::INFINITY }
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
            rounds: head.rounds,
            resumed,
            shortfall: head.shortfall,
            unmet: head.unmet,
            last_end: None,
            start_from: Vec::new(),
            seconds: 0.0,
            previous: None,
            last_mesh: None,
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

    /// Build the scene of this round. Where Gmsh makes no mesh of its sizes, or one that is refused, the run ends with
    /// the last mesh, which is built once more. Collective.
    ///
    /// # Errors
    /// What [`run::build`] refuses, but not the mesh of a later round.
    pub fn build(&mut self, session: &Session, interrupt: &Interrupt, clock: &mut Clock) -> Result<Built> {
        match run::build(session, self.scene.clone(), interrupt, clock) {
            Err(error) if error.kind() == Kind::Mesh && self.last_mesh.is_some() && self.shortfall.is_none() => {
                let round = self.rounds.len();
                let reason = format!("no mesh comes of the sizes after mesh {round}: {}", error.message());
                self.shortfall = Some(Shortfall::Limit(reason));
                follow(Rc::make_mut(&mut self.scene), self.last_mesh.take());
                self.end_meshes();
                run::build(session, self.scene.clone(), interrupt, clock)
            }
            built => built,
        }
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
            rounds: self.rounds.clone(),
            adapted: self.adapted().map(|adapted| (*adapted).clone()),
            on_last_mesh: self.is_stepping(),
            shortfall: self.shortfall.clone(),
            unmet: self.unmet.clone(),
            ..CheckpointHeader::default()
        }
    }

    /// Return the start of this round, if an earlier round gives it: `flange` to 5e-2 takes 10 steps on its four
    /// meshes, and 18 with automatic starts.
    fn start(&self, built: &Built) -> Option<InitialGuess> {
        let Built { scene, discrete, .. } = built;
        let newton = matches!(scene.method.name, MethodName::Auto | MethodName::Newton | MethodName::NewtonRobin);
        (!self.start_from.is_empty()).then(|| {
            if newton {
                let compression = discrete.model.compressions_of(&transfer::pressure(&self.start_from, discrete));
                InitialGuess::Known(Box::new(Solution { compression, ..Solution::default() }))
            } else {
                InitialGuess::Trace(transfer::trace(&self.start_from, discrete))
            }
        })
    }

    /// Make the plan of the next round. Return whether there is one.
    pub fn advance(&mut self, done: &Done, estimate: Option<&Estimate>, clock: &mut Clock) -> bool {
        if matches!(done.outcome.status, Status::Interrupted { .. }) || self.is_stepping() {
            return false;
        }
        let (Some(goal), Some(estimate)) = (self.goal.clone(), estimate) else { return false };
        self.record(done, estimate, clock);
        if !done.outcome.status.is_solved() || self.shortfall.is_some() {
            return false;
        }
        let (asked, error) = (goal.error.value, estimate.largest(goal.of));
        self.unmet = unmet(done, estimate, &goal);
        // a second mesh checks a guess
        let is_reached = error <= asked && !(self.rounds.len() == 1 && estimate.is_guess());
        if is_reached || self.has_costly_ends(estimate, &goal) {
            return self.end_meshes();
        }
        if self.rounds.len() >= goal.rounds {
            let reason = format!("{} meshes were made: allow more (adapt.rounds)", goal.rounds);
            self.shortfall = Some(Shortfall::Limit(reason));
            return self.end_meshes();
        }
        let Some(next) = self.next_sizes(done, estimate, &goal) else {
            let RoundReport { cells, .. } = self.rounds[self.rounds.len() - 1];
            let needed = format!("a mesh has {cells} cells, and the next one needs more than {}", goal.cells);
            self.shortfall = Some(Shortfall::Limit(needed + ": allow more (adapt.cells)"));
            return self.end_meshes();
        };
        self.start_from = contact_tables(done);
        self.predicted_cells = Some(next.cells);
        self.last_mesh = self.adapted();
        follow(Rc::make_mut(&mut self.scene), Some(mesh_of(&next).into()));
        true
    }

    /// Return the sizes of the next mesh; none if it would have more cells than allowed.
    fn next_sizes(&self, done: &Done, estimate: &Estimate, goal: &AdaptSpec) -> Option<Sizes> {
        let (meshes, model) = (done.built.discrete.meshes.as_ref()?, done.model());
        let pace = self.pace();
        let share = (AIM * goal.error.value / estimate.largest(goal.of)).max(pace.least).powf(pace.power);
        let cells = self.rounds[self.rounds.len() - 1].cells as f64;
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

    /// Return whether only sharp ends of contacts are left of an error, which meshes of a few times as many cells do
    /// not reach there.
    ///
    /// Without a layer the pressure is K r^(lambda - 1) at the distance r from the end, and facets of size h miss the
    /// order h^(lambda - 1/2) of it. A punch with right angles has lambda = 0.774: a half of the error takes facets of
    /// a thirteenth.
    fn has_costly_ends(&mut self, estimate: &Estimate, goal: &AdaptSpec) -> bool {
        if !matches!(goal.of, Quantity::All | Quantity::Pressures) {
            return false;
        }
        let (asked, error) = (goal.error.value, estimate.ends.iter().copied().fold(0.0, f64::max));
        let cells = self.rounds[self.rounds.len() - 1].cells as f64;
        let own = MeshError { cells, error };
        let beside = estimate.largest_beside_ends(goal.of);
        let Some(before) = self.last_end.replace(own).filter(|_| beside <= asked && error > 0.0) else { return false };
        let needed = own.cells_for(before, asked);
        if needed <= COSTLY * cells {
            return false;
        }
        let meshes = if needed < 1e9 {
            format!("takes a mesh of about {needed:.0e} cells")
        } else {
            "takes more cells than a mesh can have".to_owned()
        };
        let ends: Vec<String> = self.unmet.iter().map(UnmetReport::in_words).collect();
        self.shortfall = Some(Shortfall::SharpEnds(format!(
            "not to {asked:.1e} at sharp ends of contacts: {}; all other errors are {beside:.1e} at most, and {asked:.1e} there {meshes}; a rounded \
             edge or a softer layer bounds these pressures",
            ends.join(", ")
        )));
        true
    }

    /// Return what the error asked for will take, as a line for the terminal, once three meshes show how the error
    /// falls with the cells; none if it does not fall. The seconds are those of the last mesh in proportion to its
    /// cells.
    pub fn forecast(&self) -> Option<String> {
        let goal = self.goal.as_ref()?;
        let [.., first, _, last] = &self.rounds[..] else { return None };
        let error = |round: &RoundReport| MeshError {
            cells: round.cells as f64,
            error: match goal.of {
                Quantity::All => round.pressure.max(round.displacement),
                Quantity::Pressures => round.pressure,
                Quantity::Displacements => round.displacement,
                Quantity::Forces => round.force,
            },
        };
        let asked = goal.error.value;
        let cells = error(last).cells_for(error(first), asked).max(GROWTH * last.cells as f64);
        if !cells.is_finite() {
            return None;
        }
        let limit = if cells > goal.cells as f64 {
            format!(", more than adapt.cells = {} allows", goal.cells)
        } else {
            format!(" and {:.0} s", last.seconds * cells / last.cells as f64)
        };
        Some(format!("  an error of {asked:e} takes about {cells:.0e} cells{limit}"))
    }

    fn record(&mut self, done: &Done, estimate: &Estimate, clock: &mut Clock) {
        let (discrete, total) = (&done.built.discrete, clock.total());
        self.rounds.push(RoundReport {
            cells: discrete.bodies.iter().map(|body| body.cells).sum(),
            dofs: discrete.bodies.iter().map(|body| body.dofs).sum(),
            pressure: estimate.largest(Quantity::Pressures),
            displacement: estimate.displacement,
            force: estimate.largest(Quantity::Forces),
            energy: estimate.energy,
            iterations: done.outcome.iterations,
            seconds: total - self.seconds,
        });
        self.seconds = total;
    }

    /// Return what was asked of the mesh of this round.
    fn adapted(&self) -> Option<Arc<AdaptedMesh>> {
        match &self.scene.mesh {
            MeshSource::Geo(source) => source.adapted.clone(),
            _ => None,
        }
    }

    /// Increase the estimate of a mesh if the difference to the solution on the mesh before shows that it is too small.
    pub fn correct(&mut self, done: &Done, estimate: &mut Estimate) {
        if !self.adapts() || self.is_stepping() || !done.outcome.status.is_solved() {
            return;
        }
        let tables = contact_tables(done);
        let Some(meshes) = &done.built.discrete.meshes else { return };
        let edges: Vec<_> = (0..done.model().pairs.len()).map(|pair| meshes.points(pair).edges()).collect();
        self.previous.iter().for_each(|previous| previous.correct(&tables, &edges, estimate));
        self.previous = Some(EstimatedSolution::new(estimate, tables));
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
