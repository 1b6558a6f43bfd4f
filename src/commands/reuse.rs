//! What a run of a sweep takes over from the run before it: K and f of a body do not depend on method, layers and gaps, so a
//! condensed body is kept as it is, and where only the method changes the whole problem.

use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::parallel::Ranks;
use crate::petsc::Session;
use crate::run;
use crate::run::clock::Clock;
use crate::run::stages::{Built, Done};
use crate::scene::Scene;
use crate::solver::options;
use serde_json::Value;
use std::rc::Rc;

/// Builds `scene` after another scene of the sweep was solved, with what that one has left.
///
/// # Errors
/// Those of [`run::build`].
pub fn build(
    session: &Session,
    scene: Rc<Scene>,
    before: Option<Done>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    let Some(Done { built: mut last, .. }) = before else { return run::build(session, scene, interrupt, clock) };
    // tables of factors change the loads of bodies
    let is_full = !last.scene.method.steps.is_table() && !scene.method.steps.is_table();
    let same = |without: &[&str]| is_full && settings(&last.scene, without) == settings(&scene, without);
    let condensed = last.condensed.len() == last.discrete.bodies.len();
    // an estimate of the error needs the meshes, which are kept only for it
    let meshes = |scene: &Scene| scene.estimate || scene.method.stop.balanced;
    if condensed && meshes(&last.scene) == meshes(&scene) && same(&[]) {
        let discrete = &mut last.discrete;
        discrete.model.exchange = Rc::new(Ranks::new(session));
        let bodies = discrete.model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        discrete.assemblies_avoided = bodies.map(|body| body.begin_anew()).count();
        discrete.assemblies = 0;
        return Ok(Built { scene, ..last });
    }
    let kept = if same(&["gap", "layer", "reference"]) { last.into_condensed() } else { Vec::new() };
    options::withdraw(session)?;
    run::build_with(session, scene, kept, interrupt, clock)
}

/// A scene without what no body depends on, and without some keys of its contacts.
fn settings(scene: &Scene, without: &[&str]) -> Value {
    let mut settings = scene.settings();
    if let Value::Object(map) = &mut settings {
        ["title", "units", "method", "output"].iter().for_each(|key| drop(map.remove(*key)));
    }
    let contacts = settings.get_mut("contact").and_then(Value::as_array_mut).into_iter().flatten();
    for contact in contacts.filter_map(Value::as_object_mut) {
        without.iter().for_each(|key| drop(contact.remove(*key)));
    }
    settings
}
