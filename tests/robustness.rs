//! Where rounding or a bad start spoiled the answer: columns of two blocks whose pressure a line of algebra gives.

mod common;

use common::{Run, Scene, solve};

/// Two unit blocks of modulus `young` on each other, the lower one on a roller; Poisson's ratio is zero, so that each is a
/// spring. `upper` is what holds and loads the upper one.
fn column(young: f64, upper: &str, gap: &str, layer: &str) -> Run {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let text = format!(
        r#"
dimension = 2
mesh = {{ geo = "{geo}", set = {{ n1 = 3, n2 = 2 }} }}

[[body]]
name = "b1"
young = {young:e}
poisson = 0
fix = [{{ on = "b1_bottom", y = 0 }}, {{ on = "b1_left", x = 0 }}]

[[body]]
name = "b2"
young = {young:e}
poisson = 0
{upper}

[[contact]]
between = ["b1_top", "b2_bottom"]
gap = "{gap}"
layer = {{ {layer} }}
"#
    );
    solve(Scene::new(text), &[]).converged()
}

/// All pressures are `expected` to a share of `accuracy`.
fn assert_pressure(run: &Run, expected: f64, accuracy: f64) {
    for &pressure in &run.contact()["pressure"] {
        assert!((pressure / expected - 1.0).abs() < accuracy, "{pressure:e} instead of {expected:e}");
    }
}

/// A block falls a million times as far as it is compressed: f - K u of that displacement would be rounding.
#[test]
fn a_fall_far_beyond_the_strains() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }]
load = [{ on = "b2_top", pressure = 150 }]"#;
    let run = column(5.3e9, upper, "1.48", "linear = { stiffness = 1e5 }");
    assert_pressure(&run, 150.0, 1e-9);
    let moved = run.contact()["u_n_b2"][0];
    assert!((moved - (1.48 + 150.0 / 1e5)).abs() < 1e-6, "{moved}");
}

/// A support carries a block far, to compress the column by a ten-millionth of that: 2 p / E + p / kappa = 10 - gap. Contact
/// rows of surfaces that do not match have entries with an error of 1e-15, which is 1e-8 of what is left of 10.
#[test]
fn a_support_that_carries_a_block_far() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }, { on = "b2_top", y = -10 }]"#;
    let run = column(1.0, upper, "10 - 2^-20", "linear = { stiffness = 1e3 }");
    assert_pressure(&run, 2.0f64.powi(-20) / (2.0 + 1e-3), 1e-7);
    let moved = run.contact()["u_n_b2"][0];
    assert!((moved - 10.0).abs() < 1e-5, "{moved}");
}

/// A layer that answers the overlap of the start with 1e50 of what the blocks can bear: 2 p / E + B p^a = 5e-4.
#[test]
fn an_overlap_far_too_deep_for_its_law() {
    let upper = r#"fix = [{ on = "b2_left", x = 0 }, { on = "b2_top", y = -5e-4 }]"#;
    let (young, b, a) = (5e8, 2e-9, 0.1f64);
    let run = column(young, upper, "0", "power = { B = 2e-9, a = 0.1 }");
    let (mut low, mut high) = (0.0, young);
    for _ in 0..200 {
        let p: f64 = 0.5 * (low + high);
        if 2.0 * p / young + b * p.powf(a) < 5e-4 { low = p } else { high = p }
    }
    assert_pressure(&run, low, 1e-7);
}

/// An overlap that nothing holds together: the solution is no pressure at all, measured by what the overlap could make.
#[test]
fn an_overlap_that_comes_to_nothing() {
    for layer in ["linear = { stiffness = 1e4 }", "power = { B = 1e-5, a = 0.1 }"] {
        let run = column(1e3, r#"fix = [{ on = "b2_left", x = 0 }]"#, "-1e-5", layer);
        assert!(run.contact()["pressure"].iter().all(|&p| p <= 1e-12 * 1e3 * 1e-5), "{layer}");
    }
}
