//! The work that the program does is the work that the method needs: exact counts.
//!
//! For two bodies: the start factors each body with springs of its own and solves it once; every sweep solves each
//! body once; a body is factored when its Robin term changed.

use crate::common::here::solve_here;
use crate::common::{Run, case, distance, solve, winkler, winkler_on};

/// Bodies that factor their own G; condensed ones count at the end.
const COARSE: [&str; 4] = ["--set", "mesh.set.n=8", "--set", "solver=mumps"];

fn coarse(name: &str, args: &[&str]) -> Run {
    solve(case(name), &[&COARSE, args].concat()).converged()
}

/// Counts of a run, by name.
fn counts<const N: usize>(run: &Run, names: [&str; N]) -> [usize; N] {
    names.map(|name| run.count(name))
}

/// Solves of bodies in sweeps: all without those of the start, which is one a body.
fn assert_solves(run: &Run, in_sweeps: usize) {
    assert_eq!(run.count("body_solves") - in_sweeps, 2, "one solve a body in the start");
}

#[test]
fn a_nonlinear_layer_factors_every_body_in_every_sweep() {
    let run = solve(case("groove"), &["--set", "solver=mumps"]).converged();
    assert_eq!(counts(&run, ["iterations", "sweeps"]), [7, 8]);
    // 2 for the start, 2 in each sweep; the pattern once a body
    assert_eq!(counts(&run, ["factorizations", "symbolic_factorizations", "assemblies"]), [18, 2, 2]);
    // the lift asks for the springs that set-up has given already
    assert_eq!(counts(&run, ["robin_updates", "robin_updates_skipped"]), [18, 2]);
    assert_solves(&run, 2 * 8);
    assert_eq!(counts(&run, ["inner_iterations", "messages"]), [0, 0]);
    let history = run.history();
    assert_eq!(history.counts("iteration"), (0..8).collect::<Vec<_>>());
    assert_eq!(history.counts("sweeps"), (1..=8).collect::<Vec<_>>());
    assert_eq!(history.counts("factorizations"), (2..=9).map(|k| 2 * k).collect::<Vec<_>>());
}

#[test]
fn without_a_robin_term_stiffness_is_factored_once() {
    let layer = "contact.0.layer={linear={stiffness=1e3}}";
    let rules = ["method.psi=none", "method.gamma=0.5", "method.stop={residual=1e-8}", layer];
    let run = coarse("groove", &rules.map(|rule| ["--set", rule]).concat());
    let sweeps = run.count("sweeps");
    assert!(sweeps > 5, "{sweeps} sweeps tell nothing");
    assert_eq!(run.count("iterations") + 1, sweeps);
    assert_eq!(counts(&run, ["factorizations", "symbolic_factorizations", "robin_updates"]), [4, 2, 4]);
    assert_eq!(run.count("robin_updates_skipped"), 2 + 2 * (sweeps - 1));
    assert_solves(&run, 2 * sweeps);
}

fn full_contact(layer: &[&str]) {
    let run = coarse("wavy", &[&["--set", "method.start.normal=3e-4"], layer].concat());
    let history = run.history();
    assert_eq!(history["closed"], history["points"], "the contact must be full in all iterations");
    let sweeps = run.count("sweeps");
    assert_eq!(counts(&run, ["factorizations", "robin_updates"]), [4, 4]);
    assert_eq!(run.count("robin_updates_skipped"), 2 + 2 * (sweeps - 1));
    assert_solves(&run, 2 * sweeps);
}

fn changing_contact(layer: &str) {
    let run = coarse("groove", &["--set", layer, "--set", "method.stop={residual=1e-10}"]);
    let history = run.history();
    let (closed, factored) = (history.counts("closed"), history.counts("factorizations"));
    assert_eq!(factored[0], 4);
    let mut changes = 0;
    for k in 1..closed.len() {
        let new = factored[k] - factored[k - 1];
        assert!(new == 0 || new == 2, "row {k}: {new} factorisations");
        if closed[k] != closed[k - 1] {
            assert_eq!(new, 2, "row {k}: the contact set changed");
            changes += 1;
        }
    }
    assert!(changes > 0, "a contact set that never changes tells nothing");
    let last = factored.len() - 1;
    assert_eq!(factored[last], factored[last - 3], "the contact set has settled by then: {closed:?}, {factored:?}");
    assert_eq!(run.count("robin_updates"), run.count("factorizations"));
    assert_eq!(run.count("robin_updates") + run.count("robin_updates_skipped"), 2 * (run.count("sweeps") + 2));
}

/// A linear layer, and the power law with a = 1, which is one: its tangent is 1/B to the last digit.
#[test]
fn a_linear_layer_is_factored_again_only_when_the_contact_set_changes() {
    full_contact(&[]);
    full_contact(&["--set", "contact.0.layer={power={B=1e-5,a=1}}"]);
    changing_contact("contact.0.layer={linear={stiffness=4e4}}");
    changing_contact("contact.0.layer={power={B=2.5e-5,a=1}}");
}

/// Preconditioners count as factorisations, Krylov iterations are counted, and direct solves have none.
#[test]
fn krylov_iterations_are_counted() {
    let run = coarse("groove", &["-ksp_type", "cg", "-pc_type", "icc"]);
    let history = run.history();
    assert_eq!(run.count("factorizations"), 2 + 2 * run.count("sweeps"));
    let iterations = history.counts("inner_iterations");
    assert!(iterations.windows(2).all(|pair| pair[0] < pair[1]), "{iterations:?}");
    assert_eq!(iterations.last(), Some(&run.count("inner_iterations")));
    let mixed = coarse("groove", &["-upper_ksp_type", "cg", "-upper_pc_type", "icc"]);
    assert!(mixed.count("inner_iterations") < run.count("inner_iterations"));
}

#[test]
fn multigrid_is_kept_while_the_robin_term_moves_a_little_and_cycles_precondition_newton() {
    let args = ["--method", "newton-robin", "-pc_type", "hypre"];
    let run = coarse("groove-held", &args);
    let updates = run.count("robin_updates");
    assert!(updates > run.count("factorizations"), "{updates} changes, and a set-up for each");
    let always = coarse("groove-held", &[&args[..], &["-ksp_reuse_preconditioner", "0"]].concat());
    assert_eq!(always.count("robin_updates"), always.count("factorizations"));
    assert!(distance(&run.contact()["pressure"], &always.contact()["pressure"]) < 1e-6);
    // an application of the preconditioner for each step of conjugate gradients, a solve only for each iterate
    let each = |run: &Run| run.count("inner_iterations") as f64 / run.count("sweeps") as f64;
    let aitken = ["--method", "robin", "--set", "method.gamma=aitken"];
    let solves = coarse("groove-held", &[&aitken[..], &["-pc_type", "hypre"]].concat());
    assert!(each(&run) < 0.7 * each(&solves), "{} and {} in a sweep", each(&run), each(&solves));
}

/// The weights of the contact table are the lengths of the report, to the spacing of the points.
#[test]
fn the_table_has_the_lengths_of_the_report() {
    let run = solve(case("groove-held"), &["--set", "mesh.set.n=4"]).converged();
    let table = run.contact();
    let weight = &table["weight"];
    let closed = |q: &usize| table["compression"][*q] > 0.0;
    let length: f64 = (0..table.rows()).filter(closed).map(|q| weight[q]).sum();
    let [contact, open] = ["contact", "open"].map(|part| run.number(&format!("pairs/0/{part}_length")));
    assert!((contact + open - weight.iter().sum::<f64>()).abs() < 1e-9, "{contact} {open}");
    assert!((length - contact).abs() <= weight.iter().copied().fold(0.0, f64::max), "{length} {contact}");
    // both inner phases were measured, and lie within the run
    let inner = ["factor", "solve"].map(|phase| run.number(&format!("inner_times/{phase}")));
    assert!(inner.iter().all(|&seconds| seconds > 0.0) && inner.iter().sum::<f64>() < run.number("times/total"));
}

/// The reports of a sweep.
fn sweep(over: &[&str], more: &[&str]) -> Vec<serde_json::Value> {
    sweep_on(1, over, more)
}

/// The same on several ranks.
fn sweep_on(ranks: usize, over: &[&str], more: &[&str]) -> Vec<serde_json::Value> {
    let path = case("groove").display().to_string();
    let over: Vec<&str> = over.iter().flat_map(|over| ["--over", over]).collect();
    let words = ["sweep", &path, "-o", "out", "--json", "--set", "mesh.set.n=8"];
    let run = winkler_on(ranks, &[&words[..], &over, more].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    serde_json::from_str(&run.stdout).expect("a list of reports")
}

/// What a run has made.
const MADE: [&str; 4] = ["assemblies", "symbolic_factorizations", "condensations", "pairings"];

fn made(report: &serde_json::Value) -> [u64; 4] {
    MADE.map(|name| report[name].as_u64().expect("a count"))
}

/// A sweep over methods factors each body once, and every run is the one that `solve` makes.
#[test]
fn a_sweep_over_methods_keeps_condensed_bodies() {
    let (once, never) = ([2, 2, 2, 1], [0; 4]);
    let reports = sweep(&["method.gamma=0.5,0.6"], &[]);
    assert_eq!([made(&reports[0]), made(&reports[1])], [once, never]);
    // each method with its own linear steps, whatever the one before had
    let methods = ["newton-robin", "newton", "robin", "newton-robin", "robin", "newton"];
    let reports = sweep(&[&format!("method.name={}", methods.join(","))], &[]);
    assert!(reports.iter().zip(methods).all(|(report, method)| report["method"] == method));
    assert!(reports[1..].iter().all(|report| report["factorizations"] == 0));
}

/// The second of two scenes makes what the setting touches that differs: nothing for laws, gaps, loads, moved supports
/// and methods, a body for its material or supports, all for another mesh. Its results are those of a run of its own.
#[test]
fn a_sweep_makes_what_a_setting_touches() {
    let (nothing, body, all) = ([0, 0, 0, 0], [1, 1, 1, 0], [2, 2, 2, 1]);
    let end = |support: &str| format!("{{on=\"lower_end\",{support}}}");
    // free along a contact surface, the end is a plane of symmetry no more: the surface has other normals there
    let supports = |one: &str, other: &str| format!("body.0.fix.1={},{}", end(one), end(other));
    let settings = [
        ("contact.0.layer={power={B=1e-5,a=0.5}},{linear={stiffness=1e6}}".to_owned(), nothing),
        ("contact.0.gap=\"1e-4*x\",\"2e-4*x\"".to_owned(), nothing),
        ("body.1.load.0.pressure=10,\"8 + x\"".to_owned(), nothing),
        (supports("x=0,y=0", "x=0,y=1e-4"), nothing),
        ("body.0.young=1e5,2e5".to_owned(), body),
        (supports("x=0,y=0", "y=0"), [1, 1, 1, 1]),
        ("body.0.order=1,2".to_owned(), all),
        ("mesh.set.n=4,8".to_owned(), all),
    ];
    let method = "method={name=\"newton\", stop={residual=1e-10}}";
    let with = |solver: &'static str| ["--set", method, "--set", solver];
    for (over, expected) in &settings {
        let reports = sweep(&[over], &with("solver=condensed"));
        assert_eq!([made(&reports[0]), made(&reports[1])], [[2, 2, 2, 1], *expected], "{over}");
        let (key, values) = over.split_once('=').expect("a setting");
        let set = format!("{key}={}", second(values));
        let alone = solve_here(case("groove"), &["mesh.set.n=8", &set, method, "solver=mumps"]);
        for path in ["pairs/0/peak_pressure", "pairs/0/normal_force", "F1"] {
            let ours = reports[1].pointer(&format!("/{path}")).and_then(serde_json::Value::as_f64).expect(path);
            let theirs = alone.number(path);
            assert!((ours / theirs - 1.0).abs() < 1e-6, "{over}, {path}: {ours} {theirs}");
        }
    }
    for (over, [assemblies, ..]) in [&settings[0], &settings[4]] {
        // one matrix has the K of all bodies, and none has its own any more
        let [factored, multigrid] =
            ["solver=mumps", "solver=hypre"].map(|solver| made(&sweep(&[over], &with(solver))[1]));
        assert_eq!(factored, [2 * assemblies, *assemblies, 0, 0], "{over}");
        assert_eq!(multigrid[0], 2 * assemblies, "{over}");
    }
    // solvers of another kind are made anew, and pairs are not; a rank without a body lets others go when all ranks do
    for ranks in [1, 3] {
        let reports = sweep_on(ranks, &["solver=mumps,condensed,hypre"], &["--set", method]);
        let expected = [[2, 1, 0, 1], [2, 2, 2, 0], [2, 1, 0, 0]];
        assert!(reports.iter().map(made).eq(expected), "{ranks}");
    }
}

/// Newton's method starts from the pressures of the run before, which halves its steps here, or automatically where too
/// many steps would follow. Methods and solvers all have the automatic start, so that they can be compared.
#[test]
fn a_sweep_starts_from_the_run_before() {
    let newton = "method={name=\"newton\"}";
    let steps = |over: &[&str]| -> Vec<u64> {
        sweep(over, &["--set", newton]).iter().map(|report| report["iterations"].as_u64().expect("a count")).collect()
    };
    let alone = solve_here(case("groove"), &["mesh.set.n=8", newton, "contact.0.layer.power.B=1e-5"]);
    let near = steps(&["contact.0.layer.power.B=2e-5,1e-5"])[1] as f64;
    assert!(near + 2.0 <= alone.number("iterations"), "{near} {}", alone.number("iterations"));
    let solvers = steps(&["contact.0.layer.power.B=1e-5", "solver=mumps,condensed"]);
    assert_eq!(solvers[0], solvers[1]);
    // from pressures of another size than its own the second run would take five steps, instead of three
    let path = case("hertz-line").display().to_string();
    let limit = "method={stop={residual=1e-8, iterations=4}}";
    let over = "contact.0.layer={power={B=1e-2,a=0.5}},{power={B=1e-3,a=0.5}}";
    let run = winkler(&["sweep", &path, "-o", "out", "--set", "mesh.set.n=3", "--set", limit, "--over", over]);
    assert_eq!(run.code, 0, "{}", run.said());
}

/// A factor has the normals of curved surfaces as axes of their nodes, and multigrid has not. Bodies do not serve both.
#[test]
fn a_sweep_makes_bodies_with_other_axes_anew() {
    let path = case("rings").display().to_string();
    let linear = ["--set", "body.0.order=1", "--set", "body.1.order=1", "--over", "solver=mumps,gamg,mumps"];
    let run = winkler_on(1, &[&["sweep", &path, "-o", "out", "--json"][..], &linear].concat());
    assert_eq!(run.code, 0, "{}", run.said());
    let reports: Vec<serde_json::Value> = serde_json::from_str(&run.stdout).expect("a list of reports");
    assert!(reports.iter().map(|report| made(report)[0]).eq([2, 2, 2]));
    let peaks: Vec<f64> = reports.iter().filter_map(|report| report["pairs"][0]["peak_pressure"].as_f64()).collect();
    assert!(peaks.len() == 3 && peaks.iter().all(|peak| (peak / peaks[0] - 1.0).abs() < 1e-7), "{peaks:?}");
}

/// The second of two values, which have commas inside brackets and quotes only.
fn second(values: &str) -> &str {
    let mut depth = 0;
    let comma = values.char_indices().find(|(_, c)| {
        depth += i32::from(*c == '{') - i32::from(*c == '}');
        *c == ',' && depth == 0
    });
    &values[comma.expect("two values").0 + 1..]
}
