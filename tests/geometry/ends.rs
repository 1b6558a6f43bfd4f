//! Pairs that end: at their largest distance, at a step of a surface, and behind a facet that is no partner.

use crate::common::{Report, Scene, root, solve, solve_on};
use std::fmt::Write;

/// The stiff spheres of `sphere-layer` as bodies of revolution. Their contact ends at the radius 1, where they are 0.02 apart.
fn spheres(contact: &str, order: usize) -> Scene {
    let path = root().join("meshes/sphere-layer/axisymmetric.toml");
    let folder = root().join("meshes/hertz-sphere");
    let text = std::fs::read_to_string(path).expect("the spheres");
    let text = text.replace("../hertz-sphere", &folder.display().to_string());
    let text = text.replace("order = 1", &format!("order = {order}"));
    Scene::new(text.replace("between = [\"lower_top\", \"upper_bottom\"]", contact))
}

const REACHES: &str = "the contact reaches places";

/// A contact that goes on where `distance` has ended its pair has a wrong peak, and a warning says so. With a larger distance there is none.
#[test]
fn a_contact_at_the_largest_distance_has_a_warning() {
    for (order, ranks) in [(1, 1), (2, 2)] {
        for between in ["\"auto\"", "[\"lower_top\", \"upper_bottom\"]"] {
            for (distance, is_cut) in [(0.004, true), (0.01, true), (0.016, true), (0.026, false), (0.06, false)] {
                let scene = spheres(&format!("between = {between}\ndistance = {distance}"), order);
                let run = solve_on(ranks, &scene, &[]).converged();
                let peak = run.number("pairs/0/peak_pressure") / 373.11;
                assert_eq!(peak > 1.015, is_cut, "{between} {distance}: {peak}");
                assert_eq!(run.warnings().contains(REACHES), is_cut, "{between} {distance}: {}", run.warnings());
            }
        }
    }
    let touching = spheres("between = \"auto\"\ndistance = 0.01\ntouching = true", 1);
    assert!(solve(&touching, &[]).warnings().contains(REACHES));
}

/// The warning has the first load step in which the contact reaches the end of the pair.
#[test]
fn the_warning_names_the_step() {
    let scene = spheres("between = [\"lower_top\", \"upper_bottom\"]\ndistance = 0.01", 1);
    let run = solve(&scene, &["--set", "method.steps=[0.01, 1, 1]"]).converged();
    let warnings = run.warnings();
    assert!(warnings.contains("places in load step 2 where") && warnings.matches(REACHES).count() == 1, "{warnings}");
    assert!(run.count("pairs/0/facets_uncovered") > 10);
}

/// Return the script of a block with the top y = 0, 0 < x < 2, in 15 facets, below a body whose underside has these points.
fn below(underside: &[[f64; 2]], space: bool) -> String {
    let mut text = "Point(1)={0,-1,0};Point(2)={2,-1,0};Point(3)={2,0,0};Point(4)={0,0,0};
Line(1)={1,2};Line(2)={2,3};Line(3)={3,4};Line(4)={4,1};Curve Loop(1)={1:4};Plane Surface(1)={1};
Transfinite Curve{3}=16;MeshSize{:}=0.5;Point(11)={0,5,0,0.5};Point(12)={2,5,0,0.5};Line(11)={12,11};\n"
        .to_owned();
    let last = 20 + underside.len();
    for (i, [x, y]) in (21..).zip(underside) {
        let _ = writeln!(text, "Point({i})={{{x},{y},0,0.5}};Line({i})={{{},{i}}};", if i == 21 { 11 } else { i - 1 });
    }
    let _ = writeln!(text, "Line(12)={{{last},12}};Curve Loop(2)={{11,21:{last},12}};Plane Surface(2)={{2}};");
    text += &if space {
        format!(
            "e()=Extrude{{0,0,0.3}}{{Surface{{1,2}};}};Physical Volume(\"lower\")={{1}};Physical Volume(\"upper\")={{2}};
Physical Surface(\"top\")={{e(4)}};Physical Surface(\"floor\")={{e(2)}};
Physical Surface(\"under\")={{e(10):e({})}};Physical Surface(\"back\")={{e(8)}};",
            8 + underside.len()
        )
    } else {
        format!(
            "Physical Surface(\"lower\")={{1}};Physical Surface(\"upper\")={{2}};Physical Curve(\"top\")={{3}};
Physical Curve(\"floor\")={{1}};Physical Curve(\"under\")={{22:{last}}};Physical Curve(\"back\")={{11}};"
        )
    };
    text
}

/// Move the upper body by 0.002 towards the block of [`below`].
fn pressed(underside: &[[f64; 2]], space: bool, order: usize, contact: &str) -> Report {
    let (dimension, z) = if space { (3, ", z = 0") } else { (2, "") };
    let body = |name: &str, on: &str, y: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = {order}\nyoung = 1e5\npoisson = 0\nfix = [{{ on = \"{on}\", x = 0, y = {y}{z} }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = {dimension}\nmesh = \"under.geo\"\n{}{}[[contact]]\n{contact}\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n",
        body("lower", "floor", 0.0),
        body("upper", "back", -0.002)
    ));
    std::fs::write(scene.path.with_file_name("under.geo"), below(underside, space)).expect("a script");
    crate::common::here::solve_here(&scene, &[]).converged()
}

/// The facet of the block under the step lies before both parts of the underside. Its gap is between theirs, where a dual mean would make an
/// overlap of an eighth of the step. The step stays open, though it is cut off by `distance`: no warning.
#[test]
fn a_step_is_no_overlap() {
    for (space, order) in [(false, 1), (false, 2), (true, 1), (true, 2)] {
        for (step, contact) in [
            (0.2, "between = [\"top\", \"under\"]"),
            (0.2, "between = \"auto\"\ndistance = 0.3"),
            (0.2, "between = \"auto\"\ndistance = 0.15"),
            (0.2, "between = [\"top\", \"under\"]\ndistance = 0.15"),
            (2.0, "between = [\"under\", \"top\"]"),
        ] {
            let run = pressed(&[[0.0, 0.001], [1.0, 0.001], [1.0, step], [2.0, step]], space, order, contact);
            let gaps = run.contact()["gap"].to_vec();
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            assert!(least > 0.000_999, "{contact}, {step}, order {order}: {least}");
            assert!(!run.warnings().contains(REACHES), "{}", run.warnings());
        }
    }
}

/// Below the tooth, whose sides are too steep for a partner, the underside is the partner of all facets but the one that the tooth hides.
#[test]
fn a_near_facet_that_is_no_partner_hides_none() {
    for (space, order) in [(false, 1), (false, 2), (true, 1), (true, 2)] {
        let tooth = [[0.0, 2.0], [0.9, 2.0], [1.0, 0.01], [1.1, 2.0], [2.0, 2.0]];
        let run = pressed(&tooth, space, order, "between = [\"top\", \"under\"]\nedge = 180");
        let area: f64 = run.contact()["weight"].iter().sum();
        let width = if space { 0.3 } else { 1.0 };
        assert!((area / width - 1.8).abs() < 1e-9, "{}, order {order}: {area}", run.warnings());
    }
}
