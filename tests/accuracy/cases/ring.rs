//! Four bodies in a ring, each in contact with two others.

use super::{case, close, solved};
use crate::common::here::solve_here;
use crate::common::{Report, root};

/// Joints in the order of the scene, as angle of the joint and of the normal that points from the first body to the second.
const JOINTS: [f64; 4] = [45.0, 135.0, 225.0, 315.0];

/// Each joint carries a force along its normal, opposite on both sides; gives the forces.
fn along_joints(run: &Report) -> [f64; 4] {
    std::array::from_fn(|joint| {
        let [first, second] = run.forces(joint);
        let angle = (JOINTS[joint] + 90.0).to_radians();
        let push = second[0] * angle.cos() + second[1] * angle.sin();
        let aside = second[0] * angle.sin() - second[1] * angle.cos();
        assert!(aside.abs() < 1e-12 * push, "joint {joint}: {second:?}");
        assert!((0..2).all(|c| (first[c] + second[c]).abs() < 1e-12 * push), "joint {joint}: {first:?} {second:?}");
        push
    })
}

/// The balance of single bodies gives the force in every joint, whatever layers and materials.
#[test]
fn asymmetric() {
    let tilt = 5.0 * (2f64.sqrt() - 1.0);
    let (right, left) = (25.0 - tilt, 25.0 + tilt);
    for method in ["auto", "newton-robin"] {
        let run = solve_here(case("ring"), &[&format!("method.name={method}")]).converged();
        for (force, exact) in along_joints(&run).into_iter().zip([right, left, left, right]) {
            close(method, force, exact, 1e-7); // bodies are in balance to ten times the residual
        }
    }
    // any other layer carries the same
    let run = solved("ring", &["contact.1.layer.power.a=1", "contact.1.layer.power.B=1e-7", "body.2.young=1e4"]);
    for (force, exact) in along_joints(&run).into_iter().zip([right, left, left, right]) {
        close("another layer", force, exact, 1e-7);
    }
}

/// Under the same pressure all round the forces are equal, and the pressure in stiff joints is Lame's.
#[test]
fn symmetric() {
    let scene = root().join("meshes/ring/symmetric.toml");
    for method in ["auto", "newton"] {
        let run = solve_here(&scene, &[&format!("method.name={method}")]).converged();
        for (joint, force) in along_joints(&run).into_iter().enumerate() {
            close("force", force, 20.0, 1e-7);
            let table = run.contact_of(joint);
            for q in 0..table.rows() {
                let r = table["x"][q].hypot(table["y"][q]);
                close("pressure", table["pressure"][q], 40.0 / 3.0 * (1.0 + 1.0 / (r * r)), 3e-3);
            }
        }
    }
}
