//! The step from what one rank has of a body to its matrix and its solver, which a factory makes.

use super::body_mesh::BodyMesh;
use super::facts::BodyInfo;
use super::groups::point;
use super::post::FemBody;
use super::scene_body::{elasticity_of, refusal, too_large};
use crate::error::{Error, Result};
use crate::exchange::Plain;
use crate::fem::assemble::{Defect, InitialLoad};
use crate::fem::{Loads, NodeGraph, Prolongation, assemble, rigid, support};
use crate::linalg::{Csr, countable};
use crate::mesh::Mesh;
use crate::model::{Body, BodyCounts, BodyFacts, BodySlot, Distribution};
use crate::problem::{BodySpec, Plane};
use std::cell::OnceCell;
use std::path::Path;
use std::rc::Rc;

/// The assembly of all bodies on one rank.
pub struct Assembler<'a, const D: usize, F> {
    pub mesh: &'a Mesh<D>,
    /// Kind of a plane problem.
    pub plane: Plane,
    pub rank: usize,
    /// The maker of solvers.
    pub factory: &'a mut F,
    /// Number of matrices that were assembled in the run.
    pub assemblies: usize,
    /// Meshes of the bodies that this rank has.
    pub shapes: Vec<Rc<FemBody<D>>>,
}

/// A body of the problem before.
#[derive(Default)]
pub struct EarlierBody {
    /// The body with its slot, if it serves again.
    serving: Option<(Body, BodySlot)>,
    /// Its counters, if another one takes its place.
    counts: BodyCounts,
}

impl EarlierBody {
    /// Keep a body if it serves again, and let it go otherwise.
    pub fn new(mut slot: BodySlot, serves: bool) -> Self {
        let Some(body) = slot.local.take() else { return Self::default() };
        let counts = body.counts();
        Self { serving: serves.then_some((body, slot)), counts }
    }
}

impl<const D: usize, F: Factory> Assembler<'_, D, F> {
    /// Assemble a body and give it a solver, from what this rank has of it, or take that of the problem `before`.
    /// `slot` receives the body, and `info` the evaluation of its displacements.
    ///
    /// # Errors
    /// The scene contradicts its mesh in a way that shows when K is assembled, or the factory fails.
    pub fn make(
        &mut self,
        spec: &BodySpec,
        mut mesh: BodyMesh<D>,
        before: EarlierBody,
        slot: &mut BodySlot,
        info: &mut BodyInfo,
    ) -> Result<()> {
        let elasticity = Rc::new(elasticity_of(spec, std::mem::take(&mut mesh.regions), D, self.plane)?);
        let (name, exact, supports, own) = (info.name.clone(), spec.exact.clone(), spec.fix.len(), mesh.own_nodes());
        let mut body = FemBody { name, exact, supports, mesh, own, elasticity, split: OnceCell::new() };
        if body.mesh.is_owned {
            let initial = initial_load(spec, &body, &self.mesh.path)?;
            slot.heat = initial.energy;
            self.give_solver(spec, &mut body, &initial, before, slot, info.rank)?;
        }
        let body = Rc::new(body);
        if body.mesh.is_owned {
            body.check_exact()?;
            info.points = body.points();
            info.post = Some(body.clone());
        }
        self.shapes.push(body);
        Ok(())
    }

    /// Give a body its solver: that of the problem before under other loads, if it serves, or a new one. On ranks other
    /// than the `owner` scale and stiffness of rows stay zero until [`Discrete::share`](super::Discrete::share).
    fn give_solver(
        &mut self,
        spec: &BodySpec,
        fem: &mut FemBody<D>,
        initial: &InitialLoad,
        before: EarlierBody,
        slot: &mut BodySlot,
        owner: usize,
    ) -> Result<()> {
        let is_owner = owner == self.rank;
        if let Some((mut body, BodySlot { scale, row_stiffness, .. })) = before.serving {
            body.reload(fem.mesh.load_vector(), initial, fem.mesh.prescribed())?;
            (slot.local, slot.scale, slot.row_stiffness) = (Some(body), scale, row_stiffness);
            // the sums of all ranks are known
            slot.row_stiffness.iter_mut().filter(|_| !is_owner).for_each(|stiffness| *stiffness = 0.0);
        } else {
            self.assemblies += usize::from(is_owner);
            self.assemble(spec, fem, initial, slot)?;
            slot.local.iter_mut().for_each(|body| body.count_on(before.counts));
        }
        slot.scale = if is_owner { slot.scale } else { 0.0 };
        Ok(())
    }

    /// Assemble the matrix of a body, all of it or the rows of this rank, and make its solver, which takes the contact
    /// rows.
    fn assemble(
        &mut self,
        spec: &BodySpec,
        fem: &mut FemBody<D>,
        initial: &InitialLoad,
        slot: &mut BodySlot,
    ) -> Result<()> {
        let mesh = &mut fem.mesh;
        let (mut force, prescribed) = (mesh.load_vector(), mesh.prescribed());
        let modes = mesh.free_motions().iter();
        let mut unconstrained_modes: Vec<Vec<f64>> = modes.map(|motion| mesh.dofs_of(motion)).collect();
        unconstrained_modes.iter_mut().for_each(|motion| prescribed.iter().for_each(|entry| motion[entry.0] = 0.0));
        mesh.graph();
        let (distribution, rows) = (mesh.distribution.take(), std::mem::take(&mut mesh.rows));
        let mut graph = mesh.graph.take().unwrap_or_else(|| unreachable!("the graph was requested"));
        if let Some(distribution) = &distribution {
            graph = graph.of(|node| distribution.owned_index(D * node).is_some());
        }
        let mut stiffness = stiffness(spec, fem, &self.mesh.path, &graph)?;
        drop(graph);
        // These rows belong to other ranks.
        (0..force.len()).filter(|&i| stiffness.range(i).is_empty()).for_each(|i| force[i] = 0.0);
        let mut loads = support(&mut stiffness, force, initial, prescribed);
        slot.scale = stiffness.diagonal(0).into_iter().fold(0.0, f64::max);
        slot.row_stiffness = rows.stiffness_of_nodes(&stiffness, D);
        if let Some(distribution) = &distribution {
            (stiffness, loads) = (distribution.restrict_stiffness(stiffness), distribution.restrict(loads));
        }
        let mesh = &fem.mesh;
        let interpolation = self.factory.wants_interpolation(&slot.name).then(|| match &distribution {
            Some(owned) => owned.restrict_interpolation(&mesh.interpolation(&owned.coarse_nodes), D),
            None => mesh.interpolation(&mesh.coarse_nodes()),
        });
        // Multigrid must represent motions with hardly any strain. Far from the axis, a ring is nearly as soft against
        // radial displacements and rotations of its section as a plane body.
        let near_null_space = || rigid::modes(&mesh.extent).iter().map(|motion| mesh.dofs_of(motion)).collect();
        let body = self.factory.make(Assembled {
            name: slot.name.clone(),
            dimension: D,
            stiffness,
            loads,
            distribution,
            rows,
            near_null_space: &near_null_space,
            unconstrained_modes,
            interpolation,
        })?;
        slot.local = Some(body);
        Ok(())
    }
}

/// Assemble K of a body on its graph, which may have the rows of some nodes only. `path` is that of the mesh.
fn stiffness<const D: usize>(spec: &BodySpec, fem: &FemBody<D>, path: &Path, graph: &NodeGraph) -> Result<Csr> {
    let (name, BodyMesh { space, held, springs, .. }) = (&spec.name, &fem.mesh);
    countable(&format!("the stiffness matrix of body `{}`", name.value), graph.entries::<D>())?;
    let mut stiffness = assemble::stiffness(space, graph, &held.frame, &fem.elasticity)
        .map_err(|defect| refused(spec, &fem.mesh, path, defect))?;
    if (0..stiffness.rows()).any(|row| stiffness.row(row).any(|(_, k)| !k.is_finite())) {
        let message = format!("body `{}`: its stiffness is beyond the range of numbers", name.value);
        return Err(Error::scene(&spec.elasticity().place, message).label("far too large"));
    }
    springs.iter().for_each(|springs| assemble::add_blocks(graph, &held.frame, springs, &mut stiffness));
    Ok(stiffness)
}

/// Return the load of the initial strains of a body at all dofs. Rows of nodes that this rank does not own are not
/// complete, and cells whose first node it does not own have no energy.
///
/// # Errors
/// A temperature or an expansion is not finite somewhere.
fn initial_load<const D: usize>(spec: &BodySpec, fem: &FemBody<D>, path: &Path) -> Result<InitialLoad> {
    let counts = |cell: &[u32]| cell.iter().min().is_some_and(|&first| fem.own[first as usize]);
    let mut load = assemble::initial_load(&fem.mesh.space, &fem.elasticity, counts)
        .map_err(|defect| refused(spec, &fem.mesh, path, defect))?;
    if !load.force.iter().all(|force| force.is_finite()) {
        return Err(too_large(spec));
    }
    if !load.force.is_empty() {
        fem.mesh.held.frame.forces(&mut load.force);
    }
    Ok(load)
}

/// Return the error of a body that cannot be assembled.
fn refused<const D: usize>(spec: &BodySpec, body: &BodyMesh<D>, path: &Path, defect: Defect) -> Error {
    match defect {
        Defect::Inverted(cell) => {
            let corner = body.space.in_scene(body.space.cell_nodes(cell)[0]);
            let message = format!("body `{}`: the curved cell at {} is folded", spec.name.value, point(corner));
            Error::mesh(path, None, message).help("refine the mesh there, or use order = 1")
        }
        Defect::Elasticity(number, x, flaw) => refusal(spec, number, Some(x), &flaw),
    }
}

/// A maker of the inner solvers of bodies.
pub trait Factory {
    /// The choice of solvers of all bodies.
    type SolverPlan: Plain;

    /// Choose the solvers of all bodies, in the order of the scene, on the first rank: their facts, and the dofs to
    /// which each could be condensed. `is_kept` says whether each body has the matrix of the problem before, and then
    /// also whether its solver serves.
    ///
    /// # Errors
    /// PETSc lacks a solver that the scene asks for.
    fn plan(&mut self, bodies: Vec<(BodyFacts, Vec<usize>)>, is_kept: &mut [bool]) -> Result<Self::SolverPlan>;

    /// Follow the plan of the first rank on another rank.
    fn adopt(&mut self, plan: Self::SolverPlan);

    /// Let the solver of all bodies go before others are made, unless it may serve again: `is_renewed` says whether all
    /// bodies are those of the problem before. Collective.
    fn settle(&mut self, is_renewed: bool);

    /// Return the sets of bodies whose nodes the plan distributes over the ranks. Bodies of one set share a matrix;
    /// their indices are in increasing order. Bodies that stay whole are in no set.
    fn distributed(&self) -> Vec<Vec<usize>>;

    /// Return whether the plan eliminates unknowns of a body, so that contact rows with few entries pay.
    fn eliminates(&self, body: usize) -> bool;

    /// Return whether the plan needs the interpolation of a body from linear displacements.
    fn wants_interpolation(&self, name: &str) -> bool;

    /// Make the solver of a body by its plan, on each rank that owns the body or a part of it.
    ///
    /// # Errors
    /// PETSc refuses a matrix or the value of an option.
    fn make(&mut self, assembled: Assembled) -> Result<Body>;
}

/// A body that is ready for its inner solver.
pub struct Assembled<'a> {
    /// Name in the scene.
    pub name: String,
    /// Space dimension, which is the block size of the matrix.
    pub dimension: usize,
    /// K on all dofs, or the rows of those of this rank. The plan says what takes it.
    pub stiffness: Csr,
    /// f and supports on these dofs.
    pub loads: Loads,
    /// Distribution of the dofs, if the body is distributed.
    pub distribution: Option<Distribution>,
    /// All contact rows of the body, pair by pair. The columns are its dofs, or those of the nodes that this rank has.
    pub rows: Csr,
    /// Motions with hardly any strain in a few cells, for the near-null space of multigrid. They are the rigid motions
    /// of the free body, in a body of revolution those of its meridian. Each is one vector over these dofs.
    pub near_null_space: &'a dyn Fn() -> Vec<Vec<f64>>,
    /// Displacements of the rigid motions that supports and springs leave, on these dofs.
    pub unconstrained_modes: Vec<Vec<f64>>,
    /// Interpolation of displacements from linear ones, if it was requested. The rows are those of K. The
    /// columns belong to this body alone, or to all bodies of the matrix if the dofs are distributed.
    pub interpolation: Option<Prolongation>,
}
