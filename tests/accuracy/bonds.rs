//! Bonded layers, which pull where they are stretched.

use crate::common::here::solve_here;
use crate::common::{Scene, case, root, solve, solve_on};
use std::path::PathBuf;

/// Return the patch in the plane, in space, and as a body of revolution, with the key of its load and the load that pulls.
fn patches() -> [(PathBuf, &'static str); 3] {
    [
        (case("patch"), "body.1.load.0.pressure=-10"),
        (case("patch-3d"), "body.1.load.0.pressure=-10"),
        (root().join("meshes/patch/axisymmetric.toml"), "body.1.load.0.pressure=-10"),
    ]
}

/// V1 with the load turned round: the layer carries -q everywhere, and its stretch is where its own law, or that of tension, has q.
#[test]
fn a_pulled_patch() {
    for (scene, pull) in patches() {
        for (tension, stretch) in
            [("contact.0.gap=0", 2.5e-5 * 10f64.sqrt()), ("contact.0.tension={linear={stiffness=2e5}}", 5e-5)]
        {
            for method in [
                "{stop={residual=1e-10}}",
                "{name='newton-robin',stop={residual=1e-10}}",
                "{name='robin',gamma=0.6,robin='auto',stop={residual=1e-10}}",
            ] {
                let run = solve_here(&scene, &[pull, "contact.0.bond=true", tension, &format!("method={method}")]);
                assert_eq!(run["status"], "converged", "{method} {}", run.said());
                let table = run.contact();
                for q in 0..table.rows() {
                    assert!(
                        (table["pressure"][q] / -10.0 - 1.0).abs() < 1e-7,
                        "{tension} {method}: {}",
                        table["pressure"][q]
                    );
                    assert!(
                        (table["compression"][q] / -stretch - 1.0).abs() < 1e-7,
                        "{tension} {method}: {}",
                        table["compression"][q]
                    );
                }
                let bound = &run["error_bound"];
                assert!(method.contains("robin") || bound.as_f64().is_some_and(|bound| bound < 1e-8), "{bound}");
            }
        }
    }
    let run = solve_on(
        3,
        case("patch-3d"),
        &["--set", "contact.0.bond=true", "--set", "body.1.load.0.pressure=-10", "--set", "solver=hypre"],
    )
    .converged();
    let table = run.contact();
    assert!((0..table.rows()).all(|q| (table["pressure"][q] / -10.0 - 1.0).abs() < 1e-6));
    // in load steps, too
    let run = solve_here(case("patch"), &["contact.0.bond=true", "body.1.load.0.pressure=-10", "method={steps=3}"])
        .converged();
    assert!((run.number("steps/0/pairs/0/peak_compression") / (-2.5e-5 * (10.0f64 / 3.0).sqrt()) - 1.0).abs() < 1e-7);
}

/// Two cantilevers of the same height on each other, the upper one pulled up by its end. The layer has no shear, so that both bend as one with the sum
/// of their stiffnesses, F L^3 / (3 (2 E' I)); without the bond the upper one bends alone, twice as far.
#[test]
fn bonded_beams_bend_together() {
    const SCRIPT: &str = "L = 20; n = 40; m = 2;
        For b In {0:1}
          p = newp; Point(p) = {0, b, 0}; Point(p+1) = {L, b, 0}; Point(p+2) = {L, b+1, 0}; Point(p+3) = {0, b+1, 0};
          l = newl; Line(l) = {p, p+1}; Line(l+1) = {p+1, p+2}; Line(l+2) = {p+2, p+3}; Line(l+3) = {p+3, p};
          Transfinite Curve {l, l+2} = n + 1; Transfinite Curve {l+1, l+3} = m + 1;
          s = news; Curve Loop(s) = {l, l+1, l+2, l+3}; Plane Surface(s) = {s}; Transfinite Surface {s};
          Physical Surface(Sprintf(\"b%g\", b)) = {s}; Physical Curve(Sprintf(\"low%g\", b)) = {l};
          Physical Curve(Sprintf(\"end%g\", b)) = {l+1}; Physical Curve(Sprintf(\"high%g\", b)) = {l+2};
          Physical Curve(Sprintf(\"wall%g\", b)) = {l+3};
        EndFor\n";
    let body = |b: usize, more: &str| {
        format!(
            "[[body]]\nname = \"b{b}\"\nyoung = 1e5\npoisson = 0\norder = 2\nfix = [{{ on = \"wall{b}\", x = 0, y = 0 }}]\n{more}\n"
        )
    };
    let text = |geo: &str| {
        format!(
            "dimension = 2\nmesh = \"{geo}\"\n{}{}[[contact]]\nbetween = [\"high0\", \"low1\"]\nbond = true\n\
             layer = {{ linear = {{ stiffness = 1e8 }} }}\n",
            body(0, ""),
            body(1, "load = [{ on = \"end1\", force = [0, 1] }]")
        )
    };
    let scene = Scene::new(text("beams.geo"));
    std::fs::write(scene.path.with_file_name("beams.geo"), SCRIPT).expect("a script can be written");
    // the deflection of slender beams, with the share of shear: 6/5 F L/(G A) beside F L^3/(3 E I)
    let deflection = |beams: f64| 20f64.powi(3) / (3.0 * beams * 1e5 / 12.0) + 1.2 * 20.0 / (beams * 0.5e5);
    let run = solve_here(&scene.path, &[]).converged();
    let table = run.contact();
    let end = (0..table.rows()).max_by(|&p, &q| table["x"][p].total_cmp(&table["x"][q])).expect("points");
    let (ours, together) = (table["u_n_b0"][end], deflection(2.0));
    assert!((ours / together - 1.0).abs() < 2e-3, "{ours} {together}");
    assert!(table["pressure"].iter().any(|p| *p < 0.0));
    let apart = solve_here(&scene.path, &["contact.0.bond=false"]).converged();
    let table = apart.contact();
    assert!((table["u_n_b1"][end] / -deflection(1.0) - 1.0).abs() < 2e-3, "{}", table["u_n_b1"][end]);
}

/// A pulled patch has a largest tension with its place and no pressure, in report, tables and closing lines; beyond the end of either law it warns, in a
/// load step, too.
#[test]
fn the_largest_tension() {
    let bonded = |law: &str| {
        let sets = ["contact.0.bond=true", "body.1.load.0.pressure=-10", law];
        sets.into_iter().flat_map(|set| ["--set", set]).map(str::to_owned).collect::<Vec<_>>()
    };
    for (law, warns) in [
        ("contact.0.gap=0", false),
        ("contact.0.tension={table=[[1e-6,1]]}", true),
        ("contact.0.tension={table=[[1e-2,11]]}", false),
        ("contact.0.layer={table=[[1e-6,1]]}", true),
    ] {
        for steps in ["method={steps=1}", "method={steps=2}"] {
            let mut sets = bonded(law);
            sets.extend(["--set".to_owned(), steps.to_owned()]);
            let run = solve(case("patch"), &sets.iter().map(String::as_str).collect::<Vec<_>>()).converged();
            let what = format!("{law} {steps}: {}", run.said());
            assert_eq!(run.number("pairs/0/peak_pressure"), 0.0, "{what}");
            assert!((run.number("pairs/0/peak_tension") / 10.0 - 1.0).abs() < 1e-7, "{what}");
            assert!(run.number("pairs/0/normal_force") < 0.0 && run.number("pairs/0/mean_pressure") == 0.0, "{what}");
            assert!(
                run.stdout.contains("largest tension 10.000000") && !run.stdout.contains("peak pressure"),
                "{what}"
            );
            assert_eq!(run.warnings().contains("the layer is stretched by"), warns, "{what}");
            let table = std::fs::read_to_string(run.folder.join("contacts.csv")).expect("a table");
            assert!(table.contains(",peak_tension,tension_x,"), "{table}");
            if steps.contains('2') {
                assert!((run.number("steps/0/pairs/0/peak_tension") / 5.0 - 1.0).abs() < 1e-7, "{what}");
                let steps = std::fs::read_to_string(run.folder.join("steps.csv")).expect("a table");
                assert!(steps.contains(",peak_tension lower-upper,tension_x lower-upper,"), "{steps}");
            }
        }
    }
}

/// A bonded obstacle that turns about the middle presses one half of a stiff block with 0 to K t/2 and pulls the other: the mean pressure is that of the
/// compressed half, whatever the other carries.
#[test]
fn a_bond_that_presses_and_pulls() {
    let scene = Scene::new(format!(
        "dimension = 2\nmesh = {{ geo = \"{}\" }}\n[[body]]\nname = \"lower\"\nyoung = 1e10\npoisson = 0\nfix = [{{ on = \"lower_face\", x = 0, y = 0 }}]\n\
         [[contact]]\non = \"lower_top\"\nobstacle = true\nbond = true\ntilt = 1e-3\nlayer = {{ linear = {{ stiffness = 8e3 }} }}\n",
        case("patch").with_file_name("patch.geo").display()
    ));
    let run = solve_here(&scene, &[]).converged();
    let near = |key: &str, exact: f64| {
        let value = run.number(&format!("pairs/0/{key}"));
        assert!((value - exact).abs() < 1e-5, "{key}: {value}");
    };
    for (key, exact) in [("mean_pressure", 2.0), ("peak_pressure", 4.0), ("peak_tension", 4.0), ("normal_force", 0.0)] {
        near(key, exact);
    }
    near("contact_length", 0.5);
}
