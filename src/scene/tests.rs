use super::*;
use crate::error::caret;
use crate::expression::Field;
use crate::problem::{
    BodySpec, Constants, Gamma, LayerSpec, LoadKind, MeshSource, MethodName, Order, Plane, Preset, RobinRule,
    SolverSpec, Start, StopRule, Zone,
};

/// The scene of docs/scene-file.md, and its mesh file beside it.
const GROOVE: &str = r#"title = "Groove with a nonlinear Winkler layer"
dimension = 2                                   # plane strain
mesh = { geo = "groove.geo", set = { n = 32 } }

[[body]]
name = "lower"
young = 2.1e5
poisson = 0.3
order = 1
fix  = [{ on = "lower_axis", x = 0 }, { on = "lower_end", x = 0, y = 0 }]
load = [{ on = "lower_face", pressure = 10 }]

[[body]]
name = "upper"
young = 210000
poisson = 0.3
force = [0, "-9.81e-6 * (1 + y)"]
load = [{ on = "upper_face", traction = ["2*x", -10] }]

[[contact]]
between = ["lower_top", "upper_bottom"]
gap = "5e-4 * max(0, 1 - (x - 4)^2)^1.5"
layer = { power = { B = 2.5e-5, a = 0.5 } }

[method]
psi = "active"
gamma = 0.7
start = { normal = 1e-4 }
stop = { increment = 1e-3 }
"#;

/// Loads a text as `scene.toml`, with `groove.geo` and `groove.msh` beside it.
fn load_text(text: &str, overrides: &[&str]) -> Result<Scene> {
    load_with(text, overrides, &Flags::default())
}

fn load_with(text: &str, overrides: &[&str], flags: &Flags) -> Result<Scene> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("scene.toml", text), ("groove.geo", ""), ("groove.msh", "")] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let overrides: Vec<_> = overrides.iter().map(|text| text.to_string()).collect();
    parse(&folder.path().join("scene.toml"), text.to_owned(), &overrides, flags)
}

/// The constants of an isotropic, homogeneous body.
fn isotropic(body: &BodySpec) -> (f64, f64) {
    match &body.elasticity().constants {
        Constants::Isotropic { young: Field::Constant(young), poisson: Field::Constant(poisson) } => (*young, *poisson),
        other => panic!("{other:?}"),
    }
}

#[test]
fn defaults_and_a_scene_in_space() {
    let text = "dimension = 3\nmesh = 'groove.msh'\n[[body]]\nname='a1'\nyoung=1\npoisson=0\norder=2\nforce=['z',0,1]\n\
                fix=[{on='s',z=0.5}]\n[solver]\npreset='hypre'\n[output]\ndir='out'\nvtu=true\n";
    let scene = load_text(text, &[]).unwrap();
    assert_eq!(scene.title, "scene");
    assert!(matches!(&scene.mesh, MeshSource::Msh { .. }));
    assert_eq!(scene.bodies[0].order, Some(Order::P2));
    assert!(matches!(scene.bodies[0].fix[0].components(), [None, None, Some(Field::Constant(0.5))]));
    assert_eq!(scene.bodies[0].force.as_ref().unwrap()[0].eval([1.0, 2.0, 3.0]), 3.0);
    assert!(scene.contacts.is_empty());
    assert!(matches!(scene.method.start, Start::Auto));
    assert_eq!((scene.method.name, scene.method.robin), (MethodName::Auto, RobinRule::Auto));
    assert!(matches!(scene.method.gamma, Gamma::Stationary(0.6)));
    assert_eq!(scene.method.stop, StopRule { residual: Some(1e-8), increment: None, iterations: 2000 });
    assert_eq!(scene.solver, SolverSpec { preset: Some(Preset::Hypre) });
    assert_eq!(scene.output, OutputSpec { dir: Some("out".into()), vtu: true, ..OutputSpec::default() });
}

#[test]
fn overrides_replace_and_add() {
    let scene = load_text(
        GROOVE,
        &[
            "body.1.young=1e5",
            "body.upper.order=2",
            "body.1.load.0.traction=[1, 2]",
            "contact.0.layer = {linear={stiffness=1}}",
            "contact.0.gap=1e-4 * x",
            "contact.0.reference='1 - x'",
            "method.psi=x > 1 && k < 5",
            "method.stop.residual=1e-6",
            "mesh.set.n=64",
            "mesh.set.m = 2",
            "solver=mumps",
            "solver.preset=hypre",
            "output.vtu=true",
            "title=Ein anderer Titel",
            "plane=stress",
            "method.gamma=0.1",
            "method.gamma=0.2",
        ],
    )
    .unwrap();
    assert_eq!(isotropic(&scene.bodies[1]).0, 1e5);
    assert_eq!([0, 1].map(|body| scene.bodies[body].order), [Order::P1, Order::P2].map(Some));
    assert_eq!(scene.bodies[1].elasticity().place.source.name, "--set");
    let LoadKind::Traction(traction) = &scene.bodies[1].load[0].kind else { panic!() };
    assert_eq!(traction[1].eval([0.0; 3]), 2.0);
    let LayerSpec::Linear(law) = &scene.contacts[0].layer else { panic!("{:?}", scene.contacts) };
    assert!(matches!(law.stiffness, Field::Constant(1.0)));
    assert_eq!(scene.contacts[0].gap.eval([2.0, 0.0, 0.0]), 2e-4);
    assert_eq!(scene.contacts[0].reference.as_ref().unwrap().eval([3.0, 0.0, 0.0]), -2.0);
    let Zone::Subset(zone) = &scene.method.psi else { panic!() };
    assert_eq!([4, 5].map(|k| zone.is_true_at([2.0, 0.0, 0.0], k).unwrap()), [true, false]);
    assert_eq!(scene.method.stop.residual, Some(1e-6));
    assert_eq!(scene.method.stop.increment, Some(1e-3));
    let MeshSource::Geo(source) = &scene.mesh else { panic!() };
    assert_eq!(source.set, [("m".to_owned().into(), 2.0), ("n".to_owned().into(), 64.0)]);
    assert_eq!(scene.solver.preset, Some(Preset::Hypre));
    assert_eq!((scene.title.as_str(), scene.plane), ("Ein anderer Titel", Plane::Stress));
    assert!(scene.output.vtu && scene.output.plots);
    assert!(matches!(scene.method.gamma, Gamma::Stationary(0.2)));
}

/// The echo, written as a scene again, gives the same echo: nothing is lost and no key is misspelt.
#[test]
fn settings_are_a_scene() {
    // tables and rules for many bodies are echoed as they are, in their order
    let rule = |key: &str| {
        format!("[[contact]]\nbetween = 'auto'\ndistance = 1\n{key}\nlayer = {{ linear = {{ stiffness = 1 }} }}\n")
    };
    let rules = ["of = ['u*', 'l?w*']", ""].map(rule).concat();
    let text = GROOVE.replacen("[[contact]]", &(rules + "[[contact]]"), 1).replace("\"lower_end\"", "\"{body}_e*\"");
    let overrides = ["solver=hypre", "output.dir=out", "contact.2.reference=x", "body.upper.name=u*"];
    let scene = load_text(&text, &overrides).unwrap();
    let settings = scene.settings();
    assert_eq!(
        (&settings["body"][1]["name"], &settings["body"][0]["fix"][1]["on"]),
        (&"u*".into(), &"{body}_e*".into())
    );
    let of = [0, 1, 2].map(|table| settings["contact"][table]["of"].clone());
    assert_eq!(of, [serde_json::json!(["u*", "l?w*"]), serde_json::Value::Null, serde_json::Value::Null]);
    assert_eq!(settings["contact"][2]["between"][0], "lower_top");
    assert_eq!(settings["method"]["stop"], serde_json::json!({ "increment": 1e-3, "iterations": 2000 }));
    assert_eq!(settings["contact"][2]["gap"], "5e-4 * max(0, 1 - (x - 4)^2)^1.5");
    assert_eq!((&settings["body"][0]["order"], settings["body"][1].get("order")), (&1.into(), None));
    assert_eq!(settings["body"][1]["load"][0]["traction"], serde_json::json!(["2*x", -10.0]));
    let mut again = settings.clone();
    again.as_object_mut().unwrap().remove("scene");
    again["mesh"]["geo"] = "groove.geo".into();
    let overrides: Vec<String> =
        again.as_object().unwrap().iter().map(|(key, value)| format!("{key}={}", inline(value))).collect();
    let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
    let mut second = load_text("", &overrides).unwrap_or_else(|error| panic!("{error}")).settings();
    second["mesh"]["geo"] = settings["mesh"]["geo"].clone();
    second["scene"] = settings["scene"].clone();
    assert_eq!(settings, second);
}

/// JSON as a TOML value.
fn inline(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Object(map) => {
            let entries: Vec<_> = map.iter().map(|(key, value)| format!("{key} = {}", inline(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        serde_json::Value::Array(items) => format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

#[test]
fn a_scene_is_utf_8() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), b"title = \"a\"\nx = \"\xff\"\n").unwrap();
    let error = load(&folder.path().join("scene.toml"), &[]).expect_err("Latin-1");
    assert_eq!(error.kind(), Kind::File);
    assert!(error.message().ends_with("is not UTF-8 text, see line 2"), "{error}");
}

/// Replacement in the groove scene; text under the caret; message; part of the help (empty: whatever).
type Case = (&'static str, &'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
const CASES: &[Case] = &[
    // Syntax.
    ("dimension = 2", "dimension = two", "two", "this is not TOML: ", "need quotes: \"two\""),
    ("gamma = 0.7", "gamma = 0.7\ngamma = 0.8", "gamma", "this is not TOML: duplicate key", ""),
    ("[method]", "[method", "", "this is not TOML: unclosed table", ""),
    ("n = 32", "n = 99999999999999999999", "99999999999999999999", "the number is too large", ""),
    // Keys.
    ("young = 2.1e5", "yuong = 2.1e5", "yuong", "unknown key `yuong` in [[body]]", "did you mean `young`?"),
    ("young = 2.1e5", "mass = 2.1e5", "mass", "unknown key `mass` in [[body]]", "its keys are name, young, poisson, "),
    ("title = ", "colour = ", "colour", "unknown key `colour` in the scene", "title, dimension, plane, units, mesh"),
    ("[method]", "[methods]", "methods", "unknown key `methods` in the scene", "`method`"),
    ("B = 2.5e-5", "b = 2.5e-5", "b", "unknown key `b` in `power`", "`B`"),
    ("increment", "incremnt", "incremnt", "unknown key `incremnt` in `stop`", "`increment`"),
    ("pressure = 10", "presure = 10", "presure", "unknown key `presure` in an item of `load`", "`pressure`"),
    ("young = 2.1e5\n", "", "[[body]]", "[[body]] has no `young`", ""),
    ("name = \"upper\"\n", "", "[[body]]", "[[body]] has no `name`", ""),
    ("dimension = 2 ", "", "t", "the scene has no `dimension`", ""),
    ("B = 2.5e-5, ", "", "{ a = 0.5 }", "`power` has no `B`", ""),
    ("on = \"lower_face\", ", "", "{ pressure = 10 }", "an item of `load` has no `on`", ""),
    // Kinds of value.
    ("order = 1", "order = \"1\"", "\"1\"", "expected a whole number, found a string", "without quotes"),
    ("young = 2.1e5", "young = [1]", "[1]", "expected a number or an expression, found a list", ""),
    ("young = 2.1e5", "young = inf", "inf", "the number is not finite", ""),
    ("name = \"upper\"", "name = 7", "7", "expected a string, found a whole number", "quotes"),
    ("name = \"upper\"", "name = 1979-05-27", "1979-05-27", "expected a string, found a date", ""),
    ("dimension = 2 ", "dimension = 2.0 ", "2.0", "expected a whole number, found a number", ""),
    ("pressure = 10", "pressure = true", "true", "expected a number or an expression, found true or false", ""),
    ("layer = { power = { B = 2.5e-5, a = 0.5 } }", "layer = [1]", "[1]", "expected a table, found a list", "power = { B = 2.5e-5, a = 0.5 }"),
    ("{ on = \"lower_axis\", x = 0 }", "[\"lower_axis\", 0]", "[\"lower_axis\", 0]", "expected a table, found a list", ""),
    ("young = 2.1e5", "young = 1e400", "1e400", "the number is too large", ""),
    ("layer = { power = { B = 2.5e-5, a = 0.5 } }", "layer = \"power\"", "\"power\"", "expected a table, found a string", "power = { B = 2.5e-5, a = 0.5 }"),
    ("mesh = { geo = \"groove.geo\", set = { n = 32 } }", "mesh = 3", "3", "expected a string or a table", "a file name"),
    ("[[contact]]", "[contact]", "[contact]", "expected a list, found a table", "[[contact]]"),
    // Impossible values.
    ("dimension = 2 ", "dimension = 4 ", "4", "`dimension` is 4", ""),
    ("young = 2.1e5", "young = -2.1e5", "-2.1e5", "Young's modulus is -210000", ""),
    ("poisson = 0.3\norder", "poisson = 0.5\norder", "0.5", "Poisson's ratio is 0.5", "incompressible"),
    ("poisson = 0.3\norder", "poisson = -1\norder", "-1", "Poisson's ratio is -1", ""),
    ("poisson = 0.3\norder", "order", "[[body]]", "[[body]] has no `poisson`", ""),
    ("young = 2.1e5\npoisson = 0.3\norder", "order", "[[body]]", "[[body]] has no `young`", "orthotropic = { E1 = ... }"),
    ("order = 1", "axes = { angle = 1 }\norder = 1", "{ angle = 1 }", "axes of an isotropic material", "remove them"),
    ("order = 1", "anisotropic = [1]\norder = 1", "[1]", "[[body]] has both `young` and `anisotropic`", ""),
    ("young = 2.1e5\n", "anisotropic = [1]\n", "0.3", "[[body]] has both `poisson` and `anisotropic`", ""),
    ("young = 2.1e5\npoisson = 0.3\norder", "anisotropic = [1, 2]\norder", "[1, 2]", "an anisotropic material has 21 constants, not 2", "upper triangle"),
    ("young = 2.1e5\npoisson = 0.3\norder", "orthotropic = { E1 = 1 }\norder", "{ E1 = 1 }", "`orthotropic` has no `E2`", ""),
    ("young = 2.1e5\npoisson = 0.3\norder", "orthotropic = { e1 = 1 }\norder", "e1", "unknown key `e1` in `orthotropic`", "`E1`"),
    ("order = 1", "region = [{ on = \"core\", young = 1 }]\norder = 1", "{ on = \"core\", young = 1 }", "[[body.region]] has no `poisson`", ""),
    ("order = 1", "region = [{ young = 1, poisson = 0 }]\norder = 1", "{ young = 1, poisson = 0 }", "[[body.region]] has no `on`", ""),
    ("order = 1", "order = 9", "9", "`order` is 9", ""),
    ("gamma = 0.7", "gamma = 0", "0", "gamma is 0", ""),
    ("a = 0.5", "a = 1.5", "1.5", "a is 1.5", "p'(0) = infinity"),
    ("a = 0.5", "a = 0", "0", "a is 0", ""),
    ("B = 2.5e-5", "B = -1", "-1", "B is -1", ""),
    ("increment = 1e-3", "residual = 0", "0", "the tolerance is 0", ""),
    ("increment = 1e-3", "iterations = 0", "0", "`iterations` is 0", ""),
    ("increment = 1e-3", "iterations = -3", "-3", "`iterations` is -3", ""),
    ("[method]", "plane = 1\n[method]", "plane", "unknown key `plane` in [[contact]]", ""),
    // Words.
    ("psi = \"active\"", "psi = \"actve\"", "\"actve\"", "unknown zone `actve`", "`active`"),
    ("psi = \"active\"", "psi = \"robin\"", "\"robin\"", "unknown zone `robin`", "none, full, active"),
    ("psi = \"active\"", "psi = [\"none\", \"ful\"]", "\"ful\"", "unknown zone `ful`", "`full`"),
    ("psi = \"active\"", "psi = [\"none\"]", "[\"none\"]", "a list of zones has one for each of the two sides", "first surface of `between`"),
    ("gamma = 0.7", "gamma = \"1 - k\"", "\"1 - k\"", "gamma is 0 in iteration k = 1", ""),
    ("gamma = 0.7", "gamma = \"1/(1 + x)\"", "x", "unknown variable `x`", "known are k, pi"),
    ("gamma = 0.7", "gamma = \"aitkin\"", "\"aitkin\"", "unknown word `aitkin` for `method.gamma`", "`aitken`"),
    ("psi = \"active\"", "psi = \"z > 0\"", "z", "unknown variable `z`", "x, y, k"),
    ("start = { normal = 1e-4 }", "start = \"none\"", "\"none\"", "unknown word `none` for `method.start`", "auto, zero, normal"),
    ("[method]", "[solver]\npreset = \"mumpz\"\n[method]", "\"mumpz\"", "unknown word `mumpz` for `solver.preset`", "`mumps`"),
    ("dimension = 2 ", "dimension = 2\nplane = \"strein\" ", "\"strein\"", "unknown word `strein` for `plane`", "`strain`"),
    ("dimension = 2 ", "dimension = 3\nplane = \"strain\" ", "\"strain\"", "`plane` in a problem in space", ""),
    // Bodies.
    ("name = \"upper\"", "name = \"lower\"", "\"lower\"", "two bodies are called `lower`", ""),
    ("name = \"upper\"", "name = \"LOWER\"", "\"LOWER\"", "two bodies are called `lower`", ""),
    ("name = \"upper\"", "name = \"ksp\"", "\"ksp\"", "`ksp` cannot be the name of a body", "another name"),
    ("name = \"upper\"", "name = \"upper_sub\"", "\"upper_sub\"", "`upper_sub` cannot be the name of a body", "another name"),
    ("name = \"upper\"", "name = \"up**\"", "\"up**\"", "`up**` is no pattern", "`*` is any text"),
    ("\"lower_face\"", "\"lower_***\"", "\"lower_***\"", "`lower_***` is no pattern", ""),
    ("\"upper_bottom\"", "\"upper_*\"", "\"upper_*\"", "the pattern `upper_*` for one surface", "of = ["),
    ("gap = ", "of = [\"upper\", \"lower\"]\ngap = ", "[\"upper\", \"lower\"]", "`of` for surfaces with names", "which bodies"),
    ("gap = ", "tilt = 1e-3\ngap = ", "1e-3", "`tilt` of a contact without an obstacle", "obstacle = true"),
    ("[\"lower_top\", \"upper_bottom\"]", "\"auto\"\ndistance = 1\nforce = 5", "5", "`force` for pairs that are found", "name the two surfaces"),
    ("between = [\"lower_top\", \"upper_bottom\"]", "on = \"upper_bottom\"\nobstacle = true\ndistance = 3", "3", "`distance` of an obstacle", "the `gap` alone"),
    ("between = [\"lower_top\", \"upper_bottom\"]", "on = \"upper_bottom\"\nobstacle = true\npreload = 3", "3", "`preload` of an obstacle", "force = F"),
    ("[\"lower_top\", \"upper_bottom\"]", "\"auto\"\ndistance = 1\nof = [\"upper\"]", "[\"upper\"]", "pairs are of two bodies", "of = ["),
    ("[\"lower_top\", \"upper_bottom\"]", "\"auto\"\ndistance = 1\nof = [\"u*\", \"KSP\"]", "\"KSP\"", "`ksp` cannot be the name of a body", ""),
    ("[method]", "[[contact]]\nbetween = \"auto\"\ndistance = 1\nof = [\"u*\", \"l*\"]\nlayer = { linear = { stiffness = 1 } }\n[[contact]]\nbetween = \"auto\"\ndistance = 2\nof = [\"l*\", \"u*\"]\nlayer = { linear = { stiffness = 1 } }\n[method]", "\"l*\"", "a second contact between \"auto\" of `l*` and `u*`", "remove one"),
    ("name = \"upper\"", "name = \"\"", "\"\"", "the name is empty", ""),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\" }", "{ on = \"lower_axis\" }", "the support on `lower_axis` holds no component", "x, y: x = 0"),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\", z = 0 }", "0", "a support in `z` in a plane problem", ""),
    ("pressure = 10 ", "", "\"lower_face\"", "the load on `lower_face` has no component", "[tx, ty]"),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\", x = 0, symmetry = true }", "true", "a support has both `x` and `symmetry`", ""),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\", normal = 0, symmetry = true }", "true", "a support has both `normal` and `symmetry`", ""),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\", symmetry = false }", "false", "`symmetry = false` holds nothing", ""),
    ("{ on = \"lower_axis\", x = 0 }", "{ on = \"lower_axis\", x = \"2*u\" }", "u", "unknown variable `u`", ""),
    ("pressure = 10", "pressure = 10, force = [0, 0]", "[0, 0]", "a load has both `pressure` and `force`", ""),
    ("pressure = 10", "pressure = 10, rigid = true", "true", "`rigid` without a force or a moment", "force = [0, -10]"),
    ("pressure = 10", "force = [0, 1], moment = 2", "2", "a load has both `force` and `moment`", "two loads, or rigid = true"),
    ("pressure = 10", "traction = [0, 1], moment = 2", "2", "a load has both `traction` and `moment`", ""),
    ("pressure = 10", "force = [0, \"2*x\"]", "\"2*x\"", "a total force or moment does not depend on the place", "traction"),
    ("order = 1", "spring = [{ on = \"lower_face\" }]", "\"lower_face\"", "the spring on `lower_face` has no stiffness", "normal = k"),
    ("order = 1", "spring = [{ on = \"lower_face\", normal = 0 }]", "0", "the stiffness is 0", ""),
    ("order = 1", "spring = [{ on = \"lower_face\", stiffness = [0, 0] }]", "[0, 0]", "the spring has no stiffness", ""),
    ("pressure = 10", "pressure = 10, traction = [0, 0]", "[0, 0]", "a load has both `pressure` and `traction`", ""),
    ("force = [0, ", "force = [0, 0, ", "\"-9.81e-6 * (1 + y)\"", "a vector has 2 components here, not 3", "dimension"),
    ("traction = [\"2*x\", -10]", "traction = []", "[]", "a vector has 2 components here, not 0", ""),
    // Expressions.
    ("(x - 4)^2", "(u - 4)^2", "u", "unknown variable `u`", "known are x, y, factor, pi"),
    ("max(0", "maximum(0", "maximum", "unknown function `maximum`", "max, min"),
    ("\"2*x\"", "\"1/0\"", "\"1/0\"", "the expression is not a finite number but inf", ""),
    ("\"2*x\"", "\"2*\\u0078 + q\"", "\"2*\\u0078 + q\"", "unknown variable `q`", ""),
    ("\"2*x\"", "'''\n2*x + q'''", "q", "unknown variable `q`", ""),
    // Contacts.
    ("\"upper_bottom\"", "\"lower_top\"", "\"lower_top\"", "a contact between `lower_top` and itself", ""),
    (", \"upper_bottom\"", "", "[\"lower_top\"]", "a contact is between two surfaces", ""),
    ("[method]", "tension = { linear = { stiffness = 1 } }\n[method]", "{ linear = { stiffness = 1 } }", "only a bonded layer has a law in tension", "bond = true"),
    ("[method]", "bond = true\ntension = { linear = { stiffness = 0 } }\n[method]", "0", "stiffness is 0", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "", "{  }", "the layer has no law", "linear = { stiffness = 1e5 }"),
    ("a = 0.5 } }", "a = 0.5 }, linear = { stiffness = 1 } }", "{ stiffness = 1 }", "the layer has both `power` and `linear`", ""),
    ("B = 2.5e-5", "B = \"w\"", "w", "unknown variable `w`", "known are x, y, pi"),
    ("power = { B = 2.5e-5, a = 0.5 }", "exponential = { p0 = 1, c0 = 0 }", "0", "c0 is 0", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "exponential = { p0 = 1 }", "{ p0 = 1 }", "`exponential` has no `c0`", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "cubic = { k1 = 1, k3 = -1 }", "-1", "k3 is -1", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "cubik = { k1 = 1, k3 = 1 }", "cubik", "unknown key `cubik` in `layer`", "did you mean `cubic`?"),
    ("power = { B = 2.5e-5, a = 0.5 }", "table = []", "[]", "the table has no point", "table = ["),
    ("power = { B = 2.5e-5, a = 0.5 }", "table = [[1, 2, 3]]", "[1, 2, 3]", "a point of the table is a compression and a pressure", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "table = [[0, 0], [1, 2], [2, 1]]", "[[0, 0], [1, 2], [2, 1]]", "the pressure 1 of the table does not exceed 2", "increases"),
    ("power = { B = 2.5e-5, a = 0.5 }", "table = [[-1, 2]]", "[[-1, 2]]", "the compression -1 of the table does not exceed 0", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "table = [[1, 2]], pressure = \"c\"", "\"c\"", "the layer has both `table` and `pressure`", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "pressure = \"1e5*d\"", "d", "unknown variable `d`", "known are c, x, y, pi"),
    ("power = { B = 2.5e-5, a = 0.5 }", "pressure = 7", "7", "expected a string, found a whole number", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "pressure = \"c\", up_to = 0", "0", "the end of the law is 0", ""),
    ("power = { B = 2.5e-5, a = 0.5 }", "linear = { stiffness = 1 }, up_to = 1", "1", "`up_to` without an expression", ""),
    ("[method]", "[[contact]]\nbetween = [\"upper_bottom\", \"lower_top\"]\nlayer.linear.stiffness = 1\n[method]", "\"upper_bottom\"", "a second contact of `upper_bottom` and `lower_top`", ""),
    // The method.
    ("[method]", "[method]\nname = \"ncg\"", "\"ncg\"", "unknown word `ncg` for `method.name`", "auto"),
    ("start = { normal = 1e-4 }", "start = \"nested\"", "\"nested\"", "unknown word `nested` for `method.start`", "auto"),
    ("[method]", "[method]\ndepth = 3", "depth", "unknown key `depth`", "anderson"),
    ("psi = \"active\"", "name = \"semismooth\"\npsi = \"full\"", "\"full\"", "the method `semismooth` does not read `psi`", "`newton-robin`"),
    ("psi = \"active\"", "name = \"semismooth\"\nrobin = \"frozen\"", "\"frozen\"", "the method `semismooth` does not read `robin`", "`newton-robin`"),
    ("[method]", "[method]\nname = \"newton\"", "0.7", "the method `newton` does not read `gamma`", "`robin`"),
    ("psi = \"active\"\ngamma = 0.7", "name = \"newton\"\ninterval = true", "true", "only the method `robin` has an interval of gamma", "name = \"robin\""),
    ("[method]", "[method]\nsteps = [0.5, 0.9]", "[0.5, 0.9]", "the last load step is not the full load", "end the list with 1"),
    ("[method]", "[method]\nsteps = [0, 1]", "0", "the factor is 0", ""),
    ("[method]", "[method]\nsteps = 0", "0", "`steps` is 0", ""),
    ("[[contact]]", "adapt = { error = 1e-3 }\n[[contact]]", "", "", ""),
    // The mesh.
    ("geo = \"groove.geo\"", "geo = \"groove.geo\", msh = \"groove.msh\"", "\"groove.msh\"", "the mesh has both `geo` and `msh`", ""),
    ("geo = \"groove.geo\"", "msh = \"groove.msh\"", "{ n = 32 }", "`set` for a finished mesh", ""),
    ("geo = \"groove.geo\"", "geo = \"grove.geo\"", "\"grove.geo\"", "/grove.geo", "did you mean `groove.geo`?"),
    ("geo = \"groove.geo\"", "geo = \"no/such.geo\"", "\"no/such.geo\"", "/no/such.geo", "relative"),
    ("geo = \"groove.geo\"", "geo = \".\"", "\".\"", " is not a file", ""),
    ("n = 32 }", "n = 32 }, timeout = 0", "0", "the timeout is 0", ""),
    ("n = 32 }", "n = 32 }, threads = 0", "0", "`threads` is 0", ""),
    ("[method]", "friction = 0.2\n[method]", "friction", "unknown key `friction` in [[contact]]", "without friction"),
    ("poisson = 0.3", "poisson = 0.3\nthermal_expansion = 1e-5", "thermal_expansion", "unknown key `thermal_expansion` in [[body]]", "expansion = ALPHA"),
    ("poisson = 0.3", "poisson = 0.3\nexpansion = 1e-5", "1e-5", "`expansion` in a body without `temperature`", "temperature = 80"),
    ("poisson = 0.3", "poisson = 0.3\ntemperature = 80", "80", "`temperature` of `lower`, which has no `expansion`", "or 0"),
    ("[method]", "temperature = 80\n[method]", "temperature", "unknown key `temperature` in [[contact]]", "belongs to a body"),
    ("[method]", "points = 3\n[method]", "points", "unknown key `points` in [[contact]]", "its keys are"),
    ("n = 32 }", "n = 32 }, memory = 8", "memory", "unknown key `memory`", "`timeout` alone"),
    ("geo = \"groove.geo\", set = { n = 32 }", "msh = \"groove.msh\", timeout = 1", "1", "`timeout` for a finished mesh", ""),
    ("n = 32", "n = \"many\"", "\"many\"", "expected a number, found a string", ""),
    ("n = 32", "\"n m\" = 32", "\"n m\"", "`n m` is no name of a Gmsh number", ""),
];

/// Asserts that a scene with these overrides is refused with a caret under `marked` and these words; returns what is
/// shown.
fn refused(text: &str, overrides: &[&str], change: &str, [marked, message, help]: [&str; 3]) -> String {
    let error = load_text(text, overrides).expect_err(change);
    assert_eq!(error.kind(), Kind::Scene);
    assert!(error.message().contains(message), "{change}: not {message:?} in\n{error}");
    assert!(error.advice().unwrap_or_default().contains(help), "{change}: not {help:?} in\n{error}");
    if !marked.is_empty() {
        assert_eq!(caret(&error), marked, "{change}:\n{error}");
    }
    error.render(false)
}

#[test]
fn refusals_point_at_the_word() {
    for &(from, to, marked, message, help) in CASES {
        assert!(GROOVE.contains(from), "{from}");
        let shown = refused(&GROOVE.replacen(from, to, 1), &[], &format!("{from} -> {to}"), [marked, message, help]);
        assert!(shown.contains("scene.toml:"), "{shown}");
    }
}

#[test]
fn empty_scenes_are_refused() {
    for (text, message) in [
        ("", "the scene has no `dimension`"),
        ("dimension = 2", "the scene has no `mesh`"),
        ("dimension = 2\nmesh = 'groove.msh'", "the scene has no `body`"),
        ("dimension = 2\nmesh = 'groove.msh'\nbody = []", "the scene has no body"),
    ] {
        assert_eq!(load_text(text, &[]).expect_err(text).message(), message);
    }
}

#[test]
fn refusals_of_overrides_point_into_them() {
    #[rustfmt::skip]
    let cases = [
        ("contact.7.layer=1", "7", "`contact` has 1 item, there is no number 7", "number 0"),
        // a blank that has two bytes
        ("contact.\u{a0}7.layer=1", "7", "`contact` has 1 item, there is no number 7", "number 0"),
        ("body.2.young=1", "2", "`body` has 2 items, there is no number 2", "0 to 1"),
        ("body.uper.young=1", "uper", "`body` is a list of 2 items; `uper` is no number", "their names: lower, upper"),
        ("contact.0.between.lower=1", "lower", "`contact.0.between` is a list of 2 items; `lower` is no number", "0 to 1"),
        ("body.upper.yung=1", "yung", "unknown key `yung` in [[body]]", "`young`"),
        ("body.0.load.1.pressure=3", "1", "`body.0.load` has 1 item, there is no number 1", ""),
        ("body.1.fix.0.x=3", "fix", "`fix` has no items to choose from", ""),
        ("metod.gamma=1", "metod", "unknown key `metod` in the scene", "`method`"),
        ("method.gama=1", "gama", "unknown key `gama` in [method]", "`gamma`"),
        ("method.gamma = -1", "-1", "gamma is -1", ""),
        ("method.gamma=much", "much", "unknown word `much` for `method.gamma`", "line-search"),
        ("method.gamma=", "", "the value is missing", ""),
        ("method..gamma=1", "method..gamma", "this is not a key of the scene", "joined by points"),
        ("mesh.msh=groove.msh", "groove.msh", "the mesh has both `geo` and `msh`", ""),
        ("contact.0.layer.linear.stiffness=1", "linear", "the layer has both `power` and `linear`", ""),
        ("contact.0.layer={linear={stiffness=0}}", "0", "stiffness is 0", ""),
        ("contact.0.layer={linear={stiffness=1}", "", "this is not TOML: unclosed inline table", ""),
        ("contact.0.gap=1e-4 * max(0, w)", "w", "unknown variable `w`", ""),
        ("mesh.geo=other.geo", "other.geo", "/other.geo", ""),
        ("mesh.set.n=99999999999999999999", "99999999999999999999", "the number is too large", ""),
        ("title.main=x", "main", "expected a string, found a table", ""),
    ];
    for (text, marked, message, help) in cases {
        let shown = refused(GROOVE, &[text], text, [marked, message, help]);
        assert!(shown.contains(format!("1 | --set {text}").trim_end()) && !shown.contains("-->"), "{shown}");
    }
    let error = load_text(GROOVE, &["gamma"]).expect_err("no =");
    assert_eq!(error.kind(), Kind::Usage);
}

#[test]
fn refusals_of_flags_point_at_what_was_typed() {
    refused(GROOVE, &["adapt.rounds=3"], "no error", ["adapt", "`adapt` has no `error`", "0.01"]);
    for (tolerance, marked, message) in [(-1.0, "-1", "the error is -1"), (5.0, "5", "the error is 5")] {
        let flags = Flags { tolerance: Some(tolerance), ..Flags::default() };
        let error = load_with(GROOVE, &[], &flags).expect_err(message);
        assert_eq!((error.message(), caret(&error).as_str()), (message, marked));
        assert!(error.render(false).contains(&format!("1 | --tolerance {tolerance}")), "{error}");
    }
    refused(GROOVE, &["--over method.gamma=-1"], "a sweep", ["-1", "gamma is -1", ""]);
    // keys of the file that a method of the command line does not read stay without effect; those of options do not
    let flags = Flags { method: Some(MethodName::Newton), estimate: true, tolerance: Some(0.02) };
    let scene = load_with(GROOVE, &["adapt.rounds=3"], &flags).unwrap_or_else(|error| panic!("{error}"));
    let adapt = scene.adapt.expect("an error");
    assert_eq!(
        (scene.method.name, scene.estimate, adapt.error.value, adapt.rounds),
        (MethodName::Newton, true, 0.02, 3)
    );
    let error = load_with(GROOVE, &["adapt.error=0.1"], &Flags { tolerance: Some(7.0), ..Flags::default() });
    assert_eq!(caret(&error.expect_err("a share")), "7");
    let error = load_with(GROOVE, &["method.psi=full"], &flags).expect_err("no sweeps");
    assert_eq!((error.message(), caret(&error).as_str()), ("the method `newton` does not read `psi`", "full"));
    // a sweep over methods has its own
    let scene = load_with(GROOVE, &["--over method.name=semismooth"], &flags).expect("a scene");
    assert_eq!(scene.method.name, MethodName::Semismooth);
}

/// The second pass leaves no place without its text.
#[test]
fn every_place_has_its_text() {
    let text = GROOVE.replacen("pressure = 10", "force = [1, 2], path = \"press\"", 1).replacen(
        "order = 1",
        "region = [{ on = \"core\", orthotropic = { E1 = \"x\", E2 = 1, E3 = 1, nu12 = 0, nu13 = 0, nu23 = 0, G12 = 1, \
         G13 = 1, G23 = 1 }, axes = { first = [\"x\", 1] } }]\nspring = [{ on = \"a\", stiffness = [\"x\", 1] }]\nexact = \
         [\"x\", 0]",
        1,
    );
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("scene.toml", text.as_str()), ("groove.geo", ""), ("steps.csv", "press, turn\n1, 2\n")] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let obstacle = "[{on='a', obstacle=true, gap='turn', force='2*press', tilt='turn', at=[0, 1], \
                    layer={pressure='c'}, reference='x'}, {between='auto', of=['u*', 'l*'], distance=1, bond=true, \
                    layer={power={B='x', a=1}}, tension={linear={stiffness='x'}}}]";
    let overrides = [format!("contact={obstacle}"), "method.steps.table=steps.csv".to_owned()];
    let scene = load(&folder.path().join("scene.toml"), &overrides).unwrap_or_else(|error| panic!("{error}"));
    let shown = format!("{scene:?}");
    let unplaced: Vec<&str> = shown.split("Source { name: \"\", text: \"\" }, span: ").skip(1).collect();
    assert!(unplaced.iter().all(|rest| rest.starts_with("0..0")), "{shown}");
}
