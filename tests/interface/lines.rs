//! What a run says on the terminal.

use crate::common::{case, solve, winkler};

/// Forces have their body and their unit, and a pair has the names of its surfaces in the order of the scene, whichever side carries the points.
#[test]
fn lines_of_pairs_name_surfaces_bodies_and_units() {
    let path = case("groove-held");
    let scene = path.to_str().expect("a path");
    for (young, carrier) in [("body.upper.young=1e5", "upper_bottom"), ("body.lower.young=1e5", "lower_top")] {
        let sets = ["--set", "mesh.set.n=4", "--set", "method={}", "--set", young];
        let run = solve(&path, &[&sets[..], &["--set", "units=cm, MPa"]].concat()).converged();
        assert_eq!(run.text("pairs/0/carrier"), carrier);
        let line = run
            .stdout
            .lines()
            .find(|line| line.starts_with("  lower_top - upper_bottom: force on `lower` ("))
            .expect("a line");
        for words in [" MPa cm, peak pressure ", " MPa at (", ", length in contact ", " cm, open "] {
            assert!(line.contains(words), "{words}: {line}");
        }
        let check = winkler(&[&["check", scene][..], &sets].concat());
        let expected = "  contact lower_top - upper_bottom: ";
        assert!(
            check.stdout.contains(expected) && check.stdout.contains(&format!(" points on {carrier}, ")),
            "{}",
            check.said()
        );
    }
    let run = solve(case("patch-3d"), &["--set", "units=mm, MPa"]).converged();
    assert!(run.stdout.contains(", area in contact ") && run.stdout.contains(" mm², open "), "{}", run.said());
}

/// Each adapted mesh has its line also in a pipe, and from the third one on another line says what the error asked for will take.
#[test]
fn adapted_meshes_have_lines() {
    let run = {
        let quadratic = ["--set", "body.0.order=2", "--set", "body.1.order=2", "--set", "method={}"];
        solve(case("groove-held"), &[&["--tolerance", "2e-5"][..], &quadratic].concat()).converged()
    };
    let rounds = run.report["rounds"].as_array().expect("meshes").len();
    assert!(rounds > 3, "{rounds} meshes: {}", run.said());
    let lines: Vec<&str> = run.stdout.lines().collect();
    let forecasts = lines.iter().filter(|line| line.starts_with("  an error of 2e-5 takes about ")).count();
    assert_eq!(forecasts, rounds - 3, "{}", run.said());
    assert!(lines[0].starts_with("  mesh      cells"), "{}", run.said());
    let numbers: Vec<usize> = lines.iter().filter_map(|line| line.get(..6)?.trim().parse().ok()).collect();
    assert_eq!(numbers, (0..rounds).collect::<Vec<_>>(), "{}", run.said());
    let quiet = solve(case("groove-held"), &["--tolerance", "5e-2", "--set", "method={}", "-q"]).converged();
    assert!(!quiet.stdout.contains("mesh  "), "{}", quiet.said());
}
