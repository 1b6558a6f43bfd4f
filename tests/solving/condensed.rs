//! A condensed body is the same body: same iterates, same numbers, with one factorisation of its stiffness matrix.

use crate::common::{Scene, case, distance, root, solve};
use std::fs;

/// A patch turned by 30 degrees, with meshes that do not match, quadratic cells, a body that nothing holds along the contact,
/// and a contact node whose x displacement is prescribed, not to zero.
#[test]
fn turned_normals_and_prescribed_displacements_have_the_same_history() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let script = fs::read_to_string(root().join("meshes/patch/patch.geo")).expect("the script");
    let turn = "Physical Point(\"corner\") = {4};\nGeometry.AutoCoherence = 0;\n\
                Rotate {{0, 0, 1}, {0, 0, 0}, Pi/6} { Surface{1, 2}; }\n";
    let file = folder.path().join("patch.geo");
    fs::write(&file, script + "\n" + turn).expect("a script");
    let text = crate::common::text_of("patch");
    let (start, end) = (text.find("geo = \"").expect("a script") + 7, text.find(".geo\"").expect("a script"));
    let mut text = format!("{}{}{}", &text[..start], file.with_extension("").display(), &text[end..]);
    for (from, to) in [
        ("nl = 4, nu = 4", "nl = 3, nu = 5"),
        (
            "{ on = \"lower_face\", y = 0 }, { on = \"lower_pin\", x = 0 }",
            "{ on = \"lower_face\", x = 0, y = 0 }, { on = \"corner\", x = 1e-5 }",
        ),
        ("fix = [{ on = \"upper_pin\", x = 0 }]\n", ""),
        ("stop = { residual = 1e-12 }", "stop = { residual = 1e-9 }"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let text = text.replace("order = 1", "order = 2");
    let scene = Scene::new(text);
    let [sparse, condensed] =
        ["solver=mumps", "solver=condensed"].map(|set| solve(&scene, &["--set", set]).converged());
    let (ours, theirs) = (condensed.history(), sparse.history());
    assert_eq!(ours.counts("closed"), theirs.counts("closed"));
    for name in ["residual", "increment", "energy"] {
        let both = ours[name].iter().zip(&theirs[name]).filter(|(a, b)| !a.is_nan() || !b.is_nan());
        both.for_each(|(a, b)| assert!((a - b).abs() <= 1e-8 * b.abs() + 1e-12, "{name}: {a} and {b}"));
    }
    let (ours, theirs) = (condensed.contact(), sparse.contact());
    for name in &ours.names {
        assert!(theirs[name].iter().all(|v| *v == 0.0) || distance(&ours[name], &theirs[name]) < 1e-8, "{name}");
    }
    for path in ["bodies/0/max_von_mises", "bodies/1/max_von_mises", "bodies/0/max_displacement"] {
        let [ours, theirs] = [&condensed, &sparse].map(|run| run.number(path));
        assert!((ours / theirs - 1.0).abs() < 1e-8, "{path}: {ours} {theirs}");
    }
    assert!(sparse.warnings().contains("fixed at one node"), "{}", sparse.warnings());
    // lower: 7 contact nodes, one of them not turned as its x is prescribed; upper: 11, and one more for the rotation
    assert_eq!(condensed.solvers(), ["condensed to 7 dofs by mumps", "condensed to 11 dofs by mumps"]);
}

/// Unasked, plane bodies are condensed; options of PETSc's solvers mean these, controls of MUMPS do not.
#[test]
fn it_is_chosen_where_nothing_else_is_asked_for() {
    let run = |args: &[&str]| solve(case("groove"), &[&["--set", "mesh.set.n=8"], args].concat());
    let chosen = run(&[]).converged();
    assert_eq!(chosen.solvers(), ["condensed to 32 dofs by mumps"; 2]);
    assert!(chosen.stdout.contains("32 of them on the contact, about"), "{}", chosen.stdout);
    assert_eq!(run(&["-upper_ksp_type", "cg"]).converged().solvers()[1], "cg + cholesky by mumps");
    let typed = run(&["--set", "solver=condensed", "-lower_pc_type", "icc"]).converged();
    assert_eq!(typed.solvers(), ["cg + icc by petsc", "condensed to 32 dofs by mumps"]);
    let joined = run(&["--method", "newton", "--set", "solver=condensed"]).converged();
    assert_eq!((joined.solvers(), joined.count("factorizations")), (chosen.solvers(), 2));
    let controlled = run(&["-mat_mumps_icntl_14", "80", "-lower_mat_mumps_cntl_1", "1e-3"]).converged();
    assert_eq!((controlled.solvers(), controlled.warnings()), (chosen.solvers(), String::new()));
    for (options, words) in [
        (["-mat_mumps_icntl_19", "1"], "the program itself sets ICNTL(19)"),
        (["-upper_mat_mumps_icntl_14", "much"], "not a whole number"),
        (["-mat_mumps_icntl_99", "1"], "MUMPS has no such control"),
    ] {
        let refused = run(&options);
        assert_eq!(refused.code, 5, "{}", refused.said());
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
}
