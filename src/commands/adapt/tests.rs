//! The state of an adaptation in a checkpoint.

use super::*;
use crate::scene::load;
use std::path::Path;

/// Return the plan of a scene that is adapted, without load steps.
fn plan() -> Plan {
    let scene = load(Path::new("meshes/groove-held/scene.toml"), &["adapt.error=1e-3".to_owned()]).expect("a scene");
    Plan::of(Rc::new(scene), None)
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
