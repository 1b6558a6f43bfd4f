//! What a contact surface holds against a fluid: rings with a known ridge of pressure, in space, and lines in the plane and of
//! revolution.

use crate::common::here::{solve_here, try_here};
use crate::common::{Report, Scene, root, solve, solve_on};
use std::fs;

/// A ring of the radii 1 and 2 with a circle of element edges between, or the half of it above y = 0.
const RING: &str = "DefineConstant[ arcs = {4, Name \"arcs\"} ];\nPoint(100) = {0, 0, 0, 0.2}; last = arcs == 4 ? 3 : 2;\n\
    For k In {0:2}\n r = 1 + 0.5*k;\n For j In {0:last}\n  Point(10*k + j + 1) = {r*Cos(j*Pi/2), r*Sin(j*Pi/2), 0, 0.2};\n EndFor\n\
    For j In {0:arcs - 1}\n  Circle(10*k + j + 1) = {10*k + j + 1, 100, 10*k + (j + 1)%4 + 1};\n EndFor\nEndFor\n\
    If(arcs == 4)\n For k In {0:2}\n  Curve Loop(k + 1) = {10*k + 1, 10*k + 2, 10*k + 3, 10*k + 4};\n EndFor\n\
     Plane Surface(1) = {2, 1}; Plane Surface(2) = {3, 2};\nElse\n\
     For k In {0:1}\n  Line(50 + k) = {10*k + 1, 10*k + 11}; Line(60 + k) = {10*k + 3, 10*k + 13};\n\
      Curve Loop(k + 1) = {50 + k, 10*k + 11, 10*k + 12, -(60 + k), -(10*k + 2), -(10*k + 1)}; Plane Surface(k + 1) = {k + 1};\n EndFor\nEndIf\n\
    Extrude {0, 0, 0.3} { Surface{1, 2}; Layers{1}; }\n\
    e = 1e-3; h = 0.3; all() = Volume{:}; Physical Volume(\"ring\") = {all()};\n\
    top() = Surface In BoundingBox {-3, -3, h - e, 3, 3, h + e}; Physical Surface(\"top\") = {top()};\n\
    bottom() = Surface In BoundingBox {-3, -3, -e, 3, 3, e}; Physical Surface(\"bottom\") = {bottom()};\n\
    bore() = Surface In BoundingBox {-1 - e, -1 - e, -e, 1 + e, 1 + e, h + e}; Physical Surface(\"bore\") = {bore()};\n\
    inside() = Surface In BoundingBox {-1.5 - e, -1.5 - e, -e, 1.5 + e, 1.5 + e, h + e};\n\
    cut() = Surface In BoundingBox {-3, -e, -e, 3, e, h + e};\n\
    outside() = Surface{:}; outside() -= {top(), bottom(), inside(), cut()}; Physical Surface(\"outside\") = {outside()};\n\
    Physical Surface(\"walls\") = {bore(), outside()};\n\
    rim() = Curve In BoundingBox {-1 - e, -1 - e, h - e, 1 + e, 1 + e, h + e}; Physical Curve(\"inner_rim\") = {rim()};\n\
    outer() = Curve In BoundingBox {-3, -3, h - e, 3, 3, h + e}; between() = Curve In BoundingBox {-1.5 - e, -1.5 - e, h - e, 1.5 + e, 1.5 + e, h + e};\n\
    outer() -= {between()}; Physical Curve(\"outer_rim\") = {outer()};\n";

/// A ring that is so stiff beside its layer that the pressure is q = 2 + x/r - 8 (r - 3/2)^2, where that is positive. On
/// each way from the bore to the outside it is 1 somewhere, since q is 2 + x/r on the circle of edges; at (-3/2, 0) it is
/// 1 at most.
fn ring() -> Scene {
    let scene = Scene::new(
        "dimension = 3\nmesh = { geo = \"ring.geo\" }\n[[body]]\nname = \"ring\"\nyoung = 1e10\npoisson = 0\norder = 1\n\
         fix = [{ on = \"bottom\", x = 0, y = 0, z = 0 }]\n[[contact]]\non = \"top\"\nobstacle = true\napproach = 3e-3\n\
         gap = \"1e-3*(1 - x/sqrt(x^2 + y^2) + 8*(sqrt(x^2 + y^2) - 1.5)^2)\"\nlayer = { linear = { stiffness = 1e3 } }\n\
         seal = [\"bore\", \"outside\"]\n",
    );
    fs::write(scene.path.with_file_name("ring.geo"), RING).expect("a script");
    scene
}

/// Check the weakest point of the ring; it is one of the circle of edges up to this tolerance.
fn check(run: &Report, tolerance: f64) {
    let pressure = run.number("pairs/0/sealing_pressure");
    assert!((pressure - 1.0).abs() < tolerance, "{pressure}");
    let off: Vec<f64> = (0..3).map(|c| run.number(&format!("pairs/0/sealing_at/{c}")) - [-1.5, 0.0, 0.3][c]).collect();
    assert!(off.iter().all(|off| off.abs() < tolerance), "{off:?}");
}

/// The least over all ways of the largest pressure: whole, cut by a plane of symmetry, on three ranks, between curves, in the
/// tables of a run with load steps, and of pressures at mid-edges.
#[test]
fn the_ridge_of_a_ring() {
    let run = solve(ring(), &["--set", "method.steps=2"]).converged();
    check(&run, 1e-6);
    let held = |step: usize| run.number(&format!("steps/{step}/pairs/0/sealing_pressure"));
    assert!(held(0) == 0.0 && (held(1) - 1.0).abs() < 1e-6);
    let text = |file: &str| fs::read_to_string(run.folder.join(file)).expect("a table");
    assert!(text("contacts.csv").contains(",sealing_pressure,sealing_x,sealing_y,sealing_z\n"));
    assert!(text("steps.csv").contains(",sealing_pressure ring-obstacle,sealing_x ring-obstacle,"));
    assert!(run.stdout.contains(", sealing pressure 1.000000 at (-1.5"), "{}", run.said());
    check(&solve_on(3, ring(), &[]).converged(), 1e-6);
    check(&solve_here(ring(), &["mesh.set.arcs=2"]).converged(), 1e-6);
    check(&solve_here(ring(), &["contact.0.seal=['outer_rim', 'inner_rim']"]).converged(), 1e-6);
    // pressures at vertices are those that the mid-edges around make, and the next one is 0.1 away
    check(&solve_here(ring(), &["body.ring.order=2", "mesh.set.arcs=2"]).converged(), 0.15);
    // with the ridge open at x = -3/2 nothing is held, though most of it is closed
    let open = solve_here(ring(), &["contact.0.approach=1.9e-3"]).converged();
    assert!(open.number("pairs/0/sealing_pressure") == 0.0 && open.number("pairs/0/peak_pressure") > 1.0);
}

/// Two blocks, or two discs, on each other.
fn blocks(plane: &str) -> Scene {
    let body = |name: &str, fix: &str| {
        format!("[[body]]\nname = \"{name}\"\nyoung = 2.1e5\npoisson = 0.3\nfix = [{{ on = \"{name}_{fix} }}]\n")
    };
    Scene::new(format!(
        "dimension = 2\n{plane}mesh = {{ geo = \"{}\", set = {{ rows = 2, n1 = 9, n2 = 6 }} }}\n{}{}[[contact]]\n\
         between = [\"b1_top\", \"b2_bottom\"]\ngap = \"1e-4*(x - 0.3)^2\"\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\nseal = [\"b1_left\", \"b1_right\"]\n",
        root().join("meshes/stack/stack.geo").display(),
        body("b1", "bottom\", x = 0, y = 0"),
        body("b2", "top\", x = 0, y = -1e-4")
    ))
}

/// A line has one way, on which the largest pressure holds. The body of the named groups carries the points.
#[test]
fn the_way_along_a_line() {
    for plane in ["", "plane = \"axisymmetric\"\n"] {
        for (seal, carrier, order) in [
            ("['b1_left', 'b1_right']", "b1_top", 1),
            ("['b2_right', 'b2_left']", "b2_bottom", 1),
            ("['b1_pin', 'b1_right']", "b1_top", 4),
        ] {
            let order = ["b1", "b2"].map(|body| format!("body.{body}.order={order}"));
            let run = solve_here(blocks(plane), &[&format!("contact.0.seal={seal}"), &order[0], &order[1]]).converged();
            assert_eq!(run.text("pairs/0/carrier"), carrier);
            let [held, peak] = ["sealing", "peak"].map(|what| run.number(&format!("pairs/0/{what}_pressure")));
            // the points of files are not the nodes of higher orders
            let tolerance = if seal.contains("pin") { 0.02 } else { 1e-12 };
            assert!(peak > 0.0 && (held / peak - 1.0).abs() < tolerance, "{plane} {seal}: {held} {peak}");
        }
    }
}

#[test]
fn seals_that_cannot_be() {
    let auto = "contact.0={between='auto',distance=0.1,layer={linear={stiffness=1}},seal=['b1_left','b1_right']}";
    for (scene, set, words) in [
        (blocks(""), "contact.0.seal=['b1_left','b1_left']", "a seal between `b1_left` and itself"),
        (blocks(""), "contact.0.seal=['b1_left']", "a seal is between two groups"),
        (blocks(""), "contact.0.seal=['b1_left','b1_rihgt']", "the mesh has no group `b1_rihgt` for this seal"),
        (
            blocks(""),
            "contact.0.seal=['b1_bottom','b1_left']",
            "`b1_bottom` does not touch the contact surface `b1_top` or `b2_bottom`",
        ),
        (
            blocks(""),
            "contact.0.seal=['b1_left','b2_right']",
            "`b1_left` and `b2_right` are at surfaces of different bodies",
        ),
        (
            blocks(""),
            "contact.0.seal=['b1_left','b1_pin']",
            "`b1_left` and `b1_pin` meet the contact surface `b1_top` at the same place",
        ),
        (blocks(""), auto, "`seal` for pairs that are found"),
        (
            ring(),
            "contact.0={on='walls',obstacle=true,gap=1,layer={linear={stiffness=1}},seal=['inner_rim','outer_rim']}",
            "no way along the contact surface `walls`",
        ),
        (ring(), "contact.0.seal=['bore','bottom']", "`bottom` does not touch the contact surface `top`"),
    ] {
        let error = try_here(&scene, &[set]).err().expect(words).render(false);
        assert!(error.contains(words), "{error}");
    }
}
