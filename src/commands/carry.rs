//! A solution carried from one mesh to another: its displacements or its pressures on the contact surfaces start the next
//! iteration.

use crate::contact::ContactPair;
use crate::discretize::Discrete;
use crate::output::ContactTable;
use nalgebra::DMatrix;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// The trace on a new mesh (layout of a trace vector) that a solution, given by its contact tables, has there.
pub fn trace(tables: &[ContactTable], discrete: &Discrete) -> Vec<f64> {
    let model = &discrete.model;
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    for (i, (pair, table)) in model.pairs.iter().zip(tables).enumerate() {
        for (q, shares) in neighbours(pair, table).enumerate() {
            for (of_scene, column) in table.displacement.iter().enumerate() {
                let side = discrete.sides(i)[of_scene];
                trace[side * points + model.offset[i] + q] = mean(&shares, column) - pair.prescribed[side][q];
            }
        }
    }
    trace
}

/// The pressures at the points of a new mesh. Where most of what is around a point is open, it is open.
pub fn pressure(tables: &[ContactTable], discrete: &Discrete) -> Vec<f64> {
    let mut pressure = Vec::new();
    for (pair, table) in discrete.model.pairs.iter().zip(tables) {
        let closed: Vec<f64> = table.pressure.iter().map(|&p| f64::from(p > 0.0)).collect();
        let at = |shares: Vec<_>| if mean(&shares, &closed) < 0.5 { 0.0 } else { mean(&shares, &table.pressure) };
        pressure.extend(neighbours(pair, table).map(at));
    }
    pressure
}

/// For each point of a pair the nearest ones of a table, with weights that sum to one.
fn neighbours<'a>(pair: &'a ContactPair, table: &ContactTable) -> impl Iterator<Item = Vec<(usize, f64)>> + 'a {
    let places = table.points.iter().enumerate().map(|(q, &x)| GeomWithData::new(x, q)).collect();
    let tree = RTree::bulk_load(places);
    // the neighbours on a curve, or around a point of a surface
    let count = if pair.along_curve { 2 } else { 4 };
    pair.position.iter().map(move |&x| {
        let nearest = tree.nearest_neighbor_iter_with_distance_2(x).take(count);
        let mut shares: Vec<_> =
            nearest.map(|(near, squared)| (near.data, 1.0 / squared.sqrt().max(f64::MIN_POSITIVE))).collect();
        let all: f64 = shares.iter().map(|(_, share)| share).sum();
        shares.iter_mut().for_each(|(_, share)| *share /= all);
        shares
    })
}

/// Norms of the difference between the solutions on two meshes.
pub struct Difference {
    /// Pressures, one entry for each pair.
    pub pressure: Vec<Norms>,
    /// Normal displacements, all contact surfaces together.
    pub displacement: Norms,
}

/// Norms over the surfaces: roots of weighted sums of squares.
#[derive(Debug, Default, Clone, Copy)]
pub struct Norms {
    /// Norm of the difference of both solutions.
    pub apart: f64,
    /// Norm of the solution on the earlier mesh.
    pub old: f64,
    /// Norm of the solution on the later mesh.
    pub new: f64,
}

/// The differences of two solutions at the points of the coarser mesh, `old`, to which the values of the `new` one are brought by planes through the
/// nearest points: they bend by less than what the old mesh leaves out.
pub fn difference(old: &[ContactTable], new: &[ContactTable]) -> Difference {
    let (mut pressure, mut displacement) = (Vec::new(), Norms::default());
    for (old, new) in old.iter().zip(new) {
        let planes = Planes::new(&new.points);
        let mut of_pair = Norms::default();
        for (q, (point, weight)) in old.points.iter().zip(&old.weight).enumerate() {
            let shares = planes.shares(point);
            of_pair.add(*weight, old.pressure[q], within(&shares, &new.pressure));
            for (new, old) in new.displacement.iter().zip(&old.displacement) {
                displacement.add(*weight, old[q], within(&shares, new));
            }
        }
        pressure.push(of_pair.roots());
    }
    Difference { pressure, displacement: displacement.roots() }
}

impl Norms {
    fn add(&mut self, weight: f64, old: f64, new: f64) {
        self.apart += weight * (new - old).powi(2);
        self.old += weight * old * old;
        self.new += weight * new * new;
    }

    fn roots(self) -> Self {
        Self { apart: self.apart.sqrt(), old: self.old.sqrt(), new: self.new.sqrt() }
    }
}

/// Values at scattered points, brought to other points by linear functions fitted to the nearest ones.
struct Planes {
    tree: RTree<GeomWithData<[f64; 3], usize>>,
}

impl Planes {
    /// Points that a linear function is fitted to: twice the four that determine one in space.
    const NEAREST: usize = 8;

    fn new(points: &[[f64; 3]]) -> Self {
        let places = points.iter().enumerate().map(|(q, &x)| GeomWithData::new(x, q)).collect();
        Self { tree: RTree::bulk_load(places) }
    }

    /// The shares that the values of the nearest points have in the fitted value. Squares of misfits have the weight of the inverse distance to the fourth.
    ///
    /// The slopes are held near zero by a small weight. Points of a surface hardly differ across it, so that no slope is found there; along it the squares of their weights
    /// are some hundred times that of `SLOPES`, as each of them is one at least.
    fn shares(&self, at: &[f64; 3]) -> Vec<(usize, f64)> {
        const SLOPES: f64 = 0.1;
        let nearest: Vec<_> = self.tree.nearest_neighbor_iter_with_distance_2(*at).take(Self::NEAREST).collect();
        let far = nearest.last().map_or(0.0, |(_, squared)| squared.sqrt());
        if let Some((same, _)) = nearest.first().filter(|(_, squared)| squared.sqrt() <= 1e-9 * far) {
            return vec![(same.data, 1.0)];
        }
        let count = nearest.len();
        let rows = DMatrix::from_fn(count + 3, 4, |i, k| match nearest.get(i) {
            Some((_, squared)) if k == 0 => far * far / squared,
            Some((near, squared)) => far * (near.geom()[k - 1] - at[k - 1]) / squared,
            None => {
                if i + 1 == count + k {
                    SLOPES
                } else {
                    0.0
                }
            }
        });
        let Ok(inverse) = rows.pseudo_inverse(f64::EPSILON) else { return vec![(nearest[0].0.data, 1.0)] };
        let share = |(i, (near, squared)): (usize, &(&GeomWithData<[f64; 3], usize>, f64))| {
            (near.data, inverse[(0, i)] * far * far / squared)
        };
        nearest.iter().enumerate().map(share).collect()
    }
}

/// The fitted value, between those that it is fitted to: where all of these lie to one side, a plane may lead anywhere.
fn within(shares: &[(usize, f64)], column: &[f64]) -> f64 {
    let values = || shares.iter().map(|(near, _)| column[*near]);
    let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    mean(shares, column).clamp(least, most)
}

fn mean(shares: &[(usize, f64)], column: &[f64]) -> f64 {
    shares.iter().map(|(near, share)| share * column[*near]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of so many points a side on the unit square, with pressures and displacements that are linear functions, times a factor.
    fn table(n: usize, factor: f64) -> ContactTable {
        let points: Vec<[f64; 3]> =
            (0..n * n).map(|q| [(q % n) as f64, (q / n) as f64, 0.0].map(|x| x / (n - 1) as f64)).collect();
        let linear = |points: &[[f64; 3]]| points.iter().map(|x| factor * (1.0 + x[0] + 2.0 * x[1])).collect();
        let (pressure, displacement) = (linear(&points), [linear(&points), linear(&points)]);
        ContactTable { weight: vec![1.0; n * n], points, pressure, displacement, ..ContactTable::default() }
    }

    #[test]
    fn linear_functions_do_not_differ_and_others_by_what_they_do() {
        let same = difference(&[table(5, 1.0)], &[table(8, 1.0)]);
        // but for the weight of the slopes
        assert!(same.pressure[0].apart < 2e-3 * same.pressure[0].new, "{:?}", same.pressure);
        let off = difference(&[table(5, 1.1)], &[table(8, 1.0)]);
        let Norms { apart, old, new } = off.pressure[0];
        assert!((apart / new - 0.1).abs() < 2e-3 && (old / new - 1.1).abs() < 2e-3, "{:?}", off.pressure);
        assert!((off.displacement.apart / off.displacement.new - 0.1).abs() < 2e-3);
        // fewer points than a plane through the nearest ones takes
        let few = difference(&[table(2, 1.0)], &[table(2, 1.25)]).pressure[0];
        assert!((few.apart / few.new - 0.2).abs() < 1e-12, "{few:?}");
    }
}
