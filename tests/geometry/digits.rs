//! Meshes with the coordinates of people's files: six to nine digits, or single precision, and nodes beside an axis.

use crate::common::blocks::Blocks;
use crate::common::{Run, Scene, solve};

/// One block on another, both turned and perhaps mirrored; contact alone holds the upper one.
fn turned(dimension: usize, order: usize, mirror: f64, written: impl Fn(f64) -> String) -> Scene {
    let (sine, cosine) = 0.1f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| match dimension {
        2 => [mirror * (cosine * x - sine * y), sine * x + cosine * y, 0.0],
        // about y, then about x
        _ => {
            let (x, z) = (cosine * x + sine * z, cosine * z - sine * x);
            [mirror * x, cosine * y - sine * z, sine * y + cosine * z]
        }
    };
    let mut mesh = Blocks::default();
    mesh.add("lo", dimension, order, 3, turn);
    mesh.add("up", dimension, order, 4, |mut x| {
        x[dimension - 1] += 1.0;
        turn(x)
    });
    let held = ["x = 0, y = 0", "x = 0, y = 0, z = 0"][dimension - 2];
    let scene = Scene::new(format!(
        "dimension = {dimension}\nmesh = \"blocks.msh\"
[[body]]\nname = \"lo\"\norder = {order}\nyoung = 1000\npoisson = 0\nfix = [{{ on = \"lo_low\", {held} }}]
[[body]]\nname = \"up\"\norder = {order}\nyoung = 1000\npoisson = 0\nload = [{{ on = \"up_high\", pressure = 1 }}]
[[contact]]\nbetween = [\"lo_high\", \"up_low\"]\nlayer = {{ power = {{ B = 1e-3, a = 0.5 }} }}\n"
    ));
    std::fs::write(scene.path.with_file_name("blocks.msh"), mesh.text(order, written)).expect("a mesh");
    scene
}

/// The result is that of exact coordinates, up to their uncertainty: a pressure of one, and the compression of two blocks and a layer.
fn is_uniform(run: Run, uncertainty: f64, label: &str) {
    let run = run.converged();
    let off = run.contact()["pressure"].iter().map(|p| (p - 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 1e3 * uncertainty + 1e-9, "{label}: {off:e}\n{}", run.said());
    let approach = run.number("pairs/0/approach");
    assert!((approach / 3e-3 - 1.0).abs() < 1e3 * uncertainty + 1e-9, "{label}: {approach}\n{}", run.said());
    let moved = run.number("bodies/1/max_displacement");
    assert!(moved < 3.1e-3, "{label}: {moved}\n{}", run.said());
    assert!(run.warnings().contains("translation along"), "{label}\n{}", run.said());
    assert!(!run.warnings().contains("balance"), "{label}\n{}", run.said());
}

#[test]
fn few_digits_leave_a_plane_contact_plane() {
    for (dimension, order, mirror) in [(2, 1, 1.0), (2, 2, -1.0), (3, 1, -1.0), (3, 2, 1.0)] {
        for digits in [6, 7, 8, 9, 16] {
            let written = |x: f64| format!("{x:.*e}", digits - 1);
            let label = format!("{dimension}D, order {order}, {digits} digits");
            let uncertainty = 10f64.powi(-(digits as i32));
            is_uniform(solve(turned(dimension, order, mirror, written), &[]), uncertainty, &label);
        }
        let single = solve(turned(dimension, order, mirror, |x| f64::from(x as f32).to_string()), &[]);
        is_uniform(single, 1e-7, &format!("{dimension}D, order {order}, single precision"));
    }
}

/// Nodes of the axis that lie beside it are on it, on either side; a wider hole stays, and half a body beyond the axis is refused.
#[test]
fn nodes_beside_an_axis_are_on_it() {
    let pressed = |order: usize, beside: f64| {
        let mut mesh = Blocks::default();
        let at = |[x, y, _]: [f64; 3], low: f64| [if x == 0.0 { beside } else { 2.0 * x }, low + y, 0.0];
        mesh.add("lo", 2, order, 6, |x| at(x, 0.0));
        mesh.add("up", 2, order, 5, |x| at(x, 1.0));
        let scene = Scene::new(format!(
            "dimension = 2\nplane = \"axisymmetric\"\nmesh = \"blocks.msh\"
[[body]]\nname = \"lo\"\norder = {order}\nyoung = 1000\npoisson = 0.3\nfix = [{{ on = \"lo_low\", y = 0 }}]
[[body]]\nname = \"up\"\norder = {order}\nyoung = 2000\npoisson = 0.2\nload = [{{ on = \"up_high\", pressure = 2 }}]
[[contact]]\nbetween = [\"lo_high\", \"up_low\"]\ngap = \"1e-3*x^2\"\nlayer = {{ power = {{ B = 1e-4, a = 0.5 }} }}\n"
        ));
        std::fs::write(scene.path.with_file_name("blocks.msh"), mesh.text(order, |x| x.to_string())).expect("a mesh");
        solve(scene, &[])
    };
    for order in [1, 2] {
        let exact = pressed(order, 0.0).converged();
        for beside in [1e-8, -1e-9, 1e-5] {
            let run = pressed(order, beside).converged();
            for name in ["pairs/0/peak_pressure", "bodies/0/max_von_mises"] {
                let off = run.number(name) / exact.number(name) - 1.0;
                assert!(off.abs() < 1e-9, "{order} {beside} {name}: {off:e}\n{}", run.said());
            }
            assert!(run.warnings().contains("beside the axis"), "{}", run.said());
        }
        let hole = pressed(order, 0.01).converged();
        assert!(!hole.warnings().contains("beside the axis"), "{}", hole.said());
        assert_eq!(pressed(order, -0.01).code, 4);
    }
}
