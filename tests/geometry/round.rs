//! Round bodies that contact alone holds: only the facets of their meshes resist that they spin.

use crate::common::{Run, Scene, solve, solve_on};
use std::fs;

/// A roller with half axes `a` and 10 in a V with walls at 45 degrees.
const VEE: &str = "SetFactory(\"OpenCASCADE\");
DefineConstant[ h = 0.3, a = 10 ];
s = Sqrt(a*a + 100);
Disk(1) = {0, s, 0, Max(a, 10), Min(a, 10)};
If(a < 10)
  Rotate {{0, 0, 1}, {0, s, 0}, Pi/2} { Surface{1}; }
EndIf
Point(10) = {0, 0, 0}; Point(11) = {30, 30, 0}; Point(12) = {30, -30, 0}; Point(13) = {-30, -30, 0}; Point(14) = {-30, 30, 0};
Line(11) = {10, 11}; Line(12) = {11, 12}; Line(13) = {12, 13}; Line(14) = {13, 14}; Line(15) = {14, 10};
Curve Loop(2) = {11 : 15}; Plane Surface(2) = {2};
Field[1] = MathEval; Field[1].F = Sprintf(\"%g + 0.25*Sqrt((Fabs(x) - %g)^2 + (y - %g)^2)\", h, 7.07, 7.07);
Background Field = 1; Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0;
Physical Surface(\"roller\") = {1}; Physical Surface(\"groove\") = {2}; Physical Curve(\"skin\") = {1}; Physical Curve(\"base\") = {13};
";

/// Two rings, the outer one around the inner one, and balls: one in a hollow of another.
const RINGS: &str = "SetFactory(\"OpenCASCADE\");
Circle(1) = {0, 0, 0, 6}; Circle(2) = {0, 0, 0, 10}; Circle(3) = {0, 0, 0, 10}; Circle(4) = {0, 0, 0, 14};
For k In {1 : 4}
  Curve Loop(k) = {k};
EndFor
Plane Surface(3) = {2, 1}; Plane Surface(6) = {4, 3};
Mesh.MeshSizeMax = 1.3;
Physical Surface(\"inner\") = {3}; Physical Surface(\"outer\") = {6};
Physical Curve(\"rim\") = {4};
";

const BALL: &str = "SetFactory(\"OpenCASCADE\");
Sphere(1) = {0, 0, 0, 10};
Box(2) = {-12, -12, -12, 24, 24, 10}; Sphere(3) = {0, 0, 0, 10}; BooleanDifference(4) = { Volume{2}; Delete; }{ Volume{3}; Delete; };
Mesh.MeshSizeMax = 3.1;
Physical Volume(\"ball\") = {1}; Physical Volume(\"cup\") = {4};
base() = Surface In BoundingBox {-13, -13, -12.1, 13, 13, -11.9}; Physical Surface(\"base\") = {base()};
";

/// A scene beside its script.
fn scene(script: &str, text: &str) -> Scene {
    let scene = Scene::new(text);
    fs::write(scene.path.with_file_name("round.geo"), script).expect("a script");
    scene
}

/// A roller in a V under a force at its centre, or beside it.
fn in_vee(order: usize, a: f64, load: &str) -> Scene {
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"round.geo\", set = {{ a = {a} }} }}
[[body]]\nname = \"roller\"\norder = {order}\nyoung = 2.1e5\npoisson = 0.3\n{load}
[[body]]\nname = \"groove\"\norder = {order}\nyoung = 2.1e5\npoisson = 0.3\nfix = [{{ on = \"base\", x = 0, y = 0 }}]
[[contact]]\nbetween = \"auto\"\ndistance = 1\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n"
    );
    scene(VEE, &text)
}

const WEIGHT: &str = "force = [0, \"-1000/(100*pi)\"]";

/// What is warned of a body that is fixed.
fn is_fixed(run: &Run, body: &str) -> bool {
    let warnings = run.warnings();
    let words = format!("body {body}: nothing holds its");
    warnings
        .lines()
        .any(|line| line.contains(&words) && line.contains("rotation") && line.contains("fixed at one node"))
}

fn displacement(run: &Run, body: usize) -> f64 {
    run.number(&format!("bodies/{body}/max_displacement"))
}

/// The walls carry the roller, at whatever fineness and order, and it stays where it is. Its own surface carries the points, so that the node at
/// which it is fixed has no reaction.
#[test]
fn a_roller_in_a_vee_does_not_spin() {
    for (order, h) in [(1, "0.3"), (1, "0.1"), (2, "0.3"), (2, "0.1")] {
        let run = solve(in_vee(order, 10.0, WEIGHT), &["--set", &format!("mesh.set.h={h}")]).converged();
        assert!(is_fixed(&run, "roller"), "{order} {h}\n{}", run.said());
        assert!(displacement(&run, 0) < 0.1, "{order} {h}: {}\n{}", displacement(&run, 0), run.said());
        // facets of straight edges turn it a little
        let most = if order == 1 { 1e-4 } else { 1e-7 };
        assert!(run.number("bodies/0/balance/force_imbalance") < most, "{order} {h}: {}", run.said());
        let [force, _] = run.forces(0);
        assert!((force[1].abs() / 1000.0 - 1.0).abs() < 2e-2, "{order} {h}: {force:?}");
    }
}

/// A roller that is 2 % out of round is held on a mesh that is fine enough to tell, and taken for round on no other.
#[test]
fn a_roller_out_of_round_is_held() {
    let run = solve(in_vee(2, 10.4, WEIGHT), &["--set", "mesh.set.h=0.1"]);
    assert!(!is_fixed(&run, "roller"), "{}", run.said());
}

/// A force far beside the centre has no equilibrium, and the run says so.
#[test]
fn a_force_beside_the_centre_is_told() {
    let run = solve(in_vee(1, 10.0, "force = [0, \"-10*(x > 3)\"]"), &[]);
    assert!(!is_fixed(&run, "roller"), "{}", run.said());
    assert!(run.warnings().contains("only the facets of the mesh resist its"), "{}", run.said());
}

/// A press fit of two rings with straight facets, one of them held: pressures are those of Lame, and the same on two ranks.
#[test]
fn rings_of_a_press_fit_do_not_spin() {
    let text = "dimension = 2\nmesh = \"round.geo\"
[[body]]\nname = \"inner\"\nyoung = 2.1e5\npoisson = 0.3
[[body]]\nname = \"outer\"\nyoung = 2.1e5\npoisson = 0.3\nfix = [{ on = \"rim\", x = 0, y = 0 }]
[[contact]]\nbetween = \"auto\"\ndistance = 0.1\nangle = 45\ntouching = true\ngap = -0.01\noverlap = \"compress\"\nlayer = { linear = { stiffness = 1e6 } }\n";
    let scene = scene(RINGS, text);
    let one = solve(&scene, &[]).converged();
    let two = solve_on(2, &scene, &[]).converged();
    for run in [&one, &two] {
        assert!(is_fixed(run, "inner"), "{}", run.said());
        assert!(displacement(run, 0) < 0.02, "{}", run.said());
    }
    let off = crate::common::distance(&one.contact()["pressure"], &two.contact()["pressure"]);
    assert!(off < 1e-9, "{off:e}");
}

/// A ball in a cup turns about three axes.
#[test]
fn a_ball_in_a_cup_does_not_turn() {
    let text = "dimension = 3\nmesh = \"round.geo\"
[[body]]\nname = \"ball\"\nyoung = 2.1e3\npoisson = 0.3\nforce = [0, 0, -1]
[[body]]\nname = \"cup\"\nyoung = 2.1e3\npoisson = 0.3\nfix = [{ on = \"base\", x = 0, y = 0, z = 0 }]
[[contact]]\nbetween = \"auto\"\ndistance = 1\ntouching = true\nlayer = { linear = { stiffness = 1e3 } }\n";
    let run = solve(scene(BALL, text), &[]).converged();
    let of_ball = run.warnings().lines().filter(|line| line.contains("body ball: nothing holds its")).count();
    assert_eq!(of_ball, 1, "{}", run.said());
    assert!(
        ["x", "y", "z"].iter().all(|axis| run.warnings().contains(&format!("rotation about {axis}"))),
        "{}",
        run.said()
    );
    assert!(displacement(&run, 0) < 30.0, "{}", run.said());
}
