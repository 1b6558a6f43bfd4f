//! The numbers of a file in rows.

/// Numbers in rows of one length, all finite once [`read`](super::read) has checked them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Number of columns.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Vec<f64>,
    /// The line of each row if the file is a text; else empty.
    pub lines: Vec<u64>,
}

impl Rows {
    /// Return the number of rows.
    pub fn count(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Return the line of a row as a text, or else its index.
    pub fn line(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }
}
