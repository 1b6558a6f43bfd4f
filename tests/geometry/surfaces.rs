//! Data of files as functions of a scene, through the whole program.

use crate::common::{Run, Scene, solve, solve_on, text_of, winkler};
use std::fs;
use winkler::api::load;

/// A bilinear function on 4 x 4 points three apart, from -1 on, as a file.
fn bilinear(value: impl Fn(f64, f64) -> f64) -> String {
    let place = |k: usize| -1.0 + 3.0 * k as f64;
    let row = |j: usize| (0..4).map(|i| format!("{:e}", value(place(i), place(j)))).collect::<Vec<_>>().join(",");
    (0..4).map(|j| row(j) + "\n").collect()
}

/// Two blocks whose gap, layer, modulus and load vary; `fields` are these, in this order.
fn blocks(data: &str, fields: [&str; 4]) -> Scene {
    let [gap, layer, young, load] = fields;
    let text = text_of("patch-2d")
        .replacen("young = 2.1e5", &format!("young = \"{young}\""), 1)
        .replace("pressure = 10", &format!("pressure = \"{load}\""))
        .replace("B = 2.5e-5", &format!("B = \"{layer}\""))
        .replace("layer =", &format!("gap = \"{gap}\"\nlayer ="))
        .replace("[[contact]]", &format!("{data}\n[[contact]]"));
    Scene::new(text)
}

/// Scene whose fields come from files beside it.
fn measured() -> Scene {
    let grid =
        |name: &str| format!("[data.{name}]\nfile = \"{name}.csv\"\norigin = -1\nspacing = 3\noutside = \"clamp\"\n");
    let modulus = "[data.E]\nfile = \"E.txt\"\norigin = -1\nspacing = 3\nunit = 1e5\n";
    let data = ["g", "b", "q"].map(grid).join("\n") + "\n" + modulus;
    let scene = blocks(&data, ["1e-5*g(x, y)", "b(x, 2*y)", "E(x, y)", "q(x)"]);
    let folder = scene.path.parent().expect("a folder");
    for (name, text) in [
        ("g.csv", bilinear(|x, y| 1.0 + x + 0.5 * x * y)),
        ("b.csv", bilinear(|x, y| 2.5e-5 * (1.0 + 0.2 * x + 0.1 * y))),
        ("q.csv", "7,10,13,16\n".to_owned()),
        ("E.txt", bilinear(|x, y| 2.0 + 0.3 * x - 0.2 * y)),
    ] {
        fs::write(folder.join(name), text).expect("a file");
    }
    scene
}

/// The same typed in.
const TYPED: [&str; 4] = ["1e-5*(1 + x + 0.5*x*y)", "2.5e-5*(1 + 0.2*x + 0.2*y)", "1e5*(2 + 0.3*x - 0.2*y)", "8 + x"];

fn agree(one: &Run, other: &Run, within: f64) {
    let (a, b) = (one.contact(), other.contact());
    for q in 0..a.rows() {
        let (p, r) = (a["pressure"][q], b["pressure"][q]);
        assert!((p - r).abs() < within * r.abs(), "point {q}: {p} {r}");
    }
}

/// Gap, layer, modulus and load from files give what the same functions typed in give, on any number of ranks.
#[test]
fn data_are_functions_of_every_expression() {
    let scene = measured();
    let ours = solve(&scene, &[]).converged();
    let typed = solve(blocks("", TYPED), &[]).converged();
    assert!(typed.contact()["pressure"].iter().any(|p| (p / 10.0 - 1.0).abs() > 1e-2), "a scene where all that counts");
    agree(&ours, &typed, 1e-9);
    agree(&solve_on(2, &scene, &[]).converged(), &ours, 1e-9);
    assert_eq!(ours.text("settings/data/E/interpolate"), "linear");
    // other keys by overrides
    let doubled = solve(&scene, &["--set", "data.q.unit=2", "--set", "data.q.interpolate=cubic"]).converged();
    let load = format!("body.upper.load.0.pressure=2*({})", TYPED[3]);
    agree(&doubled, &solve(blocks("", TYPED), &["--set", &load]).converged(), 1e-9);
}

/// A run goes on only with the same numbers, wherever they are; files that nothing asks for count nothing and are not read.
#[test]
fn contents_are_part_of_the_scene() {
    let scene = measured();
    let digest = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        load(&scene.path, &sets).unwrap_or_else(|error| panic!("{error}")).problem().to_string()
    };
    let folder = scene.path.parent().expect("a folder");
    let first = digest(&[]);
    fs::copy(folder.join("g.csv"), folder.join("copy.csv")).expect("a copy");
    assert_eq!(digest(&["data.g.file=copy.csv"]), first);
    assert_ne!(digest(&["data.g.outside=error"]), first);
    fs::write(folder.join("g.csv"), bilinear(|x, y| 1.0 + x + 0.501 * x * y)).expect("a file");
    assert_ne!(digest(&[]), first);
    fs::write(folder.join("g.csv"), "no numbers at all").expect("a file");
    assert_ne!(digest(&["contact.0.gap=0"]), first);
}

/// One message that names data, place, body or pair; exit code of a scene.
#[test]
fn places_without_a_value_are_refused() {
    let scene = measured();
    for (set, words) in [
        (
            "contact.0.gap=g(x + 20, y)",
            ["the gap: data `g` have no value at (20, 1)", "contact of `lower_top` and `upper_bottom`", "outside ="],
        ),
        (
            "contact.0.layer.power.B=b(x, -5)",
            ["B: data `b` have no value at (0, -5)", "contact of `lower_top` and `upper_bottom`", ""],
        ),
        (
            "contact.0.layer={pressure=\"1e5*c*q(30)\"}",
            ["pressure of the layer: data `q` have no value at (30)", "contact of `lower_top`", ""],
        ),
        ("body.lower.young=E(x, 99 + y)", ["young: data `E` have no value at (", "for body `lower`", "\"clamp\""]),
        ("body.upper.load.0.pressure=q(x - 9)", ["this load: data `q` have no value at (-", "for body `upper`", ""]),
        ("body.upper.force=[0, \"q(-3)\"]", ["the expression: data `q` have no value at (-3)", "", ""]),
        (
            "body.upper.fix.0.x=q(x - 9)",
            ["the displacement of this support: data `q` have no value", "for body `upper`", ""],
        ),
    ] {
        let sets = ["data.g.outside=error", "data.b.outside=error", "data.q.outside=error", set];
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let run = solve(&scene, &sets);
        assert_eq!(run.code, 3, "{set}: {}", run.said());
        assert_eq!(run.stderr.matches("error:").count(), 1, "{}", run.said());
        words.iter().for_each(|word| assert!(run.stderr.contains(word), "{word}: {}", run.said()));
    }
}

#[test]
fn slips_in_data_are_pointed_at() {
    let scene = measured();
    let path = scene.path.display().to_string();
    for (sets, words) in [
        (&["data.g.file=missing.csv"][..], "there is no file"),
        (&["data.g.file=."], "is not a file"),
        (&["data.g.filee=g.csv"], "did you mean `file`?"),
        (&["data.g.spacing=0"], "the spacing is 0"),
        (&["data.g.spacing=[1, 2, 3]"], "one number, or two in a list"),
        (&["data.g.unit=0"], "the unit is 0"),
        (&["data.g.outside=wrap"], "it is one of error, clamp, periodic"),
        (&["data.g.interpolate=spline"], "it is one of linear, cubic"),
        (&["data.h.file=g.csv"], "[data.h] has no `spacing`"),
        (&["data.x={file=\"g.csv\",spacing=1}"], "data cannot be called `x`"),
        (&["data.a-b={file=\"g.csv\",spacing=1}"], "data cannot be called `a-b`"),
        (&["data.file=g.csv"], "write [data.rough]"),
        (&["contact.0.gap=g(x)"], "`g` takes 2 values, not 1"),
        (&["contact.0.gap=q(x, y)"], "`q` takes 1 value, not 2"),
        (&["contact.0.gap=g"], "`g` needs its value in parentheses"),
        (&["contact.0.gap=gg(x, y)"], "did you mean `g`?"),
        (&["data.g.points=true"], "scripts/library/heights.py"),
        (&["data.g.missing=-9999"], "scripts/library/heights.py"),
        (&["data.g.fill=linear"], "scripts/library/heights.py"),
        (&["data.g.detrend=parabola"], "scripts/library/heights.py"),
        (&["contact.0.layer={asperities={}}"], "scripts/library/asperities.py"),
    ] {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let run = winkler(&["check", &path].into_iter().chain(sets).collect::<Vec<_>>());
        assert_eq!(run.code, 3, "{}", run.said());
        assert!(run.stderr.contains(words), "{words}: {}", run.said());
    }
}
