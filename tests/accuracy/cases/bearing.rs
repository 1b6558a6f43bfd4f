//! A roller bearing: twelve and more bodies that only contact and soft springs hold.

use super::{close, solved};
use crate::common::Report;

/// Total load, on the inner ring.
const LOAD: f64 = 300.0;

/// What the inner ring presses on each roller, whose forces on the ring must add up to the load.
fn carried(run: &Report, rollers: usize) -> Vec<f64> {
    let pairs = run["pairs"].as_array().expect("pairs");
    assert_eq!(pairs.len(), 2 * rollers);
    // the inner ring is the first body, and pairs are found body by body
    let forces: Vec<[f64; 3]> = (0..rollers).map(|k| run.forces(k)[1]).collect();
    for k in 0..rollers {
        let bodies: Vec<_> = (0..2).map(|side| run.text(&format!("pairs/{k}/bodies/{side}"))).collect();
        assert_eq!(bodies, ["inner", &format!("roller{}", k + 1)]);
    }
    let sum: [f64; 2] = std::array::from_fn(|c| forces.iter().map(|force| force[c]).sum());
    assert!(sum[0].abs() < 1e-6 * LOAD && (sum[1] + LOAD).abs() < 1e-6 * LOAD, "{sum:?}");
    forces.iter().map(|force| force[0].hypot(force[1])).collect()
}

/// Forces of rollers between rings that do not deform, for a linear layer: Q = 4/3 k sqrt(2 R) delta^(3/2) at each of its two
/// contacts, which share the approach D cos(psi) - clearance/2 of the rings. D is where the forces add up to the load.
fn rigid(rollers: usize, clearance: f64, stiffness: f64) -> Vec<f64> {
    let compliance = |radius: f64| (3.0 / (4.0 * stiffness * (2.0 * radius).sqrt())).powf(2.0 / 3.0);
    let both = compliance(1.0 / (1.0 / 5.0 + 1.0 / 30.0)) + compliance(1.0 / (1.0 / 5.0 - 1.0 / 40.0));
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / rollers as f64;
    let force = |k: usize, d: f64| ((d * angle(k).cos() - clearance / 2.0).max(0.0) / both).powf(1.5);
    let total = |d: f64| (0..rollers).map(|k| force(k, d) * angle(k).cos()).sum::<f64>();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if total(middle) < LOAD { low = middle } else { high = middle }
    }
    (0..rollers).map(|k| force(k, low)).collect()
}

/// The scene is what the script prints; by default settings it converges in few steps, exactly balanced, with the upper rollers
/// open, and near Stribeck's share for the most loaded one.
#[test]
fn by_default() {
    let run = solved("bearing", &["mesh.set.n=4"]);
    let forces = carried(&run, 12);
    assert!(forces[4..9].iter().all(|&force| force == 0.0), "{forces:?}");
    assert!(forces[..3].iter().all(|&force| force > 20.0), "{forces:?}");
    let share = forces[0] * 12.0 / LOAD;
    assert!(share > 4.0 && share < 5.0, "{share}");
    for k in 1..6 {
        assert!((forces[k] - forces[12 - k]).abs() < 1e-3 * forces[0], "roller {k}: {forces:?}");
    }
    assert!(run.warnings().is_empty(), "{}", run.warnings());
    // the part of the inner ring before a roller begins and ends within a facet
    let averaged = (0..12).map(|pair| run.count(&format!("pairs/{pair}/facets_averaged")));
    assert!(averaged.clone().all(|count| count == 2), "{:?}", averaged.collect::<Vec<_>>());
}

/// Rings and rollers that are stiff against the layer share the load as in closed form.
#[test]
fn stiff_rings() {
    let young = ["inner", "outer", "roller*"].map(|name| format!("body.{name}.young=2.1e8"));
    let run = solved("bearing", &young.each_ref().map(String::as_str));
    let forces = carried(&run, 12);
    for (k, exact) in rigid(12, 0.01, 2.5e4).into_iter().enumerate() {
        assert!((forces[k] - exact).abs() < 0.005 * forces[0], "roller {k}: {}, closed form {exact}", forces[k]);
    }
}

/// Another number of rollers, none of them at the bottom.
#[test]
fn turned() {
    let run = solved("bearing", &["mesh.set.rollers=16", "mesh.set.turn=0.5", "mesh.set.n=4"]);
    let forces = carried(&run, 16);
    close("the two lowest", forces[0], forces[15], 1e-3);
    assert!(forces[0] > forces[1] && forces[1] > forces[2], "{forces:?}");
    assert_eq!(forces.iter().filter(|&&force| force == 0.0).count(), 8, "{forces:?}");
}
