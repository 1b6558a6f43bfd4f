//! The interval of gamma (33).

use crate::common::{Run, Scene, case, solve};

/// groove-held on a coarse mesh with a layer and settings of the method, which may end anyhow.
fn run(layer: &str, method: &str) -> Run {
    let (layer, method) = (format!("contact.0.layer={layer}"), format!("method={method}"));
    solve(case("groove-held"), &["--set", "mesh.set.n=16", "--set", &layer, "--set", &method])
}

const LAYER: &str = "{power={B=2.5e-5,a=0.5}}";

/// Two unit blocks that can only be compressed, E = 100, under a layer of stiffness 300: theta = 300/(100 + 300) for both.
fn one_mode(upper: &str, layer: &str, method: &str) -> Run {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let block = |name: &str, fix: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = 100\npoisson = 0\nfix = [{fix}, {{ on = \"{name}_left\", x = 0 }}]\n"
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
    // and without a solution there are no bounds, which the closing lines say
    let ended = run(LAYER, "{gamma=0.6, interval=true, stop={iterations=2}}");
    assert!(ended.code == 1 && ended.report["gamma_interval"].is_null());
    assert!(
        ended.stdout.contains("interval of gamma: unknown, as its bounds are those at a solution"),
        "{}",
        ended.said()
    );
    assert!(held.stdout.contains("theorem 3 promises convergence nowhere"), "{}", held.said());
    // nobody asked
    assert!(run(LAYER, "{gamma=0.6}").report["gamma_interval"].is_null());
}
