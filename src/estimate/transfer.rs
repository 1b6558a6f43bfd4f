//! Solutions on two meshes: the start of an iteration from the solution on another mesh, and the error of the later
//! one, checked by the earlier one.

use super::interpolate::{DAMPED, L2Norms, PointTree, Squares, Weights, clamped_mean, mean, on_edge};
use crate::contact::ContactPair;
use crate::discretize::Discrete;
use crate::estimate::Estimate;
use crate::output::ContactTable;

/// Return the trace on a new mesh (layout of a trace vector) of a solution that is given by its contact tables, one for
/// each pair.
pub fn trace(tables: &[ContactTable], discrete: &Discrete) -> Vec<f64> {
    let model = &discrete.model;
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    for (i, (pair, table)) in model.pairs.iter().zip(tables).enumerate() {
        for (q, weights) in neighbours(pair, table).enumerate() {
            for (side_in_scene, column) in table.displacement.iter().enumerate() {
                let side = discrete.sides(i)[side_in_scene];
                trace[side * points + model.offset[i] + q] = mean(&weights, column) - pair.prescribed[side][q];
            }
        }
    }
    trace
}

/// Return the pressures at the contact points of a new mesh. A point is open if the points around it in the table are
/// mostly open.
pub fn pressure(tables: &[ContactTable], discrete: &Discrete) -> Vec<f64> {
    let mut pressure = Vec::new();
    for (pair, table) in discrete.model.pairs.iter().zip(tables) {
        let closed: Vec<f64> = table.pressure.iter().map(|&p| f64::from(p != 0.0)).collect();
        let at = |weights: Weights| if mean(&weights, &closed) < 0.5 { 0.0 } else { mean(&weights, &table.pressure) };
        pressure.extend(neighbours(pair, table).map(at));
    }
    pressure
}

/// Return for each point of a pair the weights of the nearest points of a table.
fn neighbours<'a>(pair: &'a ContactPair, table: &ContactTable) -> impl Iterator<Item = Weights> + 'a {
    let scattered = PointTree::new(&table.points);
    // the neighbours on a curve, or around a point of a surface
    let count = if pair.measure.is_along_curve() { 2 } else { 4 };
    pair.position.iter().map(move |x| scattered.inverse_distances(x, count))
}

/// The contact points of each edge of a pair, if these have an order above two in the plane; otherwise empty.
pub type Edges = Vec<Vec<usize>>;

/// The estimated errors of a solution on one mesh, to be compared with those on the next mesh.
pub struct EstimatedSolution {
    /// Relative errors of the pressures, one for each pair.
    pressure: Vec<f64>,
    /// Relative error of the normal displacements.
    displacement: f64,
    /// Relative errors of the sums of the pressures, one for each pair.
    force: Vec<f64>,
    /// The solution, one table for each pair.
    tables: Vec<ContactTable>,
}

impl EstimatedSolution {
    /// Return the errors of an estimate together with its solution.
    pub fn new(estimate: &Estimate, tables: Vec<ContactTable>) -> Self {
        Self {
            pressure: estimate.pressure.clone(),
            displacement: estimate.displacement,
            force: estimate.force.clone(),
            tables,
        }
    }

    /// Return the solution, one table for each pair.
    pub fn tables(&self) -> &[ContactTable] {
        &self.tables
    }

    /// Correct the estimate of the next mesh, whose solution is `tables`, by the difference of both solutions.
    ///
    /// If the error e of the next mesh and the error e' of this mesh are right, the solutions differ by e + e' at most.
    /// Where they differ by more, at least one of them is too small, and e is multiplied by the ratio. Pairs that are
    /// found automatically may differ between meshes; then nothing is compared.
    ///
    /// `edges` are those of the next mesh, one entry for each pair.
    pub fn correct(&self, tables: &[ContactTable], edges: &[Edges], estimate: &mut Estimate) {
        if !self.tables.iter().map(bodies).eq(tables.iter().map(bodies)) {
            return;
        }
        let norms = norms(&self.tables, tables, edges);
        let of_displacement = excess(&norms.displacement, estimate.displacement, self.displacement);
        for (i, error) in estimate.pressure.iter_mut().enumerate() {
            let excess = excess(&norms.pressure[i], *error, self.pressure[i]);
            *error *= excess;
            estimate.ends[i] *= excess;
        }
        for (i, error) in estimate.force.iter_mut().enumerate() {
            let [old, new] = [&self.tables[i], &tables[i]].map(force);
            *error *= excess(&L2Norms { difference: (new - old).abs(), old, new }, *error, self.force[i]);
        }
        estimate.displacement *= of_displacement;
    }
}

/// Return the sum of the sizes of a pair's pressures.
fn force(table: &ContactTable) -> f64 {
    table.weight.iter().zip(&table.pressure).map(|(area, p)| area * p.abs()).sum()
}

/// Return the names of a pair's bodies, the same whichever of them carries the points.
fn bodies(table: &ContactTable) -> [&str; 2] {
    let mut names = table.side_names.each_ref().map(String::as_str);
    names.sort_unstable();
    names
}

/// Return how many times larger a difference is than the relative errors `new` and `old` explain, at least one.
fn excess(norms: &L2Norms, new: f64, old: f64) -> f64 {
    let most = new * norms.new + old * norms.old;
    if most > 0.0 && norms.difference.is_finite() { (norms.difference / most).max(1.0) } else { 1.0 }
}

/// Norms of the solutions on two meshes and of their difference.
struct SolutionNorms {
    /// Norms of the pressures, one entry for each pair.
    pressure: Vec<L2Norms>,
    /// Norms of the normal displacements, all contact surfaces together.
    displacement: L2Norms,
}

/// Return the norms of two solutions at the points of the coarser mesh, which is that of `old`.
fn norms(old: &[ContactTable], new: &[ContactTable], edges: &[Edges]) -> SolutionNorms {
    let (mut pressure, mut displacement) = (Vec::new(), Squares::default());
    for ((old, new), edges) in old.iter().zip(new).zip(edges) {
        let scattered = PointTree::new(&new.points);
        let mut of_pair = Squares::default();
        for (q, (point, area)) in old.points.iter().zip(&old.weight).enumerate() {
            let at_point = Interpolation::new(&scattered, &new.points, edges, point);
            of_pair.add(*area, old.pressure[q], at_point.nearest(&new.pressure, old.pressure[q]));
            for (new, old) in new.displacement.iter().zip(&old.displacement) {
                displacement.add(*area, old[q], at_point.nearest(new, old[q]));
            }
        }
        pressure.push(of_pair.norms());
    }
    SolutionNorms { pressure, displacement: displacement.norms() }
}

/// The interpolation of a column of a table at a point.
enum Interpolation {
    /// By a plane through the nearest points, which bends by less than what a coarser mesh leaves out.
    Plane(Weights),
    /// By the polynomial of an edge of order three or more, and by that without one of its points.
    Edge([Weights; 2]),
}

impl Interpolation {
    fn new(scattered: &PointTree, points: &[[f64; 3]], edges: &Edges, at: &[f64; 3]) -> Self {
        if edges.is_empty() { Self::Plane(scattered.plane(at, DAMPED)) } else { Self::Edge(on_edge(points, edges, at)) }
    }

    /// Return the value in the column that is nearest to `old` within its uncertainty.
    ///
    /// Beside a singular place, pressures of high order are much nearer to the exact ones at their points than between
    /// them. The difference of both polynomials shows by how much.
    fn nearest(&self, column: &[f64], old: f64) -> f64 {
        match self {
            Self::Plane(weights) => clamped_mean(weights, column),
            Self::Edge([weights, fewer]) => {
                let value = mean(weights, column);
                let uncertainty = (value - mean(fewer, column)).abs();
                value + (old - value).clamp(-uncertainty, uncertainty)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_that_errors_explain_changes_none() {
        let norms = |difference| L2Norms { difference, old: 2.0, new: 1.0 };
        assert_eq!([0.1, 0.5, 1.0].map(|difference| excess(&norms(difference), 0.1, 0.2)), [1.0, 1.0, 2.0]);
        assert_eq!([excess(&norms(0.1), 0.0, 0.0), excess(&norms(f64::NAN), 0.1, 0.1)], [1.0, 1.0]);
    }

    /// The solutions differ by 0.1/1.1 of the later one. Errors that explain this stay, and those that do not are
    /// raised by the same factor.
    #[test]
    fn errors_explain_the_difference_of_two_meshes() {
        let corrected = |of_earlier: f64| {
            let estimate = |displacement: f64| Estimate {
                displacement,
                pressure: vec![0.1],
                ends: vec![0.0],
                ..Estimate::default()
            };
            let mut later = estimate(0.05);
            EstimatedSolution::new(&estimate(of_earlier), vec![table(5, 1.0)]).correct(
                &[table(5, 1.1)],
                &[Edges::new()],
                &mut later,
            );
            assert_eq!(later.pressure, [0.1]);
            later.displacement
        };
        assert_eq!(corrected(0.06), 0.05);
        let raised = 0.05 * 0.1 / (0.05 * 1.1 + 0.02);
        assert!((corrected(0.02) - raised).abs() < 1e-12, "{} {raised}", corrected(0.02));
    }

    /// A grid of n x n points on the unit square, with pressures and displacements that are linear functions, times a
    /// factor.
    fn table(n: usize, factor: f64) -> ContactTable {
        let points: Vec<[f64; 3]> =
            (0..n * n).map(|q| [(q % n) as f64, (q / n) as f64, 0.0].map(|x| x / (n - 1) as f64)).collect();
        let linear = |points: &[[f64; 3]]| points.iter().map(|x| factor * (1.0 + x[0] + 2.0 * x[1])).collect();
        let (pressure, displacement) = (linear(&points), [linear(&points), linear(&points)]);
        ContactTable { weight: vec![1.0; n * n], points, pressure, displacement, ..ContactTable::default() }
    }

    #[test]
    fn linear_functions_do_not_differ_and_others_by_what_they_do() {
        let same = norms(&[table(5, 1.0)], &[table(8, 1.0)], &[Edges::new()]);
        // but for the weight of the slopes
        assert!(same.pressure[0].difference < 2e-3 * same.pressure[0].new, "{:?}", same.pressure);
        let off = norms(&[table(5, 1.1)], &[table(8, 1.0)], &[Edges::new()]);
        let L2Norms { difference, old, new } = off.pressure[0];
        assert!((difference / new - 0.1).abs() < 2e-3 && (old / new - 1.1).abs() < 2e-3, "{:?}", off.pressure);
        assert!((off.displacement.difference / off.displacement.new - 0.1).abs() < 2e-3);
        // fewer points than a plane through the nearest ones takes
        let few = norms(&[table(2, 1.0)], &[table(2, 1.25)], &[Edges::new()]).pressure[0];
        assert!((few.difference / few.new - 0.2).abs() < 1e-12, "{few:?}");
    }
}
