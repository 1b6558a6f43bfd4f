//! Wrong input ends in one message that names the place and the way out, and in the exit code of its kind.

use crate::common::{Run, Scene, case, output, root, solve, solve_on, text_of, winkler};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

const SCENE: i32 = 3;
const MESH: i32 = 4;
const SOLVER: i32 = 5;
const FILE: i32 = 6;

/// Asserts that a run was refused with this exit code, one message, and these words in it.
fn refused(run: &Run, code: i32, words: &[&str]) {
    assert_eq!(run.code, code, "{}", run.said());
    let messages = run.stderr.lines().filter(|line| line.starts_with("error")).count();
    assert_eq!(messages, 1, "one message is enough\n{}", run.said());
    for word in words {
        assert!(run.stderr.contains(word), "no `{word}`\n{}", run.said());
    }
    assert!(run.report.is_null() && run.stdout.is_empty(), "a refusal has no results\n{}", run.said());
}

/// Solves the groove with one text of its scene replaced; the refusal must point at the line where `at` stands.
fn groove_refused(from: &str, to: &str, at: &str, words: &[&str]) {
    let scene = Scene::edited("groove", from, to);
    let run = solve(&scene, &[]);
    refused(&run, SCENE, words);
    let place = format!("{}:{}:", scene.path.display(), scene.line_of(at));
    assert!(run.stderr.contains(&place), "it must point at {place}\n{}", run.stderr);
    assert!(run.stderr.contains('^'), "no caret\n{}", run.stderr);
}

#[test]
fn a_scene_that_is_not_there() {
    let folder = case("groove").parent().expect("a folder").to_owned();
    refused(&solve(folder.join("scenes.toml"), &[]), FILE, &["scenes.toml", "No such file"]);
    refused(&solve(folder, &[]), FILE, &["folder", "scene.toml"]);
    assert_eq!(winkler(&["solve"]).code, 2);
    assert_eq!(winkler(&["solv", "scene.toml"]).code, 2);
}

#[test]
fn keys_and_types() {
    groove_refused("gamma = 0.6", "gama = 0.6", "gama", &["unknown key `gama`", "did you mean `gamma`?"]);
    groove_refused("psi = \"active\"", "psi = \"activ\"", "activ\"", &["`activ`", "did you mean `active`?"]);
    groove_refused("gamma = 0.6", "gamma = \"big\"", "big", &["unknown word `big` for `method.gamma`", "line-search"]);
    groove_refused("gamma = 0.6", "gamma = -0.6", "-0.6", &["gamma"]);
    groove_refused("a = 0.5", "a = 1.5", "a = 1.5", &["a is 1.5", "must not exceed 1"]);
    groove_refused("[method]", "[method", "[method", &["TOML"]);
    groove_refused("(x - 4)^2", "(x - 4^2", "gap =", &["^"]);
}

#[test]
fn known_displacements() {
    let exact = |value: &str, words: &[&str]| {
        groove_refused("name = \"lower\"\n", &format!("name = \"lower\"\nexact = {value}\n"), "exact =", words);
    };
    exact("[0, \"sqrt(x - 5)\"]", &["the known displacement is NaN at (", "help"]);
    exact("[0, 0, 0]", &["2 components here, not 3"]);
    exact("[0, \"2*z\"]", &["`z`"]);
    exact("[0, true]", &["a number or an expression"]);
}

#[test]
fn plane_bodies_in_space() {
    let scene = Scene::edited("groove", "dimension = 2 ", "dimension = 3 ");
    refused(&solve(&scene, &[]), MESH, &["groove.geo", "no physical group holds volumes", "dimension = 3", "help"]);
}

#[test]
fn names_that_the_mesh_does_not_have() {
    groove_refused("on = \"lower_axis\"", "on = \"lower_axle\"", "lower_axle", &["`lower_axle`", "lower_axis"]);
    groove_refused("\"upper_bottom\"]", "\"uper_bottom\"]", "uper_bottom", &["`uper_bottom`", "upper_bottom"]);
    groove_refused("name = \"upper\"", "name = \"uper\"", "\"uper\"", &["`uper`", "upper"]);
    groove_refused("groove.geo", "grove.geo", "grove.geo", &["there is no file", "did you mean `groove.geo`?"]);
    groove_refused("n = 32 }", "m = 32 }", "m = 32", &["`m`", "did you mean `n`?"]);
}

#[test]
fn names_of_bodies_that_are_words_of_petsc() {
    for word in ["mat", "log", "draw"] {
        let name = format!("name = \"{word}\"");
        groove_refused("name = \"lower\"", &name, &name, &[&format!("`{word}`"), "PETSc"]);
    }
}

#[test]
fn supports_and_loads() {
    let on = "on = \"lower_axis\"";
    groove_refused(on, "on = \"upper_axis\"", "upper_axis", &["`upper_axis` does not touch body `lower`"]);
    let on = "on = \"lower_face\"";
    groove_refused(on, "on = \"upper_face\"", "\"upper_face\", p", &["`upper_face` does not touch body `lower`"]);
    let meeting = "{ on = \"lower_face\", x = 1 }, { on = \"lower_end\"";
    groove_refused("{ on = \"lower_end\"", meeting, "lower_end", &["body `lower`", "two values", "x displacement"]);
    let root = "on = \"lower_face\", pressure = \"sqrt(x - 2)\"";
    groove_refused(
        "on = \"lower_face\", pressure = 10",
        root,
        "sqrt",
        &["this load is not a finite number at x = ", "gives NaN"],
    );
}

#[test]
fn contacts() {
    let between = "[\"lower_top\", \"upper_bottom\"]";
    let away = "[\"lower_axis\", \"upper_axis\"]";
    groove_refused(between, away, "between =", &["`lower_axis`", "`upper_axis`", "do not face each other"]);
    let itself = "[\"lower_top\", \"lower_end\"]";
    groove_refused(between, itself, "between =", &["both surfaces belong to body `lower`"]);
    groove_refused(between, "[\"lower_top\", \"lower_top\"]", "between =", &["`lower_top` and itself"]);
    let gap = "5e-4 * max(0, 1 - (x - 4)^2)^1.5";
    groove_refused(gap, "sqrt(x - 1)", "gap =", &["the gap is not a finite number at x = 0, ", "gives NaN"]);
    groove_refused(gap, "1e-3 / x", "gap =", &["the gap is not a finite number at x = 0, ", "gives inf"]);
    groove_refused("normal = 1e-4", "normal = \"log(x - 1)\"", "log", &["the start is not", "at x = 0, "]);
}

#[test]
fn layers() {
    let law = "power = { B = 2.5e-5, a = 0.5 }";
    let varying = "power = { B = \"1e-5*(1.45 - x)\", a = 0.5 }";
    groove_refused(law, varying, "layer =", &["B is -", "at (1.4", "must be greater than 0"]);
    let missing = "power = { B = \"sqrt(x - 1)\", a = 0.5 }";
    groove_refused(law, missing, "layer =", &["B is not a finite number at x = 0"]);
    groove_refused(law, "pressure = \"1e5*c + x\"", "layer =", &["no law of a layer", "p(0) is 0.03"]);
    groove_refused(law, "pressure = \"1e5*c^0.5\"", "layer =", &["no law of a layer", "p'(0) = infinity"]);
    groove_refused(law, "pressure = \"1e5*c - 1e7*c^2\"", "layer =", &["does not increase at c =", "up_to = "]);
    groove_refused(law, "pressure = \"-1e5*c\"", "layer =", &["does not increase at c =", "a wrong sign"]);
}

#[test]
fn overrides() {
    let set = |text: &str, code: i32, words: &[&str]| {
        refused(&solve(case("groove"), &["--set", text]), code, &[&["--set"], words].concat());
    };
    set("method.gama=1", SCENE, &["--set method.gama=1\n", "`gama`", "did you mean `gamma`?"]);
    set("contact.5.gap=1", SCENE, &["--set contact.5.gap=1\n", "no number 5"]);
    set("method.gamma=abc", SCENE, &["--set method.gamma=abc\n", "unknown word `abc` for `method.gamma`"]);
    set("body.0.fix.0.on=nothing", SCENE, &["--set body.0.fix.0.on=nothing\n", "`nothing`"]);
    set("method.gamma", 2, &["without `=`"]);
    // the place is where the user wrote the name
    set("mesh.set.m=3", SCENE, &["--set mesh.set.m=3\n", "`m`", "did you mean `n`?"]);
}

/// What an expression lacks is named with the expression, the place and the value, wherever it stands.
#[test]
fn expressions_without_a_value() {
    for (set, words) in [
        ("method.psi=sqrt(x-2)", &["psi is not a finite number at x = 0, ", "k = 0", "gives NaN"][..]),
        ("body.0.load.0.pressure=log(x-3)", &["this load is not", "at x = ", "gives NaN"]),
        ("body.0.load.0.pressure=1/(x-x)", &["this load is not", "at x = ", "gives inf"]),
        ("body.1.load.0={on=\"upper_face\", traction=[\"sqrt(x-3)\", 0]}", &["this load is not", "gives NaN"]),
        ("body.0.force=[\"asin(x)\", 0]", &["this body force is not", "gives NaN"]),
        ("body.0.young=2e5*sqrt(x-1)", &["young is not", "at x = ", "gives NaN"]),
        ("contact.0.gap=sqrt(x-2)", &["the gap is not", "at x = ", "gives NaN"]),
        ("contact.0.reference=sqrt(x-2)", &["the reference is not", "at x = ", "gives NaN"]),
        ("contact.0.layer.power.B=1e-5*sqrt(x-2)", &["B is not", "at x = ", "gives NaN"]),
        ("method.start.normal=sqrt(x-2)", &["the start is not", "at x = ", "gives NaN"]),
    ] {
        let run = solve(case("groove"), &["--set", "mesh.set.n=8", "--set", set]);
        refused(&run, SCENE, &[words, &[&format!("| --set {set}"), "^"]].concat());
    }
    // the caret stands under the constant that is wrong, not under the first
    let scene =
        text_of("groove").replacen("young = 2.1e5\npoisson = 0.3", "young = \"2e5*(1+x)\"\npoisson = \"0.2*x\"", 1);
    let scene = Scene::new(scene);
    let run = solve(&scene, &["--set", "mesh.set.n=8"]);
    refused(&run, SCENE, &["poisson is 0.5", &format!(":{}:", scene.line_of("poisson = \"0.2"))]);
    // a zone that loses its value later loses what was computed before no less
    let run = solve(case("groove"), &["--set", "mesh.set.n=8", "--set", "method.psi=sqrt(3-k) >= 0"]);
    assert!(run.code == SCENE && run.stderr.contains("k = 4"), "{}", run.said());
    assert_eq!(run.history().rows(), 4);
}

#[test]
fn words_of_the_command_line() {
    let scene = case("groove");
    let scene = scene.to_str().expect("a path");
    refused(&winkler(&["check", scene, "--ksp_type", "cg"]), 2, &["PETSc options take one dash", "-ksp_type?"]);
    refused(&winkler(&["check", scene, "--tolerance", "-1"]), SCENE, &["| --tolerance -1\n", "the error is -1"]);
    let stray = winkler(&["check", scene, "-1"]);
    refused(&stray, 2, &["unexpected argument '-1'"]);
    assert!(!stray.stderr.contains("-- -1"), "{}", stray.said());
    use std::os::unix::ffi::OsStrExt;
    let mut command = Command::new(crate::common::WINKLER);
    command.arg("check").arg(std::ffi::OsStr::from_bytes(b"caf\xe9.toml"));
    let (status, _, said) = output(command, Duration::from_secs(60));
    assert!(status.code() == Some(2) && said.contains("not UTF-8 text: `caf\u{fffd}.toml`"), "{said}");
}

/// The patch with another mesh.
fn patch_with(mesh: &Path) -> Scene {
    let text = text_of("patch");
    let line = text.lines().find(|line| line.starts_with("mesh =")).expect("a mesh");
    Scene::new(text.replace(line, &format!("mesh = \"{}\"", mesh.display())))
}

fn gmsh(format: &[&str], to: &Path) {
    let script = root().join("meshes/patch/patch.geo");
    let mut command = Command::new("gmsh");
    command.args(["-v", "0", "-2"]).args(format).arg("-o").arg(to).arg(script);
    assert!(output(command, Duration::from_secs(60)).0.success());
}

#[test]
fn damaged_meshes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = |name: &str| folder.path().join(name);
    gmsh(&["-format", "msh22"], &file("old.msh"));
    solve(patch_with(&file("old.msh")), &["--set", "method.stop.residual=1e-3"]).converged();
    for (name, format) in [("text.msh", &["-format", "msh41"][..]), ("binary.msh", &["-format", "msh41", "-bin"])] {
        gmsh(format, &file(name));
        let whole = patch_with(&file(name));
        solve(&whole, &["--set", "method.stop.residual=1e-3"]).converged();
        let bytes = std::fs::read(file(name)).expect("a mesh");
        for part in [40, bytes.len() / 2, bytes.len() - 20] {
            std::fs::write(file(name), &bytes[..part]).expect("a shorter mesh");
            refused(&solve(&whole, &[]), MESH, &[name]);
        }
    }
    // a facet of no length in a loaded surface, named with its line
    gmsh(&["-format", "msh41"], &file("text.msh"));
    let text = std::fs::read_to_string(file("text.msh")).expect("a mesh");
    let mut lines: Vec<&str> = text.lines().collect();
    let elements = lines.iter().position(|line| *line == "$Elements").expect("elements");
    let mut blocks =
        (elements + 2..lines.len()).filter(|&i| lines[i].starts_with("1 ") && lines[i].matches(' ').count() == 3);
    let facet = blocks.next().expect("a block of facets") + 1;
    let words: Vec<&str> = lines[facet].split_whitespace().collect();
    let flat = format!("{} {} {}", words[0], words[1], words[1]);
    lines[facet] = &flat;
    std::fs::write(file("flat.msh"), lines.join("\n") + "\n").expect("a mesh");
    let place = format!("flat.msh:{}:", facet + 1);
    refused(&solve(patch_with(&file("flat.msh")), &[]), MESH, &[&place, "has zero length"]);
    std::fs::write(file("empty.msh"), "").expect("a file");
    refused(&solve(patch_with(&file("empty.msh")), &[]), MESH, &["empty.msh", "$MeshFormat"]);
}

#[test]
fn a_script_that_gmsh_refuses() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let script = std::fs::read_to_string(root().join("meshes/patch/patch.geo")).expect("a script");
    let wrong = script.replace("Line(3) = {3, 4};", "Line(3) = {3, 4;");
    assert_ne!(script, wrong);
    // numbers that would keep Gmsh busy for hours, or are none of a mesh
    for (h, words) in [("1e-9", "take h = 0.00012 or more"), ("0", "numbers above 0"), ("-1", "numbers above 0")] {
        let run = solve(case("paraboloid"), &["--set", &format!("mesh.set.h={h}")]);
        refused(&run, MESH, &["paraboloid.geo", words]);
    }
    let file = folder.path().join("wrong.geo");
    std::fs::write(&file, &wrong).expect("a script");
    let line = 1 + wrong.lines().position(|line| line.contains("{3, 4;")).expect("the line");
    let run = solve(patch_with(&file), &[]);
    refused(&run, MESH, &["wrong.geo", &format!("line {line}"), "syntax error"]);
}

/// The patch with a script of its own, which stands beside it.
fn patch_with_script(text: &str) -> (tempfile::TempDir, Scene) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("own.geo");
    std::fs::write(&file, text).expect("a script");
    (folder, patch_with(&file))
}

#[test]
fn scripts_that_take_too_much() {
    let limited = |scene: &Scene, more: &str| {
        let file = scene.text.lines().find_map(|line| line.strip_prefix("mesh = ")).expect("a mesh").to_owned();
        solve(scene, &["--set", &format!("mesh={{geo={file}, {more}}}")])
    };
    let (_folder, endless) = patch_with_script("For i In {0:1e15}\nx = i;\nEndFor\n");
    refused(&limited(&endless, "timeout=1"), MESH, &["own.geo", "has not finished", "`timeout`"]);
}

#[test]
fn petsc_options() {
    let typed = |options: &[&str], words: &[&str]| refused(&solve(case("groove"), options), SOLVER, words);
    typed(&["-ksp_tpye", "cg"], &["-ksp_tpye", "did you mean -ksp_type?"]);
    typed(&["-uper_ksp_type", "cg"], &["-uper_ksp_type", "did you mean -upper_ksp_type?"]);
    typed(&["-upper_ksp_tpye", "cg"], &["-upper_ksp_tpye", "did you mean -upper_ksp_type?"]);
    for end in ["ksp_converged_reason", "ksp_view"] {
        let (wrong, right) = (format!("-uper_{end}"), format!("did you mean -upper_{end}?"));
        typed(&["-ksp_type", "cg", &wrong], &[&wrong, &right]);
    }
    typed(&["-ksp_type", "cg", "-pc_hypre_tpe", "euclid"], &["-pc_hypre_tpe", "did you mean -pc_hypre_type?"]);
    typed(&["-ksp_type", "nonsense"], &["-ksp_type nonsense: this PETSc does not know the type"]);
    typed(&["-pc_type", "nonsense"], &["-pc_type nonsense: this PETSc does not know the type"]);
    typed(&["-ksp_type", "cg", "-ksp_rtol", "abc"], &["abc"]);
    // PETSc options are no part of a scene
    let scene = Scene::edited("groove", "dimension = 2", "solver = { options = \"-ksp_type cg\" }\ndimension = 2");
    refused(&solve(&scene, &[]), SCENE, &["options", "command line"]);
}

/// Keys that the method does not read are refused, unless an option has replaced the method that reads them.
#[test]
fn keys_of_other_methods() {
    let typed = |options: &[&str], words: &[&str]| refused(&solve(case("groove"), options), SCENE, words);
    for key in ["psi=full", "gamma=0.5", "robin=frozen"] {
        let name = key.split('=').next().unwrap_or_default();
        let said = format!("the method `newton` does not read `{name}`");
        typed(&["--method", "newton", "--set", &format!("method.{key}")], &[&said, "--set method.", "`robin`"]);
    }
    typed(&["--set", "method={name='auto',gamma='aitken'}"], &["the method `auto` does not read `gamma`"]);
    typed(&["--method", "newton-robin", "--set", "method.gamma=1"], &["`newton-robin` does not read `gamma`"]);
    typed(&["--set", "method={name='auto',linear='direct',psi='full'}"], &["does not read `psi`", "`newton-robin`"]);
    groove_refused(
        "gamma = 0.6",
        "gamma = 0.6\nname = \"newton\"",
        "gamma = 0.6",
        &["the method `newton` does not read"],
    );
    for options in ["method.name=newton", "method={name='newton-robin',psi='full',robin='tangent'}"] {
        solve(case("groove"), &["--set", "mesh.set.n=4", "--set", options]).converged();
    }
}

#[test]
fn a_folder_that_cannot_be_made() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a file");
    let scene = case("groove").display().to_string();
    for to in [file.clone(), file.join("below")] {
        let to = to.display().to_string();
        let run = winkler(&["solve", &scene, "-o", &to]);
        refused(&run, FILE, &[&to, "-o"]);
    }
}

/// Asserts that a run ended without an answer: this status, these words in its message, every file of it written.
fn failed(run: &Run, status: &[&str], words: &[&str]) {
    assert_eq!(run.code, 1, "{}", run.said());
    assert!(status.contains(&run.text("status")), "{}: {}", run.text("status"), run.said());
    for word in words {
        assert!(run.text("message").contains(word), "no `{word}` in: {}", run.text("message"));
        assert!(run.stdout.contains(word), "no `{word}`\n{}", run.said());
    }
    let files: Vec<&str> = run.report["files"].as_array().expect("files").iter().filter_map(|f| f.as_str()).collect();
    for name in ["report.json", "history.csv", "contact-lower-upper.csv", "convergence.svg", "pressure.svg"] {
        assert!(files.contains(&name), "{name} is not in {files:?}");
    }
    for name in files {
        assert!(run.folder.join(name).is_file(), "{name} is not there");
    }
    let rows = run.history();
    assert_eq!(rows.rows(), run.count("sweeps"), "one row a sweep");
    // null is honest, zero is not
    assert!(run.report["residual"].as_f64().is_none_or(|residual| residual > 0.0), "{}", run.report["residual"]);
}

/// The patch with an upper body that slides freely and is pushed aside.
fn pushed_aside() -> Scene {
    let free = crate::common::text_of("patch").replace("fix = [{ on = \"upper_pin\", x = 0 }]\n", "");
    Scene::new(free.replace("{ on = \"upper_face\", pressure = 10 }", "{ on = \"upper_face\", traction = [1, -10] }"))
}

/// The same body without the push keeps its place: one node is fixed, nothing else changes.
#[test]
fn a_body_that_slides_freely_without_load() {
    let free = Scene::edited("patch", "fix = [{ on = \"upper_pin\", x = 0 }]\n", "");
    let run = solve(&free, &[]).converged();
    assert!(run.warnings().contains("body upper: nothing holds its translation along x"), "{}", run.warnings());
    assert!(run.contact()["pressure"].iter().all(|p| (p / 10.0 - 1.0).abs() < 1e-10));
}

/// A modulus in pascals beside pressures in megapascals is said, and one of a stiff solid is not.
#[test]
fn a_modulus_in_pascals() {
    let cases = [
        ("mm, MPa", "2.1e11", true),
        ("m, Pa", "2.1e11", false),
        ("mm, MPa", "1e6", false),
        ("mm, psi", "2.1e11", false),
    ];
    for (units, young, is_said) in cases {
        let run =
            solve(case("patch"), &["--set", &format!("units='{units}'"), "--set", &format!("body.0.young={young}")])
                .converged();
        assert_eq!(
            run.warnings().contains("more than diamond has, 1.2e+06 MPa"),
            is_said,
            "{units}, {young}: {}",
            run.warnings()
        );
    }
}

#[test]
fn a_body_that_nothing_holds() {
    let run = solve(pushed_aside(), &[]);
    failed(&run, &["underconstrained"], &["`upper`", "translation along x", "support with x = 0"]);
    // not even contact, at first
    let apart = Scene::edited("patch", "start = { normal = 1e-4 }", "start = { normal = -1e-2 }");
    failed(&solve(&apart, &[]), &["underconstrained"], &["`upper`", "iteration 0", "method.start"]);
}

const COARSE: [&str; 2] = ["--set", "mesh.set.n=8"];

#[test]
fn a_gamma_that_is_too_large() {
    for (gamma, status) in [
        ("1.5", &["iteration-limit"][..]),
        ("2.5", &["not-finite", "iteration-limit"]),
        ("3", &["not-finite", "iteration-limit"]),
        ("1e200", &["not-finite"]),
    ] {
        let gamma = format!("method.gamma={gamma}");
        let run = solve(case("groove"), &[&COARSE[..], &["--set", &gamma]].concat());
        failed(&run, status, &["iteration", "method.gamma"]);
    }
    let stiff = ["--set", "method.gamma=1", "--set", "contact.0.layer={linear={stiffness=1e9}}"];
    let run = solve(case("groove"), &[&COARSE[..], &stiff].concat());
    failed(&run, &["iteration-limit"], &["smaller method.gamma"]);
}

#[test]
fn too_few_iterations() {
    let run = solve(case("groove"), &[&COARSE[..], &["--set", "method.stop.iterations=3"]].concat());
    failed(&run, &["iteration-limit"], &["3 iterations", "method.stop.iterations"]);
    assert_eq!((run.count("iterations"), run.count("sweeps")), (3, 4));
}

/// p(1) = (1e6)^10 = 1e60: nothing of what follows has a right digit, so it must not pass for an answer.
#[test]
fn a_start_so_large_that_the_law_overflows() {
    // far away, but not lost: what it says has converged is the answer
    let far = ["--set", "contact.0.layer.power={a=0.1,B=1e-6}", "--set", "method.stop={residual=1e-9}"];
    let near = solve(case("groove"), &[&COARSE[..], &far, &["--method", "newton"]].concat()).converged();
    let run = solve(case("groove"), &[&COARSE[..], &far, &["--set", "method.start.normal=1"]].concat()).converged();
    assert!(crate::common::distance(&run.contact()["pressure"], &near.contact()["pressure"]) < 1e-6);
    for start in ["1e20", "1e40"] {
        let start = format!("method.start.normal={start}");
        let law = ["--set", "contact.0.layer.power={a=0.1,B=1e-6}", "--set", &start];
        let rules = ["--set", "method.stop={residual=1e-8,iterations=200}"];
        let run = solve(case("groove"), &[&COARSE[..], &law, &rules].concat());
        failed(&run, &["not-finite", "iteration-limit"], &["iteration"]);
    }
}

#[test]
fn an_inner_solver_that_gives_up() {
    let options = ["-upper_ksp_type", "cg", "-upper_pc_type", "none", "-upper_ksp_max_it", "2"];
    let run = solve(case("groove"), &[&COARSE[..], &options].concat());
    failed(&run, &["inner-solver"], &["`upper`", "iteration 0"]);
}

/// Bodies of revolution have an axis, and nothing around it that is not the same all around.
#[test]
fn axisymmetric_scenes() {
    let scene = |from: &str, to: &str| {
        Scene::edited("groove", "dimension = 2 ", "plane = \"axisymmetric\"\ndimension = 2 ").text.replace(from, to)
    };
    let refused_for = |from: &str, to: &str, code: i32, words: &[&str]| {
        refused(&solve(Scene::new(scene(from, to)), &[]), code, words);
    };
    refused_for("pressure = 10", "force = [1, -10]", SCENE, &["force across the axis", "must be 0", "pressure = p"]);
    refused_for("\"axisymmetric\"", "\"axisymetric\"", SCENE, &["`axisymetric`", "did you mean `axisymmetric`?"]);
    let axis = "on = \"lower_end\", x = ";
    refused_for(
        &format!("{axis}0"),
        &format!("{axis}0.1"),
        SCENE,
        &["two values of the x displacement", "on the axis"],
    );
    refused_for("{ on = \"lower_face\",", "{ on = \"lower_end\",", SCENE, &["`lower_end` lies on the axis", "no area"]);
    let spring = "name = \"lower\"\nspring = [{ on = \"lower_end\", normal = 1 }]";
    refused_for("name = \"lower\"", spring, SCENE, &["`lower_end` lies on the axis"]);
    let fibres = "orthotropic = { E1 = 5, E2 = 1, E3 = 1, nu12 = 0.3, nu13 = 0.3, nu23 = 0.3, G12 = 1, G13 = 1, G23 = 1 }\n\
                  axes = { angle = 0.5, axis = [1, 1, 0] }\n";
    let lower = "name = \"lower\"\nyoung = 2.1e5\npoisson = 0.3\n";
    refused_for(lower, &format!("name = \"lower\"\n{fibres}"), SCENE, &["`lower`", "would twist", "turn axes 1 and 2"]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (script, moved) = (root().join("meshes/patch/patch.geo"), folder.path().join("moved.geo"));
    let text = std::fs::read_to_string(&script).expect("a script");
    std::fs::write(&moved, text.replace("Point(4) = {0,", "Point(4) = {-0.5,")).expect("a script");
    let scene = Scene::edited("patch", "dimension = 2 ", "plane = \"axisymmetric\"\ndimension = 2 ");
    let scene = Scene::new(scene.text.replace(&script.display().to_string(), &moved.display().to_string()));
    refused(&solve(&scene, &[]), MESH, &["moved.geo", "`lower` has a negative radius at (-", "x >= 0"]);
    let space = Scene::edited("patch-3d", "dimension = 3", "plane = \"axisymmetric\"\ndimension = 3");
    refused(&solve(&space, &[]), SCENE, &["`plane` in a problem in space"]);
}

/// What all ranks find, or the owner of one body alone, is said once, and no rank waits for another.
#[test]
fn two_ranks_refuse_as_one() {
    let words: [(i32, &[&str], &[&str]); 5] = [
        (SCENE, &["--set", "method.gama=1"], &["did you mean `gamma`?"]),
        (SCENE, &["--set", "contact.0.gap=sqrt(x-1)"], &["the gap is not a finite number"]),
        (SCENE, &["--set", "body.upper.load.0.pressure=sqrt(x-2)"], &["this load is not a finite number"]),
        (SOLVER, &["-upper_ksp_tpye", "cg"], &["-upper_ksp_tpye", "did you mean -upper_ksp_type?"]),
        (SOLVER, &["-upper_pc_type", "nonsense"], &["-upper_pc_type nonsense: this PETSc does not know the type"]),
    ];
    for (code, options, words) in words {
        refused(&solve_on(2, case("groove"), options), code, words);
    }
    failed(&solve_on(2, pushed_aside(), &[]), &["underconstrained"], &["`upper`", "translation along x"]);
    let options = ["-upper_ksp_type", "cg", "-upper_pc_type", "none", "-upper_ksp_max_it", "2"];
    let run = solve_on(2, case("groove"), &[&COARSE[..], &options].concat());
    failed(&run, &["inner-solver"], &["`upper`", "iteration 0"]);
}

/// `winkler ... | head` ends in silence.
#[test]
fn a_reader_that_goes_away() {
    for args in [&["check"][..], &["solve", "-o", "out"]] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = Command::new(crate::common::WINKLER);
        crate::common::environment(&mut command);
        command.args(args).arg(case("groove")).args(COARSE).current_dir(folder.path());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("the program ends");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("panicked"), "{args:?}: {said}");
    }
}

/// Two layers between the same facets are refused by the facets, whatever the groups are called. A surface may face two others.
#[test]
fn two_layers_on_the_same_facets() {
    const BLOCKS: &str = "For k In {0:1}
        p=10*k;
        Point(p+1)={0,k,0};Point(p+2)={2,k,0};Point(p+3)={2,k+1,0};Point(p+4)={1,k+1,0};Point(p+5)={0,k+1,0};Point(p+6)={1,k,0};
        Line(p+1)={p+1,p+6};Line(p+2)={p+6,p+2};Line(p+3)={p+2,p+3};Line(p+4)={p+3,p+4};Line(p+5)={p+4,p+5};Line(p+6)={p+5,p+1};
        Curve Loop(k+1)={p+1:p+6};Plane Surface(k+1)={k+1};
        EndFor
        Mesh.MeshSizeMax=0.5;
        Physical Surface(\"lower\")={1};Physical Surface(\"upper\")={2};Physical Curve(\"base\")={1,2};Physical Curve(\"head\")={14,15};
        Physical Curve(\"right\")={4};Physical Curve(\"all\")={4,5};Physical Curve(\"same\")={4,5};Physical Curve(\"left\")={5};
        Physical Curve(\"under\")={11,12};Physical Curve(\"under_left\")={11};Physical Curve(\"under_right\")={12};\n";
    let solved = |contacts: &[&str]| {
        let contacts: Vec<String> = contacts
            .iter()
            .map(|keys| format!("[[contact]]\n{keys}\nlayer = {{ linear = {{ stiffness = 1e5 }} }}\n"))
            .collect();
        let scene = Scene::new(format!(
            "dimension = 2\nmesh = \"blocks.geo\"\n[[body]]\nname = \"lower\"\norder = 1\nyoung = 7e3\npoisson = 0\nfix = [{{ on = \"base\", x = 0, y = 0 }}]\n\
             [[body]]\nname = \"upper\"\norder = 1\nyoung = 7e3\npoisson = 0\nfix = [{{ on = \"head\", x = 0 }}]\nload = [{{ on = \"head\", pressure = 3 }}]\n{}",
            contacts.concat()
        ));
        std::fs::write(scene.path.with_file_name("blocks.geo"), BLOCKS).expect("a script");
        solve(&scene, &[])
    };
    let (pair, obstacle) = ("between = [\"all\", \"under\"]", "on = \"all\"\nobstacle = true\ngap = 1");
    for (first, second, words) in [
        (
            pair,
            "between = [\"same\", \"under\"]",
            "`same` and `under` have facets in common with the contact of `all` and `under`",
        ),
        (pair, "between = [\"under\", \"right\"]", "`under` and `right` have facets in common"),
        (pair, "between = [\"left\", \"under_left\"]\nbond = true", "`left` and `under_left` have facets in common"),
        (obstacle, "on = \"right\"\nobstacle = true\ngap = 2", "`right` and `obstacle` have facets in common"),
    ] {
        refused(&solved(&[first, second]), SCENE, &[words, "two layers"]);
    }
    for contacts in [
        &["between = [\"left\", \"under\"]", "between = [\"right\", \"under\"]"][..],
        &["between = [\"all\", \"under_left\"]", "between = [\"same\", \"under_right\"]"],
        &[pair, "on = \"same\"\nobstacle = true\ngap = 1"],
    ] {
        let run = solved(contacts).converged();
        assert!((run.number("pairs/0/peak_pressure") / 3.0 - 1.0).abs() < 1e-6, "{}", run.said());
    }
}

/// A sweep adapts no mesh, and does not solve loosely in its place.
#[test]
fn sweeps_do_not_adapt() {
    let path = case("groove-held").display().to_string();
    let over = ["--over", "contact.0.layer.power.a=0.5,1", "--set", "mesh.set.n=4"];
    for words in [["--tolerance", "1e-2"], ["--set", "adapt={error=0.5}"]] {
        let run = winkler(&[&["sweep", &path][..], &words, &over].concat());
        assert!(run.code == 2 && run.stderr.contains("adapts none"), "{}", run.said());
    }
    let run = winkler(&[&["sweep", &path, "--estimate", "-o", "out"][..], &over].concat());
    let table = std::fs::read_to_string(run.folder.join("out/sweep.csv")).expect("a table");
    assert!(run.code == 0 && table.contains("pressure_estimate lower-upper"), "{}\n{table}", run.said());
}
