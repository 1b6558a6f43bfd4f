//! Scenes whose tables and rules stand for many bodies: they are those of single bodies, and what does not fit is refused.

use crate::common::{Run, Scene, root, solve, solve_on, text_of};
use std::fmt::Write;
use std::path::Path;

/// The wall of these tests: small, and no number of a brick begins another one's.
const SIZE: [&str; 4] = ["--set", "mesh.set.columns=3", "--set", "mesh.set.rows=3"];

/// The wall's script with a group for each side of each brick, in the temporary folder of the tests.
fn script() -> String {
    let text = std::fs::read_to_string(root().join("meshes/wall/wall.geo")).expect("the script of the wall");
    let named = |end: &str| format!("(Sprintf(StrCat(\"brick_\", parity(row % 2), \"_%g{end}\"), brick)) =");
    let surface = format!("Physical Surface{}", named(""));
    assert_eq!(text.matches(&surface).count(), 1);
    let mut groups = String::new();
    for (side, name) in ["bottom", "right", "top", "left"].iter().enumerate() {
        let _ = writeln!(groups, "Physical Curve{} {{c + {}}};", named(&format!("_{name}")), side + 1);
    }
    groups += &surface;
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sides.geo");
    // tests run at the same time: a script is there as a whole or not at all
    let own = path.with_extension(format!("{:?}", std::thread::current().id()));
    std::fs::write(&own, text.replace(&surface, &groups)).expect("a script");
    std::fs::rename(own, &path).expect("a script");
    path.display().to_string()
}

/// The scene of the wall on that script, with texts replaced.
fn wall(edits: &[(&str, &str)]) -> Scene {
    let mut text = text_of("wall");
    let geo = format!("{}/wall.geo", root().join("meshes/wall").display());
    for (from, to) in [(geo.as_str(), script().as_str())].iter().chain(edits) {
        assert_eq!(text.matches(from).count(), 1, "`{from}` must stand once in\n{text}");
        text = text.replace(from, to);
    }
    Scene::new(text)
}

fn solved(scene: &Scene, args: &[&str]) -> Run {
    solve(scene, &[&SIZE[..], args].concat()).converged()
}

/// A brick of the wall: its name, and where it begins and ends.
struct Brick {
    name: String,
    row: usize,
    from: f64,
    to: f64,
}

fn bricks() -> Vec<Brick> {
    let brick = |number: usize| {
        let (row, column) = (number / 3, number % 3);
        let (parity, shift) = if row % 2 == 0 { ("odd", 0.0) } else { ("even", 0.5) };
        let from = if column == 0 { 0.0 } else { column as f64 - shift };
        let to = if column == 2 { 3.0 } else { column as f64 + 1.0 - shift };
        Brick { name: format!("brick_{parity}_{}", number + 1), row, from, to }
    };
    (0..9).map(brick).collect()
}

/// The same wall with a table for each brick and each pair of sides.
fn one_by_one() -> Scene {
    let pattern = text_of("wall");
    let lines = |key: &str| pattern.lines().filter(|line| line.starts_with(key)).collect::<Vec<_>>();
    let mut text = format!(
        "dimension = 2\nplane = \"stress\"\nmesh = {{ geo = \"{}\", set = {{ columns = 3, rows = 3 }} }}\n",
        script()
    );
    let bricks = bricks();
    let load =
        lines("load")[0].strip_prefix("load = [").and_then(|rest| rest.strip_suffix(']')).expect("loads in a line");
    let (top, left) = load.split_once("}, ").expect("two loads");
    for brick in &bricks {
        let _ = writeln!(text, "[[body]]\nname = \"{}\"", brick.name);
        for key in ["order", "young", "poisson", "force"] {
            let _ = writeln!(text, "{}", lines(key)[0]);
        }
        let bottom = (brick.row == 0).then_some("{ on = \"bottom\", y = 0 }");
        let right = (brick.to == 3.0).then_some("{ on = \"right\", x = 0 }");
        let fix: Vec<_> = bottom.into_iter().chain(right).collect();
        let top = (brick.row == 2).then(|| format!("{top}}}"));
        let left = (brick.from == 0.0).then(|| left.to_owned());
        let load: Vec<_> = top.into_iter().chain(left).collect();
        let _ = writeln!(text, "fix = [{}]\nload = [{}]", fix.join(", "), load.join(", "));
    }
    let layers = lines("layer");
    for (i, a) in bricks.iter().enumerate() {
        for b in &bricks[i + 1..] {
            let head = a.row == b.row && a.to == b.from;
            let bed = a.row + 1 == b.row && a.from < b.to && b.from < a.to;
            let (sides, layer) = if head { (["right", "left"], layers[0]) } else { (["top", "bottom"], layers[1]) };
            if head || bed {
                let between = format!("[\"{}_{}\", \"{}_{}\"]", a.name, sides[0], b.name, sides[1]);
                let _ = writeln!(text, "[[contact]]\nbetween = {between}\n{layer}");
            }
        }
    }
    Scene::new(text)
}

/// Names of a pair's two bodies.
fn bodies(run: &Run, pair: usize) -> [String; 2] {
    [0, 1].map(|side| run.text(&format!("pairs/{pair}/bodies/{side}")).to_owned())
}

/// Pressures of a pair at places along it, sorted.
fn pressures(run: &Run, pair: usize) -> Vec<(f64, f64, f64)> {
    let table = run.contact_of(pair);
    let mut rows: Vec<_> =
        (0..table.rows()).map(|row| (table["x"][row], table["y"][row], table["pressure"][row])).collect();
    rows.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    rows
}

#[test]
fn patterns_are_the_bodies_one_by_one() {
    let (many, single) = (solved(&wall(&[]), &[]), solve(one_by_one(), &[]).converged());
    let names = |run: &Run| {
        run.report["bodies"]
            .as_array()
            .expect("bodies")
            .iter()
            .map(|body| body["name"].as_str().expect("a name").to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&many), names(&single));
    let pairs = |run: &Run| run.report["pairs"].as_array().expect("pairs").len();
    assert_eq!([pairs(&many), pairs(&single)], [6 + 2 * 5; 2]);
    let peak = (0..16).map(|pair| many.number(&format!("pairs/{pair}/peak_pressure"))).fold(0.0, f64::max);
    for pair in 0..16 {
        let own = bodies(&many, pair);
        let other = (0..16).find(|&other| bodies(&single, other) == own).unwrap_or_else(|| panic!("no {own:?}"));
        let (ours, theirs) = (pressures(&many, pair), pressures(&single, other));
        assert_eq!(ours.len(), theirs.len());
        for (a, b) in ours.iter().zip(&theirs) {
            assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12, "{own:?} {a:?} {b:?}");
            assert!((a.2 - b.2).abs() <= 1e-12 * peak, "{own:?}: {} and {}, peak {peak}", a.2, b.2);
        }
        // the report says which rule a pair comes from: head joints in a course, bed joints between two
        let head = own[0].split('_').nth(1) == own[1].split('_').nth(1);
        assert_eq!(many.count(&format!("pairs/{pair}/contact")), usize::from(!head));
        assert_eq!(single.count(&format!("pairs/{other}/contact")), other);
    }
    let settings = &many.report["settings"];
    assert_eq!(settings["body"].as_array().expect("tables").len(), 1);
    assert_eq!(settings["body"][0]["name"], "brick_*");
    assert_eq!(settings["contact"][1]["of"], serde_json::json!(["brick_odd_*", "brick_even_*"]));
}

/// A scene on the same script in which tables and rules meet.
fn meeting() -> Scene {
    let text = r#"
dimension = 2
plane = "stress"
mesh = { geo = "SCRIPT", set = { columns = 3, rows = 3 } }

[[contact]]
between = "auto"
distance = 0.01
layer = { linear = { stiffness = 2e3 } }

[[contact]]
between = "auto"
of = ["brick_odd_9", "brick_odd_?"]
distance = 0.01
layer = { linear = { stiffness = 1e3 } }

[[contact]]
between = ["brick_odd_1_right", "brick_odd_2_left"]
layer = { linear = { stiffness = 3e3 } }

[[body]]
name = "brick_*"
order = 1
young = 1e4
poisson = 0.2
fix = [{ on = "right", x = 0 }]
spring = [{ on = "{body}_righ?", normal = 1 }]
load = [{ on = "brick_even_4_left", pressure = 0.1 }]

[[body]]
name = "brick_odd_*"
young = 1e4
poisson = 0.2
order = 2
fix = [{ on = "bottom", y = 0 }, { on = "*_[1-3]_bo*", x = 0 }]
load = [{ on = "top", traction = [0, -0.5] }, { on = "{body}_left", force = [1e-3, 0] }]

[[body]]
name = "brick_odd_9"
order = 1
young = 1e4
poisson = 0.2
fix = [{ on = "*_9_right", symmetry = true }]
load = [{ on = "top", force = [0, -0.1] }]
"#;
    Scene::new(text.replace("SCRIPT", &script()))
}

#[test]
fn the_last_table_and_rule_win() {
    let sets = ["--set", "body.brick_*.load.0.pressure=0.2", "--set", "body.2.young=2e4", "--set", "solver=hypre"];
    let run = solved(&meeting(), &[&sets[..], &["-brick_odd_9_ksp_type", "gmres"]].concat());
    let body = |k: usize, path: &str| {
        run.report.pointer(&format!("/bodies/{k}{path}")).unwrap_or_else(|| panic!("{path}")).clone()
    };
    let names = ["even_4", "even_5", "even_6", "odd_1", "odd_2", "odd_3", "odd_7", "odd_8", "odd_9"];
    for (k, name) in names.iter().enumerate() {
        assert_eq!(body(k, "/name"), format!("brick_{name}"));
        // 4 x 2 squares in two triangles each, at the ends of even courses half as many and half as many again
        let nodes = [3 * 3, 5 * 3, 7 * 3, 9 * 5, 9 * 5, 9 * 5, 9 * 5, 9 * 5, 5 * 3];
        assert_eq!(body(k, "/nodes"), nodes[k], "{name}");
        let on = |list: &str| -> Vec<String> {
            let list = body(k, &format!("/balance/{list}"));
            list.as_array()
                .expect("a list")
                .iter()
                .map(|force| force["on"].as_str().expect("a name").to_owned())
                .collect()
        };
        let supports = match *name {
            "even_6" => vec!["right".to_owned()],
            "odd_1" | "odd_2" | "odd_3" => vec!["bottom".to_owned(), format!("brick_{name}_bottom")],
            "odd_9" => vec!["brick_odd_9_right".to_owned()],
            _ => vec![],
        };
        assert_eq!(on("supports"), supports, "{name}");
        assert_eq!(on("springs"), if k < 3 { vec![format!("brick_{name}_right")] } else { vec![] });
        let solver = body(k, "/solver");
        assert_eq!(solver.as_str().expect("words").contains("gmres"), *name == "odd_9", "{name}: {solver}");
        let load = [0, 1].map(|c| body(k, &format!("/balance/loads/force/{c}")).as_f64().expect("a number"));
        let expected = match *name {
            "even_4" => [0.2 * 0.125, 0.0],
            "even_5" | "even_6" => [0.0; 2],
            "odd_1" | "odd_2" | "odd_3" => [1e-3, 0.0],
            "odd_9" => [0.0, -0.1],
            _ => [1e-3, -0.5 * 0.25],
        };
        assert!((0..2).all(|c| (load[c] - expected[c]).abs() < 1e-14), "{name}: {load:?}");
    }
    for pair in 0..16 {
        let rule = match bodies(&run, pair).each_ref().map(|name| name.trim_start_matches("brick_")) {
            ["odd_1", "odd_2"] => 2,
            ["odd_8", "odd_9"] => 1,
            _ => 0,
        };
        assert_eq!(run.count(&format!("pairs/{pair}/contact")), rule, "{:?}", bodies(&run, pair));
    }
    assert!(run.report["pairs"].as_array().is_some_and(|pairs| pairs.len() == 16));
}

/// A region of a table's bodies is that of those in which its cells lie, as if they had tables of their own.
#[test]
fn regions_lie_in_their_bodies() {
    let core = Path::new(env!("CARGO_TARGET_TMPDIR")).join("core.geo");
    let text = std::fs::read_to_string(root().join("meshes/wall/wall.geo")).expect("the script of the wall");
    std::fs::write(&core, text + "Physical Surface(\"core\") = {1, 5};\n").expect("a script");
    let text = text_of("wall");
    let geo = root().join("meshes/wall/wall.geo").display().to_string();
    let text = text.replace(&geo, &core.display().to_string());
    let line = "poisson = 0.15\n";
    let with_region =
        text.replacen(line, &format!("{line}region = [{{ on = \"core\", young = 3e4, poisson = 0.3 }}]\n"), 1);
    let from = text.find("[[body]]").expect("a table");
    let to = text.find("[[contact]]").expect("another");
    let own = |name: &str| {
        text[from..to].replace("\"brick_*\"", &format!("\"{name}\"")).replace("1e4", "3e4").replace("0.15", "0.3")
    };
    // the one below lies on `bottom` and `left`, the other on nothing
    let below = own("brick_odd_1").replace("{ on = \"top\", pressure = \"0.5 * (1 + cos(pi*x))\" }, ", "");
    let below = below.replace(", { on = \"right\", x = 0 }", "");
    let inside = own("brick_even_5");
    let inside: String = inside
        .lines()
        .filter(|line| !line.starts_with("fix") && !line.starts_with("load"))
        .fold(String::new(), |all, line| all + line + "\n");
    let with_tables = format!("{}{below}{inside}{}", &text[..to], &text[to..]);
    let [region, tables] = [with_region, with_tables].map(|text| solved(&Scene::new(text), &[]));
    let peaks = |run: &Run| -> Vec<([String; 2], f64)> {
        let peak = |pair: usize| {
            let mut names = bodies(run, pair);
            names.sort();
            (names, run.number(&format!("pairs/{pair}/peak_pressure")))
        };
        let mut peaks: Vec<_> = (0..16).map(peak).collect();
        peaks.sort_by(|a, b| a.0.cmp(&b.0));
        peaks
    };
    for (a, b) in peaks(&region).iter().zip(&peaks(&tables)) {
        assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
    }
}

/// A group lies on a body that has a whole element of it, not on one that shares a corner alone.
#[test]
fn a_shared_corner_is_no_group() {
    let script = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared.geo");
    let text = "For x In {0 : 2}\nPoint(1 + x) = {x, 0, 0};\nPoint(11 + x) = {x, 1, 0};\nLine(1 + x) = {1 + x, 11 + x};\nEndFor\n\
                For x In {1 : 2}\nLine(10 + x) = {x, x + 1};\nLine(20 + x) = {10 + x, 11 + x};\n\
                Curve Loop(x) = {10 + x, x + 1, -(20 + x), -x};\nPlane Surface(x) = {x};\n\
                Physical Surface(Sprintf(\"cell_%g\", x)) = {x};\nPhysical Curve(Sprintf(\"bottom_%g\", x)) = {10 + x};\nEndFor\n\
                Physical Curve(\"left\") = {1};\nPhysical Curve(\"right\") = {3};\nTransfinite Curve {1 : 3, 11, 12, 21, 22} = 3;\n";
    std::fs::write(&script, text).expect("a script");
    let scene = Scene::new(format!(
        "dimension = 2\nmesh = \"{}\"\n[[body]]\nname = \"cell_*\"\norder = 1\nyoung = 1\npoisson = 0\n\
         fix = [{{ on = \"bottom_?\", x = 0 }}, {{ on = \"{{body}}\", y = 0 }}]\nload = [{{ on = \"right\", pressure = 1e-3 }}]\n\
         [[contact]]\nbetween = \"auto\"\ndistance = 0.1\nlayer = {{ linear = {{ stiffness = 1 }} }}\n",
        script.display()
    ));
    let run = solve(&scene, &[]).converged();
    let on = |body: usize, k: usize| run.report.pointer(&format!("/bodies/{body}/balance/supports/{k}/on")).cloned();
    assert_eq!([on(0, 0), on(0, 1), on(0, 2)], [Some("bottom_1".into()), Some("cell_1".into()), None]);
    assert_eq!([on(1, 0), on(1, 1), on(1, 2)], [Some("bottom_2".into()), Some("cell_2".into()), None]);
}

#[test]
fn what_does_not_fit_is_refused() {
    // what is replaced, by what, and words of the line that the message points to if it is another one
    let cases: &[(&str, &str, &str, &[&str])] = &[
        ("\"brick_*\"", "\"brik_*\"", "", &["no group of cells matches `brik_*`", "brick_odd_1, brick_odd_2"]),
        (
            "\"brick_odd_9\"\norder",
            "\"brick_odd_*_9\"\norder",
            "name = \"brick_odd_*_9",
            &["no group of cells matches `brick_odd_*_9`"],
        ),
        (
            "name = \"brick_odd_9\"",
            "name = \"brick_*_*\"",
            "name = \"brick_*\"",
            &[
                "all bodies of `brick_*`, such as `brick_odd_1`, belong to later tables",
                "let the table of few bodies follow",
            ],
        ),
        ("\"brick_*\"", "\"brick_**\"", "", &["`brick_**` is no pattern"]),
        ("\"*_[1-3]_bo*\"", "\"*_[4-6]_bo*\"", "", &["no group for this support matches", "brick_odd_1_bottom"]),
        ("_righ?\"", "_nowhere\"", "", &["spring matches `{body}_nowhere` on `brick_*`", "brick_even_4_bottom"]),
        ("on = \"bottom\"", "on = \"botom\"", "", &["the mesh has no ", "`botom`", "did you mean `bottom`?"]),
        ("on = \"bottom\"", "on = \"brick_even_4_top\"", "", &["lies on no body of `brick_odd_*`", "bottom"]),
        ("traction = [0, -0.5]", "force = [0, -0.5]", "", &["a total force or moment on 2 surfaces", "{body}_top"]),
        ("of = [\"brick_odd_9\"", "of = [\"brick_odd_x*\"", "", &["no body matches `brick_odd_x*`", "brick_even_4, "]),
        (
            "of = [\"brick_odd_9\"",
            "of = [\"brick_odd_1\"",
            "",
            &["no facets of brick_odd_1 - brick_odd_? face", "later rules"],
        ),
        ("\"brick_odd_1_right\"", "\"brick_*_right\"", "", &["the pattern `brick_*_right` for one surface", "of = ["]),
        ("\"brick_odd_1_right\"", "\"brick_odd_1_left\"", "", &["do not face each other"]),
    ];
    for (from, to, at, words) in cases {
        assert_eq!(meeting().text.matches(from).count(), 1, "{from}");
        let scene = Scene::new(meeting().text.replace(from, to));
        let line = scene.line_of(if at.is_empty() { to } else { at });
        refused(&scene, line, words);
    }
}

/// Asserts that a scene is refused in one message, with the place and these words.
fn refused(scene: &Scene, line: usize, words: &[&str]) {
    let run = solve(scene, &[]);
    assert_eq!(run.code, 3, "{}", run.said());
    assert_eq!(run.stderr.lines().filter(|line| line.starts_with("error")).count(), 1, "{}", run.said());
    let place = format!("{}:{line}:", scene.path.display());
    for word in words.iter().chain(&[place.as_str(), "^"]) {
        assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
    }
}

/// A block in the corner of a bracket: in the plane, or in space with the thickness `t`.
const CORNER: &str = "SetFactory(\"OpenCASCADE\"); e = 1e-3;
DefineConstant[ t = 0 ];
Rectangle(1) = {-1, -1, 0, 3, 1}; Rectangle(2) = {-1, 0, 0, 1, 2};
BooleanUnion(3) = { Surface{1}; Delete; }{ Surface{2}; Delete; };
Rectangle(4) = {0, 0, 0, 2, 2};
If(t > 0)
  Extrude{0, 0, t} { Surface{3}; } Extrude{0, 0, t} { Surface{4}; }
  Physical Volume(\"bracket\") = {1}; Physical Volume(\"block\") = {2};
  Physical Surface(\"seat\") = Abs(Boundary{ Volume{1}; }); Physical Surface(\"skin\") = Abs(Boundary{ Volume{2}; });
  Physical Surface(\"top\") = {Surface In BoundingBox{-e, 2-e, -e, 2+e, 2+e, t+e}}; Physical Surface(\"right\") = {Surface In BoundingBox{2-e, -e, -e, 2+e, 2+e, t+e}};
Else
  Physical Surface(\"bracket\") = {3}; Physical Surface(\"block\") = {4};
  Physical Curve(\"seat\") = Abs(Boundary{ Surface{3}; }); Physical Curve(\"skin\") = Abs(Boundary{ Surface{4}; });
  Physical Curve(\"top\") = {Curve In BoundingBox{-e, 2-e, -e, 2+e, 2+e, e}}; Physical Curve(\"right\") = {Curve In BoundingBox{2-e, -e, -e, 2+e, 2+e, e}};
EndIf
MeshSize{:} = 0.7;
";

/// A scene beside its script.
fn beside(script: &str, text: &str) -> Scene {
    let scene = Scene::new(text);
    std::fs::write(scene.path.with_file_name("part.geo"), script).expect("a script");
    scene
}

/// The block in the corner, with `contact` in the table of the contact.
fn in_corner(dimension: usize, order: usize, contact: &str) -> Scene {
    let (t, z) = if dimension == 3 { (1, ", z = 0") } else { (0, "") };
    let fixed = if dimension == 3 { "fix = [{ on = \"block\", z = 0 }]" } else { "" };
    let text = format!(
        "dimension = {dimension}\nmesh = {{ geo = \"part.geo\", set = {{ t = {t} }} }}
[[body]]\nname = \"bracket\"\norder = {order}\nyoung = 1e5\npoisson = 0\nfix = [{{ on = \"bracket\", x = 0, y = 0{z} }}]
[[body]]\nname = \"block\"\norder = {order}\nyoung = 1e5\npoisson = 0\n{fixed}
load = [{{ on = \"top\", pressure = 10 }}, {{ on = \"right\", pressure = 4 }}]
[[contact]]\n{contact}\nlayer = {{ linear = {{ stiffness = 1e4 }} }}\n"
    );
    beside(CORNER, &text)
}

/// Largest difference of the pressures on a face of the only pair from `exact`; the table has no faces if there is one.
fn off(run: &Run, face: f64, exact: f64) -> f64 {
    let table = run.contact();
    let faces =
        if table.names.iter().any(|name| name == "face") { table["face"].to_vec() } else { vec![1.0; table.rows()] };
    let of_face = faces.iter().zip(&table["pressure"]).filter(|(of, _)| **of == face);
    of_face.map(|(_, p)| (p - exact).abs()).reduce(f64::max).expect("points on the face")
}

#[test]
fn a_surface_with_an_edge_is_one_pair_with_normals_of_its_faces() {
    let named = |a: &str, b: &str| format!("between = [\"{a}\", \"{b}\"]");
    let auto = "between = \"auto\"\ndistance = 0.1".to_owned();
    for (dimension, order, ranks, contact) in [
        (2, 1, 1, auto.clone()),
        (2, 2, 2, auto.clone()),
        (2, 1, 2, named("seat", "skin")),
        (2, 2, 1, named("skin", "seat")),
        (3, 1, 1, auto),
        (3, 2, 2, named("skin", "seat")),
    ] {
        let run = solve_on(ranks, in_corner(dimension, order, &contact), &["--method", "newton"]).converged();
        let case = format!("{dimension} {order} {contact}\n{}", run.said());
        assert_eq!(run.report["pairs"].as_array().map(Vec::len), Some(1), "{case}");
        // the wall comes first, since its middle has the smaller x
        for (face, pressure) in [(1.0, 4.0), (2.0, 10.0)] {
            assert!(off(&run, face, pressure) < 1e-7, "{case}");
        }
    }
    // with one normal over the edge pressures are wrong
    let whole = solve(in_corner(2, 1, "between = [\"seat\", \"skin\"]\nedge = 180"), &[]).converged();
    assert!(off(&whole, 1.0, 10.0) > 1.0);
}

/// A stamp of radius 0.2 that begins 0.5 above a plate, as a body of revolution.
const FAR: &str = "Point(1) = {0,0,0,.1}; Point(2) = {3,0,0,.5}; Point(3) = {3,-3,0,.5}; Point(4) = {0,-3,0,.5};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1}; Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Point(11) = {0,.5,0,.08}; Point(12) = {.2,.5,0,.08}; Point(13) = {.2,1.5,0,.2}; Point(14) = {0,1.5,0,.2};
Line(11) = {11,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,11}; Curve Loop(2) = {11:14}; Plane Surface(2) = {2};
Physical Surface(\"plate\") = {1}; Physical Surface(\"stamp\") = {2};
Physical Curve(\"top\") = {1}; Physical Curve(\"floor\") = {3}; Physical Curve(\"tip\") = {11}; Physical Curve(\"side\") = {12}; Physical Curve(\"back\") = {13};
";

#[test]
fn named_surfaces_are_found_at_any_distance() {
    let scene = |contact: &str| {
        let text = format!(
            "dimension = 2\nplane = \"axisymmetric\"\nmesh = \"part.geo\"
[[body]]\nname = \"plate\"\norder = 1\nyoung = 1e5\npoisson = 0.3\nfix = [{{ on = \"floor\", y = 0 }}]
[[body]]\nname = \"stamp\"\norder = 1\nyoung = 1e5\npoisson = 0.3\nfix = [{{ on = \"back\", x = 0, y = -0.501 }}]
[[contact]]\n{contact}\nlayer = {{ linear = {{ stiffness = 1e7 }} }}\n"
        );
        beside(FAR, &text)
    };
    let found = solve(scene("between = \"auto\"\ndistance = 0.8"), &[]).converged();
    for names in ["between = [\"top\", \"tip\"]", "between = [\"tip\", \"top\"]"] {
        let run = solve(scene(names), &[]).converged();
        let [ours, theirs] = [&run, &found].map(|run| run.forces(0)[0][1].abs());
        assert!((ours - theirs).abs() < 1e-6 * theirs && theirs > 1.0, "{ours} {theirs}");
    }
    for (contact, reason) in [
        (
            "between = [\"top\", \"tip\"]\ndistance = 0.3",
            &["the gap is 0.500000 and", "at 0 degrees", "larger `distance`"][..],
        ),
        ("between = [\"top\", \"back\"]", &["no facet of one lies before a facet of the other"][..]),
        ("between = [\"floor\", \"back\"]", &["the gap is -"][..]),
        ("between = [\"top\", \"side\"]", &["no facet of one lies before a facet of the other"][..]),
    ] {
        let run = solve(scene(contact), &[]);
        assert_eq!(run.code, 3, "{}", run.said());
        reason.iter().for_each(|word| assert!(run.stderr.contains(word), "{contact}: no `{word}`\n{}", run.said()));
    }
}

/// A shaft of radius 1.002 in the bore of radius 1 of a ring, with `n` and `m` chords around.
const FIT: &str = "DefineConstant[ n = 16, m = 24 ];
Macro Ring
  Point(k) = {0,0,0}; Point(k+1) = {r,0,0}; Point(k+2) = {0,r,0}; Point(k+3) = {-r,0,0}; Point(k+4) = {0,-r,0};
  Circle(k) = {k+1,k,k+2}; Circle(k+1) = {k+2,k,k+3}; Circle(k+2) = {k+3,k,k+4}; Circle(k+3) = {k+4,k,k+1};
  Transfinite Curve{k:k+3} = c/4 + 1; Curve Loop(k) = {k:k+3};
Return
k = 100; r = 0.5; c = n; Call Ring;
k = 200; r = 1.002; c = n; Call Ring;
k = 300; r = 1; c = m; Call Ring;
k = 400; r = 2; c = m; Call Ring;
Plane Surface(1) = {200, 100}; Plane Surface(2) = {400, 300};
Physical Surface(\"shaft\") = {1}; Physical Surface(\"ring\") = {2};
Physical Curve(\"skin\") = {200:203}; Physical Curve(\"bore\") = {300:303}; Physical Curve(\"rim\") = {400:403};
";

/// Chords of 16 leave their circle by 1 - cos(pi/16) = 0.0192, ten times the overlap.
#[test]
fn an_overlap_of_facets_is_told() {
    let warned = |order: usize, set: &str, contact: &str| {
        let text = format!(
            "dimension = 2\nmesh = {{ geo = \"part.geo\", set = {set} }}
[[body]]\nname = \"shaft\"\norder = {order}\nyoung = 2e5\npoisson = 0.3
[[body]]\nname = \"ring\"\norder = {order}\nyoung = 2e5\npoisson = 0.3\nfix = [{{ on = \"rim\", x = 0, y = 0 }}]
[[contact]]\nbetween = [\"skin\", \"bore\"]\n{contact}\nlayer = {{ linear = {{ stiffness = 1e7 }} }}\n"
        );
        let warnings = solve(beside(FIT, &text), &["--method", "newton"]).converged().warnings();
        warnings.lines().find(|line| line.contains("straight facets leave")).map(str::to_owned)
    };
    let line = warned(1, "{}", "").expect("a warning");
    assert!(
        line.contains("by up to 1.9") && line.contains("e-02, and the overlap is ") && line.contains("touching = true"),
        "{line}"
    );
    // the number in `touching`, quadratic facets, and facets that match make pressures that are those of the circle
    assert_eq!(warned(1, "{}", "touching = true\ngap = -0.002"), None);
    assert_eq!(warned(2, "{}", ""), None);
    assert_eq!(warned(1, "{ n = 16, m = 16 }", ""), None);
}

/// Two grains of a tessellation: a pair of faces that the search has found has no common piece with the normals of its own, and is left out.
#[test]
fn found_pairs_without_a_common_piece_are_left_out() {
    let text = "dimension = 3\nmesh = \"part.geo\"
[[body]]\nname = \"grain_*\"\norder = 1\nyoung = 1e4\npoisson = 0.3
[[contact]]\nbetween = \"auto\"\ndistance = 0.01\nlayer = { linear = { stiffness = 1e9 } }\n";
    let scene = beside(include_str!("shapes/grains.geo"), text);
    let check = crate::common::winkler(&["check", scene.path.to_str().expect("a path")]);
    assert!(check.code == 0 && check.stdout.matches("contact grain_16 - grain_17").count() == 1, "{}", check.said());
}
