//! `contacts.csv`: one row per pair of contact surfaces.

use super::folder::Folder;
use super::format::field;
use super::report::PairReport;
use crate::error::Result;
use std::io::{self, Write};

/// The columns of `contacts.csv` that the report of a pair does not have.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairRow {
    /// Number of points with c > 0.
    pub closed: usize,
    /// Initial gap d at the points: least, mean over the area, largest.
    pub gap: [f64; 3],
    /// Distance of the surfaces after deformation, -c where that is positive: mean over the area of all points, and largest.
    pub opening: [f64; 2],
    /// File of its contact table; empty if it has none.
    pub table: String,
    /// File of its plot; empty if it has none.
    pub plot: String,
}

impl PairRow {
    /// Return the row of a pair from the area `weight`, the gap d and the compression c of its points, without files.
    pub fn new(weight: &[f64], gap: &[f64], compression: &[f64]) -> Self {
        let opening: Vec<f64> = compression.iter().map(|c| (-c).max(0.0)).collect();
        let total: f64 = weight.iter().sum();
        let mean = |values: &[f64]| weight.iter().zip(values).map(|(w, v)| w * v).sum::<f64>() / total;
        let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
        let most = gap.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            closed: compression.iter().filter(|&&c| c > 0.0).count(),
            gap: [least, mean(gap), most],
            opening: [mean(&opening), opening.iter().copied().fold(0.0, f64::max)],
            ..Self::default()
        }
    }
}

/// Write the pairs to `contacts.csv`, in the order of the scene.
///
/// # Errors
/// [`Kind::File`](crate::error::Kind::File) when the file cannot be written.
pub fn save(folder: &Folder, pairs: &[PairReport], rows: &[PairRow]) -> Result<()> {
    folder.write("contacts.csv", |out| write(out, pairs, rows))
}

fn write(out: &mut dyn Write, pairs: &[PairReport], rows: &[PairRow]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(fields(&PairReport::default(), &PairRow::default()).map(|(column, _)| column))?;
    for (pair, row) in pairs.iter().zip(rows) {
        csv.write_record(fields(pair, row).map(|(_, text)| text))?;
    }
    csv.flush()
}

/// Return the names of the columns in their order, each with the value of a pair.
fn fields(pair: &PairReport, row: &PairRow) -> [(&'static str, String); 23] {
    let [force, _] = pair.force;
    [
        ("a", pair.bodies[0].clone()),
        ("b", pair.bodies[1].clone()),
        ("surface_a", pair.surfaces[0].clone()),
        ("surface_b", pair.surfaces[1].clone()),
        ("points", pair.points.to_string()),
        ("closed", row.closed.to_string()),
        ("force_x", field(force[0])),
        ("force_y", field(force[1])),
        ("force_z", field(force[2])),
        ("peak_pressure", field(pair.peak_pressure)),
        ("peak_x", field(pair.peak_at[0])),
        ("peak_y", field(pair.peak_at[1])),
        ("peak_z", field(pair.peak_at[2])),
        ("contact", field(pair.extent.contact())),
        ("open", field(pair.extent.open())),
        ("gap_least", field(row.gap[0])),
        ("gap_mean", field(row.gap[1])),
        ("gap_largest", field(row.gap[2])),
        ("opening_mean", field(row.opening[0])),
        ("opening_largest", field(row.opening[1])),
        ("energy", field(pair.layer_energy)),
        ("table", row.table.clone()),
        ("plot", row.plot.clone()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Extent;

    #[test]
    fn a_row_has_means_by_weight_and_stands_under_its_columns() {
        let row = PairRow::new(&[1.0, 3.0], &[0.25, -0.75], &[-2.0, 0.5]);
        assert_eq!((row.closed, row.gap, row.opening), (1, [-0.75, -0.5, 0.25], [0.5, 2.0]));
        let pair = PairReport {
            bodies: ["up", "low"].map(str::to_owned),
            surfaces: ["up_bottom", "low_top"].map(str::to_owned),
            points: 2,
            force: [[1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]],
            peak_pressure: 4.0,
            peak_at: [5.0, 6.0, 7.0],
            extent: Extent::Area { contact_area: 8.0, open_area: 9.0 },
            layer_energy: 10.0,
            ..PairReport::default()
        };
        let mut out = Vec::new();
        let row = PairRow { table: "contact-up-low.csv".into(), ..row };
        write(&mut out, &[pair], &[row]).unwrap();
        let text = String::from_utf8(out).unwrap();
        let (header, line) = text.trim().split_once('\n').unwrap();
        assert_eq!(header.split(',').count(), 23);
        assert_eq!(
            line,
            "up,low,up_bottom,low_top,2,1,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,9.0,-0.75,-0.5,0.25,0.5,2.0,10.0,contact-up-low.csv,"
        );
    }
}
