//! The page of a run.

use crate::common::{Scene, Table, case, output, solve};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

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

/// Opens a page in a window of Chromium of this width; the page after its scripts have run. None where there is no Chromium.
fn opened(path: &Path, width: usize) -> Option<String> {
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
    command.arg(format!("--window-size={width},600"));
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
            "units=cm, MPa",
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
    let error = if run.report["error_bound"].is_null() { "estimated error" } else { "error at most" };
    for words in [
        "&lt;b&gt;A&lt;/b&gt; &amp;",
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
    // what acts is marked: each kind once a body, with the names of the groups, and contact ends within the surfaces
    let kinds = |body: &Value| -> Vec<String> {
        let marks = body["marks"].as_array().expect("marks").iter();
        marks.map(|mark| mark[0].as_str().expect("a kind").to_owned()).collect()
    };
    assert_eq!(kinds(&view["bodies"][0]), ["closed", "open", "support"]);
    assert_eq!(kinds(&view["bodies"][1]), ["closed", "load", "open", "support"]);
    let legend: Vec<&str> =
        view["roles"].as_array().expect("roles").iter().filter_map(|role| role[1].as_str()).collect();
    let surfaces = "lower_top, upper_bottom";
    assert_eq!(legend[..2], ["supports: lower_axis, lower_face, upper_axis", "loads: upper_face"]);
    assert_eq!(legend[2..], [format!("closed contact: {surfaces}"), format!("open contact: {surfaces}")]);
    // the numbers of the contact come first, then the picture, which has no warnings before it
    let [numbers, picture, more] =
        ["<td data-of=\"contact\">", "<canvas>", "<h2>Contact</h2>"].map(|words| page.find(words).expect(words));
    assert!(numbers < picture && picture < more && !page[..picture].contains("class=\"warning\""));
    let lines = |body: usize, kind: usize| {
        let text = view["bodies"][body]["marks"][kind][1][1].as_str().expect("base64");
        STANDARD.decode(text).expect("base64").len() / 8
    };
    // 16 facets on each contact surface of length 4, which is closed up to x = 3.45
    assert_eq!([lines(0, 0), lines(0, 1), lines(1, 0), lines(1, 2)], [14, 2, 14, 2]);
    assert!(run.report["memory"]["iterate"].as_f64().expect("memory") > 1.0);
    if let Some(dom) = opened(&run.folder.join("report.html"), 800) {
        assert!(dom.contains("Run it again"));
        // the script has drawn
        assert!(dom.contains("<output>× ") && dom.contains("<span style=\"background"), "the view is not drawn");
    }
}

/// The value under the mouse stands below the picture, and the axes in its corner. An adapted run has a table of its meshes.
#[test]
fn the_mouse_reads_values() {
    let run = solve(case("groove-held"), &["--report", "--tolerance", "2e-2", "--set", "method={}"]).converged();
    let html = page(&run.folder);
    let rounds = run.report["rounds"].as_array().expect("meshes");
    assert!(
        html.contains("<h2>Meshes</h2>") && rounds.iter().all(|mesh| html.contains(&format!(">{}</td>", mesh["dofs"])))
    );
    // frames are not drawn in a browser without a screen
    let frames = "<head><script>window.requestAnimationFrame = draw => setTimeout(draw, 0)</script>";
    let pointing = "<script>setTimeout(() => {
        const canvas = document.querySelector('canvas'), box = canvas.getBoundingClientRect();
        const [clientX, clientY] = [box.left + box.width / 2, box.top + box.height / 4];
        canvas.dispatchEvent(new PointerEvent('pointermove', { clientX, clientY }));
        const ends = document.querySelectorAll('input[type=number]');
        [ends[0].value, ends[1].value] = [5, 11];
        ends[1].dispatchEvent(new Event('input'));
    }, 100)</script></body>";
    let path = run.folder.join("pointed.html");
    fs::write(&path, html.replacen("<head>", frames, 1).replacen("</body>", pointing, 1)).expect("a page");
    if let Some(dom) = opened(&path, 800) {
        let under = dom.split("class=\"under\">").nth(1).and_then(|rest| rest.split('<').next()).expect("a line");
        // the middle of the upper block lies a quarter below the upper end of the picture
        assert!(under.starts_with("upper at (2") && under.ends_with(" (von Mises stress)"), "{under}");
        let bar = dom.split("class=\"bar\">").nth(1).and_then(|rest| rest.split("</div>").next()).expect("a bar");
        assert!(
            bar.contains(">5</span>") && bar.contains(">to 11</span>"),
            "colours begin and end with what was typed: {bar}"
        );
        let axes = dom.split("class=\"axes\"").nth(1).and_then(|rest| rest.split("</svg>").next()).expect("axes");
        assert!(axes.contains(">x</text>") && axes.contains(">y</text>") && !axes.contains(">z</text>"), "{axes}");
    }
}

/// Places where something acts are drawn if they are chosen, with their own legend, and the picture can be saved. Warnings are folded. Load steps have their
/// forces in a table, and their contact points in files.
#[test]
fn a_page_of_load_steps() {
    let run = solve(case("bolt"), &["--report", "--estimate"]).converged();
    let html = page(&run.folder);
    let warnings = html.find("<details><summary>3 warnings</summary>").expect("folded warnings");
    assert!(html.find("<canvas>").is_some_and(|picture| picture < warnings) && html.contains("<h2>Load steps</h2>"));
    // the force over approach and over time, and the least pressure, by which a gasket is judged
    assert!([">approach (", ">time</text>"].iter().all(|axis| html.contains(axis)), "two plots");
    let row = html.lines().find(|line| line.contains("top0 – seat0</td><td class=\"n\" data-of=\"step\">1</td>"));
    assert!(row.is_some_and(|row| row.contains("data-of=\"least pressure\">49.998</td>")), "{row:?}");
    let count = run.report["steps"].as_array().expect("steps").len();
    for step in 0..count {
        let force = run.number(&format!("steps/{step}/pairs/0/normal_force"));
        let cell = format!("{force:.2}").trim_end_matches('0').trim_end_matches('.').replace('-', "−");
        let row = format!("<td data-of=\"of\">top1 – cut</td><td class=\"n\" data-of=\"step\">{}</td>", step + 1);
        let line = html.lines().find(|line| line.contains(&row)).expect("a row of the step");
        assert!(line.contains(&format!("<td class=\"n\" data-of=\"normal force\">{cell}</td>")), "{cell}: {line}");
        if step + 1 < count {
            let points = Table::read(&run.folder.join(format!("steps/contact-column1-head-{}.csv", step + 1)));
            let sum: f64 = (0..points.rows()).map(|q| points["weight"][q] * points["pressure"][q]).sum();
            assert!((sum - force).abs() < 1e-9 * force.abs(), "step {step}: {sum} {force}");
        }
    }
    for pair in 0..3 {
        let [own, listed] =
            [format!("pairs/{pair}/pressure_estimate"), format!("discretization_error/pressure/{pair}")];
        assert_eq!(run.number(&own), run.number(&listed));
    }
    let choosing = "<script>setTimeout(() => {
        const what = document.querySelector('select');
        what.value = 'places';
        what.dispatchEvent(new Event('change'));
        HTMLAnchorElement.prototype.click = function() { document.title = this.download + ' ' + this.href.slice(0, 22); };
        [...document.querySelectorAll('#bodies button')].find(button => button.textContent.startsWith('Save')).click();
        const fits = [...document.querySelectorAll('.wide')].every(table => table.scrollWidth <= table.clientWidth);
        document.title += fits ? ' fits' : ' is too wide';
    }, 100)</script></body>";
    let path = run.folder.join("chosen.html");
    fs::write(&path, html.replacen("</body>", choosing, 1)).expect("a page");
    // as narrow as a window of Chromium can be
    if let Some(dom) = opened(&path, 500) {
        let bar =
            dom.split("class=\"bar roles\">").nth(1).and_then(|rest| rest.split("</div>").next()).expect("a legend");
        assert!(bar.contains(">supports: base0, base1, base2, pin, ") && bar.contains(">loads: crown<"), "{bar}");
        assert!(
            dom.contains("<title>A bolt with preload.png data:image/png;base64, fits</title>"),
            "{:?}",
            dom.split("title>").nth(1)
        );
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
        // q = 10, on a scale that begins at zero
        let [low, high] = [0, 1].map(|end| view["pressure"][end].as_f64().expect("a number"));
        assert!(low == 0.0 && (high - 10.0).abs() < 1e-6, "{}", view["pressure"]);
        if order == 2
            && let Some(dom) = opened(&run.folder.join("report.html"), 800)
        {
            // the script has drawn: the magnification stands beside the slider
            assert!(dom.contains("<output>× "), "the view is not drawn");
            assert!(dom.contains("<span style=\"background"), "no colours");
        }
    }
}

/// A stud on a plate: facets of the plate beside the stud have no partner, and are open.
#[test]
fn facets_beside_a_contact_are_open() {
    const PLATE: &str = "SetFactory(\"OpenCASCADE\"); Rectangle(1) = {-6, -2, 0, 12, 2}; Rectangle(2) = {-1, 0, 0, 2, 2};
        Transfinite Curve {3} = 25; Transfinite Curve {5} = 5; MeshSize {:} = 1;
        Physical Surface(\"plate\") = {1}; Physical Surface(\"stud\") = {2};
        Physical Curve(\"plate_top\") = {3}; Physical Curve(\"plate_bottom\") = {1}; Physical Curve(\"stud_top\") = {7}; Physical Curve(\"stud_bottom\") = {5};\n";
    for soft in ["plate", "stud"] {
        let body = |name: &str, keys: &str| {
            let young = if name == soft { 1e4 } else { 1e5 };
            format!("[[body]]\nname = \"{name}\"\norder = 1\nyoung = {young}\npoisson = 0\n{keys}\n")
        };
        let scene = Scene::new(format!(
            "dimension = 2\nmesh = \"plate.geo\"\n{}{}[[contact]]\nbetween = [\"plate_top\", \"stud_bottom\"]\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n",
            body("plate", "fix = [{ on = \"plate_bottom\", x = 0, y = 0 }]"),
            body("stud", "fix = [{ on = \"stud_top\", x = 0 }]\nload = [{ on = \"stud_top\", pressure = 1 }]"),
        ));
        std::fs::write(scene.path.with_file_name("plate.geo"), PLATE).expect("a script");
        let run = solve(&scene, &["--report"]).converged();
        let view = view(&page(&run.folder));
        let lines = |body: usize, kind: &str| {
            let marks = view["bodies"][body]["marks"].as_array().expect("marks");
            let found = marks.iter().find(|mark| mark[0] == kind);
            let text = found.map_or("", |mark| mark[1][1].as_str().expect("base64"));
            STANDARD.decode(text).expect("base64").len() / 8
        };
        assert_eq!(
            [lines(0, "closed"), lines(0, "open"), lines(1, "closed"), lines(1, "open")],
            [4, 20, 4, 0],
            "{soft}"
        );
    }
}
