//! The gradient of a displacement at a point, in plane bodies, in space, and in bodies of revolution.

/// Index pairs of the components of stress and strain: xx yy zz xy yz xz, the order of VTK.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Gradient of a displacement at a point.
///
/// In a body of revolution x is the radius and y runs along the axis. There the displacement stretches the circle through the
/// point, too: the third normal strain is u_r/r.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope<const D: usize> {
    /// du_i/dx_j.
    pub h: [[f64; D]; D],
    /// u_r/r in a body of revolution, zero in others.
    pub hoop: f64,
}

impl<const D: usize> Slope<D> {
    /// That of a displacement which is the same everywhere around.
    pub const ZERO: Self = Self { h: [[0.0; D]; D], hoop: 0.0 };

    /// Adds `factor` times another one.
    pub fn add(&mut self, factor: f64, other: &Self) {
        for (sum, term) in self.h.iter_mut().flatten().zip(other.h.iter().flatten()) {
            *sum += factor * term;
        }
        self.hoop += factor * other.hoop;
    }

    /// Strain (xx yy zz, and 2 eps of xy yz xz) (3); the circles are stretched along z.
    pub fn strain(&self) -> [f64; 6] {
        let mut strain = strain(&self.h);
        strain[2] += self.hoop;
        strain
    }

    /// Sum of the squares of all entries.
    pub fn square(&self) -> f64 {
        self.h.as_flattened().iter().map(|h| h * h).sum::<f64>() + self.hoop * self.hoop
    }
}

/// Strain (xx yy zz, and 2 eps of xy yz xz) of a displacement gradient (3).
pub fn strain<const D: usize>(h: &[[f64; D]; D]) -> [f64; 6] {
    PAIRS.map(|(i, j)| match (i < D && j < D, i == j) {
        (false, _) => 0.0,
        (_, true) => h[i][i],
        _ => h[i][j] + h[j][i],
    })
}
