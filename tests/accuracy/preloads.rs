//! Pairs that are pressed by a force, and bolts that keep their preload.

use crate::common::here::{solve_here, try_here};
use crate::common::{Run, Scene, case, solve_on};

fn close(what: &str, ours: f64, exact: f64, tolerance: f64) {
    assert!((ours / exact - 1.0).abs() < tolerance, "{what}: {ours}, closed form {exact}");
}

/// The patch with both ends held, pressed by the force of its contact alone: the offset is what layer and blocks give way.
#[test]
fn a_patch_pressed_by_a_force() {
    let held = |fix: &str| vec!["body.1.load=[]".to_owned(), format!("body.1.fix={fix}")];
    let plane = held("[{on='upper_face',y=0},{on='upper_pin',x=0}]");
    let space = held("[{on='upper_top',z=0},{on='upper_pin',x=0,y=0},{on='upper_spin',y=0}]");
    let layer = 2.5e-5 * 10f64.sqrt();
    let offsets =
        [("patch", plane, 10.0, layer + 2.0 * 4.33333333e-5), ("patch-3d", space, 10.0, layer + 2.0 * 4.76190476e-5)];
    for (name, held, force, offset) in offsets {
        let area = if name == "patch" { "weight" } else { "area" };
        for method in [
            "{}",
            "{linear='direct'}",
            "{linear='multigrid'}",
            "{name='newton-robin'}",
            "{name='robin',gamma=0.4,robin='auto'}",
        ] {
            let (method, force) = (format!("method={method}"), format!("contact.0.force={force}"));
            let set: Vec<&str> = held.iter().map(String::as_str).chain([method.as_str(), force.as_str()]).collect();
            let run = solve_here(case(name), &set).converged();
            let size: f64 = run.contact()["weight"].iter().sum();
            let pressure = 10.0 / size;
            let exact = 2.5e-5 * pressure.sqrt() + (offset - layer) / 10.0 * pressure;
            close(&format!("{name} {area} {method}"), run.number("pairs/0/offset"), exact, 2e-6);
            close(&method, run.number("pairs/0/peak_pressure"), pressure, 1e-6);
        }
    }
}

/// The joint diagram of `meshes/bolt`. The bolt has the stiffness Kb, the two columns of the sleeve together Kp, both with their layers. From the preload F,
/// a service load S raises the force of the bolt by S Kb/(Kb + Kp), until the sleeve lifts off at S = F (Kb + Kp)/Kp; then the bolt carries S alone.
#[test]
fn a_bolt_keeps_its_preload() {
    let in_series = |young: f64| 1.0 / (4.0 / young + 1e-6);
    let (bolt, sleeve) = (in_series(2e5), 2.0 * in_series(5e4));
    let expected = |service: f64| (100.0 + service * bolt / (bolt + sleeve)).max(service);
    let service = [0.0, 120.0, 240.0, 360.0, 30.0];
    for method in ["name='auto'", "linear='multigrid'", "name='newton-robin'"] {
        let table = case("bolt").with_file_name("tighten.csv").display().to_string();
        let run = solve_here(case("bolt"), &[&format!("method={{{method},steps={{table='{table}'}}}}")]).converged();
        for (step, &service) in service.iter().enumerate() {
            let force = run.number(&format!("steps/{step}/pairs/0/force/0/1"));
            close(&format!("{method} step {step}"), force.abs(), expected(service), 1e-4);
        }
        let offset = |step: usize| run.number(&format!("steps/{step}/pairs/0/offset"));
        close("offset", -offset(0), 100.0 / bolt + 100.0 / sleeve, 1e-3);
        assert!((1..5).all(|step| offset(step) == offset(0)), "{method}");
    }
    let run = solve_on(3, case("bolt"), &["--set", "solver=mumps"]).converged();
    close("ranks", run.number("steps/3/pairs/0/force/0/1").abs(), expected(360.0), 1e-4);
    assert_eq!(run.number("steps/3/pairs/0/offset"), run.number("steps/0/pairs/0/offset"));
}

/// A bolt that is tightened in two steps finds its offset anew in each, and keeps it while the factor stays.
#[test]
fn tightened_in_steps() {
    let scene = Scene::edited("bolt", "preload = 100", "preload = 100\npath = \"turn\"");
    let table = scene.path.with_file_name("turn.csv");
    std::fs::write(&table, "turn, service\n0.5, 0\n0.5, 20\n1, 20\n1, 0\n").expect("a table");
    let run = solve_here(&scene.path, &[&format!("method.steps={{table='{}'}}", table.display())]).converged();
    let forces: Vec<f64> = (0..4).map(|step| run.number(&format!("steps/{step}/pairs/0/force/0/1")).abs()).collect();
    let offsets: Vec<f64> = (0..4).map(|step| run.number(&format!("steps/{step}/pairs/0/offset"))).collect();
    close("half", forces[0], 50.0, 1e-6);
    assert!(forces[1] > 60.0 && offsets[0] == offsets[1], "{forces:?} {offsets:?}");
    close("whole", forces[2], 100.0, 1e-6);
    assert!(forces[3] < 95.0 && offsets[2] == offsets[3] && offsets[2] < offsets[1], "{forces:?} {offsets:?}");
}

/// A clamp of one body, the faces of whose slit are drawn together: all methods find the same offset, and the faces carry the preload.
#[test]
fn a_clamp_is_one_body() {
    const SCRIPT: &str = "Point(1)={0,0,0}; Point(2)={4,0,0}; Point(3)={4,1,0}; Point(4)={1,1,0}; Point(5)={1,1.2,0}; Point(6)={4,1.2,0};
        Point(7)={4,2.2,0}; Point(8)={0,2.2,0}; Point(9)={3,1,0}; Point(10)={3,1.2,0};
        Line(1)={1,2}; Line(2)={2,3}; Line(3)={3,9}; Line(4)={9,4}; Line(5)={4,5}; Line(6)={5,10}; Line(7)={10,6}; Line(8)={6,7}; Line(9)={7,8}; Line(10)={8,1};
        Curve Loop(1)={1,2,3,4,5,6,7,8,9,10}; Plane Surface(1)={1}; Mesh.MeshSizeMax=0.3;
        Physical Surface(\"clamp\")={1}; Physical Curve(\"lower\")={3}; Physical Curve(\"upper\")={7}; Physical Curve(\"back\")={10};\n";
    let scene = Scene::new(
        "dimension = 2\nmesh = \"clamp.geo\"\n[[body]]\nname = \"clamp\"\norder = 1\nyoung = 1e5\npoisson = 0.3\nfix = [{ on = \"back\", x = 0, y = 0 }]\n\
         [[contact]]\nbetween = [\"lower\", \"upper\"]\nbond = true\npreload = 10\nlayer = { linear = { stiffness = 1e4 } }\n",
    );
    std::fs::write(scene.path.with_file_name("clamp.geo"), SCRIPT).expect("a script");
    let methods = [
        "{}",
        "{linear='direct'}",
        "{linear='multigrid'}",
        "{name='newton-robin'}",
        "{name='robin',robin='auto',gamma='aitken'}",
    ];
    let offset = |method: &&str| {
        let run = solve_here(&scene.path, &[&format!("method={method}")]).converged();
        close(method, run.number("pairs/0/force/0/1"), 10.0, 1e-6);
        run.number("pairs/0/offset")
    };
    let offsets: Vec<f64> = methods.iter().map(offset).collect();
    assert!(offsets[0] < -10.0 / 1e4, "{offsets:?}");
    offsets.iter().for_each(|other| close("offset", *other, offsets[0], 1e-6));
    // faces that face each other, and are farther apart than they may be, are no faces under head and nut
    for load in ["preload", "force"] {
        let keys = ["contact.0={between=['lower','upper'],layer={linear={stiffness=1e4}},distance=0.1", "=10}"]
            .join(&format!(",{load}"));
        let fix = "body.0.fix=[{on='back',x=0,y=0}]";
        let error = try_here(&scene.path, &[&keys, fix]).err().map(|error| error.render(false)).unwrap_or_default();
        let words = if load == "preload" { "do not face each other anywhere" } else { "belong to body" };
        assert!(error.contains(words), "{load}: {error}");
    }
}

/// A plate that is thinner than its faces are wide, between head and nut: the bolt and the plate share the offset, bonded or not. A negative preload has advice
/// that fits.
#[test]
fn a_bolt_through_a_thin_plate() {
    let scene = Scene::new(
        "dimension = 2\nmesh = \"plate.geo\"\n[[body]]\nname = \"plate\"\norder = 1\nyoung = 1e3\npoisson = 0\nfix = [{ on = \"pin\", x = 0, y = 0 }, { on = \"other\", y = 0 }]\n\
         [[contact]]\nbetween = [\"top\", \"bottom\"]\npreload = 10\nlayer = { linear = { stiffness = 1e3 } }\n",
    );
    let script = "Point(1)={0,0,0};Point(2)={2,0,0};Point(3)={2,h,0};Point(4)={0,h,0};
        Line(1)={1,2};Line(2)={2,3};Line(3)={3,4};Line(4)={4,1};Curve Loop(1)={1,2,3,4};Plane Surface(1)={1};
        Transfinite Curve{1,3}=5;Transfinite Curve{2,4}=3;Transfinite Surface{1};
        Physical Surface(\"plate\")={1};Physical Curve(\"bottom\")={1};Physical Curve(\"top\")={3};Physical Point(\"pin\")={1};Physical Point(\"other\")={2};\n";
    let file = scene.path.with_file_name("plate.geo");
    std::fs::write(&file, format!("DefineConstant[ h = 0.5 ];\n{script}")).expect("a script");
    for h in [0.5, 4.0] {
        for bond in [false, true] {
            let sets = [format!("contact.0.bond={bond}"), format!("mesh={{geo='plate.geo',set={{h={h}}}}}")];
            let run = solve_here(&scene.path, &sets.each_ref().map(String::as_str)).converged();
            let what = format!("{h} {bond}");
            // the faces are drawn together by the pressure 5
            close(&what, run.number("pairs/0/force/0/1"), -10.0, 1e-6);
            close(&what, run.number("pairs/0/peak_pressure"), 5.0, 1e-6);
            close(&what, run.number("pairs/0/offset"), 5.0 / 1e3 + h * 5.0 / 1e3, 1e-6);
            assert!(!run.warnings().contains("overlap"), "{}", run.warnings());
        }
    }
    for (bond, words) in [("true", "is a tension already: write 10"), ("false", "a preload > 0 presses")] {
        let sets = ["contact.0.preload=-10", &format!("contact.0.bond={bond}")];
        let error = try_here(&scene.path, &sets).err().map(|error| error.render(false)).unwrap_or_default();
        assert!(error.contains("a negative `preload`") && error.contains(words), "{bond}: {error}");
    }
}

/// A run of load steps whose last one did not end goes on with the offset that its first step has found, and with the gaps of its step, on any ranks.
#[test]
fn a_preload_is_kept_over_a_restart() {
    let wave = "[[contact]]\non = \"crown\"\nobstacle = true\ngap = \"1e-4 * (1 + service) * x^2\"\nlayer = { linear = { stiffness = 1e4 } }\n";
    let scene = Scene::edited("bolt", "[method]", &format!("{wave}[method]"));
    let steps = "method.steps={table='more.csv'}";
    std::fs::write(scene.path.with_file_name("more.csv"), "service\n0\n40\n80\n120\n").expect("a table");
    for (ranks, then) in [(1, 3), (3, 1)] {
        let solver = ["--set", "solver=mumps", "--set", steps];
        let whole = solve_on(ranks, &scene.path, &solver).converged();
        let ended = solve_on(ranks, &scene.path, &[&solver[..], &["--set", "method.stop.iterations=1"]].concat());
        assert_eq!(ended["status"], "iteration-limit", "{}", ended.said());
        let folder = ended.folder.display().to_string();
        let rest = solve_on(then, &scene.path, &[&solver[..], &["--restart", &folder]].concat());
        assert_eq!(rest["status"], "converged", "{}", rest.said());
        for path in ["offset", "force/0/1"] {
            for step in 0..4 {
                let of = |run: &Run| run.number(&format!("steps/{step}/pairs/0/{path}"));
                close(path, of(&rest), of(&whole), 1e-9);
            }
        }
        close("peak", rest.number("pairs/0/peak_tension"), whole.number("pairs/0/peak_tension"), 1e-9);
    }
}

/// Two plates under a bolt without a mesh, between the faces under its head and its nut, which look away from each other. The bolt has the stiffness Kb, and
/// the plates in series with their layer have Kp: the preload F rises by S Kb/(Kb + Kp) under the service load S that pulls the plates apart.
#[test]
fn a_bolt_between_outer_faces() {
    let scene = Scene::new(
        "dimension = 2\nmesh = \"plates.geo\"\n[[body]]\nname = \"lower\"\norder = 1\nyoung = 1e5\npoisson = 0\nfix = [{ on = \"pin\", x = 0 }, { on = \"nut\", y = 0 }]\n\
         [[body]]\nname = \"upper\"\norder = 1\nyoung = 1e5\npoisson = 0\nfix = [{ on = \"pin\", x = 0 }]\nload = [{ on = \"head\", pressure = -1, path = \"service\" }]\n\
         [[contact]]\nbetween = [\"head\", \"nut\"]\npreload = 100\nlayer = { linear = { stiffness = 1e4 } }\n\
         [[contact]]\nbetween = [\"joint_upper\", \"joint_lower\"]\nlayer = { linear = { stiffness = 1e5 } }\n\
         [method]\nsteps = { table = \"service.csv\" }\n",
    );
    let script = "For i In {0:1}
        Point(4*i+1)={0,i,0}; Point(4*i+2)={2,i,0}; Point(4*i+3)={2,i+1,0}; Point(4*i+4)={0,i+1,0};
        Line(4*i+1)={4*i+1,4*i+2}; Line(4*i+2)={4*i+2,4*i+3}; Line(4*i+3)={4*i+3,4*i+4}; Line(4*i+4)={4*i+4,4*i+1};
        Curve Loop(i+1)={4*i+1,4*i+2,4*i+3,4*i+4}; Plane Surface(i+1)={i+1};
        EndFor
        Mesh.MeshSizeMax=0.5;
        Physical Surface(\"lower\")={1}; Physical Surface(\"upper\")={2}; Physical Curve(\"pin\")={4,8};
        Physical Curve(\"nut\")={1}; Physical Curve(\"joint_lower\")={3}; Physical Curve(\"joint_upper\")={5}; Physical Curve(\"head\")={7};\n";
    std::fs::write(scene.path.with_file_name("plates.geo"), script).expect("a script");
    std::fs::write(scene.path.with_file_name("service.csv"), "service\n0\n20\n30\n").expect("a table");
    // of the width 2
    let (bolt, plates) = (2e4, 2.0 / (2.0 / 1e5 + 1.0 / 1e5));
    let run = solve_here(&scene.path, &[]).converged();
    for (step, service) in [0.0, 40.0, 60.0].into_iter().enumerate() {
        let force = run.number(&format!("steps/{step}/pairs/0/force/0/1"));
        close("force", force.abs(), 100.0 + service * bolt / (bolt + plates), 1e-6);
    }
}
