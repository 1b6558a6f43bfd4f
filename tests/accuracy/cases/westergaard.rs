//! V6: pressure between a wavy surface and a flat one.

use super::{close, solved};
use std::f64::consts::PI;

/// The pressure inside the contact comes within the layer's share, 1e-3 for this stiffness, and the width with it. The gap is
/// only in the geometry.
#[test]
fn wave() {
    let (length, amplitude, load) = (2.0, 1e-4, 10.0f64);
    let modulus = 2.1e5 / (2.0 * (1.0 - 0.09));
    let full = PI * modulus * amplitude / length;
    let half_width = length / PI * (load / full).sqrt().asin();
    let sine = |x: f64| (PI * x / length).sin();
    let edge = sine(half_width);
    let exact = |x: f64| {
        let under = (edge.powi(2) - sine(x).powi(2)).max(0.0);
        2.0 * load * (PI * x / length).cos() / edge.powi(2) * under.sqrt()
    };
    for (order, n, tolerance) in [(1, 16, 0.012), (2, 8, 0.0025)] {
        let sets = [format!("body.0.order={order}"), format!("body.1.order={order}"), format!("mesh.set.n={n}")];
        let run = solved("westergaard", &sets.each_ref().map(String::as_str));
        let table = run.contact();
        for (&x, p) in table["x"].iter().zip(&table["pressure"]) {
            // the root at the end of the contact is resolved by few points
            let allowed = if x < 0.8 * half_width { tolerance } else { 0.04 };
            assert!((p - exact(x)).abs() < allowed * exact(0.0), "P{order}: p({x}) = {p}, closed form {}", exact(x));
        }
        close("half-width", run.number("pairs/0/contact_ends/0/0"), half_width, 0.005);
        close("force", run.forces(0)[1][1], load * length / 2.0, 1e-7);
    }
}
