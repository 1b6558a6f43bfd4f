//! The number of cells that cover a point, from the boundary alone.

use super::cells::Cells;
use super::distance::{Point, cross};
use super::surface::Surface;
use crate::error::Result;
use crate::linalg::Joined;

/// Weights of the corners of a cell for points inside it. These points lie on no line or plane through other nodes.
const INSIDE: [[f64; 4]; 5] = [
    [0.2718, 0.2357, 0.2583, 0.2342],
    [0.2236, 0.2646, 0.2449, 0.2669],
    [0.3142, 0.1732, 0.2824, 0.2302],
    [0.1414, 0.3317, 0.2513, 0.2756],
    [0.2887, 0.2079, 0.1619, 0.3415],
];

/// Check that every closed surface of the boundary has the body on one side and nothing on the other. Behind one facet of each
/// surface there must be one cell. There would be two if a part was meshed again inside another one.
///
/// # Errors
/// The number of cells behind a facet is not one.
pub fn check<const D: usize>(cells: &Cells<D>, surface: &Surface<D>) -> Result<()> {
    let mut joined = Joined::new(cells.node_count());
    for i in 0..surface.faces.len() {
        let facet = surface.facet(i);
        (1..D).for_each(|k| joined.join(facet[0], facet[k]));
    }
    let (count, closed) = joined.classes();
    let mut seen = vec![false; count];
    let first = (0..surface.faces.len()).filter(|&i| {
        let class = closed[surface.facet(i)[0] as usize] as usize;
        !std::mem::replace(&mut seen[class], true)
    });
    for i in first.collect::<Vec<_>>() {
        let cell = surface.faces[i].cell();
        let inside = |weights: &[f64; 4]| -> Point {
            let sum: f64 = weights[..=D].iter().sum();
            let corners = cells.cell(cell)[..=D].iter().zip(weights);
            corners
                .fold([0.0; 3], |x, (&node, weight)| std::array::from_fn(|c| x[c] + weight / sum * cells.at(node)[c]))
        };
        // A line that meets an edge decides nothing. The same holds in a thin curved cell for a point that its chords leave
        // outside.
        let counts: Vec<i32> = INSIDE.iter().filter_map(|weights| covers(surface, inside(weights))).collect();
        if counts.iter().all(|&count| count != 1) && !counts.is_empty() {
            let what = format!("{} cells lie over each other", counts[0].max(2));
            let help = "a part of the body was meshed twice: correct the geometry, or make bodies of its parts";
            return Err(cells.refuse(&what, &[cell], inside(&INSIDE[0])).help(help));
        }
    }
    Ok(())
}

/// Return how many times the boundary goes around a point, which is the number of cells of positive volume that cover it. The
/// crossings of the line from the point to larger x are counted, outwards minus inwards. Return `None` if the line meets an
/// edge of a facet.
fn covers<const D: usize>(surface: &Surface<D>, from: Point) -> Option<i32> {
    let mut far = from;
    far[0] = f64::MAX;
    let mut count = 0;
    for piece in surface.near(from, far).flat_map(|i| surface.flat(i)) {
        count +=
            if D == 2 { line(from, piece[0], piece[1]) } else { triangle(from, [piece[0], piece[1], piece[2 % D]])? };
    }
    Some(count)
}

/// Return the crossing of a segment that has the body on its left. The upper end does not belong to the segment, so that two
/// segments with a common end do not both count it.
fn line(from: Point, a: Point, b: Point) -> i32 {
    if (a[1] > from[1]) == (b[1] > from[1]) {
        return 0;
    }
    let x = a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
    if x > from[0] { (b[1] - a[1]).signum() as i32 } else { 0 }
}

/// Return the crossing of a triangle whose normal points out of the body. At its edges return `None`.
fn triangle(from: Point, x: [Point; 3]) -> Option<i32> {
    let x = x.map(|x| -> Point { std::array::from_fn(|c| x[c] - from[c]) });
    // These are twice the areas in the plane across the line.
    let areas = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| x[i][1] * x[j][2] - x[i][2] * x[j][1]);
    let size = x.iter().flat_map(|x| &x[1..]).fold(0.0, |max: f64, x| max.max(x.abs()));
    let side = |area: &f64| if area.abs() <= 1e-12 * size * size { 0 } else { area.signum() as i32 };
    let sides = areas.each_ref().map(side);
    if sides.contains(&1) && sides.contains(&-1) {
        return Some(0);
    }
    if sides.contains(&0) {
        return None;
    }
    let across: [Point; 2] = [1, 2].map(|i| std::array::from_fn(|c| x[i][c] - x[0][c]));
    let normal = cross(across[0], across[1]);
    // The line meets the plane of the triangle ahead of the point if this x is positive.
    let ahead = (0..3).map(|c| normal[c] * x[0][c]).sum::<f64>() / normal[0] > 0.0;
    Some(if ahead { sides[0] } else { 0 })
}
