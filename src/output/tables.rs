//! The tables of a run as CSV: `history.csv` and `steps.csv`, which grow row by row while it works, `contacts.csv` with
//! a row for each pair, and a table of the contact points of each pair.

use super::field;
use super::folder::{Folder, failed};
use super::report::{Extent, PairReport, ReactionReport, StepReport, TensionReport};
use crate::ddm::{Observer, Row};
use crate::error::Result;
use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::PathBuf;

/// A field of a table: the name of its column and its text.
pub type Cell = (String, String);

/// Return the field of a number, which may be missing.
pub fn number(column: impl Into<String>, value: impl Into<Option<f64>>) -> Cell {
    (column.into(), value.into().map_or(String::new(), field))
}

/// Return the field of a count.
fn count(column: impl Into<String>, value: usize) -> Cell {
    (column.into(), value.to_string())
}

/// Return the fields `what_x name` and so on of a vector, one per dimension of the scene.
pub fn vector(what: &str, name: &str, vector: &[f64; 3], dimension: usize) -> impl Iterator<Item = Cell> {
    ["x", "y", "z"]
        .into_iter()
        .zip(vector)
        .take(dimension)
        .map(move |(axis, &v)| number(format!("{what}_{axis} {name}"), v))
}

/// A CSV file to which every row is written at once, so that a killed run keeps all that it had computed. The first row
/// brings the header. After a row that cannot be written, as on a full disk, no more are.
pub struct RowFile {
    path: PathBuf,
    csv: csv::Writer<File>,
    /// Names of the columns; empty before the header.
    columns: Vec<String>,
    written: std::result::Result<(), csv::Error>,
}

impl RowFile {
    /// Open a file. It replaces a file of this name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(folder: &Folder, name: &str) -> Result<Self> {
        let csv = csv::Writer::from_writer(folder.open(name)?);
        Ok(Self { path: folder.path().join(name), csv, columns: Vec::new(), written: Ok(()) })
    }

    /// Write the header, which is that of this row.
    pub fn begin(&mut self, row: &[Cell]) {
        self.columns = row.iter().map(|(column, _)| column.clone()).collect();
        // the header takes the place of the mark of a file without rows
        let mut file = self.csv.get_ref();
        self.written = file.set_len(0).and_then(|()| file.rewind()).map_err(csv::Error::from);
        self.record(&self.columns.clone());
    }

    /// Append a row.
    pub fn push(&mut self, row: &[Cell]) {
        if self.columns.is_empty() {
            self.begin(row);
        }
        self.record(&row.iter().map(|(_, text)| text.clone()).collect::<Vec<_>>());
    }

    fn record(&mut self, texts: &[String]) {
        if self.written.is_ok() {
            self.written = self.csv.write_record(texts).and_then(|()| Ok(self.csv.flush()?));
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
    /// Fields with which each line begins; the same columns in all lines.
    pub first: Vec<Cell>,
    /// Names of the bodies in the order of [`Row::increments`].
    bodies: Vec<String>,
    /// Whether rows begin with their load step.
    steps: bool,
}

impl HistoryWriter {
    /// Begin the file, which has its header whether or not there is an iterate. Lines begin with the fields `first`.
    pub fn new(rows: RowFile, first: Vec<Cell>, bodies: Vec<String>, steps: bool) -> Self {
        let mut history = Self { rows, first, bodies, steps };
        history.rows.begin(&history.fields(&Row::default()));
        history
    }

    fn fields(&self, row: &Row) -> Vec<Cell> {
        let mut fields = self.first.clone();
        fields.extend(self.steps.then(|| count("step", row.step)));
        fields.push(count("iteration", row.iteration));
        let sizes = [("residual", row.residual), ("error", row.error), ("increment", row.increment)];
        fields.extend(sizes.map(|(name, size)| number(name, size)));
        // row 0 may have no increments
        let increment =
            |(k, body): (usize, &String)| number(format!("increment_{body}"), row.increments.get(k).copied());
        fields.extend(self.bodies.iter().enumerate().map(increment));
        fields.extend([number("gamma", row.gamma), number("energy", row.energy)]);
        let counts = [
            ("closed", row.closed),
            ("points", row.points),
            ("sweeps", row.sweeps),
            ("factorizations", row.factorizations),
            ("inner_iterations", row.inner_iterations),
            ("smoothed", row.smoothed),
        ];
        fields.extend(counts.map(|(name, value)| count(name, value)));
        fields.push(number("seconds", row.seconds));
        fields
    }
}

impl Observer for HistoryWriter {
    fn row(&mut self, row: &Row) {
        self.rows.push(&self.fields(row));
    }
}

/// The table `steps.csv`, one line per load step.
pub struct StepTable {
    /// The file.
    pub rows: RowFile,
    /// Number of steps so far.
    pub count: usize,
    /// Names of the factors of loads.
    pub factors: Vec<String>,
    /// Names of the pairs and of the reactions, each of which occurs once.
    pub names: ResultNames,
}

/// The names of pairs and reactions in the columns of tables.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultNames {
    /// Names of the pairs.
    pub pairs: Vec<String>,
    /// Names of the reactions.
    pub reactions: Vec<String>,
    /// Dimension of the scene.
    pub dimension: usize,
    /// What measures the size of contacts: `length` or `area`.
    pub measure: &'static str,
}

impl ResultNames {
    /// Return the field of the size of a contact.
    pub fn contact(&self, pair: &str, extent: &Extent) -> Cell {
        number(format!("contact_{} {pair}", self.measure), extent.contact())
    }

    /// Return the fields of all reactions.
    pub fn reactions(&self, reactions: &[ReactionReport]) -> impl Iterator<Item = Cell> {
        let named = self.reactions.iter().zip(reactions);
        named.flat_map(|(name, reaction)| vector("reaction", name, &reaction.force, self.dimension))
    }
}

/// Return the fields of the largest pressure of a pair and, of a bond, the largest tension with its place.
pub fn peaks(name: &str, pressure: f64, tension: Option<TensionReport>) -> Vec<Cell> {
    let mut fields = vec![number(format!("peak_pressure {name}"), pressure)];
    if let Some(TensionReport { peak_tension, peak_tension_at, .. }) = tension {
        fields.push(number(format!("peak_tension {name}"), peak_tension));
        fields.extend(vector("tension", name, &peak_tension_at, 3));
    }
    fields
}

impl StepTable {
    /// Write a step.
    pub fn row(&mut self, step: &StepReport) {
        self.count += 1;
        let dimension = self.names.dimension;
        let mut line = vec![count("step", self.count), number("time", step.time)];
        line.extend(self.factors.iter().map(|name| number(name, step.factors.get(name).copied())));
        line.push(("status".to_owned(), step.status.to_string()));
        line.extend([count("iterations", step.iterations), number("residual", step.residual)]);
        for (pair, name) in step.pairs.iter().zip(&self.names.pairs) {
            line.extend(vector("force", name, &pair.force, dimension));
            line.push(number(format!("approach {name}"), pair.approach));
            line.push(self.names.contact(name, &pair.extent));
            line.push(number(format!("normal_force {name}"), pair.normal_force));
            line.push(number(format!("mean_pressure {name}"), pair.mean_pressure));
            line.extend(peaks(name, pair.peak_pressure, pair.tension));
            line.push(count(format!("closed {name}"), pair.closed));
            if let Some(obstacle) = &pair.obstacle {
                // about z in the plane
                let others = if dimension == 2 { 2 } else { 0 };
                for (what, v) in [("tilt", obstacle.tilt), ("moment", obstacle.moment)] {
                    line.extend(vector(what, name, &v, 3).skip(others));
                }
            }
            line.extend(pair.offset.map(|offset| number(format!("offset {name}"), offset)));
        }
        line.extend(self.names.reactions(&step.reactions));
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
    /// Distance of the surfaces after deformation, -c where that is positive: mean over the area of all points, and
    /// largest.
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

/// Return the fields of a pair in `contacts.csv`.
fn pair_fields(pair: &PairReport, row: &PairRow) -> Vec<Cell> {
    let text = |column: &str, text: &str| (column.to_owned(), text.to_owned());
    let three = |columns: [&str; 3], values: [f64; 3]| [0, 1, 2].map(|k| number(columns[k], values[k]));
    // others than obstacles do not turn
    let (tilt, moment) =
        pair.obstacle.as_ref().map_or(([f64::NAN; 3], [f64::NAN; 3]), |found| (found.tilt, found.moment));
    let mut fields = vec![
        text("a", &pair.bodies[0]),
        text("b", &pair.bodies[1]),
        text("surface_a", &pair.surfaces[0]),
        text("surface_b", &pair.surfaces[1]),
        count("points", pair.points),
        count("closed", row.closed),
    ];
    fields.extend(three(["force_x", "force_y", "force_z"], pair.force[0]));
    fields.extend([number("normal_force", pair.normal_force), number("mean_pressure", pair.mean_pressure)]);
    fields.push(number("peak_pressure", pair.peak_pressure));
    fields.extend(three(["peak_x", "peak_y", "peak_z"], pair.peak_at));
    fields.push(number("peak_tension", pair.tension.map(|tension| tension.peak_tension)));
    let pulled_at = pair.tension.map_or([f64::NAN; 3], |tension| tension.peak_tension_at);
    fields.extend(three(["tension_x", "tension_y", "tension_z"], pulled_at));
    fields.extend([number("contact", pair.extent.contact()), number("open", pair.extent.open())]);
    fields.extend(three(["gap_least", "gap_mean", "gap_largest"], row.gap));
    fields.extend([number("opening_mean", row.opening[0]), number("opening_largest", row.opening[1])]);
    fields.extend([number("energy", pair.layer_energy), number("approach", pair.approach)]);
    fields.extend(three(["tilt_x", "tilt_y", "tilt_z"], tilt));
    fields.extend(three(["moment_x", "moment_y", "moment_z"], moment));
    fields.extend([number("offset", pair.offset), text("table", &row.table), text("plot", &row.plot)]);
    fields
}

/// Write the pairs to `contacts.csv`, in the order of the scene.
pub fn save(folder: &Folder, pairs: &[PairReport], rows: &[PairRow]) -> Result<()> {
    let header = pair_fields(&PairReport::default(), &PairRow::default());
    folder.write("contacts.csv", |out| {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(header.iter().map(|(column, _)| column))?;
        for (pair, row) in pairs.iter().zip(rows) {
            csv.write_record(pair_fields(pair, row).iter().map(|(_, text)| text))?;
        }
        csv.flush()
    })
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
        let rows = RowFile::create(&folder, "history.csv").unwrap();
        let mut history = HistoryWriter::new(rows, Vec::new(), ["upper", "lower"].map(str::to_owned).to_vec(), true);
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
            normal_force: 3.5,
            mean_pressure: 0.5,
            peak_pressure: 4.0,
            peak_at: [5.0, 6.0, 7.0],
            tension: Some(TensionReport { peak_tension: 7.5, peak_tension_at: [0.0, 1.0, 2.0], peak_stretch: 0.1 }),
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
        let row = PairRow { table: "contact-up-low.csv".into(), ..row };
        let base = tempfile::tempdir().unwrap();
        save(&Folder::create(base.path()).unwrap(), &[pair], &[row]).unwrap();
        let text = std::fs::read_to_string(base.path().join("contacts.csv")).unwrap();
        let (header, line) = text.trim().split_once('\n').unwrap();
        assert_eq!(header.split(',').count(), 37);
        assert_eq!(
            line,
            "up,low,up_bottom,low_top,2,1,1.0,2.0,3.0,3.5,0.5,4.0,5.0,6.0,7.0,7.5,0.0,1.0,2.0,8.0,9.0,-0.75,-0.5,0.25,0.5,2.0,10.0,11.0,0.1,0.2,0.3,4.0,5.0,6.0,,contact-up-low.csv,"
        );
    }
}
