//! The same meshes and pressures, whichever body comes first by name or in the scene.

use crate::common::{Run, Scene, nanoseconds, solve};

/// Half of a cylinder of radius 20 on a block, in names that a test chooses. The block's facets are half as large as those of the cylinder.
const GEO: &str = "
h = 4; hc = 1; a = 20*Pi/180;
Point(1) = {0,20,0,h}; Point(2) = {0,0,0,hc}; Point(3) = {20,20,0,h}; Point(8) = {20*Sin(a),20-20*Cos(a),0,hc};
Circle(1) = {2,1,8}; Circle(2) = {8,1,3}; Line(3) = {3,1}; Line(4) = {1,2};
Line Loop(1) = {1:4}; Plane Surface(1) = {1};
Point(11) = {0,-10,0,h}; Point(12) = {20,-10,0,h}; Point(13) = {20,0,0,hc}; Point(15) = {7,0,0,hc/2}; Point(14) = {0,0,0,hc/2};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,15}; Line(15) = {15,14}; Line(14) = {14,11};
Line Loop(2) = {11,12,13,15,14}; Plane Surface(2) = {2};
Physical Surface(\"cylinder\") = {1}; Physical Surface(\"block\") = {2};
Physical Curve(\"round\") = {1}; Physical Curve(\"flat\") = {3}; Physical Curve(\"mid\") = {4,14};
Physical Curve(\"floor\") = {11}; Physical Curve(\"face\") = {15};
";

/// Press a cylinder of modulus 10 into a block of modulus `block`. The block is called `name`, and `order` says whether its surface and its table
/// come last.
fn pressed(block: f64, name: &str, last: bool, args: &[&str]) -> Run {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let geo = folder.path().join("pressed.geo");
    std::fs::write(&geo, GEO.replace("\"block\"", &format!("\"{name}\""))).expect("a script");
    let body = |name: &str, young: f64, fix: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = {young}\npoisson = 0.3\nfix = [{{ on = \"mid\", x = 0 }}, {fix}]\n"
        )
    };
    let mut bodies = [
        body("cylinder", 10.0, "{ on = \"flat\", x = 0, y = -0.05 }"),
        body(name, block, "{ on = \"floor\", x = 0, y = 0 }"),
    ];
    let mut between = ["round", "face"];
    if !last {
        bodies.reverse();
        between.reverse();
    }
    let scene = Scene::new(format!(
        "title = \"{}\"\ndimension = 2\nmesh = \"{}\"\n{}[[contact]]\nbetween = {between:?}\nlayer = {{ linear = {{ stiffness = 1000 }} }}\n",
        nanoseconds(),
        geo.display(),
        bodies.concat()
    ));
    solve(scene, args).converged()
}

/// The points lie on the softer body, however coarse its own mesh is, and the stiff one is as fine as it where they touch: names and the order of bodies
/// have no say in the meshes.
#[test]
fn meshes_do_not_depend_on_names() {
    let cells = |run: &Run| -> Vec<usize> {
        let rounds = run.report["rounds"].as_array().expect("rounds");
        (0..rounds.len()).map(|round| run.count(&format!("rounds/{round}/cells"))).collect()
    };
    for (block, order, carrier) in [(2e5, "1", "round"), (2e5, "2", "round"), (1e9, "2", "round"), (10.0, "2", "face")]
    {
        let orders = [format!("body.0.order={order}"), format!("body.1.order={order}")];
        let plain: Vec<&str> = orders.iter().flat_map(|set| ["--set", set]).collect();
        let adapted = [&plain[..], &["--tolerance", "3e-2"]].concat();
        let first = pressed(block, "block", true, &adapted);
        for (name, last) in [("plate", true), ("block", false)] {
            let other = pressed(block, name, last, &adapted);
            let (ours, theirs) = (cells(&first), cells(&other));
            let near = |(a, b): (&usize, &usize)| (*a as f64 / *b as f64 - 1.0).abs() < 0.2;
            assert!(ours.len() == theirs.len() && ours.iter().zip(&theirs).all(near), "{ours:?} {theirs:?}");
            assert_eq!(other.text("pairs/0/carrier"), carrier, "{}", other.said());
        }
        // the stiff body has no error of its own
        assert!(cells(&first).iter().all(|&cells| cells < 5000), "{:?}", cells(&first));
        assert_eq!(first.text("pairs/0/carrier"), carrier);
        assert_eq!(pressed(block, "block", true, &plain).text("pairs/0/carrier"), carrier);
    }
}
