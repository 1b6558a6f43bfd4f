//! Prints what both faces of `meshes/paraboloid/scene.toml` yield under the exact pressures, by cosine series: in 1e-4
//! cm, one row of numbers for each x, from -1/128 to 65/128 in steps of 1/256 in both directions.
//! `meshes/paraboloid/depth.txt` has its output.
//!
//! cargo run --release --example paraboloid > meshes/paraboloid/depth.txt

#[path = "../tests/common/series.rs"]
#[allow(dead_code, reason = "tests use the rest")]
mod series;

use series::{Boxes, Series};

/// Points beyond the mirror planes at both ends of a side, so that interpolation has neighbours there.
const BEYOND: i32 = 2;

fn main() {
    let boxes =
        Boxes { side: 0.5, height: 0.5, young: 2.1e5, poisson: 0.3, stiffness: 1e6, approach: 3e-4, points: 512 };
    let series = Series::new(boxes, |x, y| 4e-3 * (x * x + y * y));
    let places: Vec<f64> = (-BEYOND..=128 + BEYOND).map(|i| f64::from(i) / 256.0).collect();
    for x in &places {
        let depths = series.depths(&vec![*x; places.len()], &places);
        println!("{}", depths.iter().map(|depth| format!("{:.6}", 1e4 * depth)).collect::<Vec<_>>().join(" "));
    }
}
