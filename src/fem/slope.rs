//! The gradient of a displacement at a point, in plane bodies, in space, and in bodies of revolution.

/// Index pairs of the components xx yy zz xy yz xz of stress and strain, in the order of VTK.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// The gradient of a displacement at a point.
///
/// In a body of revolution x is the radius r and y runs along the axis. The radial displacement u_r also stretches the circle through
/// the point, so that the third normal strain is u_r/r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope<const D: usize> {
    /// Derivatives du_i/dx_j.
    pub h: [[f64; D]; D],
    /// Strain u_r/r of the circle in a body of revolution, zero in others.
    pub hoop: f64,
}

impl<const D: usize> Slope<D> {
    /// The gradient of a constant displacement.
    pub const ZERO: Self = Self { h: [[0.0; D]; D], hoop: 0.0 };

    /// Add `factor` times another gradient.
    pub fn add(&mut self, factor: f64, other: &Self) {
        for (sum, term) in self.h.iter_mut().flatten().zip(other.h.iter().flatten()) {
            *sum += factor * term;
        }
        self.hoop += factor * other.hoop;
    }

    /// Return the strain (xx yy zz, and 2 eps of xy yz xz) (3). The strain of the circles is zz.
    pub fn strain(&self) -> [f64; 6] {
        let mut strain = strain(&self.h);
        strain[2] += self.hoop;
        strain
    }

    /// Return the sum of the squares of all entries.
    pub fn square(&self) -> f64 {
        self.h.as_flattened().iter().map(|h| h * h).sum::<f64>() + self.hoop * self.hoop
    }
}

/// Return the strain (xx yy zz, and 2 eps of xy yz xz) of a displacement gradient (3).
pub fn strain<const D: usize>(h: &[[f64; D]; D]) -> [f64; 6] {
    PAIRS.map(|(i, j)| match (i < D && j < D, i == j) {
        (false, _) => 0.0,
        (_, true) => h[i][i],
        _ => h[i][j] + h[j][i],
    })
}
