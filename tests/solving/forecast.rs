//! What a run says of itself: the estimated error of the iteration, the spectrum, the iterations left, the interval of gamma.

use crate::common::{Run, Scene, case, solve};

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
        ("{power={B=2.5e-5,a=0.5}}", 2.6),
        ("{linear={stiffness=1e6}}", 4.5),
        ("{power={B=1e-5,a=0.3}}", 6.5),
        ("{linear={stiffness=1e7}}", 20.0),
    ];
    for (layer, most) in layers {
        let exact = run(layer, "{name=\"newton\", stop={residual=1e-12}}").converged();
        let robin = ["0.6", "\"line-search\"", "\"aitken\"", "\"barzilai-borwein\"", "\"spectral\""];
        let robin = robin.map(|gamma| format!("name=\"robin\", robin=\"auto\", gamma={gamma}"));
        for method in robin.into_iter().chain(["ncg", "anderson"].map(|name| format!("name=\"{name}\""))) {
            let stop = "stop={residual=1e-8, iterations=300}";
            let (low, high) = ratios(&run(layer, &format!("{{{method}, {stop}}}")), &exact);
            // steps of Barzilai and Borwein lead through iterates with other spectra
            let most = if method.contains("barzilai") { 2.0 * most } else { most };
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

/// A run that ends at its limit says how many iterations are missing: compared with those that really are. The forecast of an
/// exact line search is that of its worst case: how much better the search is depends on the start.
#[test]
fn the_forecast_is_what_comes() {
    for (method, limit, [less, more]) in [
        ("name=\"robin\", gamma=0.6", 12, [0.05; 2]),
        ("name=\"robin\", gamma=[0.3, 0.9]", 15, [0.05; 2]),
        ("name=\"robin\", gamma=\"spectral\"", 12, [0.05; 2]),
        ("name=\"robin\", gamma=\"line-search\"", 12, [0.0, 0.1]),
        ("name=\"ncg\"", 10, [0.35; 2]),
        ("name=\"anderson\"", 12, [0.35; 2]),
    ] {
        let all = run(LAYER, &format!("{{{method}, stop={{residual=1e-8}}}}")).converged();
        let cut = run(LAYER, &format!("{{{method}, stop={{residual=1e-8, iterations={limit}}}}}"));
        assert_eq!(cut.text("status"), "iteration-limit");
        let (reported, came) = (cut.count("forecast/iterations"), all.count("iterations") - limit);
        let share = (reported as f64 - came as f64) / came as f64;
        let one = 1.0 / came as f64;
        let within = -less - one <= share && share <= more + one;
        assert!(within, "{method}: {reported} reported, {came} came");
        let line = format!("about {reported} more at this rate");
        assert!(cut.text("message").contains(&line), "{}", cut.text("message"));
        assert_eq!(all.count("forecast/iterations"), 0);
    }
}

/// The factor of a fixed gamma and the best such gamma are those that runs show.
#[test]
fn a_fixed_gamma_is_reported_with_the_best_one() {
    let last_factor = |run: &Run| {
        let residual = run.history()["residual"].to_vec();
        residual[residual.len() - 1] / residual[residual.len() - 2]
    };
    // a start with all modes, the fastest of which dies in a step of 0.6: the rigid start has too little of it to tell
    let slow = run(LAYER, "{gamma=0.6, start={normal=1e-4}}").converged();
    assert!((slow.number("forecast/factor") - last_factor(&slow)).abs() < 1e-3);
    let (gamma, factor) = (slow.number("forecast/best_gamma"), slow.number("forecast/best_factor"));
    let best = run(LAYER, &format!("{{gamma={gamma}, start={{normal=1e-4}}}}")).converged();
    assert!((last_factor(&best) - factor).abs() < 0.01, "{factor} reported, {} came", last_factor(&best));
    for other in [gamma - 0.1, gamma + 0.1] {
        let other = run(LAYER, &format!("{{gamma={other}, start={{normal=1e-4}}, stop={{iterations=500}}}}"));
        assert!(other.code == 1 || last_factor(&other) > last_factor(&best) + 0.01, "{}", last_factor(&other));
    }
    // a gamma beyond 2/lambda_max leads nowhere
    let wild = run(LAYER, "{gamma=1.2, robin=\"auto\", start={normal=1e-4}, stop={residual=1e-8, iterations=12}}");
    assert!(wild.report["forecast"]["iterations"].is_null() && wild.number("forecast/factor") > 1.0);
    let words = wild.text("message");
    assert!(words.contains("no number is enough") && words.contains("method.gamma is 1.00"), "{words}");
}

/// Two unit blocks that can only be compressed, E = 100, under a layer of stiffness 300: theta = 300/(100 + 300) for both.
fn one_mode(upper: &str, layer: &str, method: &str) -> Run {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let block = |name: &str, fix: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nyoung = 100\npoisson = 0\nfix = [{fix}, {{ on = \"{name}_left\", x = 0 }}]\n"
        )
    };
    solve(
        Scene::new(format!(
            "dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = 2, n1 = 1, n2 = 1 }} }}\n{}{}\
             [[contact]]\nbetween = [\"b1_top\", \"b2_bottom\"]\nlayer = {{ {layer} }}\n[method]\n{method}\n",
            block("b1", "{ on = \"b1_bottom\", y = 0 }"),
            block("b2", upper)
        )),
        &[],
    )
}

const PRESSED: &str = "{ on = \"b2_top\", y = -0.01 }";

/// F1 never rises from one row to the next by more than rounding.
fn descends(run: &Run) -> bool {
    run.history()["energy"].windows(2).all(|pair| pair[1] <= pair[0] + 1e-13 * pair[0].abs())
}

/// (33) for one mode: B = 1 - theta, D = 1 + theta. There the bound for descent is sharp.
#[test]
fn the_interval_of_one_mode() {
    let run = |gamma: f64| {
        let method =
            format!("psi = \"full\"\ngamma = {gamma}\ninterval = true\nstop = {{ residual = 1e-6, iterations = 900 }}");
        one_mode(PRESSED, "linear = { stiffness = 300 }", &method)
    };
    let reported = run(0.6).converged();
    let interval = |key: &str| reported.number(&format!("gamma_interval/{key}"));
    for (key, expected) in
        [("lower", 0.25), ("upper", 1.75), ("theorem", 0.5 / 1.75f64.powi(2)), ("descent", 2.0 / 1.75)]
    {
        assert!((interval(key) / expected - 1.0).abs() < 1e-9, "{key}: {}", interval(key));
    }
    assert!(descends(&run(interval("theorem")).converged()));
    assert!(descends(&run(0.99 * interval("descent")).converged()));
    assert!(!descends(&run(1.01 * interval("descent"))));
}

/// A layer that stiffens has its constants on the level set of the start only: the same sums with p' at the largest compression
/// that the energy of the start allows.
#[test]
fn the_interval_of_a_layer_that_stiffens() {
    let run = one_mode(
        PRESSED,
        "power = { B = 1e-3, a = 0.5 }",
        "psi = \"full\"\ninterval = true\nstop = { residual = 1e-10, iterations = 900 }",
    )
    .converged();
    let energy = run.history()["energy"].to_vec();
    // two points of weight 1/2: P(c) - P(c0) - p(c0) (c - c0) = 2 (F1(u0) - F1), P = B x^3/3 with x = c/B
    let excess = 2.0 * (energy[0] - energy[energy.len() - 1]);
    let x = run.contact()["compression"][0] / 1e-3;
    let rise = |y: f64| 1e-3 * ((y.powi(3) - x.powi(3)) / 3.0 - x * x * (y - x));
    let (mut low, mut high) = (x, 1e3);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if rise(middle) < excess { low = middle } else { high = middle }
    }
    let [now, most] = [x, low].map(|x| 2.0 * x / 1e-3);
    let (lower, upper) = (100.0 / (100.0 + now), (100.0 + 2.0 * most) / (100.0 + now));
    assert!(most > 1.1 * now, "{now} to {most}");
    let reported = |key: &str| run.number(&format!("gamma_interval/{key}"));
    assert!((reported("upper") / upper - 1.0).abs() < 1e-6, "{} instead of {upper}", reported("upper"));
    assert!((reported("lower") / lower - 1.0).abs() < 1e-6, "{} instead of {lower}", reported("lower"));
}

/// Inside the interval F1 falls in every step, with forms that stay and with those of the paper.
#[test]
fn inside_the_interval_the_energy_falls() {
    for robin in ["\"frozen\"", "\"tangent\""] {
        let with = |rest: &str| {
            let method = format!("method={{robin={robin}, start={{normal=1e-4}}, {rest}}}");
            solve(case("groove"), &["--set", "mesh.set.n=8", "--set", &method])
        };
        let reported = with("interval=true, stop={residual=1e-8}").converged();
        let descent = reported.number("gamma_interval/descent");
        assert!(reported.number("gamma_interval/theorem") < descent && descent < 2.0);
        let run = with(&format!("gamma={}, stop={{residual=1e-8, iterations=100}}", 0.99 * descent));
        assert!(descends(&run) && run.number("residual") < 0.5 * run.history()["residual"][0], "{robin}");
    }
    // what only contact holds has no lower bound where contact may vanish
    let held = run(LAYER, "{gamma=0.6, interval=true, stop={residual=1e-8}}").converged();
    assert!(held.report["gamma_interval"]["theorem"].is_null() && held.number("gamma_interval/descent") > 0.0);
    // nobody asked
    assert!(run(LAYER, "{gamma=0.6}").report["gamma_interval"].is_null());
}
