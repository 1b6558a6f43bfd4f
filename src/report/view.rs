//! The data of bodies and contact surfaces for the interactive view of the page.

use super::bands::{colors, hex, range};
use super::body::Part;
use crate::linalg::bounds;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Marks points without a value.
const NONE: u16 = u16::MAX;

/// Return the numbers of the view, little endian in base64.
///
/// Each part has points relative to the least coordinates and displacements (float32), triangles (uint32), and a value at each
/// point (uint16). Values are scaled to the range of the parts; 65535 stands for none.
pub fn data(bodies: &[Part], surfaces: &[Part], scale: f64, is_space: bool) -> Value {
    let [low, high] = bounds(bodies.iter().chain(surfaces).flat_map(|part| &part.points).copied());
    json!({
        "bodies": parts(bodies, low),
        "surfaces": parts(surfaces, low),
        "travel": range(bodies.iter().flat_map(Part::travel).collect::<Vec<_>>().iter()),
        "stress": range(bodies.iter().flat_map(|part| &part.value)),
        "pressure": range(surfaces.iter().flat_map(|part| &part.value)),
        "low": [0.0, 0.0, 0.0],
        "high": relative(low, &high),
        "scale": scale,
        "space": is_space,
        "colors": colors().map(hex).to_vec(),
    })
}

/// Return the coordinates of a point relative to another one.
fn relative(low: [f64; 3], x: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| x[c] - low[c])
}

/// Return the data of parts, with points relative to `low`.
fn parts(parts: &[Part], low: [f64; 3]) -> Vec<Value> {
    let ends = range(parts.iter().flat_map(|part| &part.value));
    parts.iter().map(|part| part_data(part, low, ends)).collect()
}

/// Return the data of a part; values are scaled to the range.
fn part_data(part: &Part, low: [f64; 3], [least, most]: [f64; 2]) -> Value {
    // float32 has too few digits for a small body far from the origin
    let points: Vec<[f64; 3]> = part.points.iter().map(|x| relative(low, x)).collect();
    let short = |value: &f64| match value.is_finite() {
        true => ((value - least) / (most - least) * f64::from(NONE - 1)).round() as u16,
        false => NONE,
    };
    let floats = |points: &[[f64; 3]]| -> Vec<u8> {
        points.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()).collect()
    };
    json!({
        "name": part.name,
        "points": STANDARD.encode(floats(&points)),
        "displacement": STANDARD.encode(floats(&part.displacement)),
        "value": STANDARD.encode(part.value.iter().map(short).flat_map(u16::to_le_bytes).collect::<Vec<_>>()),
        "triangles": STANDARD.encode(part.triangles.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>()),
    })
}
