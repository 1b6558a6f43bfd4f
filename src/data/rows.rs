//! The numbers of a file in rows.

/// The place of heights, where the file says it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Place of the first height.
    pub origin: [f64; 2],
    /// Distance of heights along a row and from row to row.
    pub spacing: [f64; 2],
}

/// Numbers in rows of one length. Once [`read`](super::read) has checked them, coordinates are finite, and a height is finite or NaN.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// Number of columns.
    pub columns: usize,
    /// The numbers, row by row.
    pub values: Vec<f64>,
    /// The line of each row if the file is a text; else empty.
    pub lines: Vec<u64>,
    /// The place of the heights, if the file says it.
    pub frame: Option<Frame>,
}

impl Rows {
    /// Return the number of rows.
    pub fn count(&self) -> usize {
        self.values.len() / self.columns.max(1)
    }

    /// Return the first column that has heights: the last one if each row is a point, else column 0.
    pub fn first_height(&self, points: bool) -> usize {
        if points { self.columns.saturating_sub(1) } else { 0 }
    }

    /// Return the line of a row as a text, or else its index.
    pub fn line(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"))
    }
}
