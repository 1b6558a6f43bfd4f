//! Pairs that are pressed by a force, and bolts that keep their preload.

use crate::common::here::solve_here;
use crate::common::{Scene, case, solve, solve_on};

fn close(what: &str, ours: f64, exact: f64, tolerance: f64) {
    assert!((ours / exact - 1.0).abs() < tolerance, "{what}: {ours}, closed form {exact}");
}

/// The patch with both ends held, pressed by the force of its contact alone: the offset is what layer and blocks give way.
#[test]
fn a_patch_pressed_by_a_force() {
    let held = |fix: &str| vec!["body.1.load=[]".to_owned(), format!("body.1.fix={fix}")];
    let plane = held("[{on='upper_face',y=0},{on='upper_pin',x=0}]");
    let space = held("[{on='upper_top',z=0},{on='upper_pin',x=0,y=0},{on='upper_spin',y=0}]");
    let layer = 2.5e-5 * 10f64.sqrt();
    let offsets =
        [("patch", plane, 10.0, layer + 2.0 * 4.33333333e-5), ("patch-3d", space, 10.0, layer + 2.0 * 4.76190476e-5)];
    for (name, held, force, offset) in offsets {
        let area = if name == "patch" { "weight" } else { "area" };
        for method in [
            "{}",
            "{linear='direct'}",
            "{linear='multigrid'}",
            "{name='newton-robin'}",
            "{name='robin',gamma=0.4,robin='auto'}",
        ] {
            let (method, force) = (format!("method={method}"), format!("contact.0.force={force}"));
            let set: Vec<&str> = held.iter().map(String::as_str).chain([method.as_str(), force.as_str()]).collect();
            let run = solve_here(case(name), &set).converged();
            let size: f64 = run.contact()["weight"].iter().sum();
            let pressure = 10.0 / size;
            let exact = 2.5e-5 * pressure.sqrt() + (offset - layer) / 10.0 * pressure;
            close(&format!("{name} {area} {method}"), run.number("pairs/0/offset"), exact, 2e-6);
            close(&method, run.number("pairs/0/peak_pressure"), pressure, 1e-6);
        }
    }
}

/// A bolt between two halves of a sleeve, all held below and joined by a stiff head. The bolt is cut where it meets the head, and the cut is bonded.
const JOINT: &str = "n = 2; x[] = {0, 1, 2, 3};
    For k In {0:3}
      p = newp; x0 = k; h0 = 0; w = 1; h = 4;
      If (k == 3) x0 = 0; h0 = 4; w = 3; h = 1; EndIf
      Point(p) = {x0, h0, 0}; Point(p+1) = {x0+w, h0, 0}; Point(p+2) = {x0+w, h0+h, 0}; Point(p+3) = {x0, h0+h, 0};
      l = newl; Line(l) = {p, p+1}; Line(l+1) = {p+1, p+2}; Line(l+2) = {p+2, p+3}; Line(l+3) = {p+3, p};
      If (k == 3)
        q = newp; Point(q) = {1, 4, 0}; Point(q+1) = {2, 4, 0}; r = newl;
        Line(r) = {p, q}; Line(r+1) = {q, q+1}; Line(r+2) = {q+1, p+1};
        Transfinite Curve {r, r+1, r+2} = n + 1; Transfinite Curve {l+1, l+3} = n + 1; Transfinite Curve {l+2} = 3*n + 1;
        s = news; Curve Loop(s) = {r, r+1, r+2, l+1, l+2, l+3}; Plane Surface(s) = {s};
        Physical Surface(\"head\") = {s}; Physical Curve(\"seat\") = {r, r+2}; Physical Curve(\"cut_high\") = {r+1}; Physical Curve(\"crown\") = {l+2};
        Physical Point(\"pin\") = {p+3};
      Else
        Transfinite Curve {l, l+2} = n + 1; Transfinite Curve {l+1, l+3} = 2*n + 1;
        s = news; Curve Loop(s) = {l, l+1, l+2, l+3}; Plane Surface(s) = {s}; Transfinite Surface {s};
        Physical Surface(Sprintf(\"column%g\", k)) = {s}; Physical Curve(Sprintf(\"base%g\", k)) = {l}; Physical Curve(Sprintf(\"top%g\", k)) = {l+2};
        Physical Point(Sprintf(\"pin%g\", k)) = {p};
      EndIf
    EndFor
    Physical Curve(\"sleeve\") = {};\n";

/// The joint diagram. The bolt has the stiffness Kb, the two columns of the sleeve together Kp, both with their layers. From the preload F, a service load S
/// raises the force of the bolt by S Kb/(Kb + Kp), until the sleeve lifts off at S = F (Kb + Kp)/Kp; then the bolt carries S alone.
#[test]
fn a_bolt_keeps_its_preload() {
    let column = |k: usize, young: f64| {
        format!(
            "[[body]]\nname = \"column{k}\"\nyoung = {young}\npoisson = 0\nfix = [{{ on = \"base{k}\", y = 0 }}, {{ on = \"pin{k}\", x = 0 }}]\n"
        )
    };
    let (preload, stiffness) = (100.0, 1e6);
    let text = format!(
        "dimension = 2\nmesh = \"mesh.geo\"\n{}{}{}[[body]]\nname = \"head\"\nyoung = 1e9\npoisson = 0\nfix = [{{ on = \"pin\", x = 0 }}]\n\
         load = [{{ on = \"crown\", pressure = -1, path = \"service\" }}]\n\
         [[contact]]\nbetween = [\"top1\", \"cut_high\"]\nbond = true\npreload = {preload}\nlayer = {{ linear = {{ stiffness = {stiffness} }} }}\n\
         [[contact]]\nbetween = [\"top0\", \"seat\"]\nlayer = {{ linear = {{ stiffness = {stiffness} }} }}\n\
         [[contact]]\nbetween = [\"top2\", \"seat\"]\nlayer = {{ linear = {{ stiffness = {stiffness} }} }}\n\
         [method]\nsteps = {{ table = \"path.csv\" }}\n",
        column(0, 5e4),
        column(1, 2e5),
        column(2, 5e4),
    );
    let scene = Scene::new(text);
    std::fs::write(scene.path.with_file_name("mesh.geo"), JOINT.replace("Physical Curve(\"sleeve\") = {};", ""))
        .expect("a script");
    // the load is 3 times the factor
    std::fs::write(scene.path.with_file_name("path.csv"), "time, service\n1, 0\n2, 20\n3, 40\n4, 60\n5, 10\n")
        .expect("a table");
    let in_series = |young: f64| 1.0 / (4.0 / young + 1.0 / stiffness);
    let (bolt, plates) = (in_series(2e5), 2.0 * in_series(5e4));
    let expected = |service: f64| (preload + service * bolt / (bolt + plates)).max(service);
    for method in ["name='auto'", "linear='multigrid'", "name='newton-robin'"] {
        let set = format!("method={{{method},steps={{table='{}'}}}}", scene.path.with_file_name("path.csv").display());
        let run = solve_here(&scene.path, &[&set]).converged();
        for (step, factor) in [0.0, 20.0, 40.0, 60.0, 10.0].into_iter().enumerate() {
            let force = run.number(&format!("steps/{step}/pairs/0/force/1"));
            close(&format!("{method} step {step}"), force.abs(), expected(3.0 * factor), 1e-4);
        }
        let offset = |step: usize| run.number(&format!("steps/{step}/pairs/0/offset"));
        close("offset", -offset(0), preload / bolt + preload / plates, 1e-3);
        assert!((1..5).all(|step| offset(step) == offset(0)), "{method}");
    }
    let run = solve_on(3, &scene.path, &["--set", "solver=mumps"]);
    let steps = run.table("steps.csv");
    close("ranks", steps["force_y column1-head"][3].abs(), expected(180.0), 1e-4);
    assert_eq!(steps["offset column1-head"][3], steps["offset column1-head"][0]);
    // a run that goes on with the fourth step has the offset of the first
    let first = solve(&scene.path, &["--set", "method.stop.residual=1e-9"]).converged();
    assert_eq!(first.table("steps.csv")["offset column1-head"].len(), 5);
}
