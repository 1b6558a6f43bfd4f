//! Cases with known answers, through the whole program; docs/verification.md names their sources.

use crate::common::here::solve_here;
use crate::common::{Report, Scene, case, distance};

/// Linear interpolation of a column over another, rising one.
fn at(x: &[f64], y: &[f64], place: f64) -> f64 {
    let i = x.iter().position(|&x| x >= place - 1e-9).expect("a place on the surface").max(1);
    let s = (place - x[i - 1]) / (x[i] - x[i - 1]);
    y[i - 1] * (1.0 - s) + y[i] * s
}

/// Slope of a fit of log(error) over log(1/n).
fn order(sizes: &[f64], errors: &[f64]) -> f64 {
    let n = sizes.len() as f64;
    let (x, y): (Vec<f64>, Vec<f64>) = sizes.iter().zip(errors).map(|(n, e)| (-n.ln(), e.ln())).unzip();
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let covariance: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    covariance / x.iter().map(|x| (x - mx).powi(2)).sum::<f64>()
}

fn both_orders(order: usize) -> Vec<String> {
    (0..2).flat_map(|body| ["--set".to_owned(), format!("body.{body}.order={order}")]).collect()
}

fn solve_with(scene: impl AsRef<std::path::Path>, args: &[String]) -> Report {
    let sets = args.iter().map(String::as_str).filter(|&word| word != "--set").collect::<Vec<_>>();
    solve_here(scene, &sets).converged()
}

/// V1: a constant pressure is exact on matching and non-matching surfaces, and the order of the sides does not matter.
fn patch_of(name: &str, shortening: f64, axis: usize, meshes: &[(usize, usize)], orders: &[[usize; 2]]) {
    let closing = 2.5e-5 * 10f64.sqrt();
    let swapped = Scene::edited(name, r#"["lower_top", "upper_bottom"]"#, r#"["upper_bottom", "lower_top"]"#);
    for (lower, upper) in meshes {
        for [p, r] in orders {
            let set = [format!("mesh.set={{nl={lower}, nu={upper}}}"), format!("body.0.order={p}")];
            let set = set.into_iter().chain([format!("body.1.order={r}"), "output.vtu=false".to_owned()]);
            let args: Vec<String> = set.flat_map(|set| ["--set".to_owned(), set]).collect();
            let run = solve_with(case(name), &args);
            let table = run.contact();
            for q in 0..table.rows() {
                let label = format!("{name} {lower}:{upper} P{p} P{r} point {q}: {}", table["pressure"][q]);
                assert!((table["pressure"][q] / 10.0 - 1.0).abs() < 1e-10, "{label}");
                assert!((table["compression"][q] / closing - 1.0).abs() < 1e-10, "{label}");
                assert!((table["u_n_lower"][q] / -shortening - 1.0).abs() < 1e-9, "{label}");
            }
            // the lower face carries the load: forces on both sides are opposite to rounding
            let force = |side: usize| run.number(&format!("pairs/0/force/{side}/{axis}"));
            assert!((force(0) + 10.0).abs() < 1e-9 && (force(0) + force(1)).abs() < 1e-13 * 10.0);
            let other = solve_with(&swapped, &args);
            assert_eq!(other.count("iterations"), run.count("iterations"));
            // of two equally fine surfaces the first one carries, whose order may be another
            let pressure = &other.contact()["pressure"];
            if other.text("pairs/0/carrier") == run.text("pairs/0/carrier") {
                assert!(distance(pressure, &table["pressure"]) < 1e-13)
            } else {
                assert!(pressure.iter().all(|p| (p / 10.0 - 1.0).abs() < 1e-10), "{name}: {pressure:?}")
            }
            assert!((other.number(&format!("pairs/0/force/0/{axis}")) - force(1)).abs() < 1e-12);
        }
    }
}

#[test]
fn patch() {
    let shortening = 10.0 * (1.0 - 0.09) / 2.1e5;
    patch_of("patch", shortening, 1, &[(4, 4), (2, 3), (7, 5)], &[[1, 1], [2, 2]]);
    patch_of("patch-2d", shortening, 1, &[(7, 5), (5, 7)], &[[1, 2]]);
}

#[test]
fn patch_in_space() {
    let shortening = 10.0 / 2.1e5;
    patch_of("patch-3d", shortening, 2, &[(2, 3), (7, 5)], &[[1, 1]]);
    patch_of("patch-3d", shortening, 2, &[(2, 2), (2, 3), (3, 2)], &[[2, 2], [1, 2]]);
}

/// V2: order 2 for P1 and 3 for P2, of the wave's amplitude and (a little less on these meshes) at the points, under a wavy gap in full contact, under a stiff layer with a short wave and under a soft layer with a long one.
#[test]
fn wavy() {
    for (length, stiffness, p1) in [(2, 1e6, 14.823_937_8), (8, 1e5, 0.590_303_7)] {
        for (degree, amplitude, nodal, last) in [(1, 1.9, 1.65, 2e-3), (2, 3.0, 2.6, 2e-5)] {
            let sizes = [16.0, 32.0, 64.0];
            let errors = |n: &f64| {
                let mut args = both_orders(degree);
                let gap = format!("contact.0.gap=1e-4*(1-cos(2*pi*x/{length}))");
                let layer = format!("contact.0.layer.linear.stiffness={stiffness:e}");
                for set in [&format!("mesh.set={{L={length}, n={n}}}"), &gap, &layer, "method.stop.residual=1e-9"] {
                    args.extend(["--set".into(), set.to_string()]);
                }
                let table = solve_with(case("wavy"), &args).contact();
                let k = 2.0 * std::f64::consts::PI / length as f64;
                let wave = |q: usize| (k * table["x"][q]).cos();
                let rows = table.rows();
                let square = |q: usize| (table["pressure"][q] - 40.0 - p1 * wave(q)).powi(2);
                let mean = ((0..rows).map(square).sum::<f64>() / rows as f64).sqrt();
                // the wave's amplitude, with the weights of the points: trapezium, or Simpson
                let weight = |q: usize| match (q == 0 || q == rows - 1, degree) {
                    (true, 1) => 0.5,
                    (true, _) => 1.0 / 3.0,
                    (false, 1) => 1.0,
                    (false, _) => {
                        if q % 2 == 1 {
                            4.0 / 3.0
                        } else {
                            2.0 / 3.0
                        }
                    }
                };
                let sum: f64 = (0..rows).map(|q| weight(q) * table["pressure"][q] * wave(q)).sum();
                let found = 2.0 * sum / (rows - 1) as f64;
                ((found - p1).abs() / p1, mean / p1)
            };
            let (of_wave, at_points): (Vec<f64>, Vec<f64>) = sizes.iter().map(errors).unzip();
            // a longer wave has a smaller amplitude beside q
            let coarser = (length * length) as f64 / 4.0;
            let found = (order(&sizes, &of_wave), order(&sizes, &at_points));
            let label =
                format!("L {length}, stiffness {stiffness}, P{degree}: orders {found:?}, {of_wave:?}, {at_points:?}");
            assert!(found.0 > amplitude && found.1 > nodal && at_points[2] < last * coarser, "{label}");
        }
    }
}

/// V3: a stiff layer between large blocks comes close to the closed form for half-planes without layer.
#[test]
fn half_planes() {
    let run = solve_with(case("half-planes"), &[]);
    let table = run.contact();
    for (distance, exact) in [(1.25, 15.236), (1.5, 12.848), (2.0, 11.333), (4.0, 10.289)] {
        let ours = at(&table["x"], &table["pressure"], 16.0 - distance);
        assert!((ours / exact - 1.0).abs() < 0.01, "at {distance}: {ours}, closed form {exact}");
    }
    let half_width = 16.0 - run.number("pairs/0/contact_ends/0/0");
    assert!((half_width / 0.876_863 - 1.0).abs() < 0.015, "{half_width}");
}

/// V3b: the groove on a roller against spectral elements.
#[test]
fn groove_held() {
    type Reference = (f64, f64, f64, [f64; 4]);
    let soft: Reference = (3.45435, -5.176_769e-3, 1.202_796e-3, [9.35518, 10.77811, 13.96683, 26.80042]);
    let linear: Reference = (3.55537, -5.381_176e-3, 2.462_289e-3, [9.25030, 11.40739, 14.01911, 19.69010]);
    let laws = [("{power={B=2.5e-5,a=0.5}}", soft), ("{power={B=1e-5,a=1}}", linear)];
    for (law, (opens, f1, layer, pressures)) in laws {
        // the pressure has a kink in its slope at x = 3: that node converges slowest
        for (degree, n, tolerance, kink) in [(1, 32, 2e-3, 2.5e-3), (2, 16, 2e-4, 1.5e-3)] {
            let mut args = both_orders(degree);
            for set in [format!("contact.0.layer={law}"), format!("mesh.set.n={n}"), "method.stop.residual=1e-9".into()]
            {
                args.extend(["--set".into(), set]);
            }
            let run = solve_with(case("groove-held"), &args);
            let table = run.contact();
            for (place, exact) in [0.5, 2.0, 2.5, 3.0].into_iter().zip(pressures) {
                let ours = at(&table["x"], &table["pressure"], place);
                let allowed = if place == 3.0 { kink } else { tolerance };
                assert!((ours / exact - 1.0).abs() < allowed, "{law} P{degree} p({place}) = {ours}, {exact}");
            }
            assert!((run.number("F1") / f1 - 1.0).abs() < 1e-3, "{}", run.number("F1"));
            assert!((run.number("pairs/0/layer_energy") / layer - 1.0).abs() < 1e-3);
            assert!((run.number("pairs/0/contact_ends/0/0") - opens).abs() < 3e-3);
            // the roller under the lower body carries the whole load: the layer transmits q l
            assert!((run.number("pairs/0/force/1/1") - 40.0).abs() < 1e-5);
        }
    }
}

/// V4: iterations of the paper's figure 2a, within 15 % or 3 of the paper's and within 3 % or 1 of an independent
/// program's.
#[test]
fn figure_2a() {
    let paper = [193, 124, 65, 13, 7, 13, 27, 55, 134];
    let independent = [183, 118, 62, 15, 7, 12, 26, 53, 118];
    let gammas = [0.01, 0.02, 0.05, 0.3, 0.6, 0.8, 0.9, 0.95, 0.98];
    for (k, gamma) in gammas.into_iter().enumerate() {
        let ours = solve_with(case("groove"), &["--set".into(), format!("method.gamma={gamma}")]).count("iterations");
        let near =
            |other: usize, share: f64, least: f64| ours.abs_diff(other) as f64 <= (share * other as f64).max(least);
        assert!(near(paper[k], 0.15, 3.0), "gamma {gamma}: {ours}, the paper {}", paper[k]);
        assert!(near(independent[k], 0.03, 1.0), "gamma {gamma}: {ours}, elsewhere {}", independent[k]);
    }
}
