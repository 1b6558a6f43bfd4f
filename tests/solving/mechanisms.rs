//! Groups of bodies that nothing holds: each is held by its neighbours, and all together they are not.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::{Run, Scene, case, distance, root, solve, solve_on, winkler};

const METHODS: [&str; 4] = ["auto", "newton", "newton-robin", "robin"];

/// Those that stand bodies held by contact alone.
const FAST: [&str; 3] = ["newton", "newton-robin", "auto"];

/// Blocks of `meshes/stack` in storeys and columns: what each has besides its material, Young's moduli that differ by 1e4, and
/// pairs of surfaces.
fn blocks([rows, columns]: [usize; 2], bodies: &[&str], contacts: &[[&str; 2]]) -> String {
    let script = root().join("meshes/stack/stack.geo");
    let set = format!("rows = {rows}, columns = {columns}, n1 = 2, n2 = 3, n3 = 2, n4 = 2");
    let mut text = format!("dimension = 2\nmesh = {{ geo = \"{}\", set = {{ {set} }} }}\n", script.display());
    for (number, keys) in bodies.iter().enumerate() {
        let young = [2e5, 2e1][number % 2];
        text += &format!("[[body]]\nname = \"b{}\"\norder = 1\nyoung = {young}\npoisson = 0.3\n{keys}\n", number + 1);
    }
    for [a, b] in contacts {
        text += &format!("[[contact]]\nbetween = [\"{a}\", \"{b}\"]\nlayer = {{ linear = {{ stiffness = 10 }} }}\n");
    }
    text
}

const TWO: [[&str; 2]; 1] = [["b1_top", "b2_bottom"]];
const THREE: [[&str; 2]; 2] = [TWO[0], ["b2_top", "b3_bottom"]];
const RING: [[&str; 2]; 4] =
    [["b1_top", "b3_bottom"], ["b2_top", "b4_bottom"], ["b1_right", "b2_left"], ["b3_right", "b4_left"]];

/// A pressure on one place of each block.
fn pressed(places: &[(&str, f64)]) -> Vec<String> {
    let load = |(place, pressure): &(&str, f64)| format!("load = [{{ on = \"{place}\", pressure = {pressure} }}]");
    places.iter().map(load).collect()
}

/// Two blocks under pressures on the lower and on the upper face.
fn two(below: &str, above: f64) -> String {
    let lower = format!("load = [{{ on = \"b1_bottom\", pressure = \"{below}\" }}]");
    let upper = format!("load = [{{ on = \"b2_top\", pressure = {above} }}]");
    blocks([2, 1], &[&lower, &upper], &TWO)
}

/// Four blocks around a point, squeezed by 10 along y and by 5 along x.
fn ring(upper_right: f64) -> Vec<String> {
    let of = |number: usize, [x, y]: [&str; 2], pressure: f64| {
        let on = |place: &str, value: f64| format!("{{ on = \"b{number}_{place}\", pressure = {value} }}");
        format!("load = [{}, {}]", on(y, pressure), on(x, 5.0))
    };
    vec![
        of(1, ["left", "bottom"], 10.0),
        of(2, ["right", "bottom"], 10.0),
        of(3, ["left", "top"], 10.0),
        of(4, ["right", "top"], upper_right),
    ]
}

fn all(loads: &[String]) -> Vec<&str> {
    loads.iter().map(String::as_str).collect()
}

/// A uniform pressure in a pair.
fn uniform(run: &Run, pair: usize, pressure: f64) {
    let off = run.contact_of(pair)["pressure"].iter().map(|p| (p / pressure - 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6, "pair {pair}: {off:e}\n{}", run.said());
}

/// Ends before the first sweep, says why.
fn lost(run: &Run, status: &str, words: &[&str]) {
    assert_eq!((run.code, run.text("status"), run.count("sweeps")), (1, status, 0), "{}", run.said());
    for word in words {
        assert!(run.text("message").contains(word), "no `{word}`\n{}", run.said());
    }
}

#[test]
fn pressed_together_by_opposite_loads() {
    let stack = pressed(&[("b1_bottom", 10.0), ("b2_bottom", 0.0), ("b3_top", 10.0)]);
    let stack = blocks([3, 1], &all(&stack), &THREE);
    let revolved = stack.replace("dimension = 2\n", "dimension = 2\nplane = \"axisymmetric\"\n");
    let whole = "translation along x and y and rotation";
    for (text, methods, motions) in [(&stack, &FAST[..], whole), (&revolved, &FAST[..2], "translation along y")] {
        let scene = Scene::new(text.as_str());
        for method in methods {
            let robin: &[&str] = if *method == "newton" { &[] } else { &["--set", "method.robin=auto"] };
            let run = solve(&scene, &[&["--method", method], robin].concat()).converged();
            (0..2).for_each(|pair| uniform(&run, pair, 10.0));
            let named = format!(
                "bodies `b1`, `b2` and `b3`: nothing holds them together in their {motions}, and no load works on it"
            );
            assert!(run.warnings().contains(&named), "{}", run.warnings());
        }
    }
    let scene = Scene::new(stack);
    for solver in ["mumps", "hypre"] {
        let solver = format!("solver={solver}");
        // a node that is fixed is the same on all ranks
        for run in [solve(&scene, &["--set", &solver]), solve_on(3, &scene, &["--set", &solver])] {
            let run = run.converged();
            (0..2).for_each(|pair| uniform(&run, pair, 10.0));
        }
    }
    let run = solve_on(2, &scene, &[]).converged();
    uniform(&run, 1, 10.0);
    let said = winkler(&["check", &scene.path.display().to_string()]).stdout;
    assert!(said.contains("nothing holds them together in their translation along x and y"), "{said}");
    // no node carries a force that is not in the scene
    let run = solve(&scene, &[]).converged();
    for body in 0..3 {
        for kind in ["force", "moment"] {
            let imbalance = run.number(&format!("bodies/{body}/balance/{kind}_imbalance"));
            assert!(imbalance < 1e-11, "body {body}, {kind}: {imbalance:e}\n{}", run.said());
        }
    }
}

/// Besides the ring as a whole its upper half and its right half slide. Newton's matrix is regular: one step, without a sweep.
#[test]
fn halves_of_a_ring_slide() {
    let loads = ring(10.0);
    let run = solve(Scene::new(blocks([2, 2], &all(&loads), &RING)), &["--method", "newton"]).converged();
    assert_eq!([run.count("iterations"), run.count("sweeps")], [1, 0], "{}", run.said());
    [10.0, 10.0, 5.0, 5.0].iter().enumerate().for_each(|(pair, &p)| uniform(&run, pair, p));
    for named in [
        "bodies `b3` and `b4`: nothing holds them together in their translation along x,",
        "bodies `b2` and `b4`: nothing",
    ] {
        assert!(run.warnings().contains(named), "{}", run.warnings());
    }
    // the lower left block is held: its neighbours slide along it, and the right half is out of balance
    let held = "fix = [{ on = \"b1_bottom\", y = 0 }, { on = \"b1_left\", x = 0 }]".to_owned();
    let mut loads = ring(11.0);
    loads[0] = held;
    let run = solve(Scene::new(blocks([2, 2], &all(&loads), &RING)), &[]);
    lost(&run, "underconstrained", &["bodies `b2` and `b4`", "together in their translation along y"]);
}

/// A floating grid of blocks: all of them as one, then every row but one and every column but one slide, and nothing else.
#[test]
fn rows_and_columns_of_a_grid_slide() {
    let (rows, columns) = (6, 5);
    let number = |row: usize, column: usize| row * columns + column + 1;
    let mut contacts = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let surface = |row, column, side: &str| format!("b{}_{side}", number(row, column));
        if column + 1 < columns {
            contacts.push([surface(row, column, "right"), surface(row, column + 1, "left")]);
        }
        if row + 1 < rows {
            contacts.push([surface(row, column, "top"), surface(row + 1, column, "bottom")]);
        }
    }
    let contacts: Vec<[&str; 2]> = contacts.iter().map(|pair| pair.each_ref().map(String::as_str)).collect();
    let scene = Scene::new(blocks([rows, columns], &vec![""; rows * columns], &contacts));
    let said = winkler(&["check", &scene.path.display().to_string()]).stdout;
    let slide = |axis: &str| {
        said.matches(&format!(": nothing holds them together in their translation along {axis}, and no load")).count()
    };
    assert_eq!((slide("x"), slide("y")), (rows - 1, columns - 1), "{said}");
    assert!(
        said.contains("`b12` and 18 others: nothing holds them together in their translation along x and y"),
        "{said}"
    );
    assert_eq!(said.matches("nothing holds").count(), rows + columns - 1, "{said}");
}

#[test]
fn loads_that_do_not_balance() {
    let pushed = Scene::new(two("10", 11.0));
    for method in METHODS {
        let run = solve(&pushed, &["--method", method]);
        lost(&run, "underconstrained", &["bodies `b1` and `b2`", "together in their translation along y", "4.8 %"]);
    }
    lost(&solve_on(2, &pushed, &[]), "underconstrained", &["bodies `b1` and `b2`", "translation along y"]);
    // the sum of the loads is zero, that of their moments is not
    lost(
        &solve(Scene::new(two("20*x", 10.0)), &[]),
        "underconstrained",
        &["bodies `b1` and `b2`", "in their rotation,"],
    );
    let said = winkler(&["check", &pushed.path.display().to_string()]).stdout;
    assert!(said.contains("loads work on it: there is no solution"), "{said}");
}

/// A block 1e-4 times as large as the one under it: in the middle all is in balance, beside it the two turn.
#[test]
fn sizes_that_differ() {
    let scene = |at: f64| {
        let scene = Scene::new(
            "dimension = 2\nmesh = \"blocks.geo\"\n\
             [[body]]\nname = \"large\"\norder = 1\nyoung = 2e5\npoisson = 0.3\nload = [{ on = \"under\", force = [0, 1e-3] }]\n\
             [[body]]\nname = \"small\"\norder = 1\nyoung = 2e5\npoisson = 0.3\nload = [{ on = \"over\", pressure = 10 }]\n\
             [[contact]]\nbetween = [\"top\", \"bottom\"]\nlayer = { linear = { stiffness = 1e9 } }\n",
        );
        let block = |first: usize, [x, y]: [f64; 2], size: f64, n: usize, names: [&str; 3]| {
            let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[a, b]| [x + a * size, y + b * size]);
            let mut text = String::new();
            for (p, [x, y]) in (first..).zip(points) {
                text += &format!("Point({p}) = {{{x}, {y}, 0}};\n");
            }
            for i in 0..4 {
                text += &format!("Line({}) = {{{0}, {}}};\n", first + i, first + (i + 1) % 4);
            }
            let all = format!("{{{first}:{}}}", first + 3);
            text + &format!(
                "Transfinite Curve {all} = {};\nCurve Loop({first}) = {all};\nPlane Surface({first}) = {{{first}}};\n\
                 Transfinite Surface {{{first}}};\nPhysical Surface(\"{}\") = {{{first}}};\n\
                 Physical Curve(\"{}\") = {{{first}}};\nPhysical Curve(\"{}\") = {{{}}};\n",
                n + 1,
                names[0],
                names[1],
                names[2],
                first + 2
            )
        };
        let script = block(1, [0.0, 0.0], 1.0, 101, ["large", "under", "top"])
            + &block(11, [at - 5e-5, 1.0], 1e-4, 2, ["small", "bottom", "over"]);
        std::fs::write(scene.path.with_file_name("blocks.geo"), script).expect("a script");
        scene
    };
    for method in ["auto", "newton-robin"] {
        let run = solve(scene(0.5), &["--method", method]).converged();
        let force = run.forces(0)[1][1];
        assert!((force / 1e-3 - 1.0).abs() < 1e-7, "{force:e}\n{}", run.said());
        let named = "`large` and `small`: nothing holds them together in their translation along x and y and rotation";
        assert!(run.warnings().contains(named), "{}", run.warnings());
    }
    // beside each other by 1e-3 of their loads, and more
    lost(&solve(scene(0.503), &[]), "underconstrained", &["bodies `large` and `small`", "in their rotation"]);
}

/// The middle block is pushed up, and takes the upper one along: the lowest one stays.
#[test]
fn pushed_off_together() {
    let held = "fix = [{ on = \"b1_bottom\", x = 0, y = 0 }]";
    let run = solve(Scene::new(blocks([3, 1], &[held, "force = [0, 1]", ""], &THREE)), &[]);
    lost(
        &run,
        "unbounded",
        &["resists translation along y of `b2` and translation along y of `b3`, and the loads push that way"],
    );
    assert!(!run.text("message").contains("`b1`"), "{}", run.said());
}

/// An overlap that no load keeps: contact opens before the first sweep, also of a body on top whose gap is wavy.
#[test]
fn an_overlap_that_no_load_keeps() {
    let on = |number: usize| format!("fix = [{{ on = \"b{number}_pin\", x = 0 }}]");
    let held = "fix = [{ on = \"b1_bottom\", y = 0 }, { on = \"b1_left\", x = 0 }]";
    let text = blocks([3, 1], &[held, &on(2), &on(3)], &THREE);
    let text = text.replacen("layer", "gap = -1e-5\nlayer", 1);
    let at = text.rfind("layer").expect("two layers");
    let scene = Scene::new(format!("{}gap = \"0.5*(1 - cos(4*pi*x))\"\n{}", &text[..at], &text[at..]));
    // what iterations begin with has the rounding of the overlap, and the layer's answer to that
    let rounding = 10.0 * 1e-5 * f64::EPSILON;
    for (method, most) in [("auto", 1), ("newton-robin", 1)] {
        let run = solve(&scene, &["--method", method]).converged();
        assert!(run.count("iterations") <= most, "{}", run.said());
        assert!((0..2).all(|pair| run.number(&format!("pairs/{pair}/peak_pressure")) <= rounding), "{}", run.said());
    }
}

/// Two domes that loads of the same length of arc press together, along their flat sides; the arcs have other facets, so that the loads differ by some 1e-4.
fn domes(lower: f64, traction: f64) -> Scene {
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"domes.geo\", set = {{ h = {lower} }} }}\n\
         [[body]]\nname = \"lower\"\norder = 1\nyoung = 2e5\npoisson = 0.3\nload = [{{ on = \"under\", traction = [0, 10] }}]\n\
         [[body]]\nname = \"upper\"\norder = 1\nyoung = 2e5\npoisson = 0.3\nload = [{{ on = \"over\", traction = [0, {}] }}]\n\
         [[contact]]\nbetween = [\"top\", \"bottom\"]\nlayer = {{ linear = {{ stiffness = 1e6 }} }}\n",
        -traction
    );
    let scene = Scene::new(text);
    let dome = |first: usize, side: i32, size: &str, names: [&str; 3]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| first + k);
        format!(
            "Point({a}) = {{-2, 0, 0, {size}}}; Point({b}) = {{2, 0, 0, {size}}}; Point({c}) = {{0, {}, 0, {size}}}; Point({d}) = {{0, 0, 0}};\n\
             Line({a}) = {{{a}, {b}}}; Circle({b}) = {{{b}, {d}, {c}}}; Circle({c}) = {{{c}, {d}, {a}}};\n\
             Curve Loop({a}) = {{{a}, {b}, {c}}}; Plane Surface({a}) = {{{a}}};\nPhysical Surface(\"{}\") = {{{a}}};\n\
             Physical Curve(\"{}\") = {{{a}}}; Physical Curve(\"{}\") = {{{b}, {c}}};\n",
            2 * side,
            names[0],
            names[1],
            names[2]
        )
    };
    let script = "DefineConstant[ h = 0.3 ];\n".to_owned()
        + &dome(1, -1, "h", ["lower", "top", "under"])
        + &dome(11, 1, "0.2", ["upper", "bottom", "over"]);
    std::fs::write(scene.path.with_file_name("domes.geo"), script).expect("a script");
    scene
}

/// Loads that lack balance by what straight facets miss of a circle are balanced, on every mesh and on two ranks, with a warning that has the share; those that
/// lack ten times as much are refused.
#[test]
fn loads_that_the_mesh_puts_out_of_balance() {
    let share = |run: &Run| -> f64 {
        let warnings = run.warnings();
        let line =
            warnings.lines().find(|line| line.contains("to balance")).unwrap_or_else(|| panic!("{}", run.said()));
        assert!(
            line.starts_with(
                "bodies `lower` and `upper`: nothing holds them together in their translation along x and y"
            ),
            "{line}"
        );
        let (_, rest) = line.split_once("lack balance there by ").expect("a share");
        rest.split(' ').next().and_then(|share| share.parse().ok()).expect("a number")
    };
    for h in [0.1, 0.3, 0.5] {
        let run = solve(domes(h, 10.0), &[]).converged();
        // half of the difference of the angles' squares over 24; 16 edges are in a quarter of the other arc
        let angle = |edges: f64| FRAC_PI_2 / edges;
        let expected = (angle((PI / h).ceil()).powi(2) - angle(16.0).powi(2)) / 48.0;
        assert!((share(&run) / expected.abs() - 1.0).abs() < 0.2, "{h}: {} {expected}", share(&run));
        let [below, above] = run.forces(0).map(|force| force[1]);
        assert!((below + above).abs() < 1e-9 && (above / 62.8 - 1.0).abs() < 5e-3, "{above}");
        for body in 0..2 {
            let imbalance = run.number(&format!("bodies/{body}/balance/force_imbalance"));
            assert!(imbalance < 1e-11, "{h}, body {body}: {imbalance:e}");
        }
    }
    let two = solve_on(2, domes(0.3, 10.0), &[]).converged();
    let one = solve(domes(0.3, 10.0), &[]).converged();
    assert_eq!(share(&one), share(&two));
    assert!(distance(&one.contact()["pressure"], &two.contact()["pressure"]) < 1e-9);
    lost(
        &solve(domes(0.3, 10.1), &[]),
        "underconstrained",
        &["bodies `lower` and `upper`", "translation along y", "a support with y = 0"],
    );
}

/// A pressure that begins within an element: its quadrature misses up to a thousandth, which is balanced, and no more.
#[test]
fn loads_that_quadrature_puts_out_of_balance() {
    let pressed = |above: f64| {
        let load = |on: &str, value: f64| {
            format!("load = [{{ on = \"{on}\", pressure = \"{value} * (x > 0.23) * (x < 0.77)\" }}]")
        };
        let text = blocks([2, 1], &[&load("b1_bottom", 10.0), &load("b2_top", above)], &TWO);
        Scene::new(text.replace("n1 = 2, n2 = 3", "n1 = 16, n2 = 19"))
    };
    let missed = solve(pressed(10.0), &[]);
    lost(&missed, "underconstrained", &["bodies `b1` and `b2`", "translation along y"]);
    let share = missed
        .text("message")
        .split_once("work on it (")
        .and_then(|(_, rest)| rest.split(' ').next()?.parse::<f64>().ok());
    // the upper pressure that balances the lower one
    let share = share.expect("a share in per cent") / 100.0;
    let ratio = (1.0 + share) / (1.0 - share);
    let run = [ratio, ratio.recip()].map(|factor| solve(pressed(10.0 * factor), &[]));
    let run = run.into_iter().find(|run| run.code == 0).expect("one of them balances").converged();
    assert!(run.warnings().contains("they were changed by that share to balance"), "{}", run.warnings());
}

/// Two plates that three bolts clamp, as opposite forces on discs, and that nothing else holds.
const CLAMPED: &str = "SetFactory(\"OpenCASCADE\"); e = 1e-6;
Cylinder(1) = {0,0,-0.4, 0,0,0.4, 2}; Cylinder(2) = {0,0,0, 0,0,0.4, 2};
For s In {0:1}
  For k In {0:2}
    w = 2*Pi*k/3 + 0.2; Disk(100 + 10*s + k) = {1.3*Cos(w), 1.3*Sin(w), (2*s-1)*0.4, 0.35};
  EndFor
EndFor
BooleanFragments{ Volume{1}; Delete; }{ Surface{100:102}; Delete; }
BooleanFragments{ Volume{2}; Delete; }{ Surface{110:112}; Delete; }
Physical Volume(\"lower\") = {1}; Physical Volume(\"upper\") = {2}; low() = {}; up() = {};
For k In {0:2}
  w = 2*Pi*k/3 + 0.2; x = 1.3*Cos(w); y = 1.3*Sin(w); r = 0.36;
  low() += Surface In BoundingBox{x-r, y-r, -0.4-e, x+r, y+r, -0.4+e}; up() += Surface In BoundingBox{x-r, y-r, 0.4-e, x+r, y+r, 0.4+e};
EndFor
Physical Surface(\"lower_bolts\") = {low()}; Physical Surface(\"upper_bolts\") = {up()};
MeshSize{:} = 0.5;
";

/// They run on all meshes of an adaptation, whose discs have other chords on either side, as they do without one.
#[test]
fn balanced_bolts_are_enough_on_every_mesh() {
    let body = |name: &str, force: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 2e5\npoisson = 0.3\nload = [{{ on = \"{name}_bolts\", force = [0, 0, {force}] }}]\n"
        )
    };
    let scene = Scene::new(format!(
        "dimension = 3\nmesh = \"clamped.geo\"\n{}{}[[contact]]\nbetween = \"auto\"\ndistance = 0.1\nlayer = {{ power = {{ B = 1e-3, a = 0.5 }} }}\n",
        body("lower", 1e3),
        body("upper", -1e3)
    ));
    std::fs::write(scene.path.with_file_name("clamped.geo"), CLAMPED).expect("a script");
    for more in [&[][..], &["--tolerance", "0.25"]] {
        let run = solve(&scene, more).converged();
        assert!(run.warnings().contains("nothing holds them together"), "{}", run.warnings());
        assert!((run.forces(0)[0][2].abs() / 1e3 - 1.0).abs() < 0.05, "{}", run.said());
    }
}

/// A patch that is bonded and loaded along the bond: `check` ends as `solve` does, and both say that bonds carry no shear.
#[test]
fn a_bond_carries_no_shear() {
    let path = case("patch").display().to_string();
    let keys = ["body.1.fix=[]", "body.1.load=[{on='upper_face',traction=[1,0]}]"];
    for (bond, says) in [("contact.0.bond=true", true), ("contact.0.bond=false", false)] {
        let sets: Vec<&str> = keys.iter().chain([&bond]).flat_map(|set| ["--set", *set]).collect();
        for command in ["check", "solve"] {
            let run = winkler(&[&[command, &path][..], &sets].concat());
            assert_eq!(run.code, 1, "{command} {bond}: {}", run.said());
            let words = "a bond acts along the normal only and carries no shear";
            assert_eq!(run.stdout.contains(words), says, "{command} {bond}: {}", run.said());
        }
    }
}

/// Two blocks on a base slide, each under a force that nearly presses straight down: one line names both, with the larger lack of balance.
#[test]
fn bodies_with_the_same_motion_have_one_line() {
    const BLOCKS: &str = "SetFactory(\"OpenCASCADE\"); Rectangle(1) = {-5, -1, 0, 10, 1}; Rectangle(2) = {-4, 0, 0, 2, 1}; Rectangle(3) = {2, 0, 0, 2, 1};
        MeshSize {:} = 0.5; Physical Surface(\"base\") = {1}; Physical Surface(\"a\") = {2}; Physical Surface(\"b\") = {3};
        Physical Curve(\"foot\") = {1}; Physical Curve(\"top\") = {3}; Physical Curve(\"a_low\") = {5}; Physical Curve(\"b_low\") = {9};\n";
    let body = |name: &str, keys: &str| format!("[[body]]\nname = \"{name}\"\nyoung = 1e4\npoisson = 0.3\n{keys}\n");
    let contact = |on: &str| {
        format!("[[contact]]\nbetween = [\"top\", \"{on}\"]\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n")
    };
    let scene = Scene::new(format!(
        "dimension = 2\nmesh = \"blocks.geo\"\n{}{}{}{}{}",
        body("base", "fix = [{ on = \"foot\", x = 0, y = 0 }]"),
        body("a", "force = [1e-7, -1]"),
        body("b", "force = [3e-7, -1]"),
        contact("a_low"),
        contact("b_low"),
    ));
    std::fs::write(scene.path.with_file_name("blocks.geo"), BLOCKS).expect("a script");
    let run = solve(&scene, &[]).converged();
    let line = "bodies `a` and `b`: nothing holds each of them in its translation along x, and the loads lack balance there by up to 3.0e-07 of";
    assert!(run.warnings().contains(line) && run.warnings().matches("nothing holds").count() == 1, "{}", run.said());
}
