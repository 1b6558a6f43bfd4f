//! The point from which the coordinates of a mesh are measured, if the mesh lies far from the origin of its scene.
//!
//! A coordinate of size X has an absolute error of eps X, where eps is the relative rounding error. Differences of
//! coordinates are exact or nearly so. Products, interpolations and sums of coordinates round relative to X, not to the
//! size of the body. The datum lies near the mesh and is subtracted once, where the mesh is loaded. All of these then
//! round relative to the size of the mesh. Coordinates of the scene return in expressions and in output alone.

use crate::linalg::bounds;

/// Distance of the centre of a mesh from the origin, in sizes of the mesh, below which the mesh keeps its coordinates.
/// At most three bits are lost there, and the numbers of scenes near the origin do not change.
const FAR: f64 = 4.0;

/// Return the datum for points in a box `[low, high]`. Along each axis it is zero, or a point near the middle of the
/// box if the origin is far away. `along` tells along which axes the origin may move: in a body of revolution the
/// radius is measured from the axis.
///
/// The datum is a multiple of a power of two that does not exceed the size of the box. Coordinates are multiples of a
/// smaller power, or have no digits within the box. The datum is therefore subtracted and added again without error.
pub fn of<const D: usize>([low, high]: [[f64; 3]; 2], along: [bool; D]) -> [f64; D] {
    let size = (0..D).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    let unit = size.log2().floor().exp2();
    std::array::from_fn(|c| {
        let middle = 0.5 * low[c] + 0.5 * high[c];
        let datum = (middle / unit).round() * unit;
        if along[c] && middle.abs() > FAR * size && datum.is_finite() { datum } else { 0.0 }
    })
}

/// Return the coordinates in the scene of a point that is measured from a datum.
pub fn in_scene<const D: usize>(datum: &[f64; D], x: [f64; D]) -> [f64; D] {
    std::array::from_fn(|c| x[c] + datum[c])
}

/// Return the largest error that rounding may have left in a coordinate of these points, given with their datum.
pub fn rounding<'a, const D: usize>(datum: &[f64; D], points: impl IntoIterator<Item = &'a [f64; D]>) -> f64 {
    let [low, high] = bounds(points.into_iter().map(|&x| in_scene(datum, x)));
    0.5 * f64::EPSILON * (0..D).map(|c| high[c].abs().max(low[c].abs())).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near the origin nothing moves. Far away the datum is near the middle, and every coordinate is recovered to the
    /// last bit.
    #[test]
    fn a_datum_is_exact() {
        let near = [[-1.0, 3.0, 0.0], [1.0, 5.0, 2.0]];
        assert_eq!(of::<3>(near, [true; 3]), [0.0; 3]);
        assert_eq!(of::<2>([[7.5, 0.0, 0.0], [8.5, 1.0, 0.0]], [false, true]), [0.0; 2]);
        for (far, size) in [(1e3, 0.7), (-3e6, 1.3), (1e9, 1e-3), (1e300, 1e290), (5e-280, 1e-284)] {
            let x = |share: f64| far + share * size;
            let box_of = [[x(0.0), 0.0, 0.0], [x(1.0), size, size]];
            let [datum, y, z] = of::<3>(box_of, [true; 3]);
            assert_eq!([y, z], [0.0; 2]);
            assert!((datum - x(0.5)).abs() <= size, "{far} {size}");
            for share in [0.0, 0.1, 1.0 / 3.0, 0.7, 1.0] {
                let local = x(share) - datum;
                assert_eq!(local + datum, x(share));
                assert!(local.abs() <= 2.0 * size);
            }
        }
        // The boxes have no extent, or contain no points.
        assert_eq!(of::<3>([[9.0; 3]; 2], [true; 3]), [0.0; 3]);
        assert_eq!(of::<3>([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], [true; 3]), [0.0; 3]);
    }
}
