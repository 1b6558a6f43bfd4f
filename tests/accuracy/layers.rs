//! Every law of a layer, through the whole program, against closed forms.

use crate::common::here::solve_here;
use crate::common::{Report, Scene, case};

/// Solves the patch under q = 10 with a layer and further settings.
fn patch(layer: &str, more: &[&str]) -> Report {
    let layer = format!("contact.0.layer={layer}");
    solve_here(case("patch"), &[&["method={stop={residual=1e-11}}", &layer], more].concat()).converged()
}

/// V1 with every law: the pressure is q, the layer's closing is where p(c) = q.
#[test]
fn patches() {
    for (layer, closing) in [
        ("{exponential={p0=3,c0=4e-5}}", 4e-5 * (1.0 + 10.0 / 3.0f64).ln()),
        ("{cubic={k1=5e4,k3=5e12}}", 1e-4),
        ("{table=[[5e-5,2],[1e-4,10],[2e-4,50]]}", 1e-4),
        ("{table=[[5e-5,2],[6e-5,4]]}", f64::NAN),
        ("{pressure=\"5e4*c + 5e8*c^2\"}", 1e-4),
        ("{pressure=\"5e4*c*(1 + c/1e-4)\",up_to=5e-5}", 5e-5 + (10.0 - 3.75) / 1e5),
    ] {
        let table = patch(layer, &["mesh.set={nl=2,nu=3}"]).contact();
        for q in 0..table.rows() {
            assert!((table["pressure"][q] / 10.0 - 1.0).abs() < 1e-10, "{layer} point {q}: {}", table["pressure"][q]);
            // beyond a table the last slope goes on: that of its last secant, 2e5
            let closing = if closing.is_nan() { 6e-5 + 6.0 / 2e5 } else { closing };
            assert!(
                (table["compression"][q] / closing - 1.0).abs() < 1e-9,
                "{layer} point {q}: {}",
                table["compression"][q]
            );
        }
    }
}

/// A layer of varying thickness under a gap that follows it: the pressure is uniform, the compression B(x) q^a.
#[test]
fn a_varying_layer() {
    for layer in ["{power={B=\"2.5e-5*(1 + x/2)\",a=0.5}}", "{pressure=\"(c/(2.5e-5*(1 + x/2)))^2\"}"] {
        let table = patch(layer, &["contact.0.gap=-2.5e-5*(1 + x/2)*sqrt(10)"]).contact();
        for q in 0..table.rows() {
            let compression = 2.5e-5 * (1.0 + table["x"][q] / 2.0) * 10f64.sqrt();
            assert!((table["pressure"][q] / 10.0 - 1.0).abs() < 1e-9, "{layer}: {}", table["pressure"][q]);
            assert!((table["compression"][q] / compression - 1.0).abs() < 1e-9);
        }
    }
    // a constant written as an expression is a constant
    let groove = Scene::edited("groove", "B = 2.5e-5", "B = \"2.5e-5 + 0*x\"");
    let [ours, theirs] = [groove.path.clone(), case("groove")].map(|scene| solve_here(scene, &[]).converged());
    assert_eq!(ours.count("iterations"), theirs.count("iterations"));
    assert_eq!(ours.contact()["pressure"], theirs.contact()["pressure"]);
}

/// Starts that press a layer far beyond the range of numbers come back.
#[test]
fn starts_beyond_the_range_of_numbers() {
    // c/c0 is 1e5 in the start
    for layer in ["{exponential={p0=3,c0=2e-5}}", "{pressure=\"3*(exp(c/2e-5) - 1)\"}"] {
        for method in ["auto", "newton"] {
            let start = "method.start={normal=1}";
            let name = format!("method.name={method}");
            let run = patch(layer, &[&name, start]);
            let closing = 2e-5 * (1.0 + 10.0 / 3.0f64).ln();
            let table = run.contact();
            for q in 0..table.rows() {
                assert!((table["compression"][q] / closing - 1.0).abs() < 1e-9, "{layer} {method} point {q}");
            }
            assert!(run.count("iterations") < 500, "{layer} {method}: {}", run.count("iterations"));
        }
    }
}

/// `meshes/coating`: a punch pressed by 50 into a coating that thins out, on a foundation.
#[test]
fn coating() {
    let run = solve_here(case("coating"), &[]).converged();
    // statics: the layer and the foundation carry the force on the punch
    assert!((run.number("pairs/0/force/1/1") - 50.0).abs() < 1e-6, "{}", run.said());
    assert!((run.number("bodies/0/balance/springs/0/force/1") - 50.0).abs() < 1e-6);
    for body in 0..2 {
        for kind in ["force", "moment"] {
            assert!(run.number(&format!("bodies/{body}/balance/{kind}_imbalance")) < 1e-9, "{}", run.said());
        }
    }
    let table = run.contact();
    for q in 0..table.rows() {
        let (x, c) = (table["x"][q], table["compression"][q]);
        let law = if c > 0.0 { 1e3 * c / (1e-3 * (1.0 - x / 2.0) - c) } else { 0.0 };
        assert!((table["pressure"][q] - law).abs() <= 1e-10 * law, "at {x}: {}, not {law}", table["pressure"][q]);
    }
    // the coating is used up to a third at most, far from the end of its law
    assert!(table["compression"].iter().all(|&c| c < 2e-4));
}

/// A table, or an expression with an end, that the layer leaves is reported with the compression and the end of the law; with load steps for
/// the step which goes farthest.
#[test]
fn laws_that_a_run_leaves() {
    let left = |layer: &str, steps: &str| {
        let warnings = patch(layer, &["mesh.set={nl=2,nu=3}", &format!("method.steps={steps}")]).warnings();
        let found: Vec<&str> = warnings.lines().filter(|warning| warning.contains("its law ends")).collect();
        assert!(found.len() < 2, "{warnings}");
        found.first().map(|warning| warning.to_string()).unwrap_or_default()
    };
    // q = 10 under the last slopes, 2e5 and 1e5
    let said = left("{table=[[5e-5,2],[6e-5,4]]}", "[1]");
    let words = "lower_top - upper_bottom: the layer is compressed by 9.00e-05 in load step 1, under a pressure of 1.00e+01, and its law ends at a \
                 compression of 6.00e-05";
    assert!(said.starts_with(words), "{said}");
    let said = left("{pressure=\"5e4*c*(1 + c/1e-4)\",up_to=5e-5}", "[1]");
    assert!(said.contains("by 1.13e-04") && said.contains("a compression of 5.00e-05"), "{said}");
    assert_eq!(left("{table=[[5e-5,2],[1e-4,10.001]]}", "[1]"), "");
    assert_eq!(left("{pressure=\"5e4*c*(1 + c/1e-4)\",up_to=2e-4}", "[1]"), "");
    // only the larger load leaves the table
    let table = "{table=[[5e-5,2],[1e-4,12]]}";
    assert!(left(table, "[0.5,2,1]").contains("by 1.40e-04 in load step 2, under a pressure of 2.00e+01"));
    assert_eq!(left(table, "[0.5,1]"), "");
    let alone = patch("{table=[[5e-5,2],[6e-5,4]]}", &[]);
    assert!(alone.warnings().contains("by 9.00e-05, under a pressure"), "{}", alone.warnings());
    assert!((alone.number("pairs/0/peak_compression") / 9e-5 - 1.0).abs() < 1e-9);
}
