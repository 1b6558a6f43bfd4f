//! Errors against the finest mesh of the table, for scenes without a known solution.

use super::compare;
use super::plan::Plan;
use super::process::folder_of;
use super::table::{Row, Table};

/// Set the error of every row that has none, against the row of the finest mesh with the same values of all keys that are not of the mesh.
///
/// Rows of the finest mesh have no error. Of several rows with as many dofs and the same order, the one with the smallest residual is the
/// reference.
pub(super) fn against_finest(table: &mut Table, plan: &Plan) {
    let folder = table.runs();
    // the first columns of the table are the scene and the keys
    let others: Vec<usize> =
        (0..=plan.keys.len()).filter(|&column| column == 0 || !plan.keys[column - 1].starts_with("mesh.")).collect();
    let is_alike = |a: &Row, b: &Row| others.iter().all(|&column| a.key[column] == b.key[column]);
    let is_comparable = |row: &Row| row.is_good() && !row.is_linear();
    // dofs, and the order of the elements
    let fineness = |row: &Row| (row.number("dofs").unwrap_or(0.0), row.key[row.key.len() - 2].clone());
    let residual = |row: &Row| row.number("residual").unwrap_or(f64::INFINITY);
    let mut found = Vec::new();
    for (index, row) in table.rows.iter().enumerate() {
        if !is_comparable(row) || row.number("error").is_some() {
            continue;
        }
        let group = table.rows.iter().filter(|other| is_comparable(other) && is_alike(row, other));
        let finest = group.max_by(|a, b| {
            let (x, y) = (fineness(a), fineness(b));
            x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)).then(residual(b).total_cmp(&residual(a)))
        });
        let Some(finest) = finest.filter(|finest| fineness(finest) != fineness(row)) else { continue };
        let error = || {
            let scene = plan.scene(&row.key[0])?;
            let [own, other] = [row, finest].map(|row| compare::tables(&folder_of(&folder, &row.key)).ok());
            compare::difference(scene.dimension.value, &own?, &other?)
        };
        found.extend(error().map(|error| (index, error)));
    }
    for (index, error) in found {
        table.rows[index].set_error(error, "pressure, finest mesh");
    }
}
