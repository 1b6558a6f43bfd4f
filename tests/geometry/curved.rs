//! Contact of curved surfaces that become steep: a punch with rounded edges, a cone, a ball in a socket, flanks of gears.

use crate::common::here::solve_here;
use crate::common::vtu::Grid;
use crate::common::{Report, Scene, case, root, solve, winkler};
use std::fs;

const PUNCH: usize = 1;
const CONE: usize = 2;
const BALL: usize = 3;
const FLANKS: usize = 4;

/// E/(1 - nu^2) of a body with E = 1000.
const MODULUS: f64 = 1000.0 / 0.91;

/// A pair of `curved/curved.geo`: the upper body is pressed down by `pressure` on its top. Punch and cone are rigid.
fn scene(shape: usize, order: usize, pressure: f64, stiffness: f64) -> Scene {
    let plane = if matches!(shape, CONE | BALL) { "axisymmetric" } else { "strain" };
    let young = if matches!(shape, PUNCH | CONE) { 1e6 } else { 1e3 };
    let geo = root().join("tests/geometry/shapes/curved.geo");
    Scene::new(format!(
        "dimension = 2\nplane = \"{plane}\"\nmesh = {{ geo = \"{}\", set = {{ shape = {shape}, n = 8, m = 0 }} }}\n\
         [[body]]\nname = \"upper\"\nyoung = {young}\npoisson = 0.3\norder = {order}\n\
         fix = [{{ on = \"upper_axis\", symmetry = true }}]\nload = [{{ on = \"upper_top\", pressure = {pressure} }}]\n\
         [[body]]\nname = \"lower\"\nyoung = 1000\npoisson = 0.3\norder = {order}\n\
         fix = [{{ on = \"lower_axis\", symmetry = true }}, {{ on = \"lower_base\", x = 0, y = 0 }}]\n\
         [[contact]]\nbetween = [\"upper_face\", \"lower_face\"]\nlayer = {{ linear = {{ stiffness = {stiffness} }} }}\n\
         [output]\nvtu = false\nplots = false\n",
        geo.display()
    ))
}

/// Solves it with `n` elements a radius on the upper surface and `m` on the lower one.
fn run(scene: &Scene, n: usize, m: usize) -> Report {
    solve_here(scene, &[&format!("mesh.set.n={n}"), &format!("mesh.set.m={m}")]).converged()
}

fn range(values: &[f64]) -> [f64; 2] {
    [values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max)]
}

/// Half-width at which a rigid punch with flat half-width 1 and edges of radius 1 touches a half-plane (Schubert 1942; Ciavarella,
/// Hills and Monno 1998): 2 P/E* = (pi - 2 phi)/(2 sin^2 phi) - cot phi, sin phi = 1/a.
fn punch_width(force: f64) -> f64 {
    let excess = |a: f64| {
        let phi = (1.0 / a).asin();
        (std::f64::consts::PI - 2.0 * phi) / (2.0 * phi.sin().powi(2)) - 1.0 / phi.tan() - 2.0 * force / MODULUS
    };
    let (mut low, mut high) = (1.0 + 1e-12, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    low
}

/// P1 and P2 come to the same end of the contact and, but for the tip of the cone, to the same peak, with either surface as the
/// finer one: the closed form of punch and cone (Sneddon: F = pi/2 E* a^2 cot alpha), else those of quadratic elements of a
/// quarter of the size. On chords of eight elements a radius a pressure wavers by up to a third, or by 0.43 where the other surface is three times as
/// fine; beside an axis a point of small weight is off by more than the others.
#[test]
fn linear_and_quadratic_elements_agree() {
    for (shape, pressure, exact) in [
        (PUNCH, 40.0, Some(punch_width(160.0))),
        (CONE, 14.0, Some((28.0 / (MODULUS * 0.1)).sqrt())),
        (BALL, 60.0, None),
        (FLANKS, 20.0, None),
    ] {
        let end = |run: &Report| run.number("pairs/0/contact_ends/0/0");
        let scenes = [1, 2].map(|order| scene(shape, order, pressure, 1e6));
        let fine = run(&scenes[1], 32, 32);
        let (width, peak) = (exact.unwrap_or(end(&fine)), fine.number("pairs/0/peak_pressure"));
        for (n, m) in [(8, 8), (16, 16), (8, 24)] {
            for (order, scene) in [1, 2].into_iter().zip(&scenes) {
                let run = run(scene, n, m);
                let h = 1.0 / n as f64;
                let what = format!("shape {shape}, P{order}, {n} and {m} elements");
                assert!((end(&run) - width).abs() < 0.6 * h, "{what}: contact ends at {}, not {width}", end(&run));
                let off = run.number("pairs/0/peak_pressure") / peak - 1.0;
                let most = if order == 1 { 3.5 } else { 1.4 };
                assert!(shape == CONE || off.abs() < most * h, "{what}: the peak is off by {off}");
            }
        }
    }
}

/// Gaps are those of the geometry and displacements those of the surfaces, on both sides, whichever carries the points: the edge
/// ends vertical, where normals of the punch are parallel to the block.
#[test]
fn gaps_and_displacements_of_a_rounded_punch() {
    for order in [1, 2] {
        let scene = scene(PUNCH, order, 40.0, 1e6);
        for (n, m) in [(4, 2), (5, 5), (7, 3), (8, 8), (8, 5), (8, 13), (8, 32), (11, 17)] {
            let run = run(&scene, n, m);
            let what = format!("P{order}, {n} and {m} elements");
            let table = run.contact();
            for (x, gap) in table["x"].iter().zip(&table["gap"]) {
                let over = (x - 1.0).max(0.0);
                let cosine = (1.0 - over * over).max(0.0).sqrt();
                // along the normals of the plane block, which counts as the less curved surface on either side
                let (exact, slope) = (1.0 - cosine, over / cosine);
                let h = 1.0 / n.min(m) as f64;
                assert!(
                    (gap - exact).abs() < 0.15 * h * slope + 0.15 * h * h,
                    "{what}: gap {gap} at x = {x}, not {exact}"
                );
            }
            // the punch comes down as a whole, and its normals are turned by up to 60 degrees and half a facet
            let [least, most] = range(&table["u_n_upper"]);
            assert!(least > 0.3 * most, "{what}: the punch moves by {least} to {most}");
            let [least, most] = range(&table["u_n_lower"]);
            assert!(most < 0.0 && least > -0.25, "{what}: the block moves by {least} to {most}");
        }
    }
}

/// Facets that stand too steeply are counted and drawn; the key `angle` admits them.
#[test]
fn steep_facets_are_told() {
    let scene = scene(PUNCH, 2, 40.0, 1e6);
    // as soft as the block, so that the finer surface of the punch carries the points
    let soft = ["--set", "body.upper.young=1000"];
    let run = solve(&scene, &[&soft[..], &["--set", "output.vtu=true", "--set", "mesh.set.m=5"]].concat()).converged();
    let steep = run.count("pairs/0/facets_uncovered");
    // contact does not reach them: `check` alone counts them
    assert!(steep >= 2 && !run.warnings().contains("have no partner"), "{steep}: {}", run.warnings());
    let checked =
        winkler(&[&["check", scene.path.to_str().expect("a path")], &soft[..], &["--set", "mesh.set.m=5"]].concat());
    assert!(checked.stdout.contains(" facets without a partner"), "{}", checked.said());
    let narrow = solve(&scene, &[&soft[..], &["--set", "contact.0.angle=5", "--set", "mesh.set.m=5"]].concat());
    let expected = " of `upper_face` have no partner within `angle` = 5, and there is pressure beside them";
    assert!(narrow.warnings().contains(expected), "{}", narrow.warnings());
    let surface = Grid::read(&run.folder.join("contact-upper-lower.vtu"));
    assert_eq!(surface.arrays["cover"].iter().filter(|&&share| share == 0.0).count(), steep);

    let wide = solve(&scene, &[&soft[..], &["--set", "contact.0.angle=90"]].concat()).converged();
    assert!(wide.count("pairs/0/facets_uncovered") < steep, "{}", wide.warnings());
    let refused = solve(&scene, &["--set", "contact.0.angle=91"]);
    assert!(refused.code == 3 && refused.stderr.contains("must be at most 90"), "{}", refused.said());
}

/// An adapted run reaches the error that it was asked for: estimates see no pressure where a gap grows fast between two points, and
/// the mesher finds the sizes wanted on the round edge.
#[test]
fn an_adapted_run_reaches_its_tolerance() {
    let text = scene(PUNCH, 2, 40.0, 1e6).text.replace("young = 1000000", "young = 1000");
    let run = solve(Scene::new(text), &["--tolerance", "1e-3"]).converged();
    let rounds = run.report["rounds"].as_array().expect("rounds");
    let error = |round: &serde_json::Value| round["pressure"].as_f64().expect("an error");
    assert!(error(&rounds[rounds.len() - 1]) < 1e-3 && rounds.len() <= 8, "{rounds:?}");
    assert!(rounds.iter().all(|round| error(round) < 2.0), "{rounds:?}");
}

/// Quadratic facets with curved edges in a plane, beside facets of another size: all of the plate with the hole is covered, and carries the pressure on it.
#[test]
fn a_plane_face_with_a_hole_is_covered() {
    let geo = root().join("tests/geometry/shapes/hole.geo");
    let scene = Scene::new(format!(
        "dimension = 3\nmesh = {{ geo = \"{}\" }}\n\
         [[body]]\nname = \"foot\"\nyoung = 2.1e5\npoisson = 0.3\norder = 2\n\
         fix = [{{ on = \"foot_top\", x = 0, y = 0 }}]\nload = [{{ on = \"foot_top\", pressure = 10 }}]\n\
         [[body]]\nname = \"plate\"\nyoung = 2.1e5\npoisson = 0.3\norder = 2\n\
         fix = [{{ on = \"plate_bottom\", x = 0, y = 0, z = 0 }}]\n\
         [[contact]]\nbetween = [\"foot_bottom\", \"plate_top\"]\ntouching = true\n\
         layer = {{ linear = {{ stiffness = 1e5 }} }}\n[output]\nvtu = false\nplots = false\n",
        geo.display()
    ));
    let run = solve(&scene, &[]).converged();
    assert_eq!((run.count("pairs/0/pieces_lost"), run.count("pairs/0/facets_uncovered")), (0, 0), "{}", run.warnings());
    let table = run.contact();
    let area: f64 = (0..table.rows()).map(|q| table["weight"][q]).sum();
    // twelve chords of parabolas on the circle of the hole
    let exact = 144.0 - 9.0 * std::f64::consts::PI;
    assert!((area / exact - 1.0).abs() < 2e-3, "{area} {exact}");
}

/// A bolt with a head on a plate: the shank is thinner than the hole, so that a part of the flat head lies before nothing. This part is left out, and
/// nothing of it is lost.
const BOLT: &str = "SetFactory(\"OpenCASCADE\"); e = 1e-6;
Box(1) = {-2,-2,-1, 4,4,1}; Cylinder(2) = {0,0,-1, 0,0,1, 0.6}; BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(4) = {0,0,0, 0,0,0.5, 1}; Cylinder(5) = {0,0,-0.8, 0,0,0.8, 0.5}; BooleanUnion(6) = { Volume{4}; Delete; }{ Volume{5}; Delete; };
Physical Volume(\"plate\") = {3}; Physical Volume(\"bolt\") = {6};
b() = Boundary{ Volume{6}; }; p() = Boundary{ Volume{3}; }; Physical Surface(\"bolt_skin\") = {b()}; Physical Surface(\"plate_skin\") = {p()};
Physical Surface(\"floor\") = Surface In BoundingBox{-2-e,-2-e,-1-e,2+e,2+e,-1+e};
Physical Surface(\"crown\") = Surface In BoundingBox{-1-e,-1-e,0.5-e,1+e,1+e,0.5+e};
MeshSize{:} = 0.4;
";

#[test]
fn facets_before_a_hole_lose_nothing() {
    for order in [1, 2] {
        let body = |name: &str, rest: &str| {
            format!("[[body]]\nname = \"{name}\"\nyoung = 2e5\npoisson = 0.3\norder = {order}\n{rest}\n")
        };
        let text = format!(
            "dimension = 3\nmesh = \"bolt.geo\"\n{}{}[[contact]]\nbetween = \"auto\"\ndistance = 0.05\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n",
            body("plate", "fix = [{ on = \"floor\", x = 0, y = 0, z = 0 }]"),
            body("bolt", "fix = [{ on = \"crown\", x = 0, y = 0 }]\nload = [{ on = \"crown\", force = [0, 0, -100] }]")
        );
        for contact in ["", "contact.0.between=[\"bolt_skin\", \"plate_skin\"]"] {
            let scene = Scene::new(text.clone());
            fs::write(scene.path.with_file_name("bolt.geo"), BOLT).expect("a script");
            let sets: Vec<&str> = ["--set", contact].into_iter().filter(|_| !contact.is_empty()).collect();
            let run = solve(&scene, &sets).converged();
            assert_eq!(run.count("pairs/0/pieces_lost"), 0, "order {order}, {contact}: {}", run.warnings());
            assert!((run.forces(0)[0][2].abs() - 100.0).abs() < 1e-6, "order {order}, {contact}: {}", run.said());
        }
    }
}

/// A wave of the mesh and one of the gap before a flat mesh give the same pressures with elements of high order, whose
/// edges have their order.
#[test]
fn a_wave_of_the_mesh_is_one_of_the_gap() {
    let pressures = |order: usize, sets: &[&str]| {
        let orders = [0, 1].map(|body| format!("body.{body}.order={order}"));
        let all: Vec<&str> =
            orders.iter().map(String::as_str).chain(["mesh.set.n=4"]).chain(sets.iter().copied()).collect();
        let table = solve_here(case("westergaard"), &all).converged().contact();
        ["x", "weight", "pressure"].map(|column| table[column].to_vec())
    };
    for order in [3, 4, 6] {
        let [x, weight, wavy] = pressures(order, &[]);
        let [at, _, flat] = pressures(order, &["mesh.set.D=0", "contact.0.gap=\"1e-4 * (1 - cos(pi * x))\""]);
        let mean =
            |value: &dyn Fn(usize) -> f64| (0..x.len()).map(|q| weight[q] * value(q).powi(2)).sum::<f64>().sqrt();
        let error = mean(&|q| wavy[q] - flat[q]) / mean(&|q| flat[q]);
        assert!(x.len() == at.len() && x.iter().zip(&at).all(|(x, at)| (x - at).abs() < 1e-3), "{x:?} {at:?}");
        assert!(error < 5e-4, "order {order}: {error}");
    }
}
