//! Numbers of a file in rows.

/// Numbers in rows of one length, all finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Numbers in a row.
    pub columns: usize,
    /// Row by row.
    pub values: Vec<f64>,
    /// Line of each row in a text; none of another file.
    pub lines: Vec<u64>,
}

impl Rows {
    /// Number of rows.
    pub fn count(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Where a row stands, in words.
    pub fn line(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }
}
