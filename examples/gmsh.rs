//! The paper's groove, its mesh made by Gmsh: the scene of `meshes/groove/scene.toml` built in Rust.
//!
//! ```text
//! cargo run --release --example gmsh
//! ```

use winkler::api::{BodySpec, ContactSpec, LayerSpec, MeshSource, Order, Result, Scene, Session, Solution, solve};

/// Solve the groove.
pub fn groove(session: &Session) -> Result<Solution> {
    let half = |name: &str| {
        BodySpec::new(name, 2.1e5, 0.3)
            .order(Order::P1)
            .fix(&format!("{name}_axis"), [Some(0.0), None])
            .fix(&format!("{name}_end"), [Some(0.0), Some(0.0)])
            .pressure(&format!("{name}_face"), 10.0)
    };
    let groove = |[x, _, _]: [f64; 3]| 5e-4 * (1.0 - (x - 4.0).powi(2)).max(0.0).powf(1.5);
    let layer = LayerSpec::power(2.5e-5, 0.5);
    let scene = Scene::new(2, MeshSource::script("meshes/groove/groove.geo", &[("n", 16.0)]))
        .body(half("lower"))
        .body(half("upper"))
        .contact(ContactSpec::new("lower_top", "upper_bottom", layer).gap(groove));

    solve(session, scene)
}

fn main() -> Result<()> {
    let solution = groove(&Session::start(&[])?)?;
    let report = solution.report();
    println!("{} in {} Newton steps, F1 = {:.10e}", report.status, report.iterations, report.f1.unwrap_or(f64::NAN));
    let contact = solution.contact(0);
    for (x, pressure) in contact.points.iter().zip(&contact.pressure).step_by(8) {
        println!("{:8.4} {pressure:12.8}", x[0]);
    }
    Ok(())
}
