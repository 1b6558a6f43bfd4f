//! The shape of the cells of a mesh.

use super::{Group, Mesh};

/// The shape of the cells of a group by their mean ratio, which is 1 for an equilateral simplex and near 0 for a flat one.
///
/// In the plane the mean ratio is 4 sqrt(3) area / (sum of squared edges), in space 12 (3 volume)^(2/3) / (sum of squared
/// edges). It uses the vertices only, so curved edges count as straight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Mean ratio of the worst cell.
    pub least: f64,
    /// Mean over all cells.
    pub mean: f64,
}

impl<const D: usize> Mesh<D> {
    /// Return the shape of the cells of a group. The result is meaningless for groups of lower dimension.
    pub fn quality(&self, group: &Group) -> Quality {
        let (mut least, mut sum) = (f64::INFINITY, 0.0);
        for cell in group.simplices() {
            let ratio = mean_ratio::<D>(&std::array::from_fn::<_, 4, _>(|i| self.points[cell[i.min(D)] as usize]));
            least = least.min(ratio);
            sum += ratio;
        }
        Quality { least, mean: sum / group.len() as f64 }
    }
}

/// Return the mean ratio of the simplex given by the first D + 1 vertices.
fn mean_ratio<const D: usize>(vertices: &[[f64; D]; 4]) -> f64 {
    let edge = |i: usize, j: usize| -> [f64; D] { std::array::from_fn(|c| vertices[j][c] - vertices[i][c]) };
    let mut squares = 0.0;
    for j in 1..=D {
        for i in 0..j {
            squares += edge(i, j).iter().map(|x| x * x).sum::<f64>();
        }
    }
    // The determinant of the edges from the first vertex is D! times the measure.
    let jacobian = nalgebra::DMatrix::from_fn(D, D, |row, column| edge(0, row + 1)[column]).determinant().abs();
    match D {
        2 => 2.0 * 3f64.sqrt() * jacobian / squares,
        _ => 12.0 * (jacobian / 2.0).powf(2.0 / 3.0) / squares,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_in_closed_form() {
        let h = 0.75f64.sqrt();
        assert!((mean_ratio(&[[0.0, 0.0], [1.0, 0.0], [0.5, h], [0.0; 2]]) - 1.0).abs() < 1e-14);
        assert!((mean_ratio(&[[0.0, 0.0], [3.0, 0.0], [0.0, 3.0], [0.0; 2]]) - h).abs() < 1e-14);
        let regular = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        assert!((mean_ratio(&regular) - 1.0).abs() < 1e-14);
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((mean_ratio(&corner) - 12.0 / 9.0 * 0.25f64.cbrt()).abs() < 1e-14);
        assert!(mean_ratio(&[[0.0, 0.0], [1.0, 0.0], [0.5, 1e-9], [0.0; 2]]) < 1e-8);
    }
}
