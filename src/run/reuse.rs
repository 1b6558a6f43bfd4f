//! What a run takes over from the run of another scene before it, as in a sweep.
//!
//! The stiffness matrix of a body does not depend on method, layers, gaps and the values of loads and supports: then a condensed body is reused.
//! Where only the method changes, the whole problem is reused.

use super::clock::Clock;
use super::phases::{build, build_with};
use super::stages::{Built, Done};
use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::parallel::Ranks;
use crate::petsc::Session;
use crate::problem::method::{MethodName, MethodSpec};
use crate::scene::Scene;
use crate::solver::options;
use serde_json::{Map, Value};
use std::rc::Rc;

/// Build a scene with what the run of another scene before it has left. Collective.
///
/// # Errors
/// Those of [`build`].
pub fn build_after(
    session: &Session,
    scene: Rc<Scene>,
    before: Option<Done>,
    interrupt: &Interrupt,
    clock: &mut Clock,
) -> Result<Built> {
    let Some(Done { built: mut last, .. }) = before else { return build(session, scene, interrupt, clock) };
    if serves(&last, &scene) {
        let discrete = &mut last.discrete;
        discrete.model.exchange = Rc::new(Ranks::new(session));
        let bodies = discrete.model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        discrete.assemblies_avoided = bodies.map(|body| body.begin_anew()).count();
        discrete.assemblies = 0;
        return Ok(Built { scene, ..last });
    }
    let is_same = settings(&last.scene, without_values) == settings(&scene, without_values);
    let condensed = if is_same { last.into_condensed() } else { Vec::new() };
    options::withdraw(session)?;
    build_with(session, scene, condensed, interrupt, clock)
}

/// Return whether the problem of the run before serves another scene as a whole: only the method differs, and all bodies are condensed.
fn serves(last: &Built, scene: &Scene) -> bool {
    let both = [&*last.scene, scene];
    // an estimate of the error needs the meshes, which are kept only for it
    let [old_meshes, new_meshes] = both.map(|scene| scene.estimate || scene.method.stop.balanced);
    // how linear steps are solved was chosen for the method
    let [old_joint, new_joint] = both.map(|scene| {
        let MethodSpec { name, linear, .. } = &scene.method;
        matches!(name, MethodName::Auto | MethodName::Newton).then_some((*name, *linear))
    });
    last.condensed.len() == last.discrete.bodies.len()
        && old_meshes == new_meshes
        // tables of factors change the loads of bodies
        && both.iter().all(|scene| !scene.method.steps.is_table())
        && old_joint == new_joint
        && settings(&last.scene, |_| ()) == settings(scene, |_| ())
}

/// Return the settings of a scene on which bodies can depend, changed by `edit`.
fn settings(scene: &Scene, edit: fn(&mut Value)) -> Value {
    let mut settings = scene.settings();
    if let Value::Object(map) = &mut settings {
        ["title", "units", "method", "output"].iter().for_each(|key| drop(map.remove(*key)));
    }
    edit(&mut settings);
    settings
}

/// Remove the settings on which stiffness matrices, contact rows and the set of prescribed dofs do not depend.
fn without_values(settings: &mut Value) {
    each(settings.get_mut("contact"), |contact| without(contact, &["gap", "layer", "reference"]));
    each(settings.get_mut("body"), |body| {
        without(body, &["force", "path"]);
        if let Some(Value::Array(loads)) = body.get_mut("load") {
            // only rigid surfaces change the dofs: they join them
            loads.retain(|load| load["rigid"] == true);
        }
        for key in ["load", "fix"] {
            each(body.get_mut(key), |item| {
                without(item, &["path"]);
                for key in ["force", "moment", "x", "y", "z", "normal"] {
                    item.get_mut(key).into_iter().for_each(|value| *value = Value::Bool(true));
                }
            });
        }
    });
}

fn without(table: &mut Map<String, Value>, keys: &[&str]) {
    keys.iter().for_each(|key| drop(table.remove(*key)));
}

/// Edit each table of a list in the settings.
fn each(list: Option<&mut Value>, edit: impl FnMut(&mut Map<String, Value>)) {
    let tables = list.and_then(Value::as_array_mut).into_iter().flatten();
    tables.filter_map(Value::as_object_mut).for_each(edit);
}
