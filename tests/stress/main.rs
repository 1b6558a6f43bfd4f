//! A small part of `scripts/stress`: the default method and Newton's on random scenes, in one process.

mod random;
mod runs;
mod scenes;

use runs::{Recipe, Verdict};
use std::path::Path;
use winkler::petsc::Session;

/// A series on which both methods are right everywhere, picked for that: a step back shows here. That the others are right
/// too is for `scripts/stress` to tell, which knows scenes that still fail.
const SEED: u64 = 4;

/// Default settings converge on the scenes of a series that have a solution, agree with Newton's method, and say so when there is none.
#[test]
fn random_scenes_are_solved_by_default() {
    let session = Session::start(&[]).expect("one session in this process");
    let meshes = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut bad = Vec::new();
    for index in 0..24 {
        let case = scenes::scene(SEED, index, &meshes);
        let path = folder.path().join(format!("{index}.toml"));
        std::fs::write(&path, &case.text).expect("a scene can be written");
        let reference = runs::reference(&session, &path, &case).expect("a session that lives");
        for name in ["auto", "newton"] {
            let answer = runs::by_method(&session, &path, &Recipe::new(name, &case)).expect("a session that lives");
            let verdict = runs::judge(&case, &reference, &answer);
            if !matches!(verdict, Verdict::Right | Verdict::Named) {
                bad.push(format!("{index} {name}: {verdict:?}, {}: {}", answer.message, case.line));
            }
        }
    }
    assert!(bad.is_empty(), "`scripts/stress --seed 4 --only INDEX --keep` writes the scene file\n{}", bad.join("\n"));
}
