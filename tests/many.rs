//! Many bodies: what users type reaches every one, and files and lines stay as few as a person looks through.

mod common;

use common::{Run, Scene, case, root, solve, winkler};
use std::fmt::Write;
use std::fs;

/// Courses and bricks of a course: 52 bodies with the half bricks. PETSc's table of options has room for 42 bodies with hypre.
const SIDE: usize = 7;

/// Bodies of that wall.
const BODIES: usize = 52;

/// Pairs with files of their own.
const LISTED: usize = 24;

/// The wall of `meshes/wall/write`.
fn wall() -> Scene {
    let geo = root().join("meshes/wall/wall.geo").display().to_string();
    let mut text =
        format!("dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = {SIDE}, columns = {SIDE} }} }}\n");
    let mut number = 0;
    for row in 0..SIDE {
        let last = SIDE - 1 + row % 2;
        for place in 0..=last {
            number += 1;
            let on = |is: bool, what: &str| if is { format!("{{ on = \"b{number}_{what} }}, ") } else { String::new() };
            let fix = on(row == 0, "bottom\", y = 0") + &on(place == 0, "left\", x = 0");
            let load = on(place == last, "right\", pressure = 0.5") + &on(row + 1 == SIDE, "top\", pressure = 1");
            writeln!(
                text,
                "[[body]]\nname = \"b{number}\"\nyoung = 1e4\npoisson = 0.2\nforce = [0, -0.02]\nfix = [{fix}]\nload = [{load}]"
            )
            .expect("a text");
        }
    }
    assert_eq!(number, BODIES);
    text += "[[contact]]\nbetween = \"auto\"\ndistance = 0.01\nlayer = { power = { B = 1e-3, a = 0.5 } }\n";
    Scene::new(text)
}

/// A few iterations in which every body has a solver of its own.
fn robin(scene: &Scene, more: &[&str]) -> Run {
    let run = solve(scene, &[&["--method", "robin", "--set", "method.stop.iterations=3"], more].concat());
    assert_eq!(run.text("status"), "iteration-limit", "{}", run.said());
    run
}

/// However many bodies there are, each has its solver, its own options win over those of all, and these over the program's; PETSc's
/// table has what was typed and no more, and all of it was read.
#[test]
fn every_body_has_its_options() {
    let scene = wall();
    let direct = robin(&scene, &["--set", "solver=mumps"]);
    assert_eq!(direct.solvers(), ["preonly + cholesky by mumps"; BODIES]);
    let typed = ["-b7_ksp_type", "minres", "-ksp_rtol", "1e-9", "-b50_ksp_converged_reason", "-options_left"];
    let run = robin(&scene, &[&["--set", "solver=hypre"], &typed[..]].concat());
    let mut solvers = ["cg + hypre"; BODIES];
    solvers[6] = "minres + hypre";
    assert_eq!((run.solvers(), run.warnings()), (solvers.to_vec(), direct.warnings()));
    assert_eq!(
        run.stdout.matches("Linear b50_ solve converged due to CONVERGED_RTOL").count(),
        run.stdout.matches("Linear").count()
    );
    assert!(run.stdout.contains("Linear b50_"), "{}", run.stdout);
    let table: Vec<&str> = run.stdout.lines().filter(|line| line.starts_with('-')).collect();
    assert_eq!(
        table,
        ["-b50_ksp_converged_reason", "-b7_ksp_type minres", "-ksp_rtol 1e-9", "-options_left"],
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("There are no unused options"), "{}", run.stdout);
    let [exact, near] = [&direct, &run].map(|run| run.history()["residual"].to_vec());
    assert!(exact.iter().zip(&near).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{exact:?} {near:?}");

    let slip = solve(&scene, &["--method", "robin", "-b51_ksp_tpye", "cg"]);
    assert!(slip.code == 5 && slip.stderr.contains("did you mean -b51_ksp_type?"), "{}", slip.said());
    let idle = robin(&scene, &["-pc_type", "icc", "-pc_gamg_threshold", "0.1"]);
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
    let scene = wall();
    let run = solve(&scene, &[]).converged();
    let pairs = run.report["pairs"].as_array().expect("pairs");
    let counts = |run: &Run| [files(run, "contact-", ".csv"), files(run, "pressure", ".svg")];
    assert_eq!(counts(&run), [LISTED; 2]);
    assert_eq!(run.report["files"].as_array().map(Vec::len), Some(2 * LISTED + 4), "{}", run.report["files"]);
    let text = fs::read_to_string(run.folder.join("contacts.csv")).expect("contacts.csv");
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), pairs.len());
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().expect("a number");
    let force = |row: &&Vec<&str>| number(row, 6).hypot(number(row, 7));
    let (tabled, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| !row[21].is_empty());
    let least = tabled.iter().map(force).fold(f64::INFINITY, f64::min);
    assert!(tabled.len() == LISTED && others.iter().map(force).all(|force| force <= least), "{text}");
    for row in tabled {
        let table = run.table(row[21]);
        assert_eq!((table.rows(), files(&run, row[22], "")), (row[4].parse().expect("points"), 1));
        let most = table["pressure"].iter().copied().fold(0.0, f64::max);
        assert_eq!(most, number(row, 9));
    }
    // the bed joints above the first course carry all that lies on it
    let first: Vec<String> = (1..=SIDE).map(|i| format!("b{i}")).collect();
    let is_bed = |row: &&Vec<&str>| first.contains(&row[0].to_owned()) && !first.contains(&row[1].to_owned());
    let carried: f64 = rows.iter().filter(is_bed).map(|row| number(row, 7)).sum();
    let expected = -(SIDE as f64) * (1.0 + 0.02 * 0.5 * (SIDE - 1) as f64);
    assert!((carried / expected - 1.0).abs() < 1e-8, "{carried} {expected}");
    // what was left out is told, with the way to it
    let left = pairs.len() - LISTED;
    assert!(run.text("left_out").starts_with(&format!("{left} of {} pairs", pairs.len())), "{}", run.said());
    assert!(run.stdout.contains("--set output.pairs=all") && run.stdout.lines().count() < LISTED + 8, "{}", run.stdout);
    let all = solve(&scene, &["--set", "output.pairs=all", "--set", "output.plots=false"]).converged();
    assert_eq!((counts(&all), &all.report["left_out"]), ([pairs.len(), 0], &serde_json::Value::Null));
    assert_eq!(counts(&solve(&scene, &["--set", "output.pairs=0"]).converged()), [0; 2]);
}

/// A few lines for many bodies, and all of them as JSON.
#[test]
fn check_sums_up() {
    let scene = wall();
    let path = scene.path.display().to_string();
    let run = winkler(&["check", &path]);
    assert!(run.code == 0 && run.stdout.lines().count() < 10, "{}", run.said());
    for words in ["52 bodies: 784 cells", "`b13` and ", "contacts: ", "the largest theta, of "] {
        assert!(run.stdout.contains(words), "{words}\n{}", run.stdout);
    }
    let json: serde_json::Value = serde_json::from_str(&winkler(&["check", &path, "--json"]).stdout).expect("JSON");
    assert_eq!(json["bodies"].as_array().map(Vec::len), Some(BODIES));
    // scenes of few bodies have their lines as before
    let few = winkler(&["check", case("stack").to_str().expect("a path")]);
    assert!(few.stdout.contains("  body ") && few.stdout.contains("  contact "), "{}", few.stdout);
}
