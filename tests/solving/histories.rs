//! Histories of loads by a table of factors, and what is written of each step.

use crate::common::blocks::Blocks;
use crate::common::vtu::Grid;
use crate::common::{Run, Scene, Table, case, distance, root, solve, text_of, winkler};
use std::fs;
use std::path::{Path, PathBuf};

/// The groove with the lower block on a support that is lifted and the upper one pressed, each by its own factor.
fn groove(steps: &str) -> Scene {
    let text = text_of("groove-held");
    let (held, _) = text.split_once("[method]").expect("a method");
    let path = |name: &str| if steps.contains("table") { format!(", path = \"{name}\"") } else { String::new() };
    let text = held
        .replace("pressure = 10 }", &format!("pressure = 10{} }}", path("press")))
        .replace("on = \"lower_face\", y = 0 }", &format!("on = \"lower_face\", y = 1e-3{} }}", path("lift")))
        .replace("n = 32", "n = 8");
    Scene::new(format!("{text}[method]\nstop = {{ residual = 1e-10 }}\n{steps}"))
}

/// The same with a table beside it.
fn with_table(table: &str) -> Scene {
    let scene = groove("steps = { table = \"path.csv\" }\n");
    fs::write(scene.path.with_file_name("path.csv"), table).expect("a table can be written");
    scene
}

const PATH: &str = "# loading, lifting, and back\ntime, press, lift\n0, 0, 0\n0.5, 0.5, 0\n1, 1, 0\n2, 1, 1\n3, 0.5, 1\n4, 0.5, 0\n5, 1, 0\n";

/// `steps.csv` without its words.
fn steps(folder: &Path) -> Table {
    let text = fs::read_to_string(folder.join("steps.csv")).expect("a table of steps");
    let numbers = folder.join("numbers.csv");
    fs::write(&numbers, text.replace("converged", "1").replace("iteration-limit", "0").replace("interrupted", "2"))
        .expect("a table");
    Table::read(&numbers)
}

fn near(ours: f64, theirs: f64, size: f64, label: &str) {
    assert!((ours - theirs).abs() <= size, "{label}: {ours} {theirs}");
}

/// Every step of a path is the run with its loads, whatever came before: elastic layers have no memory.
#[test]
fn a_step_of_a_path_is_a_run_with_its_loads() {
    for method in ["auto", "newton-robin"] {
        let run = solve(with_table(PATH), &["--method", method]).converged();
        let table = steps(&run.folder);
        assert_eq!(table["time"], [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!([table["press"][4], table["lift"][4]], [0.5, 1.0]);
        // only the first of the steps may be open: nothing presses
        let sizes = [("peak_pressure", 3e-6), ("contact_length", 1e-7), ("force_y", 4e-5)];
        for (step, (&press, &lift)) in table["press"].iter().zip(&table["lift"]).enumerate().skip(1) {
            let load = format!("body.1.load.0.pressure={}", 10.0 * press);
            let fix = format!("body.0.fix.1.y={}", 1e-3 * lift);
            let sets = ["--method", method, "--set", &load, "--set", &fix, "--set", "method.steps=1"];
            let alone = solve(groove(""), &sets).converged();
            let label = format!("{method}, step {step}");
            let of = |name: &str| table[&format!("{name} lower-upper")][step];
            for (name, size) in sizes {
                let path = if name == "force_y" { "pairs/0/force/0/1" } else { &format!("pairs/0/{name}") };
                near(of(name), alone.number(path), size, &format!("{label}, {name}"));
            }
            near(of("approach"), alone.number("pairs/0/approach"), 1e-10, &label);
            for (column, path) in [
                ("reaction_x lower:lower_axis", "bodies/0/balance/supports/0/force/0"),
                ("reaction_y lower:lower_face", "bodies/0/balance/supports/1/force/1"),
                ("reaction_x upper:upper_axis", "bodies/1/balance/supports/0/force/0"),
            ] {
                near(table[column][step], alone.number(path), 4e-5, &format!("{label}, {column}"));
            }
            if step == 6 {
                assert!(distance(&run.contact()["pressure"], &alone.contact()["pressure"]) < 1e-7);
                assert!(distance(&run.contact()["u_n_upper"], &alone.contact()["u_n_upper"]) < 1e-7);
                near(run.number("F1") / alone.number("F1"), 1.0, 1e-7, &label);
            }
        }
        let rows = run.history();
        assert_eq!(rows.counts("step").last(), Some(&7));
        assert!(rows["factorizations"].windows(2).all(|pair| pair[0] <= pair[1]));
        let sum: usize = (0..7).map(|step| run.count(&format!("steps/{step}/iterations"))).sum();
        assert_eq!([run.count("iterations"), sum], [sum, table.counts("iterations").iter().sum()]);
        // the lifted support presses no more; force over approach is one curve there and back
        let force = &table["force_y lower-upper"];
        near(force[1], force[5], 4e-5, "half the load");
        near(force[2], force[6], 4e-5, "the full load");
        assert!(["force-approach.svg", "force-time.svg"].iter().all(|plot| run.folder.join(plot).is_file()));
    }
}

/// The stationary iteration, too, begins with the pressures of a step whose loads had another direction.
#[test]
fn sweeps_go_on_in_another_direction() {
    // the paper's iteration needs a closed contact to begin with
    let pressed = PATH.replace("0, 0, 0\n", "");
    let run = |method: &str| solve(with_table(&pressed), &["--method", method]).converged();
    let (ours, theirs) = (run("robin"), run("auto"));
    for step in 0..6 {
        let peak = format!("steps/{step}/pairs/0/peak_pressure");
        near(ours.number(&peak), theirs.number(&peak), 1e-5, &peak);
    }
}

/// Steps change vectors alone, whatever direction their loads have: bodies are assembled and condensed once, and
/// surfaces are searched once.
#[test]
fn a_history_has_one_set_up() {
    let names = ["assemblies", "condensations", "pairings"];
    let counts = |run: &Run| names.map(|name| run.count(name));
    let bent = "press,lift\n0.1,0.2\n0.4,0.8\n0.2,0.5\n0.1,0.25\n";
    let gap = ["--set", "contact.0.gap=\"1e-4*lift\""];
    for more in [&[][..], &gap] {
        let of = |solver: &str| {
            let solver = format!("solver={solver}");
            solve(with_table(bent), &[&["--set", &solver], more].concat()).converged()
        };
        let [factored, condensed, multigrid] = ["mumps", "condensed", "hypre"].map(of);
        assert_eq!([&factored, &multigrid].map(counts), [[2, 0, 1]; 2]);
        assert_eq!(factored.count("symbolic_factorizations"), 1);
        assert_eq!(counts(&condensed), [2, 2, 1]);
        assert_eq!(condensed.count("factorizations"), 2);
    }
    // the offset of a preload is an unknown of the first step alone, around the matrix of all bodies
    let bolt = |solver: &str| solve(case("bolt"), &["--set", solver]).converged();
    assert_eq!(counts(&bolt("solver=condensed")), [4, 4, 3]);
    let factored = bolt("solver=mumps");
    assert_eq!((counts(&factored), factored.count("symbolic_factorizations")), ([4, 0, 3], 1));
    // one column of all loads: no line names it
    let scene = case("groove-held");
    let folder = tempfile::tempdir().expect("a folder");
    let text = fs::read_to_string(&scene)
        .expect("a scene")
        .replace("../groove", &root().join("meshes/groove").display().to_string());
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).expect("a scene");
    fs::write(folder.path().join("path.csv"), "factor\n0.5\n1\n0.7\n").expect("a table");
    let run = solve(&path, &["--set", "mesh.set.n=8", "--set", "method={steps={table=\"path.csv\"}}"]).converged();
    assert_eq!(run.count("assemblies"), 2);
    // and it may end below the full load
    near(run.number("pairs/0/force/0/1"), -28.0, 1e-6, "the last step");
    near(steps(&run.folder)["time"][2], 3.0, 0.0, "times are numbers of steps");
}

/// A moment has no resultant, so that it pushes nothing along any normal: the approach is that of the pressed face, however the
/// blocks are turned.
#[test]
fn a_moment_does_not_push() {
    let approach = |angle: f64| {
        let (sine, cosine) = angle.sin_cos();
        let mut mesh = Blocks::default();
        let turn = |[x, y, _]: [f64; 3], low: f64| [cosine * x - sine * (y + low), sine * x + cosine * (y + low), 0.0];
        mesh.add("lo", 2, 1, 5, |x| turn(x, 0.0));
        mesh.add("up", 2, 1, 4, |x| turn(x, 1.0));
        let scene = Scene::new(
            "dimension = 2\nmesh = \"blocks.msh\"
[[body]]\nname = \"lo\"\norder = 1\nyoung = 1000\npoisson = 0.3\nfix = [{ on = \"lo_low\", x = 0, y = 0 }]
[[body]]\nname = \"up\"\norder = 1\nyoung = 1000\npoisson = 0.3
load = [{ on = \"up_high\", pressure = 1 }, { on = \"up_side\", moment = 0.1 }]\nspring = [{ on = \"up_side\", stiffness = 1 }]
[[contact]]\nbetween = [\"lo_high\", \"up_low\"]\nlayer = { linear = { stiffness = 1e4 } }\n",
        );
        let text = mesh.text(1, |x| x.to_string());
        std::fs::write(scene.path.with_file_name("blocks.msh"), text).expect("a mesh");
        solve(scene, &[]).converged().number("pairs/0/approach")
    };
    let upright = approach(0.0);
    assert!((upright / 2e-3 - 1.0).abs() < 0.2, "{upright}");
    for angle in [0.2, 1.0, 3.0] {
        near(approach(angle) / upright, 1.0, 1e-9, "turned");
    }
}

/// Two blocks of E = 100 and height 1, a layer of 300, a gap of 0.002: pressed by p their far faces approach by the gap and
/// p (1/100 + 1/100 + 1/300); moved by u they approach by u.
#[test]
fn the_approach_is_that_of_the_far_faces() {
    let geo = root().join("meshes/stack/stack.geo");
    let block =
        |name: &str, more: &str| format!("[[body]]\nname = \"{name}\"\norder = 1\nyoung = 100\npoisson = 0\n{more}\n",);
    let left = |name: &str| format!("{{ on = \"{name}_left\", x = 0 }}");
    let scene = |below: f64, upper: &str| {
        let lower = format!("fix = [{{ on = \"b1_bottom\", y = {below} }}, {}]", left("b1"));
        Scene::new(format!(
            "dimension = 2\nmesh = {{ geo = \"{}\", set = {{ rows = 2, n1 = 2, n2 = 3 }} }}\n{}{}[[contact]]\n\
             between = [\"b2_bottom\", \"b1_top\"]\ngap = 0.002\nlayer = {{ linear = {{ stiffness = 300 }} }}\n[method]\nsteps = 4\n",
            geo.display(),
            block("b1", &lower),
            block("b2", upper),
        ))
    };
    let soft = 2.0 / 100.0 + 1.0 / 300.0;
    // a pressure at the side presses nothing along the normal
    let pressed = format!(
        "fix = [{}]\nload = [{{ on = \"b2_top\", pressure = 2 }}, {{ on = \"b2_right\", pressure = 0.0 }}]",
        left("b2")
    );
    let table = steps(&solve(scene(0.0, &pressed), &[]).converged().folder);
    let moved = format!("fix = [{}, {{ on = \"b2_top\", y = -0.006 }}]", left("b2"));
    let other = steps(&solve(scene(0.004, &moved), &[]).converged().folder);
    for step in 0..4 {
        let share = (step + 1) as f64 / 4.0;
        near(table["approach b2-b1"][step], 0.002 + 2.0 * share * soft, 1e-9, "pressed");
        near(other["approach b2-b1"][step], 0.01 * share, 1e-12, "moved");
        let force = f64::max(0.01 * share - 0.002, 0.0) / soft;
        near(other["force_y b2-b1"][step], force, 1e-7, "force on the first body");
        near(other["reaction_y b2:b2_top"][step], -force, 1e-7, "reaction");
        near(other["reaction_y b1:b1_bottom"][step], force, 1e-7, "reaction below");
    }
}

/// Displacements at the nodes in a file.
fn displacement(path: &Path) -> Vec<f64> {
    Grid::read(path).arrays["displacement"].clone()
}

#[test]
fn fields_of_all_steps_are_a_series_in_time() {
    let run = solve(with_table("time,press,lift\n0.5,0.5,0\n1.25,1,0\n7,1,1\n"), &["--vtu"]).converged();
    let text = fs::read_to_string(run.folder.join("bodies.pvd")).expect("a collection");
    let word = |line: &str, key: &str| {
        line.split(&format!("{key}=\"")).nth(1).and_then(|rest| rest.split('"').next()).map(str::to_owned)
    };
    let entries: Vec<(String, String)> =
        text.lines().filter_map(|line| Some((word(line, "timestep")?, word(line, "file")?))).collect();
    let expected: Vec<(String, String)> = [("0.5", "steps/", "-1"), ("1.25", "steps/", "-2"), ("7", "", "")]
        .iter()
        .flat_map(|(time, folder, number)| {
            ["lower", "upper", "contact-lower-upper"]
                .map(|name| ((*time).to_owned(), format!("{folder}{name}{number}.vtu")))
        })
        .collect();
    assert_eq!(entries, expected);
    for (step, sets) in [("steps/upper-1", ["5", "0"]), ("steps/upper-2", ["10", "0"]), ("upper", ["10", "1e-3"])] {
        let (load, fix) = (format!("body.1.load.0.pressure={}", sets[0]), format!("body.0.fix.1.y={}", sets[1]));
        let alone = solve(groove(""), &["--vtu", "--set", &load, "--set", &fix]).converged();
        let (ours, theirs) =
            (displacement(&run.folder.join(format!("{step}.vtu"))), displacement(&alone.folder.join("upper.vtu")));
        assert!(distance(&ours, &theirs) < 1e-8, "{step}");
    }
    // nobody asked for fields, or for tables of pairs
    let steps = |sets: &[&str]| -> Vec<PathBuf> {
        let run = solve(with_table(PATH), sets);
        fs::read_dir(run.folder.join("steps"))
            .map_or(Vec::new(), |files| files.flatten().map(|file| file.path()).collect())
    };
    let tables = steps(&[]);
    assert!(!tables.is_empty() && tables.iter().all(|path| path.extension().is_some_and(|ending| ending == "csv")));
    assert!(steps(&["--set", "output.pairs=0"]).is_empty());
}

#[test]
fn sweeps_have_forces_and_reactions() {
    let scene = groove("");
    let folder = scene.path.with_file_name("out");
    let words = ["sweep", scene.path.to_str().expect("a path"), "--over", "body.1.load.0.pressure=5,10", "-o"];
    let run = winkler(&[&words[..], &[folder.to_str().expect("a path")]].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    let mut file = csv::Reader::from_path(folder.join("sweep.csv")).expect("a table");
    let header = file.headers().expect("a header").clone();
    let rows: Vec<csv::StringRecord> = file.records().map(|row| row.expect("a row")).collect();
    let number = |row: usize, name: &str| -> f64 {
        let column = header.iter().position(|column| column == name).unwrap_or_else(|| panic!("{name}"));
        rows[row][column].parse().expect("a number")
    };
    for (row, load) in [5.0, 10.0].into_iter().enumerate() {
        near(number(row, "force_y lower-upper"), -4.0 * load, 1e-6, "force");
        near(number(row, "reaction_y lower:lower_face"), 4.0 * load, 1e-6, "reaction");
        let alone = solve(groove(""), &["--set", &format!("body.1.load.0.pressure={load}")]).converged();
        near(number(row, "approach lower-upper"), alone.number("pairs/0/approach"), 1e-12, "approach");
    }
}

/// A row with other columns is refused before its run, and leaves those that are there.
#[test]
fn a_sweep_over_supports_keeps_its_rows() {
    let scene = groove("");
    let folder = scene.path.with_file_name("out");
    let one = "[{on='lower_axis',x=0},{on='lower_face',y=0}]";
    let over = format!("body.0.fix={one},{}", one.replace(']', ",{on='lower_end',x=0}]"));
    let (scene, out) = (scene.path.to_str().expect("a path"), folder.to_str().expect("a path"));
    let run = winkler(&["sweep", scene, "--over", &over, "-o", out]);
    assert!(run.code == 2 && run.stderr.contains("other contacts or supports"), "{}", run.said());
    assert!(run.stderr.contains("lower_end"), "{}", run.stderr);
    let text = fs::read_to_string(folder.join("sweep.csv")).expect("a table");
    assert_eq!(text.lines().count(), 2, "{text}");
}

#[test]
fn tables_that_are_none_are_refused_with_their_line() {
    let refused = |table: &str, words: &[&str]| {
        let run: Run = solve(with_table(table), &[]);
        assert!(
            run.code == 3 && words.iter().all(|word| run.stderr.contains(word)),
            "{table}\n{words:?}\n{}",
            run.said()
        );
    };
    refused("", &["has no steps", "scene.toml"]);
    refused("press,lift\n", &["has no steps"]);
    refused("0.5,1\n1,1\n", &["no names of factors", "path.csv:1"]);
    refused("time\n1\n", &["no names of factors"]);
    refused("press,lift,press\n1,1,1\n", &["two columns are called `press`", "path.csv:1"]);
    refused("press,lift\n1,1\n\n1\n", &["a step has 2 numbers here, not 1", "path.csv:4"]);
    refused("press,lift\n1,one\n", &["`lift` is `one`", "path.csv:2"]);
    refused("press,lift\n1,inf\n", &["not a finite number"]);
    refused("time,press,lift\n1,1,1\n1,1,1\n", &["the time 1 comes after 1", "path.csv:3"]);
    refused("press\n1\n", &["no column `lift`", "scene.toml"]);
    refused("press,lft\n1,1\n", &["no column `lift`", "did you mean `lft`?"]);
    refused("press,lift,shear\n1,1,1\n", &["no load, support or contact has the path `shear`"]);
    refused("press;lift\n1;1\n", &["this table has one column", "by commas", "path.csv:1"]);
    let run = solve(groove("steps = { table = \"paths.csv\" }\n"), &[]);
    assert!(run.code == 3 && run.stderr.contains("there is no file"), "{}", run.said());
    let run = solve(groove("steps = { tabel = \"path.csv\" }\n"), &[]);
    assert!(run.code == 3 && run.stderr.contains("did you mean `table`?"), "{}", run.said());
    // a load that grows beyond the range of numbers is refused in its step, and the rows before are there
    let run = solve(with_table("press,lift\n1,0\n1e308,1\n"), &[]);
    assert!(run.code == 3 && steps(&run.folder).rows() == 1, "{}", run.said());
}

/// A history has the status of its worst step; what later steps keep of such a step is named.
#[test]
fn a_history_is_as_good_as_its_worst_step() {
    let scene = with_table("press, lift\n1, 0\n0, 0\n");
    let run = solve(&scene, &["--method", "newton", "--set", "method.stop.iterations=1"]);
    let statuses = [0, 1].map(|step| run.text(&format!("steps/{step}/status")).to_owned());
    assert_eq!(statuses, ["iteration-limit", "converged"], "{}", run.said());
    assert_eq!((run.code, run.text("status")), (1, "iteration-limit"), "{}", run.said());
    assert!(run.text("message").starts_with("1 of 2 load steps found no solution; load step 1: "), "{}", run.said());
    let kept = Scene::edited("bolt", "[method]", "[method]\nstop = { iterations = 1 }");
    fs::copy(case("bolt").with_file_name("tighten.csv"), kept.path.with_file_name("tighten.csv")).expect("a table");
    let run = solve(&kept, &["--method", "robin", "--set", "method.gamma=0.3"]);
    assert!(run.warnings().contains("keep the offset of `top1` and `cut`"), "{}", run.said());
}

/// Names of columns that `steps.csv` has itself, and a path of an expression, which has the columns as variables.
#[test]
fn columns_of_the_table_of_steps() {
    for name in ["step", "status", "iterations", "residual"] {
        let run = solve(with_table(&format!("{name}, press, lift\n1, 1, 0\n")), &[]);
        assert_eq!(run.code, 3, "{}", run.said());
        assert!(run.stderr.contains(&format!("a column is called `{name}`")), "{}", run.said());
    }
    let sets = ["--set", "contact.0.force=10*press", "--set", "contact.0.path=press"];
    let run = solve(with_table(PATH), &sets);
    assert!(run.code == 3 && run.stderr.contains("`path` of an expression"), "{}", run.said());
}
