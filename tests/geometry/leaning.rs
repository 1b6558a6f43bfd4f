//! Motions that facets resist and smooth surfaces do not: a pin turns and slides in a hub, a ball turns in its socket. A taper holds its plug.

use crate::common::{Report, Scene, here::solve_here};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};

/// A pin of radius 10 in a hub of radius 20 with n facets on the bore and m on the pin, whose circle begins at the angle t. With layers > 0 both are
/// extruded by 10.
const FIT: &str = "SetFactory(\"OpenCASCADE\");
DefineConstant[ n = 16, m = 16, t = 0.1, layers = 0 ];
Disk(1) = {0, 0, 0, 20}; Disk(2) = {0, 0, 0, 10}; BooleanDifference(3) = { Surface{1}; Delete; }{ Surface{2}; Delete; };
Disk(4) = {0, 0, 0, 10}; Rotate {{0, 0, 1}, {0, 0, 0}, t} { Surface{4}; }
MeshSize {:} = 4;
c() = Abs(Boundary{ Surface{3}; }); d() = Abs(Boundary{ Surface{4}; });
b() = BoundingBox Curve{c(0)}; k = (b(3) > 15) ? 0 : 1;
MeshSize { PointsOf { Curve{c(1-k)}; } } = 2*Pi*10/n; MeshSize { PointsOf { Curve{d(0)}; } } = 2*Pi*10/m;
If (layers > 0)
  e() = Extrude {0, 0, 10} { Surface{3}; Layers{layers}; }; f() = Extrude {0, 0, 10} { Surface{4}; Layers{layers}; };
  Physical Volume(\"hub\") = {e(1)}; Physical Volume(\"pin\") = {f(1)}; Physical Surface(\"shank\") = {f(2)};
  For i In {2 : #e()-1}
    q() = BoundingBox Surface{e(i)};
    If (q(3) > 15)
      Physical Surface(\"rim\") = {e(i)};
    Else
      Physical Surface(\"bore\") = {e(i)};
    EndIf
  EndFor
Else
  Physical Surface(\"hub\") = {3}; Physical Surface(\"pin\") = {4};
  Physical Curve(\"rim\") = {c(k)}; Physical Curve(\"bore\") = {c(1-k)}; Physical Curve(\"shank\") = {d(0)};
EndIf
";

/// A plug in a conical hole whose slope is k, with n facets around.
const TAPER: &str = "SetFactory(\"OpenCASCADE\");
DefineConstant[ n = 24, k = 0.05 ];
Cone(1) = {0,0,0, 0,0,20, 10, 10+20*k, 2*Pi}; Cone(2) = {0,0,0, 0,0,20, 10, 10+20*k, 2*Pi}; Cylinder(3) = {0,0,0, 0,0,20, 20, 2*Pi};
BooleanDifference(4) = { Volume{3}; Delete; }{ Volume{2}; Delete; };
Mesh.MeshSizeMin = 2*Pi*10/n; Mesh.MeshSizeMax = 2*Pi*10/n;
Physical Volume(\"pin\") = {1}; Physical Volume(\"hub\") = {4};
Physical Surface(\"shank\") = {1}; Physical Surface(\"top\") = {2}; Physical Surface(\"bore\") = {7}; Physical Surface(\"rim\") = {6};
";

/// A scene of a pin in a hub that is held at its rim.
fn fit(dimension: usize, script: &str, pin: &str, gap: f64) -> Scene {
    let held = ["x = 0, y = 0", "x = 0, y = 0, z = 0"][dimension - 2];
    let scene = Scene::new(format!(
        "dimension = {dimension}\nmesh = {{ geo = \"fit.geo\" }}
[[body]]\nname = \"hub\"\norder = 1\nyoung = 7e4\npoisson = 0.3\nfix = [{{ on = \"rim\", {held} }}]
[[body]]\nname = \"pin\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\n{pin}
[[contact]]\nbetween = [\"bore\", \"shank\"]\ntouching = true\ngap = {gap}\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n"
    ));
    std::fs::write(scene.path.with_file_name("fit.geo"), script).expect("a script");
    scene
}

/// Solve a scene with numbers for its mesh and with elements of this order.
fn at(scene: &Scene, order: usize, numbers: &[(&str, f64)]) -> Report {
    let orders = ["hub", "pin"].map(|body| format!("body.{body}.order={order}"));
    let set: Vec<String> =
        numbers.iter().map(|(name, value)| format!("mesh.set.{name}={value}")).chain(orders).collect();
    solve_here(scene, &set.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The peak pressure of the only pair.
fn peak(run: &Report) -> f64 {
    run.contact()["pressure"].iter().copied().fold(0.0, f64::max)
}

/// The loads work on this motion, which nothing holds.
fn refused(run: &Report, motion: &str) {
    let message = run.text("message");
    let named = format!("body `pin`: neither a support nor a spring nor contact holds its {motion}");
    assert!(run.text("status") == "underconstrained" && message.starts_with(&named), "{message}\n{}", run.warnings());
}

/// Whatever circles of facets lie in each other: the pressure is that of Lame with the layer, all around.
#[test]
fn press_fits_have_the_pressure_of_lame() {
    let scene = fit(2, FIT, "", -0.01);
    let (counts, orders) = (20u32..36, prop::sample::select(vec![1usize, 2, 3, 4, 6]));
    let fits = (counts.clone(), counts, any::<bool>(), 0.0..0.4, orders);
    let config = Config { cases: 12, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() };
    TestRunner::new(config)
        .run(&fits, |(n, m, is_equal, t, order)| {
            let m = if is_equal { n } else { m };
            let run = at(&scene, order, &[("n", n.into()), ("m", m.into()), ("t", t)]).converged();
            let (off, allowed) = (peak(&run) / 89.71 - 1.0, if order == 1 { 0.05 } else { 0.02 });
            prop_assert!(off.abs() < allowed, "{n} {m} {t} order {order}: {off}\n{}", run.warnings());
            prop_assert!(run.warnings().contains("nothing holds its rotation, and no load works on it"));
            Ok(())
        })
        .expect("every fit");
}

/// A force beside no support turns the pin, or slides it, at every order and however small it is.
#[test]
fn a_fit_carries_neither_torque_nor_axial_force() {
    let torque = |size: f64| format!("force = [\"-y*{size}\", \"x*{size}\"]");
    for (order, size) in [(1, 1e-3), (2, 1e-3), (4, 1e-3), (4, 1e-6)] {
        refused(&at(&fit(2, FIT, &torque(size), -0.01), order, &[("n", 24.0), ("m", 24.0)]), "rotation");
    }
    let numbers = [("layers", 2.0), ("t", 0.1)];
    refused(&at(&fit(3, FIT, "force = [0, 0, 0.1]", -0.01), 1, &numbers), "translation along z");
    refused(&at(&fit(3, FIT, "force = [\"-y*1e-3\", \"x*1e-3\", 0]", -0.01), 1, &numbers), "rotation about z");
    let free = at(&fit(3, FIT, "", -0.01), 1, &numbers).converged();
    assert!((peak(&free) / 81.0 - 1.0).abs() < 0.15, "{}\n{}", peak(&free), free.warnings());
    assert!(
        free.warnings().contains("nothing holds its translation along z and rotation about z"),
        "{}",
        free.warnings()
    );
}

/// A pin with clearance is pressed to one side of its hole: the peak is that of matching circles.
#[test]
fn a_pin_with_clearance_finds_its_hole() {
    let scene = fit(2, FIT, "force = [0, -9.549296585513721]", 0.02);
    for order in [1, 4] {
        let run = at(&scene, order, &[("n", 48.0), ("m", 48.0)]).converged();
        assert!((peak(&run) / 223.2 - 1.0).abs() < 0.01, "order {order}: {}\n{}", peak(&run), run.warnings());
    }
}

/// The slope of a taper holds the plug: at 1:20 with facets of order 1, at 1:100 from order 2 on.
#[test]
fn a_taper_holds_its_plug() {
    let scene = fit(3, TAPER, "load = [{ on = \"top\", force = [0, 0, -1000] }]", 0.0);
    for slope in [0.05, 0.11] {
        let run = at(&scene, 1, &[("k", slope)]).converged();
        let sum = |name: &str| -> f64 {
            let contact = run.contact();
            contact["weight"].iter().zip(&contact[name]).map(|(area, value)| area * value).sum()
        };
        // the mean pressure times the area, turned by the slope, is the force
        let axial = sum("pressure") * slope / slope.hypot(1.0);
        assert!((axial / 1000.0 - 1.0).abs() < 0.1, "{slope}: {axial}\n{}", run.warnings());
        assert!(run.warnings().contains("nothing holds its rotation about z"), "{}", run.warnings());
    }
    let unclear = at(&scene, 1, &[("k", 0.01)]);
    refused(&unclear, "translation along z");
    assert!(unclear.text("message").contains("take a higher order or a finer mesh"), "{}", unclear.text("message"));
}
