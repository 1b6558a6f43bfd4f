//! `winkler bench` and `winkler mesh`: rows, errors that fall with the mesh, failures as rows.

use crate::common::{Run, case, winkler};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Runs a benchmark in a folder of its own; gives the run and the rows, a map from column to text each.
fn bench(args: &[&str]) -> (Run, Vec<BTreeMap<String, String>>) {
    let run = winkler(&[&["bench"], args, &["-o", "out"]].concat());
    let rows = rows(&run.folder.join("out/bench.csv"));
    (run, rows)
}

fn rows(path: &Path) -> Vec<BTreeMap<String, String>> {
    let Ok(mut file) = csv::Reader::from_path(path) else { return Vec::new() };
    let header = file.headers().expect("a header").clone();
    let row =
        |record: csv::StringRecord| header.iter().map(str::to_owned).zip(record.iter().map(str::to_owned)).collect();
    file.records().map(|record| row(record.expect("whole rows"))).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("`{column}` is `{}` in {row:?}", row[column]))
}

fn scene(name: &str) -> String {
    case(name).display().to_string()
}

/// The wavy gap has its pressure in closed form once the scene has it: errors fall with the mesh, whatever the solver; and
/// counts and errors do not depend on the solver.
#[test]
fn errors_fall_with_the_mesh_and_rows_are_whole() {
    let exact = "contact.0.reference=40 + 6.3508814*cos(pi*x)";
    let solvers = ["--solver", "mumps", "--solver", "-ksp_type cg -pc_type jacobi -ksp_rtol 1e-10"];
    let over = ["--over", "mesh.set.n=8,16,32", "--repeat", "2", "--set", exact, "--method", "newton-robin"];
    let (run, rows) = bench(&[&[scene("wavy").as_str()], &solvers[..], &over].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    // three meshes, two solvers
    assert_eq!(rows.len(), 6);
    let solved = |solver: &str| -> Vec<&BTreeMap<String, String>> {
        rows.iter().filter(|row| row["solver"].starts_with(solver) && row["method"] == "newton-robin").collect()
    };
    for solver in ["mumps", "-ksp_type cg"] {
        let rows = solved(solver);
        assert_eq!(rows.len(), 3);
        for pair in rows.windows(2) {
            let order = (number(pair[0], "error") / number(pair[1], "error")).log2();
            assert!((1.6..2.6).contains(&order), "{solver}: order {order} of linear elements");
            assert!(number(pair[1], "dofs") > 3.0 * number(pair[0], "dofs"));
        }
        for row in rows {
            assert_eq!((row["status"].as_str(), row["runs"].as_str()), ("converged", "2"));
            assert_eq!(row["error_of"], "pressure, reference");
            for column in ["cpu_seconds", "factor_seconds", "solve_seconds", "iterate_seconds"] {
                assert!(number(row, column) > 0.0, "{column}");
            }
            // no two runs take the same time; no process takes more than all cores
            let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get()) as f64;
            assert!(number(row, "spread") > 0.0);
            assert!(number(row, "cpu_seconds") < cores * number(row, "seconds"), "{row:?}");
            // a process with PETSc in it, and not the machine
            assert!((10.0..2000.0).contains(&number(row, "memory_mb")), "{row:?}");
        }
    }
    for (direct, krylov) in solved("mumps").iter().zip(solved("-ksp_type cg")) {
        assert!((number(direct, "error") / number(krylov, "error") - 1.0).abs() < 1e-3);
        assert_eq!(direct["inner_iterations"], "0");
        assert!(number(krylov, "inner_iterations") > 100.0);
    }
    for name in ["time-error.svg", "time-dofs.svg", "memory-dofs.svg"] {
        let plot = fs::read_to_string(run.folder.join("out").join(name)).expect(name);
        assert!(plot.contains("mumps"), "{name}");
    }
    let plot = |name: &str| fs::read_to_string(run.folder.join("out").join(name)).unwrap_or_default();
    assert!(plot("time-error.svg").contains("Pareto front") && plot("time-dofs.svg").contains("(dofs^"));
    // direct solvers make no iterations, and have no curve
    assert!(
        plot("iterations-dofs.svg").matches("<polyline").count() < plot("time-dofs.svg").matches("<polyline").count()
    );
}

/// Without a known answer the finest mesh is the reference, has no error itself, and another run can take its place.
#[test]
fn the_finest_mesh_or_another_run_is_the_reference() {
    let groove = scene("groove");
    let stop = ["--solver", "mumps", "--set", "method.stop={residual=1e-8}"];
    let sizes = ["--over", "mesh.set.n=4,8,16", "--order", "1"];
    let (run, rows) = bench(&[&[groove.as_str()], &stop[..], &sizes].concat());
    assert_eq!((run.code, rows.len()), (0, 3), "{}", run.said());
    let errors: Vec<f64> = rows[..2].iter().map(|row| number(row, "error")).collect();
    assert!(errors[1] < 0.5 * errors[0] && errors[1] > 1e-4, "{errors:?}");
    let of = format!("pressure, mesh of {} dofs", rows[2]["dofs"]);
    assert_eq!((rows[2]["error"].as_str(), &rows[1]["error_of"]), ("", &of));
    let finest = run.folder.join("out/runs/groove_16_1_robin_mumps_1");
    let finest = finest.display().to_string();
    let (against, rows) = bench(&[&[groove.as_str()], &stop[..], &sizes, &["--against", &finest]].concat());
    assert_eq!(against.code, 0, "{}", against.said());
    for (row, error) in rows.iter().zip(&errors) {
        assert!((number(row, "error") / error - 1.0).abs() < 1e-6, "{row:?}");
    }
    assert!(number(&rows[2], "error") < 1e-7, "the reference itself");
}

/// Columns are what the report of the run says.
#[test]
fn rows_are_their_reports() {
    let (run, rows) = bench(&[&scene("wavy"), "--set", "mesh.set.n=4", "--solver", "mumps,hypre"]);
    assert_eq!((run.code, rows.len()), (0, 2), "{}", run.said());
    for row in &rows {
        let path = run.folder.join(format!("out/runs/wavy_1_{}_{}_1/report.json", row["asked"], row["solver"]));
        let report: serde_json::Value = serde_json::from_slice(&fs::read(&path).expect("a report")).expect("JSON");
        let of = |path: &str| report.pointer(path).and_then(|v| v.as_f64()).expect("a number");
        for (column, path) in [
            ("mesh_seconds", "/times/mesh"),
            ("discretize_seconds", "/times/discretize"),
            ("set_up_seconds", "/times/set-up"),
            ("iterate_seconds", "/times/iterate"),
            ("factor_seconds", "/inner_times/factor"),
            ("solve_seconds", "/inner_times/solve"),
            ("sweeps", "/sweeps"),
            ("factorizations", "/factorizations"),
            ("residual", "/residual"),
            ("F1", "/F1"),
            ("peak_pressure", "/pairs/0/peak_pressure"),
        ] {
            assert_eq!(number(row, column), of(path), "{column}");
        }
    }
}

/// A row names the method that ran beside the one that was asked for, and the last table has every row.
#[test]
fn rows_name_what_ran() {
    let words = ["--solver", "mumps,icc", "--method", "auto", "--over", "mesh.set.n=4,8"];
    let (run, rows) = bench(&[&[scene("groove-held").as_str()], &words[..]].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    let names = |row: &BTreeMap<String, String>| ["solver", "asked", "method"].map(|name| row[name].clone());
    let ran = ["mumps auto newton", "icc auto newton"];
    assert_eq!(rows.iter().map(|row| names(row).join(" ")).collect::<Vec<_>>(), [ran, ran].concat());
    let lines: Vec<Vec<&str>> = run.stdout.lines().map(|line| line.split_whitespace().collect()).collect();
    let head = [
        "mesh.set.n",
        "solver",
        "method",
        "status",
        "dofs",
        "iterations",
        "sweeps",
        "inner",
        "iterations",
        "s",
        "CPU",
        "s",
        "MB",
        "error",
        "of",
    ];
    let at = lines.iter().position(|line| *line == head).expect("a heading");
    for (line, row) in lines[at + 1..].iter().zip(&rows) {
        let same = ["mesh.set.n", "solver", "method", "status", "dofs", "iterations", "sweeps"];
        assert_eq!(line[..same.len()], same.map(|name| row[name].as_str()));
    }
}

/// Elements of another order are other meshes of the same scene, and the labels of runs have what differs: two keys with one last word have
/// whole names.
#[test]
fn orders_are_an_axis_and_lines_name_what_differs() {
    let over =
        ["--over", "contact.0.layer.power.a=0.5,1", "--over", "body.0.young=1e5", "--over", "body.1.young=1e5,2e5"];
    let words = ["--solver", "condensed", "--method", "newton", "--order", "1,2", "--set", "mesh.set.n=4"];
    let (run, rows) = bench(&[&[scene("groove-held").as_str()], &words[..], &over].concat());
    assert_eq!((run.code, rows.len()), (0, 8), "{}", run.said());
    for pair in rows.chunks(2) {
        assert_eq!((pair[0]["order"].as_str(), pair[1]["order"].as_str()), ("1", "2"));
        assert!(number(&pair[1], "dofs") > 3.0 * number(&pair[0], "dofs"));
    }
    assert!(run.stdout.contains("a = 0.5, body.1.young = 2e5, P2: converged"), "{}", run.said());
}

/// What goes wrong is a row with its words, and the other rows are there.
#[test]
fn failures_are_rows() {
    let methods = ["--method", "robin,newton-robin,nonsense", "--set", "method.stop={residual=1e-8,iterations=3}"];
    let solvers = ["--solver", "mumps", "--solver", "-pc_type nonsense", "--over", "mesh.set.n=4,wrong"];
    let (run, rows) = bench(&[&[scene("groove-held").as_str()], &methods[..], &solvers].concat());
    assert_eq!(run.code, 1, "{}", run.said());
    assert_eq!(rows.len(), 12);
    let of = |n: &str, method: &str, solver: &str| {
        let is = |row: &&BTreeMap<String, String>| {
            row["mesh.set.n"] == n && row["method"] == method && row["solver"].contains(solver)
        };
        let row = rows.iter().find(is).expect("a row");
        (row["status"].clone(), row["message"].clone())
    };
    let (status, words) = of("4", "robin", "mumps");
    assert!(status == "iteration-limit" && words.contains("3 iterations"), "{status}: {words}");
    let (status, words) = of("4", "nonsense", "mumps");
    assert!(status == "refused" && words.contains("nonsense"), "{status}: {words}");
    let (status, words) = of("4", "newton-robin", "-pc_type");
    assert!(status == "refused" && words.contains("nonsense"), "{status}: {words}");
    let (status, words) = of("wrong", "newton-robin", "mumps");
    assert!(status == "refused" && words.contains("number"), "{status}: {words}");
    // a run that takes too long
    let late = ["--solver", "mumps", "--over", "mesh.set.n=64,128", "--order", "1,2", "--timeout", "0.05"];
    let (run, rows) = bench(&[&[scene("groove-held").as_str()], &late[..]].concat());
    let status: Vec<&str> = rows.iter().map(|row| row["status"].as_str()).collect();
    assert_eq!((run.code, &status[..]), (1, &["timeout", "timeout", "skipped", "skipped"][..]), "{}", run.said());
}

/// Ranks are started by mpiexec, beside other keys.
#[test]
fn ranks_and_keys() {
    let over = ["--over", "contact.0.layer.linear.stiffness=1e4,1e6", "--set", "mesh.set.n=4"];
    let linear = ["--set", "contact.0.layer={linear={stiffness=1}}", "--ranks", "1,2", "--solver", "mumps"];
    let (run, rows) =
        bench(&[&[scene("groove-held").as_str(), "--method", "newton-robin"], &over[..], &linear].concat());
    assert_eq!((run.code, rows.len()), (0, 4), "{}", run.said());
    for pair in rows.chunks(2) {
        assert_eq!((pair[0]["ranks"].as_str(), pair[1]["ranks"].as_str()), ("1", "2"));
        for column in ["sweeps", "dofs"] {
            assert_eq!(pair[0][column], pair[1][column], "{column}");
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let groove = scene("groove");
    for (args, code, words) in [
        (&["--over", "mesh.set.n"][..], 2, "KEY=V1,V2"),
        (&["--over", "solver=mumps,hypre"], 2, "--solver"),
        (&["--ranks", "0"], 2, "begin at 1"),
        (&["--order", "9"], 2, "order 9"),
        (&["--timeout", "0"], 2, "no time"),
        (&["--against", "nowhere"], 6, "nowhere"),
        (&["--against", "/"], 2, "0 contact tables"),
        (&["--linear"], 2, "`--linear` is gone"),
        (&["--budget", "600"], 2, "`--budget` is gone"),
    ] {
        let (run, _) = bench(&[&[groove.as_str()], args].concat());
        assert!(run.code == code && run.stderr.contains(words), "{args:?}: {}", run.said());
    }
    let run = winkler(&["bench", "nowhere.toml"]);
    assert!(run.code == 6 && run.stderr.contains("nowhere.toml"), "{}", run.said());
}

/// The mesh of the groove, counted: 2 x 2 x 8 x n x n triangles at n = 4 in two blocks of a crossed grid.
#[test]
fn the_mesh_command_says_what_is_there() {
    let groove = scene("groove");
    let words = ["mesh", groove.as_str(), "--set", "mesh.set.n=4", "--json"];
    let facts: serde_json::Value = serde_json::from_str(&winkler(&words).stdout).expect("JSON");
    let checked = winkler(&[&["check"], &words[1..]].concat());
    let checked: serde_json::Value = serde_json::from_str(&checked.stdout).expect("JSON");
    for body in 0..2 {
        for key in ["name", "cells", "nodes", "dofs"] {
            assert_eq!(facts["bodies"][body][key], checked["bodies"][body][key], "{key}");
        }
    }
    let run = winkler(&["mesh", groove.as_str(), "--set", "mesh.set.n=4", "-o", "a.msh"]);
    assert!(
        run.code == 0 && run.stdout.contains("from the cache") && run.stdout.contains("group lower_top"),
        "{}",
        run.said()
    );
    let copy = fs::read(run.folder.join("a.msh")).expect("a mesh");
    let cached = fs::read(facts["file"].as_str().expect("a path")).expect("the cached mesh");
    assert_eq!(copy, [&cached[..], b"$Comments\nmade by winkler\n$EndComments\n"].concat());
    let refused = winkler(&["mesh", groove.as_str(), "-o", "a.stl"]);
    assert!(refused.code == 2 && refused.stderr.contains(".msh"), "{}", refused.said());
}
