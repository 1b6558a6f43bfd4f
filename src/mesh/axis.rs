//! Nodes that a mesh of a body of revolution has beside its axis, where they should be on it.

use super::Mesh;

/// Share of the largest radius that rounding of a mesher leaves on the axis.
const ROUNDING: f64 = 1e-10;

/// Radius of a hole, in edges of the cells around it, below which the body is solid. The hole changes stresses within
/// some of its radii, and the energy of the cells by the square of this ratio, 1e-6. Cells of that size do not show the
/// hole; their stress at its edge, a displacement over the radius, is meaningless.
const HOLE: f64 = 1e-3;

impl<const D: usize> Mesh<D> {
    /// Put the nodes beside the axis x = 0 on it: those nearer than the uncertainty of coordinates, and those around a
    /// hole that the cells do not show. Return a warning for the latter.
    pub fn close_axis(&mut self) -> Option<String> {
        let largest = self.points.iter().fold(0.0, |largest: f64, x| largest.max(x[0].abs()));
        let uncertain = self.uncertainty.max(ROUNDING * largest);
        let edges = self.shortest_edges();
        let (mut count, mut farthest) = (0, 0.0);
        for (x, edge) in self.points.iter_mut().zip(edges) {
            let radius = x[0].abs();
            if radius > uncertain && radius <= HOLE * edge {
                count += 1;
                farthest = radius.max(farthest);
            }
            if radius <= uncertain.max(HOLE * edge) {
                x[0] = 0.0;
            }
        }
        (count > 0).then(|| {
            format!(
                "{count} nodes are up to {farthest:.1e} beside the axis, far less than the cells there: the body is taken as \
                 solid; if it has a hole, refine the mesh around it"
            )
        })
    }

    /// Return the shortest edge of the cells around each point, zero for points of no cell.
    fn shortest_edges(&self) -> Vec<f64> {
        let mut shortest = vec![f64::INFINITY; self.points.len()];
        let length = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|point| &self.points[point as usize]);
            (0..D).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        };
        for cell in self.groups.iter().filter(|group| group.dimension == D).flat_map(|group| group.simplices()) {
            let corners = &cell[..=D];
            let pairs = corners.iter().enumerate().flat_map(|(k, &a)| corners[..k].iter().map(move |&b| (a, b)));
            let edge = pairs.map(|(a, b)| length(a, b)).fold(f64::INFINITY, f64::min);
            cell.iter().for_each(|&point| shortest[point as usize] = edge.min(shortest[point as usize]));
        }
        shortest.iter_mut().filter(|edge| edge.is_infinite()).for_each(|edge| *edge = 0.0);
        shortest
    }
}
