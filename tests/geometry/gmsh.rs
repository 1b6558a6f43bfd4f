//! Fields for Gmsh: it opens the files of a run together, and has their numbers.

use crate::common::{Run, case, output, solve};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The numbers that Gmsh prints for a script, after it has opened files.
fn gmsh(folder: &Path, files: &[String], script: &str) -> Vec<f64> {
    let merges: String = files.iter().map(|file| format!("Merge \"{file}\";\n")).collect();
    let path = folder.join("look.geo");
    fs::write(&path, format!("{merges}{script}")).expect("a script");
    let mut command = Command::new("gmsh");
    command.args(["-parse_and_exit", "-nopopup"]).arg(&path).current_dir(folder);
    let (status, said, complaint) = output(command, Duration::from_secs(120));
    let all = said + &complaint;
    assert!(status.success() && !all.contains("Error") && !all.contains("Warning"), "{all}");
    all.lines().filter_map(|line| line.split("wk ").nth(1)).map(|number| number.trim().parse().expect(&all)).collect()
}

fn files(run: &Run) -> Vec<String> {
    let all = run.report["files"].as_array().expect("files").iter().filter_map(|file| file.as_str());
    all.filter(|file| file.ends_with(".msh")).map(str::to_owned).collect()
}

/// Two bodies and their contact surface: all nodes and cells, and the ends of each field.
#[test]
fn gmsh_opens_bodies_and_contact_surfaces_with_their_fields() {
    for (name, order) in [("groove", 1), ("groove", 2), ("groove", 8), ("patch-3d", 1), ("patch-3d", 2)] {
        let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
        let mut words = vec!["--msh", "--vtu", "--set", "method={}", "--set", &orders[0], "--set", &orders[1]];
        if name == "groove" {
            words.extend(["--set", "mesh.set.n=4"]);
        }
        let run = solve(case(name), &words).converged();
        let files = files(&run);
        assert_eq!(files.len(), 3, "{files:?}");
        let script = "Printf(\"wk %g\", PostProcessing.NbViews);\nPrintf(\"wk %g\", Mesh.NbNodes);\n\
                      For v In {0:PostProcessing.NbViews-1}\nPrintf(\"wk %.16g\", View[v].Min);\nPrintf(\"wk %.16g\", View[v].Max);\nEndFor\n";
        let found = gmsh(&run.folder, &files, script);
        let views = found[0] as usize;
        assert_eq!((views, found.len()), (3 + 3 + 7, 2 + 2 * views), "{found:?}");
        let nodes = |body: usize| run.report["bodies"][body]["nodes"].as_f64().expect("a number");
        assert!(found[1] > nodes(0) + nodes(1), "nodes of all files: {}", found[1]);
        // between the points of high orders Gmsh finds other ends
        if order > 2 {
            continue;
        }
        let ends = |view: usize| [found[2 + 2 * view], found[3 + 2 * view]];
        // files by name: contact surface, then bodies in the order of their names
        assert!(files[0].starts_with("contact-") && files[1] == "lower.msh", "{files:?}");
        let views_of_contact = ["gap", "compression", "pressure", "opening", "normal", "length", "displacement"];
        let pressure = views_of_contact.iter().position(|view| *view == "pressure").expect("a view");
        let peak = run.report["pairs"][0]["peak_pressure"].as_f64().expect("a number");
        assert!((ends(pressure)[1] / peak - 1.0).abs() < 1e-6, "{name} {order}: {:?} {peak}", ends(pressure));
        for body in 0..2 {
            let most = run.report["bodies"][body]["max_von_mises"].as_f64().expect("a number");
            // of a tensor Gmsh shows the von Mises stress, too
            for view in [1, 2] {
                let [_, found] = ends(views_of_contact.len() + 3 * body + view);
                assert!((found / most - 1.0).abs() < 1e-9, "{name} {order}, body {body}: {found} {most}");
            }
        }
        // our own reader, which reads what Gmsh writes, finds mid-edge nodes in the middle of their edges
        if (name, order) == ("patch-3d", 2) {
            let path = run.folder.join("upper.msh");
            let bytes = std::fs::read(&path).expect("a file");
            let mesh =
                winkler::internals::mesh::parse::<3>(&path, &bytes, winkler::internals::mesh::MeshProducer::User)
                    .expect("a mesh");
            let cells = mesh.group("upper").expect("a body");
            assert_eq!(cells.len() as f64, run.report["bodies"][1]["cells"].as_f64().expect("a number"));
            for cell in cells.connectivity.chunks_exact(10) {
                for (k, [i, j]) in [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
                    let [a, b, middle] = [cell[i], cell[j], cell[4 + k]].map(|node| mesh.points[node as usize]);
                    assert!((0..3).all(|c| (0.5 * (a[c] + b[c]) - middle[c]).abs() < 1e-12), "{a:?} {b:?} {middle:?}");
                }
            }
        }
    }
}
