//! Several ranks give what one gives.

use crate::common::{Run, Scene, apart, case, solve, solve_on, text_of};
use std::fs;

#[test]
fn two_ranks_give_the_serial_history_and_files() {
    let serial = solve(case("groove"), &["--vtu"]).converged();
    let parallel = solve_on(2, case("groove"), &["--vtu"]).converged();
    let lines = |run: &crate::common::Run, name: &str| -> Vec<String> {
        let text = fs::read_to_string(run.folder.join(name)).expect("a result");
        text.lines().map(str::to_owned).collect()
    };
    // seconds come last
    let history = |run: &crate::common::Run| -> Vec<String> {
        let cut = |line: String| line.rsplit_once(',').map(|(front, _)| front.to_owned());
        lines(run, "history.csv").into_iter().map(|line| cut(line).expect("several columns")).collect()
    };
    assert_eq!(serial.history().names.last().map(String::as_str), Some("seconds"));
    assert_eq!(history(&serial), history(&parallel));
    assert_eq!(history(&serial).len(), 1 + 8);
    for name in ["contact-lower-upper.csv", "lower.vtu", "upper.vtu", "bodies.pvd", "pressure.svg"] {
        let [one, two] = [&serial, &parallel].map(|run| fs::read(run.folder.join(name)).expect("a result"));
        assert!(one == two, "{name}");
    }
    assert_eq!(serial.report["files"], parallel.report["files"]);
    let names = |run: &crate::common::Run| {
        let mut names: Vec<_> =
            fs::read_dir(&run.folder).expect("results").flatten().map(|file| file.file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&serial), names(&parallel));
    assert_eq!(parallel.stderr, "");
}

#[test]
fn two_ranks_report_what_one_reports() {
    let serial = solve(case("groove"), &[]).converged();
    let parallel = solve_on(2, case("groove"), &[]).converged();
    assert_eq!((serial.count("ranks"), parallel.count("ranks")), (1, 2));
    // one message a sweep, and some of a run
    assert!(serial.count("messages") == 0 && parallel.count("messages") <= parallel.count("sweeps") + 12);
    let differ = ["petsc", "ranks", "messages", "times", "inner_times", "bodies", "command", "directory"];
    let (ours, theirs) = (serial.report.as_object(), parallel.report.as_object());
    let (ours, theirs) = (ours.expect("a table"), theirs.expect("a table"));
    assert!(ours.keys().eq(theirs.keys()));
    let differs = |key: &str| differ.contains(&key) || key.starts_with("memory");
    for (key, value) in ours.iter().filter(|(key, _)| !differs(key)) {
        assert_eq!(value, &theirs[key], "{key}");
    }
    let ranks = |run: &crate::common::Run| [run.count("bodies/0/rank"), run.count("bodies/1/rank")];
    assert_eq!(ranks(&serial), [0, 0]);
    assert_eq!(ranks(&parallel), [0, 1]);
    for body in ["/bodies/0/balance", "/bodies/1/balance"] {
        assert!(serial.report.pointer(body).is_some());
        assert_eq!(serial.report.pointer(body), parallel.report.pointer(body));
    }
    // a body of another rank has a solver, too
    assert_eq!(parallel.solvers(), serial.solvers());
}

#[test]
fn a_rank_without_a_body_is_told_of() {
    let run = solve_on(3, case("groove"), &["--set", "mesh.set.n=8"]).converged();
    assert!(run.warnings().contains("1 of 3 ranks"), "{}", run.warnings());
    assert_eq!([run.count("bodies/0/rank"), run.count("bodies/1/rank")], [0, 1]);
    let serial = solve(case("groove"), &["--set", "mesh.set.n=8"]).converged();
    assert_eq!(serial.warnings(), "");
    assert_eq!(run.contact()["pressure"], serial.contact()["pressure"]);
}

#[test]
fn json_is_printed_once() {
    let run = solve_on(2, case("groove"), &["--set", "mesh.set.n=8", "--json"]).converged();
    let printed: serde_json::Value = serde_json::from_str(&run.stdout).expect("one JSON text and nothing else");
    assert_eq!(printed, *run.report);
    let table = solve_on(2, case("groove"), &["--set", "mesh.set.n=8"]).converged();
    assert_eq!(table.stdout.matches("converged in 7 iterations").count(), 1, "{}", table.stdout);
}

/// A refusal that all ranks share: its code, its words once, and no results.
fn refused(run: &Run, code: i32, words: &[&str]) {
    assert_eq!(run.code, code, "{}", run.said());
    assert_eq!(run.stderr.matches("error: ").count(), 1, "{}", run.said());
    for word in words {
        assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
    }
    assert!(run.report.is_null() && !run.stdout.contains("converged"), "{}", run.said());
}

/// All ranks solve the scene of the first one, also on machines with other files. One that is refused is refused once.
#[test]
fn the_first_rank_reads_the_scene() {
    let text = text_of("groove");
    let solve = |first: &str, second: &str| {
        let scenes = [first, second].map(Scene::new);
        let folders = scenes.each_ref().map(|scene| scene.path.parent().expect("a folder"));
        apart(folders, &[], &["solve", "scene.toml", "--set", "mesh.set.n=4"])
    };
    solve(&text, &text.replace("pressure = 10", "presure = 11")).converged();
    refused(&solve(&text.replace("pressure = 10", "presure = 10"), &text), 3, &["did you mean `pressure`?"]);
}
