//! Numbers of a file in rows, and what can be wrong with them.

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

/// What is wrong with a file, and what to do about it.
#[derive(Debug)]
pub struct Fault {
    /// Continues "data `name`, file".
    pub what: String,
    /// The way out; empty if there is none to say.
    pub help: &'static str,
}

impl Fault {
    /// A fault.
    pub fn new(what: impl Into<String>, help: &'static str) -> Self {
        Self { what: what.into(), help }
    }
}
