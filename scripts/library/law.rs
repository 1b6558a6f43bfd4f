//! A mesh of arrays and a layer law of one's own, against the closed form: a soft film of thickness h that no pressure squeezes to
//! nothing, p = k c/(1 - c/h), between two blocks that a pressure P shortens evenly.
//!
//! ```text
//! cargo run --release --example law
//! ```

use winkler::api::{BodySpec, ContactSpec, LayerLaw, LayerSpec, MeshArrays, Response, Result, Scene, Session, solve};

#[derive(Debug)]
struct Film {
    stiffness: f64,
    thickness: f64,
}

impl LayerLaw for Film {
    fn compressed(&self, _point: usize, c: f64) -> Response {
        let Film { stiffness: k, thickness: h } = *self;
        // all is infinite from c = h on: a rigid stop
        let left = (1.0 - c / h).max(0.0);
        let energy = -k * h * (h * (-c / h).max(-1.0).ln_1p() + c);
        Response { pressure: k * c / left, tangent: k / left.powi(2), energy }
    }
}

/// Adds a block of n times n squares of two triangles, with its sides `<name>_low` and `<name>_high`.
fn block(mut mesh: MeshArrays, name: &str, y: f64, n: u32) -> MeshArrays {
    let first = mesh.points.len() as u32;
    let at = |i: u32, j: u32| first + j * (n + 1) + i;
    let step = 1.0 / f64::from(n);
    let place = |number: u32| [f64::from(number % (n + 1)) * step, y + f64::from(number / (n + 1)) * step, 0.0];
    mesh.points.extend((0..(n + 1) * (n + 1)).map(place));
    let squares = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let square = |(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)];
    let side = |j: u32| (0..n).flat_map(|i| [at(i, j), at(i + 1, j)]).collect::<Vec<u32>>();
    let mesh = mesh.group(name, 2, squares.flat_map(square).collect());
    mesh.group(&format!("{name}_low"), 1, side(0)).group(&format!("{name}_high"), 1, side(n))
}

fn main() -> Result<()> {
    let (young, load, k, h) = (100.0, 20.0, 50.0, 0.1);
    let mesh = block(block(MeshArrays::new(Vec::new()), "lower", 0.0, 4), "upper", 1.0, 6);
    let scene = Scene::new(2, mesh)
        .law("film", move |_| Film { stiffness: k, thickness: h })
        .body(BodySpec::new("lower", young, 0.0).fix("lower_low", [Some(0.0), Some(0.0)]))
        .body(BodySpec::new("upper", young, 0.0).fix("upper_high", [Some(0.0), None]).pressure("upper_high", load))
        .contact(ContactSpec::new("lower_high", "upper_low", LayerSpec::Own("film".to_owned())));

    let session = Session::start(&[])?;
    let solution = solve(&session, scene)?;
    let Some(upper) = solution.body(1).transpose()? else { return Ok(()) };
    let computed = upper.displacement.iter().map(|u| u[1]).fold(f64::INFINITY, f64::min);
    let exact = -(2.0 * load / young + load / (k + load / h));
    println!("{}: the top sinks by {computed:.12}, exact {exact:.12}", solution.report().status);
    let off = solution.contact(0).pressure.iter().map(|p| (p - load).abs()).fold(0.0, f64::max);
    println!("largest error of the pressure: {off:.1e}");
    Ok(())
}
