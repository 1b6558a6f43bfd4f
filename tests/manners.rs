//! What the program does besides solving: scenes to begin from, completions, man pages, colours.

mod common;

use common::{environment, output, solve, winkler};
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
