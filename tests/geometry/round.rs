//! Round bodies that contact alone holds: forces and pressures are right, whatever resists that they spin.

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
Physical Curve(\"rim\") = {4}; Physical Curve(\"bore\") = {1};
";

const PLATE: &str = "SetFactory(\"OpenCASCADE\");
Sphere(1) = {0, 0, 2.0101, 1}; Box(2) = {-2, -2, 0, 4, 4, 1};
MeshSize{ PointsOf{ Volume{2}; } } = 0.35; MeshSize{ PointsOf{ Volume{1}; } } = 0.175;
Mesh.MeshSizeMax = 0.35; Mesh.MeshSizeFromCurvature = 0;
Physical Volume(\"ball\") = {1}; Physical Volume(\"plate\") = {2};
skin() = Boundary{ Volume{1}; }; Physical Surface(\"skin\") = {skin()};
top() = Surface In BoundingBox{-2.1, -2.1, 0.99, 2.1, 2.1, 1.01}; Physical Surface(\"top\") = {top()};
base() = Surface In BoundingBox{-2.1, -2.1, -0.01, 2.1, 2.1, 0.01}; Physical Surface(\"base\") = {base()};
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

fn displacement(run: &Run, body: usize) -> f64 {
    run.number(&format!("bodies/{body}/max_displacement"))
}

/// No force is missing: neither in the sum of the forces on a body, nor without a word.
fn in_balance(run: &Run, label: &str) {
    let imbalance = run.number("bodies/0/balance/force_imbalance");
    assert!(imbalance < 1e-8, "{label}: {imbalance:e}\n{}", run.said());
}

/// The walls carry the roller, at whatever fineness and order, and it stays where it is.
#[test]
fn a_roller_in_a_vee_does_not_spin() {
    for (order, h) in [(1, "0.3"), (1, "0.1"), (2, "0.3"), (2, "0.1")] {
        let run = solve(in_vee(order, 10.0, WEIGHT), &["--set", &format!("mesh.set.h={h}")]).converged();
        let label = format!("{order} {h}");
        assert!(displacement(&run, 0) < 0.1, "{label}: {}\n{}", displacement(&run, 0), run.said());
        in_balance(&run, &label);
        let [force, _] = run.forces(0);
        assert!((force[1].abs() / 1000.0 - 1.0).abs() < 2e-2, "{label}: {force:?}");
    }
}

/// A ball on a plate slides and turns about the normal. Contact carries its weight, and no node does.
#[test]
fn a_ball_on_a_plate_keeps_its_weight() {
    let text = |between: &str| {
        format!(
            "dimension = 3\nmesh = \"round.geo\"
[[body]]\nname = \"ball\"\norder = 1\nyoung = 1000\npoisson = 0.3\nforce = [0, 0, -0.5]
[[body]]\nname = \"plate\"\norder = 1\nyoung = 1000\npoisson = 0.3\nfix = [{{ on = \"base\", x = 0, y = 0, z = 0 }}]
[[contact]]\n{between}\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n"
        )
    };
    let runs = ["between = [\"skin\", \"top\"]", "between = [\"top\", \"skin\"]", "between = \"auto\"\ndistance = 0.1"];
    for between in runs {
        let run = solve(scene(PLATE, &text(between)), &[]).converged();
        in_balance(&run, between);
        let words =
            "body ball: nothing holds its translation along x and y and rotation about z, and no load works on it";
        assert!(run.warnings().contains(words), "{between}\n{}", run.said());
        let force = run.forces(0)[0];
        assert!(force[0].abs() + force[1].abs() < 1e-8 * force[2].abs(), "{between}: {force:?}");
    }
}

/// A force far beside the centre of a roller turns it, and the run says so.
#[test]
fn a_force_beside_the_centre_is_told() {
    let run = solve(in_vee(1, 10.0, "force = [0, \"-1e5*(x > 3)\"]"), &[]);
    assert!(run.code != 0 || run.warnings().contains("bodies turn by more than 0.05 rad: `roller`"), "{}", run.said());
}

/// The largest difference of the pressures of two runs, relative to the mean.
fn apart(one: &Run, other: &Run) -> f64 {
    let [p, q] = [one, other].map(|run| run.contact()["pressure"].to_vec());
    let mean = p.iter().sum::<f64>() / p.len() as f64;
    p.iter().zip(&q).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max) / mean
}

/// A press fit of two rings with straight facets, one of them held: pressures are those with a weak spring that keeps the other
/// from turning, and the same on two ranks.
#[test]
fn rings_of_a_press_fit_keep_their_pressures() {
    let text = |more: &str| {
        format!(
            "dimension = 2\nmesh = \"round.geo\"
[[body]]\nname = \"inner\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\n{more}
[[body]]\nname = \"outer\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\nfix = [{{ on = \"rim\", x = 0, y = 0 }}]
[[contact]]\nbetween = \"auto\"\ndistance = 0.1\nangle = 45\ntouching = true\ngap = -0.01\noverlap = \"compress\"\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n"
        )
    };
    let one = solve(scene(RINGS, &text("")), &[]).converged();
    let two = solve_on(2, scene(RINGS, &text("")), &[]).converged();
    assert!(apart(&one, &two) < 1e-6, "{:e}", apart(&one, &two));
    let held = solve(scene(RINGS, &text("spring = [{ on = \"bore\", stiffness = 10 }]")), &[]).converged();
    assert!(apart(&one, &held) < 1e-2, "{:e}\n{}", apart(&one, &held), one.said());
    in_balance(&one, "rings");
}

/// A ball in a cup: contact carries the load, and the nodes at which its turns are fixed carry nothing.
#[test]
fn a_ball_in_a_cup_keeps_its_forces() {
    let text = "dimension = 3\nmesh = \"round.geo\"
[[body]]\nname = \"ball\"\norder = 1\nyoung = 2.1e3\npoisson = 0.3\nforce = [0, 0, -1]
[[body]]\nname = \"cup\"\norder = 1\nyoung = 2.1e3\npoisson = 0.3\nfix = [{ on = \"base\", x = 0, y = 0, z = 0 }]
[[contact]]\nbetween = \"auto\"\ndistance = 1\ntouching = true\nlayer = { linear = { stiffness = 1e3 } }\n";
    let run = solve(scene(BALL, text), &[]).converged();
    let imbalance = run.number("bodies/0/balance/force_imbalance");
    assert!(imbalance < 1e-8, "{imbalance:e}\n{}", run.said());
    assert!(
        run.warnings().contains("nothing holds its rotation about x, y and z, and the loads lack balance there by"),
        "{}",
        run.said()
    );
    assert!(displacement(&run, 0) < 1.0, "{}", run.said());
}
