//! What the program does besides solving: scenes to begin from, completions, man pages, colours.

mod common;

use common::{case, environment, output, solve, winkler};
use std::fs;
use std::process::Command;
use std::time::Duration;

/// Both scenes are solved as they stand, by contact that ends inside the surface, and carry the load.
#[test]
fn a_new_scene_works() {
    for (flag, load, dimension) in [(None, 20.0, 2), (Some("--space"), 10.0, 3)] {
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
    assert!(mesh.stdout.contains("group lower_top: 20 lines, (0.0000, 1.0000) to (2.0000, 1.0000)"), "{}", mesh.said());
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
    // a group whose name cannot begin PETSc options
    let geo = fs::read_to_string(&script).expect("a script");
    fs::write(&script, geo.replace("(\"upper\")", "(\"Upper\")")).expect("a script");
    let run = winkler(&["check", &scene]);
    assert!(run.code == 3 && run.stderr.contains("rename the group `Upper` of the mesh: `upper`"), "{}", run.said());
}

#[test]
fn shells_and_man_know_the_commands() {
    let script = winkler(&["completions", "bash"]);
    assert!(script.code == 0 && script.stdout.contains("--restart") && script.stdout.contains("sweep"));
    assert_eq!(winkler(&["completions", "dos"]).code, 2);
    let folder = tempfile::tempdir().expect("a folder");
    let pages = folder.path().join("man");
    let made = winkler(&["man", pages.to_str().expect("UTF-8")]);
    assert_eq!(made.code, 0, "{}", made.said());
    let page = fs::read_to_string(pages.join("winkler-solve.1")).expect("a page");
    assert!(page.contains("checkpoint"), "{page}");
    assert_eq!(winkler(&["man", "/dev/null/man"]).code, 6);
}

#[test]
fn colours_are_asked_for() {
    let coloured = |words: &[&str], variable: Option<(&str, &str)>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_winkler"));
        environment(&mut command);
        command.args(words).arg("mesh").arg("none.toml").envs(variable);
        let (_, _, complaint) = output(command, Duration::from_secs(60));
        assert!(complaint.contains("none.toml"), "{complaint}");
        complaint.contains('\u{1b}')
    };
    assert!(!coloured(&[], None) && coloured(&["--color", "always"], None));
    assert!(coloured(&[], Some(("CLICOLOR_FORCE", "1"))));
    assert!(!coloured(&["--color", "never"], Some(("CLICOLOR_FORCE", "1"))));
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
    for words in [["-q", "-v"], ["-q", "--json"]] {
        let run = solve(case("groove"), &words);
        assert!(run.code == 2 && run.stderr.contains("cannot be used with"), "{}", run.said());
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, out) = (case("groove").display().to_string(), folder.path().join("runs").display().to_string());
    let all = winkler(&["sweep", &scene, "-q", "--over", "mesh.set.n=4,8", "--set", "method={}", "-o", &out]);
    assert_eq!((all.code, all.stdout.trim()), (0, format!("results in {out}").as_str()), "{}", all.said());
    let all = winkler(&["bench", &scene, "-q", "--solver", "mumps", "--set", "mesh.set.n=4", "-o", &out]);
    assert_eq!((all.code, all.stdout.trim()), (0, format!("results in {out}").as_str()), "{}", all.said());
}

/// With `-v` standard error has the decisions and the PETSc options of each body, typed ones and the program's own.
#[test]
fn verbose_runs_say_what_was_decided() {
    let words = ["--set", "mesh.set.n=4", "--method", "robin", "--set", "solver=mumps", "-upper_ksp_type", "cg"];
    let usual = solve(case("groove"), &words);
    let run = solve(case("groove"), &[&words[..], &["-v"]].concat());
    let without = |text: &str| text.lines().filter(|line| !line.contains(" s")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(without(&run.stdout).len(), without(&usual.stdout).len(), "what comes out is the same");
    assert!(usual.stderr.is_empty(), "{}", usual.stderr);
    for part in ["decided", "method: robin", "until increment <=", "inner solver: ", "points on `", "body lower: "] {
        assert!(run.stderr.contains(part), "no `{part}` in\n{}", run.stderr);
    }
    let options = |body: &str| {
        let begin = format!("  PETSc options of {body}: ");
        run.stderr.lines().find_map(|line| line.strip_prefix(&begin)).unwrap_or_default().to_owned()
    };
    assert!(options("upper").contains("-upper_ksp_type cg"), "{}", run.stderr);
    assert!(options("lower").contains("-lower_pc_type cholesky"), "{}", run.stderr);
    assert!(!options("lower").contains("upper"), "{}", run.stderr);
}

#[test]
fn help_has_examples_and_petsc_options() {
    for command in ["solve", "check", "sweep", "bench"] {
        let help = winkler(&[command, "--help"]);
        assert!(help.code == 0 && help.stdout.contains("Examples:\n  winkler "), "{}", help.said());
    }
    let help = winkler(&["solve", "--help"]).stdout;
    assert!(help.contains("-upper_ksp_type cg") && help.contains("-newton_pc_type"), "{help}");
    // options of the program with one dash look like PETSc's
    let slip = winkler(&["solve", "scene.toml", "-verbose"]);
    assert!(slip.code == 2 && slip.stderr.contains("did you mean --verbose?"), "{}", slip.said());
}
