//! What a run says of itself: the estimated error of the iteration, the spectrum, and the iterations left.

mod common;

use common::{Run, case, solve};

/// groove-held on a coarse mesh with a layer and settings of the method, which may end anyhow.
fn run(layer: &str, method: &str) -> Run {
    let (layer, method) = (format!("contact.0.layer={layer}"), format!("method={method}"));
    solve(case("groove-held"), &["--set", "mesh.set.n=16", "--set", &layer, "--set", &method])
}

/// u'Ku + sum omega p c of a solution, by which errors are measured: from F1, J and the contact table, with the equilibrium
/// f'u = u'Ku + sum omega p (c + d).
fn scale(run: &Run) -> f64 {
    let table = run.contact();
    let work = |column: &str| -> f64 {
        (0..table.rows()).map(|q| table["weight"][q] * table["pressure"][q] * table[column][q]).sum()
    };
    let layer = run.number("pairs/0/layer_energy");
    2.0 * (layer - run.number("F1")) - work("compression") - 2.0 * work("gap")
}

/// Estimated over true errors in the energy norm, sqrt(2 (F1 - F1*) / scale), least and largest of a run, where F1 has digits
/// enough to tell.
fn ratios(run: &Run, exact: &Run) -> (f64, f64) {
    let (history, best, scale) = (run.history(), exact.number("F1"), scale(exact));
    let pairs = history["energy"].iter().zip(&history["error"]);
    let all: Vec<f64> = pairs
        .map(|(energy, error)| ((2.0 * (energy - best) / scale).sqrt(), error))
        .filter(|(truth, error)| (3e-7..0.1).contains(truth) && error.is_finite())
        .map(|(truth, error)| error / truth)
        .collect();
    assert!(all.len() >= 2, "{} rows tell nothing", all.len());
    (all.iter().copied().fold(f64::INFINITY, f64::min), all.iter().copied().fold(0.0, f64::max))
}

/// As docs/methods.md has it: never more than a fifth too small, and too large by the root of the condition at most.
#[test]
fn estimates_follow_the_true_error() {
    let layers = [
        ("{linear={stiffness=1e3}}", 1.2),
        ("{power={B=2.5e-5,a=0.5}}", 2.5),
        ("{linear={stiffness=1e6}}", 4.0),
        ("{power={B=1e-5,a=0.3}}", 5.0),
        ("{linear={stiffness=1e7}}", 20.0),
    ];
    for (layer, most) in layers {
        let exact = run(layer, "{name=\"newton\", stop={residual=1e-12}}").converged();
        for method in ["ncg", "anderson"] {
            let (low, high) = ratios(&run(layer, &format!("{{name=\"{method}\"}}")).converged(), &exact);
            assert!(low > 0.8 && high < most, "{layer} by {method}: {low} to {high}");
        }
    }
}

/// Both methods can so stop where the mesh deserves no more.
#[test]
fn methods_with_an_estimate_stop_by_balance() {
    for method in ["ncg", "anderson"] {
        let stop = |rule: &str| run("{power={B=2.5e-5,a=0.5}}", &format!("{{name=\"{method}\", stop={{{rule}}}}}"));
        let (balanced, exact) = (stop("balanced=true").converged(), stop("residual=1e-10").converged());
        assert!(balanced.count("iterations") < exact.count("iterations") / 2, "{method}");
        let truth = (2.0 * (balanced.number("F1") - exact.number("F1")) / scale(&exact)).sqrt();
        assert!(truth < 0.02 && balanced.number("error_estimate") >= 0.8 * truth, "{method}: {truth:e}");
    }
}

const LAYER: &str = "{power={B=2.5e-5,a=0.5}}";

/// A run that ends at its limit says how many iterations are missing: compared with those that really are.
#[test]
fn the_forecast_is_what_comes() {
    for (method, limit, slack) in [
        ("name=\"robin\", gamma=0.6", 12, 0.05),
        ("name=\"robin\", gamma=[0.3, 0.9]", 15, 0.05),
        ("name=\"robin\", gamma=\"spectral\"", 12, 0.05),
        ("name=\"robin\", gamma=\"line-search\"", 12, 0.05),
        ("name=\"ncg\"", 10, 0.35),
        ("name=\"anderson\"", 12, 0.35),
    ] {
        let all = run(LAYER, &format!("{{{method}, stop={{residual=1e-8}}}}")).converged();
        let cut = run(LAYER, &format!("{{{method}, stop={{residual=1e-8, iterations={limit}}}}}"));
        assert_eq!(cut.text("status"), "iteration-limit");
        let (told, came) = (cut.count("forecast/iterations"), all.count("iterations") - limit);
        assert!((told as f64 - came as f64).abs() <= slack * came as f64 + 1.0, "{method}: {told} told, {came} came");
        let line = format!("about {told} more at this rate");
        assert!(cut.text("message").contains(&line), "{}", cut.text("message"));
        assert_eq!(all.count("forecast/iterations"), 0);
    }
}

/// The factor of a fixed gamma and the best such gamma are those that runs show.
#[test]
fn a_fixed_gamma_is_told_the_best_one() {
    let last_factor = |run: &Run| {
        let residual = run.history()["residual"].to_vec();
        residual[residual.len() - 1] / residual[residual.len() - 2]
    };
    let slow = run(LAYER, "{gamma=0.6}").converged();
    assert!((slow.number("forecast/factor") - last_factor(&slow)).abs() < 1e-3);
    let (gamma, factor) = (slow.number("forecast/best_gamma"), slow.number("forecast/best_factor"));
    let best = run(LAYER, &format!("{{gamma={gamma}}}")).converged();
    assert!((last_factor(&best) - factor).abs() < 0.01, "{factor} told, {} came", last_factor(&best));
    for other in [gamma - 0.1, gamma + 0.1] {
        let other = run(LAYER, &format!("{{gamma={other}, stop={{iterations=500}}}}"));
        assert!(other.code == 1 || other.count("iterations") > best.count("iterations"));
    }
    // a gamma beyond 2/lambda_max leads nowhere
    let wild = run(LAYER, "{gamma=1.2, stop={residual=1e-8, iterations=12}}");
    assert!(wild.report["forecast"]["iterations"].is_null() && wild.number("forecast/factor") > 1.0);
    let words = wild.text("message");
    assert!(words.contains("no number is enough") && words.contains("method.gamma is 1.00"), "{words}");
}
