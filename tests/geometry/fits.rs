//! Press fits in space that are drawn as an overlap, and spheres that touch.

use crate::common::{Scene, case, root, solve, winkler};

/// A quarter of two rings with the radii 1 to 2 + d and 2 to 3, with chords that do not match.
const RINGS: &str = "DefineConstant[ d = 0.01 ];
Point(1)={0,0,0};Point(2)={1,0,0,0.6};Point(3)={2+d,0,0,0.6};Point(4)={0,2+d,0,0.6};Point(5)={0,1,0,0.6};
Line(1)={2,3};Circle(2)={3,1,4};Line(3)={4,5};Circle(4)={5,1,2};Curve Loop(1)={1:4};Plane Surface(1)={1};
Point(12)={2,0,0,0.6};Point(13)={3,0,0,0.6};Point(14)={0,3,0,0.6};Point(15)={0,2,0,0.6};
Line(11)={12,13};Circle(12)={13,1,14};Line(13)={14,15};Circle(14)={15,1,12};Curve Loop(2)={11:14};Plane Surface(2)={2};
Transfinite Curve{2}=7;Transfinite Curve{14}=8;e()=Extrude{0,0,0.5}{Surface{1,2};};
Physical Volume(\"inner\")={1};Physical Volume(\"outer\")={2};
Physical Surface(\"x_in\")={e(4)};Physical Surface(\"y_in\")={e(2)};Physical Surface(\"pin\")={e(3)};
Physical Surface(\"y_out\")={e(8)};Physical Surface(\"x_out\")={e(10)};Physical Surface(\"hole\")={e(11)};
";

/// The rings in plane strain, with an overlap d and elements of this order: the mean pressure over that of Lame, and whether facets have a warning.
fn fit(order: usize, d: f64) -> (f64, bool) {
    let body = |name: &str, end: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = {order}\nyoung = 2.1e5\npoisson = 0.3
fix = [{{ on = \"x_{end}\", x = 0 }}, {{ on = \"y_{end}\", y = 0 }}, {{ on = \"{name}\", z = 0 }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 3\nmesh = {{ geo = \"rings.geo\", set = {{ d = {d} }} }}\n{}{}
[[contact]]\nbetween = [\"pin\", \"hole\"]\nlayer = {{ linear = {{ stiffness = 1e8 }} }}\n",
        body("inner", "in"),
        body("outer", "out")
    ));
    std::fs::write(scene.path.with_file_name("rings.geo"), RINGS).expect("a script");
    let run = solve(&scene, &[]).converged();
    let contact = run.contact();
    let sum = |value: &dyn Fn(usize) -> f64| (0..contact.rows()).map(|q| contact["weight"][q] * value(q)).sum::<f64>();
    let mean = sum(&|q| contact["pressure"][q]) / sum(&|_| 1.0);
    // both surfaces move by p 2 (1 + nu)/E ((1 - 2 nu) 4 + r^2)/|4 - r^2| at the radius 2, for the other radius r of their ring
    let moved = |r: f64| 2.0 * 1.3 / 2.1e5 * (0.4 * 4.0 + r * r) / (4.0 - r * r).abs();
    let exact = d / (moved(1.0) + moved(3.0) + 1e-8);
    (mean / exact, run.warnings().contains("straight facets leave"))
}

/// Chords of a sixth of a quarter leave their circle by 0.017, which is more than an overlap of 0.01 and less than one of 0.1.
#[test]
fn an_overlap_of_facets_in_space_has_a_warning() {
    for (order, d, to, warned) in
        [(1, 0.01, 0.5, true), (1, 0.1, 0.1, false), (2, 0.01, 0.01, false), (2, 0.1, 0.03, false)]
    {
        let (mean, has_warning) = fit(order, d);
        assert!((mean - 1.0).abs() < to && (mean - 1.0).abs() > 1e-4, "order {order}, {d}: {mean}");
        assert_eq!(has_warning, warned, "order {order}, {d}: {mean}");
    }
}

/// Spheres that touch at a point overlap within a facet if facets do not match. It is no fit.
#[test]
fn spheres_that_touch_are_no_fit() {
    let text = std::fs::read_to_string(case("sphere-layer")).expect("the spheres");
    let text = text.replace("../hertz-sphere", &root().join("meshes/hertz-sphere").display().to_string());
    let scene =
        Scene::new(text.replace("between = [\"lower_top\", \"upper_bottom\"]", "between = \"auto\"\ndistance = 0.016"));
    let run = winkler(&["check", scene.path.to_str().expect("a path")]);
    assert!(run.stdout.contains("the bodies overlap by") && !run.stdout.contains("straight facets"), "{}", run.said());
}

/// A hub on a longer shaft: the resultant is zero, and the normal force is the mean pressure times the area. Where the shaft goes on beyond the hub, its facets have no
/// partner and no warning; where `angle` takes partners away, they have one.
#[test]
fn the_normal_force_of_a_press_fit() {
    const FIT: &str = "SetFactory(\"OpenCASCADE\"); Rectangle(1) = {0, 0, 0, 25, 60}; Rectangle(2) = {25, 10, 0, 25, 40}; MeshSize {:} = 4;
        Physical Surface(\"shaft\") = {1}; Physical Surface(\"hub\") = {2};
        Physical Curve(\"shaft_bottom\") = {1}; Physical Curve(\"shaft_surface\") = {2}; Physical Curve(\"hub_bore\") = {8};\n";
    let scene = Scene::new(
        "dimension = 2\nplane = \"axisymmetric\"\nmesh = \"fit.geo\"\n\
         [[body]]\nname = \"shaft\"\nyoung = 2.1e5\npoisson = 0.3\norder = 2\nfix = [{ on = \"shaft_bottom\", y = 0 }]\n\
         [[body]]\nname = \"hub\"\nyoung = 2.1e5\npoisson = 0.3\norder = 2\n\
         [[contact]]\nbetween = [\"shaft_surface\", \"hub_bore\"]\ntouching = true\ngap = -0.02\nlayer = { linear = { stiffness = 1e6 } }\n",
    );
    std::fs::write(scene.path.with_file_name("fit.geo"), FIT).expect("a script");
    let run = solve(&scene, &["--report"]).converged();
    let [normal, mean] = ["normal_force", "mean_pressure"].map(|key| run.number(&format!("pairs/0/{key}")));
    let contact = run.contact();
    let sum: f64 = (0..contact.rows()).map(|q| contact["weight"][q] * contact["pressure"][q]).sum();
    // 406 kN, and 64.7 MPa on the bore of radius 25 and length 40
    let area = 2.0 * std::f64::consts::PI * 25.0 * 40.0;
    assert!((normal / sum - 1.0).abs() < 1e-9 && (mean * area / sum - 1.0).abs() < 1e-6, "{normal} {mean} {sum}");
    assert!((normal / 4.06e5 - 1.0).abs() < 0.01, "{normal}");
    assert!(run.stdout.contains("force on `shaft` (0.000000, 0.000000), normal force 40"), "{}", run.said());
    assert!(!run.warnings().contains("have no partner"), "{}", run.warnings());
    let page = std::fs::read_to_string(run.folder.join("report.html")).expect("a page");
    assert!(page.contains("normal force") && page.contains("mean pressure"));
    let table = std::fs::read_to_string(run.folder.join("contacts.csv")).expect("a table");
    assert!(table.contains(",normal_force,mean_pressure,peak_pressure,"), "{table}");
}
