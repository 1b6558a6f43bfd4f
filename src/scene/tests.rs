use super::*;
use crate::expression::Field;
use crate::problem::{
    BodySpec, Constants, Gamma, LawKind, LayerSpec, LoadKind, MeshSource, MethodName, Order, Plane, Preset, RobinRule,
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
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("scene.toml", text), ("groove.geo", ""), ("groove.msh", "")] {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    let overrides: Vec<_> = overrides.iter().map(|text| text.to_string()).collect();
    load(&folder.path().join("scene.toml"), &overrides)
}

/// The constants of an isotropic, homogeneous body.
fn isotropic(body: &BodySpec) -> (f64, f64) {
    match &body.elasticity.constants {
        Constants::Isotropic { young: Field::Constant(young), poisson: Field::Constant(poisson) } => (*young, *poisson),
        other => panic!("{other:?}"),
    }
}

#[test]
fn defaults_and_a_scene_in_space() {
    let text = "dimension = 3\nmesh = 'groove.msh'\n[[body]]\nname='a1'\nyoung=1\npoisson=0\norder=2\nforce=['z',0,1]\n\
                fix=[{on='s',z=0.5}]\n[solver]\npreset='hypre'\noptions='-ksp_rtol 1e-10'\n[output]\ndir='out'\nvtu=true\n";
    let scene = load_text(text, &[]).unwrap();
    assert_eq!(scene.title, "scene");
    assert!(matches!(&scene.mesh, MeshSource::Msh { .. }));
    assert_eq!(scene.bodies[0].order, Order::P2);
    assert!(matches!(scene.bodies[0].fix[0].value, [None, None, Some(Field::Constant(0.5))]));
    assert_eq!(scene.bodies[0].force.as_ref().unwrap()[0].eval([1.0, 2.0, 3.0]), 3.0);
    assert!(scene.contacts.is_empty());
    assert!(matches!(scene.method.start, Start::Auto));
    assert_eq!((scene.method.name, scene.method.robin), (MethodName::Auto, RobinRule::Auto));
    assert_eq!(scene.method.gamma, Gamma::Stationary(0.6));
    assert_eq!(
        scene.method.stop,
        StopRule { residual: Some(1e-8), increment: None, balanced: false, iterations: 2000 }
    );
    let options = vec!["-ksp_rtol".to_owned(), "1e-10".to_owned()];
    assert_eq!(scene.solver, SolverSpec { preset: Some(Preset::Hypre), options });
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
            "solver.options=-ksp_rtol 1e-10",
            "output.vtu=true",
            "title=Ein anderer Titel",
            "plane=stress",
            "method.gamma=0.1",
            "method.gamma=0.2",
        ],
    )
    .unwrap();
    assert_eq!(isotropic(&scene.bodies[1]).0, 1e5);
    assert_eq!([0, 1].map(|body| scene.bodies[body].order), [Order::P1, Order::P2]);
    assert_eq!(scene.bodies[1].elasticity.place.source.name, "--set");
    let LoadKind::Traction(traction) = &scene.bodies[1].load[0].kind else { panic!() };
    assert_eq!(traction[1].eval([0.0; 3]), 2.0);
    let LayerSpec::Form { form, values } = &scene.contacts[0].layer else { panic!("{:?}", scene.contacts) };
    assert!(form.kind == LawKind::Linear && matches!(values[..], [Field::Constant(1.0)]));
    assert_eq!(scene.contacts[0].gap.eval([2.0, 0.0, 0.0]), 2e-4);
    assert_eq!(scene.contacts[0].reference.as_ref().unwrap().eval([3.0, 0.0, 0.0]), -2.0);
    let Zone::Subset(zone) = &scene.method.psi else { panic!() };
    assert_eq!([4, 5].map(|k| zone.is_true_at("psi", [2.0, 0.0, 0.0], k).unwrap()), [true, false]);
    assert_eq!(scene.method.stop.residual, Some(1e-6));
    assert_eq!(scene.method.stop.increment, Some(1e-3));
    let MeshSource::Geo { set, .. } = &scene.mesh else { panic!() };
    assert_eq!(set, &[("m".to_owned(), 2.0), ("n".to_owned(), 64.0)]);
    assert_eq!(scene.solver.preset, Some(Preset::Hypre));
    assert_eq!(scene.solver.options, ["-ksp_rtol", "1e-10"]);
    assert_eq!((scene.title.as_str(), scene.plane), ("Ein anderer Titel", Plane::Stress));
    assert!(scene.output.vtu && scene.output.plots);
    assert_eq!(scene.method.gamma, Gamma::Stationary(0.2));
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
    assert_eq!(settings["body"][1]["order"], 1);
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

mod refusals;
