//! One normal of both sides: results do not depend on the side with the contact points, and planes of symmetry are mirrors.

use crate::common::Scene;
use crate::common::here::solve_here;
use std::fs;

/// A scene beside its script.
fn scene(script: &str, text: String) -> Scene {
    let scene = Scene::new(text);
    fs::write(scene.path.with_file_name("part.geo"), script).expect("a script");
    scene
}

/// A rubber ring between steel flats with facets of the size `flat`; the facets of the ring have the size 0.1.
const RING: &str = "SetFactory(\"OpenCASCADE\"); e = 1e-6; d = 3.53; r = d/2;
DefineConstant[ flat = 0.6 ];
Rectangle(1) = {16, -3, 0, 9, 3}; Disk(2) = {20.5, r, 0, r}; Rectangle(3) = {16, d, 0, 9, 3};
MeshSize {:} = flat; MeshSize { PointsOf { Surface{2}; } } = 0.1;
Physical Surface(\"below\") = {1}; Physical Surface(\"ring\") = {2}; Physical Surface(\"above\") = {3};
Physical Curve(\"floor\") = Curve In BoundingBox {16-e, -3-e, -e, 25+e, -3+e, e};
Physical Curve(\"low\") = Curve In BoundingBox {16-e, -e, -e, 25+e, e, e};
Physical Curve(\"skin\") = Curve In BoundingBox {20.5-r-e, -e, -e, 20.5+r+e, d+e, e};
Physical Curve(\"high\") = Curve In BoundingBox {16-e, d-e, -e, 25+e, d+e, e};
Physical Curve(\"top\") = Curve In BoundingBox {16-e, d+3-e, -e, 25+e, d+3+e, e};
";

/// Flats without friction exert no radial force, so that the mean stress along the axis alone moves the section: a force of 28.9.
#[test]
fn a_ring_between_flats_takes_the_same_force_on_any_mesh() {
    let layer = "layer = { linear = { stiffness = 1e4 } }";
    let text = format!(
        "dimension = 2\nplane = \"axisymmetric\"\nmesh = {{ geo = \"part.geo\" }}
[[body]]\nname = \"below\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\nfix = [{{ on = \"floor\", y = 0 }}]
[[body]]\nname = \"ring\"\nyoung = 7\npoisson = 0.49\norder = 2
[[body]]\nname = \"above\"\norder = 1\nyoung = 2.1e5\npoisson = 0.3\nfix = [{{ on = \"top\", y = -0.1 }}]
[[contact]]\nbetween = [\"low\", \"skin\"]\n{layer}\n[[contact]]\nbetween = [\"high\", \"skin\"]\n{layer}\n"
    );
    for flat in ["0.6", "0.05"] {
        let run = solve_here(scene(RING, text.clone()), &[&format!("mesh.set.flat={flat}")]).converged();
        let force = run.number("pairs/0/force/1/1");
        assert!((force - 28.9).abs() < 0.06, "{flat}: {force}");
    }
}

/// A stiff wedge whose faces rise by `beta` degrees stands on a soft block; both are turned by `turn` degrees. The sizes of the facets are `h` on
/// the wedge and `k` on the block.
const WEDGE: &str = "DefineConstant[ beta = 22, turn = 0, h = 0.1, k = 0.1 ];
t = Tan(beta*Pi/180);
Point(1) = {0,0,0,h}; Point(2) = {6,6*t,0,1}; Point(3) = {6,6*t+4,0,2}; Point(4) = {-6,6*t+4,0,2}; Point(5) = {-6,6*t,0,1};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,5}; Line(5) = {5,1}; Curve Loop(1) = {1:5}; Plane Surface(1) = {1};
Point(11) = {-20,-20,0,4}; Point(12) = {20,-20,0,4}; Point(13) = {20,0,0,4}; Point(14) = {2,0,0,k}; Point(15) = {-2,0,0,k}; Point(16) = {-20,0,0,4};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,15}; Line(15) = {15,16}; Line(16) = {16,11};
Curve Loop(2) = {11:16}; Plane Surface(2) = {2};
Rotate {{0,0,1}, {0,0,0}, turn*Pi/180} { Surface{1, 2}; }
Physical Surface(\"wedge\") = {1}; Physical Surface(\"block\") = {2};
Physical Curve(\"nose\") = {1,5}; Physical Curve(\"back\") = {3}; Physical Curve(\"floor\") = {11}; Physical Curve(\"face\") = {13,14,15};
";

/// Nothing acts sideways on a wedge, whichever angle is an edge, on either side, and turned: both faces carry half of the load.
#[test]
fn both_faces_of_a_wedge_carry_half() {
    for (beta, edge) in [(10, 5), (22, 5), (22, 40), (22, 100), (45, 40)] {
        for (more, turn) in [("turn=0", 0), ("turn=90", 1), ("h=0.04", 0), ("k=0.04", 0)] {
            let [held, load] = [["x", "[0, -40]"], ["y", "[40, 0]"]][turn];
            let text = format!(
                "dimension = 2\nmesh = {{ geo = \"part.geo\" }}
[[body]]\nname = \"wedge\"\norder = 1\nyoung = 1e7\npoisson = 0.3\nfix = [{{ on = \"back\", {held} = 0 }}]
load = [{{ on = \"back\", force = {load}, rigid = true }}]
[[body]]\nname = \"block\"\norder = 1\nyoung = 1e3\npoisson = 0.3\nfix = [{{ on = \"floor\", x = 0, y = 0 }}]
[[contact]]\nbetween = [\"nose\", \"face\"]\nedge = {edge}\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n"
            );
            let sets = [format!("mesh.set.beta={beta}"), format!("mesh.set.{more}")];
            let run = solve_here(scene(WEDGE, text), &sets.each_ref().map(String::as_str)).converged();
            let [along, sideways] = [1 - turn, turn].map(|c| run.number(&format!("pairs/0/force/1/{c}")).abs());
            assert!((along - 40.0).abs() < 1e-6 && sideways < 0.2, "{beta} {edge} {more}: {along} {sideways}");
            assert_eq!(run["pairs"].as_array().map_or(0, Vec::len), 1);
        }
    }
}

/// Two rings, a quarter or the whole of mirror images of it, turned by `turn` degrees; in space with the thickness `t`.
const RINGS: &str = "DefineConstant[ quarters = 1, turn = 0, t = 0, n = 3, m = 4 ];
Macro Ring
  p = newp; Point(p) = {0,0,0}; c() = {}; s() = {};
  For k In {0 : quarters}
    w = (turn + 90*k)*Pi/180;
    q1[k] = newp; Point(q1[k]) = {ri*Cos(w),ri*Sin(w),0}; q2[k] = newp; Point(q2[k]) = {ro*Cos(w),ro*Sin(w),0};
    If(k == 4)
      q1[k] = q1[0]; q2[k] = q2[0]; rl[k] = rl[0];
    Else
      rl[k] = newl; Line(rl[k]) = {q1[k],q2[k]}; Transfinite Line{rl[k]} = n+1;
    EndIf
  EndFor
  For k In {0 : quarters-1}
    c1[k] = newl; Circle(c1[k]) = {q1[k],p,q1[k+1]}; c2[k] = newl; Circle(c2[k]) = {q2[k],p,q2[k+1]};
    l = newll; Curve Loop(l) = {rl[k],c2[k],-rl[k+1],-c1[k]}; s[k] = news; Plane Surface(s[k]) = {l};
    Transfinite Line{c1[k],c2[k]} = nt+1;
    If(k == 0 || k == 2)
      Transfinite Surface{s[k]} Left;
    Else
      Transfinite Surface{s[k]} Right;
    EndIf
  EndFor
Return
ri = 20; ro = 50; nt = 2*n; Call Ring;
Physical Surface(\"inner\") = {s()}; Physical Curve(\"inner_out\") = {c2()}; Physical Curve(\"inner_x\") = {rl[0]}; Physical Curve(\"inner_y\") = {rl[1]};
If(quarters > 1)
  Physical Curve(\"inner_x\") += {rl[2]}; Physical Curve(\"inner_y\") += {rl[3]};
EndIf
ri = 50; ro = 90; nt = 2*m; Call Ring;
Physical Surface(\"outer\") = {s()}; Physical Curve(\"outer_in\") = {c1()}; Physical Curve(\"outer_out\") = {c2()}; Physical Curve(\"outer_x\") = {rl[0]}; Physical Curve(\"outer_y\") = {rl[1]};
If(quarters > 1)
  Physical Curve(\"outer_x\") += {rl[2]}; Physical Curve(\"outer_y\") += {rl[3]};
EndIf
";

/// A quarter between two planes of symmetry, inclined or not, has the pressures of the whole that its mirror images make. So the error of linear
/// elements at its ends, which falls with h there and with h^2 elsewhere, is that of their mesh: all diagonals of the cells at an end run to one side.
#[test]
fn a_quarter_has_the_pressures_of_the_whole() {
    for (order, turn) in [(1, 0), (2, 0), (1, 25)] {
        let rings = |quarters: usize, turn: i32| {
            let held = if turn == 0 { ["y", "x"] } else { ["normal"; 2] };
            let fix = |body: &str| {
                format!("fix = [{{ on = \"{body}_x\", {} = 0 }}, {{ on = \"{body}_y\", {} = 0 }}]", held[0], held[1])
            };
            let (inner, outer) = (fix("inner"), fix("outer"));
            let cos = f64::to_radians(2.0 * f64::from(turn)).cos();
            let sin = f64::to_radians(2.0 * f64::from(turn)).sin();
            let text = format!(
                "dimension = 2\nmesh = {{ geo = \"part.geo\", set = {{ quarters = {quarters}, turn = {turn} }} }}
[[body]]\nname = \"inner\"\nyoung = 7e4\npoisson = 0.33\norder = {order}\n{inner}
[[body]]\nname = \"outer\"\nyoung = 2.1e5\npoisson = 0.3\norder = {order}\n{outer}
load = [{{ on = \"outer_out\", pressure = \"40 + 12*((x^2-y^2)*{cos} + 2*x*y*{sin})/(x^2+y^2)\" }}]
[[contact]]\nbetween = [\"inner_out\", \"outer_in\"]\ntouching = true\nlayer = {{ linear = {{ stiffness = 5e4 }} }}\n"
            );
            let run = solve_here(scene(RINGS, text), &[]).converged();
            let angle = |q: usize| {
                let degrees = run.contact()["y"][q].atan2(run.contact()["x"][q]).to_degrees() - f64::from(turn);
                (1e3 * degrees).round() as i64
            };
            let mut all: Vec<(i64, f64)> =
                (0..run.contact().rows()).map(|q| (angle(q), run.contact()["pressure"][q])).collect();
            all.retain(|(angle, _)| (-1..=90_001).contains(angle));
            all.sort_by_key(|point| point.0);
            all
        };
        let (quarter, whole) = (rings(1, turn), rings(4, 0));
        assert_eq!(quarter.len(), whole.len());
        for (ours, theirs) in quarter.iter().zip(&whole) {
            assert!(
                ours.0 == theirs.0 && (ours.1 / theirs.1 - 1.0).abs() < 1e-6,
                "order {order}, {turn}: {ours:?} {theirs:?}"
            );
        }
    }
}

/// A ball on a plate under its weight, which nothing else holds but a spring that is too weak to carry any of it.
const BALL: &str = "SetFactory(\"OpenCASCADE\"); e = 1e-6;
Sphere(1) = {0, 0, 1, 1}; Box(2) = {-1, -1, -1, 2, 2, 1};
MeshSize {:} = 0.5; Field[1] = MathEval; Field[1].F = \"0.12 + 0.4*Sqrt(x*x + y*y + z*z)\"; Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0;
Physical Volume(\"ball\") = {1}; Physical Volume(\"plate\") = {2};
Physical Surface(\"skin\") = {1}; Physical Surface(\"faces\") = {2:7};
Physical Surface(\"floor\") = Surface In BoundingBox {-1-e, -1-e, -1-e, 1+e, 1+e, -1+e};
";

/// The plate carries the whole weight, and nothing acts sideways, whether the surfaces are named or found.
#[test]
fn a_plate_carries_the_weight_of_a_ball() {
    let mut peaks = Vec::new();
    for contact in ["between = [\"skin\", \"faces\"]", "between = \"auto\"\ndistance = 0.1"] {
        let text = format!(
            "dimension = 3\nmesh = {{ geo = \"part.geo\" }}
[[body]]\nname = \"ball\"\norder = 1\nyoung = 1000\npoisson = 0.3\nforce = [0, 0, -0.5]
spring = [{{ on = \"skin\", stiffness = 1e-4 }}]
[[body]]\nname = \"plate\"\norder = 1\nyoung = 1000\npoisson = 0.3\nfix = [{{ on = \"floor\", x = 0, y = 0, z = 0 }}]
[[contact]]\n{contact}\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n"
        );
        let run = solve_here(scene(BALL, text), &[]).converged();
        let force = [0, 1, 2].map(|c| run.number(&format!("pairs/0/force/1/{c}")));
        let weight = run.number("bodies/0/balance/loads/force/2").abs();
        assert!(
            (force[2] + weight).abs() < 1e-4 * weight && force[0].hypot(force[1]) < 1e-6 * weight,
            "{force:?} {weight}"
        );
        peaks.push(run.number("pairs/0/peak_pressure"));
    }
    assert!((peaks[0] / peaks[1] - 1.0).abs() < 1e-6, "{peaks:?}");
}

/// Blocks with arcs of the radii 60 and 40, whose edges of 5e-5 turn by a millionth. A shift along the arcs changes no pressure, since the normals of both
/// sides are mixed by their curvatures. Differences of tangents, of which rounding is a hundredth here, would change it by 4 per cent.
#[test]
fn curvatures_of_tiny_edges() {
    let script = "For s In {0:1}\n up = 2*s - 1; R = 60 - 20*s; p = 10*s + 1;\n For i In {0:1}\n\
        x = 1 + i/1000; y = up*(Sqrt(R*R - 1) - Sqrt(R*R - x*x)); Point(p + i) = {x, y, 0}; Point(p + 2 + i) = {x, y + up/2000, 0};\n EndFor\n\
        Point(p + 4) = {0, up*Sqrt(R*R - 1), 0}; Circle(p) = {p, p + 4, p + 1};\n\
        Line(p + 1) = {p + 1, p + 3}; Line(p + 2) = {p + 3, p + 2}; Line(p + 3) = {p + 2, p};\n\
        Transfinite Curve {p, p + 2} = 21; Transfinite Curve {p + 1, p + 3} = 3;\n\
        Curve Loop(p) = {p:p + 3}; Plane Surface(p) = {p}; Transfinite Surface {p};\nEndFor\n\
        Physical Surface(\"lower\") = {1}; Physical Curve(\"top\") = {1}; Physical Curve(\"foot\") = {3};\n\
        Physical Surface(\"upper\") = {11}; Physical Curve(\"sole\") = {11}; Physical Curve(\"head\") = {13};\n";
    let body = |name: &str, fix: &str| {
        format!("[[body]]\nname = \"{name}\"\nyoung = 1e6\npoisson = 0.3\norder = 8\nfix = [{{ on = {fix} }}]\n")
    };
    let scene = Scene::new(format!(
        "dimension = 2\nmesh = {{ geo = \"arcs.geo\" }}\n{}{}[[contact]]\nbetween = [\"top\", \"sole\"]\ntouching = true\n\
         layer = {{ linear = {{ stiffness = 1 }} }}\n[output]\nvtu = false\nplots = false\n",
        body("lower", "\"foot\", x = 0, y = 0"),
        body("upper", "\"head\", x = 1e-4, y = -1e-5")
    ));
    fs::write(scene.path.with_file_name("arcs.geo"), script).expect("a script");
    let table = solve_here(scene, &["method.stop.residual=1e-6"]).converged().contact();
    let worst = table["pressure"].iter().map(|p| (p / 1e-5 - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 3e-3, "{worst:e}");
}
