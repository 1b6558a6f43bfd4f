//! Layers that are unloaded along another curve.

use crate::common::here::{solve_here, try_here};
use crate::common::vtu::Grid;
use crate::common::{Scene, case, distance, solve_on};

/// A patch under the pressures 10, 4, 15 and 2, whose layer has the stiffness 1e5.
const LOADS: [&str; 2] = ["body.upper.load.0.pressure=2", "contact.0.layer={linear={stiffness=1e5}}"];
const PRESSURES: [f64; 4] = [10.0, 4.0, 15.0, 2.0];

fn with_method(method: &str) -> String {
    format!("method={{{method},steps=[5,2,7.5,1]}}")
}

fn close(what: &str, ours: f64, exact: f64, tolerance: f64) {
    assert!((ours / exact - 1.0).abs() < tolerance, "{what}: {ours}, by hand {exact}");
}

/// Compressions by hand: loaded, unloaded, loaded beyond the largest pressure, unloaded.
#[test]
fn loading_and_unloading_by_hand() {
    let straight = [1e-4, 1e-4 - 6.0 / 1e6, 1.5e-4, 1.5e-4 - 13.0 / 1e6];
    // the slope at 15 is half way from that at 10 to that at 20
    let sloped = [1e-4, 1e-4 - 6.0 / 1e6, 1.5e-4, 1.5e-4 - 13.0 / 2e6];
    // 1e6 x + 1e10 x^2 = fall
    let way = |fall: f64| ((1e12 + 4e10 * fall).sqrt() - 1e6) / 2e10;
    let curved = [1e-4, 1e-4 - way(6.0), 1.5e-4, 1.5e-4 - way(13.0)];
    for (unload, exact) in [
        ("{linear={stiffness=1e6}}", straight),
        ("{table=[[1e-4,10,1e6],[2e-4,20,3e6]]}", sloped),
        ("{pressure='1e6*c+1e10*c^2'}", curved),
    ] {
        let unload = format!("contact.0.unload={unload}");
        for (method, tolerance) in [
            ("name='newton'", 1e-10),
            ("linear='direct'", 1e-10),
            ("linear='multigrid'", 1e-7),
            ("name='newton-robin'", 1e-7),
            ("name='robin',gamma=0.4,robin='auto'", 1e-6),
        ] {
            let method = with_method(method);
            let run = solve_here(case("patch"), &[LOADS[0], LOADS[1], &unload, &method]).converged();
            for step in 0..4 {
                let number = |what: &str| run.number(&format!("steps/{step}/pairs/0/peak_{what}"));
                let what = format!("{unload} {method} step {step}");
                close(&what, number("pressure"), PRESSURES[step], tolerance);
                close(&what, number("compression"), exact[step], tolerance);
            }
        }
        let method = with_method("name='newton'");
        let sets = [LOADS[0], LOADS[1], &unload, &method].map(|set| ["--set", set]).concat();
        let table = solve_on(3, case("patch"), &sets).converged().contact();
        assert!(table["compression_max"].iter().all(|c| (c / 1.5e-4 - 1.0).abs() < 1e-10), "{unload}");
    }
}

/// A layer that is crushed beyond the end of its table goes on along the last slope, also where it comes back to after it was unloaded. The warning names
/// the end of the table.
#[test]
fn crushed_beyond_the_table() {
    let sets = [
        LOADS[0],
        "contact.0.layer={table=[[5e-5,5],[1e-4,10]]}",
        "contact.0.unload={linear={stiffness=1e6}}",
        "method={steps=[6,2,7.5,1]}",
    ];
    let run = solve_here(case("patch"), &sets).converged();
    for (step, exact) in [1.2e-4, 1.2e-4 - 8.0 / 1e6, 1.5e-4, 1.5e-4 - 13.0 / 1e6].into_iter().enumerate() {
        let found = run.number(&format!("steps/{step}/pairs/0/peak_compression"));
        close(&format!("step {step}"), found, exact, 1e-10);
    }
    let words =
        "by 1.50e-04 in load step 3, under a pressure of 1.50e+01, and its law ends at a compression of 1.00e-04";
    assert!(run.warnings().contains(words), "{}", run.warnings());
}

/// A wave is crushed by a pressure of 80, so that its points have compressions of their own.
fn wave(steps: &str) -> Vec<String> {
    let layer = "contact.0.layer={power={B=2.5e-5,a=0.5}}".to_owned();
    let unload = "contact.0.unload={linear={stiffness=1e7}}".to_owned();
    vec![layer, unload, format!("method={{steps={steps},stop={{residual=1e-12}}}}")]
}

/// The second loading of a crushed wave goes along the first unloading, up to the largest load, and from there along the law.
#[test]
fn a_crushed_wave() {
    let solve = |steps: &str| {
        let sets = wave(steps);
        let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set.as_str()]).collect();
        solve_on(1, case("wavy"), &words).converged().contact()
    };
    let [unloaded, loaded_again] = ["[2,1]", "[2,0.5,1]"].map(solve);
    assert!(distance(&loaded_again["pressure"], &unloaded["pressure"]) < 1e-9);
    assert!(distance(&loaded_again["compression"], &unloaded["compression"]) < 1e-9);
    let [fresh, crushed] = ["[0.5,1]", "[0.6,0.2,1]"].map(solve);
    assert!(distance(&crushed["pressure"], &fresh["pressure"]) < 1e-9);
    // the crushed layer is stiffer, and the pressure of the wave grows
    let peak = |pressure: &[f64]| pressure.iter().copied().fold(0.0, f64::max);
    assert!(peak(&unloaded["pressure"]) > 1.001 * peak(&fresh["pressure"]));
}

/// A run whose last step did not end goes on with the compressions of the steps before, on any ranks. Linear steps are loaded by one iteration, and
/// unloaded by two.
#[test]
fn memory_is_kept_over_a_restart() {
    let sets = [LOADS[0], LOADS[1], "contact.0.unload={linear={stiffness=1e6}}", "method={steps=[5,7.5,1]}"];
    let words = sets.map(|set| ["--set", set]).concat();
    for (ranks, then) in [(1, 3), (3, 1)] {
        let short = [&words[..], &["--set", "method.stop.iterations=1"]].concat();
        let ended = solve_on(ranks, case("patch"), &short);
        assert_eq!(ended["status"], "iteration-limit", "{}", ended.said());
        let folder = ended.folder.display().to_string();
        let rest = solve_on(then, case("patch"), &[&words[..], &["--restart", &folder]].concat()).converged();
        close("the last step", rest.number("steps/2/pairs/0/peak_compression"), 1.5e-4 - 13.0 / 1e6, 1e-10);
    }
}

/// Unloading that is softer than loading, and memory that nothing uses.
#[test]
fn what_cannot_be_unloaded() {
    let refused = |unload: &str, words: &str| {
        let sets = [LOADS[0], LOADS[1], &format!("contact.0.unload={unload}"), &with_method("name='newton'")];
        let error = try_here(case("patch"), &sets).err().map(|error| error.render(false)).unwrap_or_default();
        assert!(error.contains(words), "{unload}: {error}");
    };
    refused("{linear={stiffness=5e4}}", "softer than the layer");
    refused("{table=[[1e-4,10,5e4]]}", "softer than the layer");
    refused("{table=[[1e-4,10,-1]]}", "slope");
    refused("{linear={stiffness=-1}}", "stiffness is -1");
    let scene = Scene::edited("patch", "[method]", "unload = { linear = { stiffness = 1e9 } }\n[method]");
    assert!(solve_here(&scene.path, &[]).warnings().contains("`unload` without load steps"));
}

/// The joint diagram of `meshes/bolt` with gaskets of the stiffness 1e5 under the head, ten times as stiff on the way back: a service load S unloads them, so
/// that the bolt carries 100 + S Kb/(Kb + Kp) with the stiffness Kp of the sleeve and the unloaded gaskets, and S alone once the joint is open.
#[test]
fn a_gasket_under_a_bolt() {
    let in_series = |young: f64, layer: f64| 1.0 / (4.0 / young + 1.0 / layer);
    let bolt = in_series(2e5, 1e6);
    let table = case("bolt").with_file_name("tighten.csv").display().to_string();
    let method = format!("method={{steps={{table='{table}'}}}}");
    for (unload, stiffness) in [(true, 1e6), (false, 1e5)] {
        let of_pair = |pair: usize| {
            let layer = format!("contact.{pair}.layer={{linear={{stiffness=1e5}}}}");
            let unload = unload.then(|| format!("contact.{pair}.unload={{linear={{stiffness=1e6}}}}"));
            std::iter::once(layer).chain(unload)
        };
        let sets: Vec<String> = [1, 2].into_iter().flat_map(of_pair).chain([method.clone()]).collect();
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let run = solve_here(case("bolt"), &sets).converged();
        let sleeve = 2.0 * in_series(5e4, stiffness);
        for (step, service) in [0.0, 120.0, 240.0, 360.0, 30.0].into_iter().enumerate() {
            let exact = (100.0 + service * bolt / (bolt + sleeve)).max(service);
            let force = run.number(&format!("steps/{step}/pairs/0/force/0/1")).abs();
            close(&format!("unload {unload}, step {step}"), force, exact, 1e-4);
        }
    }
}

/// The same joint under a service load beyond the one that opens it, by which the gaskets, which stay compressed by 4.5e-4, come apart by 2e-4: no point is
/// closed, and the joint is open by that.
#[test]
fn a_crushed_gasket_is_open() {
    let scene = Scene::edited("bolt", "title = \"A bolt with preload\"", "title = \"An open joint\"");
    let (bolt, sleeve) = (1.0 / (4.0 / 2e5 + 1e-6), 2.0 / (4.0 / 5e4 + 1e-6));
    let service = 100.0 * (bolt + sleeve) / sleeve + 2e-4 * bolt;
    let table = scene.path.with_file_name("tighten.csv");
    std::fs::write(&table, format!("service\n0\n{}\n", service / 3.0)).expect("a table");
    let layers = [1, 2].map(|pair| {
        [("layer", "1e5"), ("unload", "1e6")]
            .map(|(key, stiffness)| format!("contact.{pair}.{key}={{linear={{stiffness={stiffness}}}}}"))
    });
    let sets: Vec<&str> = layers.iter().flatten().map(String::as_str).collect();
    let run = solve_here(&scene.path, &sets).converged();
    let closed = |step: usize| run.number(&format!("steps/{step}/pairs/1/closed"));
    assert!(closed(0) > 0.0 && closed(1) == 0.0);
    assert_eq!(run.number("pairs/1/contact_length"), 0.0);
    close("opening", run.number("pairs/1/opening/1"), 2e-4, 1e-2);
    // the meshes themselves have not come apart
    assert!(run.number("pairs/1/peak_compression") > 2e-4);
}

/// Report, fields and page agree on how far a crushed layer is open: an obstacle compresses a layer by d = 2e-3 - 1e-4 x, of which 0.9 d stay when it goes
/// half of its way back.
#[test]
fn fields_of_a_crushed_layer() {
    let scene = Scene::new(format!(
        "dimension = 3\nmesh = {{ geo = \"{}\", set = {{ nl = 2, nu = 1 }} }}\n[[body]]\nname = \"lower\"\nyoung = 1e10\npoisson = 0\n\
         fix = [{{ on = \"lower_bottom\", x = 0, y = 0, z = 0 }}]\n[[contact]]\non = \"lower_top\"\nobstacle = true\napproach = 1e-3\ngap = \"1e-4*x\"\n\
         layer = {{ linear = {{ stiffness = 1e2 }} }}\nunload = {{ linear = {{ stiffness = 1e3 }} }}\n[method]\nsteps = [2, 1]\n",
        case("patch-3d").with_file_name("patch-3d.geo").display()
    ));
    let run = solve_on(1, &scene, &["--vtu", "--report"]).converged();
    close("report", run.number("pairs/0/opening/1"), 8.1e-4, 1e-6);
    let grid = Grid::read(&run.folder.join("contact-lower-obstacle.vtu"));
    for (x, opening) in grid.points.chunks(3).zip(&grid.arrays["opening"]) {
        close("field", *opening, 8e-4 + 1e-5 * x[0], 1e-6);
    }
    let page = std::fs::read_to_string(run.folder.join("report.html")).expect("a page");
    let widest = page.split("\"opening\":[0.0,").nth(1).and_then(|rest| rest.split(']').next()).expect("a range");
    close("page", widest.parse().expect("a number"), 8.1e-4, 1e-6);
}
