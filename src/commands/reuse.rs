//! What a run of a sweep takes over from the run before it: K of a body does not depend on method, layers, gaps and the values of loads
//! and supports, so a condensed body is kept, and where only the method changes the whole problem.

use crate::error::Result;
use crate::interrupt::Interrupt;
use crate::parallel::Ranks;
use crate::petsc::Session;
use crate::problem::method::{MethodName, MethodSpec};
use crate::run::{self, Built, Clock, Done};
use crate::scene::Scene;
use crate::solver::options;
use serde_json::{Map, Value};
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
    let same = |makes: fn(&mut Value)| settings(&last.scene, makes) == settings(&scene, makes);
    let condensed = last.condensed.len() == last.discrete.bodies.len();
    // an estimate of the error needs the meshes, which are kept only for it
    let meshes = |scene: &Scene| scene.estimate || scene.method.stop.balanced;
    // how linear steps are solved was chosen for the method
    let joined = |MethodSpec { name, linear, .. }: &MethodSpec| {
        matches!(name, MethodName::Auto | MethodName::Newton).then_some((*name, *linear))
    };
    let is_full = is_full && joined(&last.scene.method) == joined(&scene.method);
    if condensed && meshes(&last.scene) == meshes(&scene) && is_full && same(|_| ()) {
        let discrete = &mut last.discrete;
        discrete.model.exchange = Rc::new(Ranks::new(session));
        let bodies = discrete.model.bodies.iter_mut().filter_map(|slot| slot.local.as_mut());
        discrete.assemblies_avoided = bodies.map(|body| body.begin_anew()).count();
        discrete.assemblies = 0;
        return Ok(Built { scene, ..last });
    }
    let kept = if same(without_values) { last.into_condensed() } else { Vec::new() };
    options::withdraw(session)?;
    run::build_with(session, scene, kept, interrupt, clock)
}

/// A scene without what no body depends on, and what `makes` leaves of it.
fn settings(scene: &Scene, makes: fn(&mut Value)) -> Value {
    let mut settings = scene.settings();
    if let Value::Object(map) = &mut settings {
        ["title", "units", "method", "output"].iter().for_each(|key| drop(map.remove(*key)));
    }
    makes(&mut settings);
    settings
}

/// Leaves what stiffness matrices, contact rows and the choice of prescribed dofs come from.
fn without_values(settings: &mut Value) {
    each(settings.get_mut("contact"), |contact| without(contact, &["gap", "layer", "reference"]));
    each(settings.get_mut("body"), |body| {
        without(body, &["force", "path"]);
        if let Some(Value::Array(loads)) = body.get_mut("load") {
            // rigid surfaces join dofs
            loads.retain(|load| load["rigid"] == true);
        }
        for key in ["load", "fix"] {
            each(body.get_mut(key), |item| {
                without(item, &["path"]);
                for key in ["force", "x", "y", "z", "normal"] {
                    item.get_mut(key).into_iter().for_each(|value| *value = Value::Bool(true));
                }
            });
        }
    });
}

fn without(table: &mut Map<String, Value>, keys: &[&str]) {
    keys.iter().for_each(|key| drop(table.remove(*key)));
}

/// Edits each table of a list of a scene.
fn each(list: Option<&mut Value>, edit: impl FnMut(&mut Map<String, Value>)) {
    let tables = list.and_then(Value::as_array_mut).into_iter().flatten();
    tables.filter_map(Value::as_object_mut).for_each(edit);
}
