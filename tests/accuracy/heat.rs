//! Bodies that expand with temperature: free expansion, Lame's plug and ring, a bolt, Timoshenko's strip, a hot tube.

use crate::common::here::{solve_here, try_here};
use crate::common::vtu::Grid;
use crate::common::{Report, Scene, case, root, solve, solve_on};
use std::f64::consts::TAU;

fn near(value: f64, exact: f64, share: f64) -> bool {
    (value - exact).abs() <= share * exact.abs()
}

/// Return the largest von Mises stress of all bodies.
fn largest(run: &Report) -> f64 {
    run["bodies"]
        .as_array()
        .expect("bodies")
        .iter()
        .filter_map(|body| body["max_von_mises"].as_f64())
        .fold(0.0, f64::max)
}

/// Return a scene of two rectangles side by side, from x = 0 to 1 and from 1 to 2, with y from 0 to 1.
fn rectangles(head: &str, bodies: [&str; 2], rest: &str) -> Scene {
    let script = "DefineConstant[ n = {2, Name \"n\"} ];\nFor k In {0:1}\n\
        p = newp; Point(p) = {k,0,0}; Point(p+1) = {k+1,0,0}; Point(p+2) = {k+1,1,0}; Point(p+3) = {k,1,0};\n\
        l = newl; Line(l) = {p,p+1}; Line(l+1) = {p+1,p+2}; Line(l+2) = {p+2,p+3}; Line(l+3) = {p+3,p};\n\
        Transfinite Curve {l,l+2} = n+1; Transfinite Curve {l+1,l+3} = n+k+1;\n\
        s = news; Curve Loop(s) = {l,l+1,l+2,l+3}; Plane Surface(s) = {s}; Physical Surface(Sprintf(\"body%g\", k)) = {s};\n\
        Physical Curve(Sprintf(\"low%g\", k)) = {l}; Physical Curve(Sprintf(\"right%g\", k)) = {l+1};\n\
        Physical Curve(Sprintf(\"high%g\", k)) = {l+2}; Physical Curve(Sprintf(\"left%g\", k)) = {l+3};\nEndFor\n";
    let [first, second] = bodies;
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"rectangles.geo\" }}\n{head}\n[[body]]\nname = \"body0\"\n{first}\n\
         [[body]]\nname = \"body1\"\n{second}\n{rest}"
    );
    let scene = Scene::new(text);
    std::fs::write(scene.path.with_file_name("rectangles.geo"), script).expect("a script");
    scene
}

/// Bodies that nothing hinders have no stress, whatever their axes, elements and solver, and none remains in a layer that
/// they touch. In plane strain the stress across the plane is -E alpha T.
#[test]
fn free_expansion_has_no_stress() {
    let keys = |expansion: &str| {
        let of = |name: &str| [format!("body.{name}.expansion={expansion}"), format!("body.{name}.temperature=100")];
        ["lower", "upper"].map(of)
    };
    let patch = |scene: std::path::PathBuf, expansion: &str, more: &[&str]| {
        let keys = keys(expansion).concat();
        let sets: Vec<&str> = keys
            .iter()
            .map(String::as_str)
            .chain(["body.upper.load=[]", "method={}"])
            .chain(more.iter().copied())
            .collect();
        solve_here(scene, &sets).converged()
    };
    let revolved = root().join("meshes/patch/axisymmetric.toml");
    for (scene, expansion, more) in [
        (case("patch"), "1e-5", &["plane='stress'", "body.lower.order=2", "body.upper.order=6"][..]),
        (case("patch-2d"), "'1e-5*(1+x-x)'", &["plane='stress'"]),
        (revolved, "[1e-5,2e-5,1e-5]", &["body.lower.exact=['1e-3*x','2e-3*y']", "body.upper.order=4"]),
        (case("patch-3d"), "1e-5", &["body.upper.order=2"]),
        (case("anisotropic-3d"), "[1e-5,3e-5,-2e-5]", &["solver=mumps"]),
        (case("anisotropic"), "[1e-5,3e-5,-2e-5]", &["plane='stress'"]),
    ] {
        let run = patch(scene.clone(), expansion, more);
        let share = if more.contains(&"body.upper.order=6") { 1e-10 } else { 1e-12 };
        assert!(largest(&run) < share * 2.1e5 * 3e-5 * 100.0, "{}: {}", scene.display(), largest(&run));
        assert!(run.number("pairs/0/peak_pressure") < 1e-9, "{}", scene.display());
        assert!(run.number("bodies/1/max_displacement") > 1e-3);
    }
    let run = patch(case("patch"), "1e-5", &[]);
    assert!(near(largest(&run), 210.0, 1e-12), "{}", largest(&run));
    // in axes turned by 45 degrees a strain along the first is as much of shear
    let sets = [
        "plane='stress'",
        "body.lower.expansion=[1e-5,0,0]",
        "body.lower.axes={angle='pi/4'}",
        "body.lower.temperature=100",
        "body.lower.exact=['5e-4*x + 1e-3*y','5e-4*y']",
        "body.upper.load=[]",
        "method={}",
    ];
    let run = solve_here(case("patch"), &sets).converged();
    assert!(run.number("bodies/0/error_l2") < 1e-10, "{}", run["bodies"][0]["error_l2"]);
    // the load adds its own stresses
    let keys = keys("[1e-5,3e-5,-2e-5]").concat();
    let sets: Vec<&str> = keys.iter().map(String::as_str).collect();
    let [cold, hot] = [&[][..], &sets].map(|sets| solve_here(case("anisotropic-3d"), sets).converged());
    assert!(near(largest(&hot), largest(&cold), 1e-9), "{} {}", largest(&hot), largest(&cold));
}

/// Lame's pressure of a hot plug in a ring, and of a cold ring on a shaft, in plane strain between walls and with free ends.
#[test]
fn plug_and_ring() {
    let (k, strain) = (1e7, 1.2e-3);
    let ends = |k: usize| format!("fix = [{{ on = \"low{k}\", y = 0 }}, {{ on = \"high{k}\", y = 0 }}]");
    let base = |k: usize| format!("fix = [{{ on = \"low{k}\", y = 0 }}]");
    let of = |young: &str, fix: &str, temperature: &str| {
        format!("young = {young}\norder = 6\nexpansion = 1.2e-5\ntemperature = {temperature}\n{fix}\n")
    };
    let contact = "[[contact]]\nbetween = [\"right0\", \"left1\"]\nlayer = { linear = { stiffness = 1e7 } }\n";
    let head = "plane = \"axisymmetric\"";
    let plug = of("2e5\npoisson = 0.3", &ends(0), "\"25 + 75\"");
    let walls = rectangles(head, [&plug, &of("1e5\npoisson = 0.2", &ends(1), "0")], contact);
    let shaft = of("2e5\npoisson = 0.3", &base(0), "0");
    let free = rectangles(head, [&shaft, &of("1e5\npoisson = 0.2", &base(1), "-100")], contact);
    // radial displacements by a unit pressure at r = 1
    let exact_walls = 1.3 * strain / (1.3 * 0.4 / 2e5 + 1.2 / 1e5 * (0.6 + 4.0) / 3.0 + 1.0 / k);
    let exact_free = strain / (0.7 / 2e5 + (0.8 + 1.2 * 4.0) / 3.0 / 1e5 + 1.0 / k);
    for (scene, exact, held) in [(&walls, exact_walls, -893.3438825), (&free, exact_free, 0.0)] {
        for sets in [&[][..], &["solver=mumps"], &["method.name='newton-robin'"]] {
            let run = solve_here(scene, sets).converged();
            assert!(
                near(run.number("pairs/0/mean_pressure"), exact, 1e-6),
                "{} {exact}",
                run["pairs"][0]["mean_pressure"]
            );
            // sigma_z pi r^2 of the plug: nu times the stresses in the plane, less E alpha T
            let end = TAU / 2.0 * (0.3 * -2.0 * exact - 2e5 * strain);
            let support = run.number("bodies/0/balance/supports/0/force/1");
            assert!(if held == 0.0 { support.abs() < 1e-7 } else { near(support, -end, 1e-6) }, "{support} {end}");
            assert!(held == 0.0 || run.number("bodies/0/balance/force_imbalance") < 1e-8);
        }
        let linear = ["--set", "body.body0.order=2", "--set", "body.body1.order=2", "--set", "solver=hypre"];
        let run = solve_on(3, scene, &linear).converged();
        assert!(near(run.number("pairs/0/mean_pressure"), exact, 1e-3), "{} {exact}", run["pairs"][0]["mean_pressure"]);
    }
}

/// A bolt that is tightened and then becomes hot loses alpha T L of its stretch: bolt and sleeve share it by their
/// stiffnesses. Steps of heat assemble and factor nothing.
#[test]
fn a_hot_bolt_loses_its_preload() {
    let scene = Scene::edited(
        "bolt",
        "name = \"column1\" ",
        "expansion = 1e-5\ntemperature = \"50*heat\"\nname = \"column1\" ",
    );
    std::fs::write(scene.path.with_file_name("tighten.csv"), "heat, service\n0, 0\n0.4, 0\n1, 0\n1, 20\n")
        .expect("a table");
    let (bolt, sleeve) = (1.0 / (4.0 / 2e5 + 1.0 / 1e6), 2.0 / (4.0 / 5e4 + 1.0 / 1e6));
    let force = |heat: f64, service: f64| {
        100.0 - 50.0 * heat * 4e-5 * bolt * sleeve / (bolt + sleeve) + 3.0 * service * bolt / (bolt + sleeve)
    };
    for solver in ["mumps", "hypre", "condensed"] {
        let run = solve_here(&scene, &[&format!("solver='{solver}'")]).converged();
        for (step, exact) in
            [force(0.0, 0.0), force(0.4, 0.0), force(1.0, 0.0), force(1.0, 20.0)].into_iter().enumerate()
        {
            let found = -run.number(&format!("steps/{step}/pairs/0/normal_force"));
            assert!(near(found, exact, 1e-4), "{solver} {step}: {found} {exact}");
        }
        assert_eq!(run.count("assemblies"), 4, "{solver}");
        assert!(run.count("factorizations") <= 4, "{solver}: {}", run["factorizations"]);
    }
    // the temperature of a body without factors grows with the loads
    let [half, whole] = ["[0.5, 1]", "[1]"].map(|steps| {
        let sets =
            [&format!("method={{steps={steps}}}")[..], "body.lower.expansion=1e-5", "body.lower.temperature=100"];
        solve_here(case("patch"), &[&sets[..], &["contact.0.layer={linear={stiffness=1e5}}"]].concat()).converged()
    });
    assert!(near(half.number("bodies/0/max_von_mises"), whole.number("bodies/0/max_von_mises"), 1e-9));
    let [first, last] = [0, 1].map(|step| half.number(&format!("steps/{step}/pairs/0/approach")));
    assert!(near(first, 0.5 * last, 1e-9) && last != 0.0, "{first} {last}");
}

/// A strip of two metals bends with Timoshenko's curvature, and its stresses in the file of fields are those of beams, each
/// metal by itself, away from the ends.
#[test]
fn a_strip_of_two_metals() {
    const SCRIPT: &str = "Point(1)={0,0,0}; Point(2)={10,0,0}; Point(3)={10,0.4,0}; Point(4)={0,0.4,0}; Point(5)={10,1,0}; Point(6)={0,1,0};\n\
        Line(1)={1,2}; Line(2)={2,3}; Line(3)={3,4}; Line(4)={4,1}; Line(5)={3,5}; Line(6)={5,6}; Line(7)={6,4};\n\
        Curve Loop(1)={1,2,3,4}; Plane Surface(1)={1}; Curve Loop(2)={-3,5,6,7}; Plane Surface(2)={2};\n\
        Transfinite Curve{1,3,6}=21; Transfinite Curve{2,4,5,7}=2;\n\
        Physical Surface(\"strip\")={1,2}; Physical Surface(\"upper\")={2}; Physical Point(\"pin\")={1}; Physical Point(\"roller\")={4};\n";
    let scene = Scene::new(
        "dimension = 2\nplane = \"stress\"\nmesh = { geo = \"strip.geo\" }\n[[body]]\nname = \"strip\"\nyoung = 2e5\npoisson = 0.3\norder = 4\n\
         expansion = 1.2e-5\ntemperature = 100\nfix = [{ on = \"pin\", x = 0, y = 0 }, { on = \"roller\", x = 0 }]\n\
         [[body.region]]\non = \"upper\"\nyoung = 7e4\npoisson = 0.33\nexpansion = 2.3e-5\n",
    );
    std::fs::write(scene.path.with_file_name("strip.geo"), SCRIPT).expect("a script");
    let run = solve(&scene, &["--vtu"]).converged();
    let grid = Grid::read(&run.folder.join("strip.vtu"));
    // Timoshenko (1925), with the ratios of heights and moduli
    let (m, n) = (0.4 / 0.6, 2e5 / 7e4);
    let parts = 3.0 * (1.0f64 + m).powi(2) + (1.0 + m * n) * (m * m + 1.0 / (m * n));
    let curvature = 6.0 * (1.2e-5 - 2.3e-5) * 100.0 * (1.0 + m).powi(2) / parts;
    let of = |x: [f64; 2], array: &str, width: usize, component: usize| {
        let at = (0..grid.points.len() / 3).filter(|&i| (0..2).all(|c| (grid.points[3 * i + c] - x[c]).abs() < 1e-9));
        at.map(|i| grid.arrays[array][width * i + component]).collect::<Vec<f64>>()
    };
    let [a, b, c] = [4.0, 5.0, 6.0].map(|x| of([x, 0.0], "displacement", 3, 1)[0]);
    assert!(near(a - 2.0 * b + c, curvature, 1e-5), "{} {curvature}", a - 2.0 * b + c);
    // no force and no moment: sigma = E (e - k y - alpha T)
    let layers = [(2e5, 1.2e-3, 0.0, 0.4), (7e4, 2.3e-3, 0.4, 1.0)];
    let sum = |of: &dyn Fn(f64, f64, f64, f64) -> f64| {
        layers.iter().map(|&(young, heat, low, high)| of(young, heat, low, high)).sum::<f64>()
    };
    let area = sum(&|young, _, low, high| young * (high - low));
    let moment = sum(&|young, _, low, high| young * (high * high - low * low) / 2.0);
    let strain = (sum(&|young, heat, low, high| young * heat * (high - low)) + curvature * moment) / area;
    for (young, heat, low, high) in layers {
        for y in [low, high] {
            let exact = young * (strain - curvature * y - heat);
            let found = of([5.0, y], "stress", 6, 0);
            assert!(found.iter().any(|found| near(*found, exact, 1e-4)), "{y}: {found:?} {exact}");
        }
    }
    assert_eq!(of([5.0, 0.4], "stress", 6, 0).len(), 2, "each metal has its own stress where they meet");
}

/// A tube between walls with the temperature 100 r^2, in closed form: the energy error against it, the estimate, and the
/// stress along the tube.
#[test]
fn a_hot_tube() {
    let tube = "young = 2e5\npoisson = 0.3\norder = 2\nexpansion = 1e-5\ntemperature = \"100*x^2\"\n\
        exact = [\"1e-3*1.3/0.7/x*((x^4-1)/4 + (0.4*x^2+1)/3*15/4)\", \"0*x\"]\n\
        fix = [{ on = \"low1\", y = 0 }, { on = \"high1\", y = 0 }]\n";
    let still = "young = 1\npoisson = 0\nfix = [{ on = \"low0\", x = 0, y = 0 }]\n";
    let scene = rectangles("plane = \"axisymmetric\"\nestimate = true", [still, tube], "");
    for (order, most) in [("1", 0.3), ("2", 1e-2), ("4", 1e-3), ("6", 1e-5)] {
        let run = solve_here(&scene, &[&format!("body.body1.order={order}")]).converged();
        let (error, estimate) = (run.number("bodies/1/error_energy"), run.number("discretization_error/energy"));
        assert!(error < most && near(estimate, error, 0.4), "{order}: {error} {estimate}");
        // the integral of nu (sigma_r + sigma_phi) - E alpha T over the section vanishes but for the last part
        let exact = 2e5 * 1e-3 * TAU * 15.0 / 4.0;
        assert!(near(run.number("bodies/1/balance/supports/0/force/1"), exact, most));
    }
    // a uniform temperature between walls: sigma = -E alpha T, and the energy of it
    let bar = |fix: &str| {
        format!(
            "young = 2e5\npoisson = 0.3\nexpansion = 1e-5\ntemperature = 100\nfix = [{{ on = \"low1\", y = 0 }}{fix}]\n"
        )
    };
    let sided = ", { on = \"high1\", y = 0 }, { on = \"left1\", x = 0 }";
    let run = solve_here(rectangles("plane = \"stress\"", [still, &bar(sided)], ""), &[]).converged();
    assert!(near(largest(&run), 200.0, 1e-9) && near(run.number("F1"), 0.5 * 200.0 * 1e-3, 1e-9), "{}", run["F1"]);
    for (from, to, words) in [
        ("100\n", "\"log(x - 1.5)\"\n", "temperature is not a finite number"),
        ("1e-5\n", "\"log(x - 1.5)\"\n", "expansion is not a finite number"),
        ("1e-5\n", "[1e-5, 2e-5]\n", "an expansion has one value or three"),
    ] {
        let scene = rectangles("plane = \"stress\"", [still, &bar("").replacen(from, to, 1)], "");
        let error = try_here(&scene, &[]).err().expect(words).render(false);
        assert!(error.contains(words) && error.contains('^'), "{error}");
    }
}
