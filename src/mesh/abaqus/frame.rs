//! Local systems of coordinates, and numbers as Fortran writes them.

use nalgebra::{Matrix3, Vector3};

/// The kind of local coordinates. Angles are in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// x, y, z.
    Rectangular,
    /// Radius, angle from x to y, z.
    Cylindrical,
}

impl Coordinates {
    /// Return the rectangular coordinates (x, y, z) in the local axes.
    pub fn rectangular(self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        match self {
            Coordinates::Rectangular => [a, b, c],
            Coordinates::Cylindrical => {
                let (sine, cosine) = sine_cosine(b);
                [a * cosine, a * sine, c]
            }
        }
    }
}

/// Return sine and cosine of an angle in degrees. They are exact at multiples of 90 degrees, where planes of symmetry
/// are.
fn sine_cosine(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        angle => angle.to_radians().sin_cos(),
    }
}

/// Local axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalAxes {
    origin: Vector3<f64>,
    axes: Matrix3<f64>,
}

impl Default for LocalAxes {
    fn default() -> Self {
        Self { origin: Vector3::zeros(), axes: Matrix3::identity() }
    }
}

impl LocalAxes {
    /// Return the global axes at another origin.
    pub fn at(origin: [f64; 3]) -> Self {
        Self { origin: origin.into(), ..Self::default() }
    }

    /// Return the axes with the first one from the origin to `first`, and `plane` in the half plane of the second one.
    /// None if the points lie on a line.
    pub fn by_plane(origin: [f64; 3], first: [f64; 3], plane: [f64; 3]) -> Option<Self> {
        let origin = Vector3::from(origin);
        let x = unit(Vector3::from(first) - origin)?;
        let z = unit(x.cross(&(Vector3::from(plane) - origin)))?;
        Some(Self { origin, axes: Matrix3::from_columns(&[x, z.cross(&x), z]) })
    }

    /// Return the axes with the global third one, and `first` in the half plane of the first one. None if `first` is
    /// straight above the origin.
    pub fn about_third(origin: [f64; 3], first: [f64; 3]) -> Option<Self> {
        let level = [first[0], first[1], origin[2]];
        Self::by_plane(origin, level, [origin[0] - level[1] + origin[1], origin[1] + level[0] - origin[0], origin[2]])
    }

    /// Return the global coordinates of a point with these rectangular local ones.
    pub fn place(&self, local: [f64; 3]) -> [f64; 3] {
        (self.origin + self.axes * Vector3::from(local)).into()
    }
}

/// Return the unit vector along a vector, or none if it is zero to rounding or not finite.
fn unit(v: Vector3<f64>) -> Option<Vector3<f64>> {
    v.try_normalize(1e-300).filter(|unit| unit.iter().all(|c| c.is_finite()))
}

/// Return a number whose exponent may begin with D, or with its sign alone; none if it is no finite number.
pub fn real(word: &str) -> Option<f64> {
    let mut text = word.trim().to_ascii_lowercase().replace('d', "e");
    if let Some(at) = text.rfind(['+', '-']).filter(|&at| at > 0 && !text[..at].ends_with('e')) {
        text.insert(at, 'e');
    }
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_coordinates_become_global_ones() {
        assert_eq!(Coordinates::Cylindrical.rectangular([2.0, 90.0, 5.0]), [0.0, 2.0, 5.0]);
        assert!((Coordinates::Cylindrical.rectangular([2.0, 30.0, 5.0])[1] - 1.0).abs() < 1e-15);
        // The first axis is y, and the second one z.
        let frame = LocalAxes::by_plane([1.0, 1.0, 1.0], [1.0, 3.0, 1.0], [1.0, 0.0, 5.0]).unwrap();
        assert_eq!(frame.place([10.0, 20.0, 30.0]), [31.0, 11.0, 21.0]);
        let frame = LocalAxes::about_third([1.0, 1.0, 1.0], [1.0, 3.0, 4.0]).unwrap();
        assert_eq!(frame.place([10.0, 20.0, 30.0]), [-19.0, 11.0, 31.0]);
        assert_eq!(LocalAxes::by_plane([0.0; 3], [1.0; 3], [2.0; 3]), None);
    }

    #[test]
    fn numbers_of_fortran() {
        for (text, value) in
            [("1.0D0", 1.0), ("1.5+3", 1500.0), ("-1.5-3", -0.0015), ("2.d-1", 0.2), ("1e+2", 100.0), ("+7.", 7.0)]
        {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["one", "", "-", "inf", "nan", "1e999", "1.5+", "d"] {
            assert_eq!(real(text), None, "{text}");
        }
    }
}
