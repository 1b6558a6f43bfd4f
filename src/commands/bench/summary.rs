//! The table on the terminal at the end of a benchmark.

use super::plan::{ASKED, Plan};
use super::row::Row;
use crate::output::{sci, seconds};
use comfy_table::{CellAlignment, Table, presets};

/// A function that returns a number as a text.
type Format = fn(f64) -> String;

/// Columns with a number: heading, name in the rows, format.
const NUMBERS: [(&str, &str, Format); 8] = [
    ("dofs", "dofs", whole),
    ("iterations", "iterations", whole),
    ("sweeps", "sweeps", whole),
    ("s", "seconds", seconds),
    ("CPU s", "cpu_seconds", seconds),
    ("MB", "memory_mb", whole),
    ("linear solves", "linear_solves", tenths),
    ("error", "error", two),
];

fn whole(value: f64) -> String {
    format!("{value:.0}")
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

fn two(value: f64) -> String {
    sci(value, 2)
}

/// Return the table with one line for each row: the values that distinguish it, the method that ran, and the numbers that some row has.
pub(super) fn of(rows: &[Row], plan: &Plan) -> Table {
    let columns = plan.columns();
    let differs =
        |column: &usize| columns[*column] != ASKED && rows.iter().any(|row| row.key[*column] != rows[0].key[*column]);
    let named: Vec<usize> = (0..columns.len()).filter(differs).collect();
    let known = |name: &str| rows.iter().any(|row| row.number(name).is_some());
    let numbers: Vec<_> = NUMBERS.iter().filter(|(_, name, _)| known(name)).collect();
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let heads = named.iter().map(|&column| columns[column].as_str());
    table.set_header(heads.chain(["method", "status"]).chain(numbers.iter().map(|number| number.0)));
    let line = |row: &Row| -> Vec<String> {
        let words = named.iter().map(|&column| row.key[column].clone());
        let words = words.chain([row.method.clone(), row.status.clone()]);
        words.chain(numbers.iter().map(|(_, name, format)| row.number(name).map_or(String::new(), format))).collect()
    };
    table.add_rows(rows.iter().map(line));
    for column in table.column_iter_mut().skip(named.len() + 2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
