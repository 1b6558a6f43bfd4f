//! One problem has one answer: any method, linear solver and number of ranks give its pressures, by the work that they need.

use crate::common::here::solve_here;
use crate::common::{Report, Table, case, distance, solve_on};
use serde_json::Value;
use std::ops::Deref;

/// A way to solve a scene.
struct Way {
    /// Values of `method` in the scene, without its `stop`.
    method: &'static str,
    /// Value of `solver`; the program chooses if it is empty.
    solver: &'static str,
    /// PETSc options of the command line.
    options: &'static str,
    ranks: usize,
    /// Exact counts of the report.
    counts: &'static [(&'static str, usize)],
}

const fn by(method: &'static str, solver: &'static str, counts: &'static [(&'static str, usize)]) -> Way {
    Way { method, solver, options: "", ranks: 1, counts }
}

const fn typed(options: &'static str, counts: &'static [(&'static str, usize)]) -> Way {
    Way { method: "gamma=0.6", solver: "", options, ranks: 1, counts }
}

const fn on(ranks: usize, method: &'static str, solver: &'static str) -> Way {
    Way { method, solver, options: "", ranks, counts: &[] }
}

const NEWTON: &str = "name=\"newton\"";
const SEMISMOOTH: &str = "name=\"semismooth\", gamma=1";
const NEWTON_ROBIN: &str = "name=\"newton-robin\"";

/// What Newton's method does for two bodies that are condensed: one sparse factor and assembly each, and no solve of a body.
const CONDENSED: &[(&str, usize)] =
    &[("factorizations", 2), ("symbolic_factorizations", 2), ("assemblies", 2), ("body_solves", 0), ("sweeps", 0)];
/// The same for the matrix of all bodies: one pattern.
const JOINED: &[(&str, usize)] = &[
    ("symbolic_factorizations", 1),
    ("dense_factorizations", 0),
    ("assemblies", 2),
    ("body_solves", 0),
    ("sweeps", 0),
    ("robin_updates", 0),
];

const GROOVE: [Way; 32] = [
    by("gamma=0.6", "", &[("factorizations", 2), ("assemblies", 2)]),
    by("gamma=[0.9, 0.5, 0.6]", "", &[]),
    by("gamma=\"line-search\"", "", &[]),
    by("gamma=\"aitken\"", "", &[]),
    by("gamma=\"line-search\", psi=\"full\"", "", &[]),
    // S is factored once a body, besides the start
    by("gamma=\"line-search\", psi=\"none\"", "", &[("dense_factorizations", 4)]),
    by("gamma=\"line-search\", psi=\"x > 2\"", "", &[]),
    by("gamma=\"aitken\", psi=[\"full\", \"x > 2\"]", "", &[]),
    by("gamma=\"0.6 + 0.3*exp(-k)\"", "", &[]),
    by(SEMISMOOTH, "", CONDENSED),
    by(SEMISMOOTH, "mumps", JOINED),
    by("name=\"semismooth\", gamma=\"line-search\"", "hypre", JOINED),
    by(NEWTON_ROBIN, "", &[]),
    by(NEWTON, "condensed", CONDENSED),
    by(NEWTON, "mumps", JOINED),
    by(NEWTON, "hypre", JOINED),
    by("gamma=0.6", "mumps", &[("symbolic_factorizations", 2), ("dense_factorizations", 0), ("inner_iterations", 0)]),
    by("gamma=0.6", "hypre", &[]),
    by("gamma=0.6", "gamg", &[]),
    by("gamma=0.6", "icc", &[]),
    by(NEWTON_ROBIN, "icc", &[]),
    typed("-upper_ksp_type cg -lower_pc_type gamg", &[]),
    typed("-ksp_type minres -pc_type jacobi -ksp_rtol 1e-8", &[]),
    typed("-pc_type icc -lower_pc_type cholesky", &[]),
    // the residual is exact whatever the inner solve
    typed("-ksp_type cg -pc_type hypre -ksp_rtol 0.03", &[]),
    typed("-ksp_type preonly -pc_type icc", &[]),
    // a stale factor does not change the answer; the factors of the start serve all sweeps of CG
    typed("-ksp_reuse_preconditioner", &[]),
    typed("-ksp_type cg -ksp_reuse_preconditioner", &[("factorizations", 2)]),
    on(2, "gamma=0.6", ""),
    Way { ranks: 2, ..typed("-ksp_type cg -pc_type hypre -upper_pc_type gamg", &[]) },
    on(2, NEWTON_ROBIN, "mumps"),
    on(2, SEMISMOOTH, ""),
];

/// A body that contact alone holds.
const HELD: [Way; 12] = [
    by("gamma=0.6", "", &[]),
    by("gamma=\"line-search\"", "", &[]),
    // the start, and once more
    by("gamma=\"aitken\", robin=\"frozen\", start={normal=1e-4}", "", &[("dense_factorizations", 4)]),
    by("gamma=\"aitken\", robin=\"auto\"", "mumps", &[]),
    by("gamma=\"aitken\", robin={floor=1e4}", "", &[]),
    by("name=\"semismooth\", gamma=0.9", "", CONDENSED),
    by(NEWTON_ROBIN, "mumps", &[]),
    by(NEWTON_ROBIN, "hypre", &[]),
    by(NEWTON, "condensed", CONDENSED),
    by(NEWTON, "mumps", JOINED),
    by(NEWTON, "hypre", JOINED),
    on(2, NEWTON_ROBIN, ""),
];

/// Many bodies, and bodies in space.
const JOINTLY: [Way; 5] = [
    by(NEWTON, "mumps", &[("symbolic_factorizations", 1), ("body_solves", 0)]),
    by(NEWTON, "hypre", &[("body_solves", 0)]),
    by(NEWTON, "condensed", &[("body_solves", 0)]),
    by(SEMISMOOTH, "hypre", &[("body_solves", 0)]),
    on(2, NEWTON, "condensed"),
];

/// Return the report and the contact tables of all pairs.
fn outcome(scene: &str, sets: &[&str], way: &Way) -> (Value, Vec<Table>) {
    let mut sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    sets.push(format!("method={{{}, stop={{residual=1e-9, iterations=5000}}}}", way.method));
    if !way.solver.is_empty() {
        sets.push(format!("solver={}", way.solver));
    }
    let tables = |report: &Report| {
        let pairs = report["pairs"].as_array().map_or(0, Vec::len);
        (report.deref().clone(), (0..pairs).map(|pair| report.contact_of(pair)).collect())
    };
    if way.ranks == 1 && way.options.is_empty() {
        return tables(&solve_here(case(scene), &sets.iter().map(String::as_str).collect::<Vec<_>>()).converged());
    }
    let words = sets.iter().flat_map(|set| ["--set", set]).chain(way.options.split_whitespace());
    tables(&solve_on(way.ranks, case(scene), &words.collect::<Vec<_>>()).converged())
}

/// All ways of a scene have the pressures, gaps and energy of the first, and stresses and displacements of bodies.
fn agree(scene: &str, sets: &[&str], ways: &[Way]) {
    let (reference, expected) = outcome(scene, sets, &by(NEWTON, "", &[]));
    for way in ways {
        let (report, tables) = outcome(scene, sets, way);
        let label = format!("{scene} {} {} {} on {}", way.method, way.solver, way.options, way.ranks);
        for (ours, theirs) in tables.iter().zip(&expected) {
            for column in ["pressure", "compression"] {
                let apart = distance(&ours[column], &theirs[column]);
                assert!(apart < 1e-6, "{label}: {column} {apart:e}");
            }
        }
        for path in ["/F1", "/bodies/0/max_von_mises", "/bodies/1/max_von_mises", "/pairs/0/approach"] {
            let [ours, theirs] = [&report, &reference].map(|report| report.pointer(path).and_then(Value::as_f64));
            let (ours, theirs) = ours.zip(theirs).unwrap_or_else(|| panic!("{label}: no {path}"));
            assert!((ours - theirs).abs() <= 1e-6 * theirs.abs(), "{label}: {path} {ours} {theirs}");
        }
        for (name, count) in way.counts {
            assert_eq!(report[name].as_u64(), Some(*count as u64), "{label}: {name}");
        }
    }
}

#[test]
fn on_the_groove() {
    agree("groove", &["mesh.set.n=8"], &GROOVE);
}

#[test]
fn where_contact_alone_holds_a_body() {
    agree("groove-held", &["mesh.set.n=8"], &HELD);
    agree("groove-held", &["mesh.set.n=4", "body.1.order=2"], &HELD[5..]);
}

#[test]
fn with_many_bodies_and_in_space() {
    agree("stack", &["mesh.set.n1=6"], &JOINTLY);
    agree("patch-3d", &["mesh.set.nl=4"], &JOINTLY);
    agree("hertz-sphere", &["mesh.set.n=3", "body.0.order=1", "body.1.order=1"], &JOINTLY);
}
