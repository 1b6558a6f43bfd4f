//! A solution carried from one mesh to another: its displacements or its pressures on the contact surfaces start the next
//! iteration.

use crate::contact::ContactPair;
use crate::discretize::Discrete;
use crate::output::ContactTable;
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

fn mean(shares: &[(usize, f64)], column: &[f64]) -> f64 {
    shares.iter().map(|(near, share)| share * column[*near]).sum()
}
