//! The tables of a run as CSV: `history.csv` and `steps.csv`, which grow row by row while it works, `contacts.csv` with
//! a row for each pair, and a table of the contact points of each pair.

use super::field;
use super::folder::{Folder, failed};
use super::report::{PairReport, PairResult, ReactionReport, SealReport, StepReport, TensionReport};
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
fn vector(what: &str, name: &str, vector: &[f64; 3], dimension: usize) -> impl Iterator<Item = Cell> {
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
}

impl ResultNames {
    /// Return the fields of a pair in the table of runs.
    pub fn of_run(&self, pair: &PairResult, name: &str) -> Vec<Cell> {
        let mut fields = pressures(pair, name);
        fields.push(contact(pair, name));
        fields.push(number(format!("layer_energy {name}"), pair.layer_energy));
        fields.extend(vector("force", name, &pair.force[0], self.dimension));
        fields.push(number(format!("approach {name}"), pair.approach));
        fields.extend(sealing(pair, name));
        fields
    }

    /// Return the fields of a pair in the table of load steps.
    fn of_step(&self, pair: &PairResult, name: &str) -> Vec<Cell> {
        let mut fields: Vec<Cell> = vector("force", name, &pair.force[0], self.dimension).collect();
        fields.push(number(format!("approach {name}"), pair.approach));
        fields.push(contact(pair, name));
        fields.extend(pressures(pair, name));
        fields.push(count(format!("closed {name}"), pair.closed));
        if let Some(obstacle) = &pair.obstacle {
            // about z in the plane
            let others = if self.dimension == 2 { 2 } else { 0 };
            for (what, v) in [("tilt", obstacle.tilt), ("moment", obstacle.moment)] {
                fields.extend(vector(what, name, &v, 3).skip(others));
            }
        }
        fields.extend(pair.offset.map(|offset| number(format!("offset {name}"), offset)));
        fields.extend(sealing(pair, name));
        fields
    }

    /// Return the fields of all reactions.
    pub fn reactions(&self, reactions: &[ReactionReport]) -> impl Iterator<Item = Cell> {
        let named = self.reactions.iter().zip(reactions);
        named.flat_map(|(name, reaction)| vector("reaction", name, &reaction.force, self.dimension))
    }
}

/// Return the field of the size of a contact.
fn contact(pair: &PairResult, name: &str) -> Cell {
    let what = if pair.extent.is_area() { "contact_area" } else { "contact_length" };
    number(format!("{what} {name}"), pair.extent.contact())
}

/// Return the fields of the pressures of a pair and, of a bond, of the largest tension with its place.
fn pressures(pair: &PairResult, name: &str) -> Vec<Cell> {
    let PairResult { normal_force, mean_pressure, peak_pressure, tension, .. } = *pair;
    let pressures =
        [("normal_force", normal_force), ("mean_pressure", mean_pressure), ("peak_pressure", peak_pressure)];
    let mut fields = pressures.map(|(what, value)| number(format!("{what} {name}"), value)).to_vec();
    if let Some(TensionReport { peak_tension, peak_tension_at, .. }) = tension {
        fields.push(number(format!("peak_tension {name}"), peak_tension));
        fields.extend(vector("tension", name, &peak_tension_at, 3));
    }
    fields
}

/// Return the fields of the least pressure of a pair, and of what its seal holds and where, if it has one.
fn sealing(pair: &PairResult, name: &str) -> Vec<Cell> {
    let mut fields = vec![number(format!("least_pressure {name}"), pair.least_pressure)];
    if let Some(SealReport { sealing_pressure, sealing_at }) = pair.seal {
        fields.push(number(format!("sealing_pressure {name}"), sealing_pressure));
        fields.extend(vector("sealing", name, &sealing_at, 3));
    }
    fields
}

impl StepTable {
    /// Write a step.
    pub fn row(&mut self, step: &StepReport) {
        self.count += 1;
        let mut line = vec![count("step", self.count), number("time", step.time)];
        line.extend(self.factors.iter().map(|name| number(name, step.factors.get(name).copied())));
        line.push(("status".to_owned(), step.status.to_string()));
        line.extend([count("iterations", step.iterations), number("residual", step.residual)]);
        let pairs = step.pairs.iter().zip(&self.names.pairs);
        line.extend(pairs.flat_map(|(pair, name)| self.names.of_step(pair, name)));
        line.extend(self.names.reactions(&step.reactions));
        self.rows.push(&line);
    }
}

/// Return the fields of a pair in `contacts.csv`.
fn pair_fields(pair: &PairReport) -> Vec<Cell> {
    let text = |column: &str, text: &str| (column.to_owned(), text.to_owned());
    let file = |column: &str, file: &Option<String>| text(column, file.as_deref().unwrap_or_default());
    let three = |columns: [&str; 3], values: [f64; 3]| [0, 1, 2].map(|k| number(columns[k], values[k]));
    let PairReport { result, estimate, .. } = pair;
    // others than obstacles do not turn
    let (tilt, moment) =
        result.obstacle.as_ref().map_or(([f64::NAN; 3], [f64::NAN; 3]), |found| (found.tilt, found.moment));
    let mut fields = vec![
        text("a", &pair.bodies[0]),
        text("b", &pair.bodies[1]),
        text("surface_a", &pair.surfaces[0]),
        text("surface_b", &pair.surfaces[1]),
        count("points", pair.points),
        count("closed", result.closed),
    ];
    fields.extend(three(["force_x", "force_y", "force_z"], result.force[0]));
    fields.extend([number("normal_force", result.normal_force), number("mean_pressure", result.mean_pressure)]);
    fields.push(number("peak_pressure", result.peak_pressure));
    fields.extend(three(["peak_x", "peak_y", "peak_z"], result.peak_at));
    fields.push(number("peak_tension", result.tension.map(|tension| tension.peak_tension)));
    let pulled_at = result.tension.map_or([f64::NAN; 3], |tension| tension.peak_tension_at);
    fields.extend(three(["tension_x", "tension_y", "tension_z"], pulled_at));
    fields.extend([number("contact", result.extent.contact()), number("open", result.extent.open())]);
    fields.extend(three(["gap_least", "gap_mean", "gap_largest"], result.gap));
    fields.extend([number("opening_mean", result.opening[0]), number("opening_largest", result.opening[1])]);
    fields.extend([number("energy", result.layer_energy), number("approach", result.approach)]);
    fields.extend(three(["tilt_x", "tilt_y", "tilt_z"], tilt));
    fields.extend(three(["moment_x", "moment_y", "moment_z"], moment));
    fields.extend([number("offset", result.offset), file("table", &pair.table), file("plot", &pair.plot)]);
    fields.push(number("least_pressure", result.least_pressure));
    fields.push(number("pressure_estimate", estimate.map(|errors| errors.pressure_estimate)));
    fields.push(number("force_estimate", estimate.map(|errors| errors.force_estimate)));
    fields.push(number("sealing_pressure", result.seal.map(|seal| seal.sealing_pressure)));
    let weakest = result.seal.map_or([f64::NAN; 3], |seal| seal.sealing_at);
    fields.extend(three(["sealing_x", "sealing_y", "sealing_z"], weakest));
    fields
}

/// Write the pairs to `contacts.csv`, in the order of the scene.
pub fn save(folder: &Folder, pairs: &[PairReport]) -> Result<()> {
    let header = pair_fields(&PairReport::default());
    folder.write("contacts.csv", |out| {
        let mut csv = csv::Writer::from_writer(out);
        csv.write_record(header.iter().map(|(column, _)| column))?;
        for pair in pairs {
            csv.write_record(pair_fields(pair).iter().map(|(_, text)| text))?;
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
    /// Largest compression in all load steps; empty unless the layer remembers it.
    pub compression_max: Vec<f64>,
    /// Contact pressure p(c), >= 0.
    pub pressure: Vec<f64>,
    /// Averaged normal displacement of side a and of side b, each along its own outer normal.
    pub displacement: [Vec<f64>; 2],
    /// Estimated error of the pressure, exact minus discrete; empty unless an estimate was requested.
    pub pressure_error: Vec<f64>,
    /// Number of the smooth face of the surface with the points; empty if all points are on one.
    pub face: Vec<f64>,
    /// Whether the pair is the shear of a bond: its compression is a slip, its pressure a traction along the surface.
    pub is_slip: bool,
}

/// The columns of the compression and the pressure.
const QUANTITIES: [&str; 2] = ["compression", "pressure"];

impl ContactTable {
    /// Write the table as CSV, one row per contact point, with numbers to full precision.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let (along, [closing, force]) = if self.is_slip { ("u_t", ["slip", "traction"]) } else { ("u_n", QUANTITIES) };
        let [name_a, name_b] = self.side_names.each_ref().map(|side| format!("{along}_{side}"));
        let mut columns: Vec<(&str, &[f64])> = vec![
            ("weight", &self.weight),
            ("gap", &self.gap),
            (closing, &self.compression),
            (force, &self.pressure),
            (&name_a, &self.displacement[0]),
            (&name_b, &self.displacement[1]),
        ];
        let optional: [(&str, &[f64]); 3] = [
            ("compression_max", &self.compression_max),
            ("pressure_error", &self.pressure_error),
            ("face", &self.face),
        ];
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
    use crate::output::{Extent, ObstacleReport, PairEstimate};

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
    fn a_row_stands_under_its_columns() {
        let result = PairResult {
            closed: 1,
            force: [[1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]],
            normal_force: 3.5,
            least_pressure: 0.25,
            mean_pressure: 0.5,
            peak_pressure: 4.0,
            peak_at: [5.0, 6.0, 7.0],
            tension: Some(TensionReport { peak_tension: 7.5, peak_tension_at: [0.0, 1.0, 2.0], peak_stretch: 0.1 }),
            extent: Extent::Area { contact_area: 8.0, open_area: 9.0 },
            gap: [-0.75, -0.5, 0.25],
            opening: [0.5, 2.0],
            layer_energy: 10.0,
            approach: Some(11.0),
            seal: Some(SealReport { sealing_pressure: 1.5, sealing_at: [3.0, 2.0, 1.0] }),
            obstacle: Some(ObstacleReport {
                tilt: [0.1, 0.2, 0.3],
                moment: [4.0, 5.0, 6.0],
                ..ObstacleReport::default()
            }),
            ..PairResult::default()
        };
        let pair = PairReport {
            bodies: ["up", "low"].map(str::to_owned),
            surfaces: ["up_bottom", "low_top"].map(str::to_owned),
            points: 2,
            result,
            estimate: Some(PairEstimate { pressure_estimate: 0.125, force_estimate: 1e-3 }),
            table: Some("contact-up-low.csv".into()),
            ..PairReport::default()
        };
        let base = tempfile::tempdir().unwrap();
        save(&Folder::create(base.path()).unwrap(), &[pair]).unwrap();
        let text = std::fs::read_to_string(base.path().join("contacts.csv")).unwrap();
        let (header, line) = text.trim().split_once('\n').unwrap();
        assert_eq!(header.split(',').count(), 44);
        assert_eq!(
            line,
            "up,low,up_bottom,low_top,2,1,1.0,2.0,3.0,3.5,0.5,4.0,5.0,6.0,7.0,7.5,0.0,1.0,2.0,8.0,9.0,-0.75,-0.5,0.25,0.5,2.0,10.0,11.0,0.1,0.2,0.3,4.0,5.0,6.0,,contact-up-low.csv,,0.25,0.125,0.001,1.5,3.0,2.0,1.0"
        );
    }
}
