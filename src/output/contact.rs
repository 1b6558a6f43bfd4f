//! `contact-<a>-<b>.csv`: weight, gap, compression, pressure and normal displacements at the contact points of one pair.

use super::format::field;
use std::io::{self, Write};

/// The result on one pair of contact surfaces; all vectors have one entry per contact point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactTable {
    /// Names of the two sides: their bodies.
    pub side_names: [String; 2],
    /// Contact points, before deformation.
    pub points: Vec<[f64; 3]>,
    /// Weight omega of each point: the length or area that belongs to it.
    pub weight: Vec<f64>,
    /// Initial gap d.
    pub gap: Vec<f64>,
    /// Compression c of the layer; negative where the layer is open.
    pub compression: Vec<f64>,
    /// Contact pressure p(c), >= 0.
    pub pressure: Vec<f64>,
    /// Averaged normal displacement of side a and of side b, each along its own outer normal.
    pub displacement: [Vec<f64>; 2],
    /// Estimated error of the pressure, exact minus discrete; empty if it was not asked for.
    pub pressure_error: Vec<f64>,
}

impl ContactTable {
    /// Writes the table as CSV, points in their order, numbers to full precision.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let [of_a, of_b] = &self.displacement;
        let mut columns = vec![&self.weight, &self.gap, &self.compression, &self.pressure, of_a, of_b];
        let estimated = (!self.pressure_error.is_empty()).then_some("pressure_error");
        columns.extend(estimated.map(|_| &self.pressure_error));
        let mut csv = csv::Writer::from_writer(out);
        let sides = self.side_names.each_ref().map(|side| format!("u_n_{side}"));
        let names = ["x", "y", "z", "weight", "gap", "compression", "pressure"].into_iter();
        csv.write_record(names.chain(sides.iter().map(String::as_str)).chain(estimated))?;
        for (q, point) in self.points.iter().enumerate() {
            let values = point.iter().copied().chain(columns.iter().map(|column| column[q]));
            csv.write_record(values.map(field))?;
        }
        csv.flush()
    }
}
