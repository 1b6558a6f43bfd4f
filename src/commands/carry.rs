//! A solution carried from one mesh to another: its displacements on the contact surfaces start the next iteration.

use super::run::Prepared;
use crate::output::ContactTable;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// The trace on a new mesh (layout of a trace vector) that a solution, given by its contact tables, has there.
pub fn trace(tables: &[ContactTable], prepared: &Prepared) -> Vec<f64> {
    let model = &prepared.problem.model;
    let points = model.points();
    let mut trace = vec![0.0; 2 * points];
    for (i, (pair, table)) in model.pairs.iter().zip(tables).enumerate() {
        let places = table.points.iter().enumerate().map(|(q, &x)| GeomWithData::new(x, q)).collect();
        let tree = RTree::bulk_load(places);
        // the neighbours on a curve, or around a point of a surface
        let count = if pair.along_curve { 2 } else { 4 };
        for (q, &x) in pair.position.iter().enumerate() {
            let mut shares = Vec::new();
            for (near, squared) in tree.nearest_neighbor_iter_with_distance_2(x).take(count) {
                shares.push((near.data, 1.0 / squared.sqrt().max(f64::MIN_POSITIVE)));
            }
            let all: f64 = shares.iter().map(|(_, share)| share).sum();
            for (of_scene, column) in table.displacement.iter().enumerate() {
                let side = if prepared.problem.contacts[i].swapped { 1 - of_scene } else { of_scene };
                let sum: f64 = shares.iter().map(|(near, share)| share * column[*near]).sum();
                trace[side * points + model.offset[i] + q] = sum / all - pair.prescribed[side][q];
            }
        }
    }
    trace
}
