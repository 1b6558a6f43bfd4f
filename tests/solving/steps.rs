//! Load steps: each is the solution of its share of the loads, and no body is made or factored anew for it.

use crate::common::{Run, Scene, case, distance, nanoseconds, root, solve, solve_on};

fn groove(method: &str, more: &[&str]) -> Run {
    let method = format!("method={method}");
    solve(case("groove-held"), &[&["--set", "mesh.set.n=8", "--set", &method][..], more].concat())
}

/// What the report says of a step: force on the first side along y, peak pressure, closed points.
fn step(run: &Run, number: usize) -> (f64, f64, usize) {
    let pair = format!("steps/{number}/pairs/0");
    let closed = run.count(&format!("{pair}/closed"));
    (run.number(&format!("{pair}/force/0/1")), run.number(&format!("{pair}/peak_pressure")), closed)
}

/// The same of a run without steps.
fn result(run: &Run) -> (f64, f64, usize) {
    let closed = run.contact()["compression"].iter().filter(|&&c| c > 0.0).count();
    (run.number("pairs/0/force/0/1"), run.number("pairs/0/peak_pressure"), closed)
}

fn assert_same(ours: (f64, f64, usize), theirs: (f64, f64, usize), label: &str) {
    assert!(
        (ours.0 / theirs.0 - 1.0).abs() < 1e-6 && (ours.1 / theirs.1 - 1.0).abs() < 1e-6,
        "{label}: {ours:?} {theirs:?}"
    );
    assert_eq!(ours.2, theirs.2, "{label}");
}

/// Prescribed displacements are loads, gaps and starts are not: two blocks of E = 100 and a layer of 300, pressed by -0.01 from a
/// gap of 0.002, p = (u - d)/(1/100 + 1/100 + 1/300). The lower one is stretched
/// sideways as well, which is no rigid motion and leaves p alone.
#[test]
fn prescribed_displacements_are_scaled_and_gaps_are_not() {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let block = |name: &str, fix: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 100\npoisson = 0\nfix = [{fix}, {{ on = \"{name}_left\", x = 0 }}]\n"
        )
    };
    let text = format!(
        "dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = 2, n1 = 2, n2 = 3 }} }}\n{}{}[[contact]]\n\
         between = [\"b1_top\", \"b2_bottom\"]\ngap = 0.002\nlayer = {{ linear = {{ stiffness = 300 }} }}\n",
        block("b1", "{ on = \"b1_bottom\", y = 0 }, { on = \"b1_right\", x = 0.001 }"),
        block("b2", "{ on = \"b2_top\", y = -0.01 }")
    );
    for (start, solver) in [("\"auto\"", "condensed"), ("\"zero\"", "mumps"), ("{normal=1e-3}", "mumps")] {
        let method =
            format!("method={{gamma=\"aitken\", robin=\"auto\", steps=5, start={start}, stop={{residual=1e-10}}}}");
        let solver = format!("solver={solver}");
        let run = solve(Scene::new(text.clone()), &["--set", &method, "--set", &solver]).converged();
        for number in 0..5 {
            let factor = (number + 1) as f64 / 5.0;
            let pressure = f64::max(0.01 * factor - 0.002, 0.0) / (2.0 / 100.0 + 1.0 / 300.0);
            let (force, peak, closed) = step(&run, number);
            let scale = 0.01 * 100.0;
            assert!(
                (peak - pressure).abs() < 1e-8 * scale && (force + pressure).abs() < 1e-8 * scale,
                "{number}: {peak}"
            );
            assert!(number == 0 || closed == run.count("pairs/0/points"));
        }
        assert!((run.contact()["u_n_b2"][0] - (0.01 - run.number("pairs/0/peak_pressure") / 100.0)).abs() < 1e-9);
    }
}

/// K does not depend on the loads: condensed bodies are factored once, others as often as their Robin term changes.
#[test]
fn steps_assemble_and_factor_nothing() {
    let names = ["assemblies", "factorizations", "symbolic_factorizations"];
    let counts = |run: &Run| names.map(|name| run.count(name));
    let steps = groove("{name=\"newton\", steps=6}", &[]).converged();
    assert_eq!(counts(&steps), [2, 2, 2]);
    // without a Robin term: the start, then K, whatever the steps
    let linear = |steps: &str| {
        let method = format!("method={{psi=\"none\", gamma=0.5, {steps} stop={{residual=1e-8}}}}");
        let layer = ["--set", "contact.0.layer={linear={stiffness=1e3}}", "--set", "solver=mumps"];
        solve(case("groove"), &[&["--set", "mesh.set.n=8", "--set", &method][..], &layer].concat()).converged()
    };
    assert_eq!(counts(&linear("steps=3,")), [2, 4, 2]);
    assert_eq!(counts(&linear("")), [2, 4, 2]);
    // a step starts from the one before: the same load again is there at once
    let again = groove("{name=\"newton\", steps=[1, 1]}", &[]).converged();
    assert_eq!(again.count("steps/1/iterations"), 1);
}

/// A step that is not solved is reported, and the next one goes on from where it ended.
#[test]
fn a_step_that_is_not_solved() {
    let method = |steps: &str| format!("{{gamma=0.6, {steps} stop={{residual=1e-8, iterations=70}}}}");
    let alone = groove(&method(""), &[]);
    assert_eq!(alone.text("status"), "iteration-limit");
    let run = groove(&method("steps=[1, 1],"), &[]);
    assert_eq!((run.code, run.text("status"), run.text("steps/0/status")), (1, "iteration-limit", "iteration-limit"));
    assert!(run.warnings().contains("load step 1 (factor 1): not converged in 70 iterations"), "{}", run.warnings());
    assert!(run.stdout.contains("step 1, factor 1.0000: 70 iterations, iteration-limit"), "{}", run.stdout);
}

#[test]
fn steps_on_two_ranks() {
    let args = ["--set", "mesh.set.n=8", "--set", "method={name=\"newton-robin\", steps=3}"];
    let (serial, parallel) =
        (solve(case("groove-held"), &args).converged(), solve_on(2, case("groove-held"), &args).converged());
    assert_eq!(serial.report["steps"], parallel.report["steps"]);
    assert_eq!(serial.contact()["pressure"], parallel.contact()["pressure"]);
}

/// The mesh is adapted under the largest step, and all steps run on it: the largest one is the last mesh of a run with these loads alone, and each is the
/// run with its share of the loads on that mesh, which is written.
#[test]
fn steps_run_on_the_mesh_of_the_largest_one() {
    let now = nanoseconds();
    let graded = root().join("meshes/groove-held/graded.toml");
    let title = format!("title={now} steps");
    let adapted = ["--tolerance", "2e-3", "--set", "mesh.set.n=1", "--set", &title];
    let method = |steps: &str| format!("method={{{steps} stop={{residual=1e-9}}}}");
    let run = solve(&graded, &[&adapted[..], &["--set", &method("steps=[0.5, 2, 1],")]].concat()).converged();
    let load = ["--set", "body.1.load.0.pressure=20"];
    let largest = solve(&graded, &[&adapted[..], &load, &["--set", &method("")]].concat()).converged();
    assert_eq!(run.report["steps"].as_array().map(Vec::len), Some(3), "{}", run.said());
    let rounds = |run: &Run| {
        let all = run.report["rounds"].as_array().expect("rounds").clone();
        all.iter().map(|round| (round["cells"].clone(), round["pressure"].clone())).collect::<Vec<_>>()
    };
    assert!(rounds(&run).len() > 1 && rounds(&run) == rounds(&largest), "{}\n{}", run.said(), largest.said());
    assert_same(step(&run, 1), result(&largest), "the largest step");

    let mesh = format!("mesh={}", run.folder.join("adapted.msh").display());
    for (number, factor) in [0.5, 2.0, 1.0].into_iter().enumerate() {
        let load = format!("body.1.load.0.pressure={}", 10.0 * factor);
        let sets = ["--set", &mesh, "--set", &load, "--set", "method={stop={residual=1e-9}}"];
        let alone = solve(&graded, &sets).converged();
        assert_same(step(&run, number), result(&alone), &format!("step {number}"));
        assert_eq!(alone.count("dofs"), run.count("dofs"));
        if number == 2 {
            assert!(distance(&run.contact()["pressure"], &alone.contact()["pressure"]) < 1e-7);
        }
    }
}

/// Load steps on the last of a few meshes that do not reach the error.
#[test]
fn steps_on_a_mesh_that_is_not_fine_enough() {
    let now = nanoseconds();
    let (graded, title) = (root().join("meshes/groove-held/graded.toml"), format!("title={now} coarse"));
    let sets = ["adapt.error=1e-5", "adapt.rounds=2", "mesh.set.n=1", "method.steps=[0.5,1]", &title];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
    let run = solve(&graded, &sets);
    assert_eq!((run.code, run.text("status"), run.text("steps/1/status")), (1, "mesh-limit", "converged"));
    let steps = run.report["steps"].as_array().map(Vec::len);
    assert_eq!((steps, run.report["rounds"].as_array().map(Vec::len)), (Some(2), Some(2)), "{}", run.said());
}

/// A step that begins at its solution makes fewer sweeps than the one before; those are not counted again.
#[test]
fn sweeps_of_a_step_are_counted_once() {
    let sets = ["--method", "newton-robin", "--set", "mesh.set.n=8", "--set", "method.steps=[1,1]"];
    let run = solve(case("groove-held"), &sets).converged();
    let (step, sweeps) = (run.history().counts("step"), run.history().counts("sweeps"));
    let first = sweeps[step.iter().rposition(|&step| step == 1).expect("a first step")];
    let all = sweeps[sweeps.len() - 1];
    assert_eq!(run.count("sweeps"), all);
    assert!(first < all && all < 2 * first, "{sweeps:?}");
}
