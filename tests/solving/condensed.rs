//! A condensed body is the same body: same iterates, same numbers, with one factorisation of its stiffness matrix.

use crate::common::{Run, Scene, case, distance, root, solve};
use std::fs;

/// Displacements and stresses of a body: what follows the 8 bytes of a length in an array of the VTU file.
fn fields(run: &Run, body: &str) -> Vec<f64> {
    let text = fs::read_to_string(run.folder.join(format!("{body}.vtu"))).expect("fields of a body");
    let array = |name: &str| -> Vec<f64> {
        let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).expect("an array");
        let data = rest.split(['>', '<']).nth(1).expect("its data");
        let bytes = base64(data.trim());
        bytes[8..].chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes"))).collect()
    };
    [array("displacement"), array("stress")]
        .map(|values| {
            let size = values.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
            values.into_iter().map(|value| value / size).collect::<Vec<_>>()
        })
        .concat()
}

fn base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let bits = |four: &[u8]| four.iter().filter(|c| **c != b'=').fold(0u32, |sum, &c| sum << 6 | u32::from(digit(c)));
    let bytes = text.as_bytes().chunks_exact(4).flat_map(|four| {
        let count = four.iter().filter(|c| **c != b'=').count();
        let word = bits(four) << (6 * (4 - count));
        word.to_be_bytes()[1..count].to_vec()
    });
    bytes.collect()
}

/// Solves a scene with MUMPS in each sweep and condensed: the histories and all results must agree to rounding.
fn agree(scene: impl AsRef<std::path::Path>, args: &[&str]) -> [Run; 2] {
    let args = [args, &["--vtu", "--set", "output.compress=false"]].concat();
    let run = |solver: &str| solve(&scene, &[&args[..], &["--set", &format!("solver={solver}")]].concat()).converged();
    let (sparse, condensed) = (run("mumps"), run("condensed"));
    for solver in condensed.solvers() {
        assert!(solver.starts_with("condensed to"), "{solver}");
    }
    let (ours, theirs) = (condensed.history(), sparse.history());
    assert_eq!(ours.counts("closed"), theirs.counts("closed"));
    for name in ours.names.iter().filter(|name| !["factorizations", "seconds"].contains(&name.as_str())) {
        for (a, b) in ours[name].iter().zip(&theirs[name]) {
            assert!((a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-8 * b.abs() + 1e-12, "{name}: {a} and {b}");
        }
    }
    let (ours, theirs) = (condensed.contact(), sparse.contact());
    for name in &ours.names {
        assert!(theirs[name].iter().all(|v| *v == 0.0) || distance(&ours[name], &theirs[name]) < 1e-8, "{name}");
    }
    for body in ["lower", "upper"] {
        let (ours, theirs) = (fields(&condensed, body), fields(&sparse, body));
        assert!(ours.len() > 50 && distance(&ours, &theirs) < 1e-8, "fields of {body}");
    }
    [sparse, condensed]
}

#[test]
fn the_groove_has_the_same_history() {
    let [sparse, condensed] = agree(case("groove"), &["--set", "mesh.set.n=16"]);
    assert_eq!(condensed.count("iterations"), sparse.count("iterations"));
    // one dof a contact node, less that which the support has
    assert_eq!(condensed.solvers(), ["condensed to 64 dofs by mumps"; 2]);
    assert_eq!(condensed.count("dense_factorizations"), sparse.count("factorizations"));
    assert_eq!(sparse.count("dense_factorizations"), 0);
}

#[test]
fn bodies_that_contact_alone_holds_have_the_same_history() {
    for method in ["newton", "ncg"] {
        agree(case("groove-held"), &["--set", "mesh.set.n=8", "--method", method]);
    }
    agree(case("groove-held"), &["--set", "mesh.set.n=8", "--set", "body.1.order=2"]);
}

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
    let [sparse, condensed] = agree(Scene::new(text), &[]);
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
        (["-mat_mumps_icntl_99", "1"], "PETSc knows no option -mat_mumps_icntl_99"),
    ] {
        let refused = run(&options);
        assert_eq!(refused.code, 5, "{}", refused.said());
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
}

/// Presets by name.
#[test]
fn every_preset_has_its_solver() {
    for (preset, solver) in [("gamg", "cg + gamg"), ("icc", "cg + icc by petsc"), ("hypre", "cg + hypre")] {
        let set = format!("solver={preset}");
        let run = solve(case("groove"), &["--set", "mesh.set.n=8", "--set", &set]).converged();
        assert_eq!(run.solvers(), [solver; 2]);
    }
}
