//! Many bodies from one table: walls of bricks and blocks in space. What is normal to the joints passes through them as it is.

use super::{close, solved};
use crate::common::Report;

/// The pairs: names of their bodies, and the force on the second one.
fn pairs(run: &Report) -> Vec<([String; 2], [f64; 3])> {
    let count = run["pairs"].as_array().expect("pairs").len();
    let name = |pair: usize, side: usize| run.text(&format!("pairs/{pair}/bodies/{side}")).to_owned();
    (0..count).map(|pair| ([name(pair, 0), name(pair, 1)], run.forces(pair)[1])).collect()
}

/// The number at the end of a body's name.
fn number(name: &str) -> usize {
    name.rsplit('_').next().and_then(|number| number.parse().ok()).expect("a number")
}

/// Walls of any size: every joint between courses carries what is above it, every one in a course the side load of the course.
#[test]
fn bricks() {
    let (columns, rows) = (5, 4);
    let run = solved("wall", &["mesh.set.columns=5", "mesh.set.rows=4"]);
    assert_eq!(run["bodies"].as_array().expect("bodies").len(), columns * rows);
    let row = |name: &str| (number(name) - 1) / columns;
    let mut beds = vec![0.0; rows - 1];
    let mut heads = 0;
    for ([below, above], force) in pairs(&run) {
        if row(&below) == row(&above) {
            close("a head joint", force[0], 0.1 * 0.125, 1e-8);
            heads += 1;
        } else {
            assert_eq!(row(&below) + 1, row(&above));
            beds[row(&below)] += force[1];
        }
    }
    assert_eq!(heads, rows * (columns - 1));
    // the load 0.5 (1 + cos(pi x)) on a wall 1.25 long, and courses of 0.125 x 0.018
    let length = 0.25 * columns as f64;
    let load = 0.5 * (length + (std::f64::consts::PI * length).sin() / std::f64::consts::PI);
    for (below, &bed) in beds.iter().enumerate() {
        let weight = 0.018 * length * 0.125 * (rows - 1 - below) as f64;
        // the quadrature of the load
        close("a bed", bed, load + weight, 1e-4);
    }
    assert!(run.warnings().is_empty(), "{}", run.warnings());
}

/// Blocks in space: every joint carries the pressure behind it, those between storeys all that is above.
#[test]
fn blocks() {
    // joints across x and y carry a hundredth of what the others do, by whose pressures the error is measured
    let run = solved("blocks", &["method.stop={residual=1e-10}"]);
    let mut storeys = [0.0; 2];
    for ([a, b], force) in pairs(&run) {
        match number(&b) - number(&a) {
            1 => close("a joint across x", force[0], 0.2 * 0.01, 1e-8),
            3 => close("a joint across y", force[1], 0.1 * 0.01, 1e-8),
            9 => storeys[(number(&a) - 1) / 9] += force[2],
            apart => panic!("{a} and {b} are {apart} apart"),
        }
    }
    // (1 + cos(10 x) cos(10 y)) on 0.3 x 0.3, of which the linear elements see the values at their quadrature points
    let load = 0.09 + (3f64.sin() / 10.0).powi(2);
    close("the lower storey's roof", storeys[0], load + 2.0 * 0.09 * 0.1 * 0.024, 1e-3);
    close("the upper storey's", storeys[1], load + 0.09 * 0.1 * 0.024, 1e-3);
    // forces are as exact as the run is asked to be, a storey's weight is a small part of them
    close("a storey's weight", storeys[0] - 0.09 * 0.1 * 0.024, storeys[1], 1e-8);
}
