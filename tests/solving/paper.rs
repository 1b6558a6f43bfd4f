//! The paper's iterations (34) against the same sums by hand, and semismooth Newton's steps.

use crate::common::here::solve_here;
use crate::common::{Scene, case, solve};

/// Two unit blocks that can only be compressed, with these moduli, the upper one pressed down by 0.01, and a layer p =
/// (c/B)^2.
fn blocks([lower, upper]: [f64; 2], method: &str) -> Scene {
    let geo = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/stack/stack.geo");
    let block = |name: &str, young: f64, fix: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\norder = 1\nyoung = {young}\npoisson = 0\nfix = [{fix}, {{ on = \"{name}_left\", x = 0 }}]\n"
        )
    };
    Scene::new(format!(
        "dimension = 2\nmesh = {{ geo = \"{geo}\", set = {{ rows = 2, n1 = 1, n2 = 1 }} }}\n{}{}\
         [[contact]]\nbetween = [\"b1_top\", \"b2_bottom\"]\nlayer = {{ power = {{ B = {B}, a = 0.5 }} }}\n[method]\n{method}\n",
        block("b1", lower, "{ on = \"b1_bottom\", y = 0 }"),
        block("b2", upper, "{ on = \"b2_top\", y = -0.01 }")
    ))
}

const B: f64 = 2e-3;

/// Increments of both blocks in the first steps of (34), (42), from displacements u of the contact along the outer
/// normals: the form G of a step has the stiffness of the blocks on the diagonal, psi kappa of each side beside it, and
/// `coupled` psi kappa between them. The paper's law is odd, so that kappa is positive where the layer is open, too.
fn increments(
    k: [f64; 2],
    mut u: [f64; 2],
    zones: [&str; 2],
    coupled: f64,
    gamma: impl Fn(i32) -> f64,
) -> Vec<[f64; 2]> {
    let step = |i: i32| {
        let c: f64 = u[0] + u[1];
        let (p, kappa) = ((c.max(0.0) / B).powi(2), 2.0 * c.abs() / B / B);
        let r = [-k[0] * u[0] - p, -k[1] * (u[1] - 0.01) - p];
        let psi = zones.map(|zone| f64::from(zone == "full" || (zone == "active" && c > 0.0)));
        let (g, h) = ([k[0] + psi[0] * kappa, k[1] + psi[1] * kappa], coupled * psi[0] * kappa);
        let determinant = g[0] * g[1] - h * h;
        let z = [(g[1] * r[0] - h * r[1]) / determinant, (g[0] * r[1] - h * r[0]) / determinant];
        (0..2).for_each(|side| u[side] += gamma(i) * z[side]);
        std::array::from_fn(|side| (gamma(i) * z[side] / u[side]).abs())
    };
    (0..6).map(step).collect()
}

/// Whether increments are the expected ones. A start has its trace to about 1e-3; where u is small, its error counts as
/// often as the step is longer than u.
fn are_alike(ours: [f64; 2], expected: [f64; 2]) -> bool {
    (0..2).all(|side| (ours[side] / expected[side] - 1.0).abs() < 0.01 * (1.0 + expected[side]))
}

/// psi of each side (38), with either body as the one that carries the points, and gamma of each iteration.
#[test]
fn each_side_has_its_own_zone() {
    for (zones, words) in [
        (["active", "none"], "[\"active\", \"none\"]"),
        (["none", "active"], "[\"none\", \"active\"]"),
        (["none", "full"], "[\"x > 9\", \"full\"]"),
        (["active", "active"], "\"active\""),
    ] {
        for k in [[1000.0, 3000.0], [3000.0, 1000.0]] {
            let method = format!(
                "psi = {words}\ngamma = \"0.3 + 0.2*exp(-k)\"\nstart = {{ normal = 4e-3 }}\nstop = {{ residual = 1e-9, iterations = 6 }}"
            );
            let history = solve(blocks(k, &method), &[]).history();
            let expected = increments(k, [4e-3; 2], zones, 0.0, |i| 0.3 + 0.2 * f64::from(-i).exp());
            for (i, both) in expected.iter().enumerate() {
                let ours = ["increment_b1", "increment_b2"].map(|column| history[column][i + 1]);
                assert!(are_alike(ours, *both), "{words} {k:?} step {i}: {ours:?} instead of {both:?}");
            }
        }
    }
}

/// (34) with (35): steps of any gamma from the closing of the start, however it is shared by the blocks.
#[test]
fn semismooth_steps_are_those_of_the_paper() {
    let k = [1000.0, 3000.0];
    for gamma in [0.5, 1.0] {
        let method = format!(
            "name = \"semismooth\"\ngamma = {gamma}\nstart = {{ normal = 4e-3 }}\nstop = {{ residual = 1e-12 }}"
        );
        let run = solve(blocks(k, &method), &[]).converged();
        // least energy with u_a + u_b = 8e-3: both blocks push alike
        let push = (0.01 - 8e-3) / (1.0 / k[0] + 1.0 / k[1]);
        let expected = increments(k, [-push / k[0], 0.01 - push / k[1]], ["active"; 2], 1.0, |_| gamma);
        let history = run.history();
        for (i, both) in expected.iter().enumerate().take(run.count("iterations").min(4)) {
            let ours = ["increment_b1", "increment_b2"].map(|column| history[column][i + 1]);
            assert!(are_alike(ours, *both), "{gamma} step {i}: {ours:?} instead of {both:?}");
        }
    }
}

/// With gamma = 1 convergence is quadratic, by every stop; with another gamma it is linear by the factor 1 - gamma.
#[test]
fn semismooth_newton_takes_few_steps() {
    let run = |method: &str| {
        let method = format!("method={{name=\"semismooth\", start={{normal=1e-4}}, {method}}}");
        solve_here(case("groove"), &["mesh.set.n=8", &method]).converged()
    };
    let residual = run("gamma=1, stop={residual=1e-10}");
    assert!(residual.count("iterations") <= 9, "{}", residual.said());
    assert_eq!((residual.text("method"), residual.count("sweeps")), ("semismooth", 0));
    let increment = run("gamma=1, stop={increment=1e-3}");
    assert!(increment.count("iterations") <= 8 && increment.number("residual") < 1e-3, "{}", increment.said());
    // ten digits by the factor 0.4 are 25 steps
    let relaxed = run("gamma=0.6, stop={residual=1e-10}");
    assert!((20..=36).contains(&relaxed.count("iterations")), "{}", relaxed.said());
}
