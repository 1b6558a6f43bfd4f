//! What the program does besides solving: scenes to begin from, completions, man pages, colours.

use crate::common::{case, environment, solve, winkler, winkler_on};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// All scenes are solved as they stand, by contact that ends inside the surface, and carry the load.
#[test]
fn a_new_scene_works() {
    for (flag, load, dimension) in [(None, 20.0, 2), (Some("--space"), 10.0, 3), (Some("--axisymmetric"), 100.0, 2)] {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = folder.path().join("trial");
        let mut words = vec!["new", scene.to_str().expect("UTF-8")];
        words.extend(flag);
        let made = winkler(&words);
        assert_eq!(made.code, 0, "{}", made.said());
        let run = solve(scene.join("scene.toml"), &["--set", "output.vtu=false"]).converged();
        let force = run.forces(0)[0][dimension - 1];
        assert!((force.abs() - load).abs() < 1e-6 * load, "{flag:?}: {force}");
        let pressure = &run.contact()["pressure"];
        assert!(pressure.contains(&0.0) && pressure.iter().any(|p| *p > 10.0), "{flag:?}");
        // what is there stays as it is
        let again = winkler(&words);
        assert_eq!(again.code, 6, "{}", again.said());
        assert!(again.stderr.contains("scene.toml` is there already"), "{}", again.stderr);
    }
    assert_eq!(winkler(&["new", "both", "--space", "--axisymmetric"]).code, 2);
    let nameless = winkler(&["new", "/"]);
    assert!(nameless.code == 2 && nameless.stderr.contains("name"), "{}", nameless.stderr);
}

/// What a beginner gets wrong most easily.
#[test]
fn first_mistakes_have_advice() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    assert_eq!(winkler(&["new", &path("press")]).code, 0);
    let (scene, script) = (path("press/scene.toml"), path("press/press.geo"));
    // places of groups: is `lower_top` the curve that is meant?
    let mesh = winkler(&["mesh", &scene]);
    assert!(mesh.stdout.contains("group lower_top: 20 lines of lower, straight, normal (0.0000, 1.0000), (0.0000, 1.0000) to (2.0000, 1.0000)"), "{}", mesh.said());
    // a gap of five times the height of a block
    let warnings =
        |set: &str| solve(&scene, &["--set", "output.vtu=false", "--set", set]).report["warnings"].to_string();
    assert!(
        warnings("contact.0.gap=5").contains("more than a tenth of the body's size: upper"),
        "{}",
        warnings("contact.0.gap=5")
    );
    assert_eq!(warnings("contact.0.gap=0.1"), "[]");
    let refused = |file: &str, advice: &str| {
        let run = winkler(&["check", file]);
        assert!(run.code == 3 && run.stderr.contains(advice), "{}", run.said());
    };
    refused(&script, "a scene is a TOML file that names its script");
    let text = fs::read_to_string(&scene).expect("a scene");
    for (name, from, to, advice) in [
        ("single.toml", "[[body]]", "[body]", "each body begins with two brackets: [[body]]"),
        ("slip.toml", "on = \"lower_bottom\"", "on = \"lower_botom\"", "no group `lower_botom` for this support"),
        ("kind.toml", "[\"lower_top\", ", "[\"lower\", ", "`lower` is a group of cells there"),
    ] {
        fs::write(folder.path().join("press").join(name), text.replace(from, to)).expect("a scene");
        refused(&path(&format!("press/{name}")), advice);
    }
    for (words, advice) in [
        (&[scene.as_str()][..], "did you mean `winkler solve "),
        (&["solve", &scene, "-n", "4"], "the number of ranks is an option of mpiexec"),
        (&["solve", &scene, "-np", "4"], "mpiexec -n 2 winkler solve"),
    ] {
        let run = winkler(words);
        assert!(run.code == 2 && run.stderr.contains(advice), "{}", run.said());
    }
    // a group whose name cannot begin PETSc options is the body with that name in small letters
    let geo = fs::read_to_string(&script).expect("a script");
    fs::write(&script, geo.replace("(\"upper\")", "(\"Upper\")")).expect("a script");
    let run = winkler(&["check", &scene]);
    assert!(run.code == 0 && run.stdout.contains("body upper"), "{}", run.said());
}

#[test]
fn shells_know_the_commands() {
    let script = winkler(&["completions", "bash"]);
    assert!(script.code == 0 && script.stdout.contains("--restart") && script.stdout.contains("sweep"));
    assert_eq!(winkler(&["completions", "dos"]).code, 2);
    for words in [&["man", "pages"][..], &["solve", "scene.toml", "--color", "never"]] {
        let run = winkler(words);
        assert!(run.code == 2 && run.stderr.contains("is gone") && run.stderr.contains("help:"), "{}", run.said());
    }
}

/// With `-q` a run that is solved says where its results are; one that is not says so, too. Warnings stay.
#[test]
fn quiet_runs_say_what_matters() {
    let small = ["--set", "mesh.set.n=4"];
    let run = solve(case("groove"), &[&small[..], &["-q"]].concat()).converged();
    assert_eq!(run.stdout.trim_start(), format!("results in {}\n", run.folder.display()), "{}", run.said());
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    let slow = ["-q", "--method", "robin", "--set", "method.stop={residual=1e-8,iterations=2}"];
    let run = solve(case("groove"), &[&small[..], &slow].concat());
    assert_eq!(run.code, 1, "{}", run.said());
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert!(lines.len() == 2 && lines[0].contains("not converged") && lines[1].contains("results in"), "{lines:?}");
    let free = ["-q", "--method", "newton", "--set", "body.upper.fix=[]"];
    let run = solve(case("groove"), &[&small[..], &free].concat());
    assert!(run.stdout.contains("warning: "), "{}", run.said());
    let run = solve(case("groove"), &["-q", "-v"]);
    assert!(run.code == 2 && run.stderr.contains("cannot be used with"), "{}", run.said());
    // the report is all that `--json` prints, with `-q` and without
    let run = solve(case("groove"), &[&small[..], &["-q", "--json"]].concat()).converged();
    let report: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert!(report["status"] == "converged" && run.stderr.is_empty(), "{}", run.said());
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, out) = (case("groove").display().to_string(), folder.path().join("runs").display().to_string());
    let all = winkler(&["sweep", &scene, "-q", "--over", "mesh.set.n=4,8", "--set", "method={}", "-o", &out]);
    assert_eq!((all.code, all.stdout.trim()), (0, format!("results in {out}").as_str()), "{}", all.said());
    let all = winkler(&["bench", &scene, "-q", "--solver", "mumps", "--set", "mesh.set.n=4", "-o", &out]);
    assert_eq!((all.code, all.stdout.trim()), (0, format!("results in {out}").as_str()), "{}", all.said());
}

/// `check` names the solvers that `solve` takes.
#[test]
fn check_names_the_solvers_of_a_run() {
    let words = ["--set", "mesh.set.n=8"];
    for solver in ["solver=condensed", "solver=mumps", "solver=hypre"] {
        let words = [&words[..], &["--set", solver]].concat();
        let scene = case("groove");
        let checked = winkler(&[&["check", scene.to_str().expect("a path"), "--json"], &words[..]].concat());
        let facts: serde_json::Value = serde_json::from_str(&checked.stdout).expect("JSON");
        let solvers = facts["bodies"].as_array().expect("bodies").iter().map(|body| body["solver"].clone());
        assert_eq!(solvers.collect::<Vec<_>>(), solve(scene, &words).solvers(), "{solver}");
    }
}

/// A run that would take hours, ended when its test ends.
struct Endless(Child);

impl Drop for Endless {
    fn drop(&mut self) {
        // one that has ended needs no end
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Endless {
    /// Starts it with results in a folder, and waits until it has rows of its own there.
    fn start(folder: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_winkler"));
        environment(&mut command);
        command.arg("solve").arg(case("groove")).arg("-o").arg(folder);
        command.args(["--set", "method.gamma=1e-6", "--set", "mesh.set.n=4"]);
        command.args(["--set", "method.stop={residual=1e-12,iterations=100000000}"]);
        let log = fs::File::create(folder.with_extension("log")).expect("a file");
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
        let run = Self(command.spawn().expect("the program"));
        let began = Instant::now();
        let is_at_work = || {
            let rows = fs::read_to_string(folder.join("history.csv")).map_or(0, |text| text.lines().count());
            rows > 3 && !folder.join("report.json").exists()
        };
        while !is_at_work() {
            let said = || fs::read_to_string(folder.with_extension("log")).unwrap_or_default();
            assert!(began.elapsed() < Duration::from_secs(120), "no rows\n{}", said());
            std::thread::sleep(Duration::from_millis(10));
        }
        run
    }
}

/// Names of all files in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A second run in the same folder is refused before it changes anything; a killed one stops nobody.
#[test]
fn one_run_at_a_time_has_a_folder() {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path().join("out");
    let out = folder.to_str().expect("UTF-8");
    let running = Endless::start(&folder);
    let before = names(&folder);
    let scene = case("groove").display().to_string();
    let holder = format!("another process is writing its results to {out}");
    for words in [
        &["solve", &scene][..],
        &["sweep", &scene, "--over", "method.gamma=0.5,0.6"],
        &["bench", &scene, "--solver", "mumps"],
    ] {
        let run = winkler(&[words, &["--set", "mesh.set.n=4", "-o", out]].concat());
        assert!(run.code == 6 && run.stderr.contains(&holder) && run.stderr.contains("-o FOLDER"), "{}", run.said());
    }
    let ranks = winkler_on(2, &["solve", &scene, "--set", "mesh.set.n=4", "-o", out]);
    assert!(ranks.code == 6 && ranks.stderr.matches(&holder).count() == 1, "{}", ranks.said());
    assert_eq!(names(&folder), before, "nothing of them is there");
    // dropping it is kill -9
    drop(running);
    let run = winkler(&["solve", &scene, "--set", "mesh.set.n=4", "-o", out]);
    assert_eq!(run.code, 0, "{}", run.said());
    assert!(names(&folder).iter().all(|name| !name.starts_with('.')), "{:?}", names(&folder));
}

/// Files of an earlier run are gone when the first row of the next one is there; those of users stay.
#[test]
fn nothing_old_stands_beside_what_is_new() {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path().join("out");
    let out = folder.to_str().expect("UTF-8");
    let scene = case("groove-held").display().to_string();
    let small = ["--set", "mesh.set.n=4", "-o", out];
    let steps = ["--set", "method.steps=3", "--vtu", "--msh", "--report"];
    let run = winkler(&[&["solve", &scene], &small[..], &steps].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    let users = ["contact-notes.csv", "mesh.vtu", "notes.txt", "part.geo", "steps.toml"];
    users.iter().for_each(|name| fs::write(folder.join(name), "mine").expect("a file"));
    fs::write(folder.join("steps/mine.vtu"), "mine").expect("a file");
    fs::write(folder.join("checkpoint"), "winkler checkpoint 1\nhours of work").expect("a file");
    // one that is refused has removed nothing
    let before = names(&folder);
    let refused = winkler(&[&["solve", &scene], &small[..], &["-ksp_tpye", "cg"]].concat());
    assert!(refused.code == 5 && names(&folder) == before, "{}", refused.said());
    drop(Endless::start(&folder));
    let mut expected = [&users[..], &["checkpoint.old", "history.csv", "steps"]].concat();
    expected.sort_unstable();
    assert_eq!(names(&folder), expected);
    assert_eq!(names(&folder.join("steps")), ["mine.vtu"]);
    assert_eq!(
        fs::read_to_string(folder.join("checkpoint.old")).expect("a file"),
        "winkler checkpoint 1\nhours of work"
    );
    assert!(users.iter().all(|name| fs::read_to_string(folder.join(name)).is_ok_and(|text| text == "mine")));
}

/// A folder that cannot be made is named, and so are what earlier versions had.
#[test]
fn what_cannot_be_done_is_refused() {
    let scratch = tempfile::tempdir().expect("a folder");
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let scene = case("groove").display().to_string();
    fs::write(path("file"), "").expect("a file");
    for out in ["file", "file/deep", "/proc/results"] {
        let run = winkler(&["solve", &scene, "--set", "mesh.set.n=4", "-o", &path(out)]);
        assert!(run.code == 6 && run.stderr.contains(out) && run.stderr.contains("-o FOLDER"), "{}", run.said());
    }
    for (words, code, advice) in [
        (&["report", "results/x"][..], 2, "--report"),
        (&["plot", "results/x", "stress"], 2, "bodies.pvd"),
        (&["bench", &scene, "--resume"], 2, "all of its runs"),
        (&["mesh", &scene, "--adapted"], 2, "adapted.msh"),
        (&["check", &scene, "-o", "x"], 2, "draws nothing"),
        (&["check", &scene, "--set", "output.compress=false"], 3, "precision = "),
    ] {
        let run = winkler(words);
        assert!(run.code == code && run.stderr.contains(advice), "{}", run.said());
    }
}
