//! Many bodies: what users type reaches every one, and files and lines stay as few as a person looks through.

use crate::common::{Run, case, solve, winkler};
use std::fs;

/// Courses, and bricks of a course. PETSc's table of options has no room for hypre's defaults of each brick.
const SIDE: usize = 7;

/// Bodies of that wall.
const BODIES: usize = SIDE * SIDE;

/// Pairs with files of their own.
const LISTED: usize = 24;

/// Arguments for a wall of that size.
const WALL: [&str; 4] = ["--set", "mesh.set.columns=7", "--set", "mesh.set.rows=7"];

/// Solves the wall.
fn wall(more: &[&str]) -> Run {
    solve(case("wall"), &[&WALL, more].concat())
}

/// A few iterations in which every body has a solver of its own.
fn robin(more: &[&str]) -> Run {
    let run = wall(&[&["--method", "robin", "--set", "method.stop.iterations=3"], more].concat());
    assert_eq!(run.text("status"), "iteration-limit", "{}", run.said());
    run
}

/// However many bodies there are, each has its solver. Its own options replace those of all, and both win over the program's; PETSc's
/// table has what was typed and no more, and all of it was read.
#[test]
fn every_body_has_its_options() {
    let direct = robin(&["--set", "solver=mumps"]);
    assert_eq!(direct.solvers(), ["preonly + cholesky by mumps"; BODIES]);
    let typed =
        ["-brick_odd_7_ksp_type", "minres", "-ksp_rtol", "1e-9", "-brick_odd_49_ksp_converged_reason", "-options_left"];
    let run = robin(&[&["--set", "solver=hypre"], &typed[..]].concat());
    let mut solvers = ["cg + hypre"; BODIES];
    solvers[6] = "minres + hypre";
    assert_eq!((run.solvers(), run.warnings()), (solvers.to_vec(), direct.warnings()));
    assert_eq!(
        run.stdout.matches("Linear brick_odd_49_ solve converged due to CONVERGED_RTOL").count(),
        run.stdout.matches("Linear").count()
    );
    assert!(run.stdout.contains("Linear brick_odd_49_"), "{}", run.stdout);
    let table: Vec<&str> = run.stdout.lines().filter(|line| line.starts_with('-')).collect();
    assert_eq!(
        table,
        ["-brick_odd_49_ksp_converged_reason", "-brick_odd_7_ksp_type minres", "-ksp_rtol 1e-9", "-options_left"],
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("There are no unused options"), "{}", run.stdout);
    let [exact, near] = [&direct, &run].map(|run| run.history()["residual"].to_vec());
    assert!(exact.iter().zip(&near).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{exact:?} {near:?}");

    let slip = wall(&["--method", "robin", "-brick_even_8_ksp_tpye", "cg"]);
    assert!(slip.code == 5 && slip.stderr.contains("did you mean -brick_even_8_ksp_type?"), "{}", slip.said());
    let idle = robin(&["-pc_type", "icc", "-pc_gamg_threshold", "0.1"]);
    assert_eq!(idle.solvers(), ["cg + icc by petsc"; BODIES]);
    assert!(idle.warnings().contains("-pc_gamg_threshold was not used"), "{}", idle.warnings());
}

/// Names of the files of a run that begin and end so.
fn files(run: &Run, start: &str, end: &str) -> usize {
    let names = fs::read_dir(&run.folder).expect("results").flatten().map(|entry| entry.file_name());
    names.filter(|name| name.to_str().is_some_and(|name| name.starts_with(start) && name.ends_with(end))).count()
}

/// A row for every pair; tables, plots and lines for the busiest, for all on request.
#[test]
fn the_busiest_pairs_have_files() {
    let run = wall(&[]).converged();
    let pairs = run.report["pairs"].as_array().expect("pairs");
    let counts = |run: &Run| [files(run, "contact-", ".csv"), files(run, "pressure", ".svg")];
    assert_eq!(counts(&run), [LISTED; 2]);
    assert_eq!(run.report["files"].as_array().map(Vec::len), Some(2 * LISTED + 4), "{}", run.report["files"]);
    let text = fs::read_to_string(run.folder.join("contacts.csv")).expect("contacts.csv");
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), pairs.len());
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().expect("a number");
    let force = |row: &&Vec<&str>| number(row, 6).hypot(number(row, 7));
    let (tabled, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| !row[35].is_empty());
    let least = tabled.iter().map(force).fold(f64::INFINITY, f64::min);
    assert!(tabled.len() == LISTED && others.iter().map(force).all(|force| force <= least), "{text}");
    for row in tabled {
        let table = run.table(row[35]);
        assert_eq!((table.rows(), files(&run, row[36], "")), (row[4].parse().expect("points"), 1));
        let most = table["pressure"].iter().copied().fold(0.0, f64::max);
        assert_eq!(most, number(row, 11));
    }
    // the bed joints above the first course carry all that lies on it: 1.75 m of wall, courses of 0.125 m
    let first: Vec<String> = (1..=SIDE).map(|brick| format!("brick_odd_{brick}")).collect();
    let is_first = |name: &str| first.iter().any(|known| known == name);
    let is_bed = |row: &&Vec<&str>| is_first(row[0]) != is_first(row[1]);
    let carried: f64 = rows.iter().filter(is_bed).map(|row| number(row, 7).abs()).sum();
    let (width, pi) = (0.25 * SIDE as f64, std::f64::consts::PI);
    let expected = 0.5 * (width + (pi * width).sin() / pi) + 0.018 * width * 0.125 * (SIDE - 1) as f64;
    assert!((carried / expected - 1.0).abs() < 1e-6, "{carried} {expected}");
    // what was left out is reported, with the way to it
    let left = pairs.len() - LISTED;
    assert!(run.text("left_out").starts_with(&format!("{left} of {} pairs", pairs.len())), "{}", run.said());
    assert!(run.stdout.contains("--set output.pairs=all") && run.stdout.lines().count() < LISTED + 8, "{}", run.stdout);
    let all = wall(&["--set", "output.pairs=all", "--set", "output.plots=false"]).converged();
    assert_eq!((counts(&all), &all.report["left_out"]), ([pairs.len(), 0], &serde_json::Value::Null));
    assert_eq!(counts(&wall(&["--set", "output.pairs=0"]).converged()), [0; 2]);
}

/// A few lines for many bodies, and all of them as JSON.
#[test]
fn check_sums_up() {
    let path = case("wall").display().to_string();
    let check = |more: &[&str]| winkler(&[&["check", &path], &WALL[..], more].concat());
    let run = check(&[]);
    assert!(run.code == 0 && run.stdout.lines().count() < 10, "{}", run.said());
    for words in ["49 bodies: 784 cells", "`brick_even_13` and ", "contacts: "] {
        assert!(run.stdout.contains(words), "{words}\n{}", run.stdout);
    }
    let json: serde_json::Value = serde_json::from_str(&check(&["--json"]).stdout).expect("JSON");
    assert_eq!(json["bodies"].as_array().map(Vec::len), Some(BODIES));
    // scenes of few bodies have their lines as before
    let few = winkler(&["check", case("stack").to_str().expect("a path")]);
    assert!(few.stdout.contains("  body ") && few.stdout.contains("  contact "), "{}", few.stdout);
}
