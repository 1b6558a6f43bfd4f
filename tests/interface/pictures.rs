//! The page of a run and single pictures, made from files alone.

use crate::common::{Run, case, output, solve, winkler};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;
use winkler::api::{BodyField, CellKind};
use winkler::error::Kind;

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).expect("report.html")
}

/// Data of the interactive view.
fn view(page: &str) -> Value {
    let text = page.split("id=\"view\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("a view");
    serde_json::from_str(text).expect("JSON")
}

/// Numbers of triangles in a part of a view.
fn triangles(part: &Value) -> usize {
    STANDARD.decode(part["triangles"].as_str().expect("base64")).expect("base64").len() / 12
}

/// Opens a page in Chromium; the page after its scripts have run. None where there is no Chromium.
fn opened(path: &Path) -> Option<String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let has = |name: &&str| Command::new("which").arg(name).output().is_ok_and(|found| found.status.success());
    let Some(browser) = names.into_iter().find(has) else {
        eprintln!("no Chromium: the page is not opened");
        return None;
    };
    let scratch = tempfile::tempdir().expect("a folder");
    let mut command = Command::new(browser);
    command.args([
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--host-resolver-rules=MAP * ~NOTFOUND",
    ]);
    command.args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--enable-logging=stderr"]);
    command.arg(format!("--user-data-dir={}", scratch.path().display()));
    command.args(["--virtual-time-budget=3000", "--dump-dom"]).arg(format!("file://{}", path.display()));
    let (status, dom, log) = output(command, Duration::from_secs(120));
    assert!(status.success(), "{log}");
    let complaints: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:?}");
    Some(dom)
}

#[test]
fn a_plane_run_has_a_page_of_its_own() {
    let run = solve(
        case("groove-held"),
        &[
            "--method",
            "newton",
            "--vtu",
            "--report",
            "--set",
            "mesh.set.n=4",
            "--set",
            "units=MPa, cm",
            "--set",
            "title=<b>A</b> & </script><script>boom()</script>",
            "-ksp_type",
            "cg",
        ],
    )
    .converged();
    let page = page(&run.folder);
    assert!(run.report["files"].as_array().expect("files").contains(&json!("report.html")));
    // nothing from elsewhere, and texts are texts
    for foreign in ["<img", "<link rel=\"style", "<script src", "@import", "url(", "<b>A</b>", "<script>boom"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    let error = if run.report["error_bound"].is_null() { "estimated error" } else { "bound of the error" };
    for words in [
        "&lt;b&gt;A&lt;&#x2f;b&gt; &amp;",
        "von Mises stress, MPa",
        "displacement, cm",
        "contact pressure, MPa",
        error,
        "-ksp_type cg",
    ] {
        assert!(page.contains(words), "{words}");
    }
    let command = page.split("<pre>cd ").nth(1).expect("how to run it again");
    assert!(command.contains("solve") && command.contains("mesh.set.n=4"));
    // all cells of both bodies are in the view, which has no section and no surfaces of contact
    let view = view(&page);
    for (k, body) in run.report["bodies"].as_array().expect("bodies").iter().enumerate() {
        assert_eq!(view["bodies"][k]["name"], body["name"]);
        assert_eq!(triangles(&view["bodies"][k]) as u64, body["cells"].as_u64().expect("a number"));
    }
    assert_eq!((&view["space"], view["surfaces"].as_array().map(Vec::len)), (&json!(false), Some(0)));
    assert!(!page.contains(">Section <"));
    assert!(run.report["memory"]["iterate"].as_f64().expect("memory") > 1.0);
    if let Some(dom) = opened(&run.folder.join("report.html")) {
        assert!(dom.contains("Run it again"));
        // the script has drawn
        assert!(dom.contains("<output>× ") && dom.contains("<span style=\"background"), "the view is not drawn");
    }
    single_pictures_are_drawn(&run);
}

/// Each single picture of a plane run says what it shows.
fn single_pictures_are_drawn(run: &Run) {
    let folder = run.folder.to_str().expect("a name");
    for (what, words) in [
        ("stress", "von Mises stress, MPa"),
        ("displacement", "displacement, cm"),
        ("pressure", "contact pressure, MPa"),
        ("convergence", "residual"),
    ] {
        let drawn = winkler(&["plot", folder, what]);
        assert_eq!(drawn.code, 0, "{}", drawn.said());
        let svg = fs::read_to_string(drawn.stdout.trim()).expect("a picture");
        assert!(
            svg.starts_with("<svg")
                && svg.contains(words)
                && svg.to_lowercase().contains("fill=\"white\"") | svg.contains("#FFFFFF"),
            "{what}"
        );
        if what == "stress" {
            // both bodies, from the first colour to the last
            assert_eq!(svg.matches("<title>").count(), 2);
            assert!(svg.contains("<title>upper</title>") && svg.contains("displacements ×"));
            assert!(svg.contains("fill=\"#440154\" d=\"M") && svg.contains("fill=\"#fee825\" d=\"M"), "all colours");
        }
    }
}

#[test]
fn bodies_in_space_are_their_surfaces() {
    for order in [1, 2] {
        let order_of = |body: usize| format!("body.{body}.order={order}");
        let run =
            solve(case("patch-3d"), &["--vtu", "--report", "--set", &order_of(0), "--set", &order_of(1)]).converged();
        let view = view(&page(&run.folder));
        for (k, body) in run.report["bodies"].as_array().expect("bodies").iter().enumerate() {
            let facets = body["boundary_facets"].as_u64().expect("a number") as usize;
            assert_eq!(triangles(&view["bodies"][k]), facets * if order == 1 { 1 } else { 4 });
        }
        assert_eq!(view["surfaces"].as_array().map(Vec::len), Some(1));
        // q = 10, and the values are numbers between the ends of the range
        assert!((view["pressure"][0].as_f64().expect("a number") - 10.0).abs() < 1e-6, "{}", view["pressure"]);
        if order == 2
            && let Some(dom) = opened(&run.folder.join("report.html"))
        {
            // the script has drawn: the magnification stands beside the slider
            assert!(dom.contains("<output>× "), "the view is not drawn");
            assert!(dom.contains("<span style=\"background"), "no colours");
        }
    }
}

#[test]
fn without_fields_the_page_says_how_to_get_them() {
    let run = solve(case("patch-3d"), &[]).converged();
    let folder = run.folder.to_str().expect("a name");
    let out = run.folder.join("elsewhere.html");
    let made = winkler(&["report", folder, "-o", out.to_str().expect("a name")]);
    assert_eq!((made.code, made.stdout.trim()), (0, out.to_str().expect("a name")), "{}", made.said());
    let text = fs::read_to_string(&out).expect("a page");
    assert!(text.contains("<code>--vtu --report</code>") && !text.contains("id=\"view\""));
    // a map of the pressure from the table
    let points = run.contact().rows();
    let map =
        text.split("<figure class=\"map\">").nth(1).and_then(|rest| rest.split("</figure>").next()).expect("a map");
    assert_eq!(map.matches('M').count(), points);
    refused(&winkler(&["plot", folder, "stress"]), 6, &["no fields", "--vtu"]);
}

/// One message with these words, and this exit code.
fn refused(run: &Run, code: i32, words: &[&str]) {
    assert_eq!(run.code, code, "{}", run.said());
    words.iter().for_each(|word| assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said()));
}

/// The picture of bodies in space has the triangles that face the viewer: of two boxes three faces each, from the first colour to the last.
#[test]
fn bodies_in_space_and_contact_surfaces_are_drawn() {
    let run = solve(case("patch-3d"), &["--vtu"]).converged();
    let folder = run.folder.to_str().expect("a name");
    let drawn = winkler(&["plot", folder, "displacement"]);
    assert_eq!(drawn.code, 0, "{}", drawn.said());
    let svg = fs::read_to_string(drawn.stdout.trim()).expect("a picture");
    let fills: Vec<&str> = svg.split("<path fill=\"").skip(1).map(|rest| &rest[..7]).collect();
    let different: std::collections::BTreeSet<&str> = fills.iter().copied().collect();
    // twelve bands on three faces of different brightness, each of which has some of them
    assert!((13..=36).contains(&different.len()), "{different:?}");
    assert!(svg.contains("displacements ×"));
    // the pressure on the facets of the joint, the same everywhere: all of it in the last colour
    let drawn = winkler(&["plot", folder, "pressure"]);
    let svg = fs::read_to_string(drawn.stdout.trim()).expect("a picture");
    assert!(svg.contains("fill=\"#fee825\" d=\"M") && !svg.contains(">open<"), "{svg}");
}

/// The curve of contact over force has a mark for each load step, and an area in space is called one, in tables too.
#[test]
fn contact_over_force() {
    let sets =
        ["--set", "mesh.set.n=4", "--set", "method.steps=3", "--set", "output.vtu=false", "--set", "units=mm, MPa"];
    for (name, column) in [("groove-held", "contact_length"), ("rough", "contact_area")] {
        let run = solve(case(name), &sets).converged();
        let header = fs::read_to_string(run.folder.join("steps.csv")).expect("steps.csv");
        assert!(
            header.lines().next().is_some_and(|header| header.contains(&format!(",{column} lower-upper,"))),
            "{header}"
        );
        let steps = run.report["steps"].as_array().expect("steps");
        assert_eq!(steps[2]["pairs"][0][column], run.report["pairs"][0][column]);
        let folder = run.folder.to_str().expect("a name");
        assert_eq!(winkler(&["plot", folder, "area"]).code, 0);
        assert_eq!(winkler(&["report", folder]).code, 0);
        let page = fs::read_to_string(run.folder.join("report.html")).expect("a page");
        assert!(page.contains("<h2>Load steps</h2>") && page.contains("contact force, N"), "{name}");
        // in the plane for each length of thickness
        assert_eq!(page.contains("contact force, N/mm"), name == "groove-held");
        let drawn = fs::read_to_string(run.folder.join("area.svg")).expect("a picture");
        assert_eq!(drawn.matches("<polygon").count(), 3, "{name}");
        assert!(drawn.contains("contact force") && drawn.contains(&column.replace("contact_", "")), "{name}");
        assert_eq!(winkler(&["plot", folder, "force"]).code, 0);
        let drawn = fs::read_to_string(run.folder.join("force.svg")).expect("a picture");
        assert!(drawn.contains("contact force") && drawn.contains("approach"), "{name}");
    }
    let run = solve(case("groove-held"), &["--set", "mesh.set.n=4"]).converged();
    refused(&winkler(&["plot", run.folder.to_str().expect("a name"), "area"]), 6, &["no load steps", "method.steps"]);
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let run = solve(case("patch-3d"), &["--vtu"]).converged();
    let folder = run.folder.to_str().expect("a name").to_owned();
    refused(&winkler(&["report"]), 2, &["DIR"]);
    refused(&winkler(&["report", "nowhere"]), 6, &["nowhere", "report.json", "winkler solve"]);
    refused(&winkler(&["report", &folder, "-o", "no/page.html"]), 6, &["no/page.html"]);
    refused(&winkler(&["plot", &folder, "stres"]), 2, &["`stres`", "did you mean `stress`?"]);
    refused(&winkler(&["plot", &folder, "pressure", "-o", "p.png"]), 2, &["p.png", "rsvg-convert"]);
    refused(&winkler(&["plot", &folder, "pressure", "-o", "no/p.svg"]), 6, &["no/p.svg"]);
    refused(&winkler(&["plot", "nowhere", "pressure"]), 6, &["report.json"]);
    // of a run without sums
    fs::remove_file(run.folder.join("SHA256SUMS")).expect("sums");
    let broken = |name: &str, text: &str, words: &[&str]| {
        let path = run.folder.join(name);
        let before = fs::read(&path).expect("a file");
        fs::write(&path, text).expect("a file");
        refused(&winkler(&["report", &folder]), 6, words);
        assert!(!run.folder.join("report.html").exists());
        fs::write(&path, before).expect("a file");
    };
    broken("lower.vtu", "<VTKFile", &["lower.vtu", "--vtu"]);
    broken("lower.vtu", "", &["lower.vtu"]);
    broken("report.json", "{", &["report.json", "no report"]);
    broken("report.json", "{}", &["report.json", "`status`"]);
    broken("history.csv", "a,b\n1\n", &["history.csv", "table"]);
    let name = "contact-lower-upper.csv";
    broken(name, "x,y\n1,2,3\n", &[name]);
    assert_eq!(winkler(&["report", &folder]).code, 0);
}

/// Numbers that look like chance, the same in every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: usize) -> usize {
        // Knuth's MMIX
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

/// A file with something wrong: a bit, a byte, a piece that is missing, or the end.
fn damaged(whole: &[u8], chance: &mut Chance) -> Vec<u8> {
    let (mut bytes, at) = (whole.to_vec(), chance.below(whole.len()));
    match chance.below(4) {
        0 => bytes[at] ^= 1 << chance.below(8),
        1 => bytes[at] = b"0123456789-.e,<>/=AZ\0\xff"[chance.below(22)],
        2 => bytes.truncate(at),
        _ => drop(bytes.drain(at..(at + 1 + chance.below(40)).min(whole.len()))),
    }
    bytes
}

/// Files of a run that are not what it wrote make no page, or the same one: a page with other numbers would be believed.
#[test]
fn damaged_results_are_not_shown() {
    let small = ["--set", "mesh.set.n=2", "--vtu"];
    let plane = solve(case("groove-held"), &["--method", "newton", small[0], small[1], small[2]]).converged();
    let space = solve(case("patch-3d"), &["--vtu", "--set", "output.compress=false"]).converged();
    let mut chance = Chance(1);
    for run in [&plane, &space] {
        let page = || winkler::internals::save(&run.folder, None).map(|path| fs::read(path).expect("a page"));
        let good = page().expect("a page");
        let read = ["report.json", "history.csv", "contacts.csv", "contact-lower-upper.csv", "SHA256SUMS"];
        let fields = ["lower.vtu", "upper.vtu", "contact-lower-upper.vtu"];
        let mut check = |names: &[&str], times: usize| {
            let mut refused = 0;
            for name in names {
                let path = run.folder.join(name);
                let whole = fs::read(&path).expect("a file");
                for _ in 0..times {
                    fs::write(&path, damaged(&whole, &mut chance)).expect("a file");
                    match page() {
                        Ok(found) => assert!(found == good, "{name} with other numbers"),
                        Err(error) => {
                            assert!(error.message().contains(name) && error.kind() == Kind::File, "{name}: {error}");
                            refused += 1;
                        }
                    }
                }
                fs::write(&path, whole).expect("a file");
            }
            refused
        };
        // some pages are the same since nothing was changed, or what they do not show
        let all = read.len() + fields.len();
        assert!(check(&[&read[..], &fields].concat(), 25) > 20 * all);
        // fields have sums of their own where they are compressed; without sums nothing may crash
        fs::remove_file(run.folder.join("SHA256SUMS")).expect("sums");
        if std::ptr::eq(run, &plane) {
            assert!(check(&fields, 150) > 250);
        } else {
            for name in fields {
                let path = run.folder.join(name);
                let whole = fs::read(&path).expect("a file");
                for _ in 0..100 {
                    fs::write(&path, damaged(&whole, &mut chance)).expect("a file");
                    // what cannot be known is shown
                    let _ = page();
                }
                fs::write(&path, whole).expect("a file");
            }
        }
        assert!(page().expect("a page") == good);
    }
}

#[test]
fn a_hundred_thousand_triangles_take_less_than_five_megabytes() {
    // a slab of cubes of six tetrahedra each
    let n = 157;
    let at = |i: usize, j: usize, k: usize| (i + (n + 1) * (j + (n + 1) * k)) as u32;
    let points: Vec<[f64; 3]> = (0..2 * (n + 1) * (n + 1))
        .map(|p| [p % (n + 1), p / (n + 1) % (n + 1), p / (n + 1) / (n + 1)].map(|c| c as f64))
        .collect();
    let ways = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut connectivity = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        for way in ways {
            let mut corner = [i, j, 0];
            connectivity.push(at(i, j, 0));
            for axis in way {
                corner[axis] += 1;
                connectivity.push(at(corner[0], corner[1], corner[2]));
            }
        }
    }
    let wave = |x: &[f64; 3]| [(0.1 * x[0]).sin(), (0.13 * x[1]).cos(), (0.07 * x[0] * x[1]).sin()];
    let displacement: Vec<[f64; 3]> = points.iter().map(wave).collect();
    let field = BodyField {
        name: "slab".into(),
        von_mises: displacement.iter().map(|u| 1.0 + u[2]).collect(),
        largest: None,
        stress: vec![[0.0; 6]; points.len()],
        principal: displacement.clone(),
        points,
        cell: CellKind::Tetra,
        connectivity,
        displacement,
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut file = fs::File::create(folder.path().join("slab.vtu")).expect("a file");
    field.write(Default::default(), &mut file).expect("a grid");
    let report = json!({
        "title": "slab", "status": "converged", "message": "", "settings": { "dimension": 3, "body": [], "contact": [] }, "pairs": [],
        "bodies": [{ "name": "slab" }], "files": ["slab.vtu"], "times": { "total": 1.0 }, "inner_times": {},
    });
    fs::write(folder.path().join("report.json"), report.to_string()).expect("a report");
    winkler::internals::save(folder.path(), None).expect("a page");
    let page = page(folder.path());
    let count = triangles(&view(&page)["bodies"][0]);
    assert_eq!(count, 4 * n * n + 8 * n);
    assert!((99_000..105_000).contains(&count) && page.len() < 5_000_000, "{count} triangles, {} bytes", page.len());
}
