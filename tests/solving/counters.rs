//! The work that the program does is the work that the method needs: exact counts.
//!
//! For two bodies: the start factors each body with springs of its own and solves it once; every sweep solves each
//! body once; a body is factored when its Robin term changed.

use crate::common::{Run, case, distance, solve, winkler};

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

/// A sweep over methods factors each body once, and every run is the one that `solve` makes.
#[test]
fn a_sweep_over_methods_keeps_condensed_bodies() {
    let sweep = |over: &[&str], more: &[&str]| -> Vec<serde_json::Value> {
        let path = case("groove").display().to_string();
        let over: Vec<&str> = over.iter().flat_map(|over| ["--over", over]).collect();
        let run =
            winkler(&[&["sweep", &path, "-o", "out", "--json", "--set", "mesh.set.n=8"][..], &over, more].concat());
        assert_eq!(run.code, 0, "{}", run.said());
        serde_json::from_str(&run.stdout).expect("a list of reports")
    };
    let done =
        ["assemblies", "factorizations", "symbolic_factorizations", "assemblies_avoided", "factorizations_avoided"];
    let counts = |report: &serde_json::Value| done.map(|name| report[name].as_u64().expect("a count"));
    let (once, never) = ([2, 2, 2, 0, 0], [0, 0, 0, 2, 2]);
    let reports = sweep(&["method.gamma=0.5,0.6"], &[]);
    assert_eq!([counts(&reports[0]), counts(&reports[1])], [once, never]);
    // each method with its own linear steps, whatever the one before had
    let methods = ["newton-robin", "newton", "robin", "newton-robin", "robin", "newton"];
    let reports = sweep(&[&format!("method.name={}", methods.join(","))], &[]);
    assert!(reports.iter().zip(methods).all(|(report, method)| report["method"] == method));
    assert!(reports[1..].iter().all(|report| report["factorizations"] == 0));
    // another load, layer, mesh, body or solver: nothing is left
    let (load, layer) = ("body.1.load.0.pressure=10,\"8 + x\"", "contact.0.layer.power.a=0.5,1");
    for over in [load, layer, "mesh.set.n=4,8", "body.0.young=1e5,2e5", "solver=mumps,condensed"] {
        assert!(sweep(&[over], &[]).iter().all(|report| counts(report)[3..] == [0, 0]), "{over}");
    }
    assert_eq!(counts(&sweep(&["method.gamma=0.5,0.6"], &["--set", "solver=mumps"])[1])[0], 2);
}
