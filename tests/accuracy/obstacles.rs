//! Rigid obstacles: foundations, indenters and footings, with known answers.

use crate::common::here::{solve_here, try_here};
use crate::common::{Report, Scene, Table, case, solve, solve_on};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Write a scene with a script beside it.
fn scene(script: &str, text: &str) -> Scene {
    let scene = Scene::new(text);
    std::fs::write(scene.path.with_file_name("mesh.geo"), script).expect("a script can be written");
    scene
}

fn close(what: &str, ours: f64, exact: f64, tolerance: f64) {
    assert!((ours / exact - 1.0).abs() < tolerance, "{what}: {ours}, closed form {exact}");
}

/// The methods and solvers of linear steps that have rigid parts in their own way.
const METHODS: [&str; 4] = ["{}", "{linear='direct'}", "{linear='multigrid'}", "{name='newton-robin'}"];

/// A rectangle -w < x < w, 0 < y < h.
const RECTANGLE: &str = "DefineConstant[ n = {8, Name \"n\"}, m = {8, Name \"m\"}, w = {1, Name \"w\"}, h = {1, Name \"h\"} ];
    Point(1) = {-w, 0, 0}; Point(2) = {w, 0, 0}; Point(3) = {w, h, 0}; Point(4) = {-w, h, 0}; Point(5) = {0, 0, 0}; Point(6) = {0, h, 0};
    Line(1) = {1, 5}; Line(2) = {5, 2}; Line(3) = {2, 3}; Line(4) = {3, 6}; Line(5) = {6, 4}; Line(6) = {4, 1};
    Transfinite Curve {1, 2, 4, 5} = n/2 + 1; Transfinite Curve {3, 6} = m + 1;
    Curve Loop(1) = {1, 2, 3, 4, 5, 6}; Plane Surface(1) = {1}; Transfinite Surface {1} = {1, 2, 3, 4};
    Physical Surface(\"body\") = {1}; Physical Curve(\"low\") = {1, 2}; Physical Curve(\"high\") = {4, 5};
    Physical Curve(\"left\") = {6}; Physical Curve(\"right\") = {3};
    Physical Point(\"middle\") = {6}; Physical Point(\"corner\") = {1};\n";

/// A beam without weight on a foundation, under a force in its middle. Where the foundation does not pull, the beam lifts off at pi/(2 L) from the
/// force, with L^4 = k/(4 E I), and sinks by P L/(2 k) coth(pi/2); where it pulls, an endless beam sinks by P L/(2 k).
#[test]
fn a_beam_lifts_off_its_foundation() {
    let (h, young, lambda) = (0.2, 1e5, 0.25);
    let k = 4.0 * young * h * h * h / 12.0 * lambda * lambda * lambda * lambda;
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"mesh.geo\", set = {{ n = 80, m = 1, w = 20, h = {h} }} }}\n[[body]]\nname = \"body\"\nyoung = {young}\n\
         poisson = 0\norder = 2\nfix = [{{ on = \"middle\", x = 0 }}]\nload = [{{ on = \"middle\", force = [0, -1] }}]\n\
         [[contact]]\non = \"low\"\nobstacle = true\nlayer = {{ linear = {{ stiffness = {k} }} }}\n"
    );
    let scene = scene(RECTANGLE, &text);
    for method in METHODS {
        let run = solve_here(&scene.path, &[&format!("method={method}")]).converged();
        let sink = lambda / (2.0 * k);
        close(method, run.number("pairs/0/peak_compression"), sink / (PI / 2.0).tanh(), 2e-3);
        let ends: Vec<f64> = (0..2).map(|end| run.number(&format!("pairs/0/contact_ends/{end}/0"))).collect();
        ends.iter().for_each(|end| close("lift-off", end.abs(), PI / (2.0 * lambda), 5e-3));
        let bonded = solve_here(&scene.path, &[&format!("method={method}"), "contact.0.bond=true"]).converged();
        close(method, bonded.number("pairs/0/peak_compression"), sink, 2e-3);
        close("force", bonded.number("pairs/0/obstacle/force"), 1.0, 1e-6);
    }
}

/// A rigid sphere of radius 50 (Hertz) and a cone with the slope 0.02 (Sneddon) in the half-space of `meshes/indenter`, by forces for a contact of radius 1,
/// by their approach, and by load steps.
#[test]
fn sphere_and_cone() {
    let modulus = 1e5 / (1.0 - 0.09);
    for (gap, force, depth) in
        [("x^2/100", 4.0 * modulus / 150.0, 0.02), ("0.02*x", 0.02 * modulus * PI / 2.0, 0.01 * PI)]
    {
        let with = |key: &str, more: &[&str]| {
            let law = "layer={linear={stiffness=1e8}}";
            let contact = format!("contact.0={{on='top',obstacle=true,gap='{gap}',{law},{key}}}");
            solve_here(case("indenter"), &[&[contact.as_str()], more].concat()).converged()
        };
        let loaded = format!("force={force}");
        for method in METHODS {
            let run = with(&loaded, &[&format!("method={method}")]);
            close(gap, run.number("pairs/0/contact_area"), PI, 0.02);
            // the block is not endless
            close(gap, run.number("pairs/0/obstacle/approach"), depth, 0.04);
            close(gap, run.number("pairs/0/obstacle/force"), force, 1e-7);
        }
        let run = with(&loaded, &["estimate=true"]);
        if gap.contains('^') {
            close(gap, run.number("pairs/0/peak_pressure"), 1.5 * force / PI, 5e-3);
        }
        assert!((1e-4..0.1).contains(&run.number("discretization_error/pressure/0")), "{}", run.said());
        // what the force has reached, the approach reaches, too
        let reached = run.number("pairs/0/obstacle/approach");
        let moved = format!("approach={reached}");
        close(gap, with(&moved, &[]).number("pairs/0/obstacle/force"), force, 1e-6);
        let steps = with(&moved, &["method={steps=4}"]);
        close(gap, steps.number("steps/3/pairs/0/obstacle/force"), force, 1e-6);
        let half = steps.number("steps/1/pairs/0/obstacle/force") / force;
        close(gap, half, if gap.contains('^') { 0.5f64.powf(1.5) } else { 0.25 }, 0.02);
        close(gap, steps.number("steps/1/pairs/0/obstacle/approach"), reached / 2.0, 1e-12);
        let steps = with(&loaded, &["method={steps=2}"]);
        close(gap, steps.number("steps/0/pairs/0/obstacle/force"), force / 2.0, 1e-7);
    }
}

/// A block with the rigid surface above it; a small quarter of that is a sphere.
const BLOCK: &str = "DefineConstant[ n = {8, Name \"n\"}, L = {2, Name \"L\"}, H = {1, Name \"H\"}, m = {2, Name \"m\"} ];
    Point(1) = {0, 0, 0}; Point(2) = {L, 0, 0}; Point(3) = {L, L, 0}; Point(4) = {0, L, 0};
    Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
    Transfinite Curve {1, 2, 3, 4} = n + 1; Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Transfinite Surface {1};
    e[] = Extrude {0, 0, H} { Surface{1}; Layers{ {m, m}, {0.75, 1} }; };
    Physical Volume(\"body\") = {e[1]}; Physical Surface(\"low\") = {1}; Physical Surface(\"high\") = {e[0]};
    Physical Surface(\"x0\") = {e[5]}; Physical Surface(\"y0\") = {e[2]}; Physical Point(\"corner\") = {1}; Physical Point(\"other\") = {2};\n";

/// Return the scene of a stiff block below a footing with these further keys.
fn footing(keys: &str) -> Scene {
    let text = format!(
        "dimension = 3\nmesh = {{ geo = \"mesh.geo\", set = {{ n = 16 }} }}\n[[body]]\nname = \"body\"\norder = 1\nyoung = 1e9\npoisson = 0\n\
         fix = [{{ on = \"low\", z = 0 }}, {{ on = \"corner\", x = 0, y = 0 }}, {{ on = \"other\", y = 0 }}]\n\
         [[contact]]\non = \"high\"\nobstacle = true\nlayer = {{ linear = {{ stiffness = 1e3 }} }}\n{keys}\n"
    );
    scene(BLOCK, &text)
}

/// A rigid footing on soft soil, loaded off its middle in both directions. Within the kernel of the section the pressure is that of Navier; beyond it lifts
/// off. Where the contact is a triangle at a corner, with the load at (a/4, b/4) from the corner, its sides are a and b, and the peak is 6 F/(a b).
#[test]
fn a_footing_lifts_off_biaxially() {
    let force = 10.0;
    // the moment of the force at (x, y) about the middle: r x F along -z
    let moment =
        |x: f64, y: f64| format!("force = {force}\nmoment = [{}, {}, 0]", -force * (y - 1.0), force * (x - 1.0));
    let within = footing(&moment(1.1, 1.2));
    for method in METHODS {
        let run = solve_here(&within.path, &[&format!("method={method}")]).converged();
        close(method, run.number("pairs/0/peak_pressure"), force / 4.0 * (1.0 + 6.0 * 0.3 / 2.0), 3e-3);
    }
    let corner = footing(&moment(0.4, 0.45));
    for method in METHODS {
        let run = solve_here(&corner.path, &[&format!("method={method}")]).converged();
        close(method, run.number("pairs/0/peak_pressure"), 6.0 * force / (1.6 * 1.8), 0.01);
        close(method, run.number("pairs/0/contact_area"), 0.5 * 1.6 * 1.8, 0.06);
        let tilt = [0, 1].map(|c| run.number(&format!("pairs/0/obstacle/tilt/{c}")));
        // the peak pressure over a and over b
        close(method, tilt[0], 6.0 * force / (1.6 * 1.8) / 1e3 / 1.8, 0.02);
        close(method, -tilt[1], 6.0 * force / (1.6 * 1.8) / 1e3 / 1.6, 0.02);
        // turned as far, it needs the same force and moment
        let reached = run.number("pairs/0/obstacle/approach");
        let turned = footing(&format!("approach = {reached}\ntilt = [{}, {}, 0]", tilt[0], tilt[1]));
        let again = solve_here(&turned.path, &[&format!("method={method}")]).converged();
        close(method, again.number("pairs/0/obstacle/force"), force, 1e-6);
        (0..2).for_each(|c| {
            let path = format!("pairs/0/obstacle/moment/{c}");
            close(method, again.number(&path), run.number(&path), 1e-6);
        });
    }
    let ranks = solve_on(3, &corner.path, &["--set", "solver=hypre"]).converged();
    close("ranks", ranks.number("pairs/0/peak_pressure"), 6.0 * force / (1.6 * 1.8), 0.01);
    close("ranks", ranks.number("pairs/0/obstacle/moment/0"), -force * (0.45 - 1.0), 1e-5);
}

/// The same in the plane: beyond a sixth of the width the contact is three times as long as the load is from the edge.
#[test]
fn a_footing_lifts_off_in_the_plane() {
    let text = |middle: &str| {
        format!(
            "dimension = 2\nmesh = {{ geo = \"mesh.geo\", set = {{ n = 40 }} }}\n[[body]]\nname = \"body\"\norder = 1\nyoung = 1e9\npoisson = 0\n\
             fix = [{{ on = \"low\", y = 0 }}, {{ on = \"corner\", x = 0 }}]\n[[contact]]\non = \"high\"\nobstacle = true\n\
             layer = {{ linear = {{ stiffness = 1e3 }} }}\nforce = 10\n{middle}\n"
        )
    };
    // 0.4 from the right edge: a force down there turns the footing clockwise
    for keys in ["moment = -6", "moment = 0\nat = [0.6, 0]"] {
        let scene = scene(RECTANGLE, &text(keys));
        for method in ["{}", "{linear='multigrid'}", "{name='robin',gamma='aitken',robin='auto'}"] {
            let run = solve_here(&scene.path, &[&format!("method={method}")]).converged();
            close(method, run.number("pairs/0/contact_length"), 1.2, 0.03);
            close(method, run.number("pairs/0/peak_pressure"), 20.0 / 1.2, 5e-3);
        }
    }
}

/// A quarter of a block under a rigid sphere, on one and on three ranks, by factorisation and multigrid, with linear and quadratic elements.
#[test]
fn a_sphere_in_space() {
    let modulus = 1e5 / (1.0 - 0.09);
    let force = 4.0 * modulus / 150.0 / 4.0;
    let text = format!(
        "dimension = 3\nmesh = {{ geo = \"mesh.geo\", set = {{ n = 16, m = 6, L = 2.5, H = 6 }} }}\n[[body]]\nname = \"body\"\norder = 1\nyoung = 1e5\n\
         poisson = 0.3\nfix = [{{ on = \"low\", z = 0 }}, {{ on = \"x0\", x = 0 }}, {{ on = \"y0\", y = 0 }}]\n[[contact]]\non = \"high\"\n\
         obstacle = true\ngap = \"(x^2 + y^2)/100\"\nlayer = {{ linear = {{ stiffness = 1e7 }} }}\nforce = {force}\n"
    );
    let scene = scene(BLOCK, &text);
    let reference = solve_here(&scene.path, &[]).converged();
    close("contact", reference.number("pairs/0/contact_area"), PI / 4.0, 0.04);
    let agrees = |run: &Report| {
        for path in ["pairs/0/obstacle/approach", "pairs/0/obstacle/force", "pairs/0/peak_pressure"] {
            close(path, run.number(path), reference.number(path), 1e-5);
        }
    };
    for method in METHODS {
        agrees(&solve_here(&scene.path, &[&format!("method={method}")]).converged());
    }
    for solver in ["solver=hypre", "solver=mumps", "solver=condensed"] {
        agrees(&solve_on(3, &scene.path, &["--set", solver]).converged());
        let quadratic = solve_on(
            3,
            &scene.path,
            &["--set", solver, "--set", "body.0.order=2", "--set", "mesh.set={n=8,m=3,L=2.5,H=6}"],
        )
        .converged();
        close(
            solver,
            quadratic.number("pairs/0/obstacle/approach"),
            reference.number("pairs/0/obstacle/approach"),
            0.02,
        );
        close(solver, quadratic.number("pairs/0/peak_pressure"), 6.0 * force / PI, 0.05);
    }
}

/// On a first mesh with one point in contact a force leaves no error of its pressure; a second mesh shows that this is a guess.
#[test]
fn a_mesh_is_adapted_to_an_obstacle() {
    let run = solve(case("indenter"), &["--tolerance", "2e-2"]).converged();
    close("peak", run.number("pairs/0/peak_pressure"), 1399.16, 0.02);
    close("area", run.number("pairs/0/contact_area"), PI, 0.05);
}

/// An obstacle on a surface that a support holds: the layer alone gives way, by F/(k A).
#[test]
fn an_obstacle_on_a_held_surface() {
    let held = footing("force = 10").text.replace("on = \"high\"", "on = \"low\"");
    let held = scene(BLOCK, &held.replace("z = 0", "x = 0, y = 0, z = 0"));
    for method in METHODS {
        let run = solve_here(&held.path, &[&format!("method={method}")]).converged();
        close(method, run.number("pairs/0/obstacle/approach"), 10.0 / (1e3 * 4.0), 1e-9);
    }
}

/// What the tables of a run have of an obstacle.
#[test]
fn obstacles_are_in_all_tables() {
    let moved = footing("approach = 1e-3\ntilt = [1e-3, 0, 0]");
    let run = solve(&moved.path, &["--set", "method.steps=2", "--report", "--vtu"]).converged();
    let steps = std::fs::read_to_string(run.folder.join("steps.csv")).expect("a table");
    let mut lines = steps.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (names, first) = (lines.next().expect("names"), lines.next().expect("a step"));
    let first: HashMap<&str, &str> = names.into_iter().zip(first).collect();
    assert_eq!(first["tilt_x body-obstacle"], "0.0005", "{steps}");
    assert_eq!(first["approach body-obstacle"].parse::<f64>().map(|approach| approach > 4e-4), Ok(true), "{steps}");
    assert_eq!(first["moment_x body-obstacle"].parse::<f64>().map(|moment| moment.abs() > 0.1), Ok(true), "{steps}");
    let contacts = std::fs::read_to_string(run.folder.join("contacts.csv")).expect("a table");
    assert!(
        contacts.starts_with("a,b,surface_a,surface_b") && contacts.contains("body,obstacle,high,obstacle"),
        "{contacts}"
    );
    let page = std::fs::read_to_string(run.folder.join("report.html")).expect("a page");
    assert!(page.contains("approach 0.001"), "the page has the obstacle");
    let table: Table = run.contact();
    // turned about x through the middle, it comes twice as near to one edge, and stays where it was at the other
    let at = |y: f64| (0..table.rows()).find(|&q| table["y"][q] == y).expect("a point on the edge");
    let [near, far] = [at(0.0), at(2.0)].map(|q| table["u_n_obstacle"][q]);
    assert!((near.abs() - 2e-3).abs() < 1e-15 && far.abs() < 1e-15, "{near} {far}");
}

/// A wave that grows and moves before a block: its gap has the factors of the load steps. Each step is the solution of a scene with numbers in their places,
/// by every method and on three ranks; a step whose gap has no value ends the run with its number.
#[test]
fn a_gap_changes_with_the_factors_of_load_steps() {
    let text = |gap: &str, table: &str| {
        format!(
            "dimension = 2\nmesh = {{ geo = \"mesh.geo\", set = {{ n = 32 }} }}\n[[body]]\nname = \"body\"\norder = 1\nyoung = 1e5\npoisson = 0.3\n\
             fix = [{{ on = \"low\", x = 0, y = 0 }}]\n[[contact]]\non = \"high\"\nobstacle = true\ngap = \"{gap}\"\napproach = 2e-3\n\
             layer = {{ linear = {{ stiffness = 1e6 }} }}\n[method]\n{table}\n"
        )
    };
    let wave = |depth: &str, shift: &str| format!("{depth} * (1 + cos(pi*(x - {shift})))");
    let (name, table) = ("steps = { table = \"wave.csv\" }", "depth, shift\n1e-3, 0\n4e-3, 0\n4e-3, 0.3\n2e-3, -0.5\n");
    let moving = |gap: &str, table: &str| {
        let scene = scene(RECTANGLE, &text(gap, name));
        std::fs::write(scene.path.with_file_name("wave.csv"), table).expect("a table");
        scene
    };
    let moving_wave = moving(&wave("depth", "shift"), table);
    let alone = table.lines().skip(1).map(|line| {
        let (depth, shift) = line.split_once(", ").expect("two factors");
        solve_here(&scene(RECTANGLE, &text(&wave(depth, &format!("({shift})")), "")).path, &[]).converged()
    });
    let alone: Vec<Report> = alone.collect();
    let mut forces: Vec<f64> = alone.iter().map(|run| run.number("pairs/0/obstacle/force")).collect();
    let checked = |run: &Report| {
        for (step, run_alone) in alone.iter().enumerate() {
            for path in ["pairs/0/obstacle/force", "pairs/0/peak_pressure"] {
                close(path, run.number(&format!("steps/{step}/{path}")), run_alone.number(path), 1e-6);
            }
        }
        close("area", run.number("pairs/0/contact_length"), alone[3].number("pairs/0/contact_length"), 1e-6);
    };
    for method in METHODS {
        let words = method.trim_matches(['{', '}']);
        let words = if words.is_empty() { String::new() } else { format!("{words},") };
        let steps =
            format!("method={{{words}steps={{table='{}'}}}}", moving_wave.path.with_file_name("wave.csv").display());
        checked(&solve_here(&moving_wave.path, &[&steps]).converged());
    }
    checked(&solve_on(3, &moving_wave.path, &["--set", "solver=hypre"]).converged());
    forces.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-3);
    assert_eq!(forces.len(), 4, "{forces:?}");
    // without load steps the common factor is 1, and equal steps have it
    let grown = scene(RECTANGLE, &text(&wave("4e-3 * factor", "0"), ""));
    close("one", solve_here(&grown.path, &[]).converged().number("pairs/0/obstacle/force"), forces[1], 1e-9);
    let half = solve_here(&scene(RECTANGLE, &text(&wave("2e-3", "0"), "")).path, &["contact.0.approach=1e-3"]);
    let steps = solve_here(&grown.path, &["method.steps=2"]).converged();
    close("half", steps.number("steps/0/pairs/0/obstacle/force"), half.number("pairs/0/obstacle/force"), 1e-6);
    for (gap, table, words) in [
        ("depth * sqrt(1.1 - shift - x)", "depth, shift\n1, 0\n1, 0.5\n", "it is in load step 2"),
        ("depth * x", "depth, shift\n1, 0\n", "the variable `shift` in its gap"),
        ("deep * x", "depth\n1\n", "unknown variable `deep`"),
    ] {
        let error = try_here(&moving(gap, table).path, &[]).err().unwrap_or_else(|| panic!("{gap} is accepted"));
        assert!(error.render(false).contains(words), "{gap}: {}", error.render(false));
    }
}

/// A footing under a constant force and a moment that grows: it lifts off beyond the kernel of its section. An expression has the factors that it names alone.
#[test]
fn a_moment_grows_under_a_constant_force() {
    let text = |keys: &str, steps: &str| {
        let held = footing(keys).text;
        format!("{held}[method]\nsteps = {steps}\n")
    };
    let growing = text("force = \"10\"\nmoment = [\"6*push\", 0, 0]", "{ table = \"push.csv\" }");
    let growing = scene(BLOCK, &growing);
    std::fs::write(growing.path.with_file_name("push.csv"), "push\n0.25\n1\n").expect("a table");
    let run = solve_here(&growing.path, &[]).converged();
    // on a square of side 2: F/A (1 + 3 e) within the kernel, beyond it the contact is 3 (1 - e) long
    for (step, peak) in [(0, 2.5 * (1.0 + 3.0 * 0.15)), (1, 2.0 * 10.0 / (3.0 * 0.4 * 2.0))] {
        let path = |key: &str| format!("steps/{step}/pairs/0/{key}");
        close("force", run.number(&path("obstacle/force")), 10.0, 1e-7);
        close("peak", run.number(&path("peak_pressure")), peak, 0.01);
    }
    let equal = solve_here(&scene(BLOCK, &text("force = \"20*factor\"", "2")).path, &[]).converged();
    let forces = [0, 1].map(|step| equal.number(&format!("steps/{step}/pairs/0/obstacle/force")));
    close("half", forces[0], 10.0, 1e-9);
    close("whole", forces[1], 20.0, 1e-9);
    for (keys, words) in
        [("force = \"10*x\"", "unknown variable `x`"), ("force = \"1/(factor - 0.5)\"", "not a finite number")]
    {
        let error =
            try_here(&scene(BLOCK, &text(keys, "2")).path, &[]).err().unwrap_or_else(|| panic!("{keys} is accepted"));
        assert!(error.render(false).contains(words), "{keys}: {}", error.render(false));
    }
}

/// By plain sweeps, an obstacle under a force takes the iterations of one that is moved as far, however stiff the layer is.
#[test]
fn sweeps_move_obstacles_with_their_bodies() {
    for stiffness in ["1e5", "1e8"] {
        for words in ["gamma=0.6", "gamma=1", "gamma='line-search'", "gamma='aitken'", "gamma='aitken',robin='auto'"] {
            let with = |key: &str| {
                let law = format!("layer={{linear={{stiffness={stiffness}}}}}");
                let contact = format!("contact.0={{on='top',obstacle=true,gap='x^2/100',{law},{key}}}");
                let run = solve_here(case("indenter"), &[&contact, &format!("method={{name='robin',{words}}}")]);
                run.converged()
            };
            let loaded = with("force=2930.4");
            let reached = loaded.number("pairs/0/obstacle/approach");
            let moved = with(&format!("approach={reached}"));
            close("force", moved.number("pairs/0/obstacle/force"), 2930.4, 1e-5);
            let counts = [&loaded, &moved].map(|run| run.count("iterations"));
            assert!(counts[0] <= counts[1] + 4, "{stiffness} {words}: {counts:?}");
        }
    }
}

/// Motions without resistance and without direction are refused by name.
#[test]
fn obstacles_that_cannot_be() {
    for (keys, words) in [
        ("force = 1\nmoment = [0, 0, 1]", "about its mean normal"),
        ("force = -1", "a negative `force`"),
        ("preload = 1", "`preload` of an obstacle"),
        ("approach = 1\nforce = 1", "both `approach` and `force`"),
        ("path = \"a\"", "`path` without a table"),
        ("force = 1\npath = \"a\"", "`path` without a table"),
        ("distance = 1", "`distance` of an obstacle"),
        ("angle = 30", "`angle` of an obstacle"),
        ("touching = true", "`touching` of an obstacle"),
        ("of = [\"body\", \"body\"]", "`of` of an obstacle"),
        ("gap = \"sqrt(-1 - x)\"", "the gap"),
    ] {
        let error = try_here(&footing(keys).path, &[]).err().unwrap_or_else(|| panic!("{keys} is accepted"));
        assert!(error.render(false).contains(words), "{keys}: {}", error.render(false));
    }
    // the block and the obstacle fall together
    let mut free = footing("force = 1").text.clone();
    free = free.replace("{ on = \"low\", z = 0 }, ", "");
    let run = solve_here(&scene(BLOCK, &free).path, &[]);
    assert_eq!(run["status"], "underconstrained", "{}", run.said());
}

/// The force of a steep obstacle along the surface is neglected, with a warning where it acts.
#[test]
fn a_steep_gap_has_a_warning() {
    for (slope, warned) in [(1.0, true), (0.2, true), (0.1, false)] {
        let run = solve_here(&footing(&format!("gap = \"{slope}*x\"\napproach = 3")).path, &[]).converged();
        assert_eq!(run.warnings().contains(&format!("has a slope of {slope:.2}")), warned, "{}", run.warnings());
    }
    // steep where nothing touches
    let run = solve_here(&footing("gap = \"max(0, x - 1)\"\napproach = 0.01").path, &[]).converged();
    assert!(!run.warnings().contains("slope"), "{}", run.warnings());
}

/// A ring on springs that do not pull, under an elliptic pressure: contact is four arcs of 44.975 degrees together, by finite elements of order 5 on fine meshes.
#[test]
fn a_ring_on_springs() {
    const RING: &str = "SetFactory(\"OpenCASCADE\"); DefineConstant[ n = 24 ];
        Disk(1) = {0, 0, 0, 5.2}; Disk(2) = {0, 0, 0, 4.8}; BooleanDifference(3) = { Surface{1}; Delete; }{ Surface{2}; Delete; };
        MeshSize {:} = 2*Pi*5/n/2; c() = Abs(Boundary{ Surface{3}; });
        Physical Surface(\"lining\") = {3}; Physical Curve(\"outer\") = {c(0)};\n";
    let text = "dimension = 2\nmesh = \"mesh.geo\"\n[[body]]\nname = \"lining\"\nyoung = 3e4\npoisson = 0.2\norder = 2\n\
        load = [{ on = \"outer\", traction = [\"-0.15*x/5.2\", \"-0.3*y/5.2\"] }]\n\
        [[contact]]\non = \"outer\"\nobstacle = true\nlayer = { linear = { stiffness = 10 } }\n";
    let scene = scene(RING, text);
    for (order, tolerance) in [(1, 5e-2), (2, 1e-3), (3, 1e-3), (6, 1e-3)] {
        let run = solve_here(&scene.path, &[&format!("body.0.order={order}")]).converged();
        close(&format!("order {order}"), run.number("pairs/0/contact_length"), 4.0 * 5.2 * 0.78496, tolerance);
        let length = run.number("pairs/0/contact_length") + run.number("pairs/0/open_length");
        close("all around", length, run.contact()["weight"].iter().sum(), 1e-9);
        assert_eq!(run["pairs"][0]["contact_ends"].as_array().map(Vec::len), Some(4), "{order}");
    }
}
