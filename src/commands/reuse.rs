//! What a run of a sweep takes over from the run before it: K and f of a body do not depend on method, layers and gaps, so a
//! condensed body is kept as it is, and where only the method changes the whole problem.

use super::clock::Clock;
use super::prepared::Prepared;
use super::run;
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::parallel::Ranks;
use crate::petsc::Session;
use crate::scene::Scene;
use crate::solver::options;
use serde_json::Value;

/// Prepares `scene` after another scene of the sweep was solved, with what that one has left.
///
/// # Errors
/// Those of [`run::prepare`].
pub fn prepare(
    session: &Session,
    scene: &Scene,
    before: Option<(&Scene, Prepared)>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Prepared> {
    let Some((last, mut prepared)) = before else { return run::prepare(session, scene, interrupt, clock) };
    let same = |without: &[&str]| settings(last, without) == settings(scene, without);
    let condensed = prepared.condensed.len() == prepared.problem.bodies.len();
    // an estimate of the error needs the meshes, which are kept only for it
    let meshes = |scene: &Scene| scene.estimate || scene.method.stop.balanced;
    if condensed && meshes(last) == meshes(scene) && same(&[]) {
        let model = &mut prepared.problem.model;
        model.exchange = Box::new(Ranks::new(session));
        let bodies = model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        prepared.problem.assemblies_avoided = bodies.map(|body| body.begin_anew()).count();
        prepared.problem.assemblies = 0;
        return Ok(prepared);
    }
    let kept = if same(&["gap", "layer", "reference"]) { prepared.take_condensed() } else { Vec::new() };
    drop(prepared);
    options::withdraw(session)?;
    run::prepare_with(session, scene, kept, interrupt, clock)
}

/// A scene without what no body depends on, and without some keys of its contacts.
fn settings(scene: &Scene, without: &[&str]) -> Value {
    let mut settings = scene.settings();
    if let Value::Object(map) = &mut settings {
        ["title", "method", "output"].iter().for_each(|key| drop(map.remove(*key)));
    }
    let contacts = settings.get_mut("contact").and_then(Value::as_array_mut).into_iter().flatten();
    for contact in contacts.filter_map(Value::as_object_mut) {
        without.iter().for_each(|key| drop(contact.remove(*key)));
    }
    settings
}
