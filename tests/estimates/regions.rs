//! Stresses and estimated errors where the material of a body jumps.

use crate::common::here::with_session;
use crate::common::{Run, Scene, solve};
use winkler::api;

/// A body whose upper part is a region, below a block. The interface is level, or upright through the contact.
const LAYERS: &str = "DefineConstant[ h = 0.25, upright = 0 ];
Point(1)={0,0,0,h}; Point(2)={2,0,0,h}; Point(3)={2,1,0,h}; Point(4)={0,1,0,h};
If (upright)
  Point(5)={1,0,0,h}; Point(6)={1,1,0,h};
  Line(1)={1,5}; Line(2)={5,2}; Line(3)={2,3}; Line(4)={3,6}; Line(5)={6,4}; Line(6)={4,1}; Line(7)={5,6};
  Curve Loop(1)={1,7,5,6}; Curve Loop(2)={2,3,4,-7};
  Physical Curve(\"lo_bottom\")={1,2}; Physical Curve(\"lo_top\")={4,5}; Physical Curve(\"lo_left\")={6}; Physical Curve(\"lo_right\")={3};
Else
  Point(5)={0,0.6,0,h}; Point(6)={2,0.6,0,h};
  Line(1)={1,2}; Line(2)={2,6}; Line(3)={6,3}; Line(4)={3,4}; Line(5)={4,5}; Line(6)={5,1}; Line(7)={5,6};
  Curve Loop(2)={1,2,-7,6}; Curve Loop(1)={7,3,4,5};
  Physical Curve(\"lo_bottom\")={1}; Physical Curve(\"lo_top\")={4}; Physical Curve(\"lo_left\")={5,6}; Physical Curve(\"lo_right\")={2,3};
EndIf
Plane Surface(1)={1}; Plane Surface(2)={2};
Point(11)={0,1,0,h}; Point(12)={2,1,0,h}; Point(13)={2,2,0,h}; Point(14)={0,2,0,h};
Line(11)={11,12}; Line(12)={12,13}; Line(13)={13,14}; Line(14)={14,11}; Curve Loop(3)={11:14}; Plane Surface(3)={3};
Physical Surface(\"lo\")={1,2}; Physical Surface(\"stiff\")={1}; Physical Surface(\"up\")={3};
Physical Curve(\"up_bottom\")={11}; Physical Curve(\"up_left\")={14}; Physical Curve(\"up_right\")={12}; Physical Curve(\"up_top\")={13};
";

/// The scene of these bodies under a pressure, in elements of an order. `elasticity` are the lines of the lower body's material.
fn layers(order: usize, elasticity: &str, pressure: &str) -> Scene {
    let body = |name: &str, material: &str, more: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = {order}\n{material}\nfix = [{{ on = \"{name}_left\", x = 0 }}, {{ on = \"{name}_right\", x = 0 }}{more}\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 2\nestimate = true\nmesh = {{ geo = \"layers.geo\", set = {{ h = 0.25, upright = 0 }} }}\n{}{}{}\n[[contact]]\nbetween = [\"lo_top\", \"up_bottom\"]\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n",
        body(
            "up",
            "young = 1000\npoisson = 0.3",
            &format!("]\nload = [{{ on = \"up_top\", pressure = \"{pressure}\" }}]")
        ),
        body("lo", elasticity.split_once("[[").map_or(elasticity, |(own, _)| own), ", { on = \"lo_bottom\", y = 0 }]"),
        elasticity.split_once("[[").map_or(String::new(), |(_, region)| format!("[[{region}")),
    ));
    std::fs::write(scene.path.with_file_name("layers.geo"), LAYERS).expect("a script");
    scene
}

const REGION: &str = "young = 200\npoisson = 0.3\n[[body.region]]\non = \"stiff\"\nyoung = 20000\npoisson = 0.3";

/// Uniaxial strain of two layers is in the space of the elements, whether they are regions or one expression with a jump. So no error is told.
#[test]
fn layers_of_two_materials_have_no_error() {
    let expression = "young = \"200 + 19800*(0.5 + 0.5*tanh(1e6*(y - 0.6)))\"\npoisson = 0.3";
    for order in [1, 2] {
        for material in [REGION, expression] {
            let run = solve(layers(order, material, "1"), &[]).converged();
            for error in ["energy", "displacement", "pressure/0"] {
                let error = run.number(&format!("discretization_error/{error}"));
                assert!(error < 1e-9, "order {order}: {error}, {}", run.said());
            }
        }
    }
}

/// Where an interface ends in the contact, the told errors of pressures and displacements are those of a finer mesh within the factors that hold for
/// parts of one material.
#[test]
fn an_interface_that_ends_in_the_contact_has_its_error() {
    let at = |order: usize, h: f64| -> Run {
        let sets = [format!("mesh.set.h={h}"), "mesh.set.upright=1".to_owned()];
        let args: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        solve(layers(order, REGION, "1 + cos(pi*x)"), &args).converged()
    };
    let exact = at(2, 0.015).contact();
    for (order, h) in [(1, 0.25), (1, 0.125), (2, 0.25), (2, 0.125)] {
        let run = at(order, h);
        let (own, [mut error, mut whole]) = (run.contact(), [0.0; 2]);
        for q in 0..own.rows() {
            let near = |r: &usize| (exact["x"][*r] - own["x"][q]).abs();
            let nearest = (0..exact.rows()).min_by(|r, s| near(r).total_cmp(&near(s))).expect("a point");
            error += own["weight"][q] * (own["pressure"][q] - exact["pressure"][nearest]).powi(2);
            whole += own["weight"][q] * own["pressure"][q].powi(2);
        }
        let (told, true_error) = (run.number("discretization_error/pressure/0"), f64::sqrt(error / whole));
        assert!((0.5..3.0).contains(&(told / true_error)), "order {order}, h {h}: {told:e} {true_error:e}");
    }
}

/// Two blocks under a layer that is five times as stiff beyond a place: at a node, or within a facet.
const BLOCKS: &str = "DefineConstant[ n = 8 ];
Macro Quad
  Point(b+1)={0,y,0}; Point(b+2)={2,y,0}; Point(b+3)={2,y+1,0}; Point(b+4)={0,y+1,0};
  For i In {1:4}
    Line(b+i)={b+i,b+(i%4)+1};
  EndFor
  Curve Loop(b)={b+1,b+2,b+3,b+4}; Plane Surface(b)={b}; Transfinite Curve{b+1,b+3}=n+1; Transfinite Curve{b+2,b+4}=n/2+1; Transfinite Surface{b};
Return
b=10; y=-1; Call Quad;
b=20; y=0; Call Quad;
Physical Surface(\"lower\")={10}; Physical Surface(\"upper\")={20}; Physical Curve(\"floor\")={11}; Physical Curve(\"top\")={23};
Physical Curve(\"low\")={13}; Physical Curve(\"up\")={21}; Physical Curve(\"low_ends\")={12,14}; Physical Curve(\"up_ends\")={22,24};
";

/// The told error of the pressures is that of a finer mesh, or more: no function on a facet follows a jump.
#[test]
fn a_layer_that_jumps_has_its_error() {
    let at = |order: usize, n: usize, jump: f64| -> Run {
        let body = |name: &str, ends: &str, on: &str, y: f64| {
            format!(
                "[[body]]\nname = \"{name}\"\nyoung = 1e3\npoisson = 0.3\norder = {order}
fix = [{{ on = \"{on}\", y = {y} }}, {{ on = \"{ends}\", x = 0 }}]\n"
            )
        };
        let scene = Scene::new(format!(
            "dimension = 2\nestimate = true\nmesh = {{ geo = \"blocks.geo\", set = {{ n = {n} }} }}\n{}{}[[contact]]
between = [\"low\", \"up\"]\nlayer = {{ linear = {{ stiffness = \"1e3*(1 + 4*(x > {jump}))\" }} }}\n",
            body("lower", "low_ends", "floor", 0.0),
            body("upper", "up_ends", "top", -0.01)
        ));
        std::fs::write(scene.path.with_file_name("blocks.geo"), BLOCKS).expect("a script");
        solve(&scene, &[]).converged()
    };
    for jump in [1.0001, 1.06] {
        let exact = at(2, 128, jump).contact();
        for order in [1, 2] {
            let run = at(order, 8, jump);
            let (own, [mut error, mut whole]) = (run.contact(), [0.0; 2]);
            for q in 0..own.rows() {
                // the nearest point on the same side of the jump
                let is_beside = |r: &usize| (exact["x"][*r] > jump) == (own["x"][q] > jump);
                let near = |r: &usize| (exact["x"][*r] - own["x"][q]).abs();
                let beside = (0..exact.rows()).filter(is_beside);
                let nearest = beside.min_by(|r, s| near(r).total_cmp(&near(s))).expect("a point");
                error += own["weight"][q] * (own["pressure"][q] - exact["pressure"][nearest]).powi(2);
                whole += own["weight"][q] * own["pressure"][q].powi(2);
            }
            let (told, true_error) = (run.number("discretization_error/pressure/0"), f64::sqrt(error / whole));
            assert!((0.7..6.0).contains(&(told / true_error)), "order {order}, {jump}: {told:e} {true_error:e}");
        }
    }
}

/// A strip with a stiff layer of one element, stretched by 1e-3: the stress is 100 in the layer and 1 outside, at all nodes of each.
#[test]
fn nodal_stresses_are_those_of_one_material() {
    let geo = "For i In {0:3}\n  Point(2*i+1)={0.5*i,0,0,1}; Point(2*i+2)={0.5*i,2,0,1}; Line(10+i)={2*i+1,2*i+2}; Transfinite Curve{10+i}=5;\nEndFor
For i In {0:2}\n  Line(20+i)={2*i+1,2*i+3}; Line(30+i)={2*i+2,2*i+4}; Transfinite Curve{20+i,30+i}=2; Curve Loop(i+1)={20+i,11+i,-(30+i),-(10+i)}; Plane Surface(i+1)={i+1}; Transfinite Surface{i+1};\nEndFor
Physical Surface(\"a\")={1:3}; Physical Surface(\"stiff\")={2}; Physical Curve(\"a_low\")={20:22}; Physical Curve(\"a_high\")={30:32}; Physical Point(\"a_corner\")={1};";
    for order in [1, 2] {
        let scene = Scene::new(format!(
            "dimension = 2\nplane = \"stress\"\nmesh = \"strip.geo\"\n[[body]]\nname = \"a\"\nyoung = 1e3\npoisson = 0\norder = {order}
fix = [{{ on = \"a_low\", y = 0 }}, {{ on = \"a_high\", y = 2e-3 }}, {{ on = \"a_corner\", x = 0 }}]\n[[body.region]]\non = \"stiff\"\nyoung = 1e5\npoisson = 0\n"
        ));
        std::fs::write(scene.path.with_file_name("strip.geo"), geo).expect("a script");
        let path = scene.path.clone();
        let field = with_session(move |session| {
            let solution = api::solve(session, api::load(&path, &[]).expect("a scene")).expect("a solution");
            solution.body(0).expect("a body").expect("its field").clone()
        });
        assert_eq!(field.von_mises.len(), field.points.len());
        for (x, stress) in field.points.iter().zip(&field.von_mises) {
            let is_one = |exact: f64| (stress / exact - 1.0).abs() < 1e-9;
            let (inner, edge) = (x[0] > 0.6 && x[0] < 0.9, (x[0] - 0.5).abs().min((x[0] - 1.0).abs()) < 1e-9);
            assert!(is_one(100.0) && (inner || edge) || is_one(1.0) && !inner, "order {order}, {x:?}: {stress}");
        }
        for exact in [1.0, 100.0] {
            let on_edges = field.points.iter().zip(&field.von_mises).filter(|(x, stress)| {
                ((x[0] - 0.5).abs() < 1e-9 || (x[0] - 1.0).abs() < 1e-9) && (**stress / exact - 1.0).abs() < 1e-9
            });
            assert_eq!(on_edges.count(), if order == 1 { 10 } else { 18 }, "order {order}, {exact}");
        }
    }
}
