//! Spheres in space: Hertz's contact, and a soft layer between stiff bodies.

use super::{close, solved};
use crate::common::Report;

/// A soft layer between stiff spheres: p = k (delta - r^2 / (2 R)) with F = pi k R delta^2; the layer carries exactly the load.
#[test]
fn soft_layer() {
    let run = solved("sphere-layer", &["mesh.set.n=4"]);
    let (stiffness, approach, peak) = (18_655.5, 0.02, 373.11);
    let table = run.contact();
    for q in 0..table.rows() {
        let r = table["x"][q].hypot(table["y"][q]);
        let exact = stiffness * (approach - r * r / 50.0f64).max(0.0);
        let ours = table["pressure"][q];
        assert!((ours - exact).abs() < 0.015 * peak, "p({r}) = {ours}, closed form {exact}");
    }
    close("force", run.forces(0)[1][2], 586.081 / 4.0, 1e-7);
}

/// Root of the mean square error of the pressures, by the areas of the points, over that of the pressure `exact(r)`.
fn error(run: &Report, exact: impl Fn(f64) -> f64) -> f64 {
    let table = run.contact();
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        let at = |q: usize| of(table["x"][q].hypot(table["y"][q]), table["pressure"][q]);
        (0..table.rows()).map(|q| table["weight"][q] * at(q).powi(2)).sum()
    };
    (sum(&|r, p| p - exact(r)) / sum(&|r, _| exact(r))).sqrt()
}

/// The same with quadratic elements, whose points are at the mid-edges: means over the triangles around vertices are 1.1 % off.
#[test]
fn soft_layer_between_quadratic_elements() {
    let run = solved("sphere-layer", &["mesh.set.n=3", "body.0.order=2", "body.1.order=2"]);
    let found = error(&run, |r| 18_655.5 * (0.02 - r * r / 50.0).max(0.0));
    assert!(found < 4e-3, "{found}");
}

/// V5: peak of the pressure between elastic spheres, and radius of the circle with the area of all closed points; the layer
/// carries exactly the load.
#[test]
fn hertz() {
    let run = solved("hertz-sphere", &[]);
    close("peak", run.number("pairs/0/peak_pressure"), 279.83, 0.01);
    let quarter = run.number("pairs/0/contact_area");
    close("radius", (4.0 * quarter / std::f64::consts::PI).sqrt(), 1.0, 0.02);
    close("force", run.forces(0)[1][2], 586.081 / 4.0, 1e-7);
    // up to the edge, where the pressure rises as a root; means over the triangles around vertices are 8 % off
    let found = error(&run, |r| 279.83 * (1.0 - r * r).max(0.0).sqrt());
    assert!(found < 0.025, "{found}");
}
