//! `contact-<a>-<b>.csv`: area, gap, compression, pressure and normal displacements at the contact points of one pair.

use super::format::field;
use std::io::{self, Write};

/// The result on one pair of contact surfaces; all vectors have one entry per contact point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactTable {
    /// Names of the two sides: their bodies.
    pub side_names: [String; 2],
    /// Contact points, before deformation.
    pub points: Vec<[f64; 3]>,
    /// Area omega of each point, a length in the plane: the integration weight of the column `weight`.
    pub weight: Vec<f64>,
    /// Initial gap d.
    pub gap: Vec<f64>,
    /// Compression c of the layer; negative where the layer is open.
    pub compression: Vec<f64>,
    /// Contact pressure p(c), >= 0.
    pub pressure: Vec<f64>,
    /// Averaged normal displacement of side a and of side b, each along its own outer normal.
    pub displacement: [Vec<f64>; 2],
    /// Estimated error of the pressure, exact minus discrete; empty unless an estimate was requested.
    pub pressure_error: Vec<f64>,
}

impl ContactTable {
    /// Write the table as CSV, one row per contact point, with numbers to full precision.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let [name_a, name_b] = self.side_names.each_ref().map(|side| format!("u_n_{side}"));
        let mut columns: Vec<(&str, &[f64])> = vec![
            ("weight", &self.weight),
            ("gap", &self.gap),
            ("compression", &self.compression),
            ("pressure", &self.pressure),
            (&name_a, &self.displacement[0]),
            (&name_b, &self.displacement[1]),
        ];
        if !self.pressure_error.is_empty() {
            columns.push(("pressure_error", &self.pressure_error));
        }
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(["x", "y", "z"].into_iter().chain(columns.iter().map(|(name, _)| *name)))?;
        for (q, point) in self.points.iter().enumerate() {
            let values = point.iter().copied().chain(columns.iter().map(|(_, values)| values[q]));
            csv.write_record(values.map(field))?;
        }
        csv.flush()
    }
}
