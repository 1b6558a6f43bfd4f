//! The tables of a run as CSV: `history.csv` and `steps.csv`, which grow row by row while it works, `contacts.csv` with a row for each pair, and
//! a table of the contact points of each pair.

use super::field;
use super::folder::{Folder, failed};
use super::report::{PairReport, StepReport};
use crate::ddm::{Observer, Row};
use crate::error::Result;
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;

/// A CSV file to which every row is written at once, so that a killed run keeps all that it had computed. After a row that cannot be written, as on
/// a full disk, no more are.
pub struct RowFile {
    path: PathBuf,
    csv: csv::Writer<File>,
    written: std::result::Result<(), csv::Error>,
}

impl RowFile {
    /// Open a file with its header. It replaces a file of this name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(folder: &Folder, name: &str, header: &[String]) -> Result<Self> {
        let csv = csv::Writer::from_writer(folder.open(name)?);
        let mut rows = Self { path: folder.path().join(name), csv, written: Ok(()) };
        rows.push(header);
        Ok(rows)
    }

    /// Append a row.
    pub fn push(&mut self, fields: &[String]) {
        if self.written.is_ok() {
            self.written = self.csv.write_record(fields).and_then(|()| Ok(self.csv.flush()?));
        }
    }

    /// End the file.
    ///
    /// # Errors
    /// The first failure to write.
    pub fn finish(self) -> Result<()> {
        self.written.map_err(|cause| failed(&self.path, &cause.into()))
    }
}

/// An observer that writes one line of `history.csv` for each row.
pub struct HistoryWriter {
    /// The file.
    pub rows: RowFile,
    bodies: usize,
    /// Whether rows have the column of load steps.
    steps: bool,
}

impl HistoryWriter {
    /// Open `history.csv` and write its header; `bodies` are the names in the order of [`Row::increments`]. With `steps`, each
    /// row begins with its load step.
    pub fn create<S: AsRef<str>>(folder: &Folder, bodies: &[S], steps: bool) -> Result<Self> {
        let mut header: Vec<String> = if steps { vec!["step".into()] } else { Vec::new() };
        header.extend(["iteration", "residual", "error", "increment"].map(String::from));
        header.extend(bodies.iter().map(|body| format!("increment_{}", body.as_ref())));
        let last = "gamma energy closed points sweeps factorizations inner_iterations smoothed seconds";
        header.extend(last.split_whitespace().map(String::from));
        Ok(Self { rows: RowFile::create(folder, "history.csv", &header)?, bodies: bodies.len(), steps })
    }
}

impl Observer for HistoryWriter {
    fn row(&mut self, row: &Row) {
        let mut fields = if self.steps { vec![row.step.to_string()] } else { Vec::new() };
        fields.push(row.iteration.to_string());
        fields.extend([row.residual, row.error, row.increment].map(field));
        // row 0 may have no increments
        fields.extend((0..self.bodies).map(|body| row.increments.get(body).map_or(String::new(), |&v| field(v))));
        fields.extend([field(row.gamma), field(row.energy)]);
        fields.extend(
            [row.closed, row.points, row.sweeps, row.factorizations, row.inner_iterations, row.smoothed]
                .map(|count| count.to_string()),
        );
        fields.push(field(row.seconds));
        self.rows.push(&fields);
    }
}

/// Return the name of the column of the contact size, from the measure of the pairs.
pub fn contact_column(measure: &str) -> String {
    format!("contact_{measure}")
}

/// Return the column names `what_x name` and so on of a vector, one per dimension of the scene.
pub fn vector_columns(what: &str, name: &str, dimension: usize) -> Vec<String> {
    ["x", "y", "z"][..dimension].iter().map(|axis| format!("{what}_{axis} {name}")).collect()
}

/// Return the fields of a vector in the columns of [`vector_columns`].
pub fn vector_fields(vector: &[f64; 3], dimension: usize) -> impl Iterator<Item = String> {
    vector[..dimension].iter().map(|&value| field(value))
}

/// The columns that the table of load steps has for a pair beside those of all pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairColumns {
    /// No others.
    None,
    /// Turn and moment of an obstacle: about z in the plane, in space their components.
    Obstacle,
    /// The offset of the gap.
    Offset,
}

impl PairColumns {
    fn names(self, dimension: usize) -> impl Iterator<Item = &'static str> {
        let names: &[&str] = match self {
            Self::None => &[],
            Self::Obstacle if dimension == 2 => &["tilt_z", "moment_z"],
            Self::Obstacle => &["tilt_x", "tilt_y", "tilt_z", "moment_x", "moment_y", "moment_z"],
            Self::Offset => &["offset"],
        };
        names.iter().copied()
    }
}

/// The table `steps.csv`, one line per load step.
pub struct StepTable {
    /// The file.
    pub rows: RowFile,
    dimension: usize,
    count: usize,
}

impl StepTable {
    /// Open `steps.csv` and write its header from the names of `factors`, `pairs` and `reactions`, each of which occurs once. The
    /// `measure` is that of the pairs.
    pub fn create(
        folder: &Folder,
        factors: &[String],
        pairs: &[(String, PairColumns)],
        reactions: &[String],
        dimension: usize,
        measure: &str,
    ) -> Result<Self> {
        let mut header = vec!["step".to_owned(), "time".to_owned()];
        header.extend_from_slice(factors);
        header.extend(["status", "iterations", "residual"].map(str::to_owned));
        for (pair, columns) in pairs {
            header.extend(vector_columns("force", pair, dimension));
            let numbers = ["approach", &contact_column(measure), "peak_pressure", "closed"];
            header.extend(numbers.map(|what| format!("{what} {pair}")));
            header.extend(columns.names(dimension).map(|what| format!("{what} {pair}")));
        }
        header.extend(reactions.iter().flat_map(|name| vector_columns("reaction", name, dimension)));
        Ok(Self { rows: RowFile::create(folder, "steps.csv", &header)?, dimension, count: 0 })
    }

    /// Write a step; `names` are those of its factors in the order of the header.
    pub fn row(&mut self, names: &[String], step: &StepReport) {
        self.count += 1;
        let number = |value: Option<f64>| value.map_or(String::new(), field);
        let mut line = vec![self.count.to_string(), field(step.time)];
        line.extend(names.iter().map(|name| number(step.factors.get(name).copied())));
        line.extend([step.status.clone(), step.iterations.to_string(), number(step.residual)]);
        for pair in &step.pairs {
            line.extend(vector_fields(&pair.force, self.dimension));
            line.extend([number(pair.approach), field(pair.extent.contact()), field(pair.peak_pressure)]);
            line.push(pair.closed.to_string());
            if let Some(obstacle) = &pair.obstacle {
                let about = if self.dimension == 2 { 2..3 } else { 0..3 };
                line.extend(
                    [obstacle.tilt, obstacle.moment].iter().flat_map(|v| v[about.clone()].iter().map(|&c| field(c))),
                );
            }
            line.extend(pair.offset.map(field));
        }
        line.extend(step.reactions.iter().flat_map(|reaction| vector_fields(&reaction.force, self.dimension)));
        self.rows.push(&line);
    }
}

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
fn fields(pair: &PairReport, row: &PairRow) -> [(&'static str, String); 31] {
    let [force, _] = pair.force;
    let number = |value: Option<f64>| value.map_or(String::new(), field);
    let turn = |c: usize| number(pair.obstacle.as_ref().map(|obstacle| obstacle.tilt[c]));
    let moment = |c: usize| number(pair.obstacle.as_ref().map(|obstacle| obstacle.moment[c]));
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
        ("approach", number(pair.approach)),
        ("tilt_x", turn(0)),
        ("tilt_y", turn(1)),
        ("tilt_z", turn(2)),
        ("moment_x", moment(0)),
        ("moment_y", moment(1)),
        ("moment_z", moment(2)),
        ("offset", number(pair.offset)),
        ("table", row.table.clone()),
        ("plot", row.plot.clone()),
    ]
}

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
    /// Number of the smooth face of the surface with the points; empty if all points are on one.
    pub face: Vec<f64>,
}

impl ContactTable {
    /// Write the table as CSV, one row per contact point, with numbers to full precision.
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
        let optional: [(&str, &[f64]); 2] = [("pressure_error", &self.pressure_error), ("face", &self.face)];
        columns.extend(optional.into_iter().filter(|(_, values)| !values.is_empty()));
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(["x", "y", "z"].into_iter().chain(columns.iter().map(|(name, _)| *name)))?;
        for (q, point) in self.points.iter().enumerate() {
            let values = point.iter().copied().chain(columns.iter().map(|(_, values)| values[q]));
            csv.write_record(values.map(field))?;
        }
        csv.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Extent, ObstacleReport};

    #[test]
    fn rows_are_in_the_file_before_the_end() {
        let base = tempfile::tempdir().unwrap();
        let folder = Folder::create(base.path()).unwrap();
        let mut history = HistoryWriter::create(&folder, &["upper", "lower"], true).unwrap();
        let first =
            Row { residual: 1.0, error: f64::NAN, increment: f64::NAN, gamma: f64::NAN, points: 9, ..Row::default() };
        history.row(&first);
        history.row(&Row { step: 2, iteration: 1, increments: vec![0.5, 1.0 / 3.0], seconds: 1.5, ..Row::default() });
        let text = std::fs::read_to_string(base.path().join("history.csv")).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].starts_with("step,iteration,residual,error,increment,increment_upper,increment_lower,gamma,"));
        assert_eq!(lines[1], "0,0,1.0,,,,,,0.0,0,9,0,0,0,0,0.0");
        assert_eq!(lines[2], "2,1,0.0,0.0,0.0,0.5,0.3333333333333333,0.0,0.0,0,0,0,0,0,0,1.5");
        history.rows.finish().unwrap();
    }

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
            approach: Some(11.0),
            obstacle: Some(ObstacleReport {
                tilt: [0.1, 0.2, 0.3],
                moment: [4.0, 5.0, 6.0],
                ..ObstacleReport::default()
            }),
            ..PairReport::default()
        };
        let mut out = Vec::new();
        let row = PairRow { table: "contact-up-low.csv".into(), ..row };
        write(&mut out, &[pair], &[row]).unwrap();
        let text = String::from_utf8(out).unwrap();
        let (header, line) = text.trim().split_once('\n').unwrap();
        assert_eq!(header.split(',').count(), 31);
        assert_eq!(
            line,
            "up,low,up_bottom,low_top,2,1,1.0,2.0,3.0,4.0,5.0,6.0,7.0,8.0,9.0,-0.75,-0.5,0.25,0.5,2.0,10.0,11.0,0.1,0.2,0.3,4.0,5.0,6.0,,contact-up-low.csv,"
        );
    }
}
