//! Estimated against true errors of the forces of pairs: singular corners far from the contact, obstacles, rims, pairs that share a load, orders 1 to 8.

use crate::common::here::solve_here;
use crate::common::{Report, Scene, solve};

/// A body of a script: its name, its corners and the number of its first point.
type Outline<'a> = (&'a str, &'a [[f64; 2]], usize);

/// Return a script of polygons. The edges of body `b` are `b_0`, `b_1`, ... in the order of its corners, and `h` is the size of its elements.
fn script(bodies: &[Outline]) -> String {
    let mut text = String::from("DefineConstant[ h = {1, Name \"h\"} ];\n");
    for (name, corners, first) in bodies {
        let numbers: Vec<String> = (1..=corners.len()).map(|k| (first + k).to_string()).collect();
        for (number, [x, y]) in (first + 1..).zip(*corners) {
            text += &format!("Point({number}) = {{{x}, {y}, 0, h}};\n");
        }
        for (k, number) in numbers.iter().enumerate() {
            let next = &numbers[(k + 1) % numbers.len()];
            text += &format!("Line({number}) = {{{number}, {next}}}; Physical Curve(\"{name}_{k}\") = {{{number}}};\n");
        }
        let at = first + 1;
        text += &format!("Curve Loop({at}) = {{{}}}; Plane Surface({at}) = {{{at}}};\n", numbers.join(", "));
        text += &format!("Physical Surface(\"{name}\") = {{{at}}};\n");
    }
    text
}

/// Return a scene of polygons; `ORDER` in its text is the order.
fn scene(bodies: &[Outline], text: &str, order: usize, adapted: bool) -> Scene {
    let estimate = if adapted { "" } else { "estimate = true\n" };
    let head = format!("dimension = 2\nmesh = {{ geo = \"forces.geo\" }}\n{estimate}");
    let scene = Scene::new(head + &text.replace("ORDER", &order.to_string()));
    std::fs::write(scene.path.with_file_name("forces.geo"), script(bodies)).expect("a script");
    scene
}

const BLOCK: Outline = ("blk", &[[-4.0, -4.0], [4.0, -4.0], [4.0, 0.0], [-4.0, 0.0]], 0);

/// A bracket with a re-entrant corner far from its contact.
const BRACKET: Outline = ("blk", &[[0.0, 0.0], [2.0, 0.0], [2.0, 4.0], [6.0, 4.0], [6.0, 6.0], [0.0, 6.0]], 0);

/// Return a body before an obstacle with this gap, held at its edge 0 and pressed at edge `top`.
fn before_obstacle(gap: &str, approach: f64, top: usize) -> String {
    format!(
        "[[body]]\nname = \"blk\"\nyoung = 100\npoisson = 0.3\norder = ORDER\nfix = [{{ on = \"blk_0\", x = 0, y = 0 }}]\n[[contact]]\n\
         on = \"blk_{top}\"\nobstacle = true\ngap = \"{gap}\"\napproach = {approach}\nlayer = {{ linear = {{ stiffness = 1e3 }} }}\n"
    )
}

/// A beam with a step on three posts, the last of which is lower.
const BRIDGE: [Outline; 4] = [
    ("p1", &[[0.0, 0.0], [1.5, 0.0], [1.5, 2.0], [0.0, 2.0]], 0),
    ("p2", &[[4.2, 0.0], [6.0, 0.0], [6.0, 2.0], [4.2, 2.0]], 10),
    ("p3", &[[2.2, 0.0], [3.5, 0.0], [3.5, 2.0], [2.2, 2.0]], 30),
    ("beam", &[[0.0, 2.0], [6.0, 2.0], [6.0, 3.0], [3.0, 3.0], [3.0, 4.0], [0.0, 4.0]], 20),
];

fn bridge() -> String {
    let post = |name: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nyoung = 1000\npoisson = 0.3\norder = ORDER\nfix = [{{ on = \"{name}_0\", x = 0, y = 0 }}]\n"
        )
    };
    let contact = |post: &str, more: &str| format!("[[contact]]\nbetween = [\"{post}_2\", \"beam_0\"]\n{more}\n");
    let stiff = "layer = { linear = { stiffness = 1e5 } }";
    [
        post("p1") + &post("p2") + &post("p3"),
        "[[body]]\nname = \"beam\"\nyoung = 2000\npoisson = 0.3\norder = ORDER\nfix = [{ on = \"beam_5\", x = 0 }]\n\
         load = [{ on = \"beam_2\", pressure = \"3\" }, { on = \"beam_4\", pressure = \"2+x\" }]\n"
            .to_owned(),
        contact("p1", stiff) + &contact("p2", stiff),
        contact("p3", "gap = \"1e-4\"\nlayer = { power = { B = 1e-2, a = 0.5 } }"),
    ]
    .concat()
}

/// Return the sum of the pressures of a pair.
fn force(run: &Report, pair: usize) -> f64 {
    let [x, y] = [0, 1].map(|c| run.number(&format!("pairs/{pair}/force/0/{c}")));
    x.hypot(y)
}

/// Bodies, the rest of the scene, the order, the size of elements, and the exact forces of pairs.
type Row<'a> = (&'a [Outline<'a>], &'a str, usize, f64, &'a [(usize, f64)]);

/// The forces of order 6 on meshes of size 0.12 to 0.15 are exact to a tenth of these errors. Sums of signed errors of pressures gave 0.05 to 0.4 of them.
#[test]
fn estimates_of_forces_are_of_the_size_of_errors() {
    let punch = before_obstacle("max(0, abs(x) - 1.13)", 0.01, 2);
    let bracket = before_obstacle("0.01*(x - 4.6)^2", 0.02, 4);
    let (bridge, posts) = (bridge(), [8.581391, 7.742099, 3.176510]);
    let rows: [Row; 7] = [
        (&[BLOCK], &punch, 1, 1.0, &[(0, 1.056213)]),
        (&[BLOCK], &punch, 2, 0.7, &[(0, 1.056213)]),
        (&[BRACKET], &bracket, 1, 0.7, &[(0, 0.0220344)]),
        (&[BRACKET], &bracket, 3, 0.7, &[(0, 0.0220344)]),
        (&BRIDGE, &bridge, 1, 1.0, &[(0, posts[0]), (1, posts[1]), (2, posts[2])]),
        (&BRIDGE, &bridge, 2, 1.0, &[(1, posts[1]), (2, posts[2])]),
        (&BRIDGE, &bridge, 4, 1.0, &[(1, posts[1]), (2, posts[2])]),
    ];
    for (bodies, text, order, h, pairs) in rows {
        let sets = [&format!("mesh.set.h={h}"), "method.stop.residual=1e-10"];
        let run = solve_here(scene(bodies, text, order, false), &sets).converged();
        for &(pair, exact) in pairs {
            let (error, name) = ((force(&run, pair) / exact - 1.0).abs(), bodies[0].0);
            let ratio = run.number(&format!("discretization_error/force/{pair}")) / error;
            println!("{name} {pair} P{order}: {error:.1e}, {ratio:.2}");
            assert!((0.4..3.0).contains(&ratio), "{name} {pair} P{order}: {error:e} {ratio}");
        }
    }
}

/// The force of a single contact follows from equilibrium, on any mesh.
#[test]
fn forces_that_loads_determine_have_no_error() {
    let text = before_obstacle("0.01*(x - 0.37)^2", 0.02, 2);
    let held = text
        .replace("x = 0, y = 0", "x = 0")
        .replace("[[contact]]", "load = [{ on = \"blk_0\", pressure = 1 }]\n[[contact]]");
    let run = solve_here(scene(&[BLOCK], &held, 2, false), &["mesh.set.h=2"]).converged();
    assert!((force(&run, 0) / 8.0 - 1.0).abs() < 1e-9 && run.number("discretization_error/force/0") < 1e-6);
}

/// Errors of pressures of both signs cancel on one of the meshes, which is not the end of the adaptation.
#[test]
fn adaptation_to_a_force_does_not_end_where_errors_cancel() {
    let scene = scene(&[BLOCK], &before_obstacle("0.01*(x - 0.37)^2", 0.02, 2), 1, true);
    let run = solve(scene, &["--tolerance", "2e-3", "--set", "adapt.of=forces", "--set", "mesh.set.h=2"]).converged();
    let (error, estimated) =
        ((run.number("pairs/0/force/0/1").abs() / 1.524281 - 1.0).abs(), run.number("discretization_error/force/0"));
    assert!(estimated <= 2e-3 && error < 2e-3, "{error} {estimated}");
}
