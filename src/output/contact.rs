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

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ContactTable {
        ContactTable {
            side_names: ["upper bottom".into(), "lower".into()],
            points: vec![[1.0, 0.0, -0.5], [0.1 + 0.2, 0.0, 1e-20]],
            weight: vec![0.5, 1.0 / 7.0],
            gap: vec![0.0, 1.0 / 3.0],
            compression: vec![1e-7, -0.25],
            pressure: vec![2.0f64.sqrt(), 0.0],
            displacement: [vec![1e-300, 2.0], vec![-3.0, 1e22]],
            pressure_error: vec![0.1, -0.1],
        }
    }

    #[test]
    fn every_number_reads_back_in_its_column() {
        let table = table();
        let mut text = Vec::new();
        table.write(&mut text).unwrap();
        let mut csv = csv::Reader::from_reader(&text[..]);
        let header: Vec<_> = csv.headers().unwrap().iter().map(String::from).collect();
        let names = "x,y,z,weight,gap,compression,pressure,u_n_upper bottom,u_n_lower,pressure_error";
        assert_eq!(header.join(","), names);
        let rows: Vec<Vec<f64>> =
            csv.records().map(|row| row.unwrap().iter().map(|v| v.parse().unwrap()).collect()).collect();
        assert_eq!(rows.len(), 2);
        for (q, row) in rows.iter().enumerate() {
            let [x, y, z] = table.points[q];
            let [a, b] = &table.displacement;
            let expected = [
                x,
                y,
                z,
                table.weight[q],
                table.gap[q],
                table.compression[q],
                table.pressure[q],
                a[q],
                b[q],
                table.pressure_error[q],
            ];
            assert_eq!(row[..], expected);
        }
    }
}
