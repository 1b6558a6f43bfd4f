//! Meshes that follow a field of sizes.

use crate::discretize::meshes::Meshes;
use crate::error::Result;
use crate::estimate::sizes::Sizes;
use crate::interrupt::Interrupt;
use crate::mesh;
use crate::petsc::Session;
use crate::problem::MeshSource;
use crate::run::{self, Clock};
use crate::scene::Scene;
use crate::solver::options;

/// Build the scene on its own mesh, and return the view of the sizes that `sizing` makes of the meshes and the number of bodies.
pub(super) fn sized(
    session: &Session,
    scene: &Scene,
    sizing: fn(&dyn Meshes, usize) -> Sizes,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Option<String>> {
    let built = run::build(session, scene.clone(), interrupt, clock)?;
    let bodies = built.discrete.bodies.len();
    let sizes = built.discrete.meshes.as_ref().map(|meshes| view(&sizing(&**meshes, bodies)));
    options::withdraw(session).map(|()| sizes)
}

/// Return sizes as a view of Gmsh.
pub(super) fn view(sizes: &Sizes) -> String {
    mesh::view(sizes.stride, &sizes.corners, &sizes.sizes)
}

/// Let the mesh of a scene follow a view of sizes.
pub(super) fn follow(scene: &mut Scene, view: Option<String>) {
    if let MeshSource::Geo { sizes, .. } = &mut scene.mesh {
        *sizes = view.map(Into::into);
    }
}
