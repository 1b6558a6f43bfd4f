//! A small part of `scripts/stress`: the default method and Newton's on random scenes, in one process.

mod builder;
mod crushed;
mod laws;
mod mixed;
mod random;
mod runs;
mod saturating;
mod scenes;
mod slender;
mod wide;

use self::runs::{Answer, Recipe, Verdict};
use self::scenes::Case;
use crate::common::here::with_session;
use std::path::Path;
use winkler::petsc::Session;

/// Series and the methods that must be right everywhere in them. The default method takes the first ones that there are; Newton's
/// has a series picked as one without failures, so that a step back shows. The rest is for `scripts/stress` to tell.
const SERIES: [(u64, &[&str]); 4] = [(1, &["auto"]), (2, &["auto"]), (3, &["auto"]), (4, &["auto", "newton"])];

/// Scenes of each series.
const SCENES: usize = 24;

/// A series of the wider box, and one of slender bodies.
const WIDE: u64 = 100;
const SLENDER: u64 = 100;

/// A series with obstacles, bonds and forces.
const MIXED: u64 = 1;

/// A series with layers that remember, and bonds that carry shear.
const CRUSHED: u64 = 1;

/// Runs scenes in the session.
struct Bench<'s> {
    session: &'s Session,
    folder: tempfile::TempDir,
}

impl Bench<'_> {
    /// What methods make of a scene, and the scene in words.
    fn run(&self, seed: u64, index: usize, methods: &[&str]) -> (Vec<(Verdict, Answer)>, String) {
        self.solve(scenes::scene(seed, index, Path::new(env!("CARGO_MANIFEST_DIR"))), methods)
    }

    /// The same of any scene.
    fn solve(&self, case: Case, methods: &[&str]) -> (Vec<(Verdict, Answer)>, String) {
        let path = self.folder.path().join("scene.toml");
        std::fs::write(&path, &case.text).expect("a scene can be written");
        let reference = runs::reference(self.session, &path, &case).expect("a session that lives");
        let by = |name: &&str| {
            let recipe = Recipe::new(name, &case);
            let answer = runs::by_method(self.session, &path, &recipe).expect("a session that lives");
            (runs::judge(&case, &reference, &answer), answer)
        };
        (methods.iter().map(by).collect(), case.line.clone())
    }
}

#[test]
fn random_scenes() {
    with_session(|session| {
        let bench = Bench { session, folder: tempfile::tempdir().expect("a temporary folder") };
        scenes_are_solved_by_default(&bench);
        no_method_claims_what_it_has_not(&bench);
    });
}

/// Default settings converge on the scenes of a series that have a solution, agree with Newton's method, and say so when there is none.
fn scenes_are_solved_by_default(bench: &Bench) {
    let mut bad = Vec::new();
    let mut judge = |series: String, methods: &[&str], (answers, scene): (Vec<(Verdict, Answer)>, String)| {
        for (name, (verdict, answer)) in methods.iter().zip(answers) {
            if !matches!(verdict, Verdict::Right | Verdict::Named) {
                bad.push(format!("{series} {name}: {verdict:?}, {}: {scene}", answer.message));
            }
        }
    };
    for (seed, methods) in SERIES {
        for index in 0..SCENES {
            judge(format!("{seed} {index}"), methods, bench.run(seed, index, methods));
        }
    }
    for index in 0..SCENES {
        let case = wide::scene(WIDE, index, Path::new(env!("CARGO_MANIFEST_DIR")));
        judge(format!("wide {WIDE} {index}"), &["auto"], bench.solve(case, &["auto"]));
    }
    for index in 0..SCENES {
        let case = slender::scene(SLENDER, index, Path::new(env!("CARGO_MANIFEST_DIR")));
        judge(format!("slender {SLENDER} {index}"), &["auto"], bench.solve(case, &["auto"]));
    }
    for index in 0..SCENES {
        let case = mixed::scene(MIXED, index, Path::new(env!("CARGO_MANIFEST_DIR")));
        judge(format!("mixed {MIXED} {index}"), &["auto"], bench.solve(case, &["auto"]));
    }
    for index in 0..SCENES {
        let case = crushed::scene(CRUSHED, index, Path::new(env!("CARGO_MANIFEST_DIR")));
        judge(format!("crushed {CRUSHED} {index}"), &["auto"], bench.solve(case, &["auto"]));
    }
    let advice = "`scripts/stress --seed SEED --only INDEX --keep DIR` writes the scene file, with --wide, --slender, --mixed or --crushed of that family";
    assert!(bad.is_empty(), "{advice}\n{}", bad.join("\n"));
}

/// Scenes on which methods said converged with pressures 1e-6 to 3e-5 off: their last step was short, or went along modes that
/// the contact does not feel; or a gap of 10 was rounded with an origin of its own, beside compressions of 1e-13 to 1e-11.
const DECEPTIVE: [(u64, usize, &str); 5] =
    [(2, 46, "aitken"), (2, 57, "aitken"), (3, 137, "aitken"), (5, 390, "newton-robin"), (8, 51, "newton-robin")];

fn no_method_claims_what_it_has_not(bench: &Bench) {
    for (seed, index, name) in DECEPTIVE {
        for (verdict, answer) in bench.run(seed, index, &[name]).0 {
            assert!(!matches!(verdict, Verdict::Wrong(_)), "{seed} {index} {name}: {verdict:?}, {}", answer.message);
            let claimed = answer.status == "roundoff-limited" && answer.residual > runs::RESIDUAL;
            assert!(!claimed, "{seed} {index} {name}: rounding is far");
        }
    }
    // rigid motions alone miss the start's trace by little, and p ~ c^10 makes 1e48 of it
    assert_eq!(bench.run(7, 276, &["auto"]).0[0].1.status, "converged");
    // the resultant goes through the one point about which a body can turn: what is lacking there is rounding beside all of it
    assert_eq!(bench.run(11, 82, &["auto"]).0[0].1.status, "converged");
    // two bodies fall 192 onto a soft layer, with a stiff one between them that closes first: the start finds the way through it
    let answer = &bench.run(14, 483, &["auto"]).0[0].1;
    assert!(answer.status == "converged" && answer.iterations <= 8, "{} {}", answer.iterations, answer.message);
    // springs of 1e-169 are rounding beside the one that keeps the next body: both motions get one
    assert_eq!(bench.run(132111, 727, &["auto"]).0[0].1.status, "converged");
    // a layer of 1e14 would answer the rounding of compressions with 1e-7 of the largest pressure: pressures are those of the linear steps. Roundoff ends the
    // run, three steps after the last progress, and a last digit may pass for progress once more
    let case = wide::scene(132118, 113, Path::new(env!("CARGO_MANIFEST_DIR")));
    let (verdict, answer) = &bench.solve(case, &["auto"]).0[0];
    assert!(!matches!(verdict, Verdict::Wrong(_)), "{verdict:?}, {}", answer.message);
    assert!(answer.claims && answer.iterations <= 13, "{} {}", answer.iterations, answer.message);
    // the laws are met to rounding, but a body of tiny forces lacks a share of its balance
    let case = wide::scene(428015, 186, Path::new(env!("CARGO_MANIFEST_DIR")));
    let answer = &bench.solve(case, &["auto"]).0[0].1;
    assert!(answer.claims && answer.iterations <= 40, "{} {}", answer.iterations, answer.message);
    // nothing holds a block that is pulled off
    let case = wide::scene(145215, 97, Path::new(env!("CARGO_MANIFEST_DIR")));
    assert_eq!(bench.solve(case, &["auto"]).0[0].1.status, "unbounded");
    // steps that led in a circle leave it by smoothed laws, and come to what rounding allows
    let case = wide::scene(2170544, 290, Path::new(env!("CARGO_MANIFEST_DIR")));
    let answer = &bench.solve(case, &["auto"]).0[0].1;
    assert!(answer.claims && answer.iterations <= 30, "{} {}", answer.iterations, answer.message);
    // contact peels off leaves whose overlap stores far more energy than bending
    let case = slender::scene(777123, 57, Path::new(env!("CARGO_MANIFEST_DIR")));
    let answer = &bench.solve(case, &["auto"]).0[0].1;
    assert_eq!(answer.status, "converged", "{}", answer.message);
    // a soft bond lets nothing resist the rise of both blocks from an obstacle
    let case = mixed::scene(777123, 45, Path::new(env!("CARGO_MANIFEST_DIR")));
    assert_eq!(bench.solve(case, &["auto"]).0[0].1.status, "unbounded");
    // steps that led in a circle where a crushed layer is stiff, and then soft again: with bodies that yield, and before an obstacle on a face that is held
    for (seed, index) in [(1795998884, 243), (1795999505, 59)] {
        let case = crushed::scene(seed, index, Path::new(env!("CARGO_MANIFEST_DIR")));
        let answer = &bench.solve(case, &["auto"]).0[0].1;
        assert!(answer.claims && answer.iterations <= 60, "{index}: {} {}", answer.iterations, answer.message);
    }
    // the residual is met, but a body is not in balance yet: that is neither converged nor rounding
    let answer = &bench.run(1, 123, &["0.6"]).0[0].1;
    assert_eq!(answer.status, "iteration-limit");
    assert!(answer.residual <= 1e-8, "{}", answer.message);
}

/// Layers that saturate: wherever Newton's method begins, it ends with the pressures that balance the load.
#[test]
fn layers_that_saturate() {
    with_session(|session| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("scene.toml");
        for index in 0..60 {
            let case = saturating::scene(1, index, Path::new(env!("CARGO_MANIFEST_DIR")));
            std::fs::write(&path, &case.text).expect("a scene can be written");
            let answer = runs::by_method(session, &path, &Recipe::new("auto", &case)).expect("a session that lives");
            let load = case.carried.expect("a load");
            let is_carried = answer.force.iter().all(|force| (force / load - 1.0).abs() < 1e-6);
            let is_right = answer.status == "converged" && is_carried;
            assert!(is_right && answer.iterations <= 60, "{}: {:?}, {}", answer.message, answer.force, case.line);
        }
    });
}
