//! The mesh of a scene with what was made on it, for the problems of all load steps, and of other scenes with the same
//! bodies on it.

use super::inner::SolverFactory;
use crate::contact::ContactPair;
use crate::contact::pieces::{self, Cut};
use crate::discretize::meshes::{KeptMeshes, Meshes};
use crate::discretize::{self, Discrete, Kept, Request, Verified};
use crate::error::Result;
use crate::exchange::Plain;
use crate::interrupt::Interrupt;
use crate::mesh::{self, Loaded};
use crate::output::Mark;
use crate::parallel::{Ranks, collectively};
use crate::petsc::Session;
use crate::problem::BodySpec;
use crate::scene::Scene;
use std::path::PathBuf;
use std::rc::Rc;

/// A mesh without its space dimension.
pub trait SceneMesh {
    /// Return the session of its ranks.
    fn session(&self) -> &Session;

    /// Return what is known of it.
    fn facts(&self) -> &MeshFacts;

    /// Take the bodies of another scene, if they are the same on this mesh. Return whether they are.
    ///
    /// # Errors
    /// A line of the scene acts on no body, or on several.
    fn follow(&mut self, scene: &Scene) -> Result<bool>;

    /// Return the bodies of the scene, each with a name of its own.
    fn bodies(&self) -> &[BodySpec];

    /// Make the discrete problem of a scene with the bodies of this mesh, from the problem `before` on it. Collective.
    ///
    /// # Errors
    /// See [`discretize::discretize`].
    fn discretize(&mut self, scene: &Scene, before: Option<Discrete>, inner: &mut SolverFactory) -> Result<Discrete>;

    /// Return the places that a page marks.
    fn marks(&self, bodies: &[BodySpec], pairs: &[ContactPair]) -> Vec<Mark>;
}

/// What is known of a mesh.
pub struct MeshFacts {
    /// Its file, on the rank that has read it.
    pub file: Option<MeshFile>,
    /// Number of dofs of linear elements in space; none in the plane.
    pub dofs_in_space: usize,
    /// A line for each group that is split into bodies.
    pub splits: Vec<String>,
    /// Number of cells that were split into simplices.
    pub split: usize,
    /// Number of curved cells that were made straight.
    pub straightened: usize,
    /// What is to be said of its file, and of surfaces that are sets of nodes, on the rank that has read it.
    pub notes: Vec<String>,
}

/// The file of a mesh.
#[derive(Debug, Clone)]
pub struct MeshFile {
    /// SHA-256 of its contents.
    pub digest: String,
    /// Its path.
    pub path: PathBuf,
    /// Whether Gmsh was to take its default algorithm for tetrahedra instead of HXT.
    pub without_hxt: bool,
}

/// The implementation of [`SceneMesh`] in `D` dimensions.
struct CheckedMesh<const D: usize> {
    session: Session,
    verified: Verified<D>,
    facts: MeshFacts,
    cut: Cut<D>,
    keep: fn(Rc<KeptMeshes<D>>) -> Meshes,
    kept: Kept<D>,
}

/// Read and check the mesh of a scene. The first rank runs Gmsh, reads the mesh and checks it. Collective.
///
/// # Errors
/// What Gmsh, the reader and the checks refuse.
pub fn read(session: &Session, scene: &Scene, interrupt: &Interrupt) -> Result<Box<dyn SceneMesh>> {
    match scene.dimension.value {
        2 => read_in::<2>(session, scene, interrupt, pieces::in_plane, Meshes::Plane),
        _ => read_in::<3>(session, scene, interrupt, pieces::in_space, Meshes::Space),
    }
}

fn read_in<const D: usize>(
    session: &Session,
    scene: &Scene,
    interrupt: &Interrupt,
    cut: Cut<D>,
    keep: fn(Rc<KeptMeshes<D>>) -> Meshes,
) -> Result<Box<dyn SceneMesh>>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    let orders: Vec<_> = scene.bodies.iter().map(|body| body.order).collect();
    let (mut file, mut notes) = (None, Vec::new());
    let read = || {
        interrupt.release()?;
        let Loaded { mesh, file: path, digest, without_hxt, notes: said, .. } =
            mesh::load::<D>(&scene.mesh, &orders, interrupt)?;
        (file, notes) = (Some(MeshFile { digest, path, without_hxt }), said);
        Ok(mesh)
    };
    let verified = discretize::verify(scene, &Ranks::new(session), read);
    let verified = verified.and_then(|verified| interrupt.release().map(|()| verified));
    let mut verified = collectively(session, verified)?;
    verified.mesh.forget_tags();
    notes.append(&mut verified.notes);
    let facts = MeshFacts {
        file,
        dofs_in_space: if D == 3 { D * verified.points } else { 0 },
        splits: verified.splits(),
        split: verified.mesh.split,
        straightened: verified.mesh.straightened,
        notes,
    };
    Ok(Box::new(CheckedMesh { session: session.clone(), verified, facts, cut, keep, kept: Kept::default() }))
}

impl<const D: usize> SceneMesh for CheckedMesh<D>
where
    [f64; D]: Plain,
    [[f64; D]; D]: Plain,
{
    fn session(&self) -> &Session {
        &self.session
    }

    fn facts(&self) -> &MeshFacts {
        &self.facts
    }

    fn follow(&mut self, scene: &Scene) -> Result<bool> {
        self.verified.follow(scene)
    }

    fn bodies(&self) -> &[BodySpec] {
        &self.verified.bodies
    }

    fn discretize(&mut self, scene: &Scene, before: Option<Discrete>, inner: &mut SolverFactory) -> Result<Discrete> {
        let Self { session, verified, cut, keep, kept, .. } = self;
        let keep = (scene.estimate || scene.adapt.is_some()).then_some(*keep);
        let request = Request { scene, verified, cut: *cut, keep };
        let exchange = Rc::new(Ranks::new(session));
        let discrete = discretize::discretize(&request, kept, before, exchange, inner);
        let mut discrete = collectively(session, discrete)?;
        discrete.share();
        Ok(discrete)
    }

    fn marks(&self, bodies: &[BodySpec], pairs: &[ContactPair]) -> Vec<Mark> {
        discretize::marks(&self.verified.mesh, bodies, pairs)
    }
}
