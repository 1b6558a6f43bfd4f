//! `scripts/paper` makes the paper's figures and prints its counts.

use crate::common::{WINKLER, output, root};
use std::fs;
use std::process::Command;
use std::time::Duration;

#[test]
fn the_script_of_the_paper_has_counts_and_figures() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut script = Command::new(root().join("scripts/paper"));
    crate::common::environment(&mut script);
    script.args(["--with", WINKLER, "--meshes", "3,4", "--set", "mesh.set.n=4", "-o"]).arg(folder.path());
    let (status, said, complaint) = output(script, Duration::from_secs(120));
    assert!(status.success(), "{said}{complaint}");
    let lines: Vec<Vec<&str>> = said.lines().map(|line| line.split_whitespace().collect()).collect();
    let of = |first: &str, columns: usize| {
        let mut fitting = lines.iter().filter(|line| line.first() == Some(&first) && line.len() == columns);
        fitting.next().unwrap_or_else(|| panic!("no {first} in\n{said}")).clone()
    };
    // the best gamma of the paper, beside ours; and by psi
    let [best, slow] = ["0.6", "0.05"].map(|gamma| of(gamma, 3)[2].parse::<usize>().expect("a count"));
    assert_eq!(of("0.6", 3)[1], "7");
    assert!(best.abs_diff(7) <= 1 && slow > 40, "{said}");
    let zones = of("0.6", 4);
    assert_eq!((zones[1], zones[2]), ("none", of("0.6", 3)[2]), "{said}");
    assert!(zones[3].parse::<usize>().is_ok_and(|full| full > best), "{said}");
    // a layer of exponent 1 takes half of the peak
    let [soft, none] = ["1", "none"].map(|a| of(a, 3)[1].parse::<f64>().expect("a pressure"));
    assert!(soft < 0.7 * none, "{said}");
    for (figure, curves) in [("figure-1b", 0), ("figure-2a", 10), ("figure-2b", 5)] {
        let text = fs::read_to_string(folder.path().join(format!("{figure}.svg"))).expect("a figure");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{figure}");
        assert!(text.matches("<polyline").count() >= curves, "{figure}");
    }
    // the history of each run, with its gamma and rho of each body
    let mut history = csv::Reader::from_path(folder.path().join("figure-2a/history.csv")).expect("a table");
    let names: Vec<String> = history.headers().expect("a header").iter().map(str::to_owned).collect();
    assert_eq!((&names[0][..], &names[1][..]), ("method.gamma", "iteration"));
    let place = names.iter().position(|name| name == "increment_upper").expect("rho of a body");
    let rows: Vec<csv::StringRecord> = history.records().flatten().filter(|row| &row[0] == "0.6").collect();
    assert_eq!(rows.len(), best + 1);
    assert!(rows[best][place].parse::<f64>().is_ok_and(|rho| rho <= 1e-3));
}
