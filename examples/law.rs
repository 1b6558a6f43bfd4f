//! A mesh of arrays and a layer law of one's own, against the closed form: a soft film of thickness h that no pressure
//! squeezes to nothing, p = k c/(1 - c/h), between two blocks that a pressure P shortens evenly.
//!
//! ```text
//! cargo run --release --example law
//! ```

use winkler::api::{BodySpec, ContactSpec, LayerLaw, LayerSpec, MeshArrays, Result, Scene, Session, Solution, solve};

const YOUNG: f64 = 100.0;
/// The pressure on the upper block.
pub const LOAD: f64 = 20.0;
const FILM: Film = Film { stiffness: 50.0, thickness: 0.1 };

#[derive(Debug)]
struct Film {
    stiffness: f64,
    thickness: f64,
}

impl LayerLaw for Film {
    fn pressure_and_tangent(&self, _point: usize, c: f64) -> (f64, f64) {
        let Film { stiffness: k, thickness: h } = *self;
        // all is infinite from c = h on: a rigid stop
        let left = (1.0 - c / h).max(0.0);
        (k * c / left, k / left.powi(2))
    }

    fn energy(&self, _point: usize, c: f64) -> f64 {
        let Film { stiffness: k, thickness: h } = *self;
        -k * h * (h * (-c / h).max(-1.0).ln_1p() + c)
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

/// Solve the blocks with their film.
pub fn pressed(session: &Session) -> Result<Solution> {
    let mesh = block(block(MeshArrays::new(Vec::new()), "lower", 0.0, 4), "upper", 1.0, 6);
    let scene = Scene::new(2, mesh)
        .law("film", |_| FILM)
        .body(BodySpec::new("lower", YOUNG, 0.0).fix("lower_low", [Some(0.0), Some(0.0)]))
        .body(BodySpec::new("upper", YOUNG, 0.0).fix("upper_high", [Some(0.0), None]).pressure("upper_high", LOAD))
        .contact(ContactSpec::new("lower_high", "upper_low", LayerSpec::Own("film".to_owned())));
    solve(session, scene)
}

/// Return by how much the top moves, by the closed form.
pub fn exact() -> f64 {
    -(2.0 * LOAD / YOUNG + LOAD / (FILM.stiffness + LOAD / FILM.thickness))
}

fn main() -> Result<()> {
    let solution = pressed(&Session::start(&[])?)?;
    let Some(upper) = solution.body(1).transpose()? else { return Ok(()) };
    let computed = upper.displacement.iter().map(|u| u[1]).fold(f64::INFINITY, f64::min);
    println!("{}: the top sinks by {computed:.12}, exact {:.12}", solution.report().status, exact());
    let off = solution.contact(0).pressure.iter().map(|p| (p - LOAD).abs()).fold(0.0, f64::max);
    println!("largest error of the pressure: {off:.1e}");
    Ok(())
}
