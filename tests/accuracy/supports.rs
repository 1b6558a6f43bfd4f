//! Supports, springs and forces of every kind, and what the report says of them.

use crate::common::here::solve_here;
use crate::common::{Report, Scene, case, distance, root, solve, text_of};
use std::f64::consts::PI;

/// Solves the patch to rounding with further settings.
fn patch(sets: &[&str]) -> Report {
    let all = [&["method={stop={residual=1e-12}}", "mesh.set={nl=2,nu=3}"], sets].concat();
    solve_here(case("patch"), &all).converged()
}

/// Every value of a column is this one.
fn uniform(run: &Report, column: &str, value: f64) {
    for found in &run.contact()[column] {
        assert!((found / value - 1.0).abs() < 1e-9, "{column}: {found}, not {value}");
    }
}

/// The force that a support, spring or rigid surface of a body gives, by list and number.
fn force(run: &Report, body: usize, list: &str, index: usize) -> [f64; 2] {
    [0, 1].map(|c| run.number(&format!("bodies/{body}/balance/{list}/{index}/force/{c}")))
}

fn near(found: [f64; 2], expected: [f64; 2]) {
    let size = expected[0].hypot(expected[1]);
    assert!((0..2).all(|c| (found[c] - expected[c]).abs() < 1e-9 * size), "{found:?}, not {expected:?}");
}

/// Forces and moments on every body cancel, and each pair's are opposite.
fn balanced(run: &Report, tolerance: f64) {
    for body in 0..run["bodies"].as_array().expect("bodies").len() {
        for kind in ["force", "moment"] {
            let imbalance = run.number(&format!("bodies/{body}/balance/{kind}_imbalance"));
            assert!(imbalance < tolerance, "body {body}, {kind}: {imbalance:e}\n{}", run.said());
        }
    }
    for kind in ["force", "moment"] {
        for c in 0..3 {
            let [a, b] = [0, 1].map(|side| run.number(&format!("pairs/0/{kind}/{side}/{c}")));
            assert!((a + b).abs() <= 1e-12 * (1.0 + a.abs()), "{kind} {c}: {a} {b}");
        }
    }
}

const SHORTENING: f64 = 10.0 * (1.0 - 0.09) / 2.1e5;

#[test]
fn a_foundation_under_the_patch() {
    // springs along the normal of the face let it widen: it sinks by q/k as a whole
    for layer in ["{on=\"lower_face\",normal=1e6}", "{on=\"lower_face\",stiffness=[0,\"1e6 + 0*x\"]}"] {
        let run = patch(&["body.0.fix=[{on=\"lower_pin\",x=0}]", &format!("body.0.spring=[{layer}]")]);
        uniform(&run, "pressure", 10.0);
        uniform(&run, "u_n_lower", -SHORTENING - 10.0 / 1e6);
        near(force(&run, 0, "springs", 0), [0.0, 10.0]);
        balanced(&run, 1e-11);
        assert!(run.warnings().is_empty(), "{}", run.warnings());
    }
}

/// A stiff contact that overlaps pushes the upper block off, which is pulled as well: nothing but a soft spring ends that.
#[test]
fn a_soft_spring_holds_what_contact_lets_go() {
    let sets = [
        "method={}",
        "body.1.load=[{on=\"upper_face\",pressure=-1e-3}]",
        "body.1.spring=[{on=\"upper_face\",normal=0.01}]",
        "contact.0.gap=-1e-3",
    ];
    let run = solve_here(case("patch"), &sets).converged();
    assert!(run.contact()["pressure"].iter().all(|&pressure| pressure == 0.0));
    let pull = force(&run, 1, "springs", 0)[1];
    assert!((pull / -1e-3 - 1.0).abs() < 1e-7, "{pull}");
}

#[test]
fn a_spring_at_a_point_holds_like_a_support() {
    let run = patch(&["body.0.fix=[{on=\"lower_face\",y=0}]", "body.0.spring=[{on=\"lower_pin\",stiffness=[1e3,0]}]"]);
    uniform(&run, "pressure", 10.0);
    assert!(run.warnings().is_empty(), "nothing slides: {}", run.warnings());
    // under a sideways load it is what holds: k u = 2
    let run = patch(&[
        "body.0.fix=[{on=\"lower_face\",y=0}]",
        "body.0.spring=[{on=\"lower_pin\",stiffness=1e3}]",
        "body.0.load=[{on=\"lower_face\",force=[2,0]}]",
    ]);
    near(force(&run, 0, "springs", 0), [-2.0, 0.0]);
    near(force(&run, 0, "supports", 0), [0.0, 10.0]);
    balanced(&run, 1e-11);
    // the energy of spring and load together is -f^2 / (2 k)
    let softer = patch(&[
        "body.0.fix=[{on=\"lower_face\",y=0}]",
        "body.0.spring=[{on=\"lower_pin\",stiffness=500}]",
        "body.0.load=[{on=\"lower_face\",force=[2,0]}]",
    ]);
    let fall = run.number("F1") - softer.number("F1");
    assert!((fall / (2.0 / 500.0 - 2.0 / 1e3) - 1.0).abs() < 1e-9, "{fall:e}");
}

#[test]
fn a_displacement_that_varies() {
    // the lower face is turned by 1e-5: everything turns with it, and the pressure stays
    let run = patch(&["body.0.fix=[{on=\"lower_face\",y=\"1e-5*x\"},{on=\"lower_pin\",x=0}]"]);
    uniform(&run, "pressure", 10.0);
    let table = run.contact();
    for (x, u) in table["x"].iter().zip(&table["u_n_lower"]) {
        assert!((u - (1e-5 * x - SHORTENING)).abs() < 1e-13, "{u} at {x}");
    }
    near(force(&run, 0, "supports", 0), [0.0, 10.0]);
    balanced(&run, 1e-11);
}

/// Supports that prescribe what the solution has there anyway, at the nodes of the contact, too, change nothing. Blocks of E = 100 and
/// height 1, a gap of 0.002 and a layer of 300 share 0.01.
#[test]
fn displacements_of_the_contact_itself() {
    let pressure = 0.008 / (2.0 / 100.0 + 1.0 / 300.0);
    let block = |name: &str, face: &str, u: f64, side: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 100\npoisson = 0\nfix = [{{ on = \"{name}_{face}\", y = {u} }}, \
             {{ on = \"{name}_left\", x = 0, y = \"{side}\" }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ rows = 2, n1 = 2, n2 = 3 }} }}\n{}{}[[contact]]\n\
         between = [\"b1_top\", \"b2_bottom\"]\ngap = 0.002\nlayer = {{ linear = {{ stiffness = 300 }} }}\n",
        root().join("meshes/stack/stack.geo").display(),
        block("b1", "bottom", 0.0, &format!("-{pressure}/100*y")),
        block("b2", "top", -0.01, &format!("-0.01 + {pressure}/100*(2 - y)"))
    ));
    for solver in ["condensed", "mumps"] {
        let run = solve_here(&scene, &["method={stop={residual=1e-10}}", &format!("solver={solver}")]);
        let run = run.converged();
        uniform(&run, "pressure", pressure);
        uniform(&run, "u_n_b1", -pressure / 100.0);
        uniform(&run, "u_n_b2", 0.01 - pressure / 100.0);
        // every facet is paired as a whole
        assert_eq!(["uncovered", "averaged"].map(|what| run.count(&format!("pairs/0/facets_{what}"))), [0; 2]);
        balanced(&run, 1e-11);
    }
}

#[test]
fn total_forces() {
    let spread = patch(&["body.1.load=[{on=\"upper_face\",force=[0,-10]}]"]);
    uniform(&spread, "pressure", 10.0);
    balanced(&spread, 1e-11);
    // a gap that is not uniform would turn the block: a rigid face only sinks
    let gap = "contact.0.gap=2e-5*x^2";
    for (surface, order) in [("upper_face", 1), ("upper_face", 2), ("upper_bottom", 1)] {
        let load = format!("body.1.load=[{{on=\"{surface}\",force=[0,-10],rigid=true}}]");
        let run = patch(&[gap, &load, &format!("body.1.order={order}")]);
        let total: f64 = run.number("pairs/0/force/1/1");
        assert!((total - 10.0).abs() < 1e-9, "{surface}: {total}");
        near(force(&run, 1, "rigid", 0), [0.0, -10.0]);
        balanced(&run, 1e-11);
        let table = run.contact();
        let (low, high) =
            table["pressure"].iter().fold((f64::MAX, 0.0f64), |(low, high), &p| (low.min(p), high.max(p)));
        assert!(high - low > 1.0, "the gap makes no difference: {low} to {high}");
        if surface == "upper_bottom" {
            let u = &table["u_n_upper"];
            assert!(u.iter().all(|value| (value - u[0]).abs() < 1e-12 * u[0].abs()), "not flat: {u:?}");
        }
    }
}

/// Loads on the nodes of a rigid surface arrive: the weight of the block under it.
#[test]
fn weight_under_a_rigid_surface() {
    let load = "body.1.load=[{on=\"upper_face\",force=[0,-10],rigid=true}]";
    for order in [1, 2, 5] {
        let run = patch(&[load, "body.1.force=[0,-4]", &format!("body.1.order={order}")]);
        let total = run.number("pairs/0/force/1/1");
        assert!((total - 14.0).abs() < 1e-9, "P{order}: {total}");
        near(force(&run, 1, "rigid", 0), [0.0, -10.0]);
        balanced(&run, 1e-11);
    }
}

/// What the forces lack where the iteration ends too early: of the upper block, contact less load, both without a part that cancels
/// within itself.
#[test]
fn imbalance_of_an_early_end() {
    let sets = ["method={name=\"robin\",start=\"zero\",stop={residual=1e-12,iterations=2}}", "mesh.set={nl=2,nu=3}"];
    let held = "body.1.fix=[{on=\"upper_pin\",x=0},{on=\"upper_face\",y=-1e-4}]";
    let loaded = "body.1.load=[{on=\"upper_bottom\",pressure=2}]";
    let args = [&sets[..], &[held, loaded]].concat();
    let run = solve_here(case("patch"), &args);
    assert_eq!(run.text("status"), "iteration-limit", "{}", run.said());
    let y = |part: &str| run.number(&format!("bodies/1/balance/{part}/force/1"));
    let parts = [y("loads"), y("contacts"), y("supports/1")];
    let lack = parts.iter().sum::<f64>().abs() / parts.iter().map(|part| part.abs()).sum::<f64>();
    let imbalance = run.number("bodies/1/balance/force_imbalance");
    assert!(lack > 1e-4 && (imbalance / lack - 1.0).abs() < 0.1, "{imbalance:e}, not {lack:e}\n{}", run.said());
}

/// Reactions of `groove-held`, known from statics: the roller carries the whole load, 10 on a length of 4.
#[test]
fn reactions() {
    for order in [1, 2, 5] {
        let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
        let sets = ["mesh.set.n=8", "method={stop={residual=1e-11}}", &orders[0], &orders[1]];
        let run = solve_here(case("groove-held"), &sets).converged();
        balanced(&run, 1e-9);
        let roller = force(&run, 0, "supports", 1);
        assert!((roller[1] - 40.0).abs() < 1e-6 && roller[0] == 0.0, "{roller:?}");
        // nothing pushes sideways, but the axis holds a moment
        let axis = force(&run, 0, "supports", 0);
        assert!(axis[0].abs() < 1e-6 && axis[1] == 0.0, "{axis:?}");
        assert!(run.number("bodies/0/balance/supports/0/moment/2").abs() > 1e-2);
        // the load on the upper block is centred at x = 2
        let moment = run.number("bodies/1/balance/loads/moment/2");
        assert!((moment + 80.0).abs() < 1e-9, "{moment}");
    }
}

/// The groove turned by 30 degrees, its supports as planes of symmetry: the same pressures.
#[test]
fn planes_of_symmetry_at_any_angle() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let script = std::fs::read_to_string(root().join("meshes/groove/groove.geo")).expect("the script");
    let turn = "Geometry.AutoCoherence = 0;\nRotate {{0, 0, 1}, {0, 0, 0}, Pi/6} { Surface{1, 2}; }\n";
    std::fs::write(folder.path().join("groove.geo"), script + "\n" + turn).expect("a script");
    let text = std::fs::read_to_string(case("groove-held")).expect("the scene");
    let along = "(x*cos(pi/6) + y*sin(pi/6) - 4)";
    let text = text.replace("../groove/groove.geo", "groove.geo").replace("(x - 4)", along);
    let planes = text.replace("x = 0 }", "symmetry = true }").replace("y = 0 }", "normal = \"1e-4*(1 + 1e-3*r)\" }");
    let planes = planes.replace("*r)", "*(x*cos(pi/6) + y*sin(pi/6)))");
    // the tangent of the lower face moved by its component along x: two directions at 60 degrees
    let sinks = "1e-4*(1 + 1e-3*(x*cos(pi/6) + y*sin(pi/6)))";
    let both = format!(
        "normal = \"{sinks}\" }}, {{ on = \"lower_face\", x = \"sin(pi/6)*{sinks} - cos(pi/6)*1e-5*{along}\" }}"
    );
    let tight = planes.replace(&format!("normal = \"{sinks}\" }}"), &both);
    assert_eq!(tight.matches("sin(pi/6)*1e-4").count(), 1);
    assert_eq!((planes.matches("symmetry = true").count(), planes.matches("normal = \"").count()), (2, 1));
    // the same without the turn; the outer normal there is -y
    let sunk = "body.0.fix.1.y=-1e-4*(1 + 1e-3*x)";
    let scene = folder.path().join("scene.toml");
    let kinds = [
        (1, "mumps", true),
        (2, "mumps", true),
        (1, "hypre", true),
        (2, "mumps", false),
        (4, "hypre", true),
        (5, "mumps", false),
    ];
    for (order, solver, slides) in kinds {
        std::fs::write(&scene, if slides { &planes } else { &tight }).expect("a scene");
        let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
        let solver = format!("solver={solver}");
        let sets = ["mesh.set.n=8", "method={stop={residual=1e-12}}", &orders[0], &orders[1], &solver];
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let turned = solve(&scene, &args);
        let held = if slides { &[][..] } else { &["--set", "body.0.fix.1.x=-1e-5*(x - 4)"] };
        let aligned = solve(case("groove-held"), &[&args[..], &["--set", sunk], held].concat());
        for column in ["pressure", "u_n_lower"] {
            let apart = distance(&turned.contact()[column], &aligned.contact()[column]);
            assert!(apart < 1e-10, "P{order} {solver} {column}: {apart:e}\n{}", turned.said());
        }
        balanced(&turned, 1e-9);
        let [mut ours, theirs] = [&turned, &aligned].map(|run| force(run, 0, "supports", 1));
        if !slides {
            let along = force(&turned, 0, "supports", 2);
            (0..2).for_each(|c| ours[c] += along[c]);
        }
        let (s, c) = (PI / 6.0).sin_cos();
        near(ours, [c * theirs[0] - s * theirs[1], s * theirs[0] + c * theirs[1]]);
    }
}

/// Wrong supports and loads are refused at their line, with the one that they contradict.
#[test]
fn refusals() {
    let refused = |from: &str, to: &str, at: &str, words: &[&str]| {
        let scene = Scene::edited("groove-held", from, to);
        let run = solve(&scene, &[]);
        assert_eq!(run.code, 3, "{}", run.said());
        let place = format!("{}:{}:", scene.path.display(), scene.line_of(at));
        for word in words.iter().copied().chain([&place[..]]) {
            assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
        }
    };
    assert!(text_of("groove-held").contains("groove.geo"));
    let fix = "fix = [{ on = \"lower_axis\", x = 0 }, { on = \"lower_face\", y = 0 }]";
    let fixed = |rest: &str| format!("fix = [{{ on = \"lower_axis\", x = 0 }}, {rest}]");
    let twice = fixed("{ on = \"lower_face\", y = 0 },\n  { on = \"lower_end\", y = 1 }");
    refused(fix, &twice, "lower_end", &["two values of the y displacement", "is on `lower_face`, line 12"]);
    let twice = fixed("{ on = \"lower_face\", normal = 0 },\n  { on = \"lower_face\", y = \"1e-3*x\" }");
    refused(fix, &twice, "1e-3*x", &["two values of the y displacement", "is on `lower_face`, line 12"]);
    let root = fixed("{ on = \"lower_face\", y = \"sqrt(x - 1)\" }");
    refused(fix, &root, "sqrt", &["the displacement of this support is not a finite number at x = 0"]);
    refused(
        fix,
        &fixed("{ on = \"lower\", symmetry = true }"),
        "symmetry",
        &["no curve `lower`", "is a group of cells"],
    );
    let load = "load = [{ on = \"upper_face\", pressure = 10 }]";
    let pushed = "load = [{ on = \"upper_face\", force = [1, -40], rigid = true }]";
    refused(load, pushed, "rigid = true", &["on `upper_face` pushes against the support on `upper_axis`", "line 19"]);
    let two = "load = [{ on = \"upper_face\", force = [0, -40], rigid = true },\n  { on = \"upper_end\", force = [0, 0], rigid = true }]";
    refused(load, two, "upper_end\", f", &["the rigid surfaces `upper_face` and `upper_end` meet", "line 20"]);
    let spring = |text: &str| format!("{load}\nspring = [{text}]");
    let away = spring("{ on = \"lower_face\", normal = 1 }");
    refused(load, &away, "normal = 1", &["`lower_face` does not touch body `upper`"]);
    let negative = spring("{ on = \"upper_end\", stiffness = [1, \"x - 1\"] }");
    refused(load, &negative, "x - 1\"", &["the spring on `upper_end` is -", "must not be negative"]);
}

/// Cubes in space turned about a skew axis, on planes of symmetry that meet in edges and corners, under a rigid force: the
/// patch is exact.
#[test]
fn planes_of_symmetry_in_space() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    // OpenCASCADE numbers the faces x0 x1 y0 y1 z0 z1 of the turned boxes from 13 and 19 on
    let names = ["x", "", "y", "", "bottom", "top"];
    let faces = ["lower", "upper"].iter().zip([13, 19]).flat_map(|(body, first)| {
        let named = names.iter().zip(first..).filter(|(name, _)| !name.is_empty());
        named.map(move |(name, face)| format!("Physical Surface(\"{body}_{name}\") = {{{face}}};\n"))
    });
    let script = "SetFactory(\"OpenCASCADE\");\nBox(1) = {0, 0, 0, 1, 1, 1};\nBox(2) = {0, 0, 1, 1, 1, 1};\n\
                  Rotate {{1, 2, 0.5}, {0, 0, 0}, 0.7} { Volume{1, 2}; }\n\
                  MeshSize {PointsOf {Volume{1};}} = 0.5;\nMeshSize {PointsOf {Volume{2};}} = 0.35;\n\
                  Physical Volume(\"lower\") = {1};\nPhysical Volume(\"upper\") = {2};\n";
    std::fs::write(folder.path().join("patch.geo"), script.to_owned() + &faces.collect::<String>()).expect("a script");
    let body = |name: &str, rest: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\n{rest}\nfix = [{{ on = \"{name}_x\", symmetry = true }}, \
             {{ on = \"{name}_y\", symmetry = true }}"
        )
    };
    // the direction of the force is that of the turned z axis, by Rodrigues' formula
    let axis = [1.0, 2.0, 0.5].map(|a: f64| a / 5.25f64.sqrt());
    let (s, c) = 0.7f64.sin_cos();
    let z = [
        axis[0] * axis[2] * (1.0 - c) + axis[1] * s,
        axis[1] * axis[2] * (1.0 - c) - axis[0] * s,
        axis[2] * axis[2] * (1.0 - c) + c,
    ];
    let force = z.map(|z| (-10.0 * z).to_string()).join(", ");
    let lower = body("lower", "") + ", { on = \"lower_bottom\", normal = 0 }]\n";
    for rigid in [true, false] {
        let load = format!("load = [{{ on = \"upper_top\", force = [{force}], rigid = {rigid} }}]");
        let text = format!(
            "dimension = 3\nmesh = \"patch.geo\"\n{lower}{}]\n[[contact]]\n\
             between = [\"lower_top\", \"upper_bottom\"]\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n\
             [method]\nstop = {{ residual = 1e-11 }}\n",
            body("upper", &load)
        );
        let scene = folder.path().join("scene.toml");
        std::fs::write(&scene, text).expect("a scene");
        // a rigid top does not widen: only the force is exact then
        let run = solve_here(&scene, if rigid { &["body.1.poisson=0"] } else { &[] }).converged();
        uniform(&run, "pressure", 10.0);
        uniform(&run, "u_n_lower", -10.0 / 2.1e5);
        balanced(&run, 1e-10);
        let reaction = [0, 1, 2].map(|c| run.number(&format!("bodies/0/balance/supports/2/force/{c}")));
        assert!((0..3).all(|c| (reaction[c] - 10.0 * z[c]).abs() < 1e-8), "{reaction:?}, {z:?}");
    }
}

/// A bar of length 10 with a square section of side 1 and no Poisson's ratio under moments at its end, which is flexible or rigid: quadratic
/// elements have the solution of a beam, u = kappa x^2 / 2 across and M h / (2 I) = 6 M at the edges.
#[test]
fn moments_bend_a_bar() {
    let young = 1e5;
    for (dimension, shape, moment, total) in [
        (
            2,
            "Rectangle(1) = {0, -0.5, 0, 10, 1}; Physical Curve(\"left\") = {4}; Physical Curve(\"right\") = {2};",
            "2",
            [0.0, 2.0],
        ),
        (
            3,
            "Box(1) = {0, -0.5, -0.5, 10, 1, 1}; Physical Surface(\"left\") = {1}; Physical Surface(\"right\") = {2};",
            "[0, 3, -4]",
            [3.0, -4.0],
        ),
    ] {
        let thing = if dimension == 2 { "Surface" } else { "Volume" };
        let zeros = if dimension == 2 { "" } else { ", z = 0" };
        let scene = Scene::new(format!(
            "dimension = {dimension}\nmesh = {{ geo = \"bar.geo\" }}\n[[body]]\nname = \"bar\"\norder = 2\nyoung = {young:?}\npoisson = 0\n\
             fix = [{{ on = \"left\", x = 0, y = 0{zeros} }}]\nload = [{{ on = \"right\", moment = {moment} }}]\n"
        ));
        let script = format!(
            "SetFactory(\"OpenCASCADE\");\n{shape}\nPhysical {thing}(\"bar\") = {{1}};\nMesh.MeshSizeMax = 1;\n"
        );
        std::fs::write(scene.path.with_file_name("bar.geo"), script).expect("a script");
        let size = f64::hypot(total[0], total[1]);
        let kappa = total.map(|m| 12.0 * m / young);
        // at a corner of the end, where the section has turned about both axes
        let along = 5.0 * (kappa[0].abs() + kappa[1].abs());
        let most = f64::hypot(50.0 * f64::hypot(kappa[0], kappa[1]), along);
        for rigid in [false, true] {
            let run = solve_here(&scene, &[&format!("body.0.load.0.rigid={rigid}")]).converged();
            let relative = |path: &str, exact: f64| (run.number(path) / exact - 1.0).abs();
            assert!(relative("bodies/0/max_displacement", most) < 1e-9, "{most} {}", run.said());
            let most = 6.0 * (total[0].abs() + total[1].abs());
            assert!(relative("bodies/0/max_von_mises", most) < 1e-7, "{}", run.said());
            let loaded = if rigid { "rigid/0" } else { "loads" };
            for (c, exact) in [0.0, total[0], total[1]].into_iter().enumerate() {
                for (part, sign) in [("supports/0", -1.0), (loaded, 1.0)] {
                    let number = |kind: &str| run.number(&format!("bodies/0/balance/{part}/{kind}/{c}"));
                    assert!((number("moment") - sign * exact).abs() < 1e-9 * size, "{part} {c} {}", run.said());
                    assert!(number("force").abs() < 1e-9 * size, "{part} {c} {}", run.said());
                }
            }
        }
    }
}
