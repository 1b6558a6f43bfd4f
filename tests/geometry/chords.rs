//! Straight facets on curved surfaces: a clearance is as wrong as an overlap, and the pressures say by how much.

use crate::common::{Run, Scene, case, solve, winkler};

/// A ball of radius 20 in a cup of radius 20.05, in n and m chords of a quarter; in the plane a cylinder in a bore.
const CUP: &str = "DefineConstant[ n = 16, m = 20 ];
Macro Arc
  p = newp; Point(p) = {0,0,0}; Point(p+1) = {0,-ri,0}; Point(p+2) = {0,-ro,0}; Point(p+3) = {ro,0,0}; Point(p+4) = {ri,0,0};
  l = newl; Circle(l) = {p+1,p,p+4}; Circle(l+1) = {p+2,p,p+3}; Line(l+2) = {p+1,p+2}; Line(l+3) = {p+4,p+3};
  ll = newll; Line Loop(ll) = {l+2,l+1,-(l+3),-l}; s = news; Plane Surface(s) = {ll};
  Transfinite Line{l,l+1} = nn+1; Transfinite Line{l+2,l+3} = 3; Transfinite Surface{s};
Return
ri = 15; ro = 20; nn = n;
Call Arc;
Physical Surface(\"ball\") = {s}; Physical Curve(\"ball_in\") = {l}; Physical Curve(\"ball_out\") = {l+1}; Physical Curve(\"ball_mid\") = {l+2};
ri = 20.05; ro = 25; nn = m;
Call Arc;
Physical Surface(\"cup\") = {s}; Physical Curve(\"cup_in\") = {l}; Physical Curve(\"cup_out\") = {l+1};
";

/// Push the stiff ball down by 0.1.
fn pushed(plane: &str, order: usize, set: &str, contact: &str) -> Run {
    let body = |name: &str, on: &str, y: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nyoung = 1e9\npoisson = 0.3\norder = {order}\nfix = [{{ on = \"{on}\", x = 0, y = {y} }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 2\nplane = \"{plane}\"\nmesh = {{ geo = \"cup.geo\", set = {set} }}\n{}{}[[contact]]\nbetween = [\"ball_out\", \"cup_in\"]\nlayer = {{ linear = {{ stiffness = 200 }} }}\n{contact}\n",
        body("ball", "ball_in", -0.1),
        body("cup", "cup_out", 0.0)
    ));
    std::fs::write(scene.path.with_file_name("cup.geo"), CUP).expect("a script");
    solve(&scene, &[]).converged()
}

/// Return the change of the pressures on curved surfaces that a warning tells, in per cent.
fn told(run: &Run) -> Option<f64> {
    let (warnings, before) = (run.warnings(), "would change by about ");
    let after = warnings.split_once(before).map(|(_, after)| after);
    after.map(|after| after.split_once(' ').expect("a number").0.parse().expect("a number"))
}

/// The closed form is F = 2 pi R^2 k (d (1 - m^3)/3 - c (1 - m^2)/2) with m = c/d, and 5236 to 5262 for the two radii. A warning says where forces are not
/// that, and by how much within a third of it.
#[test]
fn a_clearance_of_chords_has_a_warning() {
    for (order, set, contact, warned) in [
        (1, "{}", "", true),
        (1, "{ n = 32 }", "", true),
        (1, "{ n = 16, m = 16 }", "", false),
        (1, "{ n = 64, m = 80 }", "", false),
        (1, "{}", "touching = true\ngap = 0.05", false),
        (2, "{}", "", false),
    ] {
        let run = pushed("axisymmetric", order, set, contact);
        let change = 100.0 * (run.forces(0)[0][1] / 5249.0 - 1.0).abs();
        let told = told(&run);
        assert_eq!(told.is_some(), warned, "order {order}, {set}: {change}\n{}", run.said());
        assert!(
            told.map_or(change < 5.0, |told| (0.6..1.5).contains(&(told / change))),
            "order {order}, {set}: {told:?}, {change}"
        );
        assert!(told.is_none() || run.warnings().contains("touching = true"), "{}", run.warnings());
    }
    assert!(told(&pushed("strain", 1, "{}", "")).is_some());
    // contacts of Hertz: heights of chords are small beside the approach
    for name in ["hertz-line", "hertz-sphere"] {
        assert_eq!(told(&solve(case(name), &["--set", "output.plots=false"])), None, "{name}");
    }
}

/// Elements of higher orders on a mesh of order 1 show the corners between its chords, unlike linear ones. The warning and the estimate have the
/// difference from the pressure of Hertz.
#[test]
fn high_orders_show_the_corners_of_chords() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = folder.path().join("chords.msh");
    let scene = case("hertz-line");
    let [scene, mesh] = [&scene, &mesh].map(|path| path.to_str().expect("a path").to_owned());
    let coarse =
        ["mesh", &scene, "-o", &mesh, "--set", "body.0.order=1", "--set", "body.1.order=1", "--set", "mesh.set.n=2"];
    assert_eq!(winkler(&coarse).code, 0);
    for order in [2, 4] {
        let sets = [format!("mesh={mesh}"), format!("body.0.order={order}"), format!("body.1.order={order}")];
        let words: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).chain(["--estimate"]).collect();
        let run = solve(&scene, &words).converged();
        let (table, hertz) = (run.contact(), |x: f64| 1221.6 * (1.0 - (x / 1.0006).powi(2)).max(0.0).sqrt());
        let points = table["x"].iter().zip(&table["pressure"]).zip(&table["weight"]);
        let [missed, whole] = points.fold([0.0, 0.0], |[missed, whole], ((x, p), w)| {
            [missed + w * (p - hertz(*x)).powi(2), whole + w * hertz(*x).powi(2)]
        });
        let error = f64::sqrt(missed / whole);
        let (change, estimate) =
            (told(&run).expect("a warning") / 100.0, run.number("discretization_error/pressure/0"));
        assert!((0.7..2.0).contains(&(change / error)), "order {order}: {change} of {error}\n{}", run.said());
        assert!((0.4..2.0).contains(&(estimate / error)), "order {order}: {estimate} of {error}");
    }
}
