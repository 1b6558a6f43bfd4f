//! A small part of `scripts/stress`: the default method and Newton's on random scenes, in one process.

mod random;
mod runs;
mod scenes;

use runs::{Recipe, Verdict};
use std::path::Path;
use winkler::petsc::Session;

/// Series and the methods that must be right everywhere in them. The default method takes the first ones that there are; Newton's
/// has a series picked as one without failures, so that a step back shows. The rest is for `scripts/stress` to tell.
const SERIES: [(u64, &[&str]); 4] = [(1, &["auto"]), (2, &["auto"]), (3, &["auto"]), (4, &["auto", "newton"])];

/// Scenes of each series.
const SCENES: usize = 24;

/// Default settings converge on the scenes of a series that have a solution, agree with Newton's method, and say so when there is none.
#[test]
fn random_scenes_are_solved_by_default() {
    let session = Session::start(&[]).expect("one session in this process");
    let meshes = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut bad = Vec::new();
    for (seed, methods) in SERIES {
        for index in 0..SCENES {
            let case = scenes::scene(seed, index, &meshes);
            let path = folder.path().join(format!("{seed}-{index}.toml"));
            std::fs::write(&path, &case.text).expect("a scene can be written");
            let reference = runs::reference(&session, &path, &case).expect("a session that lives");
            for name in methods {
                let answer = runs::by_method(&session, &path, &Recipe::new(name, &case)).expect("a session that lives");
                let verdict = runs::judge(&case, &reference, &answer);
                if !matches!(verdict, Verdict::Right | Verdict::Named) {
                    bad.push(format!("{seed} {index} {name}: {verdict:?}, {}: {}", answer.message, case.line));
                }
            }
        }
    }
    let advice = "`scripts/stress --seed SEED --only INDEX --keep DIR` writes the scene file";
    assert!(bad.is_empty(), "{advice}\n{}", bad.join("\n"));
}
